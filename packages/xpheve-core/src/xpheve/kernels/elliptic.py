"""Elliptic functions and integrals, and the pairs of floats that carry their periods over long times.

Everything takes the complementary parameter m1 = 1 - m = k'^2, which stays exact where m tends to 1.

Sources:
- R. Bulirsch, Numerical calculation of elliptic integrals and elliptic functions, Numer. Math. 7 (1965) 78: sn, cn, dn.
- B. C. Carlson, Numerical computation of real or complex elliptic integrals, Numer. Algorithms 10 (1995) 13: R_F, R_J.
- NIST Digital Library of Mathematical Functions, 19.8(i): complete integrals by the arithmetic-geometric mean.
- T. J. Dekker, A floating-point technique for extending the available precision, Numer. Math. 18 (1971) 224: pairs.
"""

import math

Pair = tuple[float, float]  # an unevaluated sum high + low, |low| <= half a unit of the last place of high: ~32 digits

HALF_PI: Pair = (1.5707963267948966, 6.123233995736766e-17)
SPLITTER = 134217729.0  # 2^27 + 1: halves the digits of a float


# Pairs of floats


def sum_exact(a: float, b: float) -> Pair:
    """a + b without error."""
    s = a + b
    t = s - a
    return (s, (a - (s - t)) + (b - t))


def product_exact(a: float, b: float) -> Pair:
    """a b without error, while nothing overflows or underflows."""
    p = a * b
    t = SPLITTER * a
    a_high = t - (t - a)
    a_low = a - a_high
    t = SPLITTER * b
    b_high = t - (t - b)
    b_low = b - b_high
    return (p, ((a_high * b_high - p) + a_high * b_low + a_low * b_high) + a_low * b_low)


def pair_add(a: Pair, b: Pair) -> Pair:
    """a + b, to ~2^-104 of the larger operand."""
    s, e = sum_exact(a[0], b[0])
    t, f = sum_exact(a[1], b[1])
    s, e = sum_exact(s, e + t)
    return sum_exact(s, e + f)


def pair_sub(a: Pair, b: Pair) -> Pair:
    """a - b, to ~2^-104 of the larger operand."""
    return pair_add(a, (-b[0], -b[1]))


def pair_mul(a: Pair, b: Pair) -> Pair:
    """a b, to ~2^-102 relative."""
    p, e = product_exact(a[0], b[0])
    return sum_exact(p, e + (a[0] * b[1] + a[1] * b[0]))


def pair_times(a: Pair, b: float) -> Pair:
    """a b for a single float b, to ~2^-103 relative."""
    p, e = product_exact(a[0], b)
    return sum_exact(p, e + a[1] * b)


def pair_div(a: Pair, b: Pair) -> Pair:
    """a / b, to ~2^-100 relative."""
    first = a[0] / b[0]
    rest = pair_sub(a, pair_times(b, first))
    second = rest[0] / b[0]
    rest = pair_sub(rest, pair_times(b, second))
    s, e = sum_exact(first, second)
    return sum_exact(s, e + rest[0] / b[0])


def pair_sqrt(a: Pair) -> Pair:
    """Square root to ~2^-102 relative, by one Newton step from the float root; 0 of anything not above 0."""
    if a[0] <= 0.0:
        return (0.0, 0.0)
    x = math.sqrt(a[0])
    rest = pair_sub(a, product_exact(x, x))
    return sum_exact(x, rest[0] / (2.0 * x))


# Jacobi elliptic functions


def rung(a: float, g: float, n: int) -> Pair:
    """The means ``n`` rungs down Gauss's ladder from ``a`` and ``g``."""
    for _ in range(n):
        a, g = 0.5 * (a + g), math.sqrt(a * g)
    return (a, g)


def gauss_descent(a: float, g: float, u: float) -> Pair:
    """(a_n cn / sn, dn) of one rung of Gauss's ladder of arithmetic-geometric means, found from the rung below.

    Down, then up again, each rung on the way up found once more from the top, so that the ladder needs no store; it is at
    most about a dozen rungs deep, since the means meet quadratically. ``u`` must not be a multiple of 2 K.
    """
    x, y, rungs = a, g, 0
    while x - y > 1e-8 * x:  # the next rung differs by the square of this: nothing. Said so that not-a-number ends too
        x, y = 0.5 * (x + y), math.sqrt(x * y)
        rungs += 1
    mean = 0.5 * (x + y)
    angle = u * mean
    cotangent = math.cos(angle) / math.sin(angle)
    below, dn = mean * cotangent, 1.0
    ratio = cotangent * below
    below, dn = below * dn, (y + ratio) / (x + ratio)
    for n in range(rungs - 1, -1, -1):
        x, y = rung(a, g, n)
        ratio = below * below / (0.5 * (x + y))
        below, dn = below * dn, (y + ratio) / (x + ratio)
    return (below, dn)


