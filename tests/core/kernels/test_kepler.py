"""Motion about another body: against mpmath's, worked to 60 digits from the same floats, and by what nature conserves."""

from __future__ import annotations

import math
import random
from fractions import Fraction
from typing import Any

import mpmath
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mpf

from xpheve.kernels.elliptic import Pair
from xpheve.kernels.kepler import Orbit, inverse_square_rate, moved, prepare

Vec = tuple[float, float, float]
EPSILON = 2.0**-52
ROUNDINGS = 6 * EPSILON  # of the distance: what the last dozen operations leave


def orbit_of(x: Vec, v: Vec, mu: float) -> Orbit:
    d, w = (tuple((one, 0.0) for one in vector) for vector in (x, v))
    return prepare(d, w, (mu, 0.0))  # type: ignore[arg-type]


def flown(x: Vec, v: Vec, mu: float, s: float) -> tuple[list[mpf], list[mpf]]:
    """Place and velocity after ``s``, nothing rounded that `moved` gives."""
    change, more, kick = moved(orbit_of(x, v, mu), s, 0.0)
    place = [mpf(a) + mpf(b) + mpf(c) for a, b, c in zip(x, change, more, strict=True)]
    return place, [mpf(a) + mpf(b) for a, b in zip(v, kick, strict=True)]


def reference(x: Vec, v: Vec, mu: float, s: Any) -> tuple[list[mpf], list[mpf]]:
    """The same in 60 digits: Kepler's equation by bisection, then by Newton's method."""
    d, w, gm = [mpf(one) for one in x], [mpf(one) for one in v], mpf(mu)
    s = mpf(s)
    r = mpmath.sqrt(sum(a * a for a in d))
    sigma = sum(a * b for a, b in zip(d, w, strict=True))
    beta = 2 * gm / r - sum(a * a for a in w)
    zeta = gm - beta * r
    b = mpmath.sqrt(abs(beta))

    def g(y: mpf) -> tuple[mpf, mpf, mpf, mpf]:
        if beta > 0:
            sine, cosine = mpmath.sin(b * y) / b, mpmath.cos(b * y)
        elif beta < 0:
            sine, cosine = mpmath.sinh(b * y) / b, mpmath.cosh(b * y)
        else:
            return mpf(1), y, y * y / 2, y**3 / 6
        return cosine, sine, (1 - cosine) / beta, (y - sine) / beta

    def miss(y: mpf) -> mpf:
        _, _, two, three = g(y)
        return r * y + sigma * two + zeta * three - s

    if beta > 0 and gm > 0:
        period = 2 * mpmath.pi * gm / beta ** mpf(1.5)
        s = s - mpmath.nint(s / period) * period
    low, high = mpf(0), s / r
    if beta < 0:  # where hyperbolic sines are numbers still
        high = mpmath.sign(s) * min(abs(high), 1 / b)
    while (miss(high) > 0) != (s > 0) and s != 0:
        high = 2 * high
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (low, middle) if (miss(middle) > 0) == (s > 0) else (middle, high)
    y = (low + high) / 2
    for _ in range(8):
        _, one, two, _ = g(y)
        y -= miss(y) / (r + sigma * one + zeta * two)
    _, one, two, _ = g(y)
    distance, pull, along = r + sigma * one + zeta * two, gm * two / r, r * one + sigma * two
    place = [p + along * q - pull * p for p, q in zip(d, w, strict=True)]
    velocity = [q - gm * one / (r * distance) * p - gm * two / distance * q for p, q in zip(d, w, strict=True)]
    return place, velocity


def length(a: Any) -> Any:
    return mpmath.sqrt(sum(mpf(one) ** 2 for one in a))


def apart(a: Any, b: Any) -> Any:
    return length([p - q for p, q in zip(a, b, strict=True)])


def check(x: Vec, v: Vec, mu: float, s: float, room: float = ROUNDINGS) -> None:
    """Place and velocity are right to some roundings, of the distance and of the greater of both speeds."""
    with mpmath.workdps(60):
        place, velocity = flown(x, v, mu, s)
        right, speed = reference(x, v, mu, s)
        assert apart(place, right) <= room * length(right)
        assert apart(velocity, speed) <= 2 * room * max(length(speed), length(v))


