"""Linear: forces affine in places and velocities, with constant coefficients, by their exact flow."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from xpheve.bodies import Bodies
from xpheve.errors import LawFailedError, StateError
from xpheve.kernels.clock import NEVER, Instant
from xpheve.steppers.contract import (
    Array,
    Grid,
    Offer,
    Refusal,
    Rows,
    Settings,
    Signature,
    Sources,
    State,
    Stop,
)
from xpheve.steppers.flights import FlightState
from xpheve.steppers.linear_curves import Curves
from xpheve.steppers.smooth import Smooth
from xpheve.steppers.sums import exact_spans, two_sums

COST = 10.0
"""Of a unit of time, beside 1 of a parabola."""


class LinearState(FlightState):
    """A `State` with the curves of its rows, which are made again from the rest."""

    def __init__(self) -> None:
        super().__init__(np.zeros(0, dtype=np.int64))
        self.curves = Curves()


class Linear(Smooth):
    """M x'' = K x + D x' + c with constant matrices: springs without rest length, linear drag, uniform fields, turning frames, nets of them.

    Exact to rounding at any time, however far and stiff: from the start of its flight each read is one evaluation
    (`xpheve.steppers.linear_flow`). Nothing is computed between events, nor between reads. Rotation is free, in closed form.

    Work of forces without potential is what kinetic energy gains and potential energy does not lose: exact up to a few units of the last place of the
    energies that are exchanged, as the flow is.
    """

    id: ClassVar[str] = "core:linear"
    promise: ClassVar[str] = "exact flow of linear forces: any span and stiffness in one step"
    books_work: ClassVar[bool] = True

    def offer(self, signature: Signature) -> Offer | Refusal:
        refused = self.refusal(signature)
        if refused:
            return Refusal(refused)
        if signature.torque == "general":
            return Refusal("a torque that is not about a principal axis of the spin")
        if signature.form != "linear":
            return Refusal(
                "forces not proven linear in places and velocities with constant coefficients, or of too many objects together"
            )
        return Offer(np.inf, COST, True)

    def start(self, rows: Rows, bodies: Bodies, t: Instant, sources: Sources | None) -> State:
        state = LinearState()
        state.arrays |= {name: np.zeros((width, 0)) for name, width in WIDTHS.items()}
        state.numbers = {"turning": 0.0, "base": t[0], "offset": t[1], "begun": 1.0}
        self.join(state, rows, bodies, t)
        return state

    def join(self, state: State, rows: Rows, bodies: Bodies, t: Instant) -> None:
        assert isinstance(state, LinearState)
        super().join(state, rows, bodies, t)
        state.curves.add(len(rows))
        if len(rows):
            self.begin(state, bodies, slice(state.count - len(rows), state.count))
            state.numbers |= {"base": t[0], "offset": t[1], "begun": 0.0}

    def leave(self, state: State, local: int) -> None:
        assert isinstance(state, LinearState)
        state.curves.take(local, state.count - 1)
        super().leave(state, local)

    def resume(self, state: State, bodies: Bodies, t: Instant, sources: Sources | None) -> None:
        """The curves again, of a state whose arrays were restored."""
        assert isinstance(state, LinearState)
        begun = np.flatnonzero(state.arrays["begun"][0])
        if len(begun):
            self._begin(state, bodies, begun, sources)

    def covered(self, state: State) -> Instant:
        if state.numbers["begun"] or not state.count:
            return NEVER
        return state.numbers["base"], state.numbers["offset"]

    def advance(
        self, state: State, bodies: Bodies, need: Instant, wall: Instant, settings: Settings, sources: Sources | None
    ) -> Stop:
        """Rows that came begin their curves; no other step is ever made."""
        assert isinstance(state, LinearState)
        if state.numbers["begun"]:
            return Stop(NEVER, ())
        new = np.flatnonzero(state.arrays["begun"][0] == 0.0)
        self._begin(state, bodies, new, sources)
        state.numbers["begun"] = 1.0
        return Stop(NEVER, state.rows[new])

    def stride(
        self, state: State, bodies: Bodies, grid: Grid, steps: int, settings: Settings, sources: Sources | None
    ) -> Stop:
        return self.advance(state, bodies, NEVER, NEVER, settings, sources)

    def _begin(self, state: LinearState, bodies: Bodies, places: Rows, sources: Sources | None) -> None:
        """New curves of the rows at ``places``, complete groups, from what the bodies hold."""
        assert sources is not None
        rows = state.rows[places]
        arrays = bodies.arrays
        every = len(places) == state.count
        with np.errstate(all="ignore"):
            acceleration = state.curves.begin(
                sources.linear(rows),
                places,
                arrays["position"][:, rows],
                arrays["velocity"][:, rows],
                arrays["force"][:, rows],
                every,
            )
        if not np.isfinite(acceleration).all():
            obj = bodies.objects[int(rows[int((~np.isfinite(acceleration)).any(axis=0).argmax())])]
            raise LawFailedError(
                f"{obj!r}: its acceleration is beyond the range of a float, at {obj.position} m and {obj.velocity} m/s; the engine stands just before"
            )
        state.arrays["acceleration"][:, places] = acceleration
        state.arrays["torque"][:, places] = arrays["torque"][:, rows]
        state.arrays["begun"][:, places] = 1.0
        self.begin(state, bodies, places)

    # Reading

    def curve(self, state: FlightState, bodies: Bodies, t: Instant, places: slice | Rows) -> tuple[Array, Array]:
        assert isinstance(state, LinearState)
        which = np.arange(state.count)[places]
        rows = state.rows[which]
        spans = self._spans(state, t, which)
        position, velocity = bodies.arrays["position"][:, rows], bodies.arrays["velocity"][:, rows]
        moved = ((spans[0] != 0.0) | (spans[1] != 0.0)) & (state.arrays["begun"][0, which] == 1.0)
        if not moved.any():
            return position, velocity
        if moved.all():
            way, speed = state.curves.after(which, spans)
            position, velocity = position + way, speed
        else:
            way, speed = state.curves.after(which[moved], (spans[0][moved], spans[1][moved]))
            position[:, moved] += way
            velocity[:, moved] = speed
        if not (np.isfinite(position).all() and np.isfinite(velocity).all()):
            raise self._beyond(bodies, rows, t, position, velocity)
        return position, velocity

    @staticmethod
    def _beyond(bodies: Bodies, rows: Rows, t: Instant, position: Array, velocity: Array) -> StateError:
        """What to raise of a row that is beyond the range of a float."""
        bad = ~(np.isfinite(position) & np.isfinite(velocity)).all(axis=0)
        obj = bodies.objects[int(rows[int(bad.argmax())])]
        return StateError(
            f"{obj!r} is beyond the range of a float at t = {t[0]} s: its forces drive it away without bound, as a negative stiffness does; "
            "end the run before, or check the signs of its laws"
        )

    @staticmethod
    def _spans(state: LinearState, t: Instant, which: Rows) -> tuple[Array, Array]:
        """Time [s] since the start of each curve, as pairs of floats."""
        base, offset = state.arrays["since"][:, which]
        return exact_spans(t, base, offset)

    # Writing

    def changed(
        self, state: State, bodies: Bodies, rows: Sequence[int], t: Instant, sources: Sources | None
    ) -> Sequence[int]:
        assert isinstance(state, LinearState)
        together = self.together(bodies, rows, sources)
        places = self.changed_locals(bodies, together)
        self._start_anew(state, bodies, places, t, sources)
        return together

    def restart(self, state: State, bodies: Bodies, t: Instant, sources: Sources | None) -> Sequence[int]:
        assert isinstance(state, LinearState)
        self._start_anew(state, bodies, np.arange(state.count), t, sources)
        return state.rows.tolist()  # type: ignore[no-any-return]

    def _start_anew(
        self, state: LinearState, bodies: Bodies, places: Rows, t: Instant, sources: Sources | None
    ) -> None:
        joules = self.running_work(state, bodies, t, places) + state.arrays["work_rest"][0, places]
        work, rest = two_sums(state.arrays["work"][0, places], joules)
        state.arrays["work"][0, places], state.arrays["work_rest"][0, places] = work, rest
        self.rebase(state, bodies, places, t)
        self._begin(state, bodies, places, sources)

    def running_work(self, state: State, bodies: Bodies, t: Instant, places: slice | Rows) -> Array:
        assert isinstance(state, LinearState)
        which = np.arange(state.count)[places]
        found = np.zeros(len(which))
        begun = state.arrays["begun"][0, which] == 1.0
        if state.curves.works and begun.any():
            mass = bodies.arrays["mass"][0, state.rows[which]]
            spans = self._spans(state, t, which)
            found[begun] = state.curves.work(which[begun], (spans[0][begun], spans[1][begun]), mass[begun])
        return found


WIDTHS = {"since": 2, "begun": 1, "work": 1, "work_rest": 1}
"""What a row keeps besides its flight: since when its curve holds, whether it has one, and the work [J] of forces without potential before."""
