"""Quartics: the first fall to zero, against roots at fifty digits and against exact signs."""

import math
from fractions import Fraction

import mpmath
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from xpheve.kernels.polynomial import difference_of_products, first_crossing, quadratic_roots

Quartic = tuple[float, float, float, float, float]

coefficient = st.one_of(
    st.just(0.0), st.floats(-10, 10).map(lambda x: x if abs(x) > 1e-20 else 0.0), st.integers(-4, 4).map(float)
)
quartics = st.tuples(coefficient, coefficient, coefficient, coefficient, coefficient)


def exact(c: Quartic, s: float) -> Fraction:
    """The value without error."""
    x = Fraction(s)
    return sum((Fraction(k) * x**i for i, k in enumerate(c)), Fraction(0))


def size(c: Quartic, s: float) -> float:
    """The sum of the sizes of the terms."""
    return math.fsum(abs(k) * abs(s) ** i for i, k in enumerate(c))


def true_crossing(c: Quartic, start: float, end: float) -> float:
    """The first fall by all roots at 50 digits and exact signs between them."""
    coefficients = list(c)
    while coefficients and coefficients[-1] == 0.0:
        coefficients.pop()
    if len(coefficients) < 2:
        return math.inf
    with mpmath.workdps(50):
        roots = mpmath.polyroots(coefficients[::-1], asc=False, maxsteps=400, extraprec=400)
        real = sorted(float(mpmath.re(z)) for z in roots if abs(mpmath.im(z)) < mpmath.mpf(10) ** -15 * (1 + abs(z)))
    marks = [start, *(r for r in real if start < r < end), end if end < math.inf else max([0.0, start, *real]) * 2 + 1]
    # Merge what is one root but for rounding, so that signs are asked only well between roots.
    for a, b, c_ in zip(marks, marks[1:], marks[2:], strict=False):
        if exact(c, 0.5 * (a + b)) > 0 and exact(c, 0.5 * (b + c_)) <= 0:
            return b
    if len(marks) >= 2 and exact(c, 0.5 * (marks[-2] + marks[-1])) > 0 and exact(c, marks[-1]) <= 0:
        return marks[-1]
    return math.inf


def is_well_separated(c: Quartic) -> bool:
    """Whether no two roots (complex ones too) are so close that what is a root is a matter of rounding."""
    coefficients = list(c)
    while coefficients and coefficients[-1] == 0.0:
        coefficients.pop()
    if len(coefficients) < 2:
        return True
    with mpmath.workdps(50):
        try:
            roots = mpmath.polyroots(coefficients[::-1], asc=False, maxsteps=400, extraprec=400)
        except mpmath.libmp.NoConvergence:
            return False
        return all(
            abs(a - b) > 1e-6 * (abs(a) + abs(b)) + 1e-9 for i, a in enumerate(roots) for b in roots[:i]
        ) and all(abs(a) > 1e-9 for a in roots)


@settings(max_examples=400, deadline=None)
@given(quartics, st.sampled_from([0.0, -3.0, 0.5]), st.sampled_from([1.0, 4.0, math.inf]))
@example((1.0, -3.0, 0.2, 0.3, 0.1), 0.0, math.inf)
def test_the_first_crossing_is_the_first_root_at_which_the_polynomial_falls(
    c: Quartic, start: float, end: float
) -> None:
    assume(is_well_separated(c))
    found, expected = first_crossing(c, start, end), true_crossing(c, start, end)
    if expected == math.inf:
        assert found == math.inf
        return
    # Half a unit for the oracle's rounding, one for "the first float beyond", one for the last step.
    assert abs(found - expected) <= 3 * math.ulp(expected)
    assert start < found <= end


@settings(max_examples=400, deadline=None)
@given(quartics, st.sampled_from([1.0, 4.0]))
def test_no_crossing_is_missed_by_more_than_rounding(c: Quartic, end: float) -> None:
    """Samples from the start to what was found are positive once the polynomial has become so."""
    found = first_crossing(c, 0.0, end)
    was_positive = False
    for i in range(401):
        s = end * i / 400
        if s >= found:
            break
        v = exact(c, s)
        assert not (was_positive and v <= 0 and abs(v) > 1e-28 * size(c, s))  # values are right to about 1e-31
        was_positive = was_positive or v > 1e-28 * size(c, s)
    if found < math.inf:
        assert exact(c, found) <= Fraction(1e-28) * Fraction(size(c, found))
        assert exact(c, found * (1 - 2.0**-50)) >= -Fraction(1e-28) * Fraction(size(c, found))


