"""Sums and products without loss, against fractions; of arrays as of floats."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from xpheve.kernels.clock import elapsed
from xpheve.steppers.sums import exact_spans, spans_since, two_products, two_sums

NUMBERS = st.floats(-1e12, 1e12).filter(lambda x: x == 0.0 or abs(x) > 1e-12)
PAIRS = st.lists(st.tuples(NUMBERS, NUMBERS), min_size=1, max_size=8)


@given(PAIRS)
def test_nothing_is_lost(pairs: list[tuple[float, float]]) -> None:
    a, b = np.array(pairs).T
    sums, products = two_sums(a, b), two_products(a, b)
    for k, (x, y) in enumerate(pairs):
        assert Fraction(float(sums[0][k])) + Fraction(float(sums[1][k])) == Fraction(x) + Fraction(y)
        assert Fraction(float(products[0][k])) + Fraction(float(products[1][k])) == Fraction(x) * Fraction(y)
        assert sums[0][k] == x + y


@given(PAIRS, NUMBERS, st.floats(-1e-6, 1e-6))
def test_spans_are_those_of_the_clock_to_the_bit(pairs: list[tuple[float, float]], t: float, late: float) -> None:
    base = np.array([x for x, _ in pairs])
    offset = np.array([np.spacing(abs(x)) * (y / 4e12) for x, y in pairs])
    spans, (high, low) = spans_since((t, late), base, offset), exact_spans((t, late), base, offset)
    for k in range(len(pairs)):
        since = float(base[k]), float(offset[k])
        assert spans[k] == elapsed((t, late), since)
        assert (high[k], low[k]) == exact_spans((t, late), *since)
        assert high[k] == spans[k]
