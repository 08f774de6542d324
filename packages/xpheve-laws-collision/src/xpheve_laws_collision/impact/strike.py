"""An impact: both places are brought to its instant, the law is asked, the velocities change. Or it is left to others, and nothing changes."""

from __future__ import annotations

import math
from typing import Any

from xpheve.kernels.clock import elapsed
from xpheve.kernels.flight import turn_uniformly
from xpheve.kernels.quaternion import Quat
from xpheve.kernels.response import (
    APPROACH,
    ASK,
    BODY_A,
    BODY_B,
    IMPULSE,
    INVERSE_MASS,
    NORMAL,
    ORIENTATION,
    POINT,
    POSITION,
    SEPARATION,
    SPEED,
    TIME_OFFSET,
    VALUES,
    VELOCITY,
)
from xpheve.kernels.response import COLUMNS as OF_BODY
from xpheve.kernels.response import INERTIA as MOMENTS
from xpheve.kernels.response import KIND as ANSWER
from xpheve.kernels.response import MASS as WEIGHT
from xpheve.kernels.response import RADIUS as ROUND
from xpheve.kernels.response import SPIN as SPINNING
from xpheve.kernels.response import TIME as WHEN
from xpheve.kernels.vector import Vec, add, cross, dot, norm, scale
from xpheve_laws_collision.impact.cells import begin_again
from xpheve_laws_collision.impact.declared import respond, solid_gap
from xpheve_laws_collision.impact.exchange import impulse, pushed, thrown_back, times
from xpheve_laws_collision.impact.limits import BRIEF, STILL, ULPS, put, vector
from xpheve_laws_collision.impact.meetings import moved, sped
from xpheve_laws_collision.impact.predict import foresee
from xpheve_laws_collision.impact.rows import (
    ASKED,
    BITS,
    BRANCH,
    BY_LAW,
    CAPSULE,
    CELL_AT,
    CENTRE,
    CHANGED,
    CHANGES,
    COLD,
    COLDS,
    COLLAPSED,
    COLUMNS,
    CONTACT,
    COUNT,
    COUNTS,
    EVENT,
    EVENTS,
    FACES,
    FAILED,
    FIXED,
    GRID,
    HEARD,
    IMPACTS,
    INERTIA,
    INVERSE,
    ITS,
    KIND,
    LAST,
    LAW,
    LAW_ROWS,
    LAWS,
    LIMITED,
    LINK,
    LINKS,
    LISTS,
    MASK,
    MASKS,
    MASS,
    OFFSET,
    OWN,
    OWN_COLUMNS,
    PARTNER,
    PLACE,
    PLACES,
    PLANE,
    PULL,
    QUIET,
    RADIUS,
    RANK,
    SCENERIES,
    SCENERY,
    SEEN_BY,
    SHIFT,
    SIZE,
    SKIP,
    SPHERE,
    SPIN,
    STAMP,
    STANDS,
    STATE,
    STATES,
    STREAK,
    STREAK_WITH,
    STREAKED,
    TIME,
    TOUCHED,
    TURN_TIME,
    TURNED,
    TURNING,
    WALL,
    WATCHED,
    WEIGHS,
    WORK,
    WRAPS,
    V,
    X,
)
from xpheve_laws_collision.impact.rows import MOMENTS as ITS_MOMENTS

SHORTEST_FLIGHT = 1e-10  # [s], as in `xpheve_laws_collision.server.pairs`
STREAKS = 8  # dissipative impacts in a row, each less than CLOSE after the last
CLOSE = 1e-7  # [s]

State = tuple[Vec, Vec, Vec]
Instant = tuple[float, float]


def state_at(f: Any, i: int, now: Instant) -> State:
    """Position, velocity and acceleration of place ``i`` at the instant ``now``."""
    state = f[STATE]
    a = STATES * i
    s = elapsed(now, (state[a + TIME], state[a + TIME + 1]))
    pull = vector(state, a + PULL)
    v = vector(state, a + V)
    return (moved(vector(state, a + X), v, pull, s), sped(v, pull, s), pull)


def law_of(n: Any, common: int) -> int:
    """The law of the lowest bit of a mask; -1 for none."""
    bit = 0
    while common & 1 == 0 and bit < BITS - 1:
        common >>= 1
        bit += 1
    law: int = n[LAWS][bit]
    return law


