"""Where rays come to shapes: closed forms, points looked at one by one, and the scalar lines of `rays`."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from tests.laws_collision.queries.query_scenes import (
    BOUNDED,
    SHAPES,
    SOLID,
    directions,
    few,
    moved,
    quaternions,
    scene,
    vectors,
)

import xpheve as xp
from xpheve.errors import ContactError
from xpheve.kernels.quaternion import rotate, rotate_inverse
from xpheve_laws_collision.queries.casting import _ahead
from xpheve_laws_collision.rays import crossing

UPRIGHT = (1.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("shape", "way", "normal"),
    [
        (xp.Sphere(0.5), 4.5, (-1, 0, 0)),
        (xp.Box((2, 1, 1)), 4.0, (-1, 0, 0)),
        (xp.Capsule(0.25, 1.0), 4.75, (-1, 0, 0)),
        (xp.Plane((-1, 0, 0), 1.0), 4.0, (-1, 0, 0)),
        (xp.Plane((-0.6, 0, 0.8), 0.0), 5.0, (-0.6, 0, 0.8)),
        (SHAPES["mesh"], 4.6, (-1, 0, 0)),
    ],
)
def test_a_ray_along_x_meets_each_shape_where_it_begins(shape: Any, way: float, normal: Any) -> None:
    engine, (obj,) = scene((shape, (0, 0, 0), UPRIGHT))
    hit = engine.queries.ray_cast((-5, 0, 0), (3, 0, 0))
    assert hit is not None and hit.object is obj
    assert hit.distance == pytest.approx(way, abs=1e-15)
    assert hit.point == pytest.approx((way - 5.0, 0, 0), abs=1e-15)
    assert hit.normal == pytest.approx(normal, abs=1e-15)
    assert engine.queries.ray_cast((-5, 0, 0), (3, 0, 0), way * 0.999) is None
    assert engine.queries.ray_cast((-5, 0, 0), (-3, 0, 0)) is None or shape.kind == "plane"


def test_a_ball_met_off_centre_has_the_normal_of_its_radius() -> None:
    engine, _ = scene((xp.Sphere(1.0), (0, 0, 0), UPRIGHT))
    hit = engine.queries.ray_cast((-5, 0.6, 0), (1, 0, 0))
    assert hit is not None and hit.distance == pytest.approx(4.2, abs=1e-14)
    assert hit.normal == pytest.approx((-0.8, 0.6, 0), abs=1e-14)
    assert engine.queries.ray_cast((-5, 1.0, 0), (1, 0, 0)) is None  # it grazes


@pytest.mark.parametrize("kind", [*SOLID, "plane"])
def test_a_ray_that_begins_inside_hits_where_it_begins(kind: str) -> None:
    engine, (obj,) = scene((SHAPES[kind], (0, 0, 0), UPRIGHT))
    hit = engine.queries.ray_cast((0.05, 0.02, -0.01), (0, 1, 0))
    assert hit is not None and hit.object is obj
    assert hit.distance == 0.0 and hit.normal == (0, -1, 0) and hit.point == (0.05, 0.02, -0.01)


@pytest.mark.parametrize("kind", ["sphere", "box", "capsule", "plane", "mesh"])
@few
@given(direction=directions)
def test_a_ray_that_leaves_a_surface_does_not_hit_it_again(kind: str, direction: Any) -> None:
    engine, _ = scene((SHAPES[kind], (3, 0, 0), UPRIGHT))
    first = engine.queries.ray_cast((3.05, 0.02, 9), (0.003, 0.005, -1))
    assert first is not None and first.distance > 1.0
    assume(float(np.dot(direction, first.normal)) > 1e-3)
    assert engine.queries.ray_cast(first.point, direction) is None


@pytest.mark.parametrize("kind", BOUNDED)
@few
@given(origin=vectors, direction=directions, q=quaternions)
def test_no_point_before_the_hit_is_inside_and_the_hit_is_on_the_surface(
    kind: str, origin: Any, direction: Any, q: Any
) -> None:
    engine, (obj,) = scene((SHAPES[kind], (0, 0, 0), q))
    start, along = 4.0 * np.array(origin), np.array(direction) / np.linalg.norm(direction)
    hit = engine.queries.ray_cast(start.tolist(), direction)
    free = 8.0 if hit is None else hit.distance
    if kind != "mesh" and free > 0.0:
        for part in np.linspace(0.0, 0.999, 40):
            place = start + part * free * along
            assert engine.queries.closest_point(obj, place.tolist()).distance > -1e-9
    if free == 0.0:
        assert engine.queries.closest_point(obj, start.tolist()).distance < 1e-9
    elif hit is not None:
        assert abs(engine.queries.closest_point(obj, hit.point).distance) < 1e-9
        assert np.dot(hit.normal, along) < 0.0 and math.hypot(*hit.normal) == pytest.approx(1.0)


@pytest.mark.parametrize("kind", SOLID)
@few
@given(offset=vectors, direction=directions, q=quaternions)
def test_from_either_side_a_line_is_cut_to_the_same_chord(kind: str, offset: Any, direction: Any, q: Any) -> None:
    shape = SHAPES[kind]
    engine, _ = scene((shape, (0, 0, 0), q))
    along = np.array(direction) / np.linalg.norm(direction)
    middle = 0.4 * np.array(offset)
    there = engine.queries.ray_cast((middle - 5 * along).tolist(), along.tolist())
    back = engine.queries.ray_cast((middle + 5 * along).tolist(), (-along).tolist())
    line = crossing(shape, rotate_inverse(q, tuple(middle.tolist())), rotate_inverse(q, tuple(along.tolist())), q)
    if line is None or line.leaves - line.enters < 1e-3:  # it grazes, and may go by in one of them
        assert there is None or back is None or 10 - there.distance - back.distance < 1e-2
    else:
        assert there is not None and back is not None
        assert there.distance - 5 == pytest.approx(line.enters, abs=1e-9)
        assert 5 - back.distance == pytest.approx(line.leaves, abs=1e-9)
        assert there.normal == pytest.approx(line.normal, abs=1e-5)


@pytest.mark.parametrize("kind", sorted(SHAPES))
@few
@given(origin=vectors, direction=directions, q=quaternions, shift=vectors, turn=quaternions)
def test_turning_and_shifting_the_world_turns_and_shifts_the_hit(
    kind: str, origin: Any, direction: Any, q: Any, shift: Any, turn: Any
) -> None:
    start = tuple(3.0 * x for x in origin)
    one, _ = scene((SHAPES[kind], (0.1, 0.2, 0.3), q))
    other, _ = scene((SHAPES[kind], *moved((0.1, 0.2, 0.3), q, shift, turn)))
    # Rays a little beside the given one: whoever grazes may be moved past an edge by rounding.
    beside = [one.queries.ray_cast(np.add(start, d).tolist(), direction, 1e3) for d in 1e-7 * np.eye(3)]
    hit = one.queries.ray_cast(start, direction, 1e3)
    assume(all((near is None) == (hit is None) for near in beside))
    if hit is not None:
        assume(all(near is not None and abs(near.distance - hit.distance) < 1e-4 for near in beside))
    there = other.queries.ray_cast(moved(start, q, shift, turn)[0], rotate(turn, direction), 1e3)
    assert (there is None) == (hit is None)
    if hit is not None and there is not None:
        assert there.distance == pytest.approx(hit.distance, abs=1e-9)
        assert there.point == pytest.approx(moved(hit.point, q, shift, turn)[0], abs=1e-9)


@pytest.mark.parametrize("kind", ["sphere", "box", "capsule"])
@few
@given(origin=vectors, direction=directions, q=quaternions)
def test_closed_forms_in_arrays_and_one_by_one_agree(kind: str, origin: Any, direction: Any, q: Any) -> None:
    engine, _ = scene((SHAPES[kind], (0, 0, 0), q))
    start = tuple(2.0 * x for x in origin)
    along = tuple((np.array(direction) / np.linalg.norm(direction)).tolist())
    hit = engine.queries.ray_cast(start, direction)
    alone = _ahead(SHAPES[kind], rotate_inverse(q, start), rotate_inverse(q, along), q, 1e-12)
    if hit is None or alone is None:
        # What grazes may go by in one of them.
        assert (hit is None and alone is None) or ((hit and hit.distance) or (alone and alone[0]) or 0.0) > 0.0
    else:
        assert hit.distance == pytest.approx(alone[0], abs=1e-7)


def test_points_are_never_met_and_all_objects_on_the_way_come_nearest_first() -> None:
    engine, objects = scene(
        (None, (1, 0, 0), UPRIGHT),
        (xp.Sphere(0.5), (6, 0, 0), UPRIGHT),
        (xp.Box((1, 1, 1)), (3, 0, 0), UPRIGHT),
        (xp.Plane((-1, 0, 0)), (9, 0, 0), UPRIGHT),
        (xp.Sphere(0.5), (6, 5, 0), UPRIGHT),
    )
    hits = engine.queries.ray_cast_all((0, 0, 0), (1, 0, 0))
    assert [hit.object for hit in hits] == [objects[2], objects[1], objects[3]]
    assert [hit.distance for hit in hits] == pytest.approx([2.5, 5.5, 9.0])
    assert [hit.object for hit in engine.queries.ray_cast_all((0, 0, 0), (1, 0, 0), 6.0)] == [objects[2], objects[1]]


def test_an_object_of_an_unknown_shape_is_named() -> None:
    class Blob(xp.Sphere):
        """A shape of a kind that nobody knows."""

        kind = "blob"

    engine, (obj,) = scene((Blob(0.5), (0, 0, 0), UPRIGHT))
    with pytest.raises(ContactError, match=r"kind 'blob'; known: sphere.*exclude"):
        engine.queries.ray_cast((-5, 0, 0), (1, 0, 0))
    assert engine.queries.ray_cast((-5, 0, 0), (1, 0, 0), exclude=[obj]) is None
    assert engine.queries.ray_cast((-5, 3, 0), (1, 0, 0)) is None


@few
@given(quaternions)
def test_no_ray_slips_through_the_seam_of_two_triangles(q: Any) -> None:
    mesh = SHAPES["mesh"]
    engine, _ = scene((mesh, (0, 0, 0), q))
    for a, b, c in mesh.faces:
        for one, two in ((a, b), (b, c), (c, a)):
            there = rotate(q, tuple((0.3 * mesh.vertices[one] + 0.7 * mesh.vertices[two]).tolist()))
            hit = engine.queries.ray_cast((0, 0, 0), there)
            assert hit is not None and hit.point == pytest.approx(there, abs=1e-9)


@few
@given(st.integers(0, 1000))
def test_a_mesh_is_met_at_the_first_triangle_ahead_from_either_side(seed: int) -> None:
    rng = np.random.default_rng(seed)
    engine, _ = scene((SHAPES["mesh"], (0, 0, 0), UPRIGHT))
    inside = rng.uniform(-0.25, 0.25, 3)
    direction = rng.normal(size=3)
    hit = engine.queries.ray_cast(inside.tolist(), direction.tolist())
    along = direction / np.linalg.norm(direction)
    ways = [(np.copysign(half, d) - x) / d for half, x, d in zip((0.4, 0.3, 0.5), inside, along, strict=True)]
    assert hit is not None and hit.distance == pytest.approx(min(ways), rel=1e-9)
    assert np.dot(hit.normal, along) < 0.0
