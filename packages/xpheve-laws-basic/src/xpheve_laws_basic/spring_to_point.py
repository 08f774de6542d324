"""A spring that holds objects to a point of the world."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from xpheve.laws import Constant, FieldLaw, Param

if TYPE_CHECKING:
    from xpheve.laws.view import BodyView


class SpringToPoint(FieldLaw):
    """Elastic spring to a fixed point p: F = -k (|d| - L) d/|d|, where d = x - p.

    Holds for stretches in which the spring is linear and its own mass does not matter; it ends at the centre of
    mass, so it turns nothing. It pushes as well as pulls. At d = 0 it has no direction and the force is 0, which is
    exact for L = 0. What holds the point is not part of the scene, so momentum is not kept.

    A spring that also damps is this law and ``basic:damper_to_point`` on the same objects, for the reason that
    ``basic:spring`` gives.

    Benefits and drawbacks: cheaper than ``basic:spring`` to a fixed object, of which it needs none; but the place cannot move, nor be
    pulled along. The stiffer the spring, the smaller the steps must be.

    Units: stiffness k [N/m], lengths [m], force [N]; the potential is k (|d| - L)^2 / 2 [J].

    Cost: one evaluation a step, some twenty operations, a square root and three divisions a body; O(n) for n bodies.
    Accuracy: exact, to rounding, with L = 0 where all that acts is linear; else as exact as the stepper; order 2 in dt with
    the midpoint, stable while dt < 2 sqrt(m/k).

    Source: R. Hooke, Lectures de Potentia Restitutiva (1678); L. D. Landau, E. M. Lifshitz, Mechanics (3rd ed.
    1976), section 21.
    """

    id = "basic:spring_to_point"

    stiffness = Param(1.0, unit="N/m", ge=0, doc="k.")
    rest_length = Param(0.0, unit="m", ge=0, doc="L, the length without force.")
    anchor = Param((0.0, 0.0, 0.0), unit="m", doc="p, where the spring is held; world frame.")
    shortest = Constant(
        1e-150, unit="m", doc="Below it squares of lengths underflow; a spring that short has no direction."
    )

    def force(self, body: BodyView) -> Any:
        """Force on each body [N]."""
        d = body.position - self.anchor
        length = d.norm()
        return -self.stiffness * ((length - self.rest_length) / np.maximum(length, self.shortest)) * d

    def potential(self, body: BodyView) -> Any:
        """Potential energy [J], 0 at rest length."""
        stretch = (body.position - self.anchor).norm() - self.rest_length
        return 0.5 * self.stiffness * stretch * stretch
