"""What core asks of a stepper, seen from a stepper of a stranger's pack."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, ClassVar

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import NoStepperError, RecordError
from xpheve.kernels.clock import NEVER, elapsed, later
from xpheve.plugins.registry import Registry
from xpheve.steppers.contract import Flight, Offer, Refusal, State, Stepper, Stop

STEP = 0.25
WIDTHS = {"position": 3, "velocity": 3, "orientation": 4, "angular_velocity": 3}


class Wind(xp.FieldLaw):
    """Blow along x, looking at the time, so that it is not stored."""

    id = "test:wind"
    acceleration, rate = xp.Constant((1.0, 0.0, 0.0), unit="m/s^2"), xp.Constant(0.0, unit="1/s")

    def force(self, body: Any) -> Any:
        return self.acceleration * body.mass * (1.0 + self.rate * body.time)


class Other(xp.FieldLaw):
    """Another law along the way."""

    id = "test:other"
    acceleration, rate = xp.Constant((0.0, 1.0, 0.0), unit="m/s^2"), xp.Constant(0.0, unit="1/s")

    def force(self, body: Any) -> Any:
        return self.acceleration * body.mass * (1.0 + self.rate * body.time)


class Called(xp.FieldLaw):
    """A law along the way that cannot be traced, so that the midpoint rule alone serves it."""

    id = "test:called"

    def apply(self, body: Any) -> Any:
        return -1.0 * body.mass * body.position


class Dummy(Stepper):
    """Fly by parabolas, in steps of its own of `STEP`, and write down every call."""

    id: ClassVar[str] = "test:dummy"
    promise: ClassVar[str] = "exact for constant wind"
    calls: ClassVar[list[tuple[Any, ...]]] = []

    def note(self, *what: Any) -> None:
        self.calls.append(what)

    def offer(self, signature: Any) -> Any:
        self.note("offer", signature)
        if signature.laws != ("test:wind",) or signature.torque != "none":
            return Refusal("only the wind of this test")
        return Offer(np.inf, 1.0, True)

    def start(self, rows: Any, bodies: Any, t: Any, sources: Any) -> State:
        self.note("start", rows.tolist(), t)
        state = State(np.zeros(0, dtype=np.int64), {"acceleration": np.zeros((3, 0))}, {"base": t[0], "offset": t[1]})
        self.take(state, rows, bodies)
        return state

    def join(self, state: State, rows: Any, bodies: Any, t: Any) -> None:
        self.note("join", rows.tolist(), t)
        self.take(state, rows, bodies)

    def take(self, state: State, rows: Any, bodies: Any) -> None:
        first = state.count
        state.rows = np.concatenate([state.rows, rows])
        more = np.zeros((3, len(rows)))
        state.arrays["acceleration"] = np.concatenate([state.arrays["acceleration"], more], axis=1)
        bodies.local[rows] = np.arange(first, first + len(rows))
        self.forces(state, bodies)

    def forces(self, state: State, bodies: Any) -> None:
        rows = state.rows
        stored = bodies.arrays["force"][:, rows] / bodies.arrays["mass"][0, rows]
        state.arrays["acceleration"] = stored + np.array([[1.0], [0.0], [0.0]])

    def leave(self, state: State, local: int) -> None:
        self.note("leave", int(state.rows[local]))
        last = state.count - 1
        state.rows[local] = state.rows[last]
        state.rows = state.rows[:last]
        array = state.arrays["acceleration"]
        array[:, local] = array[:, last]
        state.arrays["acceleration"] = array[:, :last]

    def covered(self, state: State) -> Any:
        return state.numbers["base"], state.numbers["offset"]

    def advance(self, state: State, bodies: Any, need: Any, wall: Any, settings: Any, sources: Any) -> Stop:
        """One step of its own, not past the wall."""
        begin = self.covered(state)
        end = min(later(begin, STEP), wall)
        self.note("advance", begin, need, wall)
        assert end > begin
        for local in range(state.count):
            row = int(state.rows[local])
            for name in ("position", "velocity"):
                bodies.arrays[name][:, row] = (
                    self.read_row(state, bodies, begin, name, local)
                    if begin > bodies.clock_of(row)
                    else bodies.arrays[name][:, row]
                )
            if begin > bodies.clock_of(row):
                bodies.clock[:, row] = begin
        state.numbers["base"], state.numbers["offset"] = end
        return Stop(end, state.rows.tolist())

    def read(self, state: State, bodies: Any, t: Any, name: str, out: Any) -> None:
        self.note("read", name, t)
        for local in range(state.count):
            out[:, local] = self.read_row(state, bodies, t, name, local)

    def read_row(self, state: State, bodies: Any, t: Any, name: str, local: int) -> tuple[float, ...]:
        row = int(state.rows[local])
        held = bodies.arrays[name][:, row]
        s = elapsed(t, bodies.clock_of(row))
        a = state.arrays["acceleration"][:, local]
        if name == "position":
            held = held + s * (bodies.arrays["velocity"][:, row] + 0.5 * s * a)
        elif name == "velocity":
            held = held + s * a
        return tuple(held.tolist())

    def flight(self, state: State, bodies: Any, local: int) -> Flight:
        row = int(state.rows[local])
        a = tuple(state.arrays["acceleration"][:, local].tolist())
        return Flight(
            bodies.clock_of(row), self.covered(state), bodies.get("position", row), bodies.get("velocity", row), a, 0.0
        )

    def changed(self, state: State, bodies: Any, rows: Sequence[int], t: Any, sources: Any) -> Sequence[int]:
        self.note("changed", list(rows), t)
        self.forces(state, bodies)
        return rows


@pytest.fixture(autouse=True)
def _fresh() -> Iterator[None]:
    """Forget the calls of other tests."""
    Dummy.calls.clear()
    yield
    Dummy.calls.clear()


def calls(kind: str) -> list[tuple[Any, ...]]:
    """Return the calls of one kind."""
    return [call for call in Dummy.calls if call[0] == kind]


@pytest.fixture
def registry() -> Registry:
    """Return a registry with a pack that offers the dummy."""
    found = Registry()
    found.register([Dummy, Wind, Other], name="test")
    return found


@pytest.fixture
def engine(registry: Registry) -> xp.PhysicsEngine:
    """Return an engine with wind."""
    made = xp.PhysicsEngine(registry=registry)
    made.add_law("test:wind", name="wind")
    return made


def kite(engine: xp.PhysicsEngine, **given: Any) -> xp.PhysicalObject:
    """Return a point in the wind."""
    return engine.add_object(xp.PhysicalObject(**given), laws=["wind"])


def test_the_cheapest_exact_offer_wins_its_signature_and_no_other(engine: xp.PhysicsEngine) -> None:
    one = kite(engine)
    engine.add_law("test:other", name="other")
    engine.add_object(xp.PhysicalObject(), laws=["other"])
    engine.add_object(xp.PhysicalObject(), laws=["wind", "other"])
    engine.add_object(xp.PhysicalObject())
    engine.run(until=2.0, dt=0.5)
    assert one.position == (2, 0, 0) and one.velocity == (2, 0, 0)
    groups = {tuple(sorted(group["offers"])): group for group in engine.explain().data["groups"]}
    winners = sorted((group["stepper"], group["objects"]) for group in groups.values())
    assert ("test:dummy", 1) in winners
    ours = next(group for group in engine.explain().data["groups"] if group["stepper"] == "test:dummy")
    assert "core:ballistic" in ours["refused"] and ours["promise"] == Dummy.promise
    assert {row for call in calls("start") for row in call[1]} == {one._row}
    others = [
        group for group in engine.explain().data["groups"] if group["stepper"] not in ("test:dummy", "core:ballistic")
    ]
    assert [group["refused"]["test:dummy"] for group in others] == ["only the wind of this test"] * 2


def test_a_signature_is_offered_once(engine: xp.PhysicsEngine) -> None:
    for k in range(10):
        kite(engine, position=(k, 0, 0))
    engine.run(until=1.0)
    kite(engine)
    engine.run(until=2.0)
    assert len(calls("offer")) == 1 and len(calls("start")) == 1


def test_members_of_one_signature_are_one_batch(engine: xp.PhysicsEngine) -> None:
    bodies = [kite(engine, position=(k, 0, 0)) for k in range(10)]
    engine.run(until=1.0)
    assert sorted(calls("start")[0][1]) == list(range(10))
    assert all(body.position[0] == k + 0.5 for k, body in enumerate(bodies))


def test_joining_and_leaving_re_base_nobody_else(engine: xp.PhysicsEngine) -> None:
    bodies = [kite(engine, position=(k, 0, 0), velocity=(0, k, 0)) for k in range(5)]
    engine.run(until=0.6)
    clocks = [engine._world.bodies.clock_of(body._row) for body in bodies]
    late = kite(engine, position=(9, 0, 0))
    engine.run(until=0.61)
    assert [engine._world.bodies.clock_of(body._row) for body in bodies] == clocks
    engine.unmap(bodies[1], "wind")
    engine.remove_object(bodies[0])
    engine.run(until=2.0)
    assert {call[1] for call in calls("leave")} == {0, 1}
    assert bodies[0].position[0] == pytest.approx(0.61**2 / 2, abs=1e-14)
    assert bodies[1].position == pytest.approx((1 + 0.61**2 / 2 + 0.61 * 1.39, 2, 0), abs=1e-14)
    for k in (2, 3, 4):
        assert bodies[k].position == pytest.approx((k + 2, 2 * k, 0), abs=1e-14)
    assert late.position == pytest.approx((9 + 1.4**2 / 2, 0, 0), abs=1e-14)


def test_need_does_not_change_its_steps(registry: Registry) -> None:
    def ends(untils: Sequence[float], every: float | None = None) -> list[Any]:
        Dummy.calls.clear()
        engine = xp.PhysicsEngine(registry=registry)
        engine.add_law("test:wind", name="wind")
        body = kite(engine)
        for until in untils:
            engine.run(until=until, every=every)
        return [[call[1] for call in calls("advance")], body.position]

    whole = ends([3.1])
    assert len(whole[0]) == 13
    assert ends([0.1, 0.11, 0.7, 2.0, 3.1]) == whole
    assert ends([3.1], every=0.03) == whole


def test_a_batch_that_knows_enough_is_not_asked(engine: xp.PhysicsEngine) -> None:
    kite(engine)
    engine.run(until=0.1)
    asked = len(calls("advance"))
    for k in range(11, 25):
        engine.run(until=0.01 * k)
    assert len(calls("advance")) == asked == 1


def test_the_wall_is_the_next_host_step_and_lies_ahead(engine: xp.PhysicsEngine) -> None:
    body = kite(engine)
    engine.run(until=2.0, dt=0.4)
    walls = [(call[1], call[3]) for call in calls("advance")]
    assert all(begin < wall for begin, wall in walls)
    assert {round(wall[0] / 0.4, 9) % 1 for _, wall in walls} == {0.0}
    assert body.position == pytest.approx((2, 0, 0), abs=1e-14)
    Dummy.calls.clear()
    engine.run(until=3.0)
    assert all(call[3] == NEVER for call in calls("advance"))


def test_core_reads_only_what_is_covered(engine: xp.PhysicsEngine) -> None:
    kite(engine)
    for until in (0.1, 0.5, 0.6, 1.7):
        engine.run(until=until)
        before = len(calls("advance"))
        assert engine.bodies.position.shape == (1, 3)
        assert len(calls("advance")) == before
        time = calls("read")[-1][2]
        covered = engine._world.batches[0].stepper.covered(engine._world.batches[0].state)
        assert time <= covered and time[0] == until


def test_it_is_told_of_every_change_and_of_nothing_else(engine: xp.PhysicsEngine) -> None:
    one, two = kite(engine), kite(engine, position=(5, 0, 0))
    engine.run(until=1.0)
    assert calls("changed") == []
    one.velocity = (0, 3, 0)
    assert calls("changed") == [("changed", [one._row], (1.0, 0.0))]
    one.add_force((0, 0, 2), 0.5)
    two.mass = 4.0
    assert [call[1] for call in calls("changed")] == [[one._row], [one._row], [two._row]]
    one.velocity = one.velocity
    assert len(calls("changed")) == 3
    engine.run(until=2.0)
    assert calls("changed")[3:] == [("changed", [one._row], (1.5, 0.0))]
    assert one.velocity == (1, 3, 1) and two.velocity == (2, 0, 0)
    assert one.position[2] == pytest.approx(0.25 + 0.5, abs=1e-14)


def test_a_write_between_its_steps_is_kept_to_the_end_of_the_step(engine: xp.PhysicsEngine) -> None:
    body = kite(engine)
    engine.run(until=0.1)
    body.velocity = (0, 1, 0)
    engine.run(until=1.0)
    assert body.velocity == pytest.approx((0.9, 1, 0), abs=1e-15)
    assert body.position == pytest.approx((0.005 + 0.405, 0.9, 0), abs=1e-15)


def test_contacts_are_found_on_its_flights(engine: xp.PhysicsEngine) -> None:
    bounce = engine.add_law("collision:elastic")
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5)), laws=["wind", bounce])
    engine.add_object(xp.PhysicalObject(xp.Plane((-1, 0, 0), offset=-2.5), fixed=True), laws=[bounce])
    engine.run(until=3.0)
    assert ball.velocity == pytest.approx((-2 + 1, 0, 0), abs=1e-12)
    assert ball.position == pytest.approx((2 - 2 + 0.5, 0, 0), abs=1e-12)


def test_its_state_is_saved_and_restored_by_core(engine: xp.PhysicsEngine, registry: Registry) -> None:
    bodies = [kite(engine, position=(k, 0, 0), velocity=(0, 0.1 * k, 0)) for k in range(4)]
    bodies[1].add_force((0, 0, 1), 1.5)
    engine.run(until=0.9)
    saved = engine.checkpoint()
    twin = xp.PhysicsEngine.restore(saved, registry=registry)
    assert twin.checkpoint() == saved
    for one in (engine, twin):
        Dummy.calls.clear()
        one.run(until=3.3)
        one_way = [call for call in Dummy.calls if call[0] in ("advance", "changed")]
        assert one_way == [call for call in Dummy.calls if call[0] not in ("read", "offer")]
    assert [obj.position for obj in twin.objects] == [body.position for body in bodies]
    assert twin.checkpoint() == engine.checkpoint()


def test_a_checkpoint_of_a_stepper_that_is_not_at_hand_is_refused(engine: xp.PhysicsEngine) -> None:
    kite(engine)
    engine.run(until=1.0)
    saved = engine.checkpoint()
    poor = Registry()
    poor.register([Wind, Other], name="test")
    with pytest.raises(RecordError, match="test:dummy"):
        xp.PhysicsEngine.restore(saved, registry=poor)


def test_looking_makes_no_step(engine: xp.PhysicsEngine) -> None:
    kite(engine)
    engine.run(until=1.0)
    before = engine.checkpoint()
    Dummy.calls.clear()
    engine.explain(), engine.energy(), engine.momentum(), engine.copy(), engine.frame()
    assert engine.checkpoint() == before
    assert not calls("advance") and not calls("changed") and not calls("leave")


def test_if_all_refuse_the_error_names_each(monkeypatch: pytest.MonkeyPatch, engine: xp.PhysicsEngine) -> None:
    from xpheve.steppers.midpoint import Midpoint

    monkeypatch.setattr(Midpoint, "offer", lambda self, signature: Refusal("not today"))
    engine.add_object(xp.PhysicalObject(), laws=[engine.add_law(Called)])
    with pytest.raises(
        NoStepperError,
        match=r"(?s)core:adaptive: a law cannot be traced.*core:midpoint: not today.*test:dummy: only the wind",
    ):
        engine.run(until=1.0)
    assert engine.time == 0.0 and engine.state == "ready"


def test_a_stepper_that_raises_leaves_the_engine_ready(
    monkeypatch: pytest.MonkeyPatch, engine: xp.PhysicsEngine
) -> None:
    body = kite(engine)
    engine.run(until=0.3)

    def fail(*given: Any) -> Any:
        raise NoStepperError("out of steps")

    with monkeypatch.context() as patch:
        patch.setattr(Dummy, "advance", fail)
        with pytest.raises(NoStepperError):
            engine.run(until=1.0)
    assert engine.state == "ready" and engine.time in (0.3, 0.5)
    engine.run(until=1.0)
    assert body.position == (0.5, 0, 0)
