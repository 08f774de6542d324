"""Thrust of an engine that is fixed to the body."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from xpheve.laws import FieldLaw, Param

if TYPE_CHECKING:
    from xpheve.laws.view import BodyView


class Thrust(FieldLaw):
    """Thrust fixed in the body frame: F = R f for start <= t < start + duration, where R turns body to world.

    Holds for an engine whose line of thrust goes through the centre of mass, so that it turns nothing, and whose propellant is light
    beside the body: the mass stays. The clock of each object begins when it comes under the law (``engine.map``, or the
    start of a scene in which it is mapped), or when the law is enabled: it burns from ``delay`` to ``delay + duration`` after
    that. To burn again, disable and enable the law, or unmap the object and map it again. A
    checkpoint goes on in the midst of a burn; a scene file begins at time 0, and the burn with it.

    Both instants are exact, also inside a step: steps end there (``jumps``). The impulse on a body that does not turn is f times
    duration, to rounding, whatever the step.

    Benefits and drawbacks: ``add_force(f, duration)`` is a force fixed in the *world* frame; it is in closed form and costs
    nothing along the way. This law turns with the body. After its end it still costs an evaluation a step; disable it, or unmap the object.

    Units: f [N], times [s]. There is no potential; the work is reported.

    Cost: one evaluation a step, some thirty operations a body; one more step at each beginning and end. O(n) for n bodies.
    Accuracy: exact for a body that does not turn; else as exact as the stepper, order 2 in dt with the midpoint.

    Source: I. Newton, Principia (1687), law II; G. P. Sutton, O. Biblarz, Rocket Propulsion Elements (9th ed. 2016), section 2.2.
    """

    id = "basic:thrust"
    role = "thrust"

    thrust = Param((0.0, 0.0, 0.0), unit="N", doc="f; body frame.")
    duration = Param(None, unit="s", ge=0, doc="How long it burns; none: for ever.")
    delay = Param(
        0.0, unit="s", ge=0, doc="From when the object came under the law, or the law was enabled, to ignition."
    )

    def force(self, body: BodyView) -> Any:
        """Thrust on each body [N]."""
        start = body.since + self.delay
        burns = body.time >= start
        if self.duration is not None:
            burns = burns & (body.time < start + self.duration)
        return np.where(burns, body.to_world(self.thrust), 0.0)

    def jumps(self, since: float) -> tuple[float, ...]:
        """Ignition and end [s]."""
        start = since + self.delay
        end = math.inf if self.duration is None else start + self.duration
        return tuple(time for time in (start, end) if since < time < math.inf)
