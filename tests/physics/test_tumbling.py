"""Tumbling boxes and capsules in a room: energy, momentum, and the way back."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from tests.physics.test_bullets import Hear

import xpheve as xp

SHAPES = {"box": xp.Box((1.0, 0.6, 0.4)), "capsule": xp.Capsule(0.2, 0.9)}
G = 10.0


def room(shape: Any, seed: int, gravity: bool = True) -> tuple[xp.PhysicsEngine, xp.PhysicalObject, Hear]:
    """A body thrown about between six planes."""
    rng = np.random.default_rng(seed)
    engine = xp.PhysicsEngine(up="z")
    bounce, hear = engine.add_law("collision:elastic"), engine.add_law(Hear())
    laws = [bounce, hear]
    for normal in [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]:
        engine.add_object(xp.PhysicalObject(xp.Plane(normal, -2.0), fixed=True), laws=laws)
    q = rng.normal(size=4)
    body = xp.PhysicalObject(
        shape,
        mass=1.3,
        position=(0.1, 0.2, 0.3),
        velocity=tuple((3.0 * rng.normal(size=3)).tolist()),
        angular_velocity=tuple((4.0 * rng.normal(size=3)).tolist()),
        orientation=tuple((q / np.linalg.norm(q)).tolist()),
    )
    if gravity:
        laws = [*laws, engine.add_law("basic:planet_gravity", acceleration=G)]
    return engine, engine.add_object(body, laws=laws), hear


@pytest.mark.parametrize("kind", SHAPES)
def test_a_hundred_impacts_keep_the_energy_and_the_walls_take_the_momentum(kind: str) -> None:
    engine, body, hear = room(SHAPES[kind], 0)
    before, start = engine.energy().total, body.velocity
    until = 0.0
    while len({time for time, _ in hear.heard}) < 100:
        until += 1.0
        engine.run(until=until)
    assert abs(engine.energy().total - before) < 1e-12 * before
    for axis in range(3):
        given = [c.impulse * c.normal[axis] * (1.0 if c.body_b is body else -1.0) for _, c in hear.heard]
        given.append(-G * body.mass * until if axis == 2 else 0.0)
        gained = body.mass * (body.velocity[axis] - start[axis])
        assert abs(gained - math.fsum(given)) < 1e-12 * math.fsum(map(abs, given))


@pytest.mark.parametrize("gravity", [True, False])
@pytest.mark.parametrize("kind", SHAPES)
def test_turned_back_after_five_impacts_it_comes_back_to_where_it_started(kind: str, gravity: bool) -> None:
    engine, body, hear = room(SHAPES[kind], 3, gravity)
    start = body.position, body.velocity, body.orientation, body.angular_velocity
    until = 0.0
    while len({time for time, _ in hear.heard}) < 5:
        until += 0.1
        engine.run(until=until)
    body.velocity = tuple(-c for c in body.velocity)  # type: ignore[assignment]
    body.angular_velocity = tuple(-c for c in body.angular_velocity)  # type: ignore[assignment]
    engine.run(until=2.0 * until)
    assert math.dist(body.position, start[0]) < 1e-9
    assert math.dist(body.velocity, [-c for c in start[1]]) < 1e-9
    assert abs(abs(math.fsum(p * q for p, q in zip(body.orientation, start[2], strict=True))) - 1.0) < 1e-12
    assert math.dist(body.angular_velocity, [-c for c in start[3]]) < 1e-9
