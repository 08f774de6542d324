"""Combinations of conditions: any, all in turn, all at once, not; against a simple interpreter; and what they remember."""

from __future__ import annotations

import functools
import itertools
import operator
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import InvalidValueError, LawFailedError
from xpheve.laws.combinations import DEEPEST

when = xp.when
A, B, C = (when.Posted(name) for name in "abc")


class Log(xp.PhysicalLaw):
    """Write down each event, and do what the test says."""

    def __init__(self, act: Callable[[Any], None] | None = None, **given: Any) -> None:
        super().__init__(**given)
        self.act = act
        self.events: list[Any] = []

    def enforce_this_law(self, event: Any) -> None:
        self.events.append(event)
        if self.act is not None:
            self.act(event)


def listen(engine: xp.PhysicsEngine, condition: Any, act: Callable[[Any], None] | None = None) -> Log:
    """Return a law that waits for ``condition`` in a container of its own."""
    law = Log(act)
    engine.add_law(law, container=xp.LawContainer(condition))
    return law


def fired(condition: Any, posts: str) -> list[int]:
    """Return after which of ``posts``, one a second, a container with ``condition`` fired; a space posts nothing."""
    engine = xp.PhysicsEngine()
    law = listen(engine, condition)
    for k, letters in enumerate(posts.split("|") if "|" in posts else posts):
        engine.run(until=float(k))
        for letter in letters.strip():
            engine.post(letter)
    engine.run(until=len(posts) + 1.0)
    return [int(event.time) for event in law.events]


def test_any_fires_at_each_member() -> None:
    assert fired(A | B, "abca") == [0, 1, 3]


def test_all_waits_for_each_member_and_then_for_each_again() -> None:
    """In Java3D a WakeupAnd that is used again fires on any one member."""
    assert fired(A & B, "aabbab") == [2, 4]
    assert fired(A & B, "babb a") == [1, 5]


def test_all_members_may_come_at_one_instant() -> None:
    assert fired(A & B, "ab|a|b") == [0, 2]


def test_all_now_needs_one_instant() -> None:
    assert fired(when.AllNow(A, B), "a|b|ab|ba|aab|b") == [2, 3, 4]


def test_everything_met_is_forgotten_when_the_whole_fires() -> None:
    assert fired((A & B) | C, "acbab") == [1, 3]
    assert fired((A & B) | C, "acb") == [1]


def test_and_of_ors_and_or_of_ands() -> None:
    D = when.Posted("d")
    assert fired((A | B) & (C | D), "abdcbc") == [2, 4]
    assert fired((A & B) | (C & D), "acbd") == [2]


def test_once_in_and_around_a_combination() -> None:
    assert fired(when.AnyOf(A, B, once=True), "ccbab") == [2]
    assert fired(when.Posted("a", once=True) | B, "aabab") == [0, 2, 4]
    assert fired(when.AllOf(A, B, once=True), "ababab") == [1]


def test_fired_says_what_set_it_off_with_each_own_event() -> None:
    engine = xp.PhysicsEngine()
    law = listen(engine, A & B)
    engine.post("a", 1)
    engine.run(until=1.0)
    engine.post("b", 2, source="me")
    engine.run(until=2.0)
    [event] = law.events
    assert [(leaf, part.time, part.data) for leaf, part in event.fired] == [(A, 0.0, 1), (B, 1.0, 2)]
    assert (event.time, event.data, event.source, event.condition) == (1.0, 2, "me", A & B)


def test_a_simple_condition_has_fired_too() -> None:
    engine = xp.PhysicsEngine()
    law = listen(engine, A)
    engine.post("a", 1)
    engine.run(until=1.0)
    [(leaf, part)] = law.events[0].fired
    assert leaf == A and part.data == 1


def test_combinations_are_values() -> None:
    assert (A | B) == (A | B) and hash(A & B) == hash(A & B) and (A | B) != (B | A) and len({~R, ~R}) == 1
    assert str(A & ~R).startswith("AllOf(Posted(id='a'), Not(RegionActive(")


R = when.RegionActive(xp.Region(xp.Sphere(1.0)))


@pytest.mark.parametrize("wrong", [A, A & R, when.Elapsed(1.0), when.Asleep(), R | A], ids=str)
def test_not_is_for_levels(wrong: Any) -> None:
    with pytest.raises(InvalidValueError, match="Levels are RegionActive"):
        _ = ~wrong


