"""The event loop: one impact after another, each at its own instant, each place on its own clock.

Every place has one event: the earliest of its meetings with others, with fixed shapes, and of leaving its cell. A meeting is kept with the
number of changes that the partner had had; if the partner has changed since, the event is stale, and is looked for again when its turn comes.
What the loop cannot decide (laws that only Python can ask, several contacts at one instant, rest) it leaves as it is, and says so.

Source: M. Marin, D. Risso, P. Cordero, J. Comput. Phys. 109 (1993) 306 (one event a particle); B. Lubachevsky, J. Comput. Phys. 94 (1991)
255 (each on its own clock); overlaps: M. Bannerman et al., Comput. Part. Mech. 1 (2014) 191.
"""

from __future__ import annotations

import math
from typing import Any

from xpheve.kernels.vector import Vec, norm
from xpheve_laws_collision.impact.cells import put_in, step_over, take_out, wait_to_leave
from xpheve_laws_collision.impact.limits import TOUCH, ULPS, vector
from xpheve_laws_collision.impact.meetings import touch_of
from xpheve_laws_collision.impact.predict import foresee, look_anew, look_around, look_at_scenery, settle
from xpheve_laws_collision.impact.rows import (
    AT,
    BOX,
    BUDGET,
    BUSY,
    BUSY_AT,
    CELL,
    CELL_AT,
    CELLED,
    COUNT,
    COUNTS,
    CROSSINGS,
    DIRTIES,
    DIRTY,
    ENDLESS,
    EVENT,
    EVENTS,
    GIVEN,
    GRID,
    HEADS,
    HITS_HOW,
    JOB,
    KEYS,
    LEAVES,
    LIMIT,
    LIMITED,
    LINK,
    LINKS,
    LISTS,
    MASK,
    MASKS,
    MEETS,
    MEETS_HOW,
    MOST_AT_ONCE,
    NEXT,
    PARTNER,
    PAUSED,
    PLACE,
    PLACES,
    PRESENT,
    RADIUS,
    REST,
    RESTED,
    SAME_TIME,
    SCENERY,
    SCENES,
    SEEN,
    SHELVES,
    SKIP,
    SPACE,
    STALE,
    STAMP,
    STATE,
    STATES,
    TREE,
    WALL,
    WAY,
    WHO,
    WITH,
    WITH_SCENERY,
)
from xpheve_laws_collision.impact.since import beginning
from xpheve_laws_collision.impact.strike import stand, state_at, with_place, with_wall

RUN, LOOK, NEAR = 0, 1, 2
"""What the loop is called for: events up to a limit; predictions that are due; who touches a place."""


def entry(f: Any, n: Any) -> int:
    """Do the job: why it ended, see `xpheve_laws_collision.impact.rows`."""
    job = n[COUNTS][JOB]
    if job == NEAR:
        return touching(f, n, n[COUNTS][GIVEN])
    renew(f, n)
    if job == LOOK:
        return LIMITED
    return run(f, n)


def renew(f: Any, n: Any) -> int:
    """Predict the places that are new, or fly anew."""
    counts = n[COUNTS]
    place = n[PLACE]
    lists = n[LISTS]
    if counts[CELLED]:
        for k in range(counts[DIRTIES]):
            i = lists[k]
            take_out(n, i)
            if place[PLACES * i + PRESENT]:
                put_in(f, n, i, beginning(f, i))
    for k in range(counts[DIRTIES]):
        i = lists[k]
        place[PLACES * i + DIRTY] = 0
        n[LINK][LINKS * i + STAMP] += 1
        foresee(f, n, i, -1, -1, beginning(f, i))
    counts[DIRTIES] = 0
    return 0


def run(f: Any, n: Any) -> int:
    """Let events happen until the limit, or until there is one for others."""
    key = f[KEYS]
    event = f[EVENT]
    place = n[PLACE]
    counts = n[COUNTS]
    tree = n[TREE]
    limit = f[SPACE][LIMIT]
    limit_low = f[SPACE][LIMIT + 1]
    left = counts[BUDGET]
    while True:
        i = tree[1]
        high = key[2 * i]
        low = key[2 * i + 1]
        if high > limit or (high == limit and low >= limit_low) or high == math.inf:
            return LIMITED
        if left == 0:
            return PAUSED
        left -= 1
        e = EVENTS * i
        p = PLACES * i
        if event[e + LEAVES] == high and event[e + LEAVES + 1] == low:
            counts[CROSSINGS] += 1
            way = place[p + WAY]
            step_over(f, n, i)
            wait_to_leave(f, n, i, (high, low))
            look_around(f, n, i, way, -1)
            look_at_scenery(f, n, i, way, -1)
            settle(f, n, i)
            continue
        meets = event[e + MEETS] == high and event[e + MEETS + 1] == low
        if meets and place[p + SEEN] != n[LINK][LINKS * place[p + PARTNER] + STAMP]:
            counts[STALE] += 1
            look_anew(f, n, i, -1)
            settle(f, n, i)
            continue
        counts[WHO] = i
        counts[WITH] = place[p + PARTNER] if meets else place[p + WALL]
        counts[WITH_SCENERY] = 0 if meets else 1
        reason = LIMITED
        if is_busy(f, n, high, low):
            reason = BUSY
        elif (place[p + MEETS_HOW] if meets else place[p + HITS_HOW]) == REST:
            reason = RESTED
        elif meets:
            reason = with_place(f, n, i, (high, low))
        else:
            reason = with_wall(f, n, i, (high, low))
        if reason != LIMITED:
            f[SPACE][AT] = high
            f[SPACE][AT + 1] = low
            return reason


