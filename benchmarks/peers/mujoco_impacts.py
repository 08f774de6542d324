"""MuJoCo. Default: Euler, its own contact softness. Tuned: RK4, elliptic cone, impratio 10, contacts that last ten steps, by a negative solref."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from benchmarks.impacts.stage import Stage, Staged, Thing, contenders, to_body
from benchmarks.peers.mujoco_peer import HARD, damping_ratios
from benchmarks.problem import End
from benchmarks.turns import Contender

NAME, MODULE = "MuJoCo", "mujoco"
NOTES = {"tuned": "RK4, elliptic cone, impratio 10, contacts of ten steps"}
STEPS_OF_A_CONTACT = 10
models: dict[tuple[int, str], tuple[Stage, Any]] = {}  # to build one takes long


def impacts(scene: Staged) -> list[Contender]:
    """A contender a setting: ("default" or "tuned", dt)."""
    return contenders(scene, NAME, MODULE, World, NOTES)


class World:
    """A stage in MuJoCo."""

    def __init__(self, stage: Stage, setting: str, dt: float) -> None:
        key = id(stage), setting
        if key not in models:
            models.clear()
            models[key] = stage, model(stage, setting, dt)
        self.model = models[key][1]
        retime(self.model, stage, setting, dt)
        self.data = mujoco.MjData(self.model)
        start, n = stage.start, len(stage.movers)
        speeds = self.data.qvel.reshape(n, 6)
        speeds[:, :3] = start.velocity
        speeds[:, 3:] = to_body(start.orientation, start.turning)

    def advance(self, steps: int) -> None:
        """All steps in one call."""
        mujoco.mj_step(self.model, self.data, nstep=steps)

    def read(self) -> End:
        """Where all movers are."""
        places, speeds = self.data.qpos.reshape(-1, 7), self.data.qvel.reshape(-1, 6)
        q = places[:, 3:].copy()
        back = q * (1.0, -1.0, -1.0, -1.0)
        return End(places[:, :3].copy(), speeds[:, :3].copy(), q, to_body(back, speeds[:, 3:]))


def model(stage: Stage, setting: str, dt: float) -> Any:
    """The compiled model."""
    spec = mujoco.MjSpec()
    spec.memory = 1 << (30 if len(stage.movers) > 2000 else 28)  # left to itself it asks for more than there is
    spec.option.gravity = [0.0, 0.0, -stage.gravity]
    if setting == "tuned":
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
        spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        spec.option.impratio = 10.0
    for one in stage.scenery:
        spec.worldbody.add_geom(**_geom(one), pos=one.position, quat=_turned(one), friction=[0, 0, 0], condim=1)
    for one in stage.movers:
        body = spec.worldbody.add_body(pos=one.position, quat=one.orientation)
        body.add_freejoint()
        body.add_geom(**_geom(one), mass=one.mass, friction=[0, 0, 0], condim=1)
    return spec.compile()


def retime(model: Any, stage: Stage, setting: str, dt: float) -> None:
    """Set the step, and contacts that fit to it."""
    model.opt.timestep = dt
    if setting != "tuned":
        return
    omega = math.pi / (STEPS_OF_A_CONTACT * dt)
    ratio = damping_ratios(stage.restitution)[0]
    model.geom_solref[:] = (-(omega**2), -2.0 * ratio * omega)
    model.geom_solimp[:] = [float(c) for c in HARD.split()]


def _geom(one: Thing) -> dict[str, Any]:
    kinds, size = mujoco.mjtGeom, one.size
    if one.shape == "sphere":
        return {"type": kinds.mjGEOM_SPHERE, "size": [size[0], 0, 0]}
    if one.shape == "box":
        return {"type": kinds.mjGEOM_BOX, "size": list(size)}
    if one.shape == "capsule":
        return {"type": kinds.mjGEOM_CAPSULE, "size": [size[0], 0.5 * size[1], 0]}
    return {"type": kinds.mjGEOM_PLANE, "size": [0, 0, 1]}


def _turned(one: Thing) -> Sequence[float]:
    """The orientation of a geom; that of a plane takes z to its normal."""
    if one.shape != "plane":
        return one.orientation
    q = np.zeros(4)
    mujoco.mju_quatZ2Vec(q, np.array(one.size, float))
    return q.tolist()
