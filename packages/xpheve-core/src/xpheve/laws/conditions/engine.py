"""Conditions of what is done to the engine: started, paused, changed, told."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from xpheve.errors import InvalidValueError
from xpheve.laws.conditions.base import Condition, check_law, check_object


@dataclass(frozen=True)
class Started(Condition):
    """The engine starts: once at the first run, and again after each `reset`; a `resume` is no start."""


@dataclass(frozen=True)
class Paused(Condition):
    """`PhysicsEngine.suspend` was called; told at once, before anything else happens."""


@dataclass(frozen=True)
class Resumed(Condition):
    """`PhysicsEngine.resume` was called; told at once."""


@dataclass(frozen=True)
class ObjectAdded(Condition):
    """An object comes under a law of the container: added with it, or mapped to it later.

    Parameters
    ----------
    law
        A law, or its name or id, in place of those of the container.
    """

    law: Any = None

    def __post_init__(self) -> None:
        check_law(self)


@dataclass(frozen=True)
class ObjectRemoved(Condition):
    """An object leaves a law of the container: removed from the engine, or unmapped.

    Parameters
    ----------
    law
        A law, or its name or id, in place of those of the container.
    """

    law: Any = None

    def __post_init__(self) -> None:
        check_law(self)


@dataclass(frozen=True)
class Changed(Condition):
    """Somebody *set* a property of an object under a law of the container; moving in flight is no change.

    Parameters
    ----------
    what
        ``"mass"``, ``"position"``, ``"velocity"``, ... or the name of a column; ``""`` for any.
    obj
        Only this object, whatever laws it obeys; None for all under a law of the container.
    """

    what: str = ""
    obj: Any = None

    def __post_init__(self) -> None:
        if not isinstance(self.what, str):
            raise InvalidValueError(f"Changed(what={self.what!r}): the name of a property or column is needed")
        check_object(self, "obj")


@dataclass(frozen=True)
class PoseChanged(Condition):
    """Somebody *set* the position or orientation of an object, and it went further than ``tol``; flight and impacts are no change.

    Parameters
    ----------
    obj
        Only this object; None for all under a law of the container.
    tol
        How far [m], or by what angle [rad], it must have been moved; >= 0.
    """

    original: ClassVar[str] = "WakeupOnTransformChange"
    difference: ClassVar[str] = "a body in flight does not wake it, being set does; nothing is polled"

    obj: Any = None
    tol: float = 0.0

    def __post_init__(self) -> None:
        check_object(self, "obj")
        if isinstance(self.tol, bool) or not (isinstance(self.tol, (int, float)) and 0 <= self.tol < math.inf):
            raise InvalidValueError(
                f"PoseChanged(tol={self.tol!r}): a finite length [m] or angle [rad] from 0 up is needed"
            )


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

    original: ClassVar[str] = "WakeupOnBehaviorPost"
    difference: ClassVar[str] = "every post is delivered, in order, with its data; there only the last id can be read"

    id: Any = None
    source: Any = None


@dataclass(frozen=True)
class Input(Condition):
    """``engine.input(kind, data)`` was called; all inputs of one instant are handed over together, in order.

    Parameters
    ----------
    kind
        The kind waited for, a text such as ``"key"``.
    match
        None for any data; a value that the data equals; or a mapping whose keys the data, a mapping too, has with these values.
    """

    original: ClassVar[str] = "WakeupOnAWTEvent"
    difference: ClassVar[str] = "fed by the host, so it works without a window; at the simulation time of the call"

    kind: str
    match: Any = None

    def __post_init__(self) -> None:
        if not isinstance(self.kind, str) or not self.kind:
            raise InvalidValueError(f"Input(kind={self.kind!r}): a text such as 'key' is needed")
        if isinstance(self.match, dict):
            object.__setattr__(self, "match", tuple(sorted(self.match.items())))
        try:
            hash(self.match)
        except TypeError:
            raise InvalidValueError(
                f"Input(match={self.match!r}): a plain value, or a mapping of plain values"
            ) from None

    def takes(self, kind: str, data: Any) -> bool:
        """Whether the condition waits for this input."""
        if kind != self.kind or self.match is None:
            return kind == self.kind
        if isinstance(data, dict):
            wanted = self.match if isinstance(self.match, tuple) else ()
            return bool(wanted) and all(key in data and bool(data[key] == value) for key, value in wanted)
        return bool(data == self.match)


__all__ = ["Changed", "Input", "ObjectAdded", "ObjectRemoved", "Paused", "PoseChanged", "Posted", "Resumed", "Started"]
