"""The thesis's response: bodies answer as points."""

from __future__ import annotations

from typing import ClassVar

from xpheve.laws import Contact, Impulse, Param, ResponseLaw
from xpheve_laws_collision.mass import inverse_mass


class Point(ResponseLaw):
    """Bodies answer as points, whatever their shape: the normal components of both velocities exchange momentum.

    With n the normal and u_i = v_i . n, signed along that one normal, two bodies that move leave with

    u_1' = ((m_1 - m_2) u_1 + 2 m_2 u_2) / (m_1 + m_2), and u_2' likewise;

    one that meets what is fixed with u' = -factor u. Surface components v - (v . n) n stay as they are, to the bit. The
    bouncing factor applies to fixed partners only: between two bodies that move the collision is elastic. Bodies that recede are
    left alone.

    Cost: one division a contact.

    Benefits and drawbacks: it is exact for spheres. Nothing is ever set spinning, and the angular momentum of extended bodies is not
    kept: `collision:elastic` does both. A corner that turns into another body while the centres recede is not answered. Holds for
    bodies whose size and spin do not matter.

    Source: Nourian (2004), 4.3.2 and appendix A, with signed components along one normal in place of magnitudes and angles.
    """

    id: ClassVar[str] = "collision:point"
    container: ClassVar[str] = "collision:exact"
    lever_arms: ClassVar[bool] = False

    factor = Param(
        1.0,
        unit="1",
        ge=0,
        le=1,
        doc="Bouncing factor: part of the normal speed that is left after meeting what is fixed.",
    )
    resting = Param(
        "error",
        choices=("error", "hold"),
        doc="What happens where a body comes to rest other than on one plane: an error that names it, or it is held in place.",
    )

    def respond(self, contact: Contact) -> float | Impulse:
        """Separation speed [m/s] along the normal: the formula of appendix A keeps the relative speed."""
        alone = 0.0 in (inverse_mass(contact.body_a), inverse_mass(contact.body_b))
        return (self.factor if alone else 1.0) * contact.approach_speed
