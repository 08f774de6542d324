"""Modes of linear motion against the same closed forms with 120 digits, over 24 powers of ten of stiffness and phases up to 1e8."""

import math
import random

import mpmath
import pytest

from xpheve.kernels.linear_mode import flow, prepared

DIGITS = 120
ROUNDINGS = 1e-14
KINDS = (
    "undamped",
    "unstable",
    "underdamped",
    "overdamped",
    "nearly critical",
    "turning",
    "gyration",
    "turntable",
    "free",
)


def numbers(kind: str, rate: float, chance: random.Random) -> tuple[complex, complex]:
    """a and b of a mode of that ``kind`` whose rate [1/s] is about ``rate``."""
    k = rate * rate
    share = 10.0 ** chance.uniform(-10.0, -0.1)
    close = chance.choice([0.0, 1e-15, 1e-12, 1e-6, 1e-3, -1e-9])
    return {
        "undamped": (complex(-k), 0j),
        "unstable": (complex(k), complex(-share * rate)),
        "underdamped": (complex(-k), complex(-share * rate)),
        "overdamped": (complex(-k), complex(-rate * 10.0 ** chance.uniform(0.4, 8.0))),
        "nearly critical": (complex(-k), complex(-2.0 * rate * (1.0 + close))),
        "turning": (complex(-k), complex(-share * rate, chance.uniform(-3.0, 3.0) * rate)),
        "gyration": (0j, complex(chance.choice([0.0, -1e-3]) * rate, rate)),
        "turntable": (complex(k), complex(0.0, -2.0 * rate)),
        "free": (0j, 0j),
    }[kind]


def reference(a: complex, b: complex, s: float) -> tuple[mpmath.mpc, mpmath.mpc, mpmath.mpc]:
    """S, S' and T."""
    p, q, span = mpmath.mpc(a), mpmath.mpc(b), mpmath.mpf(s)
    mean = q / 2
    gap = mpmath.sqrt(mean * mean + p)
    if gap == 0:
        push = mpmath.exp(mean * span) * span
        speed = mpmath.exp(mean * span) * (1 + mean * span)
    else:
        one, other = mpmath.exp((mean + gap) * span), mpmath.exp((mean - gap) * span)
        push = (one - other) / (2 * gap)
        speed = ((mean + gap) * one - (mean - gap) * other) / (2 * gap)
    if p != 0:
        return push, speed, (speed - 1 - q * push) / p
    return push, speed, (push - span) / q if q != 0 else span * span / 2


def plain(z: complex) -> tuple[tuple[float, float], tuple[float, float]]:
    return (z.real, 0.0), (z.imag, 0.0)


@pytest.mark.parametrize("kind", KINDS)
def test_a_mode_is_exact_to_rounding_at_any_stiffness_and_span(kind: str) -> None:
    chance = random.Random(kind)
    with mpmath.workdps(DIGITS):
        for _ in range(60):
            rate = 10.0 ** chance.uniform(-6.0, 6.0)
            a, b = numbers(kind, rate, chance)
            s = 10.0 ** chance.uniform(-6.0, 8.0) / rate
            if kind == "unstable":
                s = min(s, 600.0 / rate)
            found = flow(prepared(plain(a), plain(b)), (s, 0.0))
            push, speed, way = reference(a, b, s)
            own = max(rate, abs(b))  # what turns a speed into a place, and back
            for z, exact, scale in (
                (found[0], push, abs(push) + abs(speed) / own),
                (found[1], speed, abs(speed) + abs(push) * own),
                (found[2], way, abs(way) + abs(push) / own),
            ):
                assert abs(mpmath.mpc(*z) - exact) <= ROUNDINGS * scale + mpmath.mpf(1e-290)


def test_a_phase_is_that_of_the_exact_span_also_where_it_is_a_pair_of_floats() -> None:
    mode = prepared(plain(complex(-1e16)), plain(0j))
    with mpmath.workdps(DIGITS):
        for base, rest in ((1.0, 3e-17), (100.0, -5e-15), (7.0, 4e-16)):
            push, speed, _ = flow(mode, (base, rest))
            exact = (mpmath.mpf(base) + mpmath.mpf(rest)) * mpmath.mpf(10) ** 8
            assert abs(push[0] * 1e8 - mpmath.sin(exact)) < 1e-15
            assert abs(speed[0] - mpmath.cos(exact)) < 1e-15


def test_a_real_mode_has_no_imaginary_part() -> None:
    for a, b in ((-1e8, 0.0), (-4.0, -1.0), (-4.0, -100.0), (4.0, -1.0), (0.0, -3.0), (0.0, 0.0)):
        for s in (0.0, 1e-9, 1.0, 1e4):
            found = flow(prepared(plain(complex(a)), plain(complex(b))), (s, 0.0))
            assert all(z[1] == 0.0 for z in found if math.isfinite(z[0]))


def test_after_no_time_a_mode_stands_where_it_was() -> None:
    for a, b in ((-1e8, 0.0), (-4.0, -100.0), (0.0, 0.0)):
        assert flow(prepared(plain(complex(a)), plain(complex(b))), (0.0, 0.0)) == ((0.0, 0.0), (1.0, 0.0), (0.0, 0.0))


def test_what_grows_beyond_the_range_of_a_float_is_not_finite() -> None:
    found = flow(prepared(plain(complex(1.0)), plain(0j)), (1e4, 0.0))
    assert not any(math.isfinite(z[0]) for z in found)


def test_two_spans_one_after_the_other_are_their_sum() -> None:
    chance = random.Random(3)
    for kind in ("undamped", "underdamped", "overdamped", "nearly critical"):
        for _ in range(50):
            rate = 10.0 ** chance.uniform(-6.0, 6.0)
            a, b = numbers(kind, rate, chance)
            mode = prepared(plain(a), plain(b))
            s, t = (chance.uniform(0.1, 3.0) / rate for _ in range(2))
            (p, _), (q, _), _ = flow(mode, (s, 0.0))
            (x, _), (y, _), _ = flow(mode, (t, 0.0))
            (whole, _), _, _ = flow(mode, (s + t, 0.0))
            # the push of s + t: a push of s, then of its speed; places by C = S' - S b
            assert abs(whole - (x * q + (y - x * b.real) * p)) <= 2e-14 * max(abs(p), abs(x), abs(whole)) * max(
                1.0, abs(b) / rate
            )
