"""Cells: lists of the places near each other, on a grid that repeats; and when a place leaves its cell.

Space is cut into cells no narrower than the greatest diameter, so that only places in neighbouring cells can touch. The grid has a limited
number of lists: cells a whole number of grids apart share one. In an open space that is no more than a hash: a pair that is not near is
predicted in vain. In a periodic box the grid is the box, and the number of box lengths between the two images is known from the cells.
Cells may move like the mean flight. When a place leaves its cell is no part of its motion: no bit of a flight depends on it.

Source: cells with one list each, M. Allen, D. Tildesley, Computer Simulation of Liquids (1987), 5.3.2.
"""

from __future__ import annotations

import math
from typing import Any

from xpheve.kernels.clock import later
from xpheve.kernels.vector import Vec
from xpheve_laws_collision.impact.limits import vector
from xpheve_laws_collision.impact.meetings import moved, sped
from xpheve_laws_collision.impact.rows import (
    BEFORE,
    BOX,
    CELL,
    CELL_AT,
    COUNTS,
    EVENT,
    EVENTS,
    FOLDED,
    FRAME,
    FRAME_TIME,
    GRID,
    HEADS,
    LEAVES,
    LINK,
    LINKS,
    NEXT,
    PERIODIC,
    PLACE,
    PLACES,
    PULL,
    SPACE,
    STATE,
    STATES,
    TIME,
    WAY,
    WIDTH,
    WRAPS,
    V,
    X,
)

BELOW_ONE = 1.0 - 2.0**-53
FARTHEST = 1e15  # cells; beyond, places have no cell of their own


def closing_time(gap: float, speed: float, pull: float) -> float:
    """When gap + speed t + pull t^2 / 2 falls to 0, or goes on falling below; infinite if it does not."""
    if gap <= 0.0:
        if speed < 0.0 or (speed == 0.0 and pull < 0.0):
            return 0.0
        if speed > 0.0 and pull < 0.0:
            return (speed + math.sqrt(max(speed * speed - 2.0 * pull * gap, 0.0))) / -pull
        return math.inf
    if pull < 0.0:
        root = math.sqrt(speed * speed - 2.0 * pull * gap)
        return 2.0 * gap / (root - speed) if speed < 0.0 else (speed + root) / -pull
    if speed < 0.0:
        inside = speed * speed - 2.0 * pull * gap
        if inside >= 0.0:
            return 2.0 * gap / (math.sqrt(inside) - speed)
    return math.inf


def seen_from_cells(f: Any, i: int, now: tuple[float, float]) -> tuple[Vec, Vec, Vec]:
    """Place, velocity and acceleration of ``i`` as the cells see it ``now``."""
    state = f[STATE]
    space = f[SPACE]
    a = STATES * i
    s = (now[0] - state[a + TIME]) + (now[1] - state[a + TIME + 1])
    pull = vector(state, a + PULL)
    v = vector(state, a + V)
    x = moved(vector(state, a + X), v, pull, s)
    v = sped(v, pull, s)
    s = (now[0] - space[FRAME_TIME]) + (now[1] - space[FRAME_TIME + 1])
    own_pull = vector(space, FRAME + 6)
    own_v = vector(space, FRAME + 3)
    own_x = moved(vector(space, FRAME), own_v, own_pull, s)
    own_v = sped(own_v, own_pull, s)
    return (
        (x[0] - own_x[0], x[1] - own_x[1], x[2] - own_x[2]),
        (v[0] - own_v[0], v[1] - own_v[1], v[2] - own_v[2]),
        (pull[0] - own_pull[0], pull[1] - own_pull[1], pull[2] - own_pull[2]),
    )


def put_in(f: Any, n: Any, i: int, now: tuple[float, float]) -> int:
    """Put ``i`` into the cell where it is ``now``."""
    place = n[PLACE]
    p = PLACES * i
    x = seen_from_cells(f, i, now)[0]
    width = f[SPACE]
    for c in range(3):
        at = x[c] / width[WIDTH + c]
        place[p + CELL_AT + c] = math.floor(at) if abs(at) < FARTHEST else 0
    return link(f, n, i)


