"""Air resistance."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import LawFailedError, ParameterError
from xpheve_laws_basic import QuadraticDrag

number = st.floats(-1e75, 1e75)  # the square of a speed is as large as floats allow
vector = st.tuples(number, number, number)
K = 0.5 * 1.225 * 0.47


def test_drag_is_half_rho_c_a_v_squared_against_the_velocity(view: Any) -> None:
    force = QuadraticDrag().force(view(velocity=[(3, 0, -4), (0, 0, 0)], drag_area=[0.1, 0.2]))
    np.testing.assert_allclose(force, [(-15 * K * 0.1, 0, 20 * K * 0.1), (0, 0, 0)], rtol=1e-15)


@given(v=vector, area=st.floats(0, 1e3))
def test_drag_never_does_positive_work_and_opposes_the_velocity(view: Any, v: Any, area: float) -> None:
    velocity = np.array(v)
    force = QuadraticDrag().force(view(velocity=v, drag_area=area))
    assert (force * velocity).sum() <= 0
    np.testing.assert_allclose(np.cross(force, velocity), 0, atol=1e-14 * np.abs(force).max() * np.abs(velocity).max())


def coast(dt: float) -> xp.PhysicalObject:
    """Return a body of 2 kg after 1 s of drag, from 30 m/s; 1/2 rho C A = 0.1 kg/m."""
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("basic:quadratic_drag")
    body = engine.add_object(xp.PhysicalObject(mass=2.0, velocity=(30, 0, 0), drag_area=0.1 / K), laws=[law])
    engine.run(until=1.0, dt=dt)
    return body


def test_speed_and_way_follow_the_closed_form_with_order_two() -> None:
    beta = 0.1 / 2 * 30  # [1/s]: v = v0 / (1 + beta t), x = v0/beta ln(1 + beta t)
    speed, way = 30 / (1 + beta), 30 / beta * math.log(1 + beta)
    bodies = [coast(1 / n) for n in (64, 128, 256)]
    for errors in ([abs(b.velocity[0] - speed) for b in bodies], [abs(b.position[0] - way) for b in bodies]):
        assert errors[2] < 1e-3
        for coarse, fine in pairwise(errors):
            assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)


def test_a_falling_sphere_reaches_terminal_speed() -> None:
    engine = xp.PhysicsEngine(up="z")
    laws = [engine.add_law("basic:quadratic_drag"), engine.add_law("basic:planet_gravity")]
    r, m = 0.1, 0.5
    area = math.pi * r**2
    ball = engine.add_object(xp.PhysicalObject(mass=m, drag_area=area), laws=laws)
    engine.run(until=40.0, dt=0.02)
    expected = math.sqrt(m * 9.81 / (K * area))  # where drag equals weight
    assert -ball.velocity[2] == pytest.approx(expected, rel=1e-6)


def test_a_fall_from_rest_follows_the_hyperbolic_tangent() -> None:
    engine = xp.PhysicsEngine(up="z")
    laws = [engine.add_law("basic:quadratic_drag"), engine.add_law("basic:planet_gravity")]
    ball = engine.add_object(xp.PhysicalObject(mass=2.0, drag_area=0.1 / K), laws=laws)
    engine.run(until=1.0, dt=1e-3)
    terminal = math.sqrt(2.0 * 9.81 / 0.1)
    assert -ball.velocity[2] == pytest.approx(terminal * math.tanh(9.81 / terminal), rel=1e-6)
    assert -ball.position[2] == pytest.approx(terminal**2 / 9.81 * math.log(math.cosh(9.81 / terminal)), rel=1e-6)


def test_an_object_without_an_area_is_an_error_not_a_body_without_drag() -> None:
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("basic:quadratic_drag")
    with pytest.raises(LawFailedError, match="quadratic_drag"):
        engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)), laws=[law])
        engine.run(until=1.0, dt=0.1)


def test_a_negative_area_is_refused() -> None:
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("basic:quadratic_drag")
    with pytest.raises(ParameterError, match="drag_area"):
        engine.add_object(xp.PhysicalObject(drag_area=-1.0), laws=[law])
