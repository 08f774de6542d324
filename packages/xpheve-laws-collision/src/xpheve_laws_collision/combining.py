"""How the values of two objects make one, for restitution and friction."""

from __future__ import annotations

import numpy as np

import xpheve as xp

RULES = ("average", "minimum", "maximum", "multiply", "geometric")


def combined(rule: str, a: float, b: float, common: float) -> float:
    """The value of a pair whose objects have ``a`` and ``b`` of their own, not a number where they have none, by ``rule``.

    ``common`` stands for what one object has not; where neither has one it is taken as it is. Nothing branches, so that laws which
    combine several values are read into compiled loops as one formula.
    """
    none_a, none_b = a != a, b != b
    one, two = xp.where(none_a, common, a), xp.where(none_b, common, b)
    found: float = xp.where(none_a & none_b, common, _mixed(rule, one, two))
    return found


def _mixed(rule: str, a: float, b: float) -> float:
    found: float
    if rule == "minimum":
        found = np.minimum(a, b)
    elif rule == "maximum":
        found = np.maximum(a, b)
    elif rule == "multiply":
        found = a * b
    else:
        found = xp.where(a == b, a, np.sqrt(a * b) if rule == "geometric" else 0.5 * (a + b))
    return found


__all__ = ["RULES", "combined"]
