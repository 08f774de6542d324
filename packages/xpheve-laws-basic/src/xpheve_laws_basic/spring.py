"""A spring between two objects."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from xpheve.laws import Constant, PairLaw, Param

if TYPE_CHECKING:
    from xpheve.laws.view import BodyView


class Spring(PairLaw):
    """Elastic spring: F on a = -k (|d| - L) d/|d|, where d leads from b to a.

    Holds for stretches in which the spring is linear and its own mass does not matter; its ends are the centres of
    mass, so it turns nothing. It pushes as well as pulls. At d = 0 it has no direction and the force is 0, which is
    exact for L = 0.

    A spring that also damps is this law and ``basic:damper`` on the same objects. They are two laws so that this
    one has a potential, by which energy is accounted exactly, and the other reports the work that it takes.

    Benefits and drawbacks: a soft way to join two objects, of any number of pairs, with an exact energy balance; but the stiffer the
    spring, the smaller the steps must be. ``basic:spring_to_point`` holds one object to a place instead.

    Units: stiffness k [N/m], lengths [m], force [N]; the potential is k (|d| - L)^2 / 2 [J].

    Cost: one evaluation a step, some twenty operations, a square root and three divisions a pair; O(n^2) for n bodies that are all joined.
    Accuracy: exact, to rounding, with L = 0 where all that acts is linear; else as exact as the stepper; order 2 in dt with the midpoint,
    stable while dt < 2 sqrt(m/k), where m is
    the reduced mass m_a m_b / (m_a + m_b).

    Source: R. Hooke, Lectures de Potentia Restitutiva (1678); L. D. Landau, E. M. Lifshitz, Mechanics (3rd ed.
    1976), section 21.
    """

    id = "basic:spring"

    stiffness = Param(1.0, unit="N/m", ge=0, doc="k.")
    rest_length = Param(0.0, unit="m", ge=0, doc="L, the length without force.")
    shortest = Constant(
        1e-150, unit="m", doc="Below it squares of lengths underflow; a spring that short has no direction."
    )

    def force(self, a: BodyView, b: BodyView) -> Any:
        """Force [N] on ``a`` of each pair."""
        d = a.position - b.position
        length = d.norm()
        return -self.stiffness * ((length - self.rest_length) / np.maximum(length, self.shortest)) * d

    def potential(self, a: BodyView, b: BodyView) -> Any:
        """Potential energy [J] of each pair, 0 at rest length."""
        stretch = (a.position - b.position).norm() - self.rest_length
        return 0.5 * self.stiffness * stretch * stretch
