"""Which point of a shape's surface is nearest to a place: closed forms in arrays, and one by one for hulls, compounds and meshes.

Distances are negative inside; of a compound the part that the place is nearest to, or deepest in, counts, and a mesh is a surface without inside.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from xpheve.kernels.quaternion import Quat, multiply, normalize, rotate, rotate_inverse
from xpheve.kernels.vector import Vec, add, scale, sub
from xpheve_laws_collision.narrow_phase.cores import Core, cores_of
from xpheve_laws_collision.narrow_phase.gjk import nearest
from xpheve_laws_collision.queries.casting import unknown
from xpheve_laws_collision.queries.places import BOX, CAPSULE, OTHER, PLANE, ROUND, Places
from xpheve_laws_collision.queries.rows import Array, Rows, crosses, dots, lengths, turned, turned_back, units

UPWARDS: Vec = (0.0, 0.0, 1.0)


class Posed(NamedTuple):
    """A shape that is no compound, at its pose in the world."""

    shape: Any
    position: Vec
    orientation: Quat


class Foot(NamedTuple):
    """Distance [m] of a place, negative inside; the nearest point of the surface [m], and its outward unit normal."""

    distance: float
    point: Vec
    normal: Vec


Feet = tuple[Array, Array, Array]


def feet(places: Places, rows: Rows, point: Array) -> Feet:
    """Pair by pair, the object of ``rows`` (p,) and ``point`` (p, 3) [m]: distances (p,), points (p, 3), normals (p, 3)."""
    distance, foot, normal = np.empty(len(rows)), np.empty((len(rows), 3)), np.empty((len(rows), 3))
    kinds = places.kind[rows]
    for kind in np.unique(kinds).tolist():
        part = np.flatnonzero(kinds == kind)
        distance[part], foot[part], normal[part] = _OF[kind](places, rows[part], point[part])
    return distance, foot, normal


def _round(places: Places, rows: Rows, point: Array) -> Feet:
    away, radius = point - places.position[rows], places.size[rows, 0]
    length, normal = units(away, UPWARDS)
    return length - radius, places.position[rows] + radius[:, None] * normal, normal


def _plane(places: Places, rows: Rows, point: Array) -> Feet:
    normal, level = places.normals(rows)
    height = dots(normal, point) - level
    return height, point - height[:, None] * normal, normal


def _box(places: Places, rows: Rows, point: Array) -> Feet:
    q, half = places.orientation[rows], places.size[rows, :3]
    p = turned_back(q, point - places.position[rows])
    foot = np.clip(p, -half, half)
    length, normal = units(p - foot, UPWARDS)
    inside = np.flatnonzero(length == 0.0)
    depth = (half - np.abs(p))[inside]
    axis = np.argmin(depth, axis=1)
    side = np.copysign(1.0, p[inside, axis])
    normal[inside] = 0.0
    normal[inside, axis] = side
    foot[inside, axis] = side * half[inside, axis]
    length[inside] = -depth[np.arange(len(inside)), axis]
    return length, places.position[rows] + turned(q, foot), turned(q, normal)


def _capsule(places: Places, rows: Rows, point: Array) -> Feet:
    q, radius, half = places.orientation[rows], places.size[rows, 0], places.size[rows, 1]
    p = turned_back(q, point - places.position[rows])
    core = np.zeros((len(rows), 3))
    core[:, 2] = np.clip(p[:, 2], -half, half)
    length, normal = units(p - core, (1.0, 0.0, 0.0))
    return length - radius, places.position[rows] + turned(q, core + radius[:, None] * normal), turned(q, normal)


def _other(places: Places, rows: Rows, point: Array) -> Feet:
    found = [foot_on(places.shape(row), *places.pose(row), _vec(point[k])) for k, row in enumerate(rows.tolist())]
    values = [np.array(column, dtype=float) for column in zip(*found, strict=True)]
    return values[0], values[1].reshape(-1, 3), values[2].reshape(-1, 3)


_OF = {ROUND: _round, PLANE: _plane, BOX: _box, CAPSULE: _capsule, OTHER: _other}


# One by one


def leaves_of(shape: Any, position: Vec, orientation: Quat) -> Iterator[Posed]:
    """``shape``, or the parts of a compound, in the world."""
    if shape.kind != "compound":
        if shape.kind not in ("sphere", "plane", "box", "capsule", "hull", "mesh"):
            raise unknown(shape)
        yield Posed(shape, position, orientation)
        return
    for part in shape.parts:
        turn = normalize(multiply(orientation, part.orientation))
        yield from leaves_of(part.shape, add(position, rotate(orientation, part.position)), turn)


def foot_on(shape: Any, position: Vec, orientation: Quat, point: Vec) -> Foot:
    """The nearest point of any shape but a plane to ``point`` [m]."""
    found = []
    for leaf in leaves_of(shape, position, orientation):
        local = rotate_inverse(leaf.orientation, sub(point, leaf.position))
        one = _on_mesh(leaf.shape, local) if leaf.shape.kind == "mesh" else _on_core(cores_of(leaf.shape)[0], local)
        there = add(leaf.position, rotate(leaf.orientation, one.point))
        found.append(Foot(one.distance, there, rotate(leaf.orientation, one.normal)))
    return min(found, key=lambda one: one.distance)


def _on_core(core: Core, p: Vec) -> Foot:
    """In the frame of the core: by its faces from inside, by the nearest points from outside."""
    place = np.array(p)
    if core.solid:
        heights = core.normals @ place - (core.vertices @ core.normals.T).max(axis=0)
        k = int(np.argmax(heights))
        if heights[k] <= 0.0:
            normal = _vec(core.normals[k])
            return Foot(float(heights[k]), sub(p, scale(normal, float(heights[k]))), normal)
    found = nearest(place[None, :], core.vertices, core.reach)
    if found is None:
        return Foot(-core.radius, add(p, scale(UPWARDS, core.radius)), UPWARDS)
    normal = scale(found.normal, -1.0)
    return Foot(found.distance - core.radius, add(found.on_b, scale(normal, core.radius)), normal)


def _on_mesh(shape: Any, p: Vec) -> Foot:
    corners = np.asarray(shape.vertices, dtype=float)[np.asarray(shape.faces)]
    points = on_triangles(corners, np.array(p))
    distances = lengths(points - np.array(p))
    k = int(np.argmin(distances))
    if distances[k] > 0.0:
        return Foot(float(distances[k]), _vec(points[k]), _vec((np.array(p) - points[k]) / distances[k]))
    normal = np.cross(corners[k, 1] - corners[k, 0], corners[k, 2] - corners[k, 0])
    return Foot(0.0, p, _vec(normal / np.linalg.norm(normal)))


def on_triangles(corners: Array, p: Array) -> Array:
    """The nearest point (n, 3) of each triangle (n, 3, 3) to ``p``: the foot in its plane if that is inside, else on a side."""
    best, least = np.empty((len(corners), 3)), np.full(len(corners), math.inf)
    for k in range(3):
        start, along = corners[:, k], corners[:, (k + 1) % 3] - corners[:, k]
        square = dots(along, along)
        part = np.clip(dots(p - start, along) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
        on = start + part[:, None] * along
        away = dots(p - on, p - on)
        nearer = away < least
        best[nearer], least[nearer] = on[nearer], away[nearer]
    normal = crosses(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    square = dots(normal, normal)
    inside = square > 0.0
    for k in range(3):
        inside &= dots(crosses(corners[:, (k + 1) % 3] - corners[:, k], p - corners[:, k]), normal) >= 0.0
    height = dots(p - corners[:, 0], normal) / np.where(square > 0.0, square, 1.0)
    best[inside] = (p - height[:, None] * normal)[inside]
    return best


def _vec(row: Any) -> Vec:
    return float(row[0]), float(row[1]), float(row[2])


__all__ = ["Foot", "Posed", "feet", "foot_on", "leaves_of", "on_triangles"]
