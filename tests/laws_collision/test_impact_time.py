"""Times of impact: against fifty digits, against samples, and at the starts that bounce, rest and overlap."""

import math

import mpmath
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from xpheve_laws_collision.impact_time.sphere_plane import sphere_plane, sphere_plane_leaves
from xpheve_laws_collision.impact_time.sphere_sphere import offset_at, sphere_sphere, sphere_sphere_leaves

Vector = tuple[float, float, float]

TOUCH = 1e-12
STILL = 1e-14
ZERO = (0.0, 0.0, 0.0)

number = st.floats(-10, 10).map(lambda x: x if abs(x) > 1e-6 else 0.0)
vector = st.tuples(number, number, number)


def plane(gap: float, speed: float, acceleration: float, horizon: float = math.inf) -> float:
    return sphere_plane(gap, speed, acceleration, TOUCH, STILL, horizon)


def spheres(d0: Vector, d1: Vector, d2: Vector, distance: float, horizon: float = math.inf) -> float:
    return sphere_sphere(d0, d1, d2, distance, TOUCH, STILL, horizon)


def gap_at(d0: Vector, d1: Vector, d2: Vector, distance: float, s: float) -> float:
    """|d(s)| - distance from 50 digits."""
    with mpmath.workdps(50):
        s_ = mpmath.mpf(s)
        d = [mpmath.mpf(a) + s_ * (mpmath.mpf(b) + s_ * mpmath.mpf(c) / 2) for a, b, c in zip(d0, d1, d2, strict=True)]
        return float(mpmath.sqrt(sum(x * x for x in d)) - mpmath.mpf(distance))


def lengths(d0: Vector, d1: Vector, d2: Vector, distance: float, s: float) -> float:
    """The sum of the lengths that are added up on the way."""
    return math.hypot(*d0) + s * math.hypot(*d1) + s * s * math.hypot(*d2) + distance


@settings(max_examples=500, deadline=None)
@given(st.floats(1e-9, 1e3), number, number)
def test_a_sphere_meets_a_plane_at_the_first_root_of_its_gap(gap: float, speed: float, acceleration: float) -> None:
    with mpmath.workdps(50):
        g, v, a = map(mpmath.mpf, (gap, speed, acceleration))
        d = v * v - 2 * a * g
        if a == 0:
            expected = g / -v if v < 0 else mpmath.inf
        elif d < 0:
            expected = mpmath.inf
        else:
            later = [t for t in ((-v - mpmath.sqrt(d)) / a, (-v + mpmath.sqrt(d)) / a) if t > 0]
            expected = min(later) if later else mpmath.inf
        assume(abs(d) > mpmath.mpf(10) ** -28 * v * v or a == 0)
    found = plane(gap, speed, acceleration)
    if expected == mpmath.inf:
        assert found == math.inf
    else:
        # A few roundings; the root of the discriminant, itself right to 2 units, adds half of its own.
        assert abs(found - expected) <= 4 * math.ulp(float(expected))


def test_a_dropped_sphere_falls_for_the_root_of_2h_over_g() -> None:
    assert plane(4.0, 0.0, -2.0) == 2.0
    assert plane(4.0, 0.0, -2.0, horizon=2.0) == 2.0
    assert plane(4.0, 0.0, -2.0, horizon=math.nextafter(2.0, 0)) == math.inf


def test_a_graze_is_no_impact() -> None:
    assert plane(2.0, -2.0, 1.0) == math.inf
    assert plane(2.0, -2.0, math.nextafter(1.0, 2)) == math.inf
    assert plane(2.0, -2.0, math.nextafter(1.0, 0)) == pytest.approx(2.0, abs=1e-7)  # the root of the last bit


def test_what_touches_and_approaches_acts_at_once() -> None:
    for gap in (0.0, 1e-13, -1e-13, -0.5):
        assert plane(gap, -1.0, 0.0) == 0.0
        assert plane(gap, -1.0, 5.0) == 0.0


def test_what_touches_and_is_still_is_no_impact() -> None:
    for acceleration in (-9.81, 0.0, 9.81):
        assert plane(0.0, 0.0, acceleration) == math.inf
        assert plane(0.0, 1e-15, acceleration) == math.inf


