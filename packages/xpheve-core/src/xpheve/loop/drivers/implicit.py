"""Radau IIA with 3, 5 or 7 stages for x'' = a(x, x', t): L-stable steps for stiff forces, to tolerances or of given length.

Over a step h the velocity is the polynomial of degree s whose derivative is the acceleration at s nodes c_i, the last of them 1. With W_i
what the velocity has gained at node i, Z = h A (v0 + W) is what the place has, and simplified Newton iteration solves A^-1 W / h = a(x0 + Z,
v0 + W). Eigenvalues of A^-1 take the stages apart; with mu = eigenvalue / h what is left of each is a system of the size of the places,

    (mu^2 - mu da/dv - da/dx) d = r,    the correction being mu d,

one for the real eigenvalue and a complex one for each pair. Groups that do not act on one another are blocks with a system each.
The error is estimated by an embedded method of order s, filtered by the real system, and held to the tolerance itself: so it is kept between the
ends of steps, too, where the polynomials are of that order; at the ends, of order 2 s - 1, all is far better. The step follows the estimate as by
Gustafsson; the number of stages follows how fast the iteration converges.

Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed. 1996, IV.8; E. Hairer, G. Wanner, J. Comput. Appl. Math.
111 (1999) 93 (number of stages); K. Gustafsson, ACM Trans. Math. Softw. 20 (1994) 496.

Numbers of three components for each of N rows lie at ``place + c * N + i``, s times over for stages. The constants below say what lies where in
``d = n[2]`` and ``s = f[0]``; `xpheve.steppers.implicit` fills the buffers in.
"""

from __future__ import annotations

import math

from xpheve.kernels.clock import elapsed, later, multiple, two_sum
from xpheve.kernels.dense import factor, factor_complex, solve, solve_complex
from xpheve.kernels.ieee import power
from xpheve.loop.drivers.motion import Buffers, forces, jacobians

# Whole numbers of d

EVALUATIONS = 0  # of the forces so far
BUDGET = 1  # pause once there were so many
STATUS = 8  # how the call ended, one of the four below
ROWS = 9  # N
MOVING = 10  # M
BLOCKS = 11
STAGES = 12  # of the next step
FRESH = 13  # 1 if no step came before that the next could go by
STEPS = 14
REJECTED = 15
SINCE = 16  # steps since the number of stages was changed, or had to be lowered
FIXED = 17  # 1 for steps of given length
LEAST = 18  # fewest and most stages
MOST = 19
WORKS = 20  # 1 if some force has no potential
AREA = 21  # numbers of the matrices of all blocks
NUMBER = 22  # of the step on the grid
KEPT = 23  # stages of the last step
TROUBLE = 24  # 1 if the step before this trial was rejected
LAST_ROW = 25  # row whose error or force stood in the way
JACOBIANS = 26
TABLE = 27  # places in s: of the coefficients of 3, 5, 7 stages
MATRICES = 30  # da/dx, da/dv, then the real system, and the pairs of parts of the complex ones
LISTS = 31  # place in d: of the blocks, four numbers each: first of the members in d, how many, place in the area, first pivot in d
ONCE = 59  # 1 for one step a call
HEADER = 64  # then, for each of M rows, what `jacobians` needs: row start, width of a row, column; see `xpheve.loop.jacobian_text`

DONE = 0
PAUSED = 1
STUCK = 2  # the step fell below what moves the clock
LOST = 3  # the acceleration is not finite where the step begins

# Numbers of s

TIME = 0  # an instant
NEED = 2
WALL = 4
BEGIN = 6  # instant at which the last step began
ORIGIN = 8  # of the grid
GRID = 10  # its step [s]; 0 if a call makes only one, up to ``WALL``
NEXT = 11  # step wanted [s]
LAST = 12  # length of the last step [s]
RTOL = 13
ATOL = 14
BEFORE = 15  # length and error of the accepted step before
BEFORE_ERROR = 16
THETA = 17  # how fast Newton's iteration converges, the last time
RATE = 18  # theta / (1 - theta)
WANTED = 19  # length to try [s], and how far it is to where the step must end
AHEAD = 20
END = 21  # that instant
NUMBERS = 23

# Places in s of vectors, as they stand in d; the last five are seven vectors each

