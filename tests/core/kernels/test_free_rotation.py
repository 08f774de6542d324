"""Free rotation against Taylor series of Euler's equations, against itself, and against what is conserved."""

import itertools
import math

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from xpheve.kernels.free_rotation import ASYMMETRIC, SEPARATRIX, STEADY, SYMMETRIC, prepare, turn
from xpheve.kernels.quaternion import (
    Quat,
    conjugate,
    from_axis_angle,
    from_rotation_vector,
    multiply,
    normalize,
    rotate,
    rotate_inverse,
)
from xpheve.kernels.vector import Vec, dot, norm, scale, sub

NO_TURN = (1.0, 0.0, 0.0, 0.0)
SOME_TURN = normalize((0.3, -0.2, 0.8, 0.5))

# Inertia (1, 2, 3), no turn at first. (Rates at t = 0, t): quaternion and body rates at t, right to 20 digits and more.
# Made by make_free_rotation_reference.py 60 10000.
REFERENCE = {
    ((0.01, 2.0, 0.01), 60.0): (
        "0.305704986990697935157712086715",
        "-0.635236172263352787308947290795",
        "0.095472318140430250428738569163",
        "0.702783396820182186986865599158",
        "1.204977776746823313293622916349",
        "-1.596285863354769809824956992571",
        "0.695742155891514445562733813715",
    ),
    ((0.01, 2.0, 0.01), 10000.0): (
        "-0.002969443833947627734759298681",
        "0.463250879678297758546405109258",
        "-0.004091535832581208282223558214",
        "-0.886212764642402917815975781065",
        "-0.024451643994090397955270009323",
        "-1.999875525403015242114247572279",
        "0.016308309681608504432028243215",
    ),
    ((0.0001, 2.0, 0.0001), 60.0): (
        "0.000072513590842890945637159612",
        "0.304810754228985118597672327397",
        "0.000295897094291783353398981194",
        "0.952412889083850000470088534156",
        "0.001366809282293993964841566328",
        "-1.999999535458042508936711812070",
        "0.000793340535156041484952218341",
    ),
    ((1e-08, 2.0, 1e-08), 60.0): (
        "-0.740180201358951828391974979019",
        "0.000278537292420266878565715856",
        "0.672408498067469354287247844835",
        "0.000060496680228932606176102116",
        "0.001140129999534155765159139815",
        "1.999999675025869663515146691640",
        "0.000658254362192851714356791370",
    ),
}


def angle_between(q: Quat, reference: Quat) -> float:
    """Angle [rad] of the rotation that is between two orientations."""
    x, y, z = multiply(conjugate(q), reference)[1:]
    return 2.0 * math.asin(min(1.0, norm((x, y, z))))


def angular_momentum(q: Quat, omega: Vec, inertia: Vec) -> Vec:
    """L = R I R^T omega, world."""
    x, y, z = rotate_inverse(q, omega)
    return rotate(q, (inertia[0] * x, inertia[1] * y, inertia[2] * z))


def energy(q: Quat, omega: Vec, inertia: Vec) -> float:
    """2 T = omega . L."""
    x, y, z = rotate_inverse(q, omega)
    return inertia[0] * x * x + inertia[1] * y * y + inertia[2] * z * z


