"""Balls nobody should let loose: one inside another, without size, too heavy, too fast, too far, too many.

Whatever comes, the engine gives an error of its own, or a finite answer, within a time. Each kind of scene is tried with a few balls
and with many: those are carried by compiled code.
"""

from __future__ import annotations

import math
import random
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from tests.physics.impact_scenes import by_all_ways, turn_of

import xpheve as xp
from xpheve.errors import XpheveError

LONGEST = 60.0  # [s] a case may take on a busy machine
FEW, MANY = 5, 60
Made = tuple[list[Any], float]  # objects, and the restitution of all


@contextmanager
def in_time(seconds: float = LONGEST) -> Iterator[None]:
    """Raise TimeoutError in what takes longer."""

    def late(*_: Any) -> None:
        raise TimeoutError(f"not done after {seconds} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def ball(radius: float = 0.1, **given: Any) -> Any:
    return xp.PhysicalObject(xp.Sphere(radius) if radius > 0.0 else None, **given)


def plane(normal: Any, offset: float = 0.0) -> Any:
    return xp.PhysicalObject(xp.Plane(normal, offset), fixed=True)


def floor() -> Any:
    return plane((0, 0, 1))


def vector(chance: random.Random, size: float = 1.0) -> list[float]:
    return [chance.uniform(-size, size) for _ in range(3)]


def survives(
    objects: list[Any], restitution: float, way: dict[str, Any], *, gravity: bool, resting: str, until: float = 1.0
) -> str:
    """The name of the error, or "finite"; anything else fails."""
    try:
        with in_time():
            engine = xp.PhysicsEngine(**{"up": "z", **way})
            laws = [engine.add_law("collision:elastic", restitution=restitution, resting=resting)]
            pull = engine.add_law("basic:planet_gravity") if gravity else None
            engine.add_objects(objects, laws=laws)
            if pull is not None:
                for obj in engine.objects:
                    if not obj.fixed:
                        engine.map(obj, pull)
            engine.run(until=until)
    except XpheveError as wrong:
        assert str(wrong)
        return type(wrong).__name__
    for name in ("position", "velocity", "orientation", "angular_velocity"):
        assert np.isfinite(getattr(engine.bodies, name)).all()
    return "finite"


# Scenes: each takes chance and a count


def overlapping(chance: random.Random, count: int) -> Made:
    """One inside the other, going anywhere."""
    objects = [
        ball(chance.uniform(0.05, 0.3), position=vector(chance, 0.2), velocity=vector(chance)) for _ in range(count)
    ]
    return objects, chance.choice([0.0, 0.5, 1.0])


def overlapping_above_ground(chance: random.Random, count: int) -> Made:
    objects, restitution = overlapping(chance, count)
    return [floor(), *objects], restitution


def one_centre(chance: random.Random, count: int) -> Made:
    """All centres at one place, still or not."""
    speed = chance.choice([0.0, 1.0])
    radius = chance.choice([0.1, 0.0])
    return [ball(radius, velocity=vector(chance, speed)) for _ in range(count)], chance.choice([0.0, 1.0])


def pairs_in_one_place(chance: random.Random, count: int) -> Made:
    """Twins: two and two at one centre, at different speeds."""
    found = []
    for k in range(count // 2 + 1):
        place = (0.5 * k, 0.0, 1.0)
        found += [ball(position=place, velocity=vector(chance)), ball(position=place, velocity=vector(chance))]
    return [floor(), *found], chance.choice([0.0, 0.5, 1.0])


def points(chance: random.Random, count: int) -> Made:
    """Without size: above the ground, on it, at one another."""
    found = [
        ball(
            0.0,
            position=(chance.uniform(-1, 1), chance.uniform(-1, 1), abs(chance.choice([0.0, 1.0]))),
            velocity=vector(chance),
        )
        for _ in range(count)
    ]
    found += [ball(0.0, position=(-1, 0, 3), velocity=(1, 0, 0)), ball(0.0, position=(1, 0, 3), velocity=(-1, 0, 0))]
    box = xp.PhysicalObject(xp.Box((0.5, 0.5, 0.5)), position=(0, 0, 0.5), orientation=turn_of(chance), fixed=True)
    return [floor(), box, *found], chance.choice([0.0, 0.5, 1.0])


def unequal_masses(chance: random.Random, count: int) -> Made:
    found = [
        ball(
            0.1,
            mass=10.0 ** chance.uniform(-6, 6),
            position=(0.25 * k, chance.uniform(-0.05, 0.05), 1.0),
            velocity=vector(chance),
        )
        for k in range(count)
    ]
    return [floor(), *found], chance.choice([0.0, 0.5, 1.0])


def unequal_sizes(chance: random.Random, count: int) -> Made:
    found = []
    for _ in range(count):
        radius = 10.0 ** chance.uniform(-9, 3)
        found.append(ball(radius, position=vector(chance, 3000.0), velocity=vector(chance, 1000.0)))
    return found, chance.choice([0.0, 0.5, 1.0])


def unequal_speeds(chance: random.Random, count: int) -> Made:
    """0 to 1e12 m/s in a room."""
    found = [
        ball(0.05, position=vector(chance, 0.9), velocity=vector(chance, chance.choice([0.0, 1e-12, 1.0, 1e3])))
        for _ in range(count)
    ]
    found.append(ball(0.05, position=(-5, 0, 0), velocity=(1e12, 0, 0)))
    found.append(ball(0.05, position=(-5, 5, 0), velocity=(1e300, 0, 0)))
    return found, chance.choice([0.0, 0.5, 1.0])


def far_away(chance: random.Random, count: int) -> Made:
    """Places at which floats are as far apart as balls are large."""
    far = chance.choice([1e9, 1e14, 1e16, 1e100, 1e300])
    found = [
        ball(1.0, position=(far + 3.0 * k, chance.uniform(-1, 1), 2.0), velocity=vector(chance, 3.0))
        for k in range(count)
    ]
    return [floor(), *found], chance.choice([0.0, 0.5, 1.0])


def hardly_anything(chance: random.Random, count: int) -> Made:
    """Near the least float: radii, masses, speeds."""
    least = chance.choice([5e-324, 1e-310, 1e-200, 1e-160])
    found = [
        ball(
            chance.choice([least, 1e-9]),
            mass=chance.choice([least, 1.0]),
            position=(1e-8 * k, 0, 0),
            velocity=(chance.choice([-least, least, 0.0]), 0, 0),
        )
        for k in range(count)
    ]
    return found, chance.choice([0.0, 1.0])


def too_much(chance: random.Random, count: int) -> Made:
    """Near the greatest float: radii, masses, speeds."""
    most = chance.choice([1e150, 1e160, 1e300, 1.7e308])
    found = [
        ball(
            chance.choice([most, 1.0]),
            mass=chance.choice([most, 1.0]),
            position=(3.0 * k, 0, 0),
            velocity=(chance.choice([-most, most, 0.0]), 0, 0),
        )
        for k in range(count)
    ]
    return found, chance.choice([0.0, 1.0])


def corner(chance: random.Random, count: int) -> Made:
    """Falling into a corner of three slopes, all the way down."""
    slopes = [plane((1, 0, 0.5)), plane((-0.5, 0.9, 0.5)), plane((-0.5, -0.9, 0.5))]
    found = [
        ball(0.05, position=(chance.uniform(-0.3, 0.3), chance.uniform(-0.3, 0.3), 2.0 + 0.2 * k)) for k in range(count)
    ]
    return [*slopes, *found], chance.choice([0.0, 0.3, 0.5, 0.9])


def chain(chance: random.Random, count: int) -> Made:
    """One above the other onto the floor, losing energy."""
    gap = chance.choice([0.0, 1e-13, 1e-6, 0.05])
    found = [ball(0.1, position=(0, 0, 0.5 + k * (0.2 + gap))) for k in range(count)]
    return [floor(), *found], chance.choice([0.0, 0.5])


def lattice(chance: random.Random, count: int) -> Made:
    """All neighbours touch, one comes in."""
    side = math.ceil(count ** (1 / 3))
    still = chance.random() < 0.5
    found = [
        ball(0.1, position=(0.2 * x, 0.2 * y, 1.0 + 0.2 * z), velocity=(0, 0, 0) if still else vector(chance, 0.1))
        for x in range(side) for y in range(side) for z in range(side)
    ]  # fmt: skip
    found.append(ball(0.1, position=(-1, 0.05, 1.02), velocity=(5, 0, 0)))
    return [*found, *([floor()] if chance.random() < 0.5 else [])], chance.choice([0.0, 0.5, 1.0])


def squeezed(chance: random.Random, count: int) -> Made:
    """Between planes that leave no room, or less than none."""
    room = chance.choice([0.2, 0.2 - 1e-13, 0.2 + 1e-13, 0.19, 0.3])
    found = [ball(0.1, position=(0.25 * k, 0, room / 2), velocity=vector(chance)) for k in range(count)]
    return [floor(), plane((0, 0, -1), -room), *found], chance.choice([0.0, 0.5, 1.0])


def buried(chance: random.Random, count: int) -> Made:
    """Inside boxes and capsules, on their middles and edges."""
    walls = [
        xp.PhysicalObject(xp.Box((1, 1, 1)), orientation=turn_of(chance), fixed=True),
        xp.PhysicalObject(xp.Capsule(0.4, 1.0), position=(0.5, 0, 0), orientation=turn_of(chance), fixed=True),
        xp.PhysicalObject(xp.Sphere(0.3), position=(0, 0.5, 0), fixed=True),
    ]
    places = [(0, 0, 0), (0.5, 0, 0), (0, 0.5, 0), (0.5, 0.5, 0.5)]
    found = [
        ball(chance.choice([0.05, 0.0]), position=chance.choice([*places, vector(chance)]), velocity=vector(chance))
        for _ in range(count)
    ]
    return [*walls, *found], chance.choice([0.0, 0.5, 1.0])


def needles(chance: random.Random, count: int) -> Made:
    """Balls on boxes as thin as sheets, long as roads, small as dust."""
    walls = []
    for k in range(3):
        size = [10.0 ** chance.uniform(-6, 3) for _ in range(3)]
        walls.append(
            xp.PhysicalObject(xp.Box(size), position=(0, 0, -float(k)), orientation=turn_of(chance), fixed=True)
        )
        walls.append(
            xp.PhysicalObject(
                xp.Capsule(10.0 ** chance.uniform(-6, 1), 10.0 ** chance.uniform(-6, 3)),
                position=(5, 0, -float(k)),
                fixed=True,
            )
        )
    found = [
        ball(
            10.0 ** chance.uniform(-6, 0),
            position=(chance.uniform(-3, 8), chance.uniform(-3, 3), 5.0),
            velocity=(0, 0, -10),
        )
        for _ in range(count)
    ]
    return [*walls, *found], chance.choice([0.0, 0.5, 1.0])


KINDS: list[Callable[[random.Random, int], Made]] = [
    overlapping, overlapping_above_ground, one_centre, pairs_in_one_place, points, unequal_masses, unequal_sizes, unequal_speeds,
    far_away, hardly_anything, too_much, corner, chain, lattice, squeezed, buried, needles,
]  # fmt: skip


def tried(kind: Callable[[random.Random, int], Made], seed: int, count: int, way: dict[str, Any]) -> str:
    chance = random.Random(seed)
    gravity, resting = chance.random() < 0.5, chance.choice(["error", "hold"])
    try:
        objects, restitution = kind(chance, count)
    except XpheveError as wrong:
        return type(wrong).__name__
    return survives(objects, restitution, way, gravity=gravity, resting=resting)


@by_all_ways
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_what_nobody_should_let_loose_ends_well(kind: Any, way: dict[str, Any]) -> None:
    for seed in (1, 4):
        tried(kind, seed, FEW, way)


@by_all_ways
@pytest.mark.parametrize(
    "speed", [pytest.param(1e6, marks=pytest.mark.stress), 1e12, pytest.param(1e300, marks=pytest.mark.stress)]
)
def test_a_bullet_among_many_that_stand_does_not_hold_up_the_others(speed: float, way: dict[str, Any]) -> None:
    """Windows of time in which pairs are looked for are those of the many."""
    engine = xp.PhysicsEngine(**way)
    law = engine.add_law("collision:elastic")
    still = [ball(0.05, position=(0.3 * (k % 8), 0.3 * (k // 8), 0.0)) for k in range(MANY)]
    going = ball(0.05, position=(-1.0, 0.0, 5.0), velocity=(speed, 0.0, 0.0))
    hit = ball(0.05, position=(3.0, 0.3, 5.0)), ball(0.05, position=(-1.0, 0.3, 5.0), velocity=(4.0, 0.0, 0.0))
    engine.add_objects([*still, going, *hit], laws=[law])
    with in_time():
        engine.run(until=2.0)
    assert engine.explain().data["contacts"]["impacts"] == 1
    assert hit[0].velocity[0] == pytest.approx(4.0) and going.position[0] == pytest.approx(2.0 * speed)


@pytest.mark.stress
@by_all_ways
@pytest.mark.parametrize("count", [1, 2, FEW, 20, MANY])
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_so_it_does_however_many_and_however_often(kind: Any, count: int, way: dict[str, Any]) -> None:
    for seed in range(12):
        tried(kind, seed, count, way)


@pytest.mark.stress
@by_all_ways
@pytest.mark.parametrize("speed", [0.0, 1.0])
@pytest.mark.parametrize("radius", [0.0, 0.1])
@pytest.mark.parametrize("gravity", [False, True])
def test_ten_thousand_at_one_point_are_an_error_or_fly(
    speed: float, radius: float, gravity: bool, way: dict[str, Any]
) -> None:
    chance = random.Random(1)
    objects = [ball(radius, velocity=vector(chance, speed)) for _ in range(10_000)]
    survives(objects, 1.0, way, gravity=gravity, resting="error", until=0.1)
