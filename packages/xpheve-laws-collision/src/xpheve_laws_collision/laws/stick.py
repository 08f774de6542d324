"""Bodies that stick to each other where they meet."""

from __future__ import annotations

import math
from typing import ClassVar

from xpheve.laws import Contact, Grip, Impulse, Param, ResponseLaw
from xpheve_laws_collision.touching_impulse import touching_impulse


class Stick(ResponseLaw):
    """Perfectly plastic impact: where the bodies touch they leave with one velocity, v' = 0 between the surfaces, across and along.

    Momentum and angular momentum are kept; of all impulses at the contact it is the one that loses the most energy. Two balls that meet
    head-on go on as one; a ball that hits a rod's end turns it, and a rod that lands on its end pivots about it.

    Cost: as `collision:friction`.

    Benefits and drawbacks: with the right masses and inertia, where `collision:stop` takes the velocity from both, whoever pushes whom,
    and loses momentum. It is no joint: nothing holds the bodies together after the instant, so that forces, other impacts, or a turn
    that moves the contact on, part them again. Two that touch and are pressed together are lasting contact: see ``resting``.

    Source: plastic impact with friction enough to stick, Routh, Dynamics of a system of rigid bodies (1905), I, 180 ff.
    """

    id: ClassVar[str] = "collision:stick"
    container: ClassVar[str] = "collision:exact"

    resting = Param(
        "error",
        choices=("error", "hold"),
        doc="What happens where a body comes to rest other than on one plane: an error that names it, or it is held in place.",
    )

    def grip(self, contact: Contact) -> Grip:
        """Nothing comes back, nothing slips."""
        return Grip(0.0, math.inf, 0.0)

    def respond(self, contact: Contact) -> Impulse:
        """Impulse [N s] at one contact point."""
        return Impulse(touching_impulse(contact, 0.0, None, 0.0))
