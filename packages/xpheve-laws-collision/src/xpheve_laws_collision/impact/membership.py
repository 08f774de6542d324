"""Whose contacts are left to the impact loop: whole sets of objects that may meet, in which all are of a kind that it knows."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from xpheve.kernels.vector import Vec
from xpheve.laws import ResponseLaw
from xpheve.laws import conditions as when
from xpheve.laws.combinations import leaves
from xpheve.laws.response import FILTER
from xpheve.objects import PhysicalObject

SCENERY = ("sphere", "plane", "box", "capsule")
"""Fixed shapes that the loop knows."""
MOST_LAWS = 62
"""Bits of a mask."""
OTHER_WISH = "core:ballistic"
"""What a user asks for who wants pairs one by one."""


class Membership:
    """Which laws' objects fly from impact to impact, and why others do not.

    Attributes
    ----------
    flying
        Laws that hear contacts all of whose objects fly, or are scenery to those that do.
    why
        By law, in words, why its objects do not.
    """

    def __init__(self) -> None:
        self.flying: frozenset[Any] = frozenset()
        self.why: dict[Any, str] = {}

    def decide(self, world: Any, heard: Iterable[Any]) -> bool:
        """Look at all objects of the laws ``heard`` anew; whether the answer is another one now."""
        before = self.flying
        self.why = {}
        flying: set[Any] = set()
        for laws in _joined(world, world.ordered_laws(heard)):
            why = _why_not(world, laws)
            if why:
                self.why.update(dict.fromkeys(laws, why))
            else:
                flying.update(laws)
        self.flying = frozenset(flying)
        return self.flying != before

    def fits(self, world: Any, obj: PhysicalObject) -> bool:
        """Whether ``obj`` itself is still of a kind that may fly."""
        return not _why_not_object(world, obj, {})


def _joined(world: Any, laws: list[Any]) -> list[list[Any]]:
    """``laws`` in sets: those that have an object in common, directly or through others."""
    known = set(laws)
    sets: dict[Any, list[Any]] = {law: [law] for law in laws}
    for law in laws:
        for obj in world.mapping.objects(law):
            own = world.mapping.laws(obj)
            if len(own) > 1:
                for other in own:
                    if other in known and sets[other] is not sets[law]:
                        sets[law].extend(sets[other])
                        for one in sets[other]:
                            sets[one] = sets[law]
    return list({id(one): one for one in sets.values()}.values())


def _why_not(world: Any, laws: list[Any]) -> str:
    """Why the objects of ``laws`` cannot fly in the loop, or need not; empty if they do."""
    answering = [law for law in laws if isinstance(law, ResponseLaw)]
    if not answering:
        return "nobody answers its contacts"
    if len(laws) > MOST_LAWS:
        return f"{len(laws)} laws of contacts belong together; the loop knows {MOST_LAWS}"
    for law in answering:
        if law.pair_values:
            return f"{law.label()} has values for single pairs"
    moving = 0
    objects = {obj: None for law in laws for obj in world.mapping.objects(law)}
    along: dict[tuple[Any, ...], bool] = {}
    for obj in objects:
        why = _why_not_object(world, obj, along)
        if why:
            return f"{obj.label} {why}"
        moving += not obj.fixed
    for law in laws:
        if law not in answering and not _hears_impacts_only(law):
            return f"{law.label()} waits for contacts to begin, to last or to end"
        if law not in answering:
            mine = world.mapping.objects(law)
            if not any(set(mine) <= set(world.mapping.objects(one)) for one in answering):
                return f"{law.label()} listens to contacts that nobody answers"
    if world.wish == OTHER_WISH:
        return f"{OTHER_WISH} was asked for"
    return "" if moving else "nothing moves"


def _hears_impacts_only(law: Any) -> bool:
    """Whether no container of ``law`` waits for another condition of contacts than an impact."""
    heard = [leaf for one in law.containers if one.condition is not None for leaf in leaves(one.condition)]
    return all(isinstance(leaf, when.Impact) for leaf in heard if leaf.served_by == "contacts")


def _why_not_object(world: Any, obj: PhysicalObject, along: dict[tuple[Any, ...], bool]) -> str:
    if any(obj._columns.get(name, usual.default) != usual.default for name, usual in FILTER.items()):
        return "is in a collision group of its own"
    kind = "sphere" if obj.shape is None else obj.shape.kind
    if obj.fixed:
        return "" if kind in SCENERY else f"is a fixed {kind}"
    if obj._driven:
        return "is driven by the host"
    if kind != "sphere":
        return f"is a {kind} that moves"
    laws = tuple(world.mapping.laws(obj))
    if laws not in along:
        along[laws] = world.is_moved_along(obj) or any(getattr(law, "one_sided", False) for law in laws)
    if along[laws]:
        return "is under laws that are evaluated along its way"
    bodies, row = world.bodies, obj._row
    torque: Vec = bodies.get("torque", row)
    if any(torque):
        return "is under a torque"
    a, b, c = bodies.get("inertia", row)
    return "" if a == b == c else "has moments of inertia that differ"