def sn_cn_dn(u: float, m1: float) -> tuple[float, float, float]:
    """Jacobi's sn, cn and dn of the argument ``u`` for the complementary parameter 0 <= m1 <= 1.

    At m1 = 0 they are tanh, sech, sech. For |u| <= K, to which the caller reduces: near K, where cn and dn are small,
    they keep their leading digits.
    """
    if m1 == 0.0:
        e = math.exp(-abs(u))
        sech = 2.0 * e / (1.0 + e * e)
        return (math.tanh(u), sech, sech)
    if abs(u) < 1e-9:  # to u^2, below a unit of the last place; the cotangent of 0 is spared
        return (u, 1.0, 1.0)
    c, dn = gauss_descent(1.0, math.sqrt(m1), abs(u))
    sn = 1.0 / math.sqrt(1.0 + c * c)
    return (math.copysign(sn, u), c * sn, dn)


# Carlson's symmetric integrals


def carlson_rc(x: float, y: float) -> float:
    """R_C(x, y) = 1/2 int_0^inf (t + x)^(-1/2) (t + y)^(-1) dt, for x >= 0, y > 0."""
    r = (y - x) / y
    if abs(r) < 1e-3:  # arcsine series, here to 1e-18: the closed forms below would divide 0 by 0
        series = 1.0 + r * (1 / 6 + r * (3 / 40 + r * (5 / 112 + r * (35 / 1152 + r * (63 / 2816)))))
        return series / math.sqrt(y)
    if r > 0.0:
        gap = math.sqrt(y - x)
        return math.atan2(gap, math.sqrt(x)) / gap
    gap = math.sqrt(x - y)
    return math.asinh(gap / math.sqrt(y)) / gap


def carlson_rf(x: float, y: float, z: float) -> float:
    """R_F(x, y, z) = 1/2 int_0^inf [(t + x)(t + y)(t + z)]^(-1/2) dt, for x, y, z >= 0, at most one of them 0."""
    a = (x + y + z) / 3.0
    q = max(abs(a - x), abs(a - y), abs(a - z)) * 120.0  # at a spread of 1/120 the series to degree 7 errs by ~1e-17
    while q > a:
        rx, ry, rz = math.sqrt(x), math.sqrt(y), math.sqrt(z)
        step = rx * (ry + rz) + ry * rz
        x, y, z, a = 0.25 * (x + step), 0.25 * (y + step), 0.25 * (z + step), 0.25 * (a + step)
        q *= 0.25
    dx, dy = (a - x) / a, (a - y) / a
    dz = -dx - dy
    e2 = dx * dy - dz * dz
    e3 = dx * dy * dz
    series = 1.0 - e2 / 10 + e3 / 14 + e2 * e2 / 24 - 3 * e2 * e3 / 44  # DLMF 19.36.1
    series += e2 * e2 * (e3 / 16 - 5 * e2 / 208) + 3 * e3 * e3 / 104
    return series / math.sqrt(a)


def carlson_rj(x: float, y: float, z: float, p: float) -> float:
    """R_J(x, y, z, p) = 3/2 int_0^inf [(t + x)(t + y)(t + z)]^(-1/2) (t + p)^(-1) dt, for x, y, z >= 0, p > 0."""
    a = (x + y + z + 2.0 * p) / 5.0
    q = max(abs(a - x), abs(a - y), abs(a - z), abs(a - p)) * 170.0  # as in carlson_rf
    power = 1.0
    total = 0.0
    while q > a:
        rx, ry, rz, rp = math.sqrt(x), math.sqrt(y), math.sqrt(z), math.sqrt(p)
        step = rx * (ry + rz) + ry * rz
        d = (rp + rx) * (rp + ry) * (rp + rz)
        # Carlson's 1 + (p - x)(p - y)(p - z) / d^2, written without its subtractions.
        total += power / d * carlson_rc(1.0, 2.0 * rp * (p + step) / d)
        x, y, z = 0.25 * (x + step), 0.25 * (y + step), 0.25 * (z + step)
        p, a = 0.25 * (p + step), 0.25 * (a + step)
        power *= 0.25
        q *= 0.25
    dx, dy, dz = (a - x) / a, (a - y) / a, (a - z) / a
    dp = -0.5 * (dx + dy + dz)
    e2 = dx * dy + dx * dz + dy * dz - 3.0 * dp * dp
    e3 = dx * dy * dz + 2.0 * e2 * dp + 4.0 * dp * dp * dp
    e4 = (2.0 * dx * dy * dz + e2 * dp + 3.0 * dp * dp * dp) * dp
    e5 = dx * dy * dz * dp * dp
    series = 1.0 - 3 * e2 / 14 + e3 / 6 + 9 * e2 * e2 / 88 - 3 * e4 / 22 - 9 * e2 * e3 / 52 + 3 * e5 / 26
    series += e2 * (3 * e4 / 20 - e2 * e2 / 16 + 45 * e2 * e3 / 272 - 9 * e5 / 68) + e3 * (3 * e3 / 40 - 9 * e4 / 68)
    return power * series / (a * math.sqrt(a)) + 6.0 * total


