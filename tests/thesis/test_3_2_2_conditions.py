"""Nourian (2004), 3.2.2.1: the fourteen wakeup criteria, their combinations, and activation; and what is better here than in Java3D."""

from __future__ import annotations

from typing import Any

import pytest

import xpheve as xp

when = xp.when
ROOM = xp.Region(xp.Box((2.0, 2.0, 2.0)), position=(5.0, 0, 0))


class Log(xp.PhysicalLaw):
    """Write down each event."""

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        self.events: list[Any] = []

    def enforce_this_law(self, event: Any) -> None:
        self.events.append(event)

    @property
    def times(self) -> list[float]:
        """When it was told."""
        return [event.time for event in self.events]


@pytest.fixture
def engine() -> xp.PhysicsEngine:
    """Return an empty engine."""
    return xp.PhysicsEngine(up="z")


def listen(engine: xp.PhysicsEngine, condition: Any) -> Log:
    """Return a law that waits for ``condition``."""
    law = Log()
    engine.add_law(law, container=xp.LawContainer(condition))
    return law


def walker(engine: xp.PhysicsEngine, *laws: Any, **given: Any) -> xp.PhysicalObject:
    """Return a point that moves at (1, 0, 0)."""
    return engine.add_object(xp.PhysicalObject(**{"velocity": (1, 0, 0)} | given), laws=laws)


@pytest.mark.thesis("conditions", "every-n-frames", "every-n-frames/decide")
def test_wakeup_on_elapsed_frames(engine: xp.PhysicsEngine) -> None:
    every, third, passive = (listen(engine, when.Steps(n, passive=p)) for n, p in ((0, False), (2, False), (0, True)))
    engine.run(until=0.6, dt=0.1)
    assert [len(law.events) for law in (every, third, passive)] == [6, 2, 6]


@pytest.mark.thesis("conditions", "every-n-frames/decide")
def test_a_passive_wait_for_frames_asks_for_none(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.Steps(passive=True))
    engine.run(until=1.0)
    assert law.events == []


@pytest.mark.thesis("conditions")
def test_wakeup_on_elapsed_time_is_exact(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.Elapsed(0.25, every=True))
    engine.run(until=1.0)
    assert law.times == [0.25, 0.5, 0.75, 1.0]


@pytest.mark.thesis("conditions")
def test_wakeup_on_behavior_post_delivers_every_post(engine: xp.PhysicsEngine) -> None:
    """In Java3D only the last id of a pass can be read."""
    law = listen(engine, when.Posted())
    for k in range(3):
        engine.post(k)
    engine.run(until=1.0)
    assert [event.id for event in law.events] == [0, 1, 2]


def touching(engine: xp.PhysicsEngine, *laws: Any) -> list[xp.PhysicalObject]:
    """Return three spheres that touch one another in a row, a fourth apart; nothing answers their contacts."""
    return [
        engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(x, 0, 0), name=name), laws=laws)
        for x, name in ((0, "a"), (1, "b"), (2, "c"), (9, "d"))
    ]


@pytest.mark.thesis("conditions", "entry-while-touching", "entry-while-touching/decide")
def test_wakeup_on_collision_entry_fires_once_if_armed_while_touching_and_names_all_pairs(
    engine: xp.PhysicsEngine,
) -> None:
    """In Java3D one pair is named."""
    law = listen(engine, when.ContactBegin())
    touching(engine, law)
    engine.run(until=1.0)
    pairs = [{one.body_a.name, one.body_b.name} for event in law.events for one in event.contacts]
    assert pairs == [{"a", "b"}, {"b", "c"}] and set(law.times) == {0.0}


@pytest.mark.thesis("conditions")
def test_contacts_may_be_those_of_one_object_or_of_two(engine: xp.PhysicsEngine) -> None:
    holder = xp.PhysicsEngine(up="z")
    every = Log()
    holder.add_law(every, container=xp.LawContainer(when.ContactBegin()))
    a, b, c, d = touching(holder, every)
    laws = [listen(holder, when.ContactBegin(*pair)) for pair in ((a,), (c, b), (a, c), (None, b))]
    for obj in (a, b, c, d):
        for law in laws:
            holder.map(obj, law)
    holder.run(until=1.0)
    assert [sum(len(event.contacts) for event in law.events) for law in laws] == [1, 1, 0, 2]


