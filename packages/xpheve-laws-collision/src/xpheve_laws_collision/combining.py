"""How the values of two objects make one, for restitution and friction."""

from __future__ import annotations

from typing import Any

import numpy as np

import xpheve as xp

RULES = ("average", "minimum", "maximum", "multiply", "geometric")


def combined(rule: str, a: Any, b: Any, common: Any) -> Any:
    """The value of a pair whose objects have ``a`` and ``b`` of their own, not a number where they have none, by ``rule``.

    ``common`` stands for what one object has not; where neither has one it is taken as it is.
    """
    none_a, none_b = a != a, b != b
    one, two = xp.where(none_a, common, a), xp.where(none_b, common, b)
    return xp.where(none_a & none_b, common, xp.where(one == two, _same(rule, one), _mixed(rule, one, two)))


def _same(rule: str, a: Any) -> Any:
    return a * a if rule == "multiply" else a


def _mixed(rule: str, a: Any, b: Any) -> Any:
    if rule == "average":
        return 0.5 * (a + b)
    if rule == "minimum":
        return np.minimum(a, b)
    if rule == "maximum":
        return np.maximum(a, b)
    return a * b if rule == "multiply" else np.sqrt(a * b)


__all__ = ["RULES", "combined"]