@given(st.floats(1e-12, 1e3), st.floats(1e-3, 1e3), st.floats(-1, 1))
def test_a_bounce_comes_back_after_twice_the_time_to_the_top(speed: float, g: float, side: float) -> None:
    """And not at the root it has just left, whichever way its gap was rounded."""
    gap = side * TOUCH * 1e-3
    found = plane(gap, speed, -g)
    top = speed / g
    height = speed * top / 2
    assume(height > 1e-14)
    assert found == pytest.approx(top + math.sqrt(max(top * top + 2 * gap / g, 0.0)), rel=1e-14)
    assert found >= top


def test_what_turns_back_inside_acts_when_it_turns() -> None:
    assert plane(-2.0, 2.0, -4.0) == 0.5
    assert plane(-0.5, 2.0, -4.0) == 0.5  # just reaches the surface
    assert plane(-0.375, 2.0, -4.0) == 0.75  # out at 0.25, back at 0.75
    assert plane(-0.375, 2.0, 0.0) == math.inf


def test_leaving_a_plane() -> None:
    assert sphere_plane_leaves(-1.0, 2.0, 0.0, math.inf) == 0.5
    assert sphere_plane_leaves(-1.0, 2.0, 0.0, 0.4) == math.inf
    assert sphere_plane_leaves(-1.0, -2.0, 0.0, math.inf) == math.inf
    assert sphere_plane_leaves(-1.5, -2.0, 2.0, math.inf) == pytest.approx(1 + math.sqrt(2.5), rel=1e-15)
    assert sphere_plane_leaves(-1.0, 2.0, -2.0, math.inf) == math.inf  # only touches from inside
    assert sphere_plane_leaves(-0.75, 2.0, -2.0, math.inf) == 0.5
    assert sphere_plane_leaves(0.0, -2.0, 2.0, math.inf) == 2.0
    assert sphere_plane_leaves(1e-17, -2.0, 2.0, math.inf) == 2.0  # an entry whose gap was rounded up
    assert sphere_plane_leaves(0.0, 1.0, -1.0, math.inf) == 0.0
    assert sphere_plane_leaves(0.0, 0.0, 1.0, math.inf) == 0.0
    assert sphere_plane_leaves(0.0, 0.0, 0.0, math.inf) == math.inf
    assert sphere_plane_leaves(1.0, 1.0, 1.0, math.inf) == math.inf


@settings(max_examples=500, deadline=None)
@given(vector, vector, st.one_of(st.just(ZERO), vector), st.floats(0.1, 10))
def test_spheres_touch_and_approach_at_the_time_found_and_never_before(
    d0: Vector, d1: Vector, d2: Vector, distance: float
) -> None:
    assume(math.hypot(*d0) > distance + 1e-9)
    horizon = 20.0
    found = spheres(d0, d1, d2, distance, horizon)
    for i in range(400):
        s = horizon * i / 400
        if s < found:
            assert gap_at(d0, d1, d2, distance, s) > -1e-13 * lengths(d0, d1, d2, distance, s)
    if found < math.inf:
        assert found <= horizon
        # A unit of the time moves the gap by its speed: lengths holds that too.
        assert abs(gap_at(d0, d1, d2, distance, found)) <= 4 * 2.0**-52 * lengths(d0, d1, d2, distance, found)
        d = offset_at(d0, d1, d2, found)
        rate = sum(x * (v + found * a) for x, v, a in zip(d, d1, d2, strict=True)) / distance
        assert rate < 1e-7 * (math.hypot(*d1) + found * math.hypot(*d2))


@pytest.mark.parametrize("far", [1e2, 1e4, 1e6])
def test_a_far_start_costs_no_more_than_its_own_rounding(far: float) -> None:
    d0, d1, d2 = (far, 0.3, -0.2), (-far, 0.1, 0.1), (0.1, -0.5, 0.2)
    found = spheres(d0, d1, d2, 1.0)
    assert abs(gap_at(d0, d1, d2, 1.0, found)) <= 2 * 2.0**-52 * far


