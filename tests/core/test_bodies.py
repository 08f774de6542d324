"""Rows of arrays: views are snapshots, buffers that someone holds are never written again."""

from __future__ import annotations

import numpy as np
import pytest

import xpheve as xp


@pytest.fixture
def engine() -> xp.PhysicsEngine:
    """Return fifty points on their way."""
    made = xp.PhysicsEngine()
    made.add_objects([xp.PhysicalObject(position=(k, 0, 0), velocity=(0, k, 1)) for k in range(50)])
    return made


def test_what_was_read_stays_as_it_was(engine: xp.PhysicsEngine) -> None:
    kept = [(engine.time, engine.bodies.position)]
    for k in range(1, 20):
        engine.run(until=0.5 * k)
        kept.append((engine.time, engine.bodies.position))
    for time, array in kept:
        assert np.array_equal(array[:, 1], np.arange(50) * time)


def test_a_slice_keeps_its_array(engine: xp.PhysicsEngine) -> None:
    engine.run(until=1.0)
    column = engine.bodies.position[:, 1]
    transposed = engine.bodies.velocity.T
    row = engine.bodies.position[7]
    for k in range(2, 6):
        engine.run(until=float(k))
        assert engine.bodies.position[3, 1] == 3.0 * k
        assert engine.bodies.velocity[3, 1] == 3.0
    assert np.array_equal(column, np.arange(50)) and row[1] == 7.0 and transposed.shape == (3, 50)


def test_reading_twice_is_the_same_array_until_something_changes(engine: xp.PhysicsEngine) -> None:
    engine.run(until=1.0)
    first = engine.bodies.position
    assert engine.bodies.position is first
    engine.objects[0].position = (9, 9, 9)
    assert tuple(engine.bodies.position[0]) == (9, 9, 9) and first[0, 0] == 0.0


def test_views_follow_adding_removing_and_handles(engine: xp.PhysicsEngine) -> None:
    engine.run(until=1.0)
    for k in (49, 0, 20):
        engine.remove_object(engine.objects[k])
    engine.add_object(xp.PhysicalObject(position=(-1, -1, -1)))
    assert len(engine.bodies) == 48 == len(engine.objects)
    engine.run(until=1.7)
    for row, obj in enumerate(engine.objects):
        assert tuple(engine.bodies.position[row]) == obj.position
        assert tuple(engine.bodies.velocity[row]) == obj.velocity
        assert tuple(engine.bodies.orientation[row]) == obj.orientation
        assert engine.bodies.mass[row] == obj.mass


def test_arrays_and_handles_agree_to_the_bit_for_every_stepper() -> None:
    engine = xp.PhysicsEngine()
    drag = engine.add_law("basic:linear_drag")
    gravity = engine.add_law("basic:planet_gravity")
    rng = np.random.default_rng(5)
    for k in range(12):
        engine.add_object(
            xp.PhysicalObject(inertia=(1, 2, 2.5), velocity=rng.normal(size=3), angular_velocity=rng.normal(size=3)),
            laws=[[], [drag], [gravity], [drag, gravity]][k % 4],
        )
    engine.objects[0].add_force(xp.Force(torque=(0.1, 0.2, 0.3)))
    for until in (0.3, 0.7, 1.9):
        engine.run(until=until)
        for name in ("position", "velocity", "orientation", "angular_velocity"):
            array = getattr(engine.bodies, name)
            assert [tuple(row) for row in array.tolist()] == [getattr(obj, name) for obj in engine.objects]


def test_columns_exist_when_a_law_asks_for_them(engine: xp.PhysicsEngine) -> None:
    law = engine.add_law("collision:elastic")
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(-5, 0, 0), restitution=0.25), laws=[law])
    column = engine.bodies["restitution"]
    assert column[-1] == 0.25 and np.isnan(column[:-1]).all()
    assert engine.bodies["mass"].shape == (51,)
