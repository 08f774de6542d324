"""When two bodies meet of which one at least flies on a curve: by the curve's own interpolant, then to rounding on the flight itself.

Spheres, points and planes: the gap to a plane, or the difference of the squares of distance and reach, changes at a rate that is a polynomial;
the first time at which it is at zero and falls is found by bounds that miss no zero (`chebyshev.first_fall`), then by Newton's steps on the flights
as their steppers have them. What is missed is no deeper than the rounding of the ways in the window.

All other bodies: conservative advancement (Mirtich, thesis, Berkeley 1996). At an instant a unit vector parts the two by a gap; for as long as what
the centres move against each other along it, and turning can add at most, do not use that up, they cannot touch.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from xpheve.kernels.quaternion import rotate
from xpheve_laws_collision.impact_time.advancement import STEPS, UndecidedError
from xpheve_laws_collision.impact_time.chebyshev import first_fall
from xpheve_laws_collision.impact_time.course import Track, segments
from xpheve_laws_collision.narrow_phase import Family, Gap, Mover

Array = NDArray[np.float64]

NEWTON = 4  # steps at most that bring an instant to rounding
ROUNDED = 0.25  # of the gap that counts as none: so far what touches and turns away is followed at once
ULPS = 2.0**-51  # of the coordinates along the normal: a gap no larger is made no smaller
CLOSE = 1e-6  # of the sizes: from there on Newton's steps find a touch of bodies that turn
OVER = 1e-3  # of a step beyond where the touch should be, so that it is between two sides
FAR = 1e-9  # of the sizes: far above rounding
BLUR = 1e-14  # of the ways in a window: so well are they interpolated
TURNS = 1.1  # times the fastest turn that was seen: a bound between what was seen


class Side(NamedTuple):
    """One of the two: where its centre is, and the body at any time s [s]; how it turns at most [rad/s] from then on, and how far it reaches [m]."""

    track: Track
    at: Callable[[float], Mover]
    turns: Callable[[float, float], float]
    reach: float


class CurvedFamily:
    """The geometry of `family`, along the flights of ``one`` and ``two`` from ``begin`` [s] on."""

    def __init__(self, family: Family, one: Side, two: Side, round_bodies: bool, begin: float = 0.0) -> None:
        self.family, self.one, self.two, self.round, self.begin = family, one, two, round_bodies, begin
        self.rests = family.rests

    def gap(self, a: Mover, b: Mover) -> Gap:
        return self.family.gap(a, b)

    def points(self, a: Mover, b: Mover) -> list[Gap]:
        return self.family.points(a, b)

    def impact_time(self, a: Mover, b: Mover, gap: Gap, horizon: float) -> float:
        end = self.begin + horizon
        found = self._meets(gap, end, 1.0) if self.round else self._advance(gap, end)
        return self._within(found, end)

    def leave_time(self, a: Mover, b: Mover, gap: Gap, horizon: float) -> float:
        end = self.begin + horizon
        found = self._meets(gap, end, -1.0) if self.round else self._part(gap, end)
        return self._within(found, end)

    def apart_for(self, a: Mover, b: Mover) -> float:
        """Nothing is told sooner than by the search itself."""
        return 0.0

    def _within(self, found: float, end: float) -> float:
        return found - self.begin if found <= end else math.inf

    def _gap(self, s: float) -> Gap:
        return self.family.gap(self.one.at(s), self.two.at(s))

    # Spheres, points and planes

    def _meets(self, gap: Gap, end: float, sign: float) -> float:
        """The first time at which ``sign`` times the gap is at zero and falls."""
        a, b = self.one.at(self.begin), self.two.at(self.begin)
        flat = b.shape.kind == "plane"
        measure: _Flat | _Apart = (
            _Flat(self.one.track, a.shape.radius, b) if flat else _Apart(self.one.track, self.two.track, a, b)
        )
        unit = 1.0 if flat else 2.0 * measure.reach
        if unit == 0.0:
            return math.inf  # two points
        noise = gap.touch * unit
        here = 0.0 if abs(gap.separation) <= gap.touch else sign * measure.level(self.begin)
        tracks = (self.one.track,) if flat else (self.one.track, self.two.track)
        for low, high in segments(tracks, self.begin, end):
            if not measure.is_far(low, high, sign):
                found = first_fall(
                    lambda s: sign * measure.rates(s),
                    lambda s: sign * measure.level(s),
                    low, high, here, noise + unit * _blur(tracks, low, high), gap.still * unit,
                )  # fmt: skip
                if found < math.inf:
                    return self._polished(found, low, end)
            level = sign * measure.level(high) if high < end else math.inf
            here = level if abs(level) > noise else 0.0
        return math.inf

    def _polished(self, s: float, low: float, end: float) -> float:
        """``s`` by Newton's steps on the flights themselves, where their gap is more than rounding."""
        for _ in range(NEWTON):
            a, b = self.one.at(s), self.two.at(s)
            gap = self.family.gap(a, b)
            if abs(gap.separation) <= _rounding(a, b, gap) or abs(gap.speed) <= gap.still:
                break
            better = s - gap.separation / gap.speed
            if not low <= better <= end or better == s or abs(self._gap(better).separation) >= abs(gap.separation):
                break
            s = better
        return s

    # Bodies with corners

    def _advance(self, gap: Gap, end: float) -> float:
        s = self.begin
        for _ in range(STEPS):
            if s > self.begin:
                gap = self._gap(s)
            if gap.separation <= gap.touch and gap.speed < -gap.still:
                return s
            if 0.0 < gap.separation <= CLOSE * self._size() and gap.speed < -gap.still:
                found = self._newton(s, gap, end)
                if found is not None:
                    return found
            step = self._safe(s, gap, end)
            if step == math.inf:
                return math.inf
            if step <= s:
                step = max(s + ROUNDED * gap.touch / self._fastest(s, end), math.nextafter(s, math.inf))
            s = step
            if s > end:
                return math.inf
        raise UndecidedError(s - self.begin)

    def _size(self) -> float:
        return min(side.reach for side in (self.one, self.two) if 0.0 < side.reach)

    def _turn(self, s: float, end: float) -> float:
        """The most [m/s] that turning moves a corner of either."""
        return sum(side.reach * side.turns(s, end) for side in (self.one, self.two) if side.reach < math.inf)

    def _fastest(self, s: float, end: float) -> float:
        high = next((high for _, high in segments(self._tracks(), s, end)), end)
        times = np.linspace(s, high, 9)
        across = self.two.track.speed(times) - self.one.track.speed(times)
        return float(np.sqrt((across * across).sum(axis=0)).max()) + self._turn(s, end) + 1e-300

    def _tracks(self) -> Sequence[Track]:
        return self.one.track, self.two.track

    def _safe(self, s: float, gap: Gap, end: float) -> float:
        """Until when the direction that parts them now still does; infinite if to the end."""
        n = np.array(gap.normal)
        here = max(gap.separation, 0.0) + (0.5 * gap.touch if gap.separation <= gap.touch else 0.0)
        for low, high in segments(self._tracks(), s, end):
            turn = self._turn(low, high)
            first = n @ (self.two.track.place(np.array([low])) - self.one.track.place(np.array([low])))
            base = here - float(first[0])

            def level(t: float, base: float = base, low: float = low, turn: float = turn) -> float:
                at = np.array([t])
                return base + float((n @ (self.two.track.place(at) - self.one.track.place(at)))[0]) - turn * (t - low)

            def rates(t: Array, turn: float = turn) -> Array:
                found: Array = n @ (self.two.track.speed(t) - self.one.track.speed(t)) - turn
                return found

            found = first_fall(rates, level, low, high, here, gap.touch, 0.0)
            if found < math.inf:
                return found
            here = level(high)
        return math.inf

    def _newton(self, s: float, gap: Gap, end: float) -> float | None:
        """The touch just after ``s``, between two sides; None if it is not there."""
        low, high = s, s + (1.0 + OVER) * gap.separation / -gap.speed
        if high > end:
            return None
        beyond = self._gap(high)
        if beyond.separation > beyond.touch:
            return None
        for _ in range(60):
            if beyond.separation >= -beyond.touch:
                return high
            middle = 0.5 * (low + high)
            there = self._gap(middle)
            guess = middle - there.separation / there.speed if there.speed < 0.0 else middle
            if there.separation > there.touch:
                low = middle
            else:
                high, beyond = middle, there
            if low < guess < high:
                there = self._gap(guess)
                if there.separation > there.touch:
                    low = guess
                else:
                    high, beyond = guess, there
            if not low < middle < high and math.nextafter(low, math.inf) >= high:
                break
        return high

    def _part(self, gap: Gap, end: float) -> float:
        """When bodies that overlap or touch are apart."""
        s = self.begin
        for _ in range(STEPS):
            gap = self._gap(s)
            if gap.separation > gap.touch or (gap.separation >= -gap.touch and gap.speed > gap.still):
                return s
            depth = max(-gap.separation, gap.touch)
            s = max(s + depth / self._fastest(s, end), math.nextafter(s, math.inf))
            if s > end:
                return math.inf
        raise UndecidedError(s - self.begin, "no parting")


