"""What happens to a place next: the first of its meetings with other places, with fixed shapes, and of leaving its cell."""

from __future__ import annotations

import math
from typing import Any

from xpheve.kernels.clock import later
from xpheve.kernels.vector import Vec, dot, norm
from xpheve_laws_collision.impact.cells import wait_to_leave
from xpheve_laws_collision.impact.limits import ULPS, vector
from xpheve_laws_collision.impact.meetings import SURE, hit, meeting, sizes
from xpheve_laws_collision.impact.rows import (
    BOX,
    CELL,
    CELLED,
    CENTRE,
    COUNT,
    COUNTS,
    ENDLESS,
    EVENT,
    EVENTS,
    FOLDED,
    GRID,
    HEADS,
    HITS,
    HITS_HOW,
    KEYS,
    KIND,
    LAST_NEARBY,
    LEAVES,
    LINK,
    LINKS,
    MASK,
    MASKS,
    MEETS,
    MEETS_HOW,
    NEARBY,
    NEARS,
    NEXT,
    NOTHING,
    PAIR,
    PARTNER,
    PERIODIC,
    PLACE,
    PLACES,
    PLANE,
    PREDICTIONS,
    PRESENT,
    PULL,
    QUIET,
    RADIUS,
    RANK,
    REST,
    SCENERIES,
    SCENERY,
    SCENES,
    SEEN,
    SHELVES,
    SHIFT,
    SINCE,
    SIZE,
    SKIP,
    SPACE,
    STAMP,
    STATE,
    STATES,
    TIME,
    TOUCHES,
    WALL,
    WRAPS,
    V,
    X,
)
from xpheve_laws_collision.impact.since import bring, is_older
from xpheve_laws_collision.impact.tournament import replay

AT_A_GLANCE = 1.0005
"""The radii, for what is left out at a glance."""


SPARE = 1e-9  # of lengths and times: farther off is surely beyond


def look_at(f: Any, n: Any, i: int, j: int, k: Vec, box: Vec) -> int:
    """Predict the pair (i, j), and keep it if it is the next that ``i`` meets: whether they touch."""
    place = n[PLACE]
    event = f[EVENT]
    e = EVENTS * i
    best = (event[e + MEETS], event[e + MEETS + 1])
    if f[SPACE][SINCE] >= f[STATE][STATES * i + TIME] and is_older(f, i) and is_older(f, j):
        bring(f, i, 0)
        bring(f, j, 1)
        high, low, how = meeting(f[PAIR], 0, 1, k, box, best)
    else:
        high, low, how = meeting(f[STATE], i, j, k, box, best)
    if how & REST and (place[PLACES * i + QUIET] or place[PLACES * j + QUIET]):
        return how >> 2
    if earlier(n, i, j, high, low, best):
        p = PLACES * i
        b = STATES * j + WRAPS
        state = f[STATE]
        event[e + MEETS] = high
        event[e + MEETS + 1] = low
        event[e + SHIFT] = (k[0] - state[b]) * box[0]
        event[e + SHIFT + 1] = (k[1] - state[b + 1]) * box[1]
        event[e + SHIFT + 2] = (k[2] - state[b + 2]) * box[2]
        place[p + PARTNER] = j
        place[p + SEEN] = n[LINK][LINKS * j + STAMP]
        place[p + MEETS_HOW] = how & 3
    return how >> 2


def earlier(n: Any, i: int, j: int, high: float, low: float, best: tuple[float, float]) -> bool:
    """Whether ``i`` meets ``j`` before what is known; at one instant the lower rank is first."""
    if high != best[0]:
        return high < best[0]
    if low != best[1]:
        return low < best[1]
    if high == math.inf:
        return False
    place = n[PLACE]
    lower: bool = place[PLACES * j + RANK] < place[PLACES * place[PLACES * i + PARTNER] + RANK]
    return lower


