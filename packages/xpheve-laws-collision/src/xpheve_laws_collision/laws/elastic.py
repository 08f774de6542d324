"""Elastic collision with restitution."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import ClassVar

from xpheve.laws import Column, Contact, Param, ResponseLaw


def _multiplied(a: float, b: float) -> float:
    return a * b


def _averaged(a: float, b: float) -> float:
    return a if a == b else 0.5 * (a + b)


def _geometric(a: float, b: float) -> float:
    return a if a == b else math.sqrt(a * b)


RULES: dict[str, Callable[[float, float], float]] = {
    "average": _averaged,
    "minimum": min,
    "maximum": max,
    "multiply": _multiplied,
    "geometric": _geometric,
}


class Elastic(ResponseLaw):
    """Frictionless impact with Newton's coefficient of restitution: v_n' = -e v_n.

    Both objects must be mapped. The law's ``restitution`` holds for objects that have none of their own; two values are
    combined by ``combine``, whether both move or one is fixed. v_n is that of the surfaces at the contact point. The impulse is along
    the normal: spheres keep their velocity across it and their spin; extended bodies hit off their centre change both, by their
    inertia. Momentum and angular momentum are kept, and at e = 1 energy too, to rounding. Any number of impacts at one instant are
    solved together, in generations.

    Cost: one prediction for each partner in reach, at each impact; in closed form for spheres on spheres, planes, boxes and capsules, by
    conservative advancement for what turns. About a millisecond an impact; some microseconds in the impact loop (`collision:impact`).

    Benefits and drawbacks: bodies answer with their inertia and are set spinning where they are hit off their centre. Beside
    `collision:point` this needs the place of the contact, not its normal alone. Holds for smooth, rigid bodies: there is no friction.

    Source: Newton, Principia (1687), scholium to the laws; Nourian (2004), 4.3.2; simultaneous impacts: Moreau,
    Unilateral contact and dry friction (1988).
    """

    id: ClassVar[str] = "collision:elastic"
    container: ClassVar[str] = "collision:exact"
    columns: ClassVar[dict[str, Column]] = {
        "restitution": Column(math.nan, unit="1", ge=0, le=1, doc="The object's own coefficient of restitution.")
    }

    restitution = Param(1.0, unit="1", ge=0, le=1, doc="Of objects that have none of their own.")
    combine = Param("average", choices=tuple(RULES), doc="How the values of two objects make one.")
    resting = Param(
        "error",
        choices=("error", "hold"),
        doc="What happens where a body comes to rest other than on one plane: an error that names it, or it is held in place.",
    )

    def coefficient(self, contact: Contact) -> float:
        """Restitution of one contact."""
        own = [obj["restitution"] for obj in (contact.body_a, contact.body_b)]
        a, b = (self.restitution if math.isnan(value) else value for value in own)
        if all(map(math.isnan, own)):
            return float(self.restitution)
        return float(RULES[self.combine](a, b))

    def respond(self, contact: Contact) -> float:
        """Separation speed [m/s] along the normal."""
        return self.coefficient(contact) * contact.approach_speed