def is_busy(f: Any, n: Any, high: float, low: float) -> bool:
    """Count the impacts of one instant: whether they have become too many to end."""
    space = f[SPACE]
    counts = n[COUNTS]
    if space[BUSY_AT] == high and space[BUSY_AT + 1] == low:
        counts[SAME_TIME] += 1
        too_many: bool = counts[SAME_TIME] > counts[MOST_AT_ONCE]
        return too_many
    space[BUSY_AT] = high
    space[BUSY_AT + 1] = low
    counts[SAME_TIME] = 1
    return False


def touching(f: Any, n: Any, i: int) -> int:
    """Write down who touches place ``i`` at the instant `AT`: places, and fixed shapes as -1 less their row. How many they are."""
    counts = n[COUNTS]
    p = PLACES * i
    found = 0
    if counts[CELLED] and counts[DIRTIES] == 0 and n[PLACE][p + CELL] >= 0:
        place = n[PLACE]
        nx, ny, nz = counts[GRID], counts[GRID + 1], counts[GRID + 2]
        x, y, z = place[p + CELL_AT] % nx, place[p + CELL_AT + 1] % ny, place[p + CELL_AT + 2] % nz
        first, last = each_once(nx)
        first_y, last_y = each_once(ny)
        first_z, last_z = each_once(nz)
        for at_x in range(x + first, x + last + 1):
            for at_y in range(y + first_y, y + last_y + 1):
                for at_z in range(z + first_z, z + last_z + 1):
                    j = n[HEADS][((at_x % nx) * ny + at_y % ny) * nz + at_z % nz]
                    while j >= 0:
                        found = touching_place(f, n, i, j, found)
                        j = n[LINK][LINKS * j + NEXT]
        at = counts[ENDLESS] + place[p + CELL]
        for k in range(n[SHELVES][at], n[SHELVES][at + 1]):
            found = touching_row(f, n, i, n[SHELVES][k], found)
        for k in range(counts[ENDLESS]):
            found = touching_row(f, n, i, n[SHELVES][k], found)
        return found
    for j in range(counts[COUNT]):
        found = touching_place(f, n, i, j, found)
    for row in range(counts[SCENES]):
        found = touching_row(f, n, i, row, found)
    return found


def each_once(size: int) -> tuple[int, int]:
    """The first and last neighbour along an axis of ``size`` cells, none twice: images are told apart by the shortest way."""
    return (-1, 1) if size > 2 else (0, size - 1)


def touching_place(f: Any, n: Any, i: int, j: int, found: int) -> int:
    """Write ``j`` down as the next of ``found``, if it touches ``i``: how many there are then."""
    if j == i or n[LINK][LINKS * j + MASK] & n[LINK][LINKS * i + MASK] == 0:
        return found
    space = f[SPACE]
    now = (space[AT], space[AT + 1])
    x = state_at(f, i, now)[0]
    y = state_at(f, j, now)[0]
    distance = f[STATE][STATES * i + RADIUS] + f[STATE][STATES * j + RADIUS]
    d = nearest((y[0] - x[0], y[1] - x[1], y[2] - x[2]), vector(space, BOX))
    if abs(norm(d) - distance) <= TOUCH * distance + ULPS * (norm(x) + norm(y)):
        n[LISTS][2 * n[COUNTS][COUNT] + found] = j
        return found + 1
    return found


def touching_row(f: Any, n: Any, i: int, row: int, found: int) -> int:
    """The same of a fixed shape."""
    if row == n[PLACE][PLACES * i + SKIP] or n[MASKS][2 * row] & n[LINK][LINKS * i + MASK] == 0:
        return found
    x, v, pull = state_at(f, i, (f[SPACE][AT], f[SPACE][AT + 1]))
    radius = f[STATE][STATES * i + RADIUS]
    gap = stand(f[SCENERY], row, x, v, pull, radius)[0]
    if abs(gap) <= touch_of(f[SCENERY], row, x, radius):
        n[LISTS][2 * n[COUNTS][COUNT] + found] = -1 - row
        return found + 1
    return found


def nearest(d: Vec, box: Vec) -> Vec:
    """The shortest of the images of an offset."""
    return (nearest_along(d[0], box[0]), nearest_along(d[1], box[1]), nearest_along(d[2], box[2]))


def nearest_along(d: float, length: float) -> float:
    """The same along an axis; a length of 0 is no period."""
    if length == 0.0:
        return d
    return d - math.floor(d / length + 0.5) * length
