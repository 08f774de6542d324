"""Distances of shapes: the gaps of the narrow phase, nearest points on both surfaces, and the same from either side."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.laws_collision.convex_bodies import body, gap_of
from tests.laws_collision.queries.query_scenes import BOUNDED, SHAPES, SOLID, few, moved, quaternions, scene, vectors

import xpheve as xp
from xpheve.errors import ContactError, InvalidValueError

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
kinds = st.sampled_from(SOLID)


def test_two_balls_a_ball_and_a_box_and_a_box_above_a_plane() -> None:
    engine, (a, b, box, floor) = scene(
        (xp.Sphere(0.5), (0, 0, 2), UPRIGHT),
        (xp.Sphere(0.25), (3, 4, 2), UPRIGHT),
        (xp.Box((1, 1, 1)), (0, 0, 0.75), UPRIGHT),
        (xp.Plane((0, 0, 1)), (0, 0, 0), UPRIGHT),
    )
    found = engine.queries.distance(a, b)
    assert found.distance == pytest.approx(4.25, abs=1e-15)
    assert found.point_a == pytest.approx((0.3, 0.4, 2)) and found.point_b == pytest.approx((2.85, 3.8, 2))
    assert found.normal == pytest.approx((0.6, 0.8, 0))
    found = engine.queries.distance(a, box)
    assert (found.distance, found.normal) == (pytest.approx(0.25), pytest.approx((0, 0, -1)))
    found = engine.queries.distance(box, floor)
    assert (found.distance, found.normal) == (pytest.approx(0.25), pytest.approx((0, 0, -1)))
    assert found.point_a == pytest.approx((0, 0, 0.25)) and found.point_b == pytest.approx((0, 0, 0))


@few
@given(kinds, kinds, vectors, quaternions, quaternions)
def test_it_is_the_gap_of_the_narrow_phase(a: str, b: str, away: Any, p: Any, q: Any) -> None:
    there = tuple(2.0 * x for x in away)
    engine, (one, two) = scene((SHAPES[a], (0, 0, 0), p), (SHAPES[b], there, q))
    found = engine.queries.distance(one, two)
    gap = gap_of(body(SHAPES[a], orientation=p), body(SHAPES[b], there, orientation=q))
    assert found.distance == pytest.approx(gap.separation, abs=1e-7)
    assert math.hypot(*found.normal) == pytest.approx(1.0, abs=1e-9)
    between = np.subtract(found.point_b, found.point_a)
    assert between == pytest.approx(np.multiply(found.distance, found.normal), abs=1e-7)
    if found.distance > 1e-6:
        assert abs(engine.queries.closest_point(one, found.point_a).distance) < 1e-7
        assert abs(engine.queries.closest_point(two, found.point_b).distance) < 1e-7


@few
@given(st.sampled_from(BOUNDED), kinds, vectors, quaternions, quaternions)
def test_it_is_the_same_from_either_side(a: str, b: str, away: Any, p: Any, q: Any) -> None:
    there = tuple(2.0 * x for x in away)
    engine, (one, two) = scene((SHAPES[a], (0, 0, 0), p), (SHAPES[b], there, q))
    found, back = engine.queries.distance(one, two), engine.queries.distance(two, one)
    assert back.distance == pytest.approx(found.distance, abs=1e-7)
    if found.distance > 1e-3 and a != "mesh":
        between = np.subtract(found.point_b, found.point_a)
        assert np.linalg.norm(np.subtract(back.point_a, back.point_b)) == pytest.approx(
            np.linalg.norm(between), abs=1e-7
        )


@few
@given(kinds, vectors, quaternions, quaternions)
def test_a_mesh_is_as_far_away_as_its_hull_from_outside(b: str, away: Any, p: Any, q: Any) -> None:
    there = tuple(2.0 * x for x in away)
    box = xp.Box((0.8, 0.6, 1.0))
    engine, (mesh, solid, other) = scene((SHAPES["mesh"], (0, 0, 0), p), (box, (0, 0, 0), p), (SHAPES[b], there, q))
    found, wanted = engine.queries.distance(mesh, other), engine.queries.distance(solid, other)
    if wanted.distance > 1e-6:
        assert found.distance == pytest.approx(wanted.distance, abs=1e-7)


@few
@given(st.sampled_from(BOUNDED), vectors, quaternions)
def test_above_a_plane_the_lowest_point_counts(kind: str, x: Any, q: Any) -> None:
    engine, (obj, plane) = scene((SHAPES[kind], x, q), (SHAPES["plane"], (0, 0, 0), UPRIGHT))
    found = engine.queries.distance(obj, plane)
    directions = np.random.default_rng(3).normal(size=(60, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    on = [engine.queries.closest_point(obj, (np.array(x) + 3.0 * d).tolist()).point for d in directions]
    lowest = min(float(np.dot(point, (0.0, 0.6, 0.8))) for point in on) - 0.1
    assert found.distance <= lowest + 1e-9 and lowest - found.distance < 0.5
    assert abs(engine.queries.closest_point(plane, found.point_b).distance) < 1e-12


@few
@given(kinds, kinds, vectors, quaternions, quaternions, vectors, quaternions)
def test_turning_and_shifting_the_world_changes_no_distance(
    a: str, b: str, away: Any, p: Any, q: Any, shift: Any, turn: Any
) -> None:
    there = tuple(2.0 * x for x in away)
    one, (c, d) = scene((SHAPES[a], (0, 0, 0), p), (SHAPES[b], there, q))
    other, (e, f) = scene((SHAPES[a], *moved((0, 0, 0), p, shift, turn)), (SHAPES[b], *moved(there, q, shift, turn)))
    found, again = one.queries.distance(c, d), other.queries.distance(e, f)
    assert again.distance == pytest.approx(found.distance, abs=1e-7)


def test_meshes_and_planes_among_themselves_are_refused_by_name() -> None:
    engine, (a, b, c, d) = scene(
        (SHAPES["mesh"], (0, 0, 0), UPRIGHT),
        (SHAPES["mesh"], (3, 0, 0), UPRIGHT),
        (SHAPES["plane"], (0, 0, 0), UPRIGHT),
        (SHAPES["plane"], (0, 0, 9), UPRIGHT),
    )
    with pytest.raises(ContactError, match="between meshes"):
        engine.queries.distance(a, b)
    with pytest.raises(InvalidValueError, match="planes have no end"):
        engine.queries.distance(c, d)
    with pytest.raises(InvalidValueError, match="twice"):
        engine.queries.distance(a, a)
