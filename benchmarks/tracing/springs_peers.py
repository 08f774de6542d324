"""A network of springs by hand, in njit, in three layouts.

Vectors do not pay here: what they save in roots and divisions goes into gathering and scattering.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from benchmarks.tracing.runner import Array, Runner, Start
from benchmarks.tracing.springs import LENGTH, STIFFNESS

BLOCK = 256


@njit(error_model="numpy")
def drift(m, x, v, hh):  # type: ignore[no-untyped-def]
    """Places in the middle of the step."""
    for i in range(x.size):
        m[i] = x[i] + hh * v[i]


@njit(error_model="numpy")
def kick(x, v, rx, rv, f, im, h):  # type: ignore[no-untyped-def]
    """The end of the step, of one component: compensated sums; the force is set to 0."""
    hh = 0.5 * h
    for i in range(x.size):
        a = f[i] * im[i]
        f[i] = 0.0
        p = x[i]
        u = v[i]
        d = h * (u + hh * a) + rx[i]
        t = p + d
        b = t - p
        rx[i] = (p - (t - b)) + (d - b)
        x[i] = t
        d = h * a + rv[i]
        t = u + d
        b = t - u
        rv[i] = (u - (t - b)) + (d - b)
        v[i] = t


@njit(error_model="numpy")
def scattered(X, Y, Z, U, V, W, RX, RY, RZ, RU, RV, RW, IM, FX, FY, FZ, MX, MY, MZ, A, B, steps, h, k, rest):  # type: ignore[no-untyped-def]
    """Spring after spring, an array a component; each adds to both its ends."""
    hh = 0.5 * h
    for _ in range(steps):
        drift(MX, X, U, hh)
        drift(MY, Y, V, hh)
        drift(MZ, Z, W, hh)
        for s in range(A.size):
            i = A[s]
            j = B[s]
            dx = MX[i] - MX[j]
            dy = MY[i] - MY[j]
            dz = MZ[i] - MZ[j]
            length = math.sqrt(dx * dx + dy * dy + dz * dz)
            w = -k * (length - rest) / length
            FX[i] += w * dx
            FY[i] += w * dy
            FZ[i] += w * dz
            FX[j] -= w * dx
            FY[j] -= w * dy
            FZ[j] -= w * dz
        kick(X, U, RX, RU, FX, IM, h)
        kick(Y, V, RY, RV, FY, IM, h)
        kick(Z, W, RZ, RW, FZ, IM, h)


@njit(error_model="numpy")
def by_body(X, Y, Z, U, V, W, RX, RY, RZ, RU, RV, RW, IM, FX, FY, FZ, MX, MY, MZ, first, B, steps, h, k, rest):  # type: ignore[no-untyped-def]
    """Springs sorted by their first end, whose sum stays in registers; the other end is added to."""
    hh = 0.5 * h
    for _ in range(steps):
        drift(MX, X, U, hh)
        drift(MY, Y, V, hh)
        drift(MZ, Z, W, hh)
        for i in range(X.size):
            x = MX[i]
            y = MY[i]
            z = MZ[i]
            fx = 0.0
            fy = 0.0
            fz = 0.0
            for s in range(first[i], first[i + 1]):
                j = B[s]
                dx = x - MX[j]
                dy = y - MY[j]
                dz = z - MZ[j]
                length = math.sqrt(dx * dx + dy * dy + dz * dz)
                w = -k * (length - rest) / length
                fx += w * dx
                fy += w * dy
                fz += w * dz
                FX[j] -= w * dx
                FY[j] -= w * dy
                FZ[j] -= w * dz
            FX[i] += fx
            FY[i] += fy
            FZ[i] += fz
        kick(X, U, RX, RU, FX, IM, h)
        kick(Y, V, RY, RV, FY, IM, h)
        kick(Z, W, RZ, RW, FZ, IM, h)


@njit(error_model="numpy")
def stretched(dx, dy, dz, k, rest):  # type: ignore[no-untyped-def]
    """Forces from differences of places, in vectors, in the same arrays."""
    for s in range(dx.size):
        length = math.sqrt(dx[s] * dx[s] + dy[s] * dy[s] + dz[s] * dz[s])
        w = -k * (length - rest) / length
        dx[s] = w * dx[s]
        dy[s] = w * dy[s]
        dz[s] = w * dz[s]


@njit(error_model="numpy")
def in_passes(  # type: ignore[no-untyped-def]
    X,
    Y,
    Z,
    U,
    V,
    W,
    RX,
    RY,
    RZ,
    RU,
    RV,
    RW,
    IM,
    FX,
    FY,
    FZ,
    MX,
    MY,
    MZ,
    A,
    B,
    SX,
    SY,
    SZ,
    steps,
    h,
    k,
    rest,
):
    """Some hundred springs at a time: first differences, then forces in vectors, then what each adds to its ends."""
    hh = 0.5 * h
    block = SX.size
    for _ in range(steps):
        drift(MX, X, U, hh)
        drift(MY, Y, V, hh)
        drift(MZ, Z, W, hh)
        for begin in range(0, A.size, block):
            count = min(block, A.size - begin)
            for s in range(count):
                i = A[begin + s]
                j = B[begin + s]
                SX[s] = MX[i] - MX[j]
                SY[s] = MY[i] - MY[j]
                SZ[s] = MZ[i] - MZ[j]
            stretched(SX[:count], SY[:count], SZ[:count], k, rest)
            for s in range(count):
                i = A[begin + s]
                j = B[begin + s]
                FX[i] += SX[s]
                FY[i] += SY[s]
                FZ[i] += SZ[s]
                FX[j] -= SX[s]
                FY[j] -= SY[s]
                FZ[j] -= SZ[s]
        kick(X, U, RX, RU, FX, IM, h)
        kick(Y, V, RY, RV, FY, IM, h)
        kick(Z, W, RZ, RW, FZ, IM, h)


def _columns(begin: Start) -> tuple[Array, Array, tuple[Any, ...]]:
    x, v = np.ascontiguousarray(begin.position.T), np.ascontiguousarray(begin.velocity.T)
    return x, v, (*x, *v, *np.zeros((6, begin.n)), 1.0 / begin.mass, *np.zeros((6, begin.n)))


def _ends(begin: Start) -> tuple[Array, Array]:
    """First and other end of each spring, sorted."""
    pairs = begin.more["pairs"]
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    return pairs[:, 0].astype(np.uint32), pairs[:, 1].astype(np.uint32)  # unsigned: nothing to wrap around


def scatter(begin: Start, dt: float) -> Runner:
    """njit, spring after spring."""
    x, v, columns = _columns(begin)
    ends = _ends(begin)
    return Runner(
        lambda steps: scattered(*columns, *ends, steps, dt, STIFFNESS, LENGTH), lambda: (x.T.copy(), v.T.copy())
    )


def rows(begin: Start, dt: float) -> Runner:
    """njit, springs by body."""
    x, v, columns = _columns(begin)
    a, b = _ends(begin)
    first = np.searchsorted(a, np.arange(begin.n + 1))
    return Runner(
        lambda steps: by_body(*columns, first, b, steps, dt, STIFFNESS, LENGTH), lambda: (x.T.copy(), v.T.copy())
    )


def passes(begin: Start, dt: float) -> Runner:
    """njit, in passes."""
    x, v, columns = _columns(begin)
    ends = _ends(begin)
    forces = np.zeros((3, BLOCK))
    return Runner(
        lambda steps: in_passes(*columns, *ends, *forces, steps, dt, STIFFNESS, LENGTH),
        lambda: (x.T.copy(), v.T.copy()),
    )


COMPILED = {"njit, spring after spring": scatter, "njit, springs by body": rows, "njit, in passes": passes}
