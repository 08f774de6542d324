"""Queries of an engine: at its time, of whom the filters say, without a trace in the run; bad questions get one clear error."""

from __future__ import annotations

import math
import threading
from typing import Any

import numpy as np
import pytest
from tests.laws_collision.queries.query_scenes import SHAPES, SOLID, crowd

import xpheve as xp
from xpheve.errors import InvalidValueError, OwnershipError, UnknownLawError
from xpheve.queries import Queries, RayHits


def bouncing() -> tuple[xp.PhysicsEngine, list[xp.PhysicalObject]]:
    """Balls that fall onto a floor and bounce."""
    engine = xp.PhysicsEngine(up="z", seed=4)
    gravity, bounce = (
        engine.add_law("basic:planet_gravity", name="g"),
        engine.add_law("collision:elastic", name="bounce"),
    )
    floor = engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True, name="floor"), [bounce])
    balls = [
        xp.PhysicalObject(xp.Sphere(0.1), position=(0.5 * k, 0, 1.0 + 0.1 * k), velocity=(0.3, 0, 0), name=f"ball_{k}")
        for k in range(4)
    ]
    engine.add_objects(balls, [gravity, bounce])
    return engine, [floor, *balls]


def ask_everything(engine: xp.PhysicsEngine) -> None:
    """One of each query."""
    q = engine.queries
    q.ray_cast((0, 0, 5), (0, 0, -1))
    q.ray_cast_all((0, 0, 5), (0, 0, -1))
    q.ray_casts(np.tile((0.0, 0.0, 5.0), (40, 1)), np.random.default_rng(1).normal(size=(40, 3)))
    q.closest_point(engine.objects[1], (0, 0, 0))
    q.nearest((0, 0, 3))
    q.distance(engine.objects[0], engine.objects[1])
    q.overlap(xp.Box((1, 1, 1)), (0, 0, 0))
    q.overlaps(0.2)
    q.sweep(xp.Box((0.1, 0.1, 0.1)), (-3, 0, 1), (6, 0, 0), turn=(0, 0, 1))


def test_objects_are_where_their_flights_are() -> None:
    engine, (_, ball, *_) = bouncing()
    for until in (0.1, 0.37, 1.9):
        engine.run(until=until)
        x, y, z = ball.position
        hit = engine.queries.ray_cast((x, y, z + 3), (0, 0, -1), objects=[ball])
        assert hit is not None and hit.object is ball and hit.point == pytest.approx((x, y, z + 0.1), abs=1e-12)
        found = engine.queries.nearest((x, y, z))
        assert found is not None and found.object is ball and found.distance == -0.1


def test_looking_changes_no_bit_of_the_run() -> None:
    (engine, _), (blind, _) = bouncing(), bouncing()
    for k in range(1, 12):
        engine.run(until=0.21 * k)
        ask_everything(engine)
        blind.run(until=0.21 * k)
    ask_everything(engine)
    for name in ("position", "velocity", "orientation", "angular_velocity"):
        assert getattr(engine.bodies, name).tobytes() == getattr(blind.bodies, name).tobytes()
    assert engine.checkpoint() == blind.checkpoint()


def test_answers_follow_what_is_written_added_removed_and_reset() -> None:
    engine, (floor, ball, *others) = bouncing()
    down = {"origin": (0, 0, 9), "direction": (0, 0, -1)}
    assert engine.queries.ray_cast(**down).object is ball  # type: ignore[arg-type, union-attr]
    ball.position = (7, 7, 7)
    assert engine.queries.ray_cast(**down).object is floor  # type: ignore[arg-type, union-attr]
    ball.shape = xp.Sphere(20.0)
    assert engine.queries.ray_cast((-30, 7, 7), (1, 0, 0)).distance == pytest.approx(17.0)  # type: ignore[union-attr]
    engine.remove_object(ball)
    assert engine.queries.ray_cast((-30, 7, 7), (1, 0, 0)) is None
    extra = engine.add_object(xp.PhysicalObject(xp.Box((1, 1, 1)), position=(0, 0, 4)))
    assert engine.queries.ray_cast(**down).object is extra  # type: ignore[arg-type, union-attr]
    engine.run(until=1.0)
    engine.reset()
    assert engine.queries.ray_cast(**down).object is not None  # type: ignore[arg-type, union-attr]
    assert engine.copy().queries.nearest((0, 0, 3)).distance == engine.queries.nearest((0, 0, 3)).distance  # type: ignore[union-attr]
    assert others[0] in engine.objects


