"""Properties that somebody set."""

from __future__ import annotations

import math
from typing import Any

from xpheve.laws import Event
from xpheve.laws import conditions as when
from xpheve.objects import PhysicalObject


def tell_changed(world: Any, obj: PhysicalObject, name: str, before: tuple[float, ...] | None) -> None:
    """``name`` of ``obj`` was set from ``before``, which is None for a column: queue it for all who wait for that."""
    armed = world.wakeups.armed
    if armed.of(when.Changed):
        laws = world.mapping.laws(obj)
        world.tell(
            when.Changed,
            lambda container, leaf: leaf.what in ("", name) and _concerns(leaf, container, obj, laws),
            Event(world.time[0], objects=(obj,), id=name),
        )
    if name in ("position", "orientation") and before is not None and armed.of(when.PoseChanged):
        laws = world.mapping.laws(obj)
        moved = _way(name, before, world.bodies.get(name, obj._row))
        world.tell(
            when.PoseChanged,
            lambda container, leaf: moved > leaf.tol and _concerns(leaf, container, obj, laws),
            Event(world.time[0], objects=(obj,), id=name),
        )


def _concerns(leaf: Any, container: Any, obj: PhysicalObject, laws: Any) -> bool:
    if leaf.obj is not None:
        return bool(leaf.obj is obj)
    return any(law in laws for law in container.laws)


def _way(name: str, before: tuple[float, ...], after: tuple[float, ...]) -> float:
    """Distance [m] between two positions, or angle [rad] between two orientations."""
    if name == "position":
        return math.dist(before, after)
    apart = math.dist(before, after)
    opposite = math.dist(before, tuple(-x for x in after))
    return 4.0 * math.asin(min(1.0, 0.5 * min(apart, opposite)))
