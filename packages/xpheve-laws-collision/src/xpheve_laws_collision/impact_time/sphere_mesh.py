"""When a sphere meets a mesh that does not turn, under constant relative acceleration.

The first touch is one of a face (a quadratic equation), of an edge or of a corner (equations of degree four), and lies within that
face or edge: elsewhere the sphere has touched what bounds it before. All are asked in the order in which the sphere can reach them.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from xpheve.kernels.polynomial import derivative, first_crossing, value
from xpheve.kernels.vector import Vec, dot, norm, scale, sub
from xpheve_laws_collision.impact_time.box_times import ball_times, box_times
from xpheve_laws_collision.impact_time.sphere_plane import return_time, sphere_plane
from xpheve_laws_collision.impact_time.sphere_sphere import (
    offset_at,
    separation_polynomial,
    sphere_sphere,
    sphere_sphere_meets,
)
from xpheve_laws_collision.narrow_phase import still_speed
from xpheve_laws_collision.narrow_phase.mesh_features import Array, Features, Indices

BATCH = 8  # triangles solved before the bound is used; doubled each time
NEARER = 1e-11  # a direction that leans this little into a face or along an edge is across it
SLOW = 1e-4  # of the speeds: arrivals slower than this are looked at as grazes


class Ball:
    """A sphere on its parabola in the mesh's frame: centre, velocity, acceleration, radius, and what counts as none.

    ``touch`` [m] is the gap that is none, ``slack`` [m] how far beyond the border of a face or edge a touch still belongs to it,
    ``speeds`` [m/s] the speeds at hand.
    """

    __slots__ = ("a", "radius", "slack", "speeds", "touch", "v", "x")

    def __init__(self, x: Vec, v: Vec, a: Vec, radius: float, touch: float, slack: float, speeds: float) -> None:
        self.x, self.v, self.a = x, v, a
        self.radius, self.touch, self.slack, self.speeds = radius, touch, slack, speeds

    def at(self, s: float) -> Vec:
        """The centre [m] after ``s`` [s]."""
        return offset_at(self.x, self.v, self.a, s)


def sphere_mesh(features: Features, ball: Ball, horizon: float) -> float:
    """Time [s] in [0, horizon] until the sphere touches the mesh and approaches; infinite if it does not.

    Face by face, edge by edge and corner by corner as `sphere_plane` and `sphere_sphere` say. What rests on one may meet another.
    """
    near = ball.radius + 2.0 * ball.touch
    lowest, highest = features.lows.min(axis=0)[None] - near, features.highs.max(axis=0)[None] + near
    first, last = box_times(ball.x, ball.v, ball.a, lowest, highest)
    if first[0] == math.inf:
        return math.inf
    horizon = min(horizon, float(last[0]))  # after which it is gone for ever
    triangles = features.within(
        lambda lows, highs: ball_times(ball.x, ball.v, ball.a, near, lows, highs, horizon) < math.inf
    )
    times = ball_times(ball.x, ball.v, ball.a, near, features.lows[triangles], features.highs[triangles], horizon)
    order = np.argsort(times, kind="stable")
    best = math.inf
    planes: dict[int, list[float]] = {}
    start, count = 0, BATCH
    while start < len(order) and times[order[start]] < math.inf and not times[order[start]] > best:
        batch = triangles[order[start : start + count]]
        start, count = start + count, 2 * count
        best = min(best, _faces(features, ball, batch, planes, min(best, horizon)))
        best = min(best, _edges(features, ball, batch, min(best, horizon)))
        best = min(best, _corners(features, ball, batch, min(best, horizon)))
        if best == 0.0:
            return best
    return best


# Faces


def _faces(features: Features, ball: Ball, batch: Indices, planes: dict[int, list[float]], horizon: float) -> float:
    best = math.inf
    for triangle in batch.tolist():
        plane = int(features.plane[triangle])
        if plane not in planes:
            normal = _vec(features.normals[triangle])
            planes[plane] = _plane_times(normal, float(features.levels[triangle]), ball)
        for time in planes[plane]:
            if time <= min(best, horizon) and over(features, triangle, ball.at(time), ball.slack):
                best = time
    return best


def _plane_times(normal: Vec, level: float, ball: Ball) -> list[float]:
    """When the sphere meets the plane: from the side of its centre, and from the other once it has passed."""
    height = dot(normal, ball.x) - level
    side = -1.0 if height < 0.0 else 1.0
    gap = abs(height) - ball.radius
    speed, acceleration = side * dot(normal, ball.v), side * dot(normal, ball.a)
    found = sphere_plane(
        0.0 if abs(gap) <= ball.touch else gap,  # a gap that counts as none is none
        speed,
        acceleration,
        ball.touch,
        still_speed(ball.speeds, acceleration),
        math.inf,
    )
    times = [found] if found < math.inf else []
    behind = -abs(height) - ball.radius
    if speed < 0.0 < acceleration and speed * speed > -2.0 * acceleration * behind:
        times.append(return_time(behind, -speed, -acceleration))
    return times


def over(features: Features, triangle: int, place: Vec, slack: float) -> bool:
    """Whether ``place`` is above or below the triangle."""
    for inward, corner in zip(features.inward[triangle].tolist(), features.corners[triangle].tolist(), strict=True):
        if dot(inward, sub(place, corner)) < -slack:
            return False
    return True


# Edges and corners


def _edges(features: Features, ball: Ball, batch: Indices, horizon: float) -> float:
    edges = features.sides[batch][features.own_edges[batch]]
    ends = features.places[features.ends[edges]]
    best = horizon
    found = math.inf
    for k, bound in _in_order(ball, ends.min(axis=1), ends.max(axis=1), horizon):
        if bound > best:
            break
        time = edge_time(features, int(edges[k]), ball, best)
        if time < math.inf:
            best = found = time
    return found


def _corners(features: Features, ball: Ball, batch: Indices, horizon: float) -> float:
    corners = features.triangles[batch][features.own_corners[batch]]
    places = features.places[corners]
    best = horizon
    found = math.inf
    for k, bound in _in_order(ball, places, places, horizon):
        if bound > best:
            break
        time = corner_time(features, int(corners[k]), ball, best)
        if time < math.inf:
            best = found = time
    return found


def _in_order(ball: Ball, lows: Array, highs: Array, horizon: float) -> list[tuple[int, float]]:
    """What the sphere can reach within ``horizon``, and from when on."""
    times = ball_times(ball.x, ball.v, ball.a, ball.radius + 2.0 * ball.touch, lows, highs, horizon)
    order = np.argsort(times, kind="stable")
    return [(int(k), float(times[k])) for k in order if times[k] < math.inf]


def edge_frame(features: Features, edge: int) -> tuple[Vec, Vec, float]:
    """One end of an edge, the unit vector along it, and its length."""
    start, end = (_vec(features.places[k]) for k in features.ends[edge])
    along = sub(end, start)
    length = norm(along)
    return start, scale(along, 1.0 / length), length


def edge_time(features: Features, edge: int, ball: Ball, horizon: float) -> float:
    """When the sphere meets an edge: the equation of spheres, across the edge."""
    start, e, length = edge_frame(features, edge)

    def belongs(s: float) -> bool:
        away = sub(ball.at(s), start)
        along = dot(e, away)
        return -ball.slack <= along <= length + ball.slack and edge_is_nearest(features, edge, _across(away, e), ball)

    return _round_time(_across(sub(start, ball.x), e), _across(ball.v, e), _across(ball.a, e), ball, belongs, horizon)


def corner_time(features: Features, corner: int, ball: Ball, horizon: float) -> float:
    """When the sphere meets a corner."""
    place = _vec(features.places[corner])

    def belongs(s: float) -> bool:
        return corner_is_nearest(features, corner, sub(ball.at(s), place), ball)

    return _round_time(sub(place, ball.x), ball.v, ball.a, ball, belongs, horizon)


def edge_is_nearest(features: Features, edge: int, away: Vec, ball: Ball) -> bool:
    """Whether no face of the edge is nearer to what is at ``away`` across it."""
    lean = (NEARER + ball.slack / ball.radius) * norm(away)
    return bool((features.inward_at(edge) @ np.array(away)).max() <= lean)


def corner_is_nearest(features: Features, corner: int, away: Vec, ball: Ball) -> bool:
    """Whether no edge of the corner is nearer to what is at ``away`` from it."""
    lean = (NEARER + ball.slack / ball.radius) * norm(away)
    return bool((features.spokes_at(corner) @ np.array(away)).max() <= lean)


def _round_time(d0: Vec, v: Vec, a: Vec, ball: Ball, belongs: Callable[[float], bool], horizon: float) -> float:
    """The first impact on a round border, at ``d0`` from the centre, that ``belongs`` to it and is no graze."""
    d1, d2 = scale(v, -1.0), scale(a, -1.0)
    distance = norm(d0)
    if distance == 0.0:
        return math.inf  # the centre lies on it: there is no side
    along = dot(d0, d1) / distance
    curve = dot(d0, d2) / distance + max(dot(d1, d1) - along * along, 0.0) / distance
    still = still_speed(ball.speeds, curve)
    if abs(distance - ball.radius) <= ball.touch and along > still:
        d0 = scale(d0, ball.radius / distance)  # a gap that counts as none is none
    time = sphere_sphere(d0, d1, d2, ball.radius, ball.touch, still, horizon)
    if time == math.inf:
        return time
    c = separation_polynomial(d0, d1, d2, ball.radius)
    for _ in range(4):
        after = time
        if belongs(time):
            after = _end_of_graze(c, time, ball)
            if after == time:
                return time
        time = sphere_sphere_meets(c, d0, d1, d2, ball.radius, still, after, horizon)
        if not time <= horizon:
            return math.inf
    return math.inf


def _end_of_graze(c: tuple[float, float, float, float, float], time: float, ball: Ball) -> float:
    """When the sphere is deepest, if that is no deeper than what counts as touching; else ``time``.

    A ball that slides on a face passes the border of it so.
    """
    slopes = derivative(c)
    if time == 0.0 or -value(slopes, time) > 2.0 * ball.radius * SLOW * ball.speeds:
        return time
    turn = first_crossing((-slopes[0], -slopes[1], -slopes[2], -slopes[3], 0.0), time, math.inf)
    if turn == math.inf or -value(c, turn) > 2.0 * ball.radius * ball.touch:
        return time
    return turn


def _across(vector: Vec, e: Vec) -> Vec:
    return sub(vector, scale(e, dot(e, vector)))


def _vec(row: Array) -> Vec:
    return (float(row[0]), float(row[1]), float(row[2]))


__all__ = ["Ball", "corner_is_nearest", "edge_frame", "edge_is_nearest", "over", "sphere_mesh"]
