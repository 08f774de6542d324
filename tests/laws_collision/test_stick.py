"""Stick: bodies that meet leave with one motion where they touch, and momentum is kept."""

from __future__ import annotations

import numpy as np
import pytest

import xpheve as xp


def test_two_balls_that_meet_head_on_go_on_as_one() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:stick")
    one = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), mass=2.0, velocity=(3, 0, 0)), laws=[law])
    two = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(2, 0, 0)), laws=[law])
    engine.run(until=1.0)
    assert one.velocity == pytest.approx((2, 0, 0)) and two.velocity == pytest.approx((2, 0, 0))
    assert engine.energy().work == pytest.approx(-3.0, abs=1e-14)


def test_off_the_centre_they_roll_on_each_other_and_keep_both_momenta() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:stick")
    met = []

    class Witness(xp.PhysicalLaw):
        def enforce_this_law(self, event: xp.Event) -> None:
            (contact,) = event.contacts
            speeds = [
                np.array(obj.velocity) + np.cross(obj.angular_velocity, np.subtract(contact.point, obj.position))
                for obj in (contact.body_a, contact.body_b)
            ]
            met.append(speeds[1] - speeds[0])

    witness = engine.add_law(Witness(), xp.LawContainer(xp.when.Impact()))
    for mass, x, y, v, w in ((2.0, 0.0, 0.2, 3.0, 5.0), (1.0, 2.0, -0.3, 0.0, -2.0)):
        ball = xp.PhysicalObject(
            xp.Sphere(0.5), mass=mass, position=(x, y, 0), velocity=(v, 0, 0), angular_velocity=(w, 1, w)
        )
        engine.add_object(ball, laws=[law, witness])
    before = engine.momentum(), engine.angular_momentum()
    engine.run(until=0.5)
    assert len(met) == 1 and np.abs(met[0]).max() < 1e-14
    assert engine.momentum() == pytest.approx(before[0], abs=1e-14)
    assert engine.angular_momentum() == pytest.approx(before[1], abs=1e-14)


def test_a_rod_that_lands_on_its_end_pivots_about_it() -> None:
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("collision:stick")
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[law])
    half = (np.cos(0.4), 0.0, np.sin(0.4), 0.0)
    rod = xp.PhysicalObject(
        xp.Box((0.01, 0.01, 2.0)), position=(0, 0, 2), orientation=half, velocity=(0.5, 0, -3), inertia=(1.0, 1.0, 0.01)
    )
    engine.add_object(rod, laws=[law])
    lost = []

    class Witness(xp.PhysicalLaw):
        def enforce_this_law(self, event: xp.Event) -> None:
            contact = event.contacts[0]
            arm = np.subtract(contact.point, rod.position)
            lost.append(np.array(rod.velocity) + np.cross(rod.angular_velocity, arm))
            law.enabled = self.enabled = False

    witness = engine.add_law(Witness(), xp.LawContainer(xp.when.Impact()))
    for obj in engine.objects:
        engine.map(obj, witness)
    engine.run(until=1.0)
    assert len(lost) == 1 and np.abs(lost[0]).max() < 1e-13
    assert abs(rod.angular_velocity[1]) > 0.1


def test_on_a_floor_a_ball_rolls_on() -> None:
    engine = xp.PhysicsEngine(up="z")
    gravity, law = engine.add_law("basic:planet_gravity"), engine.add_law("collision:stick")
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[law])
    ball = xp.PhysicalObject(xp.Sphere(0.5), position=(0, 0, 2), velocity=(1.4, 0, 0))
    engine.add_object(ball, laws=[gravity, law])
    engine.run(until=2.0)
    assert ball.velocity == pytest.approx((1.0, 0, 0), abs=1e-13)
    assert ball.angular_velocity == pytest.approx((0, 2.0, 0), abs=1e-13)
    assert engine.explain().data["contacts"]["supports"]


@pytest.mark.parametrize("container", ["collision:bounding_box", "collision:picking"])
def test_polled_containers_take_it_too(container: str) -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:stick", container=container)
    one = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), velocity=(3, 0, 0)), laws=[law])
    two = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(2, 0, 0)), laws=[law])
    engine.run(until=1.0, dt=0.01)
    assert one.velocity == pytest.approx((1.5, 0, 0)) == two.velocity
