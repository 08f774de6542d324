"""Reverse: back the way they came."""

from __future__ import annotations

import pytest

import xpheve as xp


@pytest.mark.parametrize("container", [None, "collision:bounding_box", "collision:picking"])
def test_a_ball_off_a_wall_returns_along_its_path(container: str | None) -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:reverse", container=container)
    engine.add_object(xp.PhysicalObject(xp.Plane((-1, 0, 0), offset=-2), fixed=True), laws=[law])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), velocity=(3, 1, 0)), laws=[law])
    engine.run(until=1.5, dt=0.01)
    assert ball.velocity == (-3, -1, 0) and law.evaluations >= 1
    assert ball.position == pytest.approx((-1.5, -0.5, 0), abs=0.1)


def test_both_of_two_movers_turn_round_and_energy_is_kept_but_not_momentum() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:reverse")
    one = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), mass=2.0, velocity=(3, 0, 0)), laws=[law])
    two = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(2, 0, 0), velocity=(1, 0, 0)), laws=[law])
    engine.run(until=1.0)
    assert one.velocity == (-3, 0, 0) and two.velocity == (-1, 0, 0)
    assert engine.energy().kinetic == 9.5 and engine.energy().work == 0.0
    assert engine.momentum()[0] == -7.0


def test_what_is_fixed_stays_and_a_corner_of_two_walls_turns_a_ball_round_once() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:reverse")
    for normal in ((-1, 0, 0), (0, -1, 0)):
        engine.add_object(xp.PhysicalObject(xp.Plane(normal, offset=-2), fixed=True), laws=[law])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), velocity=(1, 1, 0)), laws=[law])
    engine.run(until=2.0)
    assert ball.velocity == (-1, -1, 0) and ball.position == pytest.approx((1, 1, 0), abs=1e-14)


def test_a_second_generation_reverses_what_the_first_left() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:reverse")
    row = [
        engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(k, 0, 0), velocity=(v, 0, 0)), laws=[law])
        for k, v in enumerate((2.0, -1.0, 0.0))
    ]
    engine.run(until=0.1)
    assert [ball.velocity[0] for ball in row] == [-2.0, -1.0, 0.0]
