"""The tournament always knows the first."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as some
from tests.laws_collision.impact.loops import loop_of

from xpheve_laws_collision.impact import rows
from xpheve_laws_collision.impact.impact_loop import ImpactLoop
from xpheve_laws_collision.impact.tournament import replay


def views(loop: ImpactLoop) -> tuple[list[memoryview], list[memoryview]]:
    """The buffers as kernels get them."""
    return [memoryview(one) for one in loop.f], [memoryview(one) for one in loop.n]


times = some.floats(0.0, 10.0) | some.just(math.inf)


@given(some.integers(1, 20), some.lists(some.tuples(some.integers(0, 19), times), max_size=60))
@settings(max_examples=60, deadline=None)
def test_the_first_is_the_first_however_keys_change(count: int, changes: list[tuple[int, float]]) -> None:
    loop = loop_of(count)
    keys = loop.f[rows.KEYS]
    for place, time in changes:
        i = place % count
        keys[2 * i] = time
        replay(*views(loop), i)
        first = int(loop.n[rows.TREE][1])
        assert keys[2 * first] == keys[0 : 2 * count : 2].min()


def test_equal_instants_are_ordered_by_the_ranks_of_the_pairs() -> None:
    loop = loop_of(4)
    place, event = loop._place, loop._event
    place[:, rows.RANK] = (3, 0, 2, 1)
    place[:, rows.PARTNER] = (2, 3, 0, 1)
    event[:, rows.MEETS] = 1.0
    for i in range(4):
        loop.f[rows.KEYS][2 * i] = 1.0
        replay(*views(loop), i)
    assert int(loop.n[rows.TREE][1]) in (1, 3)
    event[0, rows.MEETS], event[0, rows.LEAVES] = np.inf, 1.0
    replay(*views(loop), 0)
    assert int(loop.n[rows.TREE][1]) == 0, "a cell is left before an impact of the same instant"