def about(e: float, anomaly: float, scale: float = 1.0, mu: float = 1.0) -> tuple[Vec, Vec]:
    """A state on an orbit of eccentricity ``e`` and parameter ``scale``, tilted, ``anomaly`` [rad] from its nearest point."""
    r = scale / (1.0 + e * math.cos(anomaly))
    speed = math.sqrt(mu / scale)
    x, y = r * math.cos(anomaly), r * math.sin(anomaly)
    u, w = -speed * math.sin(anomaly), speed * (e + math.cos(anomaly))
    return (0.6 * x, y, 0.8 * x), (0.6 * u, w, 0.8 * u)


ECCENTRICITIES = [
    0.0,
    1e-17,
    1e-9,
    0.01,
    0.099,
    0.101,
    0.5,
    0.9,
    0.999,
    0.999999,
    1.0 - 1e-12,
    1.0,
    1.0 + 1e-12,
    1.0001,
    1.5,
    30.0,
    1e6,
]


def test_the_reference_obeys_newton() -> None:
    x, v = about(0.7, 1.0)
    with mpmath.workdps(60):
        h = mpf(10) ** -15
        for s in (0, 3, 40):
            before, here, after = (reference(x, v, 1.0, mpf(s) + k * h)[0] for k in (-1, 0, 1))
            pull = [-one / length(here) ** 3 for one in here]
            second = [(a - 2 * b + c) / h**2 for a, b, c in zip(before, here, after, strict=True)]
            assert apart(second, pull) < mpf(10) ** -25
            assert (
                apart([(c - a) / (2 * h) for a, c in zip(before, after, strict=True)], reference(x, v, 1.0, s)[1])
                < mpf(10) ** -25
            )


@pytest.mark.parametrize("orbits", [1, 100, 1000, 10**6, 10**9])
def test_an_orbit_of_eccentricity_nine_tenths_is_right_for_ever(orbits: int) -> None:
    e = 0.9
    for share in (0.0, 0.1, 0.4999, 0.5, 0.77, 0.99999):
        check((1.0 - e, 0.0, 0.0), (0.0, math.sqrt((1.0 + e) / (1.0 - e)), 0.0), 1.0, 2.0 * math.pi * (orbits + share))
        check((1.0 + e, 0.0, 0.0), (0.0, math.sqrt((1.0 - e) / (1.0 + e)), 0.0), 1.0, 2.0 * math.pi * (orbits + share))


@pytest.mark.parametrize("e", ECCENTRICITIES)
def test_orbits_of_all_eccentricities(e: float) -> None:
    for anomaly, span in ((0.0, 1e-12), (0.0, 0.3), (1.0, 5.0), (-1.5, 2.0), (-1.5, 200.0), (1.5, -3e4), (-0.01, 0.02)):
        x, v = about(e, anomaly)
        check(x, v, 1.0, span)


@given(
    e=st.floats(0.0, 1.0) | st.floats(0.999, 1.001) | st.floats(1.0, 100.0),
    anomaly=st.floats(-1.5, 1.5),
    scale=st.floats(-9.0, 12.0),
    mu=st.floats(-20.0, 25.0),
    span=st.floats(-12.0, 9.0),
    back=st.booleans(),
)
@settings(max_examples=60)
def test_orbits_of_all_sizes_over_all_times(
    e: float, anomaly: float, scale: float, mu: float, span: float, back: bool
) -> None:
    size, strength = 10.0**scale, 10.0**mu
    x, v = about(e, anomaly, size, strength)
    s = 10.0**span * math.sqrt(size / strength) * size
    check(x, v, strength, -s if back else s)


@given(v=st.tuples(*[st.floats(-3.0, 3.0)] * 3), span=st.floats(-6.0, 6.0), anomaly=st.floats(-3.0, 3.0))
@settings(max_examples=40)
def test_bodies_that_repel_one_another(v: Vec, span: float, anomaly: float) -> None:
    check((math.cos(anomaly), math.sin(anomaly), 0.3), v, -1.0, 10.0**span)


