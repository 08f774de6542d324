"""Velocities after an impact: those of the exact rational solution, rounded once."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as some

from xpheve_laws_collision.impact import exchange
from xpheve_laws_collision.simultaneous import apply, solve_generation, wanted_speeds

number = some.floats(-1e3, 1e3).filter(
    lambda x: x == 0.0 or abs(x) > 1e-280
)  # beside the least of floats halves of digits are lost
vector = some.tuples(number, number, number)
share = some.sampled_from([0.0, 0.25, 1.0, 1.0 / 3.0, 7.3, 1e-6])


def normalised(rng: Any) -> tuple[float, float, float]:
    x, y, z = rng.normal(size=3)
    length = float(np.sqrt(x * x + y * y + z * z))
    return float(x) / length, float(y) / length, float(z) / length


def after(n: Any, u: Any, v: Any, a: float, b: float, e: float) -> tuple[Any, Any]:
    p = exchange.impulse(n, u, v, a, b, e)
    return exchange.pushed(u, n, exchange.times(p, (-a, 0.0))), exchange.pushed(v, n, exchange.times(p, (b, 0.0)))


@given(vector, vector, share, share, some.floats(0.0, 1.0), some.integers(0, 2**30))
@settings(max_examples=200, deadline=None)
def test_velocities_are_the_exact_ones_rounded_once(u: Any, v: Any, a: float, b: float, e: float, seed: int) -> None:
    n = normalised(np.random.default_rng(seed))
    approach = -sum(Fraction(c) * (Fraction(q) - Fraction(p)) for c, p, q in zip(n, u, v, strict=True))
    if a + b == 0.0 or approach <= 0:
        return
    wanted = wanted_speeds([(0, 1)], [n], [u, v], [e])
    exact = apply([(0, 1)], [n], solve_generation([(0, 1)], [a, b], [n], [u, v], wanted), [a, b], [u, v])
    assert after(n, u, v, a, b, e) == tuple(tuple(c + 0.0 for c in one) for one in exact)


@given(vector, some.sampled_from([0.0, 0.5, 0.9, 1.0]), some.integers(0, 2**30))
@settings(max_examples=100, deadline=None)
def test_what_stands_still_throws_back_exactly(u: Any, e: float, seed: int) -> None:
    n = normalised(np.random.default_rng(seed))
    if sum(Fraction(c) * Fraction(p) for c, p in zip(n, u, strict=True)) <= 0:
        return
    still = (0.0, 0.0, 0.0)
    wanted = wanted_speeds([(0, 1)], [n], [u, still], [e])
    exact = apply(
        [(0, 1)], [n], solve_generation([(0, 1)], [1.0, 0.0], [n], [u, still], wanted), [1.0, 0.0], [u, still]
    )
    assert exchange.thrown_back(n, u, e) == tuple(c + 0.0 for c in exact[0])


def test_along_an_axis_the_others_keep_their_bits() -> None:
    assert exchange.thrown_back((0.0, -1.0, 0.0), (0.1, -3.0, 0.7), 0.5) == (0.1, 1.5, 0.7)
    assert str(exchange.thrown_back((1.0, 0.0, 0.0), (2.0, -0.0, -0.0), 0.0)) == "(0.0, 0.0, 0.0)"


def test_equal_masses_exchange_what_lies_along_the_normal() -> None:
    n = normalised(np.random.default_rng(5))
    u = tuple(3.0 * c for c in n)
    new_u, new_v = after(n, u, (0.0, 0.0, 0.0), 1.0, 1.0, 1.0)
    assert max(map(abs, new_u)) < 1e-15 and np.allclose(new_v, u, rtol=4e-16, atol=0)
