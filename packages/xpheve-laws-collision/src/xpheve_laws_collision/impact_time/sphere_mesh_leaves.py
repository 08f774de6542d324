"""When a sphere that touches or cuts a mesh is apart from it."""

from __future__ import annotations

import math

from xpheve.kernels.polynomial import quadratic_roots
from xpheve.kernels.vector import Vec, add, dot, norm, scale, sub
from xpheve_laws_collision.impact_time.sphere_mesh import Ball, edge_frame, sphere_mesh
from xpheve_laws_collision.impact_time.sphere_plane import sphere_plane_leaves
from xpheve_laws_collision.impact_time.sphere_sphere import sphere_sphere_leaves
from xpheve_laws_collision.narrow_phase import still_speed
from xpheve_laws_collision.narrow_phase.mesh_features import Features
from xpheve_laws_collision.narrow_phase.mesh_places import EDGE, FACE, Place, nearest_places

STEPS = 10_000


def sphere_mesh_leaves(features: Features, ball: Ball, horizon: float) -> float:
    """Time [s] in [0, horizon] at which the separation goes from at most 0 to more; infinite if it does not.

    The nearest place of the surface is cut until the sphere leaves it alone, or its centre is no longer over that face or
    beside that edge: then it is asked which is the nearest. A way shorter than the depth is no way out either.
    """
    from xpheve_laws_collision.impact_time.advancement import UndecidedError

    t = 0.0
    if nearest_places(features, ball, ball.x, 0.0)[0].distance - ball.radius > ball.touch:
        t = sphere_mesh(features, ball, horizon)
    for _ in range(STEPS):
        if not t <= horizon or t == math.inf:
            return math.inf
        x, v = ball.at(t), add(ball.v, scale(ball.a, t))
        places = nearest_places(features, ball, x, 0.0)
        separation = places[0].distance - ball.radius
        if separation > ball.touch or (separation >= -ball.touch and all(_opens(one, v, ball) for one in places)):
            return t
        speed, pull = norm(v), norm(ball.a)
        if speed == 0.0 and pull == 0.0:
            return math.inf
        depth = max(-separation, ball.touch)
        safe = 2.0 * depth / (speed + math.sqrt(speed * speed + 2.0 * pull * depth))
        cut = max(_cut_for(features, one, x, v, ball) for one in places)
        t = max(t + max(safe, cut), math.nextafter(t, math.inf))
    raise UndecidedError(t, "no parting")


def _opens(place: Place, v: Vec, ball: Ball) -> bool:
    speed, rate = dot(place.outward, v), dot(place.outward, ball.a)
    still = still_speed(ball.speeds, rate)
    return speed > still or (abs(speed) <= still and rate > 0.0)


def _cut_for(features: Features, place: Place, x: Vec, v: Vec, ball: Ball) -> float:
    """How long [s] the sphere surely cuts the feature of ``place``."""
    gap = min(place.distance - ball.radius, 0.0)
    if place.kind == FACE:
        speed, rate = dot(place.outward, v), dot(place.outward, ball.a)
        leaves = min(
            sphere_plane_leaves(gap, speed, rate, math.inf),
            sphere_plane_leaves(-place.distance - ball.radius, -speed, -rate, math.inf),  # out on the other side
        )
        sides = zip(features.inward[place.number].tolist(), features.corners[place.number].tolist(), strict=True)
        return min(leaves, *(_stays(inward, corner, x, v, ball.a) for inward, corner in sides))
    d0, d1, d2 = scale(place.outward, -min(place.distance, ball.radius)), scale(v, -1.0), scale(ball.a, -1.0)
    if place.kind != EDGE:
        return sphere_sphere_leaves(d0, d1, d2, ball.radius, math.inf)
    start, e, length = edge_frame(features, place.number)
    d1, d2 = sub(d1, scale(e, dot(e, d1))), sub(d2, scale(e, dot(e, d2)))
    leaves = sphere_sphere_leaves(d0, d1, d2, ball.radius, math.inf)
    end = add(start, scale(e, length))
    return min(leaves, _stays(e, start, x, v, ball.a), _stays(scale(e, -1.0), end, x, v, ball.a))


def _stays(inward: Vec, border: Vec, x: Vec, v: Vec, a: Vec) -> float:
    """How long the centre stays on the inner side of a border."""
    height = dot(inward, sub(x, border))
    if height <= 0.0:
        return 0.0
    roots = quadratic_roots(height, dot(inward, v), 0.5 * dot(inward, a))
    return min((root for root in roots if root > 0.0), default=math.inf)