def asked(n: Any, law: int, heard: int) -> int:
    """Write which law answers into ``n[0]``: whether it does so here."""
    if law < 0 or heard:
        return 0
    row = BITS + LAW_ROWS * law
    if n[LAWS][row + BRANCH] < 0:
        return 0
    own = n[LAW]
    own[0] = law
    own[1] = n[LAWS][row + BRANCH]
    own[2] = n[LAWS][row + OFFSET]
    return 1


def turn_now(f: Any, i: int, now: Instant) -> Quat:
    """The orientation of place ``i``; a sphere turns evenly."""
    cold = f[COLD]
    c = COLDS * i
    q = (cold[c + TURNING], cold[c + TURNING + 1], cold[c + TURNING + 2], cold[c + TURNING + 3])
    s = elapsed(now, (cold[c + TURN_TIME], cold[c + TURN_TIME + 1]))
    return turn_uniformly(q, vector(cold, c + SPIN), s)


def tell_place(f: Any, n: Any, at: int, i: int, x: Vec, v: Vec, now: Instant) -> int:
    """Write place ``i`` into the contact, as body at ``at``."""
    contact = f[CONTACT]
    cold = f[COLD]
    c = COLDS * i
    put(contact, at + POSITION, x)
    put(contact, at + VELOCITY, v)
    put(contact, at + SPINNING, vector(cold, c + SPIN))
    q = turn_now(f, i, now)
    for k in range(4):
        contact[at + ORIENTATION + k] = q[k]
    contact[at + WEIGHT] = cold[c + MASS]
    contact[at + INVERSE_MASS] = f[STATE][STATES * i + INVERSE]
    put(contact, at + MOMENTS, vector(cold, c + INERTIA))
    radius = f[STATE][STATES * i + RADIUS]
    contact[at + ROUND] = radius if radius > 0.0 else math.nan
    for k in range(n[COUNTS][OWN_COLUMNS]):
        contact[at + OF_BODY + k] = cold[c + OWN + k]
    return 0


def tell_scenery(f: Any, n: Any, at: int, row: int) -> int:
    """Write fixed shape ``row`` into the contact."""
    contact = f[CONTACT]
    shape = f[SCENERY]
    zero = (0.0, 0.0, 0.0)
    c = SCENERIES * row
    kind = int(shape[c + KIND])
    own = f[COLUMNS]
    o = FIXED * row
    put(contact, at + POSITION, vector(own, o + STANDS))
    put(contact, at + VELOCITY, zero)
    put(contact, at + SPINNING, zero)
    for k in range(4):
        contact[at + ORIENTATION + k] = own[o + FACES + k]
    contact[at + WEIGHT] = own[o + WEIGHS]
    contact[at + INVERSE_MASS] = 0.0
    put(contact, at + MOMENTS, vector(own, o + ITS_MOMENTS))
    contact[at + ROUND] = shape[c + SIZE] if kind == SPHERE or kind == CAPSULE else math.nan
    for k in range(n[COUNTS][OWN_COLUMNS]):
        contact[at + OF_BODY + k] = own[o + ITS + k]
    return 0


def answer(f: Any, n: Any, normal: Vec, point: Vec, approach: float, gap: float, now: Instant) -> int:
    """Ask the law: the kind of its answer."""
    contact = f[CONTACT]
    put(contact, NORMAL, normal)
    put(contact, POINT, point)
    contact[APPROACH] = approach
    contact[SEPARATION] = gap
    contact[WHEN] = now[0]
    contact[TIME_OFFSET] = now[1]
    contact[ANSWER] = ASK
    respond(f, n)
    kind = int(contact[ANSWER])
    return kind


def keep_sum(f: Any, law: int, joules: float) -> int:
    """Add to the work of a law; the sum is compensated (Neumaier)."""
    work = f[WORK]
    before = work[2 * law]
    after = before + joules
    work[2 * law + 1] += (before - after) + joules if abs(before) >= abs(joules) else (joules - after) + before
    work[2 * law] = after
    return 0


def finite(a: Vec) -> bool:
    """Whether all components are numbers."""
    return (a[0] - a[0]) + (a[1] - a[1]) + (a[2] - a[2]) == 0.0