# Legendre's integrals


def complete_k(m1: float) -> float:
    """Complete integral of the first kind, K = F(pi/2), for 0 < m1 <= 1: pi / 2 over the mean of 1 and k'."""
    a, g = 1.0, math.sqrt(m1)
    while a - g > 1e-8 * a:  # the next mean differs by the square of this: nothing
        a, g = 0.5 * (a + g), math.sqrt(a * g)
    return math.pi / (a + g)


def incomplete_f(s: float, c: float, d: float) -> float:
    """F(phi) = int_0^phi d(theta) / sqrt(1 - m sin^2 theta), |phi| <= pi/2, from s = sin phi, c = cos phi = cn, d = dn.

    Three numbers instead of (phi, m), for near phi = pi/2 and m = 1 the small c and d must come with all their digits.
    """
    return s * carlson_rf(c * c, d * d, 1.0)


def incomplete_pi(s: float, c: float, d: float, n: float) -> float:
    """Pi(n; phi) = int_0^phi d(theta) / [(1 - n sin^2 theta) sqrt(1 - m sin^2 theta)], |phi| <= pi/2, n s^2 < 1."""
    x, y = c * c, d * d
    s2 = s * s
    return s * (carlson_rf(x, y, 1.0) + n * s2 / 3.0 * carlson_rj(x, y, 1.0, 1.0 - n * s2))


def atan_over(k: float, x: float) -> float:
    """atan(k x) / k, and its limit x at k = 0."""
    kx = k * x
    if abs(kx) < 1e-5:
        return x * (1.0 - kx * kx / 3.0)
    return math.atan(kx) / k


def incomplete_h(s: float, c: float, d: float, m1: float, nu: float) -> float:
    """H(u) = int_0^u cn^2 / (1 + nu sn^2) du, from s = sn u, c = cn u >= 0, d = dn u, for nu >= 0, to a few roundings.

    The third-kind integral of the free rigid body. As a difference of R_F and R_J it would cancel where nu is large or
    m1 small; with Carlson's exchange of the fourth argument of R_J, DLMF 19.21.12, every term is positive:

        H = atan(kappa s c / d) / kappa + m1 s^3 / (3 (1 + nu)) R_J(c^2, d^2, 1, c^2 + m1 s^2 / (1 + nu)),
        kappa^2 = nu (nu + m) / (1 + nu).

    At m1 = 0, where c = d, only the arc tangent is left.
    """
    if m1 == 0.0:
        return atan_over(math.sqrt(nu), s)
    kappa = math.sqrt(nu * ((nu + (1.0 - m1)) / (1.0 + nu)))
    c2, s2 = c * c, s * s
    share = m1 * s2 / (1.0 + nu)
    return atan_over(kappa, s * (c / d)) + s * share / 3.0 * carlson_rj(c2, d * d, 1.0, c2 + share)


def complete_k_h(m1: Pair, nu1: Pair) -> tuple[float, float, float, float]:
    """K and H(K) of ``incomplete_h`` as pairs: (K high, K low, H high, H low), for 0 < m1 <= 1 and nu1 = 1 + nu >= 1.

    DLMF 19.8.5 to 19.8.7 with alpha^2 = -nu, by which H = K (1 - sum Q_n / 2). In pairs, because the count of
    periods multiplies their error: a day of fast spinning has 1e8 of them.
    """
    a: Pair = (1.0, 0.0)
    g = pair_sqrt(m1)
    p = pair_sqrt(nu1)
    weight: Pair = (1.0, 0.0)
    total: Pair = (1.0, 0.0)
    while a[0] - g[0] > 1e-15 * a[0] or weight[0] > 1e-33:  # the mean taken below errs by the square of the first
        ag = pair_mul(a, g)
        pp = pair_mul(p, p)
        above = pair_add(pp, ag)
        weight = pair_times(pair_div(pair_mul(weight, pair_sub(pp, ag)), above), 0.5)
        total = pair_add(total, weight)
        p = pair_times(pair_div(above, p), 0.5)
        mean = pair_add(a, g)
        a, g = (0.5 * mean[0], 0.5 * mean[1]), pair_sqrt(ag)
    k = pair_div(HALF_PI, pair_times(pair_add(a, g), 0.5))
    h = pair_mul(k, pair_sub((1.0, 0.0), (0.5 * total[0], 0.5 * total[1])))
    return (k[0], k[1], h[0], h[1])
