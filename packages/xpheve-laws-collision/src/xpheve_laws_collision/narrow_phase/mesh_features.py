"""The surface of a mesh as what a ball can touch: faces, edges and corners, each once, and a tree of boxes over them.

Neighbouring triangles in one plane share that plane, to the bit; the edges between them and the corners inside them are left
out, since a ball touches the plane there. All in the body frame; in an order that the numbers of the mesh decide.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Test = Callable[[Array, Array], NDArray[np.bool_]]

FLAT = 1e-12  # of the reach: corners this near to a plane lie in it
LEAF = 8  # triangles in a box of the lowest level
FAN = 16  # boxes in a box of the next level
KEPT = 64  # meshes whose features are remembered


class Features:
    """What a ball can touch of a mesh.

    Triangles come in the order of the tree. ``triangles`` (m, 3) holds indices into ``places`` (k, 3) [m], ``normals`` (m, 3) and
    ``levels`` (m,) [m] the planes, ``inward`` (m, 3, 3) unit vectors in the plane across each side (from corner k to k + 1),
    ``sides`` (m, 3) the edges. ``ends`` (e, 2) holds the corners of the edges, ``sharp`` (e,) and ``pointed`` (k,) say which edges
    and corners can be touched, ``edge_owner`` and ``corner_owner`` in which triangle they are looked for.
    """

    def __init__(self, vertices: Array, faces: Indices) -> None:
        self.places, same = np.unique(vertices[faces].reshape(-1, 3) + 0.0, axis=0, return_inverse=True)
        triangles = same.reshape(-1, 3)
        self.reach = float(np.sqrt((self.places * self.places).sum(axis=1)).max())
        corners = self.places[triangles]
        self.order: Indices = tree_order(corners)
        """The index in the mesh's faces of each triangle."""
        self.triangles: Indices = triangles[self.order]
        self.corners: Array = corners[self.order]
        pairs = np.sort(self.triangles[:, ((0, 1), (1, 2), (2, 0))].reshape(-1, 2), axis=1)
        self.ends, sides = np.unique(pairs, axis=0, return_inverse=True)
        self.sides: Indices = sides.reshape(-1, 3)
        self._half = np.argsort(self.sides.reshape(-1), kind="stable")
        self._first_half = np.searchsorted(self.sides.reshape(-1)[self._half], np.arange(len(self.ends) + 1))
        self._find_planes()
        self._find_inward()
        self._find_sharp()
        self._find_owners()
        self.lows: Array = self.corners.min(axis=1)
        self.highs: Array = self.corners.max(axis=1)
        self.levels_of_boxes = _levels(self.lows, self.highs)

    # Planes

    def _find_planes(self) -> None:
        a = self.corners[:, 0]
        normals = np.cross(self.corners[:, 1] - a, self.corners[:, 2] - a)
        areas = np.sqrt((normals * normals).sum(axis=1))
        normals = normals / areas[:, None] + 0.0
        normals /= np.sqrt((normals * normals).sum(axis=1))[:, None]
        levels = (normals * a).sum(axis=1)
        self.plane: Indices = np.arange(len(normals))
        """By triangle, the triangle whose plane it shares."""
        free = np.ones(len(normals), dtype=bool)
        for seed in self._seeds(areas, normals, levels):
            if free[seed]:
                self._spread(seed, normals, levels, free)
        self.normals: Array = normals[self.plane]
        self.levels: Array = levels[self.plane]

    def _seeds(self, areas: Array, normals: Array, levels: Array) -> list[int]:
        """Triangles with a neighbour in their plane, large ones first: their planes are the most exact."""
        limit = FLAT * self.reach
        has = np.zeros(len(areas), dtype=bool)
        first = self._first_half
        two = np.flatnonzero(np.diff(first) >= 2)
        one, other = self._half[first[two]] // 3, self._half[first[two] + 1] // 3
        off = np.abs((self.corners[other] * normals[one][:, None, :]).sum(axis=2) - levels[one][:, None]).max(axis=1)
        back = np.abs((self.corners[one] * normals[other][:, None, :]).sum(axis=2) - levels[other][:, None]).max(axis=1)
        near = np.minimum(off, back) <= limit
        has[one[near]] = has[other[near]] = True
        found = np.flatnonzero(has)
        return [int(k) for k in found[np.argsort(-areas[found], kind="stable")]]

    def _spread(self, seed: int, normals: Array, levels: Array, free: NDArray[np.bool_]) -> None:
        """Give the plane of ``seed`` to the triangles around it that lie in it."""
        limit = FLAT * self.reach
        front = np.array([seed])
        free[seed] = False
        while len(front):
            around = np.unique([k for t in front for k in self.around(int(t))])
            around = around[free[around]]
            front = around[
                np.abs(self.corners[around] @ normals[seed] - levels[seed]).max(axis=1, initial=0.0) <= limit
            ]
            self.plane[front] = seed
            free[front] = False

    def around(self, triangle: int) -> list[int]:
        """The triangles that share a side with this one."""
        found: list[int] = []
        for side in self.sides[triangle]:
            found += (self._half[self._first_half[side] : self._first_half[side + 1]] // 3).tolist()
        return found

    # Edges and corners

    def _find_inward(self) -> None:
        along = np.roll(self.corners, -1, axis=1) - self.corners
        inward = np.cross(self.normals[:, None, :], along)
        third = np.roll(self.corners, -2, axis=1) - self.corners
        inward *= np.sign((inward * third).sum(axis=2))[:, :, None]  # the shared plane may face the other way
        self.inward: Array = inward / np.sqrt((inward * inward).sum(axis=2))[:, :, None]

    def _find_sharp(self) -> None:
        """An edge is flat where all its triangles lie in one plane, on both sides."""
        starts = self._first_half[:-1]
        inward = self.inward.reshape(-1, 3)[self._half]
        count = np.diff(self._first_half)
        facing = (inward * np.repeat(inward[starts], count, axis=0)).sum(axis=1)
        plane = self.plane[self._half // 3]
        one_plane = np.minimum.reduceat(plane, starts) == np.maximum.reduceat(plane, starts)
        self.sharp: NDArray[np.bool_] = ~(one_plane & (np.minimum.reduceat(facing, starts) < 0.0))
        self.pointed: NDArray[np.bool_] = np.zeros(len(self.places), dtype=bool)
        self.pointed[self.ends[self.sharp].reshape(-1)] = True
        by_corner = self.ends.reshape(-1)
        self._spokes = np.argsort(by_corner, kind="stable")
        self._first_spoke = np.searchsorted(by_corner[self._spokes], np.arange(len(self.places) + 1))

    def _find_owners(self) -> None:
        self.edge_owner: Indices = self._half[self._first_half[:-1]] // 3
        flat = self.triangles.reshape(-1)
        order = np.argsort(flat, kind="stable")
        self.corner_owner: Indices = order[np.searchsorted(flat[order], np.arange(len(self.places)))] // 3
        own = self.edge_owner[self.sides] == np.arange(len(self.sides))[:, None]
        self.own_edges: NDArray[np.bool_] = own & self.sharp[self.sides]
        own = self.corner_owner[self.triangles] == np.arange(len(self.sides))[:, None]
        self.own_corners: NDArray[np.bool_] = own & self.pointed[self.triangles]

    def inward_at(self, edge: int) -> Array:
        """Of an edge, for each of its triangles the unit vector into it, across the edge."""
        found: Array = self.inward.reshape(-1, 3)[self._half[self._first_half[edge] : self._first_half[edge + 1]]]
        return found

    def spokes_at(self, corner: int) -> Array:
        """The unit vectors from a corner along its edges."""
        spokes = self._spokes[self._first_spoke[corner] : self._first_spoke[corner + 1]]
        other = self.ends[spokes // 2, 1 - spokes % 2]
        along = self.places[other] - self.places[corner]
        found: Array = along / np.sqrt((along * along).sum(axis=1))[:, None]
        return found

    # The tree

    def within(self, test: Test) -> Indices:
        """The triangles whose boxes pass ``test``, which is asked of ever smaller boxes (lows and highs, shape (n, 3))."""
        found: Indices = np.arange(len(self.levels_of_boxes[-1][0]))
        for level in range(len(self.levels_of_boxes) - 1, -1, -1):
            lows, highs = self.levels_of_boxes[level]
            found = found[test(lows[found], highs[found])]
            width, count = (LEAF, len(self.lows)) if level == 0 else (FAN, len(self.levels_of_boxes[level - 1][0]))
            found = (found[:, None] * width + np.arange(width)).reshape(-1)
            found = found[found < count]
        return found[test(self.lows[found], self.highs[found])]


def tree_order(corners: Array) -> Indices:
    """An order of the triangles in which those near each other come together: halves along the longest side, again and again."""
    middles = 0.5 * (corners.min(axis=1) + corners.max(axis=1))
    done: list[Indices] = []
    open_parts: list[Indices] = [np.arange(len(corners))]
    while open_parts:
        part = open_parts.pop()
        if len(part) <= LEAF:
            done.append(part)
            continue
        axis = int(np.argmax(np.ptp(middles[part], axis=0)))
        part = part[np.argsort(middles[part, axis], kind="stable")]
        half = LEAF
        while 2 * half < len(part):
            half *= 2
        open_parts += [part[half:], part[:half]]  # the first half is taken next
    return np.concatenate(done)


def _levels(lows: Array, highs: Array) -> list[tuple[Array, Array]]:
    found: list[tuple[Array, Array]] = []
    width = LEAF
    while True:
        starts = np.arange(0, len(lows), width)
        lows, highs = np.minimum.reduceat(lows, starts, axis=0), np.maximum.reduceat(highs, starts, axis=0)
        found.append((lows, highs))
        if len(lows) <= FAN:
            return found
        width = FAN


_known: dict[int, tuple[Any, Features]] = {}


def features_of(shape: Any) -> Features:
    """The features of a mesh; made once."""
    held = _known.get(id(shape))
    if held is not None and held[0] is shape:
        return held[1]
    features = Features(np.asarray(shape.vertices, dtype=np.float64), np.asarray(shape.faces, dtype=np.int64))
    if len(_known) >= KEPT:
        _known.clear()
    _known[id(shape)] = (shape, features)  # with the shape itself, so that its id stays its own
    return features
