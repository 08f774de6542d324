"""Numbers as scene files write them: plain, in SI units, or as text with a unit of their own."""

from __future__ import annotations

import math
from typing import Any

Vec = tuple[float, float, float]


def number(value: Any, unit: str) -> float:
    """``value`` as a finite float of ``unit``; ValueError says what is needed."""
    wanted = "a number" if unit == "1" else f"a number in {unit}"
    if isinstance(value, str):
        from xpheve.units import parse_quantity

        return parse_quantity(value, unit)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError(f"{wanted} is needed")
    try:
        found = float(value)
    except OverflowError:
        found = math.inf
    if not math.isfinite(found):
        raise ValueError(f"a finite {wanted[2:]} is needed")
    return found


def numbers(value: Any, unit: str, count: int) -> tuple[float, ...]:
    """``value`` as ``count`` finite floats of ``unit``; ValueError says what is needed."""
    words = {3: "three", 4: "four"}
    if not isinstance(value, list) or len(value) != count:
        order = " (w, x, y, z)" if count == 4 else "" if unit == "1" else f" in {unit}"
        raise ValueError(f"{words[count]} numbers{order} are needed, such as [{', '.join(['0.0'] * count)}]")
    return tuple(number(one, unit) for one in value)
