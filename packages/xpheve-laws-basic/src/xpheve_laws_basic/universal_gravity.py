"""Gravity between bodies."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from xpheve.laws import PairLaw, Param

if TYPE_CHECKING:
    from xpheve.laws.view import BodyView


class UniversalGravity(PairLaw):
    """Newton's gravity: F on a = -G m_a m_b d / (|d|^2 + s^2)^(3/2), where d leads from b to a.

    Holds for points and for bodies outside one another whose mass is spread in spherical shells, at speeds far
    below that of light. Without softening (s = 0) it is singular at d = 0, and two bodies in one place are an
    error. With softening each body acts like a Plummer sphere of radius s, which is for swarms where close
    encounters do not matter.

    Benefits and drawbacks: orbits, and pulls both ways; ``basic:planet_gravity`` is its limit near the ground, in closed form and
    free along the way; ``basic:black_hole_gravity`` adds the last stable orbit around one hole. All pairs are summed, which is slow
    beyond some thousands of bodies, unless ``error`` allows a tree.

    Units: G [m^3/(kg s^2)], masses [kg], lengths [m], force [N]; the potential of a pair is -G m_a m_b / sqrt(|d|^2
    + s^2) [J].

    Cost: one evaluation a step; n (n - 1)/2 pairs of n bodies, or sources times targets with ``between``: O(n^2); by a tree
    about O(n log n).
    Accuracy: the force is exact to rounding, or of 99% of the bodies within ``error``; trajectories are as exact as the stepper,
    order 2 in dt with the midpoint.

    Source: I. Newton, Principia (1687), book III, proposition VII; G of CODATA 2018: E. Tiesinga et al., Rev. Mod.
    Phys. 93, 025010 (2021); softening: H. C. Plummer, MNRAS 71, 460 (1911).
    """

    id = "basic:universal_gravity"
    role = "gravity"
    singular = "Two bodies in one place attract without bound: move them apart, or give the law a softening"

    gravitational_constant = Param(6.67430e-11, unit="m^3/(kg s^2)", ge=0, doc="G; relative uncertainty 2.2e-5.")
    softening = Param(0.0, unit="m", ge=0, doc="s, the Plummer radius; 0 for Newton's law itself.")
    error = Param(
        0.0, unit="1", ge=0, le=0.1, doc="Relative error that sums over many bodies may have; 0 for exact ones."
    )

    def force(self, a: BodyView, b: BodyView) -> Any:
        """Force [N] on ``a`` of each pair."""
        d = a.position - b.position
        square = d.dot(d) + self.softening**2
        return -self.gravitational_constant * a.mass * b.mass / (square * np.sqrt(square)) * d

    def potential(self, a: BodyView, b: BodyView) -> Any:
        """Potential energy [J] of each pair, 0 far apart."""
        d = a.position - b.position
        return -self.gravitational_constant * a.mass * b.mass / np.sqrt(d.dot(d) + self.softening**2)
