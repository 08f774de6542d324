"""Each condition fires exactly when it should, and not otherwise; in which order, and what a handler is told."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import pytest

import xpheve as xp

when = xp.when


class Log(xp.PhysicalLaw):
    """Write down each event, and do what the test says."""

    def __init__(self, act: Callable[[Log, Any], None] | None = None, **given: Any) -> None:
        super().__init__(**given)
        self.act = act
        self.events: list[Any] = []

    def enforce_this_law(self, event: Any) -> None:
        self.events.append(event)
        if self.act is not None:
            self.act(self, event)

    @property
    def times(self) -> list[float]:
        """When it was told."""
        return [event.time for event in self.events]


def listen(
    engine: xp.PhysicsEngine, condition: Any, act: Callable[[Log, Any], None] | None = None, name: str = ""
) -> Log:
    """Return a law that waits for ``condition`` in a container of its own."""
    law = Log(act, name=name)
    engine.add_law(law, container=xp.LawContainer(condition))
    return law


@pytest.fixture
def engine() -> xp.PhysicsEngine:
    """Return an empty engine."""
    return xp.PhysicsEngine()


def moving(engine: xp.PhysicsEngine, *laws: Any, **given: Any) -> xp.PhysicalObject:
    """Return a point that moves at (1, 0, 0)."""
    given = {"velocity": (1, 0, 0)} | given
    return engine.add_object(xp.PhysicalObject(**given), laws=laws)


# Started


def test_started_once_at_the_first_run_and_again_after_reset(engine: xp.PhysicsEngine) -> None:
    law, once = listen(engine, when.Started()), listen(engine, when.Started(once=True))
    assert law.events == []
    engine.run(until=0.0)
    assert law.times == once.times == [0.0]
    engine.run(until=1.0)
    engine.suspend()
    engine.resume()
    engine.step(0.5)
    assert law.times == [0.0]
    engine.reset()
    assert law.times == [0.0]
    engine.run(until=1.0)
    assert law.times == [0.0, 0.0] and once.times == [0.0, 0.0]


def test_a_terminated_engine_starts_anew_after_reset(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.Started())
    engine.run(until=2.0)
    engine.terminate()
    engine.reset()
    engine.run(until=1.0)
    assert law.times == [0.0, 0.0]


def test_started_is_not_told_to_who_comes_later(engine: xp.PhysicsEngine) -> None:
    engine.run(until=1.0)
    law = listen(engine, when.Started())
    engine.run(until=2.0)
    assert law.events == []


def test_a_law_that_is_started_knows_its_objects(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.Started())
    one = moving(engine, law)
    moving(engine)
    engine.run(until=1.0)
    assert law.objects == (one,)
    assert law.events[0].condition == when.Started()


# Elapsed


def test_elapsed_is_exact_and_comes_once(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.Elapsed(0.3))
    body = moving(engine, law)
    engine.run(until=0.29999999999999993)
    assert law.events == []
    engine.run(until=5.0)
    assert law.times == [0.3] and law.events[0].objects == (body,)


@pytest.mark.parametrize("period", [0.1, 1 / 3, 0.7, 1e-3 * math.pi])
@pytest.mark.parametrize("start", [0.0, 1.1])
def test_every_comes_at_whole_multiples_without_drift(engine: xp.PhysicsEngine, period: float, start: float) -> None:
    engine.run(until=start)
    law = listen(engine, when.Elapsed(period, every=True))
    n = 3000
    engine.run(until=start + (n + 0.5) * period)
    exact = [float(Fraction(start) + k * Fraction(period)) for k in range(1, n + 1)]
    assert law.times == exact


def test_elapsed_is_armed_in_mid_run(engine: xp.PhysicsEngine) -> None:
    engine.run(until=2.5)
    law = listen(engine, when.Elapsed(1.0))
    engine.run(until=3.0)
    assert law.events == []
    engine.run(until=9.0)
    assert law.times == [3.5]


def test_elapsed_is_armed_by_a_handler_at_its_instant(engine: xp.PhysicsEngine) -> None:
    found: list[Log] = []
    listen(engine, when.Elapsed(1.0), lambda law, event: found.append(listen(engine, when.Elapsed(0.25))))
    engine.run(until=3.0)
    assert found[0].times == [1.25]


def test_the_end_of_a_run_is_included_and_told_once(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.Elapsed(0.5, every=True))
    for k in range(1, 9):
        engine.run(until=0.25 * k)
    assert law.times == [0.5, 1.0, 1.5, 2.0]


def test_an_event_that_reads_until_is_included(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.Elapsed(0.1, every=True))
    engine.run(until=0.5)
    assert law.times[-1] == 0.5
    engine.run(until=1.0)
    assert len(law.times) == 10 and law.times[-1] == 1.0


def test_pauses_do_not_count(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.Elapsed(1.0, every=True))
    engine.run(until=0.5)
    engine.suspend()
    engine.resume()
    engine.run(until=2.0)
    assert law.times == [1.0, 2.0]


# once, several containers, disabled laws


@pytest.mark.parametrize(
    "condition",
    [
        when.Elapsed(0.5, every=True, once=True),
        when.Posted("go", once=True),
        when.Steps(once=True),
        when.Changed(once=True),
    ],
    ids=str,
)
def test_once_disarms_after_the_first(engine: xp.PhysicsEngine, condition: Any) -> None:
    law = listen(engine, condition)
    body = moving(engine, law)
    engine.run(until=0.1, dt=0.1)
    for k in range(5):
        engine.post("go")
        body.velocity = (k + 2.0, 0, 0)
        engine.run(until=1.0 + k, dt=0.1)
    assert len(law.events) == 1


def test_once_at_one_instant_with_many_events_fires_once(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.Posted(once=True))
    for _ in range(5):
        engine.post("go")
    engine.run(until=1.0)
    assert len(law.events) == 1


def test_once_holds_for_all_contacts_of_one_instant(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.ContactBegin(once=True))
    engine.add_law("collision:elastic", name="bounce")
    for y in (0, 10):
        for x, v in ((0, 1), (3, -1)):
            engine.add_object(
                xp.PhysicalObject(xp.Sphere(0.5), position=(x, y, 0), velocity=(v, 0, 0)), laws=[law, "bounce"]
            )
    engine.run(until=5.0)
    assert len(law.events) == 1 and len(law.events[0].contacts) == 2


def test_many_containers_may_share_one_condition(engine: xp.PhysicsEngine) -> None:
    condition = when.Elapsed(0.5, every=True)
    laws = [listen(engine, condition) for _ in range(5)]
    engine.run(until=2.0)
    assert [law.times for law in laws] == [[0.5, 1.0, 1.5, 2.0]] * 5


def test_laws_with_the_same_default_condition_share_a_container(engine: xp.PhysicsEngine) -> None:
    kind = type("Own", (Log,), {"condition": when.Elapsed(1.0)})
    engine.add_law(kind())
    engine.add_law(kind())
    assert len(engine.containers) == 1 and len(engine.containers[0].laws) == 2


def test_a_disabled_law_hears_nothing_and_the_others_do(engine: xp.PhysicsEngine) -> None:
    holder = xp.LawContainer(when.Elapsed(1.0, every=True))
    one, two = Log(name="one"), Log(name="two")
    engine.add_law(one, container=holder)
    engine.add_law(two, container=holder)
    one.enabled = False
    engine.run(until=2.0)
    one.enabled = True
    engine.run(until=4.0)
    assert one.times == [3.0, 4.0] and two.times == [1.0, 2.0, 3.0, 4.0]


def test_a_handler_that_disables_a_later_law_of_its_event(engine: xp.PhysicsEngine) -> None:
    holder = xp.LawContainer(when.Elapsed(1.0))
    later = Log(name="later")
    first = type("First", (Log,), {"priority": 1})(lambda law, event: setattr(later, "enabled", False))
    engine.add_law(later, container=holder)
    engine.add_law(first, container=holder)
    engine.run(until=2.0)
    assert len(first.events) == 1 and later.events == [] and not later.enabled


def test_a_law_in_two_containers_answers_both(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.Elapsed(1.0))
    engine.add_container(xp.LawContainer(when.Posted("go"))).add_law(law)
    engine.post("go")
    engine.run(until=2.0)
    assert law.times == [0.0, 1.0]


def test_removed_laws_and_containers_hear_nothing(engine: xp.PhysicsEngine) -> None:
    laws = [listen(engine, when.Elapsed(1.0, every=True)) for _ in range(3)]
    engine.run(until=1.0)
    engine.remove_law(laws[0])
    engine.remove_container(laws[1].containers[0])
    engine.run(until=3.0)
    assert [len(law.events) for law in laws] == [1, 1, 3]
    assert laws[1].engine is engine and laws[1].containers == []


def test_a_handler_may_remove_its_own_law(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.Elapsed(1.0, every=True), lambda law, event: engine.remove_law(law))
    engine.run(until=5.0)
    assert law.times == [1.0] and engine.laws == ()


# Order


def ordered(*laws: tuple[str, dict[str, Any], str]) -> list[str]:
    """Return in which order laws of (class, contents, name) are enforced, added as given."""
    told: list[str] = []
    engine = xp.PhysicsEngine()
    holder = xp.LawContainer(when.Elapsed(1.0))
    for label, contents, name in laws:
        kind = type(label, (Log,), contents)
        engine.add_law(kind(lambda law, event: told.append(law.name or law.label()), name=name), container=holder)
    engine.run(until=1.0)
    return told


def test_laws_of_one_container_go_by_before_and_after_then_priority_then_id_then_rank() -> None:
    laws = [
        ("A", {"after": ("C",)}, ""),
        ("B", {"priority": -1}, ""),
        ("C", {}, ""),
        ("D", {"priority": 5}, ""),
        ("E", {"before": ("D",)}, ""),
    ]
    expected = ["C", "E", "B", "D", "A"]
    found = ordered(*laws)
    assert found == ordered(*reversed(laws))
    assert found.index("C") < found.index("A") and found.index("E") < found.index("D")
    assert sorted(found) == sorted(expected)


def test_priority_then_id_then_name() -> None:
    laws = [("X", {}, "two"), ("X", {}, "one"), ("B", {}, ""), ("A", {"priority": -1}, ""), ("Z", {"priority": 1}, "")]
    expected = ["Z", "B", "one", "two", "A"]
    assert ordered(*laws) == expected
    assert ordered(*reversed(laws)) == expected


def test_a_law_without_an_order_goes_by_priority_among_all(engine: xp.PhysicsEngine) -> None:
    """`before` and `after` order those they name; they do not outrank priority for the rest."""
    laws = [("High", {"priority": 9, "after": ("Low",)}, ""), ("Low", {"priority": -9}, ""), ("Mid", {}, "")]
    found = ordered(*laws)
    assert found.index("Low") < found.index("High")
    assert found == ordered(*reversed(laws))


def test_before_and_after_name_laws_that_need_not_be_there() -> None:
    assert ordered(("A", {"after": ("no:such",), "before": ("none:either",)}, ""), ("B", {}, "")) in (
        ["A", "B"],
        ["B", "A"],
    )


def test_containers_of_one_instant_go_by_rank_whatever_the_order_of_adding() -> None:
    def told(names: list[str]) -> list[str]:
        found: list[str] = []
        engine = xp.PhysicsEngine()
        for name in names:
            law = Log(lambda law, event: found.append(law.name), name=name)
            engine.add_law(law, container=xp.LawContainer(when.Elapsed(1.0)))
        engine.run(until=1.0)
        return found

    assert told(["a", "b", "c"]) == told(["c", "a", "b"]) == told(["b", "c", "a"])


# One instant: reading what was written, posts


def test_handlers_of_one_instant_see_what_earlier_ones_wrote(engine: xp.PhysicsEngine) -> None:
    holder = xp.LawContainer(when.Elapsed(1.0))
    seen: list[Any] = []
    first = type("First", (Log,), {"priority": 2})(lambda law, event: setattr(body, "velocity", (0, 5, 0)))
    second = type("Second", (Log,), {"priority": 1})(
        lambda law, event: (seen.append((body.position, body.velocity)), setattr(body, "mass", body.mass * 2))
    )
    third = Log(lambda law, event: seen.append((body.velocity, body.mass)))
    for law in (third, first, second):
        engine.add_law(law, container=holder)
    body = moving(engine, first)
    engine.run(until=2.0)
    assert seen == [((1, 0, 0), (0, 5, 0)), ((0, 5, 0), 2.0)]
    assert body.position == (1, 5, 0) and body.mass == 2.0


def test_posts_arrive_in_order_with_their_data_and_source(engine: xp.PhysicsEngine) -> None:
    every = listen(engine, when.Posted())
    some = listen(engine, when.Posted("b"))
    from_one = listen(engine, when.Posted(source="one"))
    for k, (name, source) in enumerate([("a", None), ("b", "one"), ("a", "two"), ("b", None), ("c", "one")]):
        engine.post(name, k, source)
    engine.run(until=1.0)
    assert [(event.id, event.data, event.source) for event in every.events] == [
        ("a", 0, None), ("b", 1, "one"), ("a", 2, "two"), ("b", 3, None), ("c", 4, "one"),
    ]  # fmt: skip
    assert [event.data for event in some.events] == [1, 3]
    assert [event.data for event in from_one.events] == [1, 4]
    assert every.times == [0.0] * 5


def test_a_post_from_a_handler_arrives_at_the_same_instant_with_the_law_as_source(engine: xp.PhysicsEngine) -> None:
    chain = listen(
        engine, when.Posted("next"), lambda law, event: engine.post("next", event.data + 1) if event.data < 5 else None
    )
    first = listen(engine, when.Elapsed(1.25), lambda law, event: engine.post("next", 0))
    engine.run(until=2.0)
    assert [event.data for event in chain.events] == [0, 1, 2, 3, 4, 5]
    assert set(chain.times) == {1.25}
    assert chain.events[0].source is first and chain.events[1].source is chain


def test_posts_of_two_handlers_keep_their_order(engine: xp.PhysicsEngine) -> None:
    heard = listen(engine, when.Posted())
    for name in "ab":
        listen(engine, when.Elapsed(1.0), lambda law, event: [engine.post(law.name, k) for k in range(3)], name=name)
    engine.run(until=2.0)
    assert [(event.id, event.data) for event in heard.events] == [(name, k) for name in "ab" for k in range(3)]


def test_a_post_is_for_those_who_listen_when_it_is_posted(engine: xp.PhysicsEngine) -> None:
    engine.post("go")
    law = listen(engine, when.Posted("go"))
    engine.run(until=1.0)
    engine.post("go")
    engine.run(until=2.0)
    assert law.times == [1.0]


def test_ids_of_other_kinds_are_told_apart(engine: xp.PhysicsEngine) -> None:
    number, text = listen(engine, when.Posted(1)), listen(engine, when.Posted("1"))
    engine.post(1)
    engine.post("1")
    engine.post(0)
    engine.post(None)
    engine.run(until=1.0)
    assert len(number.events) == len(text.events) == 1


# Forces that end


def test_force_expired_at_the_exact_instant(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.ForceExpired())
    some = listen(engine, when.ForceExpired("b"))
    body = moving(engine, velocity=(0, 0, 0))
    engine.run(until=0.1)
    forces = [body.add_force((20, 0, 0), duration, id) for duration, id in ((0.7, "a"), (0.25, "b"), (math.inf, "c"))]
    engine.run(until=3.0)
    assert law.times == [float(Fraction(0.1) + Fraction(0.25)), float(Fraction(0.1) + Fraction(0.7))]
    assert [event.id for event in law.events] == ["b", "a"]
    assert [event.id for event in some.events] == ["b"]
    assert law.events[0].objects == (body,) and law.events[0].force.vector == forces[1].vector
    assert [force.id for force in body.forces] == ["c"]


def test_a_force_taken_away_does_not_expire(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.ForceExpired())
    body = moving(engine)
    body.add_force((1, 0, 0), 1.0, "gone")
    engine.run(until=0.5)
    body.remove_force("gone")
    engine.run(until=2.0)
    assert law.events == []


def test_a_force_on_an_object_taken_away_does_not_expire(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.ForceExpired())
    body = moving(engine)
    body.add_force((1, 0, 0), 1.0)
    engine.run(until=0.5)
    engine.remove_object(body)
    engine.run(until=2.0)
    assert law.events == []


def test_forces_with_one_id_expire_each_for_itself(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.ForceExpired("x"))
    bodies = [moving(engine), moving(engine)]
    for k, body in enumerate(bodies):
        body.add_force((1, 0, 0), 1.0 + k, "x")
        body.add_force((0, 1, 0), 1.0, "x")
    engine.run(until=5.0)
    assert law.times == [1.0, 1.0, 1.0, 2.0]


def test_a_handler_sees_the_force_gone_and_may_give_another(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.ForceExpired("a"), lambda law, event: body.add_force((0, 1, 0), 1.0, id="b"))
    body = moving(engine, velocity=(0, 0, 0))
    body.add_force((1, 0, 0), 1.0, "a")
    engine.run(until=3.0)
    assert len(law.events) == 1 and body.velocity == (1, 1, 0) and body.forces == ()


# Changed


def test_changed_is_told_of_what_somebody_set(engine: xp.PhysicsEngine) -> None:
    any_, mass = listen(engine, when.Changed()), listen(engine, when.Changed("mass"))
    body, other = moving(engine, any_, mass), moving(engine)
    engine.run(until=1.0)
    assert any_.events == []
    body.mass = 2.0
    body.velocity = (0, 1, 0)
    other.mass = 7.0
    engine.run(until=2.0)
    assert [(event.id, event.time, event.objects) for event in any_.events] == [
        ("mass", 1.0, (body,)),
        ("velocity", 1.0, (body,)),
    ]
    assert [event.id for event in mass.events] == ["mass"]


def test_flight_forces_and_bounces_are_no_change(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.Changed())
    engine.add_law("collision:elastic", name="bounce")
    body = moving(engine, law, "bounce", shape=xp.Sphere(0.5))
    moving(engine, law, "bounce", shape=xp.Sphere(0.5), position=(3, 0, 0), velocity=(0, 0, 0))
    body.add_force((0, 1, 0), 0.5)
    engine.run(until=5.0, dt=0.1)
    assert law.events == []


@pytest.mark.parametrize(
    "name", ["position", "velocity", "orientation", "angular_velocity", "mass", "inertia", "charge"]
)
def test_setting_the_same_bits_is_no_change(engine: xp.PhysicsEngine, name: str) -> None:
    kind = type("Charged", (Log,), {"columns": {"charge": xp.Column(1.0)}})
    law = kind()
    engine.add_law(law, container=xp.LawContainer(when.Changed()))
    body = moving(engine, law, inertia=(1, 2, 3), angular_velocity=(0.1, 0.2, 0.3), shape=xp.Sphere(1.0))
    engine.run(until=1.5)
    before = engine.checkpoint()
    value = body[name] if name == "charge" else getattr(body, name)
    if name == "charge":
        body["charge"] = value
    else:
        setattr(body, name, value)
    engine.run(until=2.0)
    assert law.events == []
    twin = xp.PhysicsEngine.restore(before, laws=[kind])
    twin.run(until=2.0)
    assert [obj.position for obj in twin.objects] == [obj.position for obj in engine.objects]
    assert [obj.orientation for obj in twin.objects] == [obj.orientation for obj in engine.objects]


def test_changed_of_a_column(engine: xp.PhysicsEngine) -> None:
    law = type("Charged", (Log,), {"columns": {"charge": xp.Column(1.0)}})()
    engine.add_law(law, container=xp.LawContainer(when.Changed("charge")))
    body = moving(engine, law)
    engine.run(until=1.0)
    body["charge"] = 3.0
    body.mass = 9.0
    engine.run(until=2.0)
    assert [event.id for event in law.events] == ["charge"] and body["charge"] == 3.0


def test_a_change_by_a_handler_is_told_at_the_same_instant(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.Changed())
    body = moving(engine, law)
    listen(engine, when.Elapsed(1.0), lambda _, event: setattr(body, "mass", 4.0))
    engine.run(until=2.0)
    assert law.times == [1.0]


# Added and removed


def test_objects_added_and_removed_by_adding_mapping_and_their_opposites(engine: xp.PhysicsEngine) -> None:
    added, removed = listen(engine, when.ObjectAdded()), listen(engine, when.ObjectRemoved())
    one = moving(engine, added, removed)
    two = moving(engine)
    engine.run(until=1.0)
    assert [event.objects for event in added.events] == [(one,)] and added.times == [0.0]
    engine.map(two, added)
    engine.map(two, removed)
    engine.map(two, added)
    engine.run(until=2.0)
    assert [event.objects for event in added.events] == [(one,), (two,)] and added.times == [0.0, 1.0]
    assert removed.events == []
    engine.unmap(two, removed)
    engine.unmap(two, removed)
    engine.remove_object(one)
    engine.run(until=3.0)
    assert removed.times == [2.0, 2.0]
    assert {event.objects[0] for event in removed.events} == {one, two}


def test_many_added_at_once_are_one_event(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.ObjectAdded())
    objects = engine.add_objects([xp.PhysicalObject(position=(k, 0, 0)) for k in range(5)], laws=[law])
    engine.run(until=1.0)
    assert [event.objects for event in law.events] == [objects]


def test_removing_a_law_tells_its_other_containers_of_its_objects(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.ObjectRemoved())
    body = moving(engine, law)
    engine.run(until=1.0)
    engine.unmap(body, law)
    engine.run(until=2.0)
    assert law.events[0].objects == (body,)


# Host steps


def test_steps_are_told_at_the_start_and_read_in_the_middle(engine: xp.PhysicsEngine) -> None:
    law = listen(
        engine, when.Steps(), lambda law, event: seen.append((engine.time, event.time, body.position[0], event.dt))
    )
    seen: list[Any] = []
    body = moving(engine, law)
    engine.run(until=1.0, dt=0.25)
    assert seen == [(0.25 * k, 0.25 * k + 0.125, 0.25 * k + 0.125, 0.25) for k in range(4)]


@pytest.mark.parametrize("n", [0, 1, 2, 5])
def test_every_n_plus_first_step(engine: xp.PhysicsEngine, n: int) -> None:
    law = listen(engine, when.Steps(n), lambda law, event: seen.append(engine.time))
    seen: list[float] = []
    engine.run(until=3.0, dt=0.125)
    assert seen == [0.125 * k for k in range(0, 24, n + 1)]
    assert all(event.dt == 0.125 * (n + 1) for event in law.events)


def test_the_middle_of_the_step(engine: xp.PhysicsEngine) -> None:
    law = listen(
        engine, when.Steps(at="middle"), lambda law, event: seen.append((engine.time, event.time, body.position[0]))
    )
    seen: list[Any] = []
    body = moving(engine, law)
    engine.run(until=1.0, dt=0.25)
    assert seen == [(0.25 * k + 0.125,) * 3 for k in range(4)]


def test_the_grid_goes_on_over_calls_and_off_grid_looks(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.Steps(), lambda law, event: seen.append(engine.time))
    seen: list[float] = []
    for until in (0.1, 0.33, 0.34, 0.5, 0.8, 1.0):
        engine.run(until=until, dt=0.25)
    assert seen == [0.0, 0.25, 0.5, 0.75]
    engine.run(until=2.0, dt=0.25, every=0.07)
    assert seen == [0.25 * k for k in range(8)] and len(law.events) == 8


def test_another_dt_begins_another_grid(engine: xp.PhysicsEngine) -> None:
    listen(engine, when.Steps(), lambda law, event: seen.append(engine.time))
    seen: list[float] = []
    engine.run(until=0.6, dt=0.25)
    engine.run(until=1.0, dt=0.125)
    assert seen == [0.0, 0.25, 0.5, *[0.6 + 0.125 * k for k in range(4)]]


# Polled containers


class Polled(xp.LawContainer):
    """Detect what the test says."""

    answers: tuple[bool, ...] = (True,)

    def detect(self) -> Any:
        answer = self.answers[(self.detections - 1) % len(self.answers)]
        return xp.Event(self.engine.time) if answer else None


def test_a_polled_container_is_asked_each_period_and_fires_when_it_says(engine: xp.PhysicsEngine) -> None:
    kind = type("Third", (Polled,), {"period": 0.25, "answers": (False, False, True)})
    law, holder = Log(), kind()
    engine.add_law(law, container=holder)
    engine.run(until=3.0)
    assert holder.detections == 12 and holder.firings == 4
    assert law.times == [0.75, 1.5, 2.25, 3.0]


def test_a_polled_container_without_a_period_is_asked_at_host_steps(engine: xp.PhysicsEngine) -> None:
    law, holder = Log(), Polled()
    engine.add_law(law, container=holder)
    engine.run(until=1.0, dt=0.25)
    assert holder.detections == 4 and law.times == [0.0, 0.25, 0.5, 0.75]
    assert "polled" in str(engine.explain())


def test_one_detection_serves_all_laws(engine: xp.PhysicsEngine) -> None:
    laws, holder = [Log(name=name) for name in "abc"], Polled()
    for law in laws:
        engine.add_law(law, container=holder)
    engine.run(until=1.0, dt=0.01)
    assert holder.detections == 100 and [len(law.events) for law in laws] == [100] * 3


# Contacts


def pair(
    engine: xp.PhysicsEngine, *laws: Any, gap: float = 2.0, speed: float = 1.0
) -> tuple[xp.PhysicalObject, xp.PhysicalObject]:
    """Return a ball flying at another, their surfaces ``gap`` apart."""
    one = moving(engine, *laws, shape=xp.Sphere(0.5), velocity=(speed, 0, 0), name="one")
    two = moving(engine, *laws, shape=xp.Sphere(0.5), velocity=(0, 0, 0), position=(1 + gap, 0, 0), name="two")
    return one, two


def contact_log(engine: xp.PhysicsEngine, mapped: bool = True) -> tuple[dict[str, Log], list[tuple[str, float]]]:
    """Return listeners of all contact conditions, and the order in which they were told."""
    told: list[tuple[str, float]] = []
    laws = {
        kind.__name__: listen(
            engine, kind(), lambda law, event: told.append((law.name, event.time)), name=kind.__name__
        )
        for kind in (when.Impact, when.ContactBegin, when.ContactEnd)
    }
    return laws, told


def test_a_bounce_begins_is_an_impact_and_ends_in_one_instant(engine: xp.PhysicsEngine) -> None:
    logs, told = contact_log(engine)
    bounce = engine.add_law("collision:elastic")
    one, two = pair(engine, bounce, *logs.values())
    engine.run(until=9.0)
    assert told == [("Impact", 2.0), ("ContactBegin", 2.0), ("ContactEnd", 2.0)]
    contact = logs["Impact"].events[0].contacts[0]
    assert {contact.body_a, contact.body_b} == {one, two}
    sign = 1.0 if contact.body_a is one else -1.0
    assert contact.normal == (sign, 0, 0) and contact.point == (2.5, 0, 0)
    assert contact.approach_speed == 1.0 and abs(contact.separation) < 1e-12
    assert logs["ContactEnd"].events[0].contacts[0].approach_speed == -1.0
    assert logs["ContactBegin"].events[0].objects == logs["Impact"].events[0].objects


def test_listeners_are_told_after_the_response(engine: xp.PhysicsEngine) -> None:
    seen: list[Any] = []
    law = listen(engine, when.Impact(), lambda law, event: seen.append((one.velocity, two.velocity, one.position)))
    bounce = engine.add_law("collision:elastic")
    one, two = pair(engine, bounce, law)
    engine.run(until=9.0)
    assert seen == [((0, 0, 0), (1, 0, 0), (2, 0, 0))]


def test_a_listener_may_write_after_the_response(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.Impact(), lambda law, event: setattr(one, "velocity", (-3, 0, 0)))
    bounce = engine.add_law("collision:elastic")
    one, two = pair(engine, bounce, law)
    engine.run(until=3.0)
    assert one.velocity == (-3, 0, 0) and two.velocity == (1, 0, 0) and one.position == (-1, 0, 0)
    assert len(law.events) == 1


def test_pairs_without_a_response_pass_through_and_are_told(engine: xp.PhysicsEngine) -> None:
    logs, told = contact_log(engine)
    one, _ = pair(engine, *logs.values())
    engine.run(until=9.0)
    assert [name for name, _ in told] == ["Impact", "ContactBegin", "ContactEnd"]
    assert told[0][1] == told[1][1] == 2.0 and told[2][1] == pytest.approx(4.0, abs=1e-12)
    assert one.velocity == (1, 0, 0) and one.position == (9, 0, 0)


def test_only_pairs_that_are_both_mapped_are_told(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.ContactBegin())
    bounce = engine.add_law("collision:elastic")
    moving(engine, bounce, law, shape=xp.Sphere(0.5))
    moving(engine, bounce, shape=xp.Sphere(0.5), position=(3, 0, 0), velocity=(0, 0, 0))
    engine.run(until=9.0)
    assert law.events == []


def floor_scene(speed: float = 0.0, height: float = 0.0, **given: Any) -> tuple[Any, ...]:
    """Return engine, ball, floor and logs of contacts between them, z up."""
    engine = xp.PhysicsEngine(up="z")
    logs, told = contact_log(engine)
    gravity = engine.add_law("basic:planet_gravity", acceleration=10.0)
    bounce = engine.add_law("collision:elastic", **given)
    floor = engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce, *logs.values()])
    ball = engine.add_object(
        xp.PhysicalObject(xp.Sphere(0.5), position=(0, 0, 0.5 + height), velocity=(0, 0, speed)),
        laws=[gravity, bounce, *logs.values()],
    )
    return engine, ball, floor, logs, told


def test_a_ball_put_on_the_floor_begins_once_and_ends_when_pushed_off() -> None:
    engine, ball, _, _, told = floor_scene()
    engine.run(until=2.0)
    assert told == [("ContactBegin", 0.0)]
    ball.velocity = (0, 0, 5)
    engine.run(until=2.5)
    assert told == [("ContactBegin", 0.0), ("ContactEnd", 2.0)]
    engine.run(until=3.0 + 1e-9)
    assert told[2:] == [("Impact", 3.0), ("ContactBegin", 3.0), ("ContactEnd", 3.0)]


def test_a_ball_lifted_by_a_force_ends_its_contact() -> None:
    engine, ball, _, _, told = floor_scene()
    engine.run(until=1.0)
    ball.add_force((0, 0, 30))
    engine.run(until=2.0)
    assert told == [("ContactBegin", 0.0), ("ContactEnd", 1.0)]
    assert ball.position[2] == pytest.approx(0.5 + 10.0, abs=1e-12)


def test_a_ball_that_comes_to_rest_stays_in_contact() -> None:
    engine, ball, _, _, told = floor_scene(height=1.0, restitution=0.0)
    engine.run(until=3.0)
    fall = math.sqrt(0.2)
    assert [name for name, _ in told] == ["Impact", "ContactBegin"]
    assert told[0][1] == pytest.approx(fall, rel=1e-15)
    assert ball.velocity == (0, 0, 0) and ball.position[2] == pytest.approx(0.5, abs=1e-15)


def test_stay_is_told_each_step_while_touching() -> None:
    engine, ball, floor, _, _ = floor_scene()
    stay = Log(lambda law, event: seen.append(engine.time))
    seen: list[float] = []
    engine.add_law(stay, container=xp.LawContainer(when.ContactStay()))
    engine.map(ball, stay)
    engine.map(floor, stay)
    engine.run(until=1.0, dt=0.25)
    assert seen[-3:] == [0.25, 0.5, 0.75] and stay.events[-1].contacts[0].normal in ((0, 0, 1), (0, 0, -1))
    ball.velocity = (0, 0, 10)
    engine.run(until=1.5, dt=0.25)
    assert [time for time in seen if time > 1.0] == []


def test_stay_is_told_while_passing_through(engine: xp.PhysicsEngine) -> None:
    stay = Log(lambda law, event: seen.append(engine.time))
    seen: list[float] = []
    engine.add_law(stay, container=xp.LawContainer(when.ContactStay()))
    pair(engine, stay, gap=2.125)
    engine.run(until=9.0, dt=0.25)
    assert seen == [2.25, 2.5, 2.75, 3.0, 3.25, 3.5, 3.75, 4.0]


@pytest.mark.parametrize("dt", [None, 0.25], ids=["events", "steps"])
def test_armed_on_a_pair_that_touches_already(engine: xp.PhysicsEngine, dt: float | None) -> None:
    """Begin comes once, when armed; end when they come apart."""
    bounce = engine.add_law("collision:elastic")
    one, two = pair(engine, bounce, gap=0.0, speed=0.0)
    engine.run(until=1.0, dt=dt)
    begin, end = listen(engine, when.ContactBegin()), listen(engine, when.ContactEnd())
    for obj in (one, two):
        engine.map(obj, begin)
        engine.map(obj, end)
    engine.run(until=2.0, dt=dt)
    engine.run(until=3.0, dt=dt)
    assert begin.times == [1.0] and end.times == []
    one.velocity = (-1, 0, 0)
    engine.run(until=4.0, dt=dt)
    assert begin.times == [1.0] and end.times == [3.0]


def test_armed_on_a_pair_that_overlaps_already(engine: xp.PhysicsEngine) -> None:
    begin, end = listen(engine, when.ContactBegin()), listen(engine, when.ContactEnd())
    one, _ = pair(engine, gap=-0.25, speed=0.0)
    engine.run(until=1.0)
    for obj in engine.objects:
        engine.map(obj, begin)
        engine.map(obj, end)
    engine.run(until=2.0)
    assert begin.times == [1.0] and begin.events[0].contacts[0].separation == pytest.approx(-0.25, abs=1e-15)
    one.velocity = (-1, 0, 0)
    engine.run(until=4.0)
    assert begin.times == [1.0] and end.times == [pytest.approx(2.25, abs=1e-12)]


def test_contact_ends_when_one_is_taken_away_or_carried_off(engine: xp.PhysicsEngine) -> None:
    logs, told = contact_log(engine)
    one, two = pair(engine, *logs.values(), gap=-0.25, speed=0.0)
    engine.run(until=1.0)
    one.position = (-5, 0, 0)
    engine.run(until=2.0)
    assert told == [("ContactBegin", 0.0), ("ContactEnd", 1.0)]
    one.position = (0.25, 0, 0)
    engine.run(until=3.0)
    assert told[2:] == [("ContactBegin", 2.0)]
    engine.remove_object(two)
    engine.run(until=4.0)
    assert len(told) == 3


def test_touching_pairs_that_slide_by_begin_and_end_once(engine: xp.PhysicsEngine) -> None:
    """A ball rolls past another at a distance of one diameter less a little."""
    logs, told = contact_log(engine)
    moving(engine, *logs.values(), shape=xp.Sphere(0.5), position=(-3, 0.8, 0))
    moving(engine, *logs.values(), shape=xp.Sphere(0.5), velocity=(0, 0, 0))
    engine.run(until=9.0)
    assert [name for name, _ in told] == ["Impact", "ContactBegin", "ContactEnd"]
    assert told[0][1] == pytest.approx(3 - 0.6, abs=1e-12) and told[2][1] == pytest.approx(3 + 0.6, abs=1e-12)


def test_a_miss_is_no_contact(engine: xp.PhysicsEngine) -> None:
    logs, told = contact_log(engine)
    moving(engine, *logs.values(), shape=xp.Sphere(0.5), position=(-3, 1.0 + 1e-9, 0))
    moving(engine, *logs.values(), shape=xp.Sphere(0.5), velocity=(0, 0, 0))
    engine.run(until=9.0)
    assert told == []


def test_a_disabled_listener_hears_nothing_and_begins_once_enabled(engine: xp.PhysicsEngine) -> None:
    law = listen(engine, when.ContactBegin())
    law.enabled = False
    one, _ = pair(engine, law)
    engine.run(until=2.5)
    assert law.events == []
    law.enabled = True
    engine.run(until=9.0)
    assert law.times == [2.5] and one.velocity == (1, 0, 0)


# Conditions are values


def test_conditions_are_frozen_equal_and_readable() -> None:
    assert when.Elapsed(1.0) == when.Elapsed(1.0) != when.Elapsed(1.0, every=True)
    assert len({when.Posted("a"), when.Posted("a"), when.Posted("b")}) == 2
    assert str(when.Elapsed(2.0, every=True)) == "Elapsed(seconds=2.0, every=True)"
    with pytest.raises(AttributeError):
        when.Elapsed(1.0).seconds = 2.0  # type: ignore[misc]


def test_a_condition_nobody_armed_costs_nothing(engine: xp.PhysicsEngine) -> None:
    moving(engine)
    engine.run(until=100.0)
    report = engine.explain().data
    assert report["events"]["handled"] == 0 and report["contacts"] is None and report["conditions"] == []


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: when.Elapsed(True), r"Elapsed\(seconds=True\): a finite time"),
        (lambda: when.Elapsed(False), r"Elapsed\(seconds=False\): a finite time"),
        (lambda: when.Steps(n=True), r"Steps\(n=True\): a whole number"),
        (lambda: when.Steps(n=False), r"Steps\(n=False\): a whole number"),
        (lambda: when.Steps(n=0.5), r"Steps\(n=0.5\): a whole number"),
    ],
)
def test_a_truth_is_no_number(make: Callable[[], Any], said: str) -> None:
    with pytest.raises(xp.errors.InvalidValueError, match=said):
        make()