@pytest.mark.parametrize(
    "make", [lambda: A | 3, lambda: A & None, when.AnyOf, lambda: when.AllNow("a"), lambda: A | when.Impact()]
)
def test_members_are_conditions(make: Callable[[], Any]) -> None:
    with pytest.raises(InvalidValueError):
        make()


# Against an interpreter that is as simple as the words

trees = st.recursive(
    st.sampled_from([A, B, C]),
    lambda inner: st.one_of(
        st.tuples(st.sampled_from([when.AnyOf, when.AllOf, when.AllNow]), st.lists(inner, min_size=1, max_size=3)).map(
            lambda made: made[0](*made[1])
        )
    ),
    max_leaves=6,
)


class Reference:
    """A tree of conditions as nested sets of what was met."""

    def __init__(self, condition: Any) -> None:
        self.condition = condition
        self.members = [Reference(one) for one in getattr(condition, "of", ())]
        self.seen: dict[int, int] = {}

    def hear(self, name: str, now: int) -> bool:
        """Whether ``name`` at ``now`` sets it off."""
        if not self.members:
            return bool(self.condition.id == name)
        heard = [k for k, one in enumerate(self.members) if one.hear(name, now)]
        if isinstance(self.condition, when.AnyOf):
            return bool(heard)
        self.seen |= dict.fromkeys(heard, now)
        everyone = range(len(self.members))
        if isinstance(self.condition, when.AllNow):
            done = all(self.seen.get(k) == now for k in everyone)
        else:
            done = all(k in self.seen for k in everyone)
        if done:
            self.seen.clear()
        return done

    def forget(self) -> None:
        """Nothing was met."""
        self.seen.clear()
        for one in self.members:
            one.forget()


@settings(max_examples=80, deadline=None)
@given(trees, st.lists(st.text("abc", max_size=3), max_size=8))
def test_trees_fire_as_the_interpreter_says(condition: Any, posts: list[str]) -> None:
    engine = xp.PhysicsEngine()
    law = listen(engine, condition)
    reference, expected = Reference(condition), []
    for k, letters in enumerate(posts):
        engine.run(until=float(k))
        for letter in letters:
            engine.post(letter)
            if reference.hear(letter, k):
                expected.append(k)
                reference.forget()
    engine.run(until=len(posts) + 1.0)
    assert [int(event.time) for event in law.events] == expected


@settings(max_examples=25, deadline=None)
@given(trees, st.lists(st.text("abc", max_size=2), min_size=2, max_size=6), st.integers(0, 5))
def test_what_was_met_goes_into_checkpoints(condition: Any, posts: list[str], cut: int) -> None:
    engine = xp.PhysicsEngine()
    listen(engine, condition)
    for k, letters in enumerate(posts):
        engine.run(until=float(k))
        if k == cut:
            other = xp.PhysicsEngine.restore(engine.checkpoint(), laws=[Log])
            copy = engine.copy()
        for one in (engine, other, copy) if k >= cut else (engine,):
            one.run(until=float(k))
            for letter in letters:
                one.post(letter)
    engine.run(until=9.0)
    if cut < len(posts):
        for one in (other, copy):
            one.run(until=9.0)
            assert [event.time for event in one.laws[0].events] == [
                event.time for event in engine.laws[0].events if event.time >= cut
            ]


def test_a_handler_that_raises_leaves_what_was_met() -> None:
    engine = xp.PhysicsEngine()
    trouble = [True]

    def act(event: Any) -> None:
        if trouble[0]:
            raise ZeroDivisionError("now")

    law = listen(engine, A & B, act)
    other = listen(engine, A & B)
    engine.post("a")
    engine.run(until=1.0)
    engine.post("b")
    with pytest.raises(LawFailedError):
        engine.run(until=2.0)
    trouble[0] = False
    law.events.clear()
    other.events.clear()
    engine.run(until=2.0)
    assert [event.time for event in law.events] == [event.time for event in other.events] == [1.0]


def test_reset_forgets_what_was_met() -> None:
    engine = xp.PhysicsEngine()
    law = listen(engine, A & B)
    engine.run(until=1.0)
    engine.post("a")
    engine.run(until=2.0)
    engine.reset()
    engine.post("b")
    engine.run(until=3.0)
    assert law.events == []


@pytest.mark.parametrize("order", list(itertools.permutations("abc")), ids="".join)
def test_three_in_any_order(order: tuple[str, ...]) -> None:
    assert fired(when.AllOf(A, B, C), "".join(order)) == [2]


