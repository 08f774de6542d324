"""What a mesh cannot do is refused when the object meets the law, or at the instant at which it begins."""

from __future__ import annotations

from typing import Any

import pytest
from tests.laws_collision.meshes import room

import xpheve as xp
from xpheve.errors import ContactError

BOX = xp.Box((1, 1, 1))


def house() -> xp.Compound:
    return xp.Compound([xp.Part(room()), xp.Part(BOX, (5.0, 0.0, 0.0))])


def engine_with(*objects: xp.PhysicalObject) -> tuple[xp.PhysicsEngine, Any]:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    for obj in objects:
        engine.add_object(obj, laws=[law])
    return engine, law


@pytest.mark.parametrize("shape", [room(), house()])
def test_a_mesh_that_turns_is_refused_when_it_comes(shape: Any) -> None:
    engine, law = engine_with()
    with pytest.raises(ContactError, match=r"'top'.*turns.*Make it a Hull"):
        engine.add_object(xp.PhysicalObject(shape, name="top", mass=1, angular_velocity=(0, 0, 1)), laws=[law])
    assert len(engine.objects) == 0
    top = engine.add_object(xp.PhysicalObject(shape, name="top", mass=1, angular_velocity=(0, 0, 1)))
    with pytest.raises(ContactError, match=r"'top'.*turns"):
        engine.map(top, law)
    assert not top.laws


@pytest.mark.parametrize("other", [BOX, xp.Plane((0, 0, 1)), house()])
@pytest.mark.parametrize("house_first", [False, True])
def test_a_compound_with_a_mesh_meets_balls_only_and_the_rest_is_refused_when_it_comes(
    other: Any, house_first: bool
) -> None:
    one = xp.PhysicalObject(house(), name="house", position=(50, 0, 0), mass=1)
    fixed = isinstance(other, xp.Plane)
    two = (
        xp.PhysicalObject(other, name="other", fixed=True) if fixed else xp.PhysicalObject(other, name="other", mass=1)
    )
    first, second = (one, two) if house_first else (two, one)
    engine, law = engine_with(first)
    with pytest.raises(ContactError, match=rf"'{second.name}'.*mesh"):
        engine.add_object(second, laws=[law])
    assert engine.objects == (first,)


def test_a_mesh_that_is_made_to_turn_is_refused_at_the_instant_and_nothing_changes() -> None:
    hall = xp.PhysicalObject(room(), name="hall", mass=1, position=(100, 0, 0))
    engine, _ = engine_with(hall, xp.PhysicalObject(xp.Sphere(0.1), position=(0, 0, 0), velocity=(0, 1, 0)))
    engine.run(until=1.0)
    with pytest.raises(ContactError, match=r"'hall'.*turns"):
        hall.angular_velocity = (0, 0, 1)
    assert hall.angular_velocity == (0, 0, 0)
    engine.run(until=2.0)
    assert hall.position == (100, 0, 0)


def test_a_new_shape_that_cannot_meet_the_others_changes_nothing() -> None:
    first = xp.PhysicalObject(BOX, name="first", mass=1, position=(9, 0, 0), angular_velocity=(0, 0, 1))
    engine, _ = engine_with(first, xp.PhysicalObject(xp.Sphere(0.1)))
    for shape in (room(), house(), xp.Box((1, 1, 1e12))):
        with pytest.raises(ContactError, match="'first'"):
            first.shape = shape
        assert first.shape is BOX
    engine.run(until=1.0)
