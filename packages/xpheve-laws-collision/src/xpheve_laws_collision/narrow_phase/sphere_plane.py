"""Sphere and plane."""

from __future__ import annotations

from xpheve.kernels.quaternion import rotate
from xpheve.kernels.vector import add, dot, norm, scale, sub
from xpheve_laws_collision.impact_time.sphere_plane import sphere_plane, sphere_plane_leaves
from xpheve_laws_collision.narrow_phase import TOUCH, ULPS, Gap, Mover, Vec, still_speed


class SpherePlane:
    """A sphere (or a point) and a fixed plane: everything is linear in the sphere's centre."""

    rests = True

    def gap(self, a: Mover, b: Mover) -> Gap:
        radius = a.shape.radius
        outward: Vec = rotate(b.orientation, b.shape.normal)
        offset = sub(a.position, b.position)
        height = dot(outward, offset) - b.shape.offset
        speed = dot(outward, a.velocity)
        touch = TOUCH * radius + ULPS * (norm(a.position) + norm(b.position) + abs(b.shape.offset))
        point = sub(a.position, scale(outward, height))
        normal = (0.0 - outward[0], 0.0 - outward[1], 0.0 - outward[2])
        acceleration = dot(outward, a.acceleration)
        still = still_speed(norm(a.velocity), acceleration)
        return Gap(height - radius, speed, acceleration, normal, point, touch, still)

    def points(self, a: Mover, b: Mover) -> list[Gap]:
        return [self.gap(a, b)]

    def impact_time(self, a: Mover, b: Mover, gap: Gap, horizon: float) -> float:
        # A gap that counts as none is none: else a bounce lower than its rounding would not come back.
        separation = 0.0 if abs(gap.separation) <= gap.touch else gap.separation
        return sphere_plane(separation, gap.speed, gap.acceleration, gap.touch, gap.still, horizon)

    def leave_time(self, a: Mover, b: Mover, gap: Gap, horizon: float) -> float:
        return sphere_plane_leaves(gap.separation, gap.speed, gap.acceleration, horizon)

    def apart_for(self, a: Mover, b: Mover) -> float:
        return 0.0


def put_on(sphere: Mover, gap: Gap) -> tuple[Vec, Vec]:
    """Position and velocity of a sphere set on the plane: no gap, no normal speed."""
    n = gap.normal
    along = dot(n, sphere.velocity)
    return add(sphere.position, scale(n, gap.separation)), sub(sphere.velocity, scale(n, along))
