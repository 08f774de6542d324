"""What containers share that look for contacts themselves, at host steps or each period."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, ClassVar

import numpy as np

from xpheve.kernels.quaternion import rotate
from xpheve.kernels.vector import Vec, dot
from xpheve.laws import Contact, Event, LawContainer, Param
from xpheve.laws.response import meets
from xpheve.objects import PhysicalObject
from xpheve.shapes import Plane
from xpheve_laws_collision.bounds import Bounds, bounds_of, overlaps

Pair = tuple[PhysicalObject, PhysicalObject]
UP: dict[str, Vec] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


class Detector(LawContainer):
    """Looks at the pairs of objects that share one of its laws, and hands each law the contacts of its own objects.

    Subclasses write `contact`, and `margin` if they look beyond the boxes.
    """

    accepts_role: ClassVar[str] = "collision"
    periodic: ClassVar[bool] = False

    period = Param(None, unit="s", gt=0, doc="Time between two looks; none: at the start of each host step.")

    def contact(self, a: PhysicalObject, b: PhysicalObject, bounds: tuple[Bounds, Bounds]) -> Contact | None:
        """The contact of the two objects whose ``bounds`` (grown by `margin`) overlap, if they are in contact."""
        raise NotImplementedError

    def margin(self, a: PhysicalObject) -> float:
        """By how much [m] the bounds of ``a`` are grown on all sides."""
        return 0.0

    def detect(self) -> Event | None:
        """All contacts of this instant, of any number of pairs of one object."""
        contacts = []
        objects = self._objects()
        bounds = [self._bounds(obj) for obj in objects]
        for i, j in overlaps(np.array([one.low for one in bounds]), np.array([one.high for one in bounds])):
            a, b = objects[i], objects[j]
            if not (a.fixed and b.fixed) and self._laws(a, b):
                found = self.contact(a, b, (bounds[i], bounds[j]))
                if found is not None:
                    contacts.append(found)
        if not contacts:
            return None
        concerned = {obj: None for one in contacts for obj in (one.body_a, one.body_b)}
        return Event(self.engine.time, None, tuple(obj for obj in objects if obj in concerned), tuple(contacts))

    def enforce_laws(self, event: Event) -> None:
        """Enforce each enabled law once, with the contacts of objects that obey it."""
        self.firings += 1
        for law in list(self.laws):
            own = tuple(one for one in event.contacts if law in one.body_a.laws and law in one.body_b.laws)
            if own:
                objects = {obj: None for one in own for obj in (one.body_a, one.body_b)}
                law.enforce(Event(event.time, event.condition, tuple(o for o in event.objects if o in objects), own))

    def _objects(self) -> list[PhysicalObject]:
        """The objects of the enabled laws, in rank order."""
        found: Iterable[PhysicalObject] = {obj: None for law in self.laws if law.enabled for obj in law.objects}
        return sorted(found, key=lambda obj: (obj.rank, obj.serial))

    def _laws(self, a: PhysicalObject, b: PhysicalObject) -> list[Any]:
        if not meets(a, b):
            return []
        return [law for law in self.laws if law.enabled and law in a.laws and law in b.laws]

    def _bounds(self, obj: PhysicalObject) -> Bounds:
        low, high = bounds_of(obj.shape, obj.position, obj.orientation)
        grow = self.margin(obj)
        return Bounds((low[0] - grow, low[1] - grow, low[2] - grow), (high[0] + grow, high[1] + grow, high[2] + grow))

    def plane_of(self, obj: PhysicalObject) -> tuple[Vec, float]:
        """Outward normal and level of a plane in the world: normal . x = level on it."""
        assert isinstance(obj.shape, Plane)
        normal = rotate(obj.orientation, obj.shape.normal or UP[self.engine.up])
        return normal, dot(normal, obj.position) + obj.shape.offset


def approach_speed(a: PhysicalObject, b: PhysicalObject, normal: Vec) -> float:
    """Rate [m/s] at which the centres come closer along ``normal``."""
    return dot(normal, a.velocity) - dot(normal, b.velocity)
