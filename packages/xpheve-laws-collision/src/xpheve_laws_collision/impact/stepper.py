"""Impact: spheres that fly in closed form from impact to impact."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from xpheve.bodies import Bodies
from xpheve.kernels.clock import NEVER, Instant
from xpheve.steppers.contract import Flight, Offer, Refusal, Rows, Settings, Signature, Sources, State, Stop
from xpheve.steppers.flights import FlightState, FlightStepper

DUE = "due"
UNKNOWN: Instant = (-np.inf, 0.0)
"""When the next event is due as long as it is not looked for: at once, so that it is."""


class ImpactStepper(FlightStepper):
    """Spheres and points under stored forces, and the impacts between them and with fixed scenery, one after the other.

    Between impacts rows fly as those of `core:ballistic` do, each on its own clock. The impacts are found and answered by the loop of
    `xpheve_laws_collision.impact.fleet`, many in one call; what one instant asks of more than two bodies, of listeners or of laws in plain
    Python is left to the contact server.

    Source: event-driven dynamics with a clock for each particle: B. D. Lubachevsky, J. Comput. Phys. 94 (1991) 255; M. N. Bannerman et al.,
    J. Comput. Chem. 32 (2011) 3329.
    """

    id: ClassVar[str] = "collision:impact"
    promise: ClassVar[str] = "closed form from impact to impact, exact to rounding"
    limit: ClassVar[float] = np.inf
    impacts: ClassVar[bool] = True

    def offer(self, signature: Signature) -> Offer | Refusal:
        if not signature.impacts:
            return Refusal("not spheres among fixed scenery all of whose contacts the impact loop knows")
        return Offer(np.inf, 0.5, True)

    def start(self, rows: Rows, bodies: Bodies, t: Instant, sources: Sources | None) -> State:
        state = FlightState(np.zeros(0, dtype=np.int64))
        state.arrays["streak"] = np.zeros((4, 0))
        state.numbers["since"], state.numbers["since_rest"] = t
        self.join(state, rows, bodies, t)
        return state

    def join(self, state: State, rows: Rows, bodies: Bodies, t: Instant) -> None:
        super().join(state, rows, bodies, t)
        look_again(state)

    def leave(self, state: State, local: int) -> None:
        super().leave(state, local)
        look_again(state)

    def resume(self, state: State, bodies: Bodies, t: Instant, sources: Sources | None) -> None:
        look_again(state)

    def covered(self, state: State) -> Instant:
        assert isinstance(state, FlightState)
        due: Instant = state.made.get(DUE, UNKNOWN)
        return due

    def flight(self, state: State, bodies: Bodies, local: int) -> Flight:
        return super().flight(state, bodies, local)._replace(t1=NEVER)

    def advance(
        self, state: State, bodies: Bodies, need: Instant, wall: Instant, settings: Settings, sources: Any
    ) -> Stop:
        assert isinstance(state, FlightState)
        rows = sources.fleet.fly(state, need)
        state.facts = None
        return Stop(self.covered(state), rows)

    def changed(
        self, state: State, bodies: Bodies, rows: Sequence[int], t: Instant, sources: Sources | None
    ) -> Sequence[int]:
        assert isinstance(state, FlightState)
        places = self.changed_locals(bodies, rows)
        self._take_forces(state, bodies, places)
        load_again(state, places.tolist())
        return rows


def look_again(state: State) -> None:
    """Nothing is known of the next event of ``state``."""
    put_due(state, UNKNOWN)


def put_due(state: State, due: Instant) -> None:
    """The next event of ``state`` is ``due``: not a part of the state, but what follows from it."""
    assert isinstance(state, FlightState)
    state.made[DUE] = due


def load_again(state: State, places: Sequence[int]) -> None:
    """The rows at ``places`` are others than the loop knows, or stand otherwise to their surroundings."""
    assert isinstance(state, FlightState)
    state.made.setdefault("stale", set()).update(places)
    look_again(state)