@given(across=st.floats(-30.0, -3.0), span=st.floats(0.0, 100.0), away=st.floats(-1.2, 1.2))
@settings(max_examples=40)
def test_all_but_straight_falls_pass_the_centre(across: float, span: float, away: float) -> None:
    check((1.0, 0.0, 0.0), (away, 10.0**across, 0.0), 1.0, span)


PLAIN = st.floats(-2.0, 2.0).map(lambda one: round(one, 9))
"""Numbers that stay whole however they are scaled here."""


@given(
    x=st.tuples(*[PLAIN] * 3).filter(any),
    v=st.tuples(*[PLAIN] * 3),
    s=st.floats(-1e4, 1e4).map(lambda one: round(one, 6)),
    length_shift=st.integers(-200, 200),
    time_shift=st.integers(-200, 200),
    sign=st.sampled_from([1.0, -1.0]),
)
def test_other_units_change_no_bit(x: Vec, v: Vec, s: float, length_shift: int, time_shift: int, sign: float) -> None:
    def scaled(one: Any, k: int) -> Any:
        return tuple(math.ldexp(part, k) for part in one)

    change, more, kick = moved(orbit_of(x, v, sign), s, 0.0)
    speed_shift = length_shift - time_shift
    other = orbit_of(
        scaled(x, length_shift), scaled(v, speed_shift), math.ldexp(sign, 3 * length_shift - 2 * time_shift)
    )
    found = moved(other, math.ldexp(s, time_shift), 0.0)
    expected = scaled(change, length_shift), scaled(more, length_shift), scaled(kick, speed_shift)
    assert str(found) == str(expected)  # NaN beyond a fall


@given(e=st.floats(0.0, 3.0), anomaly=st.floats(-1.5, 1.5), s=st.floats(0.0, 50.0))
def test_time_runs_backward_as_forward(e: float, anomaly: float, s: float) -> None:
    x, v = about(e, anomaly)
    change, more, kick = moved(orbit_of(x, v, 1.0), -s, 0.0)
    mirror, rest, jerk = moved(orbit_of(x, tuple(-one for one in v), 1.0), s, 0.0)  # type: ignore[arg-type]
    assert (change, more) == (mirror, rest)
    assert kick == tuple(-one for one in jerk)


@given(e=st.floats(0.0, 0.95), anomaly=st.floats(-3.0, 3.0), s=st.floats(0.01, 6.0))
def test_the_way_back_leads_home(e: float, anomaly: float, s: float) -> None:
    x, v = about(e, anomaly, 1.0 - e * e)
    place, velocity = (tuple(map(float, one)) for one in flown(x, v, 1.0, s))
    home, before = flown(place, velocity, 1.0, -s)
    slow = (1.0 + e) / (1.0 - e)  # by how much a rounding may grow in a passage
    assert apart(home, x) < 100 * EPSILON * slow**1.5 and apart(before, v) < 100 * EPSILON * slow**2.5


@given(
    e=st.floats(0.0, 0.999999) | st.floats(0.9999, 1.0001) | st.floats(1.0, 10.0),
    anomaly=st.floats(-1.5, 1.5),
    scale=st.floats(-9.0, 12.0),
    span=st.floats(-12.0, 9.0),
)
@settings(max_examples=60)
def test_energy_angular_momentum_and_laplaces_vector_are_kept(
    e: float, anomaly: float, scale: float, span: float
) -> None:
    size = 10.0**scale
    x, v = about(e, anomaly, size, size**3)
    with mpmath.workdps(40):
        mu, states = mpf(size**3), [([mpf(a) for a in x], [mpf(a) for a in v]), flown(x, v, size**3, 10.0**span)]
        energies, momenta, vectors, fasts = [], [], [], []
        for place, velocity in states:
            r, fast = length(place), length(velocity)
            h = [place[k - 2] * velocity[k - 1] - place[k - 1] * velocity[k - 2] for k in range(3)]
            turned = [velocity[k - 2] * h[k - 1] - velocity[k - 1] * h[k - 2] for k in range(3)]
            energies.append(fast**2 / 2 - mu / r)
            momenta.append(h)
            vectors.append([a - mu * b / r for a, b in zip(turned, place, strict=True)])
            fasts.append(max(fast**2, mu / r))
        far, fast = max(length(place) for place, _ in states), mpmath.sqrt(max(fasts))
        assert abs(energies[1] - energies[0]) <= 16 * EPSILON * max(fasts)
        assert apart(*momenta) <= 16 * EPSILON * far * fast
        assert apart(*vectors) <= 16 * EPSILON * max(mu, far * fast * fast)


