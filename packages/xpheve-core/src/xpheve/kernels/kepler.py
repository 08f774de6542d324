"""Motion of one body about another under an inverse-square force, exactly, for any time ahead or behind.

``prepare`` turns a state into constants, ``moved`` gives the change of the state a time s later, from that state: nothing is stepped. With d from the
centre to the body, d'' = -mu d / |d|^3, and mu of either sign. In Sundman's variable Y, dY = dt / |d|, all conics are one (Stumpff's functions as
G_k, which are sines, powers or hyperbolic sines of Y as beta = 2 mu / r - v^2 is above, at or below 0):

    s  = r Y + sigma G2 + zeta G3,                   sigma = d . v,   zeta = mu - beta r,    (Kepler's equation)
    d1 = d - (mu G2 / r) d + (r G1 + sigma G2) v,    |d1| = r + sigma G1 + zeta G2.

r, sigma, zeta, d and v are those of a place of reference: where the body was at the beginning, or its nearest point to the centre (there sigma
= 0), whichever is nearer in time. From the first a small change is found without loss; from the second a narrow passage is, since all sums there have
terms of one sign. The time since the nearest point and the period are pairs of floats, right to the last bit of the state as given, so that
a thousand periods cost no digit.

A state whose angular momentum is 0, or so small that no float is as near to the centre as it leads, ends there if mu > 0: beyond that time
`moved` gives NaN.

Any units; mu in length^3/time^2. Errors are a few roundings of the place and of the phase up to about 1e15 periods; beyond, the body is on its orbit.

Sources:
- J. Wisdom, D. M. Hernandez, MNRAS 453 (2015) 3015: universal variables without Stumpff series of large arguments.
- E. Stiefel, G. Scheifele, Linear and Regular Celestial Mechanics (1971), section 11: the equations above.
- J. M. A. Danby, Fundamentals of Celestial Mechanics (2nd ed. 1988), 6.6: a root by a step of fourth order.
"""

import math

from xpheve.kernels.elliptic import (
    HALF_PI,
    Pair,
    pair_add,
    pair_div,
    pair_mul,
    pair_sqrt,
    pair_sub,
    pair_times,
    sum_exact,
)
from xpheve.kernels.vector import Vec

Pairs = tuple[Pair, Pair, Pair]  # a vector of pairs

# The constants, all floats, by place:
#    0 -  2  unit of length, one over the unit of time, unit of speed: powers of two; all below is in them
#    3 -  4  mu, beta
#    5 -  6  period (pair), 0 if there is none
#    7 -  8  when the body was in the centre last, and when it will be there; infinite if never
#    9 - 11  r, sigma, zeta at the beginning
#   12 - 17  d / r and v at the beginning
#   18       1 if the nearest point is a reference, too
#   19 - 20  time since the nearest point (pair)
#   21 - 22  distance and zeta there
#   23 - 28  unit vector to the nearest point, and distance times velocity there
#   29 - 34  d at the beginning: what is rounded, and the rest
Orbit = tuple[float, ...]
Eleven = tuple[float, ...]  # places 18 to 28

TWO_PI: Pair = (4.0 * HALF_PI[0], 4.0 * HALF_PI[1])
FOREVER = 1e100  # periods; beyond them products would overflow, and long before them no digit of a phase is left
NO_PERIOD = 1e-200  # (2 pi / period)^2 below this counts as 0
ROUND = 0.1  # eccentricity below which distances differ so little that the beginning is reference enough
NEAR = 0.7  # beta Y^2 up to which the series are summed
NEAR_PAIR = 0.2  # the same for pairs
CLOSE = 1e-9  # a step of this part of Y: its square is below rounding
STEPS = 200  # more than bisection needs
EXPONENT = 1000  # of two, of a unit, at most

