"""Velocities after an impact along a normal, as if the exact solution were rounded once: sums and products in two floats.

A pair of floats stands for their unevaluated sum, about 32 digits. Where the exact result is no float, that is rounded wrongly only if it is
within 1e-15 of its last place of the middle between two. Source: Dekker, Numer. Math. 18 (1971) 224; error-free sums of Knuth, TAOCP 2, 4.2.2.
"""

from __future__ import annotations

from xpheve.kernels.clock import two_sum
from xpheve.kernels.polynomial import product_error
from xpheve.kernels.vector import Vec

Two = tuple[float, float]


def product(a: float, b: float) -> Two:
    """``a b`` without error."""
    p = a * b
    return (p, product_error(a, b, p))


def sum_of(a: Two, b: Two) -> Two:
    """a + b."""
    high, error = two_sum(a[0], b[0])
    low, rest = two_sum(a[1], b[1])
    high, error = two_sum(high, error + low)
    return two_sum(high, error + rest)


def times(a: Two, b: Two) -> Two:
    """a b."""
    p = a[0] * b[0]
    return two_sum(p, product_error(a[0], b[0], p) + (a[0] * b[1] + a[1] * b[0]))


def over(a: Two, b: Two) -> Two:
    """a / b."""
    first = a[0] / b[0]
    rest = sum_of(a, times((-first, 0.0), b))
    second = rest[0] / b[0]
    rest = sum_of(rest, times((-second, 0.0), b))
    high, low = two_sum(first, second)
    return two_sum(high, low + rest[0] / b[0])


def separation(n: Vec, u: Vec, v: Vec) -> Two:
    """n . (v - u): how fast a pair comes apart."""
    x = times(two_sum(v[0], 0.0 - u[0]), (n[0], 0.0))
    y = times(two_sum(v[1], 0.0 - u[1]), (n[1], 0.0))
    z = times(two_sum(v[2], 0.0 - u[2]), (n[2], 0.0))
    return sum_of(sum_of(x, y), z)


def pushed(u: Vec, n: Vec, share: Two) -> Vec:
    """``u + share n``, each component rounded once; no -0."""
    return (component(u[0], n[0], share), component(u[1], n[1], share), component(u[2], n[2], share))


def component(u: float, n: float, share: Two) -> float:
    """One component of `pushed`."""
    if n == 0.0:
        return u + 0.0
    change = times(share, (n, 0.0))
    high, low = two_sum(u, change[0])
    return high + (low + change[1]) + 0.0


def impulse(n: Vec, u: Vec, v: Vec, inverse_a: float, inverse_b: float, restitution: float) -> Two:
    """The impulse along ``n`` on the second, as many n [N s], after which they part at ``restitution`` times the speed of approach.

    Newton's law: J = -(1 + e) n.(v - u) / (n.n (1/m_a + 1/m_b)).
    """
    square = sum_of(sum_of(product(n[0], n[0]), product(n[1], n[1])), product(n[2], n[2]))
    wanted = times(separation(n, u, v), two_sum(1.0, restitution))
    p = over(wanted, times(square, two_sum(inverse_a, inverse_b)))
    return (0.0 - p[0], 0.0 - p[1])


def along_axis(n: Vec) -> bool:
    """Whether ``n`` is one of the axes."""
    return abs(n[0]) + abs(n[1]) + abs(n[2]) == 1.0 and (abs(n[0]) == 1.0 or abs(n[1]) == 1.0 or abs(n[2]) == 1.0)


def thrown_back(n: Vec, u: Vec, restitution: float) -> Vec:
    """The velocity after an impact on what stands still: u - (1 + e) (n.u / n.n) n."""
    if along_axis(n):
        return (
            (0.0 - restitution * u[0] if n[0] != 0.0 else u[0]) + 0.0,
            (0.0 - restitution * u[1] if n[1] != 0.0 else u[1]) + 0.0,
            (0.0 - restitution * u[2] if n[2] != 0.0 else u[2]) + 0.0,
        )
    p = impulse(n, u, (0.0, 0.0, 0.0), 1.0, 0.0, restitution)
    return pushed(u, n, (0.0 - p[0], 0.0 - p[1]))
