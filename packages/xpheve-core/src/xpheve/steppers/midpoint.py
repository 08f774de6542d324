"""Midpoint: second-order steps for any smooth forces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from xpheve.bodies import Bodies
from xpheve.errors import NoStepperError
from xpheve.kernels.clock import Instant, elapsed, later
from xpheve.steppers.contract import Array, Offer, Refusal, Rows, Settings, Signature, Sources, State, Stepper, Stop
from xpheve.steppers.flights import FlightState, FlightStepper

GROWTH = 5.0  # of a step over the last at most, as usual: Hairer, Norsett, Wanner I, II.4
SAFETY = 0.9
SMALLEST = 1e-14  # of the time at hand; a step below it no longer moves the clock reliably


class Midpoint(FlightStepper):
    """Over each step the force found at its middle acts, so that between steps motion is a parabola.

    Drift-kick-drift (Hairer, Lubich, Wanner, Geometric Numerical Integration, I.1.4 and II.5): symplectic for forces of position alone;
    for forces of velocity the kick is by the midpoint rule; stored forces act exactly; torques kick between two halves of free rotation.
    Second order. With ``dt`` a step is a host step; else two half steps are held against one whole, and the step follows the tolerances.
    """

    id: ClassVar[str] = "core:midpoint"
    promise: ClassVar[str] = "second order in the step; symplectic at fixed dt"

    def offer(self, signature: Signature) -> Offer | Refusal:
        return Offer(2.0, 100.0, False)

    def start(self, rows: Rows, bodies: Bodies, t: Instant, sources: Sources | None) -> State:
        state = FlightState(np.zeros(0, dtype=np.int64))
        state.arrays["working"] = np.zeros((3, 0))
        state.numbers = {"base": t[0], "offset": t[1], "next": 0.0, "second": 0.0, "steps": 0.0, "rejected": 0.0}
        self.join(state, rows, bodies, t)
        return state

    def merge(self, state: State, other: State, bodies: Bodies, settings: Settings) -> bool:
        """With ``dt`` two batches make the same steps as one. By tolerances a step is as long as the worst row allows, so they stay two."""
        if settings.dt is None:
            return False
        rows = np.concatenate([state.rows, other.rows])
        order = np.argsort(rows)
        state.rows = rows[order]
        for name, array in state.arrays.items():
            state.arrays[name] = np.concatenate([array, other.arrays[name]], axis=1)[:, order]
        for name in ("steps", "rejected"):
            state.numbers[name] = max(state.numbers[name], other.numbers[name])
        wanted = [one.numbers["next"] for one in (state, other) if one.numbers["next"]]
        state.numbers |= {"next": min(wanted, default=0.0), "second": 0.0}
        bodies.local[state.rows] = np.arange(state.count)
        state.locate()
        return True

    def covered(self, state: State) -> Instant:
        return state.numbers["base"], state.numbers["offset"]

    def advance(
        self, state: State, bodies: Bodies, need: Instant, wall: Instant, settings: Settings, sources: Sources | None
    ) -> Stop:
        assert isinstance(state, FlightState) and sources is not None
        begin = self.covered(state)
        if begin >= need:
            return Stop(begin, ())
        step = _Step(self, state, bodies, sources)
        if settings.dt is not None:
            span, trial = elapsed(wall, begin), step.first(begin, elapsed(wall, begin))
            end = wall
            state.numbers["second"] = 0.0
        elif state.numbers["second"] > 0.0:
            span = state.numbers["second"]
            trial, end = step.first(begin, span), later(begin, span)
            state.numbers["second"] = 0.0
        else:
            span, trial = step.to_tolerance(begin, elapsed(wall, begin), settings)
            end = later(begin, span)
        if not np.isfinite(span):
            raise NoStepperError("core:midpoint found no length for its step: give run(dt=...)")
        self._commit(state, bodies, slice(None), begin, trial)
        state.numbers["base"], state.numbers["offset"] = end
        state.numbers["steps"] += 1.0
        return Stop(end, state.rows.tolist())

    def _commit(
        self, state: FlightState, bodies: Bodies, which: slice | Rows, t: Instant, trial: dict[str, Array]
    ) -> None:
        rows = state.rows[which]
        for name in ("position", "velocity", "orientation", "angular_velocity"):
            bodies.arrays[name][:, rows] = trial[name]
        bodies.clock[0, rows], bodies.clock[1, rows] = t
        state.arrays["acceleration"][:, which] = trial["acceleration"]
        state.arrays["torque"][:, which] = trial["torque"]
        state.arrays["working"][:, which] = trial["working"]
        state.facts = None
        bodies.change += 1

    def changed(
        self, state: State, bodies: Bodies, rows: Sequence[int], t: Instant, sources: Sources | None
    ) -> Sequence[int]:
        """The joined rows start anew at ``t``, towards the end of the batch's step."""
        assert isinstance(state, FlightState) and sources is not None
        together = sources.joined(rows)
        which = self.changed_locals(bodies, together)
        span = elapsed(self.covered(state), t)
        trial = _Step(self, state, bodies, sources).first(t, max(span, 0.0), which)
        self._commit(state, bodies, which, t, trial)
        return together


