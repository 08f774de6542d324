"""MuJoCo on smooth motion: a free body that flies or spins, a joint with a spring and a damper.

Euler (its default) and RK4.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from benchmarks.smooth.problem import End, Problem
from benchmarks.turns import Contender, row

NAME, MODULE = "MuJoCo", "mujoco"


def smooth(problem: Problem) -> list[Contender]:
    """A contender a setting: (integrator, dt)."""
    return [_contender(problem, *one) for one in problem.peers.get(MODULE, ())]


def _contender(problem: Problem, kind: str, dt: float) -> Contender:
    steps = round(problem.span / dt)
    model = mujoco.MjModel.from_xml_string(problem.models["mujoco"](dt, kind))
    data = mujoco.MjData(model)
    free = model.nq == 7

    def begin(data: Any) -> None:
        if problem.spin is not None:
            data.qvel[3:6] = problem.spin.turning
        elif problem.slope is not None and free:
            data.qvel[:3] = problem.slope.start[3:6]
        elif problem.slope is not None:
            data.qpos[0], data.qvel[0] = problem.slope.start

    read = _turned if free else _slid

    def make() -> tuple[Callable[[], Any], Callable[[], End]]:
        mujoco.mj_resetData(model, data)
        begin(data)

        def go() -> None:
            mujoco.mj_step(model, data, nstep=steps)

        return go, lambda: read(data)

    note = "its default" if kind == "Euler" else "tuned"
    return Contender(row(problem, f"{NAME} {kind}", f"dt {dt:.4g}", dt, note), make)


def _turned(data: Any) -> End:
    q, w = data.qpos[3:7].copy(), data.qvel[3:6].copy()
    t = 2 * np.cross(q[1:], w)
    return End(
        data.qpos[None, :3].copy(), data.qvel[None, :3].copy(), q[None], (w + q[0] * t + np.cross(q[1:], t))[None]
    )


def _slid(data: Any) -> End:
    return End(np.array([[data.qpos[0], 0.0, 0.0]]), np.array([[data.qvel[0], 0.0, 0.0]]))
