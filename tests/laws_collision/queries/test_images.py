"""Queries in periodic scenes: as among all the images, put there one by one."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import ContactError, InvalidValueError

BOX = (2.0, 3.0, None)


def both(seed: int, count: int = 25) -> Any:
    """A periodic scene of balls and a floor, and one of its images."""
    rng = np.random.default_rng(seed)
    radii = rng.uniform(0.05, 0.3, count)
    places = rng.uniform((0, 0, 0.2), (2, 3, 2.5), (count, 3))
    engine = xp.PhysicsEngine(up="z", periodic=BOX)
    objects = engine.add_objects(
        [xp.PhysicalObject(xp.Sphere(r), position=x) for r, x in zip(radii, places.tolist(), strict=True)]
    )
    floor = engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True))
    plain = xp.PhysicsEngine(up="z")
    original: dict[Any, Any] = {}
    for i, j in itertools.product(range(-4, 5), repeat=2):
        copies = plain.add_objects(
            [
                xp.PhysicalObject(xp.Sphere(r), position=(x[0] + 2 * i, x[1] + 3 * j, x[2]))
                for r, x in zip(radii, places.tolist(), strict=True)
            ]
        )
        original |= dict(zip(copies, objects, strict=True))
    original[plain.add_object(xp.PhysicalObject(xp.Plane(), fixed=True))] = floor
    return rng, engine, plain, original, objects


@pytest.mark.parametrize("seed", range(4))
def test_rays_meet_the_images_on_their_way(seed: int) -> None:
    rng, engine, plain, original, _ = both(seed)
    origins, directions = rng.uniform((0, 0, 0.1), (2, 3, 3), (40, 3)), rng.normal(size=(40, 3))
    hits, wanted = (one.queries.ray_casts(origins, directions, 5.0) for one in (engine, plain))
    assert (hits.rows >= 0).sum() > 10
    for k in range(40):
        a, b = hits[k], wanted[k]
        assert (a is None) == (b is None)
        if a is not None and b is not None:
            assert a.object is original[b.object] and a.distance == pytest.approx(b.distance, abs=1e-9)
            assert a.point == pytest.approx(b.point, abs=1e-9) and a.normal == pytest.approx(b.normal, abs=1e-9)
    all_on_the_way = engine.queries.ray_cast_all(origins[0].tolist(), directions[0].tolist(), 5.0)
    assert len({hit.object for hit in all_on_the_way}) == len(all_on_the_way)


@pytest.mark.parametrize("seed", range(4))
def test_nearest_points_and_distances_are_those_of_the_nearest_images(seed: int) -> None:
    rng, engine, plain, original, objects = both(seed)
    for point in rng.uniform((0, 0, 0), (2, 3, 2), (10, 3)).tolist():
        found, wanted = engine.queries.nearest(point), plain.queries.nearest(point)
        assert found is not None and wanted is not None
        assert found.object is original[wanted.object]
        assert found.point == pytest.approx(wanted.point, abs=1e-9)
        near = {original[obj] for obj in plain.queries.overlap(xp.Sphere(0.2), point)}
        assert set(engine.queries.overlap(xp.Sphere(0.2), point)) == near
    images: dict[Any, list[Any]] = {}
    for copy, obj in original.items():
        images.setdefault(obj, []).append(copy)
    for a, b in itertools.combinations(objects[:6], 2):
        central = next(one for one in images[a] if one.position == pytest.approx(a.position))
        wanted_distance = min(plain.queries.distance(central, other).distance for other in images[b])
        assert engine.queries.distance(a, b).distance == pytest.approx(wanted_distance, abs=1e-9)


@pytest.mark.parametrize("margin", [0.0, 0.1])
@pytest.mark.parametrize("seed", range(4))
def test_pairs_overlap_through_the_faces(seed: int, margin: float) -> None:
    _, engine, plain, original, _ = both(seed, 40)
    rows = {obj: row for row, obj in enumerate(engine.objects)}
    wanted = {
        tuple(sorted((original[a], original[b]), key=rows.__getitem__))
        for a, b in plain.queries.overlaps(margin)
        if original[a] is not original[b]
    }
    found = engine.queries.overlaps(margin)
    assert set(found) == wanted and len(found) == len(wanted)


@pytest.mark.parametrize("seed", range(4))
def test_a_moved_ball_comes_to_images(seed: int) -> None:
    rng, engine, plain, original, _ = both(seed, 12)
    for motion in (rng.normal(size=(12, 3)) * (2, 2, 0.2)).tolist():
        for shape in (xp.Sphere(0.1), None):
            found, wanted = (one.queries.sweep(shape, (1.0, 1.0, 1.0), motion) for one in (engine, plain))
            assert (found is None) == (wanted is None)
            if found is not None and wanted is not None:
                assert found.object is original[wanted.object]
                assert found.fraction == pytest.approx(wanted.fraction, abs=1e-9)


def test_what_has_no_images_is_refused_by_name() -> None:
    _, engine, _, _, objects = both(0, 5)
    with pytest.raises(InvalidValueError, match="shorter length"):
        engine.queries.ray_cast((1, 1, 1), (1, 0, 0))
    with pytest.raises(InvalidValueError, match="shorter length"):
        engine.queries.ray_cast((1, 1, 1), (1, 0, 0), 1e300)
    assert engine.queries.ray_cast((1, 1, 9), (0, 0, 1)) is None  # no period along z
    with pytest.raises(ContactError, match="images of spheres"):
        engine.queries.overlap(xp.Box((1, 1, 1)), (0, 0, 0))
    box = engine.add_object(xp.PhysicalObject(xp.Box((1, 1, 1)), position=(1, 1, 5), fixed=True, name="box"))
    with pytest.raises(ContactError, match=r"box.*exclude="):
        engine.queries.nearest((0, 0, 1))
    assert engine.queries.nearest((0, 0, 1), exclude=[box]) is not None
    assert math.isfinite(engine.queries.distance(objects[0], objects[1]).distance)
