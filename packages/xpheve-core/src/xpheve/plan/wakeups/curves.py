"""Flights that are no parabolas, followed by reading them from their stepper."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from xpheve.errors import XpheveError
from xpheve.events import Guard
from xpheve.kernels.clock import Instant, later
from xpheve.kernels.vector import Vec

LONGEST = 2.0**40  # [s] from which downwards a pace is looked for
FACTOR = 0.25  # from one length that is tried to the next
TRIES = 64
BENT = 0.1  # of the change of velocity: a flight farther off its parabola is bent
HARDLY = 1e-6  # of the velocity: a change below it bends nothing, as where a spring is slack
ROUNDING = 1e-14  # of the coordinates: a way so short is no way
STILL_PARTS = 8  # of a step, at whose ends a body at rest is looked at
STILL_SPANS = (2.0**-20, 2.0**-10, 1.0, 2.0**10)  # [s] the same, of a flight without end


class Curve:
    """The path of the centre of ``row`` from ``begin`` on, known for ``span`` [s]; equal to any other of the same flight.

    ``velocity`` [m/s] and ``acceleration`` [m/s^2] are those at its beginning.
    """

    __slots__ = ("_places", "acceleration", "begin", "guards", "row", "span", "velocity", "world")

    def __init__(
        self,
        world: Any,
        row: int,
        begin: Instant,
        span: float,
        velocity: Vec,
        acceleration: Vec,
        guards: tuple[Guard, ...],
    ) -> None:
        self.world, self.row, self.begin, self.span = world, row, begin, span
        self.velocity, self.acceleration, self.guards = velocity, acceleration, guards
        self._places: dict[float, Vec] = {}

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Curve) and (self.row, self.guards) == (other.row, other.guards)

    def __hash__(self) -> int:
        return hash(self.row)

    def read(self, name: str, s: float) -> Any:
        """Column ``name`` of the row, ``s`` [s] after the flight began."""
        return self.world.read_row(self.row, name, later(self.begin, s))

    def place(self, s: float) -> Vec:
        """Position [m] after ``s`` [s]."""
        found = self._places.get(s)
        if found is None:
            found = self._places[s] = self.read("position", s)
        return found

    def first_window(self) -> float:
        """How long [s] a window to begin with: a step of the stepper is smooth; of a flight without end, its pace."""
        return self.span if math.isfinite(self.span) else self.pace()

    def pace(self) -> float:
        """For how long [s] the flight stays near its parabola, to a factor of four: the time scale of a flight without end.

        The longest power of four over which velocity changes as acceleration says, to a tenth. That is looked for from above: where motion
        has gone round in between, its velocity has changed by far less than the acceleration says.
        """
        known = self.world.wakeups.paces.get(self.world.bodies.objects[self.row])
        if known is not None and known[0] == self.guards:
            return float(known[1])
        v, a = np.array(self.velocity), np.array(self.acceleration)
        hardly = HARDLY * float(np.abs(v).max())
        found, h = 1.0, LONGEST
        for _ in range(TRIES):
            change = self._change(v, h)
            if change is not None:
                off = float(np.abs(change - h * a).max())
                if off <= BENT * float(np.abs(change).max()) + hardly:
                    found = h
                    break
            h *= FACTOR
        self.world.wakeups.paces[self.world.bodies.objects[self.row]] = (self.guards, found)
        return found

    def _change(self, v: Any, h: float) -> Any:
        """How the velocity changes within ``h`` [s]; None if that is no number, as far along a motion that grows without end."""
        try:
            with np.errstate(all="ignore"):
                change = np.array(self.read("velocity", h)) - v
        except (ArithmeticError, XpheveError):
            return None
        return change if np.isfinite(change).all() else None

    def is_still(self) -> bool:
        """Whether the flight stays where it began: no acceleration there, and no velocity there nor later.

        A flight without end is one formula, so that what does not move at some moments never does.
        """
        if any(self.velocity) or any(self.acceleration):
            return False
        parts = range(1, STILL_PARTS + 1)
        spans = [k / STILL_PARTS * self.span for k in parts] if math.isfinite(self.span) else STILL_SPANS
        return not any(any(self.read("velocity", s)) for s in spans)

    def is_no_way(self, low: float, high: float) -> bool:
        """Whether the ways from ``low`` to ``high`` [s], and half as far, are within rounding of the position."""
        here = self.place(low)
        size = max(map(abs, (*here, *self.place(0.0))))
        size += high * max(map(abs, (*self.velocity, *self.read("velocity", low)))) + 1e-300
        for s in (high, 0.5 * (low + high)):
            if any(abs(x1 - x0) > ROUNDING * size for x1, x0 in zip(self.place(s), here, strict=True)):
                return False
        return True

    def is_no_push(self, low: float, high: float) -> bool:
        """Whether the velocity changes from ``low`` to ``high`` [s] by no more than rounding."""
        here, there = self.read("velocity", low), self.read("velocity", high)
        size = max(map(abs, (*here, *self.velocity))) + high * max(map(abs, self.acceleration)) + 1e-300
        return all(abs(v1 - v0) <= ROUNDING * size for v1, v0 in zip(there, here, strict=True))
