"""Rotation of arrays is that of its rows, to the bit."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from xpheve.kernels import spin
from xpheve.loop import array_spin


@given(st.integers(0, 2**32 - 1))
def test_arrays_of_tops_turn_to_the_bits_of_each_top(seed: int) -> None:
    some = np.random.default_rng(seed)
    count = 9
    q, omega, torque = some.normal(size=(4, count)), some.normal(size=(3, count)) * 10.0, some.normal(size=(3, count))
    q /= np.linalg.norm(q, axis=0)
    inertia = some.uniform(0.1, 5.0, size=(3, count))
    inertia[:, 0] = 0.0
    inertia[:, 1] = 2.5
    inertia[1, 2] = inertia[0, 2]
    omega[:, 3] = torque[:, 3] = 0.0
    s = some.uniform(0.0, 0.3, size=count)
    s[4] = 0.0
    found_q, found_omega = array_spin.flown(q, omega, inertia, torque, s)
    for k in range(count):
        moments = tuple(inertia[:, k].tolist())
        kick = tuple((torque[:, k] * spin.inverse_of(moments)).tolist())
        one = tuple(q[:, k].tolist()), tuple(omega[:, k].tolist())
        if s[k]:
            one = spin.flown(*one, spin.excess_of(moments), spin.spread_of(moments), kick, float(s[k]))
        assert (tuple(found_q[:, k].tolist()), tuple(found_omega[:, k].tolist())) == one


@given(st.tuples(*[st.floats(0.1, 10.0)] * 3))
def test_moments_of_arrays_are_those_of_each_row(inertia: tuple[float, float, float]) -> None:
    excess, spread, inverse = array_spin.moments(np.array([inertia]).T)
    assert tuple(excess[:, 0].tolist()) == spin.excess_of(inertia)
    assert tuple(spread[:, 0].tolist()) == spin.spread_of(inertia)
    assert inverse[0] == spin.inverse_of(inertia)
