"""What counts as none, for the loop and for the geometry of the contact server alike; and vectors of rows."""

from __future__ import annotations

from typing import Any

from xpheve.kernels.vector import Vec

TOUCH = 1e-12  # of the sizes: a gap this small is none (design: far above rounding, far below what shows)
STILL = 1e-14  # of the speeds at hand: slower than this is no approach
BRIEF = 1e-20  # [s] nor is what the closing acceleration turns back in less: no clock tells such flights apart
ULPS = 8.0 * 2.0**-52  # of the coordinates: what rounding of a position leaves of a gap
LOADED = 1e-13  # of the accelerations: less presses nothing together


def vector(row: Any, at: int) -> Vec:
    """Three numbers of a row."""
    return (row[at], row[at + 1], row[at + 2])


def put(row: Any, at: int, value: Vec) -> int:
    """Write three numbers."""
    row[at] = value[0]
    row[at + 1] = value[1]
    row[at + 2] = value[2]
    return 0
