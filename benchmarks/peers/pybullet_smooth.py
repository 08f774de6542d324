"""PyBullet on smooth motion: a free body that spins. Tuned: no damping. It keeps state in float64 here, but steps rotation in first order."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pybullet as p

from benchmarks.smooth.problem import End, Problem
from benchmarks.turns import Contender, row

NAME, MODULE = "PyBullet", "pybullet"


def smooth(problem: Problem) -> list[Contender]:
    """A contender a setting: ("default" or "tuned", dt)."""
    return [] if problem.spin is None else [_contender(problem, *one) for one in problem.peers.get(MODULE, ())]


def _contender(problem: Problem, setting: str, dt: float) -> Contender:
    steps = round(problem.span / dt)
    spin = problem.spin
    assert spin is not None
    worlds: list[int] = []

    def make() -> tuple[Callable[[], Any], Callable[[], End]]:
        while worlds:
            p.disconnect(worlds.pop())
        world = p.connect(p.DIRECT)
        worlds.append(world)
        p.setTimeStep(dt, world)
        shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1, physicsClientId=world)
        body = p.createMultiBody(1.0, shape, physicsClientId=world)
        more = {"linearDamping": 0, "angularDamping": 0, "maxJointVelocity": 1e9} if setting == "tuned" else {}
        p.changeDynamics(body, -1, localInertiaDiagonal=spin.inertia, physicsClientId=world, **more)
        p.resetBaseVelocity(body, (0, 0, 0), spin.turning, physicsClientId=world)

        def go() -> None:
            for _ in range(steps):
                p.stepSimulation(world)

        def end() -> End:
            place, q = p.getBasePositionAndOrientation(body, world)
            v, w = p.getBaseVelocity(body, world)
            return End(*(np.array([one]) for one in (place, v, (q[3], *q[:3]), w)))

        return go, end

    return Contender(row(problem, f"{NAME} {setting}", f"dt {dt:.4g}", dt), make)
