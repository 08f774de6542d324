"""What every shape says of itself."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, ClassVar

from xpheve.errors import InvalidValueError

Vec = tuple[float, float, float]


class Shape:
    """A geometry in its own frame, centred on its centre of mass and along its principal axes. Immutable."""

    offers: ClassVar[str] = "shape"
    kind: ClassVar[str] = ""
    __slots__ = ()

    def __setattr__(self, name: str, value: Any) -> None:
        if not name.startswith("_") and hasattr(self, name):
            raise InvalidValueError(
                f"{self!r}.{name} = {value!r}: a shape does not change, and several objects may share it; "
                f"give the object a new one: obj.shape = {type(self).__name__}(...)"
            )
        super().__setattr__(name, value)

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

    def reach_from(self, point: Vec) -> float:
        """Distance [m] from ``point``, in the body frame, to the farthest point of the shape, or a little more."""
        return math.hypot(*point) + self.reach

    @property
    def frame(self) -> tuple[Vec, tuple[float, float, float, float]]:
        """Position [m] and quaternion of the frame in which the shape was authored, seen from the body frame."""
        return (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)

    @property
    def solid(self) -> bool:
        """Whether mass properties follow from the shape; a mesh with holes has none."""
        return True

    def why_hollow(self) -> str:
        """Return why a shape that is not `solid` is not, and the way out."""
        return ""

    @property
    def mass(self) -> float | None:
        """Mass [kg] that follows from densities given to parts; None if none were."""
        return None

    def scaled(self, s: float | Sequence[float]) -> Shape:
        """The shape ``s`` times as large about the origin of its authored frame; three factors where the kind allows."""
        raise InvalidValueError(f"a {self.kind or type(self).__name__} cannot be scaled")

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


def positive(value: Any, what: str, kind: str = "length", unit: str = "m") -> float:
    """``value`` as a finite float above 0; raises `InvalidValueError` naming ``what``."""
    length = number(value, what)
    if not 0 < length < math.inf:
        least = "0" if unit == "1" else f"0 {unit}"
        raise InvalidValueError(f"{what} = {length}: a finite {kind} above {least} is needed")
    return length


def factors(s: float | Sequence[float]) -> Vec:
    """``s`` as three factors above 0 along x, y, z; one number stands for three equal ones."""
    try:
        given = tuple(s) if isinstance(s, Iterable) else (s, s, s)
    except TypeError:
        given = ()
    if len(given) != 3:
        raise InvalidValueError(f"scaled({s!r}): one factor, or three, are needed")
    x, y, z = (positive(one, "scaled", "factor", "1") for one in given)
    return x, y, z


def one_factor(s: float | Sequence[float], kind: str) -> float:
    """``s`` as one factor; raises `InvalidValueError` for three that differ."""
    x, y, z = factors(s)
    if not x == y == z:
        raise InvalidValueError(f"scaled({s!r}): a {kind} is scaled by one factor only; make a mesh of it first")
    return x


def number(value: Any, what: str) -> float:
    """``value`` as a float; raises `InvalidValueError` naming ``what``."""
    try:
        return float(value)
    except (TypeError, ValueError):
        raise InvalidValueError(f"{what} = {value!r}: a number of metres is needed") from None
