"""The nearest point of a surface: closed forms, the contacts of a small ball, and points sampled on triangles."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from tests.laws_collision.convex_bodies import body, gap_of
from tests.laws_collision.queries.query_scenes import BOUNDED, SHAPES, SOLID, few, moved, quaternions, scene, vectors

import xpheve as xp
from xpheve.kernels.quaternion import rotate
from xpheve_laws_collision.queries.surface import on_triangles

UPRIGHT = (1.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("shape", "point", "distance", "foot", "normal"),
    [
        (xp.Sphere(0.5), (2, 0, 0), 1.5, (0.5, 0, 0), (1, 0, 0)),
        (xp.Sphere(0.5), (0, 0, 0), -0.5, (0, 0, 0.5), (0, 0, 1)),
        (None, (0, 3, 0), 3.0, (0, 0, 0), (0, 1, 0)),
        (xp.Box((2, 2, 2)), (4, 5, 1), 5.0, (1, 1, 1), (0.6, 0.8, 0)),
        (xp.Box((2, 2, 2)), (0.25, 0, -0.5), -0.5, (0.25, 0, -1), (0, 0, -1)),
        (xp.Capsule(0.5, 2.0), (0, 3, 0.5), 2.5, (0, 0.5, 0.5), (0, 1, 0)),
        (xp.Capsule(0.5, 2.0), (3, 0, 5), 4.5, (0.3, 0, 1.4), (0.6, 0, 0.8)),
        (xp.Plane((0, 0, 1), 0.5), (3, 4, 2), 1.5, (3, 4, 0.5), (0, 0, 1)),
        (xp.Plane((0, 0, 1), 0.5), (3, 4, 0), -0.5, (3, 4, 0.5), (0, 0, 1)),
        (SHAPES["mesh"], (0.7, 0.7, 0), 0.5, (0.4, 0.3, 0), (0.6, 0.8, 0)),
        (SHAPES["mesh"], (0.3, 0, 0), 0.1, (0.4, 0, 0), (-1, 0, 0)),
    ],
)
def test_the_nearest_points_of_plain_shapes(shape: Any, point: Any, distance: float, foot: Any, normal: Any) -> None:
    engine, (obj,) = scene((shape, (0, 0, 0), UPRIGHT))
    found = engine.queries.closest_point(obj, point)
    assert found.object is obj
    assert found.distance == pytest.approx(distance, abs=1e-14)
    assert found.point == pytest.approx(foot, abs=1e-14)
    assert found.normal == pytest.approx(normal, abs=1e-14)
    assert engine.queries.nearest(point) == found


@pytest.mark.parametrize("kind", BOUNDED)
@few
@given(point=vectors, q=quaternions)
def test_the_foot_is_on_the_surface_at_its_distance_along_its_normal(kind: str, point: Any, q: Any) -> None:
    engine, (obj,) = scene((SHAPES[kind], (0.1, -0.2, 0.3), q))
    found = engine.queries.closest_point(obj, point)
    assert math.hypot(*found.normal) == pytest.approx(1.0, abs=1e-12)
    assert np.add(found.point, np.multiply(found.distance, found.normal)) == pytest.approx(np.array(point), abs=1e-9)
    if kind != "compound" or found.distance > 0.0:  # inside a compound the part that is deepest counts
        assert abs(engine.queries.closest_point(obj, found.point).distance) < 1e-9


@pytest.mark.parametrize("kind", SOLID)
@few
@given(point=vectors, q=quaternions)
def test_it_is_the_gap_of_a_tiny_ball(kind: str, point: Any, q: Any) -> None:
    engine, (obj,) = scene((SHAPES[kind], (0.1, -0.2, 0.3), q))
    found = engine.queries.closest_point(obj, point)
    gap = gap_of(body(xp.Sphere(1e-3), point), body(SHAPES[kind], (0.1, -0.2, 0.3), orientation=q))
    assert found.distance == pytest.approx(gap.separation + 1e-3, abs=1e-9)


@pytest.mark.parametrize("kind", sorted(SHAPES))
@few
@given(point=vectors, q=quaternions, shift=vectors, turn=quaternions)
def test_turning_and_shifting_the_world_changes_no_distance(
    kind: str, point: Any, q: Any, shift: Any, turn: Any
) -> None:
    one, (a,) = scene((SHAPES[kind], (0.1, 0.2, 0.3), q))
    other, (b,) = scene((SHAPES[kind], *moved((0.1, 0.2, 0.3), q, shift, turn)))
    there = tuple(x + y for x, y in zip(rotate(turn, point), shift, strict=True))
    found, again = one.queries.closest_point(a, point), other.queries.closest_point(b, there)
    assert again.distance == pytest.approx(found.distance, abs=1e-9)


@few
@given(vectors, vectors, vectors, vectors)
def test_no_point_sampled_on_a_triangle_is_nearer_than_the_one_found(a: Any, b: Any, c: Any, p: Any) -> None:
    corners = np.array([[a, b, c]])
    found = on_triangles(corners, np.array(p))[0]
    weights = np.random.default_rng(1).dirichlet((1, 1, 1), 400)
    sampled = np.concatenate([weights @ corners[0], corners[0]])
    least = np.sqrt(((sampled - p) ** 2).sum(axis=1)).min()
    distance = np.linalg.norm(found - p)
    assert distance <= least + 1e-9
    away = np.sqrt(((sampled - found) ** 2).sum(axis=1)).min()
    assert away < 0.6  # and it is on the triangle
