"""A spring between two objects."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import xpheve as xp
from xpheve_laws_basic import Spring

number = st.floats(-10, 10)
vector = st.tuples(number, number, number)


def test_a_stretched_spring_pulls_and_a_compressed_one_pushes(view: Any) -> None:
    law = Spring(stiffness=2.0, rest_length=1.0)
    a, b = view(position=[(3, 0, 0), (0, 0.5, 0)]), view(position=[(0, 0, 0), (0, 0, 0)])
    np.testing.assert_allclose(law.force(a, b), [(-4, 0, 0), (0, 1, 0)], rtol=1e-15)


@given(x=vector, y=vector, rest=st.floats(0, 5))
def test_action_is_opposite_and_equal_to_reaction(view: Any, x: Any, y: Any, rest: float) -> None:
    law = Spring(stiffness=2.0, rest_length=rest)
    a, b = view(position=x), view(position=y)
    assert np.array_equal(law.force(a, b), -law.force(b, a))


@given(x=vector, y=vector, rest=st.floats(0, 5))
def test_force_is_the_downhill_slope_of_the_potential(
    view: Any, minus_gradient: Any, x: Any, y: Any, rest: float
) -> None:
    assume(math.dist(x, y) > 1.0)
    law = Spring(stiffness=2.0, rest_length=rest)
    slope = minus_gradient(lambda x: law.potential(view(position=x), view(position=y)), np.array([x]))
    np.testing.assert_allclose(law.force(view(position=x), view(position=y)), slope, atol=1e-6)


@pytest.mark.parametrize("rest", [0.0, 1.0])
@pytest.mark.parametrize("length", [0.0, 5e-324, 1e-170, 1e-150, 1e-140])
def test_the_force_of_a_spring_of_no_length_is_finite(view: Any, rest: float, length: float) -> None:
    force = Spring(rest_length=rest).force(view(position=(length, 0, 0)), view(position=(0, 0, 0)))
    assert np.isfinite(force).all()
    assert np.linalg.norm(force) <= rest + length
    if length == 0:
        assert np.array_equal(force, [(0, 0, 0)])


def pair(dt: float) -> tuple[Any, Any]:
    """Return engine and lighter one of bodies of 1 and 3 kg after 1 s on a spring (omega = 2/s) stretched by 0.5 m."""
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("basic:spring", stiffness=3.0, rest_length=1.0)
    light = engine.add_object(xp.PhysicalObject(mass=1.0), laws=[law])
    engine.add_object(xp.PhysicalObject(mass=3.0, position=(1.5, 0, 0)), laws=[law])
    engine.run(until=1.0, dt=dt)
    return engine, light


def test_two_bodies_swing_about_their_centre_of_mass_with_order_two() -> None:
    # Reduced mass 3/4 kg; the centre of mass rests at 1.125 m; the light body is 3/4 of the distance away from it.
    expected = 1.125 - 0.75 * (1.0 + 0.5 * math.cos(2.0))
    errors = [abs(pair(1 / n)[1].position[0] - expected) for n in (16, 32, 64)]
    assert errors[2] < 1e-4
    for coarse, fine in pairwise(errors):
        assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)


def test_momentum_is_kept_to_rounding_and_energy_to_order_two() -> None:
    engine, _ = pair(0.01)
    np.testing.assert_allclose(engine.momentum(), (0, 0, 0), atol=1e-14)
    assert engine.energy().total == pytest.approx(0.5 * 3.0 * 0.5**2, rel=1e-3)