@pytest.mark.parametrize(("rates", "t"), list(REFERENCE))
def test_a_body_flips_over_when_its_taylor_series_says(rates: Vec, t: float) -> None:
    expected = [float(text) for text in REFERENCE[rates, t]]
    q, omega = turn(prepare(NO_TURN, rates, (1.0, 2.0, 3.0)), t)
    # Measured 3e-16; 4e-15 leaves a few roundings of a quaternion and of its comparison.
    assert angle_between(q, (expected[0], expected[1], expected[2], expected[3])) < 4e-15
    # A flip lasts 1 / lambda = 0.9 s and comes after up to 19 s: a rounding of its time moves the rates by ~5e-15.
    assert rotate_inverse(q, omega) == pytest.approx(expected[4:], rel=0.0, abs=2e-14)


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
@pytest.mark.parametrize("rates", [(0.3, 1.0, 0.5), (-0.3, 1.0, -1.5), (1.0, -0.2, 0.1), (-2.0, 0.3, 0.01)])
def test_the_names_of_the_axes_do_not_matter(order: tuple[int, int, int], rates: Vec) -> None:
    """A body whose axes are named in another order, some of them turned about, moves as the same body."""
    inertia = (1.0, 2.0, 3.0)
    even = order in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
    sign = 1.0 if even else -1.0  # keeps the axes right-handed
    q, omega = turn(prepare(NO_TURN, rates, inertia), 17.0)
    renamed = (inertia[order[0]], inertia[order[1]], inertia[order[2]])
    turned = (sign * rates[order[0]], sign * rates[order[1]], sign * rates[order[2]])
    p, other = turn(prepare(NO_TURN, turned, renamed), 17.0)
    assert [sign * omega[i] for i in order] == pytest.approx(other, rel=0.0, abs=1e-14)
    expected = (q[0], sign * q[1 + order[0]], sign * q[1 + order[1]], sign * q[1 + order[2]])
    assert angle_between(p, expected) < 1e-14  # several roundings


def test_the_state_given_comes_back_to_the_bit() -> None:
    q, omega = (0.3, -0.2, 0.8, 0.5), (0.1, -0.7, 1e-9)  # not even of length 1
    for inertia in [(1.0, 2.0, 3.0), (1.0, 1.0, 3.0), (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)]:
        assert turn(prepare(q, omega, inertia), 0.0) == (q, omega)


def test_a_body_at_rest_stays() -> None:
    for inertia in [(1.0, 2.0, 3.0), (1.0, 1.0, 3.0), (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)]:
        assert turn(prepare(SOME_TURN, (0.0, 0.0, 0.0), inertia), 1e6) == (SOME_TURN, (0.0, 0.0, 0.0))


@pytest.mark.parametrize("q", [NO_TURN, (0.0, 1.0, 0.0, 0.0), SOME_TURN, from_axis_angle((0.6, 0.0, 0.8), 1.0)])
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("t", [1.0, -60.0, 1e6])
def test_a_spin_about_a_principal_axis_goes_on_for_ever(q: Quat, axis: int, t: float) -> None:
    """About the middle one too, however the body stands."""
    own = (2.0 * (axis == 0), 2.0 * (axis == 1), 2.0 * (axis == 2))
    omega = rotate(q, own)
    constants = prepare(q, omega, (1.0, 2.0, 3.0))
    assert constants[0] == STEADY
    later, same = turn(constants, t)
    assert same == omega
    expected = multiply(q, from_rotation_vector(scale(own, math.fmod(t, 2.0 * math.pi))))
    # Rounding omega moves the angle by 2^-53 |omega| t; 2 pi as a float is off by 2.4e-16, t / 2 pi times.
    assert angle_between(later, expected) < 2e-15 + 4e-16 * abs(t)


def test_a_rate_of_1e_17_across_the_middle_axis_is_no_rounding_where_the_axes_are_the_worlds() -> None:
    constants = prepare(NO_TURN, (1e-17, 2.0, 1e-17), (1.0, 2.0, 3.0))
    assert constants[0] == ASYMMETRIC
    assert turn(constants, 60.0)[1][1] == pytest.approx(2.0, abs=1e-9)  # L keeps its direction, the body is upside down
    q, _ = turn(constants, 60.0)
    assert rotate(q, (0.0, 1.0, 0.0))[1] == pytest.approx(-1.0, abs=1e-9)


