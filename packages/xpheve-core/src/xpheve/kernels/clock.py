"""Instants as (base, offset): the unevaluated sum of two floats, normalised so that base = fl(base + offset).

About 32 digits, so that intervals of 1e-10 s keep their digits late in a run, and comparing tuples compares instants.

Source: error-free sums of Knuth, The Art of Computer Programming 2, 4.2.2; Dekker, Numer. Math. 18 (1971) 224.
"""

from __future__ import annotations

Instant = tuple[float, float]

START: Instant = (0.0, 0.0)
NEVER: Instant = (float("inf"), 0.0)


def two_sum(a: float, b: float) -> Instant:
    """``a + b`` without loss, as (rounded sum, its error)."""
    s = a + b
    if s - s != 0.0:  # inf or NaN: there is no error term
        return s, 0.0
    t = s - a
    return s, (a - (s - t)) + (b - t)


def later(instant: Instant, span: float) -> Instant:
    """The instant ``span`` [s] after ``instant``."""
    s, e = two_sum(instant[0], span)
    return two_sum(s, e + instant[1])


def elapsed(instant: Instant, since: Instant) -> float:
    """Time [s] from ``since`` to ``instant``, rounded once."""
    s, e = two_sum(instant[0], -since[0])
    return s + (e + (instant[1] - since[1]))


def multiple(origin: Instant, k: int, span: float) -> Instant:
    """``origin + k * span`` [s], the product without loss."""
    p = k * span
    high, low = _split(float(k))
    h, l = _split(span)
    error = ((high * h - p) + high * l + low * h) + low * l
    s, e = two_sum(origin[0], p)
    return two_sum(s, e + (origin[1] + error))


def _split(a: float) -> tuple[float, float]:
    """``a`` as two floats of 26 bits each (Veltkamp)."""
    c = 134217729.0 * a
    high = c - (c - a)
    return high, a - high
