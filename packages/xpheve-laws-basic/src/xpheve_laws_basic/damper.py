"""A damper between two objects."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from xpheve.laws import Constant, PairLaw, Param

if TYPE_CHECKING:
    from xpheve.laws.view import BodyView


class Damper(PairLaw):
    """Viscous damper (dashpot): F on a = -c (u . (v_a - v_b)) u, where u = d/|d| and d leads from b to a.

    Holds where the resistance grows in proportion to the speed at which the distance changes; motion across it is
    free. At d = 0 it has no direction and the force is 0. With ``basic:spring`` on the same objects it makes a
    spring-damper; critical damping of a pair is c = 2 sqrt(k m), where m is the reduced mass m_a m_b / (m_a + m_b).

    Benefits and drawbacks: ``basic:linear_drag`` damps all motion against a fluid and takes momentum away; this one damps only
    the stretching of a pair, and keeps its momentum. A stiff damper asks for small steps.

    Units: damping c [N s/m], velocities [m/s], force [N]. There is no potential; the work is reported.

    Cost: one evaluation a step, some thirty operations, a square root and three divisions a pair; O(n^2) for n bodies that are all joined.
    Accuracy: as exact as the stepper; order 2 in dt with the midpoint, stable while c dt / m < 2.

    Source: L. D. Landau, E. M. Lifshitz, Mechanics (3rd ed. 1976), section 25.
    """

    id = "basic:damper"

    damping = Param(1.0, unit="N*s/m", ge=0, doc="c.")
    shortest = Constant(
        1e-150, unit="m", doc="Below it squares of lengths underflow; a damper that short has no direction."
    )

    def force(self, a: BodyView, b: BodyView) -> Any:
        """Force [N] on ``a`` of each pair."""
        d = a.position - b.position
        u = d / np.maximum(d.norm(), self.shortest)
        return -self.damping * u.dot(a.velocity - b.velocity) * u
