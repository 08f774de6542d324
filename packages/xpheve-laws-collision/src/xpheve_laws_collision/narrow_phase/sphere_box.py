"""Sphere (or point) and box, or capsule, that does not turn: in closed form; else as `Convex`."""

from __future__ import annotations

import math
from typing import Any

from xpheve.errors import ContactError
from xpheve.kernels.quaternion import rotate, rotate_inverse
from xpheve.kernels.vector import Vec, add, dot, norm, scale, sub
from xpheve_laws_collision.impact_time.rounded_box import ball_box, ball_box_leaves, second_rate, standing
from xpheve_laws_collision.narrow_phase import TOUCH, ULPS, Gap, Mover, still_speed
from xpheve_laws_collision.narrow_phase.convex import Convex, turns


class SphereBox(Convex):
    """A sphere and a box or capsule.

    The first is a ball seen from a box that stands still, the second a ball with the radii of both and a box without width and
    depth: one equation for each piece of the flight (`impact_time.rounded_box`).
    """

    def gap(self, a: Mover, b: Mover) -> Gap:
        if turns(b):
            return super().gap(a, b)
        d, v, acceleration = _seen(a, b)
        half, radius = _rounded(a, b)
        distance, *outward = standing(d, half)
        separation = distance - radius
        local = (0.0 - outward[0], 0.0 - outward[1], 0.0 - outward[2])
        speed = 0.0 - dot(local, v)
        rate = second_rate(d, v, acceleration, half)
        normal = rotate(b.orientation, local)
        point = add(a.position, scale(normal, a.shape.radius + 0.5 * separation))
        size = norm(half) + radius
        touch = TOUCH * size + ULPS * (norm(a.position) + norm(b.position))
        return Gap(
            separation, speed, rate, normal, point, touch, still_speed(norm(a.velocity) + norm(b.velocity), rate)
        )

    def points(self, a: Mover, b: Mover) -> list[Gap]:
        return super().points(a, b) if turns(b) else [self.gap(a, b)]

    def impact_time(self, a: Mover, b: Mover, gap: Gap, horizon: float) -> float:
        """See `impact_time.rounded_box.ball_box`.

        Raises
        ------
        ContactError
            If the bodies meet at a speed that no float holds.
        """
        if turns(b):
            return super().impact_time(a, b, gap, horizon)
        d, v, acceleration = _seen(a, b)
        if not max(map(abs, v)) < math.inf:
            raise ContactError(f"bodies meet at {v} m/s, which no float holds: let them go slower")
        half, radius = _rounded(a, b)
        return ball_box(d, v, acceleration, half, radius, gap.touch, gap.still, horizon)

    def leave_time(self, a: Mover, b: Mover, gap: Gap, horizon: float) -> float:
        """See `impact_time.rounded_box.ball_box_leaves`."""
        if turns(b):
            return super().leave_time(a, b, gap, horizon)
        half, radius = _rounded(a, b)
        return ball_box_leaves(*_seen(a, b), half, radius, horizon)

    def apart_for(self, a: Mover, b: Mover) -> float:
        return super().apart_for(a, b) if turns(b) else 0.0


def _seen(a: Mover, b: Mover) -> tuple[Vec, Vec, Vec]:
    """Position, velocity and acceleration of the sphere in the frame of the box."""
    q = b.orientation
    return (
        rotate_inverse(q, sub(a.position, b.position)),
        rotate_inverse(q, sub(a.velocity, b.velocity)),
        rotate_inverse(q, sub(a.acceleration, b.acceleration)),
    )


def _rounded(a: Mover, b: Mover) -> tuple[Vec, float]:
    """Half edges of the box, and the radius of the ball that meets it [m]."""
    shape: Any = b.shape
    if shape.kind == "capsule":
        return (0.0, 0.0, 0.5 * shape.length), shape.radius + a.shape.radius
    x, y, z = shape.size
    return (0.5 * x, 0.5 * y, 0.5 * z), a.shape.radius
