"""Which closed part of a mesh lies inside which; parts that wind inwards where nothing is solid are turned."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from xpheve.shapes.polyhedron import Array, Indices, mass_properties

SAMPLES = 5
"""Vertices of a part that are asked for whether they lie inside another; the majority of those that are not on it counts."""
MOST_WORK = 100_000_000
"""Pairs of a sample and a triangle that are looked at; some seconds."""
ON = 0.01
"""A winding number so far from a whole one belongs to a point on the surface."""


class Part(NamedTuple):
    """A closed part: its triangles' numbers, its signed volume [m^3], and its bounds [m]."""

    triangles: Indices
    volume: float
    low: Array
    high: Array


def turned_parts(places: Array, corners: Indices, said: list[str]) -> Indices:
    """The triangles of a closed mesh with each part wound as what it lies in tells; what was done goes to ``said``.

    A part in the open, or in a cavity, is solid: one that winds inwards is turned with all that lies inside it. A part inside a
    solid one is a cavity if it winds inwards; one that winds outwards is kept, counts a second time, and is told of.
    """
    parts = _parts(places, corners)
    holder = _holders(places, corners, parts)
    if holder is None:
        said.append(f"{len(parts)} parts are too many to tell which lies inside which: kept as they wind")
        return corners
    sign = [1 if part.volume > 0.0 else -1 for part in parts]
    turn, twice = [False] * len(parts), 0
    for k in _outer_first(holder):
        outer = holder[k]
        if outer is not None and turn[outer]:
            turn[k], sign[k] = True, -sign[k]
        solid = outer is not None and sign[outer] > 0
        if sign[k] < 0 and not solid:
            turn[k], sign[k] = not turn[k], 1
        twice += solid and sign[k] > 0
    if any(turn):
        which = np.concatenate([part.triangles for part, turned in zip(parts, turn, strict=True) if turned])
        corners = corners.copy()
        corners[which] = corners[which][:, ::-1]
        some = f"{sum(turn)} of {len(parts)} parts, {len(which)}"
        said.append(f"wound inwards: {'all' if all(turn) else some} triangles turned round")
    if twice:
        many = f"{twice} parts lie inside others and wind" if twice > 1 else "a part lies inside another and winds"
        said.append(f"{many} outwards: kept, so that volume and mass count twice there; turn it if it is a cavity")
    return corners


def _parts(places: Array, corners: Indices) -> list[Part]:
    """Triangles joined by edges, in the order of their first ones."""
    edges = np.concatenate([corners[:, (0, 1)], corners[:, (1, 2)], corners[:, (2, 0)]])
    key = edges.min(axis=1) * len(places) + edges.max(axis=1)
    order = np.argsort(key, kind="stable")
    owner = np.tile(np.arange(len(corners)), 3)[order]
    same = key[order][1:] == key[order][:-1]
    label = _least_joined(len(corners), owner[:-1][same], owner[1:][same])
    order = np.argsort(label, kind="stable")
    pieces = np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
    found = []
    for which in pieces:
        at = places[corners[which]].reshape(-1, 3)
        volume = mass_properties(places, corners[which]).volume
        found.append(Part(which, volume, at.min(axis=0), at.max(axis=0)))
    return found


def _least_joined(count: int, a: Indices, b: Indices) -> Indices:
    """By each of ``count`` things the least that is joined to it, where ``a`` is joined to ``b`` pair by pair.

    Labels fall to the least of both ends and are then followed twice as far each round (Shiloach and Vishkin 1982).
    """
    label = np.arange(count)
    while True:
        one, other = label[a], label[b]
        least = np.minimum(one, other)
        found = label.copy()
        np.minimum.at(found, one, least)
        np.minimum.at(found, other, least)
        found = found[found]
        if np.array_equal(found, label):
            return label
        label = found


def _holders(places: Array, corners: Indices, parts: list[Part]) -> list[int | None] | None:
    """By part the smallest other one that it lies inside, or None; None in place of all if that is too much work."""
    low, high = np.array([part.low for part in parts]), np.array([part.high for part in parts])
    size = np.abs([part.volume for part in parts])
    order = np.argsort(low[:, 0], kind="stable")
    starts, widest = low[order, 0], float((high[:, 0] - low[:, 0]).max())
    work = 0
    found: list[int | None] = []
    for k, part in enumerate(parts):
        first = int(np.searchsorted(starts, part.high[0] - widest * 1.000001))
        near = order[first : int(np.searchsorted(starts, part.low[0], side="right"))]
        work += len(near) // 8
        about = near[
            (low[near] <= part.low).all(axis=1) & (high[near] >= part.high).all(axis=1) & (size[near] > size[k])
        ]
        holder = None
        for other in sorted(about.tolist(), key=lambda one: (size[one], one)):
            work += SAMPLES * len(parts[other].triangles)
            if work > MOST_WORK:
                return None
            if _inside(places, corners, part, parts[other]):
                holder = other
                break
        found.append(holder)
    return found


def _inside(places: Array, corners: Indices, part: Part, other: Part) -> bool:
    """Whether most of some vertices of ``part`` lie inside ``other``."""
    own = np.unique(corners[part.triangles])
    some = own[np.linspace(0, len(own) - 1, min(SAMPLES, len(own))).astype(np.int64)]
    triangles = places[corners[other.triangles]]
    votes = 0
    for at in places[some]:
        turns = abs(winding_number(at, triangles))
        if abs(turns - round(turns)) < ON:
            votes += 1 if round(turns) % 2 else -1
    return votes > 0


def winding_number(at: Array, triangles: Any) -> float:
    """How often closed ``triangles`` (m, 3, 3) go round ``at``: +-1 inside, 0 outside.

    The solid angles of the triangles, summed (van Oosterom and Strackee 1983), over a full one.
    """
    size = float(np.abs(triangles - at).max()) or 1.0
    a, b, c = ((triangles[:, k] - at) / size for k in range(3))
    p, q, r = (np.sqrt((one * one).sum(axis=1)) for one in (a, b, c))
    triple = (a * np.cross(b, c)).sum(axis=1)
    below = p * q * r + (a * b).sum(axis=1) * r + (b * c).sum(axis=1) * p + (c * a).sum(axis=1) * q
    return float(2.0 * np.arctan2(triple, below).sum() / (4.0 * np.pi))


def _outer_first(holder: list[int | None]) -> list[int]:
    """The parts, each after the one that it lies inside."""
    inner: dict[int | None, list[int]] = {}
    for k, outer in enumerate(holder):
        inner.setdefault(outer, []).append(k)
    found = list(inner.get(None, []))
    for k in found:  # grows while it is gone through
        found += inner.get(k, [])
    return found
