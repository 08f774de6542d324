"""Gauss-Radau 15: steps of any length that are right to the last digits, for smooth forces of any kind.

Over a step from t0, of length dt, the acceleration is the polynomial of degree 7 that agrees with the forces at eight nodes t0 + h_n dt; places
and velocities are its integrals (`xpheve.kernels.radau`). What forces there are depends on the places, so both are found in passes: each goes
through the nodes in order, and takes every new force into account at once. The first pass begins with the last step's polynomial, continued, and
corrected by as much as the last continuation was wrong. Places, velocities, work and time are sums that keep their remainders.

Source: E. Everhart, in: Dynamics of Comets (1985), 185; H. Rein and D. S. Spiegel, MNRAS 446 (2015) 1424 (passes to the last digit, compensated
sums); D. Pham, H. Rein and D. S. Spiegel, OJAp 7 (2024) (length of a step from the derivatives at its end).

The numbers ``s``: `HEAD` numbers named below; then places, velocities, accelerations (padded to whole tiles), forces without potential at sixteen
nodes (3 N each), work, its remainder, the power's series and the present step's work (`WORKS` N in all); then tiles of `LANES` coordinates, each with
`SIZE` numbers, and tiles of `CURVE` numbers. Coordinate c of row i is number c * N + i. What ``s`` holds of a step is its beginning and the
accelerations along it: the state at its end is put together when the next begins.
"""

import math

from xpheve.kernels.ieee import sqrt
from xpheve.kernels.radau import (
    ARMS,
    ARMS_REST,
    BEND,
    END,
    GAINS,
    GAINS_REST,
    SLOPE,
    TWIST,
    values,
)
from xpheve.loop.drivers.motion import Buffers, forces

# Whole numbers: d[0] evaluations, d[1] evaluations after which to stop, d[8...] as follows.
STEPS, REFUSED, PASSES, TURNING, SPEEDY, WORKING, MOST = 8, 9, 10, 11, 12, 13, 14
"""Steps, refused steps, passes so far; whether rows turn, forces depend on velocities, work is kept; steps of this call at most (0: any)."""
WORST = 15
"""The row that made the last step as short as it is, or that failed."""

T, T_REST, SPAN, NEXT, NEED, NEED_REST, WALL, WALL_REST = 0, 1, 2, 3, 4, 5, 6, 7
"""When the present step began, and its length, 0 if there is none; the length wished for the next; until when to go, and never further [s]."""
RTOL, ATOL, PACE, FIXED, LEAST = 8, 9, 10, 11, 12
"""Tolerances; length of a step by the time in which forces change, at the limit of rounding; a length for all steps, or 0; the least, by the time."""
AHEAD, LIMIT, LIMIT_REST, KNOWN = 13, 14, 15, 16
"""How far the wall was from the beginning of the present step, and the wall: a step of that length ends there to the last digit; and until when
forces are known."""
NODE, PLACE, SPEED, EXTRA, EXTRA_PLACE, EXTRA_SPEED, SERIES, FORETOLD, SHARE = 32, 40, 104, 168, 176, 240, 304, 560, 624
"""Where the tables of `xpheve.kernels.radau` lie: nodes; weights of places and of speeds, 8 numbers a node; the same of extra nodes; coefficients of
series, 16 numbers a polynomial. What is found for one step: what f_1 to f_7 weigh in the forces of the next, 8 numbers a node. At last what nodes
weigh in the whole."""
HEAD = 632

LANES = 8
X, X_REST, V, V_REST, A, F1, F2, F3, F4, F5, F6, F7 = 0, 8, 16, 24, 32, 40, 48, 56, 64, 72, 80, 88
"""In a tile: place and velocity at the beginning, with what rounding left of them; acceleration there; what is added to it at the nodes."""
P1, P2, P3, P4, P5, P6, P7 = 96, 104, 112, 120, 128, 136, 144
"""What was foretold of F1 to F7."""
Y0, Y1, Y2, Y3 = 152, 160, 168, 176
"""What has to be summed over a row's coordinates."""
OWED = 184
"""By how much places were rounded so far, each by its share in the step."""
CARRY = 192
"""What the last step has left owed, by its length."""
Q1, Q2, Q3, Q4, Q5, Q6, Q7 = 200, 208, 216, 224, 232, 240, 248
"""What is foretold of the next step."""
SIZE = 256
WORKS = 67
"""Numbers for each row between accelerations and tiles: forces without potential at the nodes and at `EXTRA` ones, work, its remainder, 
16 coefficients of its power, and what the present step adds."""
E1, E8 = 128, 184
"""In the tiles behind, of `CURVE` numbers, after 16 coefficients of the acceleration as a series of Legendre polynomials: what is added to it at the
extra nodes."""
CURVE = 192