def _blur(tracks: Sequence[Track], low: float, high: float) -> float:
    """How well [m] the interpolants of ways know a place."""
    return BLUR * sum(float((np.abs(middle) + edges).max()) for middle, edges in (one.box(low, high) for one in tracks))


def _rounding(a: Mover, b: Mover, gap: Gap) -> float:
    """What rounding of the coordinates leaves of a gap [m]."""
    along = math.fsum(abs(n) * (abs(x) + abs(y)) for n, x, y in zip(gap.normal, a.position, b.position, strict=True))
    return ULPS * along


class _Flat:
    """A sphere above a plane: its gap [m]."""

    reach = 0.5

    def __init__(self, ball: Track, radius: float, plane: Mover) -> None:
        self.ball, self.radius = ball, float(radius)
        self.normal = np.array(rotate(plane.orientation, plane.shape.normal))
        self.base = np.array(plane.position)[:, None]
        self.offset = float(plane.shape.offset)

    def is_far(self, low: float, high: float, sign: float) -> bool:
        """Whether ``sign`` times the level surely is above 0 all along, by boxes about the ways."""
        middle, edges = self.ball.box(low, high)
        swing = float(np.abs(self.normal) @ edges) * (1.0 + FAR)
        level = float(self.normal @ (middle - self.base[:, 0])) - self.offset - self.radius
        return sign * level > swing + FAR * (abs(level) + self.radius)

    def rates(self, s: Array) -> Array:
        found: Array = self.normal @ self.ball.speed(s)
        return found

    def level(self, s: float) -> float:
        return float((self.normal @ (self.ball.place(np.array([s])) - self.base))[0]) - self.offset - self.radius


