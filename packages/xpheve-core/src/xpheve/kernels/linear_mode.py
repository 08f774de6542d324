"""One mode of a linear motion, z'' = a z + b z': what a unit of velocity and a unit of force make of it, after any span, exactly.

The numbers a and b may be complex: then z = x + i y is a place in a plane in which the motion looks alike in every direction, as
that of a charge in a magnetic field, or seen from a turntable. Let S be the solution with z(0) = 0, z'(0) = 1 (the answer to a push), and T its
integral from 0 (the answer to a constant force). With force f at rest and velocity v at the beginning

    z(s) - z(0) = S v + T f,    z'(s) = S' v + S f.

With the roots r = m +- d of the characteristic equation, m = b/2, d^2 = m^2 + a: S = exp(m s) sinh(d s)/d = (exp(r1 s) - exp(r2 s))/(r1 - r2).
Roots and phases r s are pairs of floats, so that the error is a few units of the last place however long the span and stiff the
mode: each exponential is that of the exact a, b and s. Small arguments are summed as power series; near equal roots even functions of
d s take the place of differences; the root that is small beside the other one is -a over that.

Sources: the closed form is in every textbook, such as L. D. Landau, E. M. Lifshitz, Mechanics (3rd ed. 1976), sections 21 to 26; pairs of
floats: T. J. Dekker, Numer. Math. 18 (1971) 224.
"""

from xpheve.kernels.elliptic import (
    Pair,
    pair_add,
    pair_div,
    pair_mul,
    pair_sqrt,
    pair_sub,
)
from xpheve.kernels.ieee import cos, divide, exp, sin

Complex = tuple[float, float]  # real and imaginary part
Wide = tuple[Pair, Pair]  # the same in pairs

SMALL = 4.0  # |a| s^2 + |b| s up to which the power series are as exact as anything
CLOSE = 0.5  # |d| s up to which the roots count as equal
TERMS = 48  # more than any series here takes


def times(x: Complex, y: Complex) -> Complex:
    """x y."""
    return (x[0] * y[0] - x[1] * y[1], x[0] * y[1] + x[1] * y[0])


def over(x: Complex, y: Complex) -> Complex:
    """x / y, scaled so that squares of y neither overflow nor underflow."""
    size = max(abs(y[0]), abs(y[1]))
    p, q = divide(y[0], size), divide(y[1], size)
    norm = (p * p + q * q) * size
    return (divide(x[0] * p + x[1] * q, norm), divide(x[1] * p - x[0] * q, norm))


def wide_times(x: Wide, y: Wide) -> Wide:
    """x y in pairs."""
    real = pair_sub(pair_mul(x[0], y[0]), pair_mul(x[1], y[1]))
    return (real, pair_add(pair_mul(x[0], y[1]), pair_mul(x[1], y[0])))


def wide_over(x: Wide, y: Wide) -> Wide:
    """x / y in pairs."""
    norm = pair_add(pair_mul(y[0], y[0]), pair_mul(y[1], y[1]))
    real = pair_add(pair_mul(x[0], y[0]), pair_mul(x[1], y[1]))
    imaginary = pair_sub(pair_mul(x[1], y[0]), pair_mul(x[0], y[1]))
    return (pair_div(real, norm), pair_div(imaginary, norm))


def wide_root(x: Wide) -> Wide:
    """The square root of x with real part >= 0."""
    re, im = x
    if im[0] == 0.0:
        return (pair_sqrt(re), (0.0, 0.0)) if re[0] >= 0.0 else ((0.0, 0.0), pair_sqrt((-re[0], -re[1])))
    size = pair_sqrt(pair_add(pair_mul(re, re), pair_mul(im, im)))
    if size[0] == 0.0:  # squares underflow
        return ((0.0, 0.0), (0.0, 0.0))
    if re[0] >= 0.0:
        one = pair_sqrt(half(pair_add(size, re)))
        return (one, half(pair_div(im, one)))
    other = pair_sqrt(half(pair_sub(size, re)))
    if im[0] < 0.0:
        other = (-other[0], -other[1])
    return (half(pair_div(im, other)), other)


def half(x: Pair) -> Pair:
    """x / 2, exactly."""
    return (0.5 * x[0], 0.5 * x[1])


def larger(x: Wide, y: Wide) -> bool:
    """Whether |x| >= |y|."""
    return max(abs(x[0][0]), abs(x[1][0])) >= max(abs(y[0][0]), abs(y[1][0]))


def prepared(a: Wide, b: Wide) -> tuple[Wide, Wide, Wide, Wide, Wide, Wide]:
    """What holds for every span: a, b, m = b/2, d, and the two roots."""
    mean = (half(b[0]), half(b[1]))
    square = wide_times(mean, mean)
    gap = wide_root((pair_add(square[0], a[0]), pair_add(square[1], a[1])))
    first = (pair_add(mean[0], gap[0]), pair_add(mean[1], gap[1]))
    second = (pair_sub(mean[0], gap[0]), pair_sub(mean[1], gap[1]))
    minus = ((-a[0][0], -a[0][1]), (-a[1][0], -a[1][1]))
    if larger(first, second):
        if first[0][0] != 0.0 or first[1][0] != 0.0:
            second = wide_over(minus, first)
    else:
        first = wide_over(minus, second)
    return (a, b, mean, gap, first, second)


def rounded(x: Wide) -> Complex:
    """x in floats."""
    return (x[0][0], x[1][0])


