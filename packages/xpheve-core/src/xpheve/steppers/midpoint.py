"""Midpoint: second-order steps for any smooth forces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from xpheve.bodies import Bodies
from xpheve.errors import LawFailedError, NoStepperError
from xpheve.kernels import spin
from xpheve.kernels.clock import Instant, elapsed, later
from xpheve.kernels.vector import scale
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
    Stepper,
    Stop,
)
from xpheve.steppers.flights import FlightState, FlightStepper, Quat, Vec
from xpheve.steppers.sums import spans_since, two_sums

GROWTH = 5.0  # of a step over the last at most, as usual: Hairer, Norsett, Wanner I, II.4
SAFETY = 0.9
SMALLEST = 1e-14  # of the time at hand; a step below it no longer moves the clock reliably

KEPT = {"position_rest": 3, "velocity_rest": 3, "working": 3, "work": 1, "work_rest": 1, "stepped": 1}
"""What a row keeps besides its flight: remainders of compensated sums, the present force without potential, the work of those before, and how
it turns, as `Sources.stepped` says."""


class Midpoint(FlightStepper):
    """Over each step the force found at its middle acts, so that between steps motion is a parabola.

    Drift-kick-drift (Hairer, Lubich, Wanner, Geometric Numerical Integration, I.1.4 and II.5): symplectic for forces of position alone;
    for forces of velocity the kick is by the midpoint rule; stored forces act exactly; torques kick between two halves of free rotation
    (`xpheve.kernels.spin`). Rotation that no torque changes and no law needs along the way stays in closed form. Second order.
    With ``dt`` a step is a host step; else two half steps are held against one whole, and the step follows the tolerances.
    Places, velocities and work are compensated sums (`xpheve.loop.fields`).
    """

    id: ClassVar[str] = "core:midpoint"
    promise: ClassVar[str] = "second order in the step; symplectic at fixed dt"
    books_work: ClassVar[bool] = True
    loops: ClassVar[bool] = False

    def offer(self, signature: Signature) -> Offer | Refusal:
        if signature.flows:
            return Refusal(f"an exact flow is to be split off: {', '.join(signature.flows)}")
        return Offer(2.0, 100.0, False)

    def start(self, rows: Rows, bodies: Bodies, t: Instant, sources: Sources | None) -> State:
        state = FlightState(np.zeros(0, dtype=np.int64))
        state.arrays |= {name: np.zeros((width, 0)) for name, width in KEPT.items()}
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

    # Fixed steps

    def advance(
        self, state: State, bodies: Bodies, need: Instant, wall: Instant, settings: Settings, sources: Sources | None
    ) -> Stop:
        assert isinstance(state, FlightState) and sources is not None
        begin = self.covered(state)
        if begin >= need:
            return Stop(begin, ())
        if settings.dt is not None:
            grid = Grid(begin, elapsed(wall, begin), 0)
            return self._stride(state, bodies, grid, 1, wall, sources)
        return self._to_tolerance(state, bodies, wall, settings, sources)

    def stride(
        self, state: State, bodies: Bodies, grid: Grid, steps: int, settings: Settings, sources: Sources | None
    ) -> Stop:
        assert isinstance(state, FlightState) and sources is not None
        if self._alone(state, bodies, sources):
            return super().stride(state, bodies, grid, steps, settings, sources)
        return self._stride(state, bodies, grid, steps, grid.point(steps), sources)

    def _stride(
        self, state: FlightState, bodies: Bodies, grid: Grid, steps: int, end: Instant, sources: Sources
    ) -> Stop:
        """``steps`` steps of ``grid``; the last ends at ``end``, and is the flight that is under way then."""
        if not np.isfinite(grid.dt):
            raise NoStepperError("core:midpoint found no length for its step: give run(dt=...)")
        state.numbers["second"] = 0.0
        found = self._ended(state, bodies, self.covered(state), sources)
        if self._alone(state, bodies, sources):
            trial = MidpointStep(self, state, bodies, sources).flights(grid.origin, grid.dt, state.rows, found)
        else:
            trial = self._run(state, bodies, grid, steps, found, sources)
        self._commit(state, bodies, slice(None), grid.point(steps - 1), trial)
        self._cover(state, end, steps)
        return Stop(end, state.rows)

    def _alone(self, state: FlightState, bodies: Bodies, sources: Sources) -> bool:
        """Whether the laws must be evaluated one by one: they have no loop, or they join objects that turn, and read how."""
        if sources.program is None:
            return True
        if not sources.turning_pairs:
            return False
        rows, arrays = state.rows, bodies.arrays
        turns = arrays["angular_velocity"][:, rows].any() or arrays["torque"][:, rows].any()
        return bool(turns or sources.twists[rows].any())

    def _run(
        self, state: FlightState, bodies: Bodies, grid: Grid, steps: int, found: dict[str, Array], sources: Sources
    ) -> dict[str, Array]:
        """What the loop makes of ``found`` in ``steps`` steps; if a force was not finite, the error that says whose."""
        numbers = sources.pack(state, found)
        sources.run(numbers, grid, steps)
        if sources.program.strays(numbers, grid.dt).any():
            self._fail(state, bodies, grid, steps, found, sources)
        return found | {"torque": np.zeros((3, state.count))} | sources.unpack(numbers)

    def _fail(
        self,
        state: FlightState,
        bodies: Bodies,
        grid: Grid,
        steps: int,
        found: dict[str, Array],
        sources: Sources,
    ) -> None:
        """Go to the last step that is finite, and raise what makes the next one fail."""
        strays = sources.program.strays
        good, bad = 0, steps
        kept = best = sources.pack(state, found)
        while bad - good > 1:
            middle = (good + bad) // 2
            numbers = kept.copy()
            sources.run(numbers, grid, middle)
            if strays(numbers, grid.dt).any():
                bad = middle
            else:
                good, best = middle, numbers
        if good:
            trial = found | {"torque": np.zeros((3, state.count))} | sources.unpack(best)
            self._commit(state, bodies, slice(None), grid.point(good - 1), trial)
            self._cover(state, grid.point(good), good)
        begin = grid.point(good)
        trial = self._ended(state, bodies, self.covered(state), sources)
        MidpointStep(self, state, bodies, sources).flights(begin, grid.dt, state.rows, trial)
        numbers = kept.copy()
        sources.run(numbers, grid, bad)
        row = int(np.flatnonzero(strays(numbers, grid.dt))[0])
        raise LawFailedError(
            f"motion, or its work, leaves the range of floats in the step from t = {begin[0]} s on: {sources.label(row)}; "
            "the engine stands just before"
        )

    def _cover(self, state: FlightState, end: Instant, steps: int) -> None:
        state.numbers["base"], state.numbers["offset"] = end
        state.numbers["steps"] += float(steps)

    def _ended(
        self, state: FlightState, bodies: Bodies, t: Instant, sources: Sources, which: slice | Rows = slice(None)
    ) -> dict[str, Array]:
        """State, remainders and work of rows at ``t``, to which their present flights have led; nothing is written.

        Of rows whose rotation stays in closed form, it is left as it was at its base.
        """
        rows = _where(state, which)
        held = {name: array[:, which] for name, array in state.arrays.items()}
        x, v, a = bodies.arrays["position"][:, rows], bodies.arrays["velocity"][:, rows], held["acceleration"]
        s = _span_since(t, bodies.clock[0, rows], bodies.clock[1, rows])
        way = s * (v + (0.5 * s) * a)
        found: dict[str, Array] = {}
        found["position"], found["position_rest"] = two_sums(x, way + held["position_rest"])
        found["velocity"], found["velocity_rest"] = two_sums(v, s * a + held["velocity_rest"])
        force = held["working"] + bodies.arrays["working"][:, rows]
        found["work"], found["work_rest"] = held["work"], held["work_rest"]
        if force.any():
            self._add_work(found, force, way)
        for name in ("orientation", "angular_velocity"):
            found[name] = bodies.arrays[name][:, rows]
        before = held["stepped"]
        found["stepped"] = np.maximum(sources.stepped(state.rows[which]), np.minimum(before, 1.0))
        if not found["stepped"].any():
            return found
        for name in ("orientation", "angular_velocity"):
            found[name] = found[name].copy()
        stepped = np.flatnonzero(before[0])
        for name, values in zip(
            ("orientation", "angular_velocity"), self._flown(state, bodies, t, stepped, which), strict=True
        ):
            found[name][:, stepped] = values
        places = np.arange(state.count)[which]
        for k in np.flatnonzero((found["stepped"][0] > 0.0) & (before[0] == 0.0)).tolist():
            for name in ("orientation", "angular_velocity"):
                found[name][:, k] = self.read_row(state, bodies, t, name, int(places[k]))
        return found

    @staticmethod
    def _add_work(found: dict[str, Array], force: Array, way: Array) -> None:
        """Add the work of ``force`` along ``way`` to what is kept."""
        joules = force[0] * way[0] + force[1] * way[1] + force[2] * way[2] + found["work_rest"][0]
        work, rest = two_sums(found["work"][0], joules)
        found["work"], found["work_rest"] = work[None], rest[None]

    def _flown(
        self,
        state: FlightState,
        bodies: Bodies,
        t: Instant,
        places: Rows | Sequence[int],
        which: slice | Rows = slice(None),
    ) -> tuple[Array, Array]:
        """Orientations and angular velocities at ``t`` of the rows at ``places`` (of ``which``), whose rotation is stepped."""
        from xpheve.loop.array_spin import flown

        rows, torque = state.rows[which][places], state.arrays["torque"][:, which][:, places]
        q, omega, inertia = (bodies.arrays[name][:, rows] for name in ("orientation", "angular_velocity", "inertia"))
        return flown(q, omega, inertia, torque, spans_since(t, bodies.turn_clock[0, rows], bodies.turn_clock[1, rows]))

    def _turned(self, state: FlightState, bodies: Bodies, row: int, local: int, s: float) -> tuple[Quat, Vec]:
        if state.arrays["stepped"][0, local] == 0.0:
            return super()._turned(state, bodies, row, local, s)
        q: Any = bodies.get("orientation", row)
        omega: Any = bodies.get("angular_velocity", row)
        if s == 0.0:
            return q, omega
        inertia: Any = bodies.get("inertia", row)
        torque: Any = state.arrays["torque"][:, local].tolist()
        torque = scale(torque, spin.inverse_of(inertia))
        return spin.flown(q, omega, spin.excess_of(inertia), spin.spread_of(inertia), torque, s)

    def _read_turning(
        self, state: FlightState, bodies: Bodies, t: Instant, name: str, out: Array, turning: Sequence[int]
    ) -> None:
        stepped = state.arrays["stepped"][0]
        together = [local for local in turning if stepped[local]]
        if together:
            out[:, together] = self._flown(state, bodies, t, together)[0 if name == "orientation" else 1]
            turning = [local for local in turning if not stepped[local]]
        super()._read_turning(state, bodies, t, name, out, turning)

    def _commit(
        self, state: FlightState, bodies: Bodies, which: slice | Rows, t: Instant, trial: dict[str, Array]
    ) -> None:
        rows = _where(state, which)
        for name in ("position", "velocity"):
            bodies.arrays[name][:, rows] = trial[name]
        bodies.clock[0, rows], bodies.clock[1, rows] = t
        stepped = np.flatnonzero(trial["stepped"][0])
        if len(stepped):
            rows = state.rows[which]
            for name in ("orientation", "angular_velocity"):
                bodies.arrays[name][:, rows[stepped]] = trial[name][:, stepped]
            bodies.turn_clock[:, rows[stepped]] = bodies.clock[:, rows[stepped]]
        for name in ("acceleration", *KEPT):
            state.arrays[name][:, which] = trial[name]
        state.arrays["torque"][:, which] = np.where(trial["stepped"] == 2.0, trial["torque"], 0.0)
        state.facts = None
        bodies.change += 1

    def changed(
        self, state: State, bodies: Bodies, rows: Sequence[int], t: Instant, sources: Sources | None
    ) -> Sequence[int]:
        """The joined rows start anew at ``t``, towards the end of the batch's step."""
        assert isinstance(state, FlightState) and sources is not None
        together = sources.joined(rows)
        which = self.changed_locals(bodies, together)
        written = which[(bodies.clock[0, together] == t[0]) & (bodies.clock[1, together] == t[1])]
        for name in ("position_rest", "velocity_rest"):  # what was written is what it says
            state.arrays[name][:, written] = 0.0
        span = elapsed(self.covered(state), t)
        trial = self._ended(state, bodies, t, sources, which)
        trial = MidpointStep(self, state, bodies, sources).flights(t, max(span, 0.0), state.rows[which], trial)
        self._commit(state, bodies, which, t, trial)
        return together

    def restart(self, state: State, bodies: Bodies, t: Instant, sources: Sources | None) -> Sequence[int]:
        assert isinstance(state, FlightState) and sources is not None
        span = elapsed(self.covered(state), t)
        trial = self._ended(state, bodies, t, sources)
        trial = MidpointStep(self, state, bodies, sources).flights(t, max(span, 0.0), state.rows, trial)
        self._commit(state, bodies, slice(None), t, trial)
        return state.rows.tolist()  # type: ignore[no-any-return]

    # Steps to tolerances

    def _to_tolerance(
        self, state: FlightState, bodies: Bodies, wall: Instant, settings: Settings, sources: Sources
    ) -> Stop:
        begin = self.covered(state)
        step = MidpointStep(self, state, bodies, sources)
        start = self._ended(state, bodies, begin, sources)
        if state.numbers["second"] > 0.0:
            span = state.numbers["second"]
            trial = step.flights(begin, span, state.rows, start)
            state.numbers["second"] = 0.0
        else:
            span, trial = step.to_tolerance(begin, elapsed(wall, begin), settings, start)
        if not np.isfinite(span):
            raise NoStepperError("core:midpoint found no length for its step: give run(dt=...)")
        self._commit(state, bodies, slice(None), begin, trial)
        self._cover(state, later(begin, span), 1)
        return Stop(self.covered(state), state.rows)


