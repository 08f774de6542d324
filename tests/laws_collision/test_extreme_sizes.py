"""Bodies whose sizes no float can hold side by side are refused when they come; searches that get nowhere end."""

from __future__ import annotations

import math
from typing import Any

import pytest

import xpheve as xp
from xpheve.errors import ContactError
from xpheve_laws_collision.impact_time import advancement


def scene(first: Any, second: Any) -> xp.PhysicsEngine:
    """The second one flies, turning, at the first."""
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    engine.add_object(xp.PhysicalObject(first, name="first", mass=10, position=(3, 0, 0.1)), laws=[law])
    flier = xp.PhysicalObject(second, name="second", velocity=(3, 0, 0), angular_velocity=(0, 0, 0.3))
    engine.add_object(flier, laws=[law])
    return engine


def needle(height: float) -> xp.Hull:
    return xp.Hull([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, height)])


CUBE = xp.Box((0.3, 0.3, 0.3))


@pytest.mark.parametrize(
    ("shape", "part"),
    [
        (needle(1e9), "too thin"),
        (xp.Box((1, 1, 1e9)), "too thin"),
        (xp.Box((1, 1, 1e15)), "too thin"),
        (xp.Box((1e-9, 1, 1)), "too thin"),
        (xp.Capsule(1e-12, 1.0), "too thin"),
        (xp.Box((1e80, 1e80, 1e80)), "Choose other units"),
        (xp.Box((1e-80, 1e-80, 1e-80)), "Choose other units"),
        (xp.Compound([xp.Part(CUBE), xp.Part(xp.Box((1, 1, 1e9)), (2, 0, 0))]), "too thin"),
    ],
)
def test_what_is_too_thin_too_large_or_too_small_is_refused_when_it_comes(shape: Any, part: str) -> None:
    with pytest.raises(ContactError, match=part) as caught:
        scene(shape, CUBE)
    assert "first" in str(caught.value)


@pytest.mark.parametrize("turned_round", [False, True])
def test_a_tiny_box_beside_a_huge_one_is_refused_by_both_names(turned_round: bool) -> None:
    both = [xp.Box((1e-9, 1e-9, 1e-9)), xp.Box((1, 1, 1))]
    with pytest.raises(ContactError, match=r"'second'.* and .*'first'"):
        scene(*(both[::-1] if turned_round else both))
    scene(xp.Sphere(1e-9), xp.Box((1, 1, 1)))  # what is round has no sides to tell apart


def test_a_shape_that_has_left_limits_nobody() -> None:
    engine = scene(xp.Box((1, 1, 1)), CUBE)
    engine.remove_object(engine.object("first"))
    engine.remove_object(engine.object("second"))
    tiny = engine.add_object(xp.PhysicalObject(xp.Box((1e-9, 1e-9, 1e-9))), laws=list(engine.laws))
    assert list(engine.objects) == [tiny]


@pytest.mark.parametrize("k", [1e-30, 1e-21, 1e21, 1e30])
def test_the_same_in_other_units_is_the_same(k: float) -> None:
    found = []
    for unit in (1.0, k):
        engine = xp.PhysicsEngine()
        law = engine.add_law("collision:elastic")
        corners = [(unit * x, unit * y, unit * z) for x, y, z in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))]
        target = xp.PhysicalObject(xp.Hull(corners), mass=10, position=(3 * unit, 0, 0.1 * unit))
        flier = xp.PhysicalObject(xp.Box((0.3 * unit, 0.3 * unit, 0.3 * unit)), velocity=(3 * unit, 0, 0))
        engine.add_objects([target, flier], laws=[law])
        engine.run(until=3)
        found.append([c / unit for c in flier.velocity])
    assert math.dist(*found) < 1e-12 < abs(found[0][0] - 3)


def test_searches_that_get_nowhere_end_with_both_names(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(advancement, "STEPS", 2)
    engine = scene(xp.Box((1, 1, 1)), CUBE)
    with pytest.raises(ContactError, match=r"'first'.*'second'.*is not found"):
        engine.run(until=3)
    assert 0.0 < engine.time < 0.8  # they have not met yet


@pytest.mark.parametrize("shape", [needle(1e5), xp.Box((1, 1, 1e7)), xp.Box((1, 1, 1e-7))])
def test_what_is_long_or_thin_is_met_in_time(shape: Any) -> None:
    engine = scene(shape, CUBE)
    before = engine.energy().total
    engine.run(until=3)
    assert engine.object("second").velocity[0] < 2.9
    assert math.isclose(engine.energy().total, before, rel_tol=1e-9)
