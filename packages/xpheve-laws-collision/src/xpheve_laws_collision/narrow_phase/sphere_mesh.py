"""Sphere (or point) and triangle mesh.

The surface has no thickness and two sides; that of the sphere's centre is outside. ``separation`` is the distance of the centre
from the surface less the radius. A sphere that cuts the surface is pushed out to the side of its centre; a centre on the surface
itself counts as in front of it, where the triangles wind anticlockwise.
"""

from __future__ import annotations

from xpheve.errors import ContactError
from xpheve.kernels.quaternion import rotate, rotate_inverse
from xpheve.kernels.vector import add, dot, norm, scale, sub
from xpheve_laws_collision.impact_time.sphere_mesh import Ball, edge_frame, sphere_mesh
from xpheve_laws_collision.impact_time.sphere_mesh_leaves import sphere_mesh_leaves
from xpheve_laws_collision.narrow_phase import TOUCH, ULPS, Gap, Mover, still_speed
from xpheve_laws_collision.narrow_phase.mesh_features import features_of
from xpheve_laws_collision.narrow_phase.mesh_places import EDGE, FACE, Place, nearest_places

SKIN = 1e-10  # of the reach of the mesh: points, and spheres smaller than this, touch it at this distance


class SphereMesh:
    """A sphere and a mesh that does not turn."""

    rests = False

    def gap(self, a: Mover, b: Mover) -> Gap:
        features, ball = features_of(b.shape), ball_of(a, b)
        places = nearest_places(features, ball, ball.x, 0.0)
        return min((_gap(one, ball, b) for one in places), key=lambda one: one.speed)

    def points(self, a: Mover, b: Mover) -> list[Gap]:
        """One for each place at which the sphere touches or cuts the surface: faces, then edges, then corners.

        Two faces of a corner of a room are two places; two triangles of one plane are one. If it touches nowhere, the nearest.
        """
        features, ball = features_of(b.shape), ball_of(a, b)
        return [_gap(one, ball, b) for one in nearest_places(features, ball, ball.x, ball.radius)]

    def impact_time(self, a: Mover, b: Mover, gap: Gap, horizon: float) -> float:
        return sphere_mesh(features_of(b.shape), ball_of(a, b), horizon)

    def leave_time(self, a: Mover, b: Mover, gap: Gap, horizon: float) -> float:
        return sphere_mesh_leaves(features_of(b.shape), ball_of(a, b), horizon)

    def apart_for(self, a: Mover, b: Mover) -> float:
        return 0.0


def ball_of(a: Mover, b: Mover) -> Ball:
    """The sphere ``a`` in the frame of the mesh ``b``.

    Raises
    ------
    ContactError
        If the mesh turns.
    """
    if any(b.angular_velocity) or any(b.torque):
        raise ContactError(
            f"{b.shape!r} turns (angular velocity {b.angular_velocity} rad/s): contacts with a mesh are known where it does not "
            "turn. Make it a Hull or a Compound of convex parts, or hold its rotation"
        )
    reach = features_of(b.shape).reach
    around = norm(b.position) + reach
    radius = max(a.shape.radius, SKIN * reach, 64.0 * ULPS * around)
    touch = TOUCH * radius + ULPS * (norm(a.position) + around)
    q = b.orientation
    return Ball(
        rotate_inverse(q, sub(a.position, b.position)),
        rotate_inverse(q, sub(a.velocity, b.velocity)),
        rotate_inverse(q, sub(a.acceleration, b.acceleration)),
        radius,
        touch,
        2.0 * touch,
        norm(a.velocity) + norm(b.velocity),
    )


def _gap(place: Place, ball: Ball, b: Mover) -> Gap:
    n = place.outward
    speed = dot(n, ball.v)
    acceleration = dot(n, ball.a)
    if place.kind != FACE:
        v = ball.v
        if place.kind == EDGE:
            _, e, _ = edge_frame(features_of(b.shape), place.number)
            v = sub(v, scale(e, dot(e, v)))
        acceleration += max(dot(v, v) - speed * speed, 0.0) / place.distance
    normal = rotate(b.orientation, n)
    return Gap(
        place.distance - ball.radius,
        speed,
        acceleration,
        (0.0 - normal[0], 0.0 - normal[1], 0.0 - normal[2]),
        add(b.position, rotate(b.orientation, place.point)),
        ball.touch,
        still_speed(ball.speeds, acceleration),
    )
