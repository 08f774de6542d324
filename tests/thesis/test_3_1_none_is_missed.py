"""Thesis 3.1.1 and 3.5: among many balls in a box no collision is missed, and looking at them changes none."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest

import xpheve as xp

RADIUS, GAP, COUNT = 0.1, 0.4, 150  # [m], [m]


def box_of_balls() -> tuple[xp.PhysicsEngine, float]:
    """Balls on a grid in a closed box of planes, thrown about under gravity, and half the side [m] of the box."""
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity")
    bounce = engine.add_law("collision:elastic", restitution=1.0)
    side = math.ceil(COUNT ** (1 / 3))
    half = 0.5 * GAP * (side + 1)
    for axis in range(3):
        for sign in (1.0, -1.0):
            inward = [sign * (k == axis) for k in range(3)]
            at = [-sign * half * (k == axis) for k in range(3)]
            engine.add_object(xp.PhysicalObject(xp.Plane(inward), position=at, fixed=True), laws=[bounce])
    chance = random.Random(4)
    balls = []
    for k in range(COUNT):
        cell = (k % side, k // side % side, k // side**2)
        place = [GAP * (c + 1) - half + chance.uniform(-0.05, 0.05) for c in cell]
        balls.append(xp.PhysicalObject(xp.Sphere(RADIUS), position=place, velocity=[chance.gauss(0, 1) for _ in "xyz"]))
    engine.add_objects(balls, laws=[gravity, bounce])
    return engine, half


def overlap(engine: xp.PhysicsEngine, half: float) -> float:
    """How far [m] a ball is inside a wall or another ball; below 0 if none is."""
    x = engine.bodies.position[~engine.bodies.fixed]
    away = np.sqrt(((x[:, None] - x[None, :]) ** 2).sum(axis=2)) + 9.0 * np.eye(len(x))
    return max(float(np.abs(x).max()) + RADIUS - half, 2.0 * RADIUS - float(away.min()))


@pytest.mark.thesis("keeping-up")
def test_3_1_1_of_150_balls_in_a_box_none_passes_another_and_looking_at_them_changes_nothing() -> None:
    found = []
    for looks in (400, 1):
        engine, half = box_of_balls()
        before = engine.energy()
        worst = -math.inf
        for k in range(1, looks + 1):
            engine.run(until=k / looks)
            worst = max(worst, overlap(engine, half))
        assert worst <= 1e-12 * RADIUS
        after = engine.energy()
        assert abs(after.total - before.total) <= 1e-14 * max(after.kinetic, abs(after.potential))
        found.append((engine.explain().data["contacts"]["impacts"], engine.bodies.position.tobytes()))
    assert found[0] == found[1] and found[0][0] > 300
