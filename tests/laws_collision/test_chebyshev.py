"""The first fall of smooth functions: no zero of the interpolant is missed."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from xpheve_laws_collision.impact_time import chebyshev as c
from xpheve_laws_collision.impact_time.advancement import UndecidedError


def fall(rates: Any, level: Any, low: float, high: float, begin: float | None = None) -> float:
    """`first_fall` with noise and slowness of rounding."""
    return c.first_fall(rates, level, low, high, level(low) if begin is None else begin, 1e-13, 1e-14)


def polynomial(roots: list[float]) -> tuple[Any, Any]:
    """Rates and level of a polynomial with ``roots``, above zero at the left."""
    p = np.polynomial.Polynomial.fromroots(roots) * (-1.0) ** len(roots)
    return p.deriv(), lambda s: float(p(s))


def test_the_basis_interpolates_integrates_and_differentiates() -> None:
    x = np.linspace(-1.0, 1.0, 7)
    values = c.TO_COEFFICIENTS @ np.sin(3.0 * c.NODES)
    assert np.abs(values @ c.polynomials(x) - np.sin(3.0 * x)).max() < 1e-14
    assert np.abs((c.DERIVATIVE @ values) @ c.polynomials(x) - 3.0 * np.cos(3.0 * x)).max() < 1e-12
    way = np.polynomial.chebyshev.chebval(x, c.INTEGRAL @ values)
    assert np.abs(way - (math.cos(3.0) - np.cos(3.0 * x)) / 3.0).max() < 1e-14


@given(st.lists(st.floats(0.05, 0.95), min_size=1, max_size=6, unique=True))
def test_the_first_of_several_roots_is_found(roots: list[float]) -> None:
    roots = sorted(roots)
    if min(np.diff(roots), default=1.0) < 1e-3:
        return
    rates, level = polynomial(roots)
    assert fall(rates, level, 0.0, 1.0) == pytest.approx(roots[0], abs=1e-7 * 10.0 ** len(roots) * 1e-3)


@pytest.mark.parametrize("depth", [1e-3, 1e-6, 1e-9, 1e-11])
def test_a_shallow_dip_is_found_and_a_near_miss_is_none(depth: float) -> None:
    rates = lambda s: 2.0 * (s - 0.37)  # noqa: E731
    assert fall(rates, lambda s: (s - 0.37) ** 2 - depth, 0.0, 1.0) == pytest.approx(0.37 - math.sqrt(depth), rel=1e-4)
    assert fall(rates, lambda s: (s - 0.37) ** 2 + depth, 0.0, 1.0) == math.inf


@pytest.mark.parametrize("speed", [1.0, 1e-3, 1e-6, 1e-9])
def test_a_hop_from_zero_is_as_long_as_its_parabola(speed: float) -> None:
    """What leaves at zero comes back at 2 v / a, however short that is beside the interval."""
    found = fall(lambda s: speed - 10.0 * s, lambda s: 0.3e-13, 0.0, 1.0, 0.0)
    assert found == pytest.approx(0.2 * speed, rel=1e-6)


def test_what_begins_below_and_falls_is_found_at_once_and_else_where_it_turns() -> None:
    assert fall(lambda s: 0.0 * s - 1.0, lambda s: -0.1 - s, 0.0, 1.0) == 0.0
    turning = fall(lambda s: 1.0 - 4.0 * s, lambda s: -1.0 + s - 2.0 * s * s, 0.0, 1.0)
    assert turning == pytest.approx(0.25, abs=1e-9)


def test_what_neither_falls_nor_rises_is_none() -> None:
    assert fall(lambda s: 0.0 * s, lambda s: 0.0, 0.0, 1.0) == math.inf


def test_quick_swings_are_resolved_by_halving() -> None:
    found = fall(lambda s: -200.0 * np.sin(200.0 * s), lambda s: math.cos(200.0 * s) + 0.999, 0.0, 1.0)
    assert found == pytest.approx(math.acos(-0.999) / 200.0, rel=1e-12)


def test_what_halving_does_not_tell_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(c, "MOST", 3)
    with pytest.raises(UndecidedError):
        fall(lambda s: -200.0 * np.sin(200.0 * s), lambda s: math.cos(200.0 * s) + 0.999, 0.0, 1.0)
