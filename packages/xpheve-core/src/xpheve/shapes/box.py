"""Box."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar

from xpheve.errors import InvalidValueError
from xpheve.shapes.base import Shape, Vec, factors, positive


class Box(Shape):
    """A solid box of full edge lengths ``size`` (3,) [m]."""

    kind: ClassVar[str] = "box"
    __slots__ = ("size",)

    def __init__(self, size: Sequence[float]) -> None:
        try:
            edges = tuple(positive(edge, "Box.size") for edge in size)
        except TypeError:
            raise InvalidValueError(f"Box.size = {size!r}: three edge lengths are needed") from None
        if len(edges) != 3:
            raise InvalidValueError(f"Box.size = {edges}: three edge lengths are needed")
        self.size: Vec = (edges[0], edges[1], edges[2])

    @property
    def volume(self) -> float:
        return self.size[0] * self.size[1] * self.size[2]

    @property
    def reach(self) -> float:
        return 0.5 * math.hypot(*self.size)

    def inertia(self, mass: float) -> Vec:
        x, y, z = (edge * edge for edge in self.size)
        return mass * (y + z) / 12, mass * (x + z) / 12, mass * (x + y) / 12

    def reach_from(self, point: Vec) -> float:
        return math.hypot(*(abs(x) + 0.5 * edge for x, edge in zip(point, self.size, strict=True)))

    def scaled(self, s: float | Sequence[float]) -> Shape:
        return Box([edge * factor for edge, factor in zip(self.size, factors(s), strict=True)])

    def describe(self) -> dict[str, Any]:
        return {"kind": self.kind, "size": list(self.size)}
