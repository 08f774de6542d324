"""A force of short reach by hand, in njit: cells at each step, and a sorted list of neighbours with a skin."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from benchmarks.tracing.cutoff import CUTOFF, DEPTH, SIZE, level, slope
from benchmarks.tracing.runner import Runner, Start

SKIN = 0.3
MOST = 96  # neighbours of a body, at most, to one side; asserted


@njit(error_model="numpy")
def middle(X, V, M, hh):  # type: ignore[no-untyped-def]
    """Places in the middle of the step."""
    for i in range(len(X)):
        for k in range(3):
            M[i, k] = X[i, k] + hh * V[i, k]


@njit(error_model="numpy")
def kick(X, V, RX, RV, F, IM, h):  # type: ignore[no-untyped-def]
    """The end of the step: compensated sums; forces are set to 0."""
    hh = 0.5 * h
    for i in range(len(X)):
        im = IM[i]
        for k in range(3):
            a = F[i, k] * im
            F[i, k] = 0.0
            p = X[i, k]
            u = V[i, k]
            d = h * (u + hh * a) + RX[i, k]
            t = p + d
            b = t - p
            RX[i, k] = (p - (t - b)) + (d - b)
            X[i, k] = t
            d = h * a + RV[i, k]
            t = u + d
            b = t - u
            RV[i, k] = (u - (t - b)) + (d - b)
            V[i, k] = t


@njit(error_model="numpy")
def sort_into_cells(M, width, cell, first, order):  # type: ignore[no-untyped-def]
    """Counting sort: cell of each body, first body of each cell, bodies in the order of cells; gives numbers of cells, 0 if there is no room."""
    lx = M[0, 0]
    ly = M[0, 1]
    lz = M[0, 2]
    hx, hy, hz = lx, ly, lz
    n = len(M)
    for i in range(n):
        lx = min(lx, M[i, 0])
        ly = min(ly, M[i, 1])
        lz = min(lz, M[i, 2])
        hx = max(hx, M[i, 0])
        hy = max(hy, M[i, 1])
        hz = max(hz, M[i, 2])
    nx = int((hx - lx) / width) + 1
    ny = int((hy - ly) / width) + 1
    nz = int((hz - lz) / width) + 1
    cells = nx * ny * nz
    if cells + 1 > first.size:
        return 0, 0, 0
    for c in range(cells + 1):
        first[c] = 0
    over = 1.0 / width
    for i in range(n):
        c = (int((M[i, 0] - lx) * over) * ny + int((M[i, 1] - ly) * over)) * nz + int((M[i, 2] - lz) * over)
        cell[i] = c
        first[c + 1] += 1
    for c in range(cells):
        first[c + 1] += first[c]
    for i in range(n):
        c = cell[i]
        order[first[c]] = i
        first[c] += 1
    for c in range(cells, 0, -1):
        first[c] = first[c - 1]
    first[0] = 0
    return nx, ny, nz


@njit(error_model="numpy")
def cells_each_step(X, V, RX, RV, IM, M, F, S, G, cell, first, order, steps, h, cutoff, epsilon, sigma, f0, f1):  # type: ignore[no-untyped-def]
    """Sorts all bodies into cells of the cutoff's width at each step, and walks cells: runs of three cells in z are one stretch of bodies."""
    end = cutoff * cutoff
    ss = sigma * sigma
    e = 24.0 * epsilon
    n = len(X)
    for _ in range(steps):
        middle(X, V, M, 0.5 * h)
        nx, ny, nz = sort_into_cells(M, cutoff, cell, first, order)
        if nx == 0:
            return 1
        for s in range(n):
            i = order[s]
            for k in range(3):
                S[s, k] = M[i, k]
                G[s, k] = 0.0
        for cx in range(nx):
            for cy in range(ny):
                for cz in range(nz):
                    c = (cx * ny + cy) * nz + cz
                    for s in range(first[c], first[c + 1]):
                        x = S[s, 0]
                        y = S[s, 1]
                        z = S[s, 2]
                        fx = 0.0
                        fy = 0.0
                        fz = 0.0
                        for row in range(5):  # own row from here on, and four rows of the half ahead
                            if row == 0:
                                ox, oy = cx, cy
                                low = s + 1
                                high = first[c + 2] if cz + 1 < nz else first[c + 1]
                            else:
                                ox = cx if row == 1 else cx + 1
                                oy = cy + 1 if row == 1 else cy + row - 3
                                if ox >= nx or oy < 0 or oy >= ny:
                                    continue
                                o = (ox * ny + oy) * nz
                                low = first[o + max(cz - 1, 0)]
                                high = first[o + min(cz + 2, nz)]
                            for t in range(low, high):
                                dx = x - S[t, 0]
                                dy = y - S[t, 1]
                                dz = z - S[t, 2]
                                q = dx * dx + dy * dy + dz * dz
                                if q < end:
                                    over = 1.0 / q
                                    b = ss * over
                                    b = b * b * b
                                    w = e * (2.0 * b * b - b) * over - f0 - f1 * (q - end)
                                    fx += w * dx
                                    fy += w * dy
                                    fz += w * dz
                                    G[t, 0] -= w * dx
                                    G[t, 1] -= w * dy
                                    G[t, 2] -= w * dz
                        G[s, 0] += fx
                        G[s, 1] += fy
                        G[s, 2] += fz
        for s in range(n):
            i = order[s]
            for k in range(3):
                F[i, k] = G[s, k]
        kick(X, V, RX, RV, F, IM, h)
    return 0


