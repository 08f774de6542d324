"""Between the steps: polynomials through what is known at their ends."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from xpheve.steppers.contract import Array, Rows


class Node(NamedTuple):
    """A place of the path with its first and second derivative, (components, rows) each."""

    place: Array
    rate: Array
    bend: Array


class Newton(NamedTuple):
    """Polynomials c_0 + (s - t_0)(c_1 + (s - t_1)(c_2 + ...)), one a component and row; coefficients (components, rows), times (1, rows)."""

    coefficients: tuple[Array, ...]
    times: tuple[Array, ...]

    def of(self, places: slice | Rows) -> Newton:
        """Those of the rows at ``places``."""
        if isinstance(places, slice) and places == slice(None):
            return self
        return Newton(*(tuple(one[:, places] for one in part) for part in self))

    def at(self, s: Array) -> tuple[Array, Array]:
        """Values and first derivatives at ``s`` (1, rows)."""
        place = self.coefficients[-1]
        rate = np.zeros_like(place)
        for coefficient, time in zip(self.coefficients[-2::-1], self.times[::-1], strict=True):
            d = s - time
            rate = rate * d + place
            place = place * d + coefficient
        return place, rate


def through(nodes: Sequence[Node], times: Sequence[Array], derivatives: int) -> Newton:
    """Hermite's polynomial through ``nodes`` at ``times`` [s], (1, rows) and all different, and their first one or two ``derivatives``.

    Divided differences (J. Stoer, R. Bulirsch, Introduction to Numerical Analysis, 2.1.5); exact at the first node.
    """
    each = derivatives + 1
    knots = [node for node in nodes for _ in range(each)]
    when = [time for time in times for _ in range(each)]
    column = [knot.place for knot in knots]
    found = [column[0]]
    for level in range(1, len(knots)):
        following = []
        for k in range(len(knots) - level):
            if k // each != (k + level) // each:
                following.append((column[k + 1] - column[k]) / (when[k + level] - when[k]))
            else:
                following.append(knots[k].rate if level == 1 else 0.5 * knots[k].bend)
        column = following
        found.append(column[0])
    return Newton(tuple(found), tuple(when[:-1]))


def octic(begin: Node, end: Node, earlier: Node, span: Array, ago: Array) -> Newton:
    """Places in s [s] after ``begin``, of degree 8: through ``end`` at ``span`` and ``earlier`` at ``ago``, and all derivatives.

    Its error is that of a path's ninth derivative, below span^9 / 6e6 of it where ``ago`` = -span.
    """
    return through((begin, end, earlier), (0.0 * span, span, ago), 2)


def cubic(begin: Node, end: Node, span: Array) -> Newton:
    """As `octic`, through places and velocities at both ends alone: the error is that of the fourth derivative."""
    return through((begin, end), (0.0 * span, span), 1)
