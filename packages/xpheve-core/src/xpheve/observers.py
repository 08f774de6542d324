"""Observers and probes: what conditions of regions look for. Neither is touched or moved by any law."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from xpheve.errors import InvalidValueError
from xpheve.forces import vector
from xpheve.objects import PhysicalObject

Vec = tuple[float, float, float]


class Probe:
    """A point that the host moves, or that rides on the centre of an object.

    Parameters
    ----------
    name
        For events, listings and files; unique among the probes and observers of an engine, not empty.
    position
        [m], world frame, shape (3,); not with ``attached``.
    attached
        The object it rides on.

    Raises
    ------
    InvalidValueError
        If the name is empty, a number is not finite, or both a position and an object are given.
    """

    radius = 0.0
    kind = "probe"

    def __init__(
        self, name: str, position: Sequence[float] | None = None, *, attached: PhysicalObject | None = None
    ) -> None:
        if not isinstance(name, str) or not name:
            raise InvalidValueError(f"{type(self).__name__}: name = {name!r}: a text that is not empty is needed")
        if attached is not None and position is not None:
            raise InvalidValueError(f"{type(self).__name__} {name!r}: give position or attached, not both")
        if attached is not None and not isinstance(attached, PhysicalObject):
            raise InvalidValueError(f"{type(self).__name__} {name!r}: attached = {attached!r} is no PhysicalObject")
        self.name = name
        self.engine: Any = None
        self._attached = attached
        self._position = vector((0.0, 0.0, 0.0) if position is None else position, f"{self!r}: position")

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name!r}>"

    @property
    def label(self) -> str:
        """The name."""
        return self.name

    @property
    def attached(self) -> PhysicalObject | None:
        """The object it rides on, or None. Once that has left the engine, the point stays where it was."""
        return self._attached

    @property
    def position(self) -> Vec:
        """[m], world frame. Setting it takes effect at the present instant, and ends riding on an object."""
        return self._position if self._attached is None else self._attached.position

    @position.setter
    def position(self, value: Sequence[float]) -> None:
        checked = vector(value, f"{self!r}: position")
        if self.engine is None:
            self._attached, self._position = None, checked
        else:
            self.engine.move_point(self, checked)


class Observer(Probe):
    """Somebody who looks on, with a volume around the centre in which laws are to be awake.

    Parameters
    ----------
    name, position, attached
        As of a `Probe`.
    radius
        Of the volume [m]; finite, >= 0.
    """

    kind = "observer"

    def __init__(
        self,
        name: str,
        position: Sequence[float] | None = None,
        *,
        attached: PhysicalObject | None = None,
        radius: float = 0.0,
    ) -> None:
        super().__init__(name, position, attached=attached)
        try:
            number = float(radius)
        except (TypeError, ValueError):
            number = -1.0
        if not 0.0 <= number < float("inf"):
            raise InvalidValueError(f"{self!r}: radius = {radius!r}: a finite length [m] from 0 up is needed")
        self.radius = number
