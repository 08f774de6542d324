"""Which containers are armed with which conditions: each distinct condition once, whoever shares it."""

from __future__ import annotations

from typing import Any

from xpheve.laws import LawContainer
from xpheve.laws.combinations import leaves, plain
from xpheve.laws.conditions import Condition

Hearer = tuple[LawContainer, Condition]


class Armed:
    """A table of the simple conditions of a world's containers; made again when containers came or went."""

    def __init__(self, world: Any) -> None:
        self._world = world
        self._seen: tuple[int, int] = (-1, -1)
        self._by_leaf: dict[Condition, list[LawContainer]] = {}
        self._by_kind: dict[type[Condition], list[tuple[Condition, list[LawContainer]]]] = {}
        self.detections: dict[Condition, int] = {}
        """How many events each condition had, found once for all containers."""

    def all(self) -> dict[Condition, list[LawContainer]]:
        """Each condition, without ``once``, with its containers in the order of adding."""
        containers = self._world.containers
        seen = (self._world.structure, len(containers))
        if seen != self._seen:
            self._seen = seen
            self._by_leaf = {}
            self._by_kind = {}
            for container in containers:
                for leaf in dict.fromkeys(plain(leaf) for leaf in leaves(container.condition)):
                    self._by_leaf.setdefault(leaf, []).append(container)
        return self._by_leaf

    def of(self, kind: type[Condition]) -> list[tuple[Condition, list[LawContainer]]]:
        """The conditions of ``kind`` with their containers."""
        every = self.all()
        found = self._by_kind.get(kind)
        if found is None:
            found = self._by_kind[kind] = [item for item in every.items() if isinstance(item[0], kind)]
        return found

    def hearers(self, kind: type[Condition]) -> list[Hearer]:
        """Who waits for ``kind``: containers not spent, in rank order, with the condition of each; one with two of the kind comes twice."""
        found = self.of(kind)
        if not found:
            return []
        spent, ranks = self._world.spent, self._world.ranks.container_ranks
        heard = [(container, leaf) for leaf, containers in found for container in containers if container not in spent]
        return sorted(heard, key=lambda one: ranks.get(one[0], 0))

    def count(self, leaf: Condition) -> None:
        """One more event of ``leaf`` was found; taken back with the instant."""
        before = self.detections.get(leaf, 0)
        self.detections[leaf] = before + 1
        if self._world.transaction is not None:
            self._world.transaction.undo.append(lambda: self.detections.__setitem__(leaf, before))
