"""Where parallel lines of sight meet shapes, for moving pictures.

A hit takes the start of each ray, shape (h, w, 3), on a regular grid, and their one direction (3,), both in the body's frame; it gives
how far along the first meeting is, (h, w), NaN for a miss, and the outward normals there, (h, w, 3).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from xpheve.errors import InvalidValueError
from xpheve.record.frame import FloatArray

Hit = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]

_WIDEST = 1 << 22  # pixels tried at once


def sphere(radius: float) -> Hit:
    """A sphere about the origin."""

    def hit(start: FloatArray, way: FloatArray) -> tuple[FloatArray, FloatArray]:
        far = _sphere_at(start, way, radius)
        return far, (start + far[..., None] * way) / radius

    return hit


def _sphere_at(start: FloatArray, way: FloatArray, radius: float) -> FloatArray:
    half = start @ way
    room = half * half - ((start * start).sum(axis=-1) - radius * radius)
    return np.asarray(-half - np.sqrt(np.where(room >= 0, room, np.nan)))


def box(size: FloatArray) -> Hit:
    """A box of full edge lengths ``size``."""

    def hit(start: FloatArray, way: FloatArray) -> tuple[FloatArray, FloatArray]:
        slope = np.where(np.abs(way) < 1e-12, 1e-12, way)
        enter = (-np.sign(slope) * size / 2 - start) / slope
        leave = (np.sign(slope) * size / 2 - start) / slope
        axis = enter.argmax(axis=-1)
        far = enter.max(axis=-1)
        far = np.where((far <= leave.min(axis=-1)), far, np.nan)
        return far, np.eye(3)[axis] * -np.sign(slope)

    return hit


def capsule(radius: float, length: float) -> Hit:
    """A capsule along z."""

    def hit(start: FloatArray, way: FloatArray) -> tuple[FloatArray, FloatArray]:
        a = float(way[:2] @ way[:2]) or 1e-300
        half = start[..., :2] @ way[:2]
        room = half * half - a * ((start[..., :2] ** 2).sum(axis=-1) - radius * radius)
        side = (-half - np.sqrt(np.where(room >= 0, room, np.nan))) / a
        side = np.where(np.abs(start[..., 2] + side * way[2]) <= length / 2, side, np.nan)
        ends = [_sphere_at(start - [0, 0, z], way, radius) for z in (-length / 2, length / 2)]
        far = np.fmin(side, np.fmin(*ends))
        where = start + far[..., None] * way
        core = np.zeros_like(where)
        core[..., 2] = np.clip(where[..., 2], -length / 2, length / 2)
        return far, (where - core) / radius

    return hit


def surface(vertices: FloatArray, faces: Any) -> Hit:
    """Triangles, seen from either side; their normals point against the rays."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.sqrt((normals * normals).sum(axis=1)), 1e-300)[:, None]

    def hit(start: FloatArray, way: FloatArray) -> tuple[FloatArray, FloatArray]:
        height, width = start.shape[:2]
        far = np.full((height, width), np.inf)
        which = np.zeros((height, width), dtype=np.int64)
        if height > 1 and width > 1:
            across, down = start[0, 1] - start[0, 0], start[1, 0] - start[0, 0]
            frame = np.linalg.inv(np.stack([across, down, way], axis=1))
            seen = (vertices - start[0, 0]) @ frame.T  # columns, rows and distances of the vertices
            _rasterise(seen[faces], far, which)
        outward = normals[which]
        outward = np.where((outward @ way)[..., None] > 0.0, -outward, outward)
        return np.where(np.isfinite(far), far, np.nan), outward

    return hit


