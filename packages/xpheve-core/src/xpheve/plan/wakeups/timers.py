"""Containers that wait for time, or are polled: one timer for all that wait equally long from the same instant."""

from __future__ import annotations

from functools import partial
from typing import Any

from xpheve.events import START, Entry
from xpheve.kernels.clock import Instant, multiple
from xpheve.laws import Event, LawContainer
from xpheve.laws import conditions as when
from xpheve.laws.conditions import Condition


class Timer:
    """Who is called at which multiples of ``period`` [s] since ``origin``, and how often that has been."""

    def __init__(self, key: Any, period: float, every: bool, origin: Instant, count: int = 0) -> None:
        self.key = key
        """The condition; for a polled container the container itself."""
        self.period, self.every, self.origin, self.count = period, every, origin, count
        self.hearers: list[LawContainer] = []


class _Ring(Entry):
    """A timer's next call."""

    __slots__ = ("timer",)
    timer: Timer


class Timers:
    """All timers of a world."""

    def __init__(self, world: Any) -> None:
        self.world = world
        self.all: list[Timer] = []
        self.known: dict[LawContainer, None] = {}
        """Containers that have been given their timers."""

    def arm(self) -> None:
        """Give each new container that waits for time its timers, from now on."""
        world = self.world
        for leaf, containers in world.wakeups.armed.of(when.Elapsed):
            for container in containers:
                if container not in self.known and container not in world.spent and not container.is_polled:
                    self._join(leaf, leaf.seconds, leaf.every, container)
        for container in world.containers:
            if (
                container.is_polled
                and container.period
                and container not in self.known
                and container not in world.spent
            ):
                self._join(container, container.period, True, container)
        self.known.update(dict.fromkeys(world.containers))

    def _join(self, key: Any, period: float, every: bool, container: LawContainer) -> None:
        now = self.world.time
        for timer in self.all:
            if timer.key == key and timer.origin == now and timer.count == 0:
                timer.hearers.append(container)
                return
        timer = Timer(key, period, every, now)
        timer.hearers.append(container)
        self.all.append(timer)
        self.set(timer)

    def set(self, timer: Timer) -> None:
        """Put the next call of ``timer`` into the queue, if somebody still waits."""
        if timer not in self.all:
            return
        ranks = self.world.ranks.container_ranks
        first = min((ranks.get(container, 0) for container in timer.hearers), default=0)
        due = multiple(timer.origin, timer.count + 1, timer.period)
        entry = _Ring(due, START, (0, first), self.ring)
        entry.timer = timer
        self.world.queue.push(entry)

    def forget(self, container: LawContainer) -> None:
        """``container`` waits no more."""
        self.known.pop(container, None)
        for timer in self.all:
            if container in timer.hearers:
                timer.hearers.remove(container)
        self.all = [timer for timer in self.all if timer.hearers]

    def ring(self, entries: list[Entry]) -> None:
        """All timers of one instant: call who waits, in rank order."""
        world = self.world
        due = [entry.timer for entry in entries if isinstance(entry, _Ring) and entry.timer in self.all]
        transaction = world.transaction
        kept = (list(self.all), [(timer, timer.count) for timer in due])
        transaction.undo.append(lambda: self._put_back(*kept))
        calls: list[tuple[int, int, LawContainer, Timer]] = []
        for k, timer in enumerate(due):
            timer.count += 1
            if not isinstance(timer.key, LawContainer):
                world.wakeups.armed.count(timer.key)
            calls += [(world.ranks.container_ranks.get(c, 0), k, c, timer) for c in timer.hearers]
        for _, _, container, timer in sorted(calls, key=lambda call: call[:2]):
            self._call(container, timer.key)
        for timer in due:
            if timer.every:
                transaction.later.append(partial(self.set, timer))
            else:
                self.all.remove(timer)

    def _call(self, container: LawContainer, key: Condition | LawContainer) -> None:
        world = self.world
        if isinstance(key, LawContainer):
            world.poll(container, container.period)
            return
        world.signal(container, key, Event(world.time[0], key, world.objects_under(container)))
        if isinstance(container.condition, when.Elapsed) and not container.condition.every:
            world.spend(container)

    def _put_back(self, timers: list[Timer], counts: list[tuple[Timer, int]]) -> None:
        self.all = timers
        for timer, count in counts:
            timer.count = count
