"""How far two shapes are apart, and where they are nearest; of overlapping ones the depth.

Round shapes by their centres, planes by what reaches deepest, the rest by the convex cores of the narrow phase. Of compounds the two parts that are
nearest, or deepest in each other, count. A mesh is a surface without inside: a solid is no deeper in it than it is round.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from xpheve.errors import ContactError, InvalidValueError
from xpheve.kernels.quaternion import Quat, rotate, rotate_inverse
from xpheve.kernels.vector import Vec, add, dot, scale, sub
from xpheve.queries import Separation
from xpheve_laws_collision.narrow_phase import Mover
from xpheve_laws_collision.narrow_phase.cores import Array, Core, cores_of, matrix
from xpheve_laws_collision.narrow_phase.gjk import nearest
from xpheve_laws_collision.narrow_phase.standing import Standing
from xpheve_laws_collision.queries.surface import Foot, Posed, foot_on, leaves_of, on_triangles

STILL: Vec = (0.0, 0.0, 0.0)


def separation(a: Posed, b: Posed) -> Separation:
    """Distance [m], nearest points [m] and unit normal from ``a`` to ``b``, which may be compounds.

    Raises
    ------
    ContactError
        If both are meshes, or one is of a kind that nobody here knows.
    InvalidValueError
        If both are planes.
    """
    pairs = [(one, two) for one in leaves_of(*a) for two in leaves_of(*b)]
    return min((_of_leaves(one, two) for one, two in pairs), key=lambda found: found.distance)


def _of_leaves(a: Posed, b: Posed) -> Separation:
    kinds = (a.shape.kind, b.shape.kind)
    if kinds[0] == "sphere":
        return _from_ball(a, b)
    if kinds[1] == "sphere" or kinds[0] == "plane" or (kinds[0] == "mesh" and kinds[1] != "plane"):
        if kinds[0] == kinds[1]:
            raise _refused(a, b)
        return _flipped(_of_leaves(b, a))
    if kinds[1] == "plane":
        return _above(a, b)
    return _to_mesh(a, b) if kinds[1] == "mesh" else _convex(a, b)


def _refused(a: Posed, b: Posed) -> Exception:
    if a.shape.kind == "plane":
        return InvalidValueError(
            f"{a.shape!r} and {b.shape!r}: planes have no end, so no distance; ask of bounded objects"
        )
    return ContactError(
        f"{a.shape!r} and {b.shape!r}: no distance between meshes is known; make one a Hull, or a Compound of convex parts"
    )


def _flipped(found: Separation) -> Separation:
    x, y, z = found.normal
    return Separation(found.distance, found.point_b, found.point_a, (0.0 - x, 0.0 - y, 0.0 - z))


def _from_ball(ball: Posed, b: Posed) -> Separation:
    radius = ball.shape.radius
    foot = foot_at(b, ball.position)
    inward = scale(foot.normal, -1.0)
    return Separation(foot.distance - radius, add(ball.position, scale(inward, radius)), foot.point, inward)


def foot_at(b: Posed, point: Vec) -> Foot:
    """The nearest point of any shape to ``point`` [m]."""
    if b.shape.kind != "plane":
        return foot_on(*b, point)
    outward, level = half_space(b)
    height = dot(outward, point) - level
    return Foot(height, sub(point, scale(outward, height)), outward)


def half_space(plane: Posed) -> tuple[Vec, float]:
    """Outward unit normal and level [m] of a plane in the world."""
    outward = rotate(plane.orientation, plane.shape.normal)
    return outward, dot(outward, plane.position) + plane.shape.offset


def _above(a: Posed, plane: Posed) -> Separation:
    """By the point of ``a`` that reaches deepest; of several the middle."""
    outward, level = half_space(plane)
    down = np.array(rotate_inverse(a.orientation, outward))
    vertices, radius = _corners(a.shape)
    heights = vertices @ down
    lowest = float(heights.min())
    deepest = vertices[heights <= lowest + 1e-12 * (abs(lowest) + 1e-3 * float(np.abs(vertices).max()))].mean(axis=0)
    point = sub(add(a.position, rotate(a.orientation, _vec(deepest))), scale(outward, radius))
    height = dot(outward, a.position) - level + lowest - radius
    return Separation(height, point, sub(point, scale(outward, height)), scale(outward, -1.0))


def _corners(shape: Any) -> tuple[Array, float]:
    """What stands out of a shape: corners in its frame, and the radius about them."""
    if shape.kind == "mesh":
        return np.asarray(shape.vertices, dtype=float)[np.unique(np.asarray(shape.faces))], 0.0
    core = cores_of(shape)[0]
    return core.vertices, core.radius


def _convex(a: Posed, b: Posed) -> Separation:
    one, two = cores_of(a.shape)[0], cores_of(b.shape)[0]
    at_rest_a = Mover(a.position, STILL, STILL, a.orientation, a.shape)
    at_rest_b = Mover(b.position, STILL, STILL, b.orientation, b.shape)
    stand = Standing(at_rest_a, at_rest_b, one, two)
    n = stand.normal
    if stand.witness is not None:
        on_a = add(add(a.position, stand.witness), scale(n, one.radius))
        return Separation(stand.separation, on_a, add(on_a, scale(n, stand.separation)), n)
    # Flat to each other, or overlapping: a point that they touch at, moved onto both faces.
    place = stand.gap().point
    top = dot(n, a.position) + _farthest(one, a.orientation, n) + one.radius
    low = dot(n, b.position) - _farthest(two, b.orientation, scale(n, -1.0)) - two.radius
    along = dot(n, place)
    return Separation(stand.separation, add(place, scale(n, top - along)), add(place, scale(n, low - along)), n)


def _farthest(core: Core, q: Quat, direction: Vec) -> float:
    return float((core.vertices @ np.array(rotate_inverse(q, direction))).max())


def _to_mesh(a: Posed, mesh: Posed) -> Separation:
    """By its triangles, nearest first, as far as they may be nearer than the best."""
    core = cores_of(a.shape)[0]
    turn = matrix(mesh.orientation)
    corners = np.asarray(mesh.shape.vertices, dtype=float)[np.asarray(mesh.shape.faces)] @ turn.T
    corners = corners + np.array(sub(mesh.position, a.position))
    vertices = core.vertices @ matrix(a.orientation).T
    from_centre = np.sqrt((on_triangles(corners, np.zeros(3)) ** 2).sum(axis=1))
    best: Separation | None = None
    for k in np.argsort(from_centre, kind="stable").tolist():
        if best is not None and from_centre[k] - core.reach >= best.distance:
            break
        found = nearest(vertices, corners[k], core.reach + float(from_centre[k]))
        if found is None:
            return _crossing(a, corners[k], core)
        on_a = add(found.on_a, scale(found.normal, core.radius))
        distance = found.distance - core.radius
        if best is None or distance < best.distance:
            best = Separation(distance, add(a.position, on_a), add(a.position, found.on_b), found.normal)
    if best is None:
        raise ContactError(f"{mesh.shape!r} has no triangles")
    return best


def _crossing(a: Posed, triangle: Array, core: Core) -> Separation:
    """The surface goes through ``a``: no distance, a point of the triangle near the centre, and its normal."""
    point = add(a.position, _vec(on_triangles(triangle[None], np.zeros(3))[0]))
    normal = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
    size = float(np.linalg.norm(normal))
    n = _vec(normal / size) if size > 0.0 else (0.0, 0.0, 1.0)
    return Separation(-core.radius, point, point, n)


def _vec(row: Array) -> Vec:
    return float(row[0]), float(row[1]), float(row[2])


__all__ = ["foot_at", "half_space", "separation"]
