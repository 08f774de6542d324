"""The sign of an expression of the state of an object, followed along its flight.

What reads neither state nor time has one sign a flight. What is a polynomial in time along a ballistic flight changes its sign where the
polynomial does, found for the whole flight at once. All else, and what is read of place and velocity along a curved flight, is followed in
windows.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

from xpheve.kernels.polynomial import value
from xpheve.kernels.sign_changes import Quartic, sign_changes
from xpheve.plan.wakeups.course import FLYING, Course
from xpheve.plan.wakeups.crossings import State, window
from xpheve.plan.wakeups.expressions import expression_of
from xpheve.plan.wakeups.motion import Motion, Subject, is_still
from xpheve.plan.wakeups.watches import Outlook, Record, Watch, Window, is_rounding


class CrossWatch(Watch):
    """The sign of an expression of the state of an object."""

    def __init__(self, world: Any, expression: Callable[[Any], Any]) -> None:
        super().__init__(world)
        self.expression = expression
        self.trace = expression_of(world, expression)

    def outlook(self, subject: Subject, motion: Motion, record: Record, now: float) -> Outlook:
        course = Course(self.world, self.trace, subject, motion)
        reads = self.trace.reads
        if motion.span == 0.0 or not self.trace.moves:
            return Outlook([(0.0, _sign(course.at(0.0)))], reads=reads)
        if self.trace.polynomial is not None and (motion.curve is None or not reads & set(FLYING)):
            return Outlook(_polynomial_states(course.coefficients(), motion, reads), reads=reads)
        scale = motion.first_window

        def find(start: float, wish: float) -> Window:
            return window(course, course.at, start, wish, motion.span, scale)

        stays = "time" not in reads and self._stays(motion) and is_still(self.world, course.subject)
        return self.in_windows(find, subject, motion, record, now, (stays, *course.fixed.values()), stays, reads)

    @staticmethod
    def _stays(motion: Motion) -> bool:
        """Whether a flight that is still is so for as long as it lasts, for all that a few looks at it say."""
        return motion.curve is None or math.isinf(motion.span)


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
