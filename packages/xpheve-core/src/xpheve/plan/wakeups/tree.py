"""What a combination of conditions remembers for one container, and when it fires."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

from xpheve.kernels.clock import Instant
from xpheve.laws import Event
from xpheve.laws.combinations import AllNow, AllOf, AnyOf, _Combination, plain
from xpheve.laws.conditions import Condition

Part = tuple[Condition, Event]
Parts = list[Part]


class Node(NamedTuple):
    """A condition in a tree, numbered from the root on, left to right."""

    number: int
    condition: Condition
    children: tuple[Node, ...]


def is_one_level(condition: Condition) -> bool:
    """Whether ``condition`` fires when it becomes true; `AnyOf` fires whenever one of its members does, levels too."""
    return condition.is_level and not isinstance(condition, AnyOf)


def grow(condition: Condition, numbers: Iterator[int]) -> Node:
    """The tree of ``condition``."""
    number = next(numbers)
    of = condition.of if isinstance(condition, _Combination) and not is_one_level(condition) else ()
    return Node(number, condition, tuple(grow(one, numbers) for one in of))


def _levels(node: Node) -> Iterator[Node]:
    if is_one_level(node.condition):
        yield node
    for child in node.children:
        yield from _levels(child)


class Memory:
    """What has happened to a tree since it last fired."""

    def __init__(self) -> None:
        self.met: dict[int, Parts] = {}
        """By member of an `AllOf`: what met it."""
        self.at: dict[int, tuple[Instant, Parts]] = {}
        """By member of an `AllNow`: when it last fired."""
        self.held: dict[int, bool] = {}
        """By level: whether it held when last asked."""
        self.used: set[int] = set()
        """Members with ``once`` that have fired."""

    def copy(self) -> Memory:
        """A memory of its own with the same contents."""
        other = Memory()
        other.met = {k: list(v) for k, v in self.met.items()}
        other.at = {k: (instant, list(v)) for k, (instant, v) in self.at.items()}
        other.held, other.used = dict(self.held), set(self.used)
        return other


class Tree:
    """A condition that is a level, or made of others, in one container."""

    def __init__(self, condition: Condition) -> None:
        self.root = grow(condition, iter(range(1_000_000)))
        self.memory = Memory()
        self._levels = list(_levels(self.root))

    def is_stale(self, holds: Callable[[Condition], bool]) -> bool:
        """Whether a level is other than when last asked: it was armed, or what it is about came or went."""
        return any(self.memory.held.get(node.number, False) != holds(node.condition) for node in self._levels)

    def signal(
        self, leaf: Condition | None, event: Event, now: Instant, holds: Callable[[Condition], bool]
    ) -> tuple[Part, ...]:
        """``leaf`` fired, or (None) a level changed: what set off the whole, empty if it does not fire."""
        found = self._visit(self.root, leaf, event, now, holds)
        if found:
            self.memory.met.clear()
            self.memory.at.clear()
        return tuple(found)

    def _visit(
        self, node: Node, leaf: Condition | None, event: Event, now: Instant, holds: Callable[[Condition], bool]
    ) -> Parts:
        memory, condition = self.memory, node.condition
        if is_one_level(condition):
            before, memory.held[node.number] = memory.held.get(node.number, False), holds(condition)
            found = [(condition, event)] if memory.held[node.number] and not before else []
        elif not node.children:
            found = [(condition, event)] if plain(condition) == leaf else []
        else:
            parts = [self._visit(child, leaf, event, now, holds) for child in node.children]
            if isinstance(condition, AllOf):
                found = self._all_of(node, parts)
            elif isinstance(condition, AllNow):
                found = self._all_now(node, parts, event, now, holds)
            else:
                found = [one for part in parts for one in part]
        if node.number in memory.used:
            return []
        if found and condition.once and node is not self.root:
            memory.used.add(node.number)
        return found

    def _all_of(self, node: Node, parts: list[Parts]) -> Parts:
        met = self.memory.met
        for child, part in zip(node.children, parts, strict=True):
            if part:
                met.setdefault(child.number, part)
        if not all(child.number in met for child in node.children):
            return []
        return [one for child in node.children for one in met.pop(child.number)]

    def _all_now(
        self, node: Node, parts: list[Parts], event: Event, now: Instant, holds: Callable[[Condition], bool]
    ) -> Parts:
        at = self.memory.at
        found: Parts = []
        complete = True
        for child, part in zip(node.children, parts, strict=True):
            if child.condition.is_level:
                complete = complete and holds(child.condition)
                found.append((child.condition, event))
                continue
            if part:
                at[child.number] = (now, part)
            if child.number in at and at[child.number][0] == now:
                found += at[child.number][1]
            else:
                complete = False
        if not complete:
            return []
        for child in node.children:
            at.pop(child.number, None)
        return found
