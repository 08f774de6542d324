"""When a ball meets a box that does not turn, under constant relative acceleration.

The distance of a point from a box is known part by part: beyond one face it is linear in the point, beyond two or three its square is a
sum of squares. The point passes from one part to another where one of its coordinates passes that of a face, which are roots of
quadratic equations. They cut the flight into pieces, and on each of them the gap has the sign of a polynomial of degree two or four. It
goes on without a jump, and so does its slope, so that no impact is lost where two pieces join: one piece ends positive, or the next one
starts by having arrived. A box without width and depth is a segment, and a ball that meets that one meets a capsule.
"""

import math

from xpheve.kernels.polynomial import derivative, first_crossing, quadratic_roots, value
from xpheve.kernels.vector import Vec, dot, norm, scale

FAST = 1e150  # [m^2/s^2] of a speed squared: the squares of these are near the end of floats
PIECES = 64  # a flight has at most 13, of which one inside may be cut 11 times more
GRAZES = 3  # in one piece
TICK = 2.0**-52  # of the time: the least by which a search goes on


def flown(d0: Vec, d1: Vec, d2: Vec, s: float) -> Vec:
    """Where the ball's centre is after ``s`` [s]: d0 + d1 s + d2 s^2 / 2 [m]."""
    h = 0.5 * s
    return (
        d0[0] + s * (d1[0] + h * d2[0]),
        d0[1] + s * (d1[1] + h * d2[1]),
        d0[2] + s * (d1[2] + h * d2[2]),
    )


def speed_at(d1: Vec, d2: Vec, s: float) -> Vec:
    """Its velocity then [m/s]."""
    return (d1[0] + s * d2[0], d1[1] + s * d2[1], d1[2] + s * d2[2])


def standing(p: Vec, half: Vec) -> tuple[float, float, float, float]:
    """Distance [m] of a point from the box with half edges ``half`` [m], less than 0 inside, and the unit vector from the box to it.

    Inside it is the least depth, along the axis of that face.
    """
    x = p[0] - min(max(p[0], -half[0]), half[0])
    y = p[1] - min(max(p[1], -half[1]), half[1])
    z = p[2] - min(max(p[2], -half[2]), half[2])
    distance = norm((x, y, z))
    if distance > 0.0:
        return (distance, x / distance, y / distance, z / distance)
    x = abs(p[0]) - half[0]
    y = abs(p[1]) - half[1]
    z = abs(p[2]) - half[2]
    if x >= y and x >= z:
        return (x, math.copysign(1.0, p[0]), 0.0, 0.0)
    if y >= z:
        return (y, 0.0, math.copysign(1.0, p[1]), 0.0)
    return (z, 0.0, 0.0, math.copysign(1.0, p[2]))


def second_rate(p: Vec, v: Vec, a: Vec, half: Vec) -> float:
    """Second rate [m/s^2] of that distance: what the acceleration does along the direction, and how the way bends about an edge."""
    distance, x, y, z = standing(p, half)
    bend = x * a[0] + y * a[1] + z * a[2]
    if distance > 0.0:
        u = v[0] if is_beyond(p[0], v[0], half[0]) else 0.0
        w = v[1] if is_beyond(p[1], v[1], half[1]) else 0.0
        q = v[2] if is_beyond(p[2], v[2], half[2]) else 0.0
        along = x * u + y * w + z * q
        across = norm((u - along * x, w - along * y, q - along * z))
        bend += across * across / distance
    return bend


def is_beyond(p: float, v: float, half: float) -> bool:
    """Whether a coordinate is beyond its faces, or will be at once."""
    return abs(p) > half or half == 0.0 or (abs(p) == half and p * v > 0.0)