def turned(spin: Vec, inertia: float, arm: Vec, push: Vec) -> Vec:
    """The spin after an impulse at the end of ``arm``."""
    if inertia == 0.0:
        return spin
    change = cross(arm, push)
    return (
        spin[0] + change[0] / inertia + 0.0,
        spin[1] + change[1] / inertia + 0.0,
        spin[2] + change[2] / inertia + 0.0,
    )


def gained(mass: float, before: Vec, after: Vec) -> float:
    """Kinetic energy after less that before [J]."""
    if mass - mass != 0.0:
        return 0.0
    return (
        0.5
        * mass
        * (
            (after[0] - before[0]) * (after[0] + before[0])
            + (after[1] - before[1]) * (after[1] + before[1])
            + (after[2] - before[2]) * (after[2] + before[2])
        )
    )


def streak_of(f: Any, n: Any, i: int, partner: int, now: Instant, alone: int) -> int:
    """How many dissipative impacts place ``i`` has had in close succession, this one included."""
    event = f[EVENT]
    place = n[PLACE]
    p = PLACES * i
    e = EVENTS * i + LAST
    count: int = place[p + STREAK]
    if not elapsed(now, (event[e], event[e + 1])) < CLOSE:
        count = 0
    return count if alone and place[p + STREAK_WITH] == partner else count + 1


def note_streak(f: Any, n: Any, i: int, partner: int, now: Instant, count: int) -> int:
    """Keep it."""
    event = f[EVENT]
    e = EVENTS * i + LAST
    event[e] = now[0]
    event[e + 1] = now[1]
    n[PLACE][PLACES * i + STREAK] = count
    n[PLACE][PLACES * i + STREAK_WITH] = partner
    return 0


def fly_on(f: Any, n: Any, i: int, x: Vec, v: Vec, now: Instant) -> int:
    """Give place ``i`` a new flight from ``now`` on."""
    state = f[STATE]
    place = n[PLACE]
    a = STATES * i
    p = PLACES * i
    put(state, a + X, x)
    put(state, a + V, v)
    state[a + TIME] = now[0]
    state[a + TIME + 1] = now[1]
    n[LINK][LINKS * i + STAMP] += 1
    place[p + QUIET] = 0
    begin_again(f, n, i)
    place[p + CHANGED] += 1
    if place[p + CHANGED] == 1:
        n[LISTS][n[COUNTS][COUNT] + n[COUNTS][CHANGES]] = i
        n[COUNTS][CHANGES] += 1
    return 0


def spin_on(f: Any, n: Any, at: int, i: int, spin: Vec, now: Instant) -> int:
    """Give place ``i``, body at ``at`` of the contact, a new spin from ``now`` on."""
    cold = f[COLD]
    c = COLDS * i
    if spin[0] == cold[c + SPIN] and spin[1] == cold[c + SPIN + 1] and spin[2] == cold[c + SPIN + 2]:
        return 0
    put(cold, c + SPIN, spin)
    for k in range(4):
        cold[c + TURNING + k] = f[CONTACT][at + ORIENTATION + k]
    cold[c + TURN_TIME] = now[0]
    cold[c + TURN_TIME + 1] = now[1]
    n[PLACE][PLACES * i + TURNED] = 1
    return 1


def flight_of(f: Any, i: int) -> tuple[Vec, Vec, Instant, Vec]:
    """The flight of place ``i`` as it is, so that it can be put back."""
    state = f[STATE]
    a = STATES * i
    return (
        vector(state, a + X),
        vector(state, a + V),
        (state[a + TIME], state[a + TIME + 1]),
        vector(state, a + WRAPS),
    )


def put_back(f: Any, n: Any, i: int, flight: tuple[Vec, Vec, Instant, Vec]) -> int:
    """Give place ``i`` the flight back that it had."""
    state = f[STATE]
    p = PLACES * i
    w = STATES * i + WRAPS
    for c in range(3):
        n[PLACE][p + CELL_AT + c] += int(flight[3][c] - state[w + c]) * n[COUNTS][GRID + c]
    put(state, STATES * i + X, flight[0])
    put(state, STATES * i + V, flight[1])
    put(state, w, flight[3])
    state[STATES * i + TIME] = flight[2][0]
    state[STATES * i + TIME + 1] = flight[2][1]
    n[LINK][LINKS * i + STAMP] += 1
    return 0