class _Step:
    """One step of rows of a batch, tried without touching anything."""

    def __init__(self, stepper: Stepper, state: FlightState, bodies: Bodies, sources: Sources) -> None:
        self.stepper, self.state, self.bodies, self.sources = stepper, state, bodies, sources

    def first(self, t: Instant, span: float, which: slice | Rows = slice(None)) -> dict[str, Array]:
        """From the state at ``t``: the flights that serve until ``span`` later."""
        state, bodies = self.state, self.bodies
        begin = {}
        for name in ("position", "velocity", "orientation", "angular_velocity"):
            whole = np.empty((4 if name == "orientation" else 3, state.count))
            self.stepper.read(state, bodies, t, name, whole)
            begin[name] = whole[:, which]
        return self.flights(t, span, state.rows[which], begin)

    def flights(self, t: Instant, span: float, rows: Rows, begin: dict[str, Array]) -> dict[str, Array]:
        """Acceleration and torque found half way, beside the state at the beginning."""
        mass = self.bodies.arrays["mass"][0, rows]
        stored = self.bodies.arrays["force"][:, rows] / mass
        torque = self.bodies.arrays["torque"][:, rows]
        half = 0.5 * span
        middle = self._middle(begin, rows, torque, half)
        force, twist, reads_velocity = self.sources.evaluate(rows, later(t, half), middle)
        if reads_velocity:
            middle["velocity"] = begin["velocity"] + half * (stored + force / mass)
            if twist.any():
                middle["orientation"], middle["angular_velocity"] = self._turn(begin, rows, torque + twist, half)
            force, twist, _ = self.sources.evaluate(rows, later(t, half), middle)
        working = self.sources.working
        return begin | {"acceleration": stored + force / mass, "torque": torque + twist, "working": working}

    def _middle(self, begin: dict[str, Array], rows: Rows, torque: Array, half: float) -> dict[str, Array]:
        # Of stored forces too only what the middle needs: so a body at rest or at its terminal speed stays there exactly.
        middle = {"position": begin["position"] + half * begin["velocity"], "velocity": begin["velocity"]}
        middle["orientation"], middle["angular_velocity"] = self._turn(begin, rows, torque, half)
        return middle

    def _turn(self, begin: dict[str, Array], rows: Rows, torque: Array, span: float) -> tuple[Array, Array]:
        from xpheve.kernels.flight import turn_split

        q, omega = begin["orientation"].copy(), begin["angular_velocity"].copy()
        for k in np.flatnonzero(omega.any(axis=0) | torque.any(axis=0)).tolist():
            inertia = self.bodies.get("inertia", int(rows[k]))
            q[:, k], omega[:, k] = turn_split(
                tuple(q[:, k].tolist()),
                tuple(omega[:, k].tolist()),
                inertia,  # type: ignore[arg-type]
                tuple(torque[:, k].tolist()),
                span,
            )
        return q, omega

    def end(self, trial: dict[str, Array], rows: Rows, span: float) -> dict[str, Array]:
        """The state ``span`` after the beginning of the flights in ``trial``."""
        half, a = 0.5 * span, trial["acceleration"]
        q, omega = self._turn(trial, rows, trial["torque"], span)
        return {
            "position": trial["position"] + span * (trial["velocity"] + half * a),
            "velocity": trial["velocity"] + span * a,
            "orientation": q,
            "angular_velocity": omega,
        }

    def to_tolerance(self, t: Instant, longest: float, settings: Settings) -> tuple[float, dict[str, Array]]:
        """The first of two half steps that agree with a whole one (step doubling; Hairer, Norsett, Wanner I, II.4)."""
        numbers, rows = self.state.numbers, self.state.rows
        wanted = numbers["next"] or self._guess(t)
        while True:
            span = min(wanted, longest)
            whole = self.first(t, span)
            first = self.first(t, 0.5 * span)
            halfway = self.end(first, rows, 0.5 * span)
            second = self.flights(later(t, 0.5 * span), 0.5 * span, rows, halfway)
            error = self._error(self.end(whole, rows, span), self.end(second, rows, 0.5 * span), first, settings)
            factor = GROWTH if error == 0 else min(GROWTH, max(0.1, SAFETY * error ** (-1.0 / 3.0)))
            if error <= 1.0:
                # A step that a wall cut short says too little of the step after it to make that shorter, too.
                numbers["next"], numbers["second"] = max(span * factor, wanted if span < wanted else 0.0), 0.5 * span
                return 0.5 * span, first
            numbers["rejected"] += 1.0
            wanted = span = span * factor
            if not span > SMALLEST * max(1.0, abs(t[0])):
                raise NoStepperError(
                    f"core:midpoint cannot keep rtol={settings.rtol}, atol={settings.atol} at t = {t[0]} s: its step fell to {span} s. "
                    "Loosen the tolerances, or give run(dt=...)"
                )

    def _guess(self, t: Instant) -> float:
        """A first step: a hundredth of the time in which velocity or position changes by its own size."""
        trial = self.first(t, 0.0)
        x, v, a = (float(np.abs(trial[name]).max(initial=0.0)) for name in ("position", "velocity", "acceleration"))
        times = [x / v if v and x else 0.0, v / a if v and a else 0.0]
        return 0.01 * min([time for time in times if time > 0.0], default=0.1)

    def _error(
        self, coarse: dict[str, Array], fine: dict[str, Array], begin: dict[str, Array], settings: Settings
    ) -> float:
        """Largest estimated error over its tolerance; the fine solution's is a third of the difference."""
        worst = 0.0
        for name in ("position", "velocity", "orientation", "angular_velocity"):
            scale = settings.atol + settings.rtol * np.maximum(np.abs(begin[name]), np.abs(fine[name])).max(
                axis=0, initial=0.0
            )
            gap = np.abs(coarse[name] - fine[name]) / 3.0 / scale
            worst = max(worst, float(gap.max(initial=0.0)))
        return worst if np.isfinite(worst) else np.inf
