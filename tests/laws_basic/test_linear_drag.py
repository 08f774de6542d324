"""Drag in proportion to speed."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import xpheve as xp
from xpheve_laws_basic import LinearDrag

number = st.floats(-1e100, 1e100)
vector = st.tuples(number, number, number)


def test_drag_is_minus_b_times_velocity(view: Any) -> None:
    law = LinearDrag(coefficient=0.5)
    assert np.array_equal(law.force(view(velocity=[(2, 0, -4), (0, 0, 0)])), [(-1, 0, 2), (0, 0, 0)])


@given(v=vector, b=st.floats(0, 1e6))
def test_drag_never_does_positive_work(view: Any, v: Any, b: float) -> None:
    force = LinearDrag(coefficient=b).force(view(velocity=v))
    assert (force * np.array(v)).sum() <= 0


def coast(dt: float, stepper: str = "") -> xp.PhysicalObject:
    """Return a body of 2 kg after 1 s of b = 3 kg/s, from 4 m/s."""
    engine = xp.PhysicsEngine(up="z", stepper=stepper)
    law = engine.add_law("basic:linear_drag", coefficient=3.0)
    body = engine.add_object(xp.PhysicalObject(mass=2.0, velocity=(4, 0, 0)), laws=[law])
    engine.run(until=1.0, dt=dt)
    return body


def test_speed_and_way_follow_the_exponential_with_order_two_or_exactly() -> None:
    tau = 2.0 / 3.0
    speed, way = 4 * math.exp(-1 / tau), 4 * tau * (1 - math.exp(-1 / tau))
    exact = coast(0.5)
    assert (exact.velocity[0], exact.position[0]) == pytest.approx((speed, way), rel=1e-15)
    bodies = [coast(1 / n, "core:midpoint") for n in (32, 64, 128)]
    for errors in ([abs(b.velocity[0] - speed) for b in bodies], [abs(b.position[0] - way) for b in bodies]):
        assert errors[2] < 1e-4
        for coarse, fine in pairwise(errors):
            assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)


def test_a_sinking_sphere_reaches_terminal_speed() -> None:
    engine = xp.PhysicsEngine(up="z")
    laws = [engine.add_law("basic:linear_drag", coefficient=0.5), engine.add_law("basic:planet_gravity")]
    body = engine.add_object(xp.PhysicalObject(mass=0.1), laws=laws)
    engine.run(until=20.0, dt=0.01)  # 100 time constants
    assert body.velocity[2] == pytest.approx(-0.1 * 9.81 / 0.5, rel=1e-12)


def test_the_work_is_reported() -> None:
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("basic:linear_drag", coefficient=3.0)
    body = engine.add_object(xp.PhysicalObject(mass=2.0, velocity=(4, 0, 0)), laws=[law])
    engine.run(until=1.0, dt=0.01)
    lost = 0.5 * 2 * (body.velocity[0] ** 2 - 16)
    assert engine.energy().work == pytest.approx(lost, rel=1e-9)
