"""S1 over a long time: a sphere thrown, for 60 s, 1e4 s and 1e6 s. The answer is the parabola with 40 digits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import mpmath
import numpy as np

from benchmarks.ball import DIGITS, Ball
from benchmarks.scenes.s01_thrown import SCENE
from benchmarks.smooth.problem import Bar, End, Ours, Problem, Slope


def build(engine: Any) -> Sequence[Any]:
    """The sphere in an engine, z up or not: gravity says its direction."""
    import xpheve as xp

    gravity = engine.add_law("basic:planet_gravity", acceleration=SCENE.gravity, direction=(0.0, 0.0, -1.0))
    ball = xp.PhysicalObject(xp.Sphere(SCENE.radius), mass=SCENE.mass, position=SCENE.position, velocity=SCENE.velocity)
    return [engine.add_object(ball, laws=[gravity])]


def error(ball: Ball, end: End) -> float:
    """Distance from the exact place over how far that is from the start."""
    with mpmath.workdps(DIGITS):
        place, _ = ball.exact(ball.span)
        off = [mpmath.mpf(float(a)) - b for a, b in zip(np.ravel(end.position), place, strict=True)]
        way = [b - mpmath.mpf(a) for a, b in zip(ball.position, place, strict=True)]
        return float(mpmath.norm(off) / mpmath.norm(way))


def make(sqrt: Any) -> Any:
    """The slope of (x, v)."""
    g = SCENE.gravity

    def slope(t: Any, y: Any) -> Any:
        return (y[3], y[4], y[5], 0.0 * y[3], 0.0 * y[4], 0.0 * y[5] - g)

    return slope


def ends(y: Any) -> End:
    """The state of the slope as an end."""
    values = np.array([float(c) for c in y])
    return End(values[None, :3], values[None, 3:])


def mujoco_model(dt: float, integrator: str) -> str:
    """The same sphere for MuJoCo, its velocity to be set."""
    at = " ".join(map(repr, SCENE.position))
    return (
        f'<mujoco><option timestep="{dt!r}" gravity="0 0 {-SCENE.gravity!r}" integrator="{integrator}"/><worldbody><body pos="{at}"><freejoint/>'
        f'<geom type="sphere" size="{SCENE.radius!r}" mass="{SCENE.mass!r}"/></body></worldbody></mujoco>'
    )


def problem(span: float) -> Problem:
    """The flight of ``span`` [s]."""
    ball = replace(SCENE, span=span)
    return Problem(
        id=f"S1 {span:g} s",
        title=f"a sphere thrown, {span:g} s",
        span=span,
        metric="error of the place over the way",
        build=build,
        ours=[Ours("closed form", None, {}), Ours("closed form, host steps", None, {"dt": span / 4})],
        error=partial(error, ball),
        slope=Slope((*SCENE.position, *SCENE.velocity), make, ends),
        peers={
            "mujoco": [(kind, dt) for kind in ("Euler", "RK4") for dt in (1 / 60, 1 / 240)] if span == 60.0 else [],
            "heyoka": [0.0],
            "scipy": [("DOP853", 1e-9), ("DOP853", 1e-13)],
        },
        models={"mujoco": mujoco_model},
        bars=[Bar("closed form, to rounding", "all errors", error=1e-15)],
        notes="" if span == 60.0 else "MuJoCo is left out: the same steps over and over.",
        short=1.0,
    )


PROBLEMS = [problem(span) for span in (60.0, 1e4, 1e6)]
