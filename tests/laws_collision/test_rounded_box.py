"""Spheres against boxes and capsules that do not turn: against fifty digits, against samples, at joints, overlaps and returns."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import xpheve_laws_collision.impact_time as files
from xpheve.compile import assemble, compiled, interpreted
from xpheve_laws_collision.impact_time.rounded_box import ball_box_leaves, flown
from xpheve_laws_collision.impact_time.sphere_box import sphere_box, sphere_box_gap
from xpheve_laws_collision.impact_time.sphere_capsule import sphere_capsule, sphere_capsule_gap

Vector = tuple[float, float, float]
TOUCH, STILL = 1e-12, 1e-14
ZERO = (0.0, 0.0, 0.0)
HALF = (1.0, 0.5, 1.5)

number = st.floats(-10, 10).map(lambda x: x if abs(x) > 1e-6 else 0.0)
vector = st.tuples(number, number, number)
grid = st.sampled_from([-2.0, -1.5, -1.0, -0.5, 0.0, 0.0, 0.5, 1.0, 1.5, 2.0])
on_grid = st.tuples(grid, grid, grid)
halves = st.tuples(*(st.sampled_from([0.25, 0.5, 1.0, 1.5]),) * 3)
radii = st.sampled_from([0.0, 0.25, 0.5, 1.0])


def boxes(d0: Vector, d1: Vector, d2: Vector, radius: float, half: Vector = HALF, horizon: float = math.inf) -> float:
    return sphere_box(d0, d1, d2, *half, radius, TOUCH, STILL, horizon)


def gap(d0: Vector, d1: Vector, d2: Vector, half: Vector, radius: float, s: float) -> float:
    return sphere_box_gap(flown(d0, d1, d2, s), *half, radius)[0]


def exact_gap(d0: Vector, d1: Vector, d2: Vector, half: Vector, radius: float, s: float) -> float:
    """Distance of surfaces from fifty digits; of a centre inside 0 less the radius."""
    with mpmath.workdps(50):
        s_ = mpmath.mpf(s)
        d = [mpmath.mpf(a) + s_ * (mpmath.mpf(b) + s_ * mpmath.mpf(c) / 2) for a, b, c in zip(d0, d1, d2, strict=True)]
        away = [max(abs(x) - mpmath.mpf(h), 0) for x, h in zip(d, half, strict=True)]
        return float(mpmath.sqrt(sum(x * x for x in away)) - mpmath.mpf(radius))


def lengths(d0: Vector, d1: Vector, d2: Vector, radius: float, s: float) -> float:
    return math.hypot(*d0) + s * math.hypot(*d1) + s * s * math.hypot(*d2) + radius + math.hypot(*HALF)


@settings(max_examples=200, deadline=None)
@given(vector, vector, st.one_of(st.just(ZERO), vector), st.floats(0.01, 3.0))
def test_they_touch_and_approach_at_the_time_found_and_never_before(
    d0: Vector, d1: Vector, d2: Vector, radius: float
) -> None:
    assume(gap(d0, d1, d2, HALF, radius, 0.0) > 1e-9)
    horizon = 20.0
    found = boxes(d0, d1, d2, radius, horizon=horizon)
    end = min(found, horizon)
    for k in range(200):
        s = end * k / 200
        assert gap(d0, d1, d2, HALF, radius, s) > -1e-13 * lengths(d0, d1, d2, radius, s)
    if found < math.inf:
        assert found <= horizon
        assert abs(exact_gap(d0, d1, d2, HALF, radius, found)) <= 4 * 2.0**-52 * lengths(d0, d1, d2, radius, found)


@settings(max_examples=300, deadline=None)
@given(on_grid, on_grid, st.one_of(st.just(ZERO), on_grid), halves, radii, st.booleans())
def test_nothing_slips_through_where_faces_edges_and_corners_join(
    d0: Vector, d1: Vector, d2: Vector, half: Vector, radius: float, capsule: bool
) -> None:
    """Whole numbers make flights that come along the very lines at which the equations change."""
    d0 = (2.0 * d0[0], 2.0 * d0[1], 2.0 * d0[2])
    if capsule:
        found = sphere_capsule(d0, d1, d2, half[0], half[2], radius, TOUCH, STILL, math.inf)
        half, radius = (0.0, 0.0, half[2]), half[0] + radius
    else:
        found = boxes(d0, d1, d2, radius, half)
    out = False
    end = min(found, 8.0)
    for k in range(121):
        here = gap(d0, d1, d2, half, radius, end * k / 120)
        out = out or here > 1e-9
        assert not (out and here < -1e-9)
    if out and found < math.inf:
        assert abs(gap(d0, d1, d2, half, radius, found)) < 1e-13


@settings(max_examples=60, deadline=None)
@given(
    vector,
    vector,
    vector,
    st.floats(0.0, 2.0),
    st.permutations([0, 1, 2]),
    st.tuples(*(st.sampled_from([-1.0, 1.0]),) * 3),
)
def test_a_mirror_changes_no_bit_and_other_names_of_the_axes_next_to_none(
    d0: Vector, d1: Vector, d2: Vector, radius: float, order: list[int], signs: Vector
) -> None:
    def mirrored(v: Vector) -> Any:
        return tuple(sign * x for sign, x in zip(signs, v, strict=True))

    there = boxes(d0, d1, d2, radius)
    assert boxes(mirrored(d0), mirrored(d1), mirrored(d2), radius) == there
    named: Any = [tuple(v[k] for k in order) for v in (d0, d1, d2, HALF)]
    assert boxes(*named[:3], radius, named[3]) == pytest.approx(there, rel=1e-9)


def test_a_face_an_edge_and_a_corner_are_met_when_the_formula_says() -> None:
    assert boxes((0.2, 3.0, 0.1), (0.0, -1.0, 0.0), ZERO, 0.5) == 2.0
    assert boxes((0.2, 4.5, 0.1), ZERO, (0.0, -2.0, 0.0), 0.0) == 2.0
    edge = boxes((2.0, 1.5, 0.1), (-1.0, -1.0, 0.0), ZERO, 0.5)  # along the diagonal
    assert edge == pytest.approx(1.0 - math.sqrt(0.125), rel=1e-15)
    corner = boxes((2.0, 1.5, 2.5), (-1.0, -1.0, -1.0), ZERO, 0.3)
    assert corner == pytest.approx(1.0 - 0.3 / math.sqrt(3.0), rel=1e-15)
    assert boxes((0.2, 3.0, 0.1), (0.0, -1.0, 0.0), ZERO, 0.5, horizon=1.9) == math.inf


def test_along_the_very_line_of_an_edge_it_is_met() -> None:
    for radius in (0.1, 0.5, 2.0):
        assert boxes((1.0, 5.0, 1.5), (0.0, -1.0, 0.0), ZERO, radius) == pytest.approx(4.5 - radius, rel=1e-15)
        beyond = math.nextafter(1.0, 2.0)
        assert boxes((beyond, 5.0, 1.5), (0.0, -1.0, 0.0), ZERO, radius) == pytest.approx(4.5 - radius, rel=1e-15)


@pytest.mark.parametrize("far", [1e2, 1e4, 1e6])
def test_a_far_start_costs_no_more_than_its_own_rounding(far: float) -> None:
    d0, d1, d2 = (far, 0.6, 1.6), (-far, 0.1, 0.1), (0.1, -0.5, 0.2)
    found = boxes(d0, d1, d2, 1.0)
    assert abs(exact_gap(d0, d1, d2, HALF, 1.0, found)) <= 2 * 2.0**-52 * far


def test_speeds_whose_squares_are_no_floats_are_met_too() -> None:
    assert boxes((0.2, 3.0, 0.1), (0.0, -1e200, 0.0), ZERO, 0.5) == pytest.approx(2e-200, rel=1e-15)


def test_what_touches_or_overlaps_and_approaches_acts_at_once() -> None:
    for y in (1.0, 1.0 + 1e-13, 1.0 - 1e-13, 0.3):
        assert boxes((0.2, y, 0.1), (0.0, -1.0, 0.0), (3.0, 5.0, 0.0), 0.5) == 0.0


def test_what_rests_is_a_support_and_a_graze_no_impact() -> None:
    assert boxes((0.2, 1.0, 0.1), ZERO, (0.0, -9.81, 0.0), 0.5) == math.inf
    assert boxes((-5.0, 1.0, 0.1), (1.0, 0.0, 0.0), ZERO, 0.5) == math.inf
    assert boxes((0.0, 3.0, 0.1), (0.0, -2.0, 0.0), (0.0, 1.0, 0.0), 0.5) == math.inf


@settings(max_examples=60, deadline=None)
@given(st.floats(1e-9, 1e2), st.floats(1e-2, 1e2), st.floats(-1, 1))
def test_a_bounce_off_a_face_comes_back_after_twice_the_time_to_the_top(speed: float, g: float, side: float) -> None:
    """And not at the root it has just left, whichever way its gap was rounded."""
    offset = side * 1e-16
    assume(speed * speed / g > 1e-9 * abs(offset))
    found = boxes((0.2, 1.0 + offset, 0.1), (0.0, speed, 0.0), (0.0, -g, 0.0), 0.5)
    height = 0.5 * speed * speed / g
    assert found == pytest.approx(2.0 * speed / g, rel=1e-14 + 2e-16 / height)


def test_what_is_thrown_off_one_face_comes_back_on_another() -> None:
    """Up off the top, and out beyond the side: it falls past the edge, and a pull brings it to the side."""
    d0, d1, d2 = (0.9, 1.0, 0.0), (2.0, 1.0, 0.0), (-2.0, -2.0, 0.0)
    found = boxes(d0, d1, d2, 0.5)
    assert 0.0 < found < math.inf
    assert all(gap(d0, d1, d2, HALF, 0.5, found * k / 50) > 0.0 for k in range(1, 50))
    assert abs(gap(d0, d1, d2, HALF, 0.5, found)) < 1e-15


def test_what_turns_back_inside_acts_when_it_turns() -> None:
    assert boxes((0.2, 0.7, 0.1), (0.0, 0.5, 0.0), (0.0, -2.0, 0.0), 0.5) == 0.25
    assert boxes((0.9, 0.0, 0.1), (0.5, 0.0, 0.0), (-1.0, 0.0, 0.0), 0.0) == pytest.approx(0.5 + math.sqrt(0.05))


def test_a_separating_overlap_on_a_line_is_left_alone() -> None:
    assert boxes((0.2, 0.7, 0.1), (0.0, 0.5, 0.0), ZERO, 0.5) == math.inf
    assert boxes((0.2, 1.0, 0.1), (0.3, 0.5, 0.0), ZERO, 0.5) == math.inf


@settings(max_examples=60, deadline=None)
@given(vector, st.one_of(st.just(ZERO), vector), st.floats(0.05, 2.0), st.tuples(*(st.floats(-1, 1),) * 3))
def test_an_overlap_ends_where_the_gap_opens(d1: Vector, d2: Vector, radius: float, place: Vector) -> None:
    d0: Any = tuple(0.99 * x * h for x, h in zip(place, HALF, strict=True))
    found = ball_box_leaves(d0, d1, d2, HALF, radius, 20.0)
    end = min(found, 20.0)
    assert all(gap(d0, d1, d2, HALF, radius, end * k / 100) < 1e-11 for k in range(100))
    if found < math.inf:
        assert abs(exact_gap(d0, d1, d2, HALF, radius, found)) <= 8 * 2.0**-52 * lengths(d0, d1, d2, radius, found)


def test_the_gap_has_its_normal_towards_the_box_and_inside_its_least_depth() -> None:
    assert sphere_box_gap((0.2, 2.0, 0.1), *HALF, 0.5) == (1.0, 0.0, -1.0, 0.0)
    separation, *normal = sphere_box_gap((4.0, 4.5, 0.0), *HALF, 1.0)
    assert separation == 4.0 and normal == pytest.approx([-0.6, -0.8, 0.0], abs=1e-16)
    assert sphere_box_gap((0.2, -0.4, 0.1), *HALF, 0.25) == (pytest.approx(-0.35), 0.0, 1.0, 0.0)
    assert sphere_capsule_gap((3.0, 4.0, 0.7), 1.0, 1.5, 0.5)[0] == 3.5
    assert sphere_capsule_gap((0.0, 0.0, 4.5), 1.0, 1.5, 0.5) == (1.5, 0.0, 0.0, -1.0)
    separation, *normal = sphere_capsule_gap(ZERO, 1.0, 1.5, 0.5)
    assert separation == -1.5 and math.hypot(*normal) == 1.0 and normal[2] == 0.0


TEXT = """
def entry(f, n):
    a = f[0]
    o = f[1]
    for i in range(n[0][0]):
        r = 16 * i
        d0 = (a[r], a[r + 1], a[r + 2])
        d1 = (a[r + 3], a[r + 4], a[r + 5])
        d2 = (a[r + 6], a[r + 7], a[r + 8])
        x = a[r + 9]
        y = a[r + 10]
        z = a[r + 11]
        radius = a[r + 12]
        o[8 * i] = sphere_box__sphere_box(d0, d1, d2, x, y, z, radius, a[r + 13], a[r + 14], a[r + 15])
        o[8 * i + 1] = sphere_capsule__sphere_capsule(d0, d1, d2, x, y, radius, a[r + 13], a[r + 14], a[r + 15])
        o[8 * i + 2] = rounded_box__ball_box_leaves(d0, d1, d2, (x, y, z), radius, a[r + 15])
        s, o[8 * i + 3], o[8 * i + 4], o[8 * i + 5] = sphere_box__sphere_box_gap(d0, x, y, z, radius)
        o[8 * i + 6] = s
        o[8 * i + 7] = sphere_capsule__sphere_capsule_gap(d0, x, y, radius)[0]
    return 1
