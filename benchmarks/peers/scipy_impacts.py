"""SciPy's DOP853 with events: it stops where the ball touches, the speed is turned round, and it begins again."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.measure import Row
from benchmarks.problem import End
from benchmarks.turns import Contender

NAME, MODULE = "SciPy", "scipy"


def impacts(scene: Any) -> list[Contender]:
    """A contender an rtol, for scenes that have a ``slope`` and a ``radius``."""
    return [_contender(scene, rtol) for rtol in scene.peers.get(MODULE, ())] if hasattr(scene, "slope") else []


def _contender(scene: Any, rtol: float) -> Contender:
    slope, radius, restitution = scene.slope, scene.radius, scene.restitution

    def touches(t: float, y: Any) -> Any:
        return y[2] - radius

    touches.terminal, touches.direction = True, -1.0  # type: ignore[attr-defined]
    state: list[Any] = []

    def make() -> tuple[Callable[[], Any], Callable[[], End]]:
        slope(0.0, np.array(scene.begin))

        def go() -> None:
            t, y = 0.0, np.array(scene.begin)
            while t < scene.span:
                solved = solve_ivp(
                    slope,
                    (t, scene.span),
                    y,
                    method="DOP853",
                    rtol=max(rtol, 3e-14),
                    atol=rtol * 1e-3,
                    max_step=max(1e-3, 0.5 * y[5] / scene.weight),  # so that no bounce is within a step
                    events=touches,
                )
                t, y = float(solved.t[-1]), solved.y[:, -1].copy()
                if solved.status == 1:
                    y[2], y[5] = np.nextafter(radius, 1.0), -restitution * y[5]
            state[:] = [y]

        return go, lambda: End(state[0][None, :3], state[0][None, 3:])

    return Contender(Row(scene.id, f"{NAME} DOP853", f"rtol {rtol:.0e}", note="events; restarted at each impact"), make)
