"""Overlaps: every pair looked at one by one finds the same."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from tests.laws_collision.queries.query_scenes import SHAPES, SOLID, crowd, few, quaternions, scene, vectors

import xpheve as xp
from xpheve_laws_collision.queries.meeting import neighbours, widest_gap

UPRIGHT = (1.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("margin", [-0.05, 0.0, 0.3])
@pytest.mark.parametrize("seed", range(3))
def test_pairs_are_those_whose_distance_says_so(seed: int, margin: float) -> None:
    engine, objects = crowd(seed, 45, 1.6)
    floor = engine.add_object(xp.PhysicalObject(SHAPES["plane"], fixed=True))
    everyone = [*objects, floor]
    wanted = tuple((a, b) for a, b in combinations(everyone, 2) if engine.queries.distance(a, b).distance <= margin)
    assert len(wanted) > 5
    assert engine.queries.overlaps(margin) == wanted
    inner = set(objects[:20])
    assert engine.queries.overlaps(margin, objects=objects[:20]) == tuple(
        pair for pair in wanted if pair[0] in inner and pair[1] in inner
    )


@pytest.mark.parametrize("shape", [None, xp.Sphere(0.4), xp.Box((1, 1, 0.5)), SHAPES["hull"], SHAPES["plane"]])
@pytest.mark.parametrize("margin", [-0.05, 0.0, 0.3])
def test_who_overlaps_a_shape_is_whose_distance_from_it_says_so(shape: Any, margin: float) -> None:
    engine, objects = crowd(5, 60, 1.5)
    q = (0.5, 0.5, -0.5, 0.5)
    found = engine.queries.overlap(shape, (0.2, 0.1, 0.3), q, margin)
    probe = engine.add_object(xp.PhysicalObject(shape, position=(0.2, 0.1, 0.3), orientation=q, fixed=True))
    wanted = tuple(obj for obj in objects if engine.queries.distance(probe, obj).distance <= margin)
    assert found == wanted and (wanted or shape is None)


def test_a_point_in_a_ball_overlaps_it_and_so_does_a_shape_behind_a_plane() -> None:
    engine, (ball, floor) = scene((xp.Sphere(1.0), (0, 0, 3), UPRIGHT), (xp.Plane((0, 0, 1)), (0, 0, 0), UPRIGHT))
    assert engine.queries.overlap(None, (0.5, 0.5, 3)) == (ball,)
    assert engine.queries.overlap(None, (0.5, 0.5, -3)) == (floor,)
    assert engine.queries.overlap(xp.Box((1, 1, 1)), (0, 0, 0.45)) == (floor,)
    assert engine.queries.overlap(xp.Box((1, 1, 1)), (0, 0, 1.25), margin=0.5) == (ball,)
    assert engine.queries.overlap(xp.Box((1, 1, 1)), (0, 0, 1.25), margin=0.2) == ()
    assert engine.queries.overlap(xp.Box((1, 1, 1)), (0, 0, 1.25), margin=0.8) == (ball, floor)


@few
@given(vectors, quaternions, quaternions)
def test_the_widest_gap_of_boxes_parts_them_no_farther_than_they_are(away: Any, p: Any, q: Any) -> None:
    engine, (a, b) = scene((xp.Box((1, 0.6, 0.4)), (0, 0, 0), p), (xp.Box((0.3, 1.2, 0.7)), away, q))
    places = engine.queries._places()  # type: ignore[attr-defined]
    gap = float(widest_gap(places, np.array([0]), np.array([1]))[0])
    distance = engine.queries.distance(a, b).distance
    assert gap <= distance + 1e-9
    if abs(distance) > 1e-9:
        assert (gap > 0.0) == (distance > 0.0)
    if distance < 0.0:
        assert gap == pytest.approx(distance, abs=1e-7)


@pytest.mark.parametrize("count", [0, 1, 2, 300])
def test_neighbours_are_all_boxes_that_overlap(count: int) -> None:
    rng = np.random.default_rng(count)
    low = rng.uniform(-2, 2, (count, 3))
    high = low + rng.uniform(0, 0.6, (count, 3))
    i, j = neighbours(low, high)
    found = {(min(pair), max(pair)) for pair in zip(i.tolist(), j.tolist(), strict=True)}
    wanted = {
        (a, b) for a, b in combinations(range(count), 2) if (low[a] <= high[b]).all() and (low[b] <= high[a]).all()
    }
    assert found == wanted and len(i) == len(wanted)


def test_all_kinds_meet_all_kinds() -> None:
    for a in SOLID:
        for b in SOLID:
            engine, pair = scene((SHAPES[a], (0, 0, 0), UPRIGHT), (SHAPES[b], (0.1, 0, 0), UPRIGHT))
            assert engine.queries.overlaps() == (tuple(pair),)
