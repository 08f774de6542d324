"""What every shape says of itself."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from xpheve.errors import InvalidValueError

Vec = tuple[float, float, float]


class Shape:
    """A geometry in its own frame, centred on its centre of mass and along its principal axes. Immutable."""

    offers: ClassVar[str] = "shape"
    kind: ClassVar[str] = ""
    __slots__ = ()

    @property
    def volume(self) -> float:
        """Volume [m^3]; inf for an unbounded shape."""
        raise NotImplementedError

    @property
    def reach(self) -> float:
        """Radius [m] of the smallest sphere about the centre that holds the shape; inf for an unbounded one."""
        raise NotImplementedError

    def inertia(self, mass: float) -> Vec:
        """Principal moments [kg m^2] of the solid shape of ``mass`` [kg]."""
        raise NotImplementedError

    def describe(self) -> dict[str, Any]:
        """Kind and parameters as plain values, for files."""
        raise NotImplementedError

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Shape) and self.describe() == other.describe()

    def __hash__(self) -> int:
        return hash(repr(self))

    def __repr__(self) -> str:
        given = {key: value for key, value in self.describe().items() if key != "kind"}
        return f"{type(self).__name__}({', '.join(f'{k}={v!r}' for k, v in given.items())})"


def positive(value: Any, what: str) -> float:
    """``value`` as a finite float above 0; raises `InvalidValueError` naming ``what``."""
    length = number(value, what)
    if not 0 < length < math.inf:
        raise InvalidValueError(f"{what} = {length}: a finite length above 0 m is needed")
    return length


def number(value: Any, what: str) -> float:
    """``value`` as a float; raises `InvalidValueError` naming ``what``."""
    try:
        return float(value)
    except (TypeError, ValueError):
        raise InvalidValueError(f"{what} = {value!r}: a number of metres is needed") from None
