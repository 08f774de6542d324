"""Elastic hard spheres from impact to impact, written by hand for numba: what the work costs with no engine around it.

All spheres have one diameter and one mass, in a cube with walls or in a periodic one. Every sphere flies on its own
clock and has one event: the next impact it knows of, or the next crossing of a cell, whichever is first; a heap holds
them. An impact with a sphere that has been changed since is stale, and is looked for anew. After an impact the 27
cells around are asked, after a crossing the 9 new ones.

Source of the method: D. C. Rapaport, The Art of Molecular Dynamics Simulation, chapter 14 (cells, one clock a particle);
B. D. Lubachevsky, J. Comput. Phys. 94, 255 (1991) (one event a particle).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit

Array = Any
SORT = 20  # impacts a sphere between two sorts by cell
NEVER = math.inf


@dataclass
class Spheres:
    """Spheres of one ``diameter`` [m], mass 1: ``position`` and ``velocity`` (n, 3), in [0, ``edge``)^3 or between walls there."""

    position: Array
    velocity: Array
    diameter: float
    edge: float
    periodic: bool
    time: float = 0.0
    impacts: int = 0
    walls: int = 0

    @property
    def n(self) -> int:
        """How many."""
        return len(self.position)


def cells_per_edge(n: int, diameter: float, span: float, a_cell: float = 0.35) -> int:
    """How many cells an edge of ``span`` [m] has: as wide as a diameter at least, and with ``a_cell`` spheres in the mean."""
    most = int(span / diameter)
    return max(3, min(most, round((n / a_cell) ** (1.0 / 3.0))))


def run(spheres: Spheres, *, until: float = NEVER, impacts: int | None = None, a_cell: float = 0.35) -> None:
    """Go on to the time ``until`` [s], or for ``impacts`` impacts of two spheres, whichever is first. All end at one time."""
    left = np.iinfo(np.int64).max if impacts is None else impacts
    while left > 0 and spheres.time < until:
        batch = min(left, SORT * spheres.n)
        done = _batch(spheres, until, batch, a_cell)
        left -= done
        if done < batch:
            break


def _batch(spheres: Spheres, until: float, impacts: int, a_cell: float) -> int:
    """Sort by cell, so that neighbours lie near to each other in memory; begin all clocks at 0; run."""
    n = spheres.n
    low = 0.0 if spheres.periodic else 0.5 * spheres.diameter
    span = spheres.edge - 2.0 * low
    cells = cells_per_edge(n, spheres.diameter, span, a_cell)
    if spheres.periodic and spheres.edge / cells < spheres.diameter:
        raise ValueError(f"a periodic cube of {spheres.edge} m is too narrow for spheres of {spheres.diameter} m")
    place = spheres.position
    if spheres.periodic:
        place = place - spheres.edge * np.floor(place / spheres.edge)
    where = np.clip(((place - low) * (cells / span)).astype(np.int64), 0, cells - 1)
    order = np.argsort((where[:, 2] * cells + where[:, 1]) * cells + where[:, 0], kind="stable")
    state = np.zeros((n, 8))
    state[:, :3], state[:, 3:6] = place[order], spheres.velocity[order]
    made = np.zeros((n, 4))
    links = np.zeros((n, 8), np.int64)
    links[:, :3] = where[order]
    heads = np.full(cells**3, -1, np.int64)
    heap_time, heap_who, heap_place = np.zeros(n), np.arange(n), np.arange(n)
    counts = np.zeros(2, np.int64)
    end = _loop(
        state.ravel(),
        made.ravel(),
        links.ravel(),
        heads,
        heap_time,
        heap_who,
        heap_place,
        counts,
        n,
        cells,
        span / cells,
        low,
        spheres.edge,
        spheres.diameter**2,
        spheres.periodic,
        until - spheres.time,
        impacts,
    )
    spheres.position[order], spheres.velocity[order] = state[:, :3], state[:, 3:6]
    spheres.time = until if counts[0] < impacts else spheres.time + end
    spheres.impacts += int(counts[0])
    spheres.walls += int(counts[1])
    return int(counts[0])


@njit(cache=True, inline="always")
def _meet(x, y, z, u, v, w, square):  # type: ignore[no-untyped-def]
    """Seconds until two spheres touch, of relative place (x, y, z) and velocity (u, v, w); at once if they overlap and approach."""
    b = x * u + y * v + z * w
    if b >= 0.0:
        return math.inf
    a = u * u + v * v + w * w
    c = x * x + y * y + z * z - square
    if c <= 0.0:
        return 0.0
    d = b * b - a * c
    if d < 0.0:
        return math.inf
    return c / (math.sqrt(d) - b)


@njit(cache=True)
def _look(state, links, heads, i, now, cells, edge, square, periodic, x0, x1, y0, y1, z0, z1, best, partner):  # type: ignore[no-untyped-def]
    """The first impact of sphere i with those in the cells of the given offsets, if it is before ``best``."""
    r, k = 8 * i, 8 * i
    s = now - state[r + 6]
    u, v, w = state[r + 3], state[r + 4], state[r + 5]
    x, y, z = state[r] + u * s, state[r + 1] + v * s, state[r + 2] + w * s
    cx, cy, cz = links[k], links[k + 1], links[k + 2]
    for dz in range(z0, z1 + 1):
        nz, sz = cz + dz, z
        if nz < 0:
            if not periodic:
                continue
            nz, sz = nz + cells, z + edge
        elif nz >= cells:
            if not periodic:
                continue
            nz, sz = nz - cells, z - edge
        for dy in range(y0, y1 + 1):
            ny, sy = cy + dy, y
            if ny < 0:
                if not periodic:
                    continue
                ny, sy = ny + cells, y + edge
            elif ny >= cells:
                if not periodic:
                    continue
                ny, sy = ny - cells, y - edge
            row = (nz * cells + ny) * cells
            for dx in range(x0, x1 + 1):
                nx, sx = cx + dx, x
                if nx < 0:
                    if not periodic:
                        continue
                    nx, sx = nx + cells, x + edge
                elif nx >= cells:
                    if not periodic:
                        continue
                    nx, sx = nx - cells, x - edge
                j = heads[row + nx]
                while j >= 0:
                    if j != i:
                        q = 8 * j
                        h = now - state[q + 6]
                        a, b, c = state[q + 3], state[q + 4], state[q + 5]
                        t = now + _meet(
                            sx - (state[q] + a * h),
                            sy - (state[q + 1] + b * h),
                            sz - (state[q + 2] + c * h),
                            u - a,
                            v - b,
                            w - c,
                            square,
                        )
                        if t < best:
                            best, partner = t, j
                    j = links[8 * j + 3]
    return best, partner


@njit(cache=True)
def _cross(state, links, i, now, width, low):  # type: ignore[no-untyped-def]
    """When sphere i leaves its cell, and through which side: axis 0, 1, 2 upwards, 3, 4, 5 downwards."""
    r = 8 * i
    best, side = math.inf, 0
    for axis in range(3):
        v = state[r + 3 + axis]
        if v != 0.0:
            up = v > 0.0
            wall = low + width * (links[r + axis] + (1 if up else 0))
            t = state[r + 6] + (wall - state[r + axis]) / v
            if t < best:
                best, side = t, axis if up else 3 + axis
    return max(best, now), side


@njit(cache=True)
def _sift(times, who, places, at, time, i):  # type: ignore[no-untyped-def]
    """Put sphere i with ``time`` where it belongs in the heap (four children a node), from the hole ``at``."""
    n = len(times)
    while at > 0:
        above = (at - 1) >> 2
        if times[above] <= time:
            break
        times[at], who[at] = times[above], who[above]
        places[who[at]] = at
        at = above
    while True:
        first = 4 * at + 1
        if first >= n:
            break
        least, value = first, times[first]
        for child in range(first + 1, min(first + 4, n)):
            if times[child] < value:
                least, value = child, times[child]
        if value >= time:
            break
        times[at], who[at] = value, who[least]
        places[who[at]] = at
        at = least
    times[at], who[at], places[i] = time, i, at


@njit(cache=True)
def _enter(links, heads, i, cells):  # type: ignore[no-untyped-def]
    k = 8 * i
    cell = (links[k + 2] * cells + links[k + 1]) * cells + links[k]
    first = heads[cell]
    links[k + 3], links[k + 4] = first, -1
    if first >= 0:
        links[8 * first + 4] = i
    heads[cell] = i


@njit(cache=True)
def _leave(links, heads, i, cells):  # type: ignore[no-untyped-def]
    k = 8 * i
    after, before = links[k + 3], links[k + 4]
    if before >= 0:
        links[8 * before + 3] = after
    else:
        heads[(links[k + 2] * cells + links[k + 1]) * cells + links[k]] = after
    if after >= 0:
        links[8 * after + 4] = before


@njit(cache=True)
def _move(state, i, now):  # type: ignore[no-untyped-def]
    r = 8 * i
    s = now - state[r + 6]
    state[r] += state[r + 3] * s
    state[r + 1] += state[r + 4] * s
    state[r + 2] += state[r + 5] * s
    state[r + 6] = now


@njit(cache=True)
def _strike(state, i, j, edge, periodic):  # type: ignore[no-untyped-def]
    """Two spheres of one mass exchange what they have along the line between them."""
    p, q = 8 * i, 8 * j
    x, y, z = state[p] - state[q], state[p + 1] - state[q + 1], state[p + 2] - state[q + 2]
    if periodic:
        x, y, z = x - edge * round(x / edge), y - edge * round(y / edge), z - edge * round(z / edge)
    u, v, w = state[p + 3] - state[q + 3], state[p + 4] - state[q + 4], state[p + 5] - state[q + 5]
    share = (x * u + y * v + z * w) / (x * x + y * y + z * z)
    state[p + 3] -= share * x
    state[p + 4] -= share * y
    state[p + 5] -= share * z
    state[q + 3] += share * x
    state[q + 4] += share * y
    state[q + 5] += share * z


@njit(cache=True)
def _anew(
    state,
    made,
    links,
    heads,
    times,
    who,
    places,
    i,
    now,
    cells,
    width,
    low,
    edge,
    square,
    periodic,
    x0,
    x1,
    y0,
    y1,
    z0,
    z1,
    best,
    partner,
):  # type: ignore[no-untyped-def]
    """The next event of sphere i, into the heap."""
    best, partner = _look(
        state, links, heads, i, now, cells, edge, square, periodic, x0, x1, y0, y1, z0, z1, best, partner
    )
    out, side = _cross(state, links, i, now, width, low)
    made[4 * i] = best
    k = 8 * i
    links[k + 5], links[k + 6] = partner, side
    if partner >= 0:
        made[4 * i + 1] = state[8 * partner + 7]
    if out < best:
        links[k + 7] = 1
        best = out
    else:
        links[k + 7] = 0
    _sift(times, who, places, places[i], best, i)


@njit(cache=True)
def _loop(
    state,
    made,
    links,
    heads,
    times,
    who,
    places,
    counts,
    n,
    cells,
    width,
    low,
    edge,
    square,
    periodic,
    until,
    impacts,
):  # type: ignore[no-untyped-def]
    """From event to event. ``state``: place, velocity, clock, changes. ``links``: cell, next, before, partner, side, kind."""
    for i in range(n):
        _enter(links, heads, i, cells)
        times[i] = -math.inf
    for i in range(n):
        _anew(
            state,
            made,
            links,
            heads,
            times,
            who,
            places,
            i,
            0.0,
            cells,
            width,
            low,
            edge,
            square,
            periodic,
            -1,
            1,
            -1,
            1,
            -1,
            1,
            math.inf,
            -1,
        )
    now = 0.0
    while counts[0] < impacts:
        if times[0] > until:
            break
        now = times[0]
        i = who[0]
        k = 8 * i
        j = links[k + 5]
        if links[k + 7] == 1:
            side = links[k + 6]
            axis = side % 3
            step = 1 if side < 3 else -1
            there = links[k + axis] + step
            if not periodic and (there < 0 or there >= cells):
                _move(state, i, now)
                state[k + 3 + axis] = -state[k + 3 + axis]
                state[k + 7] += 1.0
                counts[1] += 1
                _anew(
                    state,
                    made,
                    links,
                    heads,
                    times,
                    who,
                    places,
                    i,
                    now,
                    cells,
                    width,
                    low,
                    edge,
                    square,
                    periodic,
                    -1,
                    1,
                    -1,
                    1,
                    -1,
                    1,
                    math.inf,
                    -1,
                )
                continue
            _leave(links, heads, i, cells)
            if there < 0:
                there += cells
                state[k + axis] += edge
            elif there >= cells:
                there -= cells
                state[k + axis] -= edge
            links[k + axis] = there
            _enter(links, heads, i, cells)
            if j >= 0 and state[8 * j + 7] != made[4 * i + 1]:
                _anew(
                    state,
                    made,
                    links,
                    heads,
                    times,
                    who,
                    places,
                    i,
                    now,
                    cells,
                    width,
                    low,
                    edge,
                    square,
                    periodic,
                    -1,
                    1,
                    -1,
                    1,
                    -1,
                    1,
                    math.inf,
                    -1,
                )
            elif axis == 0:
                _anew(
                    state,
                    made,
                    links,
                    heads,
                    times,
                    who,
                    places,
                    i,
                    now,
                    cells,
                    width,
                    low,
                    edge,
                    square,
                    periodic,
                    step,
                    step,
                    -1,
                    1,
                    -1,
                    1,
                    made[4 * i],
                    j,
                )
            elif axis == 1:
                _anew(
                    state,
                    made,
                    links,
                    heads,
                    times,
                    who,
                    places,
                    i,
                    now,
                    cells,
                    width,
                    low,
                    edge,
                    square,
                    periodic,
                    -1,
                    1,
                    step,
                    step,
                    -1,
                    1,
                    made[4 * i],
                    j,
                )
            else:
                _anew(
                    state,
                    made,
                    links,
                    heads,
                    times,
                    who,
                    places,
                    i,
                    now,
                    cells,
                    width,
                    low,
                    edge,
                    square,
                    periodic,
                    -1,
                    1,
                    -1,
                    1,
                    step,
                    step,
                    made[4 * i],
                    j,
                )
            continue
        if state[8 * j + 7] != made[4 * i + 1]:
            _anew(
                state,
                made,
                links,
                heads,
                times,
                who,
                places,
                i,
                now,
                cells,
                width,
                low,
                edge,
                square,
                periodic,
                -1,
                1,
                -1,
                1,
                -1,
                1,
                math.inf,
                -1,
            )
            continue
        _move(state, i, now)
        _move(state, j, now)
        _strike(state, i, j, edge, periodic)
        state[k + 7] += 1.0
        state[8 * j + 7] += 1.0
        counts[0] += 1
        _anew(
            state,
            made,
            links,
            heads,
            times,
            who,
            places,
            i,
            now,
            cells,
            width,
            low,
            edge,
            square,
            periodic,
            -1,
            1,
            -1,
            1,
            -1,
            1,
            math.inf,
            -1,
        )
        _anew(
            state,
            made,
            links,
            heads,
            times,
            who,
            places,
            j,
            now,
            cells,
            width,
            low,
            edge,
            square,
            periodic,
            -1,
            1,
            -1,
            1,
            -1,
            1,
            math.inf,
            -1,
        )
    if counts[0] < impacts:
        now = until
    for i in range(n):
        _move(state, i, now)
    return now


def lattice(n: int, packing: float, seed: int = 6, diameter: float = 1.0) -> Spheres:
    """``n`` spheres on places drawn from a face-centred lattice in a periodic cube, with speeds drawn from Maxwell's law, at rest as a whole."""
    side = math.ceil((n / 4) ** (1.0 / 3.0) - 1e-9)
    edge = diameter * (n * math.pi / (6.0 * packing)) ** (1.0 / 3.0)
    base = np.array([[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]]) + 0.25
    corners = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    sites = ((corners + base).reshape(-1, 3)) * (edge / side)
    if edge / side * math.sqrt(0.5) < diameter:
        raise ValueError(f"{n} spheres at packing {packing} do not fit on this lattice")
    random = np.random.default_rng(seed)
    chosen = np.sort(random.permutation(len(sites))[:n])
    velocity = random.normal(size=(n, 3))
    velocity -= velocity.mean(axis=0)
    velocity *= math.sqrt(3.0 * n / (velocity**2).sum())
    return Spheres(sites[chosen], velocity, diameter, edge, True)


