"""When a ball on a parabola can touch boxes: bounds from below, for many boxes at once."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from xpheve.kernels.vector import Vec

Array = NDArray[np.float64]

SLACK = 1e-12  # relative: bounds are looser by far more than rounding
TIGHTENED = 3  # times that bounds are improved


def box_times(x: Vec, v: Vec, a: Vec, lows: Array, highs: Array) -> tuple[Array, Array]:
    """The first and the last time [s] at which x + v s + a s^2 / 2 can be in each box; the first is infinite where it never is.

    Axis by axis the first and last time between the two faces; between them it may be outside for a while.
    """
    first = np.zeros(len(lows))
    last = np.full(len(lows), math.inf)
    with np.errstate(all="ignore"):
        for k in range(3):
            enters, leaves = _slab_times(v[k], a[k], lows[:, k] - x[k], highs[:, k] - x[k])
            first = np.maximum(first, enters)
            last = np.minimum(last, leaves)
    first *= 1.0 - SLACK
    last *= 1.0 + SLACK
    first[~(first <= last)] = math.inf
    return first, last


def _slab_times(v: float, a: float, low: Array, high: Array) -> tuple[Array, Array]:
    """First and last time s >= 0 with low <= v s + a s^2 / 2 <= high; the first is infinite where there is none."""
    ahead = np.where(low > 0.0, low, np.where(high < 0.0, high, 0.0)) * (1.0 - SLACK)
    if a == 0.0:
        if v == 0.0:
            return np.where(ahead == 0.0, 0.0, math.inf), np.full(len(low), math.inf)
        enters = np.where(ahead == 0.0, 0.0, ahead / v)
        enters[enters < 0.0] = math.inf
        return enters, (high if v > 0.0 else low) / v
    one, other = _roots(v, a, ahead)
    one[~(one >= 0.0)] = math.inf
    other[~(other >= 0.0)] = math.inf
    enters = np.where(ahead == 0.0, 0.0, np.minimum(one, other))
    end = high + SLACK * np.abs(high) if a > 0.0 else low - SLACK * np.abs(low)
    one, other = _roots(v, a, end)
    leaves = np.maximum(one, other)
    leaves[np.isnan(leaves)] = -math.inf
    return enters, leaves


def _roots(v: float, a: float, way: Array) -> tuple[Array, Array]:
    """Both s with v s + a s^2 / 2 = way; not a number where there is none."""
    q = -(v + math.copysign(1.0, v) * np.sqrt(v * v + 2.0 * a * way))
    second = -2.0 * way / q
    second[q == 0.0] = 0.0
    return q / a, second


def ball_times(x: Vec, v: Vec, a: Vec, radius: float, lows: Array, highs: Array, horizon: float) -> Array:
    """A time [s] before which a ball cannot touch each box; infinite where it does not within ``horizon``.

    From the box times, by the distance that is left and the greatest speed on the way.
    """
    first, last = box_times(x, v, a, lows - radius, highs + radius)
    end = np.minimum(last, horizon)
    first[first > end] = math.inf
    alive = np.flatnonzero(first < math.inf)
    if end[alive].max(initial=0.0) == math.inf:
        return first
    start, speed, pull = np.array(x), np.array(v), np.array(a)
    for _ in range(TIGHTENED):
        s, stop = first[alive, None], end[alive, None]
        place = start + s * (speed + 0.5 * s * pull)
        away = place - np.clip(place, lows[alive], highs[alive])
        way = np.sqrt((away * away).sum(axis=1)) - radius
        fastest = np.sqrt(np.maximum(((speed + s * pull) ** 2).sum(axis=1), ((speed + stop * pull) ** 2).sum(axis=1)))
        with np.errstate(all="ignore"):
            later = first[alive] + np.where(way > 0.0, way / fastest, 0.0) * (1.0 - SLACK)
        later *= 1.0 - SLACK
        later = np.maximum(first[alive], later)
        later[later > end[alive]] = math.inf
        first[alive] = later
        alive = alive[later < math.inf]
    return first