X = 32  # places
V = 33
X_REST = 34  # what rounding lost of them
V_REST = 35
A = 36  # accelerations now, and forces without potential
W_FORCE = 37
X_BEGIN = 38  # where the last step began
V_BEGIN = 39
X_STAGE = 40  # a stage
V_STAGE = 41
A_STAGE = 42
W_STAGE = 43
X_SCALE = 44  # tolerances
V_SCALE = 45
WORK = 46  # before the last step, what rounding lost of it, and of the last step, one a row
STORED = 47  # stored forces without potential
LEFT = 48  # right sides of linear systems
LEFT_IM = 49
X_ERROR = 50
V_ERROR = 51
P = 52  # the estimate before it is filtered
Q = 53
GAIN = 54  # W
WAY = 55  # Z
RIGHT = 56  # residuals
STEP_GAIN = 57  # corrections
CURVE = 58  # polynomial of what the velocity gained in the last step
POWER = STEP_GAIN  # polynomial of the work of the last step

SAFETY = 0.9
GROWTH = 8.0
SHRINKAGE = 0.2
SMALLEST = 1e-15  # of the time at hand
EPSILON = 2.3e-16
NEWTON = 0.5  # power of the tolerance to which, by the tolerance, the equations of a step are solved, as usual
PERSISTENCE = 20.0  # more iterations for steps of given length, which are not to be cut
PATIENCE = 10  # steps with one number of stages before there may be more


def entry(f: Buffers, n: Buffers) -> int:
    """Make steps until ``NEED`` is reached, or the budget is spent; ``WALL`` is never passed. Returns the status.

    The length of a step is tried again, shorter, as long as its equations cannot be solved or its error is too large.
    """
    s = f[0]
    d = n[2]
    d[STATUS] = DONE
    start(f, n)
    while d[STATUS] == DONE and elapsed((s[NEED], s[NEED + 1]), (s[TIME], s[TIME + 1])) > 0.0:
        aim(s, d)
        differentiate(f, n)
        factor_by = 1.0
        while factor_by > 0.0 and d[STATUS] == DONE:
            h = next_trial(s, d)
            factor_by = 0.5
            if prepare(s, d, h):
                guess(s, d, h)
                factor_by = iterate(f, n, h)
                if factor_by < 0.0 and d[FIXED] == 0:
                    factor_by = judge(s, d, h, estimate(f, n, h), -factor_by)
                elif factor_by > 0.0:
                    s[RATE] = 1.0
                    fewer(d)
            if factor_by > 0.0:
                d[TROUBLE] = 1
                d[REJECTED] += 1
                s[WANTED] = h * factor_by
        if d[STATUS] == DONE:
            move(s, d, h, -factor_by)
            take(f, n, h)
            if d[STATUS] == DONE and (d[ONCE] == 1 or d[EVALUATIONS] >= d[BUDGET]):
                d[STATUS] = PAUSED
    return int(d[STATUS])


# What lies where -----------------------------------------------------------------------------------------------------


