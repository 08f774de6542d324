"""Splitting: exact flows around all that is no flow, at host steps."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from xpheve.bodies import Bodies
from xpheve.errors import NoStepperError
from xpheve.kernels.clock import Instant, elapsed, later
from xpheve.steppers.contract import Array, Grid, Offer, Refusal, Rows, Settings, Signature, Sources, State, Stop
from xpheve.steppers.flights import FlightState
from xpheve.steppers.midpoint import MidpointStep
from xpheve.steppers.nodes import Newton, Node, cubic
from xpheve.steppers.stepped import Stepped, rate_of
from xpheve.steppers.sums import two_sums

NAMES = ("position", "velocity", "orientation", "angular_velocity")


class Splitting(Stepped):
    """Half a step of each flow in order of rank, a step of the rest by the midpoint rule, half a step of each flow in the opposite order.

    G. Strang, SIAM J. Numer. Anal. 5 (1968) 506; Hairer, Lubich, Wanner, Geometric Numerical Integration, II.5. Second order, whatever
    the flows are; what all of them and the rest keep is kept, and velocities are exact where one flow acts alone. However stiff a flow is, steps are
    stable; but where it is far faster than they are, what forces do against it is right to the first order only. Between two steps rows are read
    off Hermite's cubic.
    """

    id: ClassVar[str] = "core:splitting"
    promise: ClassVar[str] = "exact flows around a second-order step of the rest"
    books_work: ClassVar[bool] = True
    extra: ClassVar[dict[str, int]] = {"work": 1, "work_rest": 1, "gain": 1}
    """Work [J] of what has no potential, what its sum has left over, and its part of the present step."""

    def offer(self, signature: Signature) -> Offer | Refusal:
        if not signature.flows:
            return Refusal("no law is an exact flow")
        if not signature.fixed_step:
            return Refusal("exact flows are split off at host steps: run(dt=...)")
        if signature.contacts:
            return Refusal("contacts are looked for that are known along parabolas only")
        return Offer(2.0, 200.0, False)

    def stride(
        self, state: State, bodies: Bodies, grid: Grid, steps: int, settings: Settings, sources: Sources | None
    ) -> Stop:
        """One step after the other."""
        assert isinstance(state, FlightState) and sources is not None
        if not np.isfinite(grid.dt):
            raise NoStepperError(f"{self.id} found no length for its step: give run(dt=...)")
        for k in range(steps):
            self._step(state, bodies, grid.point(k), grid.point(k + 1), sources)
        return Stop(self.covered(state), state.rows)

    def _step(self, state: FlightState, bodies: Bodies, t: Instant, end: Instant, sources: Sources) -> None:
        rows, span = state.rows, elapsed(end, t)
        stepped = sources.stepped(rows)
        if state.numbers["turning"] == 0.0 and stepped.any():
            self._take_up_rotation(state, bodies)
        begin = self._at_end(state, bodies, t)
        if state.numbers["turning"] == 1.0:
            stepped = np.maximum(stepped, 1.0 * begin["angular_velocity"].any(axis=0))
        found = begin.copy()
        turned, work = sources.flow(rows, t, found, 0.5 * span)
        if state.numbers["turning"] == 0.0 and "angular_velocity" in turned:
            self._take_up_rotation(state, bodies)
            self._step(state, bodies, t, end, sources)
            return
        if state.numbers["turning"] == 1.0:
            stepped = np.maximum(stepped, 1.0 * found["angular_velocity"].any(axis=0))
        step = MidpointStep(self, state, bodies, sources)
        trial = step.flights(t, span, rows, found | {"stepped": stepped})
        ended = step.end(trial, rows, span)
        found = {name: ended[name] for name in NAMES}
        way = found["position"] - begin["position"]
        work = work + (trial["working"] * way).sum(axis=0)
        work = work + sources.flow(rows, later(t, 0.5 * span), found, 0.5 * span, backwards=True)[1]
        self._keep(state, bodies, begin, found, trial["acceleration"], span)
        self._book(state, state.arrays["gain"][0] + self._stored_work(state, bodies, state.arrays["begin"][:3]))
        state.arrays["gain"] = work[None]
        state.numbers["base"], state.numbers["offset"] = end
        state.numbers["steps"] += 1.0
        self._put_beginning(state, bodies, t)

    def _at_end(self, state: FlightState, bodies: Bodies, t: Instant) -> dict[str, Array]:
        """The state of all rows at ``t``, which is where the batch is covered."""
        end = state.arrays["end"]
        found = {"position": end[:3], "velocity": end[3:6]}
        for name in ("orientation", "angular_velocity"):
            found[name] = np.empty((4 if name == "orientation" else 3, state.count))
            self.read(state, bodies, t, name, found[name])
        return found

    def _keep(
        self,
        state: FlightState,
        bodies: Bodies,
        begin: dict[str, Array],
        end: dict[str, Array],
        acceleration: Array,
        span: float,
    ) -> None:
        """A step from ``begin`` to ``end`` was made."""
        none = np.zeros((4, state.count))
        for name, values in (("begin", begin), ("end", end)):
            state.arrays[name] = np.concatenate([values["position"], values["velocity"], acceleration])
            rate = rate_of(values["orientation"], values["angular_velocity"])
            state.arrays[f"{name}_turn"] = np.concatenate([values["orientation"], rate, none])
        state.arrays["span"] = np.full((1, state.count), span)

    def path(self, begin: Node, end: Node, earlier: Node, span: Array, ago: Array) -> Newton:
        return cubic(begin, end, span)

    # Work

    def _stored_work(self, state: FlightState, bodies: Bodies, position: Array) -> Array:
        """Work [J] of stored forces without potential since the bodies' clocks, to ``position``."""
        way = position - bodies.arrays["position"][:, state.rows]
        found: Array = (bodies.arrays["working"][:, state.rows] * way).sum(axis=0)
        return found

    def _book(self, state: FlightState, joules: Array) -> None:
        """Add ``joules`` to what is kept."""
        work, rest = two_sums(state.arrays["work"][0], joules + state.arrays["work_rest"][0])
        state.arrays["work"], state.arrays["work_rest"] = work[None], rest[None]

    def running_work(self, state: State, bodies: Bodies, t: Instant, places: slice | Rows) -> Array:
        found: Array = (self._past(state, t) * state.arrays["gain"])[0, places]
        return found

    def _past(self, state: State, t: Instant) -> Array:
        """How much of the present step is over at ``t``, (1, rows)."""
        span = state.arrays["span"]
        known = span > 0.0
        return np.where(known, 1.0 + elapsed(t, self.covered(state)) / np.where(known, span, 1.0), 0.0)

    def cut(self, state: FlightState, bodies: Bodies, places: Rows, t: Instant) -> None:
        """Of the work of the present step what is done at ``t`` is booked; that on written rows by stored forces was."""
        joules = np.zeros(state.count)
        joules[places] = (self._past(state, t) * state.arrays["gain"])[0, places]
        behind = places[~self._written(state, bodies, places)]
        joules[behind] += self._stored_work(state, bodies, self.curve(state, bodies, t, slice(None))[0])[behind]
        self._book(state, joules)
        state.arrays["gain"][0, places] = 0.0
