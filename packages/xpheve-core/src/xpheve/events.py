"""The event queue: what happens when, in which order."""

from __future__ import annotations

import heapq
from collections.abc import Callable
from typing import TYPE_CHECKING

from xpheve.kernels.clock import NEVER, Instant

if TYPE_CHECKING:
    from xpheve.objects import PhysicalObject

FORCE, START, IMPACT, AFTER = range(4)
"""Stages of one instant, in order: forces end; hosts, timers and posts; impacts; contacts end and structure changes."""

Rank = tuple[int, ...]
Guard = tuple["PhysicalObject", int]


class Entry:
    """Something that will happen: when, at which stage, in which order among equals, and what.

    ``guards`` are objects with the versions of their flights that the entry was predicted from; it is void when one has moved on.
    ``stands`` says whether what it is about is there at all: it was not taken away, or taken back with a handler that failed.
    """

    __slots__ = ("act", "alive", "guards", "instant", "rank", "stage", "stands")

    def __init__(
        self,
        instant: Instant,
        stage: int,
        rank: Rank,
        act: Callable[[list[Entry]], None],
        guards: tuple[Guard, ...] = (),
        stands: Callable[[], bool] | None = None,
    ) -> None:
        self.instant = instant
        self.stage = stage
        self.rank = rank
        self.act = act
        self.guards = guards
        self.stands = stands
        self.alive = True


class EventQueue:
    """Entries by instant (base, offset), then stage, then rank.

    The same function in several entries of one stage and instant is called once, with all of them.
    """

    def __init__(self, is_live: Callable[[Entry], bool]) -> None:
        self._heap: list[tuple[float, float, int, Rank, int, Entry]] = []
        self._count = 0
        self._is_live = is_live
        self.voided = 0

    def __len__(self) -> int:
        return len(self._heap)

    def push(self, entry: Entry) -> Entry:
        """Put ``entry`` in."""
        self._count += 1
        heapq.heappush(self._heap, (*entry.instant, entry.stage, entry.rank, self._count, entry))
        return entry

    def next_time(self) -> Instant:
        """When the next live entry is due; `NEVER` if there is none. Void entries at the top are dropped."""
        heap = self._heap
        while heap:
            entry = heap[0][-1]
            if self._is_live(entry):
                return entry.instant
            heapq.heappop(heap)
            self.voided += 1
        return NEVER

    def next_stage(self) -> int:
        """The stage of the next live entry; after all stages if there is none."""
        return AFTER + 1 if self.next_time() == NEVER else self._heap[0][-1].stage

    def pop_stage(self, due: Instant) -> list[Entry]:
        """The live entries of the first stage due at ``due`` or before, in rank order; empty if there is none."""
        if self.next_time() > due:
            return []
        first = self._heap[0][-1]
        found: list[Entry] = []
        while self._heap and self.next_time() <= due and self._heap[0][-1].stage == first.stage:
            if self._heap[0][-1].instant != first.instant:
                break
            found.append(heapq.heappop(self._heap)[-1])
        return found

    def clear(self) -> None:
        """Forget everything."""
        self._heap.clear()
