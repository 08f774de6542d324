"""Gauss-Radau 15: steps of any length that are right to the last digits, for smooth forces of any kind.

Over a step from t0, of length dt, the acceleration is the polynomial of degree 7 that agrees with the forces at eight nodes t0 + h_n dt; places
and velocities are its integrals (`xpheve.kernels.radau`). What forces there are depends on the places, so both are found in passes: each goes
through the nodes in order, and takes every new force into account at once. The first pass begins with the last step's polynomial, continued, and
corrected by as much as the last continuation was wrong. Places, velocities, work and time are sums that keep their remainders.

Source: E. Everhart, in: Dynamics of Comets (1985), 185; H. Rein and D. S. Spiegel, MNRAS 446 (2015) 1424 (passes to the last digit, compensated
sums); D. Pham, H. Rein and D. S. Spiegel, OJAp 7 (2024) (length of a step from the derivatives at its end).

The numbers ``s``: `HEAD` numbers named below; then places, velocities, accelerations (padded to whole tiles, ``Z`` each), forces without potential
at the eight nodes (3 N each), work and its remainder (N each); then tiles of `LANES` coordinates, each with `SLOTS` numbers for every coordinate.
Coordinate c of row i is number c * N + i. What ``s`` holds of a step is its beginning and the accelerations along it: the state at its end is
put together when the next begins.
"""

import math

from xpheve.kernels.ieee import sqrt
from xpheve.kernels.radau import (
    ARMS,
    ARMS_REST,
    BEND,
    END,
    NODES,
    PLACES,
    SLOPE,
    SPEEDS,
    TWIST,
    WEIGHTS,
    WEIGHTS_REST,
    values,
)
from xpheve.loop.drivers.motion import Buffers, forces

# Whole numbers: d[0] evaluations, d[1] evaluations after which to stop, d[8...] as follows.
STEPS, REFUSED, PASSES, TURNING, SPEEDY, WORKING, MOST = 8, 9, 10, 11, 12, 13, 14
"""Steps, refused steps, passes so far; whether rows turn, forces depend on velocities, work is kept; steps of this call at most (0: any)."""
WORST = 15
"""The row that made the last step as short as it is, or that failed."""
LOOKING = 16
"""1: go to ``s[NEED]``, which lies in the present step, and stay there, to be looked at: this is no step of the sequence."""

T, T_REST, SPAN, NEXT, NEED, NEED_REST, WALL, WALL_REST = 0, 1, 2, 3, 4, 5, 6, 7
"""When the present step began, and its length, 0 if there is none; the length wished for the next; until when to go, and never further [s]."""
RTOL, ATOL, PACE, RATE, FIXED, LEAST = 8, 9, 10, 11, 12, 13
"""Tolerances; length of a step by the time in which forces change, at the limit of rounding; how the last step's passes converged; a length for
all steps, or 0; the least length, by the time."""
HEAD = 32

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
SIZE = 200

REACHED, PAUSED, NOT_FINITE, TOO_SHORT = 0, 1, 2, 3
"""What `entry` answers."""

FINE = (WEIGHTS_REST[1], WEIGHTS_REST[2], WEIGHTS_REST[3], WEIGHTS_REST[4], WEIGHTS_REST[5], WEIGHTS_REST[6], WEIGHTS_REST[7])
CLOSE = 1e-18
"""Passes end when the next would change accelerations by less than this part: far less than rounding does."""
STALLED = 0.25
"""Passes that shrink changes by less than this have met rounding, or diverge."""
MOST_PASSES = 12
ROUGH = 1e-9
"""Relative changes that cannot be rounding's."""
FLAW = 1e-17
"""Relative error of a velocity's change over a step of the length `PACE` asks for; it grows with the 16th power of the length."""
LONGEST = 1.3
"""The longest step, by the time in which forces change: beyond, passes hardly converge."""
GROWTH = 4.0
"""Of a step over the last at most."""
REFUSE = 0.5
"""A step after which one of this part would have been right is done again."""
FORGIVE = 0.25
"""What the last step has left owed is forgiven in one shorter than this part of it."""
SHRINK = 0.125
"""Of a step that failed."""


