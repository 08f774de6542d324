"""Conditions along flights that are no parabolas: at the instants of the closed form, found without touching the motion."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.plan.wakeups.curves import Curve
from xpheve.plugins.registry import Registry

when = xp.when
RATE = 2.0
PLACES = st.tuples(*(st.floats(-2, 2) for _ in range(3)))


class Log(xp.PhysicalLaw):
    """Write down when it is told, and do something."""

    def __init__(self, act: Callable[[Any], None] | None = None, **given: Any) -> None:
        super().__init__(**given)
        self.act = act
        self.times: list[float] = []

    def enforce_this_law(self, event: Any) -> None:
        self.times.append(event.time)
        if self.act is not None:
            self.act(event)


def listen(engine: xp.PhysicsEngine, condition: Any, act: Callable[[Any], None] | None = None) -> Log:
    """Return a law that waits for ``condition``."""
    law = Log(act)
    engine.add_law(law, container=xp.LawContainer(condition))
    return law


def sprung(engine: xp.PhysicsEngine, *laws: Any, **given: Any) -> xp.PhysicalObject:
    """Return a point on the spring."""
    return engine.add_object(xp.PhysicalObject(**given), laws=["spring", *laws])


def test_the_steppers_of_these_tests_win(engine: xp.PhysicsEngine) -> None:
    body = sprung(engine, position=(1, 0, 0))
    engine.run(until=1.0)
    assert engine.explain().data["groups"][0]["stepper"] in ("curves:round", "curves:stepped")
    assert engine._world.flight(body._row).curved
    assert body.position[0] == pytest.approx(math.cos(2.0), abs=4e-16)


def test_a_coordinate_crosses_where_the_sine_does(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.Crosses("body.position.x"))
    sprung(engine, law, velocity=(2, 0, 0))  # x = sin 2t
    engine.run(until=50.0)
    assert law.times == pytest.approx([k * math.pi / 2 for k in range(1, 32)], rel=3e-16)


def test_each_direction_is_told_apart(engine: xp.PhysicsEngine) -> None:
    up, down = (listen(engine, when.Crosses("body.velocity.x - 1.0", direction=k)) for k in (1, -1))
    sprung(engine, up, down, velocity=(2, 0, 0))  # v = 2 cos 2t passes 1 at 2t = +-pi/3
    engine.run(until=10.0)
    third = math.pi / 3
    assert down.times == pytest.approx([(third + 2 * math.pi * k) / 2 for k in range(4)], abs=4e-15)
    assert up.times == pytest.approx([(2 * math.pi * k - third) / 2 for k in range(1, 4)], abs=4e-15)


def test_a_crossing_is_the_first_float_of_time(engine: xp.PhysicsEngine) -> None:
    """A float before, the expression that is read there has the old sign."""
    seen: list[tuple[float, float]] = []
    world = engine._world

    def note(event: Any) -> None:
        row, t = event.objects[0]._row, world.time
        before = (t[0], math.nextafter(t[1], -math.inf) if t[1] else -math.ulp(t[0]))
        seen.append((world.read_row(row, "position", t)[0], world.read_row(row, "position", before)[0]))

    law = listen(engine, when.Crosses("body.position.x", direction=-1), note)
    sprung(engine, law, position=(1, 0, 0))
    engine.run(until=5.0)
    assert len(seen) == 2
    assert all(here <= 0.0 for here, _ in seen) and all(abs(there) < 1e-14 for _, there in seen)


def test_what_reads_time_alone_is_exact_along_a_curve(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.Crosses("body.time - 4.25"))
    sprung(engine, law, position=(1, 0, 0))
    engine.run(until=10.0)
    assert law.times == [4.25]


def test_windows_go_on_along_a_flight_without_end(registry: Registry) -> None:
    """Ten thousand crossings of one flight that is never re-based, the last as exact as time allows."""
    engine = xp.PhysicsEngine(registry=registry)
    engine.add_law("curves:pull", name="spring")
    law = listen(engine, when.Crosses("body.position.x"))
    body = sprung(engine, law, velocity=(2, 0, 0))
    engine.run(until=1000.0 * math.pi / 2 + 0.1)
    assert len(law.times) == 1000
    assert engine._world.bodies.clock_of(body._row) == (0.0, 0.0)
    assert law.times == pytest.approx([k * math.pi / 2 for k in range(1, 1001)], rel=4e-15)


def test_a_long_wait_costs_few_windows(registry: Registry) -> None:
    engine = xp.PhysicsEngine(registry=registry)
    engine.add_law("curves:pull", name="spring")
    law = listen(engine, when.Crosses("body.position.x - 3.0"))
    sprung(engine, law, position=(1, 0, 0))
    engine.run(until=1000.0)
    assert law.times == []
    assert engine._world.wakeups.tracker.predictions < 1000  # some 320 turns, each resolved by a window or two


@pytest.mark.parametrize("followed", [1, 3])
def test_following_changes_no_bit_of_the_motion(engine: xp.PhysicsEngine, followed: int) -> None:
    def watched(watch: bool) -> list[Any]:
        twin = xp.PhysicsEngine(registry=engine.registry)
        twin.add_law(next(iter(engine.laws)).label(), name="spring")
        law = Log()
        container = xp.LawContainer(
            when.Crosses("body.position.x - 0.3") | when.ProbeEnter(xp.Region(xp.Box((1, 1, 1)), (0.2, 0, 0)))
        )
        twin.add_law(law, container=container)
        bodies = [sprung(twin, position=(1 + k, 0.1, 0), velocity=(0, 0.3, k)) for k in range(3)]
        for body in bodies[:followed] if watch else ():
            twin.map(body, law)
        bodies[2].add_force((0, 1, 0), 0.7)
        twin.run(until=7.7)
        assert bool(law.times) == watch
        clocks = [twin._world.bodies.clock_of(body._row) for body in bodies]
        return [clocks, [(body.position, body.velocity) for body in bodies]]

    assert watched(True) == watched(False)


def test_an_event_restarts_only_what_it_touches(engine: xp.PhysicsEngine, registry: Registry) -> None:
    from xpheve.steppers.contract import Stepper

    one, two = sprung(engine, position=(1, 0, 0)), sprung(engine, position=(2, 0, 0))

    def kick(event: Any) -> None:
        one.velocity = (0, 1, 0)

    law = listen(engine, when.Crosses("body.position.x"), kick)
    engine.map(one, law)
    engine.run(until=1.0)
    stepper: Any = engine._world.batches[int(engine._world.bodies.batch[one._row])].stepper
    assert isinstance(stepper, Stepper)
    assert [rows for _, rows, _ in stepper.calls] == [[one._row]]
    assert law.times == pytest.approx([math.pi / 4], abs=4e-16)
    assert two.position[0] == pytest.approx(2 * math.cos(2.0), abs=4e-15)
    s = 2.0 * (1.0 - math.pi / 4)
    assert one.position == pytest.approx((0, 0.5 * math.sin(s), 0), abs=4e-15)


def test_a_probe_rides_along(engine: xp.PhysicsEngine) -> None:
    region = xp.Region(xp.Sphere(0.5))
    entered = listen(engine, when.ProbeEnter(region, xp.Probe("none")))
    assert entered.times == []
    body = sprung(engine, position=(1, 0, 0))
    probe = engine.add_probe(xp.Probe("eye", attached=body))
    law = listen(engine, when.ProbeEnter(region, probe))
    engine.run(until=3.0)
    # |cos 2t| = 1/2 from above
    assert law.times == pytest.approx([math.pi / 6, math.pi / 6 + math.pi / 2], abs=4e-16 + 1e-15)


def test_rest_is_seen_on_curves(engine: xp.PhysicsEngine) -> None:
    asleep, awake = listen(engine, when.Asleep()), listen(engine, when.Awake())
    body = sprung(engine, asleep, awake)
    other = sprung(engine, asleep, awake, position=(1, 0, 0))  # swings
    turning = sprung(engine, asleep, awake, velocity=(2, 0, 0))  # no force where it begins
    engine.run(until=1.0)
    assert asleep.times == [] and awake.times == []
    body.add_force((1, 0, 0), 1.0)
    engine.run(until=4.0)
    assert awake.times == [1.0] and asleep.times == []
    body.position, body.velocity = (0, 0, 0), (0, 0, 0)
    engine.run(until=5.0)
    assert asleep.times == [4.0] and awake.times == [1.0]
    assert other.position[0] == pytest.approx(math.cos(10.0), abs=1e-14)
    assert turning.position[0] == pytest.approx(math.sin(10.0), abs=1e-14)


class Counted(xp.PhysicalLaw):
    """Keep the times in what checkpoints hold."""

    id = "curves:counted"

    def enforce_this_law(self, event: Any) -> None:
        self.state.setdefault("times", []).append(event.time)


def test_a_checkpoint_follows_on_to_the_bit(engine: xp.PhysicsEngine) -> None:
    laws = [Counted(name="level"), Counted(name="ball")]
    region = xp.Region(xp.Sphere(0.5), position=(0, 0.5, 0))
    for law, condition in zip(laws, (when.Crosses("body.position.x - 0.25"), when.ProbeEnter(region)), strict=True):
        engine.add_law(law, container=xp.LawContainer(condition))
    sprung(engine, *laws, position=(1, 0.2, 0), velocity=(0, 1, 0))
    engine.run(until=6.1)
    twin = xp.PhysicsEngine.restore(engine.checkpoint(), registry=engine.registry, laws=[Counted])
    for one in (engine, twin):
        one.run(until=20.0)
    found = [[one.state["times"] for one in which.laws if isinstance(one, Counted)] for which in (engine, twin)]
    assert found[0] == found[1] and min(map(len, found[0])) >= 6
    assert twin.checkpoint() == engine.checkpoint()


@pytest.mark.parametrize("rate", [1e-7, 1e-3, 1.0, 1e4, 1e11])
@pytest.mark.parametrize("start", ["apart", "through", "round", "drifting"])
def test_the_pace_is_a_part_of_a_turn(rate: float, start: str) -> None:
    def velocity(s: float) -> tuple[float, float, float]:
        cos, sin = math.cos(rate * s), math.sin(rate * s)
        return {
            "apart": (-rate * sin, 0.0, 0.0),
            "through": (rate * cos, 0.0, 0.0),
            "round": (-rate * sin, rate * cos, 0.0),
            "drifting": (-rate * sin, 100.0 * rate, 0.0),
        }[start]

    class World:
        """What a curve asks of a world."""

        wakeups: Any = SimpleNamespace(paces={})
        bodies: Any = SimpleNamespace(objects=["body"])

        def read_row(self, row: int, name: str, t: Any) -> Any:
            assert name == "velocity"
            return velocity(t[0] + t[1])

    a = (0.0 if start == "through" else -rate * rate, 0.0, 0.0)
    pace = Curve(World(), 0, (0.0, 0.0), math.inf, velocity(0.0), a, ()).pace()
    assert 1e-4 < pace * rate < 1.0


def test_what_cannot_be_read_far_ahead_has_a_pace() -> None:
    class World:
        """A motion that grows without end."""

        wakeups: Any = SimpleNamespace(paces={})
        bodies: Any = SimpleNamespace(objects=["body"])

        def read_row(self, row: int, name: str, t: Any) -> Any:
            return math.exp(t[0] + t[1]), 0.0, 0.0  # OverflowError

    curve = Curve(World(), 0, (0.0, 0.0), math.inf, (1.0, 0.0, 0.0), (1.0, 0.0, 0.0), ())
    assert 0.01 < curve.pace() < 1.0


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(x=PLACES, v=PLACES, level=st.floats(-1.5, 1.5), law=st.sampled_from(["curves:pull", "curves:stepped_pull"]))
def test_no_crossing_of_a_level_is_missed(registry: Registry, x: Any, v: Any, level: float, law: str) -> None:
    """As many as the closed form has, where they are no touches."""
    size = math.hypot(x[0], v[0] / RATE)
    if abs(abs(level) - size) < 1e-3:
        return
    engine = xp.PhysicsEngine(registry=registry)
    engine.add_law(law, name="spring")
    log = listen(engine, when.Crosses(f"body.position.x - {level!r}"))
    sprung(engine, log, position=x, velocity=v)
    engine.run(until=7.0)
    begin, half = math.atan2(v[0] / RATE, x[0]), math.acos(level / size) if abs(level) < size else None
    wanted = []
    if half is not None:  # size cos(2 t - begin) = level
        for k in range(-3, 8):
            for sign in (1, -1):
                t = (begin + sign * half + 2 * math.pi * k) / RATE
                if 1e-9 < t < 7.0 - 1e-9:
                    wanted.append(t)
    assert [t for t in log.times if 1e-9 < t < 7.0 - 1e-9] == pytest.approx(sorted(wanted), abs=1e-12)


def test_what_is_rounding_all_along_is_no_crossing_and_costs_no_windows(registry: Registry) -> None:
    """The square of the radius of a circle less itself: nothing is there to be resolved."""
    engine = xp.PhysicsEngine(registry=registry)
    engine.add_law("curves:pull", name="spring")
    law = listen(engine, when.Crosses("body.position.dot(body.position) - 1.0"))
    sprung(engine, law, position=(1, 0, 0), velocity=(0, 2, 0))
    engine.run(until=100.0)
    assert law.times == []
    assert engine._world.wakeups.tracker.predictions < 500
