"""Inertial forces of a frame that turns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from xpheve.laws import FieldLaw, Param

if TYPE_CHECKING:
    from xpheve.laws.view import BodyView


class RotatingFrame(FieldLaw):
    """Coriolis and centrifugal force of a frame that turns: F = -2 m W x v - m W x (W x d), where d = x - p.

    Holds in a frame that turns with constant angular velocity W about a fixed point p, as seen from an inertial frame; then the
    third inertial force, Euler's -m dW/dt x d, is 0. Positions, velocities, orientations and angular velocities of the scene are those seen in
    the turning frame: what stays at rest in it has v = 0. All objects of the scene that have mass must be mapped to it.

    A body that spins is held by the inertial torque -W x (J (w + W)) - w x (J W) + J (w x W), where J is its inertia tensor and w
    its angular velocity: so the axis of a free gyroscope keeps its direction among the stars and turns with -W in the scene (Foucault).

    Benefits and drawbacks: turntables, centrifuges and the turning Earth are simple in their own frame, in which walls are at rest. In the
    inertial frame the same free motion is a straight line in closed form. Do not set W while objects fly: Euler's force would be missing.

    Units: W [rad/s], point p [m], velocity v [m/s], force [N], torque [N m]. The potential is that of the centrifugal force, -m |W x d|^2/2
    [J]; Coriolis' does no work. The torque has none here; its work is reported.

    Cost: one evaluation a step, some forty operations a body, and as many for its torque; O(n) for n bodies.
    Accuracy: exact, to rounding, for points where all that acts is linear; else as exact as the stepper; order 2 in dt with the
    midpoint, for |W| dt < 0.1.

    Source: L. D. Landau, E. M. Lifshitz, Mechanics (3rd ed. 1976), section 39, equation 39.7; torque: Euler's equations, section 36, in the
    angular velocity w + W.
    """

    id = "basic:rotating_frame"
    role = "inertial"

    angular_velocity = Param((0.0, 0.0, 0.0), unit="rad/s", doc="W of the frame, as seen from an inertial one.")
    point = Param((0.0, 0.0, 0.0), unit="m", doc="p, on the axis.")

    def force(self, body: BodyView) -> Any:
        """Inertial force on each body [N]."""
        turning = np.cross(self.angular_velocity, body.position - self.point)
        return -body.mass * np.cross(self.angular_velocity, 2.0 * body.velocity + turning)

    def torque(self, body: BodyView) -> Any:
        """Inertial torque on each body [N m]; 0 for a point, and for a ball that does not spin."""
        frame, spin = body.to_body(self.angular_velocity), body.to_body(body.angular_velocity)
        # W x J W sees only how the moments differ: exactly 0 for a ball.
        centrifugal = frame.cross((body.inertia - body.inertia[:, 0:1]) * frame)
        gyroscopic = frame.cross(body.inertia * spin) + spin.cross(body.inertia * frame)
        return body.to_world(body.inertia * spin.cross(frame) - gyroscopic - centrifugal)

    def potential(self, body: BodyView) -> Any:
        """Potential energy [J] of the centrifugal force, 0 on the axis."""
        turning = (body.position - self.point).cross(self.angular_velocity)
        return -0.5 * body.mass * turning.dot(turning)
