"""Torque-free rotation of a rigid body, exactly, for any time ahead or behind.

``prepare`` turns a state into constants, ``turn`` gives the state a time t later. With A, B, C the principal moments
about the body axes x, y, z, named so that B is the middle one and the angular momentum L circles z (C largest or
smallest), L in the body frame follows Jacobi's functions of u = u0 + lambda t (Landau & Lifshitz, Mechanics, 37.10):

    L = (A a cn u, B b sn u, C c dn u),    lambda^2 = (C - B)(L^2 - 2 T A) / (A B C), lambda of the sign of C - B,

and the attitude is a turn psi about L, fixed in the world, after the turn (theta, chi) that sets L upright:

    q = Q0 Rot(z, psi) Rot(x, theta) Rot(z, chi),    L = |L| (sin theta sin chi, sin theta cos chi, cos theta),
    d psi / dt = L (A wx^2 + B wy^2) / (A^2 wx^2 + B^2 wy^2) = L [1 / B + (1 / A - 1 / B) cn^2 / (1 + nu sn^2)],
    nu = C (B - A) / (A (C - B)) >= 0,

whose integral is Legendre's third kind (van Zon & Schofield, J. Comput. Phys. 225 (2007) 145). Split about 1 / B as
here, every part stays small where A, B and C draw together or u hardly moves, so nothing cancels.

What decides the period near the middle axis, D = 2 T B - L^2, is a difference of nearly equal numbers: it and all
else that time multiplies are worked in pairs of floats, right to the last bit of the state as given.

Moments in any unit and order, finite, all above 0 or all 0 (a point); rates in rad/s, world frame; times in s, of
either sign. Errors are a few roundings up to about 1e15 radians of turning; beyond, only what is conserved is right.
"""

import math

from xpheve.kernels.elliptic import (
    HALF_PI,
    Pair,
    complete_k_h,
    incomplete_f,
    incomplete_h,
    pair_add,
    pair_div,
    pair_mul,
    pair_sqrt,
    pair_sub,
    pair_times,
    product_exact,
    sn_cn_dn,
    sum_exact,
)
from xpheve.kernels.quaternion import Quat, conjugate, multiply, normalize, rotate
from xpheve.kernels.vector import Vec, norm

Pairs = tuple[Pair, Pair, Pair]  # a vector of pairs

STEADY = 0.0  # about one axis for ever: points, spheres, spins about a principal axis
SYMMETRIC = 1.0  # two moments equal: a turn about L, then a turn about the axis of symmetry
ASYMMETRIC = 2.0
SEPARATRIX = 3.0  # asymmetric, and bound for the middle axis: turns over at most once


# The constants, all floats, by place:
#    0       which of the four above
#    1 -  4  q at t = 0
#    5 -  7  angular velocity at t = 0, world
#    8       unit of rate, a power of two; every rate below is in it
#    9 - 10  rate of the turn about L (pair)
#   11 - 13  steady, symmetric: unit vector along L, body; asymmetric: body axes among x, y, z, as +-1, +-2, +-3
#   14 - 15  symmetric: rate of the turn about the axis of symmetry (pair); asymmetric: lambda (pair)
#   16 - 17  symmetric: axis of symmetry, as 1, 2, 3, then 0; asymmetric: 2 K (pair), 0 on the separatrix
#   18 - 19  what psi gains in 2 K beyond its mean rate (pair)
#   20 - 24  u0, H(u0), m1, nu, and what multiplies H in psi
#   25 - 28  the turn (theta, chi) at t = 0, undone
#   29 - 31  greatest components of L / |L| along x, y, z
#   32 - 34  |L| / A, |L| / B, |L| / C
Constants = tuple[float, ...]