@pytest.mark.thesis("conditions")
def test_wakeup_on_collision_movement(engine: xp.PhysicsEngine) -> None:
    stay, moving = listen(engine, when.ContactStay()), listen(engine, when.ContactStay(moving=True))
    a, *_ = touching(engine, stay, moving)
    engine.run(until=0.5, dt=0.25)
    assert len(stay.events) == 2 and moving.events == []
    a.angular_velocity = (1, 0, 0)
    engine.run(until=1.0, dt=0.25)
    assert len(moving.events) == 2 and {one.body_a for one in moving.events[0].contacts} == {a}


@pytest.mark.thesis("conditions")
def test_wakeup_on_collision_exit_for_a_pair_and_for_none_left(engine: xp.PhysicsEngine) -> None:
    end = listen(engine, when.ContactEnd())
    law = Log()
    a, b, c, d = touching(engine, end)
    engine.add_law(law, container=xp.LawContainer(when.ContactClear(b)))
    for obj in (a, b, c, d):
        engine.map(obj, law)
    engine.run(until=1.0)
    a.velocity = (-1, 0, 0)
    engine.run(until=2.0)
    c.velocity = (1, 0, 0)
    engine.run(until=3.0)
    assert [{one.body_a.name, one.body_b.name} for event in end.events for one in event.contacts] == [
        {"a", "b"},
        {"b", "c"},
    ]
    assert law.times == [end.times[1]]


@pytest.mark.thesis("conditions", "transform-changed", "transform-changed/decide")
def test_wakeup_on_transform_change_is_for_what_was_set(engine: xp.PhysicsEngine) -> None:
    law, far = listen(engine, when.PoseChanged()), listen(engine, when.PoseChanged(tol=0.5))
    body = walker(engine, law, far)
    engine.run(until=1.0)
    body.position = (1.1, 0, 0)
    engine.run(until=2.0)
    body.orientation = (0, 1, 0, 0)
    engine.run(until=3.0)
    body.velocity = (0, 0, 0)
    engine.run(until=4.0)
    assert [(event.time, event.id) for event in law.events] == [(1.0, "position"), (2.0, "orientation")]
    assert far.times == [2.0]


@pytest.mark.thesis("conditions", "live-changes")
def test_the_mass_is_monitored(engine: xp.PhysicsEngine) -> None:
    """4.2.2: 'not implemented in this version'."""
    body, other = walker(engine), walker(engine)
    law = listen(engine, when.Changed("mass", body))
    other.mass = body.mass = 2.0
    engine.run(until=1.0)
    assert [event.objects for event in law.events] == [(body,)]


@pytest.mark.thesis("conditions", "activation")
def test_wakeup_on_activation_and_deactivation(engine: xp.PhysicsEngine) -> None:
    active, inactive = listen(engine, when.RegionActive(ROOM)), listen(engine, when.RegionInactive(ROOM))
    engine.add_observer(xp.Observer("eye", attached=walker(engine), radius=1.0))
    engine.run(until=10.0)
    assert active.times == [3.0] and inactive.times == [0.0, 7.0]


@pytest.mark.thesis("activation")
def test_a_law_sleeps_while_no_observers_volume_meets_its_region(engine: xp.PhysicsEngine) -> None:
    """A behavior of Java3D runs only while it is active."""
    law = listen(engine, when.AllNow(when.Elapsed(0.5, every=True), when.RegionActive(ROOM)))
    eye = engine.add_observer(xp.Observer("eye", position=(50, 0, 0), radius=1.0))
    engine.run(until=2.25)
    assert law.evaluations == 0
    eye.position = (5, 0, 0)
    engine.run(until=3.0)
    assert law.times == [2.5, 3.0] and law.evaluations == 2
    eye.position = (50, 0, 0)
    engine.run(until=9.0)
    assert law.evaluations == 2


