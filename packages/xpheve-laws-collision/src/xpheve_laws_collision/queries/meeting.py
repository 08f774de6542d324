"""Which objects are within a margin of a shape, or of each other."""

from __future__ import annotations

import numpy as np

from xpheve_laws_collision.bounds import bounds_of
from xpheve_laws_collision.queries.places import BOX, CAPSULE, OTHER, PLANE, ROUND, Places
from xpheve_laws_collision.queries.rows import Array, Mask, Rows, crosses, dots, lengths, turned, turned_back
from xpheve_laws_collision.queries.separation import half_space, separation
from xpheve_laws_collision.queries.surface import Posed, feet

PART = 4096  # boxes whose neighbours along the axis are gathered at once


def within(places: Places, rows: Rows, posed: Posed, margin: float) -> list[int]:
    """The ``rows`` whose distance from the shape is at most ``margin`` [m], in order."""
    if posed.shape.kind == "plane":
        return _behind(places, rows, posed, margin)
    low, high = bounds_of(*posed)
    below, above = places.boxes
    spare = max(margin, 0.0) + 1e-9 * (posed.shape.reach + max(map(abs, posed.position)))
    near = ((below[rows] <= np.array(high) + spare) & (above[rows] >= np.array(low) - spare)).all(axis=1)
    rows = rows[near | (places.kind[rows] == PLANE)]
    if posed.shape.kind != "sphere":
        return [row for row in rows.tolist() if _distance(places, row, posed) <= margin]
    distance = feet(places, rows, np.tile(np.array(posed.position), (len(rows), 1)))[0] if len(rows) else np.zeros(0)
    found: list[int] = rows[distance - posed.shape.radius <= margin].tolist()
    return found


def _distance(places: Places, row: int, posed: Posed) -> float:
    return separation(posed, Posed(places.shape(row), *places.pose(row))).distance


def _behind(places: Places, rows: Rows, plane: Posed, margin: float) -> list[int]:
    normal, level = half_space(plane)
    rows = rows[places.kind[rows] != PLANE]
    found: list[int] = rows[heights(places, rows, np.tile(np.array(normal), (len(rows), 1)), level) <= margin].tolist()
    return found


def heights(places: Places, rows: Rows, normal: Array, level: Array | float) -> Array:
    """How high [m] the lowest points of ``rows`` are above planes, one a row."""
    found = np.asarray(dots(normal, places.position[rows]) - level)
    kinds, size = places.kind[rows], places.size[rows]
    local = turned_back(places.orientation[rows], normal)
    for kind in np.unique(kinds).tolist():
        part = np.flatnonzero(kinds == kind)
        if kind == ROUND:
            found[part] -= size[part, 0]
        elif kind == BOX:
            found[part] -= dots(np.abs(local[part]), size[part, :3])
        elif kind == CAPSULE:
            found[part] -= size[part, 0] + np.abs(local[part, 2]) * size[part, 1]
        elif kind == OTHER:
            levels = np.broadcast_to(level, (len(rows),))
            for k in part.tolist():
                found[k] = _lowest(places, int(rows[k]), normal[k], float(levels[k]))
    return found


