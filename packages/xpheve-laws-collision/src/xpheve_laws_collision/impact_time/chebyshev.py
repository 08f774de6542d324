"""Chebyshev's interpolation of smooth functions of time, and the first time at which one that falls is at zero or below.

A function on an interval is taken at the zeros of a Chebyshev polynomial; the coefficients of its interpolant bound it, and its integral, from
above and below: |T_k| <= 1. Where the bounds do not decide, the interval is halved: so no zero of the interpolant is missed, however close to
another. Interpolation at these points: Trefethen, Approximation Theory and Approximation Practice (2013), 3 and 8; bounds by the range of a
polynomial in place of its zeros are those of interval subdivision (Moore, Interval Analysis (1966)).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from xpheve_laws_collision.impact_time.advancement import UndecidedError

Array = NDArray[np.float64]

DEGREE = 24
COUNT = DEGREE + 1
NODES: Array = np.array(chebyshev.chebpts1(COUNT), dtype=np.float64)
TO_COEFFICIENTS: Array = np.array((2.0 / COUNT) * chebyshev.chebvander(NODES, DEGREE).T, dtype=np.float64)
TO_COEFFICIENTS[0] *= 0.5
INTEGRAL: Array = np.array([chebyshev.chebint(row, lbnd=-1) for row in np.eye(COUNT)]).T
"""Of the coefficients of a function to those of its integral from -1 on, (26, 25)."""
DERIVATIVE: Array = np.array([np.append(chebyshev.chebder(row), 0.0) for row in np.eye(COUNT)]).T
"""Of the coefficients of a function to those of its derivative, (25, 25)."""
ORDERS: Array = np.arange(float(COUNT))[:, None]
TAIL = 3  # last coefficients, that show whether a function is resolved
RESOLVED = 1e-13  # of the largest: so small they are where it is
ROUNDING = 1e-14  # of the largest rate that was seen: what is left of them is no more than that of their parts
MARGIN = 10.0  # times the last coefficients: a bound by so much more than zero holds for what is not resolved, too
DEEPEST = 2.0**-46  # of the whole interval: shorter ones are not halved
MOST = 4_000  # intervals of one search
BISECTIONS = 80


def polynomials(x: Array) -> Array:
    """T_0 to T_24 at ``x`` in [-1, 1], (25, n)."""
    found: Array = np.cos(ORDERS * np.arccos(np.clip(x, -1.0, 1.0)))
    return found


def first_fall(
    rates: Callable[[Array], Array],
    level: Callable[[float], float],
    low: float,
    high: float,
    begin: float,
    noise: float,
    still: float,
) -> float:
    """The first s in [``low``, ``high``] at which a function is zero or below, and falls; infinite if there is none.

    Parameters
    ----------
    rates
        The function's derivative at many s, (n,) to (n,).
    level
        The function itself at one s: only right to ``noise``.
    low, high
        Where it is looked for.
    begin
        The function at ``low``: 0 where it counts as none.
    noise
        Values of ``level`` so small say nothing: the integral from the left is taken in their place.
    still
        Rates so small are none.

    Returns
    -------
    float
        ``low`` if it is below there already, and falls. What begins below and rises is found where it turns.

    Raises
    ------
    UndecidedError
        If halving `MOST` times does not tell.
    """
    waiting = [(low, high)]
    here, scale = begin, 0.0
    shortest = max(DEEPEST * (high - low), 4.0 * math.ulp(high))
    for _ in range(MOST):
        if not waiting:
            return math.inf
        left, right = waiting.pop()
        half = 0.5 * (right - left)
        rate = TO_COEFFICIENTS @ rates(left + half * (NODES + 1.0))
        way = half * (INTEGRAL @ rate)
        way[0] += here
        spread, swing = float(np.abs(rate[1:]).sum()), float(np.abs(way[1:]).sum())
        tail = float(np.abs(rate[-TAIL:]).max())
        if not spread < math.inf:
            raise UndecidedError(left)
        ends = here + float(half * (INTEGRAL @ rate).sum())
        least, most, fastest = float(way[0]) - swing, float(rate[0]) + spread, float(rate[0]) - spread
        scale = max(scale, abs(float(rate[0])) + spread)
        resolved = tail <= max(RESOLVED * (abs(float(rate[0])) + spread), ROUNDING * scale)
        if least > MARGIN * tail * half and (resolved or least > 0.1 * swing):
            here = _reached(level, right, ends, noise)  # far from zero all along
            continue
        if resolved or right - left <= shortest:
            if most <= still and fastest >= -still:
                here = _reached(level, right, ends, noise)
                continue
            if most < 0.0:  # it falls all along
                if here <= 0.0:
                    return left
                if ends <= 0.0:
                    return left + half * (1.0 + _root(way, rate * half))
                here = _reached(level, right, ends, noise)
                continue
            if fastest > 0.0:
                here = _reached(level, right, ends, noise)
                continue
        if right - left <= shortest:
            slope = float(chebyshev.chebval(-1.0, rate))
            if here <= 0.0 and slope < 0.0:
                return left
            if here > 0.0 >= ends:
                return right
            here = _reached(level, right, ends, noise)
            continue
        waiting += [(left + half, right), (left, left + half)]
    raise UndecidedError(waiting[-1][0] if waiting else high)


def _reached(level: Callable[[float], float], s: float, summed: float, noise: float) -> float:
    """The function at ``s``: as it is, or the sum of its rates where that is no more than rounding."""
    value = level(s)
    return value if abs(value) > noise else summed


def _root(way: Array, rate: Array) -> float:
    """Where in [-1, 1] a falling function, above zero at -1 and not at 1, is zero: Newton's steps between two sides."""
    low, high = -1.0, 1.0
    x = low
    for _ in range(BISECTIONS):
        value, slope = float(chebyshev.chebval(x, way)), float(chebyshev.chebval(x, rate))
        if value > 0.0:
            low = x
        elif value < 0.0:
            high = x
        else:
            return x
        step = x - value / slope if slope < 0.0 else math.inf
        if step == x or not low < high:
            return x
        x = step if low < step < high else 0.5 * (low + high)
        if x in (low, high):
            return high
    return high


__all__ = ["COUNT", "DERIVATIVE", "NODES", "TO_COEFFICIENTS", "first_fall", "polynomials"]