def test_filters_say_who_is_asked_for() -> None:
    engine, (floor, ball, *others) = bouncing()
    q, place = engine.queries, (0, 0, 0.2)
    assert q.nearest(place).object is floor  # type: ignore[union-attr]
    assert q.nearest(place, exclude=[floor]).object is ball  # type: ignore[union-attr]
    assert q.nearest(place, exclude=floor).object is ball  # type: ignore[union-attr, arg-type]
    assert q.nearest(place, laws=["g"]).object is ball  # type: ignore[union-attr]
    assert q.nearest(place, laws=[engine.law("g")], exclude=[ball, others[0]]).object is others[1]  # type: ignore[union-attr]
    assert q.nearest(place, objects=others).object is others[0]  # type: ignore[union-attr]
    assert q.nearest(place, objects=[]) is None and q.nearest(place, 0.1, laws="g") is None  # type: ignore[arg-type]
    assert q.overlap(xp.Sphere(5), place, laws=["g"]) == (ball, *others)
    assert {hit.object for hit in q.ray_cast_all((-1, 0, 1.05), (1, 0, 0.02), laws=["g"])} <= {ball, *others}


@pytest.mark.parametrize("seed", range(3))
def test_many_rays_at_once_are_as_each_alone_with_a_tree_and_without(seed: int) -> None:
    engine, objects = crowd(seed, 300, 6.0, [*SOLID, "plane"] if seed == 2 else SOLID)
    rng = np.random.default_rng(seed)
    origins, directions = rng.uniform(-8, 8, (500, 3)), rng.normal(size=(500, 3))
    lengths = rng.uniform(1, 30, 500)
    hits = engine.queries.ray_casts(origins, directions, lengths)
    assert isinstance(hits, RayHits) and len(hits) == 500 and (hits.rows >= 0).sum() > 20
    other, _ = crowd(seed, 300, 6.0, [*SOLID, "plane"] if seed == 2 else SOLID)
    for k in range(0, 500, 7):
        alone = other.queries.ray_cast(origins[k].tolist(), directions[k].tolist(), float(lengths[k]))
        found = hits[k]
        assert (found is None) == (alone is None)
        if found is not None and alone is not None:
            assert (found.distance, found.point, found.normal) == (alone.distance, alone.point, alone.normal)
            assert found.object is engine.objects[hits.rows[k]] and alone.object.serial == found.object.serial
    missed = hits.rows < 0
    assert np.isinf(hits.distances[missed]).all() and np.isnan(hits.points[missed]).all()
    some = objects[::3]
    filtered = engine.queries.ray_casts(origins, directions, objects=some)
    assert {hits.objects[row] for row in filtered.rows if row >= 0} <= set(some)


def test_one_origin_serves_many_directions_and_arrays_are_read_only() -> None:
    engine, _ = bouncing()
    hits = engine.queries.ray_casts((0, 0, 5), [(0, 0, -1), (0, 0, 1), (1, 0, 0)])
    assert (hits.rows >= 0).tolist() == [True, False, False] and hits[1] is None
    with pytest.raises(ValueError, match="read-only"):
        hits.points[0, 0] = 1.0
    assert len(engine.queries.ray_casts(np.zeros((0, 3)), (0, 0, 1))) == 0


def test_an_empty_scene_answers_that_there_is_nothing() -> None:
    q = xp.PhysicsEngine().queries
    assert isinstance(q, Queries)
    assert q.ray_cast((0, 0, 0), (1, 0, 0)) is None and q.ray_cast_all((0, 0, 0), (1, 0, 0)) == ()
    assert q.nearest((0, 0, 0)) is None and q.overlaps() == () and q.overlap(None, (0, 0, 0)) == ()
    assert q.sweep(xp.Sphere(1), (0, 0, 0), (1, 0, 0)) is None
    assert (q.ray_casts(np.zeros((5, 3)), (1, 0, 0)).rows == -1).all()