def parted(f: Any, n: Any, law: int, joules: float) -> int:
    """Book an impact that was answered by ``law``."""
    n[LAWS][BITS + LAW_ROWS * law + ASKED] += 1
    n[COUNTS][IMPACTS] += 1
    if joules != 0.0:
        keep_sum(f, law, joules)
    return 0


def too_short(restitution: float, parting: float, closing: float) -> bool:
    """Whether bounces have become so short that Python ends them in closed form."""
    return restitution < 1.0 and closing < 0.0 and -2.0 * parting / closing < SHORTEST_FLIGHT


def changed(
    contact: Any,
    kind: int,
    normal: Vec,
    approach: float,
    lever_a: float,
    lever_b: float,
    va: Vec,
    vb: Vec,
    spin_a: Vec,
    spin_b: Vec,
) -> tuple[int, Vec, Vec, Vec, Vec, float, float]:
    """What a law's answer makes of a pair.

    Returns
    -------
    tuple
        Whether it could be used; both velocities and both spins; the coefficient of restitution (1 for answers of other kinds), and the
        work done [J].
    """
    light_a = contact[BODY_A + INVERSE_MASS]
    light_b = contact[BODY_B + INVERSE_MASS]
    if kind == SPEED:
        value = contact[VALUES]
        if not (value >= 0.0 and value < math.inf):
            return (0, va, vb, spin_a, spin_b, 1.0, 0.0)
        restitution = value / approach
        if light_a + light_b == 0.0:
            return (1, va, vb, spin_a, spin_b, restitution, 0.0)
        push = impulse(normal, va, vb, light_a, light_b, restitution)
        new_a = pushed(va, normal, times(push, (0.0 - light_a, 0.0)))
        new_b = pushed(vb, normal, times(push, (light_b, 0.0)))
        joules = 0.5 * push[0] * approach * (restitution - 1.0) if restitution != 1.0 else 0.0
        return (1, new_a, new_b, spin_a, spin_b, restitution, joules)
    given = vector(contact, VALUES)
    if kind == IMPULSE:
        back = (0.0 - given[0], 0.0 - given[1], 0.0 - given[2])
        new_a = no_minus_zero(add(va, scale(back, light_a)))
        new_b = no_minus_zero(add(vb, scale(given, light_b)))
        new_spin_a = spin_a
        new_spin_b = spin_b
        if light_a > 0.0:
            new_spin_a = turned(spin_a, contact[BODY_A + MOMENTS], scale(normal, lever_a), back)
        if light_b > 0.0:
            new_spin_b = turned(spin_b, contact[BODY_B + MOMENTS], scale(normal, 0.0 - lever_b), given)
    else:
        new_a = no_minus_zero(given) if light_a > 0.0 else va
        new_b = no_minus_zero(vector(contact, VALUES + 3)) if light_b > 0.0 else vb
        new_spin_a = spin_a
        new_spin_b = spin_b
    joules = gained(contact[BODY_A + WEIGHT], va, new_a) + gained(contact[BODY_B + WEIGHT], vb, new_b)
    joules += gained(contact[BODY_A + MOMENTS], spin_a, new_spin_a)
    joules += gained(contact[BODY_B + MOMENTS], spin_b, new_spin_b)
    # Who takes an impact over has to part the pair: if not, Python says so
    apart = dot(normal, (new_b[0] - new_a[0], new_b[1] - new_a[1], new_b[2] - new_a[2]))
    fits = apart >= 0.0 - 1e-12 * approach and joules - joules == 0.0
    fits = fits and finite(new_spin_a) and finite(new_spin_b)
    return (1 if fits else 0, new_a, new_b, new_spin_a, new_spin_b, 1.0, joules)


def no_minus_zero(a: Vec) -> Vec:
    """``a`` without zeros of minus sign."""
    return (a[0] + 0.0, a[1] + 0.0, a[2] + 0.0)


