"""Telling listeners of contacts: met, left, still there, and late comers."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from xpheve.events import Entry
from xpheve.kernels.clock import Instant
from xpheve.kernels.vector import Vec, add, cross, sub
from xpheve.laws import Contact, Event
from xpheve.laws import conditions as when
from xpheve.laws.combinations import leaves
from xpheve.objects import PhysicalObject
from xpheve_laws_collision.narrow_phase import Gap
from xpheve_laws_collision.server.pairs import Given, Pair, Pairs, contact_of, pair_of


class Telling(Pairs):
    """Fires the containers that wait for contacts."""

    def _tell(
        self, kind: type[when.Condition], found: list[tuple[Pair, Gap, float]], only: list[Any] | None = None
    ) -> None:
        """Fire the containers that wait for ``kind``; of their laws ``only`` those, if given."""
        if not found:
            return
        world = self.world
        contacts = [
            contact_of(pair, gap, speed, world.time, self.given.get(pair) or Given(velocity=self._relative(pair, gap)))
            for pair, gap, speed in sorted(found, key=lambda one: (one[0][0].rank, one[0][1].rank))
        ]
        counted: set[Any] = set()
        for container, leaf in world.hearers(kind):
            laws = [law for law in container.laws if law.enabled and not hasattr(law, "respond")]
            laws = laws if only is None else [law for law in laws if law in only]
            taken = tuple(one for one in contacts if self._takes(laws, leaf, one))
            if laws and taken:
                if leaf not in counted:
                    counted.add(leaf)
                    world.wakeups.armed.count(leaf)
                objects = world.in_rank_order({obj for one in taken for obj in (one.body_a, one.body_b)})
                world.signal(_Listening(container, laws), leaf, Event(world.time[0], leaf, tuple(objects), taken))

    def _relative(self, pair: Pair, gap: Gap) -> Vec:
        """Velocity [m/s] of the second of ``pair`` seen from the first, at the contact, now."""
        found = []
        for obj in pair:
            velocity, spin = (self.world.read_row(obj._row, name) for name in ("velocity", "angular_velocity"))
            found.append(add(velocity, cross(spin, self._lever(obj, gap))) if any(spin) else velocity)
        return sub(found[1], found[0])

    def _takes(self, laws: list[Any], leaf: Any, contact: Contact) -> bool:
        """Whether ``contact`` concerns one of ``laws``, and is one that the condition ``leaf`` asks for."""
        pair = (contact.body_a, contact.body_b)
        if not self._heard(laws, *pair):
            return False
        if isinstance(leaf, when.ContactClear):
            return any(leaf.a in (None, obj) and self._is_clear(laws, obj) for obj in pair)
        return bool(getattr(leaf, "takes", lambda one: True)(contact))

    def _heard(self, laws: list[Any], a: PhysicalObject, b: PhysicalObject) -> bool:
        """Whether one of ``laws`` has both objects."""
        mapping = self.world.mapping
        return any(law in mapping.laws(a) and law in mapping.laws(b) for law in laws)

    def _is_clear(self, laws: list[Any], obj: PhysicalObject) -> bool:
        """Whether ``obj`` touches nothing that ``laws`` have together with it."""
        return not any(
            obj in pair and all(one._row >= 0 for one in pair) and self._heard(laws, *pair)
            for pair in (*self.touching, *self.inside)
        )

    def _late_laws(self, pair: Pair, begun: Instant) -> list[Any]:
        """Laws that wait for the beginning of contacts, and came to ``pair`` after it had begun."""
        if not self.world.listeners(when.ContactBegin):
            return []
        one, two = (self.world.mapping.laws(obj) for obj in pair)
        return [
            law
            for law in one
            if law in two
            and law.enabled
            and max(one[law], two[law]) > begun
            and any(isinstance(leaf, when.ContactBegin) for c in law.containers for leaf in leaves(c.condition))
        ]

    def _tell_late(self, entries: list[Entry]) -> None:
        """Tell those that armed themselves on a pair in contact, once."""
        self._keep()
        for pair in [pair_of(entry, self) for entry in entries]:
            table = self.touching if pair in self.touching else self.inside
            laws = self._late_laws(pair, table[pair])
            table[pair] = self.world.time
            gap = self._gap(pair, self.world.time)
            self._tell(when.ContactBegin, [(pair, gap, -gap.speed)], laws)
            self._again([(pair, gap, -gap.speed)])

    def _meet(self, entries: list[Entry]) -> None:
        """Pairs that touch without approaching, or overlap with nobody to answer."""
        self._keep()
        begun = []
        for pair in [pair_of(entry, self) for entry in entries]:
            gap = self._gap(pair, self.world.time)
            overlapping = gap.separation < -gap.touch and not self._answered(pair)
            table = self.inside if overlapping else self.touching
            table[pair] = self.world.time
            begun.append((pair, gap, -gap.speed))
        self._tell(when.ContactBegin, begun)
        self._again(begun)

    def _leave(self, entries: list[Entry]) -> None:
        """Pairs that come apart."""
        self._keep()
        ended = []
        for pair in [pair_of(entry, self) for entry in entries]:
            self._forget_pair(pair)
            gap = self._gap(pair, self.world.time)
            ended.append((pair, gap, -gap.speed))
        self._tell(when.ContactEnd, ended)
        self._again(ended)

    def _pass_through(self, pairs: list[Pair]) -> None:
        begun = []
        for pair in pairs:
            gap = self._gap(pair, self.world.time)
            self.inside[pair] = self.world.time
            begun.append((pair, gap, -gap.speed))
        self._tell(when.Impact, begun)
        self._tell(when.ContactBegin, begun)
        self._again(begun)

    def _part(self, entries: list[Entry]) -> None:
        """Pairs that came apart in an impact, told in the last stage of the instant."""
        self._keep()
        found, self.parting = self.parting, []
        self._tell(when.ContactEnd, found)

    def _again(self, found: list[tuple[Pair, Gap, float]]) -> None:
        """Predict the pairs anew at the end of the instant, though their flights are the same."""
        for pair, _, _ in found:
            self.told[pair] = self.world.time
            self.world.transaction.later.append(lambda pair=pair: self._predict(pair))

    def host_step(self) -> None:
        now = self.world.time
        standing = [pair for pair in (*self.touching, *self.inside) if all(obj._row >= 0 for obj in pair)]
        found = []
        for pair in standing:
            gap = self._gap(pair, now)
            found.append((pair, gap, -gap.speed))
        self._tell(when.ContactStay, found)


class _Listening:
    """A container as `World.fire` sees it, with those of its laws that listen."""

    def __init__(self, container: Any, laws: list[Any]) -> None:
        self.condition = container.condition
        self.laws = laws
        self._container = container

    def __hash__(self) -> int:
        return hash(self._container)

    def __eq__(self, other: object) -> bool:
        return self._container is other or (isinstance(other, _Listening) and other._container is self._container)

    def label(self) -> str:
        return str(self._container.label())

    def enforce_laws(self, event: Event) -> None:
        self._container.firings += 1
        for law in self.laws:
            own = tuple(one for one in event.contacts if law in one.body_a.laws and law in one.body_b.laws)
            if own:
                law.enforce(replace(event, contacts=own))