def spanned(x: Wide, s: Pair) -> Wide:
    """x s in pairs."""
    return (pair_mul(x[0], s), pair_mul(x[1], s))


def exponential(x: Wide) -> Complex:
    """exp(x), its phase as exact as the pair."""
    size = exp(x[0][0]) * (1.0 + x[0][1])
    if x[1][0] == 0.0:
        return (size, 0.0)
    c, s, p, q = cos(x[1][0]), sin(x[1][0]), cos(x[1][1]), sin(x[1][1])
    return (size * (c * p - s * q), size * (s * p + c * q))


def mean_exponential(root: Complex, phase: Complex, grown: Complex, s: float) -> Complex:
    """(exp(r s) - 1)/r for the root r, of phase r s and exponential ``grown``; s where r is 0."""
    if max(abs(phase[0]), abs(phase[1])) > 0.5:
        return over((grown[0] - 1.0, grown[1]), root)
    total, term = (1.0, 0.0), (1.0, 0.0)
    for k in range(2, TERMS):
        term = times(term, phase)
        term = (term[0] / k, term[1] / k)
        total = (total[0] + term[0], total[1] + term[1])
        if abs(term[0]) + abs(term[1]) < 1e-19:
            break
    return (total[0] * s, total[1] * s)


def by_series(a: Complex, b: Complex, s: float) -> tuple[Complex, Complex, Complex]:
    """S, S' and T as power series."""
    p, q = (a[0] * s * s, a[1] * s * s), (b[0] * s, b[1] * s)
    before, term = (0.0, 0.0), (1.0, 0.0)
    push, speed, way = (1.0, 0.0), (1.0, 0.0), (0.5, 0.0)
    for k in range(2, TERMS):
        x, y = times(p, before), times(q, term)
        rest = 1.0 / (k - 1)
        before, term = term, ((x[0] * rest + y[0]) / k, (x[1] * rest + y[1]) / k)
        push = (push[0] + term[0], push[1] + term[1])
        speed = (speed[0] + k * term[0], speed[1] + k * term[1])
        way = (way[0] + term[0] / (k + 1), way[1] + term[1] / (k + 1))
        if abs(term[0]) + abs(term[1]) + abs(before[0]) + abs(before[1]) < 1e-20:
            break
    return ((s * push[0], s * push[1]), speed, (s * s * way[0], s * s * way[1]))


def by_equal_roots(a: Complex, b: Complex, mean: Wide, gap: Complex, span: Pair) -> tuple[Complex, Complex, Complex]:
    """S, S' and T where the roots are nearly one."""
    s = span[0]
    z = (gap[0] * s, gap[1] * s)
    square = times(z, z)
    sine, cosine, term = (1.0, 0.0), (1.0, 0.0), (1.0, 0.0)
    for k in range(1, 12):
        term = times(term, square)
        term = (term[0] / (2 * k * (2 * k - 1)), term[1] / (2 * k * (2 * k - 1)))
        cosine = (cosine[0] + term[0], cosine[1] + term[1])
        sine = (sine[0] + term[0] / (2 * k + 1), sine[1] + term[1] / (2 * k + 1))
    grown = exponential(spanned(mean, span))
    m = (mean[0][0] * s, mean[1][0] * s)
    push = times(grown, sine)
    turned = times(m, sine)
    speed = times(grown, (cosine[0] + turned[0], cosine[1] + turned[1]))
    push = (push[0] * s, push[1] * s)
    drag = times(b, push)
    return (push, speed, over((speed[0] - 1.0 - drag[0], speed[1] - drag[1]), a))


def by_roots(
    a: Complex, b: Complex, gap: Complex, first: Wide, second: Wide, span: Pair
) -> tuple[Complex, Complex, Complex]:
    """S, S' and T where the roots differ."""
    p, q = spanned(first, span), spanned(second, span)
    e, g = exponential(p), exponential(q)
    r, t = rounded(first), rounded(second)
    apart = (2.0 * gap[0], 2.0 * gap[1])
    push = over((e[0] - g[0], e[1] - g[1]), apart)
    x, y = times(r, e), times(t, g)
    speed = over((x[0] - y[0], x[1] - y[1]), apart)
    if max(abs(gap[0]), abs(gap[1])) <= 0.25 * max(abs(b[0]), abs(b[1])):
        drag = times(b, push)
        return (push, speed, over((speed[0] - 1.0 - drag[0], speed[1] - drag[1]), a))
    u, w = mean_exponential(r, rounded(p), e, span[0]), mean_exponential(t, rounded(q), g, span[0])
    return (push, speed, over((u[0] - w[0], u[1] - w[1]), apart))


def flow(mode: tuple[Wide, Wide, Wide, Wide, Wide, Wide], span: Pair) -> tuple[Complex, Complex, Complex]:
    """S, S' and T of a prepared mode after ``span`` [s]."""
    a, b, mean, gap, first, second = mode
    x, y, d = rounded(a), rounded(b), rounded(gap)
    s = abs(span[0])
    if (abs(x[0]) + abs(x[1])) * s * s + (abs(y[0]) + abs(y[1])) * s <= SMALL:
        return by_series(x, y, span[0])
    if max(abs(d[0]), abs(d[1])) * s <= CLOSE:
        return by_equal_roots(x, y, mean, d, span)
    return by_roots(x, y, d, first, second, span)