def with_place(f: Any, n: Any, i: int, now: Instant) -> int:
    """The impact of ``i`` and its partner ``now``: why the loop has to stop, or `LIMITED`."""
    place = n[PLACE]
    j = place[PLACES * i + PARTNER]
    shift = vector(f[EVENT], EVENTS * i + SHIFT)
    if place[PLACES * j + RANK] < place[PLACES * i + RANK]:
        i, j = j, i
        shift = (0.0 - shift[0], 0.0 - shift[1], 0.0 - shift[2])
    p = PLACES * i
    q = PLACES * j
    law = law_of(n, n[LINK][LINKS * i + MASK] & n[LINK][LINKS * j + MASK])
    if not asked(n, law, place[p + HEARD] & place[q + HEARD]):
        return BY_LAW
    if place[p + SKIP] >= 0 or place[q + SKIP] >= 0:
        return TOUCHED
    state = f[STATE]
    xa, va, pull_a = state_at(f, i, now)
    xb, vb, pull_b = state_at(f, j, now)
    d = ((xb[0] - xa[0]) + shift[0], (xb[1] - xa[1]) + shift[1], (xb[2] - xa[2]) + shift[2])
    length = norm(d)
    normal = scale(d, 1.0 / length) if length > 0.0 else (0.0, 0.0, 1.0)
    w = (vb[0] - va[0], vb[1] - va[1], vb[2] - va[2])
    approach = 0.0 - dot(normal, w)
    bend = max((dot(w, w) - approach * approach) / length, 0.0) if length > 0.0 else 0.0
    closing = dot(normal, (pull_b[0] - pull_a[0], pull_b[1] - pull_a[1], pull_b[2] - pull_a[2])) + bend
    if not approach - approach == 0.0:
        return FAILED
    if not approach > STILL * (norm(va) + norm(vb)) + BRIEF * max(0.0, 0.0 - closing):
        fly_on(f, n, i, xa, va, now)
        fly_on(f, n, j, xb, vb, now)
        foresee(f, n, i, j, -1, now)
        foresee(f, n, j, i, -1, now)
        return LIMITED
    gap = length - (state[STATES * i + RADIUS] + state[STATES * j + RADIUS])
    tell_place(f, n, BODY_A, i, xa, va, now)
    tell_place(f, n, BODY_B, j, add(xa, d), vb, now)
    lever = state[STATES * i + RADIUS] + 0.5 * gap
    kind = answer(f, n, normal, add(xa, scale(normal, lever)), approach, gap, now)
    if kind == ASK:
        return BY_LAW
    cold = f[COLD]
    spin_a = vector(cold, COLDS * i + SPIN)
    spin_b = vector(cold, COLDS * j + SPIN)
    fits, new_a, new_b, spin_a, spin_b, restitution, joules = changed(
        f[CONTACT], kind, normal, approach, lever, length - lever, va, vb, spin_a, spin_b
    )
    if not fits or not finite(new_a) or not finite(new_b):
        return FAILED
    if too_short(restitution, restitution * approach, closing):
        return COLLAPSED
    loses = restitution < 1.0 or joules < 0.0
    count_a = streak_of(f, n, i, j, now, 0) if loses else 0
    count_b = streak_of(f, n, j, i, now, 0) if loses else 0
    if count_a >= STREAKS or count_b >= STREAKS:
        return STREAKED
    was_a = flight_of(f, i)
    was_b = flight_of(f, j)
    fly_on(f, n, i, xa, new_a, now)
    fly_on(f, n, j, xb, new_b, now)
    if foresee(f, n, i, j, -1, now) + foresee(f, n, j, i, -1, now):
        put_back(f, n, i, was_a)
        put_back(f, n, j, was_b)
        foresee(f, n, i, -1, -1, now)
        foresee(f, n, j, -1, -1, now)
        return TOUCHED
    spin_on(f, n, BODY_A, i, spin_a, now)
    spin_on(f, n, BODY_B, j, spin_b, now)
    if loses:
        note_streak(f, n, i, j, now, count_a)
        note_streak(f, n, j, i, now, count_b)
    parted(f, n, law, joules)
    return SEEN_BY if place[p + WATCHED] | place[q + WATCHED] else LIMITED


