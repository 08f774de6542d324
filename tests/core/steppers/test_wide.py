"""Pairs of floats against exact fractions."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from xpheve.steppers.wide import Wide, blocks, identity, stacked, wide

ROUNDINGS = Fraction(1, 10**31)


def exact(a: Wide) -> Any:
    """The numbers as fractions."""
    return np.vectorize(lambda x, y: Fraction(float(x)) + Fraction(float(y)), otypes=[object])(a.high, a.low)


def some(rng: np.random.Generator, *shape: int) -> Wide:
    high = rng.normal(size=shape) * 10.0 ** rng.uniform(-3.0, 3.0, shape)
    return Wide(high, np.spacing(high) * rng.uniform(-0.5, 0.5, shape))


def largest(values: Any) -> Fraction:
    found: Fraction = max(abs(one) for one in np.ravel(values))
    return found


@pytest.mark.parametrize("seed", range(5))
def test_sums_products_quotients_and_roots_have_31_digits(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = some(rng, 40), some(rng, 40)
    x, y = exact(a), exact(b)
    for found, true, scale in (
        (a + b, x + y, abs(x) + abs(y)),
        (a - b, x - y, abs(x) + abs(y)),
        (a * b, x * y, abs(x * y)),
        (a / b, x / y, abs(x / y)),
    ):
        assert largest((exact(found) - true) / scale) < ROUNDINGS
    root = exact((a * a).root())
    assert largest((root - abs(x)) / x) < ROUNDINGS


def test_floats_on_either_side_count_as_pairs() -> None:
    third = Wide(1.0) / 3.0
    assert largest(exact(third * 3.0) - 1) < ROUNDINGS
    assert exact(1.0 - third) == exact(-(third - 1.0))
    assert exact(1.0 / (1.0 / third)) == pytest.approx(exact(third), rel=1e-30)
    assert wide(third) is third


@pytest.mark.parametrize("shape", [(3, 4, 2), (30, 50, 7), (1, 1, 1), (60, 120, 1)])
def test_a_product_of_matrices_has_the_digits_of_pairs(shape: tuple[int, int, int]) -> None:
    rng = np.random.default_rng(sum(shape))
    n, k, m = shape
    a, b = Wide(rng.normal(size=(n, k)), 1e-17 * rng.normal(size=(n, k))), Wide(rng.normal(size=(k, m)))
    wanted = exact(a).dot(exact(b))
    assert largest(exact(a @ b) - wanted) < Fraction(k, 10**30)


def test_a_column_has_the_same_bits_alone_and_beside_others() -> None:
    rng = np.random.default_rng(1)
    a, b = some(rng, 9, 12), some(rng, 12, 6)
    whole = a @ b
    for k in range(6):
        alone = a @ b[:, k]
        assert (alone.high == whole.high[:, k]).all() and (alone.low == whole.low[:, k]).all()


def test_sums_that_cancel_keep_what_is_left() -> None:
    a = Wide(np.array([[1e16, 1.0, -1e16]]))
    assert (a @ Wide(np.ones(3))).high[0] == 1.0
    assert a.sum(1).high[0] == 1.0


def test_parts_are_written_and_matrices_put_together() -> None:
    a = identity(3)
    a[1, 1] = Wide(1.0) / 3.0
    assert a.low[1, 1] != 0.0
    assert a.transposed.high[1, 1] == a.high[1, 1]
    assert blocks([[a, a], [a, a]]).shape == (6, 6)
    assert stacked([a, a]).shape == (2, 3, 3)
    assert a.key() == a.copy().key() != identity(3).key()
    assert a.scaled(0.5).high[0, 0] == 0.5


def test_a_product_after_a_write_is_that_of_what_was_written() -> None:
    a, x = identity(2), Wide(np.array([1.0, 1.0]))
    assert (a @ x).high.tolist() == [1.0, 1.0]
    a[0, 0] = Wide(5.0)
    assert (a @ x).high.tolist() == [5.0, 1.0]
