"""Flights on curves, as the contact server follows them: window by window, each interpolated once for all pairs.

A step of a stepper is one window. A flight without end is cut into windows that begin where it does, the first about as long as it takes to bend,
each next one as long as all before it together, up to a limit: by the flight alone, so that nothing depends on who asked when.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from xpheve.kernels.clock import NEVER, Instant, elapsed, later
from xpheve.kernels.vector import Vec
from xpheve.objects import PhysicalObject
from xpheve.steppers.contract import Flight

if TYPE_CHECKING:
    from xpheve_laws_collision.impact_time.course import Course, Track

    Known = tuple[int, Course]

PACES = 16.0
"""How many times as long as a flight without end stays near its parabola its first window is: a radian or two of an oscillation."""
LONGEST = 16.0
"""How many times as long as the first a window gets."""


class Curves:
    """The curved flights of ``world`` whose contacts are looked for."""

    def __init__(self, world: Any) -> None:
        self.world = world
        self.windows = 0
        """How many were interpolated."""
        self._courses: dict[PhysicalObject, Known] = {}

    def window(self, obj: PhysicalObject, flight: Flight) -> tuple[Instant, Instant]:
        """Where the window of the flight begins, and where it ends, in which the present instant lies."""
        if not flight.curved or flight.t1 != NEVER:
            return flight.t0, flight.t1
        begin = flight.t0
        now: Instant = max(self.world.time, begin)
        width = 2.0 ** math.ceil(math.log2(PACES * self.world.pace(obj._row)))
        width = max(width, 2.0**20 * math.ulp(now[0]))  # so that time is fine beside it
        low, high = _edges(elapsed(now, begin) / width)
        while later(begin, high * width) <= now:  # by rounding
            low, high = _edges(high)
        return later(begin, low * width), later(begin, high * width)

    def course(self, obj: PhysicalObject, flight: Flight) -> Course | None:
        """The present window of a curved flight; None if its next step is not made yet."""
        from xpheve_laws_collision.impact_time.course import Course

        low, high = self.window(obj, flight)
        if not low < high:
            return None
        version = int(self.world.bodies.version[obj._row])
        known = self._courses.get(obj)
        if known is None or known[0] != version or known[1].begin != low or known[1].end != high:
            row, read = obj._row, self.world.read_times
            self.windows += 1
            known = self._courses[obj] = version, Course(lambda name, at: read(row, name, at), low, high)
        return known[1]

    def forget(self, obj: PhysicalObject) -> None:
        """``obj`` is gone."""
        self._courses.pop(obj, None)

    def track(self, obj: PhysicalObject, start: Instant, flight: Flight) -> Track:
        """Where the centre of ``obj`` is after ``start``, within its window."""
        from xpheve_laws_collision.impact_time.course import Parabola, Since

        if flight.curved:
            course = self.course(obj, flight)
            assert course is not None
            return Since(course, elapsed(start, course.begin))
        s = elapsed(start, flight.t0)
        x, v, a = flight.position, flight.velocity, flight.acceleration
        return Parabola(
            (_place(x[0], v[0], a[0], s), _place(x[1], v[1], a[1], s), _place(x[2], v[2], a[2], s)),
            (v[0] + s * a[0], v[1] + s * a[1], v[2] + s * a[2]),
            a,
        )

    def centre(self, obj: PhysicalObject, t: Instant, flight: Flight) -> tuple[Vec, Vec, Vec]:
        """Position, velocity and acceleration at ``t`` of a curved flight."""
        sixfold = self.tangent(obj, t, flight)
        return sixfold[:3], sixfold[3:], self._acceleration(obj, t, flight)

    def tangent(self, obj: PhysicalObject, t: Instant, flight: Flight) -> Any:
        """Position and velocity at ``t`` of a curved flight, (6,)."""
        if t == flight.t0:
            return *flight.position, *flight.velocity
        row, read = obj._row, self.world.read_row
        return *read(row, "position", t), *read(row, "velocity", t)

    def _acceleration(self, obj: PhysicalObject, t: Instant, flight: Flight) -> Vec:
        """As at ``t`` by the last window that is known, also if an event has just ended it."""
        version = int(self.world.bodies.version[obj._row])
        known = self._courses.get(obj)
        course = known[1] if known is not None and known[0] == version else None
        if course is None or not course.begin <= t <= course.end:
            if t == flight.t0 or not flight.t0 < flight.t1:
                return flight.acceleration
            course = self.course(obj, flight)
        found = None if course is None else course.acceleration(elapsed(t, course.begin))
        return flight.acceleration if found is None else found

    def turn(self, obj: PhysicalObject, start: Instant, low: float, high: float) -> float:
        """The fastest turn [rad/s] that is seen from ``low`` to ``high`` [s] after ``start``."""
        instants = [later(start, s) for s in np.linspace(low, high, 25).tolist()]
        spins = self.world.read_times(obj._row, "angular_velocity", instants)
        return float(np.sqrt((spins * spins).sum(axis=0)).max())


def _edges(s: float) -> tuple[float, float]:
    """Where the window begins, and where it ends, that holds ``s`` first windows after a flight began."""
    if s < 1.0:
        return 0.0, 1.0
    if s < 2.0 * LONGEST:
        low = 2.0 ** math.floor(math.log2(s))
        return low, 2.0 * low
    low = LONGEST * math.floor(s / LONGEST)
    return low, low + LONGEST


def _place(x: float, v: float, a: float, s: float) -> float:
    return x + s * (v + 0.5 * s * a)
