"""Rapier, in float32. Default: its own softness, margins and speed cap. Tuned: no margins, 8 iterations, continuous detection, no cap, no sleep."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import rapier3d as r

from benchmarks.impacts.stage import Stage, Staged, Thing, contenders
from benchmarks.measure import Field
from benchmarks.problem import End
from benchmarks.turns import Contender

NAME, MODULE = "Rapier", "rapier3d"
BULLETS = ("default", "tuned", "continuous")
NOTES = {"default": "float32", "tuned": "float32; no margins, 8 iterations, continuous detection, no cap on speed"}


def impacts(scene: Staged) -> list[Contender]:
    """A contender a setting: ("default" or "tuned", dt)."""
    return contenders(scene, NAME, MODULE, World, NOTES)


class World:
    """A stage in Rapier."""

    def __init__(self, stage: Stage, setting: str, dt: float) -> None:
        self.world = r.PhysicsWorld(gravity=(0.0, 0.0, -stage.gravity))
        self.world.set_num_threads(1)
        known = self.world.integration_parameters
        known.dt = dt
        if setting == "tuned":
            known.normalized_prediction_distance = 0.0
            known.normalized_allowed_linear_error = 0.0
            known.normalized_max_linear_velocity = 1e9
            known.max_ccd_substeps = 8
            known.num_solver_iterations = 8
        for one in stage.scenery:
            self.world.add_collider(_collider(one, stage))
        self.handles = [self._add(one, stage, setting != "default") for one in stage.movers]

    def _add(self, one: Thing, stage: Stage, continuous: bool) -> Any:
        body = (
            r.RigidBody.dynamic()
            .position(_pose(one))
            .linvel(one.velocity)
            .angvel(one.turning)
            .can_sleep(not continuous)
            .ccd_enabled(continuous)
            .gyroscopic_forces(True)
        )
        return self.world.add_body(body, [_shape(one).mass(one.mass).restitution(stage.restitution).friction(0.0)])

    def advance(self, steps: int) -> None:
        """Step after step."""
        step = self.world.step
        for _ in range(steps):
            step()

    def read(self) -> End:
        """Where all movers are."""
        bodies = [self.world.rigid_bodies[handle] for handle in self.handles]
        q = [one.rotation for one in bodies]
        return End(
            np.array([_three(one.translation) for one in bodies]),
            np.array([_three(one.linvel) for one in bodies]),
            np.array([(one.w, one.i, one.j, one.k) for one in q]),
            np.array([_three(one.angvel) for one in bodies]),
        )


def _three(v: Any) -> tuple[float, float, float]:
    return v.x, v.y, v.z


def _pose(one: Thing) -> Any:
    return r.Isometry3(tuple(map(float, one.position)), r.Rotation3(*map(float, one.orientation)))


def _shape(one: Thing) -> Any:
    if one.shape == "sphere":
        return r.Collider.ball(one.size[0])
    if one.shape == "box":
        return r.Collider.cuboid(*one.size)
    if one.shape == "capsule":
        return r.Collider.capsule_z(0.5 * one.size[1], one.size[0])
    return r.Collider.halfspace(one.size)


def _collider(one: Thing, stage: Stage) -> Any:
    return _shape(one).position(_pose(one)).restitution(stage.restitution).friction(0.0)


def field(positions: Any, velocities: Any, dt: float) -> list[Field]:
    """S12, contacts on, no sleep."""
    rows = zip(positions.tolist(), velocities.tolist(), strict=True)
    made = World(Stage(_spheres(rows), 1.0, 9.81), "tuned", dt)

    def read() -> tuple[Any, Any]:
        end = made.read()
        return end.position, end.velocity

    return [Field("tuned", lambda: None, lambda: made.advance(1), read)]


def _spheres(rows: Any) -> Sequence[Thing]:
    return [Thing("sphere", (0.1,), tuple(x), tuple(v), mass=1.0) for x, v in rows]
