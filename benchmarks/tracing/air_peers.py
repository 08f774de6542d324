"""Gravity, quadratic drag and wind by hand: two fused njit loops, and NumPy."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from benchmarks.tracing.air import GRAVITY, WIND
from benchmarks.tracing.runner import Array, Runner, Start

LANES = 32
SLOTS = 17  # of a tile: position, velocity, their remainders, stored acceleration (3 each), 1/m, drag


@njit(error_model="numpy")
def tiled(s, steps, h, wx, wy, wz, tiles, last):  # type: ignore[no-untyped-def]
    """Tiles of 32 bodies, a component of all of them after the other; all steps of a tile, which stays in the nearest cache."""
    hh = 0.5 * h
    for tile in range(tiles):
        lanes = 32
        if tile == tiles - 1:
            lanes = last
        for _ in range(steps):
            for i in range(lanes):
                x = s[tile, 0, i]
                y = s[tile, 1, i]
                z = s[tile, 2, i]
                u = s[tile, 3, i]
                v = s[tile, 4, i]
                w = s[tile, 5, i]
                gx = s[tile, 12, i]
                gy = s[tile, 13, i]
                gz = s[tile, 14, i]
                im = s[tile, 15, i]
                c = s[tile, 16, i]
                q = c * math.sqrt(u * u + v * v + w * w)
                du = u - wx
                dv = v - wy
                dw = w - wz
                r = c * math.sqrt(du * du + dv * dv + dw * dw)
                um = u + hh * (gx - (q * u + r * du) * im)
                vm = v + hh * (gy - (q * v + r * dv) * im)
                wm = w + hh * (gz - (q * w + r * dw) * im)
                q = c * math.sqrt(um * um + vm * vm + wm * wm)
                du = um - wx
                dv = vm - wy
                dw = wm - wz
                r = c * math.sqrt(du * du + dv * dv + dw * dw)
                ax = gx - (q * um + r * du) * im
                ay = gy - (q * vm + r * dv) * im
                az = gz - (q * wm + r * dw) * im
                d = h * (u + hh * ax) + s[tile, 6, i]
                t = x + d
                b = t - x
                s[tile, 6, i] = (x - (t - b)) + (d - b)
                s[tile, 0, i] = t
                d = h * (v + hh * ay) + s[tile, 7, i]
                t = y + d
                b = t - y
                s[tile, 7, i] = (y - (t - b)) + (d - b)
                s[tile, 1, i] = t
                d = h * (w + hh * az) + s[tile, 8, i]
                t = z + d
                b = t - z
                s[tile, 8, i] = (z - (t - b)) + (d - b)
                s[tile, 2, i] = t
                d = h * ax + s[tile, 9, i]
                t = u + d
                b = t - u
                s[tile, 9, i] = (u - (t - b)) + (d - b)
                s[tile, 3, i] = t
                d = h * ay + s[tile, 10, i]
                t = v + d
                b = t - v
                s[tile, 10, i] = (v - (t - b)) + (d - b)
                s[tile, 4, i] = t
                d = h * az + s[tile, 11, i]
                t = w + d
                b = t - w
                s[tile, 11, i] = (w - (t - b)) + (d - b)
                s[tile, 5, i] = t


def tiles(begin: Start, dt: float) -> Runner:
    """njit, tiles; the last tile is filled up to a multiple of 8 with bodies on which nothing acts, so that no rest is left to scalars."""
    n = begin.n
    count = -(-n // LANES)
    s = np.zeros((count, SLOTS, LANES))

    def put(slot: int, values: Array) -> None:
        whole = np.zeros(count * LANES)
        whole[:n] = values
        s[:, slot] = whole.reshape(count, LANES)

    for k in range(3):
        put(k, begin.position[:, k])
        put(3 + k, begin.velocity[:, k])
    put(14, -GRAVITY)
    put(15, 1.0 / begin.mass)
    put(16, begin.more["drag"])
    last = min(LANES, (n - LANES * (count - 1) + 7) // 8 * 8)

    def read() -> tuple[Array, Array]:
        parts = s.transpose(1, 0, 2).reshape(SLOTS, -1)[:, :n]
        return parts[:3].T.copy(), parts[3:6].T.copy()

    return Runner(lambda steps: tiled(s, steps, dt, *WIND, count, last), read)


@njit(error_model="numpy")
def separate(X, Y, Z, U, V, W, RX, RY, RZ, RU, RV, RW, IM, C, steps, h, g, wx, wy, wz):  # type: ignore[no-untyped-def]
    """One array a component; gravity is a number, not an array."""
    hh = 0.5 * h
    for _ in range(steps):
        for i in range(X.size):
            u = U[i]
            v = V[i]
            w = W[i]
            im = IM[i]
            c = C[i]
            q = c * math.sqrt(u * u + v * v + w * w)
            du = u - wx
            dv = v - wy
            dw = w - wz
            r = c * math.sqrt(du * du + dv * dv + dw * dw)
            um = u - hh * ((q * u + r * du) * im)
            vm = v - hh * ((q * v + r * dv) * im)
            wm = w + hh * (g - (q * w + r * dw) * im)
            q = c * math.sqrt(um * um + vm * vm + wm * wm)
            du = um - wx
            dv = vm - wy
            dw = wm - wz
            r = c * math.sqrt(du * du + dv * dv + dw * dw)
            ax = -(q * um + r * du) * im
            ay = -(q * vm + r * dv) * im
            az = g - (q * wm + r * dw) * im
            x = X[i]
            d = h * (u + hh * ax) + RX[i]
            t = x + d
            b = t - x
            RX[i] = (x - (t - b)) + (d - b)
            X[i] = t
            x = Y[i]
            d = h * (v + hh * ay) + RY[i]
            t = x + d
            b = t - x
            RY[i] = (x - (t - b)) + (d - b)
            Y[i] = t
            x = Z[i]
            d = h * (w + hh * az) + RZ[i]
            t = x + d
            b = t - x
            RZ[i] = (x - (t - b)) + (d - b)
            Z[i] = t
            d = h * ax + RU[i]
            t = u + d
            b = t - u
            RU[i] = (u - (t - b)) + (d - b)
            U[i] = t
            d = h * ay + RV[i]
            t = v + d
            b = t - v
            RV[i] = (v - (t - b)) + (d - b)
            V[i] = t
            d = h * az + RW[i]
            t = w + d
            b = t - w
            RW[i] = (w - (t - b)) + (d - b)
            W[i] = t


def arrays(begin: Start, dt: float) -> Runner:
    """njit, an array a component."""
    x, v = np.ascontiguousarray(begin.position.T), np.ascontiguousarray(begin.velocity.T)
    rest = np.zeros((6, begin.n))
    own = (1.0 / begin.mass, begin.more["drag"].copy())
    columns: tuple[Any, ...] = (*x, *v, *rest, *own)
    return Runner(lambda steps: separate(*columns, steps, dt, -GRAVITY, *WIND), lambda: (x.T.copy(), v.T.copy()))


def in_numpy(begin: Start, dt: float) -> Runner:
    """NumPy, an array of shape (3, n) a quantity, every result into an array that is there already."""
    x, v = np.ascontiguousarray(begin.position.T), np.ascontiguousarray(begin.velocity.T)
    x_rest, v_rest, middle, a, b, t = (np.zeros_like(x) for _ in range(6))
    speed, part = np.empty(begin.n), np.empty(begin.n)
    wind, g = np.array(WIND)[:, None], np.array([[0.0], [0.0], [-GRAVITY]])
    inverse, drag = 1.0 / begin.mass, begin.more["drag"]

    def resisted(u: Array, out: Array) -> None:
        """Drag |u| u of each body, into ``out``; ``t`` is spoilt."""
        np.multiply(u, u, out=t)
        np.add(t[0], t[1], out=speed)
        np.add(speed, t[2], out=speed)
        np.sqrt(speed, out=speed)
        np.multiply(speed, drag, out=part)
        np.multiply(part, u, out=out)

    def accelerated(u: Array) -> None:
        """Acceleration at velocity ``u``, into ``a``; ``b`` is spoilt."""
        resisted(u, a)
        np.subtract(u, wind, out=b)
        resisted(b, b)
        np.add(a, b, out=a)
        np.multiply(a, inverse, out=a)
        np.subtract(g, a, out=a)

    def add(total: Array, rest: Array, step: Array) -> None:
        """``total += step``, with its remainder; ``step`` and ``t`` are spoilt."""
        np.add(step, rest, out=step)
        np.add(total, step, out=t)
        np.subtract(t, total, out=rest)  # b = t - total
        np.subtract(step, rest, out=step)
        np.subtract(t, rest, out=rest)
        np.subtract(total, rest, out=rest)
        np.add(rest, step, out=rest)
        np.copyto(total, t)

    def advance(steps: int) -> None:
        for _ in range(steps):
            accelerated(v)
            np.multiply(a, 0.5 * dt, out=middle)
            np.add(v, middle, out=middle)
            accelerated(middle)
            np.multiply(a, 0.5 * dt, out=middle)
            np.add(v, middle, out=middle)
            np.multiply(middle, dt, out=middle)
            add(x, x_rest, middle)
            np.multiply(a, dt, out=a)
            add(v, v_rest, a)

    return Runner(advance, lambda: (x.T.copy(), v.T.copy()))


COMPILED = {"njit, tiles": tiles, "njit, arrays": arrays}
NUMPY = {"NumPy": in_numpy}
