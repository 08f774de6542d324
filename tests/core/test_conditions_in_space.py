"""Regions, observers, probes, crossings and rest: at exact instants of flights, found once, and free for who does not ask."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import InvalidValueError, LawFailedError, OwnershipError, RecordError, SceneError

when = xp.when
BALL = xp.Region(xp.Sphere(1.0), position=(5, 0, 0))


class Log(xp.PhysicalLaw):
    """Write down each event."""

    def __init__(self, act: Callable[[Any], None] | None = None, **given: Any) -> None:
        super().__init__(**given)
        self.act = act
        self.events: list[Any] = []

    def enforce_this_law(self, event: Any) -> None:
        self.events.append(event)
        if self.act is not None:
            self.act(event)

    @property
    def times(self) -> list[float]:
        """When it was told."""
        return [event.time for event in self.events]


def listen(engine: xp.PhysicsEngine, condition: Any, act: Callable[[Any], None] | None = None) -> Log:
    """Return a law that waits for ``condition`` in a container of its own."""
    law = Log(act)
    engine.add_law(law, container=xp.LawContainer(condition))
    return law


def thrown(engine: xp.PhysicsEngine, *laws: Any, g: float = 10.0, **given: Any) -> xp.PhysicalObject:
    """Return a point under a constant force."""
    body = engine.add_object(xp.PhysicalObject(**given), laws=laws)
    if g:
        body.add_force((0, 0, -g))
    return body


# Regions and probes


@pytest.mark.parametrize("region", [BALL, xp.Region(xp.Box((2, 4, 4)), position=(5, 0, 0))], ids=["ball", "box"])
def test_a_body_enters_and_leaves_at_exact_instants(region: xp.Region) -> None:
    engine = xp.PhysicsEngine()
    entered, left = listen(engine, when.ProbeEnter(region)), listen(engine, when.ProbeExit(region))
    body = thrown(engine, entered, left, g=0, velocity=(0.5, 0, 0))
    engine.run(until=20.0)
    assert entered.times == [8.0] and left.times == [12.0]
    assert entered.events[0].objects == (body,)


def test_a_half_space_is_left_and_entered_by_a_throw() -> None:
    engine = xp.PhysicsEngine()
    ground = xp.Region(xp.Plane(normal=(0, 0, 1)), position=(0, 0, 1.0))
    law = listen(engine, when.ProbeEnter(ground) | when.ProbeExit(ground))
    thrown(engine, law, velocity=(0, 0, 10.0))
    engine.run(until=5.0)
    root = math.sqrt(80.0)
    assert law.times == pytest.approx([(10 - root) / 10, (10 + root) / 10], abs=1e-15)


@settings(max_examples=60, deadline=None)
@given(*(st.tuples(*(st.floats(-3, 3) for _ in range(3))) for _ in range(3)), st.floats(0, 2), st.booleans())
def test_inside_is_what_the_distance_says(x: Any, v: Any, a: Any, radius: float, box: bool) -> None:
    """Between the instants found the state is that of a dense sample of the distance."""
    from xpheve.plan.wakeups.inside import inside

    shape: Any = xp.Box((1.0, 2.0, 1.5)) if box else xp.Sphere(0.8)
    region = xp.Region(shape, position=(0.3, -0.2, 0.1), orientation=(0.8, 0.2, -0.4, 0.4))
    states = inside(region, radius, x, v, a, 4.0)
    axes = np.array(region.axes)
    for s in np.linspace(0.0, 4.0, 400).tolist():
        place = axes @ (np.array(x) + s * (np.array(v) + 0.5 * s * np.array(a)) - np.array(region.position))
        over = np.maximum(np.abs(place) - 0.5 * np.array(shape.size), 0.0) if box else place
        gap = float(np.linalg.norm(over)) - radius - (0.0 if box else shape.radius)
        near = min((abs(s - start) for start, _ in states[1:]), default=1.0) < 1e-6
        if abs(gap) > 1e-7 and not near:
            assert [state for start, state in states if start <= s][-1] == (gap < 0)


def test_steps_find_regions_too() -> None:
    """A spring is stepped: each step has flights of its own, and the crossing is on one of them."""
    engine = xp.PhysicsEngine()
    spring = engine.add_law("basic:spring_to_point", stiffness=1.0)
    half = xp.Region(xp.Plane(normal=(1, 0, 0)))
    law = listen(engine, when.ProbeEnter(half) | when.ProbeExit(half))
    engine.add_object(xp.PhysicalObject(position=(1, 0, 0)), laws=[spring, law])
    engine.run(until=10.0, dt=0.001)
    assert law.times == pytest.approx([math.pi / 2, 3 * math.pi / 2, 5 * math.pi / 2], abs=1e-5)


def test_a_probe_that_the_host_moves_and_one_that_rides() -> None:
    engine = xp.PhysicsEngine()
    body = thrown(engine, g=0, velocity=(1, 0, 0))
    hand = engine.add_probe(xp.Probe("hand"))
    rider = engine.add_probe(xp.Probe("rider", attached=body))
    law = listen(engine, when.ProbeEnter(BALL))
    only = listen(engine, when.ProbeEnter(BALL, hand))
    engine.run(until=2.5)
    hand.position = (5, 0.5, 0)
    engine.run(until=8.0)
    assert [(event.time, event.source) for event in law.events] == [(2.5, hand), (4.0, rider)]
    assert only.times == [2.5] and law.events[1].objects == (body,)
    engine.remove_object(body)
    engine.run(until=9.0)
    assert rider.position == (8, 0, 0) and rider.attached is None


# Observers


def test_levels_follow_the_volume_and_events_the_centre() -> None:
    engine = xp.PhysicsEngine()
    body = thrown(engine, g=0, velocity=(1, 0, 0))
    engine.add_observer(xp.Observer("eye", attached=body, radius=2.0))
    names = ("RegionActive", "RegionInactive", "ObserverEnter", "ObserverExit")
    laws = [listen(engine, getattr(when, name)(BALL)) for name in names]
    engine.run(until=10.0)
    assert [law.times for law in laws] == [[2.0], [0.0, 8.0], [4.0], [6.0]]


def test_one_observer_takes_over_from_another_without_a_gap() -> None:
    engine = xp.PhysicsEngine()
    one = engine.add_observer(xp.Observer("one", position=(5, 0, 0)))
    two = engine.add_observer(xp.Observer("two", position=(9, 0, 0)))
    law = listen(engine, when.RegionInactive(BALL))
    engine.run(until=1.0)
    one.position, two.position = (9, 0, 0), (5, 0, 0)
    engine.run(until=2.0)
    assert law.times == []
    engine.remove_observer(two)
    engine.run(until=3.0)
    assert law.times == [2.0]


def test_a_failed_handler_takes_the_move_of_an_observer_back() -> None:
    engine = xp.PhysicsEngine()
    eye = engine.add_observer(xp.Observer("eye", position=(1, 2, 3)))

    def act(event: Any) -> None:
        eye.position = (5, 0, 0)
        raise ZeroDivisionError("now")

    law = listen(engine, when.Elapsed(1.0), act)
    active = listen(engine, when.RegionActive(BALL))
    with pytest.raises(LawFailedError):
        engine.run(until=2.0)
    assert eye.position == (1, 2, 3) and active.times == []
    law.act = None
    engine.run(until=2.0)
    assert active.times == []


# Crossings


def height(body: Any) -> Any:
    """Return the height less 1."""
    return body.position.z - 1.0


def test_a_height_is_crossed_to_1e_12() -> None:
    engine = xp.PhysicsEngine()
    both, up, down = (listen(engine, when.Crosses(height, direction)) for direction in (0, 1, -1))
    thrown(engine, both, up, down, g=9.81, velocity=(0, 0, 7.0))
    engine.run(until=5.0)
    root = math.sqrt(49 - 2 * 9.81)
    exact = [(7 - root) / 9.81, (7 + root) / 9.81]
    assert both.times == pytest.approx(exact, abs=1e-12)
    assert up.times == [both.times[0]] and down.times == [both.times[1]]
    assert [event.data for event in both.events] == [1, -1]


def test_two_crossings_close_together_and_a_touch() -> None:
    engine = xp.PhysicsEngine()
    top = 10.0**2 / 20.0  # of a throw at 10 m/s under 10 m/s^2, at t = 1
    dip = 1e-10
    close = listen(engine, when.Crosses(lambda body: body.position.z - (top - dip)))
    touch = listen(engine, when.Crosses(lambda body: body.position.z - top))
    thrown(engine, close, touch, velocity=(0, 0, 10.0))
    engine.run(until=3.0)
    half = math.sqrt(2 * dip / 10.0)
    assert close.times == pytest.approx([1 - half, 1 + half], abs=1e-9)
    assert touch.times == []


def test_an_expression_of_time_orientation_and_a_column() -> None:
    engine = xp.PhysicsEngine()

    def facing(body: Any) -> Any:
        q = body.orientation
        return q[:, 0:1] ** 2 + q[:, 1:2] ** 2 - q[:, 2:3] ** 2 - q[:, 3:4] ** 2

    law = listen(engine, when.Crosses(facing))
    spun = xp.PhysicalObject(xp.Sphere(1.0), angular_velocity=(0, 0, 2.0))
    engine.add_object(spun, laws=[law])
    clock = listen(engine, when.Crosses(lambda body: np.sin(body.time) * body.mass))
    engine.map(spun, clock)
    engine.run(until=20.0)
    assert law.times == pytest.approx([math.pi / 4 + k * math.pi / 2 for k in range(13)][: len(law.times)], abs=1e-12)
    assert len(law.times) == 13 and clock.times == pytest.approx([k * math.pi for k in range(1, 7)], abs=1e-12)


def test_a_jump_over_zero_is_a_crossing() -> None:
    engine = xp.PhysicsEngine()
    law = listen(engine, when.Crosses(lambda body: body.velocity.x))
    body = thrown(engine, law, g=0, velocity=(1, 0, 0))
    engine.run(until=1.5)
    body.velocity = (-1, 0, 0)
    engine.run(until=3.0)
    assert law.times == [1.5]


@pytest.mark.parametrize("copied", [False, True])
def test_where_runs_end_does_not_move_a_crossing_by_a_bit(copied: bool) -> None:
    def told(stops: list[float]) -> list[float]:
        engine = xp.PhysicsEngine()
        first = listen(engine, when.Crosses(lambda body: np.sin(3.0 * body.position.x) - 0.3 * body.position.z))
        second = listen(engine, when.ProbeEnter(BALL) | when.ProbeExit(BALL))
        thrown(engine, first, second, g=0.1, velocity=(1.0, 0, 0.3))
        found: list[float] = []
        for stop in stops:
            if copied:
                engine = engine.copy()
            engine.run(until=stop)
            if copied:
                found += [time for law in engine.laws for time in law.times]
        return sorted(found) if copied else sorted([*first.times, *second.times])

    whole = told([12.0])
    assert len(whole) > 8 and told([0.1 * k for k in range(1, 120)] + [12.0]) == whole


def test_an_expression_that_fails_names_itself_and_leaves_the_engine_before() -> None:
    engine = xp.PhysicsEngine()
    law = listen(engine, when.Crosses(lambda body: body.nothing))
    thrown(engine, law)
    with pytest.raises(LawFailedError, match=r"lambda.*nothing"):
        engine.run(until=1.0)
    assert engine.time == 0.0
    other = xp.PhysicsEngine()
    thrown(other, listen(other, when.Crosses(lambda body: body.position.x / 0.0)))
    with pytest.raises(LawFailedError, match="gave nan"):
        other.run(until=1.0)


def test_a_function_goes_into_checkpoints_by_name_and_into_no_scene_file(tmp_path: Any) -> None:
    engine = xp.PhysicsEngine()
    thrown(engine, listen(engine, when.Crosses(height)), velocity=(0, 0, 7.0))
    engine.run(until=0.5)
    with pytest.raises(RecordError, match=r"functions=\[height\]"):
        xp.PhysicsEngine.restore(engine.checkpoint(), laws=[Log])
    other = xp.PhysicsEngine.restore(engine.checkpoint(), laws=[Log], functions=[height])
    engine.run(until=3.0)
    other.run(until=3.0)
    assert other.laws[0].times == engine.laws[0].times[-1:] and engine.checkpoint() == other.checkpoint()
    with pytest.raises(SceneError):
        engine.save_scene(tmp_path / "scene.toml")


# Rest


def test_asleep_and_awake_at_the_end_of_the_instant() -> None:
    engine = xp.PhysicsEngine()
    asleep, awake = listen(engine, when.Asleep()), listen(engine, when.Awake())
    body = thrown(engine, asleep, awake, g=0)
    level = listen(engine, when.Asleep(body))
    engine.run(until=1.0)
    body.velocity = (1, 0, 0)
    engine.run(until=2.0)
    body.velocity = (0, 0, 0)
    engine.run(until=3.0)
    body.add_force((1, 0, 0), duration=0.5)
    body.velocity = (-0.5, 0, 0)
    engine.run(until=5.0)
    assert asleep.times == [2.0, 3.5] and awake.times == [1.0, 3.0] and level.times == [0.0, 2.0, 3.5]


def test_a_turning_body_is_awake() -> None:
    engine = xp.PhysicsEngine()
    law = listen(engine, when.Awake())
    body = engine.add_object(xp.PhysicalObject(xp.Sphere(1.0)), laws=[law])
    engine.run(until=1.0)
    body.angular_velocity = (0, 1, 0)
    engine.run(until=2.0)
    assert law.times == [1.0]


# One server each, none unarmed


def test_what_nobody_is_armed_with_costs_nothing() -> None:
    engine = xp.PhysicsEngine()
    engine.add_observer(xp.Observer("eye", radius=1.0))
    law = listen(engine, when.Posted())
    body = thrown(engine, law, velocity=(1, 0, 0))
    engine.run(until=1.0)
    body.position = (0, 0, 0)
    engine.run(until=2.0)
    assert engine._world.wakeups.tracker.predictions == 0 and engine._world.wakeups.trees == {}
    assert [one["detections"] for one in engine.explain().data["servers"]] == [0]


@pytest.mark.parametrize(
    "make",
    [lambda: when.ProbeEnter(BALL), lambda: when.Crosses(height), lambda: when.Elapsed(1.0), lambda: when.Input("key")],
    ids=["region", "crossing", "timer", "input"],
)
def test_a_hundred_containers_with_an_equal_condition_have_one_server(make: Callable[[], Any]) -> None:
    def looks(count: int) -> tuple[Any, int, int]:
        engine = xp.PhysicsEngine()
        laws = [listen(engine, make()) for _ in range(count)]
        thrown(engine, *laws, g=0, velocity=(1, 0, 0.5))
        engine.input("key", 1)
        engine.run(until=2.5)
        engine.run(until=6.5)
        [server] = engine.explain().data["servers"]
        assert server["containers"] == count and sum(len(law.events) for law in laws) == count * len(laws[0].events)
        return server["detections"], engine._world.wakeups.tracker.predictions, len(engine._world.queue)

    assert looks(100) == looks(1)
    assert looks(1)[0] == 1 or make() == when.ProbeEnter(BALL)


# Hostile input


@pytest.mark.parametrize(
    "make",
    [
        lambda: xp.Region(xp.Sphere(1.0), position=(math.nan, 0, 0)),
        lambda: xp.Region(xp.Sphere(1.0), orientation=(0, 0, 0, 0)),
        lambda: xp.Region(xp.Capsule(1.0, 1.0)),
        lambda: xp.Region(xp.Plane()),
        lambda: xp.Region("ball"),
        lambda: xp.Sphere(math.nan),
        lambda: when.ProbeEnter(xp.Sphere(1.0)),
        lambda: when.RegionActive(None),
        lambda: when.ProbeEnter(BALL, "hand"),
        lambda: when.Crosses(3),
        lambda: when.Crosses(height, 2),
        lambda: when.Crosses(height, obj="ball"),
        lambda: when.PoseChanged(tol=math.nan),
        lambda: when.PoseChanged("ball"),
        lambda: when.ContactBegin("ball"),
        lambda: when.Elapsed(1.0, clock="wall"),
        lambda: when.Input(""),
        lambda: when.Input("key", [1]),
        lambda: when.Asleep(3),
        lambda: when.Changed(3),
        lambda: when.ObjectAdded(3),
        lambda: xp.Observer(""),
        lambda: xp.Observer("eye", radius=math.inf),
        lambda: xp.Probe("p", position=(1, 2)),
        lambda: xp.Probe("p", position=(1, 2, math.nan)),
        lambda: xp.Probe("p", attached="ball"),
        lambda: setattr(BALL, "position", (0, 0, 0)),
    ],
)
def test_what_cannot_be_is_refused(make: Callable[[], Any]) -> None:
    with pytest.raises(InvalidValueError):
        make()


def test_what_belongs_elsewhere_is_refused() -> None:
    here, there = xp.PhysicsEngine(), xp.PhysicsEngine()
    body, eye = there.add_object(xp.PhysicalObject()), there.add_observer(xp.Observer("eye"))
    probe = there.add_probe(xp.Probe("hand"))
    for condition in (
        when.Asleep(body),
        when.ContactBegin(b=body),
        when.ProbeEnter(BALL, probe),
        ~when.Asleep(body) | when.Posted(),
    ):
        with pytest.raises(OwnershipError):
            listen(here, condition)
    for act in (
        lambda: here.add_observer(eye),
        lambda: here.remove_observer(eye),
        lambda: here.add_probe(xp.Probe("p", attached=body)),
    ):
        with pytest.raises(OwnershipError):
            act()
    with pytest.raises(InvalidValueError):
        there.add_observer(xp.Observer("eye"))
    with pytest.raises(InvalidValueError):
        there.add_observer(xp.Probe("p"))  # type: ignore[arg-type]
    assert here.containers == () and here.observers == ()


@pytest.mark.parametrize("kind", ["observer", "probe"])
def test_a_point_that_was_taken_out_is_asked_no_further_and_may_come_back(kind: str) -> None:
    engine = xp.PhysicsEngine()
    room = xp.Region(xp.Sphere(1.0))
    entered, left = (when.ProbeEnter, when.ProbeExit) if kind == "probe" else (when.ObserverEnter, when.ObserverExit)
    law = listen(engine, entered(room) | left(room))
    point = xp.Probe("tip", position=(5, 0, 0)) if kind == "probe" else xp.Observer("eye", position=(5, 0, 0))
    put, take = getattr(engine, f"add_{kind}"), getattr(engine, f"remove_{kind}")
    assert put(point) is point and point.engine is engine
    engine.run(until=0.5)
    point.position = (0, 0, 0)
    engine.run(until=1.0)
    take(point)
    assert point.engine is None
    with pytest.raises(xp.errors.OwnershipError, match=point.name):
        take(point)
    told = len(law.events)
    point.position = (5, 0, 0)
    engine.run(until=2.0)
    assert told == len(law.events) and isinstance(law.events[0].fired[0][0], entered)
    put(point)
    engine.run(until=2.5)
    point.position = (0.5, 0, 0)
    engine.run(until=3.0)
    assert isinstance(law.events[-1].fired[0][0], entered) and law.events[-1].time == 2.5
