"""Conditions of contacts: objects that meet, touch and come apart."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

from xpheve.laws.conditions.base import Condition, check_object


@dataclass(frozen=True)
class Impact(Condition):
    """Two objects under a law of the container touch and approach one another."""

    served_by: ClassVar[str] = "contacts"


@dataclass(frozen=True)
class _OfContacts(Condition):
    """What conditions of contacts share: which pairs they take."""

    a: Any = None
    b: Any = None
    served_by: ClassVar[str] = "contacts"

    def __post_init__(self) -> None:
        check_object(self, "a")
        check_object(self, "b")

    def takes(self, contact: Any) -> bool:
        """Whether the condition waits for ``contact``: its pair is ``a`` and ``b``, either way round; None is any."""
        one, two = contact.body_a, contact.body_b
        return any(self.a in (None, x) and self.b in (None, y) for x, y in ((one, two), (two, one)))


@dataclass(frozen=True)
class ContactBegin(_OfContacts):
    """The gap between two objects closes; once when armed on a pair that touches already.

    Parameters
    ----------
    a, b
        Only contacts of these objects; None for any under a law of the container.
    """

    original: ClassVar[str] = "WakeupOnCollisionEntry"
    difference: ClassVar[str] = (
        "all pairs of the instant are handed over, with normal and point; both objects obey a law of the container"
    )


@dataclass(frozen=True)
class ContactStay(_OfContacts):
    """Two objects touch: at the start of each host step for as long as they do.

    Parameters
    ----------
    a, b
        Only contacts of these objects; None for any under a law of the container.
    moving
        Only while one of the two moves or turns.
    """

    original: ClassVar[str] = "WakeupOnCollisionMovement"
    difference: ClassVar[str] = "``ContactStay(moving=True)``; asked at host steps"

    moving: bool = False

    def takes(self, contact: Any) -> bool:
        if not super().takes(contact):
            return False
        bodies = (contact.body_a, contact.body_b)
        return not self.moving or any(any(obj.velocity) or any(obj.angular_velocity) for obj in bodies)


@dataclass(frozen=True)
class ContactEnd(_OfContacts):
    """Two touching objects come apart; for a bounce in the same instant, after the impact.

    Parameters
    ----------
    a, b
        Only contacts of these objects; None for any under a law of the container.
    """

    original: ClassVar[str] = "WakeupOnCollisionExit"
    difference: ClassVar[str] = "for each pair; `ContactClear` is for none left"


@dataclass(frozen=True)
class ContactClear(ContactEnd):
    """The last contact of an object ended: it touches nothing any more.

    Parameters
    ----------
    a
        Only this object; None for any under a law of the container.
    """

    difference: ClassVar[str] = "as there: no contact is left; not told of an object that never touched"

    b: Any = field(default=None, init=False, repr=False)


__all__ = ["ContactBegin", "ContactClear", "ContactEnd", "ContactStay", "Impact"]