@pytest.mark.parametrize("inertia", [(1.0, 1.0, 2.0), (2.0, 1.0, 2.0), (3.0, 1.0, 1.0), (1.0, 1.0, 1e-3)])
def test_a_symmetric_top_turns_about_l_and_about_itself(inertia: Vec) -> None:
    omega, t = (0.3, 1.0, 0.5), 20.0
    constants = prepare(SOME_TURN, omega, inertia)
    assert constants[0] == SYMMETRIC
    q, _ = turn(constants, t)
    axis = next(i for i in range(3) if inertia[i - 1] == inertia[i - 2])
    momentum = angular_momentum(SOME_TURN, omega, inertia)
    about = rotate_inverse(SOME_TURN, omega)[axis] * (1.0 - inertia[axis] / inertia[axis - 1]) * t
    own = (about * (axis == 0), about * (axis == 1), about * (axis == 2))
    precession = from_rotation_vector(scale(momentum, t / inertia[axis - 1]))
    expected = multiply(multiply(precession, SOME_TURN), from_rotation_vector(own))
    assert angle_between(q, expected) < 1e-12 * max(1.0, norm(own))  # the expectation's angles round at ~1e2 rad


@pytest.mark.parametrize(
    "rates", [(0.3, 1.0, 0.5), (3.0, 1.0, 0.9), (1e-3, 2.0, 1e-3), (1e-9, 1e-9, 1.0), (1.0, 1e-9, 0.0)]
)
def test_an_almost_symmetric_top_moves_like_the_symmetric_one(rates: Vec) -> None:
    """The two ways of working it meet.

    Moments 1e-15 apart turn L in the body at a rate of about 1e-15 |omega| / 2, and the attitude follows as the
    square of the time.
    """
    for axis in range(3):
        exact = [2.0, 2.0, 2.0]
        exact[axis] = 3.0
        near = list(exact)
        near[axis - 1] += 1e-15
        q, _ = turn(prepare(SOME_TURN, rates, (exact[0], exact[1], exact[2])), 30.0)
        constants = prepare(SOME_TURN, rates, (near[0], near[1], near[2]))
        p, _ = turn(constants, 30.0)
        assert constants[0] == ASYMMETRIC
        angle = 30.0 * norm(rates)
        assert angle_between(p, q) < 1e-15 * (angle + 0.25 * angle * angle) + 4e-15


def test_an_almost_round_body_moves_like_a_ball() -> None:
    inertia = (1.0, 1.0 + 2.3e-16, 1.0 + 4.5e-16)
    assert len(set(inertia)) == 3
    q, _ = turn(prepare(SOME_TURN, (0.3, 1.0, 0.5), inertia), 30.0)
    ball, _ = turn(prepare(SOME_TURN, (0.3, 1.0, 0.5), (1.0, 1.0, 1.0)), 30.0)
    angle = 30.0 * 1.2
    assert angle_between(q, ball) < 4.5e-16 * (angle + 0.25 * angle * angle) + 4e-15  # as above


def test_on_the_separatrix_a_body_turns_over_once_and_stays() -> None:
    inertia, omega = (2.0, 3.0, 6.0), (3.0, 0.0, 1.0)  # 2 (3 - 2) 3^2 = 6 (6 - 3) 1^2 without a rounding
    constants = prepare(NO_TURN, omega, inertia)
    assert constants[0] == SEPARATRIX
    rate = math.sqrt(2.0)  # lambda^2 = (C - B)(L^2 - 2 T A) / (A B C) = 3 * 24 / 36; the start is at u = 0
    greatest = math.sqrt(72.0) / 3.0  # of w2: all of |L| along the middle axis
    for t in (-2.0, -0.1, 1e-6, 0.3, 1.0, 5.0):
        q, now = turn(constants, t)
        own = rotate_inverse(q, now)
        sech = 1.0 / math.cosh(rate * t)
        expected = (3.0 * sech, greatest * math.tanh(rate * t), sech)
        assert own == pytest.approx(expected, rel=0.0, abs=1e-14)
    for t in (-1e6, 1e6):
        q, now = turn(constants, t)
        assert norm(sub(now, scale(angular_momentum(NO_TURN, omega, inertia), 1.0 / 3.0))) < 1e-14


moment = st.floats(0.6, 1.0)  # of such three any two exceed the third, as in every body
component = st.one_of(st.just(0.0), st.floats(1e-3, 1.0), st.floats(-1.0, -1e-3), st.floats(-1e-9, 1e-9))
orientation = st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: sum(x * x for x in q) > 1e-2).map(normalize)


