"""A damper that holds objects back from moving to and from a point."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import xpheve as xp
from xpheve_laws_basic import DamperToPoint

number = st.floats(-10, 10)
vector = st.tuples(number, number, number)


def test_it_resists_coming_and_going_but_not_circling(view: Any) -> None:
    law = DamperToPoint(damping=2.0, anchor=(1, 0, 0))
    force = law.force(view(position=[(2, 0, 0)] * 2, velocity=[(3, 0, 0), (0, 5, 0)]))
    np.testing.assert_allclose(force, [(-6, 0, 0), (0, 0, 0)], atol=1e-15)


@given(x=vector, p=vector, v=vector)
def test_it_never_does_positive_work(view: Any, x: Any, p: Any, v: Any) -> None:
    force = DamperToPoint(damping=2.0, anchor=p).force(view(position=x, velocity=v))
    power = float((force * np.array(v)).sum())
    assert power <= 1e-12 * (1 + np.abs(force).max() * np.abs(v).max())


def test_at_the_point_it_has_no_direction_and_no_force(view: Any) -> None:
    assert np.array_equal(DamperToPoint().force(view(position=(0, 0, 0), velocity=(1, 0, 0))), [(0, 0, 0)])


def coast(dt: float) -> float:
    """Return how far from the point a body of 2 kg is after 1 s of c = 3 N s/m, from 1 m, at 4 m/s outward."""
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("basic:damper_to_point", damping=3.0)
    body = engine.add_object(xp.PhysicalObject(mass=2.0, position=(1, 0, 0), velocity=(4, 0, 0)), laws=[law])
    engine.run(until=1.0, dt=dt)
    return float(body.position[0])


def test_a_body_leaving_the_point_slows_down_as_the_exponential_with_order_two() -> None:
    tau = 2.0 / 3.0
    expected = 1 + 4 * tau * (1 - math.exp(-1 / tau))
    errors = [abs(coast(1 / n) - expected) for n in (32, 64, 128)]
    assert errors[2] < 1e-4
    for coarse, fine in pairwise(errors):
        assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)


def test_the_work_is_reported_so_that_the_books_balance() -> None:
    engine = xp.PhysicsEngine(up="z")
    laws = [
        engine.add_law("basic:spring_to_point", stiffness=8.0, rest_length=0.5),
        engine.add_law("basic:damper_to_point"),
    ]
    engine.add_object(xp.PhysicalObject(mass=2.0, position=(2, 0, 0), velocity=(0, 3, 0)), laws=laws)
    before = engine.energy().total
    engine.run(until=2.0, dt=1e-3)
    energy = engine.energy()
    assert energy.work < 0
    assert energy.total - before == pytest.approx(energy.work, rel=1e-4)
