"""How the values of two objects make one, for restitution and friction."""

from __future__ import annotations

import math

RULES = ("average", "minimum", "maximum", "multiply", "geometric")


def combined(rule: str, a: float, b: float, common: float) -> float:
    """The value of a pair whose objects have ``a`` and ``b`` of their own, not a number where they have none, by ``rule``.

    ``common`` stands for what one object has not; where neither has one it is taken as it is.
    """
    if math.isnan(a) and math.isnan(b):
        return common
    one = common if math.isnan(a) else a
    two = common if math.isnan(b) else b
    if rule == "minimum":
        return min(one, two)
    if rule == "maximum":
        return max(one, two)
    if rule == "multiply":
        return one * two
    if one == two:
        return one
    return math.sqrt(one * two) if rule == "geometric" else 0.5 * (one + two)


__all__ = ["RULES", "combined"]