def stand(shape: Any, row: int, x: Vec, v: Vec, pull: Vec, radius: float) -> tuple[float, Vec, float]:
    """Gap [m] between a place and a fixed shape, unit normal towards the shape, and second rate of the gap."""
    c = SCENERIES * row
    kind = int(shape[c + KIND])
    if kind == PLANE:
        out = vector(shape, c + CENTRE)
        gap = dot(out, x) - shape[c + SIZE] - radius
        return (gap, (0.0 - out[0], 0.0 - out[1], 0.0 - out[2]), dot(out, pull))
    if kind != SPHERE:
        return solid_gap(shape, c, x, v, pull, radius)
    centre = vector(shape, c + CENTRE)
    d = (centre[0] - x[0], centre[1] - x[1], centre[2] - x[2])
    length = norm(d)
    normal = scale(d, 1.0 / length) if length > 0.0 else (0.0, 0.0, 1.0)
    speed = dot(normal, v)
    bend = max((dot(v, v) - speed * speed) / length, 0.0) if length > 0.0 else 0.0
    return (length - radius - shape[c + SIZE], normal, bend - dot(normal, pull))


def with_wall(f: Any, n: Any, i: int, now: Instant) -> int:
    """The impact of ``i`` and a fixed shape ``now``: why the loop has to stop, or `LIMITED`."""
    place = n[PLACE]
    p = PLACES * i
    wall = place[p + WALL]
    law = law_of(n, n[LINK][LINKS * i + MASK] & n[MASKS][2 * wall])
    if not asked(n, law, place[p + HEARD] & n[MASKS][2 * wall + 1]):
        return BY_LAW
    if place[p + SKIP] >= 0:
        return TOUCHED
    state = f[STATE]
    radius = state[STATES * i + RADIUS]
    x, v, pull = state_at(f, i, now)
    gap, normal, closing = stand(f[SCENERY], wall, x, v, pull, radius)
    approach = dot(normal, v)
    if not approach - approach == 0.0:
        return FAILED
    if f[SCENERY][SCENERIES * wall + KIND] == PLANE and gap != 0.0:  # take out the rounding of a long flight
        if abs(gap) <= ULPS * (norm(vector(state, STATES * i + X)) + norm(x)):
            x = add(x, scale(normal, gap))
    if not approach > STILL * norm(v) + BRIEF * max(0.0, 0.0 - closing):
        fly_on(f, n, i, x, v, now)
        foresee(f, n, i, -1, wall, now)
        return LIMITED
    zero = (0.0, 0.0, 0.0)
    tell_place(f, n, BODY_A, i, x, v, now)
    tell_scenery(f, n, BODY_B, wall)
    kind = answer(f, n, normal, add(x, scale(normal, radius + 0.5 * gap)), approach, gap, now)
    contact = f[CONTACT]
    spin = vector(f[COLD], COLDS * i + SPIN)
    restitution = 1.0
    joules = 0.0
    new = v
    if kind == ASK:
        return BY_LAW
    if kind == SPEED:
        value = contact[VALUES]
        if not (value >= 0.0 and value < math.inf):
            return FAILED
        restitution = value / approach
        new = thrown_back(normal, v, restitution)
        if restitution != 1.0:
            joules = 0.5 * contact[BODY_A + WEIGHT] * approach * approach * (restitution * restitution - 1.0)
    else:
        fits, new, _, spin, _, restitution, joules = changed(
            contact, kind, normal, approach, radius + 0.5 * gap, 0.0, v, zero, spin, zero
        )
        if not fits:
            return FAILED
    if not finite(new):
        return FAILED
    if too_short(restitution, restitution * approach, closing):
        return COLLAPSED
    loses = restitution < 1.0 or joules < 0.0
    count = streak_of(f, n, i, -1 - wall, now, 1 if closing < 0.0 else 0) if loses else 0
    if count >= STREAKS:
        return STREAKED
    was = flight_of(f, i)
    fly_on(f, n, i, x, new, now)
    if foresee(f, n, i, -1, wall, now):
        put_back(f, n, i, was)
        foresee(f, n, i, -1, -1, now)
        return TOUCHED
    spin_on(f, n, BODY_A, i, spin, now)
    if loses:
        note_streak(f, n, i, -1 - wall, now, count)
    parted(f, n, law, joules)
    return SEEN_BY if place[p + WATCHED] else LIMITED
