"""Where a straight line goes into a shape and comes out of it."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from xpheve.kernels.quaternion import Quat, multiply, rotate, rotate_inverse
from xpheve.kernels.vector import Vec, add, cross, dot, norm, scale, sub


class Crossing(NamedTuple):
    """Way [m] along the line, from its origin, to where it enters and leaves; outward unit normal where it enters, world frame."""

    enters: float
    leaves: float
    normal: Vec


def crossing(shape: Any, origin: Vec, direction: Vec, q: Quat) -> Crossing | None:
    """The line ``origin`` + t ``direction`` (unit, both in the shape's frame) through ``shape``, turned by ``q``; None if it goes by.

    A line that only touches goes by, and one goes by a point (shape None) unless it begins there. Of a compound, or of a mesh, the first
    entry and the last exit.
    """
    if shape is None:
        return Crossing(0.0, 0.0, (0.0, 0.0, 0.0)) if not any(origin) else None
    if shape.kind == "compound":
        return _of_parts(shape, origin, direction, q)
    found = (
        _SHAPES[shape.kind](shape, origin, direction)
        if shape.kind in _SHAPES
        else _sphere(shape.reach, origin, direction)
    )
    if found is None:
        return None
    enters, leaves, normal = found
    return Crossing(enters, leaves, rotate(q, normal))


Found = tuple[float, float, Vec] | None


def _sphere(radius: float, origin: Vec, direction: Vec) -> Found:
    along = -dot(origin, direction)
    nearest = add(origin, scale(direction, along))
    square = radius * radius - dot(nearest, nearest)
    if square <= 0.0:
        return None
    half = math.sqrt(square)
    return along - half, along + half, scale(add(origin, scale(direction, along - half)), 1.0 / radius)


def _slabs(slabs: list[tuple[Vec, float]], origin: Vec, direction: Vec) -> Found:
    """Through the half-spaces normal . x <= level."""
    enters, leaves, normal = -math.inf, math.inf, (0.0, 0.0, 0.0)
    for outward, level in slabs:
        fall, height = dot(outward, direction), level - dot(outward, origin)
        if fall == 0.0:
            if height < 0.0:
                return None
        elif fall < 0.0:
            if height / fall > enters:
                enters, normal = height / fall, outward
        else:
            leaves = min(leaves, height / fall)
    return (enters, leaves, normal) if enters < leaves else None


def _box(shape: Any, origin: Vec, direction: Vec) -> Found:
    slabs: list[tuple[Vec, float]] = []
    for k, edge in enumerate(shape.size):
        for sign in (1.0, -1.0):
            x, y, z = (sign if k == axis else 0.0 for axis in range(3))
            slabs.append(((x, y, z), 0.5 * edge))
    return _slabs(slabs, origin, direction)


def _hull(shape: Any, origin: Vec, direction: Vec) -> Found:
    slabs: list[tuple[Vec, float]] = []
    for face in shape.faces:
        a, b, c = (_corner(shape.vertices[k]) for k in face)
        outward = cross(sub(b, a), sub(c, a))
        size = norm(outward)
        if size > 0.0:
            outward = scale(outward, 1.0 / size)
            level = dot(outward, a)
            slabs.append((outward, level) if level >= 0.0 else (scale(outward, -1.0), -level))
    return _slabs(slabs, origin, direction)


def _corner(row: Any) -> Vec:
    return float(row[0]), float(row[1]), float(row[2])


def _capsule(shape: Any, origin: Vec, direction: Vec) -> Found:
    """The cylinder between the ends, and the two spheres: first entry, last exit."""
    radius, half = shape.radius, 0.5 * shape.length
    found: list[tuple[float, float, Vec]] = []
    for end in (-half, half):
        ball = _sphere(radius, (origin[0], origin[1], origin[2] - end), direction)
        if ball is not None:
            found.append(ball)
    a = direction[0] ** 2 + direction[1] ** 2
    b = origin[0] * direction[0] + origin[1] * direction[1]
    inside = b * b - a * (origin[0] ** 2 + origin[1] ** 2 - radius * radius)
    if a > 0.0 and inside > 0.0:
        root = math.sqrt(inside)
        walls = [(-b - root) / a, (-b + root) / a]
        heights = [origin[2] + t * direction[2] for t in walls]
        x, y = (origin[k] + walls[0] * direction[k] for k in (0, 1))
        normal = (x / radius, y / radius, 0.0)
        if abs(heights[0]) <= half:
            found.append((walls[0], walls[0], normal))
        if abs(heights[1]) <= half:
            found.append((walls[1], walls[1], normal))
    if not found:
        return None
    first = min(found, key=lambda one: one[0])
    return first[0], max(one[1] for one in found), first[2]


def _mesh(shape: Any, origin: Vec, direction: Vec) -> Found:
    """By the triangles that the line goes through (Moeller and Trumbore, J. Graphics Tools 2 (1997) 21)."""
    corners = np.asarray(shape.vertices, dtype=float)[np.asarray(shape.faces)]
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    o, d = np.array(origin), np.array(direction)
    p = np.cross(d, two)
    det = (one * p).sum(axis=1)
    hit = det != 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        s = o - corners[:, 0]
        u = (s * p).sum(axis=1) / det
        r = np.cross(s, one)
        v = (r @ d) / det
        t = (two * r).sum(axis=1) / det
    hit &= (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0)
    if not hit.any():
        return None
    places = np.flatnonzero(hit)
    first = places[int(np.argmin(t[places]))]
    outward = np.cross(one[first], two[first])
    outward = outward / np.linalg.norm(outward)
    if float(outward @ d) > 0.0:
        outward = -outward
    x, y, z = outward.tolist()
    return float(t[first]), float(t[places].max()), (x, y, z)


def _of_parts(shape: Any, origin: Vec, direction: Vec, q: Quat) -> Crossing | None:
    found = []
    for part in shape.parts:
        local = rotate_inverse(part.orientation, sub(origin, part.position))
        along = rotate_inverse(part.orientation, direction)
        one = crossing(part.shape, local, along, multiply(q, part.orientation))
        if one is not None:
            found.append(one)
    if not found:
        return None
    first = min(found, key=lambda one: one.enters)
    return first._replace(leaves=max(one.leaves for one in found))


_SHAPES: dict[str, Any] = {
    "sphere": lambda shape, origin, direction: _sphere(shape.radius, origin, direction),
    "box": _box,
    "capsule": _capsule,
    "hull": _hull,
    "mesh": _mesh,
}
