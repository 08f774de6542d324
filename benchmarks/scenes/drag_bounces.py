"""A ball under its weight and quadratic drag in a wind, restitution 0.8: ten bounces on a floor, against Taylor series of 40 digits.

The engines of games have no such force of their own; SciPy's DOP853 with events stands for what one would write.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks import references
from benchmarks.impacts.ours import Ours
from benchmarks.problem import Bar, End, Scene
from benchmarks.references.bounces_in_wind import (
    AREA,
    COEFFICIENT,
    DENSITY,
    MASS,
    POSITION,
    RADIUS,
    RESTITUTION,
    SPAN,
    VELOCITY,
    WEIGHT,
    WIND,
)

NAME = "bounces_in_wind"


@dataclass(frozen=True)
class Windy(Scene):
    """A scene that SciPy can follow: slope of (x, v), start, what happens at the floor."""

    slope: Callable[[float, Any], Any] = lambda t, y: y
    begin: Sequence[float] = ()
    radius: float = RADIUS
    restitution: float = RESTITUTION
    weight: float = WEIGHT


def build(engine: Any) -> Sequence[Any]:
    """The ball, the floor, gravity and wind in an engine."""
    import xpheve as xp

    bounce = engine.add_law("collision:elastic", restitution=RESTITUTION)
    gravity = engine.add_law("basic:planet_gravity", acceleration=WEIGHT)
    wind = engine.add_law("basic:wind", velocity=WIND, density=DENSITY, coefficient=COEFFICIENT)
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce])
    ball = xp.PhysicalObject(xp.Sphere(RADIUS), mass=MASS, position=POSITION, velocity=VELOCITY, drag_area=AREA)
    return [engine.add_object(ball, laws=[gravity, wind, bounce])]


def error(end: End) -> float:
    """Distance [m] from the place of the reference."""
    known = references.load(NAME)[0]
    return float(np.linalg.norm((end.position[0] - known.high[:3]) - known.low[:3]))


def slope(t: float, y: Any) -> Any:
    """y' of (x, v)."""
    u, v, w = y[3] - WIND[0], y[4] - WIND[1], y[5] - WIND[2]
    share = 0.5 * DENSITY * COEFFICIENT * AREA / MASS * math.sqrt(u * u + v * v + w * w)
    return np.array([y[3], y[4], y[5], -share * u, -share * v, -share * w - WEIGHT])


def compiled() -> Callable[[float, Any], Any]:
    """The slope by numba, where it is there."""
    try:
        from numba import njit
    except ImportError:
        return slope
    return njit(slope)  # type: ignore[no-any-return]


TOLERANCES = (1e-6, 1e-8, 1e-10, 1e-12, 1e-13)
PROBLEMS = [
    Windy(
        id="drag and wind",
        title=f"quadratic drag, wind, restitution {RESTITUTION}: ten bounces, {SPAN:g} s",
        span=SPAN,
        metric="distance from the exact place [m]",
        build=build,
        ours=[
            Ours(f"rtol {rtol:.0e}", {"compile": compile}, {"rtol": rtol, "atol": 1e-3 * rtol})
            for compile in ("always",)
            for rtol in TOLERANCES
        ],
        error=error,
        slope=compiled(),
        begin=(*POSITION, *VELOCITY),
        peers={"scipy": TOLERANCES},
        bars=[Bar("within 1e-9 m after ten bounces", "error", error=1e-9)],
        short=0.5,
    )
]
