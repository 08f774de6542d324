"""Perfectly rough bodies: superballs."""

from __future__ import annotations

import math
from typing import ClassVar

from xpheve.laws import Contact, Grip, Impulse, Param, ResponseLaw
from xpheve_laws_collision.touching_impulse import touching_impulse


class Rough(ResponseLaw):
    """Impact of perfectly rough bodies, which never slip: v_n' = -e v_n and v_t' = -beta v_t, with v that of the surfaces.

    At e = beta = 1, the default, energy is kept, and the impulse is the only one that keeps it and reverses the velocity at the contact:
    that of superballs. One thrown under a table comes back to the hand after three bounces. Momentum and angular momentum are kept, for a
    ball on a fixed wall that about the contact point. At beta = -1 the bodies are smooth; at beta = 0 they stick. Extended bodies turn by
    their full inertia.

    Cost: as `collision:friction`.

    Benefits and drawbacks: reversible, so that spins and velocities can be told in closed form over many bounces. Real surfaces slip at
    grazing angles: `collision:friction` has a limit to what the surfaces hold. Lasting contact has no friction yet.

    Source: Garwin, Kinematics of an ultraelastic rough ball, Am. J. Phys. 37 (1969) 88; Broomhead and Gutkin, The dynamics of billiards
    with no-slip collisions, Physica D 67 (1993) 188.
    """

    id: ClassVar[str] = "collision:rough"
    container: ClassVar[str] = "collision:exact"

    restitution = Param(1.0, unit="1", ge=0, le=1, doc="Newton's coefficient of restitution, e.")
    beta = Param(1.0, unit="1", ge=-1, le=1, doc="Tangential restitution: part of the slip that is reversed.")
    resting = Param(
        "error",
        choices=("error", "hold"),
        doc="What happens where a body comes to rest other than on one plane: an error that names it, or it is held in place.",
    )

    def grip(self, contact: Contact) -> Grip:
        """Surfaces that hold whatever it takes."""
        return Grip(self.restitution, math.inf, self.beta)

    def respond(self, contact: Contact) -> Impulse:
        """Impulse [N s] at one contact point."""
        return Impulse(touching_impulse(contact, self.restitution, None, self.beta))
