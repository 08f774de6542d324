"""A damper that holds objects back from moving to and from a point of the world."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from xpheve.laws import Constant, FieldLaw, Param

if TYPE_CHECKING:
    from xpheve.laws.view import BodyView


class DamperToPoint(FieldLaw):
    """Viscous damper to a fixed point p: F = -c (u . v) u, where u = d/|d| and d = x - p.

    Holds where the resistance grows in proportion to the speed at which the distance changes; circling around the
    point is free. At d = 0 it has no direction and the force is 0, so that an object on its way through the point
    is not damped just there. With ``basic:spring_to_point`` on the same objects it makes a spring-damper; critical
    damping is c = 2 sqrt(k m).

    Benefits and drawbacks: ``basic:linear_drag`` damps motion in all directions, with three multiplications; this one
    only to and from the point. ``basic:damper`` is the same between two objects, and keeps their momentum.

    Units: damping c [N s/m], velocity v [m/s], force [N]. There is no potential; the work is reported.

    Cost: one evaluation a step, some thirty operations, a square root and three divisions a body; O(n) for n bodies.
    Accuracy: as exact as the stepper; order 2 in dt with the midpoint, stable while c dt / m < 2.

    Source: L. D. Landau, E. M. Lifshitz, Mechanics (3rd ed. 1976), section 25.
    """

    id = "basic:damper_to_point"

    damping = Param(1.0, unit="N*s/m", ge=0, doc="c.")
    anchor = Param((0.0, 0.0, 0.0), unit="m", doc="p, where the damper is held; world frame.")
    shortest = Constant(
        1e-150, unit="m", doc="Below it squares of lengths underflow; a damper that short has no direction."
    )

    def force(self, body: BodyView) -> Any:
        """Force on each body [N]."""
        d = body.position - self.anchor
        u = d / np.maximum(d.norm(), self.shortest)
        return -self.damping * u.dot(body.velocity) * u
