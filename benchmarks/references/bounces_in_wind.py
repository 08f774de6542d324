"""A ball under its weight and quadratic drag in a wind, that bounces on a floor ten times: by Taylor series in 40 digits.

With u the velocity against the wind, u' = g - k |u| u. The coefficients of u follow one from another: of |u|^2 as a product of series, of |u| as the
square root of a series, of |u| u as a product again (E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, I.8). An
impact is the zero of the height's polynomial, by Newton's steps; there the vertical velocity is turned and multiplied by the restitution.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mpmath

from benchmarks.references import save

DIGITS, ORDER, STEP = 40, 36, "0.03125"
MASS, RADIUS, AREA, DENSITY, COEFFICIENT, WEIGHT, RESTITUTION = 0.5, 0.1, 0.25, 1.225, 0.47, 9.81, 0.8
WIND = (1.5, -0.5, 0.25)
POSITION, VELOCITY = (0.0, 0.0, 2.0), (3.0, 1.0, 0.0)
SPAN, BOUNCES = 3.75, 10
START = [*POSITION, *VELOCITY, MASS, RADIUS, AREA, DENSITY, COEFFICIENT, WEIGHT, RESTITUTION, *WIND]

Series = list[Any]


def _product(a: Series, b: Series, k: int) -> Any:
    return mpmath.fsum(a[j] * b[k - j] for j in range(k + 1))


def series(u: list[Any], drag: Any, pull: list[Any]) -> list[Series]:
    """Coefficients of u in time, by component, from ``u`` at 0."""
    parts = [[c] for c in u]
    square: Series = []
    size: Series = []
    for k in range(ORDER):
        square.append(mpmath.fsum(_product(part, part, k) for part in parts))
        if k == 0:
            size.append(mpmath.sqrt(square[0]))
        else:
            size.append((square[k] - mpmath.fsum(size[j] * size[k - j] for j in range(1, k))) / (2 * size[0]))
        for part, g in zip(parts, pull, strict=True):
            part.append(((g if k == 0 else 0) - drag * _product(size, part, k)) / (k + 1))
    return parts


def _at(part: Series, s: Any) -> Any:
    return mpmath.polyval(part[::-1], s)


def solve() -> tuple[list[Any], int]:
    """Place and velocity after `SPAN`, and the number of bounces until then."""
    with mpmath.workdps(DIGITS):
        exact = mpmath.mpf
        wind = [exact(c) for c in WIND]
        drag = exact(DENSITY) * exact(COEFFICIENT) * exact(AREA) / (2 * exact(MASS))
        pull = [exact(0), exact(0), -exact(WEIGHT)]
        x, v, left, count = [exact(c) for c in POSITION], [exact(c) for c in VELOCITY], exact(SPAN), 0
        while left > 0:
            speeds = series([a - b for a, b in zip(v, wind, strict=True)], drag, pull)
            for part, w in zip(speeds, wind, strict=True):
                part[0] += w
            places = [[x0, *(c / (k + 1) for k, c in enumerate(part))] for x0, part in zip(x, speeds, strict=True)]
            step = min(exact(STEP), left)
            impact = _at(places[2], step) < exact(RADIUS)
            if impact:
                step = mpmath.findroot(
                    lambda s, part=places[2]: _at(part, s) - exact(RADIUS),
                    (step / 64, step),
                    solver="anderson",
                    tol=exact(10) ** -74,
                )
            x, v, left = [_at(part, step) for part in places], [_at(part, step) for part in speeds], left - step
            if impact:
                x[2], v[2], count = exact(RADIUS), -exact(RESTITUTION) * v[2], count + 1
        return [*x, *v], count


def make() -> Path:
    """Write the answer."""
    end, count = solve()
    assert count == BOUNCES, count
    made = f"Taylor series of order {ORDER} in {DIGITS} digits: benchmarks/references/bounces_in_wind.py"
    return save("bounces_in_wind", made, [(SPAN, START, [mpmath.nstr(c, 34) for c in end])])
