"""MuJoCo on smooth motion: a free body that spins (Euler and RK4), a joint with a spring and a damper (Euler, implicit, RK4)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from benchmarks.smooth.measure import Contender, row
from benchmarks.smooth.problem import End, Problem

NAME, MODULE = "MuJoCo", "mujoco"


def smooth(problem: Problem) -> list[Contender]:
    """A contender a setting: (integrator, dt)."""
    return [_contender(problem, *one) for one in problem.peers.get(MODULE, ())]


def _contender(problem: Problem, kind: str, dt: float) -> Contender:
    steps = round(problem.span / dt)
    model = mujoco.MjModel.from_xml_string(problem.models["mujoco"](dt, kind))
    data = mujoco.MjData(model)

    def make() -> tuple[Callable[[], Any], Callable[[], End]]:
        mujoco.mj_resetData(model, data)
        if problem.spin is not None:
            data.qvel[3:6] = problem.spin.turning
        else:
            data.qpos[0] = 1.0

        def go() -> None:
            mujoco.mj_step(model, data, nstep=steps)

        return go, (lambda: _turned(data)) if problem.spin is not None else (lambda: _slid(data))

    note = "its default" if kind == "Euler" else "tuned"
    return Contender(row(problem, f"{NAME} {kind}", f"dt {dt:.4g}", dt, note), make)


def _turned(data: Any) -> End:
    q, w = data.qpos[3:7].copy(), data.qvel[3:6].copy()
    t = 2 * np.cross(q[1:], w)
    return End(data.qpos[None, :3].copy(), data.qvel[None, :3].copy(), q[None], (w + q[0] * t + np.cross(q[1:], t))[None])


def _slid(data: Any) -> End:
    return End(np.array([[data.qpos[0], 0.0, 0.0]]), np.array([[data.qvel[0], 0.0, 0.0]]))
