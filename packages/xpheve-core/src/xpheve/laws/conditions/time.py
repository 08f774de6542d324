"""Conditions of time: after a wait, at host steps, at the end of a force."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from xpheve.errors import InvalidValueError
from xpheve.laws.conditions.base import Condition


@dataclass(frozen=True)
class Elapsed(Condition):
    """Simulation time has gone by since the condition was armed, at the exact instant.

    Parameters
    ----------
    seconds
        Length [s] of the wait; > 0.
    every
        Again after each further wait of the same length.
    clock
        ``"sim"``: the engine's time, which stands still while the engine does. There is no other: a law that wakes at wall time could
        not be repeated to the bit. A host that runs the engine by the wall clock gets both.
    """

    original: ClassVar[str] = "WakeupOnElapsedTime"
    difference: ClassVar[str] = "simulation time and exact, where Java3D has wall time and may be late; persistent"

    seconds: float
    every: bool = False
    clock: str = "sim"
    served_by: ClassVar[str] = "queue"

    def __post_init__(self) -> None:
        if isinstance(self.seconds, bool) or not (
            isinstance(self.seconds, (int, float)) and 0 < self.seconds < math.inf
        ):
            raise InvalidValueError(f"Elapsed(seconds={self.seconds!r}): a finite time above 0 s is needed")
        if self.clock != "sim":
            raise InvalidValueError(
                f"Elapsed(clock={self.clock!r}): choose 'sim', simulation time; wall time would not repeat to the bit"
            )


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
    passive
        Do not ask for steps: without ``dt`` the run goes on, and this condition waits.
    """

    original: ClassVar[str] = "WakeupOnElapsedFrames"
    difference: ClassVar[str] = (
        "a frame is a host step; all are synchronous; the handler is called at the start of the step"
    )

    n: int = 0
    at: str = "start"
    passive: bool = False
    served_by: ClassVar[str] = "steps"

    def __post_init__(self) -> None:
        if isinstance(self.n, bool) or not (isinstance(self.n, int) and self.n >= 0):
            raise InvalidValueError(f"Steps(n={self.n!r}): a whole number from 0 is needed")
        if self.at not in ("start", "middle"):
            raise InvalidValueError(f"Steps(at={self.at!r}): choose 'start' or 'middle'")


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


__all__ = ["Elapsed", "ForceExpired", "Steps"]
