"""The bounding-box container: contact is where boxes overlap."""

from __future__ import annotations

from typing import ClassVar

from xpheve.kernels.vector import Vec
from xpheve.laws import Contact
from xpheve.objects import PhysicalObject
from xpheve_laws_collision.bounds import Bounds, reaches
from xpheve_laws_collision.containers.detector import Detector, approach_speed


class BoundingBoxes(Detector):
    """Detects overlaps of boxes along the axes of the world, each period or host step: cheap, early and coarse.

    Contact begins before the bodies touch (two balls that pass each other's corners are in contact), and after their boxes have
    passed through each other between two looks there is none. The normal is the axis along which the boxes overlap least, or a plane's own; the point
    is the middle of the overlap.

    Source: Nourian (2004), 3.2.2.1 and 4.3.3, figure 4-20; `WakeupOnCollisionEntry` of Java3D with USE_BOUNDS.
    """

    id: ClassVar[str] = "collision:bounding_box"

    def contact(self, a: PhysicalObject, b: PhysicalObject, bounds: tuple[Bounds, Bounds]) -> Contact | None:
        """The overlap of the two boxes, or of one and the ground behind a plane."""
        for one, other, mine, sign in ((a, b, bounds[0], -1.0), (b, a, bounds[1], 1.0)):
            if other.shape is not None and other.shape.kind == "plane":
                return self._on_plane(a, b, one, other, mine, sign)
        low = tuple(max(p, q) for p, q in zip(bounds[0].low, bounds[1].low, strict=True))
        high = tuple(min(p, q) for p, q in zip(bounds[0].high, bounds[1].high, strict=True))
        depths = [top - bottom for top, bottom in zip(high, low, strict=True)]
        axis = depths.index(min(depths))
        forwards = sum(bounds[1][k][axis] for k in (0, 1)) >= sum(bounds[0][k][axis] for k in (0, 1))
        x, y, z = ((1.0 if forwards else -1.0) if k == axis else 0.0 for k in range(3))
        normal = (x, y, z)
        p, q, r = (0.5 * (top + bottom) for top, bottom in zip(high, low, strict=True))
        return Contact(a, b, normal, (p, q, r), 0.0 - depths[axis], approach_speed(a, b, normal))

    def _on_plane(
        self, a: PhysicalObject, b: PhysicalObject, one: PhysicalObject, plane: PhysicalObject, box: Bounds, sign: float
    ) -> Contact | None:
        outward, level = self.plane_of(plane)
        depth = reaches(box, outward, level)
        if depth < 0.0:
            return None
        middle = [0.5 * (low + high) for low, high in zip(*box, strict=True)]
        height = sum(n * c for n, c in zip(outward, middle, strict=True)) - level
        x, y, z = (c - height * n for c, n in zip(middle, outward, strict=True))
        normal: Vec = (sign * outward[0] + 0.0, sign * outward[1] + 0.0, sign * outward[2] + 0.0)
        return Contact(a, b, normal, (x, y, z), 0.0 - depth, approach_speed(a, b, normal))