REACHED, PAUSED, NOT_FINITE, TOO_SHORT, UNKNOWN = 0, 1, 2, 3, 4
"""What `entry` answers."""

CLOSE = 1e-18
"""Passes end when the next would change accelerations by less than this part: far less than rounding does, or than tolerances allow."""
CLOSE_ENOUGH = 1e-5
"""The same, by the relative tolerance."""
STALLED = 0.25
"""Passes that shrink changes by less than this have met rounding, or diverge."""
MOST_PASSES = 12
ROUGH = 1e-9
"""Relative changes that cannot be rounding's."""
FLAW = 3e-14
"""Relative error of a velocity's change over a step of the length `PACE` asks for, as tolerances count it: from rtol = 1e-13 on
little is left to gain. True errors are a thousand times less, and grow with the 16th power of the length."""
SLIGHT = 0.01
"""An acceleration that does less than this part of what tolerances allow, in a whole step, makes no step shorter: where forces balance, it is
nothing but their rounding, which changes as soon as one looks."""
LONGEST = 0.9
"""The longest step, by the time in which forces change: beyond, passes converge slowly."""
FAINT = 1e-3
"""Of the relative tolerance: a row whose forces do less than this, all that is foretold of them included, asks for no step: else one
that passes a place where forces vanish with all their derivatives but a high one, as those of x^3 do, would be followed in ever shorter steps."""
FIRST = 0.01
"""The first step, by a guess of the time in which forces change: it is found too short, or done again, soon enough."""
GROWTH = 4.0
"""Of a step over the last at most."""
REFUSE = 0.5
"""A step after which one of this part would have been right is done again."""
FORGIVE = 0.25
"""What the last step has left owed is forgiven in one shorter than this part of it."""
SHRINK = 0.125
"""Of a step that failed."""
BENT = 1e-8
"""Of a row's acceleration: more the polynomial misses at the end of a step only if forces are not smooth, at the limit of rounding; with the root of
the tolerance, as steps grow with its 16th root, and what it misses with their eighth power."""
SEEN = 1e-11
"""Of a place or velocity: a miss that does less cannot be told from rounding."""
IDLE = 0.1
"""Of the tolerances: what forces change by less over a step is too little to make steps shorter. At rest it is rounding, at any length."""


def entry(f: Buffers, n: Buffers) -> int:
    """Make steps until ``s[NEED]`` is reached, or a limit: one of `REACHED`, `PAUSED`, `NOT_FINITE`, `TOO_SHORT`, `UNKNOWN`."""
    s = f[0]
    d = n[2]
    steps = d[STEPS]
    answer = REACHED
    while answer == REACHED and not is_covered(s):
        if d[0] >= d[1] or (d[MOST] > 0 and d[STEPS] - steps >= d[MOST]):
            answer = PAUSED
        elif goes_beyond(s):
            answer = UNKNOWN
        else:
            answer = step(f, n)
            if (
                answer == REACHED and end(s)[0] >= s[WALL]
            ):  # to the float: what the length of a step cannot hold is no step of its own
                answer = PAUSED
    if d[STEPS] > steps and s[SPAN] > 0.0:
        fill_in(f, n)
    return answer


def is_covered(s: Buffers) -> bool:
    """Whether the present step ends at or after ``s[NEED]``."""
    t, rest = end(s)
    covered: bool = t > s[NEED] or (t == s[NEED] and rest >= s[NEED_REST])
    return covered


def goes_beyond(s: Buffers) -> bool:
    """Whether the next step may lead to where forces are not known."""
    beyond: bool = s[T] + (s[SPAN] + s[NEXT]) > s[KNOWN]
    return beyond