FOUR_PI: Pair = (8.0 * HALF_PI[0], 8.0 * HALF_PI[1])
WHOLE = 4503599627370496.0  # 2^52: from here on every float is a whole number
FOREVER = 1e100  # units of time; past it products would overflow, and long before it no digit of a phase is left
NOISE = 1.8e-15  # 8 units of the last place: what rounding q, omega and their product can leave in a body rate of zero
TINY = 1e-120  # of the spin; below, squares of products would leave the range of a float
FLAT = 1e-140  # m1 below this is taken for 0: the body would turn over once in more than 160 / lambda


# Before: from a state to constants


def prepare(q: Quat, omega_world: Vec, inertia: Vec) -> Constants:
    """Constants of the motion through orientation ``q`` and ``omega_world`` [rad/s] with principal moments ``inertia``.

    A body whose spin cannot be told from one about a principal axis, as q and omega are rounded, keeps it for ever.
    """
    unit = power_of_two(max(abs(omega_world[0]), abs(omega_world[1]), abs(omega_world[2])))
    size = power_of_two(max(inertia[0], inertia[1], inertia[2]))
    rates = (omega_world[0] / unit, omega_world[1] / unit, omega_world[2] / unit)
    moments = (inertia[0] / size, inertia[1] / size, inertia[2] / size)
    spin = to_body(q, rates)
    if moments[0] == moments[1] == moments[2] or about_a_principal_axis(q, rates, spin):
        return prepare_steady(q, omega_world, unit, spin)
    low, middle, high = ascending(moments)
    if moments[low] == moments[middle]:
        return prepare_symmetric(q, omega_world, unit, spin, moments, high)
    if moments[middle] == moments[high]:
        return prepare_symmetric(q, omega_world, unit, spin, moments, low)
    return prepare_asymmetric(q, omega_world, unit, spin, moments, low, middle, high)


def power_of_two(x: float) -> float:
    """A power of two near ``x`` > 0, by which to divide without rounding; 1 for 0."""
    if x == 0.0:
        return 1.0
    return math.ldexp(1.0, max(-1000, min(1000, math.frexp(x)[1])))


def ascending(moments: Vec) -> tuple[int, int, int]:
    """The three axes by moment, smallest first."""
    low, middle, high = 0, 1, 2
    if moments[low] > moments[middle]:
        low, middle = middle, low
    if moments[middle] > moments[high]:
        middle, high = high, middle
    if moments[low] > moments[middle]:
        low, middle = middle, low
    return (low, middle, high)


def to_body(q: Quat, v: Vec) -> Pairs:
    """World vector ``v`` in the body frame of ``q``, to the last bit of both, whatever the length of ``q``.

    Near the middle axis a digit lost here would be one of the time at which the body turns over.
    """
    w, x, y, z = q
    if x == 0.0 and y == 0.0 and z == 0.0:
        return ((v[0], 0.0), (v[1], 0.0), (v[2], 0.0))
    uu = pair_add(pair_add(product_exact(x, x), product_exact(y, y)), product_exact(z, z))
    ww = product_exact(w, w)
    along = pair_add(pair_add(product_exact(x, v[0]), product_exact(y, v[1])), product_exact(z, v[2]))
    across = (
        pair_sub(product_exact(y, v[2]), product_exact(z, v[1])),
        pair_sub(product_exact(z, v[0]), product_exact(x, v[2])),
        pair_sub(product_exact(x, v[1]), product_exact(y, v[0])),
    )
    straight, length = pair_sub(ww, uu), pair_add(ww, uu)
    # [(w^2 - u.u) v + 2 (u.v) u - 2 w u x v] / |q|^2
    return (
        pair_div(to_body_part(straight, v[0], along, x, w, across[0]), length),
        pair_div(to_body_part(straight, v[1], along, y, w, across[1]), length),
        pair_div(to_body_part(straight, v[2], along, z, w, across[2]), length),
    )


def to_body_part(straight: Pair, v: float, along: Pair, u: float, w: float, across: Pair) -> Pair:
    """straight v + 2 along u - 2 w across."""
    turned = pair_sub(pair_times(along, 2.0 * u), pair_times(across, 2.0 * w))
    return pair_add(pair_times(straight, v), turned)


