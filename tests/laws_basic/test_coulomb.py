"""The electric force between charges."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import LawFailedError, ParameterError
from xpheve_laws_basic import Coulomb

number = st.floats(-10, 10)
vector = st.tuples(number, number, number)
K = 8.9875517923e9


def test_two_coulombs_a_metre_apart_push_with_k_newtons(view: Any) -> None:
    a, b = view(position=(1, 0, 0), charge=1.0), view(position=(0, 0, 0), charge=1.0)
    assert np.array_equal(Coulomb().force(a, b), [(K, 0, 0)])
    in_water = Coulomb(relative_permittivity=80.0).force(a, b)
    np.testing.assert_allclose(in_water, [(K / 80, 0, 0)], rtol=1e-15)


def test_k_is_one_over_four_pi_epsilon_zero_and_c_squared_times_1e_7_to_its_digits() -> None:
    assert pytest.approx(1 / (4 * math.pi * 8.8541878128e-12), rel=2e-10) == K
    assert pytest.approx(299792458.0**2 * 1e-7, rel=1e-9) == K


@given(x=vector, y=vector, p=number, q=number, s=st.floats(0, 2))
def test_action_is_opposite_and_equal_to_reaction(view: Any, x: Any, y: Any, p: float, q: float, s: float) -> None:
    assume(s > 0.01 or math.dist(x, y) > 0.01)
    law = Coulomb(coulomb_constant=1.0, softening=s)
    a, b = view(position=x, charge=p), view(position=y, charge=q)
    np.testing.assert_allclose(law.force(a, b), -law.force(b, a), rtol=1e-14)
    along = (law.force(a, b) * np.subtract(x, y)).sum()
    assert along * p * q >= 0, "like charges repel"


@given(x=vector, y=vector, s=st.floats(0, 2))
def test_force_is_the_downhill_slope_of_the_potential(view: Any, minus_gradient: Any, x: Any, y: Any, s: float) -> None:
    assume(math.dist(x, y) > 1.0)
    law = Coulomb(coulomb_constant=1.0, softening=s, relative_permittivity=2.0)
    b = view(position=y, charge=-3.0)
    slope = minus_gradient(lambda x: law.potential(view(position=x, charge=2.0), b), np.array([x]))
    np.testing.assert_allclose(law.force(view(position=x, charge=2.0), b), slope, atol=1e-6)


def atom(dt: float) -> tuple[xp.PhysicsEngine, xp.PhysicalObject]:
    """Run the electron of Bohr's first circle a quarter around a proton that is held."""
    engine = xp.PhysicsEngine(up="z", stepper="core:midpoint")
    e, m, a0 = 1.602176634e-19, 9.1093837015e-31, 5.29177210903e-11
    law = engine.add_law("basic:coulomb")
    engine.add_object(xp.PhysicalObject(mass=1.67e-27, charge=e, fixed=True), laws=[law])
    speed = math.sqrt(K * e * e / (m * a0))
    body = xp.PhysicalObject(mass=m, charge=-e, position=(a0, 0, 0), velocity=(0, speed, 0))
    engine.add_object(body, laws=[law])
    quarter = 0.5 * math.pi * a0 / speed
    engine.run(until=quarter, dt=quarter * dt)
    return engine, body


def test_bohrs_electron_circles_with_order_two_and_keeps_its_energy() -> None:
    a0 = 5.29177210903e-11
    found = [atom(1 / n) for n in (16, 32, 64)]
    errors = [math.dist(body.position, (0, a0, 0)) / a0 for _, body in found]
    assert errors[2] < 1e-3
    for coarse, fine in pairwise(errors):
        assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)
    assert found[2][0].energy().total == pytest.approx(-13.605693 * 1.602176634e-19, rel=1e-6)


def test_two_charges_in_one_place_are_an_error_that_names_the_way_out() -> None:
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("basic:coulomb")
    engine.add_objects([xp.PhysicalObject(charge=1.0) for _ in range(2)], laws=[law])
    with pytest.raises(LawFailedError, match="give the law a softening"):
        engine.run(until=1.0, dt=0.1)


def test_a_permittivity_of_zero_is_refused() -> None:
    with pytest.raises(ParameterError, match="relative_permittivity"):
        Coulomb(relative_permittivity=0.0)
