"""Boxes along the axes of the world about objects, in whatever way they are turned."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from xpheve.kernels.quaternion import Quat, multiply, rotate
from xpheve.kernels.vector import Vec, add

Array = NDArray[np.float64]


class Bounds(NamedTuple):
    """Lowest and highest corner [m]."""

    low: Vec
    high: Vec


def bounds_of(shape: Any, position: Vec, orientation: Quat) -> Bounds:
    """The least box along the axes of the world that holds ``shape`` (a point if None); endless for a plane.

    Least for points, spheres, boxes, capsules, hulls and meshes; for a compound the box about those of its parts; for a shape of
    another kind the box about its bounding sphere.
    """
    if shape is None:
        return Bounds(position, position)
    if shape.kind == "compound":
        parts = [
            bounds_of(
                part.shape, add(position, rotate(orientation, part.position)), multiply(orientation, part.orientation)
            )
            for part in shape.parts
        ]
        low = tuple(min(part.low[k] for part in parts) for k in range(3))
        high = tuple(max(part.high[k] for part in parts) for k in range(3))
        return Bounds((low[0], low[1], low[2]), (high[0], high[1], high[2]))
    if shape.kind in ("hull", "mesh"):
        turned = np.asarray(shape.vertices, dtype=float) @ _matrix(orientation).T + np.asarray(position)
        low, high = turned.min(axis=0).tolist(), turned.max(axis=0).tolist()
        return Bounds((low[0], low[1], low[2]), (high[0], high[1], high[2]))
    x, y, z = _half_extent(shape, orientation)
    a, b, c = position
    return Bounds((a - x, b - y, c - z), (a + x, b + y, c + z))


def _half_extent(shape: Any, orientation: Quat) -> Vec:
    if shape.kind == "box":
        axes = [rotate(orientation, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
        x, y, z = (0.5 * sum(abs(axes[k][i]) * shape.size[k] for k in range(3)) for i in range(3))
        return x, y, z
    if shape.kind == "capsule":
        axis = rotate(orientation, (0.0, 0.0, 1.0))
        x, y, z = (0.5 * shape.length * abs(component) + shape.radius for component in axis)
        return x, y, z
    return shape.reach, shape.reach, shape.reach


def _matrix(q: Quat) -> Array:
    """The rotation as a matrix, (3, 3)."""
    return np.array([rotate(q, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]).T


def overlaps(low: Array, high: Array) -> list[tuple[int, int]]:
    """The pairs (i < j) of boxes, (n, 3) corners, that overlap or touch, in order.

    Sorted along one axis, so that only neighbours are compared.
    """
    n = len(low)
    if n < 2:
        return []
    bounded = np.isfinite(low).all(axis=1)
    axis = int(np.argmax(np.ptp(low[bounded], axis=0))) if bounded.any() else 0
    order = np.argsort(low[:, axis], kind="stable")
    low, high = low[order], high[order]
    last = np.searchsorted(low[:, axis], high[:, axis], side="right")
    found: list[tuple[int, int]] = []
    for k in range(n - 1):
        near = slice(k + 1, int(last[k]))
        hit = ((low[near] <= high[k]) & (low[k] <= high[near])).all(axis=1)
        for other in order[near][hit].tolist():
            i, j = sorted((int(order[k]), other))
            found.append((i, j))
    return sorted(found)


def reaches(bounds: Bounds, normal: Vec, level: float) -> float:
    """How deep [m] the box reaches behind the plane normal . x = level; negative if it does not."""
    lowest = math.fsum(c * (low if c > 0.0 else high) for c, low, high in zip(normal, *bounds, strict=True) if c != 0.0)
    return level - lowest