def enskog_rate(n: int, packing: float, diameter: float = 1.0) -> float:
    """Impacts a second of ``n`` spheres of mass 1 at temperature 1 (mean square speed 3), by Enskog with the contact value of Carnahan and Starling.

    S. Chapman, T. G. Cowling, The Mathematical Theory of Non-Uniform Gases, 16.2; N. F. Carnahan, K. E. Starling, J. Chem. Phys. 51, 635 (1969).
    The factor for ``n`` counts that the sum of momenta is 0: relative velocities are 2 n / (n - 1) times those of one, in the square.
    """
    density = packing / (math.pi / 6.0 * diameter**3)
    contact = (1.0 - 0.5 * packing) / (1.0 - packing) ** 3
    a_sphere = 4.0 * math.sqrt(math.pi) * density * diameter**2 * contact
    return 0.5 * n * a_sphere


def fluid(n: int, packing: float, seed: int = 6, each: int = 25) -> Spheres:
    """``n`` spheres in a periodic cube, in equilibrium: a small cube is molten, after ``each`` impacts a sphere, and then put side by side.

    All velocities are drawn anew, and it goes on for a while, so that the copies forget one another.
    """
    copies = next((k for k in (4, 3, 2) if n % k**3 == 0 and n // k**3 >= 1000), 1)
    seedling = lattice(n // copies**3, packing, seed)
    run(seedling, impacts=each * seedling.n)
    if copies == 1:
        return _at_zero(seedling)
    place = np.mod(seedling.position, seedling.edge)
    shifts = np.stack(np.meshgrid(*[np.arange(copies)] * 3, indexing="ij"), axis=-1).reshape(-1, 1, 3) * seedling.edge
    velocity = np.random.default_rng(seed + 1).normal(size=(n, 3))
    velocity -= velocity.mean(axis=0)
    velocity *= math.sqrt(3.0 * n / (velocity**2).sum())
    found = Spheres((place + shifts).reshape(-1, 3), velocity, seedling.diameter, copies * seedling.edge, True)
    run(found, impacts=3 * n)
    return _at_zero(found)


def _at_zero(spheres: Spheres) -> Spheres:
    """The same at the time 0, within the cube."""
    place = np.mod(spheres.position, spheres.edge)
    return Spheres(place, spheres.velocity, spheres.diameter, spheres.edge, spheres.periodic)


@njit(cache=True)
def _closest(state, links, heads, n, cells, edge, periodic):  # type: ignore[no-untyped-def]
    least = math.inf
    for i in range(n):
        _enter(links, heads, i, cells)
    for i in range(n):
        k = 8 * i
        for dz in range(-1, 2):
            for dy in range(-1, 2):
                for dx in range(-1, 2):
                    nx, ny, nz = links[k] + dx, links[k + 1] + dy, links[k + 2] + dz
                    if periodic:
                        nx, ny, nz = nx % cells, ny % cells, nz % cells
                    elif nx < 0 or ny < 0 or nz < 0 or nx >= cells or ny >= cells or nz >= cells:
                        continue
                    j = heads[(nz * cells + ny) * cells + nx]
                    while j >= 0:
                        if j != i:
                            q = 8 * j
                            x, y, z = state[k] - state[q], state[k + 1] - state[q + 1], state[k + 2] - state[q + 2]
                            if periodic:
                                x, y, z = (
                                    x - edge * round(x / edge),
                                    y - edge * round(y / edge),
                                    z - edge * round(z / edge),
                                )
                            least = min(least, x * x + y * y + z * z)
                        j = links[8 * j + 3]
    return math.sqrt(least)


def closest(position: Array, diameter: float, edge: float, periodic: bool) -> float:
    """The least distance [m] of two centres (n, 3) in a cube, if it is at most the width of a cell; right to rounding."""
    n = len(position)
    cells = cells_per_edge(n, diameter, edge, 0.35)
    place = np.mod(position, edge) if periodic else np.asarray(position)
    where = np.clip((place * (cells / edge)).astype(np.int64), 0, cells - 1)
    state, links = np.zeros((n, 8)), np.zeros((n, 8), np.int64)
    state[:, :3], links[:, :3] = place, where
    heads = np.full(cells**3, -1, np.int64)
    flat = links.ravel()
    return float(_closest(state.ravel(), flat, heads, n, cells, edge, periodic))
