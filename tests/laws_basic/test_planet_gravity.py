"""Uniform gravity."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import ParameterError
from xpheve_laws_basic import PlanetGravity

number = st.floats(-1e3, 1e3)
vector = st.tuples(number, number, number)


def test_weight_is_mass_times_g_against_up(view: Any) -> None:
    law = PlanetGravity()
    force = law.force(view(mass=[1.0, 2.5], up=(0, 1, 0)))
    assert np.array_equal(force, [[0, -9.81, 0], [0, -9.81 * 2.5, 0]])


def test_it_reads_nothing_that_flight_changes_so_that_it_is_stored(view: Any) -> None:
    for law in (PlanetGravity(), PlanetGravity(direction=(1, 0, 0))):
        reads: set[str] = set()
        law.force(view(mass=1.0, reads=reads))
        assert reads <= {"mass", "up"}


def test_a_direction_counts_whatever_its_length(view: Any) -> None:
    law = PlanetGravity(direction=(0, 3e-200, -4e-200), acceleration=10.0)
    np.testing.assert_allclose(law.force(view(mass=2.0)), [[0, 12, -16]], rtol=1e-15)


def test_a_direction_to_nowhere_is_refused_and_changes_nothing() -> None:
    with pytest.raises(ParameterError, match="points nowhere"):
        PlanetGravity(direction=(0, 0, 0))
    law = PlanetGravity(direction=(0, 0, 2))
    with pytest.raises(ParameterError, match="points nowhere"):
        law.direction = (0, 0, 0)
    assert law.direction == (0, 0, 1)


@given(vector.filter(any))
def test_a_direction_read_back_and_set_again_is_the_same_to_the_bit(direction: tuple[float, float, float]) -> None:
    law = PlanetGravity(direction=direction)
    kept = law.direction
    assert math.hypot(*kept) == pytest.approx(1.0, abs=1e-15)
    assert PlanetGravity(direction=kept).direction == kept


@given(x=vector, m=st.floats(1e-3, 1e3), direction=st.none() | vector.filter(any))
def test_force_is_the_downhill_slope_of_the_potential(
    view: Any, minus_gradient: Any, x: Any, m: float, direction: Any
) -> None:
    law = PlanetGravity(direction=direction)
    x = np.array([x])
    slope = minus_gradient(lambda x: law.potential(view(position=x, mass=m)), x)
    np.testing.assert_allclose(law.force(view(mass=m)), slope, atol=1e-8 * m * 9.81)


def test_a_thrown_ball_flies_its_parabola_exactly() -> None:
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", acceleration=9.81)
    ball = engine.add_object(xp.PhysicalObject(mass=3.0, position=(1, 2, 3), velocity=(4, -5, 6)), laws=[gravity])
    engine.run(until=7.0)
    t = 7.0
    expected = (1 + 4 * t, 2 - 5 * t, 3 + 6 * t - 0.5 * 9.81 * t * t)
    np.testing.assert_allclose(ball.position, expected, rtol=1e-14)
    np.testing.assert_allclose(ball.velocity, (4, -5, 6 - 9.81 * t), rtol=1e-14)
    assert gravity.evaluations <= 1, "the force is stored; nothing is evaluated on the way"


@pytest.mark.parametrize("dt", [None, 0.1, 1 / 240])
def test_a_stored_force_is_exact_whatever_the_step(dt: float | None) -> None:
    engine = xp.PhysicsEngine(up="z")
    ball = engine.add_object(xp.PhysicalObject(mass=2.0), laws=[engine.add_law("basic:planet_gravity")])
    engine.run(until=1.0, dt=dt)
    assert ball.position[2] == pytest.approx(-0.5 * 9.81, rel=1e-12)


def test_energy_is_kept() -> None:
    engine = xp.PhysicsEngine(up="y")
    gravity = engine.add_law("basic:planet_gravity")
    engine.add_object(xp.PhysicalObject(mass=2.0, position=(0, 10, 0), velocity=(1, 2, 3)), laws=[gravity])
    before = engine.energy().total
    assert before == pytest.approx(2 * 9.81 * 10 + 14, rel=1e-14)
    engine.run(until=10.0)
    assert engine.energy().total == pytest.approx(before, rel=1e-12)


def test_changing_g_in_flight_takes_effect_at_that_instant() -> None:
    engine = xp.PhysicsEngine(up="z")
    gravity: Any = engine.add_law("basic:planet_gravity", acceleration=10.0)
    ball = engine.add_object(xp.PhysicalObject(mass=2.0), laws=[gravity])
    engine.run(until=1.0)
    gravity.acceleration = 4.0
    engine.run(until=3.0)
    assert ball.position[2] == pytest.approx(-5 - 10 * 2 - 0.5 * 4 * 4, rel=1e-12)
