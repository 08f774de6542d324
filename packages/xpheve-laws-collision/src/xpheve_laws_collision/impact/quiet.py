"""For how long nothing can meet: boxes about the ways of all places, as seen from their mean motion, that do not overlap."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

PART = 0.25  # of the mean distance between places, which they fly at their mean speed in the time that is tried
MOST = 8  # pairs a place that overlap along one axis, beyond which it is not looked further
SLACK = 1e-9  # of all lengths, far above rounding


def quiet_span(x: Floats, v: Floats, a: Floats, radius: Floats) -> float:
    """A time [s] in which no two of spheres at ``x`` (n, 3) [m], flying along parabolas, come within their radii; 0 if none is found.

    What is the same for all, mean velocity and mean acceleration, brings no two together: it is taken away first.
    """
    v = v - v.mean(axis=0)
    a = a - a.mean(axis=0)
    extents = np.ptp(x, axis=0)
    wide = extents[extents > 1e-3 * float(extents.max())]
    if not len(wide) or not np.isfinite(extents).all():
        return 0.0
    spacing = float(np.prod(wide ** (1.0 / len(wide)))) / len(x) ** (1.0 / len(wide))
    speed, bend = (float(np.sqrt((one * one).sum(axis=1).mean())) for one in (v, a))
    span = min(
        PART * spacing / speed if speed > 0.0 else math.inf,
        math.sqrt(2.0 * PART * spacing / bend) if bend > 0.0 else math.inf,
    )
    if not 0.0 < span < math.inf:
        return 0.0
    margin = radius * (1.0 + SLACK) + SLACK * (np.abs(x).max() + spacing)
    way = np.abs(v) * span + 0.5 * np.abs(a) * span * span + margin[:, None]
    return 0.0 if _overlap(x - way, x + way, extents) else span


def _overlap(low: Floats, high: Floats, extents: Floats) -> bool:
    """Whether two of the boxes do, or too many do along one axis to look."""
    axis = int(np.argmax(extents))
    others = [k for k in range(3) if k != axis]
    order = np.argsort(low[:, axis], kind="stable")
    low, high = low[order], high[order]
    last = np.searchsorted(low[:, axis], high[:, axis], side="right")
    counts = np.maximum(last - np.arange(len(low)) - 1, 0)
    chunk = 1024
    for begin in range(0, len(low), chunk):
        part = slice(begin, begin + chunk)
        number = int(counts[part].sum())
        if number > MOST * chunk * math.sqrt(len(low)):
            return True
        first = np.repeat(np.arange(begin, begin + len(counts[part])), counts[part])
        starts = np.repeat(np.cumsum(counts[part]) - counts[part], counts[part])
        second = first + 1 + (np.arange(number) - starts)
        hit = np.ones(number, dtype=bool)
        for k in others:
            hit &= (low[first, k] <= high[second, k]) & (low[second, k] <= high[first, k])
        if hit.any():
            return True
    return False