def look_around(f: Any, n: Any, i: int, way: int, but: int) -> int:
    """Predict ``i`` with all places near it, or with those that came near as it moved over ``way``.

    Returns how many of them touch it, ``but`` left out.
    """
    if n[COUNTS][CELLED]:
        return look_in_cells(f, n, i, way, but)
    mask = n[LINK][LINKS * i + MASK]
    zero = (0.0, 0.0, 0.0)
    touching = 0
    for j in range(n[COUNTS][COUNT]):
        if j != i and n[LINK][LINKS * j + MASK] & mask:
            n[COUNTS][PREDICTIONS] += 1
            touches = look_at(f, n, i, j, zero, zero)
            if touches and j != but:
                touching += 1
    return touching


def reach_of(n: Any, c: int, at: int, way: int) -> tuple[int, int]:
    """The first and last neighbour along axis ``c`` of a cell whose folded coordinate is ``at``."""
    if abs(way) == c + 1:
        one = 1 if way > 0 else -1
        return (one, one)
    size = n[COUNTS][GRID + c]
    if n[COUNTS][PERIODIC + c] or size > 2:
        return (-1, 1)
    return (0, size - 1)  # all there are, each once


def look_in_cells(f: Any, n: Any, i: int, way: int, but: int) -> int:
    """`look_around` with cells."""
    place = n[PLACE]
    counts = n[COUNTS]
    heads = n[HEADS]
    p = PLACES * i
    nx, ny, nz = counts[GRID], counts[GRID + 1], counts[GRID + 2]
    x, y, z = place[p + FOLDED], place[p + FOLDED + 1], place[p + FOLDED + 2]
    first, last = reach_of(n, 0, x, way)
    first_y, last_y = reach_of(n, 1, y, way)
    first_z, last_z = reach_of(n, 2, z, way)
    nearby = n[NEARBY]
    found = 0
    for at_x in range(x + first, x + last + 1):
        over_x = -1 if at_x < 0 else (1 if at_x >= nx else 0)
        row = (at_x - over_x * nx) * ny
        for at_y in range(y + first_y, y + last_y + 1):
            over_y = -1 if at_y < 0 else (1 if at_y >= ny else 0)
            line = (row + at_y - over_y * ny) * nz
            over_xy = over_x + 21 + 4 * over_y
            for at_z in range(z + first_z, z + last_z + 1):
                over = -1 if at_z < 0 else (1 if at_z >= nz else 0)
                head = heads[line + at_z - over * nz]
                nearby[NEARS * found] = head
                nearby[NEARS * found + 1] = over_xy + 16 * over
                found += 1 if head >= 0 else 0
    return look_at_nearby(f, n, i, found, but)