INVERSE_FACTORIALS = (
    (0.16666666666666666, 9.25185853854297e-18),
    (0.008333333333333333, 1.1564823173178714e-19),
    (0.0001984126984126984, 1.7209558293420705e-22),
    (2.7557319223985893e-06, -1.858393274046472e-22),
    (2.505210838544172e-08, -1.448814070935912e-24),
    (1.6059043836821613e-10, 1.2585294588752098e-26),
    (7.647163731819816e-13, 7.03872877733453e-30),
    (2.8114572543455206e-15, 1.6508842730861433e-31),
    (8.22063524662433e-18, 2.2141894119604265e-34),
    (1.9572941063391263e-20, -1.3643503830087908e-36),
    (3.868170170630684e-23, -8.843177655482344e-40),
    (6.446950284384474e-26, -1.9330404233703465e-42),
)
"""1 / (2 n + 3)! as pairs."""


# Before: from a state to constants


def pair_dot(a: Pairs, b: Pairs) -> Pair:
    """a . b."""
    return pair_add(pair_add(pair_mul(a[0], b[0]), pair_mul(a[1], b[1])), pair_mul(a[2], b[2]))


def pair_cross(a: Pairs, b: Pairs) -> Pairs:
    """a x b."""
    return (
        pair_sub(pair_mul(a[1], b[2]), pair_mul(a[2], b[1])),
        pair_sub(pair_mul(a[2], b[0]), pair_mul(a[0], b[2])),
        pair_sub(pair_mul(a[0], b[1]), pair_mul(a[1], b[0])),
    )


def pair_scale(a: Pairs, s: Pair) -> Pairs:
    """s a."""
    return (pair_mul(a[0], s), pair_mul(a[1], s), pair_mul(a[2], s))


def pair_shift(a: Pair, k: int) -> Pair:
    """a 2^k."""
    return (math.ldexp(a[0], k), math.ldexp(a[1], k))


def exponent(x: float) -> int:
    """The power of two just above |x|; very low for 0."""
    return math.frexp(x)[1] if x != 0.0 else -4000


def largest(a: Pairs) -> float:
    """The greatest component, in size."""
    return max(abs(a[0][0]), abs(a[1][0]), abs(a[2][0]))


def limited(k: int) -> int:
    """An exponent that a unit may have."""
    return max(-EXPONENT, min(EXPONENT, k))


def inverse_square_rate(strength: float, one: float, other: float, a: float, b: float) -> Pair:
    """K q_a q_b (1 / m_a + 1 / m_b) = mu; of a body that does not move the mass is infinite.

    Parameters
    ----------
    strength, one, other
        K and both charges.
    a, b
        Both masses.
    """
    k = exponent(strength) + exponent(one) + exponent(other)
    c = pair_times((math.frexp(strength)[0], 0.0), math.frexp(one)[0])
    c = pair_times(c, math.frexp(other)[0])
    if a == math.inf or b == math.inf:
        least = min(a, b)
        return pair_shift(pair_div(c, (math.frexp(least)[0], 0.0)), k - exponent(least))
    shift = max(exponent(a), exponent(b))
    total = sum_exact(math.ldexp(a, -shift), math.ldexp(b, -shift))
    c = pair_div(pair_div(pair_mul(c, total), (math.frexp(a)[0], 0.0)), (math.frexp(b)[0], 0.0))
    return pair_shift(c, k + shift - exponent(a) - exponent(b))