def about_a_principal_axis(q: Quat, v: Vec, spin: Pairs) -> bool:
    """Whether two of the body rates ``spin`` cannot be told from zero, given how ``q`` and ``v`` are rounded.

    The measure is the sum of the terms that made the rate, so that where q leaves an axis alone only a true 0 counts.
    """
    w, x, y, z = abs(q[0]), abs(q[1]), abs(q[2]), abs(q[3])
    a, b, c = abs(v[0]), abs(v[1]), abs(v[2])
    uu = x * x + y * y + z * z
    length = w * w + uu
    noise = NOISE / length if length > 0.0 else 0.0
    along = 2.0 * (x * a + y * b + z * c)
    quiet = 0
    if abs(spin[0][0]) <= max(TINY, noise * (along * x + 2.0 * w * (y * c + z * b) + length * a)):
        quiet += 1
    if abs(spin[1][0]) <= max(TINY, noise * (along * y + 2.0 * w * (z * a + x * c) + length * b)):
        quiet += 1
    if abs(spin[2][0]) <= max(TINY, noise * (along * z + 2.0 * w * (x * b + y * a) + length * c)):
        quiet += 1
    return quiet >= 2


def length_of(v: Pairs) -> Pair:
    """|v| of a vector of pairs."""
    x, y, z = pair_mul(v[0], v[0]), pair_mul(v[1], v[1]), pair_mul(v[2], v[2])
    return pair_sqrt(pair_add(pair_add(x, y), z))


def along(v: Pairs, length: Pair) -> Vec:
    """v / length, rounded; zero when the length is."""
    if length[0] == 0.0:
        return (0.0, 0.0, 0.0)
    return (v[0][0] / length[0], v[1][0] / length[0], v[2][0] / length[0])


def prepare_steady(q: Quat, omega_world: Vec, unit: float, spin: Pairs) -> Constants:
    """One turn about the fixed direction of omega."""
    rate = length_of(spin)
    axis = along(spin, rate)
    none = (0.0, 0.0)
    return (STEADY, *q, *omega_world, unit, *rate, *axis, *none, *none, *none, *NO_PHASE, *NO_FRAME)


def prepare_symmetric(q: Quat, omega_world: Vec, unit: float, spin: Pairs, moments: Vec, axis: int) -> Constants:
    """omega = L / A + (1 - C / A) w_z z with C the moment about the axis of symmetry z and A across it.

    L / A turns the body in the world, the rest turns it in itself, both at constant rates.
    """
    across, about = moments[(axis + 1) % 3], moments[axis]
    momentum = (pair_times(spin[0], moments[0]), pair_times(spin[1], moments[1]), pair_times(spin[2], moments[2]))
    size = length_of(momentum)
    nutation = pair_div(pair_mul(sum_exact(across, -about), spin[axis]), (across, 0.0))
    rate = pair_div(size, (across, 0.0))
    none = (0.0, 0.0)
    direction = along(momentum, size)
    return (
        SYMMETRIC, *q, *omega_world, unit, *rate, *direction, *nutation, axis + 1.0, 0.0, *none, *NO_PHASE, *NO_FRAME,
    )  # fmt: skip


