"""What steppers share whose rows fly under a constant acceleration: reading them, one or all, at any time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from xpheve.bodies import Bodies
from xpheve.kernels.clock import Instant, elapsed
from xpheve.kernels.flight import (
    FREE,
    PRINCIPAL,
    RESTING,
    place,
    speed,
    turn_about_axis,
    turn_split,
    way_of_turning,
)
from xpheve.kernels.free_rotation import prepare, turn
from xpheve.steppers.contract import Array, Flight, Rows, State, Stepper

Quat = tuple[float, float, float, float]
Vec = tuple[float, float, float]


class FlightState(State):
    """A `State` with what can be made again from the rest: kept so that nothing is computed twice."""

    def __init__(self, rows: Rows) -> None:
        super().__init__(rows, {"acceleration": np.zeros((3, len(rows))), "torque": np.zeros((3, len(rows)))})
        self.turns: dict[int, tuple[int, tuple[float, ...]]] = {}
        """By serial number: the version and constants of a free rotation."""
        self.facts: tuple[int, float | None, list[float | None], list[int]] | None = None
        """At a count of changes: the clock all rows share, the components of acceleration they share, the rows that turn."""
        self.where: slice | Rows = slice(0, 0)

    def locate(self) -> None:
        """Find out whether the rows lie side by side."""
        rows, n = self.rows, len(self.rows)
        self.facts = None
        if n and rows[n - 1] - rows[0] == n - 1 and bool((np.diff(rows) == 1).all()):
            self.where = slice(int(rows[0]), int(rows[0]) + n)
        else:
            self.where = rows


class FlightStepper(Stepper):
    """Rows that fly as ``position + s (velocity + s acceleration / 2)`` until their flight changes."""

    def join(self, state: State, rows: Rows, bodies: Bodies, t: Instant) -> None:
        assert isinstance(state, FlightState)
        first = state.count
        state.rows = np.concatenate([state.rows, rows])
        for name, array in state.arrays.items():
            state.arrays[name] = np.concatenate([array, np.zeros((array.shape[0], len(rows)))], axis=1)
        bodies.local[rows] = np.arange(first, first + len(rows))
        state.locate()
        self._take_forces(state, bodies, slice(first, first + len(rows)))

    def leave(self, state: State, local: int) -> None:
        assert isinstance(state, FlightState)
        last = state.count - 1
        for name, array in state.arrays.items():
            if local != last:
                array[:, local] = array[:, last]
            state.arrays[name] = array[:, :last]
        if local != last:
            state.rows[local] = state.rows[last]
        state.rows = state.rows[:last]
        state.locate()

    def _take_forces(self, state: FlightState, bodies: Bodies, which: slice | Rows) -> None:
        """Acceleration and torque of the stored forces."""
        rows = state.rows[which]
        state.arrays["acceleration"][:, which] = bodies.arrays["force"][:, rows] / bodies.arrays["mass"][0, rows]
        state.arrays["torque"][:, which] = bodies.arrays["torque"][:, rows]
        state.facts = None

    def _facts(self, state: FlightState, bodies: Bodies) -> tuple[int, float | None, list[float | None], list[int]]:
        if state.facts is not None and state.facts[0] == bodies.change:
            return state.facts
        where = state.where
        base, offset = bodies.clock[0, where], bodies.clock[1, where]
        shared: float | None = None
        if len(base) and bool((base == base[0]).all()) and bool((offset == offset[0]).all()):
            shared = 0.0
        components: list[float | None] = []
        for component in state.arrays["acceleration"]:
            same = len(component) > 0 and bool((component == component[0]).all())
            components.append(float(component[0]) if same else None)
        turning = bodies.arrays["angular_velocity"][:, where].any(axis=0) | state.arrays["torque"].any(axis=0)
        state.facts = (bodies.change, shared, components, np.flatnonzero(turning).tolist())
        return state.facts

    def _spans(self, state: FlightState, bodies: Bodies, t: Instant) -> Any:
        """Time [s] since each row was re-based: one float if they share it, else an array."""
        where = state.where
        if self._facts(state, bodies)[1] is not None:
            return elapsed(t, (float(bodies.clock[0, where][0]), float(bodies.clock[1, where][0])))
        return _spans_since(t, bodies.clock[0, where], bodies.clock[1, where])

    def read(self, state: State, bodies: Bodies, t: Instant, name: str, out: Array) -> None:
        assert isinstance(state, FlightState)
        if name in ("position", "velocity"):
            self._read_centre(state, bodies, t, name, out)
            return
        where = state.where
        out[...] = bodies.arrays[name][:, where]
        for local in self._facts(state, bodies)[3]:
            out[:, local] = self.read_row(state, bodies, t, name, local)

    def _read_centre(self, state: FlightState, bodies: Bodies, t: Instant, name: str, out: Array) -> None:
        """`place` and `speed` of all rows, component by component; what all share is added as one number."""
        where = state.where
        s = self._spans(state, bodies, t)
        half = 0.5 * s
        shared = self._facts(state, bodies)[2]
        for k in range(3):
            x0, v0, line = bodies.arrays["position"][k, where], bodies.arrays["velocity"][k, where], out[k]
            a = state.arrays["acceleration"][k] if shared[k] is None else shared[k]
            still = shared[k] == 0.0
            if name == "velocity":
                if still:
                    line[...] = v0
                else:
                    np.add(v0, s * a, out=line)
                continue
            if still:
                np.multiply(v0, s, out=line)
            else:
                np.add(v0, half * a, out=line)
                np.multiply(line, s, out=line)
            np.add(line, x0, out=line)

    def read_row(self, state: State, bodies: Bodies, t: Instant, name: str, local: int) -> tuple[float, ...]:
        assert isinstance(state, FlightState)
        row = int(state.rows[local])
        s = elapsed(t, bodies.clock_of(row))
        if name == "position":
            x, v, a = bodies.get("position", row), bodies.get("velocity", row), _column(state, "acceleration", local)
            return place(x[0], v[0], a[0], s), place(x[1], v[1], a[1], s), place(x[2], v[2], a[2], s)
        if name == "velocity":
            v, a = bodies.get("velocity", row), _column(state, "acceleration", local)
            return speed(v[0], a[0], s), speed(v[1], a[1], s), speed(v[2], a[2], s)
        q, omega = self._turned(state, bodies, row, local, s)
        return q if name == "orientation" else omega

    def _turned(self, state: FlightState, bodies: Bodies, row: int, local: int, s: float) -> tuple[Quat, Vec]:
        """Orientation and angular velocity of a row ``s`` after its re-base."""
        q: Any = bodies.get("orientation", row)
        omega: Any = bodies.get("angular_velocity", row)
        torque: Any = _column(state, "torque", local)
        inertia: Any = bodies.get("inertia", row)
        how = way_of_turning(q, omega, inertia, torque)
        if s == 0.0 or how == RESTING:
            return q, omega
        if how == FREE:
            return turn(self._constants(state, bodies, row, q, omega, inertia), s)
        if how == PRINCIPAL:
            return turn_about_axis(q, omega, inertia, torque, s)
        return turn_split(q, omega, inertia, torque, s)

    def _constants(
        self, state: FlightState, bodies: Bodies, row: int, q: Quat, omega: Vec, inertia: Vec
    ) -> tuple[float, ...]:
        serial, version = int(bodies.serial[row]), int(bodies.version[row])
        held = state.turns.get(serial)
        if held is None or held[0] != version:
            held = state.turns[serial] = (version, prepare(q, omega, inertia))
        return held[1]

    def flight(self, state: State, bodies: Bodies, local: int) -> Flight:
        row = int(state.rows[local])
        x, v, a = bodies.get("position", row), bodies.get("velocity", row), _column(state, "acceleration", local)
        return Flight(bodies.clock_of(row), self.covered(state), x, v, a, 0.0)  # type: ignore[arg-type]

    def changed_locals(self, bodies: Bodies, rows: Sequence[int]) -> Rows:
        """The places of ``rows`` in their batch."""
        return bodies.local[np.asarray(rows, dtype=np.int64)]


def _column(state: State, name: str, local: int) -> tuple[float, ...]:
    return tuple(state.arrays[name][:, local].tolist())


def _spans_since(t: Instant, base: Array, offset: Array) -> Array:
    """`elapsed` for arrays, to the same bits."""
    s = t[0] + -base
    u = s - t[0]
    e = (t[0] - (s - u)) + (-base - u)
    return s + (e + (t[1] - offset))
