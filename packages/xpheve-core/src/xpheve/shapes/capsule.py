"""Capsule."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar

from xpheve.shapes.base import Shape, Vec, one_factor, positive


class Capsule(Shape):
    """A solid cylinder of ``radius`` and ``length`` [m] along the body's z axis, with a half sphere on each end."""

    kind: ClassVar[str] = "capsule"
    __slots__ = ("length", "radius")

    def __init__(self, radius: float, length: float) -> None:
        self.radius = positive(radius, "Capsule.radius")
        self.length = positive(length, "Capsule.length")

    @property
    def volume(self) -> float:
        return math.pi * self.radius**2 * (self.length + 4.0 / 3.0 * self.radius)

    @property
    def reach(self) -> float:
        return 0.5 * self.length + self.radius

    def inertia(self, mass: float) -> Vec:
        """Cylinder and half spheres, each about the common centre (parallel axes)."""
        r, h = self.radius, self.length
        cylinder = mass * h / (h + 4.0 / 3.0 * r)
        caps = mass - cylinder
        along = 0.5 * cylinder * r * r + 0.4 * caps * r * r
        across = cylinder * (r * r / 4 + h * h / 12) + caps * (0.4 * r * r + h * h / 4 + 3.0 / 8.0 * h * r)
        return across, across, along

    def reach_from(self, point: Vec) -> float:
        return math.hypot(point[0], point[1], abs(point[2]) + 0.5 * self.length) + self.radius

    def scaled(self, s: float | Sequence[float]) -> Shape:
        factor = one_factor(s, self.kind)
        return Capsule(self.radius * factor, self.length * factor)

    def describe(self) -> dict[str, Any]:
        return {"kind": self.kind, "radius": self.radius, "length": self.length}
