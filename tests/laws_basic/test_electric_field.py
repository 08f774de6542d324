"""A uniform electric field."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import LawFailedError
from xpheve_laws_basic import ElectricField

number = st.floats(-1e3, 1e3)
vector = st.tuples(number, number, number)


def test_force_is_charge_times_field(view: Any) -> None:
    reads: set[str] = set()
    force = ElectricField(field=(1, -2, 3)).force(view(charge=[2.0, -1.0, 0.0], reads=reads))
    assert np.array_equal(force, [(2, -4, 6), (-1, 2, -3), (0, 0, 0)])
    assert reads == {"charge"}, "nothing that flight changes, so that it is stored"


@given(x=vector, q=st.floats(-10, 10), field=vector)
def test_force_is_the_downhill_slope_of_the_potential(
    view: Any, minus_gradient: Any, x: Any, q: float, field: Any
) -> None:
    law = ElectricField(field=field)
    slope = minus_gradient(lambda x: law.potential(view(position=x, charge=q)), np.array([x]))
    np.testing.assert_allclose(law.force(view(charge=q)), slope, atol=1e-6)


def test_an_electron_between_plates_flies_its_parabola_exactly() -> None:
    q, m = -1.602176634e-19, 9.1093837e-31
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("basic:electric_field", field=("0 V/m", "0 V/m", "2 kV/m"))
    electron = engine.add_object(xp.PhysicalObject(mass=m, velocity=(1e7, 0, 0), charge=q), laws=[law])
    before = engine.energy().total
    t = 3e-9
    engine.run(until=t)
    np.testing.assert_allclose(electron.position, (1e7 * t, 0, 0.5 * q * 2000 / m * t * t), rtol=1e-14)
    np.testing.assert_allclose(electron.velocity, (1e7, 0, q * 2000 / m * t), rtol=1e-14)
    assert engine.energy().total == pytest.approx(before, rel=1e-14)
    assert law.evaluations == 1


def test_a_charge_that_is_set_takes_effect_at_that_instant() -> None:
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("basic:electric_field", field=(1, 0, 0))
    body = engine.add_object(xp.PhysicalObject(charge=2.0), laws=[law])
    engine.run(until=1.0)
    body["charge"] = -1.0
    engine.run(until=3.0)
    assert body.velocity[0] == pytest.approx(0.0, abs=1e-15)


def test_an_object_that_does_not_say_its_charge_is_an_error_that_says_so() -> None:
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("basic:electric_field", field=(1, 0, 0))
    with pytest.raises(LawFailedError, match="dust has no charge"):
        engine.add_object(xp.PhysicalObject(name="dust"), laws=[law])
        engine.run(until=1.0)