def _rasterise(corners: FloatArray, far: FloatArray, which: Any) -> None:
    """Nearest of the triangles ``corners`` (m, 3, 3), (column, row, distance), at each whole column and row."""
    height, width = far.shape
    flat = corners[:, :, :2]
    low = np.clip(np.ceil(flat.min(axis=1)), 0, [width, height]).astype(np.int64)
    high = np.clip(np.floor(flat.max(axis=1)), -1, [width - 1, height - 1]).astype(np.int64)
    size = high - low + 1
    candidates = np.flatnonzero((size > 0).all(axis=1))
    if not len(candidates):
        return
    grade = np.ceil(np.log2(np.maximum(size[candidates], 1))).astype(np.int64)
    for columns, rows in np.unique(grade, axis=0):  # triangles of like size together
        group = candidates[(grade == (columns, rows)).all(axis=1)]
        span = 1 << int(columns), 1 << int(rows)
        chunk = max(_WIDEST // (span[0] * span[1]), 1)
        for first in range(0, len(group), chunk):
            _fill(corners, group[first : first + chunk], low, high, span, far, which)


def _fill(
    corners: FloatArray, group: Any, low: Any, high: Any, span: tuple[int, int], far: FloatArray, which: Any
) -> None:
    x = low[group, 0, None, None] + np.arange(span[0])[None, None, :]
    y = low[group, 1, None, None] + np.arange(span[1])[None, :, None]
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = (corners[group, k].T[:, :, None, None] for k in range(3))
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    area = np.where(np.abs(area) > 1e-12, area, np.nan)  # seen on edge
    u = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area
    v = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
    inside = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1.0 + 1e-9)
    inside &= (x <= high[group, 0, None, None]) & (y <= high[group, 1, None, None])
    k, j, i = np.nonzero(inside)
    distance = (az + u * (bz - az) + v * (cz - az))[k, j, i]
    column, row = x[k, 0, i], y[k, j, 0]
    order = np.argsort(-distance, kind="stable")  # of those on one pixel, the last written is the nearest
    k, column, row, distance = k[order], column[order], row[order], distance[order]
    nearer = distance < far[row, column]
    far[row[nearer], column[nearer]] = distance[nearer]
    which[row[nearer], column[nearer]] = group[k[nearer]]


_made: dict[int, tuple[dict[str, Any], Hit, float]] = {}
_MOST_KEPT = 64


def hit_of(shape: dict[str, Any] | None, least: float) -> Hit:
    """How to meet a shape, at least ``least`` [m] wide; of kinds unknown here, a sphere that holds it."""
    if shape is None or reach_of(shape) < least:
        return sphere(least)
    kind = shape.get("kind")
    if kind == "box":
        return box(np.asarray(shape["size"], dtype=np.float64))
    if kind == "capsule":
        return capsule(float(shape["radius"]), float(shape["length"]))
    if kind in ("compound", "hull", "mesh"):
        return _of_triangles(shape)[0]
    return sphere(reach_of(shape))


def reach_of(shape: dict[str, Any] | None) -> float:
    """Radius [m] about the centre that holds a shape; 0 if there is none to tell."""
    if not shape:
        return 0.0
    if shape.get("kind") in ("compound", "hull", "mesh"):
        return _of_triangles(shape)[1]
    if "size" in shape:
        return 0.5 * float(np.linalg.norm(shape["size"]))
    return float(shape.get("radius", 0.0)) + 0.5 * float(shape.get("length", 0.0))


def _of_triangles(shape: dict[str, Any]) -> tuple[Hit, float]:
    """How to meet a shape that is drawn as triangles, and its reach; kept for the few shapes of a record."""
    kept = _made.get(id(shape))
    if kept is None or kept[0] is not shape:
        from xpheve.shapes import from_description
        from xpheve.shapes.triangles import triangles

        try:
            made = from_description(shape)
            kept = shape, surface(*triangles(made)), made.reach
        except InvalidValueError:
            kept = shape, sphere(1e-300), 0.0  # a description that nobody could have written
        if len(_made) >= _MOST_KEPT:
            _made.clear()
        _made[id(shape)] = kept
    return kept[1], kept[2]
