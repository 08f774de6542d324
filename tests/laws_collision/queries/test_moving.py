"""What moved shapes come to first: closed forms, and the way looked at step by step."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.laws_collision.queries.query_scenes import (
    BOUNDED,
    SHAPES,
    SOLID,
    crowd,
    directions,
    pose_along,
    quaternions,
    scene,
    vectors,
)

import xpheve as xp
from xpheve.errors import ContactError, InvalidValueError

UPRIGHT = (1.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("shape", "met", "fraction", "point"),
    [
        (xp.Sphere(0.5), xp.Sphere(0.5), 0.4, (-0.5, 0, 0)),
        (xp.Sphere(0.5), xp.Box((1, 1, 1)), 0.4, (-0.5, 0, 0)),
        (xp.Sphere(0.5), xp.Plane((-1, 0, 0)), 0.45, (0, 0, 0)),
        (xp.Sphere(0.5), None, 0.45, (0, 0, 0)),
        (None, xp.Sphere(0.5), 0.45, (-0.5, 0, 0)),
        (None, xp.Plane((-1, 0, 0)), 0.5, (0, 0, 0)),
        (xp.Box((1, 1, 1)), xp.Plane((-1, 0, 0)), 0.45, None),
        (xp.Box((1, 1, 1)), xp.Box((2, 1, 1)), 0.35, None),
        (xp.Capsule(0.5, 1.0), xp.Sphere(1.0), 0.35, (-1, 0, 0)),
        (xp.Sphere(0.5), SHAPES["mesh"], 0.41, (-0.4, 0, 0)),
    ],
)
def test_a_shape_moved_along_x_stops_where_it_touches(shape: Any, met: Any, fraction: float, point: Any) -> None:
    engine, (obj,) = scene((met, (0, 0, 0), UPRIGHT))
    hit = engine.queries.sweep(shape, (-5, 0, 0), (10, 0, 0))
    assert hit is not None and hit.object is obj
    assert hit.fraction == pytest.approx(fraction, abs=1e-12)
    assert hit.normal == pytest.approx((-1, 0, 0), abs=1e-9)
    if point is not None:
        assert hit.point == pytest.approx(point, abs=1e-9)
    assert engine.queries.sweep(shape, (-5, 0, 0), (10 * fraction - 1e-6, 0, 0)) is None
    assert engine.queries.sweep(shape, (-5, 0, 0), (-10, 0, 0)) is None


@pytest.mark.parametrize("kind", SOLID)
def test_what_overlaps_at_the_start_is_hit_there_and_what_touches_and_is_left_is_not(kind: str) -> None:
    engine, (obj, _) = scene((SHAPES[kind], (0, 0, 0), UPRIGHT), (xp.Sphere(0.1), (0, 0, 40), UPRIGHT))
    hit = engine.queries.sweep(xp.Sphere(0.1), (0, 0, 0), (5, 0, 0))
    assert hit is not None and hit.object is obj and hit.fraction == 0.0
    still = engine.queries.sweep(xp.Sphere(0.1), (0, 0, 0), (0, 0, 0))
    assert still is not None and still.fraction == 0.0
    assert engine.queries.sweep(xp.Sphere(0.1), (5, 0, 0), (0, 0, 0)) is None
    foot = engine.queries.closest_point(obj, (3.0, 0.1, 0.1))
    beside = np.add(foot.point, np.multiply(0.1, foot.normal))
    assert engine.queries.sweep(xp.Sphere(0.1), beside.tolist(), foot.normal) is None
    into = engine.queries.sweep(xp.Sphere(0.1), beside.tolist(), np.multiply(-1.0, foot.normal).tolist())
    assert into is not None and into.fraction < 1e-9


def test_a_rod_that_only_turns_comes_to_what_its_end_reaches() -> None:
    engine, (ball,) = scene((xp.Sphere(0.25), (0.0, 1.0, 0), UPRIGHT))
    rod = xp.Box((2.0, 0.02, 0.02))
    hit = engine.queries.sweep(rod, (0, 0, 0), (0, 0, 0), turn=(0, 0, np.pi / 2))
    assert hit is not None and hit.object is ball
    assert 0.5 < hit.fraction < 1.0
    assert engine.queries.sweep(rod, (0, 0, 0), (0, 0, 0), turn=(0, 0, hit.fraction * np.pi / 2 - 1e-6)) is None
    assert engine.queries.sweep(rod, (0, 0, 0), (0, 0, 0), turn=(0, 0, np.pi / 2), exclude=[ball]) is None


@pytest.mark.parametrize("met", BOUNDED)
@settings(max_examples=25)
@given(
    x=vectors,
    direction=directions,
    p=quaternions,
    q=quaternions,
    turn=st.just((0.0, 0.0, 0.0)) | vectors,
    a=st.sampled_from(SOLID),
)
def test_before_the_stop_they_are_apart_and_at_the_stop_they_touch(
    met: str, x: Any, direction: Any, p: Any, q: Any, turn: Any, a: str
) -> None:
    shape = SHAPES["sphere" if met == "mesh" else a]
    start = tuple(-3.0 * d + 0.5 * c for d, c in zip(direction, x, strict=True))
    motion = tuple(6.0 * d for d in direction)
    engine, (obj,) = scene((SHAPES[met], (0, 0, 0), q))
    hit = engine.queries.sweep(shape, start, motion, p, turn)
    end = 1.0 if hit is None else hit.fraction
    parts = np.linspace(0.0, end, 60)[:-1] if hit is not None else np.linspace(0.0, end, 60)
    for part in parts.tolist():
        if hit is not None and hit.fraction == 0.0:
            break
        assert not engine.queries.overlap(shape, *pose_along(start, p, motion, turn, part), margin=-1e-7)
    if hit is not None:
        pose = pose_along(start, p, motion, turn, end)
        assert engine.queries.overlap(shape, *pose, margin=1e-7) == (obj,)
        assert abs(engine.queries.closest_point(obj, hit.point).distance) < (1e-6 if end else 2.0)


@pytest.mark.parametrize("seed", range(6))
def test_among_many_the_first_is_the_one_that_each_alone_says(seed: int) -> None:
    engine, objects = crowd(seed, 40)
    for shape in (xp.Sphere(0.2), xp.Box((0.3, 0.2, 0.2)), None):
        hit = engine.queries.sweep(shape, (-6, 0, 0), (12, 0.5, 0.2), turn=(0.5, 0, 1.0))
        alone = [
            engine.queries.sweep(shape, (-6, 0, 0), (12, 0.5, 0.2), turn=(0.5, 0, 1.0), objects=[o]) for o in objects
        ]
        first = min((one for one in alone if one is not None), key=lambda one: one.fraction, default=None)
        assert (hit is None) == (first is None)
        if hit is not None and first is not None:
            assert hit.object is first.object and hit.fraction == pytest.approx(first.fraction, abs=1e-12)


def test_a_plane_cannot_be_moved_and_a_box_in_a_mesh_is_refused_by_name() -> None:
    engine, _ = scene((SHAPES["mesh"], (0, 0, 0), UPRIGHT))
    with pytest.raises(InvalidValueError, match="a plane has no end"):
        engine.queries.sweep(xp.Plane(), (0, 0, 0), (1, 0, 0))
    with pytest.raises(ContactError, match="mesh"):
        engine.queries.sweep(xp.Box((1, 1, 1)), (-5, 0, 0), (10, 0, 0))
