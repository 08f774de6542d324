"""Wakeup conditions: *when* the laws of a container are enforced.

A condition is a frozen value and may be shared. It does nothing by itself: the plan gives each armed condition one
server (the event queue, the engine, or the scene's contact server); a condition nobody armed costs nothing.
All conditions stay armed after firing; ``once=True`` disarms them at their first event.

Source: the wakeup criteria of Java3D as used in Nourian (2004), 3.2.2.1, with simulation time for wall time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar

from xpheve.errors import InvalidValueError


@dataclass(frozen=True)
class Condition:
    """What every wakeup condition is; with ``once`` it fires at its first event only, until a `reset`."""

    once: bool = field(default=False, kw_only=True)

    served_by: ClassVar[str] = "engine"
    """``"engine"``, ``"queue"``, ``"steps"`` or ``"contacts"``: who finds its events."""

    def __str__(self) -> str:
        shown = [
            f"{f.name}={getattr(self, f.name)!r}"
            for f in fields(self)
            if getattr(self, f.name) not in (f.default, None)
        ]
        return f"{type(self).__name__}({', '.join(shown)})"


@dataclass(frozen=True)
class Started(Condition):
    """The engine starts: once at the first run, and again after each `reset`; a `resume` is no start."""


@dataclass(frozen=True)
class ObjectAdded(Condition):
    """An object comes under a law of the container: added with it, or mapped to it later."""


@dataclass(frozen=True)
class ObjectRemoved(Condition):
    """An object leaves a law of the container: removed from the engine, or unmapped."""


@dataclass(frozen=True)
class Changed(Condition):
    """Somebody *set* a property of an object under a law of the container; moving in flight is no change.

    Parameters
    ----------
    what
        ``"mass"``, ``"position"``, ``"velocity"``, ... or the name of a column; ``""`` for any.
    """

    what: str = ""


@dataclass(frozen=True)
class Elapsed(Condition):
    """Simulation time has gone by since the condition was armed, at the exact instant.

    Parameters
    ----------
    seconds
        Length [s] of the wait; > 0.
    every
        Again after each further wait of the same length.
    """

    seconds: float
    every: bool = False
    served_by: ClassVar[str] = "queue"

    def __post_init__(self) -> None:
        if not (isinstance(self.seconds, (int, float)) and 0 < self.seconds < math.inf):
            raise InvalidValueError(f"Elapsed(seconds={self.seconds!r}): a finite time above 0 s is needed")


@dataclass(frozen=True)
class Steps(Condition):
    """Host steps: the start of each step of ``run(until=..., dt=...)`` or ``step(dt)``.

    The handler is called at the *start* of the step and reads the state half a step ahead under the last forces
    (``event.time`` says so); a force that it stores acts over the whole step: second order for smooth forces. A velocity that it sets acts
    at the start, first order, unless ``at="middle"`` puts the event itself into the middle of the step.

    Parameters
    ----------
    n
        Steps left out between two calls: 0 is every step.
    at
        ``"start"`` or ``"middle"``.
    """

    n: int = 0
    at: str = "start"
    served_by: ClassVar[str] = "steps"

    def __post_init__(self) -> None:
        if not (isinstance(self.n, int) and self.n >= 0):
            raise InvalidValueError(f"Steps(n={self.n!r}): a whole number from 0 is needed")
        if self.at not in ("start", "middle"):
            raise InvalidValueError(f"Steps(at={self.at!r}): choose 'start' or 'middle'")


@dataclass(frozen=True)
class Posted(Condition):
    """``engine.post(id, data, source=...)`` was called; every post is delivered, in order.

    Parameters
    ----------
    id
        The id waited for; None for any.
    source
        The law, container or object that posts; None for any.
    """

    id: Any = None
    source: Any = None


@dataclass(frozen=True)
class ForceExpired(Condition):
    """A force with a duration came to its end; at that exact instant.

    Parameters
    ----------
    id
        The force's id; None for any.
    """

    id: Any = None
    served_by: ClassVar[str] = "queue"


@dataclass(frozen=True)
class Impact(Condition):
    """Two objects under a law of the container touch and approach one another."""

    served_by: ClassVar[str] = "contacts"


@dataclass(frozen=True)
class ContactBegin(Condition):
    """The gap between two objects closes; once when armed on a pair that touches already."""

    served_by: ClassVar[str] = "contacts"


@dataclass(frozen=True)
class ContactStay(Condition):
    """Two objects touch: at the start of each host step for as long as they do."""

    served_by: ClassVar[str] = "contacts"


@dataclass(frozen=True)
class ContactEnd(Condition):
    """Two touching objects come apart; for a bounce in the same instant, after the impact."""

    served_by: ClassVar[str] = "contacts"