def end(s: Buffers) -> tuple[float, float]:
    """When the present step ends; as `xpheve.kernels.clock.later` has it, but for steps up to a wall."""
    if s[SPAN] > 0.0 and s[SPAN] == s[AHEAD]:
        return s[LIMIT], s[LIMIT_REST]
    t, low = two_sum(s[T], s[SPAN])
    return two_sum(t, low + s[T_REST])


def two_sum(a: float, b: float) -> tuple[float, float]:
    """The sum, and what rounding lost of it (Knuth, TAOCP 2, 4.2.2)."""
    t = a + b
    e = t - a
    return t, (a - (t - e)) + (b - e)


def step(f: Buffers, n: Buffers) -> int:
    """End the present step, and make the next: 0, or why there is none."""
    s = f[0]
    d = n[2]
    rows = n[0][1]
    moving = n[0][2]
    tiles, x, v, a, w, z = places_in(d, rows)
    before = s[SPAN]
    last = before
    if last > 0.0:
        conclude(s, d, tiles, w, z, rows, moving)
    begin(s, z, tiles, x, v)
    forces(f, n, x, v, a, w, s[T])
    d[0] += 1
    first(s, z, tiles, a)
    if not s[NEXT] > 0.0:
        s[NEXT] = guess(s, d, z, rows, moving)
        if goes_beyond(s):
            return UNKNOWN
    dt = wanted(s)
    failed = TOO_SHORT
    while True:
        if not dt > s[LEAST] * abs(s[T]) or not dt > 1e-250:
            s[NEXT] = 0.0
            return failed
        if last > 0.0:
            foretell(s, z, tiles, dt / last)
        else:
            forget(s, z, tiles)
        rough = passes(f, n, z, tiles, x, v, a, w, dt, 1.0 / dt if dt > FORGIVE * before else 0.0)
        if rough < 1.0:
            failed = TOO_SHORT
            if s[FIXED] > 0.0:
                break
            best = dt * measure(s, d, z, tiles, rows, moving, dt)
            if best >= REFUSE * dt and is_smooth(f, n, z, tiles, x, v, a, w, dt):
                s[NEXT] = min(best, GROWTH * dt)
                break
            best = SHRINK * dt if best >= REFUSE * dt else max(best, 0.01 * dt)
        else:
            failed = TOO_SHORT if rough < math.inf else NOT_FINITE
            best = SHRINK * dt
        d[REFUSED] += 1
        if s[FIXED] > 0.0:
            return failed
        last = 0.0
        dt = best
    if d[WORKING]:
        find_work(s, w, z, rows, moving, dt)
    s[SPAN] = dt
    d[STEPS] += 1
    return 0


def places_in(d: Buffers, rows: int) -> tuple[int, int, int, int, int, int]:
    """How many tiles there are; where places, velocities, accelerations, forces without potential, and tiles begin."""
    tiles = ((7 if d[TURNING] else 3) * rows + LANES - 1) // LANES
    pad = LANES * tiles
    w = HEAD + 3 * pad
    return tiles, HEAD, HEAD + pad, HEAD + 2 * pad, w, w + WORKS * rows


def conclude(s: Buffers, d: Buffers, tiles: int, w: int, z: int, rows: int, moving: int) -> None:
    """Go to the end of the present step."""
    dt = s[SPAN]
    if d[WORKING]:
        book_work(s, w + 48 * rows, rows, moving)
    finish(s, z, tiles, dt)
    if d[TURNING]:
        straighten(s, z, rows, moving)
    s[T], s[T_REST] = end(s)
    s[SPAN] = 0.0


def wanted(s: Buffers) -> float:
    """How long a step to try: as wished, but not past the wall; without a stump before it."""
    wish: float = s[FIXED] if s[FIXED] > 0.0 else s[NEXT]
    s[AHEAD] = 0.0
    if s[WALL] == math.inf:
        return wish
    t, low = two_sum(s[WALL], -s[T])
    left: float = t + (low + (s[WALL_REST] - s[T_REST]))
    s[AHEAD], s[LIMIT], s[LIMIT_REST] = left, s[WALL], s[WALL_REST]
    if wish >= left:
        return left
    if s[FIXED] > 0.0 or 2.0 * wish <= left:
        return wish
    return 0.5 * left


# One step ------------------------------------------------------------------------------------------------------------


