"""Times of impact of turning bodies: closed forms, no impact missed, no impact too early."""

import math
from typing import Any

import mpmath
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.laws_collision.convex_bodies import (
    NONE,
    SHAPES,
    body,
    floor,
    gap_of,
    impact,
    kinds,
    leave,
    points_of,
    quaternions,
    vectors,
)

import xpheve as xp
from xpheve.kernels.quaternion import from_axis_angle, multiply
from xpheve_laws_collision.impact_time.advancement import UndecidedError

DOWN = (0.0, 0.0, -10.0)
EDGE_DOWN = from_axis_angle((1.0, 0.0, 0.0), math.pi / 4)
CORNER_DOWN = multiply(
    from_axis_angle((1.0, 0.0, 0.0), math.atan(math.sqrt(0.5))), from_axis_angle((0.0, 1.0, 0.0), math.pi / 4)
)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize(
    ("orientation", "low"), [((1.0, 0.0, 0.0, 0.0), 1.0), (EDGE_DOWN, math.sqrt(2)), (CORNER_DOWN, math.sqrt(3))]
)
def test_a_box_falls_flat_on_its_edge_and_on_its_corner(orientation: Any, low: float, scale: float) -> None:
    crate = body(xp.Box((2 * scale,) * 3), (0, 0, 5 * scale), NONE, DOWN, orientation)
    assert math.isclose(impact(crate, floor()), math.sqrt(2 * (5 - low) * scale / 10), rel_tol=1e-14)


@pytest.mark.parametrize("rate", [0.5, 3.0, -40.0])
def test_a_box_that_spins_about_one_axis_lands_when_the_formula_says(rate: float) -> None:
    crate = body(xp.Box((1, 2, 3)), (0, 0, 5), (0.3, 0.2, 1.0), DOWN, angular_velocity=(rate, 0, 0))
    found = impact(crate, floor())
    with mpmath.workdps(40):

        def height(t: Any) -> Any:
            lean = abs(mpmath.sin(rate * t)) * 1 + abs(mpmath.cos(rate * t)) * mpmath.mpf(3) / 2
            return 5 + t - 5 * t * t - lean

        t = mpmath.mpf(0)
        while height(t) > 0:  # it closes by less than 100 m/s
            t += max(height(t) / 100, mpmath.mpf(10) ** -6)
        root = mpmath.findroot(height, (t - mpmath.mpf(10) ** -6, t), solver="anderson", tol=1e-50)
    assert math.isclose(found, float(root), rel_tol=1e-13)


def test_a_thin_fast_plate_meets_a_thin_plate_and_bullets_do() -> None:
    plate = body(xp.Box((1, 1, 1e-3)))
    fast = body(xp.Box((1, 1, 1e-3)), (0.2, 0.1, 1000.0), (0, 0, -1000.0))
    assert math.isclose(impact(fast, plate), (1000 - 1e-3) / 1000, rel_tol=1e-15)
    bullet = body(xp.Sphere(1e-3), (0.1, 0.2, 1e4), (0, 0, -1e6))
    assert math.isclose(impact(bullet, plate), (1e4 - 1.5e-3) / 1e6, rel_tol=1e-14)
    missing = body(xp.Sphere(1e-3), (0.502, 0.2, 1e4), (0, 0, -1e6))
    assert impact(missing, plate) == math.inf
    spinning = plate._replace(angular_velocity=(50.0, 20.0, 700.0))
    for k in range(20):
        shot = body(xp.Sphere(1e-4), (0.3 * math.cos(k), 0.3 * math.sin(k), 100.0 + k), (0, 0, -1e5))
        t = impact(shot, spinning)
        assert t < math.inf and abs(gap_of(shot.at(t), spinning.at(t)).separation) < 1e-12


def test_edges_across_each_other_meet_when_the_formula_says() -> None:
    lower = body(xp.Box((2, 2, 2)), orientation=EDGE_DOWN)
    upper = body(
        xp.Box((2, 2, 2)), (0.1, 0.2, 5), (0, 0, -2.0), orientation=from_axis_angle((0.0, 1.0, 0.0), math.pi / 4)
    )
    assert math.isclose(impact(lower, upper), (5 - 2 * math.sqrt(2)) / 2, rel_tol=1e-14)


