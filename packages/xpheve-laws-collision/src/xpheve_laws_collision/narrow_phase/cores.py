"""Shapes as convex cores: the points within a radius of a point, a segment, a triangle or a polyhedron.

A sphere is a point and its radius, a capsule a segment and its radius, a box or hull a polyhedron and no radius, and a
compound several of these, each at its place in the body frame (van den Bergen, Collision Detection in Interactive 3D
Environments, 2003, chapter 4). A plane is the half space behind it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from xpheve.errors import ContactError
from xpheve.kernels.quaternion import Quat, multiply, normalize, rotate
from xpheve_laws_collision.narrow_phase import Vec

Array = NDArray[np.float64]

COPLANAR = 1e-10  # triangles whose normals (as unit vectors) and planes (of the size) agree to this are one face
MANY = 60  # edges of a core whose parallel ones are not looked for
KEPT = 4096  # shapes whose cores are remembered

_BOX_FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


class Core:
    """A convex core in the body frame."""

    __slots__ = ("corners", "directions", "edge_normals", "edges", "normals", "radius", "reach", "solid", "vertices")

    def __init__(self, vertices: Array, radius: float, faces: list[tuple[int, ...]] | None = None) -> None:
        self.vertices = vertices
        self.corners: list[Vec] = [(float(x), float(y), float(z)) for x, y, z in vertices]
        """The same as floats: a few are walked faster than an array is asked."""
        self.radius = radius
        self.solid = faces is not None
        """Whether the core is a polyhedron."""
        self.normals: Array = np.zeros((0, 3))
        """Outward unit normals of the faces; of a flat core, what else could part it from another one."""
        self.edges: list[tuple[int, int]] = []
        self.directions: Array = np.zeros((0, 3))
        """Unit vectors along the edges, parallel ones once."""
        self.edge_normals: Array = np.zeros((0, 2, 3))
        """Of a polyhedron: by edge the normals of its two faces."""
        self.reach = float(np.sqrt((vertices * vertices).sum(axis=1)).max()) + radius
        """Greatest distance [m] of a point from the body's centre."""
        if faces is not None:
            self._take_faces(faces)
        elif len(vertices) > 1:
            self._take_flat()

    def _take_faces(self, faces: list[tuple[int, ...]]) -> None:
        self.normals = np.array([_face_normal(self.vertices[list(face)]) for face in faces])
        sides: dict[tuple[int, int], list[int]] = {}
        for k, face in enumerate(faces):
            for i, j in zip(face, face[1:] + face[:1], strict=True):
                sides.setdefault((min(i, j), max(i, j)), []).append(k)
        self.edges = sorted(edge for edge, both in sides.items() if len(both) == 2)
        self.edge_normals = np.array([[self.normals[k] for k in sides[edge]] for edge in self.edges])
        self.directions = _directions(self.vertices, self.edges)

    def _take_flat(self) -> None:
        n = len(self.vertices)
        self.edges = [(0, 1)] if n == 2 else [(k, (k + 1) % n) for k in range(n)]
        self.directions = _directions(self.vertices, self.edges)
        if n == 2:
            along = self.directions[0]
            across = np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))])
            across = across / np.linalg.norm(across)
            other = np.cross(along, across)
            self.normals = np.array([across, -across, other, -other])
        else:
            normal = _face_normal(self.vertices)
            inside = np.cross(self.directions, normal)
            self.normals = np.concatenate([[normal, -normal], inside, -inside])


class Half:
    """The half space behind a plane: outward unit ``normal`` and ``offset`` [m] in the body frame."""

    __slots__ = ("normal", "offset")

    def __init__(self, normal: Vec, offset: float) -> None:
        self.normal = normal
        self.offset = offset


_known: dict[int, tuple[Any, tuple[Core, ...]]] = {}


def cores_of(shape: Any) -> tuple[Core, ...]:
    """The cores of a shape that is not a plane, in the body frame."""
    held = _known.get(id(shape))
    if held is not None and held[0] is shape:
        return held[1]
    cores = tuple(_cores(shape, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)))
    if len(_known) >= KEPT:
        _known.clear()
    _known[id(shape)] = (shape, cores)  # with the shape itself, so that its id stays its own
    return cores