def ball_box(d0: Vec, d1: Vec, d2: Vec, half: Vec, radius: float, touch: float, still: float, horizon: float) -> float:
    """Time [s] in [0, horizon] until a ball touches a box and approaches; infinite if it does not.

    Parameters
    ----------
    d0, d1, d2
        The ball's centre from the middle of the box [m], its rate [m/s], its constant second rate [m/s^2]; in the frame of the box,
        which does not turn.
    half
        Half edges of the box [m]; two of them may be 0.
    radius
        Of the ball [m]; of a point 0.
    touch, still
        The gap [m] that counts as touching, the speed [m/s] that counts as none.
    horizon
        [s], may be infinite.

    Returns
    -------
    float
        As `sphere_plane`: 0 when touching or overlapping and approaching; what touches and separates is found when it comes back,
        also on another face; what overlaps and turns back before it is out, at the instant it turns; what touches or overlaps and
        is still, when it comes back if its way bends off the box, else never. A graze, which arrives with no speed, is none.

    Notes
    -----
    The gap at the time returned is within a few units in the last place of the lengths at hand.
    """
    if not dot(d1, d1) < FAST:
        fastest = max(abs(d1[0]), abs(d1[1]), abs(d1[2]))
        if not fastest < math.inf:
            return math.inf
        unit = math.ldexp(1.0, -math.frexp(fastest)[1])
        slow = scale(d1, unit)
        bent = scale(scale(d2, unit), unit)
        return unit * slow_ball_box(d0, slow, bent, half, radius, touch, still * unit, horizon / unit)
    return slow_ball_box(d0, d1, d2, half, radius, touch, still, horizon)


def slow_ball_box(
    d0: Vec, d1: Vec, d2: Vec, half: Vec, radius: float, touch: float, still: float, horizon: float
) -> float:
    """The same at speeds of which the squares are floats."""
    distance, x, y, z = standing(d0, half)
    gap = distance - radius
    speed = x * d1[0] + y * d1[1] + z * d1[2]
    if gap <= touch:
        if speed < -still:
            return 0.0
        if d2[0] == 0.0 and d2[1] == 0.0 and d2[2] == 0.0:
            return math.inf  # distance from what is convex is convex along a line
        if speed <= still and second_rate(d0, d1, d2, half) < 0.0:
            return math.inf  # a support
        # A gap that counts as none is none.
        reach = distance if gap >= -touch else radius
        last = min(gone(d0, d1, d2, half, reach), horizon)
        rising = speed > still
        time = after_touch(d0, d1, d2, half, reach, radius, still, last, rising)
        return time if time <= horizon else math.inf
    first, last = entered(d0, d1, d2, half, radius, horizon)
    if not first <= last:
        return math.inf
    if first > 0.0 and lands_on_face(d0, d1, d2, half, radius, touch, still, first):
        return first
    time = met(d0, d1, d2, half, radius, radius, still, first, last)
    return time if time <= horizon else math.inf


# The box with faces moved out by the radius: outside it nothing touches


def between(p: float, v: float, a: float, reach: float) -> tuple[float, float]:
    """First and last time [s] from 0 on at which a coordinate is within ``reach`` [m] of 0; the first is infinite if it never is."""
    low, high = quadratic_roots(p - reach, v, 0.5 * a)
    low_2, high_2 = quadratic_roots(p + reach, v, 0.5 * a)
    last = -math.inf
    for root in (low, high, low_2, high_2):
        if last < root < math.inf:
            last = root
    if abs(p) <= reach:
        return (0.0, last if last > -math.inf else math.inf)
    if p < 0.0:
        low = low_2
        high = high_2
    first = low if low > 0.0 else high
    return (first if first > 0.0 else math.inf, last)


def entered(d0: Vec, d1: Vec, d2: Vec, half: Vec, radius: float, horizon: float) -> tuple[float, float]:
    """Times between which all that touches has to be; the first is later than the last if nothing can."""
    first = 0.0
    last = horizon
    for k in (0, 1, 2):
        if first <= last:
            low, high = between(d0[k], d1[k], d2[k], half[k] + radius)
            first = max(first, low)
            last = min(last, high)
    return (first, last)


def gone(d0: Vec, d1: Vec, d2: Vec, half: Vec, radius: float) -> float:
    """When the ball has left for ever."""
    last = math.inf
    for k in (0, 1, 2):
        last = min(last, between(d0[k], d1[k], d2[k], half[k] + radius)[1])
    return last


