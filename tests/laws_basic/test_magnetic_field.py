"""A uniform magnetic field."""

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
from xpheve_laws_basic import MagneticField

number = st.floats(-10, 10)
vector = st.tuples(number, number, number)
OMEGA = 1.5 * 2.0 / 0.5  # [rad/s] = q B/m below


def test_force_is_charge_times_velocity_cross_field(view: Any) -> None:
    force = MagneticField(field=(0, 0, 2)).force(view(velocity=[(1, 0, 5), (0, 1, 0)], charge=[3.0, -1.0]))
    assert np.array_equal(force, [(0, -6, 0), (-2, 0, 0)])


@given(v=vector, b=vector, q=st.floats(-10, 10))
def test_it_does_no_work(view: Any, v: Any, b: Any, q: float) -> None:
    force = MagneticField(field=b).force(view(velocity=v, charge=q))
    assert abs((force * np.array(v)).sum()) <= 1e-12 * max(1.0, np.abs(force).max() * np.abs(v).max())


def circle(
    steps: int, turns: float = 0.25, stepper: str = "core:midpoint"
) -> tuple[xp.PhysicsEngine, xp.PhysicalObject]:
    """Return engine and charge, of 1.5 C and 0.5 kg in 2 T along z, after some turns of ``steps`` steps each."""
    engine = xp.PhysicsEngine(up="z", stepper=stepper)
    law = engine.add_law("basic:magnetic_field", field=("0 T", "0 T", "2 T"))
    body = xp.PhysicalObject(mass=0.5, charge=1.5, velocity=(0, 3.0, 0.5))
    engine.add_object(body, laws=[law])
    period = 2 * math.pi / OMEGA
    engine.run(until=turns * period, dt=period / steps)
    return engine, body


def test_a_charge_gyrates_on_its_radius_with_its_frequency_with_order_two_or_exactly() -> None:
    radius = 3.0 / OMEGA  # m v/(q B); it circles with -q B/m: clockwise around +z
    where = (radius, radius, 0.5 * 0.25 * 2 * math.pi / OMEGA)
    exact = circle(1, stepper="")[1]
    assert exact.position == pytest.approx(where, rel=1e-15)
    assert exact.velocity == pytest.approx((3.0, 0.0, 0.5), abs=1e-15)
    bodies = [circle(n)[1] for n in (128, 256, 512)]
    for errors in (
        [math.dist(body.position, where) for body in bodies],
        [math.dist(body.velocity, (3.0, 0.0, 0.5)) for body in bodies],
    ):
        assert errors[2] < 1e-3
        for coarse, fine in pairwise(errors):
            assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)
    assert [body.velocity[2] for body in bodies] == [0.5, 0.5, 0.5], "along the field it flies on freely"


def test_energy_grows_by_what_the_page_of_the_law_says_and_no_more() -> None:
    steps, turns = 100, 3
    engine, _ = circle(steps, turns)
    across = 0.5 * 0.5 * 9.0
    grown = (1 + (2 * math.pi / steps) ** 4 / 4) ** (steps * turns)
    energy = engine.energy()
    assert energy.kinetic - 0.5 * 0.5 * 0.25 == pytest.approx(across * grown, rel=1e-10)
    assert energy.work == 0.0, "so that the balance shows the stepper's error"
    assert grown - 1 == pytest.approx(turns * 4e-4, rel=0.05)


def test_with_an_electric_field_across_it_drifts_by_e_cross_b_over_b_squared() -> None:
    engine = xp.PhysicsEngine(up="z")
    laws = [
        engine.add_law("basic:magnetic_field", field=(0, 0, 2.0)),
        engine.add_law("basic:electric_field", field=(0, 3.0, 0)),
    ]
    charges = [
        engine.add_object(xp.PhysicalObject(mass=0.5, charge=q, position=(0, 0, z)), laws=laws)
        for z, q in enumerate((1.5, -1.5))
    ]
    period = 2 * math.pi / OMEGA
    engine.run(until=4 * period, dt=period / 1000)
    for charge in charges:  # a cycloid: at rest again after each turn, whatever the sign
        assert charge.position[0] == pytest.approx(3.0 / 2.0 * 4 * period, rel=1e-4)
        np.testing.assert_allclose(charge.velocity, (0, 0, 0), atol=1e-3)


def test_an_object_that_does_not_say_its_charge_is_an_error_that_says_so() -> None:
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("basic:magnetic_field", field=(1, 0, 0))
    with pytest.raises(LawFailedError, match="dust has no charge"):
        engine.add_object(xp.PhysicalObject(name="dust"), laws=[law])
        engine.run(until=1.0, dt=0.1)
