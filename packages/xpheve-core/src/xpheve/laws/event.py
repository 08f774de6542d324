"""What a handler is told when its condition fires."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from xpheve.errors import OwnershipError
from xpheve.kernels.clock import NEVER, Instant

if TYPE_CHECKING:
    from xpheve.laws.conditions import Condition
    from xpheve.objects import PhysicalObject

Vec = tuple[float, float, float]

UNKNOWN: Vec = (math.nan, math.nan, math.nan)


@dataclass(frozen=True, slots=True)
class Contact:
    """Two objects that touch, or are about to.

    ``normal`` is a unit vector from ``body_a`` to ``body_b``, world frame; ``point`` [m] lies on it between the
    surfaces; ``separation`` [m] is the gap, negative when overlapping; ``approach_speed`` [m/s] is the rate at which
    the gap closes, negative when it opens. ``relative_velocity`` [m/s] is that of ``body_b`` seen from ``body_a`` at the point, spins
    included: for those who are told of an impact the one before it. ``instant`` is the exact simulation time as (base, offset) [s].

    Those who are told of an impact after it get what the response gave the pair: ``impulse`` [N s], the sum of the sizes at all its points, and
    ``impulse_vector`` [N s], world frame, the sum on ``body_b``. Both are not a number where nothing was answered.
    """

    body_a: PhysicalObject
    body_b: PhysicalObject
    normal: Vec
    point: Vec
    separation: float
    approach_speed: float
    impulse: float = math.nan
    relative_velocity: Vec = UNKNOWN
    impulse_vector: Vec = UNKNOWN
    instant: Instant = NEVER

    @property
    def time(self) -> float:
        """Simulation time [s], as a float: the exact one is ``instant``."""
        return self.instant[0]

    @property
    def tangential_velocity(self) -> Vec:
        """The part of ``relative_velocity`` [m/s] across the normal: how ``body_b`` slips over ``body_a``."""
        u, n = self.relative_velocity, self.normal
        along = n[0] * u[0] + n[1] * u[1] + n[2] * u[2]
        return (u[0] - along * n[0], u[1] - along * n[1], u[2] - along * n[2])


def _engine_of(obj: PhysicalObject) -> Any:
    """The engine that ``obj`` is in; raises `OwnershipError` if it is in none."""
    if obj._engine is None:
        raise OwnershipError(f"{obj!r} is in no engine: it was removed, or never added")
    return obj._engine


@dataclass(frozen=True, slots=True)
class Event:
    """One firing of a condition.

    ``condition`` is the one that fired; ``id`` names the post, the force, or the property that was set; ``dt`` [s] is the host step.

    ``time`` [s] is the simulation time at which states are read; ``objects`` are those concerned, in rank order;
    ``contacts`` belong to contact conditions, ``data`` and ``source`` to a post or an input, ``source`` to an observer or probe, ``force``
    to an expired force; ``parts`` holds, for a combination, each condition that fired with its own event, and is empty else.
    """

    time: float
    condition: Condition | None = None
    objects: tuple[PhysicalObject, ...] = ()
    contacts: tuple[Contact, ...] = ()
    id: Any = None
    data: Any = None
    source: Any = None
    force: Any = None
    dt: float = 0.0
    parts: tuple[tuple[Condition, Event], ...] = ()

    def remove(self, obj: PhysicalObject) -> None:
        """Take ``obj`` out of its engine at the end of this instant, after all handlers."""
        _engine_of(obj).remove_object(obj)

    def replace(self, obj: PhysicalObject, new: Any, laws: Any = None) -> tuple[PhysicalObject, ...]:
        """Take ``obj`` out and ``new`` objects in at the end of this instant: `PhysicsEngine.replace_object`."""
        found: tuple[PhysicalObject, ...] = _engine_of(obj).replace_object(obj, new, laws)
        return found

    def split(
        self, obj: PhysicalObject, parts: Any, laws: Any = None, *, conserve: bool = True
    ) -> tuple[PhysicalObject, ...]:
        """Let ``obj`` come apart into ``parts`` at the end of this instant: `PhysicsEngine.split_object`."""
        found: tuple[PhysicalObject, ...] = _engine_of(obj).split_object(obj, parts, laws, conserve=conserve)
        return found

    @property
    def fired(self) -> tuple[tuple[Condition | None, Event], ...]:
        """What set it off: for a combination each condition with its own event, else the condition itself."""
        return self.parts or ((self.condition, self),)