NO_PHASE = (0.0, 0.0, 0.0, 0.0, 0.0)
NO_FRAME = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def prepare_asymmetric(
    q: Quat, omega_world: Vec, unit: float, spin: Pairs, moments: Vec, low: int, middle: int, high: int
) -> Constants:
    """Jacobi's functions and their periods."""
    balance = middle_axis_balance(spin, moments, low, middle, high)
    # x, y, z: L circles z. The signs of z and x are such that w_z > 0 and w_x >= 0, that of y makes them right-handed.
    x, y, z = low, middle, high
    if balance[0] > 0.0:
        x, y, z = high, middle, low
    sign_x = 1.0 if spin[x][0] >= 0.0 else -1.0
    sign_z = 1.0 if spin[z][0] >= 0.0 else -1.0
    sign_y = sign_x * sign_z if (y - x) % 3 == 1 else -sign_x * sign_z
    a, b, c = moments[x], moments[y], moments[z]
    wx, wy, wz = spin[x], spin[y], spin[z]
    xx, yy, zz = pair_mul(wx, wx), pair_mul(wy, wy), pair_mul(wz, wz)
    # Distances between moments, without error; all of one sign.
    ba, ca, cb = sum_exact(b, -a), sum_exact(c, -a), sum_exact(c, -b)
    # A (C - A) w_x^2, B (C - B) w_y^2, B (B - A) w_y^2, C (C - A) w_z^2
    p_x, p_y = pair_mul(pair_times(ca, a), xx), pair_mul(pair_times(cb, b), yy)
    q_y, q_z = pair_mul(pair_times(ba, b), yy), pair_mul(pair_times(ca, c), zz)
    p_all = pair_add(p_x, p_y)  # 2 T C - L^2
    q_all = pair_add(q_y, q_z)  # L^2 - 2 T A
    m1 = pair_div(pair_mul(ca, balance), pair_mul(cb, q_all))
    m1 = (abs(m1[0]), math.copysign(1.0, m1[0]) * m1[1])
    if m1[0] >= 1.0:
        m1 = (1.0, 0.0)
    rate = pair_sqrt(pair_div(pair_mul(cb, q_all), pair_times(product_exact(a, b), c)))
    if cb[0] < 0.0:
        rate = (-rate[0], -rate[1])
    momentum = (pair_times(wx, a), pair_times(wy, b), pair_times(wz, c))
    size = length_of(momentum)
    # Amplitudes and phase.
    cn = math.sqrt(p_x[0] / p_all[0])
    sn = math.copysign(math.sqrt(p_y[0] / p_all[0]), sign_y * wy[0])
    dn = math.sqrt(q_z[0] / q_all[0])
    greatest = (
        math.sqrt(a * p_all[0] / ca[0]) / size[0],
        math.sqrt(b * p_all[0] / cb[0]) / size[0],
        math.sqrt(c * q_all[0] / ca[0]) / size[0],
    )
    nu1 = pair_div(pair_times(ca, b), pair_times(cb, a))
    nu = c * ba[0] / (a * cb[0])
    weight = pair_div(pair_mul(size, ba), pair_mul(rate, product_exact(a, b)))
    undo = conjugate(upright(greatest[0] * cn, greatest[1] * sn, greatest[2] * dn))
    frame = place(x, y, z, sign_x, sign_y, sign_z)
    over = (size[0] / a, size[0] / b, size[0] / c)
    mean = pair_div(size, (b, 0.0))
    if m1[0] < FLAT:
        u0 = math.copysign(math.asinh(abs(sn) / max(cn, dn, TINY)), sn)
        h0 = incomplete_h(sn, 1.0, 1.0, 0.0, nu)
        return (
            SEPARATRIX, *q, *omega_world, unit, *mean, *frame, *rate, 0.0, 0.0, 0.0, 0.0,
            u0, h0, 0.0, nu, weight[0], *undo, *greatest, *over,
        )  # fmt: skip
    k_high, k_low, h_high, h_low = complete_k_h(m1, nu1)
    gain = pair_mul(weight, (2.0 * h_high, 2.0 * h_low))
    u0 = incomplete_f(sn, cn, dn)
    h0 = incomplete_h(sn, cn, dn, m1[0], nu)
    return (
        ASYMMETRIC, *q, *omega_world, unit, *mean, *frame, *rate, 2.0 * k_high, 2.0 * k_low, *gain,
        u0, h0, m1[0], nu, weight[0], *undo, *greatest, *over,
    )  # fmt: skip