def test_elapsed_steps_and_levels_combine() -> None:
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject(name="body"))
    law = listen(engine, when.AllNow(when.Elapsed(1.0, every=True), ~when.Asleep(body)))
    steps = listen(engine, when.AllNow(when.Steps(), when.Awake(body)))
    engine.run(until=2.5, dt=0.5)
    body.velocity = (1, 0, 0)
    engine.run(until=4.0, dt=0.5)
    body.velocity = (0, 0, 0)
    engine.run(until=6.0, dt=0.5)
    assert [event.time for event in law.events] == [3.0, 4.0]
    assert [event.time for event in steps.events] == [2.75, 3.25, 3.75]


# Many members, and members in members

MANY = [when.Posted(str(k)) for k in range(400)]


@pytest.mark.parametrize("form", ["toml", "json"])
@pytest.mark.parametrize("join", [operator.or_, operator.and_], ids=["or", "and"])
def test_a_chain_of_operators_is_one_combination_which_files_and_checkpoints_hold(
    join: Callable[[Any, Any], Any], form: str, tmp_path: Path
) -> None:
    kind = when.AnyOf if join is operator.or_ else when.AllOf
    for count in (8, 400):
        chain = functools.reduce(join, MANY[:count])
        assert chain == kind(*MANY[:count]) and chain.depth == 1
        engine = xp.PhysicsEngine()
        engine.add_law("basic:planet_gravity", container=xp.LawContainer(chain, name="any"))
        engine.save_scene(tmp_path / f"s.{form}")
        assert xp.PhysicsEngine.load_scene(tmp_path / f"s.{form}").laws[0].containers[0].condition == chain
        engine.step(0.1)
        assert xp.PhysicsEngine.restore(engine.checkpoint()).laws[0].containers[0].condition == chain
        assert engine.copy().laws[0].containers[0].condition == chain


def test_operators_keep_parts_with_once_of_their_own_and_join_from_the_right_too() -> None:
    part = when.AnyOf(A, B, once=True)
    assert (part | C).of == (part, C) and (A | (B | C)).of == (A, B, C) and (A & (B & C)).of == (A, B, C)
    assert ((A & B) | C).of == (A & B, C) and (when.AllNow(A, B) & C).of == (when.AllNow(A, B), C)


@settings(max_examples=30, deadline=None)
@given(st.sampled_from([when.AnyOf, when.AllOf]), st.lists(st.text("abc", max_size=3), max_size=8))
def test_joined_parts_fire_as_nested_ones(kind: Any, posts: list[str]) -> None:
    nested, joined = kind(kind(A, B), C), kind(A, B, C)
    engine = xp.PhysicsEngine()
    laws = [listen(engine, condition) for condition in (nested, joined)]
    for k, letters in enumerate(posts):
        engine.run(until=float(k))
        for letter in letters:
            engine.post(letter)
    engine.run(until=9.0)
    one, other = ([(event.time, event.fired) for event in law.events] for law in laws)
    assert one == other


def alternating(depth: int) -> Any:
    condition: Any = A
    for k in range(depth):
        condition = condition | B if k % 2 else condition & C
    return condition


@pytest.mark.parametrize("form", ["toml", "json"])
def test_the_deepest_tree_can_be_saved_read_and_restored(form: str, tmp_path: Path) -> None:
    region = when.RegionActive(xp.Region(xp.Plane(normal=(0, 0, 1))))
    deepest: Any = ~region & C
    for k in range(DEEPEST - 2):
        deepest = deepest & C if k % 2 else deepest | B
    assert deepest.depth == DEEPEST
    engine = xp.PhysicsEngine()
    engine.add_law("basic:planet_gravity", container=xp.LawContainer(deepest, name="deep"))
    engine.step(0.1)
    assert xp.PhysicsEngine.restore(engine.checkpoint()).laws[0].containers[0].condition == deepest
    assert engine.copy().laws[0].containers[0].condition == deepest
    engine.save_scene(tmp_path / f"s.{form}")
    again = xp.PhysicsEngine.load_scene(tmp_path / f"s.{form}")
    assert again.laws[0].containers[0].condition == deepest
    again.step(0.1)


@pytest.mark.parametrize("depth", [DEEPEST + 1, 400])
def test_deeper_trees_are_refused_when_made(depth: int) -> None:
    with pytest.raises(InvalidValueError, match=f"nested {DEEPEST + 1} deep; at most {DEEPEST}"):
        alternating(depth)
