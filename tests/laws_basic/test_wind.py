"""Air resistance in a wind."""

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
from xpheve_laws_basic import QuadraticDrag, Wind

number = st.floats(-1e3, 1e3)
vector = st.tuples(number, number, number)
K = 0.5 * 1.225 * 0.47


def test_a_body_at_rest_is_pushed_with_half_rho_c_a_w_squared_along_the_wind(view: Any) -> None:
    force = Wind(velocity=(3, 0, -4)).force(view(velocity=[(0, 0, 0), (3, 0, -4)], drag_area=[0.1, 0.2]))
    np.testing.assert_allclose(force, [(15 * K * 0.1, 0, -20 * K * 0.1), (0, 0, 0)], rtol=1e-15)


@given(v=vector, w=vector, area=st.floats(0, 1e3))
def test_it_is_quadratic_drag_in_the_frame_of_the_air(view: Any, v: Any, w: Any, area: float) -> None:
    wind = Wind(velocity=w).force(view(velocity=v, drag_area=area))
    drag = QuadraticDrag().force(view(velocity=np.subtract(v, w), drag_area=area))
    assert np.array_equal(wind, drag)


@given(v=vector, w=vector, area=st.floats(0, 1e3))
def test_in_the_frame_of_the_air_it_never_does_positive_work(view: Any, v: Any, w: Any, area: float) -> None:
    force = Wind(velocity=w).force(view(velocity=v, drag_area=area))
    assert (force * np.subtract(v, w)).sum() <= 0


def blown(dt: float) -> xp.PhysicalObject:
    """Return a body of 2 kg after 1 s from rest in a wind of 30 m/s; 1/2 rho C A = 0.1 kg/m."""
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("basic:wind", velocity=(30, 0, 0))
    body = engine.add_object(xp.PhysicalObject(mass=2.0, drag_area=0.1 / K), laws=[law])
    engine.run(until=1.0, dt=dt)
    return body


def test_a_body_from_rest_catches_up_with_the_wind_by_the_closed_form_with_order_two() -> None:
    beta = 0.1 / 2 * 30  # [1/s]: w - v = w/(1 + beta t), w t - x = w/beta ln(1 + beta t)
    speed, way = 30 - 30 / (1 + beta), 30 - 30 / beta * math.log(1 + beta)
    bodies = [blown(1 / n) for n in (64, 128, 256)]
    for errors in ([abs(b.velocity[0] - speed) for b in bodies], [abs(b.position[0] - way) for b in bodies]):
        assert errors[2] < 1e-3
        for coarse, fine in pairwise(errors):
            assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)


def test_a_wind_that_turns_takes_effect_at_that_instant() -> None:
    engine = xp.PhysicsEngine(up="z")
    law: Any = engine.add_law("basic:wind", velocity=(5, 0, 0))
    body = engine.add_object(xp.PhysicalObject(mass=1.0, drag_area=0.1, velocity=(5, 0, 0)), laws=[law])
    engine.run(until=1.0, dt=0.1)
    assert body.velocity == (5.0, 0.0, 0.0)
    law.velocity = (5, 2, 0)
    engine.run(until=2.0, dt=0.1)
    assert body.velocity[1] > 0
    assert body.velocity[0] == 5.0


def test_an_object_without_an_area_is_an_error_that_says_so() -> None:
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("basic:wind")
    with pytest.raises(LawFailedError, match=r"leaf has no drag_area.*drag_area=\.\.\."):
        engine.add_object(xp.PhysicalObject(name="leaf"), laws=[law])
        engine.run(until=1.0, dt=0.1)
