"""Fixed boxes and capsules: how a sphere stands to them, and when it meets them, in the world frame."""

from __future__ import annotations

import math
from typing import Any

from xpheve.kernels.vector import Vec
from xpheve_laws_collision.impact.rows import NOTHING


def box_time(shape: Any, c: int, x: Vec, v: Vec, pull: Vec, radius: float) -> tuple[float, int]:
    """To be filled from the closed forms."""
    return (math.inf, NOTHING)


def capsule_time(shape: Any, c: int, x: Vec, v: Vec, pull: Vec, radius: float) -> tuple[float, int]:
    """To be filled from the closed forms."""
    return (math.inf, NOTHING)


def gap_to(shape: Any, c: int, x: Vec, radius: float) -> tuple[float, Vec]:
    """To be filled from the closed forms."""
    return (math.inf, (0.0, 0.0, 1.0))
