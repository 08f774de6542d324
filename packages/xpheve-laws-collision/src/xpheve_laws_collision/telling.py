"""Who is told of contacts: the containers armed with a condition of contacts, each with the contacts that concern it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from xpheve.laws import Contact, Event
from xpheve.laws import conditions as when
from xpheve.objects import PhysicalObject


class Listening:
    """A container as `World.fire` sees it, with those of its laws that listen."""

    def __init__(self, container: Any, laws: list[Any]) -> None:
        self.condition = container.condition
        self.laws = laws
        self._container = container

    def __hash__(self) -> int:
        return hash(self._container)

    def __eq__(self, other: object) -> bool:
        return self._container is other or (isinstance(other, Listening) and other._container is self._container)

    def label(self) -> str:
        return str(self._container.label())

    def enforce_laws(self, event: Event) -> None:
        self._container.firings += 1
        for law in self.laws:
            own = tuple(one for one in event.contacts if law in one.body_a.laws and law in one.body_b.laws)
            if own:
                law.enforce(replace(event, contacts=own))


def tell(server: Any, kind: type[when.Condition], found: list[Any], only: list[Any] | None = None) -> None:
    """Fire the containers that wait for ``kind``; of their laws ``only`` those, if given.

    ``found`` are pairs with their gap and approach speed.
    """
    if not found:
        return
    world = server.world
    contacts = [
        contact_of(pair, gap, speed)
        for pair, gap, speed in sorted(found, key=lambda one: (one[0][0].rank, one[0][1].rank))
    ]
    counted: set[Any] = set()
    for container, leaf in world.hearers(kind):
        laws = [law for law in container.laws if law.enabled and not hasattr(law, "respond")]
        laws = laws if only is None else [law for law in laws if law in only]
        taken = tuple(
            one for one in contacts if _heard(world, laws, one.body_a, one.body_b) and _takes(server, laws, leaf, one)
        )
        if laws and taken:
            if leaf not in counted:
                counted.add(leaf)
                world.wakeups.armed.count(leaf)
            objects = world.in_rank_order({obj for one in taken for obj in (one.body_a, one.body_b)})
            world.signal(Listening(container, laws), leaf, Event(world.time[0], leaf, tuple(objects), taken))


def _heard(world: Any, laws: list[Any], a: PhysicalObject, b: PhysicalObject) -> bool:
    """Whether one of ``laws`` has both objects."""
    return any(law in world.mapping.laws(a) and law in world.mapping.laws(b) for law in laws)


def _takes(server: Any, laws: list[Any], leaf: Any, contact: Contact) -> bool:
    if isinstance(leaf, when.ContactClear):
        parted = (contact.body_a, contact.body_b)
        return any(leaf.a in (None, obj) and _is_clear(server, laws, obj) for obj in parted)
    return bool(getattr(leaf, "takes", lambda one: True)(contact))


def _is_clear(server: Any, laws: list[Any], obj: PhysicalObject) -> bool:
    """Whether ``obj`` touches nothing that ``laws`` have together with it."""
    return not any(
        obj in pair and all(one._row >= 0 for one in pair) and _heard(server.world, laws, *pair)
        for pair in (*server.touching, *server.inside)
    )


def contact_of(pair: Any, gap: Any, approach: float) -> Contact:
    """What a handler is told of ``pair``."""
    return Contact(pair[0], pair[1], gap.normal, gap.point, gap.separation, approach)
