"""What a handler is told when its condition fires."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from xpheve.laws.conditions import Condition
    from xpheve.objects import PhysicalObject

Vec = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Contact:
    """Two objects that touch, or are about to.

    ``normal`` is a unit vector from ``body_a`` to ``body_b``, world frame; ``point`` [m] lies on it between the
    surfaces; ``separation`` [m] is the gap, negative when overlapping; ``approach_speed`` [m/s] is the rate at which
    the gap closes, negative when it opens. ``impulse`` [N s] is the size of what the response gave the pair, for those who are told
    of an impact after it; not a number where nothing was answered.
    """

    body_a: PhysicalObject
    body_b: PhysicalObject
    normal: Vec
    point: Vec
    separation: float
    approach_speed: float
    impulse: float = math.nan


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

    @property
    def fired(self) -> tuple[tuple[Condition | None, Event], ...]:
        """What set it off: for a combination each condition with its own event, else the condition itself."""
        return self.parts or ((self.condition, self),)
