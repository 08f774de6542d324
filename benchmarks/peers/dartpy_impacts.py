"""DART. Default: collisions by FCL. Tuned: collisions by Bullet, split impulses, so that pushing apart adds no energy."""

from __future__ import annotations

from typing import Any

import dartpy as d
import numpy as np

from benchmarks.impacts.stage import Stage, Staged, Thing, contenders
from benchmarks.problem import End
from benchmarks.turns import Contender

NAME, MODULE = "DART", "dartpy"
NOTES = {"tuned": "Bullet's collisions, split impulses"}


def impacts(scene: Staged) -> list[Contender]:
    """A contender a setting: ("default" or "tuned", dt)."""
    return contenders(scene, NAME, MODULE, World, NOTES)


class World:
    """A stage in DART."""

    def __init__(self, stage: Stage, setting: str, dt: float) -> None:
        if setting != "tuned" and any(one.shape == "capsule" for one in stage.things):
            raise LookupError("its default collisions (FCL) know no capsules")
        self.world = d.simulation.World("stage")
        self.lost = False
        self.world.setTimeStep(dt)
        self.world.setGravity([0.0, 0.0, -stage.gravity])
        solver = self.world.getConstraintSolver()
        if setting == "tuned":
            solver.setCollisionDetector(d.collision.BulletCollisionDetector())
            solver.setSplitImpulseEnabled(True)
        for k, one in enumerate(stage.scenery):
            self._add(one, f"fixed {k}", stage)
        self.bodies = [self._add(one, f"mover {k}", stage) for k, one in enumerate(stage.movers)]

    def _add(self, one: Thing, name: str, stage: Stage) -> Any:
        skeleton = d.dynamics.Skeleton(name)
        if one.mass > 0:
            joint, body = skeleton.createFreeJointAndBodyNodePair()
            body.setInertia(d.dynamics.Inertia(one.mass, [0.0, 0.0, 0.0], np.diag(one.inertia)))
        else:
            joint, body = skeleton.createWeldJointAndBodyNodePair()
        node = body.createShapeNode(_shape(one))
        node.createCollisionAspect()
        surface = node.createDynamicsAspect()
        surface.setRestitutionCoeff(stage.restitution**0.5)  # DART multiplies the two
        surface.setFrictionCoeff(0.0)
        pose = d.math.Isometry3()
        pose.set_translation(list(one.position))
        pose.set_rotation(_matrix(one.orientation))
        if one.mass > 0:
            joint.setPositions(d.dynamics.FreeJoint.convertToPositions(pose))
            joint.setVelocities([*one.turning, *one.velocity])
        elif one.shape != "plane":
            joint.setTransformFromParentBodyNode(pose)
        self.world.addSkeleton(skeleton)
        return body

    def advance(self, steps: int) -> None:
        """Step after step, as long as it is finite: it would tell of each step that is not."""
        for k in range(steps):
            self.world.step()
            if k % 10 == 0 and not np.isfinite(self.bodies[0].getLinearVelocity()).all():
                self.lost = True
            if self.lost:
                return

    def read(self) -> End:
        """Where all movers are."""
        if self.lost:
            return End(*(np.full((len(self.bodies), size), np.nan) for size in (3, 3, 4, 3)))
        poses = [one.getWorldTransform() for one in self.bodies]
        return End(
            np.array([np.ravel(pose.translation()) for pose in poses]),
            np.array([np.ravel(one.getLinearVelocity()) for one in self.bodies]),
            np.array([_quaternion(pose) for pose in poses]),
            np.array([np.ravel(one.getAngularVelocity()) for one in self.bodies]),
        )


def _shape(one: Thing) -> Any:
    if one.shape == "sphere":
        return d.dynamics.SphereShape(one.size[0])
    if one.shape == "box":
        return d.dynamics.BoxShape([2.0 * edge for edge in one.size])
    if one.shape == "capsule":
        return d.dynamics.CapsuleShape(*one.size)
    return d.dynamics.PlaneShape(list(one.size), float(np.dot(one.size, one.position)))


def _quaternion(pose: Any) -> tuple[float, float, float, float]:
    q = d.math.Quaternion(pose.rotation())
    return q.w(), q.x(), q.y(), q.z()


def _matrix(q: Any) -> Any:
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