def _cores(shape: Any, position: Vec, orientation: Quat) -> list[Core]:
    kind = shape.kind
    if kind == "compound":
        return [
            core
            for part in shape.parts
            for core in _cores(part.shape, *_posed(position, orientation, part.position, part.orientation))
        ]
    if kind == "sphere":
        return [Core(_placed(np.zeros((1, 3)), position, orientation), shape.radius)]
    if kind == "capsule":
        half = 0.5 * shape.length
        ends = np.array([(0.0, 0.0, -half), (0.0, 0.0, half)])
        return [Core(_placed(ends, position, orientation), shape.radius)]
    if kind == "box":
        x, y, z = (0.5 * edge for edge in shape.size)
        corners = np.array([(i, j, k) for i in (-x, x) for j in (-y, y) for k in (-z, z)])
        return [Core(_placed(corners, position, orientation), 0.0, list(_BOX_FACES))]
    if kind == "hull":
        points = np.asarray(shape.vertices, dtype=np.float64)
        faces = merged_faces(points, np.asarray(shape.faces))
        used = sorted({k for face in faces for k in face})
        place = {old: new for new, old in enumerate(used)}
        faces = [tuple(place[k] for k in face) for face in faces]
        return [Core(_placed(points[used], position, orientation), 0.0, faces)]
    raise ContactError(
        f"{shape!r}: no contacts are known for a part of kind {kind!r}; make it a Hull, or several convex parts"
    )


def merged_faces(points: Array, triangles: NDArray[Any]) -> list[tuple[int, ...]]:
    """The faces of a convex polyhedron from a triangulation of its surface: polygons, counter-clockwise from outside."""
    middle = points.mean(axis=0)
    size = float(np.abs(points - middle).max())
    faces: list[tuple[int, ...]] = []
    seen = np.zeros((len(triangles), 4))  # normal and height
    for triangle in triangles:
        corners = points[triangle]
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        length = float(np.linalg.norm(normal))
        if length <= 1e-14 * size * size:
            continue  # no area, no plane
        normal = normal / length
        if normal @ (corners[0] - middle) < 0.0:
            normal = -normal
        height = float(normal @ corners[0])
        known = seen[: len(faces)]
        same = (np.abs(known[:, :3] - normal) < COPLANAR).all(axis=1) & (np.abs(known[:, 3] - height) < COPLANAR * size)
        if same.any():
            continue
        seen[len(faces)] = (*normal, height)
        on = np.flatnonzero(np.abs(points @ normal - height) < COPLANAR * size)
        faces.append(_ordered(points, on, normal))
    return faces


def _ordered(points: Array, on: NDArray[Any], normal: Array) -> tuple[int, ...]:
    """The corners of the convex polygon of the points ``on`` a plane, counter-clockwise about ``normal``."""
    u = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    u = u / np.linalg.norm(u)
    v = np.cross(normal, u)
    flat = {int(k): (float(points[k] @ u), float(points[k] @ v)) for k in on}
    size = max(max(abs(x), abs(y)) for x, y in flat.values())

    def chain(order: list[int]) -> list[int]:
        # Andrew's monotone chain (Inf. Process. Lett. 9 (1979) 216); points on an edge are no corners.
        found: list[int] = []
        for k in order:
            while len(found) >= 2 and _area(flat[found[-2]], flat[found[-1]], flat[k]) <= 1e-12 * size * size:
                found.pop()
            found.append(k)
        return found[:-1]

    order = sorted(flat, key=lambda k: flat[k])
    return tuple(chain(order) + chain(order[::-1]))


def _area(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _face_normal(corners: Array) -> Array:
    """Unit normal of a polygon, from its two longest diagonals' cross products (Newell's sum)."""
    moved = corners - corners[0]
    normal = np.cross(moved[1:-1], moved[2:]).sum(axis=0)
    return np.asarray(normal / np.linalg.norm(normal))


def _directions(vertices: Array, edges: list[tuple[int, int]]) -> Array:
    ends = np.array(edges)
    along = vertices[ends[:, 1]] - vertices[ends[:, 0]]
    along = along / np.sqrt((along * along).sum(axis=1))[:, None]
    if len(along) > MANY:
        return np.asarray(along)
    kept: list[int] = []
    for k, direction in enumerate(along):
        if not kept or float(np.abs(np.cross(direction, along[kept])).max(axis=1).min()) >= 1e-14:
            kept.append(k)
    return np.asarray(along[kept])


def matrix(q: Quat) -> Array:
    """The rotation matrix of a unit quaternion, body to world."""
    columns = (rotate(q, (1.0, 0.0, 0.0)), rotate(q, (0.0, 1.0, 0.0)), rotate(q, (0.0, 0.0, 1.0)))
    return np.array(columns).T


def _placed(points: Array, position: Vec, orientation: Quat) -> Array:
    turned: Array = points if orientation[1:] == (0.0, 0.0, 0.0) else points @ matrix(orientation).T
    placed: Array = turned + np.array(position)
    return placed


def _posed(position: Vec, orientation: Quat, inner: Any, turned: Any) -> tuple[Vec, Quat]:
    moved = rotate(orientation, (float(inner[0]), float(inner[1]), float(inner[2])))
    q = (float(turned[0]), float(turned[1]), float(turned[2]), float(turned[3]))
    where = (position[0] + moved[0], position[1] + moved[1], position[2] + moved[2])
    return where, normalize(multiply(orientation, q))
