"""Scenes of balls and walls, written once for the engine and for the oracle, and the ways in which the engine can carry them."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from tests.physics.impact_oracle import Ball, Wall

import xpheve as xp
from xpheve.errors import XpheveError

Vec = Sequence[float]
Turn = tuple[float, float, float, float]


def ways() -> list[dict[str, Any]]:
    """Options of the engine: pair by pair in Python, and by the compiled stepper of impacts where there is one."""
    found: list[dict[str, Any]] = [{"stepper": "core:ballistic"}]
    try:
        xp.PhysicsEngine(stepper="collision:impact")
    except XpheveError:
        return found
    return [*found, {"stepper": "collision:impact"}]


WAYS = ways()
by_all_ways = pytest.mark.parametrize("way", WAYS, ids=[way["stepper"] for way in WAYS])


@dataclass
class Scene:
    """Balls among walls under one law of impact."""

    balls: list[Ball]
    walls: list[Wall] = field(default_factory=list)
    restitution: float = 1.0
    resting: str = "error"

    def engine(self, order: Sequence[int] | None = None, **options: Any) -> tuple[Any, list[Any]]:
        """Return an engine with the scene, and its balls in the order of ``balls``; ``order`` is that of adding, walls after balls."""
        engine = xp.PhysicsEngine(**{"up": "z", **options})
        bounce = engine.add_law("collision:elastic", restitution=self.restitution, resting=self.resting)
        made = [ball_of(ball) for ball in self.balls] + [wall_of(wall) for wall in self.walls]
        sequence = range(len(made)) if order is None else order
        engine.add_objects([made[k] for k in sequence], laws=[bounce])
        for body, ball in zip(made, self.balls, strict=False):
            if any(ball.force):
                body.add_force(ball.force)
        return engine, made[: len(self.balls)]


def ball_of(ball: Ball) -> Any:
    shape = xp.Sphere(ball.radius) if ball.radius else None
    return xp.PhysicalObject(shape, mass=ball.mass, position=ball.position, velocity=ball.velocity)


def wall_of(wall: Wall) -> Any:
    if wall.kind == "plane":
        return xp.PhysicalObject(xp.Plane(wall.size[:3], wall.size[3]), fixed=True)
    shape = {"box": lambda s: xp.Box(s), "capsule": lambda s: xp.Capsule(*s), "sphere": lambda s: xp.Sphere(*s)}
    return xp.PhysicalObject(
        shape[wall.kind](wall.size), position=wall.position, orientation=wall.orientation, fixed=True
    )


class Hear(xp.PhysicalLaw):
    """Write down every impact: (time, label, label)."""

    def __init__(self, heard: list[tuple[float, Any]], **given: Any) -> None:
        super().__init__(**given)
        self.heard = heard

    def enforce_this_law(self, event: Any) -> None:
        self.heard.extend((event.time, contact) for contact in event.contacts)


def listen(engine: Any) -> list[tuple[float, Any]]:
    """A list that fills with (time, contact) of all impacts in ``engine``."""
    heard: list[tuple[float, Any]] = []
    law = engine.add_law(Hear(heard), container=xp.LawContainer(xp.when.Impact()))
    for obj in engine.objects:
        engine.map(obj, law)
    return heard


def states(bodies: Sequence[Any]) -> tuple[Any, Any]:
    """Positions and velocities, each (bodies, 3)."""
    return np.array([body.position for body in bodies]), np.array([body.velocity for body in bodies])


def turn_of(chance: random.Random) -> Turn:
    """A random unit quaternion."""
    q = [chance.gauss(0.0, 1.0) for _ in range(4)]
    size = math.hypot(*q)
    return (q[0] / size, q[1] / size, q[2] / size, q[3] / size)


def vector_of(chance: random.Random, size: float = 1.0) -> tuple[float, float, float]:
    return (chance.uniform(-size, size), chance.uniform(-size, size), chance.uniform(-size, size))


def distance_to(wall: Wall, point: Vec) -> float:
    """From a point to the surface of a wall [m], in floats; negative inside."""
    if wall.kind == "plane":
        size = math.hypot(*wall.size[:3])
        return math.fsum(n * x for n, x in zip(wall.size[:3], point, strict=True)) / size - wall.size[3]
    w, x, y, z = wall.orientation
    rows = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
            [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
            [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    local = rows @ np.subtract(point, wall.position)
    core = {"box": [c / 2 for c in wall.size], "capsule": [0.0, 0.0, wall.size[-1] / 2]}.get(wall.kind, [0.0] * 3)
    round_by = 0.0 if wall.kind == "box" else wall.size[0]
    return float(np.linalg.norm(local - np.clip(local, np.negative(core), core))) - round_by


def cluttered(seed: int, balls: int = 4, walls: int = 3, pulled: bool = True) -> Scene:
    """A random scene in a room of six planes of 2 m: unequal balls, tilted boxes, capsules and spheres.

    Balls are pulled in different directions, each its own, if ``pulled``.
    """
    chance = random.Random(seed)
    room = [
        Wall("plane", (*(side * (k == axis) + 0.0 for k in range(3)), -1.0)) for axis in range(3) for side in (1, -1)
    ]
    furniture = []
    for _ in range(walls):
        kind = chance.choice(["box", "capsule", "sphere"])
        size: Vec
        if kind == "box":
            size = [chance.uniform(0.05, 0.8) for _ in range(3)]
        elif kind == "capsule":
            size = (chance.uniform(0.05, 0.2), chance.uniform(0.1, 0.8))
        else:
            size = (chance.uniform(0.05, 0.3),)
        furniture.append(Wall(kind, tuple(size), vector_of(chance), turn_of(chance)))
    found: list[Ball] = []
    while len(found) < balls:
        radius = chance.choice([0.0, chance.uniform(0.02, 0.2), chance.uniform(0.02, 0.2)])
        place = vector_of(chance, 0.95 - radius)
        mass = 10.0 ** chance.uniform(-1.0, 1.0)
        free = all(distance_to(wall, place) > radius + 0.01 for wall in room + furniture) and all(
            math.dist(place, other.position) > radius + other.radius + 0.01 for other in found
        )
        # Two points never meet: a graze of width 0.
        if free and (radius > 0.0 or all(other.radius > 0.0 for other in found)):
            force = tuple(mass * c for c in vector_of(chance, 3.0)) if pulled else (0.0, 0.0, 0.0)
            found.append(Ball(radius, mass, place, vector_of(chance, 2.0), force))
    return Scene(found, room + furniture, chance.choice([1.0, 1.0, 0.8, 0.5]))


def crowd(seed: int, balls: int = 40, restitution: float = 1.0, pulled: bool = False) -> Scene:
    """Many unequal balls in a room of 2 m with a tilted box, a capsule and a sphere in it: the compiled stepper's own kind of scene."""
    scene = cluttered(seed, balls=0, walls=0)
    chance = random.Random(seed)
    walls = [
        *scene.walls,
        Wall("box", (0.4, 0.3, 0.5), (0.3, 0.2, -0.4), turn_of(chance)),
        Wall("capsule", (0.15, 0.6), (-0.4, 0.3, 0.2), turn_of(chance)),
        Wall("sphere", (0.25,), (0.1, -0.5, 0.4)),
    ]
    found: list[Ball] = []
    while len(found) < balls:
        radius = chance.uniform(0.04, 0.1)
        place = vector_of(chance, 0.95 - radius)
        if all(distance_to(wall, place) > radius + 0.01 for wall in walls) and all(
            math.dist(place, other.position) > radius + other.radius + 0.01 for other in found
        ):
            mass = chance.uniform(0.5, 2.0)
            force = (0.0, 0.0, -mass * 2.0) if pulled else (0.0, 0.0, 0.0)
            found.append(Ball(radius, mass, place, vector_of(chance), force))
    return Scene(found, walls, restitution)
