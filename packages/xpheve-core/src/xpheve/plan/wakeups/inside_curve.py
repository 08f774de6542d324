"""When a point, or a sphere about it, is inside a region along a flight that is no parabola: window by window.

Each side of a region is a function of time that is as smooth as the flight: the distance to a plane, the square of that to a centre, the
coordinates of a box. Their zeros part a window, and between these one test says what holds.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from xpheve.kernels.sign_changes import between
from xpheve.kernels.vector import Vec, dot
from xpheve.plan.wakeups.crossings import State, window
from xpheve.plan.wakeups.curves import Curve
from xpheve.plan.wakeups.inside import turned
from xpheve.regions import Region
from xpheve.shapes import Box, Plane, Sphere

Gap = Callable[[float], float]
NEAR = 16  # floats of time about a zero in which rounding may have put the change


def inside_curve(
    region: Region, radius: float, curve: Curve, start: float, wish: float, end: float
) -> tuple[float, float, list[State]]:
    """A window [start, stop]: stop, the length to wish for next, and from when on a sphere of ``radius`` [m] meets ``region`` or does not.

    Parameters
    ----------
    region, radius
        What is entered, and by what: 0 for a point.
    curve
        The path of the centre.
    start, wish, end
        [s] since the path began: where the window begins, how long it may be, and until when the path is known.
    """
    scale = curve.first_window()
    outside: Callable[[float], bool]
    if isinstance(region.shape, Box):
        box = _Box(region, radius, curve)
        stop, changes = _changes(box.faces, start, wish, end, scale)
        if radius > 0.0:
            stop, changes = _round_edges(box, start, stop, changes, scale)
        outside = box.outside
    else:
        gap = _gap(region, radius, curve)
        stop, changes = _changes([gap], start, wish, end, scale)
        outside = _beyond(gap)
    wanted = 2.0 * wish if stop - start >= min(wish, end - start) else stop - start
    return stop, wanted, _states(outside, changes, start, stop)


def _changes(gaps: list[Gap], start: float, wish: float, end: float, scale: float) -> tuple[float, list[float]]:
    """The end of a window in which all of ``gaps`` are resolved, and where one of them changes its sign in it."""
    found: set[float] = set()
    stop = end
    for gap in gaps:
        stop, _, states = window(_many(gap), gap, start, min(wish, stop - start), stop, scale)
        found.update(s for s, _ in states[1:])
    return stop, sorted(s for s in found if s <= stop)


def _beyond(gap: Gap) -> Callable[[float], bool]:
    """Whether ``gap`` is above 0; so asked that what may end as NaN is."""
    return lambda s: not gap(s) <= 0.0


def _many(gap: Gap) -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
    return lambda times: np.array([gap(s) for s in times.tolist()])


def _round_edges(box: _Box, start: float, stop: float, changes: list[float], scale: float) -> tuple[float, list[float]]:
    """The same with the changes of the distance to ``box``, which is smooth between those of its faces."""
    found: list[float] = []
    for low, high in pairwise([start, *changes, stop]):
        if not low < high:
            continue
        nearest = box.nearest(between(low, high))
        reached, more = _changes([nearest], low, high - low, high, scale)
        found += [low, *more]
        if reached < high:
            return reached, found
    return stop, found


def _states(outside: Callable[[float], bool], changes: list[float], start: float, stop: float) -> list[State]:
    """What holds between neighbouring ``changes``, asked in the middle; changes that change nothing are left out."""
    found: list[State] = []
    for low, high in pairwise([start, *changes, stop]):
        if low < high or not found:
            state = not outside(between(low, high))
            if not found or found[-1][1] != state:
                found.append((_first(outside, state, low, start), state))
    return found


def _first(outside: Callable[[float], bool], state: bool, s: float, start: float) -> float:
    """The first float about ``s`` from which on ``state`` holds, if there is one near."""
    here = s
    for _ in range(NEAR):
        before = math.nextafter(here, -math.inf)
        if here <= start or outside(before) == state:
            break
        here = before
    for _ in range(NEAR):
        if outside(here) != state:
            return here
        here = math.nextafter(here, math.inf)
    return s


def _gap(region: Region, radius: float, curve: Curve) -> Gap:
    """Plane and sphere: what is above 0 outside."""
    c = region.position
    if isinstance(region.shape, Plane):
        assert region.shape.normal is not None
        n, offset = turned(region, region.shape.normal), region.shape.offset

        def above(s: float) -> float:
            x = curve.place(s)
            return dot(n, (x[0] - c[0], x[1] - c[1], x[2] - c[2])) - offset - radius

        return above
    assert isinstance(region.shape, Sphere)
    reach = region.shape.radius + radius

    def beyond(s: float) -> float:
        x = curve.place(s)
        distance = math.hypot(x[0] - c[0], x[1] - c[1], x[2] - c[2])
        return (distance - reach) * (distance + reach)

    return beyond


class _Box:
    """A box met by a sphere of ``radius`` [m] on ``curve``."""

    def __init__(self, region: Region, radius: float, curve: Curve) -> None:
        assert isinstance(region.shape, Box)
        self.region, self.radius, self.curve = region, radius, curve
        self.half = [0.5 * edge for edge in region.shape.size]
        self.faces: list[Gap] = [self._face(k, side) for k in range(3) for side in (1.0, -1.0)]

    def local(self, s: float) -> Vec:
        """The centre in the axes of the box."""
        x, c = self.curve.place(s), self.region.position
        p = (x[0] - c[0], x[1] - c[1], x[2] - c[2])
        e, f, g = self.region.axes
        return dot(e, p), dot(f, p), dot(g, p)

    def _face(self, k: int, side: float) -> Gap:
        return lambda s: self.local(s)[k] - side * self.half[k]

    def outside(self, s: float) -> bool:
        square = 0.0
        for q, h in zip(self.local(s), self.half, strict=True):
            over = abs(q) - h
            if self.radius == 0.0 and over > 0.0:
                return True
            square += over * over if over > 0.0 else 0.0
        return square > self.radius * self.radius

    def nearest(self, s: float) -> Gap:
        """The square of the distance to the face, edge or corner that is nearest at ``s``, less that of the radius."""
        places = [
            (k, math.copysign(h, q))
            for k, (q, h) in enumerate(zip(self.local(s), self.half, strict=True))
            if abs(q) > h
        ]

        def gap(s: float) -> float:
            q = self.local(s)
            distance = math.hypot(*(q[k] - h for k, h in places))
            return (distance - self.radius) * (distance + self.radius)

        return gap