def test_a_head_on_meeting_is_exact() -> None:
    assert spheres((3.0, 0.0, 0.0), (-1.0, 0.0, 0.0), ZERO, 2.0) == 1.0
    assert spheres((3.0, 0.0, 0.0), (0.0, 0.0, 0.0), (-2.0, 0.0, 0.0), 2.0) == 1.0
    assert spheres((3.0, 0.0, 0.0), (-1.0, 0.0, 0.0), ZERO, 2.0, horizon=0.99) == math.inf


def test_a_line_that_grazes_is_no_impact_and_a_bit_nearer_is_one() -> None:
    far = (-1e6, 1.0, 0.0)
    assert spheres(far, (1.0, 0.0, 0.0), ZERO, 1.0) == math.inf
    assert spheres((-1e6, math.nextafter(1.0, 0), 0.0), (1.0, 0.0, 0.0), ZERO, 1.0) == pytest.approx(1e6, abs=1e-7)


def test_a_curve_that_grazes_goes_on_to_where_it_hits() -> None:
    """Thrown so that its top just touches the other from below; then it falls past, and never comes again."""
    assert spheres((-2.0, -3.0, 0.0), (1.0, 2.0, 0.0), (0.0, -1.0, 0.0), 1.0) == math.inf


@given(vector, st.floats(0.5, 2), st.sampled_from([-1, 1]), st.integers(0, 2))
def test_a_mirror_changes_no_bit(d1: Vector, distance: float, sign: int, axis: int) -> None:
    d0, d2 = (3.0, 1.0, -2.0), (-0.3, 0.2, 0.7)

    def mirrored(v: Vector) -> Vector:
        return tuple(-x if c == axis or sign < 0 else x for c, x in enumerate(v))  # type: ignore[return-value]

    for acceleration in (ZERO, d2):
        there = spheres(d0, d1, acceleration, distance)
        assert spheres(mirrored(d0), mirrored(d1), mirrored(acceleration), distance) == there


@given(st.floats(-12, 2), st.floats(-1, 1))
def test_a_ball_bouncing_on_another_comes_back(exponent: float, side: float) -> None:
    """Straight up and down it is the plane again: 2 v / g, also for bounces of a micrometre a second."""
    speed, g, distance = 10.0**exponent, 9.81, 0.5
    gap = side * 1e-16
    height = speed * speed / (2 * g)
    assume(height > 1e-13)  # below, the roundings of |d| are as high as the bounce
    d0 = (0.0, distance + gap, 0.0)
    found = spheres(d0, (0.0, speed, 0.0), (0.0, -g, 0.0), distance)
    rounding = 4 * 2.0**-53 * distance / height  # of the gap against the height
    assert found == pytest.approx(2 * speed / g, rel=1e-14 + rounding)


def test_a_ball_touching_and_leaving_on_a_line_is_left_alone() -> None:
    assert spheres((1.0, 0.0, 0.0), (1.0, 0.3, 0.0), ZERO, 1.0) == math.inf
    assert spheres((0.5, 0.0, 0.0), (1.0, 0.3, 0.0), ZERO, 1.0) == math.inf
    assert spheres((1.0, 0.0, 0.0), (0.0, 0.3, 0.0), ZERO, 1.0) == math.inf


def test_touching_or_overlapping_and_approaching_acts_at_once() -> None:
    for x in (1.0, 1.0 + 1e-13, 1.0 - 1e-13, 0.3):
        assert spheres((x, 0.0, 0.0), (-1.0, 0.0, 0.0), ZERO, 1.0) == 0.0
        assert spheres((x, 0.0, 0.0), (-1e-13, 5.0, 0.0), (3.0, 0.0, 0.0), 1.0) == 0.0


def test_a_support_is_no_impact() -> None:
    assert spheres((0.0, 1.0, 0.0), ZERO, (0.0, -9.81, 0.0), 1.0) == math.inf
    assert spheres((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, -9.81, 0.0), 1.0) == math.inf  # too slow to lift off
    assert spheres((0.0, 0.5, 0.0), (0.0, 1e-15, 0.0), (0.0, -9.81, 0.0), 1.0) == math.inf
    assert plane(-0.5, 1e-15, -9.81) == math.inf