def table(d: list[int]) -> int:
    """Where the coefficients of the present number of stages begin: the nodes; see `xpheve.steppers.radau_tables`."""
    return d[TABLE + (d[STAGES] - 3) // 2]


def a_table(d: list[int]) -> int:
    """Where A begins, which is followed by its inverse, by D, and by what tells of the embedded method."""
    return table(d) + d[STAGES]


# The first step ------------------------------------------------------------------------------------------------------


def start(f: Buffers, n: Buffers) -> int:
    """Find the acceleration now, and a length of the first step if there was none before.

    Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed. 1993, II.4.
    """
    s = f[0]
    d = n[2]
    x, v, a, trial = d[X], d[V], d[A], d[A_STAGE]
    forces(f, n, x, v, a, d[W_FORCE], s[TIME])
    d[EVALUATIONS] += 1
    if not finite(s, d, a):
        d[STATUS] = LOST
        return 0
    if s[NEXT] > 0.0 or d[FIXED] == 1:
        return 0
    scales(s, d)
    rows = d[ROWS]
    size, slope = largest(s, d, x, v), largest(s, d, v, a)
    h = 1e-6 if size < 1e-5 or slope < 1e-5 else 0.01 * size / slope
    for i in range(d[MOVING]):
        for c in range(i, i + 3 * rows, rows):
            s[d[X_STAGE] + c] = s[x + c] + h * s[v + c]
            s[d[V_STAGE] + c] = s[v + c] + h * s[a + c]
    forces(f, n, d[X_STAGE], d[V_STAGE], trial, d[W_STAGE], later((s[TIME], s[TIME + 1]), h)[0])
    d[EVALUATIONS] += 1
    for i in range(d[MOVING]):
        for c in range(i, i + 3 * rows, rows):
            s[trial + c] = (s[trial + c] - s[a + c]) / h
    bend = largest(s, d, a, trial)
    most = max(slope, bend)
    second = max(1e-6, 1e-3 * h) if not most > 1e-15 else power(0.01 / most, 1.0 / (d[STAGES] + 1.0))
    s[NEXT] = min(100.0 * h, second) if bend < 1e300 else 1e-3 * h
    return 0


def finite(s: list[float], d: list[int], a: int) -> bool:
    """Whether all components at ``a`` are finite; else the first row with one that is not is noted."""
    for i in range(d[MOVING]):
        total = s[a + i] + s[a + i + d[ROWS]] + s[a + i + 2 * d[ROWS]]
        if total - total != 0.0:
            d[LAST_ROW] = i
            return False
    return True


def scales(s: list[float], d: list[int]) -> int:
    """Set the scales of errors, component by component: atol + rtol times its size, as SciPy has it."""
    rows, relative, absolute = d[ROWS], s[RTOL], s[ATOL]
    x, v, x_to, v_to = d[X], d[V], d[X_SCALE], d[V_SCALE]
    for i in range(d[MOVING]):
        for c in range(i, i + 3 * rows, rows):
            s[x_to + c] = absolute + relative * abs(s[x + c])
            s[v_to + c] = absolute + relative * abs(s[v + c])
    return 0


def length(s: list[float], at_row: int, rows: int) -> float:
    """Length of the vector of a row."""
    a, b, c = s[at_row], s[at_row + rows], s[at_row + 2 * rows]
    return math.sqrt(a * a + b * b + c * c)


def largest(s: list[float], d: list[int], x: int, v: int) -> float:
    """The largest of what lies at ``x`` and at ``v``, in the scales of places and of velocities; NaN counts as infinite."""
    rows, x_scale, v_scale, most = d[ROWS], d[X_SCALE], d[V_SCALE], 0.0
    for i in range(d[MOVING]):
        for c in range(i, i + 3 * rows, rows):
            here = max(abs(s[x + c]) / s[x_scale + c], abs(s[v + c]) / s[v_scale + c])
            if not here <= most:
                d[LAST_ROW] = i
                most = here if here == here else math.inf
    return most


# A step --------------------------------------------------------------------------------------------------------------


def aim(s: list[float], d: list[int]) -> int:
    """Find how far the step may go, and how far it is wished to."""
    now, wall = (s[TIME], s[TIME + 1]), (s[WALL], s[WALL + 1])
    if d[FIXED] == 1 and s[GRID] > 0.0:
        wall = multiple((s[ORIGIN], s[ORIGIN + 1]), d[NUMBER] + 1, s[GRID])
    s[END], s[END + 1] = wall
    s[AHEAD] = elapsed(wall, now)
    s[WANTED] = s[NEXT] if d[FIXED] == 0 or s[NEXT] > 0.0 else s[AHEAD]
    scales(s, d)
    return 0


def next_trial(s: list[float], d: list[int]) -> float:
    """The length to try: what is wanted, or all that is left, or half of it, so that no crumb remains."""
    wanted, ahead = s[WANTED], s[AHEAD]
    if not wanted > SMALLEST * max(1e-300, abs(s[TIME])):
        d[STATUS] = STUCK
    if wanted >= ahead * (1.0 - 1e-9):
        return ahead
    return 0.5 * ahead if 2.0 * wanted > ahead else wanted


def judge(s: list[float], d: list[int], h: float, error: float, iterations: float) -> float:
    """By which factor the step is to be tried again; negative, for the next step's length, if it may be taken."""
    stages = d[STAGES]
    room = 2.0 * limit_of(stages)
    safe = min(SAFETY, SAFETY * (1.0 + room) / (iterations + room))
    ratio = max(1.0 / GROWTH, min(1.0 / SHRINKAGE, power(error, 1.0 / (stages + 1.0)) / safe))
    if not error < 1.0:
        return 0.1 if d[FRESH] == 1 else min(SAFETY, 1.0 / ratio)
    if s[BEFORE_ERROR] > 0.0:
        predicted = s[BEFORE] / h * power(error * error / s[BEFORE_ERROR], 1.0 / (stages + 1.0)) / SAFETY
        ratio = max(ratio, max(1.0 / GROWTH, min(1.0 / SHRINKAGE, predicted)))
    if d[TROUBLE] == 1:
        ratio = max(ratio, 1.0)
    s[BEFORE] = h
    s[BEFORE_ERROR] = max(0.01, error)
    return -1.0 / ratio


def move(s: list[float], d: list[int], h: float, growth: float) -> int:
    """Set the clock to the end of the step ``h``, and the length of the next to ``growth`` times that.

    A step that a wall cut short says too little of the next to make that shorter, too.
    """
    now = (s[TIME], s[TIME + 1])
    s[BEGIN], s[BEGIN + 1] = now
    s[LAST] = h
    ends = h == s[AHEAD]
    if ends:
        s[TIME], s[TIME + 1] = s[END], s[END + 1]
    else:
        s[TIME], s[TIME + 1] = later(now, h)
    if d[FIXED] == 0:
        s[NEXT] = max(growth * h, s[WANTED] if h < s[WANTED] else 0.0)
    elif ends:
        s[NEXT] = 0.0
        d[NUMBER] += 1
    else:
        s[NEXT] = h
    return 0


def limit_of(stages: int) -> float:
    """Most iterations for a step."""
    return 7.0 + 2.5 * (stages - 3)


def fewer(d: list[int]) -> int:
    """After trouble: fewer stages."""
    if d[STAGES] > d[LEAST]:
        d[STAGES] -= 2
    d[SINCE] = 0
    return 0


def take(f: Buffers, n: Buffers, h: float) -> int:
    """Take the step over: the state at its end, its polynomial, work; then choose the number of stages."""
    s = f[0]
    d = n[2]
    stages, rows, span = d[STAGES], d[ROWS], 3 * d[ROWS]
    d[KEPT] = stages
    places(s, d, h)
    if d[WORKS] == 1:
        book(f, n, h)
    x, v, x_begin, v_begin, x_rest, v_rest = d[X], d[V], d[X_BEGIN], d[V_BEGIN], d[X_REST], d[V_REST]
    gain, curve = d[GAIN], d[CURVE]
    inverse, last = a_table(d) + 2 * stages * stages, (stages - 1) * span
    way = d[WAY] + last
    for i in range(d[MOVING]):
        for c in range(i, i + span, rows):
            s[x_begin + c] = s[x + c]
            s[v_begin + c] = s[v + c]
            s[x + c], s[x_rest + c] = two_sum(s[x + c], s[way + c] + s[x_rest + c])
            s[v + c], s[v_rest + c] = two_sum(s[v + c], s[gain + last + c] + s[v_rest + c])
            for k in range(7):
                s[curve + k * span + c] = 0.0
            for k in range(stages):
                s[curve + k * span + c] = weighted(s, inverse + k * stages, gain + c, stages, span)
    forces(f, n, x, v, d[A], d[W_FORCE], s[TIME])
    d[EVALUATIONS] += 1
    if not finite(s, d, d[A]):
        d[STATUS] = LOST
    d[FRESH] = 0
    d[TROUBLE] = 0
    d[STEPS] += 1
    d[SINCE] += 1
    if s[THETA] >= 0.8:
        fewer(d)
    elif d[SINCE] >= PATIENCE and s[THETA] <= 0.002 and stages < d[MOST] and 0.8 * h <= s[NEXT] <= 1.2 * h:
        d[STAGES] += 2
        d[SINCE] = 0
        s[BEFORE_ERROR] = 0.0
    return 0


def weighted(s: list[float], weights: int, values: int, stages: int, span: int) -> float:
    """The sum of the values of all stages by weight."""
    total = 0.0
    for j in range(stages):
        total = total + s[weights + j] * s[values + j * span]
    return total


def book(f: Buffers, n: Buffers, h: float) -> int:
    """Find the work of the laws' forces without potential: the integral of the polynomial through their powers at the nodes.

    Its coefficients of theta, theta^2, ... go to ``POWER``, ``k * N + i``; to the work before is added that of the step before, with the work of
    stored forces, which goes by the way alone.
    """
    s = f[0]
    d = n[2]
    stages, rows, moving = d[STAGES], d[ROWS], d[MOVING]
    v, w, work, right, to, inverse = (
        d[V_STAGE],
        d[W_STAGE],
        d[WORK],
        d[RIGHT],
        d[POWER],
        a_table(d) + 2 * stages * stages,
    )
    stored, x, x_begin = d[STORED], d[X], d[X_BEGIN]
    for i in range(moving):
        total = s[work + 2 * rows + i]
        for c in range(i, i + 3 * rows, rows):
            total = total + s[stored + c] * (s[x + c] - s[x_begin + c])
        s[work + i], s[work + rows + i] = two_sum(s[work + i], total + s[work + rows + i])
    for j in range(stages):
        stage(f, n, j, h, d[A_STAGE])
        for i in range(moving):
            total = 0.0
            for c in range(i, i + 3 * rows, rows):
                total = total + (s[w + c] - s[stored + c]) * s[v + c]
            s[right + j * rows + i] = s[table(d) + j] * total
    for i in range(moving):
        total = 0.0
        for k in range(stages):
            part = h * weighted(s, inverse + k * stages, right + i, stages, rows) / (k + 1.0)
            s[to + k * rows + i] = part
            total = total + part
        for k in range(stages, 7):
            s[to + k * rows + i] = 0.0
        s[work + 2 * rows + i] = total
    return 0


# Newton's iteration --------------------------------------------------------------------------------------------------


def guess(s: list[float], d: list[int], h: float) -> int:
    """Begin where the polynomial of the last step leads; with nothing gained if there was none."""
    stages, kept, rows, span = d[STAGES], d[KEPT], d[ROWS], 3 * d[ROWS]
    gain, curve, nodes = d[GAIN], d[CURVE], table(d)
    ratio = 0.0
    if d[FRESH] == 0:
        ratio = h / s[LAST]
    else:
        kept = 0
    for j in range(stages):
        theta = 1.0 + s[nodes + j] * ratio
        for i in range(d[MOVING]):
            for c in range(i, i + span, rows):
                total, end = 0.0, 0.0
                for k in range(kept - 1, -1, -1):
                    total = (total + s[curve + k * span + c]) * theta
                    end = end + s[curve + k * span + c]
                s[gain + j * span + c] = total - end
    return 0


def places(s: list[float], d: list[int], h: float) -> int:
    """What places gain, from what velocities gain: Z = h A (v0 + W)."""
    stages, rows, span = d[STAGES], d[ROWS], 3 * d[ROWS]
    v, gain, way, nodes, m = d[V], d[GAIN], d[WAY], table(d), a_table(d)
    for j in range(stages):
        node = s[nodes + j]
        for i in range(d[MOVING]):
            for c in range(i, i + span, rows):
                s[way + j * span + c] = h * (node * s[v + c] + weighted(s, m + j * stages, gain + c, stages, span))
    return 0


def stage(f: Buffers, n: Buffers, j: int, h: float, to: int) -> int:
    """Put places and velocities of stage ``j`` together, and write their accelerations to ``to``."""
    s = f[0]
    d = n[2]
    rows, span = d[ROWS], 3 * d[ROWS]
    x, v, x_stage, v_stage, gain, way = d[X], d[V], d[X_STAGE], d[V_STAGE], d[GAIN] + j * span, d[WAY] + j * span
    for i in range(d[MOVING]):
        for c in range(i, i + span, rows):
            s[x_stage + c] = s[x + c] + s[way + c]
            s[v_stage + c] = s[v + c] + s[gain + c]
    forces(f, n, x_stage, v_stage, to, d[W_STAGE], later((s[TIME], s[TIME + 1]), s[table(d) + j] * h)[0])
    d[EVALUATIONS] += 1
    return 0


def iterate(f: Buffers, n: Buffers, h: float) -> float:
    """Solve for the stages: minus the number of iterations; or by which factor the step should be tried again."""
    s = f[0]
    d = n[2]
    stages = d[STAGES]
    most, relative = limit_of(stages) + PERSISTENCE * d[FIXED], s[RTOL]
    wanted = max(10.0 * EPSILON / relative, min(0.03, power(relative, NEWTON)))
    rate, theta, quotient_before, old, count = power(max(s[RATE], EPSILON), 0.8), 0.0, 0.0, 0.0, 0.0
    while count < most:
        places(s, d, h)
        for j in range(stages):
            stage(f, n, j, h, d[RIGHT] + j * 3 * d[ROWS])
        correct(s, d, h)
        size = apply(s, d, h)
        count += 1.0
        if not size < 1e300:
            return 0.25
        if count > 1.0:
            here = size / old
            theta = here if count == 2.0 else math.sqrt(here * quotient_before)
            quotient_before = here
            if theta >= 0.99:  # corrections that are small, and shrink no more, are rounding's
                return -count if size < 0.01 else 0.5
            rate = theta / (1.0 - theta)
            expected = rate * size * power(theta, most - 1.0 - count) / wanted
            if expected >= 1.0:
                return 0.8 * power(max(1e-4, min(20.0, expected)), -1.0 / (4.0 + most - 1.0 - count))
        old = max(size, 1e-300)
        if rate * size <= wanted:
            s[RATE], s[THETA] = rate, theta
            return -count
    return 0.5


def correct(s: list[float], d: list[int], h: float) -> int:
    """Turn accelerations at the stages into residuals, and find the corrections: block by block, eigenvalue by eigenvalue."""
    stages, rows, moving, span = d[STAGES], d[ROWS], d[MOVING], 3 * d[ROWS]
    gain, right, put = d[GAIN], d[RIGHT], d[STEP_GAIN]
    inverse = a_table(d) + stages * stages
    for j in range(stages):
        for i in range(moving):
            for c in range(i + j * span, i + (j + 1) * span, rows):
                s[right + c] = s[right + c] - weighted(s, inverse + j * stages, gain + c - j * span, stages, span) / h
                s[put + c] = 0.0
    number = a_table(d) + 3 * stages * stages + stages
    left, left_im, area = d[LEFT], d[LEFT_IM], d[AREA]
    for b in range(d[BLOCKS]):
        block = d[LISTS] + 4 * b
        size, to = 3 * d[block + 1], d[MATRICES] + 2 * area + d[block + 2]
        gather(s, d, block, number + 1 + stages, left)
        solve(s, to, size, d, d[block + 3], left)
        spread(s, d, block, number + 1, left, s[number] / h)
        pair = number + 1 + 2 * stages
        for k in range((stages - 1) // 2):
            gather(s, d, block, pair + 2 + 2 * stages, left)
            gather(s, d, block, pair + 2 + 3 * stages, left_im)
            re = to + (1 + 2 * k) * area
            solve_complex(s, re, re + area, size, d, d[block + 3] + (k + 1) * size, left, left_im)
            double(s, size, s[pair] / h, s[pair + 1] / h, left, left_im)
            spread(s, d, block, pair + 2, left, 1.0)
            spread(s, d, block, pair + 2 + stages, left_im, -1.0)
            pair += 2 + 4 * stages
    return 0


def gather(s: list[float], d: list[int], block: int, weights: int, to: int) -> int:
    """The sum of the residuals of all stages by weight, for the rows of a block, row by row."""
    rows, stages, span, first, right = d[ROWS], d[STAGES], 3 * d[ROWS], d[block], d[RIGHT]
    for m in range(d[block + 1]):
        for c in range(3):
            s[to + 3 * m + c] = weighted(s, weights, right + c * rows + d[first + m], stages, span)
    return 0


def double(s: list[float], size: int, re: float, im: float, left: int, left_im: int) -> int:
    """Multiply by twice an eigenvalue: it stands for its conjugate, too, whose part is the conjugate."""
    for k in range(size):
        x, y = s[left + k], s[left_im + k]
        s[left + k] = 2.0 * (re * x - im * y)
        s[left_im + k] = 2.0 * (re * y + im * x)
    return 0


def spread(s: list[float], d: list[int], block: int, weights: int, by: int, mu: float) -> int:
    """Add ``mu`` times what lies at ``by``, by weight, to the corrections of all stages."""
    rows, stages, span, first, put = d[ROWS], d[STAGES], 3 * d[ROWS], d[block], d[STEP_GAIN]
    for m in range(d[block + 1]):
        for c in range(3):
            to, part = put + c * rows + d[first + m], mu * s[by + 3 * m + c]
            for j in range(stages):
                s[to + j * span] = s[to + j * span] + s[weights + j] * part
    return 0


def apply(s: list[float], d: list[int], h: float) -> float:
    """Correct what the velocities gain; the size of the correction, of places too, in the scales: the largest of all rows."""
    stages, rows, span = d[STAGES], d[ROWS], 3 * d[ROWS]
    gain, put, x_scale, v_scale, m, most = d[GAIN], d[STEP_GAIN], d[X_SCALE], d[V_SCALE], a_table(d), 0.0
    for i in range(d[MOVING]):
        total = 0.0
        for j in range(stages):
            for c in range(i, i + span, rows):
                more = s[put + j * span + c]
                s[gain + j * span + c] = s[gain + j * span + c] + more
                way = h * weighted(s, m + j * stages, put + c, stages, span) / s[x_scale + c]
                more = more / s[v_scale + c]
                total = total + more * more + way * way
        if not total <= most:
            d[LAST_ROW] = i
            most = total if total == total else math.inf
    return math.sqrt(most / stages)


# Linear systems ------------------------------------------------------------------------------------------------------


def differentiate(f: Buffers, n: Buffers) -> int:
    """Find da/dx and da/dv of all blocks where the step begins."""
    s = f[0]
    d = n[2]
    for k in range(d[MATRICES], d[MATRICES] + 2 * d[AREA]):
        s[k] = 0.0
    jacobians(f, n, d[X], d[V], d[MATRICES], d[MATRICES] + d[AREA], s[TIME])
    d[EVALUATIONS] += 1
    d[JACOBIANS] += 1
    return 0


def prepare(s: list[float], d: list[int], h: float) -> bool:
    """Make and factor the systems of all blocks for a step ``h``; False if one is singular."""
    stages, area = d[STAGES], d[AREA]
    number = a_table(d) + 3 * stages * stages + stages
    mu = s[number] / h
    for b in range(d[BLOCKS]):
        block = d[LISTS] + 4 * b
        size, by_x, pivots = 3 * d[block + 1], d[MATRICES] + d[block + 2], d[block + 3]
        by_v, to = by_x + area, by_x + 2 * area
        for k in range(size * size):
            s[to + k] = -mu * s[by_v + k] - s[by_x + k]
        for k in range(to, to + size * size, size + 1):
            s[k] = s[k] + mu * mu
        good = factor(s, to, size, d, pivots)
        pair = number + 1 + 2 * stages
        for p in range((stages - 1) // 2):
            re, im = s[pair] / h, s[pair + 1] / h
            to = by_x + (3 + 2 * p) * area
            for k in range(size * size):
                s[to + k] = -re * s[by_v + k] - s[by_x + k]
                s[to + area + k] = -im * s[by_v + k]
            for k in range(to, to + size * size, size + 1):
                s[k] = s[k] + (re * re - im * im)
                s[k + area] = s[k + area] + 2.0 * re * im
            good = good and factor_complex(s, to, to + area, size, d, pivots + (p + 1) * size)
            pair += 2 + 4 * stages
        if not good:
            d[LAST_ROW] = d[d[block]]
            return False
    return True


def differences(f: Buffers, n: Buffers, x: int, v: int, jx: int, jv: int, now: float) -> int:
    """`jacobians` by differences of the forces, for forces that have no trace: one call for each column of the largest block, or two."""
    s = f[0]
    d = n[2]
    a, w = d[A_STAGE], d[W_STAGE]
    forces(f, n, x, v, a, w, now)
    d[EVALUATIONS] += 1
    columns = 0
    for b in range(d[BLOCKS]):
        columns = max(columns, 3 * d[d[LISTS] + 4 * b + 1])
    for column in range(columns):
        shift(s, d, x, v, column)
        forces(f, n, x, v, d[X_ERROR], w, now)
        divide(s, d, x, column, jx)
        shift(s, d, v, a, column)
        forces(f, n, x, v, d[X_ERROR], w, now)
        divide(s, d, v, column, jv)
        d[EVALUATIONS] += 2
    return 0


def shift(s: list[float], d: list[int], x: int, v: int, column: int) -> int:
    """Shift one component of ``x`` of a row of each block a little; ``v`` is how fast it changes. What it was is kept."""
    for b in range(d[BLOCKS]):
        block = d[LISTS] + 4 * b
        if column < 3 * d[block + 1]:
            row = d[d[block] + column // 3]
            here = x + (column % 3) * d[ROWS] + row
            s[d[LEFT] + b] = s[here]
            size = max(length(s, x + row, d[ROWS]), abs(s[NEXT]) * length(s, v + row, d[ROWS]))
            s[here] = s[here] + 1.5e-8 * (size if size < 1e300 else 1.0) + 1e-3 * s[ATOL]
    return 0


def divide(s: list[float], d: list[int], x: int, column: int, to: int) -> int:
    """Undo `shift`, and add what it has done to the accelerations of its block, by its size, to the matrices at ``to``."""
    rows, shifted, before = d[ROWS], d[X_ERROR], d[A_STAGE]
    for b in range(d[BLOCKS]):
        block = d[LISTS] + 4 * b
        size = 3 * d[block + 1]
        if column < size:
            here = x + (column % 3) * rows + d[d[block] + column // 3]
            way = s[here] - s[d[LEFT] + b]
            s[here] = s[d[LEFT] + b]
            for m in range(size):
                at = (m % 3) * rows + d[d[block] + m // 3]
                if way != 0.0:
                    s[to + d[block + 2] + m * size + column] = (s[shifted + at] - s[before + at]) / way
    return 0


# The error -----------------------------------------------------------------------------------------------------------


def estimate(f: Buffers, n: Buffers, h: float) -> float:
    """The embedded method's estimate of the error, in the scales.

    If it is too large, and the step the first or after a rejected one, it is filtered once more (Hairer, Wanner II, IV.8, (8.20)).
    """
    s = f[0]
    d = n[2]
    stages, rows, span = d[STAGES], d[ROWS], 3 * d[ROWS]
    gain, p, q = d[GAIN], d[P], d[Q]
    weights, inverse = a_table(d) + 3 * stages * stages, a_table(d) + stages * stages
    for i in range(d[MOVING]):
        for c in range(i, i + span, rows):
            s[p + c] = h * weighted(s, weights, gain + c, stages, span)
            total = 0.0
            for j in range(stages):
                total = total + s[weights + j] * weighted(s, inverse + j * stages, gain + c, stages, span)
            s[q + c] = total
    first = h / s[weights + stages]
    error = filtered(s, d, first, d[A])
    if error < 1.0 or not (d[FRESH] == 1 or d[TROUBLE] == 1) or not error < 1e300:
        return error
    x, v, x_stage, v_stage, x_error, v_error = d[X], d[V], d[X_STAGE], d[V_STAGE], d[X_ERROR], d[V_ERROR]
    for i in range(d[MOVING]):
        for c in range(i, i + span, rows):
            s[x_stage + c] = s[x + c] + s[x_error + c]
            s[v_stage + c] = s[v + c] + s[v_error + c]
            s[p + c] = s[p + c] + first * s[v_error + c]
    forces(f, n, x_stage, v_stage, d[A_STAGE], d[W_STAGE], s[TIME])
    d[EVALUATIONS] += 1
    return filtered(s, d, first, d[A_STAGE])


def filtered(s: list[float], d: list[int], first: float, a: int) -> float:
    """Error of places and velocities: mu (mu - J)^-1 of (P, Q + first * acceleration at ``a``); its size in the scales."""
    rows, area, left, x_error, v_error, p, q = d[ROWS], d[AREA], d[LEFT], d[X_ERROR], d[V_ERROR], d[P], d[Q]
    mu = 1.0 / first
    for b in range(d[BLOCKS]):
        block = d[LISTS] + 4 * b
        members, count = d[block], d[block + 1]
        size, by_v = 3 * count, d[MATRICES] + area + d[block + 2]
        for m in range(size):
            here = (m % 3) * rows + d[members + m // 3]
            total = s[q + here] + first * s[a + here] + mu * s[p + here]
            for k in range(size):
                total = total - s[by_v + m * size + k] * s[p + (k % 3) * rows + d[members + k // 3]]
            s[left + m] = mu * total
        solve(s, by_v + area, size, d, d[block + 3], left)
        for m in range(size):
            here = (m % 3) * rows + d[members + m // 3]
            s[x_error + here] = s[left + m]
            s[v_error + here] = mu * (s[left + m] - s[p + here])
    return largest(s, d, x_error, v_error)
