"""Shapes as triangles, to be drawn and exported; curved ones approximately."""

from __future__ import annotations

import math

import numpy as np

from xpheve.errors import InvalidValueError
from xpheve.orientation import to_pose
from xpheve.shapes.base import Shape
from xpheve.shapes.box import Box
from xpheve.shapes.capsule import Capsule
from xpheve.shapes.compound import Compound
from xpheve.shapes.polyhedron import Array, Indices, Polyhedron
from xpheve.shapes.sphere import Sphere

AROUND = 32
"""Corners of a circle."""


def triangles(shape: Shape, around: int = AROUND) -> tuple[Array, Indices]:
    """Vertices (n, 3) [m] in the body frame and outward triangles (m, 3) of a bounded shape.

    Corners of spheres and capsules lie on the true surface; ``around`` of them make a circle. Raises `InvalidValueError` for a
    shape without end, or of a kind unknown here.
    """
    if isinstance(shape, Polyhedron):
        return shape.vertices, shape.faces
    if isinstance(shape, Box):
        return _box(shape)
    if isinstance(shape, Sphere):
        return _capsule(shape.radius, 0.0, around)
    if isinstance(shape, Capsule):
        return _capsule(shape.radius, shape.length, around)
    if isinstance(shape, Compound):
        return _joined(shape, around)
    raise InvalidValueError(f"a {shape.kind or type(shape).__name__} cannot be made of triangles")


def _box(shape: Box) -> tuple[Array, Indices]:
    x, y, z = (0.5 * edge for edge in shape.size)
    corners = np.array([(i, j, k) for i in (-x, x) for j in (-y, y) for k in (-z, z)])
    squares = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    return corners, np.array([face for a, b, c, d in squares for face in ((a, b, c), (a, c, d))])


def _capsule(radius: float, length: float, around: int) -> tuple[Array, Indices]:
    """Two half spheres in rings about z, ``length`` apart; of a sphere they share the middle ring."""
    half = max(around // 4, 2)
    rings: list[tuple[float, float]] = []
    for sign in (1.0, -1.0):
        steps = range(1, half + 1) if sign > 0 else range(half if length > 0.0 else half - 1, 0, -1)
        for k in steps:
            angle = 0.5 * math.pi * k / half
            height = 0.0 if k == half else radius * math.cos(angle)
            rings.append((radius * math.sin(angle), sign * (0.5 * length + height)))
    turn = [2.0 * math.pi * k / around for k in range(around)]
    top = 0.5 * length + radius
    places = [(0.0, 0.0, top)]
    places += [(r * math.cos(a), r * math.sin(a), z) for r, z in rings for a in turn]
    places.append((0.0, 0.0, -top))
    faces = [(0, 1 + k, 1 + (k + 1) % around) for k in range(around)]
    for ring in range(len(rings) - 1):
        a, b = 1 + ring * around, 1 + (ring + 1) * around
        for k in range(around):
            n = (k + 1) % around
            faces += [(a + k, b + k, b + n), (a + k, b + n, a + n)]
    last, end = 1 + (len(rings) - 1) * around, len(places) - 1
    faces += [(last + k, end, last + (k + 1) % around) for k in range(around)]
    return np.array(places), np.array(faces)


def _joined(shape: Compound, around: int) -> tuple[Array, Indices]:
    places, faces, count = [], [], 0
    for part in shape.parts:
        own, corners = triangles(part.shape, around)
        pose = to_pose(part.position, part.orientation)
        places.append(own @ pose[:3, :3].T + pose[:3, 3])
        faces.append(corners + count)
        count += len(own)
    return np.concatenate(places), np.concatenate(faces)
