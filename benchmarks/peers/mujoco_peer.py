"""MuJoCo. Default: Euler, its own contact softness. Tuned: RK4, elliptic cone, impratio 10, elastic contact by a negative solref."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import product
from typing import Any

import mujoco
import numpy as np

from benchmarks.ball import Ball
from benchmarks.measure import Contender, Field, Row

NAME, MODULE = "MuJoCo", "mujoco"
STEPS_OF_A_CONTACT = (5, 7, 10, 14, 20, 28, 40, 80)  # the stiffnesses tried when tuning
HARD = "0.9999 0.9999 0.001 0.5 2"


def ball(scene: Ball, dts: Sequence[float]) -> list[Contender]:
    """Default and tuned rows over ``dts``."""
    found = []
    for dt in dts:
        found.append(_contender(scene, dt, "default", _model(scene, dt, "", ""), ""))
        found.append(_contender(scene, dt, "tuned", *_tuned(scene, dt)))
    return found


def _tuned(scene: Ball, dt: float) -> tuple[Any, str]:
    """The tuned model; with a floor, the stiffness that gives the least error in this very scene."""
    option = 'integrator="RK4" cone="elliptic" impratio="10"'
    if scene.restitution is None:
        return _model(scene, dt, option, ""), "RK4"
    best: tuple[float, Any, str] | None = None
    for steps, ratio in product(STEPS_OF_A_CONTACT, damping_ratios(scene.restitution)):
        omega = math.pi / (steps * dt)
        contact = f'solref="{-(omega**2)!r} {-2.0 * ratio * omega!r}" solimp="{HARD}"'
        model = _model(scene, dt, option, contact)
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data, nstep=round(scene.span / dt))
        error, _ = scene.errors(data.qpos[:3], data.qvel[:3])
        if best is None or error < best[0]:
            best = (error, model, f"RK4; the best of {len(STEPS_OF_A_CONTACT)} stiffnesses: a contact of {steps} steps")
    assert best is not None
    return best[1], best[2]


def damping_ratios(restitution: float) -> list[float]:
    """Damping of a spring that gives a contact its restitution, over the critical one.

    Two are tried: that of a spring let go where it has its length again, and that of one that only pushes and is let go earlier.
    """
    if restitution >= 1.0:
        return [0.0]
    loss = -math.log(max(restitution, 1e-9))
    low, high = 0.0, 0.7
    while high - low > 1e-12:  # of a spring that only pushes: restitution = exp(-z phase / sqrt(1 - z^2))
        z = 0.5 * (low + high)
        phase = math.pi - math.atan2(2.0 * z * math.sqrt(1.0 - z * z), 1.0 - 2.0 * z * z)
        low, high = (z, high) if z * phase / math.sqrt(1.0 - z * z) < loss else (low, z)
    return [loss / math.hypot(math.pi, loss), 0.5 * (low + high)]


def _model(scene: Ball, dt: float, option: str, contact: str) -> Any:
    floor = "" if scene.restitution is None else f'<geom type="plane" size="0 0 1" {contact}/>'
    at = " ".join(map(repr, scene.position))
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{dt!r}" gravity="0 0 {-scene.gravity!r}" {option}/><worldbody>{floor}'
        f'<body pos="{at}"><freejoint/><geom type="sphere" size="{scene.radius!r}" mass="{scene.mass!r}" {contact}/></body>'
        "</worldbody></mujoco>"
    )


def _contender(scene: Ball, dt: float, setting: str, model: Any, note: str) -> Contender:
    steps = round(scene.span / dt)
    data = mujoco.MjData(model)

    def make() -> tuple[Callable[[], Any], Callable[[], tuple[Any, Any]]]:
        mujoco.mj_resetData(model, data)
        data.qvel[:3] = scene.velocity

        def go() -> None:
            mujoco.mj_step(model, data, nstep=steps)

        return go, lambda: (data.qpos[:3].copy(), data.qvel[:3].copy())

    return Contender(Row(scene.id, NAME, setting, dt, note=note), make)


def field(positions: Any, velocities: Any, dt: float) -> list[Field]:
    """S12, contacts switched off: Euler (default), RK4 (tuned). Positions and velocities lie in MuJoCo's own arrays: reading them is free."""
    spec = mujoco.MjSpec()
    spec.memory = 1 << 29  # left to itself it asks for more than there is, for contacts that never come
    spec.option.timestep = dt
    spec.option.gravity = [0.0, 0.0, -9.81]
    for place in positions:
        body = spec.worldbody.add_body(pos=place)
        body.add_freejoint()
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.1, 0, 0], mass=1.0, contype=0, conaffinity=0)
    model = spec.compile()
    data = mujoco.MjData(model)

    def start(integrator: Any) -> None:
        model.opt.integrator = integrator
        mujoco.mj_resetData(model, data)
        data.qvel.reshape(-1, 6)[:, :3] = velocities

    def step() -> None:
        mujoco.mj_step(model, data)

    def read() -> tuple[Any, Any]:
        return np.array(data.qpos.reshape(-1, 7)[:, :3]), np.array(data.qvel.reshape(-1, 6)[:, :3])

    kinds = {"default": mujoco.mjtIntegrator.mjINT_EULER, "tuned": mujoco.mjtIntegrator.mjINT_RK4}
    return [Field(name, lambda kind=kind: start(kind), step, read) for name, kind in kinds.items()]