def test_far_from_the_origin_an_impact_is_as_exact_as_places_are() -> None:
    crate = body(xp.Box((2, 2, 2)), (1e6, 1e6, 1e6 + 5), NONE, DOWN, CORNER_DOWN)
    t = impact(crate, floor(1e6))
    assert math.isclose(t, math.sqrt(0.2 * (5 - math.sqrt(3))), rel_tol=1e-10)
    other = body(xp.Box((2, 2, 2)), (1e6, 1e6, 1e6))
    assert impact(crate, other) < math.inf


@settings(max_examples=120, deadline=None)
@given(kinds, kinds, vectors, vectors, quaternions, quaternions, vectors, vectors, st.floats(0.1, 30.0), st.booleans())
def test_nothing_touches_before_the_impact_and_there_is_one_when_it_touches(
    first: str, second: str, aim: Any, pull: Any, p: Any, q: Any, spin: Any, other: Any, rate: float, on_floor: bool
) -> None:
    a = body(
        SHAPES[first],
        (0, 0, 4),
        [c - 4 * d for c, d in zip(aim, (0, 0, 1), strict=True)],
        pull,
        p,
        [rate * c for c in spin],
    )
    b = floor() if on_floor else body(SHAPES[second], NONE, NONE, NONE, q, [rate * c for c in other])
    t = impact(a, b, 3.0)
    end = min(t, 3.0)
    for k in range(60):
        s = end * (k / 60) ** 0.5
        assert gap_of(a.at(s), b.at(s)).separation > 0.0
    if t < math.inf:
        gap = gap_of(a.at(t), b.at(t))
        assert abs(gap.separation) <= 4 * gap.touch and gap.speed < 0.0


def test_a_box_that_has_bounced_is_found_when_it_comes_back() -> None:
    crate = body(xp.Box((2, 2, 2)), (0, 0, 1), (0, 0, 1), DOWN)
    assert math.isclose(impact(crate, floor()), 0.2, rel_tol=1e-14)
    assert math.isclose(impact(crate, body(xp.Box((2, 2, 2)), (0, 0, -1))), 0.2, rel_tol=1e-14)
    # One edge leaves while the other comes down: that is at once; and a slow spin brings it back sooner.
    assert impact(crate._replace(angular_velocity=(0.0, 2.0, 0.0)), floor()) == 0.0
    turning = crate._replace(angular_velocity=(0.0, 0.5, 0.0))
    t = impact(turning, floor())
    assert math.isclose(1 + t - 5 * t * t, math.sin(0.5 * t) + math.cos(0.5 * t), abs_tol=1e-13) and 0.01 < t < 0.2


def test_what_rests_is_no_impact_and_what_presses_in_is_one_now() -> None:
    crate = body(xp.Box((2, 2, 2)), (0, 0, 1), NONE, DOWN)
    assert impact(crate, floor()) == math.inf
    assert impact(crate._replace(velocity=(1.0, 0.0, 0.0)), floor()) == math.inf
    assert impact(crate._replace(velocity=(0.0, 0.0, -1.0)), floor()) == 0.0
    assert impact(crate._replace(position=(0.0, 0.0, 0.7), velocity=(0.0, 0.0, -1.0)), floor()) == 0.0
    sliding = body(xp.Box((2, 2, 2)), (0, 0, 1), (1, 0, 0), NONE, angular_velocity=(0, 0, 3))
    assert impact(sliding, floor()) == math.inf


def test_an_overlapping_box_leaves_and_what_touches_and_opens_leaves_now() -> None:
    crate = body(xp.Box((2, 2, 2)), (0, 0, 0.5), (0, 0, 2.0))
    assert math.isclose(leave(crate, floor()), 0.25, rel_tol=1e-11)
    assert leave(crate._replace(position=(0.0, 0.0, 1.0)), floor()) == 0.0
    assert leave(crate._replace(velocity=(0.0, 0.0, -2.0)), floor(), 10.0) == math.inf


@settings(max_examples=60, deadline=None)
@given(
    kinds,
    kinds,
    vectors,
    vectors,
    vectors,
    quaternions,
    quaternions,
    vectors,
    st.sampled_from((0.0, 2.0, 20.0)),
    st.booleans(),
)
def test_overlapping_bodies_leave_when_samples_say(
    first: str, second: str, at: Any, aim: Any, pull: Any, p: Any, q: Any, spin: Any, rate: float, on_floor: bool
) -> None:
    a = body(SHAPES[first], [0.5 * c for c in at], [2 * c for c in aim], pull, p, [rate * c for c in spin])
    b = floor() if on_floor else body(SHAPES[second], NONE, NONE, NONE, q, [-0.5 * rate * c for c in spin])
    if gap_of(a, b).separation > -1e-6:
        return
    try:
        t = leave(a, b, 1.0)
    except UndecidedError as undecided:
        assert "no parting" in str(undecided)
        t = undecided.until
    for k in range(1, 30):
        s = min(t, 1.0) * k / 30
        assert gap_of(a.at(s), b.at(s)).separation < 1e-9
    if t < math.inf:
        gap = gap_of(a.at(t), b.at(t))
        assert abs(gap.separation) <= 3 * gap.touch


