"""Distances of convex bodies: proven from both sides, the same from anywhere, and those of the analytic families."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.laws_collision.convex_bodies import (
    NONE,
    SHAPES,
    body,
    corners,
    floor,
    gap_of,
    impact,
    kinds,
    points_of,
    quaternions,
    vectors,
)

import xpheve as xp
from xpheve.errors import ContactError
from xpheve.kernels.quaternion import from_axis_angle, multiply, rotate
from xpheve_laws_collision.narrow_phase import family_of

TIGHT = 1e-14


@settings(max_examples=300, deadline=None)
@given(kinds, kinds, vectors, quaternions, quaternions, st.floats(0, 3), st.sampled_from((1e-6, 1.0, 1e6)))
def test_the_distance_is_proven_by_a_parting_direction_and_by_two_points(
    first: str, second: str, away: Any, p: Any, q: Any, far: float, scale: float
) -> None:
    a = body(_scaled(SHAPES[first], scale), NONE, orientation=p)
    b = body(_scaled(SHAPES[second], scale), [far * scale * c for c in away], orientation=q)
    gap = gap_of(a, b)
    size = scale * 4
    if gap.separation <= 0.0:
        return
    # No nearer: the direction parts the deepest parts by as much. No farther: the halfway point is that near to both.
    n = np.array(gap.normal)
    best = max(_between(n, pa, ra, pb, rb) for pa, ra in corners(a) for pb, rb in corners(b))
    assert math.isclose(np.linalg.norm(n), 1.0, abs_tol=1e-14)
    assert best >= gap.separation - TIGHT * size
    halfway = body(xp.Sphere(1e-3 * scale), gap.point)
    for side in (a, b):
        assert gap_of(side, halfway).separation + 1e-3 * scale <= 0.5 * gap.separation + 1e-13 * size


def _scaled(shape: Any, s: float) -> Any:
    return shape if s == 1.0 else shape.scaled(s)


def _between(n: Any, a: Any, radius_a: float, b: Any, radius_b: float) -> float:
    return float((b @ n).min() - (a @ n).max()) - radius_a - radius_b


@settings(max_examples=200, deadline=None)
@given(kinds, kinds, vectors, quaternions, quaternions)
def test_an_overlap_is_the_least_shift_that_parts(first: str, second: str, away: Any, p: Any, q: Any) -> None:
    if "compound" in (first, second):
        return
    a, b = body(SHAPES[first], orientation=p), body(SHAPES[second], [0.6 * c for c in away], orientation=q)
    gap = gap_of(a, b)
    if gap.separation >= 0.0:
        return
    moved = b._replace(position=tuple(x - gap.separation * n for x, n in zip(b.position, gap.normal, strict=True)))
    assert abs(gap_of(a, moved).separation) < 1e-13
    (pa, ra), (pb, rb) = corners(a)[0], corners(b)[0]
    rng = np.random.default_rng(1)
    for direction in rng.normal(size=(200, 3)):
        assert _between(direction / np.linalg.norm(direction), pa, ra, pb, rb) <= gap.separation + 1e-13


@settings(max_examples=150, deadline=None)
@given(kinds, kinds, vectors, quaternions, quaternions, quaternions, vectors)
def test_the_distance_is_the_same_from_either_side_and_from_anywhere(
    first: str, second: str, away: Any, p: Any, q: Any, turn: Any, shift: Any
) -> None:
    a, b = body(SHAPES[first], orientation=p), body(SHAPES[second], [2 * c for c in away], orientation=q)
    gap = gap_of(a, b)
    assert math.isclose(gap_of(b, a).separation, gap.separation, abs_tol=1e-13)
    u, v = (
        one._replace(
            position=tuple(x + y for x, y in zip(rotate(turn, one.position), shift, strict=True)),
            orientation=multiply(turn, one.orientation),
        )
        for one in (a, b)
    )
    assert math.isclose(gap_of(u, v).separation, gap.separation, abs_tol=2e-14)


@settings(max_examples=100, deadline=None)
@given(kinds, vectors, quaternions)
def test_the_distance_to_a_plane_is_that_of_the_lowest_corner(kind: str, place: Any, q: Any) -> None:
    a = body(SHAPES[kind], place, orientation=q)
    lowest = min(float(points[:, 2].min()) - radius for points, radius in corners(a))
    gap = gap_of(a, floor(-0.25))
    assert math.isclose(gap.separation, lowest + 0.25, abs_tol=1e-15 * 10)
    assert gap.normal == (0.0, 0.0, -1.0)


@settings(max_examples=100, deadline=None)
@given(vectors, vectors, quaternions)
def test_a_sphere_in_a_compound_is_the_sphere(place: Any, velocity: Any, q: Any) -> None:
    ball, same = xp.Sphere(0.3), xp.Compound([(xp.Sphere(0.3), (0, 0, 0))])
    other = body(xp.Sphere(0.2), (1.0, 1.2, 0.7), (-0.5, -0.4, -0.5))
    for partner in (other, floor(-2.0)):
        exact = body(ball, place, velocity, (0, 0, -1.0))
        general = exact._replace(shape=same, orientation=q)
        assert math.isclose(gap_of(general, partner).separation, gap_of(exact, partner).separation, abs_tol=1e-14)
        s, t = impact(general, partner), impact(exact, partner)
        assert math.isclose(s, t, rel_tol=1e-11) or _is_graze(exact, partner, min(s, t))


def _is_graze(a: Any, b: Any, t: float) -> bool:
    return t < math.inf and abs(gap_of(a.at(t), b.at(t)).speed) < 1e-5


def test_a_sphere_on_a_face_an_edge_and_a_corner() -> None:
    crate, ball = body(xp.Box((2, 2, 2))), xp.Sphere(0.5)
    for place, expected in (((0.3, 0.2, 2), 0.5), ((0, 2, 2), math.sqrt(2) - 0.5), ((2, 2, 2), math.sqrt(3) - 0.5)):
        gap = gap_of(crate, body(ball, place))
        assert math.isclose(gap.separation, expected, rel_tol=1e-15)
    assert gap_of(crate, body(ball, (0, 0, 0.8))).separation == pytest.approx(-0.7, abs=1e-15)


def test_where_a_box_touches_a_plane() -> None:
    crate = xp.Box((2, 2, 2))
    ways = [
        (1.0, (1.0, 0.0, 0.0, 0.0), 4),
        (math.sqrt(2), from_axis_angle((1.0, 0.0, 0.0), math.pi / 4), 2),
        (
            math.sqrt(3),
            multiply(
                from_axis_angle((1.0, 0.0, 0.0), math.atan(math.sqrt(0.5))),
                from_axis_angle((0.0, 1.0, 0.0), math.pi / 4),
            ),
            1,
        ),
    ]
    for height, orientation, count in ways:
        points = points_of(body(crate, (0, 0, height), orientation=orientation), floor())
        assert len(points) == count
        assert all(abs(one.separation) < 1e-15 * 4 and abs(one.point[2]) < 1e-14 for one in points)


def test_where_faces_edges_and_capsules_touch() -> None:
    crate = body(xp.Box((2, 2, 2)))
    face = points_of(crate, body(xp.Box((2, 2, 2)), (0.5, 0.5, 2)))
    assert {tuple(round(c, 12) for c in one.point) for one in face} == {
        (x, y, 1.0) for x in (-0.5, 1.0) for y in (-0.5, 1.0)
    }
    turned = from_axis_angle((0.0, 0.0, 1.0), math.pi / 4)
    assert len(points_of(crate, body(xp.Box((2, 2, 2)), (0, 0, 2), orientation=turned))) == 8
    across = from_axis_angle((0.0, 1.0, 0.0), math.pi / 2)
    lying = points_of(crate, body(xp.Capsule(0.25, 6), (0, 0, 1.25), orientation=across))
    assert sorted(round(one.point[0], 12) for one in lying) == [-1.0, 1.0]
    rod = points_of(body(xp.Capsule(0.25, 1), (0, 0, 0.25), orientation=across), floor())
    assert sorted(round(one.point[0], 12) for one in rod) == [-0.5, 0.5]
    assert len(points_of(crate, body(xp.Sphere(0.5), (0, 0, 1.5)))) == 1
    # Edge across edge: one point, and the normal across both edges.
    lower = body(xp.Box((2, 2, 2)), orientation=from_axis_angle((1.0, 0.0, 0.0), math.pi / 4))
    upper = body(
        xp.Box((2, 2, 2)), (0.1, 0.2, 2 * math.sqrt(2)), orientation=from_axis_angle((0.0, 1.0, 0.0), math.pi / 4)
    )
    (edge,) = points_of(lower, upper)
    assert edge.normal == pytest.approx((0, 0, 1), abs=1e-14) and edge.point == pytest.approx(
        (0.1, 0, math.sqrt(2)), abs=1e-13
    )


def test_contact_points_have_the_speed_of_the_material() -> None:
    points = points_of(body(xp.Box((2, 2, 2)), (0, 0, 1), (0, 0, -3), angular_velocity=(0, 1, 0)), floor())
    assert [(one.point[0], one.speed) for one in points] == [(-1, -2), (-1, -2), (1, -4), (1, -4)]
    assert gap_of(body(xp.Box((2, 2, 2)), (0, 0, 1), (0, 0, -3), angular_velocity=(0, 1, 0)), floor()).speed == -4


def test_a_mesh_is_refused_with_the_way_out() -> None:
    with pytest.raises(ContactError, match="convex parts"):
        family_of("box", "mesh")
