"""Which fixed shapes a place has to look at, cell by cell: those that a sphere whose centre is in the cell can touch.

Cells a whole number of grids apart share a list, as they share the places in them. Planes, and what fills many cells, are for all to look at.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from xpheve_laws_collision.impact import rows
from xpheve_laws_collision.impact.layout import Grid

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

SLACK = 1e-6
"""By this part of a cell, and of the sizes, more is taken for near than is."""
FAR = 1e-12
"""By this part of the coordinates, too: so far out a place may be beside its cell by rounding."""
MOST_CELLS = 512
"""A shape that lies in more cells is for all to look at."""


def is_bounded(shapes: Floats) -> npt.NDArray[np.bool_]:
    """Which of the rows of scenery have an end."""
    bounded: npt.NDArray[np.bool_] = (shapes[:, rows.KIND] != rows.PLANE) & np.isfinite(shapes).all(axis=1)
    return bounded


def cores(shapes: Floats) -> tuple[Floats, Floats]:
    """Half edges (m, 3) and radius (m,) [m] of boxes, rounded, that the shapes are."""
    kind = shapes[:, rows.KIND].astype(np.int64)
    half, radius = np.zeros((len(shapes), 3)), np.zeros(len(shapes))
    boxes, capsules, balls = kind == rows.BOX, kind == rows.CAPSULE, kind == rows.SPHERE
    half[boxes] = shapes[boxes, rows.SIZE : rows.SIZE + 3]
    radius[capsules], half[capsules, 2] = shapes[capsules, rows.SIZE], shapes[capsules, rows.SIZE + 1]
    radius[balls] = shapes[balls, rows.SIZE]
    return half, radius


def with_reach(shapes: Floats) -> Floats:
    """The rows of scenery, no bounded one with a reach [m] below what its sizes say."""
    half, radius = cores(shapes)
    reach = np.linalg.norm(half, axis=1) + radius
    found = shapes.copy()
    less = is_bounded(shapes) & (found[:, rows.SIZE + 3] < (1.0 - 1e-9) * reach)
    found[less, rows.SIZE + 3] = reach[less]
    return found


def rotations(shapes: Floats) -> Floats:
    """Rotation matrices (m, 3, 3); spheres need none."""
    turns = shapes[:, rows.TURN : rows.TURN + 9].reshape(-1, 3, 3)
    found: Floats = np.where((shapes[:, rows.KIND] == rows.SPHERE)[:, np.newaxis, np.newaxis], np.eye(3), turns)
    return found


def bounds(shapes: Floats) -> tuple[Floats, Floats]:
    """The least and greatest coordinates (m, 3) [m] of bounded shapes."""
    half, radius = cores(shapes)
    extent = np.einsum("mij,mj->mi", np.abs(rotations(shapes)), half) + radius[:, np.newaxis]
    centre = shapes[:, rows.CENTRE : rows.CENTRE + 3]
    return centre - extent, centre + extent


def shelves_for(shapes: Floats, grid: Grid | None) -> tuple[int, Ints]:
    """How many shapes all look at; and those, where the list of each cell begins, and the lists.

    Without a grid all look at all. Within a list rows ascend.
    """
    if grid is None:
        return len(shapes), np.arange(len(shapes) + 1, dtype=np.int64)
    bounded = is_bounded(shapes)
    cells = math.prod(grid.sizes)
    row, cell, wide = _in_cells(shapes, np.flatnonzero(bounded), grid, min(MOST_CELLS, max(8, cells // 4)))
    endless = np.sort(np.concatenate([np.flatnonzero(~bounded), wide])).astype(np.int64)
    pairs = np.unique(cell * max(1, len(shapes)) + row)
    cell, row = np.divmod(pairs, max(1, len(shapes)))
    starts = np.searchsorted(cell, np.arange(cells + 1)) + len(endless) + cells + 1
    return len(endless), np.concatenate([endless, starts, row]).astype(np.int64)


def _in_cells(shapes: Floats, at: Ints, grid: Grid, most: int) -> tuple[Ints, Ints, Ints]:
    """Rows and cells of all pairs that may touch; and the rows that lie in more than ``most`` cells."""
    widths, origin, sizes = np.array(grid.widths), np.array(grid.origin), np.array(grid.sizes)
    low, high = bounds(shapes[at])
    half, radius = cores(shapes[at])
    reach = 0.5 * grid.diameter * (1.0 + SLACK) + SLACK * float(np.max(widths))
    more = reach + FAR * np.maximum(np.abs(low - origin), np.abs(high - origin)) + SLACK * (high - low)
    first = np.floor((low - origin - more) / widths)
    last = np.floor((high - origin + more) / widths)
    number = np.prod(last - first + 1.0, axis=1)
    few = (number <= most) & (np.abs(first) < 1e15).all(axis=1)
    wide = at[~few]
    at, first, half, radius, more = at[few], first[few].astype(np.int64), half[few], radius[few], more[few]
    spans = last[few].astype(np.int64) - first + 1
    count = np.prod(spans, axis=1)
    own = np.repeat(np.arange(len(at)), count)
    k = np.arange(len(own)) - np.repeat(np.cumsum(count) - count, count)
    cell = first[own]
    cell[:, 2] += k % spans[own, 2]
    cell[:, 1] += k // spans[own, 2] % spans[own, 1]
    cell[:, 0] += k // (spans[own, 2] * spans[own, 1])
    # Only cells whose ball about the middle comes near the shape
    middle = origin + (cell + 0.5) * widths - shapes[at][own, rows.CENTRE : rows.CENTRE + 3]
    inside = np.einsum("kji,kj->ki", rotations(shapes[at])[own], middle)
    apart = np.linalg.norm(np.maximum(np.abs(inside) - half[own], 0.0), axis=1)
    near = apart <= radius[own] + 0.5 * float(np.linalg.norm(widths)) + np.max(more, axis=1)[own]
    folded = cell[near] % sizes
    return at[own[near]], (folded[:, 0] * sizes[1] + folded[:, 1]) * sizes[2] + folded[:, 2], wide


__all__ = ["bounds", "cores", "is_bounded", "rotations", "shelves_for", "with_reach"]
