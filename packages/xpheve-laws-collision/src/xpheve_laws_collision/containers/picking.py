"""The picking container of the thesis: contact is what lies directly ahead."""

from __future__ import annotations

from typing import ClassVar

from xpheve.kernels.quaternion import rotate_inverse
from xpheve.kernels.vector import Vec, add, dot, norm, scale, sub
from xpheve.laws import Contact, Param
from xpheve.objects import PhysicalObject
from xpheve_laws_collision.bounds import Bounds
from xpheve_laws_collision.containers.detector import Detector
from xpheve_laws_collision.rays import Crossing, crossing


class Picking(Detector):
    """Detects what lies within tau ahead or behind of a body's surface, along a ray from its centre: the thesis's detector.

    For each pair, from the centre of the first object (by rank; not a plane) a ray goes in the direction of the relative velocity
    v_rel = v_1 - v_2. From where it leaves the first object's surface, the second is looked for from -tau to tau along it, with
    tau = factor * |v_rel| * dt, dt being the time between two looks: 2 to 3 are the thesis's factors, 1 is the least. The range below 0
    finds bodies that overlap already.

    It misses, as printed: glancing hits, for the ray from the centre goes by; pairs without relative velocity, which gives no direction; gaps
    beyond tau; overlaps deeper than tau. A point has no surface to be hit. `collision:exact` misses nothing, and is the default of the laws here.

    Source: Nourian (2004), 4.3.3, figures 4-21 to 4-23; any number of pairs of one object are reported, where the thesis reports one.
    """

    id: ClassVar[str] = "collision:picking"

    factor = Param(
        2.0,
        unit="1",
        gt=0,
        doc="Tolerance over the way that the pair makes, relative to each other, between two looks.",
    )

    def margin(self, a: PhysicalObject) -> float:
        """No pair is found farther apart than tau, to which each body's own speed lends a part."""
        speed = norm(a.velocity)
        return float(self.factor) * speed * self.span * (1.0 + 1e-12)

    def contact(self, a: PhysicalObject, b: PhysicalObject, bounds: tuple[Bounds, Bounds]) -> Contact | None:
        """The pick from the first of the two that is bounded."""
        first, second = (b, a) if a.shape is not None and a.shape.kind == "plane" else (a, b)
        relative = sub(first.velocity, second.velocity)
        speed = norm(relative)
        if speed == 0.0:
            return None
        direction = scale(relative, 1.0 / speed)
        own, other = self._crossing(first, first.position, direction), self._crossing(second, first.position, direction)
        if own is None or other is None:
            return None
        way = other.enters - own.leaves
        if abs(way) > self.factor * speed * self.span:
            return None
        normal = scale(other.normal, -1.0)
        point = add(first.position, scale(direction, other.enters - 0.5 * way))
        if first is not a:
            normal = scale(normal, -1.0)
        x, y, z = normal
        normal = (x + 0.0, y + 0.0, z + 0.0)
        closing = dot(normal, sub(a.velocity, b.velocity))
        return Contact(a, b, normal, point, way, closing)

    def _crossing(self, obj: PhysicalObject, origin: Vec, direction: Vec) -> Crossing | None:
        if obj.shape is not None and obj.shape.kind == "plane":
            outward, level = self.plane_of(obj)
            falls = -dot(outward, direction)
            if falls <= 0.0:
                return None
            return Crossing((dot(outward, origin) - level) / falls, float("inf"), outward)
        q = obj.orientation
        return crossing(obj.shape, rotate_inverse(q, sub(origin, obj.position)), rotate_inverse(q, direction), q)
