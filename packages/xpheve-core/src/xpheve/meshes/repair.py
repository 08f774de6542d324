"""Mending what can be mended without guessing; holes are not filled."""

from __future__ import annotations

from collections import deque
from typing import Any, NamedTuple

import numpy as np

from xpheve.errors import MeshError
from xpheve.meshes.parts import turned_parts
from xpheve.shapes.polyhedron import Array, Indices, doubled_areas, is_closed, mass_properties

LARGEST = 1e30
"""[m]; beyond it float32 files overflow, and so do moments of inertia."""


class Repaired(NamedTuple):
    """Sound vertices (n, 3) and faces (m, 3); what was mended, and what was only tidied up, a sentence each."""

    vertices: Array
    faces: Indices
    repairs: tuple[str, ...]
    tidied: tuple[str, ...]


def repaired(vertices: Any, faces: Any, what: str = "mesh") -> Repaired:
    """Vertices and triangles that a `xpheve.Mesh` takes.

    Vertices at the same place are joined; triangles that have no area, come twice or name no vertex are left out, and vertices
    that none needs; neighbours that wind against one another are turned; of a closed mesh, parts wound inwards
    are turned round unless they are cavities of others (see `xpheve.meshes.parts`).

    Raises
    ------
    MeshError
        If nothing is left, or a triangle has a corner that is not finite.
    """
    try:
        places = np.array(vertices, dtype=np.float64).reshape(-1, 3)
        given = np.array(faces)
        corners = (given if given.size else np.zeros((0, 3))).astype(np.int64).reshape(-1, 3)
    except (TypeError, ValueError, OverflowError):
        raise MeshError(f"{what}: vertices of shape (n, 3) and faces of shape (m, 3) are needed") from None
    said: list[str] = []
    tidied: list[str] = []

    def keep(which: Any, why: str) -> None:
        nonlocal corners
        gone = int(len(which) - which.sum())
        if gone:
            corners = corners[which]
            said.append(f"{gone} triangle{'s' if gone > 1 else ''} {why} left out")

    keep(((corners >= 0) & (corners < len(places))).all(axis=1), "of vertices that do not exist")
    used = np.unique(corners)
    bad = used[~(np.abs(places[used]) < LARGEST).all(axis=1)]
    if len(bad):
        raise MeshError(
            f"{what}: vertex {bad[0]} is {places[bad[0]].tolist()} ({len(bad)} such): finite coordinates below "
            f"{LARGEST:g} m are needed; correct the file"
        )
    if len(used) < len(places):
        tidied.append(f"{len(places) - len(used)} vertices that no triangle needs left out")
    corners, places = np.searchsorted(used, corners), places[used] + 0.0
    corners, places = _joined(corners, places, tidied)
    keep(_distinct(corners) & _broad(places, corners), "without area")
    keep(_first_of_each(corners), "that came twice")
    if not len(corners):
        raise MeshError(f"{what}: no triangle is left; {'; '.join([*said, *tidied]) or 'it is empty'}")
    used = np.unique(corners)
    corners, places = np.searchsorted(used, corners), places[used]
    corners = _wound_alike(corners, places, said)
    if is_closed(places, corners):
        corners = turned_parts(places, corners, said)
    return Repaired(places, corners, tuple(said), tuple(tidied))


def _joined(corners: Indices, places: Array, said: list[str]) -> tuple[Indices, Array]:
    _, first, same = np.unique(places, axis=0, return_index=True, return_inverse=True)
    if len(first) == len(places):
        return corners, places
    said.append(f"{len(places) - len(first)} vertices joined with others at the same place")
    order = np.argsort(first)  # kept in the order of the file
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return rank[same.reshape(-1)][corners], places[first[order]]


def _distinct(corners: Indices) -> Any:
    a, b, c = corners.T
    return (a != b) & (b != c) & (c != a)


def _broad(places: Array, corners: Indices) -> Any:
    """Which triangles have an area above rounding."""
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        area = doubled_areas(places, corners)
        a, b, c = (places[corners[:, k]] for k in range(3))
        longest = np.maximum(
            ((b - a) ** 2).sum(axis=1), np.maximum(((c - b) ** 2).sum(axis=1), ((a - c) ** 2).sum(axis=1))
        )
        return (area > 1e-15 * longest) & (area > 1e-280)


def _first_of_each(corners: Indices) -> Any:
    if not len(corners):
        return np.zeros(0, dtype=bool)
    turned = np.take_along_axis(corners, (corners.argmin(axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    _, first = np.unique(turned, axis=0, return_index=True)
    which = np.zeros(len(corners), dtype=bool)
    which[first] = True
    return which


def _wound_alike(corners: Indices, places: Array, said: list[str]) -> Indices:
    """Turn triangles so that neighbours agree, where every edge has at most two; each such part then outwards if it is closed."""
    edges = np.concatenate([corners[:, (0, 1)], corners[:, (1, 2)], corners[:, (2, 0)]])
    owner = np.tile(np.arange(len(corners)), 3)
    key = edges.min(axis=1) * len(places) + edges.max(axis=1)
    forth = edges[:, 0] < edges[:, 1]
    order = np.argsort(key, kind="stable")
    key, owner, forth = key[order], owner[order], forth[order]
    start = np.flatnonzero(np.concatenate([[True], key[1:] != key[:-1]]))
    count = np.diff(np.append(start, len(key)))
    if (count > 2).any():
        return corners  # edges of three triangles: sides cannot be told
    pairs = start[count == 2]
    a, b, clash = owner[pairs], owner[pairs + 1], forth[pairs] == forth[pairs + 1]
    if not clash.any():
        return corners
    near: list[list[tuple[int, bool]]] = [[] for _ in range(len(corners))]
    for i, j, against in zip(a.tolist(), b.tolist(), clash.tolist(), strict=True):
        near[i].append((j, against))
        near[j].append((i, against))
    turn: list[bool | None] = [None] * len(corners)
    found = corners.copy()
    turned = 0
    for seed in range(len(corners)):
        if turn[seed] is not None:
            continue
        part, mixed = _spread(seed, near, turn)
        if part is None:
            return corners  # one-sided, such as a Moebius strip
        if not mixed:
            continue
        which = np.array(part)
        flip = np.array([bool(turn[k]) for k in part])
        if 2 * flip.sum() > len(flip):
            flip = ~flip
        pieces = found[which]
        pieces[flip] = pieces[flip][:, ::-1]
        if is_closed(places, pieces) and mass_properties(places, pieces).volume < 0.0:
            pieces, flip = np.ascontiguousarray(pieces[:, ::-1]), ~flip
        found[which] = pieces
        turned += int(flip.sum())
    said.append(f"{turned} triangle{'s' if turned != 1 else ''} turned to wind as the neighbours do")
    return found


def _spread(seed: int, near: list[list[tuple[int, bool]]], turn: list[bool | None]) -> tuple[list[int] | None, bool]:
    """All triangles joined to ``seed``, with what must be turned in ``turn``; None if that cannot be; and whether some must."""
    turn[seed] = False
    part, mixed, waiting = [seed], False, deque([seed])
    while waiting:
        i = waiting.popleft()
        for j, against in near[i]:
            wanted = bool(turn[i]) != against
            mixed |= against
            if turn[j] is None:
                turn[j] = wanted
                part.append(j)
                waiting.append(j)
            elif turn[j] != wanted:
                return None, True
    return part, mixed
