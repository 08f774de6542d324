"""Lift on a spinning ball."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import LawFailedError
from xpheve_laws_basic import Magnus

number = st.floats(-10, 10)
vector = st.tuples(number, number, number)


def test_the_force_in_slow_flow_is_pi_rho_r_cubed_spin_cross_velocity(view: Any) -> None:
    r, rho = 0.11, 1.2
    body = view(
        velocity=(20, 0, 0), angular_velocity=(0, 0, 50), volume=4 / 3 * math.pi * r**3, displaced_volume=math.nan
    )
    force = Magnus(density=rho).force(body)
    np.testing.assert_allclose(force, [(0, math.pi * rho * r**3 * 50 * 20, 0)], rtol=1e-14)


def test_backspin_lifts_and_topspin_drops_a_ball(view: Any) -> None:
    # To the right along x with up z: backspin turns about -y.
    body = view(
        velocity=[(30, 0, 0)] * 2,
        angular_velocity=[(0, -100, 0), (0, 100, 0)],
        displaced_volume=[1e-4, 1e-4],
        volume=[math.nan] * 2,
    )
    lift = Magnus().force(body)[:, 2]
    assert lift[0] == -lift[1] > 0


@given(v=vector, w=vector)
def test_it_does_no_work(view: Any, v: Any, w: Any) -> None:
    force = Magnus().force(view(velocity=v, angular_velocity=w, displaced_volume=1.0, volume=math.nan))
    assert abs((force * np.array(v)).sum()) <= 1e-12 * max(1.0, np.abs(force).max() * np.abs(v).max())


def circle(steps: int) -> tuple[xp.PhysicsEngine, xp.PhysicalObject]:
    """Return engine and ball after a quarter of its circle: C rho V w/m = 4 rad/s."""
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("basic:magnus", coefficient=0.5, density=2.0)
    ball = xp.PhysicalObject(
        xp.Sphere(0.5), mass=1.5, displaced_volume=0.6, angular_velocity=(0, 0, 10.0), velocity=(3, 0, 0)
    )
    engine.add_object(ball, laws=[law])
    engine.run(until=math.pi / 8, dt=math.pi / 8 / steps)
    return engine, ball


def test_a_ball_with_its_spin_across_its_way_circles_with_order_two() -> None:
    found = [circle(n) for n in (32, 64, 128)]
    errors = [math.dist(ball.position, (0.75, 0.75, 0)) for _, ball in found]
    assert errors[2] < 1e-3
    for coarse, fine in pairwise(errors):
        assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)
    energy = found[2][0].energy()
    grown = (1 + (4 * math.pi / 8 / 128) ** 4 / 4) ** 128  # as with a magnetic field
    assert energy.kinetic - 0.5 * 0.4 * 1.5 * 0.25 * 100 == pytest.approx(6.75 * grown, rel=1e-10)
    assert energy.work == 0.0


def test_a_spin_along_the_way_does_nothing() -> None:
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("basic:magnus")
    ball = xp.PhysicalObject(xp.Sphere(0.1), angular_velocity=(50, 0, 0), velocity=(30, 0, 0))
    engine.add_object(ball, laws=[law])
    engine.run(until=1.0, dt=0.1)
    assert ball.velocity == (30.0, 0.0, 0.0)


def test_a_point_without_a_volume_is_an_error_that_says_what_is_needed() -> None:
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("basic:magnus")
    with pytest.raises(LawFailedError, match=r"dot has no displaced_volume"):
        engine.add_object(xp.PhysicalObject(name="dot"), laws=[law])
        engine.run(until=1.0, dt=0.1)
