"""Steppers of a stranger's pack whose rows fly on curves: springs in closed form, without end, and in steps of their own."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
import pytest

import xpheve as xp
from xpheve.kernels.clock import NEVER, elapsed, later
from xpheve.plugins.registry import Registry
from xpheve.steppers.contract import Flight, Offer, Refusal, State, Stepper, Stop

STEP = 0.375
RATE = 2.0
"""Angular frequency [rad/s] of the springs of both steppers."""


class Pull(xp.FieldLaw):
    """F = -m w^2 x, with w = `RATE`."""

    id = "curves:pull"
    rate = xp.Constant(RATE, unit="1/s")

    def force(self, body: Any) -> Any:
        return -body.mass * self.rate**2 * body.position

    def potential(self, body: Any) -> Any:
        return 0.5 * body.mass * self.rate**2 * body.position.dot(body.position)


class SteppedPull(Pull):
    """The same for the other stepper."""

    id = "curves:stepped_pull"


class Round(Stepper):
    """x = c + (x0 - c) cos(w s) + v0 sin(w s) / w, where c is where stored forces hold the spring."""

    id: ClassVar[str] = "curves:round"
    promise: ClassVar[str] = "springs in closed form"
    laws: ClassVar[tuple[str, ...]] = ("curves:pull",)
    calls: ClassVar[list[tuple[Any, ...]]] = []

    def offer(self, signature: Any) -> Any:
        if signature.laws != self.laws or signature.torque != "none":
            return Refusal("only the springs of this test")
        if signature.contacts:
            return Refusal("contacts are looked for, and its rows fly on curves")
        return Offer(np.inf, 1.0, True)

    def start(self, rows: Any, bodies: Any, t: Any, sources: Any) -> State:
        state = State(np.zeros(0, dtype=np.int64), {}, {"base": t[0], "offset": t[1]})
        self.join(state, rows, bodies, t)
        return state

    def join(self, state: State, rows: Any, bodies: Any, t: Any) -> None:
        first = state.count
        state.rows = np.concatenate([state.rows, rows])
        bodies.local[rows] = np.arange(first, first + len(rows))

    def leave(self, state: State, local: int) -> None:
        state.rows[local] = state.rows[state.count - 1]
        state.rows = state.rows[:-1]

    def advance(self, state: State, bodies: Any, need: Any, wall: Any, settings: Any, sources: Any) -> Stop:
        return Stop(NEVER, ())

    def read(self, state: State, bodies: Any, t: Any, name: str, out: Any) -> None:
        for local in range(state.count):
            out[:, local] = self.read_row(state, bodies, t, name, local)

    def read_row(self, state: State, bodies: Any, t: Any, name: str, local: int) -> tuple[float, ...]:
        row = int(state.rows[local])
        if name not in ("position", "velocity"):
            return bodies.get(name, row)
        s = RATE * elapsed(t, bodies.clock_of(row))
        x, v = bodies.get("position", row), bodies.get("velocity", row)
        if s == 0.0:
            return x if name == "position" else v
        cos, sin = math.cos(s), math.sin(s)
        c = self.centre(bodies, row)
        if name == "position":
            return tuple(c[k] + (x[k] - c[k]) * cos + v[k] / RATE * sin for k in range(3))
        return tuple(v[k] * cos - RATE * (x[k] - c[k]) * sin for k in range(3))

    def centre(self, bodies: Any, row: int) -> list[float]:
        mass = bodies.get("mass", row)[0]
        return [one / (mass * RATE * RATE) for one in bodies.get("force", row)]

    def flight(self, state: State, bodies: Any, local: int) -> Flight:
        row = int(state.rows[local])
        x, c = bodies.get("position", row), self.centre(bodies, row)
        a = tuple(-RATE * RATE * (x[k] - c[k]) for k in range(3))
        end = self.covered(state)
        return Flight(bodies.clock_of(row), end, x, bodies.get("velocity", row), a, 0.0, True)

    def changed(self, state: State, bodies: Any, rows: Sequence[int], t: Any, sources: Any) -> Sequence[int]:
        self.calls.append((self.id, list(rows), t))
        return rows


class Stepped(Round):
    """The same, known one step of `STEP` at a time, at whose beginning all rows are re-based."""

    id: ClassVar[str] = "curves:stepped"
    laws: ClassVar[tuple[str, ...]] = ("curves:stepped_pull",)

    def covered(self, state: State) -> Any:
        return state.numbers["base"], state.numbers["offset"]

    def advance(self, state: State, bodies: Any, need: Any, wall: Any, settings: Any, sources: Any) -> Stop:
        begin = self.covered(state)
        for local, row in enumerate(state.rows.tolist()):
            flown = [self.read_row(state, bodies, begin, name, local) for name in ("position", "velocity")]
            bodies.arrays["position"][:, row], bodies.arrays["velocity"][:, row] = flown
            bodies.clock[:, row] = begin
        bodies.change += 1
        state.numbers["base"], state.numbers["offset"] = min(later(begin, STEP), wall)
        return Stop(self.covered(state), state.rows.tolist())

    def leap(self, state: State, bodies: Any, need: Any, wall: Any, settings: Any, sources: Any) -> Stop:
        while self.covered(state) < min(need, wall):
            stop = self.advance(state, bodies, need, wall, settings, sources)
        return stop


@pytest.fixture
def registry() -> Registry:
    """Return a registry with a pack that offers the steppers and their laws."""
    Round.calls.clear()
    found = Registry()
    found.register([Round, Stepped, Pull, SteppedPull], name="curves")
    return found


@pytest.fixture(params=["curves:pull", "curves:stepped_pull"], ids=["closed form", "steps"])
def spring(request: pytest.FixtureRequest) -> str:
    """Return the id of the law of either stepper."""
    return str(request.param)


@pytest.fixture
def engine(registry: Registry, spring: str) -> xp.PhysicsEngine:
    """Return an engine with a spring to the origin, named so."""
    made = xp.PhysicsEngine(registry=registry)
    made.add_law(spring, name="spring")
    return made