def middle_axis_balance(spin: Pairs, moments: Vec, low: int, middle: int, high: int) -> Pair:
    """D = 2 T I2 - L^2 = I1 (I2 - I1) w1^2 - I3 (I3 - I2) w3^2: above 0 when L circles the axis of the least moment."""
    i1, i2, i3 = moments[low], moments[middle], moments[high]
    w1, w3 = spin[low], spin[high]
    return pair_sub(
        pair_mul(pair_times(sum_exact(i2, -i1), i1), pair_mul(w1, w1)),
        pair_mul(pair_times(sum_exact(i3, -i2), i3), pair_mul(w3, w3)),
    )


def place(x: int, y: int, z: int, sign_x: float, sign_y: float, sign_z: float) -> Vec:
    """Where the body's own axes 0, 1, 2 are among x, y, z: +-1, +-2, +-3."""
    return (
        place_of(0, x, y, sign_x, sign_y, sign_z),
        place_of(1, x, y, sign_x, sign_y, sign_z),
        place_of(2, x, y, sign_x, sign_y, sign_z),
    )


def place_of(axis: int, x: int, y: int, sign_x: float, sign_y: float, sign_z: float) -> float:
    """Where the body's own ``axis`` is among x, y, z: +-1, +-2, +-3."""
    if axis == x:
        return sign_x
    if axis == y:
        return 2.0 * sign_y
    return 3.0 * sign_z


# After: from constants to the state at t


def turn(constants: Constants, t: float) -> tuple[Quat, Vec]:
    """Orientation and angular velocity [rad/s], world, a time ``t`` [s] later; at t = 0 the state given, to the bit."""
    if t == 0.0 or constants[9] == 0.0:
        return (
            (constants[1], constants[2], constants[3], constants[4]),
            (constants[5], constants[6], constants[7]),
        )
    if constants[0] == STEADY:
        return turn_steady(constants, t)
    if constants[0] == SYMMETRIC:
        return turn_symmetric(constants, t)
    return turn_asymmetric(constants, t)


def scaled(t: float, unit: float) -> float:
    """``t`` in units of 1 / ``unit``, kept in range."""
    return max(min(t * unit, FOREVER), -FOREVER)


def whole(x: float) -> float:
    """The whole number nearest to ``x``, as a float, without the errors ``round`` raises."""
    size = abs(x)
    return math.copysign((size + WHOLE) - WHOLE, x) if size < WHOLE else x


def half_turn(angle: Pair) -> Pair:
    """(cos, sin) of half the ``angle`` [rad], whole turns taken out first without loss."""
    turns = whole(angle[0] / FOUR_PI[0])
    if turns != 0.0:
        angle = pair_sub(angle, pair_times(FOUR_PI, turns))
    half = 0.5 * angle[0] + 0.5 * angle[1]
    return (math.cos(half), math.sin(half))


def turn_steady(k: Constants, t: float) -> tuple[Quat, Vec]:
    """q Rot(omega, |omega| t)."""
    c, s = half_turn(pair_times((k[9], k[10]), scaled(t, k[8])))
    q = multiply((k[1], k[2], k[3], k[4]), (c, s * k[11], s * k[12], s * k[13]))
    return (normalize(q), (k[5], k[6], k[7]))


def turn_symmetric(k: Constants, t: float) -> tuple[Quat, Vec]:
    """q Rot(L, |L| t / A) Rot(z, (1 - C / A) w_z t), read as body axes; omega is carried round L."""
    time = scaled(t, k[8])
    c, s = half_turn(pair_times((k[9], k[10]), time))
    q0 = (k[1], k[2], k[3], k[4])
    about_momentum = (c, s * k[11], s * k[12], s * k[13])
    c, s = half_turn(pair_times((k[14], k[15]), time))
    axis = k[16]
    about_axis = (c, s if axis == 1.0 else 0.0, s if axis == 2.0 else 0.0, s if axis == 3.0 else 0.0)
    turned = multiply(q0, about_momentum)
    around = normalize(multiply(turned, conjugate(q0)))
    return (normalize(multiply(turned, about_axis)), rotate(around, (k[5], k[6], k[7])))