@pytest.mark.thesis("conditions")
def test_wakeup_on_view_platform_entry_and_exit(engine: xp.PhysicsEngine) -> None:
    entry, leaving = listen(engine, when.ObserverEnter(ROOM)), listen(engine, when.ObserverExit(ROOM))
    eye = engine.add_observer(xp.Observer("eye", attached=walker(engine), radius=1.0))
    engine.run(until=10.0)
    assert entry.times == [4.0] and leaving.times == [6.0] and entry.events[0].source is eye


@pytest.mark.thesis("conditions")
def test_wakeup_on_sensor_entry_and_exit(engine: xp.PhysicsEngine) -> None:
    entry, leaving = listen(engine, when.ProbeEnter(ROOM)), listen(engine, when.ProbeExit(ROOM))
    body = walker(engine, entry, leaving)
    hand = engine.add_probe(xp.Probe("hand"))
    engine.run(until=1.0)
    hand.position = (5, 0, 0)
    engine.run(until=10.0)
    assert entry.times == [1.0, 4.0] and leaving.times == [6.0]
    assert entry.events[0].source is hand and entry.events[1].objects == (body,)


@pytest.mark.thesis("conditions")
def test_wakeup_on_awt_event_hands_over_all_events_of_the_instant(engine: xp.PhysicsEngine) -> None:
    keys, enter = listen(engine, when.Input("key")), listen(engine, when.Input("key", {"name": "enter"}))
    engine.input("key", {"name": "a", "down": True})
    engine.input("mouse", (1, 2))
    engine.input("key", {"name": "enter", "down": True})
    other = xp.PhysicsEngine.restore(engine.checkpoint(), laws=[Log])
    for one in (engine, other):
        one.run(until=1.0)
        found = [[data["name"] for event in law.events for data in event.data] for law in one.laws]
        assert found == [["a", "enter"], ["enter"]] and len(one.laws[0].events) == 1
    assert keys.times == enter.times == [0.0]


@pytest.mark.thesis("conditions")
def test_paused_and_resumed_are_told_at_once(engine: xp.PhysicsEngine) -> None:
    paused, resumed = listen(engine, when.Paused()), listen(engine, when.Resumed())
    engine.run(until=1.0)
    engine.suspend()
    assert paused.times == [1.0] and resumed.times == []
    engine.resume()
    assert resumed.times == [1.0]


@pytest.mark.thesis("conditions")
def test_object_added_and_removed_under_a_named_law(engine: xp.PhysicsEngine) -> None:
    gravity = engine.add_law("basic:planet_gravity", name="gravity")
    added, removed = listen(engine, when.ObjectAdded(gravity)), listen(engine, when.ObjectRemoved("gravity"))
    body = walker(engine, gravity)
    walker(engine)
    engine.run(until=1.0)
    engine.unmap(body, gravity)
    engine.run(until=2.0)
    assert [event.objects for event in added.events] == [event.objects for event in removed.events] == [(body,)]
    assert added.times == [0.0] and removed.times == [1.0]


@pytest.mark.thesis("conditions")
def test_wakeup_and_does_not_fire_on_one_member_the_second_time(engine: xp.PhysicsEngine) -> None:
    """A WakeupAnd of Java3D that is armed again wakes on any member, because its flags stay set."""
    law = listen(engine, when.Posted("a") & when.Posted("b"))
    for k, name in enumerate("abaab"):
        engine.run(until=float(k))
        engine.post(name)
    engine.run(until=9.0)
    assert law.times == [1.0, 4.0]


@pytest.mark.thesis("conditions")
def test_wakeup_or_and_of_ors_or_of_ands(engine: xp.PhysicsEngine) -> None:
    a, b, c, d = (when.Posted(name) for name in "abcd")
    laws = [listen(engine, one) for one in (a | b, (a | b) & (c | d), (a & b) | (c & d))]
    for k, name in enumerate("acbd"):
        engine.run(until=float(k))
        engine.post(name)
    engine.run(until=9.0)
    assert [law.times for law in laws] == [[0.0, 2.0], [1.0, 3.0], [2.0]]


