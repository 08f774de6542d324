"""PyBullet. Tuned: maximal coordinates, no damping, contactProcessingThreshold 0, erp = contactERP = 0."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pybullet as p

from benchmarks.ball import Ball
from benchmarks.measure import Contender, Field, Row

NAME, MODULE = "PyBullet", "pybullet"


def ball(scene: Ball, dts: Sequence[float]) -> list[Contender]:
    """Default and tuned rows over ``dts``."""
    return [_contender(scene, dt, tuned) for dt in dts for tuned in (False, True)]


def _contender(scene: Ball, dt: float, tuned: bool) -> Contender:
    steps = round(scene.span / dt)
    world, body = _world(scene, dt, tuned)

    def make() -> tuple[Callable[[], Any], Callable[[], tuple[Any, Any]]]:
        # A new world for each run, so that no contact cache is warm.
        nonlocal world, body
        p.disconnect(world)
        world, body = _world(scene, dt, tuned)
        here = world

        def go() -> None:
            for _ in range(steps):
                p.stepSimulation(here)

        def end() -> tuple[Any, Any]:
            return p.getBasePositionAndOrientation(body, here)[0], p.getBaseVelocity(body, here)[0]

        return go, end

    return Contender(Row(scene.id, NAME, "tuned" if tuned else "default", dt), make)


def _world(scene: Ball, dt: float, tuned: bool) -> tuple[int, int]:
    world = p.connect(p.DIRECT)
    p.setTimeStep(dt, world)
    p.setGravity(0, 0, -scene.gravity, world)
    if tuned:
        p.setPhysicsEngineParameter(erp=0.0, contactERP=0.0, physicsClientId=world)
    bodies = []
    if scene.restitution is not None:
        plane = p.createCollisionShape(p.GEOM_PLANE, physicsClientId=world)
        bodies.append(p.createMultiBody(0, plane, useMaximalCoordinates=tuned, physicsClientId=world))
        p.changeDynamics(bodies[0], -1, restitution=1.0, physicsClientId=world)
    sphere = p.createCollisionShape(p.GEOM_SPHERE, radius=scene.radius, physicsClientId=world)
    body = p.createMultiBody(
        scene.mass, sphere, basePosition=scene.position, useMaximalCoordinates=tuned, physicsClientId=world
    )
    bodies.append(body)
    if scene.restitution is not None:  # Bullet multiplies the two
        p.changeDynamics(body, -1, restitution=scene.restitution, physicsClientId=world)
    if tuned:
        for one in bodies:
            p.changeDynamics(
                one, -1, linearDamping=0, angularDamping=0, contactProcessingThreshold=0, physicsClientId=world
            )
    p.resetBaseVelocity(body, scene.velocity, physicsClientId=world)
    return world, body


def field(positions: Any, velocities: Any, dt: float) -> list[Field]:
    """S12, tuned, contacts filtered away. The time is that of the step alone; reading is one call a body and comes on top."""
    world = p.connect(p.DIRECT)
    p.setTimeStep(dt, world)
    p.setGravity(0, 0, -9.81, world)
    sphere = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1, physicsClientId=world)
    bodies = []
    for place, velocity in zip(positions.tolist(), velocities.tolist(), strict=True):
        body = p.createMultiBody(1.0, sphere, basePosition=place, useMaximalCoordinates=True, physicsClientId=world)
        p.changeDynamics(body, -1, linearDamping=0, angularDamping=0, physicsClientId=world)
        p.setCollisionFilterGroupMask(body, -1, 0, 0, physicsClientId=world)
        p.resetBaseVelocity(body, velocity, physicsClientId=world)
        bodies.append(body)

    def read() -> tuple[Any, Any]:
        at = [p.getBasePositionAndOrientation(body, world)[0] for body in bodies]
        return np.array(at), np.array([p.getBaseVelocity(body, world)[0] for body in bodies])

    return [Field("tuned", lambda: None, lambda: p.stepSimulation(world), read)]
