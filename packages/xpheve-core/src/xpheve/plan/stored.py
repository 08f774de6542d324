"""Stored forces: who put which force on which object, until when."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from xpheve.forces import Force
from xpheve.kernels.clock import NEVER, Instant, elapsed

if TYPE_CHECKING:
    from xpheve.objects import PhysicalObject

Vec = tuple[float, float, float]


class StoredForce:
    """A force on an object with its owner (None: the user; a law; the contact server) and the instant at which it ends."""

    __slots__ = ("accounted", "force", "owner", "until")

    def __init__(self, force: Force, owner: Any, until: Instant, accounted: bool) -> None:
        self.force = force
        self.owner = owner
        self.until = until
        self.accounted = accounted
        """Whether a potential stands for its work."""

    def remaining(self, now: Instant) -> float:
        """Time [s] it still acts."""
        return math.inf if self.until == NEVER else elapsed(self.until, now)


class StoredForces:
    """The stored forces of all objects."""

    def __init__(self) -> None:
        self.of: dict[PhysicalObject, list[StoredForce]] = {}

    def on(self, obj: PhysicalObject) -> list[StoredForce]:
        """The forces on ``obj``."""
        return self.of.get(obj, [])

    def put(self, obj: PhysicalObject, stored: StoredForce) -> None:
        """Add one."""
        self.of.setdefault(obj, []).append(stored)

    def replace(self, obj: PhysicalObject, stored: StoredForce) -> bool:
        """Put ``stored`` in place of those of the same owner and id; whether anything changed."""
        held = self.of.setdefault(obj, [])
        same = [one for one in held if one.owner is stored.owner and one.force.id == stored.force.id]
        if len(same) == 1 and same[0].force == stored.force and same[0].until == stored.until:
            return False
        held[:] = [one for one in held if one not in same]
        held.append(stored)
        return True

    def withdraw(self, obj: PhysicalObject, owner: Any) -> bool:
        """Take away all that ``owner`` put on ``obj``; whether there was any."""
        held = self.of.get(obj, [])
        kept = [one for one in held if one.owner is not owner]
        if len(kept) == len(held):
            return False
        held[:] = kept
        return True

    def total(self, obj: PhysicalObject) -> tuple[Vec, Vec]:
        """Force [N] and torque [N m], each component rounded once whatever the order (fsum)."""
        return _sum([one.force for one in self.of.get(obj, ())])

    def working(self, obj: PhysicalObject) -> tuple[Vec, Vec]:
        """The part of `total` whose work no potential stands for."""
        return _sum([one.force for one in self.of.get(obj, ()) if not one.accounted])


NONE: Vec = (0.0, 0.0, 0.0)


def _sum(forces: list[Force]) -> tuple[Vec, Vec]:
    if len(forces) == 1:
        return forces[0].vector, forces[0].torque
    if not forces:
        return NONE, NONE
    x, y, z = (math.fsum(f.vector[k] for f in forces) for k in range(3))
    u, v, w = (math.fsum(f.torque[k] for f in forces) for k in range(3))
    return (x + 0.0, y + 0.0, z + 0.0), (u + 0.0, v + 0.0, w + 0.0)
