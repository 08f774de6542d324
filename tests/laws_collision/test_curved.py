"""Impact times along any tracks are those of the closed forms, and of the advancement of turning bodies, where the tracks are parabolas."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve_laws_collision.impact_time.course import Parabola
from xpheve_laws_collision.impact_time.curved import CurvedFamily, Side
from xpheve_laws_collision.impact_time.path import Path
from xpheve_laws_collision.narrow_phase import Mover, family_of

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
NONE = (0.0, 0.0, 0.0)
number = st.floats(-3.0, 3.0).map(lambda c: round(c, 6))
vector = st.tuples(number, number, number)


def side(mover: Mover) -> Side:
    """A side that flies as ``mover`` does."""
    path = Path(mover)
    track = Parabola(mover.position, mover.velocity, mover.acceleration)
    return Side(track, path.at, lambda low, high: path.bounds(low, high - low)[0], getattr(mover.shape, "reach", 0.0))


def both(a: Mover, b: Mover, horizon: float = 4.0) -> tuple[float, float, Any, Any]:
    """The impact time by the closed form or advancement, and along the tracks; then how they stand, and the second's family."""
    family, swapped = family_of(a.shape.kind, b.shape.kind)
    assert not swapped
    curved = CurvedFamily(family, side(a), side(b), a.shape.kind == "sphere" and b.shape.kind in ("sphere", "plane"))
    gap = family.gap(a, b)
    return family.impact_time(a, b, gap, horizon), curved.impact_time(a, b, gap, horizon), gap, curved


def grazes(found: float, a: Mover, b: Mover) -> bool:
    """Whether they touch with hardly any speed: then one may see a touch, and the other none."""
    family, _ = family_of(a.shape.kind, b.shape.kind)
    return math.isfinite(found) and abs(family.gap(Path(a).at(found), Path(b).at(found)).speed) < 1e-4


@settings(deadline=None)
@given(vector, vector, vector)
def test_a_ball_meets_a_plane_as_in_closed_form(x: Any, v: Any, a: Any) -> None:
    ball = Mover(x, v, a, UPRIGHT, xp.Sphere(0.5))
    plane = Mover(NONE, NONE, NONE, UPRIGHT, xp.Plane((0, 0, 1)))
    exact, found, gap, _ = both(ball, plane)
    assume(abs(gap.separation) > 1e-6 and not grazes(exact, ball, plane) and not grazes(found, ball, plane))
    if gap.separation > 0.0 or gap.speed < 0.0:
        assert found == pytest.approx(exact, rel=1e-12, abs=1e-12)


@settings(deadline=None)
@given(vector, vector, vector, vector)
def test_two_balls_meet_as_in_closed_form(x: Any, v: Any, a: Any, w: Any) -> None:
    one = Mover(NONE, w, NONE, UPRIGHT, xp.Sphere(0.25))
    two = Mover(x, v, a, UPRIGHT, xp.Sphere(0.5))
    exact, found, gap, _ = both(one, two)
    assume(gap.separation > 1e-6 and not grazes(exact, one, two) and not grazes(found, one, two))
    assert found == pytest.approx(exact, rel=1e-11, abs=1e-11)


@settings(deadline=None, max_examples=25)
@given(vector, vector, st.sampled_from([xp.Box((0.4, 0.6, 0.2)), xp.Capsule(0.1, 0.4)]), st.booleans())
def test_a_body_with_corners_meets_a_plane_as_by_advancement(v: Any, spin: Any, shape: Any, turns: bool) -> None:
    body = Mover((0.0, 0.0, 1.5), v, (0.0, 0.0, -3.0), UPRIGHT, shape, spin if turns else NONE, (1.0, 2.0, 2.5))
    plane = Mover(NONE, NONE, NONE, UPRIGHT, xp.Plane((0, 0, 1)))
    exact, found, _, _ = both(body, plane)
    assume(not grazes(exact, body, plane))
    assert found == pytest.approx(exact, abs=1e-10)


def test_a_ball_inside_another_leaves_it_where_the_closed_form_says() -> None:
    one = Mover(NONE, NONE, NONE, UPRIGHT, xp.Sphere(1.0))
    two = Mover((0.25, 0.0, 0.0), (1.0, 0.5, 0.0), (0.0, 0.0, 1.0), UPRIGHT, xp.Sphere(0.5))
    _, _, gap, curved = both(one, two)
    family, _ = family_of("sphere", "sphere")
    assert curved.leave_time(one, two, gap, 9.0) == pytest.approx(family.leave_time(one, two, gap, 9.0), rel=1e-13)
    assert curved.leave_time(one, two, gap, 0.1) == math.inf


def test_a_box_that_sinks_through_a_plane_leaves_it_when_it_is_back() -> None:
    box = Mover((0.0, 0.0, 0.05), (0.0, 0.0, -1.0), (0.0, 0.0, 2.0), UPRIGHT, xp.Box((0.2, 0.2, 0.2)))
    plane = Mover(NONE, NONE, NONE, UPRIGHT, xp.Plane((0, 0, 1)))
    _, _, gap, curved = both(box, plane)
    assert gap.separation == pytest.approx(-0.05)
    assert curved.leave_time(box, plane, gap, 9.0) == pytest.approx(0.5 + math.sqrt(0.25 + 0.05), abs=1e-9)


def test_two_points_never_meet() -> None:
    one, two = (Mover((x, 0.0, 0.0), (-x, 0.0, 0.0), NONE, UPRIGHT, xp.Sphere(1e-300)) for x in (1.0, -1.0))
    points = [mover._replace(shape=_Point) for mover in (one, two)]
    family, _ = family_of("sphere", "sphere")
    curved = CurvedFamily(family, side(points[0]), side(points[1]), True)
    assert curved.impact_time(*points, family.gap(*points), 9.0) == math.inf


class _Point:
    """What the server takes for the shape of an object that has none."""

    kind = "sphere"
    radius = 0.0