def entry(f: Buffers, n: Buffers) -> int:
    """Make steps until ``s[NEED]`` is reached, or a limit: one of `REACHED`, `PAUSED`, `NOT_FINITE`, `TOO_SHORT`."""
    s = f[0]
    d = n[2]
    if d[LOOKING]:
        return look(f, n)
    steps = d[STEPS]
    while True:
        if is_covered(s):
            return REACHED
        if d[0] >= d[1] or (d[MOST] > 0 and d[STEPS] - steps >= d[MOST]):
            return PAUSED
        answer = step(f, n)
        if answer:
            return answer


def is_covered(s: Buffers) -> bool:
    """Whether the present step ends at or after ``s[NEED]``."""
    t, rest = end(s)
    return t > s[NEED] or (t == s[NEED] and rest >= s[NEED_REST])


def end(s: Buffers) -> tuple[float, float]:
    """When the present step ends; as `xpheve.kernels.clock.later` has it."""
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
            if best >= REFUSE * dt:
                s[NEXT] = min(best, GROWTH * dt)
                break
            best = max(best, 0.01 * dt)
        else:
            failed = TOO_SHORT if rough < math.inf else NOT_FINITE
            best = SHRINK * dt
        d[REFUSED] += 1
        if s[FIXED] > 0.0:
            return failed
        keep_past(s, z, tiles)
        last = 0.0
        dt = best
    s[SPAN] = dt
    d[STEPS] += 1
    return 0


def look(f: Buffers, n: Buffers) -> int:
    """Put the state at ``s[NEED]``, within the present step, in the place of its beginning.

    The polynomial is best at the step's end; so a step of its own leads there, with the forces to begin with that the polynomial gives.
    """
    s = f[0]
    d = n[2]
    rows = n[0][1]
    tiles, x, v, a, w, z = places_in(d, rows)
    t, low = two_sum(s[NEED], -s[T])
    dt = t + (low + (s[NEED_REST] - s[T_REST]))
    if dt > 0.0:
        if dt < s[SPAN]:
            shorten(s, z, tiles, dt / s[SPAN])
            if passes(f, n, z, tiles, x, v, a, w, dt, 1.0 / dt) == math.inf:
                return NOT_FINITE
        s[SPAN] = dt
        conclude(s, d, tiles, w, z, rows, n[0][2])
        s[T], s[T_REST] = s[NEED], s[NEED_REST]
    return REACHED


def places_in(d: Buffers, rows: int) -> tuple[int, int, int, int, int, int]:
    """How many tiles there are; where places, velocities, accelerations, forces without potential, and tiles begin."""
    tiles = ((7 if d[TURNING] else 3) * rows + LANES - 1) // LANES
    pad = LANES * tiles
    w = HEAD + 3 * pad
    return tiles, HEAD, HEAD + pad, HEAD + 2 * pad, w, w + 26 * rows


def conclude(s: Buffers, d: Buffers, tiles: int, w: int, z: int, rows: int, moving: int) -> None:
    """Go to the end of the present step."""
    dt = s[SPAN]
    if d[WORKING]:
        add_work(s, w, w + 24 * rows, z, rows, moving, dt)
    finish(s, z, tiles, dt)
    if d[TURNING]:
        straighten(s, z, rows, moving)
    s[T], s[T_REST] = end(s)
    s[SPAN] = 0.0


def wanted(s: Buffers) -> float:
    """How long a step to try: as wished, but not past the wall; without a stump before it."""
    wish = s[FIXED] if s[FIXED] > 0.0 else s[NEXT]
    if s[WALL] == math.inf:
        return wish
    t, low = two_sum(s[WALL], -s[T])
    left = t + (low + (s[WALL_REST] - s[T_REST]))
    if wish >= left:
        return left
    if s[FIXED] > 0.0 or 2.0 * wish <= left:
        return wish
    return 0.5 * left


# One step ------------------------------------------------------------------------------------------------------------


def begin(s: Buffers, z: int, tiles: int, x: int, v: int) -> None:
    """Put places and velocities at the beginning where ``forces`` reads them."""
    for k in range(tiles):
        for l in range(LANES):
            i = z + k * SIZE + l
            s[x + k * LANES + l] = s[i + X]
            s[v + k * LANES + l] = s[i + V]


