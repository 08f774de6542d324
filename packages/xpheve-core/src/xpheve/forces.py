"""Force: vector, duration, id."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from xpheve.errors import InvalidValueError

Vec = tuple[float, float, float]


def vector(value: Any, what: str) -> Vec:
    """``value`` as three finite floats; raises `InvalidValueError` naming ``what``."""
    try:
        x, y, z = value
        x, y, z = float(x), float(y), float(z)
    except (TypeError, ValueError):
        raise InvalidValueError(f"{what} = {value!r}: three numbers are needed") from None
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(z)):
        raise InvalidValueError(f"{what} = {(x, y, z)}: finite numbers are needed")
    return x + 0.0, y + 0.0, z + 0.0  # + 0.0 makes -0.0 to 0.0


class Force:
    """A force on an object, constant in the world frame, for a time. Immutable.

    Parameters
    ----------
    vector
        Force [N], shape (3,), world frame, at the centre of mass.
    duration
        Time [s] it acts, exactly, also when it ends inside a step; ``math.inf`` (the default) for ever.
    id
        One id may name many forces; removing it removes them all. None: the engine gives one when the force is added.
    torque
        Torque [N m], shape (3,), world frame.

    Raises
    ------
    InvalidValueError
        If a component is not finite, or the duration is negative or NaN.
    """

    __slots__ = ("duration", "id", "torque", "vector")

    def __init__(
        self,
        vector: Sequence[float] = (0.0, 0.0, 0.0),
        duration: float = math.inf,
        id: int | str | None = None,
        *,
        torque: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> None:
        self.vector = _vector(vector, "Force.vector")
        self.torque = _vector(torque, "Force.torque")
        try:
            self.duration = float(duration)
        except (TypeError, ValueError):
            raise InvalidValueError(f"Force.duration = {duration!r}: a number of seconds is needed") from None
        if not self.duration >= 0:
            raise InvalidValueError(
                f"Force.duration = {self.duration}: seconds from 0 up are needed; a force that never ends has duration math.inf"
            )
        if not (id is None or isinstance(id, (int, str))):
            raise InvalidValueError(f"Force.id = {id!r}: an int or a text is needed")
        self.id = id

    def __repr__(self) -> str:
        torque = f", torque={self.torque}" if any(self.torque) else ""
        return f"Force({self.vector}, duration={self.duration}, id={self.id!r}{torque})"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Force):
            return NotImplemented
        return (self.vector, self.duration, self.id, self.torque) == (
            other.vector,
            other.duration,
            other.id,
            other.torque,
        )

    def __hash__(self) -> int:
        return hash((self.vector, self.duration, self.id, self.torque))


_vector = vector


class ForceIds:
    """Ids of an engine's forces: 1, 2, 3, ..., so that runs repeat; ``"input-1"``, ... for those of other threads, with a counter of their own."""

    __slots__ = ("inputs", "last")

    def __init__(self, last: int = 0) -> None:
        self.last = last
        self.inputs = 0

    def given(self, id: int | str) -> None:
        """``id`` was chosen by the user: it is not given again."""
        if isinstance(id, int):
            self.last = max(self.last, id)
        elif id.startswith("input-") and id[6:].isdecimal():
            self.inputs = max(self.inputs, int(id[6:]))

    def new(self) -> int:
        """An id not given before in this engine."""
        self.last += 1
        return self.last
