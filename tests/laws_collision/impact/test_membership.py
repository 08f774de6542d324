"""Whose contacts are left to the loop, and what is said of the others."""

from __future__ import annotations

from typing import Any

import pytest

import xpheve as xp


def scene(other: xp.PhysicalObject | None = None, **options: Any) -> tuple[xp.PhysicsEngine, xp.ResponseLaw]:
    """Two balls on a floor, and another object under the same law."""
    engine = xp.PhysicsEngine(up="z", **options)
    bounce = engine.add_law("collision:elastic")
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce])
    balls = [xp.PhysicalObject(xp.Sphere(0.1), position=(x, 0, 1), velocity=(0, 0, -1)) for x in (0, 1)]
    engine.add_objects(balls, laws=[bounce])
    if other is not None:
        engine.add_object(other, laws=[bounce])
    return engine, bounce  # type: ignore[return-value]


def told(engine: xp.PhysicsEngine) -> tuple[int, str]:
    """How many fly, and why the others do not."""
    engine.run(until=0.1)
    found = engine.explain().data["contacts"]["impact loop"]
    return found["moving"], " ".join(found["not there"].values())


def at(**given: Any) -> dict[str, Any]:
    return {"position": (5.0, 0.0, 3.0), **given}


@pytest.mark.parametrize(
    "other",
    [
        None,
        lambda: xp.PhysicalObject(**at()),
        lambda: xp.PhysicalObject(xp.Box((1, 1, 1)), **at(fixed=True)),
        lambda: xp.PhysicalObject(xp.Capsule(0.1, 1.0), **at(fixed=True)),
        lambda: xp.PhysicalObject(xp.Sphere(0.5), **at(fixed=True)),
    ],
    ids=["none", "point", "fixed box", "fixed capsule", "fixed ball"],
)
def test_balls_and_points_among_fixed_shapes_fly(other: Any) -> None:
    third = None if other is None else other()
    engine, _ = scene(third)
    assert told(engine) == (2 if third is None or third.fixed else 3, "")


@pytest.mark.parametrize(
    ("other", "why"),
    [
        (lambda: xp.PhysicalObject(xp.Box((1, 1, 1)), **at()), "is a box that moves"),
        (lambda: xp.PhysicalObject(xp.Sphere(0.1), inertia=(1, 1, 2), **at()), "has moments of inertia that differ"),
        (lambda: xp.PhysicalObject(xp.Sphere(0.1), group=2, **at()), "is in a collision group of its own"),
    ],
    ids=["box", "inertia", "group"],
)
def test_one_of_another_kind_keeps_all_under_its_law_out(other: Any, why: str) -> None:
    third = other()
    engine, _ = scene(third)
    moving, reason = told(engine)
    assert moving == 0 and f"{third.label} {why}" in reason


def test_sets_of_objects_that_never_meet_are_asked_one_by_one() -> None:
    engine, _ = scene()
    alone = engine.add_law("collision:elastic")
    engine.add_objects([xp.PhysicalObject(xp.Box((1, 1, 1)), position=(x, 9, 9)) for x in (0, 3)], laws=[alone])
    moving, reason = told(engine)
    assert moving == 2 and "is a box that moves" in reason


def test_a_law_evaluated_along_the_way_keeps_out() -> None:
    engine, bounce = scene()
    drag = engine.add_law("basic:linear_drag", coefficient=0.1)
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(5, 0, 3)), laws=[bounce, drag])
    moving, reason = told(engine)
    assert moving == 0 and "under laws that are evaluated along its way" in reason


def test_values_of_single_pairs_and_a_wish_keep_out() -> None:
    engine, bounce = scene()
    bounce.set_pair(engine.objects[0], engine.objects[1], restitution=0.5)
    assert told(engine)[0] == 0 and "has values for single pairs" in told(engine)[1]
    engine, _ = scene(stepper="core:ballistic")
    assert told(engine) == (0, "core:ballistic was asked for")


def test_what_changes_in_the_course_of_a_run_is_decided_anew() -> None:
    engine, bounce = scene()
    assert told(engine) == (2, "")
    box = engine.add_object(xp.PhysicalObject(xp.Box((1, 1, 1)), position=(5, 0, 3)), laws=[bounce])
    engine.run(until=0.2)
    assert engine.explain().data["contacts"]["impact loop"]["moving"] == 0
    engine.remove_object(box)
    engine.run(until=0.3)
    assert engine.explain().data["contacts"]["impact loop"]["moving"] == 2


def test_where_nothing_moves_nothing_flies() -> None:
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic")
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce])
    assert told(engine) == (0, "nothing moves")
