"""Conditions made of conditions, in one another to a depth of 32: any of several, all of them in turn, all at once, and not.

A combination is a condition like any other: frozen, shareable, armed until it is removed, and ``once=True`` disarms it at its first event.
Its members go on by themselves: ``Elapsed(1.0)`` has one event, in a combination as alone. What a combination remembers (which members have been met)
belongs to the container.

Source: WakeupOr, WakeupAnd, WakeupAndOfOrs and WakeupOrOfAnds of Java3D (Nourian 2004, 3.2.2.1), without their limit to two levels.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from xpheve.errors import InvalidValueError
from xpheve.laws.conditions.base import Condition

DEEPEST = 32
"""Combinations in one another; scene files allow as many."""


@dataclass(frozen=True, init=False)
class _Combination(Condition):
    """What combinations share."""

    of: tuple[Condition, ...]

    def __init__(self, *of: Condition, once: bool = False) -> None:
        name = type(self).__name__
        if not of:
            raise InvalidValueError(f"{name}(): at least one condition is needed")
        for one in of:
            if not isinstance(one, Condition):
                raise InvalidValueError(f"{name}: {one!r} is no condition; give one such as xpheve.when.Posted('go')")
            if one.served_by == "contacts" and any(type(leaf).__name__ == "Impact" for leaf in leaves(one)):
                raise InvalidValueError(
                    f"{name}: Impact belongs to response laws and stands alone; combine ContactBegin"
                )
        deep = 1 + max(one.depth for one in of)
        if deep > DEEPEST:
            raise InvalidValueError(
                f"{name}: conditions are nested {deep} deep; at most {DEEPEST} are allowed. Give one {name} all its members: "
                f"{name}(a, b, c, ...), or put inner ones into containers of their own that post"
            )
        object.__setattr__(self, "of", tuple(of))
        object.__setattr__(self, "depth", deep)
        object.__setattr__(self, "once", bool(once))

    @property
    def served_by(self) -> str:  # type: ignore[override]
        """``"contacts"`` if a member needs the contact server, else ``"members"``."""
        return "contacts" if any(leaf.served_by == "contacts" for leaf in leaves(self)) else "members"

    def __str__(self) -> str:
        once = ", once=True" if self.once else ""
        return f"{type(self).__name__}({', '.join(map(str, self.of))}{once})"


@dataclass(frozen=True, init=False)
class AnyOf(_Combination):
    """One of the members fires: ``a | b``."""

    original: ClassVar[str] = "WakeupOr, WakeupOrOfAnds"
    difference: ClassVar[str] = "up to 32 deep"

    @property
    def is_level(self) -> bool:
        return all(one.is_level for one in self.of)


@dataclass(frozen=True, init=False)
class AllOf(_Combination):
    """Each member has fired since the last time, in any order, not necessarily together: ``a & b``.

    A level counts when it becomes true. All that was met is forgotten whenever the whole condition of the container fires.
    """

    original: ClassVar[str] = "WakeupAnd, WakeupAndOfOrs"
    difference: ClassVar[str] = (
        "what was met is forgotten at each firing; there a WakeupAnd used again fires on any one member"
    )


@dataclass(frozen=True, init=False)
class AllNow(_Combination):
    """All members at the same instant: events that happen, levels that hold."""

    difference: ClassVar[str] = "not in Java3D"

    @property
    def is_level(self) -> bool:
        return all(one.is_level for one in self.of)


@dataclass(frozen=True, init=False)
class Not(_Combination):
    """A level condition does not hold: ``~a``. A level itself."""

    difference: ClassVar[str] = "not in Java3D"

    def __init__(self, *of: Condition, once: bool = False) -> None:
        super().__init__(*of, once=once)
        if len(of) != 1:
            raise InvalidValueError(f"Not: {len(of)} conditions; one is needed")
        if not of[0].is_level:
            raise InvalidValueError(
                f"~{of[0]}: it happens at instants, so it never stops holding. Levels are RegionActive, RegionInactive, Asleep(obj), "
                "Awake(obj), and AnyOf, AllNow and Not of levels"
            )

    @property
    def is_level(self) -> bool:
        return True


def joined(kind: type[_Combination], *members: Any) -> Any:
    """A combination of ``kind``; members that are such themselves, without ``once``, give their own members in their places."""
    return kind(*(one for member in members for one in (member.of if _is_plain(kind, member) else (member,))))


def _is_plain(kind: type[_Combination], member: Any) -> bool:
    return type(member) is kind and not member.once


def leaves(condition: Condition | None) -> Iterator[Condition]:
    """The conditions that ``condition`` is made of, from left to right; itself if it is simple, none of None."""
    if isinstance(condition, _Combination):
        for one in condition.of:
            yield from leaves(one)
    elif condition is not None:
        yield condition


def plain(condition: Any) -> Any:
    """``condition`` without ``once``: what is equal in this has one server."""
    return replace(condition, once=False) if condition.once else condition
