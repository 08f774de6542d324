"""A damper between two objects."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import xpheve as xp
from xpheve_laws_basic import Damper

number = st.floats(-10, 10)
vector = st.tuples(number, number, number)


def test_it_resists_the_change_of_distance_only(view: Any) -> None:
    law = Damper(damping=2.0)
    a = view(position=[(1, 0, 0)] * 3, velocity=[(3, 0, 0), (0, 5, 0), (1, 1, 1)])
    b = view(position=[(0, 0, 0)] * 3, velocity=[(0, 0, 0), (0, 0, 0), (1, 1, 1)])
    np.testing.assert_allclose(law.force(a, b), [(-6, 0, 0), (0, 0, 0), (0, 0, 0)], atol=1e-15)


@given(x=vector, y=vector, v=vector, w=vector)
def test_action_is_opposite_to_reaction_and_takes_energy(view: Any, x: Any, y: Any, v: Any, w: Any) -> None:
    law = Damper(damping=2.0)
    a, b = view(position=x, velocity=v), view(position=y, velocity=w)
    force = law.force(a, b)
    assert np.array_equal(force, -law.force(b, a))
    power = float((force * (np.array(v) - np.array(w))).sum())
    assert power <= 1e-12 * (1 + np.abs(force).max() * np.abs(np.array(v) - np.array(w)).max())


def test_in_one_place_it_has_no_direction_and_no_force(view: Any) -> None:
    here = view(position=(1, 2, 3), velocity=(1, 0, 0))
    assert np.array_equal(Damper().force(here, view(position=(1, 2, 3), velocity=(0, 0, 0))), [(0, 0, 0)])


def swing(dt: float) -> Any:
    """Return the distance after 1 s of bodies of 2 kg each on spring and damper, from 0.5 m beyond rest, at rest."""
    engine = xp.PhysicsEngine(up="z")
    spring = engine.add_law("basic:spring", stiffness=4.0, rest_length=2.0)
    damper = engine.add_law("basic:damper", damping=1.0)
    a = engine.add_object(xp.PhysicalObject(mass=2.0), laws=[spring, damper])
    b = engine.add_object(xp.PhysicalObject(mass=2.0, position=(2.5, 0, 0)), laws=[spring, damper])
    engine.run(until=1.0, dt=dt)
    np.testing.assert_allclose(engine.momentum(), (0, 0, 0), atol=1e-14)
    return b.position[0] - a.position[0]


def test_spring_and_damper_swing_down_as_the_closed_form_with_order_two() -> None:
    # Reduced mass 1 kg: s'' + s' + 4 s = 0, s(0) = 0.5, s'(0) = 0; decay 1/2, omega = sqrt(4 - 1/4).
    omega = math.sqrt(3.75)
    expected = 2.0 + 0.5 * math.exp(-0.5) * (math.cos(omega) + 0.5 / omega * math.sin(omega))
    errors = [abs(swing(1 / n) - expected) for n in (16, 32, 64)]
    assert errors[2] < 1e-4
    for coarse, fine in pairwise(errors):
        assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.15)
