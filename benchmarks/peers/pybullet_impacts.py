"""PyBullet. Default: as it comes. Tuned: maximal coordinates, no damping, no threshold of restitution.

And contactProcessingThreshold 0, erp = contactERP = 0.
"""

from __future__ import annotations

import numpy as np
import pybullet as p

from benchmarks.impacts.stage import Stage, Staged, Thing, contenders
from benchmarks.problem import End
from benchmarks.turns import Contender

NAME, MODULE = "PyBullet", "pybullet"
NOTES = {"tuned": "maximal coordinates, no damping, erp 0"}
BULLETS = ("default", "tuned", "tuned, swept")
worlds: list[int] = []  # PyBullet keeps few at a time


def impacts(scene: Staged) -> list[Contender]:
    """A contender a setting: ("default" or "tuned", dt)."""
    return contenders(scene, NAME, MODULE, World, NOTES)


class World:
    """A stage in PyBullet; the world before is given up."""

    def __init__(self, stage: Stage, setting: str, dt: float) -> None:
        while worlds:
            p.disconnect(worlds.pop())
        self.world = p.connect(p.DIRECT)
        worlds.append(self.world)
        self.tuned, self.swept = setting.startswith("tuned"), setting.endswith("swept")
        p.setTimeStep(dt, self.world)
        p.setGravity(0, 0, -stage.gravity, self.world)
        if self.tuned:
            p.setPhysicsEngineParameter(
                erp=0.0, contactERP=0.0, restitutionVelocityThreshold=0.0, physicsClientId=self.world
            )
        self.shapes: dict[object, int] = {}
        for one in stage.scenery:
            self._add(one, stage)
        self.bodies = [self._add(one, stage) for one in stage.movers]

    def _add(self, one: Thing, stage: Stage) -> int:
        w, x, y, z = one.orientation
        body: int = p.createMultiBody(
            one.mass,
            self._shape(one),
            basePosition=one.position,
            baseOrientation=(x, y, z, w),
            useMaximalCoordinates=self.tuned,
            physicsClientId=self.world,
        )
        more = {"linearDamping": 0, "angularDamping": 0, "contactProcessingThreshold": 0} if self.tuned else {}
        # Bullet multiplies the two coefficients.
        p.changeDynamics(
            body, -1, restitution=stage.restitution**0.5, lateralFriction=0, physicsClientId=self.world, **more
        )
        if one.mass > 0:
            if self.swept:  # its continuous detection, by a smaller sphere within
                p.changeDynamics(body, -1, ccdSweptSphereRadius=0.5 * min(one.size), physicsClientId=self.world)
            if one.shape != "sphere":  # Bullet would take that of a box around it
                p.changeDynamics(body, -1, mass=one.mass, localInertiaDiagonal=one.inertia, physicsClientId=self.world)
            p.resetBaseVelocity(body, one.velocity, one.turning, physicsClientId=self.world)
        return body

    def _shape(self, one: Thing) -> int:
        key = one.shape, one.size
        if key not in self.shapes:
            self.shapes[key] = self._new_shape(one)
        return self.shapes[key]

    def _new_shape(self, one: Thing) -> int:
        here = self.world
        if one.shape == "sphere":
            return int(p.createCollisionShape(p.GEOM_SPHERE, radius=one.size[0], physicsClientId=here))
        if one.shape == "box":
            return int(p.createCollisionShape(p.GEOM_BOX, halfExtents=one.size, physicsClientId=here))
        if one.shape == "capsule":
            return int(
                p.createCollisionShape(p.GEOM_CAPSULE, radius=one.size[0], height=one.size[1], physicsClientId=here)
            )
        return int(p.createCollisionShape(p.GEOM_PLANE, planeNormal=one.size, physicsClientId=here))

    def advance(self, steps: int) -> None:
        """Step after step."""
        for _ in range(steps):
            p.stepSimulation(self.world)

    def read(self) -> End:
        """Where all movers are."""
        places = [p.getBasePositionAndOrientation(body, self.world) for body in self.bodies]
        speeds = [p.getBaseVelocity(body, self.world) for body in self.bodies]
        return End(
            np.array([place for place, _ in places]),
            np.array([v for v, _ in speeds]),
            np.array([(q[3], *q[:3]) for _, q in places]),
            np.array([w for _, w in speeds]),
        )
