"""Flights that are older than the scenery or the laws: they count from when those are as they are."""

from __future__ import annotations

from typing import Any

from xpheve.kernels.clock import elapsed
from xpheve_laws_collision.impact.limits import put, vector
from xpheve_laws_collision.impact.meetings import moved, sped
from xpheve_laws_collision.impact.rows import PAIR, PULL, SINCE, SPACE, STATE, STATES, TIME, V, X


def is_older(f: Any, i: int) -> bool:
    """Whether the flight of ``i`` began before `SINCE`."""
    high = f[SPACE][SINCE]
    began = f[STATE][STATES * i + TIME]
    older: bool = began < high or (began == high and f[STATE][STATES * i + TIME + 1] < f[SPACE][SINCE + 1])
    return older


def bring(f: Any, i: int, to: int) -> int:
    """Write the flight of ``i`` as it is at `SINCE` into row ``to`` of `PAIR`."""
    state = f[STATE]
    space = f[SPACE]
    pair = f[PAIR]
    a = STATES * i
    b = STATES * to
    for k in range(STATES):
        pair[b + k] = state[a + k]
    s = elapsed((space[SINCE], space[SINCE + 1]), (state[a + TIME], state[a + TIME + 1]))
    v = vector(state, a + V)
    pull = vector(state, a + PULL)
    put(pair, b + X, moved(vector(state, a + X), v, pull, s))
    put(pair, b + V, sped(v, pull, s))
    pair[b + TIME] = space[SINCE]
    pair[b + TIME + 1] = space[SINCE + 1]
    return 0


def beginning(f: Any, i: int) -> tuple[float, float]:
    """From when on the flight of ``i`` counts."""
    if is_older(f, i):
        return (f[SPACE][SINCE], f[SPACE][SINCE + 1])
    return (f[STATE][STATES * i + TIME], f[STATE][STATES * i + TIME + 1])