def look_at_nearby(f: Any, n: Any, i: int, count: int, but: int) -> int:
    """Predict ``i`` with the ``count`` lists noted as nearby: how many places touch it, ``but`` left out.

    The lists are followed side by side, each place followed by the next of its list, so that no branch depends on how long they are. Most
    places are seen to pass at a glance, in plain floats: their centres, on a straight way past each other, do not come within a little more
    than the sum of the radii, or not before what is known already. What is left out so changes no bit of what is found.
    """
    state = f[STATE]
    event = f[EVENT]
    nearby = n[NEARBY]
    links = n[LINK]
    box = vector(f[SPACE], BOX)
    a = STATES * i
    e = EVENTS * i + MEETS
    high = state[a + TIME]
    low = state[a + TIME + 1]
    xa = vector(state, a + X)
    va = vector(state, a + V)
    pull = vector(state, a + PULL)
    wraps = vector(state, a + WRAPS)
    slack = ULPS * (abs(xa[0]) + abs(xa[1]) + abs(xa[2]) + box[0] + box[1] + box[2]) * 64.0
    reach = AT_A_GLANCE * state[a + RADIUS] + slack
    until = (event[e] - high) + (event[e + 1] - low)
    mask = links[LINKS * i + MASK]
    pulled = pull[0] != 0.0 or pull[1] != 0.0 or pull[2] != 0.0
    closed = box[0] != 0.0 or box[1] != 0.0 or box[2] != 0.0
    touching = 0
    skipped = 0
    m = 0
    while m < count:
        at = NEARS * (m & LAST_NEARBY)
        to = NEARS * (count & LAST_NEARBY)
        j = nearby[at]
        over = nearby[at + 1]
        after = links[LINKS * j + NEXT]
        nearby[to] = after
        nearby[to + 1] = over
        count += 1 if after >= 0 else 0
        m += 1
        if j == i or links[LINKS * j + MASK] & mask == 0:
            skipped += 1
            continue
        b = STATES * j
        if pull[0] == state[b + PULL] and pull[1] == state[b + PULL + 1] and pull[2] == state[b + PULL + 2]:
            s = (high - state[b + TIME]) + (low - state[b + TIME + 1])
            vx = state[b + V]
            vy = state[b + V + 1]
            vz = state[b + V + 2]
            x = (state[b + X] - xa[0]) + s * vx
            y = (state[b + X + 1] - xa[1]) + s * vy
            z = (state[b + X + 2] - xa[2]) + s * vz
            vx -= va[0]
            vy -= va[1]
            vz -= va[2]
            if pulled:
                h = 0.5 * s * s
                x += h * pull[0]
                y += h * pull[1]
                z += h * pull[2]
                vx += s * pull[0]
                vy += s * pull[1]
                vz += s * pull[2]
            if closed:
                x += (wraps[0] + ((over & 3) - 1) - state[b + WRAPS]) * box[0]
                y += (wraps[1] + ((over >> 2 & 3) - 1) - state[b + WRAPS + 1]) * box[1]
                z += (wraps[2] + ((over >> 4) - 1) - state[b + WRAPS + 2]) * box[2]
            left = until
            if s < 0.0:  # the flight of the other is the later one
                x -= s * vx
                y -= s * vy
                z -= s * vz
                left += s
            distance = reach + AT_A_GLANCE * state[b + RADIUS]
            far = x * x + y * y + z * z
            along = x * vx + y * vy + z * vz
            beyond = far - distance * distance
            swift = vx * vx + vy * vy + vz * vz
            inside = along * along - swift * beyond
            if (beyond > 0.0) & ((along >= 0.0) | (inside < -SURE * swift * far)):  # one branch, which is mostly taken
                continue
            if beyond > 0.0 and beyond > 1.001 * left * (math.sqrt(max(inside, 0.0)) - along):
                continue
        k = (wraps[0] + ((over & 3) - 1), wraps[1] + ((over >> 2 & 3) - 1), wraps[2] + ((over >> 4) - 1))
        touches = look_at(f, n, i, j, k, box)
        if touches and j != but:
            touching += 1
        until = (event[e] - high) + (event[e + 1] - low)
    n[COUNTS][PREDICTIONS] += count - skipped
    return touching


def look_at_scenery(f: Any, n: Any, i: int, way: int, but: int) -> int:
    """Predict ``i`` with the fixed shapes of its cell and those without bounds; with the former only, where it moved over ``way``.

    Returns how many of them touch it, ``but`` left out.
    """
    counts = n[COUNTS]
    shelves = n[SHELVES]
    p = PLACES * i
    e = EVENTS * i
    touching = 0
    if way == 0:
        n[PLACE][p + WALL] = -1
        n[PLACE][p + HITS_HOW] = NOTHING
        f[EVENT][e + HITS] = math.inf
        f[EVENT][e + HITS + 1] = 0.0
        if counts[ENDLESS] > 0:
            touching = look_at_rows(f, n, i, 0, counts[ENDLESS], but, math.inf)
    if counts[CELLED] and counts[SCENES] > counts[ENDLESS] and n[PLACE][p + CELL] >= 0:
        at = counts[ENDLESS] + n[PLACE][p + CELL]
        if shelves[at] < shelves[at + 1]:
            touching += look_at_rows(f, n, i, shelves[at], shelves[at + 1], but, f[EVENT][e + LEAVES])
    return touching


