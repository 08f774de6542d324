"""Ballistic: forces constant in the world frame, in closed form."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from xpheve.bodies import Bodies
from xpheve.kernels.clock import NEVER, Instant
from xpheve.steppers.contract import Offer, Refusal, Rows, Settings, Signature, Sources, State, Stop
from xpheve.steppers.flights import FlightState, FlightStepper


class Ballistic(FlightStepper):
    """Stored forces only; rotation free of torque, or under a torque about the principal axis of the spin.

    Exact to rounding at any time, however far: free rotation of an asymmetric body by Jacobi's functions
    (`xpheve.kernels.free_rotation`). Nothing is computed between events, nor between reads.
    """

    id: ClassVar[str] = "core:ballistic"
    promise: ClassVar[str] = "closed form, exact to rounding"
    limit: ClassVar[float] = np.inf

    def offer(self, signature: Signature) -> Offer | Refusal:
        if signature.laws:
            return Refusal(f"evaluated along the way: {', '.join(signature.laws)}")
        if signature.torque == "general":
            return Refusal("a torque that is not about a principal axis of the spin")
        return Offer(np.inf, 1.0, True)

    def start(self, rows: Rows, bodies: Bodies, t: Instant, sources: Sources | None) -> State:
        state = FlightState(np.zeros(0, dtype=np.int64))
        self.join(state, rows, bodies, t)
        return state

    def advance(
        self, state: State, bodies: Bodies, need: Instant, wall: Instant, settings: Settings, sources: Sources | None
    ) -> Stop:
        return Stop(NEVER, ())

    def changed(
        self, state: State, bodies: Bodies, rows: Sequence[int], t: Instant, sources: Sources | None
    ) -> Sequence[int]:
        assert isinstance(state, FlightState)
        self._take_forces(state, bodies, self.changed_locals(bodies, rows))
        return rows