def test_no_time_changes_nothing_and_a_little_time_little() -> None:
    x, v = about(0.5, 1.0)
    orbit = orbit_of(x, v, 1.0)
    still = (0.0, 0.0, 0.0)
    assert moved(orbit, 0.0, 0.0) == (still, still, still)
    for s in (5e-324, 1e-300, 1e-100, 1e-20):
        change, more, kick = moved(orbit, s, 0.0)
        assert change == pytest.approx(tuple(s * one for one in v), rel=4e-16, abs=5e-324) and more == still
        assert kick == pytest.approx(tuple(-s * one / math.hypot(*x) ** 3 for one in x), rel=4e-16, abs=5e-324)


def test_time_may_be_a_pair_of_floats() -> None:
    x, v = about(0.9, 0.3)
    with mpmath.workdps(60):
        orbit = orbit_of(x, v, 1.0)
        s, rest = 1e9, 5.9e-8
        change, more, _ = moved(orbit, s, rest)
        right = reference(x, v, 1.0, mpf(s) + mpf(rest))[0]
        found = [mpf(a) + mpf(b) + mpf(c) for a, b, c in zip(x, change, more, strict=True)]
        assert apart(found, right) <= ROUNDINGS * length(right)
        assert apart(found, reference(x, v, 1.0, s)[0]) > 1e-9


