"""What nature does not tell apart the engine does not either: order, place, direction, motion, units, and who looks."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from tests.physics.impact_oracle import Ball, Wall
from tests.physics.impact_scenes import Scene, by_all_ways, cluttered, crowd, states, turn_of, vector_of

import xpheve as xp

ULP = 2.0**-52
ROUNDINGS = 60.0  # of each number, one impact after the other, and of what a scene is changed by
seeds = st.integers(0, 10**6)
quick = settings(deadline=None, max_examples=3)

# A few balls among boxes and capsules, all pulled; many in a crowd. For each how long it is looked at [s].
MAKERS: list[tuple[Callable[[int], Scene], float]] = [(cluttered, 0.8), (crowd, 0.6)]
small_and_large = pytest.mark.parametrize("made", MAKERS, ids=["few", "many"])


def outcome(scene: Scene, until: float, way: dict[str, Any], order: Any = None) -> tuple[Any, Any, int]:
    """Positions, velocities, how many impacts."""
    engine, bodies = scene.engine(order, **way)
    engine.run(until=until)
    return *states(bodies), engine.explain().data["contacts"]["impacts"]


def same_bits(one: Any, other: Any) -> bool:
    """Whether two outcomes are the same; 0 and -0 are."""
    return one[2] == other[2] and all(
        (a + 0.0).tobytes() == (b + 0.0).tobytes() for a, b in zip(one[:2], other[:2], strict=True)
    )


def grown(scene: Scene, until: float, way: dict[str, Any], plain: Any, seed: int) -> float:
    """What a deviation of 1 of the start becomes, found with one of 2^-34; infinite where other pairs meet then."""
    chance, off = random.Random(seed), 2.0**-34
    moved = []
    for ball in scene.balls:
        place, speed = ([c + off * chance.choice([-1, 1]) for c in v] for v in (ball.position, ball.velocity))
        moved.append(replace(ball, position=tuple(place), velocity=tuple(speed)))
    other = outcome(replace(scene, balls=moved), until, way)
    if other[2] != plain[2]:
        return math.inf
    return max(1.0, *(float(np.abs(a - b).max()) / off for a, b in zip(plain[:2], other[:2], strict=True)))


def turned(scene: Scene, rows: Any, shift: Any, boost: Any) -> Scene:
    """All of it turned by a proper rotation matrix, then shifted, then in motion; walls are in no motion."""
    assert not any(boost) or not scene.walls
    quaternion = quaternion_of(rows)

    def turn(v: Any) -> tuple[float, ...]:
        return tuple(float(c) for c in rows @ np.asarray(v))

    def put(x: Any) -> tuple[float, ...]:
        return tuple(float(c) for c in rows @ np.asarray(x) + shift)

    balls = [
        replace(
            b, position=put(b.position), velocity=tuple(np.add(turn(b.velocity), boost).tolist()), force=turn(b.force)
        )
        for b in scene.balls
    ]
    walls = []
    for wall in scene.walls:
        if wall.kind == "plane":
            normal = turn(wall.size[:3])
            walls.append(replace(wall, size=(*normal, wall.size[3] + float(np.dot(normal, shift)))))
        else:
            walls.append(replace(wall, position=put(wall.position), orientation=times(quaternion, wall.orientation)))
    return replace(scene, balls=balls, walls=walls)


def times(p: Any, q: Any) -> tuple[float, float, float, float]:
    a, b, c, d = p
    w, x, y, z = q
    return (
        a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y, a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w,
    )  # fmt: skip


def matrix_of(q: Any) -> Any:
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_of(rows: Any) -> Any:
    """Of a rotation matrix of which 1 + trace is not near 0, or of one that is an exact half turn about z."""
    w = 0.5 * math.sqrt(max(0.0, 1.0 + np.trace(rows)))
    if w < 0.05:
        assert rows[2, 2] == 1.0
        return (0.0, 0.0, 0.0, 1.0)
    return (
        w,
        (rows[2, 1] - rows[1, 2]) / (4 * w),
        (rows[0, 2] - rows[2, 0]) / (4 * w),
        (rows[1, 0] - rows[0, 1]) / (4 * w),
    )


def scaled(scene: Scene, length: float = 1.0, mass: float = 1.0, time: float = 1.0) -> Scene:
    """The same in other units; exact for powers of two."""

    def of(v: Any, factor: float) -> tuple[float, ...]:
        return tuple(factor * c for c in v)

    balls = [
        Ball(
            length * b.radius, mass * b.mass, of(b.position, length), of(b.velocity, length / time),
            of(b.force, mass * length / time / time),
        )
        for b in scene.balls
    ]  # fmt: skip
    walls = []
    for wall in scene.walls:
        size = (*wall.size[:3], length * wall.size[3]) if wall.kind == "plane" else of(wall.size, length)
        walls.append(Wall(wall.kind, size, of(wall.position, length), wall.orientation))
    return replace(scene, balls=balls, walls=walls)


# Order


@by_all_ways
@small_and_large
@quick
@given(seed=seeds)
def test_the_order_in_which_objects_are_added_changes_no_bit(made: Any, way: dict[str, Any], seed: int) -> None:
    maker, until = made
    scene = maker(seed)
    order = list(range(len(scene.balls) + len(scene.walls)))
    random.Random(seed).shuffle(order)
    assert same_bits(outcome(scene, until, way), outcome(scene, until, way, order))


# Place and direction


@by_all_ways
@small_and_large
@quick
@given(seed=seeds, size=st.sampled_from([0.0, 1.0, 100.0]))
def test_a_scene_that_is_turned_and_moved_goes_alike(made: Any, way: dict[str, Any], seed: int, size: float) -> None:
    maker, until = made
    scene = maker(seed)
    chance = random.Random(seed)
    q = turn_of(chance)
    rows, shift = matrix_of(q), np.array(vector_of(chance, size))
    if abs(q[0]) < 0.05:
        return
    plain = outcome(scene, until, way)
    found = outcome(turned(scene, rows, shift, (0.0, 0.0, 0.0)), until, way)
    near = ROUNDINGS * ULP * grown(scene, until, way, plain, seed) * (2.0 + size)
    if math.isinf(near):
        return
    assert found[2] == plain[2]
    assert (found[0] - shift) @ rows == pytest.approx(plain[0], abs=near)
    assert found[1] @ rows == pytest.approx(plain[1], abs=near)


@by_all_ways
@small_and_large
@quick
@given(seed=seeds, axis=st.integers(0, 2))
def test_a_scene_seen_in_a_mirror_is_its_mirror_image_to_the_bit(
    made: Any, way: dict[str, Any], seed: int, axis: int
) -> None:
    maker, until = made
    scene = maker(seed)
    signs = [-1.0 if k == axis else 1.0 for k in range(3)]

    def mirror(v: Any) -> tuple[float, ...]:
        return tuple(s * c for s, c in zip(signs, v, strict=True))

    balls = [
        replace(b, position=mirror(b.position), velocity=mirror(b.velocity), force=mirror(b.force)) for b in scene.balls
    ]
    walls = []
    for wall in scene.walls:
        if wall.kind == "plane":
            walls.append(replace(wall, size=(*mirror(wall.size[:3]), wall.size[3])))
        else:
            # An axial vector: the mirror keeps its part along the axis, and turns the others round. All shapes here are their own images.
            w, *u = wall.orientation
            orientation = (w, *(-s * c for s, c in zip(signs, u, strict=True)))
            walls.append(replace(wall, position=mirror(wall.position), orientation=orientation))
    plain = outcome(scene, until, way)
    found = outcome(replace(scene, balls=balls, walls=walls), until, way)
    assert same_bits((found[0] * signs, found[1] * signs, found[2]), plain)


# Motion


@by_all_ways
@quick
@given(seed=seeds, speed=st.sampled_from([1.0, 100.0]))
@pytest.mark.parametrize("count", [6, 40])
def test_balls_in_common_motion_meet_as_at_rest(count: int, way: dict[str, Any], seed: int, speed: float) -> None:
    scene = replace(crowd(seed, balls=count), walls=[])
    inwards = [
        replace(b, velocity=tuple(v - 2.0 * x for v, x in zip(b.velocity, b.position, strict=True)))
        for b in scene.balls
    ]
    scene = replace(scene, balls=inwards)
    boost, until = np.array(vector_of(random.Random(seed), speed)), 0.4
    plain = outcome(scene, until, way)
    found = outcome(turned(scene, np.eye(3), np.zeros(3), boost), until, way)
    near = ROUNDINGS * ULP * grown(scene, until, way, plain, seed) * (2.0 + speed)
    if math.isinf(near):
        return
    assert found[2] == plain[2]
    assert found[0] - until * boost == pytest.approx(plain[0], abs=near)
    assert found[1] - boost == pytest.approx(plain[1], abs=near)


@by_all_ways
@small_and_large
@quick
@given(seed=seeds)
def test_at_restitution_1_all_goes_back_where_it_came_from(made: Any, way: dict[str, Any], seed: int) -> None:
    maker, until = made
    scene = replace(maker(seed), restitution=1.0)
    until *= 0.6
    engine, bodies = scene.engine(**way)
    start = states(bodies)
    engine.run(until=until)
    there = (*states(bodies), engine.explain().data["contacts"]["impacts"])
    for body in bodies:
        body.velocity = tuple(-c for c in body.velocity)
    engine.run(until=2.0 * until)
    assert engine.explain().data["contacts"]["impacts"] == 2 * there[2]
    near = ROUNDINGS * ULP * 4.0 * grown(scene, until, way, there, seed)
    if math.isinf(near):
        return
    back = states(bodies)
    assert back[0] == pytest.approx(start[0], abs=near)
    assert -back[1] == pytest.approx(start[1], abs=near)


# Units


@by_all_ways
@small_and_large
@quick
@given(seed=seeds, power=st.integers(-20, 20))
@example(seed=1, power=20)
@example(seed=1, power=-20)
def test_lengths_of_micrometres_or_megametres_are_the_same_to_the_bit(
    made: Any, way: dict[str, Any], seed: int, power: int
) -> None:
    maker, until = made
    scene, unit = maker(seed), 2.0**power
    found = outcome(scaled(scene, length=unit), until, way)
    assert same_bits((found[0] / unit, found[1] / unit, found[2]), outcome(scene, until, way))


@by_all_ways
@small_and_large
@quick
@given(seed=seeds, power=st.integers(-30, 30))
def test_masses_in_other_units_are_the_same_to_the_bit(made: Any, way: dict[str, Any], seed: int, power: int) -> None:
    maker, until = made
    scene = maker(seed)
    assert same_bits(outcome(scaled(scene, mass=2.0**power), until, way), outcome(scene, until, way))


@by_all_ways
@small_and_large
@quick
@given(seed=seeds, power=st.integers(-12, 20))
def test_a_scene_in_slow_or_quick_motion_is_the_same_to_the_bit(
    made: Any, way: dict[str, Any], seed: int, power: int
) -> None:
    maker, until = made
    scene, unit = maker(seed), 2.0**power
    found = outcome(scaled(scene, time=unit), until * unit, way)
    assert same_bits((found[0], found[1] * unit, found[2]), outcome(scene, until, way))


# Who looks


@by_all_ways
@small_and_large
@quick
@given(seed=seeds, every=st.floats(0.007, 0.3), cut=st.floats(0.0, 1.0))
def test_looking_stopping_and_asking_change_no_bit(
    made: Any, way: dict[str, Any], seed: int, every: float, cut: float
) -> None:
    maker, until = made
    scene = maker(seed)
    plain = outcome(scene, until, way)
    engine, bodies = scene.engine(**way)
    engine.run(until=cut * until, every=every)
    engine.energy(), engine.momentum(), engine.explain(), [body.position for body in bodies]
    engine.run(until=until, every=every)
    assert same_bits((*states(bodies), engine.explain().data["contacts"]["impacts"]), plain)
    engine, bodies = scene.engine(**way)
    for k in range(1, 11):
        engine.run(until=until * k / 10.0)
    assert same_bits((*states(bodies), engine.explain().data["contacts"]["impacts"]), plain)


@by_all_ways
@small_and_large
@quick
@given(seed=seeds, cut=st.floats(0.0, 1.0), restitution=st.sampled_from([1.0, 0.7]))
def test_copies_and_checkpoints_go_on_as_if_nobody_had_made_them(
    made: Any, way: dict[str, Any], seed: int, cut: float, restitution: float
) -> None:
    maker, until = made
    scene = replace(maker(seed), restitution=restitution)
    plain = outcome(scene, until, way)
    engine, bodies = scene.engine(**way)
    count = len(bodies)
    engine.run(until=cut * until)
    twin = engine.copy()
    again = xp.PhysicsEngine.restore(engine.checkpoint())
    for one in (engine, twin, again):
        one.run(until=until)
        found = (*states(one.objects[:count]), plain[2])
        assert same_bits(found, plain)