def lands_on_face(d0: Vec, d1: Vec, d2: Vec, half: Vec, radius: float, touch: float, still: float, s: float) -> bool:
    """Whether it arrives at one face, and stands over no other, when it comes into the larger box."""
    p = flown(d0, d1, d2, s)
    beyond = 0
    for k in (0, 1, 2):
        if abs(p[k]) > half[k]:
            beyond += 1
    distance, x, y, z = standing(p, half)
    if beyond > 1 or distance - radius > touch or (beyond == 0 and radius > 0.0):
        return False
    return dot((x, y, z), speed_at(d1, d2, s)) < -still


# Pieces of the flight


def cuts_of(p: float, v: float, a: float, half: float) -> tuple[float, float, float, float]:
    """When a coordinate passes a face."""
    low, high = quadratic_roots(p - half, v, 0.5 * a)
    low_2, high_2 = quadratic_roots(p + half, v, 0.5 * a)
    return (low, high, low_2, high_2)


def next_of(cuts: tuple[float, float, float, float], after: float, least: float) -> float:
    """The first of ``cuts`` after ``after``, if it is before ``least``; else that."""
    for k in (0, 1, 2, 3):
        if after < cuts[k] < least:
            least = cuts[k]
    return least


def side_of(p: float, half: float) -> float:
    """Beyond which face: -1, 1, or 0 between them."""
    if p > half:
        return 1.0
    if p < -half:
        return -1.0
    return 0.0


def sides_of(p: Vec, half: Vec) -> Vec:
    """Beyond which faces; a segment along z has all others beside it."""
    if half[0] == 0.0 and half[1] == 0.0:
        return (1.0, 1.0, side_of(p[2], half[2]))
    return (side_of(p[0], half[0]), side_of(p[1], half[1]), side_of(p[2], half[2]))


def face_inside(p: Vec, v: Vec, half: Vec) -> Vec:
    """The face nearest to a point inside, as sides; of equally near ones that which it is nearest to just after."""
    best = (1.0, 0.0, 0.0)
    highest = -math.inf
    fastest = -math.inf
    for k in (0, 1, 2):
        for side in (1.0, -1.0):
            level = side * p[k] - half[k]
            rate = side * v[k]
            if level > highest or (level == highest and rate > fastest):
                highest = level
                fastest = rate
                best = (side if k == 0 else 0.0, side if k == 1 else 0.0, side if k == 2 else 0.0)
    return best


def other_face(p: Vec, v: Vec, a: Vec, half: Vec, face: Vec, end: float) -> float:
    """When another face is nearer to a point inside; ``end`` [s] if none is before."""
    level = dot(face, p) - (abs(face[0]) * half[0] + abs(face[1]) * half[1] + abs(face[2]) * half[2])
    rate = dot(face, v)
    bend = 0.5 * dot(face, a)
    for k in (0, 1, 2):
        for side in (1.0, -1.0):
            if face[k] != side:
                lead = 0.5 * side * a[k]
                low, high = quadratic_roots(level - (side * p[k] - half[k]), rate - side * v[k], bend - lead)
                passed = high if bend < lead else low
                if 0.0 < passed < end:
                    end = passed
    return end


def piece(p: Vec, v: Vec, a: Vec, half: Vec, sides: Vec, reach: float) -> tuple[float, float, float, float, float]:
    """The polynomial [m or m^2] that has the sign of the gap while the ball is beyond ``sides``."""
    x = p[0] - sides[0] * half[0] if sides[0] != 0.0 else 0.0
    y = p[1] - sides[1] * half[1] if sides[1] != 0.0 else 0.0
    z = p[2] - sides[2] * half[2] if sides[2] != 0.0 else 0.0
    v = (v[0] if sides[0] != 0.0 else 0.0, v[1] if sides[1] != 0.0 else 0.0, v[2] if sides[2] != 0.0 else 0.0)
    a = (a[0] if sides[0] != 0.0 else 0.0, a[1] if sides[1] != 0.0 else 0.0, a[2] if sides[2] != 0.0 else 0.0)
    if abs(sides[0]) + abs(sides[1]) + abs(sides[2]) == 1.0:
        level = sides[0] * x + sides[1] * y + sides[2] * z
        return (level - reach, dot(sides, v), 0.5 * dot(sides, a), 0.0, 0.0)
    d = (x, y, z)
    distance = norm(d)
    return (
        (distance - reach) * (distance + reach),
        2.0 * dot(d, v),
        dot(v, v) + dot(d, a),
        dot(v, a),
        0.25 * dot(a, a),
    )