class MidpointStep:
    """One step of rows of a batch, tried without touching anything."""

    def __init__(self, stepper: Stepper, state: FlightState, bodies: Bodies, sources: Sources) -> None:
        self.stepper, self.state, self.bodies, self.sources = stepper, state, bodies, sources

    def flights(self, t: Instant, span: float, rows: Rows, begin: dict[str, Array]) -> dict[str, Array]:
        """Acceleration and torque found half way, beside the state at the beginning."""
        mass = self.bodies.arrays["mass"][0, rows]
        stored = self.bodies.arrays["force"][:, rows] / mass
        torque = self.bodies.arrays["torque"][:, rows]
        half = 0.5 * span
        middle = self._middle(t, begin, rows, torque, half)
        force, twist, reads_velocity = self.sources.evaluate(rows, later(t, half), middle)
        if reads_velocity:
            middle["velocity"] = begin["velocity"] + half * (stored + force / mass)
            if twist.any():
                self._half_way(middle, begin, rows, torque + twist, half)
            force, twist, _ = self.sources.evaluate(rows, later(t, half), middle, again=True)
        working = self.sources.working
        return begin | {"acceleration": stored + force / mass, "torque": torque + twist, "working": working}

    def _middle(self, t: Instant, begin: dict[str, Array], rows: Rows, torque: Array, half: float) -> dict[str, Array]:
        # Of stored forces too only what the middle needs: so a body at rest or at its terminal speed stays there exactly.
        middle = {"position": begin["position"] + half * begin["velocity"], "velocity": begin["velocity"]}
        middle |= {name: begin[name].copy() for name in ("orientation", "angular_velocity")}
        self._half_way(middle, begin, rows, torque, half)
        if self.sources.reads_turning:
            free = (begin["stepped"][0] == 0.0) & begin["angular_velocity"].any(axis=0)
            for k in np.flatnonzero(free).tolist():
                local = int(self.bodies.local[rows[k]])
                for name in ("orientation", "angular_velocity"):
                    middle[name][:, k] = self.stepper.read_row(self.state, self.bodies, later(t, half), name, local)
        return middle

    def _half_way(
        self, middle: dict[str, Array], begin: dict[str, Array], rows: Rows, torque: Array, half: float
    ) -> None:
        """Put the rotation half way into ``middle``, of rows whose rotation is stepped."""
        k = np.flatnonzero(begin["stepped"][0])
        if len(k):
            from xpheve.loop.array_spin import half_way

            q, omega, inertia = begin["orientation"], begin["angular_velocity"], self.bodies.arrays["inertia"]
            torque = np.where(begin["stepped"] == 2.0, torque, 0.0)
            found = half_way(q[:, k], omega[:, k], inertia[:, rows[k]], torque[:, k], half)
            middle["orientation"][:, k], middle["angular_velocity"][:, k] = found

    def end(self, trial: dict[str, Array], rows: Rows, span: float) -> dict[str, Array]:
        """The state ``span`` after the beginning of the flights in ``trial``."""
        half, a = 0.5 * span, trial["acceleration"]
        q, omega = trial["orientation"].copy(), trial["angular_velocity"].copy()
        k = np.flatnonzero(trial["stepped"][0])
        if len(k):
            from xpheve.loop.array_spin import flown

            torque = np.where(trial["stepped"] == 2.0, trial["torque"], 0.0)[:, k]
            inertia = self.bodies.arrays["inertia"][:, rows[k]]
            q[:, k], omega[:, k] = flown(q[:, k], omega[:, k], inertia, torque, span)
        return trial | {
            "position": trial["position"] + span * (trial["velocity"] + half * a),
            "velocity": trial["velocity"] + span * a,
            "orientation": q,
            "angular_velocity": omega,
        }

    def to_tolerance(
        self, t: Instant, longest: float, settings: Settings, start: dict[str, Array]
    ) -> tuple[float, dict[str, Array]]:
        """The first of two half steps that agree with a whole one (step doubling; Hairer, Norsett, Wanner I, II.4)."""
        numbers, rows = self.state.numbers, self.state.rows
        wanted = numbers["next"] or self._guess(t, start)
        while True:
            span = min(wanted, longest)
            whole = self.flights(t, span, rows, start)
            first = self.flights(t, 0.5 * span, rows, start)
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

    def _guess(self, t: Instant, start: dict[str, Array]) -> float:
        """A first step: a hundredth of the time in which velocity or position changes by its own size."""
        trial = self.flights(t, 0.0, self.state.rows, start)
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


def _where(state: State, which: slice | Rows) -> slice | Rows:
    """The rows of the places ``which``; as a slice if they are all, and lie side by side."""
    return state.where if isinstance(which, slice) else state.rows[which]


def _span_since(t: Instant, base: Array, offset: Array) -> Any:
    """Time [s] since each row's clock; one number if they share it."""
    if len(base) and bool((base == base[0]).all()) and bool((offset == offset[0]).all()):
        return elapsed(t, (float(base[0]), float(offset[0])))
    return spans_since(t, base, offset)
