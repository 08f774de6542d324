"""What counts as none, as in `xpheve_laws_collision.narrow_phase`; and vectors of rows."""

from __future__ import annotations

from typing import Any

from xpheve.kernels.vector import Vec

TOUCH = 1e-12  # of the sizes
STILL = 1e-14  # of the speeds
BRIEF = 1e-20  # [s]
ULPS = 8.0 * 2.0**-52  # of the coordinates
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
