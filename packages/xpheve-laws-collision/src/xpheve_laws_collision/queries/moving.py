"""What a moved shape comes to first: balls among balls and planes in closed form, all else by the impact times of the narrow phase.

The way is flown in one second at constant velocity and rotation, and what is in it stands still. Objects are asked in the order in which their
bounding spheres are reached, until none can be earlier than what was found.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from xpheve.kernels.vector import Vec, norm, scale
from xpheve_laws_collision.narrow_phase import Gap, Mover, family_of, flipped
from xpheve_laws_collision.queries.casting import cast
from xpheve_laws_collision.queries.places import PLANE, ROUND, Places
from xpheve_laws_collision.queries.rows import Array, Rows, dots
from xpheve_laws_collision.queries.separation import separation
from xpheve_laws_collision.queries.surface import Posed

STILL: Vec = (0.0, 0.0, 0.0)


class Way(NamedTuple):
    """A shape, where it begins, and how it is moved [m] and turned [rad] by the end."""

    start: Posed
    motion: Vec
    turn: Vec


class Stop(NamedTuple):
    """The row that is come to, at which part of the way, where, and the outward normal there."""

    row: int
    fraction: float
    point: Vec
    normal: Vec


def first_stop(places: Places, rows: Rows, way: Way) -> Stop | None:
    """The first of ``rows`` that the shape comes to, or overlaps at the start. Raises `ContactError` for pairs that nobody knows."""
    best: Stop | None = None
    if way.start.shape.kind == "sphere":
        kinds = places.kind[rows]
        plain = (kinds == ROUND) | (kinds == PLANE)
        best = _ball_among_balls(places, rows[plain], way)
        rows = rows[~plain]
    bounds = _reached(places, rows, way)
    mover = Mover(
        way.start.position, way.motion, STILL, way.start.orientation, way.start.shape, way.turn, _inertia(way)
    )
    for k in np.argsort(bounds, kind="stable").tolist():
        if not bounds[k] <= (1.0 if best is None else best.fraction):
            break
        found = _stop_at(places, int(rows[k]), mover, 1.0 if best is None else best.fraction)
        if found is not None and (best is None or (found.fraction, found.row) < (best.fraction, best.row)):
            best = found
    return best


def _inertia(way: Way) -> Vec:
    """Equal moments, so that what turns goes on turning evenly."""
    return (1.0, 1.0, 1.0) if any(way.turn) else STILL


def _ball_among_balls(places: Places, rows: Rows, way: Way) -> Stop | None:
    """The centre's ray among balls and half spaces grown by the radius."""
    length = norm(way.motion)
    radius = way.start.shape.radius
    along = scale(way.motion, 1.0 / length) if length > 0.0 else (0.0, 0.0, 1.0)
    origin = np.tile(np.array(way.start.position), (len(rows), 1))
    direction = np.tile(np.array(along), (len(rows), 1))
    ways, normals = cast(places, rows, origin, direction, radius)
    if not len(rows) or not ways.min() <= length:
        return None
    k = int(np.argmin(ways))
    row = int(rows[k])
    overlapping = _overlap_at_start(places, row, way.start) if ways[k] == 0.0 else None
    if overlapping is not None:
        return overlapping
    if length == 0.0:
        return None
    x, y, z = (origin[k] + ways[k] * direction[k] - radius * normals[k]).tolist()
    a, b, c = normals[k].tolist()
    return Stop(row, float(ways[k]) / length, (x, y, z), (a, b, c))


def _overlap_at_start(places: Places, row: int, start: Posed) -> Stop | None:
    found = separation(start, Posed(places.shape(row), *places.pose(row)))
    touch = float(places.touch(np.array([row]), np.array([start.position]))[0])
    if found.distance >= -touch:
        return None
    return Stop(row, 0.0, found.point_b, scale(found.normal, -1.0))


def _reached(places: Places, rows: Rows, way: Way) -> Array:
    """Parts of the way before which the bounding spheres, or sphere and plane, are apart; infinite where they stay so."""
    reach = way.start.shape.reach
    motion = np.array(way.motion)
    length = float(np.sqrt(motion @ motion))
    found = np.full(len(rows), math.inf)
    planes = np.flatnonzero(places.kind[rows] == PLANE)
    others = np.flatnonzero(places.kind[rows] != PLANE)
    normal, level = places.normals(rows[planes])
    height = normal @ np.array(way.start.position) - level - reach * (1.0 + 1e-9)
    fall = -(normal @ motion)
    with np.errstate(divide="ignore", invalid="ignore"):
        found[planes] = np.where(height <= 0.0, 0.0, np.where(fall > 0.0, height / fall, math.inf))
    away = np.array(way.start.position) - places.position[rows[others]]
    limit = (places.reach[rows[others]] + reach) * (1.0 + 1e-9) + 1e-12 * np.abs(away).max(axis=1, initial=0.0)
    square = dots(away, away) - limit * limit
    closing = -(away @ motion)
    inside = closing * closing - length * length * square
    with np.errstate(divide="ignore", invalid="ignore"):
        enters = square / (closing + np.sqrt(np.maximum(inside, 0.0)))
    found[others] = np.where(square <= 0.0, 0.0, np.where((closing > 0.0) & (inside >= 0.0), enters, math.inf))
    return found


def _stop_at(places: Places, row: int, mover: Mover, horizon: float) -> Stop | None:
    position, orientation = places.pose(row)
    other = Mover(position, STILL, STILL, orientation, places.shape(row))
    family, swapped = family_of(mover.shape.kind, other.shape.kind)
    one, two = (other, mover) if swapped else (mover, other)

    def seen(a: Mover, b: Mover) -> Gap:
        return flipped(family.gap(a, b)) if swapped else family.gap(a, b)

    gap = family.gap(one, two)
    fraction = 0.0
    if gap.separation >= -gap.touch:
        fraction = family.impact_time(one, two, gap, horizon)
        if not fraction <= horizon:
            return None
        there = mover.at(fraction)
        one, two = (other, there) if swapped else (there, other)
    found = seen(one, two)
    return Stop(row, fraction, found.point, scale(found.normal, -1.0))


__all__ = ["Stop", "Way", "first_stop"]
