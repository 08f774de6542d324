"""Inputs of the host: all of one kind and instant are handed over together."""

from __future__ import annotations

from typing import Any

from xpheve.errors import InvalidValueError
from xpheve.events import START, Entry
from xpheve.laws import Event
from xpheve.laws import conditions as when


class _Arrival(Entry):
    """Inputs that wait to be handed over."""

    __slots__ = ()


class Inputs:
    """What came in and has not been handed over."""

    def __init__(self, world: Any) -> None:
        self.world = world
        self.waiting: list[tuple[str, Any]] = []

    def put(self, kind: str, data: Any) -> None:
        """``data`` of ``kind`` came in; forgotten at once if nobody is armed."""
        if not isinstance(kind, str) or not kind:
            raise InvalidValueError(f"input: kind = {kind!r}: a text such as 'key' is needed")
        if not any(leaf.takes(kind, data) for leaf, _ in self.world.wakeups.armed.of(when.Input)):
            return
        self.waiting.append((kind, data))
        if len(self.waiting) == 1:
            self.announce()

    def announce(self) -> None:
        """Put the handing over into the queue."""
        self.world.posts += 1
        self.world.queue.push(_Arrival(self.world.time, START, (1, self.world.posts, 0), self.hand_over))

    def hand_over(self, entries: list[Entry]) -> None:
        """Let each container have all inputs that it waits for, as one event."""
        world = self.world
        waiting, self.waiting = self.waiting, []
        world.transaction.undo.append(lambda: setattr(self, "waiting", waiting))
        counted: set[Any] = set()
        for container, leaf in world.wakeups.armed.hearers(when.Input):
            assert isinstance(leaf, when.Input)
            data = tuple(value for kind, value in waiting if leaf.takes(kind, value))
            if data:
                if leaf not in counted:
                    counted.add(leaf)
                    world.wakeups.armed.count(leaf)
                world.signal(container, leaf, Event(world.time[0], leaf, id=leaf.kind, data=data))
