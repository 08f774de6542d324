"""Stop: nobody moves any more."""

from __future__ import annotations

import pytest

import xpheve as xp


@pytest.mark.parametrize("container", [None, "collision:bounding_box", "collision:picking"])
def test_two_that_meet_stand_still_and_the_energy_is_booked(container: str | None) -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:stop", container=container)
    one = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), mass=2.0, velocity=(3, 0, 0)), laws=[law])
    two = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(2, 0, 0)), laws=[law])
    engine.run(until=1.0, dt=0.01)
    assert one.velocity == two.velocity == (0, 0, 0)
    assert one.position[0] == pytest.approx(1.0, abs=0.1)
    assert engine.energy().work == -9.0


def test_on_a_floor_it_lies_where_it_fell() -> None:
    engine = xp.PhysicsEngine()
    gravity, law = engine.add_law("basic:planet_gravity"), engine.add_law("collision:stop")
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[law])
    ball = engine.add_object(
        xp.PhysicalObject(xp.Sphere(0.5), position=(0, 2, 0), velocity=(1, 0, 0)), laws=[gravity, law]
    )
    engine.run(until=9.0)
    assert ball.velocity == (0, 0, 0) and ball.position[1] == 0.5 and law.evaluations == 1


def test_under_a_polled_container_a_pressed_body_creeps_by_half_the_acceleration_times_the_square_of_the_step() -> None:
    engine = xp.PhysicsEngine()
    gravity = engine.add_law("basic:planet_gravity", acceleration=10.0)
    law = engine.add_law("collision:stop", container="collision:bounding_box")
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[law])
    box = engine.add_object(xp.PhysicalObject(xp.Box((1, 1, 1)), position=(0, 0.5, 0)), laws=[gravity, law])
    engine.run(until=1.0, dt=0.01)
    assert box.position[1] == pytest.approx(0.5 - 99.5 * 0.5 * 10 * 0.01**2, abs=1e-3)
