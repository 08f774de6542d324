"""A spring that holds objects to a point of the world."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import xpheve as xp
from xpheve_laws_basic import SpringToPoint

number = st.floats(-10, 10)
vector = st.tuples(number, number, number)


def test_force_is_k_times_the_stretch_towards_the_point(view: Any) -> None:
    law = SpringToPoint(stiffness=2.0, rest_length=1.0, anchor=(1, 1, 1))
    force = law.force(view(position=[(4, 1, 1), (1, 1.5, 1)]))
    np.testing.assert_allclose(force, [(-4, 0, 0), (0, 1, 0)], rtol=1e-15)


@given(x=vector, p=vector, rest=st.floats(0, 5))
def test_force_is_the_downhill_slope_of_the_potential(
    view: Any, minus_gradient: Any, x: Any, p: Any, rest: float
) -> None:
    assume(math.dist(x, p) > 1.0)
    law = SpringToPoint(stiffness=2.0, rest_length=rest, anchor=p)
    slope = minus_gradient(lambda x: law.potential(view(position=x)), np.array([x]))
    np.testing.assert_allclose(law.force(view(position=x)), slope, atol=1e-6)


@pytest.mark.parametrize("rest", [0.0, 1.0])
@pytest.mark.parametrize("length", [0.0, 5e-324, 1e-170, 1e-150, 1e-140])
def test_the_force_of_a_spring_of_no_length_is_finite(view: Any, rest: float, length: float) -> None:
    force = SpringToPoint(rest_length=rest).force(view(position=(length, 0, 0)))
    assert np.isfinite(force).all()
    assert np.linalg.norm(force) <= rest + length
    if length == 0:
        assert np.array_equal(force, [(0, 0, 0)])


def swing(dt: float, stepper: str = "core:midpoint") -> Any:
    """Return engine and body of 2 kg on a spring of 8 N/m (omega = 2/s), thrown out of its ellipse, after 1 s."""
    engine = xp.PhysicsEngine(up="z", stepper=stepper)
    law = engine.add_law("basic:spring_to_point", stiffness=8.0, anchor=(1, 0, 0))
    ball = engine.add_object(xp.PhysicalObject(mass=2.0, position=(2, 0, 0), velocity=(0, 3, 0)), laws=[law])
    engine.run(until=1.0, dt=dt)
    return engine, ball


def test_a_body_on_a_spring_without_length_runs_on_an_ellipse_with_order_two_or_exactly() -> None:
    expected = (1 + math.cos(2.0), 1.5 * math.sin(2.0), 0.0)
    assert swing(0.5, "")[1].position == pytest.approx(expected, abs=1e-15)
    errors = [math.dist(swing(1 / n)[1].position, expected) for n in (16, 32, 64)]
    assert errors[2] < 1e-3
    for coarse, fine in pairwise(errors):
        assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)


def test_energy_does_not_drift() -> None:
    """Leapfrog keeps an energy near the true one: its error swings and does not grow."""
    engine, _ = swing(0.01)
    before = 0.5 * 2 * 9 + 0.5 * 8 * 1
    errors = []
    for until in (2.0, 20.0):
        engine.run(until=until, dt=0.01)
        errors.append(abs(engine.energy().total / before - 1))
    assert max(errors) < 1e-3


def test_a_spring_hangs_where_it_balances_the_weight() -> None:
    engine = xp.PhysicsEngine(up="z")
    laws = [
        engine.add_law("basic:spring_to_point", stiffness=50.0, rest_length=1.0),
        engine.add_law("basic:damper_to_point", damping=10.0),
        engine.add_law("basic:planet_gravity"),
    ]
    weight = engine.add_object(xp.PhysicalObject(mass=1.0, position=(0, 0, -1.0)), laws=laws)
    engine.run(until=10.0, dt=0.01)
    assert weight.position[2] == pytest.approx(-1.0 - 9.81 / 50.0, rel=1e-12)
