"""Impacts with what the host moves: an infinite mass with a velocity, at exact instants, and nothing tunnels."""

from __future__ import annotations

import pytest

import xpheve as xp

pytest.importorskip("xpheve_laws_collision.mass", reason="the contact server that knows driven objects")


def paddle(restitution: float = 1.0) -> tuple[xp.PhysicsEngine, xp.PhysicalObject, xp.PhysicalObject]:
    """A hand that holds a ball-shaped paddle, and a free ball 1 m away."""
    engine = xp.PhysicsEngine(up="z")
    bounce = engine.add_law("collision:elastic", restitution=restitution)
    hand = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), name="hand"), laws=[bounce])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(1, 0, 0), name="ball"), laws=[bounce])
    return engine, hand, ball


def test_a_carried_object_strikes_with_infinite_mass_at_the_exact_instant() -> None:
    engine, hand, ball = paddle()
    hand.carry((2, 0, 0), within=1.0)
    engine.run(until=0.5)
    assert ball.position == pytest.approx((1 + 4 * 0.1, 0, 0), abs=1e-12), "struck at 0.4 s, it leaves at 4 m/s"
    assert ball.velocity == pytest.approx((4, 0, 0), abs=1e-12)
    engine.run(until=2.0)
    assert hand.position == (2, 0, 0) and hand.velocity == (0, 0, 0)


@pytest.mark.parametrize("speed", [1e2, 1e4, 1e6])
def test_nothing_tunnels_however_fast_the_hand(speed: float) -> None:
    engine, hand, ball = paddle()
    hand.carry((1000.0, 0, 0), within=1000.0 / speed)
    engine.run(until=2000.0 / speed)
    assert ball.velocity == pytest.approx((2 * speed, 0, 0), rel=1e-9)


def test_a_held_object_is_a_wall_and_its_hold_outlasts_the_impact() -> None:
    engine, hand, ball = paddle(0.5)
    hand.hold()
    ball.velocity = (-2, 0, 0)
    engine.run(until=1.0)
    assert ball.velocity == pytest.approx((1, 0, 0), abs=1e-12)
    assert hand.driven and hand.position == (0, 0, 0) and hand.velocity == (0, 0, 0)
    work = sum(engine.explain().data["energy"]["work_by"].values())
    assert work == pytest.approx(engine.energy().kinetic - 2.0, abs=1e-12)


def test_two_driven_objects_pass_through_each_other() -> None:
    engine, hand, ball = paddle()
    ball.hold()
    hand.carry((5, 0, 0), within=1.0)
    engine.run(until=2.0)
    assert hand.position == (5, 0, 0) and ball.position == (1, 0, 0)


def test_a_ball_at_rest_on_the_floor_can_be_picked_up_and_dropped_again() -> None:
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", acceleration=10.0)
    bounce = engine.add_law("collision:elastic", restitution=0.0)
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(0, 0, 0.1)), laws=[gravity, bounce])
    engine.run(until=1.0)
    ball.carry((0, 0, 1.1), within=0.5)
    engine.run(until=2.0)
    assert ball.position == (0, 0, 1.1)
    ball.release()
    engine.run(until=2.2)
    assert ball.position == pytest.approx((0, 0, 1.1 - 0.2), abs=1e-12)
    engine.run(until=4.0)
    assert ball.position == pytest.approx((0, 0, 0.1), abs=1e-12) and ball.velocity == (0, 0, 0)


def test_a_ball_let_go_where_it_touches_the_floor_rests() -> None:
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", acceleration=10.0)
    bounce = engine.add_law("collision:elastic", restitution=0.0)
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(0, 0, 2)), laws=[gravity, bounce])
    ball.carry((0, 0, 0.1), within=1.0)
    engine.run(until=1.5)
    ball.release()
    engine.run(until=3.0)
    assert ball.position == (0, 0, 0.1) and ball.velocity == (0, 0, 0)


@pytest.mark.parametrize("restitution", [1.0, 0.6])
@pytest.mark.parametrize("hand_first", [True, False])
def test_what_a_hand_gives_in_an_impact_is_its_work(restitution: float, hand_first: bool) -> None:
    """A bat that turns and moves strikes a ball: the balance holds, and the impact's own work is never above zero."""
    engine = xp.PhysicsEngine(up="z")
    bounce = engine.add_law("collision:elastic", restitution=restitution)
    bat = xp.PhysicalObject(xp.Box((0.1, 1.0, 0.1)), name="bat")
    ball = xp.PhysicalObject(xp.Sphere(0.1), mass=0.3, position=(0.6, 0.3, 0), velocity=(-3, 0.5, 0), name="ball")
    engine.add_objects([bat, ball] if hand_first else [ball, bat], laws=[bounce])
    engine.run(until=0.0)
    bat.drive((2, 0, 0), angular_velocity=(0, 0, -1.5))
    balance = engine.energy().balance
    for _ in range(2):
        engine.run(until=engine.time + 0.5)
        assert engine.energy().balance == pytest.approx(balance, rel=1e-13)
    work = engine.explain().data["energy"]["work_by"]
    assert ball.velocity[0] > 3 and work["driven"] > 0.5
    assert work.get("bounce", work.get("collision:elastic", 0.0)) <= 0.0
    bat.release()
    assert engine.energy().balance == pytest.approx(balance, rel=1e-13)