@pytest.mark.parametrize(
    ("name", "arguments", "says"),
    [
        ("ray_cast", ((0, 0, 0), (0, 0, 0)), r"direction 0 is \(0, 0, 0\)"),
        ("ray_cast", ((0, 0, math.nan), (0, 0, 1)), "ray_cast: origin"),
        ("ray_cast", ((0, 0, 0), (0, math.inf, 1)), "ray_cast: direction"),
        ("ray_cast", ((0, 0, 0), (0, 0, 1), 0.0), "length = 0.0"),
        ("ray_cast", ((0, 0, 0), (0, 0, 1), math.nan), "length = nan"),
        ("ray_cast_all", ((0, 0), (0, 0, 1)), "ray_cast_all: origin"),
        ("ray_casts", ([(0, 0, 0), (0, 0, math.nan)], (0, 0, 1)), r"origin\[.*1.*\].*finite"),
        ("ray_casts", ([(0, 0, 0)] * 2, [(0, 0, 1)] * 3), "one for all, or n of each"),
        ("ray_casts", ([(0, 0, 0)] * 2, [(0, 0, 1), (0, 0, 0)]), "direction 1 is"),
        ("ray_casts", ("here", (0, 0, 1)), "rows of three"),
        ("ray_casts", ((0, 0, 0), (0, 0, 1), "far"), "length = 'far'"),
        ("nearest", ((0, math.nan, 0),), "nearest: point"),
        ("nearest", ((0, 0, 0), math.nan), "nearest: within"),
        ("overlap", ("ball", (0, 0, 0)), "overlap: shape = 'ball' is no shape"),
        ("overlap", (None, (0, 0, math.inf)), "overlap: position"),
        ("overlap", (None, (0, 0, 0), (0, 0, 0, 0)), "overlap: orientation"),
        ("overlaps", ("wide",), "overlaps: margin = 'wide'"),
        ("sweep", (None, (0, 0, 0), (math.nan, 0, 0)), "sweep: motion"),
        ("sweep", (None, (0, 0, 0), (1, 0, 0), (1, 0, 0, 0), (0, math.inf, 0)), "sweep: turn"),
    ],
)
def test_a_bad_question_is_named_with_its_value(name: str, arguments: Any, says: str) -> None:
    engine, _ = bouncing()
    with pytest.raises(InvalidValueError, match=says):
        getattr(engine.queries, name)(*arguments)


def test_objects_and_laws_of_elsewhere_are_refused() -> None:
    engine, (_, ball, *_) = bouncing()
    stranger = xp.PhysicalObject()
    for ask in (
        lambda: engine.queries.distance(ball, stranger),
        lambda: engine.queries.closest_point(stranger, (0, 0, 0)),
        lambda: engine.queries.nearest((0, 0, 0), exclude=[stranger]),
        lambda: engine.queries.overlaps(objects=[stranger]),
    ):
        with pytest.raises(OwnershipError):
            ask()
    with pytest.raises(UnknownLawError):
        engine.queries.nearest((0, 0, 0), laws=["wind"])
    with pytest.raises(InvalidValueError):
        engine.queries.distance(engine.law("g"), ball)  # type: ignore[arg-type]


def test_a_handler_may_ask_and_another_thread_sees_a_whole_scene() -> None:
    seen: list[Any] = []

    class Look(xp.PhysicalLaw):
        """Asks when a ball touches the floor."""

        condition = xp.when.Elapsed(0.25, every=True)

        def enforce_this_law(self, event: Any) -> None:
            """Ask."""
            seen.append(self.engine.queries.nearest((0, 0, 0)))  # type: ignore[union-attr, attr-defined]

    engine, (_, ball, *_) = bouncing()
    engine.add_law(Look())
    engine.run(until=0.6)
    assert len(seen) == 2 and all(one is not None for one in seen)
    found: list[Any] = []
    engine.start()
    try:
        thread = threading.Thread(target=lambda: found.append(engine.queries.closest_point(ball, (0, 0, 9))))
        thread.start()
        thread.join(timeout=20)
        here = engine.queries.ray_cast((0, 0, 50), (0, 0, -1))
    finally:
        engine.terminate()
    assert found and found[0].object is ball and here is not None


def test_kinds_that_are_taken_one_by_one_are_found_among_the_others() -> None:
    engine, objects = crowd(9, 120, 4.0, ["hull", "compound", "mesh", "sphere"])
    for point in np.random.default_rng(2).uniform(-4, 4, (20, 3)).tolist():
        found = engine.queries.nearest(point)
        wanted = min((engine.queries.closest_point(obj, point) for obj in objects), key=lambda one: one.distance)
        assert found == wanted
    assert SHAPES["mesh"] in [obj.shape for obj in objects]
