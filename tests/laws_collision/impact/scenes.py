"""Scenes that the impact loop and the contact server must agree on."""

from __future__ import annotations

import numpy as np

import xpheve as xp

LOOP, SERVER = "collision:impact", "core:ballistic"
"""The steppers that have contacts found by the loop, and pair by pair."""


def room(engine: xp.PhysicsEngine, size: float, laws: list[xp.PhysicalLaw]) -> list[xp.PhysicalObject]:
    """Six fixed planes about the cube from -size/2 to size/2 [m]."""
    planes = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            normal = tuple(-sign if k == axis else 0.0 for k in range(3))
            planes.append(xp.PhysicalObject(xp.Plane(normal, -0.5 * size), fixed=True))
    return engine.add_objects(planes, laws=laws)


def gas(
    stepper: str,
    count: int,
    *,
    size: float = 2.0,
    radius: float = 0.05,
    speed: float = 1.0,
    restitution: float = 1.0,
    gravity: float = 0.0,
    seed: int = 1,
    uneven: bool = False,
    **more: object,
) -> tuple[xp.PhysicsEngine, list[xp.PhysicalObject]]:
    """``count`` balls on a jittered lattice in a room, each with a speed of its own; unevenly large and heavy if asked for."""
    rng = np.random.default_rng(seed)
    engine = xp.PhysicsEngine(up="z", stepper=stepper, **more)
    bounce = engine.add_law("collision:elastic", restitution=restitution, resting="hold")
    laws = [bounce]
    room(engine, size, laws)
    if gravity:
        laws = [engine.add_law("basic:planet_gravity", acceleration=gravity), *laws]
    side = int(np.ceil(count ** (1 / 3)))
    spacing = (size - 2.0 * radius) / side
    assert spacing > 2.2 * radius
    cells = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)[:count]
    places = (cells + 0.5) * spacing - 0.5 * size + radius + rng.uniform(-0.04, 0.04, (count, 3)) * spacing
    velocities = rng.normal(size=(count, 3))
    velocities *= speed / np.linalg.norm(velocities, axis=1)[:, None]
    sizes = radius * (rng.uniform(0.5, 1.0, count) if uneven else np.ones(count))
    masses = rng.uniform(0.1, 10.0, count) if uneven else np.full(count, 0.1)
    balls = [
        xp.PhysicalObject(xp.Sphere(float(r)), mass=float(m), position=tuple(x), velocity=tuple(v))
        for r, m, x, v in zip(sizes, masses, places.tolist(), velocities.tolist(), strict=True)
    ]
    return engine, engine.add_objects(balls, laws=laws)


def states(balls: list[xp.PhysicalObject]) -> np.ndarray:
    """Positions and velocities, (balls, 6)."""
    return np.array([[*ball.position, *ball.velocity] for ball in balls])
