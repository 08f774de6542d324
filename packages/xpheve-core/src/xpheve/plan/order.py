"""In which order laws act inside one event: before and after, then priority, then id, then rank."""

from __future__ import annotations

from collections.abc import Iterable

from xpheve.errors import OrderError
from xpheve.laws import PhysicalLaw


def positions(laws: Iterable[PhysicalLaw]) -> dict[str, int]:
    """For each law id, the length of the longest chain of ids that come before it.

    Raises
    ------
    OrderError
        If ``before`` and ``after`` form a ring.
    """
    earlier: dict[str, set[str]] = {}
    for law in laws:
        earlier.setdefault(law.label(), set()).update(law.after)
        for other in law.before:
            earlier.setdefault(other, set()).add(law.label())
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
