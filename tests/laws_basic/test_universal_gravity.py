"""Newton's gravity between bodies."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import xpheve as xp
from xpheve_laws_basic import UniversalGravity

number = st.floats(-10, 10)
vector = st.tuples(number, number, number)


def test_the_earth_pulls_with_9_8_newtons_a_kilogram(view: Any) -> None:
    law = UniversalGravity()
    apple = view(position=(6.371e6, 0, 0), mass=1.0)
    earth = view(position=(0, 0, 0), mass=5.9722e24)
    expected = -6.67430e-11 * 5.9722e24 / 6.371e6**2
    np.testing.assert_allclose(law.force(apple, earth), [[expected, 0, 0]], rtol=1e-15)
    assert expected == pytest.approx(-9.82, abs=0.01)


@given(x=vector, y=vector, s=st.floats(0, 2))
def test_action_is_opposite_and_equal_to_reaction(view: Any, x: Any, y: Any, s: float) -> None:
    assume(s > 0.01 or math.dist(x, y) > 0.01)
    law = UniversalGravity(gravitational_constant=1.0, softening=s)
    a, b = view(position=x, mass=2.0), view(position=y, mass=3.0)
    np.testing.assert_allclose(law.force(a, b), -law.force(b, a), rtol=1e-14)


@given(x=vector, y=vector, s=st.floats(0, 2))
def test_force_is_the_downhill_slope_of_the_potential(view: Any, minus_gradient: Any, x: Any, y: Any, s: float) -> None:
    assume(math.dist(x, y) > 1.0)
    law = UniversalGravity(gravitational_constant=1.0, softening=s)
    b = view(position=y, mass=3.0)
    slope = minus_gradient(lambda x: law.potential(view(position=x, mass=2.0), b), np.array([x]))
    np.testing.assert_allclose(law.force(view(position=x, mass=2.0), b), slope, atol=1e-6)


def test_softened_bodies_in_one_place_do_not_pull(view: Any) -> None:
    law = UniversalGravity(softening=0.1)
    both = view(position=(1, 2, 3), mass=1.0)
    assert np.array_equal(law.force(both, both), [[0, 0, 0]])


def orbit(dt: float) -> tuple[Any, tuple[float, float, float]]:
    """Run the lighter of two bodies a quarter of its circle around the other; returns engine and final position."""
    engine = xp.PhysicsEngine(up="z", stepper="core:midpoint")
    law = engine.add_law("basic:universal_gravity", gravitational_constant=1.0)
    # In the frame of the centre of mass: distance 1, masses 3 and 1, so that omega^2 = G (m_a + m_b) / d^3 = 4.
    engine.add_object(xp.PhysicalObject(mass=3.0, position=(-0.25, 0, 0), velocity=(0, -0.5, 0)), laws=[law])
    moon = engine.add_object(xp.PhysicalObject(mass=1.0, position=(0.75, 0, 0), velocity=(0, 1.5, 0)), laws=[law])
    engine.run(until=math.pi / 4, dt=dt)
    return engine, moon.position


def test_two_bodies_circle_each_other_with_order_two() -> None:
    errors = [math.dist(orbit(math.pi / 4 / n)[1], (0, 0.75, 0)) for n in (16, 32, 64)]
    assert errors[2] < 1e-3
    for coarse, fine in pairwise(errors):
        assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)


def test_momentum_is_kept_to_rounding() -> None:
    engine, _ = orbit(math.pi / 64)
    np.testing.assert_allclose(engine.momentum(), (0, 0, 0), atol=1e-13)


def test_a_planet_pulls_dust_that_does_not_pull_itself() -> None:
    engine = xp.PhysicsEngine(up="z")
    planet = engine.add_object(xp.PhysicalObject(mass=1e3, fixed=True))
    dust = [engine.add_object(xp.PhysicalObject(mass=1.0, position=(x, 0, 0))) for x in (10.0, 20.0)]
    engine.add_law("basic:universal_gravity", gravitational_constant=1.0, between=([planet], dust))
    engine.run(until=0.01, dt=0.001)
    np.testing.assert_allclose([grain.velocity[0] for grain in dust], [-1e3 / 100 * 0.01, -1e3 / 400 * 0.01], rtol=1e-3)
    assert planet.position == (0, 0, 0)
