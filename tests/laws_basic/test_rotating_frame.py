"""Inertial forces of a turning frame, beside the same motion in an inertial one."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import xpheve as xp
from xpheve.kernels.quaternion import from_rotation_vector, rotate
from xpheve_laws_basic import RotatingFrame

number = st.floats(-10, 10)
vector = st.tuples(number, number, number)
W = (0.3, -0.2, 1.1)
P = (0.5, 0.25, -1.0)
STILL = (0.0, 0.0, 0.0)


def seen(x: Any, t: float) -> Any:
    """Return vector ``x`` of the inertial frame as the turning frame has it at ``t``."""
    return np.array(rotate(from_rotation_vector((-W[0] * t, -W[1] * t, -W[2] * t)), tuple(map(float, x))))


def test_on_a_turntable_what_rests_is_thrown_outward_and_what_moves_is_turned_right(view: Any) -> None:
    law = RotatingFrame(angular_velocity=(0, 0, "2 rad/s"))
    force = law.force(view(position=[(3, 0, 1), (0, 0, 0)], velocity=[(0, 0, 0), (1, 0, 5)], mass=[0.5, 0.5]))
    np.testing.assert_allclose(force, [(6, 0, 0), (0, -2, 0)], atol=1e-15)


@given(x=vector, w=vector, m=st.floats(0.1, 10))
def test_the_centrifugal_force_is_the_downhill_slope_of_the_potential(
    view: Any, minus_gradient: Any, x: Any, w: Any, m: float
) -> None:
    law = RotatingFrame(angular_velocity=w, point=P)
    slope = minus_gradient(lambda x: law.potential(view(position=x, mass=m)), np.array([x]))
    force = law.force(view(position=x, velocity=STILL, mass=m))
    np.testing.assert_allclose(force, slope, atol=1e-9 * max(1.0, np.abs(force).max()))


@given(v=vector, w=vector)
def test_the_coriolis_force_does_no_work(view: Any, v: Any, w: Any) -> None:
    force = RotatingFrame(angular_velocity=w).force(view(position=STILL, velocity=v, mass=1.0))
    assert abs((force * np.array(v)).sum()) <= 1e-12 * max(1.0, np.abs(force).max() * np.abs(v).max())


def straight(n: int, stepper: str = "core:midpoint") -> tuple[xp.PhysicsEngine, xp.PhysicalObject, float]:
    """A body that flies straight in the inertial frame, as the turning frame has it after 1 s; and the drift of its energy."""
    engine = xp.PhysicsEngine(up="z", stepper=stepper)
    law = engine.add_law("basic:rotating_frame", angular_velocity=W, point=P)
    x, v = np.array((1.0, 2.0, 0.0)), np.array((-1.0, 0.5, 0.7))
    body = engine.add_object(xp.PhysicalObject(mass=2.0, position=x + P, velocity=v - np.cross(W, x)), laws=[law])
    before = engine.energy().balance
    engine.run(until=1.0, dt=1 / n)
    return engine, body, abs(engine.energy().balance - before)


def order_two(error: Callable[[int], float], bar: float) -> None:
    """Hold that the error falls with the square of the step, below ``bar``."""
    errors = [error(n) for n in (32, 64, 128)]
    assert errors[2] < bar
    for coarse, fine in pairwise(errors):
        assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.15)


def test_a_straight_line_of_the_inertial_frame_is_followed_with_order_two_or_exactly() -> None:
    x, v = np.array((1.0, 2.0, 0.0)), np.array((-1.0, 0.5, 0.7))
    where = seen(x + v, 1.0)
    speed = seen(v, 1.0) - np.cross(W, where)
    _, body, drift = straight(1, "")
    assert body.position == pytest.approx(where + P, abs=1e-14)
    assert body.velocity == pytest.approx(speed, abs=1e-14)
    assert drift < 1e-13
    order_two(lambda n: math.dist(straight(n)[1].position, where + P), 1e-3)
    order_two(lambda n: math.dist(straight(n)[1].velocity, speed), 1e-3)


def test_kinetic_and_centrifugal_energy_are_kept_together_with_the_order_of_the_stepper() -> None:
    errors = [straight(n)[2] for n in (32, 64, 128)]
    assert errors[2] < 1e-3  # of 11 J
    assert all(coarse / fine > 3 for coarse, fine in pairwise(errors))


def spinning(n: int, shape: xp.Box | xp.Sphere) -> tuple[xp.PhysicalObject, xp.PhysicalObject]:
    """A free spinning body after 1 s in both frames: turning, and inertial (in closed form)."""
    own = (1.0, -0.5, 2.0)
    found = []
    for turning in (True, False):
        engine = xp.PhysicsEngine(up="z")
        laws = [engine.add_law("basic:rotating_frame", angular_velocity=W)] if turning else []
        omega = np.array(own) if turning else np.add(own, W)
        body = xp.PhysicalObject(shape, mass=3.0, angular_velocity=omega, velocity=(0, 0, 0))
        found.append(engine.add_object(body, laws=laws))
        engine.run(until=1.0, dt=1 / n if turning else None)
    return found[0], found[1]


@pytest.mark.parametrize("shape", [xp.Sphere(0.5), xp.Box((1, 2, 3))], ids=["a ball", "a box"])
def test_a_free_gyroscope_keeps_its_direction_among_the_stars_with_order_two(shape: Any) -> None:
    """Foucault's gyroscope of 1852."""

    def spin(n: int) -> float:
        here, there = spinning(n, shape)
        return math.dist(here.angular_velocity, seen(there.angular_velocity, 1.0) - W)

    def turned(n: int) -> float:
        here, there = spinning(n, shape)
        axis = (1.0, 2.0, 2.0)
        return math.dist(rotate(here.orientation, axis), seen(rotate(there.orientation, axis), 1.0))

    order_two(spin, 1e-3)
    order_two(turned, 1e-3)


def test_a_ball_that_does_not_spin_feels_exactly_no_torque() -> None:
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("basic:rotating_frame", angular_velocity=W)
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(1, 0, 0)), laws=[law])
    point = engine.add_object(xp.PhysicalObject(position=(2, 0, 0)), laws=[law])
    engine.run(until=1.0, dt=0.1)
    for body in (ball, point):
        assert body.orientation == (1.0, 0.0, 0.0, 0.0)
        assert body.angular_velocity == STILL


def test_what_rests_among_the_stars_is_seen_to_circle() -> None:
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("basic:rotating_frame", angular_velocity=(0, 0, 1.0))
    star = engine.add_object(xp.PhysicalObject(position=(2, 0, 0), velocity=(0, -2, 0)), laws=[law])
    engine.run(until=math.pi / 2, dt=math.pi / 2000)
    np.testing.assert_allclose(star.position, (0, -2, 0), atol=1e-5)