def test_what_is_carried_off_by_its_sideways_speed_is_found_when_it_comes_back() -> None:
    """Up along the flank of the other, a little inward pull: off, and back where it went up."""
    d0, d1, d2 = (1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (-0.5, -2.0, 0.0)
    found = spheres(d0, d1, d2, 1.0)
    assert found > 0.5
    assert abs(gap_at(d0, d1, d2, 1.0, found)) < 1e-15
    assert all(gap_at(d0, d1, d2, 1.0, found * i / 100) > 0 for i in range(1, 100))


def test_what_turns_back_inside_the_other_acts_when_it_turns() -> None:
    assert spheres((0.0, 0.5, 0.0), (0.0, 0.5, 0.0), (0.0, -1.0, 0.0), 1.0) == 0.5
    assert spheres((0.0, 0.625, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), 1.0) == pytest.approx(1.5, rel=1e-15)
    assert spheres(ZERO, (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), 1.0) == 1.0  # from centre in centre


@settings(max_examples=300, deadline=None)
@given(vector, vector, st.one_of(st.just(ZERO), vector), st.floats(0.1, 10))
def test_an_overlap_ends_where_the_gap_opens(d0: Vector, d1: Vector, d2: Vector, distance: float) -> None:
    assume(math.hypot(*d0) < distance - 1e-9)
    horizon = 20.0
    found = sphere_sphere_leaves(d0, d1, d2, distance, horizon)
    for i in range(200):
        s = horizon * i / 200
        if s < found:
            assert gap_at(d0, d1, d2, distance, s) < 1e-13 * lengths(d0, d1, d2, distance, s)
    if found < math.inf:
        assert abs(gap_at(d0, d1, d2, distance, found)) <= 4 * 2.0**-52 * lengths(d0, d1, d2, distance, found)


@settings(max_examples=200, deadline=None)
@given(vector, vector, st.one_of(st.just(ZERO), vector), st.floats(1, 10))
def test_what_passes_through_leaves_after_it_came(offset: Vector, aim: Vector, d2: Vector, distance: float) -> None:
    """From the state at the impact, whose gap was rounded to either side of 0."""
    d0 = (offset[0] + 21.0, offset[1], offset[2])
    d1 = (-20.0, 0.2 * aim[1], 0.2 * aim[2])
    came = spheres(d0, d1, d2, distance, 20.0)
    assume(came < math.inf)
    here = offset_at(d0, d1, d2, came)
    speed = tuple(v + came * a for v, a in zip(d1, d2, strict=True))
    rate = sum(x * v for x, v in zip(here, speed, strict=True)) / distance
    assume(rate < -1e-3 * math.hypot(*speed))
    left = sphere_sphere_leaves(here, speed, d2, distance, math.inf)
    assert 0.0 < left < math.inf
    assert gap_at(here, speed, d2, distance, 0.5 * left) < 0
    assert abs(gap_at(here, speed, d2, distance, left)) <= 4 * 2.0**-52 * lengths(here, speed, d2, distance, left)


def test_leaving_a_sphere() -> None:
    assert sphere_sphere_leaves((-1.0, 0.0, 0.0), (1.0, 0.0, 0.0), ZERO, 1.0, math.inf) == 2.0
    assert sphere_sphere_leaves(ZERO, (1.0, 0.0, 0.0), ZERO, 1.0, math.inf) == 1.0
    assert sphere_sphere_leaves(ZERO, ZERO, ZERO, 1.0, math.inf) == math.inf
    assert sphere_sphere_leaves((1.0, 0.0, 0.0), (1.0, 0.0, 0.0), ZERO, 1.0, math.inf) == 0.0
    assert sphere_sphere_leaves((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), ZERO, 1.0, math.inf) == 0.0
    assert sphere_sphere_leaves((2.0, 0.0, 0.0), (1.0, 0.0, 0.0), ZERO, 1.0, math.inf) == math.inf
    # Rises to touch from inside and falls back, out below.
    assert sphere_sphere_leaves(ZERO, (0.0, 2.0, 0.0), (0.0, -2.0, 0.0), 1.0, math.inf) == pytest.approx(
        1 + math.sqrt(2), rel=1e-15
    )
