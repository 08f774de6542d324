"""The objects of a scene at an instant as arrays: kinds of shape, sizes, poses, boxes about them."""

from __future__ import annotations

from typing import Any

import numpy as np

from xpheve.kernels.vector import Vec
from xpheve.shapes import Plane
from xpheve_laws_collision.narrow_phase import TOUCH, ULPS
from xpheve_laws_collision.queries.rows import Array, Rows, dots, lengths, turned
from xpheve_laws_collision.queries.tree import Tree

ROUND, PLANE, BOX, CAPSULE, OTHER = range(5)
"""Kinds with closed forms in arrays, points among the round ones; and all others, taken one by one."""
KINDS = {"sphere": ROUND, "plane": PLANE, "box": BOX, "capsule": CAPSULE}
FAR = 1e60  # [m] no bounded shape that a query knows reaches farther
SLACK = 1e-9  # of all lengths at hand: far above the rounding of the boxes


class Table:
    """What does not change while objects move: kinds (n,), sizes (n, 4) and reaches (n,) [m] of shapes.

    A size is a radius; three half edges; radius and half length of a capsule; of a plane the outward normal in its own frame and the offset.
    """

    def __init__(self, shapes: list[Any], up: Vec) -> None:
        self.shapes = shapes
        known: dict[int, int] = {}
        rows: list[tuple[int, tuple[float, ...], float]] = []
        places = np.empty(len(shapes), dtype=np.int64)
        for k, shape in enumerate(shapes):
            place = known.get(id(shape))
            if place is None:
                place = known[id(shape)] = len(rows)
                rows.append(_row(shape, up))
            places[k] = place
        self.kind: Rows = np.array([row[0] for row in rows], dtype=np.int64)[places]
        self.size: Array = np.array([row[1] for row in rows], dtype=float).reshape(len(rows), 4)[places]
        self.reach: Array = np.array([row[2] for row in rows], dtype=float)[places]


def _row(shape: Any, up: Vec) -> tuple[int, tuple[float, ...], float]:
    if shape is None:
        return ROUND, (0.0, 0.0, 0.0, 0.0), 0.0
    kind = KINDS.get(shape.kind, OTHER)
    size: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    if kind == ROUND:
        size = (shape.radius, 0.0, 0.0, 0.0)
    elif kind == PLANE:
        size = (*(up if shape.normal is None else shape.normal), shape.offset)
    elif kind == BOX:
        size = (*(0.5 * edge for edge in shape.size), 0.0)
    elif kind == CAPSULE:
        size = (shape.radius, 0.5 * shape.length, 0.0, 0.0)
    return kind, size, min(shape.reach, FAR) if kind == OTHER else shape.reach


class Places:
    """The objects now; planes have no box."""

    def __init__(self, table: Table, position: Array, orientation: Array) -> None:
        self.table = table
        self.kind, self.size, self.reach = table.kind, table.size, table.reach
        self.position, self.orientation = position, orientation
        self.asked = 0
        """Pairs of a ray and an object that were looked at."""
        self._boxes: tuple[Array, Array] | None = None
        self._tree: Tree | None = None

    def __len__(self) -> int:
        return len(self.kind)

    @property
    def bounded(self) -> Rows:
        """The rows of all but planes."""
        return np.flatnonzero(self.kind != PLANE)

    @property
    def planes(self) -> Rows:
        """The rows of planes."""
        return np.flatnonzero(self.kind == PLANE)

    @property
    def boxes(self) -> tuple[Array, Array]:
        """Lowest and highest corners (n, 3) [m] of boxes along the axes that hold each object, and a little more."""
        if self._boxes is None:
            half = np.repeat(self.reach[:, None], 3, axis=1)
            for kind in (BOX, CAPSULE):
                rows = np.flatnonzero(self.kind == kind)
                if len(rows):
                    half[rows] = half_extents(kind, self.orientation[rows], self.size[rows])
            half += SLACK * (half + np.abs(self.position))
            self._boxes = self.position - half, self.position + half
        return self._boxes

    @property
    def tree(self) -> Tree:
        """A tree of the boxes of all `bounded` rows."""
        if self._tree is None:
            low, high = self.boxes
            self._tree = Tree(low[self.bounded], high[self.bounded])
        return self._tree

    def moved_to(self, position: Array) -> Places:
        """The same objects at other positions."""
        return Places(self.table, position, self.orientation)

    def normals(self, rows: Rows) -> tuple[Array, Array]:
        """Outward normals (k, 3) and levels (k,) [m] of planes in the world."""
        normal = turned(self.orientation[rows], self.size[rows, :3])
        return normal, dots(normal, self.position[rows]) + self.size[rows, 3]

    def touch(self, rows: Rows, point: Array) -> Array:
        """Gaps [m] that count as none between the objects and something at ``point``."""
        bounded = np.where(self.kind[rows] == PLANE, np.abs(self.size[rows, 3]), self.reach[rows])
        return np.asarray(TOUCH * bounded + ULPS * (lengths(self.position[rows]) + lengths(point)))

    def shape(self, row: int) -> Any:
        """The shape of ``row`` as the narrow phase takes it: a sphere of no radius for a point, a plane with a normal."""
        return plain(self.table.shapes[row], tuple(self.size[row, :3].tolist()))

    def pose(self, row: int) -> tuple[Vec, tuple[float, float, float, float]]:
        """Position and orientation of ``row``."""
        x, y, z = self.position[row].tolist()
        w, a, b, c = self.orientation[row].tolist()
        return (x, y, z), (w, a, b, c)


def half_extents(kind: int, q: Array, size: Array) -> Array:
    """Half edges (k, 3) [m] of the least boxes along the axes about boxes or capsules."""
    if kind == CAPSULE:
        along = np.abs(turned(q, np.broadcast_to((0.0, 0.0, 1.0), (len(q), 3))))
        return np.asarray(along * size[:, 1:2] + size[:, :1])
    total = np.zeros((len(q), 3))
    for k in range(3):
        axis = np.zeros((len(q), 3))
        axis[:, k] = size[:, k]
        total += np.abs(turned(q, axis))
    return total


class Dot:
    """The shape of an object that has none: a sphere without extent."""

    kind = "sphere"
    radius = 0.0
    reach = 0.0


DOT = Dot()


def plain(shape: Any, normal: Vec) -> Any:
    """``shape`` as the narrow phase takes it."""
    if shape is None:
        return DOT
    if shape.kind == "plane" and shape.normal is None:
        return Plane(normal, shape.offset)
    return shape


__all__ = ["BOX", "CAPSULE", "DOT", "OTHER", "PLANE", "ROUND", "Dot", "Places", "Table", "half_extents", "plain"]
