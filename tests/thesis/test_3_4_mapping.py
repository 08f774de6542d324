"""Thesis 3.4: each object obeys its own laws; figures 3-24 and 3-25."""

from __future__ import annotations

import pytest

import xpheve as xp


def test_fig_3_24_each_object_obeys_its_own_list_of_laws() -> None:
    engine = xp.PhysicsEngine()
    gravity = engine.add_law("basic:planet_gravity", acceleration=9.8)
    collision = engine.add_law("collision:elastic")
    wind = engine.add_law("basic:planet_gravity", acceleration=1.0, direction=(1, 0, 0), name="wind")
    smoke = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(0, 5, 0)), laws=[wind])
    balloon = engine.add_object(
        xp.PhysicalObject(xp.Sphere(0.1), position=(0, 9, 0), velocity=(1, 0, 0)), laws=[collision]
    )
    car = engine.add_object(xp.PhysicalObject(xp.Sphere(1.0), position=(20, 1 + 4.9, 0)), laws=[gravity, collision])
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[collision])
    engine.run(until=1.5)
    assert smoke.position == (1.125, 5, 0) and balloon.position == (1.5, 9, 0)
    assert car.velocity[1] == pytest.approx(9.8 - 4.9, abs=1e-12)
    assert [len(obj.laws) for obj in (smoke, balloon, car)] == [1, 1, 2]


def test_3_4_a_pair_is_answered_when_both_are_mapped() -> None:
    for mapped in (True, False):
        engine = xp.PhysicsEngine()
        law = engine.add_law("collision:elastic")
        ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), velocity=(1, 0, 0)), laws=[law])
        engine.add_object(
            xp.PhysicalObject(xp.Sphere(0.5), position=(3, 0, 0), fixed=True), laws=[law] if mapped else []
        )
        engine.run(until=4.0)
        assert ball.velocity == ((-1, 0, 0) if mapped else (1, 0, 0))


@pytest.mark.parametrize("what", ["g", "mass"])
def test_5_2_a_changed_g_or_mass_corrects_the_stored_force_at_that_instant(what: str) -> None:
    engine = xp.PhysicsEngine()
    gravity = engine.add_law("basic:planet_gravity", acceleration=10.0)
    body = engine.add_object(xp.PhysicalObject(mass=2.0), laws=[gravity])
    engine.run(until=1.0)
    if what == "g":
        gravity.acceleration = 5.0  # type: ignore[attr-defined]
    else:
        body.mass = 1.0
    assert [force.vector for force in body.forces] == [(0, -10, 0)]
    engine.run(until=2.0)
    assert body.velocity == ((0, -15, 0) if what == "g" else (0, -20, 0))
