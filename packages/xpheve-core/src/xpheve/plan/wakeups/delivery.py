"""Events on their way to containers, through the queue, and into combinations."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from xpheve.events import Entry
from xpheve.laws import Event, LawContainer
from xpheve.laws.combinations import _Combination
from xpheve.laws.conditions import Condition
from xpheve.plan.wakeups.tree import Tree


class Delivery:
    """An event of ``leaf`` on its way to a container."""

    def __init__(self, world: Any, container: LawContainer, leaf: Condition, event: Event) -> None:
        self.world, self.container, self.leaf, self.event = world, container, leaf, event

    def __call__(self, entries: list[Entry]) -> None:
        world = self.world
        time = self.event.time or world.time[0]
        world.signal(self.container, self.leaf, replace(self.event, time=time))


def needs_tree(condition: Condition | None) -> bool:
    """Whether a container with ``condition`` has something to remember."""
    return condition is not None and (isinstance(condition, _Combination) or condition.is_level)


def signal(world: Any, container: Any, leaf: Condition | None, event: Event) -> None:
    """``leaf`` fired: let ``container`` fire if that is its condition, or completes it. None: a level may have changed."""
    condition = container.condition
    if container in world.spent:
        return
    if not needs_tree(condition):
        world.fire(container, replace(event, condition=condition))
        return
    trees: dict[LawContainer, Tree] = world.wakeups.trees
    tree = trees.get(container)
    if tree is None:
        # Not planned yet; what only looks like a container, as the contact server has, is equal to the one it stands for.
        tree = trees[next(one for one in world.containers if one == container)] = Tree(condition)
    if world.transaction is not None:
        kept = tree.memory.copy()
        world.transaction.undo.append(lambda: setattr(tree, "memory", kept))
    parts = tree.signal(leaf, event, world.time, world.wakeups.holds)
    if parts:
        world.fire(container, _joined(world, condition, parts, event))


def _joined(world: Any, condition: Condition, parts: tuple[tuple[Condition, Event], ...], last: Event) -> Event:
    """One event of several: the objects and contacts of all, the rest of the one that completed them."""
    parts = tuple((leaf, replace(one, condition=leaf)) for leaf, one in parts)
    objects = {obj: None for _, one in parts for obj in one.objects}
    contacts = {id(contact): contact for _, one in parts for contact in one.contacts}
    return replace(
        last,
        condition=condition,
        objects=tuple(world.in_rank_order(objects)),
        contacts=tuple(contacts.values()),
        parts=parts,
    )
