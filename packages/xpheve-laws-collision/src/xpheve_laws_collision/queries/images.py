"""Queries in periodic scenes: spheres and points have images, planes lie along the periodic axes; all else is refused by name."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np

from xpheve.errors import ContactError, InvalidValueError
from xpheve.kernels.vector import Vec
from xpheve.periodic import shortest_rows
from xpheve_laws_collision.queries.meeting import heights, neighbours
from xpheve_laws_collision.queries.moving import Way
from xpheve_laws_collision.queries.places import PLANE, ROUND, Places, Table
from xpheve_laws_collision.queries.rows import Array, Rows, lengths

MOST = 10_000  # images of the box along a ray, or a way


def check(places: Places, rows: Rows, objects: list[Any], box: Vec) -> None:
    """Raise `ContactError` if one of ``rows`` has no images here."""
    kinds = places.kind[rows]
    wrong = np.flatnonzero((kinds != ROUND) & (kinds != PLANE))
    if len(wrong):
        raise ContactError(
            f"{objects[rows[wrong[0]]]!r}: in a scene of periods {box} m queries know images of spheres and points, and planes. "
            "Leave others out: exclude=, or objects="
        )


def check_shape(shape: Any, box: Vec) -> None:
    """Raise `ContactError` if ``shape`` has no images here."""
    if shape.kind != "sphere":
        raise ContactError(
            f"{shape!r}: in a scene of periods {box} m queries know images of spheres and points; ask with one of these"
        )


def beside(places: Places, point: Array, box: Vec) -> Places:
    """The objects at their images nearest to ``point``; planes stay."""
    moved = point + shortest_rows(places.position - point, box)
    planes = places.planes
    moved[planes] = places.position[planes]
    return places.moved_to(moved)


def _shifts(low: Array, high: Array, box: Vec) -> list[Vec]:
    """The moves [m] of the box that bring parts of it between ``low`` and ``high``."""
    ranges: list[list[float]] = []
    for k, edge in enumerate(box):
        if edge == math.inf:
            ranges.append([0.0])
            continue
        if not (high[k] - low[k]) / edge < MOST:
            raise _too_long(box)
        ranges.append([edge * n for n in range(math.floor(low[k] / edge), math.floor(high[k] / edge) + 1)])
    if math.prod(map(len, ranges)) > MOST:
        raise _too_long(box)
    return [(x, y, z) for x, y, z in itertools.product(*ranges)]


def _too_long(box: Vec) -> InvalidValueError:
    return InvalidValueError(
        f"the way goes through more than {MOST} images of a box of periods {box} m: give a shorter length, such as length=10 periods"
    )


def of_rays(places: Places, rays: tuple[Array, Array, Array], box: Vec) -> tuple[Rows, Array]:
    """For each ray one a box that it goes through, its origin moved instead of the objects: numbers of the rays, origins."""
    origin, direction, length = rays
    reach = float(places.reach[places.bounded].max(initial=0.0))
    parents: list[int] = []
    origins: list[Array] = []
    for k in range(len(origin)):
        with np.errstate(invalid="ignore"):
            end = np.where(direction[k] == 0.0, origin[k], origin[k] + length[k] * direction[k])
        shifts = _shifts(np.minimum(origin[k], end) - reach, np.maximum(origin[k], end) + reach, box)
        shifts.sort(key=lambda shift: shift != (0.0, 0.0, 0.0))  # planes are asked along the first of them
        if shifts[0] != (0.0, 0.0, 0.0):
            shifts.insert(0, (0.0, 0.0, 0.0))
        parents += [k] * len(shifts)
        origins.append(origin[k] - np.array(shifts))
    return np.array(parents, dtype=np.int64), np.concatenate(origins)


def of_way(places: Places, rows: Rows, way: Way, box: Vec) -> tuple[Places, Rows, Rows]:
    """The objects, their images along the way, their rows there, and the rows of those that they are images of."""
    start, end = np.array(way.start.position), np.array(way.start.position) + np.array(way.motion)
    reach = float(places.reach[places.bounded].max(initial=0.0)) + way.start.shape.reach
    shifts = _shifts(np.minimum(start, end) - reach, np.maximum(start, end) + reach, box)
    return _repeated(places, rows, shifts)


def _repeated(places: Places, rows: Rows, shifts: list[Vec]) -> tuple[Places, Rows, Rows]:
    balls, planes = rows[places.kind[rows] != PLANE], rows[places.kind[rows] == PLANE]
    of = np.concatenate([np.tile(balls, len(shifts)), planes])
    moves = np.concatenate([np.repeat(np.array(shifts).reshape(-1, 3), len(balls), axis=0), np.zeros((len(planes), 3))])
    table = object.__new__(Table)
    table.shapes = [places.table.shapes[row] for row in of.tolist()]
    table.kind, table.size, table.reach = places.kind[of], places.size[of], places.reach[of]
    return Places(table, places.position[of] + moves, places.orientation[of]), np.arange(len(of)), of


def near_pairs(places: Places, rows: Rows, margin: float, box: Vec) -> list[tuple[int, int]]:
    """The pairs of ``rows`` of which an image of one is within ``margin`` [m] of the other, the lower row first, in order."""
    balls, planes = rows[places.kind[rows] != PLANE], rows[places.kind[rows] == PLANE]
    spare = float(places.reach[balls].max(initial=0.0)) * (1.0 + 1e-9) + 0.5 * max(margin, 0.0)
    around = [[0.0] if edge == math.inf else [-edge, 0.0, edge] for edge in box]
    copies, of = [places.position[balls]], [balls]
    for x, y, z in itertools.product(*around):
        if (x, y, z) != (0.0, 0.0, 0.0):
            moved = places.position[balls] + np.array((x, y, z))
            close = np.all([(m > -2 * spare) & (m < e + 2 * spare) for m, e in zip(moved.T, box, strict=True)], axis=0)
            copies.append(moved[close])
            of.append(balls[close])
    at, number = np.concatenate(copies), np.concatenate(of)
    radius = places.size[number, 0]
    half = (radius * (1.0 + 1e-9) + 0.5 * max(margin, 0.0))[:, None] + 1e-9 * np.abs(at)
    i, j = neighbours(at - half, at + half)
    own = (i < len(balls)) | (j < len(balls))
    i, j = i[own], j[own]
    away = shortest_rows(places.position[number[i]] - places.position[number[j]], box)
    keep = (lengths(away) - radius[i] - radius[j] <= margin) & (number[i] != number[j])
    one, two = number[i[keep]], number[j[keep]]
    found = set(zip(np.minimum(one, two).tolist(), np.maximum(one, two).tolist(), strict=True))
    for plane in planes.tolist():
        normal, level = places.normals(np.array([plane]))
        above = heights(places, balls, np.repeat(normal, len(balls), axis=0), float(level[0]))
        found |= {(min(row, plane), max(row, plane)) for row in balls[above <= margin].tolist()}
    return sorted(found)


__all__ = ["beside", "check", "check_shape", "near_pairs", "of_rays", "of_way"]