def begin(s: Buffers, z: int, tiles: int, x: int, v: int) -> None:
    """Put places and velocities at the beginning where ``forces`` reads them."""
    for k in range(tiles):
        for u in range(LANES):
            i = z + k * SIZE + u
            s[x + k * LANES + u] = s[i + X]
            s[v + k * LANES + u] = s[i + V]


def first(s: Buffers, z: int, tiles: int, a: int) -> None:
    """Take the accelerations at the beginning."""
    for k in range(tiles):
        for u in range(LANES):
            s[z + k * SIZE + u + A] = s[a + k * LANES + u]


def forget(s: Buffers, z: int, tiles: int) -> None:
    """Foretell that forces stay as they are."""
    for k in range(tiles):
        for u in range(7 * LANES):
            i = z + k * SIZE + u
            s[i + F1] = 0.0
            s[i + P1] = 0.0


def foretell(s: Buffers, z: int, tiles: int, q: float) -> None:
    """Continue the last step's polynomial over one that is ``q`` times as long, and put right what was wrong with the last continuation."""
    for node in range(1, 8):
        w = values(1.0 + q * s[NODE + node])
        at = FORETOLD + 8 * node
        s[at], s[at + 1], s[at + 2], s[at + 3] = w[0] - END[0], w[1] - END[1], w[2] - END[2], w[3] - END[3]
        s[at + 4], s[at + 5], s[at + 6] = w[4] - END[4], w[5] - END[5], w[6] - END[6]
    for node in range(1, 8):
        foretell_node(s, z, tiles, FORETOLD + 8 * node, LANES * (node - 1))
    for k in range(tiles):
        for u in range(7 * LANES):
            i = z + k * SIZE + u
            q = s[i + Q1]
            s[i + F1] = q + (s[i + F1] - s[i + P1])
            s[i + P1] = q


def foretell_node(s: Buffers, z: int, tiles: int, w: int, slot: int) -> None:
    """What the continued polynomial has at one node of the next step."""
    c1, c2, c3, c4, c5, c6, c7 = seven(s, w)
    for k in range(tiles):
        for u in range(LANES):
            i = z + k * SIZE + u
            s[i + slot + Q1] = blend(s, i, c1, c2, c3, c4, c5, c6, c7)


def passes(f: Buffers, n: Buffers, z: int, tiles: int, x: int, v: int, a: int, w: int, dt: float, owed: float) -> float:
    """Find the forces at the nodes: 0 if they agree with the places, 1 if they do not, infinity if one is not finite."""
    s = f[0]
    d = n[2]
    rows = n[0][1]
    before = 0.0
    expected = 1.0
    for count in range(MOST_PASSES):
        owe(s, z, tiles, owed)
        for node in range(1, 8):
            h = s[NODE + node] * dt
            put_places(s, z, tiles, x, h, PLACE + 8 * node, s[SHARE + node])
            if d[SPEEDY]:
                put_speeds(s, z, tiles, v, h, SPEED + 8 * node)
            forces(f, n, x, v, a, w + 3 * rows * node, s[T] + (s[T_REST] + h))
            if node < 7:
                take(s, z, tiles, a, LANES * (node - 1))
        take_last(s, z, tiles, a)
        d[0] += 7
        d[PASSES] += 1
        change, matters = changes(s, d, z, rows, n[0][2], dt)
        if not change < math.inf:
            return math.inf
        if count > 0:
            expected = change / before if before > 0.0 else 0.0
        if change * expected <= max(CLOSE, CLOSE_ENOUGH * s[RTOL]):
            return 0.0
        if count > 1 and expected > STALLED:
            return matters
        before = change
    return matters


def seven(s: Buffers, w: int) -> tuple[float, float, float, float, float, float, float]:
    """Seven weights of a table."""
    return s[w], s[w + 1], s[w + 2], s[w + 3], s[w + 4], s[w + 5], s[w + 6]


def blend(s: Buffers, i: int, c1: float, c2: float, c3: float, c4: float, c5: float, c6: float, c7: float) -> float:
    """The sum of f_1 to f_7 by these weights, for the coordinate at ``i``."""
    early: float = (c1 * s[i + F1] + c2 * s[i + F2]) + (c3 * s[i + F3] + c4 * s[i + F4])
    late: float = (c5 * s[i + F5] + c6 * s[i + F6]) + c7 * s[i + F7]
    return early + late


