"""Rotation in steps: what is exact, what is kept, and how fast the rest converges to the closed form."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from xpheve.kernels import free_rotation, spin

NONE = (0.0, 0.0, 0.0)
UNEVEN = (1.0, 2.0, 3.0)
rates = st.floats(-20.0, 20.0)
vectors = st.tuples(rates, rates, rates)
moments = st.tuples(*[st.floats(0.1, 10.0)] * 3)
turns = st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: sum(x * x for x in q) > 0.1)


def unit(q: Any) -> Any:
    """``q`` with length 1."""
    return tuple(x / math.sqrt(sum(y * y for y in q)) for x in q)


def flown(q: Any, omega: Any, inertia: Any, torque: Any, s: float, steps: int = 1) -> Any:
    """State after ``steps`` steps that fill ``s``, under ``torque`` [N m]."""
    kick = tuple(one * spin.inverse_of(inertia) for one in torque)
    for _ in range(steps):
        q, omega = spin.flown(q, omega, spin.excess_of(inertia), spin.spread_of(inertia), kick, s / steps)
    return q, omega


def gap(one: Any, other: Any) -> float:
    """Largest difference of two states, orientations being the same with either sign."""
    sign = math.copysign(1.0, np.dot(one[0], other[0]))
    return float(max(np.abs(np.array(one[0]) * sign - other[0]).max(), np.abs(np.array(one[1]) - other[1]).max()))


def exactly(q: Any, omega: Any, inertia: Any, s: float) -> Any:
    """The closed form."""
    return free_rotation.turn(free_rotation.prepare(q, omega, inertia), s)


@pytest.mark.parametrize("inertia", [(2.0, 2.0, 2.0), NONE])
@given(q=turns, omega=vectors)
def test_balls_and_points_turn_exactly_and_keep_their_angular_velocity_to_the_bit(
    inertia: Any, q: Any, omega: Any
) -> None:
    q = unit(q)
    found = flown(q, omega, inertia, NONE, 0.37)
    assert found[1] == omega
    assert gap(found, exactly(q, omega, inertia, 0.37)) < 1e-14


@given(q=turns, omega=vectors, a=st.floats(0.2, 5.0), c=st.floats(0.2, 5.0), axis=st.integers(0, 2))
def test_tops_with_two_equal_moments_turn_exactly_in_one_step_of_any_length(
    q: Any, omega: Any, a: float, c: float, axis: int
) -> None:
    q, inertia = unit(q), tuple(c if k == axis else a for k in range(3))
    assert gap(flown(q, omega, inertia, NONE, 1.7), exactly(q, omega, inertia, 1.7)) < 1e-11


@pytest.mark.parametrize("inertia", [UNEVEN, (3.0, 1.0, 2.0), (2.0, 3.0, 1.0)])
def test_other_tops_follow_the_closed_form_with_order_two(inertia: Any) -> None:
    q, omega = unit((0.9, 0.1, -0.3, 0.2)), (1.0, 2.0, -0.7)
    exact = exactly(q, omega, inertia, 2.0)
    errors = [gap(flown(q, omega, inertia, NONE, 2.0, n), exact) for n in (100, 200, 400)]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.02)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.02)
    assert errors[2] < 3e-6


def momentum(q: Any, omega: Any, inertia: Any) -> Any:
    return np.array(spin.stretched(q, omega, spin.excess_of(inertia)))


def energy(q: Any, omega: Any, inertia: Any) -> float:
    """Of rotation, in units of half the middle moment."""
    return float(np.dot(momentum(q, omega, inertia), omega))


@given(q=turns, omega=vectors, inertia=moments)
def test_angular_momentum_stays_in_the_world_as_it_is(q: Any, omega: Any, inertia: Any) -> None:
    q = unit(q)
    before, after = momentum(q, omega, inertia), momentum(*flown(q, omega, inertia, NONE, 0.1), inertia)
    assert np.abs(after - before).max() <= 1e-12 * max(1.0, np.abs(before).max())


def test_the_energy_of_a_free_top_does_not_drift() -> None:
    q, omega = (1.0, 0.0, 0.0, 0.0), (0.1, 3.0, 0.1)  # near the middle axis: it turns over again and again
    start, worst = energy(q, omega, UNEVEN), [0.0, 0.0]
    for half in range(2):
        for _ in range(5000):
            q, omega = flown(q, omega, UNEVEN, NONE, 0.02)
            worst[half] = max(worst[half], abs(energy(q, omega, UNEVEN) / start - 1.0))
    assert worst[1] < 1.05 * worst[0] < 1e-3


@example(q=(0.0, 0.421875, -0.75, 1.0), omega=(8.0, -16.0, 0.0), inertia=(2.0, 0.109375, 8.0), torque=NONE)
@given(q=turns, omega=vectors, inertia=moments, torque=vectors)
def test_it_runs_back_the_way_it_came(q: Any, omega: Any, inertia: Any, torque: Any) -> None:
    """But for rounding, which each of the four turns there and back makes larger by the angle that the body may turn in it."""
    q = unit(q)
    there = flown(q, omega, inertia, torque, 0.05)
    fastest = max(math.hypot(*omega), math.hypot(*there[1])) * max(inertia) / min(inertia)
    bound = 1e-13 * max(1.0, math.hypot(*omega)) * max(1.0, 0.05 * fastest) ** 4
    assert gap(flown(*there, inertia, torque, -0.05), (q, omega)) < bound


def test_a_torque_about_a_principal_axis_is_exact_in_one_step() -> None:
    q, omega = flown((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 2.0), UNEVEN, (0.0, 0.0, 1.5), 3.0)
    angle = 2.0 * 3.0 + 0.5 * (1.5 / 3.0) * 9.0
    assert gap((q, omega), ((math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2)), (0.0, 0.0, 3.5))) < 1e-14


@given(q=turns)
def test_what_neither_spins_nor_is_twisted_keeps_every_bit(q: Any) -> None:
    assert flown(q, NONE, UNEVEN, NONE, 0.1) == (q, NONE)


@given(q=turns, torque=vectors)
def test_nothing_turns_a_point(q: Any, torque: Any) -> None:
    assert flown(q, NONE, NONE, torque, 0.1) == (q, NONE)
