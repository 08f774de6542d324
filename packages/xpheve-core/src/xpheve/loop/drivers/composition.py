"""Compositions: steps made of drifts, in which nothing acts, and kicks, in which nothing moves. One file for methods of all orders.

A step of length h is, with the coefficients b_0 ... b_S and a_0 ... a_(S-1) that the caller gives,

    kick(b_0 h) drift(a_0 h) kick(b_1 h) drift(a_1 h) ... drift(a_(S-1) h) kick(b_S h).

Both are exact flows of one part of the energy, so the whole is symplectic (Hairer, Lubich, Wanner, Geometric Numerical Integration, II.4
and II.5, VI.3). What the last kick of a step was evaluated for serves the first of the next; where b_0 = b_S = 0 neither is made. Places,
velocities and angular momenta are compensated sums (W. Kahan, Comm. ACM 8 (1965) 40; as here D. Knuth, TAOCP 2, 4.2.2): without them
rounding, not the method, sets the error.

A body that turns drifts in free rotation about its angular momentum L, which is exact where two moments are equal; else the turns about
two body axes are a composition of symmetric halves, with weights that the caller gives (`xpheve.kernels.spin`). Torques kick L.

Buffers: ``s`` = f[0] holds in front the numbers named below, then blocks of rows side by side, component by component; ``d`` = n[2].
"""

from xpheve.kernels.quaternion import Quat, conjugate, multiply, rotate_inverse
from xpheve.kernels.spin import stretched, through_axes, turned, uneven
from xpheve.kernels.turning import rate_of
from xpheve.kernels.vector import Vec
from xpheve.loop.drivers.motion import Buffers, forces

# Of s
ORIGIN, NUMBER, STEP, COEFFICIENTS = 0, 1, 2, 3
"""The time [s] of step 0, the number of the first step, h [s]; then b_0, a_0, b_1, ..., b_S, and the weights of turns."""

# Of d; those below 8 are for all drivers
EVALUATIONS, ENOUGH = 0, 1
WANTED, FRESH, STAGES, WEIGHTS, WIDTH = 8, 9, 10, 11, 12
"""Steps wanted; whether second derivatives at the beginning are there; S; how many weights; 3, or 7 where rows turn."""
PLACE, SPEED, PUSH, WORKING, PLACE_REST, SPEED_REST, MOMENTUM, MOMENTUM_REST, UNEVEN = (
    13,
    14,
    15,
    16,
    17,
    18,
    19,
    20,
    21,
)
"""Where the blocks begin: places, velocities (0 for q), second derivatives, forces without potential; what sums have left over; L / A [rad/s],
and what its sum has; A_k / A - 1 and A / A_k - 1."""
NODES = 22
"""Where three nodes begin, one after another, each with places, velocities and second derivatives of the path: before the last step but one,
before the last step, and after it. The caller gives the second as the last call left it, for the first."""


def entry(f: Buffers, n: Buffers) -> int:
    """Make steps until as many are made as wanted, or enough evaluations: how many it were."""
    s = f[0]
    d = n[2]
    made = 0
    near = d[ENOUGH] - 2 * (d[STAGES] + 3)
    while made < d[WANTED] and (made == 0 or d[EVALUATIONS] < d[ENOUGH]):
        if made + 2 >= d[WANTED] or d[EVALUATIONS] >= near:  # one of the last two steps
            shift(s, d, n[0][1])
            note(f, n, 1, s[NUMBER] + made)
        step(f, n, s[NUMBER] + made, s[STEP])
        made += 1
    note(f, n, 2, s[NUMBER] + made)
    return made


def evaluate(f: Buffers, n: Buffers, now: float) -> int:
    """Second derivatives of the places as they are, and of all that turns as if it stood still."""
    d = n[2]
    d[EVALUATIONS] += 1
    forces(f, n, d[PLACE], d[SPEED], d[PUSH], d[WORKING], now)
    return 0


def step(f: Buffers, n: Buffers, number: float, h: float) -> int:
    """One step of ``h`` [s]."""
    s = f[0]
    d = n[2]
    rows, moving = n[0][1], n[0][2]
    b = s[COEFFICIENTS]
    if b != 0.0:
        if d[FRESH] == 0:
            evaluate(f, n, s[ORIGIN] + h * number)
        kick(s, d, rows, moving, h * b)
    passed = 0.0
    for k in range(d[STAGES]):
        a = s[COEFFICIENTS + 2 * k + 1]
        drift(s, d, rows, moving, h * a)
        passed += a
        b = s[COEFFICIENTS + 2 * k + 2]
        d[FRESH] = 0
        if b != 0.0:
            evaluate(f, n, s[ORIGIN] + h * (number + passed))
            kick(s, d, rows, moving, h * b)
            d[FRESH] = 1
    return 0


def add(s: Buffers, place: int, rest: int, change: float) -> int:
    """Add ``change`` to the sum at ``place``, whose lost digits are at ``rest``."""
    before = s[place]
    change = change + s[rest]
    after = before + change
    taken = after - before
    s[rest] = (before - (after - taken)) + (change - taken)
    s[place] = after
    return 0


