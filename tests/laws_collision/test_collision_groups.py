"""Collision groups: objects of one law that are not to meet."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import xpheve as xp
from xpheve.errors import ParameterError


def rows(
    count: int, first: dict[str, float], second: dict[str, float]
) -> tuple[xp.PhysicsEngine, list[Any], list[Any]]:
    """Return an engine in which ``count`` balls each run into a ball at rest."""
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic")
    ones = [xp.PhysicalObject(xp.Sphere(0.1), position=(0, y, 0), velocity=(1, 0, 0), **first) for y in range(count)]
    twos = [xp.PhysicalObject(xp.Sphere(0.1), position=(1, y, 0), **second) for y in range(count)]
    engine.add_objects([*ones, *twos], laws=[bounce])
    return engine, ones, twos


@pytest.mark.parametrize("count", [2, 60])  # pair by pair, and by sweeps
@pytest.mark.parametrize(
    ("first", "second", "meet"),
    [
        ({}, {}, True),
        ({"group": 2}, {}, True),
        ({"group": 2, "mask": 2}, {}, False),
        ({"group": 2, "mask": 2}, {"group": 2}, True),
        ({"mask": 0}, {}, False),
        ({"group": 0}, {}, False),
        ({}, {"mask": 6}, False),
        ({"group": 4}, {"mask": 6}, True),
        ({"group": 2**31}, {"mask": 2**31}, True),
    ],
)
def test_two_meet_if_each_ones_mask_has_the_others_group(
    count: int, first: dict[str, float], second: dict[str, float], meet: bool
) -> None:
    engine, ones, twos = rows(count, first, second)
    engine.run(until=2.0)
    assert all(one.velocity == ((0, 0, 0) if meet else (1, 0, 0)) for one in ones)
    assert all(two.velocity == ((1, 0, 0) if meet else (0, 0, 0)) for two in twos)


@pytest.mark.parametrize("count", [2, 60])
def test_changed_under_way_they_hold_from_then_on(count: int) -> None:
    engine, ones, _ = rows(count, {}, {})
    engine.run(until=0.5)
    ones[0]["mask"] = 2
    engine.run(until=2.0)
    assert ones[0].velocity == (1, 0, 0) and ones[1].velocity == (0, 0, 0)


def test_a_floor_that_is_of_no_group_any_more_carries_nobody() -> None:
    engine = xp.PhysicsEngine(up="z")
    gravity, bounce = engine.add_law("basic:planet_gravity", acceleration=10.0), engine.add_law("collision:elastic")
    floor = engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(0, 0, 0.1)), laws=[gravity, bounce])
    engine.run(until=1.0)
    assert ball.velocity == (0, 0, 0)
    floor["group"] = 2
    engine.run(until=1.5)
    assert ball.velocity[2] == 0.0  # group 2 is in its mask
    floor["mask"] = 2
    engine.run(until=2.0)
    assert ball.velocity[2] == pytest.approx(-5.0, abs=1e-13)


def test_nobody_hears_of_those_that_do_not_meet() -> None:
    heard = []

    class Ear(xp.PhysicalLaw):
        def enforce_this_law(self, event: xp.Event) -> None:
            heard.append(event)

    for mask in (2, 1):
        engine, ones, twos = rows(1, {"mask": mask}, {})
        ear = engine.add_law(Ear(), xp.LawContainer(xp.when.ContactBegin()))
        for obj in (*ones, *twos):
            engine.map(obj, ear)
        engine.run(until=2.0)
        assert len(heard) == (0 if mask == 2 else 1)


@pytest.mark.parametrize("container", ["collision:bounding_box", "collision:picking"])
def test_polled_containers_keep_to_them(container: str) -> None:
    for mask, meet in ((2, False), (1, True)):
        engine = xp.PhysicsEngine()
        stop = engine.add_law("collision:stop", container=container)
        ball = xp.PhysicalObject(xp.Sphere(0.5), velocity=(3, 0, 0), mask=mask)
        engine.add_objects([ball, xp.PhysicalObject(xp.Sphere(0.5), position=(2, 0, 0))], laws=[stop])
        engine.run(until=2.0, dt=0.01)
        assert (ball.velocity == (0, 0, 0)) == meet


def test_removed_objects_leave_no_group_behind() -> None:
    engine, ones, _ = rows(60, {}, {})
    ones[0]["mask"] = 2
    engine.run(until=0.1)
    engine.remove_object(ones[0])
    extra = xp.PhysicalObject(xp.Sphere(0.1), position=(0.1, 0, 0), velocity=(1, 0, 0))
    engine.add_object(extra, laws=list(engine.laws))
    engine.run(until=2.0)
    assert extra.velocity == (0, 0, 0) and all(one.velocity == (0, 0, 0) for one in ones[1:])


def test_files_and_checkpoints_keep_them(tmp_path: Path) -> None:
    engine, _, _ = rows(1, {"mask": 2}, {"group": 5})
    engine.save_scene(tmp_path / "s.toml")
    for other in (xp.PhysicsEngine.load_scene(tmp_path / "s.toml"), xp.PhysicsEngine.restore(engine.checkpoint())):
        other.run(until=2.0)
        assert sorted(obj.velocity for obj in other.objects) == [(0, 0, 0), (1, 0, 0)]


@pytest.mark.parametrize("bad", [-1, 0.5, 2**32])
def test_what_is_no_set_of_groups_is_refused(bad: float) -> None:
    engine, ones, _ = rows(1, {}, {})
    for name in ("group", "mask"):
        with pytest.raises(ParameterError, match=name):
            ones[0][name] = bad
        with pytest.raises(ParameterError, match=name):
            engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), **{name: bad}), laws=list(engine.laws))


def test_a_value_of_one_pair_among_many_holds_from_then_on() -> None:
    engine, ones, twos = rows(60, {}, {})
    engine.run(until=0.5)
    law: Any = engine.laws[0]
    law.set_pair(ones[3], twos[3], restitution=0.0)
    engine.run(until=2.0)
    assert ones[3].velocity == twos[3].velocity == (0.5, 0, 0)
    assert all(one.velocity == (0, 0, 0) for one in ones if one is not ones[3])
    law.set_pair(ones[3], twos[3], restitution=None)
    engine.run(until=2.5)
    assert twos[0].velocity == (1, 0, 0)
