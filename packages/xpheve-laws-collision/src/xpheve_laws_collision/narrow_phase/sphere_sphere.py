"""Sphere and sphere."""

from __future__ import annotations

import math

from xpheve.errors import ContactError
from xpheve.kernels.vector import add, dot, norm, scale, sub
from xpheve_laws_collision.impact_time.sphere_sphere import sphere_sphere, sphere_sphere_leaves
from xpheve_laws_collision.narrow_phase import TOUCH, ULPS, Gap, Mover, still_speed


class SphereSphere:
    """Two spheres (or points), moving or fixed."""

    rests = False

    def gap(self, a: Mover, b: Mover) -> Gap:
        d, v, acceleration = _relative(a, b)
        distance = a.shape.radius + b.shape.radius
        length = norm(d)
        normal = scale(d, 1.0 / length) if length > 0.0 else (0.0, 0.0, 1.0)
        speed = dot(normal, v)
        across = dot(v, v) - speed * speed
        if not across < math.inf:  # beyond the range of floats
            across = math.inf if any(sub(v, scale(normal, speed))) else 0.0
        bend = across / length if length > 0.0 else 0.0
        touch = TOUCH * distance + ULPS * (norm(a.position) + norm(b.position))
        gap = length - distance
        point = add(a.position, scale(normal, a.shape.radius + 0.5 * gap))
        closing = dot(normal, acceleration) + max(bend, 0.0)
        still = still_speed(norm(a.velocity) + norm(b.velocity), closing)
        return Gap(gap, speed, closing, normal, point, touch, still)

    def points(self, a: Mover, b: Mover) -> list[Gap]:
        return [self.gap(a, b)]

    def impact_time(self, a: Mover, b: Mover, gap: Gap, horizon: float) -> float:
        d, v, acceleration = _relative(a, b)
        distance = a.shape.radius + b.shape.radius
        if abs(gap.separation) <= gap.touch and gap.speed > gap.still:
            d = scale(gap.normal, distance)  # a gap that counts as none is none
        return sphere_sphere(d, v, acceleration, distance, gap.touch, gap.still, horizon)

    def leave_time(self, a: Mover, b: Mover, gap: Gap, horizon: float) -> float:
        d, v, acceleration = _relative(a, b)
        return sphere_sphere_leaves(d, v, acceleration, a.shape.radius + b.shape.radius, horizon)

    def apart_for(self, a: Mover, b: Mover) -> float:
        return 0.0


def _relative(a: Mover, b: Mover) -> tuple[tuple[float, float, float], ...]:
    """Position, velocity and acceleration of b as seen from a; raises `ContactError` for a velocity that no float holds."""
    velocity = sub(b.velocity, a.velocity)
    if not max(map(abs, velocity)) < math.inf:
        raise ContactError(f"bodies meet at {velocity} m/s, which no float holds: let them go slower")
    return sub(b.position, a.position), velocity, sub(b.acceleration, a.acceleration)
