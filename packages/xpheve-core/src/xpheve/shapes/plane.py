"""Plane."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar

from xpheve.errors import InvalidValueError
from xpheve.shapes.base import Shape, Vec, number, one_factor


class Plane(Shape):
    """The half space behind a plane; what is solid lies against the ``normal``.

    Parameters
    ----------
    normal
        Outward direction, shape (3,), of any length above 0; None for the scene's ``up``.
    offset
        Distance [m] of the plane from the object's position along ``normal``.

    Raises
    ------
    InvalidValueError
        If the normal is not three finite numbers, or zero.
    """

    kind: ClassVar[str] = "plane"
    __slots__ = ("normal", "offset")

    def __init__(self, normal: Sequence[float] | None = None, offset: float = 0.0) -> None:
        self.normal: Vec | None = None if normal is None else _unit(normal)
        self.offset = number(offset, "Plane.offset")
        if not math.isfinite(self.offset):
            raise InvalidValueError(f"Plane.offset = {offset!r}: a finite length [m] is needed")

    @property
    def volume(self) -> float:
        return math.inf

    @property
    def reach(self) -> float:
        return math.inf

    def inertia(self, mass: float) -> Vec:
        raise InvalidValueError("a plane has no moments of inertia: say fixed=True")

    def scaled(self, s: float | Sequence[float]) -> Shape:
        return Plane(self.normal, self.offset * one_factor(s, self.kind))

    def describe(self) -> dict[str, Any]:
        normal = None if self.normal is None else list(self.normal)
        return {"kind": self.kind, "normal": normal, "offset": self.offset}


def _unit(normal: Sequence[float]) -> Vec:
    try:
        values = tuple(float(component) for component in normal)
    except (TypeError, ValueError):
        raise InvalidValueError(f"Plane.normal = {normal!r}: three numbers are needed") from None
    largest = max(map(abs, values), default=0.0) if all(map(math.isfinite, values)) else math.nan
    if len(values) != 3 or not 0 < largest < math.inf:
        raise InvalidValueError(f"Plane.normal = {values}: three finite numbers, not all 0, are needed")
    scaled = [component / largest for component in values]
    length = math.sqrt(math.fsum(component * component for component in scaled))
    return scaled[0] / length, scaled[1] / length, scaled[2] / length