def prepare(d: Pairs, v: Pairs, mu: Pair) -> Orbit:
    """The constants of the orbit through the place ``d`` from the centre at the velocity ``v``; ``d`` must not be 0."""
    length = limited(exponent(largest(d)))
    time = -max(exponent(largest(v)) - length, (exponent(mu[0]) - 3 * length + 1) // 2)
    time = limited(0 if time > 2000 else time)
    x = (pair_shift(d[0], -length), pair_shift(d[1], -length), pair_shift(d[2], -length))
    w = (pair_shift(v[0], time - length), pair_shift(v[1], time - length), pair_shift(v[2], time - length))
    gm = pair_shift(mu, 2 * time - 3 * length)
    r = pair_sqrt(pair_dot(x, x))
    inverse = pair_div((1.0, 0.0), r)
    unit = pair_scale(x, inverse)
    sigma = pair_dot(x, w)
    twice = (2.0 * gm[0], 2.0 * gm[1])
    beta = pair_sub(pair_mul(twice, inverse), pair_dot(w, w))
    zeta = pair_sub(gm, pair_mul(beta, r))
    period = period_of(gm, beta)
    start = (
        math.ldexp(1.0, length), math.ldexp(1.0, -time), math.ldexp(1.0, limited(length - time)), gm[0], beta[0], period[0], period[1],
    )  # fmt: skip
    begin = (r[0], sigma[0], zeta[0], unit[0][0], unit[1][0], unit[2][0], w[0][0], w[1][0], w[2][0])
    nearest = nearest_point(x, w, unit, r, sigma, zeta, gm, beta)
    place = (x[0][0], x[1][0], x[2][0], x[0][1], x[1][1], x[2][1])
    return start + fall(nearest, gm[0], period[0]) + begin + nearest + place


def period_of(mu: Pair, beta: Pair) -> Pair:
    """2 pi mu / beta^(3/2); 0 for an orbit that does not close."""
    if mu[0] <= 0.0 or beta[0] <= NO_PERIOD:
        return (0.0, 0.0)
    return pair_div(pair_mul(TWO_PI, mu), pair_mul(beta, pair_sqrt(beta)))


def nearest_point(x: Pairs, w: Pairs, unit: Pairs, r: Pair, sigma: Pair, zeta: Pair, mu: Pair, beta: Pair) -> Eleven:
    """Places 18 to 28 of the constants: Laplace's vector shows where the nearest point is, zeta there is its length."""
    h = pair_cross(x, w)
    turned = pair_cross(w, h)
    pull = pair_scale(unit, mu)
    laplace = (pair_sub(turned[0], pull[0]), pair_sub(turned[1], pull[1]), pair_sub(turned[2], pull[2]))
    kappa = pair_sqrt(pair_dot(laplace, laplace))
    if mu[0] == 0.0 or kappa[0] <= ROUND * abs(mu[0]):
        return (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    axis = pair_scale(laplace, pair_div((1.0, 0.0), kappa))
    if mu[0] > 0.0:
        q = pair_div(pair_dot(h, h), pair_add(mu, kappa))
    else:
        q = pair_div(pair_sub(kappa, mu), (-beta[0], -beta[1]))
    side = pair_cross(h, axis)
    since = time_since_nearest(sigma, zeta, q, kappa, beta)
    return (
        1.0, since[0], since[1], q[0], kappa[0], axis[0][0], axis[1][0], axis[2][0], side[0][0], side[1][0], side[2][0],
    )  # fmt: skip


def time_since_nearest(sigma: Pair, zeta: Pair, q: Pair, kappa: Pair, beta: Pair) -> Pair:
    """Time since the nearest point, by kappa G1 = sigma and kappa G0 = zeta: Y as a float, then one Newton step on pairs."""
    sine, cosine = pair_div(sigma, kappa), pair_div(zeta, kappa)
    if beta[0] > 0.0:
        b = math.sqrt(beta[0])
        y = math.atan2(b * sine[0], cosine[0]) / b
    elif beta[0] < 0.0:
        b = math.sqrt(-beta[0])
        y = math.asinh(b * sine[0]) / b
    else:
        y = sine[0]
    g0, g1, g2, g3 = pair_functions(beta, y)
    step = pair_sub(pair_mul(sine, g0), pair_mul(cosine, g1))  # G1 of what is missing of Y
    g3 = pair_add(g3, pair_times(g2, step[0]))
    return pair_add(pair_mul(q, pair_add((y, 0.0), step)), pair_mul(kappa, g3))


def pair_functions(beta: Pair, y: float) -> tuple[Pair, Pair, Pair, Pair]:
    """G0, G1, G2, G3 of ``y`` as pairs: the series at a part of it, doubled."""
    halvings = 0
    part = y
    while abs(beta[0]) * part * part > NEAR_PAIR:
        part = 0.5 * part
        halvings += 1
    z = pair_times(pair_times(beta, part), part)
    total = INVERSE_FACTORIALS[11]
    for k in range(10, -1, -1):
        total = pair_sub(INVERSE_FACTORIALS[k], pair_mul(z, total))
    square = pair_times((part, 0.0), part)
    g3 = pair_mul(total, pair_times(square, part))
    g1 = pair_sub((part, 0.0), pair_mul(beta, g3))
    root = pair_sqrt(pair_sub((1.0, 0.0), pair_mul(beta, pair_mul(g1, g1))))  # G0, above 0 here
    g2 = pair_div(pair_mul(g1, g1), pair_add((1.0, 0.0), root))
    g0 = root
    for _ in range(halvings):
        more = pair_add(g3, pair_mul(g1, g2))
        g3 = (2.0 * more[0], 2.0 * more[1])
        square = pair_mul(g1, g1)
        product = pair_mul(g0, g1)
        g2, g1 = (2.0 * square[0], 2.0 * square[1]), (2.0 * product[0], 2.0 * product[1])
        g0 = pair_sub((1.0, 0.0), pair_mul(beta, g2))
    return (g0, g1, g2, g3)


def fall(nearest: Eleven, mu: float, period: float) -> Pair:
    """When a body without angular momentum was, and will be, in the centre that attracts it; infinite for all others."""
    if nearest[0] == 0.0 or nearest[3] > 0.0 or mu <= 0.0:
        return (-math.inf, math.inf)
    since = nearest[1]
    once = period if period > 0.0 else math.inf
    return (-since, once - since) if since > 0.0 else (-once - since, -since)


# After: from constants to a state


def reduced(s: Pair, period: Pair) -> Pair:
    """``s`` less whole periods, at most half a period in size."""
    if not abs(s[0]) > 0.5 * period[0] > 0.0:
        return s
    turns = s[0] / period[0]
    if not abs(turns) < FOREVER:
        return (0.0, 0.0)
    return pair_sub(s, pair_times(period, float(math.floor(turns + 0.5)) if abs(turns) < 1e15 else turns))


def series_two(z: float) -> float:
    """G2 / Y^2 for |z| = |beta| Y^2 up to `NEAR`."""
    return 0.5 - z * (
        0.041666666666666664
        - z
        * (
            0.001388888888888889
            - z
            * (
                2.48015873015873e-05
                - z
                * (
                    2.755731922398589e-07
                    - z * (2.08767569878681e-09 - z * (1.1470745597729725e-11 - z * 4.779477332387385e-14))
                )
            )
        )
    )


def series_three(z: float) -> float:
    """G3 / Y^3 for |z| = |beta| Y^2 up to `NEAR`."""
    return 0.16666666666666666 - z * (
        0.008333333333333333
        - z
        * (
            0.0001984126984126984
            - z
            * (
                2.7557319223985893e-06
                - z
                * (
                    2.505210838544172e-08
                    - z * (1.6059043836821613e-10 - z * (7.647163731819816e-13 - z * 2.8114572543455206e-15))
                )
            )
        )
    )


def functions(beta: float, y: float) -> tuple[float, float, float, float]:
    """G0, G1, G2, G3 of ``y``: the series at a part of it, doubled."""
    part, halvings = y, 0
    z = beta * (y * y)
    while abs(z) > NEAR:
        part = 0.5 * part
        z = 0.25 * z
        halvings += 1
    square = part * part
    g2 = square * series_two(z)
    g3 = square * part * series_three(z)
    g1 = part - beta * g3
    g0 = 1.0 - beta * g2
    for _ in range(halvings):
        g3 = 2.0 * (g3 + g1 * g2)
        g2 = 2.0 * (g1 * g1)
        g1 = 2.0 * (g0 * g1)
        g0 = 1.0 - beta * g2
    return (g0, g1, g2, g3)


def rough_third_root(x: float) -> float:
    """The third root of ``x`` >= 0 to some per cent, by square roots, which round alike everywhere: 1/3 is nearly 1/4 + 1/16 + 1/64 + 1/256."""
    a = math.sqrt(math.sqrt(x))
    b = math.sqrt(math.sqrt(a))
    c = math.sqrt(math.sqrt(b))
    return a * b * (c * math.sqrt(math.sqrt(c)))


def rough_logarithm(x: float) -> float:
    """The logarithm of ``x`` >= 1 to some 1e-5, by square roots: 65536 log x^(1/65536)."""
    root = x
    for _ in range(16):
        root = math.sqrt(root)
    return 131072.0 * ((root - 1.0) / (root + 1.0))


def first_guess(s: float, r: float, sigma: float, zeta: float, beta: float) -> float:
    """Y where Kepler's equation is about fulfilled, for s > 0: the least of what each of its terms alone would give."""
    y = math.inf
    if r > 0.0:
        y = s / r
    if sigma > 0.0:
        y = min(y, math.sqrt(2.0 * s / sigma))
    if zeta > 0.0:
        y = min(y, rough_third_root(6.0 * s / zeta))
        if beta < 0.0:
            b = math.sqrt(-beta)
            y = min(y, rough_logarithm(2.0 * (s * b * (b * b) / zeta) + 1.8) / b)
    if beta > 0.0:
        y = min(y, 3.5 / math.sqrt(beta))
    return y


def solid(x: float) -> float:
    """``x``, to divide by: next to nothing in the place of 0."""
    return x + (x == 0.0) * 1e-300


def step_of(
    time: float,
    rest: float,
    r: float,
    sigma: float,
    zeta: float,
    beta: float,
    y: float,
    g0: float,
    g1: float,
    g2: float,
    g3: float,
) -> Pair:
    """By how much Kepler's equation is missed at ``y``, and the step of fourth order towards its root."""
    miss = ((r * y + sigma * g2 + zeta * g3) - time) - rest
    slope = solid(r + (sigma * g1 + zeta * g2))
    bend = sigma * g0 + zeta * g1
    twist = zeta * g0 - beta * (sigma * g1)
    step = -miss / slope
    step = -miss / solid(slope + 0.5 * step * bend)
    return (miss, -miss / solid(slope + 0.5 * step * (bend + step * twist / 3.0)))


def solved(s: Pair, r: float, sigma: float, zeta: float, beta: float) -> tuple[float, float, float]:
    """G0, G1, G2 of the root Y of Kepler's equation for the time ``s`` since the reference.

    Each step narrows a bracket; one that would leave it is replaced by a bisection.
    """
    if s[0] == 0.0:
        return (1.0, 0.0, 0.0)
    sign = 1.0 if s[0] > 0.0 else -1.0
    time, rest, sigma = sign * s[0], sign * s[1], sign * sigma
    low, high = 0.0, math.inf
    y = first_guess(time, r, sigma, zeta, beta)
    g0, g1, g2 = 1.0, 0.0, 0.0
    for _ in range(STEPS):
        g0, g1, g2, g3 = functions(beta, y)
        miss, step = step_of(time, rest, r, sigma, zeta, beta, y, g0, g1, g2, g3)
        if abs(step) <= CLOSE * y:
            g0, g1, g2 = g0 - step * (beta * g1), g1 + step * g0, g2 + step * g1
            break
        if miss < 0.0:
            low = y
        else:  # above, or beyond all numbers
            high = y
        y = y + step
        if not low < y < high:
            y = 0.5 * (low + high) if high < math.inf else 2.0 * low
    return (g0, sign * g1, g2)


def moved(orbit: Orbit, s: float, rest: float) -> tuple[Vec, Vec, Vec]:
    """How place and velocity have changed a time ``s + rest`` after the beginning.

    Returns
    -------
    change, more, kick
        Change of the place, what rounding left out of it, and change of the velocity; all NaN beyond a fall into the centre.
    """
    t = (s * orbit[1], rest * orbit[1])
    if not orbit[7] < t[0] < orbit[8]:
        return ((math.nan, math.nan, math.nan), (math.nan, math.nan, math.nan), (math.nan, math.nan, math.nan))
    if orbit[3] == 0.0:
        return freely(orbit, t[0])
    period = (orbit[5], orbit[6])
    near = reduced(t, period)
    if orbit[18] != 0.0:
        since = reduced(pair_add(t, (orbit[19], orbit[20])), period)
        if abs(since[0]) < abs(near[0]):
            g0, g1, g2 = solved(since, orbit[21], 0.0, orbit[22], orbit[4])
            return from_nearest(orbit, g0, g1, g2)
    g0, g1, g2 = solved(near, orbit[9], orbit[10], orbit[11], orbit[4])
    return from_beginning(orbit, g1, g2)


def freely(orbit: Orbit, t: float) -> tuple[Vec, Vec, Vec]:
    """`moved` without any force."""
    way = t * orbit[0]
    return ((way * orbit[15], way * orbit[16], way * orbit[17]), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def from_beginning(orbit: Orbit, g1: float, g2: float) -> tuple[Vec, Vec, Vec]:
    """`moved`, by the functions of Y since the beginning."""
    mu, r, sigma, zeta = orbit[3], orbit[9], orbit[10], orbit[11]
    distance = solid(r + (sigma * g1 + zeta * g2))
    pull = mu * g2
    along = r * g1 + sigma * g2
    back, less = mu * g1 / distance, pull / distance
    length, speed = orbit[0], orbit[2]
    return (
        (
            (along * orbit[15] - pull * orbit[12]) * length,
            (along * orbit[16] - pull * orbit[13]) * length,
            (along * orbit[17] - pull * orbit[14]) * length,
        ),
        (0.0, 0.0, 0.0),
        (
            -(back * orbit[12] + less * orbit[15]) * speed,
            -(back * orbit[13] + less * orbit[16]) * speed,
            -(back * orbit[14] + less * orbit[17]) * speed,
        ),
    )


def from_nearest(orbit: Orbit, g0: float, g1: float, g2: float) -> tuple[Vec, Vec, Vec]:
    """`moved`, by the functions of Y since the nearest point."""
    mu, q, kappa = orbit[3], orbit[21], orbit[22]
    distance = solid(q + kappa * g2)
    along = q - mu * g2
    back, side = -(mu * g1) / distance, g0 / distance
    length, speed = orbit[0], orbit[2]
    x, x_more = difference(along * orbit[23] + g1 * orbit[26], orbit[29], orbit[32])
    y, y_more = difference(along * orbit[24] + g1 * orbit[27], orbit[30], orbit[33])
    z, z_more = difference(along * orbit[25] + g1 * orbit[28], orbit[31], orbit[34])
    return (
        (x * length, y * length, z * length),
        (x_more * length, y_more * length, z_more * length),
        (
            (back * orbit[23] + side * orbit[26] - orbit[15]) * speed,
            (back * orbit[24] + side * orbit[27] - orbit[16]) * speed,
            (back * orbit[25] + side * orbit[28] - orbit[17]) * speed,
        ),
    )


def difference(x: float, high: float, low: float) -> Pair:
    """x - (high + low) as a pair."""
    s, e = sum_exact(x, -high)
    return sum_exact(s, e - low)
