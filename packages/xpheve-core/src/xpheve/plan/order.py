"""In which order laws act inside one event: before and after, then priority, then id, then rank."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from xpheve.errors import OrderError, OrderWarning
from xpheve.laws import PhysicalLaw

if TYPE_CHECKING:
    from xpheve.plan.transaction import Clash
    from xpheve.plan.world import World


def earlier_of(laws: Iterable[PhysicalLaw]) -> dict[str, set[str]]:
    """For each law id the ids that ``before`` and ``after`` put right before it."""
    earlier: dict[str, set[str]] = {}
    for law in laws:
        earlier.setdefault(law.label(), set()).update(law.after)
        for other in law.before:
            earlier.setdefault(other, set()).add(law.label())
    return earlier


def positions(laws: Iterable[PhysicalLaw]) -> dict[str, int]:
    """For each law id, the length of the longest chain of ids that come before it.

    Raises
    ------
    OrderError
        If ``before`` and ``after`` form a ring.
    """
    earlier = earlier_of(laws)
    depth: dict[str, int] = {}

    def measure(one: str, trail: tuple[str, ...]) -> int:
        if one in trail:
            ring = " -> ".join([*trail[trail.index(one) :], one])
            raise OrderError(
                f"these laws ask for an order that goes round in a ring: {ring}; drop one before= or after="
            )
        if one not in depth:
            depth[one] = max((measure(other, (*trail, one)) + 1 for other in sorted(earlier.get(one, ()))), default=0)
        return depth[one]

    for one in sorted(earlier):
        measure(one, ())
    return depth


def comes_before(laws: Iterable[PhysicalLaw], first: str, second: str) -> bool:
    """Whether a chain of ``before`` and ``after`` leads from ``first`` to ``second``."""
    earlier = earlier_of(laws)
    seen: set[str] = set()
    frontier = [second]
    while frontier:
        one = frontier.pop()
        for other in earlier.get(one, ()):
            if other == first:
                return True
            if other not in seen:
                seen.add(other)
                frontier.append(other)
    return False


def why_before(world: World, first: PhysicalLaw, second: PhysicalLaw) -> str:
    """What puts ``first`` before ``second`` inside one event."""
    one, other = world.law_order(first), world.law_order(second)
    if one[0] != other[0]:
        asked = comes_before(world.laws, first.label(), second.label())
        return "before/after" if asked else "before/after of other laws: it stands less deep in their chains"
    if one[1] != other[1]:
        return f"priority {first.priority} above {second.priority}"
    if one[2] != other[2]:
        return f"id: {first.label()} sorts before {second.label()}; say before= or after= if it matters"
    return "rank: names first, then parameters, then as added; give them priorities if it matters"


def order_report(world: World) -> list[dict[str, Any]]:
    """Each event that several laws answer, with their order and what puts each before the next."""
    found = []
    for container in sorted(world.containers, key=lambda one: world.ranks.container_ranks.get(one, 0)):
        laws = sorted(container.laws, key=world.law_order)
        if len(laws) < 2:
            continue
        found.append(
            {
                "container": container.name or container.label(),
                "condition": str(container.condition),
                "laws": [law.name or law.label() for law in laws],
                "because": [why_before(world, a, b) for a, b in pairwise(laws)],
            }
        )
    return found


def report_clashes(world: World, clashes: Iterable[Clash]) -> None:
    """Warn, once for two laws and a column, of laws that both set it at one event with nothing that says which comes last."""
    for first, second, name, obj in clashes:
        a, b = first.label(), second.label()
        together = any(container in second.containers for container in first.containers)
        ordered = together and (
            first.priority != second.priority or comes_before(world.laws, a, b) or comes_before(world.laws, b, a)
        )
        if ordered or (first, second, name) in world.clashes or (second, first, name) in world.clashes:
            continue
        out = "" if together else "put both into one container, and "
        text = (
            f"{first!r} and {second!r} both set {name} of {obj!r} at t = {world.time[0]} s, and nothing says which comes last; "
            f"here {second!r} does. The way out: {out}give one of them before= or after= the other's id, or another priority; "
            "warnings.filterwarnings('ignore', category=xpheve.errors.OrderWarning) silences this"
        )
        warnings.warn(text, OrderWarning, stacklevel=2)
        world.clashes[first, second, name] = text