def weighed(s: Buffers, i: int, w: tuple[float, ...]) -> float:
    """The same, for weights of the method."""
    return blend(s, i, w[0], w[1], w[2], w[3], w[4], w[5], w[6])


def owe(s: Buffers, z: int, tiles: int, by: float) -> None:
    """What rounding has done to the place at the beginning, by the share of the acceleration there; and what was left owed, ``by`` 1 / dt."""
    for k in range(tiles):
        for u in range(LANES):
            i = z + k * SIZE + u
            s[i + OWED] = s[SHARE] * s[i + X_REST] + by * s[i + CARRY]


def put_places(s: Buffers, z: int, tiles: int, x: int, h: float, w: int, share: float) -> None:
    """Places ``h`` [s] after the beginning, at the node with weights ``w``, whose acceleration has the ``share`` in the whole step's.

    A place with a share is rounded so that what rounding has done to the places of a step, each by its share, cancels: then it hardly
    changes the velocity at the end, however steep the forces are.
    """
    c1, c2, c3, c4, c5, c6, c7 = seven(s, w)
    inverse = 1.0 / share if share > 0.0 else 0.0
    for k in range(tiles):
        for u in range(LANES):
            i = z + k * SIZE + u
            f = blend(s, i, c1, c2, c3, c4, c5, c6, c7)
            place, lost = two_sum(s[i + X], s[i + X_REST] + h * (s[i + V] + h * (0.5 * s[i + A] + f)))
            owed = s[i + OWED]
            put = place + (lost + owed * inverse)
            s[i + OWED] = owed + share * ((place - put) + lost)
            s[x + k * LANES + u] = put


def put_speeds(s: Buffers, z: int, tiles: int, v: int, h: float, w: int) -> None:
    """Velocities ``h`` [s] after the beginning, at the node with weights ``w``."""
    c1, c2, c3, c4, c5, c6, c7 = seven(s, w)
    for k in range(tiles):
        for u in range(LANES):
            i = z + k * SIZE + u
            f = blend(s, i, c1, c2, c3, c4, c5, c6, c7)
            s[v + k * LANES + u] = s[i + V] + (s[i + V_REST] + h * (s[i + A] + f))


def take(s: Buffers, z: int, tiles: int, a: int, slot: int) -> None:
    """Take the accelerations at a node."""
    for k in range(tiles):
        for u in range(LANES):
            i = z + k * SIZE + u
            s[i + F1 + slot] = s[a + k * LANES + u] - s[i + A]


def take_last(s: Buffers, z: int, tiles: int, a: int) -> None:
    """Take the accelerations at the last node, and how they have changed since the last pass."""
    for k in range(tiles):
        for u in range(LANES):
            i = z + k * SIZE + u
            new = s[a + k * LANES + u] - s[i + A]
            s[i + Y0] = new - s[i + F7]
            s[i + F7] = new


def changes(s: Buffers, d: Buffers, z: int, rows: int, moving: int, dt: float) -> tuple[float, float]:
    """By how much of itself a row's acceleration has changed in this pass, at worst; and 1 if that matters, else 0."""
    worst = 0.0
    matters = 0.0
    for part in range(2 if d[TURNING] else 1):
        begin = 3 * part
        last = 7 if part else 3
        for i in range(moving):
            change = 0.0
            size = 0.0
            place = 0.0
            for c in range(begin, last):
                j = lane(z, c * rows + i)
                change += abs(s[j + Y0])
                size += abs(s[j + A])
                place += abs(s[j + X])
            if not change < math.inf:
                return math.inf, 1.0
            if change > worst * size:
                worst = change / size if size > 0.0 else 1.0
                d[WORST] = i
            if change > ROUGH * size and change * dt * dt > 0.1 * (s[ATOL] + s[RTOL] * place):
                matters = 1.0
    return worst, matters