def test_a_straight_fall_ends_in_the_centre() -> None:
    at_rest = orbit_of((2.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0)
    assert at_rest[8] / at_rest[1] == pytest.approx(math.pi, rel=1e-15) and at_rest[7] == -at_rest[8]
    check((2.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0, 3.0)
    check((2.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0, -3.14159)
    for s in (3.15, -3.15, 1e300):
        assert all(math.isnan(one) for part in moved(at_rest, s, 0.0) for one in part)
    outward = orbit_of((0.0, 3.0, 0.0), (0.0, 1.0, 0.0), 1.0)  # faster than the speed of escape
    assert outward[8] == math.inf and -math.inf < outward[7] < 0.0
    check((0.0, 3.0, 0.0), (0.0, 1.0, 0.0), 1.0, 1e9)
    inward = orbit_of((0.0, 3.0, 0.0), (0.0, -1.0, 0.0), 1.0)
    assert inward[8] == -outward[7] and inward[7] == -math.inf
    thrown = orbit_of((0.0, 0.0, 1.0), (0.0, 0.0, 1.0), 1.0)  # up, and down again
    period = thrown[5]
    assert thrown[8] - thrown[7] == pytest.approx(period, rel=1e-15)
    check((0.0, 0.0, 1.0), (0.0, 0.0, 1.0), 1.0, 0.999 * thrown[8] / thrown[1])


def test_without_a_force_motion_is_uniform_even_through_the_centre() -> None:
    orbit = orbit_of((1.0, 0.0, 0.0), (-1.0, 0.5, 0.0), 0.0)
    assert moved(orbit, 4.0, 0.0) == ((-4.0, 2.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert moved(orbit_of((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), 0.0), 1.0, 0.0)[0] == (-1.0, 0.0, 0.0)


HOSTILE: list[tuple[Vec, Vec, float, float]] = [
    ((1e300, 0.0, 0.0), (0.0, 1e150, 0.0), 1e300, 1e150),
    ((1e300, 1e300, 0.0), (0.0, 1e300, 0.0), 1e308, 1e5),
    ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), 1.0, 1e300),
    ((1.0, 0.0, 0.0), (0.0, math.sqrt(2.0), 0.0), 1.0, 1e300),
    ((1.0, 0.0, 0.0), (0.0, 2.0, 0.0), 1.0, -1e300),
    ((1.0, 0.0, 0.0), (0.0, 0.0, 0.0), -1.0, 1e300),
    ((1.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1e-300, 1e150),
    ((1.0, 0.0, 0.0), (0.0, 0.0, 0.0), 5e-324, 1e100),
    ((1.0, 0.0, 0.0), (0.0, 1e-160, 0.0), 1.0, 1e4),
    ((1.0, 0.0, 0.0), (0.0, 1e300, 0.0), 1.0, 1e-300),
    ((1.0, 0.0, 0.0), (-1e300, 1e-300, 0.0), 1.0, 1e8),
    ((1e-9, 0.0, 0.0), (0.0, 0.0, 0.0), -1e20, 1e9),
    ((1.0, 0.0, 0.0), (0.0, 1e200, 0.0), 1e-200, 1.0),
    ((1e12, 0.0, 0.0), (0.0, 1e-200, 0.0), 1e-290, 1.0),
    ((1e-300, 0.0, 0.0), (0.0, 1.0, 0.0), 1e-300, 1.0),
    ((5e-300, 0.0, 0.0), (0.0, 1e-10, 0.0), 5e-320, 1e-290),
]


@pytest.mark.parametrize(("x", "v", "mu", "s"), HOSTILE)
def test_numbers_at_the_ends_of_their_range_give_numbers(x: Vec, v: Vec, mu: float, s: float) -> None:
    change, more, kick = moved(orbit_of(x, v, mu), s, 0.0)
    assert all(map(math.isfinite, (*change, *more, *kick)))
    if abs(s) < 1e200 and v[0] > -1e200:
        check(x, v, mu, s, 1e-14)


def exact(pair: Pair) -> Fraction:
    return Fraction(pair[0]) + Fraction(pair[1])


@given(
    k=st.floats(-1e30, 1e30).filter(lambda one: abs(one) > 1e-30),
    q=st.floats(1e-100, 1e100),
    p=st.floats(-1e100, -1e-100),
    a=st.floats(1e-100, 1e100),
    b=st.floats(1e-100, 1e100),
)
def test_the_strength_of_a_pair_is_right_to_thirty_digits(k: float, q: float, p: float, a: float, b: float) -> None:
    right = Fraction(k) * Fraction(q) * Fraction(p) * (1 / Fraction(a) + 1 / Fraction(b))
    if 1e-250 < abs(right) < 1e300:
        assert abs(exact(inverse_square_rate(k, q, p, a, b)) / right - 1) < Fraction(1, 10**30)
    alone = Fraction(k) * Fraction(q) * Fraction(p) / Fraction(b)
    if 1e-250 < abs(alone) < 1e300:
        assert abs(exact(inverse_square_rate(k, q, p, math.inf, b)) / alone - 1) < Fraction(1, 10**30)
    assert inverse_square_rate(0.0, q, p, a, b)[0] == 0.0


@pytest.mark.stress
@pytest.mark.parametrize("seed", range(4))
def test_thousands_of_orbits_of_all_kinds(seed: int) -> None:
    rng = random.Random(seed)
    for _ in range(2000):
        e = rng.choice([rng.uniform(0, 1), 1.0 - 10.0 ** rng.uniform(-9, 0), 1.0 + 10.0 ** rng.uniform(-9, 4)])
        size, mu = 10.0 ** rng.uniform(-9, 12), 10.0 ** rng.uniform(-20, 20)
        x, v = about(e, rng.uniform(-1.57, 1.57) if e >= 1.0 else rng.uniform(-3.1, 3.1), size, mu)
        sign = rng.choice([1.0, 1.0, -1.0])
        s = rng.choice([1.0, -1.0]) * 10.0 ** rng.uniform(-12, 9) * math.sqrt(size / mu) * size
        check(x, v, sign * mu, s)
