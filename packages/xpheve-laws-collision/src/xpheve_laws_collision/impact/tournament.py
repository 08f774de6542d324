"""The place whose event is next: a tournament of all places, in which an event that changes plays again on the way to the top only.

Of equal instants the event of the pair with the lower ranks is first, so that the order is nobody's but the pairs'.
"""

from __future__ import annotations

from typing import Any

from xpheve_laws_collision.impact.rows import (
    COUNTS,
    EVENT,
    EVENTS,
    HITS,
    KEYS,
    LEAVES_OF_TREE,
    MEETS,
    PARTNER,
    PLACE,
    PLACES,
    RANK,
    TREE,
    WALL,
)

BEYOND = 1 << 40
"""Added to the number of a fixed shape: those come after all places."""


def ranks(f: Any, n: Any, i: int) -> tuple[int, int, int]:
    """What decides between equal instants: 0 for leaving a cell and 1 for an impact, and the ranks of the pair."""
    place = n[PLACE]
    event = f[EVENT]
    e = EVENTS * i
    p = PLACES * i
    high = f[KEYS][2 * i]
    low = f[KEYS][2 * i + 1]
    own = place[p + RANK]
    if event[e + MEETS] == high and event[e + MEETS + 1] == low:
        other = place[PLACES * place[p + PARTNER] + RANK]
        return (1, min(own, other), max(own, other))
    if event[e + HITS] == high and event[e + HITS + 1] == low:
        return (1, own, BEYOND + place[p + WALL])
    return (0, own, 0)


def beats(f: Any, n: Any, i: int, j: int) -> bool:
    """Whether the event of place ``i`` comes before that of ``j``, the instants being equal."""
    a = ranks(f, n, i)
    b = ranks(f, n, j)
    if a[0] != b[0]:
        return a[0] < b[0]
    if a[1] != b[1]:
        return a[1] < b[1]
    return a[2] < b[2]


def winner(f: Any, n: Any, i: int, j: int) -> int:
    """Which of two places is first; a number beyond the places is nobody, and last."""
    key = f[KEYS]
    a = key[2 * i]
    b = key[2 * j]
    if a < b:
        return i
    if b < a:
        return j
    if a - a != 0.0:  # both never
        return i
    a = key[2 * i + 1]
    b = key[2 * j + 1]
    if a < b:
        return i
    if b < a:
        return j
    return i if beats(f, n, i, j) else j


def replay(f: Any, n: Any, i: int) -> int:
    """Play again from place ``i`` upwards, whose instant has changed."""
    tree = n[TREE]
    key = f[KEYS]
    node = n[COUNTS][LEAVES_OF_TREE] + i
    best = i
    high = key[2 * i]
    while node > 1:
        other = tree[node ^ 1]
        rival = key[2 * other]
        if rival == high:
            best = winner(f, n, best, other) if node & 1 == 0 else winner(f, n, other, best)
        else:
            best = other if rival < high else best
            high = rival if rival < high else high
        node >>= 1
        if tree[node] == best and best != i:
            return 0  # who wins here has not changed, nor has its instant
        tree[node] = best
    return 0
