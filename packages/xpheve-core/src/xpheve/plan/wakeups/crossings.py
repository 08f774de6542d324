"""Where a function of time changes its sign, window by window, by Chebyshev interpolation.

Source: Boyd, SIAM J. Numer. Anal. 40 (2002) 1666: zeros of a function in an interval are those of its Chebyshev interpolant, found as
eigenvalues of the colleague matrix (Good, Quart. J. Math. 12 (1961) 61); here each is narrowed down on the function itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from xpheve.plan.wakeups.motion import FIRST

Array = NDArray[np.float64]
State = tuple[float, Any]

DEGREE = 24
RESOLVED = 1e-11  # last coefficients against the largest
NOTHING = 1e-15  # of the largest value: rounding, not a sign
NOISY = 8.0  # times the difference between neighbours
NEAR_REAL = (
    1e-3  # imaginary parts up to here may belong to a pair of zeros close together; a split too many does no harm
)
SHORTEST = (
    2.0**-30
)  # of the flight, of its pace, or of `FIRST`: windows that halved without end would never come past a pole
FEWEST = (
    64  # units in the last place of time that a window spans, so that its nodes differ and it gets on across a jump
)
NODES = chebyshev.chebpts1(DEGREE + 1)
TO_COEFFICIENTS = (2.0 / (DEGREE + 1)) * chebyshev.chebvander(NODES, DEGREE).T
TO_COEFFICIENTS[0] *= (
    0.5  # coefficients of the interpolant from its values at the nodes, where the polynomials are orthogonal
)


def window(
    f: Callable[[Array], Array],
    at: Callable[[float], float],
    start: float,
    wish: float,
    end: float,
    scale: float = FIRST,
) -> tuple[float, float, list[State]]:
    """A window [start, stop] in which ``f`` is resolved: stop, the length to wish for next, and from when which sign holds.

    ``f`` takes many times, ``at`` is the same for one. The signs are 1 and -1, or 0 where ``f`` is nothing but rounding all along; they
    depend on ``f``, ``start``, ``wish``, ``end`` and ``scale`` only, the time [s] in which what moves may be far elsewhere.
    """
    length = min(wish, end - start)
    shortest = max(SHORTEST * min(FIRST, scale, end), FEWEST * math.ulp(start + length))
    noise = -1.0
    while True:
        times = start + 0.5 * length * (NODES + 1.0)
        values = f(times)
        coefficients: Array = TO_COEFFICIENTS @ values
        left = float(np.abs(coefficients[-3:]).max())
        if left <= RESOLVED * float(np.abs(coefficients).max()) or length <= shortest:
            break
        if noise < 0.0:
            noise = _noise(f, times, values)
        if left <= noise:
            break
        length *= 0.5
    stop = end if start + length >= end else start + length
    wanted = length if length < wish and length < end - start else 2.0 * wish
    return stop, wanted, _signs(f, at, start, stop, values, coefficients, max(noise, 0.0))


def _noise(f: Callable[[Array], Array], times: Array, values: Array) -> float:
    """What rounding makes of ``f``, as between neighbouring floats of time: shorter windows say no more than that."""
    beside = np.nextafter(times, times[::-1])
    return NOISY * float(np.abs(f(beside) - values).max())


def _signs(
    f: Callable[[Array], Array],
    at: Callable[[float], float],
    start: float,
    stop: float,
    values: Array,
    coefficients: Array,
    noise: float,
) -> list[State]:
    zeros = _zeros(coefficients)
    cuts = np.concatenate([[-1.0], zeros, [1.0]])
    places = np.unique(np.concatenate([cuts, 0.5 * (cuts[1:] + cuts[:-1])]))
    times = np.unique(np.clip(start + 0.5 * (stop - start) * (places + 1.0), start, stop))
    found = f(times)
    nothing = max(NOTHING * max(float(np.abs(values).max()), float(np.abs(found).max())), noise)
    states: list[State] = []
    low = start
    for time, value in zip(times.tolist(), found.tolist(), strict=True):
        if abs(value) <= nothing:
            continue
        sign = 1 if value > 0.0 else -1
        if not states:
            states.append((start, sign))
        elif states[-1][1] != sign:
            states.append((_narrowed(at, low, time, sign), sign))
        low = time
    return states or [(start, 0)]


def _zeros(coefficients: Array) -> Array:
    """Candidates in (-1, 1), from the colleague matrix."""
    if abs(float(coefficients[0])) > 1.001 * float(np.abs(coefficients[1:]).sum()):
        return np.zeros(0)  # no T_k is beyond 1: the constant wins everywhere
    kept = chebyshev.chebtrim(coefficients, 1e-15 * float(np.abs(coefficients).max()))
    if len(kept) < 2:
        return np.zeros(0)
    roots = chebyshev.chebroots(kept)
    real = np.sort(roots.real[np.abs(roots.imag) <= NEAR_REAL])
    inside: Array = real[(real > -1.0) & (real < 1.0)]
    return inside


def _narrowed(f: Callable[[float], float], low: float, high: float, sign: int) -> float:
    """The first float at which ``f`` has ``sign`` or is zero, between ``low``, where it has the other, and ``high``; by secants and halves."""

    def at(s: float) -> float:
        return sign * f(s)

    below, above = at(low), at(high)
    for k in range(200):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        s = middle
        if k % 3 < 2 and above > below:
            # A secant, a unit or two beyond it in turn, so that the bracket closes from both sides.
            guess = low - below * ((high - low) / (above - below))
            s = guess + (1.0 if k % 3 else -1.0) * 2.0 * math.ulp(guess)
            s = s if low < s < high else middle
        value = at(s)
        if value >= 0.0:
            high, above = s, value
        else:
            low, below = s, value
    return high
