"""The cheapest response: nobody moves any more."""

from __future__ import annotations

from typing import ClassVar

from xpheve.laws import Contact, Param, ResponseLaw, Velocities

STILL = (0.0, 0.0, 0.0)


class Stop(ResponseLaw):
    """Bodies that meet stand still: v' = 0, for both.

    Cost: none but the call; with `collision:bounding_box` it is the cheapest answer there is.

    Benefits and drawbacks: it needs no normal and no masses, and is for tutorials and where objects only must not pass each other.
    Momentum and energy are lost, also along the surface, where `collision:point` keeps the velocity. Forces that push bodies together
    go on, so that under a polled container they creep into each other by half the acceleration times the square of the time
    between two looks. Spins stay. Holds for nothing in nature but a perfectly sticky fixed target.

    Source: Nourian (2004), 2.6 and 3.2 ("setting the velocities of the colliding objects to zero").
    """

    id: ClassVar[str] = "collision:stop"
    container: ClassVar[str] = "collision:exact"
    lever_arms: ClassVar[bool] = False

    resting = Param(
        "error",
        choices=("error", "hold"),
        doc="What happens where a body comes to rest other than on one plane: an error that names it, or it is held in place.",
    )

    def respond(self, contact: Contact) -> Velocities:
        """Two velocities of zero."""
        return Velocities(STILL, STILL)