def crossing(
    c: tuple[float, float, float, float, float], start: float, end: float, slow: float, arrived: bool
) -> float:
    """The first time in [start, end] at which the polynomial has gone from positive to not positive, and no graze.

    ``arrived`` says that it was positive before the start: then the crossing may have been there. ``slow`` is a slope that is none.
    """
    slopes = derivative(c)
    if arrived and value(c, start) <= 0.0 and value(slopes, start) < 0.0:
        return start
    bends = derivative(slopes)
    s = start
    for _ in range(GRAZES):
        s = first_crossing(c, s, end)
        if s == math.inf:
            return math.inf
        if value(slopes, s) < -slow or value(bends, s) <= 0.0:
            return s
    return math.inf


def refined(d0: Vec, d1: Vec, d2: Vec, half: Vec, radius: float, s: float, side: float) -> float:
    """The time near ``s`` at which the gap itself is smallest, by Newton steps as long as they help.

    ``side`` is 1 where the ball parts from the box, -1 where it comes.
    """
    best = s
    least = math.inf
    for _ in range(4):
        p = flown(d0, d1, d2, s)
        distance, x, y, z = standing(p, half)
        gap = distance - radius
        rate = dot((x, y, z), speed_at(d1, d2, s))
        if not (abs(gap) < least and s >= 0.0 and rate * side > 0.0):
            return best
        best = s
        least = abs(gap)
        s = s - gap / rate
    return best


def piece_at(d0: Vec, d1: Vec, d2: Vec, half: Vec, t: float, end: float) -> tuple[float, float, float, float]:
    """Beyond which faces the ball is from ``t`` on, and until when: not after ``end``."""
    line = half[0] == 0.0 and half[1] == 0.0
    for k in (0, 1, 2):
        if k == 2 or not line:
            end = next_of(cuts_of(d0[k], d1[k], d2[k], half[k]), t, end)
    middle = t + 0.5 * (end - t) if end < math.inf else t + max(1.0, t)
    sides = sides_of(flown(d0, d1, d2, middle), half)
    if sides[0] == 0.0 and sides[1] == 0.0 and sides[2] == 0.0:
        p = flown(d0, d1, d2, t)
        v = speed_at(d1, d2, t)
        sides = face_inside(p, v, half)
        end = t + other_face(p, v, d2, half, sides, end - t)
    return (sides[0], sides[1], sides[2], end)


def met(
    d0: Vec, d1: Vec, d2: Vec, half: Vec, reach: float, radius: float, still: float, start: float, last: float
) -> float:
    """When a ball that is apart at ``start`` meets the box: of radius ``reach`` [m] in the search, ``radius`` in the end."""
    t = start
    arrived = t > 0.0
    for _ in range(PIECES):
        x, y, z, end = piece_at(d0, d1, d2, half, t, last)
        p = flown(d0, d1, d2, t)
        c = piece(p, speed_at(d1, d2, t), d2, half, (x, y, z), reach)
        slow = still if abs(x) + abs(y) + abs(z) == 1.0 else 2.0 * reach * still
        s = crossing(c, 0.0, end - t, slow, arrived)
        if s < math.inf:
            return refined(d0, d1, d2, half, radius, t + s, -1.0)
        if not end < last:
            return math.inf
        t = end if end > t else t + max(TICK * t, 1e-300)
        arrived = True
    return math.inf