def link(f: Any, n: Any, i: int) -> int:
    """Put ``i`` into the list of its cell."""
    place = n[PLACE]
    counts = n[COUNTS]
    p = PLACES * i
    w = STATES * i + WRAPS
    state = f[STATE]
    for c in range(3):
        size = counts[GRID + c]
        at = place[p + CELL_AT + c]
        folded = at % size
        place[p + FOLDED + c] = folded
        state[w + c] = float((at - folded) // size) if counts[PERIODIC + c] else 0.0
    return enter(n, i)


def enter(n: Any, i: int) -> int:
    """Put ``i`` into the list of its folded cell."""
    place = n[PLACE]
    counts = n[COUNTS]
    heads = n[HEADS]
    links = n[LINK]
    p = PLACES * i
    cell = (place[p + FOLDED] * counts[GRID + 1] + place[p + FOLDED + 1]) * counts[GRID + 2] + place[p + FOLDED + 2]
    first = heads[cell]
    place[p + CELL] = cell
    links[LINKS * i + BEFORE] = -1
    links[LINKS * i + NEXT] = first
    if first >= 0:
        links[LINKS * first + BEFORE] = i
    heads[cell] = i
    return 0


def take_out(n: Any, i: int) -> int:
    """Take ``i`` out of the list it is in."""
    place = n[PLACE]
    p = PLACES * i
    cell = place[p + CELL]
    if cell < 0:
        return 0
    after = n[LINK][LINKS * i + NEXT]
    before = n[LINK][LINKS * i + BEFORE]
    if before >= 0:
        n[LINK][LINKS * before + NEXT] = after
    else:
        n[HEADS][cell] = after
    if after >= 0:
        n[LINK][LINKS * after + BEFORE] = before
    place[p + CELL] = -1
    return 1


def wait_to_leave(f: Any, n: Any, i: int, now: tuple[float, float]) -> int:
    """Note when ``i`` leaves its cell, and which way: 1 to 3 upwards along an axis, -1 to -3 downwards."""
    place = n[PLACE]
    event = f[EVENT]
    p = PLACES * i
    x, v, pull = seen_from_cells(f, i, now)
    width = vector(f[SPACE], WIDTH)
    best = math.inf
    way = 0
    for c in range(3):
        if not abs(x[c]) < FARTHEST * width[c]:
            continue
        inside = x[c] - place[p + CELL_AT + c] * width[c]
        if pull[c] == 0.0:
            gap = width[c] - inside if v[c] > 0.0 else inside
            if v[c] != 0.0 and gap < best * abs(v[c]):
                best = max(gap, 0.0) / abs(v[c])
                way = c + 1 if v[c] > 0.0 else -c - 1
            continue
        up = closing_time(width[c] - inside, 0.0 - v[c], 0.0 - pull[c])
        if up < best:
            best = up
            way = c + 1
        down = closing_time(inside, v[c], pull[c])
        if down < best:
            best = down
            way = -c - 1
    place[p + WAY] = way
    e = EVENTS * i + LEAVES
    if way == 0:
        event[e] = math.inf
        event[e + 1] = 0.0
        return 0
    high, low = later(now, best)
    event[e] = high
    event[e + 1] = low
    return 1


def step_over(f: Any, n: Any, i: int) -> int:
    """Move ``i`` into the cell that it enters."""
    place = n[PLACE]
    p = PLACES * i
    way = place[p + WAY]
    take_out(n, i)
    c = abs(way) - 1
    one = 1 if way > 0 else -1
    size = n[COUNTS][GRID + c]
    at = place[p + FOLDED + c] + one
    place[p + CELL_AT + c] += one
    if at < 0 or at >= size:  # into another box, or another turn of the grid
        at -= one * size
        if n[COUNTS][PERIODIC + c]:
            f[STATE][STATES * i + WRAPS + c] += one
    place[p + FOLDED + c] = at
    return enter(n, i)


def begin_again(f: Any, n: Any, i: int) -> int:
    """The flight of ``i`` begins inside the periodic box: shift it by the box lengths that its position is beyond it."""
    state = f[STATE]
    space = f[SPACE]
    place = n[PLACE]
    counts = n[COUNTS]
    a = STATES * i
    for c in range(3):
        if counts[PERIODIC + c]:
            length = space[BOX + c]
            k = math.floor(state[a + X + c] / length)
            if k != 0:
                state[a + X + c] -= k * length
                if not state[a + X + c] < length:  # what lies less than a rounding below 0
                    state[a + X + c] = length * BELOW_ONE
                place[PLACES * i + CELL_AT + c] -= k * counts[GRID + c]
                state[a + WRAPS + c] -= k
    return 0
