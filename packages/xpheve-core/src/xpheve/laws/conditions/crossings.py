"""Conditions of how objects move: an expression that goes through zero, rest and its end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from xpheve.errors import InvalidValueError
from xpheve.laws.conditions.base import Condition, check_object


@dataclass(frozen=True)
class Crosses(Condition):
    """An expression of the state of an object goes through zero, at that exact instant of its flight.

    The expression is interpolated along the flight in windows by Chebyshev polynomials of degree 24, each halved until its last
    coefficients are below 1e-11 of the largest; all zeros in a window come from the colleague matrix, and each change of sign is then
    narrowed down on the expression itself to neighbouring floats of time since the flight began.

    What can be missed: two zeros between which the expression stays below 1e-15 of its largest value in the window (about 1e-7 of the
    window's length apart); and what an expression that is not smooth does between the samples. A touch of zero without a change of sign is
    no crossing. A jump over zero, as a velocity makes at an impact, is one.

    Parameters
    ----------
    expression
        Takes what `FieldLaw.force` takes, ``body.position``, ``body.mass``, ``body.time``, columns, and returns one number for each row. It
        is called with one object at many times, so ``body.time`` is an array (n, 1) like the others.
    direction
        1 for upwards only, -1 for downwards only, 0 for both.
    obj
        Only this object; None for all under a law of the container.

    Source: Boyd, SIAM J. Numer. Anal. 40 (2002) 1666 (zeros by Chebyshev expansion); Good, Quart. J. Math. 12 (1961) 61 (colleague matrix).
    """

    expression: Callable[[Any], Any]
    direction: int = 0
    obj: Any = None
    served_by: ClassVar[str] = "flights"

    def __post_init__(self) -> None:
        if not callable(self.expression):
            raise InvalidValueError(f"Crosses(expression={self.expression!r}): a function of a body is needed")
        if self.direction not in (-1, 0, 1) or isinstance(self.direction, bool):
            raise InvalidValueError(f"Crosses(direction={self.direction!r}): choose -1, 0 or 1")
        check_object(self, "obj")

    def __str__(self) -> str:
        # Not the function's address: listings and ranks are the same in every process.
        name = getattr(self.expression, "__qualname__", type(self.expression).__name__)
        more = f", direction={self.direction}" if self.direction else ""
        return f"Crosses({name}{more}{'' if self.obj is None else f', obj={self.obj!r}'}{', once=True' if self.once else ''})"


@dataclass(frozen=True)
class _OfSleep(Condition):
    """What conditions of sleep share."""

    obj: Any = None
    served_by: ClassVar[str] = "flights"

    def __post_init__(self) -> None:
        check_object(self, "obj")

    @property
    def is_level(self) -> bool:
        return self.obj is not None


@dataclass(frozen=True)
class Asleep(_OfSleep):
    """An object came to rest: no velocity, no angular velocity, no net force or torque; told at the end of the instant.

    Parameters
    ----------
    obj
        Only this object: a level condition. None for the event, of any object under a law of the container.
    """


@dataclass(frozen=True)
class Awake(_OfSleep):
    """An object at rest began to move, or a net force or torque to act on it; told at the end of the instant.

    Parameters
    ----------
    obj
        Only this object: a level condition. None for the event, of any object under a law of the container.
    """


__all__ = ["Asleep", "Awake", "Crosses"]