def turn_asymmetric(k: Constants, t: float) -> tuple[Quat, Vec]:
    """q (theta0, chi0)* Rot(z, psi) (theta, chi): see the top of the file."""
    time = scaled(t, k[8])
    u = pair_times((k[14], k[15]), time)
    psi = pair_times((k[9], k[10]), time)
    halves = 0.0  # periods 2 K gone by: each turns L half round z
    if k[0] == ASYMMETRIC:
        halves = whole((u[0] + k[20]) / k[16])
    if halves != 0.0:
        u = pair_sub(u, pair_times((k[16], k[17]), halves))
        psi = pair_add(psi, pair_times((k[18], k[19]), halves))
    phase = (u[0] + k[20]) + u[1]
    if k[0] == ASYMMETRIC:
        phase = max(-0.5 * k[16], min(0.5 * k[16], phase))
    m1 = k[22]
    sn, cn, dn = sn_cn_dn(phase, m1)
    cn = max(cn, 0.0)
    psi = pair_add(psi, (k[24] * (incomplete_h(sn, cn, dn, m1, k[23]) - k[21]), 0.0))
    # L / |L| along x, y, z, but for the half turns round z; set to length 1, which it has but for rounding.
    x, y, z = k[29] * cn, k[30] * sn, k[31] * dn
    n = math.sqrt(x * x + y * y + z * z)
    x, y, z = x / n, y / n, z / n
    c, s = half_turn(psi)
    turned = multiply(multiply((k[25], k[26], k[27], k[28]), (c, 0.0, 0.0, s)), upright(x, y, z))
    turned = multiply(turned, half_turns_back(halves))
    facing = 1.0 - 2.0 * abs(halves - 2.0 * whole(0.5 * halves))  # -1 after an odd count
    rates = (facing * x * k[32], facing * y * k[33], z * k[34])
    places = (k[11], k[12], k[13])
    step = to_own_axes((turned[1], turned[2], turned[3]), places)
    q = normalize(multiply((k[1], k[2], k[3], k[4]), (turned[0], step[0], step[1], step[2])))
    omega = rotate(q, to_own_axes(rates, places))
    return (q, (omega[0] * k[8], omega[1] * k[8], omega[2] * k[8]))


def upright(x: float, y: float, z: float) -> Quat:
    """Rot(x, theta) Rot(z, chi), which turns the unit vector (x, y, z) to (0, 0, 1), for x >= 0 and z >= 0.

    (x, y, z) = (sin theta sin chi, sin theta cos chi, cos theta).
    """
    across = norm((x, y, 0.0))
    cos_theta = math.sqrt(0.5 * (1.0 + z))
    sin_theta = 0.5 * across / cos_theta
    if across == 0.0:
        return (cos_theta, sin_theta, 0.0, 0.0)
    larger = math.sqrt(0.5 * (1.0 + abs(y) / across))
    smaller = 0.5 * x / across / larger
    cos_chi, sin_chi = (larger, smaller) if y >= 0.0 else (smaller, larger)
    return (cos_theta * cos_chi, sin_theta * cos_chi, -sin_theta * sin_chi, cos_theta * sin_chi)


def half_turns_back(halves: float) -> Quat:
    """Rot(z, -pi halves), exactly, in the sign that keeps the quaternion continuous in time."""
    quarter = halves - 4.0 * whole(0.25 * halves)  # -2, -1, 0, 1, 2
    if quarter == 0.0:
        return (1.0, 0.0, 0.0, 0.0)
    if abs(quarter) == 2.0:
        return (-1.0, 0.0, 0.0, 0.0)
    return (0.0, 0.0, 0.0, -quarter)


def to_own_axes(v: Vec, places: Vec) -> Vec:
    """Components along x, y, z to components along the body's own axes, which lie at ``places``."""
    return (own_axis(v, places[0]), own_axis(v, places[1]), own_axis(v, places[2]))


def own_axis(v: Vec, place: float) -> float:
    """The component of ``v`` along the body axis at ``place``."""
    component = v[int(abs(place)) - 1]
    return component if place > 0.0 else -component