@settings(max_examples=300, deadline=None)
@given(
    inertia=st.tuples(moment, moment, moment),
    omega=st.tuples(component, component, component),
    q=orientation,
    mass=st.floats(-20.0, 20.0),
    speed=st.floats(-9.0, 9.0),
    t=st.floats(-1e6, 1e6),
)
def test_angular_momentum_and_energy_are_kept(
    inertia: Vec, omega: Vec, q: Quat, mass: float, speed: float, t: float
) -> None:
    """At any scale and after any time, to the rounding of the state itself."""
    inertia = scale(inertia, 10.0**mass)
    omega = scale(omega, 10.0**speed)
    assume(norm(omega) > 0.0)
    later, now = turn(prepare(q, omega, inertia), t)
    before, after = angular_momentum(q, omega, inertia), angular_momentum(later, now, inertia)
    assert abs(norm(later_length(later)) - 1.0) < 1e-15
    # Roundings of q, omega and of this check itself: a few units of 1e-16 each; measured 4e-15 at worst.
    assert norm(sub(after, before)) <= 1e-14 * norm(before)
    assert energy(later, now, inertia) == pytest.approx(energy(q, omega, inertia), rel=1e-14)


def later_length(q: Quat) -> Vec:
    """A vector as long as ``q``."""
    return (math.hypot(q[0], q[1]), q[2], q[3])


@settings(max_examples=200, deadline=None)
@given(
    inertia=st.tuples(moment, moment, moment),
    omega=st.tuples(*[st.floats(-2.0, 2.0)] * 3),
    q=orientation,
    first=st.floats(-5.0, 5.0),
    second=st.floats(-5.0, 5.0),
)
def test_two_turns_make_one(inertia: Vec, omega: Vec, q: Quat, first: float, second: float) -> None:
    assume(norm(omega) > 1e-3)
    whole, rates = turn(prepare(q, omega, inertia), first + second)
    halfway = turn(prepare(q, omega, inertia), first)
    parts, others = turn(prepare(*halfway, inertia), second)
    # Near the middle axis the roundings of the state halfway (1e-15) grow as exp(lambda t), lambda <= 0.7 |omega| here:
    # at the very worst by 0.7 * 3.5 * 5 = 12, a factor 2e5.
    growth = math.exp(0.7 * norm(omega) * abs(second))
    assert angle_between(parts, whole) < 1e-14 * growth
    assert norm(sub(rates, others)) < 1e-14 * growth * norm(omega)


def test_a_turn_of_a_moment_is_the_rate_times_the_moment() -> None:
    q, _ = turn(prepare(SOME_TURN, (0.3, 1.0, 0.5), (1.0, 2.0, 3.0)), 1e-9)
    change = multiply(q, conjugate(SOME_TURN))
    assert change[1:] == pytest.approx((0.15e-9, 0.5e-9, 0.25e-9), rel=0.0, abs=5e-16)  # the rounding of q


def test_the_quaternion_is_continuous_in_time() -> None:
    for inertia in [(1.0, 2.0, 3.0), (3.0, 2.0, 1.0), (1.0, 1.0, 3.0), (1.0, 1.0, 1.0)]:
        constants = prepare(SOME_TURN, (0.3, 1.0, 0.5), inertia)
        before = SOME_TURN
        for n in range(1, 1000):
            q, _ = turn(constants, 0.05 * n)
            assert sum(a * b for a, b in zip(before, q, strict=True)) > 0.9  # turns of 0.1 rad, not of 2 pi
            before = q


def test_no_scale_breaks_it() -> None:
    for inertia in itertools.product((1e-20, 1.0, 1e20), repeat=3):
        for omega in itertools.product((1e-9, 0.0, -1.0, 1e9), repeat=3):
            constants = prepare(SOME_TURN, omega, inertia)
            for t in (1e6, -1e-6, 1e12):
                q, now = turn(constants, t)
                assert dot(q[1:], q[1:]) + q[0] * q[0] == pytest.approx(1.0, abs=1e-15)
                assert math.isfinite(norm(now))