def test_a_compound_has_left_when_its_last_part_has() -> None:
    pole = xp.Compound([(xp.Sphere(0.2), (0, 0, 1)), (xp.Sphere(0.2), (0, 0, -1))])
    wheel = body(pole, (0, 0, 0.9), NONE, NONE, angular_velocity=(0, 4.0, 0))
    t = leave(wheel, floor(), 10.0)
    # One end is down, then the other: 0.9 - |cos 4 t| = 0.2 when it first is out.
    assert math.isclose(t, math.acos(0.7) / 4, rel_tol=1e-10)
    low = wheel._replace(position=(0.0, 0.0, 0.1), velocity=(0.0, 0.0, 0.1))
    t = leave(low, floor(), 20.0)
    for k in range(1, 400):
        height = 0.1 + 0.1 * t * k / 400
        assert height - abs(math.cos(4 * t * k / 400)) < 0.2
    assert abs(0.1 + 0.1 * t - abs(math.cos(4 * t)) - 0.2) < 1e-9


def test_bodies_that_turn_about_each_other_for_ever_are_undecided_and_say_until_when() -> None:
    a = body(xp.Box((2, 0.2, 0.2)), (0, 0, 0), angular_velocity=(0, 0, 1))
    b = body(xp.Box((0.2, 2, 0.2)), (1.9, 0, 0.5), angular_velocity=(1, 0.1, 0))
    assert impact(a, b, 1e-3) == math.inf
    far = body(xp.Box((2, 0.2, 0.2)), (5, 0, 0), angular_velocity=(0, 0, 1))
    assert impact(far, b) == math.inf
    still = body(xp.Box((2, 0.2, 0.2)), (0, 0, 0.3))
    spinning = still._replace(position=(0.0, 0.0, 0.0), angular_velocity=(0.0, 0.0, 1.0))
    try:
        assert impact(spinning, still) == math.inf
    except UndecidedError as undecided:
        assert undecided.until > 100.0


def test_a_mover_flies_as_the_stepper_has_it() -> None:
    engine = xp.PhysicsEngine()
    obj = xp.PhysicalObject(xp.Box((1, 2, 3)), velocity=(1, 2, 3), angular_velocity=(1, 2, 3))
    engine.add_object(obj)
    start = body(obj.shape, obj.position, obj.velocity, NONE, obj.orientation, obj.angular_velocity)
    engine.run(until=0.7)
    later = start.at(0.7)
    assert later.position == obj.position and later.orientation == obj.orientation
    assert later.angular_velocity == obj.angular_velocity
    assert len(points_of(later, floor(later.position[2] - 1.0))) >= 1


@settings(max_examples=60, deadline=None)
@given(
    kinds,
    kinds,
    quaternions,
    quaternions,
    vectors,
    vectors,
    st.sampled_from((0.5, 20.0)),
    st.sampled_from((1.0, 0.3, 1e-5)),
)
def test_after_a_bounce_the_next_impact_is_found(
    first: str, second: str, p: Any, q: Any, spin: Any, other: Any, rate: float, restitution: float
) -> None:
    a = body(SHAPES[first], (0, 0, 3), (0.1, 0.2, -3), DOWN, p, [rate * c for c in spin])
    b = body(SHAPES[second], NONE, NONE, NONE, q, [rate * c for c in other])
    t = impact(a, b, 2.0)
    for _ in range(2):
        if t == math.inf:
            return
        a, b = a.at(t), b.at(t)
        gap = gap_of(a, b)
        push = (1.0 + restitution) * gap.speed
        a = a._replace(velocity=tuple(v + push * n for v, n in zip(a.velocity, gap.normal, strict=True)))
        t = impact(a, b, 2.0)
        end = min(t, 2.0)
        for k in range(1, 20):
            gap = gap_of(a.at(end * k / 20), b.at(end * k / 20))
            assert gap.separation > -2 * gap.touch
        if t < math.inf:
            gap = gap_of(a.at(t), b.at(t))
            assert abs(gap.separation) <= 2 * gap.touch and gap.speed < 0.0
