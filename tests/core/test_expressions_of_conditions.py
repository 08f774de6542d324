"""Expressions of conditions are read when they are added: refused then, and followed exactly."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import DimensionError, TracedBranchError, TraceError

when = xp.when


class Diary(xp.PhysicalLaw):
    """Write down when it was told."""

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        self.events: list[Any] = []

    def enforce_this_law(self, event: Any) -> None:
        self.events.append(event)

    @property
    def times(self) -> list[float]:
        """When it was told."""
        return [event.time for event in self.events]


def told(expression: Any, until: float, force: Any = (0, 0, 0), **given: Any) -> list[float]:
    """Return when ``expression`` of a point under a constant force went through zero."""
    engine = xp.PhysicsEngine(up="z")
    diary = engine.add_law(Diary(), container=xp.LawContainer(when.Crosses(expression)))
    body = engine.add_object(xp.PhysicalObject(**given), laws=[diary])
    if any(force):
        body.add_force(force)
    engine.run(until=until)
    assert isinstance(diary, Diary)
    return diary.times


def branching(body: Any) -> Any:
    """Decide on what is no number yet."""
    return body.position.z if body.mass > 1.0 else body.position.x


@pytest.mark.parametrize(
    ("expression", "error"),
    [
        (lambda body: body.position.z - body.time, DimensionError),
        (branching, TracedBranchError),
        (lambda body: body.position, TraceError),
        (lambda body: body.velocity.z > 0.0, TraceError),
    ],
)
def test_what_is_no_expression_is_refused_before_anything_changes(expression: Any, error: type[Exception]) -> None:
    engine = xp.PhysicsEngine()
    container = xp.LawContainer(when.Posted() | when.Crosses(expression))
    with pytest.raises(error, match=r"test_expressions_of_conditions\.py:"):
        engine.add_law(Diary(), container=container)
    with pytest.raises(error):
        engine.add_container(container)
    assert not engine.laws and container.engine is None and not container.laws


@settings(max_examples=60)
@given(speed=st.floats(3.0, 30.0), gravity=st.floats(0.5, 20.0), part=st.floats(0.05, 0.9))
def test_a_height_is_crossed_within_a_unit_of_the_closed_form(speed: float, gravity: float, part: float) -> None:
    from fractions import Fraction

    height = part * speed**2 / (2.0 * gravity)
    assume(gravity * height > 1e-3)
    found = told(lambda body: body.position.z - height, 2.1 * speed / gravity, (0, 0, -gravity), velocity=(0, 0, speed))
    assert len(found) == 2
    v, g, h = Fraction(speed), Fraction(gravity), Fraction(height)
    for k, time in enumerate(found):
        # the true height, in fractions, has changed its side within a unit on either side
        low, high = (Fraction(math.nextafter(time, to)) for to in (-math.inf, math.inf))
        before, after = (v * s - g * s * s / 2 - h for s in (low, high))
        assert (before <= 0 <= after) if k == 0 else (before >= 0 >= after)


@pytest.mark.parametrize(
    ("plain", "windowed"),
    [
        (lambda b: b.position.z - 2.0, lambda b: b.position.z - 2.0 + 0.0 * np.sin(b.time)),
        (
            lambda b: b.position.dot(b.position) - 30.0,
            lambda b: b.position.dot(b.position) - 30.0 + 0.0 * np.sin(b.time),
        ),
        (lambda b: b.velocity.z + 0.3 * b.time, lambda b: b.velocity.z + 0.3 * b.time + 0.0 * np.sin(b.time)),
    ],
)
def test_polynomials_and_windows_find_the_same(plain: Any, windowed: Any) -> None:
    given = {"velocity": (0.3, 1.0, 9.0), "position": (1.0, 0.0, -0.5)}
    first = told(plain, 5.0, (0, 0, -9.81), **given)
    second = told(windowed, 5.0, (0, 0, -9.81), **given)
    assert first and len(first) == len(second)
    for one, other in zip(first, second, strict=True):
        assert abs(one - other) <= 4.0 * math.ulp(one)


def test_954_roots_of_a_sine_are_found_each() -> None:
    found = told(lambda body: np.sin(3.0 * body.position.x), 100.0, velocity=(10.0, 0, 0))
    assert len(found) == 954
    assert max(abs(time - k * math.pi / 30.0) / math.ulp(time) for k, time in enumerate(found, start=1)) <= 2.0


def test_a_throw_that_begins_on_the_edge_is_told_of_its_way_back_only() -> None:
    found = told(lambda body: body.position.z - 0.1, 3.0, (0, 0, -10.0), position=(0, 0, 0.1), velocity=(0, 0, 10.0))
    assert found == [2.0]


def test_what_reads_neither_state_nor_time_is_looked_at_once_a_flight() -> None:
    engine = xp.PhysicsEngine()
    diary = Diary()
    engine.add_law(diary, container=xp.LawContainer(when.Crosses(lambda body: body.mass - 2.0)))
    body = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0), mass=1.0), laws=[diary])
    engine.run(until=1000.0)
    assert engine._world.wakeups.tracker.predictions == 1 and diary.times == []
    body.mass = 3.0
    engine.run(until=1001.0)
    assert diary.times == [1000.0]


def test_a_number_that_changes_later_is_read_when_the_condition_is_added() -> None:
    limit = [1.0]

    def height(body: Any) -> Any:
        return body.position.x - limit[0]

    engine = xp.PhysicsEngine()
    diary = Diary()
    engine.add_law(diary, container=xp.LawContainer(when.Crosses(height)))
    engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)), laws=[diary])
    limit[0] = 2.0
    again = engine.copy()
    for one in (engine, again):
        one.run(until=4.0)
    assert diary.times == [1.0] == again.laws[0].times
    assert told(height, 4.0, velocity=(1, 0, 0)) == [2.0]


def test_the_volume_and_inertia_of_an_object_can_be_read() -> None:
    def level(body: Any) -> Any:
        return body.position.z - 1.0 * body.volume + 1.0 * body.inertia.x - 0.4

    found = told(level, 3.0, shape=xp.Box((1.0, 1.0, 1.0)), mass=6.0, velocity=(0, 0, 1.0))
    assert found == pytest.approx([0.4], abs=1e-15)


@pytest.mark.parametrize(
    "expression",
    [
        lambda body: (body.time - 2.5) * (body.time - 1.0),
        lambda body: (body.time - 2.5) * (body.time - 1.0) * (2.0 + np.sin(body.time)),
    ],
)
def test_an_expression_of_time_is_followed_for_an_object_that_stands(expression: Any) -> None:
    assert told(expression, 4.0) == [1.0, 2.5]
    assert told(lambda body: body.time - 2.5, 4.0) == [2.5]


def test_a_slow_turn_far_away_is_a_crossing_of_the_velocity() -> None:
    found = told(lambda body: body.velocity.x, 1.0, (1.0, 0, 0), position=(1e6, 0, 0), velocity=(-1e-9, 0, 0))
    assert found == [1e-9]