def first(s: Buffers, z: int, tiles: int, a: int) -> None:
    """Take the accelerations at the beginning."""
    for k in range(tiles):
        for l in range(LANES):
            s[z + k * SIZE + l + A] = s[a + k * LANES + l]


def forget(s: Buffers, z: int, tiles: int) -> None:
    """Foretell that forces stay as they are."""
    for k in range(tiles):
        for l in range(7 * LANES):
            i = z + k * SIZE + l
            s[i + F1] = 0.0
            s[i + P1] = 0.0


def foretell(s: Buffers, z: int, tiles: int, q: float) -> None:
    """Continue the last step's polynomial over one that is ``q`` times as long, and put right what was wrong with the last continuation."""
    w1 = values(1.0 + q * NODES[1])
    w2 = values(1.0 + q * NODES[2])
    w3 = values(1.0 + q * NODES[3])
    w4 = values(1.0 + q * NODES[4])
    w5 = values(1.0 + q * NODES[5])
    w6 = values(1.0 + q * NODES[6])
    w7 = values(1.0 + q * NODES[7])
    for k in range(tiles):
        for l in range(LANES):
            i = z + k * SIZE + l
            f1, f2, f3, f4, f5, f6, f7 = s[i + F1], s[i + F2], s[i + F3], s[i + F4], s[i + F5], s[i + F6], s[i + F7]
            e = weighed(END, f1, f2, f3, f4, f5, f6, f7)
            p1 = weighed(w1, f1, f2, f3, f4, f5, f6, f7) - e
            p2 = weighed(w2, f1, f2, f3, f4, f5, f6, f7) - e
            p3 = weighed(w3, f1, f2, f3, f4, f5, f6, f7) - e
            p4 = weighed(w4, f1, f2, f3, f4, f5, f6, f7) - e
            p5 = weighed(w5, f1, f2, f3, f4, f5, f6, f7) - e
            p6 = weighed(w6, f1, f2, f3, f4, f5, f6, f7) - e
            p7 = weighed(w7, f1, f2, f3, f4, f5, f6, f7) - e
            s[i + F1] = p1 + (f1 - s[i + P1])
            s[i + F2] = p2 + (f2 - s[i + P2])
            s[i + F3] = p3 + (f3 - s[i + P3])
            s[i + F4] = p4 + (f4 - s[i + P4])
            s[i + F5] = p5 + (f5 - s[i + P5])
            s[i + F6] = p6 + (f6 - s[i + P6])
            s[i + F7] = p7 + (f7 - s[i + P7])
            s[i + P1] = p1
            s[i + P2] = p2
            s[i + P3] = p3
            s[i + P4] = p4
            s[i + P5] = p5
            s[i + P6] = p6
            s[i + P7] = p7


def shorten(s: Buffers, z: int, tiles: int, q: float) -> None:
    """Take the present polynomial at the nodes of a step that is ``q`` times as long, from the same beginning."""
    w1 = values(q * NODES[1])
    w2 = values(q * NODES[2])
    w3 = values(q * NODES[3])
    w4 = values(q * NODES[4])
    w5 = values(q * NODES[5])
    w6 = values(q * NODES[6])
    w7 = values(q * NODES[7])
    for k in range(tiles):
        for l in range(LANES):
            i = z + k * SIZE + l
            f1, f2, f3, f4, f5, f6, f7 = s[i + F1], s[i + F2], s[i + F3], s[i + F4], s[i + F5], s[i + F6], s[i + F7]
            s[i + F1] = weighed(w1, f1, f2, f3, f4, f5, f6, f7)
            s[i + F2] = weighed(w2, f1, f2, f3, f4, f5, f6, f7)
            s[i + F3] = weighed(w3, f1, f2, f3, f4, f5, f6, f7)
            s[i + F4] = weighed(w4, f1, f2, f3, f4, f5, f6, f7)
            s[i + F5] = weighed(w5, f1, f2, f3, f4, f5, f6, f7)
            s[i + F6] = weighed(w6, f1, f2, f3, f4, f5, f6, f7)
            s[i + F7] = weighed(w7, f1, f2, f3, f4, f5, f6, f7)