def lane(z: int, j: int) -> int:
    """Where the first number of coordinate ``j`` is."""
    return z + (j // LANES) * SIZE + j % LANES


# The end of a step ---------------------------------------------------------------------------------------------------


def finish(s: Buffers, z: int, tiles: int, dt: float) -> None:
    """Carry places and velocities to the end of the step; products that count are without loss (Dekker; Veltkamp's halves)."""
    dt_high, dt_low = halves(dt)
    for k in range(tiles):
        for u in range(LANES):
            i = z + k * SIZE + u
            v = s[i + V]
            a = s[i + A]
            s[i + CARRY] = s[i + OWED] * dt
            high, low = halves(v)
            arm = weighed(s, i, ARMS) + weighed(s, i, ARMS_REST)
            small = dt * (s[i + V_REST] + dt * (0.5 * a + arm)) + (high * dt_low + (low * dt_high + low * dt_low))
            t, rest = two_sum(s[i + X], high * dt_high)
            s[i + X], s[i + X_REST] = two_sum(t, rest + (small + s[i + X_REST]))
            mean, lost = two_sum(a, weighed(s, i, GAINS))
            lost += weighed(s, i, GAINS_REST)
            high, low = halves(mean)
            small = dt * lost + (high * dt_low + (low * dt_high + low * dt_low))
            t, rest = two_sum(v, high * dt_high)
            s[i + V], s[i + V_REST] = two_sum(t, rest + (small + s[i + V_REST]))


def halves(a: float) -> tuple[float, float]:
    """``a`` as two numbers of 26 bits."""
    c = 134217729.0 * a
    high = c - (c - a)
    return high, a - high


def straighten(s: Buffers, z: int, rows: int, moving: int) -> None:
    """Make orientations unit quaternions again, and their rates orthogonal to them; what is put right goes to the remainders."""
    for i in range(moving):
        a, b, c, e = lane(z, 3 * rows + i), lane(z, 4 * rows + i), lane(z, 5 * rows + i), lane(z, 6 * rows + i)
        over = 0.5 * (s[a + X] * s[a + X] + s[b + X] * s[b + X] + s[c + X] * s[c + X] + s[e + X] * s[e + X] - 1.0)
        along = s[a + X] * s[a + V] + s[b + X] * s[b + V] + s[c + X] * s[c + V] + s[e + X] * s[e + V]
        put_right(s, a, over, along)
        put_right(s, b, over, along)
        put_right(s, c, over, along)
        put_right(s, e, over, along)


def put_right(s: Buffers, i: int, over: float, along: float) -> None:
    """Take from one component of an orientation what makes it too long, and from its rate what lies along it."""
    q = s[i + X]
    s[i + X], s[i + X_REST] = two_sum(q, s[i + X_REST] - over * q)
    s[i + V], s[i + V_REST] = two_sum(s[i + V], s[i + V_REST] - along * q)


def find_work(s: Buffers, w: int, z: int, rows: int, moving: int, dt: float) -> None:
    """The work of forces without potential over the step: the integral of force by velocity, by the same nodes."""
    for i in range(moving):
        total = 0.0
        for node in range(8):
            power = 0.0
            for c in range(3):
                j = lane(z, c * rows + i)
                power += s[w + (3 * node + c) * rows + i] * speed(s, j, s[NODE + node] * dt, SPEED + 8 * node)
            total += s[SHARE + node] * power
        s[w + 66 * rows + i] = dt * total


def book_work(s: Buffers, work: int, rows: int, moving: int) -> None:
    """Add the work of the present step."""
    for i in range(moving):
        s[work + i], s[work + rows + i] = two_sum(s[work + i], s[work + rows + i] + s[work + 18 * rows + i])


def speed(s: Buffers, i: int, h: float, w: int) -> float:
    """Velocity along one coordinate ``h`` [s] after the beginning."""
    c1, c2, c3, c4, c5, c6, c7 = seven(s, w)
    found: float = s[i + V] + h * (s[i + A] + blend(s, i, c1, c2, c3, c4, c5, c6, c7))
    return found


# Within a step ------------------------------------------------------------------------------------------------------


def fill_in(f: Buffers, n: Buffers) -> None:
    """Find the motion within the present step as well as at its end, as a series: the polynomial of a step is best at its end.

    Forces are found once more where the polynomial leads to between the nodes; sixteen of them make a series as good as the step. This is no
    part of the sequence of steps, nor counted: how often it is done depends on who looks.
    """
    s = f[0]
    d = n[2]
    rows = n[0][1]
    tiles, x, v, a, w, z = places_in(d, rows)
    curve = z + tiles * SIZE
    for k in range(8):
        h = s[EXTRA + k] * s[SPAN]
        put_places(s, z, tiles, x, h, EXTRA_PLACE + 8 * k, 0.0)
        if d[SPEEDY]:
            put_speeds(s, z, tiles, v, h, EXTRA_SPEED + 8 * k)
        now = s[T] + (s[T_REST] + h)
        if now >= s[WALL]:  # where a force jumps, what it is before counts
            now = s[WALL] - 2.0**-52 * abs(s[WALL])
        forces(f, n, x, v, a, w + 3 * rows * (8 + k), now)
        for j in range(tiles):
            for u in range(LANES):
                s[curve + j * CURVE + u + E1 + LANES * k] = s[a + j * LANES + u] - s[z + j * SIZE + u + A]
    for m in range(16):
        put_coefficient(s, z, curve, tiles, m)
    if d[WORKING]:
        fill_in_power(s, w, z, rows, n[0][2])


def put_coefficient(s: Buffers, z: int, curve: int, tiles: int, m: int) -> None:
    """The coefficient of polynomial ``m`` in the acceleration."""
    w = SERIES + 16 * m
    c1, c2, c3, c4, c5, c6, c7 = seven(s, w + 1)
    e1, e2, e3, e4, e5, e6, e7 = seven(s, w + 8)
    e8 = s[w + 15]
    whole = 1.0 if m == 0 else 0.0
    for k in range(tiles):
        for u in range(LANES):
            i = z + k * SIZE + u
            j = curve + k * CURVE + u
            f = blend(s, i, c1, c2, c3, c4, c5, c6, c7)
            f += blend(s, j + E1 - F1, e1, e2, e3, e4, e5, e6, e7) + e8 * s[j + E8]
            s[j + LANES * m] = f + whole * s[i + A]


def fill_in_power(s: Buffers, w: int, z: int, rows: int, moving: int) -> None:
    """The power of forces without potential within the step, as a series."""
    series = w + 50 * rows
    for i in range(moving):
        for m in range(16):
            s[series + m * rows + i] = 0.0
        for node in range(16):
            h = (s[NODE + node] if node < 8 else s[EXTRA + node - 8]) * s[SPAN]
            u = SPEED + 8 * node if node < 8 else EXTRA_SPEED + 8 * (node - 8)
            power = 0.0
            for c in range(3):
                power += s[w + (3 * node + c) * rows + i] * speed(s, lane(z, c * rows + i), h, u)
            for m in range(16):
                s[series + m * rows + i] += s[SERIES + 16 * m + node] * power


# The length of steps -------------------------------------------------------------------------------------------------


def guess(s: Buffers, d: Buffers, z: int, rows: int, moving: int) -> float:
    """A first step: short against the time in which accelerations change places or velocities by their own size."""
    least = math.inf
    for part in range(2 if d[TURNING] else 1):
        for i in range(moving):
            x = 0.0
            v = 0.0
            a = 0.0
            for c in range(3 * part, 7 if part else 3):
                j = lane(z, c * rows + i)
                x = max(x, abs(s[j + X]))
                v = max(v, abs(s[j + V]))
                a = max(a, abs(s[j + A]))
            if a > 0.0:
                time = max(v / a, sqrt(x / a))
                if 0.0 < time < least:
                    least = time
    return FIRST * least if least < math.inf else FIRST


def measure(s: Buffers, d: Buffers, z: int, tiles: int, rows: int, moving: int, dt: float) -> float:
    """How long the next step should be, by ``dt``: as the row needs whose forces change soonest, or as tolerances allow."""
    for k in range(tiles):
        for u in range(LANES):
            i = z + k * SIZE + u
            s[i + Y0] = s[i + A] + weighed(s, i, END)
            s[i + Y1] = weighed(s, i, SLOPE)
            s[i + Y2] = weighed(s, i, BEND)
            s[i + Y3] = weighed(s, i, TWIST)
    pace = s[PACE] * s[PACE]
    window = 1.0 / pace
    most = (LONGEST * LONGEST) / pace
    shortest = 1e16
    for part in range(2 if d[TURNING] else 1):
        first = 3 * part
        last = 7 if part else 3
        for i in range(moving):
            y0 = 0.0
            y1 = 0.0
            y2 = 0.0
            y3 = 0.0
            x = 0.0
            v = 0.0
            for c in range(first, last):
                j = lane(z, c * rows + i)
                y0 += s[j + Y0] * s[j + Y0]
                y1 += s[j + Y1] * s[j + Y1]
                y2 += s[j + Y2] * s[j + Y2]
                y3 += s[j + Y3] * s[j + Y3]
                x = max(x, abs(s[j + X]))
                v = max(v, abs(s[j + V]))
            room_v = s[ATOL] + s[RTOL] * v
            room_x = s[ATOL] + s[RTOL] * x
            whole = (sqrt(y0) + sqrt(y1)) * dt
            if whole < SLIGHT * room_v and whole * dt < SLIGHT * room_x:
                continue
            reach = sqrt(y0 + window * (y1 + window * (y2 + window * y3))) * dt
            if reach < FAINT * s[RTOL] * v and reach * dt < FAINT * s[RTOL] * x:
                continue
            size = y0
            y0 += window * y1
            y1 += window * y2
            y2 += window * y3
            rate = y1 + sqrt(y0 * y2)
            square = min(pace * 2.0 * y0 / rate, 1e16) if rate > 0.0 else 1e16
            flaw = FLAW * sqrt(size) * sqrt(square) * dt
            if flaw < room_v and flaw * sqrt(square) * dt < room_x:
                gain = min(room_v, room_x / (sqrt(square) * dt)) / flaw if flaw > 0.0 else 1e300
                square *= min(most, sqrt(sqrt(sqrt(gain))))
            if square < 1.0:
                bend = swing(s, z, first, last, rows, i) * dt
                if bend < IDLE * room_v and bend * dt < IDLE * room_x:
                    square = 1.0
            if square < shortest:
                shortest = square
                d[WORST] = i
    return sqrt(shortest)


def is_smooth(f: Buffers, n: Buffers, z: int, tiles: int, x: int, v: int, a: int, w: int, dt: float) -> bool:
    """Whether forces at the end of the step are what the polynomial through those at the nodes makes of them.

    Where a force has a bend or jumps within the step they are not, though nothing in the derivatives at the end need show it. Measured by the
    row's own acceleration, and by what it does to place and velocity; a smooth force is far below `BENT` at any tolerance.
    """
    s = f[0]
    d = n[2]
    rows = n[0][1]
    for k in range(tiles):
        for u in range(LANES):
            i = z + k * SIZE + u
            s[x + k * LANES + u] = s[i + X] + dt * (s[i + V] + dt * (0.5 * s[i + A] + weighed(s, i, ARMS)))
            s[v + k * LANES + u] = s[i + V] + dt * (s[i + A] + weighed(s, i, GAINS))
    now = s[T] + (s[T_REST] + dt)
    if now >= s[WALL]:  # where a force jumps, what it is before counts
        now = s[WALL] - 2.0**-52 * abs(s[WALL])
    forces(f, n, x, v, a, w + 24 * rows, now)
    d[0] += 1
    bent = BENT * sqrt(max(s[RTOL], 1e-13) * 1e13)
    for part in range(2 if d[TURNING] else 1):
        first = 3 * part
        last = 7 if part else 3
        for i in range(n[0][2]):
            gap = 0.0
            here = 0.0
            place = 0.0
            pace = 0.0
            for c in range(first, last):
                j = lane(z, c * rows + i)
                off = s[a + c * rows + i] - s[j + Y0]
                gap += off * off
                here += s[j + A] * s[j + A]
                place = max(place, abs(s[j + X]))
                pace = max(pace, abs(s[j + V]))
            gap = sqrt(gap)
            if gap > bent * (sqrt(here) + swing(s, z, first, last, rows, i)):
                room_v = max(s[ATOL] + s[RTOL] * pace, SEEN * pace)
                room_x = max(s[ATOL] + s[RTOL] * place, SEEN * (place + pace * dt))
                if gap * dt > IDLE * room_v or gap * dt * dt > IDLE * room_x:
                    d[WORST] = i
                    return False
    return True


def swing(s: Buffers, z: int, first: int, last: int, rows: int, i: int) -> float:
    """How far the acceleration of a row goes, within the step, from where it was at the beginning."""
    most = 0.0
    for k in range(7):
        square = 0.0
        for c in range(first, last):
            more = s[lane(z, c * rows + i) + F1 + LANES * k]
            square += more * more
        most = max(most, square)
    return sqrt(most)
