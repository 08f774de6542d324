"""Parting directions: along which two polyhedra are farthest apart, or overlap least.

Two polyhedra are apart if and only if some face normal of either, or some cross product of an edge of one and an edge of
the other, parts them; if none does, the least overlap along these is the depth (separating axis theorem: Gottschalk, Lin
& Manocha, SIGGRAPH 1996). Of many edges only those pairs count that build a face of the Minkowski difference, that is
whose arcs on the Gauss map cross (Gregorius, Game Developers Conference 2013).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from xpheve_laws_collision.narrow_phase.cores import Array, Core

PARALLEL = 1e-12  # sine between edges that have no common perpendicular of their own
FEW = 400  # pairs of edge directions that are all tried

FACE_A, FACE_B, EDGES, POINTS = 0, 1, 2, 3
"""What the direction is fixed to: a face of a, of b, an edge of each, or the nearest points."""


class Axis(NamedTuple):
    """A parting direction: distance along it [m] (less than 0: depth), unit vector from a to b, what it is fixed to, the edges."""

    distance: float
    normal: Array
    kind: int
    edges: tuple[Array | None, Array | None] = (None, None)


def widest(core_a: Core, core_b: Core, turn_a: Array, turn_b: Array, a: Array, b: Array) -> Axis:
    """The direction along which the cores with world vertices ``a`` and ``b``, turned by ``turn_a`` and ``turn_b``, are farthest apart.

    Faces come first: an edge pair has to part by more than rounding to be preferred.
    """
    best = Axis(-math.inf, np.array((0.0, 0.0, 1.0)), POINTS)
    size = core_a.reach + core_b.reach
    for normals, kind in ((core_a.normals @ turn_a.T, FACE_A), (-(core_b.normals @ turn_b.T), FACE_B)):
        if len(normals):
            distances = _distances(normals, a, b)
            k = int(np.argmax(distances))
            if distances[k] > best.distance + (1e-13 * size if kind == FACE_B else 0.0):
                best = Axis(float(distances[k]), normals[k], kind)
    for first, second in _edge_pairs(core_a, core_b, turn_a, turn_b):
        axes = np.cross(first, second)
        lengths = np.sqrt((axes * axes).sum(axis=1))
        keep = lengths > PARALLEL
        if not keep.any():
            continue
        axes = axes[keep] / lengths[keep, None]
        axes = np.concatenate([axes, -axes])
        distances = _distances(axes, a, b)
        k = int(np.argmax(distances))
        if distances[k] > best.distance + 1e-13 * size:
            count = len(axes) // 2
            best = Axis(float(distances[k]), axes[k], EDGES, (first[keep][k % count], second[keep][k % count]))
    return best


def _distances(axes: Array, a: Array, b: Array) -> Array:
    return np.asarray((axes @ b.T).min(axis=1) - (axes @ a.T).max(axis=1))


def _edge_pairs(core_a: Core, core_b: Core, turn_a: Array, turn_b: Array) -> list[tuple[Array, Array]]:
    """Directions of the edges whose common perpendiculars may part the cores, pair by pair."""
    n, m = len(core_a.directions), len(core_b.directions)
    if n == 0 or m == 0:
        return []
    along_a, along_b = core_a.directions @ turn_a.T, core_b.directions @ turn_b.T
    if n * m <= FEW or not (core_a.solid and core_b.solid):
        return [(np.repeat(along_a, m, axis=0), np.tile(along_b, (n, 1)))]
    i, j = _crossing_arcs(core_a.edge_normals @ turn_a.T, -(core_b.edge_normals @ turn_b.T))
    edges_a, edges_b = np.array(core_a.edges)[i], np.array(core_b.edges)[j]
    va, vb = core_a.vertices @ turn_a.T, core_b.vertices @ turn_b.T
    return [(_units(va[edges_a[:, 1]] - va[edges_a[:, 0]]), _units(vb[edges_b[:, 1]] - vb[edges_b[:, 0]]))]


def _units(rows: Array) -> Array:
    return np.asarray(rows / np.sqrt((rows * rows).sum(axis=1))[:, None])


def _crossing_arcs(a: Array, b: Array) -> tuple[Array, Array]:
    """Pairs of arcs (n, 2, 3), (m, 2, 3) on the unit sphere that cross."""
    across_a, across_b = np.cross(a[:, 0], a[:, 1]), np.cross(b[:, 0], b[:, 1])
    c_from_a, d_from_a = across_a @ b[:, 0].T, across_a @ b[:, 1].T
    a_from_b, b_from_b = (across_b @ a[:, 0].T).T, (across_b @ a[:, 1].T).T
    crossing = (c_from_a * d_from_a < 0.0) & (a_from_b * b_from_b < 0.0) & (c_from_a * b_from_b > 0.0)
    return np.nonzero(crossing)  # type: ignore[return-value]
