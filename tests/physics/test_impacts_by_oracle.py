"""Random small scenes, impact by impact, against the same in 40 digits."""

from __future__ import annotations

import contextlib
import math
from typing import Any

import numpy as np
import pytest
from tests.physics.impact_oracle import Ball, CollapseError, Outcome, Wall, backwards, growth, outcome
from tests.physics.impact_scenes import Scene, by_all_ways, cluttered, listen, states

ULP = 2.0**-52
# Each number of a flight is rounded a few times before and after each impact; `growth` says what becomes of such a deviation. It is
# measured in one direction, of many: 10 and more times the least that there can be.
ROUNDINGS = 30.0
LEAST = 1.0  # of the growths: what is rounded last has grown by nobody


def compare(scene: Scene, until: float, way: dict[str, Any], told: bool = True) -> Outcome:
    """The engine against the oracle: which pairs meet, when, and what is left at the end."""
    expected = outcome(scene.balls, scene.walls, until, scene.restitution)
    grown = [max(LEAST, g) for g in growth(scene.balls, scene.walls, until, scene.restitution, expected)]
    engine, bodies = scene.engine(**way)
    objects = list(engine.objects)
    heard = listen(engine) if told else []
    engine.run(until=until)
    assert engine.explain().data["contacts"]["impacts"] == len(expected.impacts)
    for (time, contact), (exact, i, j) in zip(heard, expected.impacts, strict=told):
        assert {contact.body_a, contact.body_b} == {objects[i], objects[j]}
        assert abs(float(exact - time)) < ROUNDINGS * ULP * grown[0]
    positions, velocities = states(bodies)
    near = [ROUNDINGS * ULP * g for g in grown]
    assert deviation(expected.positions, positions) < near[1]
    assert deviation(expected.velocities, velocities) < near[2]
    if max(grown) < 100.0:
        assert max(near) < 1e-12
    return expected


def deviation(exact: Any, found: Any) -> float:
    """The greatest, formed in 40 digits."""
    return max(
        float(abs(a - float(b))) for one, two in zip(exact, found, strict=True) for a, b in zip(one, two, strict=True)
    )


@by_all_ways
@pytest.mark.parametrize("seed", range(4))
def test_balls_among_planes_boxes_and_capsules_fly_as_in_40_digits(seed: int, way: dict[str, Any]) -> None:
    compare(cluttered(seed), 0.8, way, told=way["stepper"] != "collision:impact")  # that tells listeners of nothing yet


@by_all_ways
def test_so_they_do_where_nobody_listens_and_nothing_pulls(way: dict[str, Any]) -> None:
    for seed in (11, 12):
        compare(cluttered(seed, pulled=False), 0.8, way, told=False)


@pytest.mark.stress
@by_all_ways
@pytest.mark.parametrize("first", range(0, 200, 20))
def test_many_scenes_fly_as_in_40_digits(first: int, way: dict[str, Any]) -> None:
    for seed in range(first, first + 20):
        with contextlib.suppress(CollapseError):
            compare(
                cluttered(100 + seed, balls=2 + seed % 5, walls=seed % 7, pulled=seed % 3 > 0),
                1.0,
                way,
                told=seed % 2 > 0 and way["stepper"] != "collision:impact",
            )


@by_all_ways
@pytest.mark.parametrize("count", [1, 40])
def test_many_far_copies_of_a_scene_all_fly_as_the_first(count: int, way: dict[str, Any]) -> None:
    """Copies far apart, as many as the compiled stepper asks for: each is the same scene, moved by a power of two."""
    scene = cluttered(3, balls=3, walls=2)
    expected = outcome(scene.balls, scene.walls, 0.5, scene.restitution)
    apart = 16.0
    balls, walls = [], []
    for k in range(count):
        shift = (apart * k, 0.0, 0.0)
        balls += [moved(ball, shift) for ball in scene.balls]
        walls += [moved(wall, shift) for wall in scene.walls if wall.kind != "plane"]
    # The walls of the room along x would close other rooms.
    rooms = [wall for wall in scene.walls if wall.kind == "plane" and wall.size[0] == 0.0]
    open_room = outcome(
        scene.balls, [w for w in scene.walls if w.kind != "plane" or w.size[0] == 0.0], 0.5, scene.restitution
    )
    engine, bodies = Scene(balls, [*rooms, *walls], scene.restitution).engine(**way)
    engine.run(until=0.5)
    assert engine.explain().data["contacts"]["impacts"] == count * len(open_room.impacts) and expected
    positions, velocities = states(bodies)
    each = len(scene.balls)
    for k in range(count):
        here = slice(each * k, each * (k + 1))
        # Places of up to 640 m are rounded to 1e-13.
        assert deviation(open_room.positions, positions[here] - [apart * k, 0, 0]) < 2e-14 * (1.0 + apart * k)
        assert deviation(open_room.velocities, velocities[here]) < 2e-14 * (1.0 + apart * k)


def moved(one: Any, shift: Any) -> Any:
    kind = Ball if isinstance(one, Ball) else Wall
    given = dict(one.__dict__)
    given["position"] = tuple(a + b for a, b in zip(one.position, shift, strict=True))
    return kind(**given)


@by_all_ways
def test_a_scene_run_backwards_comes_back(way: dict[str, Any]) -> None:
    """From where 40 digits say that it ends, velocities reversed; forces are the same then, and so is the way."""
    scene = cluttered(21, balls=3)
    scene.restitution = 1.0
    there = outcome(scene.balls, scene.walls, 0.7)
    assert len(there.impacts) >= 3
    grown = max(growth(scene.balls, scene.walls, 0.7, 1.0, there)[1:])
    engine, bodies = Scene(backwards(scene.balls, there), scene.walls).engine(**way)
    engine.run(until=0.7)
    positions, velocities = states(bodies)
    # What 40 digits rounded to floats is off by an ulp, too; an inverse grows as the map that it inverts.
    near = ROUNDINGS * ULP * max(1.0, grown)
    assert positions == pytest.approx(np.array([b.position for b in scene.balls]), abs=near)
    assert -velocities == pytest.approx(np.array([b.velocity for b in scene.balls]), abs=near)


def test_the_oracle_itself_keeps_energy_and_knows_closed_forms() -> None:
    ball = Ball(0.1, 2.0, (0.0, 0.0, 1.1), (0.3, 0.0, 0.0), (0.0, 0.0, -20.0))
    floor = Wall("plane", (0.0, 0.0, 2.0, 0.0))
    found = outcome([ball], [floor], 1.25, 0.5)
    first = math.sqrt(0.2)
    exact = [first, 2 * first, 2.5 * first, 2.75 * first]
    assert [float(time) for time, _, _ in found.impacts[:4]] == pytest.approx(exact, rel=1e-15)
    scene = cluttered(5)
    end = outcome(scene.balls, scene.walls, 0.8)
    before, after = (
        sum(0.5 * ball.mass * sum(float(c) ** 2 for c in v) - sum(f * float(c) for f, c in zip(ball.force, x, strict=True))
            for ball, x, v in zip(scene.balls, places, speeds, strict=True))
        for places, speeds in (
            ([b.position for b in scene.balls], [b.velocity for b in scene.balls]), (end.positions, end.velocities),
        )
    )  # fmt: skip
    assert len(end.impacts) > 5 and after == pytest.approx(before, rel=1e-14)