def _lowest(places: Places, row: int, normal: Array, level: float) -> float:
    from xpheve.shapes import Plane

    x, y, z = normal.tolist()
    plane = Posed(Plane((x, y, z), level), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    return _distance(places, row, plane)


def near_pairs(places: Places, rows: Rows, margin: float) -> list[tuple[int, int]]:
    """The pairs of ``rows`` whose distance is at most ``margin`` [m], the lower row first, in order."""
    bounded, planes = rows[places.kind[rows] != PLANE], rows[places.kind[rows] == PLANE]
    low, high = (corner[bounded] for corner in places.boxes)
    i, j = neighbours(low - 0.5 * max(margin, 0.0), high + 0.5 * max(margin, 0.0))
    i, j = bounded[i], bounded[j]
    keep = near(places, i, j, margin)
    found = list(zip(i[keep].tolist(), j[keep].tolist(), strict=True))
    for plane in planes.tolist():
        normal, level = places.normals(np.array([plane]))
        above = heights(places, bounded, np.repeat(normal, len(bounded), axis=0), float(level[0]))
        found += [(row, plane) for row in bounded[above <= margin].tolist()]
    return sorted((min(pair), max(pair)) for pair in found)


def near(places: Places, i: Rows, j: Rows, margin: float) -> Mask:
    """Whether the pairs of bounded rows are within ``margin`` [m] of each other."""
    keep = np.zeros(len(i), dtype=bool)
    swap = (places.kind[i] != ROUND) & (places.kind[j] == ROUND)
    i, j = np.where(swap, j, i), np.where(swap, i, j)
    ball = np.flatnonzero(places.kind[i] == ROUND)
    if len(ball):
        keep[ball] = feet(places, j[ball], places.position[i[ball]])[0] - places.size[i[ball], 0] <= margin
    boxes = np.flatnonzero((places.kind[i] == BOX) & (places.kind[j] == BOX))
    gap = np.full(len(i), np.nan)
    gap[boxes] = widest_gap(places, i[boxes], j[boxes])
    keep[gap <= min(margin, 0.0)] = True  # only where they overlap is the widest gap the distance
    for k in np.flatnonzero((places.kind[i] != ROUND) & ~(gap > margin) & ~keep).tolist():
        one = Posed(places.shape(int(i[k])), *places.pose(int(i[k])))
        keep[k] = _distance(places, int(j[k]), one) <= margin
    return keep


def widest_gap(places: Places, i: Rows, j: Rows) -> Array:
    """The widest gap (p,) [m] between pairs of boxes along any of the 15 axes that may part them; negative where they overlap.

    No more than their distance, and that itself where they overlap (Gottschalk, Lin & Manocha, SIGGRAPH 1996, 171).
    """
    axes_i, axes_j = (_axes(places, rows) for rows in (i, j))
    away = places.position[j] - places.position[i]
    best = np.full(len(i), -np.inf)
    for axis in (*axes_i, *axes_j, *(crosses(one, two) for one in axes_i for two in axes_j)):
        length = lengths(axis)
        reach = sum(
            places.size[rows, k] * np.abs(dots(axis, own))
            for rows, axes in ((i, axes_i), (j, axes_j))
            for k, own in enumerate(axes)
        )
        parallel = length < 1e-6  # then an axis of a face says the same
        gap = (np.abs(dots(axis, away)) - reach) / np.where(parallel, 1.0, length)
        best = np.maximum(best, np.where(parallel, -np.inf, gap))
    return best


def _axes(places: Places, rows: Rows) -> list[Array]:
    """The three axes (p, 3) of each box in the world."""
    return [turned(places.orientation[rows], np.tile(axis, (len(rows), 1))) for axis in np.eye(3)]


def neighbours(low: Array, high: Array) -> tuple[Rows, Rows]:
    """Pairs of boxes (n, 3) that overlap: sorted along the axis along which they are spread most, and compared with what begins before they end."""
    n = len(low)
    if n < 2:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    axis = int(np.argmax((low + high).std(axis=0) / np.maximum((high - low).mean(axis=0), 1e-300)))
    order = np.argsort(low[:, axis], kind="stable")
    low, high = low[order], high[order]
    last = np.searchsorted(low[:, axis], high[:, axis], side="right")
    counts = np.maximum(last - np.arange(n) - 1, 0)
    ones, others = [], []
    for begin in range(0, n, PART):
        part = slice(begin, min(begin + PART, n))
        first = np.repeat(np.arange(part.start, part.stop), counts[part])
        starts = np.repeat(np.cumsum(counts[part]) - counts[part], counts[part])
        second = first + 1 + (np.arange(len(first)) - starts)
        keep = np.ones(len(first), dtype=bool)
        for k in range(3):
            if k != axis:
                keep &= (low[first, k] <= high[second, k]) & (low[second, k] <= high[first, k])
        ones.append(order[first[keep]])
        others.append(order[second[keep]])
    return np.concatenate(ones), np.concatenate(others)


__all__ = ["heights", "near", "near_pairs", "neighbours", "widest_gap", "within"]
