"""Sphere."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar

from xpheve.shapes.base import Shape, Vec, one_factor, positive


class Sphere(Shape):
    """A solid sphere of ``radius`` [m]."""

    kind: ClassVar[str] = "sphere"
    __slots__ = ("radius",)

    def __init__(self, radius: float) -> None:
        self.radius = positive(radius, "Sphere.radius")

    @property
    def volume(self) -> float:
        return 4.0 / 3.0 * math.pi * self.radius**3

    @property
    def reach(self) -> float:
        return self.radius

    def inertia(self, mass: float) -> Vec:
        moment = 0.4 * mass * self.radius * self.radius
        return moment, moment, moment

    def reach_from(self, point: Vec) -> float:
        return math.hypot(*point) + self.radius

    def scaled(self, s: float | Sequence[float]) -> Shape:
        return Sphere(self.radius * one_factor(s, self.kind))

    def describe(self) -> dict[str, Any]:
        return {"kind": self.kind, "radius": self.radius}
