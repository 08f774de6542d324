"""Makes the reference numbers of `test_implicit.py`: Radau IIA with 7 stages in 30 digits, the whole Newton iteration, steps by halving.

Run it by hand; it takes some minutes. Nothing of xPheve is used.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from mpmath import binomial, inverse, matrix, mp, mpf, polyroots, re

mp.dps = 30
STAGES = 7
TOLERANCE = mpf(10) ** -18
Vector = list[Any]
Problem = tuple[Callable[[Vector], Vector], Callable[[Vector], list[Vector]]]


def coefficients() -> Any:
    """The inverse of A (Hairer, Wanner, Solving ODEs II, IV.5)."""
    terms = [mpf(0)] * (2 * STAGES)
    for k in range(STAGES + 1):
        terms[STAGES - 1 + k] = binomial(STAGES, k) * (-1) ** (STAGES - k)
    for _ in range(STAGES - 1):
        terms = [terms[k] * k for k in range(1, len(terms))]
    c = sorted(re(root) for root in polyroots(terms, maxsteps=500, extraprec=400, asc=True))
    powers = matrix([[c[i] ** k for k in range(STAGES)] for i in range(STAGES)])
    integrals = matrix([[c[i] ** (k + 1) / (k + 1) for k in range(STAGES)] for i in range(STAGES)])
    found = inverse(integrals * inverse(powers))
    return [[found[i, j] for j in range(STAGES)] for i in range(STAGES)]


def solve(rows: list[Vector], b: Vector) -> Vector:
    """Gaussian elimination with partial pivoting, in place."""
    n = len(b)
    for k in range(n):
        best = max(range(k, n), key=lambda i: abs(rows[i][k]))
        rows[k], rows[best], b[k], b[best] = rows[best], rows[k], b[best], b[k]
        for i in range(k + 1, n):
            by = rows[i][k] / rows[k][k]
            if by:
                rows[i] = rows[i][: k + 1] + [rows[i][j] - by * rows[k][j] for j in range(k + 1, n)]
                b[i] -= by * b[k]
    for i in range(n - 1, -1, -1):
        b[i] = (b[i] - sum(rows[i][j] * b[j] for j in range(i + 1, n))) / rows[i][i]
    return b


def step(problem: Problem, y: Vector, h: Any, inverse_a: Any) -> Vector | None:
    """One step, its equations solved to the last digits; None if that fails."""
    slope, jacobian = problem
    n = len(y)
    gains = [[mpf(0)] * n for _ in range(STAGES)]
    before = mpf("inf")
    for _ in range(30):
        right: Vector = []
        rows: list[Vector] = []
        for i in range(STAGES):
            here = [a + b for a, b in zip(y, gains[i], strict=True)]
            f, by = slope(here), jacobian(here)
            for r in range(n):
                right.append(f[r] - sum(inverse_a[i][j] * gains[j][r] for j in range(STAGES)) / h)
                line = []
                for j in range(STAGES):
                    line += [
                        (inverse_a[i][j] / h if r == c else mpf(0)) - (by[r][c] if i == j else 0) for c in range(n)
                    ]
                rows.append(line)
        found = solve(rows, right)
        gains = [[gains[i][r] + found[n * i + r] for r in range(n)] for i in range(STAGES)]
        size = max(abs(one) for one in found)
        if size < mpf(10) ** -26:
            return [a + b for a, b in zip(y, gains[-1], strict=True)]
        if size > 1e6 or size > 2 * before:
            return None
        before = size
    return None


def run(problem: Problem, y: Sequence[Any], end: Any) -> Vector:
    """The state at ``end``: steps of which one and its halves agree."""
    inverse_a, t, h, y = coefficients(), mpf(0), mpf(10) ** -6, list(map(mpf, y))
    while t < end:
        h = min(h, end - t)
        whole = step(problem, y, h, inverse_a)
        half = step(problem, y, h / 2, inverse_a) if whole else None
        full = step(problem, half, h / 2, inverse_a) if half else None
        if whole is None or full is None:
            h /= 4
            continue
        error = max(abs(a - b) / (abs(a) + mpf(10) ** -6) for a, b in zip(whole, full, strict=True)) / TOLERANCE
        if error <= 1:
            t, y = t + h, full
        h *= min(mpf(5), max(mpf("0.2"), mpf("0.9") * (error + mpf(10) ** -12) ** (-mpf(1) / 14)))
    return y


MU = mpf(10000)
VAN_DER_POL: Problem = (
    lambda y: [y[1], MU * (1 - y[0] ** 2) * y[1] - y[0]],
    lambda y: [[mpf(0), mpf(1)], [-2 * MU * y[0] * y[1] - 1, MU * (1 - y[0] ** 2)]],
)
S, F, B = mpf(0.04), mpf(3e7), mpf(1e4)  # 0.04 as a float has it
ROBERTSON: Problem = (
    lambda y: [-S * y[0] + B * y[1] * y[2], S * y[0] - B * y[1] * y[2] - F * y[1] ** 2, F * y[1] ** 2],
    lambda y: [[-S, B * y[2], B * y[1]], [S, -B * y[2] - 2 * F * y[1], -B * y[1]], [mpf(0), 2 * F * y[1], mpf(0)]],
)

if __name__ == "__main__":
    print("van der Pol, mu = 1e4, from (2, 0), t = 2e4:", run(VAN_DER_POL, (2, 0), mpf(20000)))
    print("Robertson, from (1, 0, 0), t = 1e4:", run(ROBERTSON, (1, 0, 0), mpf(10000)))
