"""What steppers share whose rows fly under a constant acceleration: reading them, one or all, at any time."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
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
from xpheve.kernels.free_rotation import prepare
from xpheve.kernels.free_rotation import turn as turn_freely
from xpheve.steppers.contract import Array, Flight, Rows, State, Stepper
from xpheve.steppers.sums import spans_since

turn = lru_cache(maxsize=64)(turn_freely)
"""Orientation and angular velocity of one instant are asked for one after the other, by every pair of a body."""

Quat = tuple[float, float, float, float]
_add, _multiply = np.add, np.multiply
Vec = tuple[float, float, float]


class _Facts:
    """What holds for a batch until the next write: kept so that a read does nothing but the arithmetic."""

    __slots__ = ("acceleration", "base", "change", "clock", "offset", "position", "rests", "turning", "velocity")

    def __init__(self, state: FlightState, bodies: Bodies) -> None:
        where = state.where
        self.change = bodies.change
        self.base, self.offset = bodies.clock[0, where], bodies.clock[1, where]
        self.clock: Instant | None = None
        """The clock that all rows share, if they do."""
        if len(self.base) and bool((self.base == self.base[0]).all()) and bool((self.offset == self.offset[0]).all()):
            self.clock = float(self.base[0]), float(self.offset[0])
        self.position = tuple(bodies.arrays["position"][:, where])
        self.velocity = tuple(bodies.arrays["velocity"][:, where])
        self.acceleration: list[float | Array] = []
        """By component: one number if all rows share it."""
        for component in state.arrays["acceleration"]:
            same = len(component) > 0 and bool((component == component[0]).all())
            self.acceleration.append(float(component[0]) if same else component)
        self.rests = tuple(state.arrays.get(name) for name in ("position_rest", "velocity_rest"))
        """What rounding left out of place and velocity, if the stepper keeps it."""
        turning = bodies.arrays["angular_velocity"][:, where].any(axis=0) | state.arrays["torque"].any(axis=0)
        self.turning: list[int] = np.flatnonzero(turning).tolist()


class FlightState(State):
    """A `State` with what can be made again from the rest: kept so that nothing is computed twice."""

    def __init__(self, rows: Rows) -> None:
        super().__init__(rows, {"acceleration": np.zeros((3, len(rows))), "torque": np.zeros((3, len(rows)))})
        self.turns: dict[int, tuple[Any, tuple[float, ...]]] = {}
        """By serial number: the state at the base, and the constants of the free rotation through it."""
        self.facts: _Facts | None = None
        self.made: dict[str, Any] = {}
        """What a stepper made of its arrays, for reads: forgotten when rows come, go or change places."""

    def locate(self) -> None:
        super().locate()
        self.facts = None
        self.made.clear()


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

    def _facts(self, state: FlightState, bodies: Bodies) -> _Facts:
        facts = state.facts
        if facts is None or facts.change != bodies.change:
            facts = state.facts = _Facts(state, bodies)
        return facts

    def read(self, state: State, bodies: Bodies, t: Instant, name: str, out: Array) -> None:
        assert isinstance(state, FlightState)
        facts = self._facts(state, bodies)
        if name in ("position", "velocity"):
            s: Any = elapsed(t, facts.clock) if facts.clock is not None else spans_since(t, facts.base, facts.offset)
            (_read_position if name == "position" else _read_velocity)(facts, s, out)
            return
        out[...] = bodies.arrays[name][:, state.where]
        self._read_turning(state, bodies, t, name, out, facts.turning)

    def _read_turning(
        self, state: FlightState, bodies: Bodies, t: Instant, name: str, out: Array, turning: Sequence[int]
    ) -> None:
        """Write orientation or angular velocity of the rows at places ``turning`` into ``out``."""
        if name == "angular_velocity" and turning:
            changing = self._changes_spin(state, bodies, np.array(turning, dtype=np.int64))
            turning = [local for local, changes in zip(turning, changing.tolist(), strict=True) if changes]
        for local in turning:
            out[:, local] = self.read_row(state, bodies, t, name, local)

    def _changes_spin(self, state: FlightState, bodies: Bodies, places: Rows) -> Array:
        """Which of the rows at ``places`` may have another angular velocity than at their base: not free balls, nor points."""
        inertia = bodies.arrays["inertia"][:, state.rows[places]]
        even = (inertia[0] == inertia[1]) & (inertia[1] == inertia[2])
        changes: Array = ~even | state.arrays["torque"][:, places].any(axis=0)
        return changes

    def read_row(self, state: State, bodies: Bodies, t: Instant, name: str, local: int) -> tuple[float, ...]:
        assert isinstance(state, FlightState)
        row = int(state.rows[local])
        if name in ("position", "velocity"):
            s = elapsed(t, bodies.clock_of(row))
        if name == "position":
            x, v, a = bodies.get("position", row), bodies.get("velocity", row), _column(state, "acceleration", local)
            if "position_rest" in state.arrays:
                r = _column(state, "position_rest", local)
                return tuple(x[k] + (s * (v[k] + (0.5 * s) * a[k]) + r[k]) for k in range(3))
            return place(x[0], v[0], a[0], s), place(x[1], v[1], a[1], s), place(x[2], v[2], a[2], s)
        if name == "velocity":
            v, a = bodies.get("velocity", row), _column(state, "acceleration", local)
            if "velocity_rest" in state.arrays:
                r = _column(state, "velocity_rest", local)
                return tuple(v[k] + (s * a[k] + r[k]) for k in range(3))
            return speed(v[0], a[0], s), speed(v[1], a[1], s), speed(v[2], a[2], s)
        q, omega = self._turned(state, bodies, row, local, elapsed(t, bodies.turn_clock_of(row)))
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
        serial, key = int(bodies.serial[row]), (q, omega, inertia)
        held = state.turns.get(serial)
        if held is None or held[0] != key:
            held = state.turns[serial] = (key, prepare(q, omega, inertia))
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


def _read_position(facts: _Facts, s: Any, out: Array) -> None:
    """`place` of all rows, component by component; adding an acceleration of 0 is left out, which changes no bit."""
    half = 0.5 * s
    rests: Any = facts.rests[0]
    for k, (x0, v0, a, line) in enumerate(zip(facts.position, facts.velocity, facts.acceleration, out, strict=True)):
        if type(a) is float and a == 0.0:
            _multiply(v0, s, line)
        else:
            _add(v0, half * a, line)
            _multiply(line, s, line)
        if rests is not None:
            _add(line, rests[k], line)
        _add(line, x0, line)


def _read_velocity(facts: _Facts, s: Any, out: Array) -> None:
    """`speed` of all rows, component by component."""
    rests: Any = facts.rests[1]
    for k, (v0, a, line) in enumerate(zip(facts.velocity, facts.acceleration, out, strict=True)):
        if rests is not None:
            _add(v0, s * a + rests[k], line)
        elif type(a) is float and a == 0.0:
            line[...] = v0
        else:
            _add(v0, s * a, line)