class _Apart:
    """Two spheres: the square of the distance of their centres less that of their reach [m^2], by which nothing is divided."""

    def __init__(self, one: Track, two: Track, a: Mover, b: Mover) -> None:
        self.one, self.two = one, two
        self.reach = float(a.shape.radius + b.shape.radius)

    def is_far(self, low: float, high: float, sign: float) -> bool:
        """See `_Flat.is_far`."""
        (x, size), (y, other) = self.one.box(low, high), self.two.box(low, high)
        apart, edges = np.abs(y - x), (size + other) * (1.0 + FAR)
        least, most = np.maximum(apart - edges, 0.0), apart + edges
        if sign > 0.0:
            return float(np.sqrt((least * least).sum())) > self.reach * (1.0 + FAR)
        return float(np.sqrt((most * most).sum())) < self.reach * (1.0 - FAR)

    def rates(self, s: Array) -> Array:
        d, w = self.two.place(s) - self.one.place(s), self.two.speed(s) - self.one.speed(s)
        found: Array = 2.0 * (d * w).sum(axis=0)
        return found

    def level(self, s: float) -> float:
        at = np.array([s])
        distance = float(np.sqrt(((self.two.place(at) - self.one.place(at)) ** 2).sum()))
        return (distance - self.reach) * (distance + self.reach)
