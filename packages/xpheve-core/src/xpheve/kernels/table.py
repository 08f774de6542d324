"""Tables that are interpolated: in a straight line, or by cubics, between given points.

A table of n points x_0 < ... < x_(n-1) is cut into n + 1 pieces: before x_0, between neighbours, from x_(n-1) on. Each piece is a
polynomial in x - anchor, so that a look-up is one search and one polynomial, without a branch on where x lies. In the flat buffer
``tables`` it begins at ``start``::

    4       lowest and highest x that have a value; x is then held to between the next two
    n + 1   anchors: x_0, x_0, x_1, ..., x_(n-1)
    n + 1   values at the anchors
    n + 1   slopes there
    n + 1   coefficients of (x - anchor)^2, and n + 1 of (x - anchor)^3: cubic tables only

Outside its lowest and highest x, and for NaN, a table is NaN.
"""

import math

HEAD = 4

Buffer = tuple[float, ...]
"""Floats one after another; in a run, a view of memory."""


def piece(tables: Buffer, start: int, count: int, x: float) -> int:
    """Which piece ``x`` lies in: how many of the ``count`` points are <= x, 0 for NaN.

    A binary search whose steps depend on ``count`` alone (P.-V. Khuong, P. Morin, ACM J. Exp. Algorithmics 22, 1.3 (2017)).
    """
    first = start + HEAD + 1
    low = 0
    left = count
    while left > 1:
        half = left // 2
        low = low + half if tables[first + low + half - 1] <= x else low
        left -= half
    return low + 1 if tables[first + low] <= x else low


def held(tables: Buffer, start: int, x: float) -> float:
    """``x``, held to where the table goes on; NaN where it has no value."""
    inside = x if tables[start] <= x <= tables[start + 1] else math.nan
    above = tables[start + 2] if inside < tables[start + 2] else inside
    return tables[start + 3] if above > tables[start + 3] else above


def moves(tables: Buffer, start: int, x: float) -> float:
    """1 where the table follows ``x``, 0 where it is held, NaN where it has no value."""
    inside = 1.0 if tables[start] <= x <= tables[start + 1] else math.nan
    return inside if tables[start + 2] <= x <= tables[start + 3] else 0.0 * inside


def linear(tables: Buffer, start: int, count: int, x: float) -> float:
    """The value at ``x``, in straight lines between points."""
    u = held(tables, start, x)
    k = start + HEAD + piece(tables, start, count, u)
    n = count + 1
    return tables[k + n] + (u - tables[k]) * tables[k + 2 * n]


def linear_slope(tables: Buffer, start: int, count: int, x: float) -> float:
    """The derivative of `linear`: at a point, that of the line behind it."""
    k = start + HEAD + piece(tables, start, count, x)
    return tables[k + 2 * (count + 1)] * moves(tables, start, x)


def cubic(tables: Buffer, start: int, count: int, x: float) -> float:
    """The value at ``x``, by a cubic between points and straight lines outside."""
    u = held(tables, start, x)
    k = start + HEAD + piece(tables, start, count, u)
    n = count + 1
    t = u - tables[k]
    return tables[k + n] + t * (tables[k + 2 * n] + t * (tables[k + 3 * n] + t * tables[k + 4 * n]))


def cubic_slope(tables: Buffer, start: int, count: int, x: float) -> float:
    """The derivative of `cubic`."""
    k = start + HEAD + piece(tables, start, count, x)
    n = count + 1
    t = x - tables[k]
    found = tables[k + 2 * n] + t * (2.0 * tables[k + 3 * n] + t * (3.0 * tables[k + 4 * n]))
    follows = moves(tables, start, x)
    return 0.0 if follows == 0.0 else found * follows


def cubic_bend(tables: Buffer, start: int, count: int, x: float) -> float:
    """The second derivative of `cubic`: at a point, that of the cubic behind it."""
    k = start + HEAD + piece(tables, start, count, x)
    n = count + 1
    found = 2.0 * tables[k + 3 * n] + (x - tables[k]) * (6.0 * tables[k + 4 * n])
    follows = moves(tables, start, x)
    return 0.0 if follows == 0.0 else found * follows


def cubic_third(tables: Buffer, start: int, count: int, x: float) -> float:
    """The third derivative of `cubic`, one number a piece."""
    k = start + HEAD + piece(tables, start, count, x)
    return 6.0 * tables[k + 4 * (count + 1)] * moves(tables, start, x)
