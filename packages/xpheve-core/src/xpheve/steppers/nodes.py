"""Between the steps: the polynomial through places, velocities and accelerations at three instants."""

from __future__ import annotations

from typing import NamedTuple

from xpheve.steppers.contract import Array


class Node(NamedTuple):
    """A place of the path with its first and second derivative, (components, rows) each."""

    place: Array
    rate: Array
    bend: Array


def between(begin: Node, end: Node, earlier: Node, span: Array, ago: Array, s: Array) -> tuple[Array, Array]:
    """Place and first derivative ``s`` [s] after ``begin``, (components, rows) each.

    Hermite's polynomial of degree 8 through three nodes, in Newton's form from ``begin`` on, to ``end`` at ``span`` and ``earlier`` at ``ago``
    (J. Stoer, R. Bulirsch, Introduction to Numerical Analysis, 2.1.5). It is exact at ``s`` = 0, and right to rounding at the others; its error
    in between is that of a path's ninth derivative, below span^9 / 6e6 of it where ``ago`` = -span.

    Parameters
    ----------
    span, ago, s
        Times [s] since ``begin``, (1, rows); none of the first two is 0, nor are they equal.
    """
    knots = (begin, begin, begin, end, end, end, earlier, earlier, earlier)
    times = (0.0 * span, 0.0 * span, 0.0 * span, span, span, span, ago, ago, ago)
    column = [knot.place for knot in knots]
    coefficients = [column[0]]
    for level in range(1, 9):
        following = []
        for k in range(9 - level):
            if k // 3 != (k + level) // 3:
                following.append((column[k + 1] - column[k]) / (times[k + level] - times[k]))
            else:
                following.append(knots[k].rate if level == 1 else 0.5 * knots[k].bend)
        column = following
        coefficients.append(column[0])
    place, rate = coefficients[8], 0.0 * coefficients[8]
    for k in range(7, -1, -1):
        d = s - times[k]
        rate = rate * d + place
        place = place * d + coefficients[k]
    return place, rate


def cubic(begin: Node, end: Node, span: Array, s: Array) -> tuple[Array, Array]:
    """As `between`, through places and velocities at both ends alone: Hermite's cubic, whose error is that of the fourth derivative."""
    mean = (end.place - begin.place) / span
    bend = (mean - begin.rate) / span
    twist = ((end.rate - mean) / span - bend) / span
    after = s - span
    place = begin.place + s * (begin.rate + s * (bend + after * twist))
    rate = begin.rate + s * (2.0 * (bend + after * twist) + s * twist)
    return place, rate
