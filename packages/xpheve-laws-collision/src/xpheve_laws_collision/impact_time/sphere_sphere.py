"""When two spheres meet, under constant relative acceleration."""

import math

from xpheve.kernels.polynomial import derivative, difference_of_products, first_crossing, value
from xpheve.kernels.vector import Vec, dot, norm, scale


def offset_at(d0: Vec, d1: Vec, d2: Vec, s: float) -> Vec:
    """The centre offset d0 + d1 s + d2 s^2 / 2 [m] after ``s`` [s]."""
    h = 0.5 * s
    return (
        d0[0] + s * (d1[0] + h * d2[0]),
        d0[1] + s * (d1[1] + h * d2[1]),
        d0[2] + s * (d1[2] + h * d2[2]),
    )


def separation_polynomial(d0: Vec, d1: Vec, d2: Vec, distance: float) -> tuple[float, float, float, float, float]:
    """Coefficients of |d(s)|^2 - distance^2 [m^2], which has the sign of the gap."""
    r = norm(d0)
    return (
        (r - distance) * (r + distance),
        2.0 * dot(d0, d1),
        dot(d1, d1) + dot(d0, d2),
        dot(d1, d2),
        0.25 * dot(d2, d2),
    )


def chord(d0: Vec, d1: Vec, distance: float) -> float:
    """|d| times the speed of approach at which the line d0 + d1 s meets the sphere |d| = distance [m^2/s]; 0 on a miss.

    The root of the discriminant, distance^2 |d1|^2 - |d0 x d1|^2: nothing cancels but the miss distance.
    """
    across = norm(
        (
            difference_of_products(d0[1], d1[2], d0[2], d1[1]),
            difference_of_products(d0[2], d1[0], d0[0], d1[2]),
            difference_of_products(d0[0], d1[1], d0[1], d1[0]),
        )
    )
    reach = norm(d1) * distance
    if across >= reach:
        return 0.0
    return math.sqrt((reach - across) * (reach + across))


def polished(
    d0: Vec,
    d1: Vec,
    d2: Vec,
    distance: float,
    s: float,
) -> float:
    """The time near ``s`` at which |d| - distance itself is smallest, by Newton steps as long as they help.

    The squares in the polynomial cost digits when the spheres start many diameters apart.
    """
    best = s
    least = math.inf
    side = 0.0
    for _ in range(4):
        d = offset_at(d0, d1, d2, s)
        r = norm(d)
        gap = r - distance
        rate = dot(d, (d1[0] + s * d2[0], d1[1] + s * d2[1], d1[2] + s * d2[2]))
        if side == 0.0:
            side = rate
        # Where the spheres almost graze a step could reach the other root, where they part.
        if not (abs(gap) < least and s >= 0.0 and rate * side > 0.0):
            return best
        best = s
        least = abs(gap)
        s = s - gap * r / rate
    return best


FAST = 1e150  # [m^2/s^2] of a speed squared: the squares of these are near the end of floats


def unit_of_time(d1: Vec) -> float:
    """A power of two [s] in which fast bodies go about 1 m: in it their squares are numbers, and no bit is lost.

    0 where a component of ``d1`` [m/s] is infinite, or not a number.
    """
    fastest = max(abs(d1[0]), abs(d1[1]), abs(d1[2]))
    if not fastest < math.inf:
        return 0.0
    return math.ldexp(1.0, -math.frexp(fastest)[1])


def sphere_sphere(
    d0: Vec,
    d1: Vec,
    d2: Vec,
    distance: float,
    touch: float,
    still: float,
    horizon: float,
) -> float:
    """Time [s] in [0, horizon] until two spheres touch and approach; infinite if they do not.

    Parameters
    ----------
    d0, d1, d2
        From centre a to centre b [m], its rate [m/s], its constant second rate [m/s^2]; world frame.
    distance
        Sum of the radii [m].
    touch, still
        The gap [m] that counts as touching, the speed [m/s] that counts as none.
    horizon
        [s], may be infinite.

    Returns
    -------
    float
        As `sphere_plane`, with the gap |d| - distance. What touches and is still, but is carried outward by
        its sideways speed, is found when it comes back.

    Notes
    -----
    The gap at the time returned is within a few units in the last place of the lengths at hand. Whether a
    graze is a hit is decided to rounding: of the miss distance where d2 is 0, else of |d|^2.
    """
    if not dot(d1, d1) < FAST:
        unit = unit_of_time(d1)
        if unit == 0.0:
            return math.inf
        slow, bend = scale(d1, unit), scale(scale(d2, unit), unit)
        return unit * slow_sphere_sphere(d0, slow, bend, distance, touch, still * unit, horizon / unit)
    return slow_sphere_sphere(d0, d1, d2, distance, touch, still, horizon)