@pytest.mark.thesis("conditions")
def test_conditions_stay_armed_and_once_is_java3ds_way(engine: xp.PhysicsEngine) -> None:
    every, one = listen(engine, when.Posted("a")), listen(engine, when.Posted("a", once=True))
    for _ in range(3):
        engine.post("a")
    engine.run(until=1.0)
    assert len(every.events) == 3 and len(one.events) == 1


@pytest.mark.thesis("every-n-frames/decide")
def test_a_frame_is_a_host_step_whatever_the_stepper_and_without_one_it_is_refused(engine: xp.PhysicsEngine) -> None:
    """Decision 10: drag is stepped, gravity is in closed form; both see the same frames."""
    counts = []
    for law in ("basic:planet_gravity", "basic:linear_drag"):
        one = xp.PhysicsEngine(up="z")
        one.add_object(xp.PhysicalObject(velocity=(1, 0, 0)), laws=[one.add_law(law)])
        frames = listen(one, when.Steps(1))
        one.run(until=1.0, dt=0.125)
        counts.append(frames.times)
    assert counts[0] == counts[1] == [0.125, 0.375, 0.625, 0.875]
    listen(engine, when.Steps())
    with pytest.raises(xp.errors.StateError, match=r"dt=\.\.\."):
        engine.run(until=1.0)


@pytest.mark.thesis("conditions")
@pytest.mark.parametrize("added", ["before the start", "while it runs"])
@pytest.mark.parametrize(
    "condition",
    [when.Started() | when.ObjectAdded(), when.ObjectAdded(), when.Steps()],
    ids=["startup, or an object is added", "an object is added", "every frame"],
)
def test_the_table_gravity_works_under_each_condition_of_its_row(condition: Any, added: str) -> None:
    """And never is there more than one force of it."""
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", container=xp.LawContainer(condition), acceleration=10.0)
    body = xp.PhysicalObject()
    for when_added, until in (("before the start", 1.0), ("while it runs", 2.0)):
        if added == when_added:
            engine.add_object(body, laws=[gravity])
        engine.run(until=until, dt=0.25)
    assert body.velocity[2] == (-20.0 if added == "before the start" else -10.0) and len(body.forces) == 1


@pytest.mark.thesis("conditions")
def test_the_table_a_startup_container_alone_is_deaf_to_what_is_added_later(engine: xp.PhysicsEngine) -> None:
    gravity = engine.add_law("basic:planet_gravity", container=xp.LawContainer(when.Started()), acceleration=10.0)
    first = engine.add_object(xp.PhysicalObject(), laws=[gravity])
    engine.run(until=1.0)
    late = engine.add_object(xp.PhysicalObject(), laws=[gravity])
    engine.run(until=2.0)
    assert first.velocity == (0, 0, -20) and late.velocity == (0, 0, 0)
    engine.reset()
    engine.add_object(late, laws=[gravity])
    engine.run(until=1.0)
    assert late.velocity == (0, 0, -10)


@pytest.mark.thesis("conditions")
@pytest.mark.parametrize("container", ["collision:exact", "collision:bounding_box", "collision:picking"])
@pytest.mark.parametrize("added", ["before the start", "while it runs"])
def test_the_table_collision_works_with_exact_contact_bounding_boxes_and_picks(container: str, added: str) -> None:
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic", container=container)
    wall = xp.PhysicalObject(xp.Box((1, 9, 9)), position=(5, 0, 0), fixed=True)
    ball = xp.PhysicalObject(xp.Sphere(0.5), velocity=(1, 0, 0))
    if added == "before the start":
        engine.add_objects([wall, ball], laws=[bounce])
    engine.run(until=1.0, dt=1 / 64)
    if added == "while it runs":
        engine.add_objects([wall, ball], laws=[bounce])
    engine.run(until=8.0, dt=1 / 64)
    assert ball.velocity == (-1, 0, 0)