@settings(max_examples=200, deadline=None)
@given(st.lists(st.integers(1, 60), min_size=4, max_size=4, unique=True), st.integers(-60, 60), st.integers(-60, 60))
def test_roots_that_are_floats_are_hit_to_the_bit(roots: list[int], scale: int, stretch: int) -> None:
    """(s - a)(s - b)(s - c)(s - d) with small integers, in units of s and of the value that are powers of two."""
    product = [1]
    for r in roots:
        product = [a - r * b for a, b in zip([0, *product], [*product, 0], strict=True)]
    c0, c1, c2, c3, c4 = (math.ldexp(k, scale - i * stretch) for i, k in enumerate(product))
    a, b, c, d = sorted(roots)
    unit = math.ldexp(1.0, stretch)
    quartic = (c0, c1, c2, c3, c4)
    assert first_crossing(quartic, 0.0, math.inf) == a * unit
    assert first_crossing(quartic, a * unit, math.inf) == c * unit
    assert first_crossing(quartic, c * unit, math.inf) == math.inf
    assert first_crossing((-c0, -c1, -c2, -c3, -c4), 0.0, math.inf) == b * unit
    assert first_crossing((-c0, -c1, -c2, -c3, -c4), b * unit, d * unit) == d * unit
    assert first_crossing(quartic, 0.0, math.nextafter(a * unit, 0)) == math.inf


def test_a_touch_from_above_counts_only_if_it_reaches_zero() -> None:
    assert first_crossing((1.0, -2.0, 1.0, 0.0, 0.0), 0.0, math.inf) == 1.0
    assert first_crossing((1.0 + 2.0**-52, -2.0, 1.0, 0.0, 0.0), 0.0, math.inf) == math.inf
    # (s - 2)^4 is within 1e-31 of 0 as soon as s is within 1e-8 of 2.
    assert first_crossing((16.0, -32.0, 24.0, -8.0, 1.0), 0.0, math.inf) == pytest.approx(2.0, abs=1e-7)
    assert first_crossing((16.0 + 2.0**-48, -32.0, 24.0, -8.0, 1.0), 0.0, math.inf) == math.inf


def test_a_start_that_is_not_positive_is_no_crossing() -> None:
    assert first_crossing((0.0, -1.0, 0.0, 0.0, 0.0), 0.0, math.inf) == math.inf
    assert first_crossing((-1.0, -1.0, 0.0, 0.0, 0.0), 0.0, math.inf) == math.inf
    assert first_crossing((0.0, 1.0, -1.0, 0.0, 0.0), 0.0, math.inf) == 1.0  # up and back
    assert first_crossing((0.0, 2.0**-40, -1.0, 0.0, 0.0), 0.0, math.inf) == 2.0**-40  # soon back


@pytest.mark.parametrize("c", [(0.0,) * 5, (3.0, 0.0, 0.0, 0.0, 0.0), (-3.0, 0.0, 0.0, 0.0, 0.0)])
def test_a_constant_never_crosses(c: Quartic) -> None:
    assert first_crossing(c, 0.0, math.inf) == math.inf


@pytest.mark.parametrize("exponent", [-200, -100, 0, 100, 200])
@pytest.mark.parametrize("degree", [1, 2, 3, 4])
def test_scales_do_not_matter(exponent: int, degree: int) -> None:
    """c0 - cn s^n for c0 and cn of very different sizes."""
    c = [10.0**exponent, 0.0, 0.0, 0.0, 0.0]
    c[degree] = -(10.0**-exponent) * 2.0
    found = first_crossing((c[0], c[1], c[2], c[3], c[4]), 0.0, math.inf)
    with mpmath.workdps(50):
        expected = mpmath.root(mpmath.mpf(c[0]) / -mpmath.mpf(c[degree]), degree)
        if expected > 1e308 or expected < 1e-308:
            return
        assert abs(found - expected) <= 2 * math.ulp(float(expected))


def test_bounds_of_time_that_make_no_interval_give_nothing() -> None:
    falling = (1.0, -1.0, 0.0, 0.0, 0.0)
    assert first_crossing(falling, 2.0, 1.0) == math.inf
    assert first_crossing(falling, 0.0, math.nan) == math.inf
    assert first_crossing(falling, 2.0, math.inf) == math.inf
    assert first_crossing(falling, -1e300, math.inf) == 1.0


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
def test_the_roots_of_a_quadratic_do_not_cancel(a: float, b: float, c: float) -> None:
    assume(min(abs(a), abs(c)) > 1e-6)
    u, v = quadratic_roots(c, b, a)
    discriminant = Fraction(b) ** 2 - 4 * Fraction(a) * Fraction(c)
    if discriminant < 0:
        assert u == v == math.inf
        return
    with mpmath.workdps(60):
        root = mpmath.sqrt(mpmath.mpf(discriminant.numerator) / discriminant.denominator)
        expected = sorted([(-b - root) / (2 * mpmath.mpf(a)), (-b + root) / (2 * mpmath.mpf(a))])
        for x, y in zip((u, v), expected, strict=True):
            assert abs(x - y) <= 4 * math.ulp(float(y))  # a product, a root, a sum, a quotient


@given(*[st.floats(-1e100, 1e100)] * 4)
def test_a_difference_of_products_is_right_to_two_units(a: float, b: float, c: float, d: float) -> None:
    assume(all(x == 0 or abs(x) > 1e-100 for x in (a, b, c, d)))
    true = Fraction(a) * Fraction(b) - Fraction(c) * Fraction(d)
    assert abs(Fraction(difference_of_products(a, b, c, d)) - true) <= abs(true) * Fraction(2.0**-51)