def look_at_rows(f: Any, n: Any, i: int, first: int, end: int, but: int, until: float) -> int:
    """Predict ``i`` with fixed shapes of the shelves from ``first`` on, and keep the next that it hits: how many touch it.

    Nobody wants to know what comes later than ``until`` or than what is known already: what is too far off for that is left out.
    """
    place = n[PLACE]
    event = f[EVENT]
    shapes = f[SCENERY]
    masks = n[MASKS]
    shelves = n[SHELVES]
    p = PLACES * i
    e = EVENTS * i + HITS
    mask = n[LINK][LINKS * i + MASK]
    skip = place[p + SKIP]
    state = f[STATE]
    one = i
    if f[SPACE][SINCE] >= state[STATES * i + TIME] and is_older(f, i):
        bring(f, i, 0)
        state = f[PAIR]
        one = 0
    start = (state[STATES * one + TIME], state[STATES * one + TIME + 1])
    high = event[e]
    low = event[e + 1]
    speed = -1.0
    bend = 0.0
    touching = 0
    for at in range(first, end):
        row = shelves[at]
        if row != skip and masks[2 * row] & mask:
            c = SCENERIES * row
            if shapes[c + KIND] != PLANE:
                if speed < 0.0:
                    speed = norm(vector(state, STATES * one + V))
                    bend = 0.5 * norm(vector(state, STATES * one + PULL))
                span = min(high, until) - start[0]
                span = max(0.0, span + SPARE * abs(start[0] + span))
                reach = state[STATES * one + RADIUS] + shapes[c + SIZE + 3] + span * (speed + span * bend)
                if is_beyond(vector(state, STATES * one + X), vector(shapes, c + CENTRE), reach):
                    continue
            n[COUNTS][PREDICTIONS] += 1
            span, how = hit(state, one, shapes, row)
            if how & TOUCHES and row != but:
                touching += 1
            if span < math.inf and not (how & REST and place[p + QUIET]):
                new, new_low = later(start, span)
                if new < high or (new == high and (new_low < low or (new_low == low and row < place[p + WALL]))):
                    high = new
                    low = new_low
                    place[p + WALL] = row
                    place[p + HITS_HOW] = how & 3
    event[e] = high
    event[e + 1] = low
    return touching


def is_beyond(x: Vec, y: Vec, reach: float) -> bool:
    """Whether two points are surely farther apart than ``reach``."""
    d = (y[0] - x[0], y[1] - x[1], y[2] - x[2])
    more = reach + SPARE * (reach + sizes(x) + sizes(y))
    return dot(d, d) > more * more


def settle(f: Any, n: Any, i: int) -> int:
    """Enter the first of what happens to ``i`` into the tournament."""
    event = f[EVENT]
    key = f[KEYS]
    e = EVENTS * i
    high = event[e + MEETS]
    low = event[e + MEETS + 1]
    for at in (HITS, LEAVES):
        if event[e + at] < high or (event[e + at] == high and event[e + at + 1] < low):
            high = event[e + at]
            low = event[e + at + 1]
    key[2 * i] = high
    key[2 * i + 1] = low
    return replay(f, n, i)


def look_anew(f: Any, n: Any, i: int, but: int) -> int:
    """Predict ``i`` with all places near it, from nothing: how many touch it, ``but`` left out."""
    e = EVENTS * i + MEETS
    f[EVENT][e] = math.inf
    f[EVENT][e + 1] = 0.0
    n[PLACE][PLACES * i + PARTNER] = -1
    if not n[PLACE][PLACES * i + PRESENT]:
        return 0
    return look_around(f, n, i, 0, but)


def foresee(f: Any, n: Any, i: int, but_place: int, but_wall: int, now: tuple[float, float]) -> int:
    """All that happens to ``i``, whose flight is new: how many touch it, the two left out."""
    if n[COUNTS][CELLED]:
        wait_to_leave(f, n, i, now)
    touching = look_anew(f, n, i, but_place) + look_at_scenery(f, n, i, 0, but_wall)
    settle(f, n, i)
    return touching