@njit(error_model="numpy")
def find_neighbours(M, reach, cell, first, order, start, other):  # type: ignore[no-untyped-def]
    """Half list of pairs closer than ``reach``; the bodies should lie in the order of cells. Gives their number, -1 if there is no room."""
    nx, ny, nz = sort_into_cells(M, reach, cell, first, order)
    if nx == 0:
        return -1
    n = len(M)
    most = reach * reach
    count = 0
    for i in range(n):
        start[i] = count
        if count + n > other.size:
            return -1
        c = cell[i]
        cz = c % nz
        cy = (c // nz) % ny
        cx = c // (nz * ny)
        for ox in range(max(cx - 1, 0), min(cx + 2, nx)):
            for oy in range(max(cy - 1, 0), min(cy + 2, ny)):
                o = (ox * ny + oy) * nz
                for s in range(first[o + max(cz - 1, 0)], first[o + min(cz + 2, nz)]):
                    j = order[s]
                    if j > i:
                        dx = M[i, 0] - M[j, 0]
                        dy = M[i, 1] - M[j, 1]
                        dz = M[i, 2] - M[j, 2]
                        other[count] = j
                        count += dx * dx + dy * dy + dz * dz < most
    start[n] = count
    return count


@njit(error_model="numpy")
def take(A, order, spare):  # type: ignore[no-untyped-def]
    """Put rows into another order."""
    for s in range(len(A)):
        for k in range(3):
            spare[s, k] = A[order[s], k]
    for s in range(len(A)):
        for k in range(3):
            A[s, k] = spare[s, k]


@njit(error_model="numpy")
def moved_too_far(M, M0, most):  # type: ignore[no-untyped-def]
    """Whether a body is further than half the skin from where it was when the list was made."""
    worst = 0.0
    for i in range(len(M)):
        dx = M[i, 0] - M0[i, 0]
        dy = M[i, 1] - M0[i, 1]
        dz = M[i, 2] - M0[i, 2]
        q = dx * dx + dy * dy + dz * dz
        if q > worst:
            worst = q
    return worst > most


@njit(error_model="numpy")
def forces(dx, dy, dz, end, ss, e, f0, f1):  # type: ignore[no-untyped-def]
    """Forces from differences of places, in vectors, in the same arrays; 0 beyond the cutoff."""
    for s in range(dx.size):
        x = dx[s]
        y = dy[s]
        z = dz[s]
        q = x * x + y * y + z * z
        over = 1.0 / q
        b = ss * over
        b = b * b * b
        w = e * (2.0 * b * b - b) * over - f0 - f1 * (q - end)
        w = w if q < end else 0.0
        dx[s] = w * x
        dy[s] = w * y
        dz[s] = w * z


@njit(error_model="numpy")
def pair_after_pair(M, F, start, other, DX, DY, DZ, end, ss, e, f0, f1):  # type: ignore[no-untyped-def]
    """Forces of all listed pairs, one after the other, those beyond the cutoff skipped."""
    for i in range(len(M)):
        x = M[i, 0]
        y = M[i, 1]
        z = M[i, 2]
        fx = 0.0
        fy = 0.0
        fz = 0.0
        for s in range(start[i], start[i + 1]):
            j = other[s]
            dx = x - M[j, 0]
            dy = y - M[j, 1]
            dz = z - M[j, 2]
            q = dx * dx + dy * dy + dz * dz
            if q < end:
                over = 1.0 / q
                b = ss * over
                b = b * b * b
                w = e * (2.0 * b * b - b) * over - f0 - f1 * (q - end)
                fx += w * dx
                fy += w * dy
                fz += w * dz
                F[j, 0] -= w * dx
                F[j, 1] -= w * dy
                F[j, 2] -= w * dz
        F[i, 0] += fx
        F[i, 1] += fy
        F[i, 2] += fz


@njit(error_model="numpy")
def body_after_body(M, F, start, other, DX, DY, DZ, end, ss, e, f0, f1):  # type: ignore[no-untyped-def]
    """Forces of all listed pairs, those of a body together: differences, forces in vectors, sums."""
    for i in range(len(M)):
        x = M[i, 0]
        y = M[i, 1]
        z = M[i, 2]
        begin = start[i]
        length = start[i + 1] - begin
        for s in range(length):
            j = other[begin + s]
            DX[s] = x - M[j, 0]
            DY[s] = y - M[j, 1]
            DZ[s] = z - M[j, 2]
        forces(DX[:length], DY[:length], DZ[:length], end, ss, e, f0, f1)
        fx = 0.0
        fy = 0.0
        fz = 0.0
        for s in range(length):
            j = other[begin + s]
            fx += DX[s]
            fy += DY[s]
            fz += DZ[s]
            F[j, 0] -= DX[s]
            F[j, 1] -= DY[s]
            F[j, 2] -= DZ[s]
        F[i, 0] += fx
        F[i, 1] += fy
        F[i, 2] += fz


@njit(error_model="numpy")
def listed(  # type: ignore[no-untyped-def]
    X,
    V,
    RX,
    RV,
    IM,
    own,
    M,
    M0,
    F,
    spare,
    cell,
    first,
    order,
    start,
    other,
    count,
    DX,
    DY,
    DZ,
    steps,
    h,
    cutoff,
    skin,
    epsilon,
    sigma,
    f0,
    f1,
    vectors,
):
    """Bodies kept in the order of cells, a half list of pairs up to the cutoff and a skin, made anew when a body has crossed half the skin."""
    end = cutoff * cutoff
    ss = sigma * sigma
    e = 24.0 * epsilon
    n = len(X)
    for _ in range(steps):
        middle(X, V, M, 0.5 * h)
        if count[0] == 0 or moved_too_far(M, M0, 0.25 * skin * skin):
            if sort_into_cells(M, cutoff + skin, cell, first, order)[0] == 0:
                return 1
            for A in (X, V, RX, RV, M):
                take(A, order, spare)
            for s in range(n):
                spare[s, 0] = IM[order[s]]
                spare[s, 1] = own[order[s]]
            for s in range(n):
                IM[s] = spare[s, 0]
                own[s] = int(spare[s, 1])
                for k in range(3):
                    M0[s, k] = M[s, k]
            if find_neighbours(M, cutoff + skin, cell, first, order, start, other) < 0:
                return 1
            count[0] += 1
        if vectors:
            body_after_body(M, F, start, other, DX, DY, DZ, end, ss, e, f0, f1)
        else:
            pair_after_pair(M, F, start, other, DX, DY, DZ, end, ss, e, f0, f1)
        kick(X, V, RX, RV, F, IM, h)
    return 0


CONSTANTS = (DEPTH, SIZE, level(), slope())


def _state(begin: Start) -> tuple[Any, ...]:
    """Places, velocities, their remainders, 1/m."""
    x, v = np.array(begin.position), np.array(begin.velocity)
    return x, v, np.zeros_like(x), np.zeros_like(x), 1.0 / begin.mass


def _checked(code: int) -> None:
    if code:
        raise MemoryError("the peer has no room for its cells or its list")


def cells(begin: Start, dt: float) -> Runner:
    """njit, cells at each step."""
    state, n = _state(begin), begin.n
    work = [np.zeros((n, 3)) for _ in range(4)]
    cell, first, order = np.zeros(n, np.uint32), np.zeros(1 << 20, np.uint32), np.zeros(n, np.uint32)
    return Runner(
        lambda steps: _checked(cells_each_step(*state, *work, cell, first, order, steps, dt, CUTOFF, *CONSTANTS)),
        lambda: (state[0].copy(), state[1].copy()),
    )


def neighbours(begin: Start, dt: float, vectors: bool = False) -> Runner:
    """njit, a sorted list of neighbours with a skin."""
    state, n = _state(begin), begin.n
    own = np.arange(n)
    work = [np.zeros((n, 3)) for _ in range(4)]
    cell, first, order = np.zeros(n, np.uint32), np.zeros(1 << 20, np.uint32), np.zeros(n, np.uint32)
    starts, other, count = np.zeros(n + 1, np.uint32), np.zeros(MOST * n + n, np.uint32), np.zeros(1, np.int64)
    own_state = (*state, own, *work, cell, first, order, starts, other, count, *np.zeros((3, n)))

    def read() -> tuple[Any, Any]:
        back = np.argsort(own)
        return state[0][back], state[1][back]

    return Runner(lambda steps: _checked(listed(*own_state, steps, dt, CUTOFF, SKIN, *CONSTANTS, vectors)), read)


def neighbours_in_vectors(begin: Start, dt: float) -> Runner:
    """njit, the same list; the forces of a body's pairs in vectors."""
    return neighbours(begin, dt, vectors=True)


COMPILED = {"njit, cells": cells, "njit, list": neighbours, "njit, list, vectors": neighbours_in_vectors}
