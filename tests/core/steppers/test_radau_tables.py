"""The numbers of the Radau methods are those that 50 digits give."""

from __future__ import annotations

from typing import Any

import mpmath
import pytest

from xpheve.steppers.radau_tables import STAGES, TABLES, size, start


def nodes(stages: int) -> list[Any]:
    """Roots of the derivative of order s - 1 of x^(s-1) (x - 1)^s."""
    terms = [mpmath.mpf(0)] * (2 * stages)
    for k in range(stages + 1):
        terms[stages - 1 + k] = mpmath.binomial(stages, k) * (-1) ** (stages - k)
    for _ in range(stages - 1):
        terms = [terms[k] * k for k in range(1, len(terms))]
    return sorted(mpmath.re(root) for root in mpmath.polyroots(terms, maxsteps=500, extraprec=400, asc=True))


class Reader:
    """Takes numbers of a table one after another, and compares them."""

    def __init__(self, numbers: tuple[float, ...]) -> None:
        self.numbers = list(numbers)

    def same(self, expected: list[Any]) -> None:
        taken, self.numbers = self.numbers[: len(expected)], self.numbers[len(expected) :]
        for one, other in zip(taken, expected, strict=True):
            assert abs(one - other) <= 2e-16 * abs(other)


@pytest.mark.parametrize("stages", STAGES)
def test_tables_are_those_of_the_methods(stages: int) -> None:
    reader, s = Reader(TABLES[start(stages) : start(stages) + size(stages)]), range(stages)
    with mpmath.workdps(50):
        c = nodes(stages)
        powers = mpmath.matrix([[c[i] ** k for k in s] for i in s])
        a = mpmath.matrix([[c[i] ** (k + 1) / (k + 1) for k in s] for i in s]) * mpmath.inverse(powers)
        inverse = mpmath.inverse(a)
        basis = mpmath.inverse(mpmath.matrix([[c[i] ** (k + 1) for k in s] for i in s]))
        reader.same(c)
        for matrix in (a, inverse, basis):
            reader.same([matrix[i, j] for i in s for j in s])
        values, right = mpmath.eig(inverse)
        left = mpmath.inverse(right)
        real = min(s, key=lambda k: abs(mpmath.im(values[k])))
        gamma = mpmath.re(values[real])
        # The embedded method: weight 1 / gamma at 0, and weights at the nodes that make it of order s.
        rest = mpmath.matrix([mpmath.mpf(1) / (k + 1) - (1 / gamma if k == 0 else 0) for k in s])
        weights = mpmath.lu_solve(powers.T, rest)
        reader.same([weights[j] - a[stages - 1, j] for j in s])
        reader.same([gamma])
        pairs = sorted((k for k in s if mpmath.im(values[k]) > 1e-20), key=lambda k: mpmath.im(values[k]))
        for k in (real, *pairs):
            scale = right[stages - 1, k]
            parts = [right[i, k] / scale for i in s], [left[k, i] * scale for i in s]
            if k == real:
                for part in parts:
                    reader.same([mpmath.re(one) for one in part])
                continue
            reader.same([mpmath.re(values[k]), mpmath.im(values[k])])
            for part in parts:
                reader.same([mpmath.re(one) for one in part])
                reader.same([mpmath.im(one) for one in part])
    assert not reader.numbers