def after_touch(
    d0: Vec,
    d1: Vec,
    d2: Vec,
    half: Vec,
    reach: float,
    radius: float,
    still: float,
    last: float,
    rising: bool,
) -> float:
    """When what touches or overlaps and does not approach is back; when it turns if it turns before it is out."""
    t = 0.0
    for _ in range(PIECES):
        x, y, z, end = piece_at(d0, d1, d2, half, t, last)
        p = flown(d0, d1, d2, t)
        c = piece(p, speed_at(d1, d2, t), d2, half, (x, y, z), reach)
        slopes = derivative(c)
        slow = still if abs(x) + abs(y) + abs(z) == 1.0 else 2.0 * reach * still
        turn = math.inf
        if rising and c[1] <= 0.0 and (c[1] < -slow or c[2] <= 0.0):
            turn = 0.0
        elif end > t:
            turn = first_crossing(slopes, 0.0, end - t)
        until = min(turn, end - t)
        if until < math.inf and value(c, until) > 0.0:
            s = crossing(c, until, end - t, slow, False)
            if s < math.inf:
                return refined(d0, d1, d2, half, radius, t + s, -1.0)
            if not end < last:
                return math.inf
            return met(d0, d1, d2, half, reach, radius, still, end, last)
        if turn < math.inf:
            return t + turn
        if not end < last:
            return math.inf
        rising = value(slopes, end - t) > 0.0
        t = end if end > t else t + max(TICK * t, 1e-300)
    return math.inf


def ball_box_leaves(d0: Vec, d1: Vec, d2: Vec, half: Vec, radius: float, horizon: float) -> float:
    """Time [s] in [0, horizon] at which the gap goes from at most 0 to more; infinite if it does not.

    Units as in `ball_box`. A gap of exactly 0 that opens leaves at 0; a positive gap has to close first. To touch 0 from inside and
    fall back is not to leave.
    """
    if not dot(d1, d1) < FAST:
        fastest = max(abs(d1[0]), abs(d1[1]), abs(d1[2]))
        if not fastest < math.inf:
            return math.inf
        unit = math.ldexp(1.0, -math.frexp(fastest)[1])
        slow = scale(d1, unit)
        bent = scale(scale(d2, unit), unit)
        return unit * slow_ball_box_leaves(d0, slow, bent, half, radius, horizon / unit)
    return slow_ball_box_leaves(d0, d1, d2, half, radius, horizon)


def slow_ball_box_leaves(d0: Vec, d1: Vec, d2: Vec, half: Vec, radius: float, horizon: float) -> float:
    """The same at speeds of which the squares are floats."""
    distance, x, y, z = standing(d0, half)
    gap = distance - radius
    speed = dot((x, y, z), d1)
    if gap == 0.0 and (speed > 0.0 or (speed == 0.0 and second_rate(d0, d1, d2, half) > 0.0)):
        return 0.0
    last = gone(d0, d1, d2, half, radius)
    inside = gap <= 0.0
    t = 0.0
    for _ in range(PIECES):
        x, y, z, end = piece_at(d0, d1, d2, half, t, last)
        c = piece(flown(d0, d1, d2, t), speed_at(d1, d2, t), d2, half, (x, y, z), radius)
        s = parting(c, end - t, inside)
        if s < math.inf:
            s = refined(d0, d1, d2, half, radius, t + s, 1.0)
            return s if s <= horizon else math.inf
        inside = value(c, end - t) <= 0.0 if end < math.inf else inside
        if not end < last or end > horizon:
            break
        t = end if end > t else t + max(TICK * t, 1e-300)
    return last if inside and last <= horizon else math.inf


def parting(c: tuple[float, float, float, float, float], end: float, inside: bool) -> float:
    """The first time in [0, end] at which the polynomial goes from at most 0 to more, and does not only touch 0; else infinite."""
    slopes = derivative(c)
    if inside and c[0] > 0.0 and c[1] >= 0.0:
        return 0.0
    outward = (-c[0], -c[1], -c[2], -c[3], -c[4])
    s = 0.0
    for _ in range(GRAZES):
        if c[0] > 0.0 and s == 0.0:
            s = first_crossing(c, 0.0, end)
            if s == math.inf:
                return math.inf
        s = first_crossing(outward, s, end)
        if s == math.inf:
            return math.inf
        turn = first_crossing(slopes, s, math.inf)
        if turn == math.inf or value(c, turn) > 0.0:
            return s
        s = turn
    return math.inf
