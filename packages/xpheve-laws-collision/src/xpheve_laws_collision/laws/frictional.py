"""Impact with friction: restitution along the normal, Coulomb's cone across it, spin."""

from __future__ import annotations

import math
from typing import ClassVar

from xpheve.laws import Column, Contact, Grip, Impulse, Param, ResponseLaw
from xpheve_laws_collision.combining import RULES, combined
from xpheve_laws_collision.touching_impulse import touching_impulse


class Frictional(ResponseLaw):
    """Impact with restitution and Coulomb friction: v_n' = -e v_n, and across the normal |P_t| <= mu P_n.

    The surfaces stick if the impulse that needs lies in the cone: the slip is then reversed by the ``tangential`` restitution, which is 0
    for most materials. Else they slide: for spheres at mu times the normal impulse, against the slip; for other bodies along the impulse
    that would make them stick. Spins change with the full inertia, so that a ball thrown with backspin comes back. ``friction`` and
    ``restitution`` hold for objects that have none of their own; two values are combined by ``combine_friction`` and ``combine``.
    Momentum and angular momentum are kept. Energy never rises, whatever the shapes, spins and coefficients. Impacts at one instant are
    solved together: first along all normals, as by `collision:elastic`, then across them, each within its own cone.

    Cost: as `collision:elastic`, and for one contact about a third more; a millisecond or more for several that are connected.

    Benefits and drawbacks: the normal speed is reversed by e exactly, and energy does not rise, which Newton's law with slip integrated
    along the impact does not give (Kane's paradox); slip that changes its direction during one impact is not followed. Lasting contact
    has no friction yet: a ball that has come to rest on a plane slides and keeps its spin.

    Source: Chatterjee and Ruina, A new algebraic rigid-body collision law based on impulse space considerations, J. Appl. Mech. 65 (1998)
    939; for spheres Walton (1993), and Foerster et al., Phys. Fluids 6 (1994) 1108; contacts solved together: Moreau (1988).
    """

    id: ClassVar[str] = "collision:friction"
    container: ClassVar[str] = "collision:exact"
    columns: ClassVar[dict[str, Column]] = {
        "restitution": Column(math.nan, unit="1", ge=0, le=1, doc="The object's own coefficient of restitution."),
        "friction": Column(math.nan, unit="1", ge=0, doc="The object's own coefficient of friction."),
    }

    restitution = Param(1.0, unit="1", ge=0, le=1, doc="Of objects that have none of their own.")
    friction = Param(0.3, unit="1", ge=0, doc="Coulomb's coefficient, of objects that have none of their own.")
    tangential = Param(0.0, unit="1", ge=-1, le=1, doc="Part of the slip that is reversed where the surfaces stick.")
    combine = Param("average", choices=RULES, doc="How the restitutions of two objects make one.")
    combine_friction = Param("geometric", choices=RULES, doc="How the frictions of two objects make one.")
    resting = Param(
        "error",
        choices=("error", "hold"),
        doc="What happens where a body comes to rest other than on one plane: an error that names it, or it is held in place.",
    )

    def coefficients(self, contact: Contact) -> tuple[float, float]:
        """Restitution and friction of one contact."""
        a, b = contact.body_a, contact.body_b
        e = combined(self.combine, a["restitution"], b["restitution"], self.restitution)
        return e, combined(self.combine_friction, a["friction"], b["friction"], self.friction)

    def grip(self, contact: Contact) -> Grip:
        """Restitution, friction and tangential restitution of one contact."""
        return Grip(*self.coefficients(contact), self.tangential)

    def respond(self, contact: Contact) -> Impulse:
        """Impulse [N s] at one contact point."""
        e, mu = self.coefficients(contact)
        return Impulse(touching_impulse(contact, e, mu, self.tangential))