def add_all(s: Buffers, places: int, rests: int, rates: int, count: int, span: float) -> int:
    """Add ``count`` rates times ``span`` to the sums from ``places`` on. Rows that only act have rates of 0."""
    for i in range(count):
        before = s[places + i]
        change = span * s[rates + i] + s[rests + i]
        after = before + change
        taken = after - before
        s[rests + i] = (before - (after - taken)) + (change - taken)
        s[places + i] = after
    return 0


def drift(s: Buffers, d: Buffers, rows: int, moving: int, span: float) -> int:
    """Places move on for ``span`` [s] at the velocities that they have, and bodies turn freely."""
    add_all(s, d[PLACE], d[PLACE_REST], d[SPEED], 3 * rows, span)
    if d[WIDTH] == 7:
        for i in range(moving):
            turn(s, d, rows, i, span)
    return 0


def kick(s: Buffers, d: Buffers, rows: int, moving: int, span: float) -> int:
    """The second derivatives act for ``span`` [s] on velocities, and on angular momenta."""
    add_all(s, d[SPEED], d[SPEED_REST], d[PUSH], 3 * rows, span)
    if d[WIDTH] == 7:
        for i in range(moving):
            twist(s, d, rows, i, span)
    return 0


def orientation_at(s: Buffers, block: int, rows: int, i: int) -> Quat:
    """The quaternion of row ``i`` of a block."""
    at = block + 3 * rows + i
    return (s[at], s[at + rows], s[at + 2 * rows], s[at + 3 * rows])


def vector_at(s: Buffers, block: int, rows: int, i: int) -> Vec:
    """The vector of row ``i`` of a block."""
    at = block + i
    return (s[at], s[at + rows], s[at + 2 * rows])


def turn(s: Buffers, d: Buffers, rows: int, i: int, span: float) -> int:
    """Row ``i`` turns freely for ``span`` [s]."""
    q = orientation_at(s, d[PLACE], rows, i)
    momentum = vector_at(s, d[MOMENTUM], rows, i)
    spread = vector_at(s, d[UNEVEN] + 3 * rows, rows, i)
    if uneven(spread):
        local = rotate_inverse(q, momentum)
        if spread[0] * spread[1] == 0.0 and spread[1] * spread[2] == 0.0 and spread[2] * spread[0] == 0.0:
            q, local = through_axes(q, local, spread, span)  # about one axis alone, which is exact
        else:
            weights = COEFFICIENTS + 2 * d[STAGES] + 1
            for k in range(d[WEIGHTS]):
                q, local = through_axes(q, local, spread, s[weights + k] * span)
    w, x, y, z = turned(q, momentum, (0.0, 0.0, 0.0), span)
    at = d[PLACE] + 3 * rows + i
    s[at] = w
    s[at + rows] = x
    s[at + 2 * rows] = y
    s[at + 3 * rows] = z
    return 0


def twist(s: Buffers, d: Buffers, rows: int, i: int, span: float) -> int:
    """The torque on row ``i`` acts for ``span`` [s]: of a body at rest q'' = (T / I) q / 2, and L / A changes at T / A."""
    q = orientation_at(s, d[PLACE], rows, i)
    bend = orientation_at(s, d[PUSH], rows, i)
    _, x, y, z = multiply(bend, conjugate(q))
    torque = stretched(q, (2.0 * x, 2.0 * y, 2.0 * z), vector_at(s, d[UNEVEN], rows, i))
    for c in range(3):
        add(s, d[MOMENTUM] + c * rows + i, d[MOMENTUM_REST] + c * rows + i, span * torque[c])
    return 0


def note(f: Buffers, n: Buffers, node: int, number: float) -> int:
    """Keep the state as it is as a node: with the derivatives of the path, q' = w q / 2 among them, which the steps leave at 0."""
    s = f[0]
    d = n[2]
    rows, moving, width = n[0][1], n[0][2], d[WIDTH]
    now = s[ORIGIN] + s[STEP] * number
    if d[FRESH] == 0:
        evaluate(f, n, now)
        d[FRESH] = 1
    size = width * rows
    to = d[NODES] + 3 * size * node
    for k in range(size):
        s[to + k] = s[d[PLACE] + k]
        s[to + size + k] = s[d[SPEED] + k]
        s[to + 2 * size + k] = s[d[PUSH] + k]
    if width == 7:
        for i in range(moving):
            spin(s, d, rows, i, to + size)
        d[EVALUATIONS] += 1
        forces(f, n, d[PLACE], to + size, to + 2 * size, d[WORKING], now)
    return 0


def spin(s: Buffers, d: Buffers, rows: int, i: int, to: int) -> int:
    """Write q' of row ``i`` into the block ``to``."""
    q = orientation_at(s, d[PLACE], rows, i)
    omega = stretched(q, vector_at(s, d[MOMENTUM], rows, i), vector_at(s, d[UNEVEN] + 3 * rows, rows, i))
    rate = rate_of(q, omega)
    at = to + 3 * rows + i
    s[at] = rate[0]
    s[at + rows] = rate[1]
    s[at + 2 * rows] = rate[2]
    s[at + 3 * rows] = rate[3]
    return 0


def shift(s: Buffers, d: Buffers, rows: int) -> int:
    """What was the node before the last step is that before the last but one now."""
    size = 3 * d[WIDTH] * rows
    for k in range(d[NODES], d[NODES] + size):
        s[k] = s[k + size]
    return 0
