"""The queue: by instant, stage and rank; what flew on is dropped."""

from __future__ import annotations

from typing import Any

import pytest

from xpheve.events import AFTER, FORCE, IMPACT, START, Entry, EventQueue
from xpheve.kernels.clock import NEVER, later


def entry(time: float, stage: int = START, rank: tuple[int, ...] = (0,), offset: float = 0.0) -> Entry:
    """Return an entry that does nothing."""
    return Entry((time, offset), stage, rank, lambda members: None)


def drain(queue: EventQueue, until: tuple[float, float] = (1e9, 0.0)) -> list[list[Entry]]:
    """Return all stages until then."""
    found = []
    while stage := queue.pop_stage(until):
        found.append(stage)
    return found


def test_instants_then_stages_then_ranks() -> None:
    queue = EventQueue(lambda one: True)
    late, after, impact, second, first, force = (
        entry(2.0), entry(1.0, AFTER), entry(1.0, IMPACT), entry(1.0, START, (2,)), entry(1.0, START, (1,)), entry(1.0, FORCE),
    )  # fmt: skip
    for one in (late, after, impact, second, first, force):
        queue.push(one)
    assert drain(queue) == [[force], [first, second], [impact], [after], [late]]
    assert queue.next_time() == NEVER and len(queue) == 0


def test_offsets_count() -> None:
    queue = EventQueue(lambda one: True)
    later_one, sooner = entry(1.0, offset=1e-20), entry(1.0, offset=-1e-20)
    queue.push(later_one)
    queue.push(sooner)
    assert drain(queue) == [[sooner], [later_one]]
    assert later((1.0, 0.0), 1e-20) == (1.0, 1e-20)


def test_nothing_is_popped_before_its_time() -> None:
    queue = EventQueue(lambda one: True)
    queue.push(entry(1.0))
    assert queue.pop_stage((0.9999999, 0.0)) == [] and queue.pop_stage((1.0, -1e-30)) == []
    assert len(queue.pop_stage((1.0, 0.0))) == 1


def test_void_entries_are_dropped_at_the_top_and_counted() -> None:
    dead: set[Any] = set()
    queue = EventQueue(lambda one: one not in dead)
    entries = [entry(float(k), rank=(k,)) for k in range(5)]
    for one in reversed(entries):
        queue.push(one)
    dead.update(entries[:3])
    assert queue.next_time() == (3.0, 0.0) and queue.voided == 3
    dead.add(entries[4])
    assert drain(queue) == [[entries[3]]]


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 2, 0)])
def test_equal_entries_come_as_they_were_pushed(order: tuple[int, ...]) -> None:
    queue = EventQueue(lambda one: True)
    entries = [entry(1.0) for _ in range(3)]
    for k in order:
        queue.push(entries[k])
    assert drain(queue) == [[entries[k] for k in order]]
