"""Boxes in a room of six planes, long: small and large, light and heavy, spinning, losing energy or not."""

from __future__ import annotations

import math
import random

import pytest

import xpheve as xp

pytestmark = pytest.mark.stress


def room(
    count: int, *, scale: float = 1.0, spin: float = 3.0, restitution: float = 1.0, seed: int = 3
) -> xp.PhysicsEngine:
    """Return boxes of about 0.3 of the scale in a room of three."""
    chance = random.Random(seed)
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic", restitution=restitution, resting="hold")
    for axis in range(3):
        for side in (1.0, -1.0):
            normal = tuple(side * (k == axis) for k in range(3))
            engine.add_object(xp.PhysicalObject(xp.Plane(normal, -1.5 * scale), fixed=True), laws=[law])
    for k in range(count):
        place = (-1 + 0.8 * (k % 3), -1 + 0.8 * (k // 3 % 3), -1 + 0.8 * (k // 9))
        turn = [chance.gauss(0, 1) for _ in range(4)]
        engine.add_object(
            xp.PhysicalObject(
                xp.Box((0.3 * scale, 0.24 * scale, 0.39 * scale)), mass=1.0 + k, position=[scale * x for x in place],
                orientation=[x / math.hypot(*turn) for x in turn], velocity=[scale * chance.uniform(-1, 1) for _ in range(3)],
                angular_velocity=[chance.uniform(-spin, spin) for _ in range(3)],
            ),
            laws=[law],
        )  # fmt: skip
    return engine


def stays(engine: xp.PhysicsEngine, scale: float = 1.0) -> bool:
    return all(max(map(abs, obj.position)) < 1.5 * scale for obj in engine.objects if not obj.fixed)


@pytest.mark.parametrize(
    ("count", "until", "scale", "spin"),
    [(10, 5.0, 1.0, 3.0), (4, 3.0, 1e-3, 3.0), (4, 3.0, 1e3, 3.0), (2, 0.5, 1.0, 1e3)],
)
def test_energy_is_kept_at_restitution_1_and_nothing_leaves_the_room(
    count: int, until: float, scale: float, spin: float
) -> None:
    engine, twin = (room(count, scale=scale, spin=spin) for _ in range(2))
    before = engine.energy().kinetic
    engine.run(until=until)
    twin.run(until=until)
    assert engine.energy().kinetic == pytest.approx(before, rel=1e-12) and stays(engine, scale)
    assert engine.bodies.position.tobytes() == twin.bodies.position.tobytes()


def test_masses_a_million_apart() -> None:
    engine = room(4)
    engine.objects[6].mass, engine.objects[7].mass = 1e-3, 1e3
    before = engine.energy().kinetic
    engine.run(until=2.0)
    assert engine.energy().kinetic == pytest.approx(before, rel=1e-12) and stays(engine)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_under_gravity_the_books_balance_and_all_comes_to_an_end(restitution: float) -> None:
    engine = room(4, restitution=restitution)
    gravity = engine.add_law("basic:planet_gravity")
    for obj in engine.objects:
        if not obj.fixed:
            engine.map(obj, gravity)
    before = engine.energy()
    engine.run(until=4.0)
    after = engine.energy()
    assert after.total - after.work == pytest.approx(before.total, rel=1e-12) and stays(engine)
    if restitution < 1.0:
        assert after.kinetic == 0.0