def weighed(
    w: tuple[float, ...], f1: float, f2: float, f3: float, f4: float, f5: float, f6: float, f7: float
) -> float:
    """The sum of f_1 to f_7 by their weights."""
    return ((w[0] * f1 + w[1] * f2) + (w[2] * f3 + w[3] * f4)) + ((w[4] * f5 + w[5] * f6) + w[6] * f7)


def keep_past(s: Buffers, z: int, tiles: int) -> None:
    """A refused step says nothing of the next."""
    forget(s, z, tiles)


def passes(
    f: Buffers, n: Buffers, z: int, tiles: int, x: int, v: int, a: int, w: int, dt: float, owed: float
) -> float:
    """Find the forces at the nodes: 0 if they agree with the places, 1 if they do not, infinity if one is not finite."""
    s = f[0]
    d = n[2]
    rows = n[0][1]
    before = 0.0
    expected = 1.0
    for count in range(MOST_PASSES):
        owe(s, z, tiles, owed)
        for node in range(1, 8):
            h = NODES[node] * dt
            put_places(s, z, tiles, x, h, PLACES[node], WEIGHTS[node], 1.0 / WEIGHTS[node])
            if d[SPEEDY]:
                put_speeds(s, z, tiles, v, h, SPEEDS[node])
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
            s[RATE] = expected
        if change * expected <= CLOSE:
            return 0.0
        if count > 1 and expected > STALLED:
            return matters
        before = change
    return matters


def owe(s: Buffers, z: int, tiles: int, by: float) -> None:
    """What rounding has done to the place at the beginning, by the share of the acceleration there; and what was left owed, ``by`` 1 / dt."""
    for k in range(tiles):
        for l in range(LANES):
            i = z + k * SIZE + l
            s[i + OWED] = WEIGHTS[0] * s[i + X_REST] + by * s[i + CARRY]


def put_places(
    s: Buffers, z: int, tiles: int, x: int, h: float, w: tuple[float, ...], share: float, inverse: float
) -> None:
    """Places ``h`` [s] after the beginning, at the node with weights ``w``, whose acceleration has the ``share`` in the whole step's.

    A place is rounded so that what rounding has done to the places of a step, each by its share, cancels: then it hardly changes the velocity
    at the end, however steep the forces are.
    """
    for k in range(tiles):
        for l in range(LANES):
            i = z + k * SIZE + l
            f = weighed(w, s[i + F1], s[i + F2], s[i + F3], s[i + F4], s[i + F5], s[i + F6], s[i + F7])
            place, lost = two_sum(s[i + X], s[i + X_REST] + h * (s[i + V] + h * (0.5 * s[i + A] + f)))
            owed = s[i + OWED]
            put = place + (lost + owed * inverse)
            s[i + OWED] = owed + share * ((place - put) + lost)
            s[x + k * LANES + l] = put


def put_speeds(s: Buffers, z: int, tiles: int, v: int, h: float, w: tuple[float, ...]) -> None:
    """Velocities ``h`` [s] after the beginning, at the node with weights ``w``."""
    for k in range(tiles):
        for l in range(LANES):
            i = z + k * SIZE + l
            f = weighed(w, s[i + F1], s[i + F2], s[i + F3], s[i + F4], s[i + F5], s[i + F6], s[i + F7])
            s[v + k * LANES + l] = s[i + V] + (s[i + V_REST] + h * (s[i + A] + f))


def take(s: Buffers, z: int, tiles: int, a: int, slot: int) -> None:
    """Take the accelerations at a node."""
    for k in range(tiles):
        for l in range(LANES):
            i = z + k * SIZE + l
            s[i + F1 + slot] = s[a + k * LANES + l] - s[i + A]