def slow_sphere_sphere(
    d0: Vec,
    d1: Vec,
    d2: Vec,
    distance: float,
    touch: float,
    still: float,
    horizon: float,
) -> float:
    """`sphere_sphere` of speeds whose squares are numbers."""
    r = norm(d0)
    gap = r - distance
    along = dot(d0, d1)
    straight = d2[0] == 0.0 and d2[1] == 0.0 and d2[2] == 0.0
    if gap <= touch:
        if along < -still * r:
            return 0.0
        if straight:
            return math.inf  # the square of the distance is convex: what does not approach never will
        time = sphere_sphere_return(d0, d1, d2, distance, gap >= -touch, along <= still * r, horizon)
    elif straight:
        time = math.inf
        root = chord(d0, d1, distance)
        if along < 0.0 and root > still * distance:
            time = gap * (r + distance) / (root - along)
    else:
        c = separation_polynomial(d0, d1, d2, distance)
        time = sphere_sphere_meets(c, d0, d1, d2, distance, still, 0.0, horizon)
    return time if time <= horizon else math.inf


def sphere_sphere_meets(
    c: tuple[float, float, float, float, float],
    d0: Vec,
    d1: Vec,
    d2: Vec,
    distance: float,
    still: float,
    start: float,
    horizon: float,
) -> float:
    """The first crossing of the polynomial ``c`` after ``start`` that is not a graze, polished."""
    slopes = derivative(c)
    s = start
    for _ in range(3):
        s = first_crossing(c, s, horizon)
        if s == math.inf:
            return math.inf
        # The polynomial's rate is twice |d| times the speed. Arriving with none and curving outward is a graze.
        if value(slopes, s) < -2.0 * distance * still or value(derivative(slopes), s) <= 0.0:
            return polished(d0, d1, d2, distance, s)
    return math.inf


def sphere_sphere_return(
    d0: Vec,
    d1: Vec,
    d2: Vec,
    distance: float,
    touching: bool,
    resting: bool,
    horizon: float,
) -> float:
    """When what touches or overlaps and does not approach is back; when it turns if it turns before it is out."""
    c = separation_polynomial(d0, d1, d2, distance)
    if resting and c[2] <= 0.0:
        return math.inf  # a support
    if resting and touching:
        # Curving outward: the double root at the start is divided away.
        s = first_crossing((c[2], c[3], c[4], 0.0, 0.0), 0.0, horizon)
        return s if s == math.inf else polished(d0, d1, d2, distance, s)
    turn = first_crossing(derivative(c), 0.0, horizon)
    if turn == math.inf or value(c, turn) <= 0.0:
        return turn
    return sphere_sphere_meets(c, d0, d1, d2, distance, 0.0, turn, horizon)


def sphere_sphere_leaves(
    d0: Vec,
    d1: Vec,
    d2: Vec,
    distance: float,
    horizon: float,
) -> float:
    """Time [s] in [0, horizon] at which the gap goes from at most 0 to more; infinite if it does not.

    Units as in `sphere_sphere`. A gap of exactly 0 that opens leaves at 0; a positive gap has to close first.
    To touch 0 from inside and fall back is not to leave.
    """
    if not dot(d1, d1) < FAST:
        unit = unit_of_time(d1)
        if unit == 0.0:
            return math.inf
        slow, bend = scale(d1, unit), scale(scale(d2, unit), unit)
        return unit * slow_sphere_sphere_leaves(d0, slow, bend, distance, horizon / unit)
    return slow_sphere_sphere_leaves(d0, d1, d2, distance, horizon)


def slow_sphere_sphere_leaves(
    d0: Vec,
    d1: Vec,
    d2: Vec,
    distance: float,
    horizon: float,
) -> float:
    """`sphere_sphere_leaves` of speeds whose squares are numbers."""
    c = separation_polynomial(d0, d1, d2, distance)
    if c[0] == 0.0 and (c[1] > 0.0 or (c[1] == 0.0 and c[2] > 0.0)):
        return 0.0
    time = math.inf
    if d2[0] == 0.0 and d2[1] == 0.0 and d2[2] == 0.0:
        along = dot(d0, d1)
        root = chord(d0, d1, distance)
        if root > 0.0 and (c[0] <= 0.0 or along < 0.0):
            time = -c[0] / (along + root) if along > 0.0 else (root - along) / dot(d1, d1)
        return time if time <= horizon else math.inf
    outside = (-c[0], -c[1], -c[2], -c[3], -c[4])
    slopes = derivative(c)
    s = 0.0
    for _ in range(3):
        s = first_crossing(outside, s, horizon)
        if s == math.inf:
            return math.inf
        turn = first_crossing(slopes, s, math.inf)
        if turn == math.inf or value(c, turn) > 0.0:
            time = polished(d0, d1, d2, distance, s)
            return time if time <= horizon else math.inf
        s = turn
    return math.inf
