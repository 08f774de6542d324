"""Dense systems are solved as well as NumPy solves them, to the same bits interpreted and compiled; singular ones are told."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from xpheve.compile import assemble, compiled, interpreted
from xpheve.kernels import dense

BODY = """
def entry(f, n):
    s = f[0]
    p = n[0]
    size = p[0]
    area = size * size
    good = dense__factor(s, 0, size, p, 1)
    if good:
        dense__solve(s, 0, size, p, 1, 3 * area)
    both = dense__factor_complex(s, area, 2 * area, size, p, 1 + size)
    if both:
        dense__solve_complex(s, area, 2 * area, size, p, 1 + size, 3 * area + size, 3 * area + 2 * size)
    return good + 2 * both
"""


def solved(size: int, seed: int, run: object) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    numbers = rng.normal(size=3 * size * size + 3 * size) * 10.0 ** rng.integers(-3, 4, size=3 * size * size + 3 * size)
    before, whole = numbers.copy(), np.zeros(1 + 2 * size, dtype=np.int64)
    whole[0] = size
    assert run(assemble(BODY, {}))([numbers], [whole]) == 3  # type: ignore[operator]
    return before, numbers, whole


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 12), st.integers(0, 1_000_000))
def test_solutions_leave_residuals_of_rounding(size: int, seed: int) -> None:
    before, after, _ = solved(size, seed, interpreted)
    area = size * size
    a, re, im = (before[k * area : (k + 1) * area].reshape(size, size) for k in range(3))
    right, x = before[3 * area :].reshape(3, size), after[3 * area :].reshape(3, size)
    for matrix, b, found in ((a, right[0], x[0]), (re + 1j * im, right[1] + 1j * right[2], x[1] + 1j * x[2])):
        residual = np.abs(matrix @ found - b).max()
        # The residual of elimination with pivots is of the size of rounding by the growth of its factors (Golub, Van Loan, 3.4.6).
        assert residual <= 1e-13 * size * (np.abs(matrix).max() * np.abs(found).max() + np.abs(b).max())


@pytest.mark.parametrize("size", [1, 3, 7])
def test_bits_are_the_same_interpreted_and_compiled(size: int) -> None:
    for one, other in zip(solved(size, 5, interpreted), solved(size, 5, compiled), strict=True):
        assert one.tobytes() == other.tobytes()


def test_rows_are_exchanged_where_the_pivot_is_zero() -> None:
    s, p = [0.0, 2.0, 4.0, 1.0, 6.0, 8.0], [0, 0]
    assert dense.factor(s, 0, 2, p, 0)
    dense.solve(s, 0, 2, p, 0, 4)
    assert s[4:] == [(8.0 - 3.0) / 4.0, 3.0]


@pytest.mark.parametrize(
    "matrix", [[1.0, 2.0, 2.0, 4.0], [0.0] * 4, [float("nan"), 0.0, 0.0, 1.0], [float("inf"), 0.0, 0.0, 1.0]]
)
def test_a_singular_or_infinite_matrix_is_told(matrix: list[float]) -> None:
    assert not dense.factor(list(matrix), 0, 2, [0, 0], 0)
    assert not dense.factor_complex(list(matrix) + [0.0] * 4, 0, 4, 2, [0, 0], 0)


def test_quotients_of_complex_numbers_do_not_overflow_on_the_way() -> None:
    assert dense.quotient(1e200, 1e200, 1e200, 1e200) == (1.0, 0.0)
    assert dense.quotient(1.0, 0.0, 0.0, 2.0) == (0.0, -0.5)