"""


@pytest.mark.slow
def test_they_have_the_same_bits_interpreted_and_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XPHEVE_CACHE_DIR", str(tmp_path))
    folder = Path(next(iter(files.__path__)))
    text = assemble(
        TEXT, {name: str(folder / f"{name}.py") for name in ("rounded_box", "sphere_box", "sphere_capsule")}
    )
    rng = np.random.default_rng(4)
    count = 400
    given = np.zeros((count, 16))
    given[:, :9] = 3.0 * rng.normal(size=(count, 9))
    given[::2, 3:6] -= 2.0 * given[::2, 0:3]  # towards the box
    given[::3, 6:9] = 0.0
    given[::5, :9] = np.round(given[::5, :9])
    given[:, 9:12] = rng.choice([0.25, 0.5, 1.0, 1.5], (count, 3))
    given[:, 12] = rng.choice([0.0, 0.1, 0.5, 1.0], count)
    given[:, 13:15] = TOUCH, STILL
    given[:, 15] = rng.choice([math.inf, 5.0], count)
    found = []
    for kernel in (interpreted(text), compiled(text, "spheres and boxes")):
        out = np.zeros(8 * count)
        assert kernel([given.ravel(), out], [np.array([count])]) == 1
        found.append(out)
    assert (found[0].view(np.int64) == found[1].view(np.int64)).all()
    assert 0.2 < np.isfinite(found[0].reshape(count, 8)[:, 0]).mean() < 0.9
