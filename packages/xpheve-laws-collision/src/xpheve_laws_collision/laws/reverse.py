"""The cheapest bounce: back the way they came."""

from __future__ import annotations

from typing import ClassVar

from xpheve.laws import Contact, Param, ResponseLaw, Velocities


class Reverse(ResponseLaw):
    """Bodies that meet go back the way they came: v' = -v, for both.

    Cost: six signs a contact, whatever the shapes.

    Benefits and drawbacks: no normal is needed, so that it fits a container that knows none well, such as `collision:bounding_box`;
    energy is kept. Momentum is not, a body at rest stays at rest when it is hit, and a ball that meets a floor at an angle returns along
    its path; `collision:point` reflects it. Holds for a body that meets what is fixed, head-on.

    Source: Nourian (2004), 2.6 and 4.3.2.1 ("object.velocity = -object.velocity").
    """

    id: ClassVar[str] = "collision:reverse"
    container: ClassVar[str] = "collision:exact"
    lever_arms: ClassVar[bool] = False

    resting = Param(
        "error",
        choices=("error", "hold"),
        doc="What happens where a body comes to rest other than on one plane: an error that names it, or it is held in place.",
    )

    def respond(self, contact: Contact) -> Velocities:
        """Both velocities, reversed."""
        a, b = contact.body_a.velocity, contact.body_b.velocity
        return Velocities([0.0 - component for component in a], [0.0 - component for component in b])
