"""How fine the cells are, how many, and whether they fly along."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xpheve.errors import ContactError
from xpheve.kernels.clock import Instant
from xpheve_laws_collision.impact import rows

Floats = npt.NDArray[np.float64]

ROOM = 1.0 + 1e-6
"""Cells are a little wider than the greatest diameter: places leave them by rounding late."""
PLACES_A_CELL = 0.2
"""How many there are to be at least, on average: finer cells cost more than they spare."""

FINEST = 1e4
"""Cells along an axis at most."""
ASIDE = 0.381966
"""By this part of a cell the lowest place is beside the first boundary: places on a lattice should not lie on boundaries."""


class Grid(NamedTuple):
    """Cells: numbers along the axes, widths [m], origin [m] at ``time``, its velocity and acceleration; the diameter [m] they are made for."""

    sizes: tuple[int, int, int]
    widths: tuple[float, float, float]
    time: Instant
    origin: tuple[float, float, float]
    velocity: tuple[float, float, float]
    acceleration: tuple[float, float, float]
    diameter: float


def grid_for(
    state: Floats,
    now: Instant,
    periodic: Sequence[float] | None,
    free: bool,
    bounds: tuple[Floats, Floats] | None = None,
    coarser: float = 1.0,
) -> Grid:
    """Return cells for the flights ``state`` (k, 16); they move along with them if ``free``.

    ``bounds``: least and greatest coordinates (m, 3) [m] of fixed shapes that lie in cells, too. ``coarser``: cells of an open space are to be
    so many times as wide as they would be.

    Raises
    ------
    ContactError
        A periodic box narrower than two diameters.
    """
    diameter = 2.0 * float(np.max(state[:, rows.RADIUS]))
    s = (now[0] - state[:, rows.TIME]) + (now[1] - state[:, rows.TIME + 1])
    s = np.maximum(s, 0.0)[:, np.newaxis]
    v, pull = state[:, rows.V : rows.V + 3], state[:, rows.PULL : rows.PULL + 3]
    x = state[:, rows.X : rows.X + 3] + s * (v + 0.5 * s * pull)
    v = v + s * pull
    closed = [length < math.inf for length in periodic] if periodic is not None else [False] * 3
    for c, length in enumerate(periodic or ()):
        if length < 2.0 * diameter:
            raise ContactError(
                f"periodic[{c}] = {length} m is narrower than two of the greatest diameters ({diameter} m): "
                "a sphere would meet two images of another at once. Make the box wider, or the spheres smaller"
            )
    low, high = np.quantile(x, [0.02, 0.98], axis=0)
    count = len(state)
    if bounds is not None and len(bounds[0]):
        count = max(count, len(bounds[0]))
        low = np.minimum(low, np.quantile(bounds[0], 0.02, axis=0))
        high = np.maximum(high, np.quantile(bounds[1], 0.98, axis=0))
    extents = np.maximum(1.05 * (high - low), diameter)
    for c in range(3):
        if periodic is not None and closed[c]:
            extents[c] = periodic[c]
    widths = [coarser * width for width in _widths(extents, diameter * ROOM, count)]
    sizes = [
        max(1, math.floor(e / w) if shut else math.ceil(e / w))
        for e, w, shut in zip(extents, widths, closed, strict=True)
    ]
    if periodic is not None:
        widths = [e / n if shut else w for e, n, w, shut in zip(extents, sizes, widths, closed, strict=True)]
    origin = [0.0 if shut else float(one) - ASIDE * w for one, w, shut in zip(low, widths, closed, strict=True)]
    still = np.zeros(3)
    free = free and periodic is None
    return Grid(
        (sizes[0], sizes[1], sizes[2]),
        (float(widths[0]), float(widths[1]), float(widths[2])),
        now,
        (origin[0], origin[1], origin[2]),
        _three(v.mean(axis=0) if free else still),
        _three(pull.mean(axis=0) if free else still),
        diameter,
    )


def _widths(extents: Floats, least: float, count: int) -> list[float]:
    """Cells as cubes: the least width, or as many as there are places."""
    width = max(least, float(np.max(extents)) / FINEST) or 1.0
    while np.prod(np.ceil(extents / width)) > count / PLACES_A_CELL + 1.0:
        width *= 1.1
    return [width] * 3


def _three(a: Floats) -> tuple[float, float, float]:
    x, y, z = a.tolist()
    return x, y, z


__all__ = ["Grid", "grid_for"]
