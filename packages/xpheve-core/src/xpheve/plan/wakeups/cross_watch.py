"""The sign of an expression of the state of an object, followed along its flight.

What reads neither state nor time has one sign a flight. What is a polynomial in time along a ballistic flight changes its sign where the
polynomial does, found for the whole flight at once. All else is followed in windows.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any
from weakref import WeakKeyDictionary

from xpheve.kernels.clock import NEVER
from xpheve.kernels.polynomial import value
from xpheve.kernels.sign_changes import Quartic, sign_changes
from xpheve.plan.wakeups.course import Course
from xpheve.plan.wakeups.crossings import State, window
from xpheve.plan.wakeups.expressions import expression_of
from xpheve.plan.wakeups.motion import Motion, Subject, is_still
from xpheve.plan.wakeups.watches import FIRST, Outlook, Record, Watch, is_rounding

Window = tuple[float, float, list[State]]


class CrossWatch(Watch):
    """The sign of an expression of the state of an object."""

    def __init__(self, world: Any, expression: Callable[[Any], Any]) -> None:
        super().__init__(world)
        self.expression = expression
        self.trace = expression_of(world, expression)
        self._held: WeakKeyDictionary[Subject, tuple[Any, Window]] = WeakKeyDictionary()
        """The last window of each subject, which has as many events as zeros."""

    def outlook(self, subject: Subject, motion: Motion, record: Record, now: float) -> Outlook:
        if record.begin != motion.begin:
            record.begin, record.start, record.wish = motion.begin, 0.0, FIRST
        course = Course(self.world, self.trace, subject, motion)
        if motion.span == 0.0 or not self.trace.moves:
            return Outlook([(0.0, _sign(course.at(0.0)))], reads=self.trace.reads)
        if self.trace.polynomial is not None:
            return Outlook(_polynomial_states(course.coefficients(), motion, self.trace.reads), reads=self.trace.reads)
        return self._in_windows(course, motion, record, now)

    def _in_windows(self, course: Course, motion: Motion, record: Record, now: float) -> Outlook:
        limit = motion.span
        while True:
            stop, wish, states = self._window(course, motion, record, limit)
            if "time" not in self.trace.reads and is_still(self.world, course.subject):
                return Outlook(states, reads=self.trace.reads)
            if stop > now or stop >= limit:
                return Outlook(states, stop if stop < limit else NEVER[0], wish, self.trace.reads)
            record.start, record.wish = stop, wish

    def _window(self, course: Course, motion: Motion, record: Record, limit: float) -> Window:
        key = (motion, record.start, record.wish, tuple(course.fixed.values()))
        held = self._held.get(course.subject)
        if held is not None and held[0] == key:
            return held[1]
        found = window(course, course.at, record.start, record.wish, limit)
        self._held[course.subject] = (key, found)
        return found


def _sign(number: float) -> int:
    return (number > 0.0) - (number < 0.0)


def _polynomial_states(c: Quartic, motion: Motion, reads: frozenset[str]) -> list[State]:
    """From when which sign of the polynomial ``c`` holds along ``motion``."""
    changes = sign_changes(c, 0.0, motion.span)
    edges = [0.0, *changes, motion.span]
    states: list[State] = []
    for low, high in pairwise(edges):
        sign = _sign_between(c, low, high)
        if sign == 0 or (states and states[-1][1] == sign):
            continue
        begin = 0.0 if not states else _reached(c, low)
        if len(states) == 1 and is_rounding(motion, 0.0, begin, reads):
            states.clear()  # it began on the edge, a unit on the wrong side of it
            begin = 0.0
        states.append((begin, sign))
    return states or [(0.0, 0)]


def _reached(c: Quartic, s: float) -> float:
    """``s``, the first float beyond a change; or the one before if that is the zero itself."""
    before = math.nextafter(s, -math.inf)
    return before if value(c, before) == 0.0 else s


def _sign_between(c: Quartic, low: float, high: float) -> int:
    """The sign of ``c`` where it has none but touches of zero; 0 if there is no float between."""
    if math.isinf(high):
        return next((_sign(one) for one in reversed(c) if one != 0.0), 0)
    for part in (0.5, 0.25, 0.75, 0.125, 0.625):
        s = low + part * (high - low)
        sign = _sign(value(c, s)) if low <= s <= high else 0
        if sign:
            return sign
    return 0
