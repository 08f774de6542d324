"""Conditions of how objects move: an expression that goes through zero, rest and its end."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from xpheve.errors import InvalidValueError
from xpheve.laws.conditions.base import Condition, check_object
from xpheve.laws.conditions.text import TextExpression


@dataclass(frozen=True)
class Crosses(Condition):
    """An expression of the state of an object goes through zero, at that exact instant of its flight.

    The expression is read once, as the methods of a law are, when the condition is added to an engine, and what is no formula is refused then.
    Numbers that it closes over are constants from there on; so that they change, add a condition with a new function. A number in its text, or
    closed over, has no unit: it takes the one that fits, in SI, and a factor may have any; a sum of metres and seconds is refused.

    What is a polynomial of degree at most four in time along a flight, such as a height or the square of a distance, goes through zero where
    that polynomial does, to neighbouring floats, and no zero is missed; along orbits, springs and steps of high order nothing is such a
    polynomial. What reads neither state nor time is looked at once a flight. All else is
    interpolated along the flight in windows by Chebyshev polynomials of degree 24, each halved until its last coefficients are below 1e-11 of
    the largest; all zeros in a window come from the colleague matrix, and each change of sign is then narrowed down on the expression itself to
    neighbouring floats of time since the flight began.

    What can be missed in windows: two zeros between which the expression stays below 1e-15 of its largest value in the window (about 1e-7 of the
    window's length apart); and what an expression that is not smooth does between the samples. A touch of zero without a change of sign is
    no crossing. A jump over zero, as a velocity makes at an impact, is one.

    Parameters
    ----------
    expression
        A function that takes what `FieldLaw.force` takes, ``body.position``, ``body.mass``, ``body.time``, columns, and returns one number for
        each row; or text that says it, ``"body.position.z - 2.0"``, which scene files and checkpoints can hold.
    direction
        1 for upwards only, -1 for downwards only, 0 for both.
    obj
        Only this object; None for all under a law of the container.

    Source: Boyd, SIAM J. Numer. Anal. 40 (2002) 1666 (zeros by Chebyshev expansion); Good, Quart. J. Math. 12 (1961) 61 (colleague matrix).
    """

    expression: Any
    direction: int = 0
    obj: Any = None
    served_by: ClassVar[str] = "flights"

    def __post_init__(self) -> None:
        if isinstance(self.expression, str):
            object.__setattr__(self, "expression", TextExpression(self.expression))
        if not callable(self.expression):
            raise InvalidValueError(
                f"Crosses(expression={self.expression!r}): a function of a body is needed, or text that says it"
            )
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