def take_last(s: Buffers, z: int, tiles: int, a: int) -> None:
    """Take the accelerations at the last node, and how they have changed since the last pass."""
    for k in range(tiles):
        for l in range(LANES):
            i = z + k * SIZE + l
            new = s[a + k * LANES + l] - s[i + A]
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
        for l in range(LANES):
            i = z + k * SIZE + l
            f1, f2, f3, f4, f5, f6, f7 = s[i + F1], s[i + F2], s[i + F3], s[i + F4], s[i + F5], s[i + F6], s[i + F7]
            v = s[i + V]
            a = s[i + A]
            s[i + CARRY] = s[i + OWED] * dt
            high, low = halves(v)
            arm = (ARMS[0] * f1 + ARMS[1] * f2) + (ARMS[2] * f3 + ARMS[3] * f4)
            arm += (ARMS[4] * f5 + ARMS[5] * f6) + (ARMS[6] * f7 + weighed(ARMS_REST, f1, f2, f3, f4, f5, f6, f7))
            small = dt * (s[i + V_REST] + dt * (0.5 * a + arm)) + (high * dt_low + (low * dt_high + low * dt_low))
            t, rest = two_sum(s[i + X], high * dt_high)
            s[i + X], s[i + X_REST] = two_sum(t, rest + (small + s[i + X_REST]))
            mean = (WEIGHTS[1] * f1 + WEIGHTS[2] * f2) + (WEIGHTS[3] * f3 + WEIGHTS[4] * f4)
            mean += (WEIGHTS[5] * f5 + WEIGHTS[6] * f6) + WEIGHTS[7] * f7
            mean, lost = two_sum(a, mean)
            lost += weighed(FINE, f1, f2, f3, f4, f5, f6, f7)
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


def add_work(s: Buffers, w: int, work: int, z: int, rows: int, moving: int, dt: float) -> None:
    """Add the work of forces without potential over the step: the integral of force by velocity, by the same nodes."""
    for i in range(moving):
        total = 0.0
        for node in range(8):
            power = 0.0
            for c in range(3):
                j = lane(z, c * rows + i)
                power += s[w + (3 * node + c) * rows + i] * speed(s, j, NODES[node] * dt, SPEEDS[node])
            total += WEIGHTS[node] * power
        s[work + i], s[work + rows + i] = two_sum(s[work + i], s[work + rows + i] + dt * total)


def speed(s: Buffers, i: int, h: float, w: tuple[float, ...]) -> float:
    """Velocity along one coordinate ``h`` [s] after the beginning."""
    f = weighed(w, s[i + F1], s[i + F2], s[i + F3], s[i + F4], s[i + F5], s[i + F6], s[i + F7])
    return s[i + V] + h * (s[i + A] + f)


# The length of steps -------------------------------------------------------------------------------------------------


def measure(
    s: Buffers, d: Buffers, z: int, tiles: int, rows: int, moving: int, dt: float
) -> float:
    """How long the next step should be, by ``dt``: as the row needs whose forces change soonest, or as tolerances allow."""
    for k in range(tiles):
        for l in range(LANES):
            i = z + k * SIZE + l
            f1, f2, f3, f4, f5, f6, f7 = s[i + F1], s[i + F2], s[i + F3], s[i + F4], s[i + F5], s[i + F6], s[i + F7]
            s[i + Y0] = s[i + A] + weighed(END, f1, f2, f3, f4, f5, f6, f7)
            s[i + Y1] = weighed(SLOPE, f1, f2, f3, f4, f5, f6, f7)
            s[i + Y2] = weighed(BEND, f1, f2, f3, f4, f5, f6, f7)
            s[i + Y3] = weighed(TWIST, f1, f2, f3, f4, f5, f6, f7)
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
            if y1 == 0.0 and y2 == 0.0 and y3 == 0.0:
                continue
            size = y0
            y0 += window * y1
            y1 += window * y2
            y2 += window * y3
            square = pace * 2.0 * y0 / (y1 + sqrt(y0 * y2))
            square = min(square, 1e16)
            flaw = FLAW * sqrt(size) * sqrt(square) * dt
            room_v = s[ATOL] + s[RTOL] * v
            room_x = s[ATOL] + s[RTOL] * x
            if flaw < room_v and flaw * sqrt(square) * dt < room_x:
                gain = min(room_v, room_x / (sqrt(square) * dt)) / flaw if flaw > 0.0 else 1e300
                square *= min(most, sqrt(sqrt(sqrt(gain))))
            if square < shortest:
                shortest = square
                d[WORST] = i
    return sqrt(shortest)
