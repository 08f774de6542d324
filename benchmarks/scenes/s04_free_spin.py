"""S4: a free body of principal inertia (1, 2, 3) that spins about its middle axis, nearly, for 60 s, 1e4 s and 1e6 s.

It is near the separatrix, so that errors grow. The answer is the closed form with 70 digits
(`benchmarks.references.free_spin`).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from benchmarks import references
from benchmarks.smooth.problem import Bar, End, Ours, Problem, Slope, Spin
from benchmarks.smooth.turning import angle, quaternion_rate

SPIN = Spin((1.0, 2.0, 3.0), (0.01, 2.0, 0.01))
SPANS = {60.0: 1e-11, 1e4: 1e-10, 1e6: 1e-8}
NAME = "free_spin"


def build(engine: Any) -> Sequence[Any]:
    """The body in an engine."""
    import xpheve as xp

    return [engine.add_object(xp.PhysicalObject(inertia=SPIN.inertia, angular_velocity=SPIN.turning))]


def error(span: float, end: End) -> float:
    """Angle [rad] from the exact orientation."""
    known = next(one for one in references.load(NAME) if one.span == span)
    return angle(end.orientation, known.high, known.low)


def drift(end: End) -> float:
    """Change of the energy over the energy at the start."""
    q, w = np.asarray(end.orientation, np.longdouble).reshape(4), np.asarray(end.turning, np.longdouble).reshape(3)
    q = q / np.sqrt(q @ q)
    t = 2 * np.cross(-q[1:], w)
    body = w + q[0] * t + np.cross(-q[1:], t)
    moments, begin = np.array(SPIN.inertia, np.longdouble), np.array(SPIN.turning, np.longdouble)
    energy = (moments * begin * begin).sum()
    return float(((moments * body * body).sum() - energy) / energy)


def make(sqrt: Any) -> Any:
    """The slope of (q, w)."""

    def slope(t: Any, y: Any) -> Any:
        w = (y[4], y[5], y[6])
        q = quaternion_rate((y[0], y[1], y[2], y[3]), w)
        return (*q, -w[1] * w[2], w[2] * w[0], -w[0] * w[1] / 3.0)

    return slope


def ends(y: Any) -> End:
    """The state of the slope as an end; angular velocity in the world frame."""
    q, w = np.array([float(c) for c in y[:4]]), np.array([float(c) for c in y[4:7]])
    q = q / np.sqrt(q @ q)
    t = 2 * np.cross(q[1:], w)
    zero = np.zeros((1, 3))
    return End(zero, zero, q[None], (w + q[0] * t + np.cross(q[1:], t))[None])


def mujoco_model(dt: float, integrator: str) -> str:
    """The same body for MuJoCo."""
    moments = " ".join(map(repr, SPIN.inertia))
    return (
        f'<mujoco><option timestep="{dt!r}" gravity="0 0 0" integrator="{integrator}"/><worldbody><body><freejoint/>'
        f'<inertial pos="0 0 0" mass="1" diaginertia="{moments}"/></body></worldbody></mujoco>'
    )


def problem(span: float) -> Problem:
    """The body for ``span`` [s]."""
    bars = [Bar(f"closed form; attitude within {SPANS[span]:.0e} rad", "all errors", error=SPANS[span])]
    if span == 60.0:
        bars.append(
            Bar(
                "CPU at most a tenth of MuJoCo RK4's at its 7e-8",
                "ratio",
                peer="MuJoCo RK4",
                peer_setting="dt 0.01667",
                ratio=0.1,
                no_larger=True,
            )
        )
    few = span > 60.0
    return Problem(
        id=f"S4 {span:g} s",
        title=f"a free asymmetric body, {span:g} s",
        span=span,
        metric="angle from the exact orientation [rad]",
        build=build,
        ours=[Ours("closed form", None, {}), Ours("closed form, host steps", None, {"dt": span / 4})],
        error=partial(error, span),
        drift=drift,
        slope=Slope((1.0, 0.0, 0.0, 0.0, *SPIN.turning), make, ends),
        spin=SPIN,
        peers={
            "mujoco": [("RK4", 1 / 60)]
            if few
            else [(kind, dt) for kind in ("Euler", "RK4") for dt in (1 / 60, 1 / 240, 1 / 1000)],
            "pybullet": [] if few else [("default", 1 / 240), ("tuned", 1 / 240), ("tuned", 1 / 1000)],
            "heyoka": [0.0] if few else [1e-9, 0.0],
            "scipy": [] if few else [("DOP853", 1e-9), ("DOP853", 1e-13)],
        }
        if span < 1e6
        else {},
        models={"mujoco": mujoco_model},
        bars=bars,
        notes="" if span < 1e6 else "Peers are left out: MuJoCo would take some seven minutes for it.",
        short=1.0,
    )


PROBLEMS = [problem(span) for span in SPANS]
