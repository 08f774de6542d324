"""Where rays come to shapes: closed forms in arrays for spheres, planes, boxes and capsules, `rays.crossing` one by one for all others.

All take pairs of a ray and an object, row by row, and give the way (p,) [m] to the surface, infinite where there is none, and the outward unit
normal (p, 3) there. A solid in which a ray begins is hit where it begins, and the normal points against the ray. ``grown`` by a radius [m], round
shapes and planes are met as a ball of that radius meets them.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from xpheve.errors import ContactError
from xpheve.kernels.quaternion import Quat, multiply, rotate, rotate_inverse
from xpheve.kernels.vector import Vec, cross, dot, norm, scale, sub
from xpheve_laws_collision.queries.places import BOX, CAPSULE, OTHER, PLANE, ROUND, Places
from xpheve_laws_collision.queries.rows import Array, Mask, Rows, crosses, dots, lengths, turned, turned_back
from xpheve_laws_collision.rays import crossing

SEAM = 1e-11  # of its sides a triangle is met outside them: a ray along the seam of two does not slip through
LEVEL = 1e-12  # a ray this little inclined to a triangle lies in its plane, and meets others at its sides
Met = tuple[Array, Array]


def cast(places: Places, rows: Rows, origin: Array, direction: Array, grown: float = 0.0) -> Met:
    """Pair by pair: the object of ``rows`` (p,) and the ray from ``origin`` (p, 3) [m] along the unit vectors ``direction`` (p, 3)."""
    way, normal = np.full(len(rows), math.inf), np.full((len(rows), 3), math.nan)
    kinds = places.kind[rows]
    for kind in np.unique(kinds).tolist():
        part = np.flatnonzero(kinds == kind)
        way[part], normal[part] = _OF[kind](places, rows[part], origin[part], direction[part], grown)
    return way, normal


def _met(enters: Array, leaves: Array, hit: Mask, normal: Array, out: Array, direction: Array, touch: Array) -> Met:
    """What touches where the ray begins is met if the ray goes in, and not if it goes out, which it does at ``out`` as the cosine to the normal.

    How deep the ray begins is measured from the tangent planes where it comes in and where it goes out, since a ray goes far in a thin skin.
    """
    with np.errstate(invalid="ignore"):
        hit = hit & (leaves * out > touch) & (leaves > 0.0)
        inside = (enters < 0.0) & ~(np.abs(enters * dots(normal, direction)) <= touch)
    way = np.where(hit, np.where(inside, 0.0, np.maximum(enters, 0.0)), math.inf)
    return way, np.where(inside[:, None], -direction, normal)


def _round(places: Places, rows: Rows, origin: Array, direction: Array, grown: float) -> Met:
    radius = places.size[rows, 0] + grown
    from_centre = origin - places.position[rows]
    along = -dots(from_centre, direction)
    nearest = from_centre + along[:, None] * direction
    square = radius * radius - dots(nearest, nearest)
    half = np.sqrt(np.maximum(square, 0.0))
    normal = nearest - half[:, None] * direction
    normal /= np.where(radius > 0.0, radius, 1.0)[:, None]
    touch = places.touch(rows, origin) + 1e-12 * grown
    out = half / np.where(radius > 0.0, radius, 1.0)
    return _met(along - half, along + half, square > 0.0, normal, out, direction, touch)


def _plane(places: Places, rows: Rows, origin: Array, direction: Array, grown: float) -> Met:
    outward, level = places.normals(rows)
    height = dots(outward, origin) - (level + grown)
    fall = -dots(outward, direction)
    touch = places.touch(rows, origin) + 1e-12 * grown
    with np.errstate(divide="ignore", invalid="ignore"):
        enters = np.where(height < -touch, -math.inf, np.where(fall > 0.0, height / fall, math.inf))
    hit = (height < -touch) | (fall > 0.0)
    return _met(enters, np.full(len(rows), math.inf), hit, outward, np.ones(len(rows)), direction, touch)


def _box(places: Places, rows: Rows, origin: Array, direction: Array, grown: float) -> Met:
    q, half = places.orientation[rows], places.size[rows, :3]
    o = turned_back(q, origin - places.position[rows])
    d = turned_back(q, direction)
    with np.errstate(divide="ignore", invalid="ignore"):
        one, two = (-half - o) / d, (half - o) / d
    level = d == 0.0
    beside = level & (np.abs(o) > half)
    near = np.where(level, -math.inf, np.minimum(one, two))
    far = np.where(level, math.inf, np.maximum(one, two))
    axis = np.argmax(near, axis=1)
    k = np.arange(len(rows))
    normal = np.zeros((len(rows), 3))
    normal[k, axis] = -np.sign(d[k, axis])
    last = np.argmin(far, axis=1)
    enters, leaves = near[k, axis], far[k, last]
    hit = (enters < leaves) & ~beside.any(axis=1)
    return _met(enters, leaves, hit, turned(q, normal), np.abs(d[k, last]), direction, places.touch(rows, origin))


def _capsule(places: Places, rows: Rows, origin: Array, direction: Array, grown: float) -> Met:
    """First entry into, last exit from, the two balls and the wall between them."""
    q, radius, half = places.orientation[rows], places.size[rows, 0], places.size[rows, 1]
    o = turned_back(q, origin - places.position[rows])
    d = turned_back(q, direction)
    enters, leaves = np.full(len(rows), math.inf), np.full(len(rows), -math.inf)
    normal, behind = np.zeros((len(rows), 3)), np.zeros((len(rows), 3))

    def take(when: Array, hit: Mask, centre: Array) -> None:
        first, last = hit & (when < enters), hit & (when > leaves)
        outward = (o + when[:, None] * d) - centre
        enters[first], leaves[last] = when[first], when[last]
        normal[first] = outward[first] / radius[first, None]
        behind[last] = outward[last] / radius[last, None]

    for sign in (-1.0, 1.0):
        end = np.zeros((len(rows), 3))
        end[:, 2] = sign * half
        along = -dots(o - end, d)
        nearest = o - end + along[:, None] * d
        square = radius * radius - dots(nearest, nearest)
        root = np.sqrt(np.maximum(square, 0.0))
        for when in (along - root, along + root):
            take(when, square > 0.0, end)
    across = d[:, 0] ** 2 + d[:, 1] ** 2
    b = o[:, 0] * d[:, 0] + o[:, 1] * d[:, 1]
    square = radius * radius * across - (o[:, 0] * d[:, 1] - o[:, 1] * d[:, 0]) ** 2
    root = np.sqrt(np.maximum(square, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        for when in ((-b - root) / across, (-b + root) / across):
            height = o[:, 2] + when * d[:, 2]
            axis = np.zeros((len(rows), 3))
            axis[:, 2] = height
            take(when, (across > 0.0) & (square > 0.0) & (np.abs(height) <= half), axis)
    touch = places.touch(rows, origin)
    return _met(enters, leaves, enters < leaves, turned(q, normal), dots(behind, d), direction, touch)


def _other(places: Places, rows: Rows, origin: Array, direction: Array, grown: float) -> Met:
    way, normal = np.full(len(rows), math.inf), np.full((len(rows), 3), math.nan)
    touch = places.touch(rows, origin)
    for k, row in enumerate(rows.tolist()):
        x, q = places.pose(row)
        o = rotate_inverse(q, sub(_vec(origin[k]), x))
        d = rotate_inverse(q, _vec(direction[k]))
        found = _ahead(places.shape(row), o, d, q, float(touch[k]))
        if found is not None:
            way[k], normal[k] = found
    return way, normal


def _ahead(shape: Any, o: Vec, d: Vec, q: Quat, touch: float) -> tuple[float, Vec] | None:
    """Way to ``shape`` from ``o`` along ``d``, both in its frame, and the outward normal in the world; None if the ray goes by."""
    if shape.kind == "compound":
        found = []
        for part in shape.parts:
            local = rotate_inverse(part.orientation, sub(o, part.position))
            along = rotate_inverse(part.orientation, d)
            one = _ahead(part.shape, local, along, multiply(q, part.orientation), touch)
            if one is not None:
                found.append(one)
        return min(found, key=lambda one: one[0], default=None)
    if shape.kind == "mesh":
        return _mesh(shape, o, d, q, touch)
    if shape.kind not in ("sphere", "box", "capsule", "hull"):
        raise unknown(shape)
    through = crossing(shape, o, d, q)
    if through is None or through.leaves <= 0.0:
        return None
    if through.enters >= 0.0:
        return through.enters, through.normal
    along = rotate(q, d)
    back = crossing(shape, o, scale(d, -1.0), q)
    if back is not None and through.leaves * dot(back.normal, along) <= touch:
        return None
    if through.enters * dot(through.normal, along) <= touch:
        return 0.0, through.normal
    return 0.0, scale(along, -1.0)


def _mesh(shape: Any, o: Vec, d: Vec, q: Quat, touch: float) -> tuple[float, Vec] | None:
    """The first triangle ahead, from either side (Moeller & Trumbore, J. Graphics Tools 2 (1997) 21)."""
    corners = np.asarray(shape.vertices, dtype=float)[np.asarray(shape.faces)]
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    along = np.array(d)
    p = np.cross(along, two)
    volume = (one * p).sum(axis=1)
    s = np.array(o) - corners[:, 0]
    r = np.cross(s, one)
    with np.errstate(divide="ignore", invalid="ignore"):
        u, v, t = (s * p).sum(axis=1) / volume, (r @ along) / volume, (two * r).sum(axis=1) / volume
        across = np.abs(volume) > LEVEL * lengths(crosses(one, two))
        hit = across & (u >= -SEAM) & (v >= -SEAM) & (u + v <= 1.0 + SEAM) & (t > touch)
    if not hit.any():
        return None
    k = int(np.argmin(np.where(hit, t, math.inf)))
    n = cross(_vec(one[k]), _vec(two[k]))
    n = scale(n, (-1.0 if dot(n, d) > 0.0 else 1.0) / norm(n))
    return float(t[k]), rotate(q, n)


def unknown(shape: Any) -> ContactError:
    """The error for a shape of another kind."""
    return ContactError(
        f"{shape!r}: no query knows a shape of kind {shape.kind!r}; known: sphere, plane, box, capsule, hull, mesh, compound. "
        "Leave the object out by exclude=, or give it one of these"
    )


def _vec(row: Array) -> Vec:
    return float(row[0]), float(row[1]), float(row[2])


_OF = {ROUND: _round, PLANE: _plane, BOX: _box, CAPSULE: _capsule, OTHER: _other}

__all__ = ["cast", "unknown"]
