"""A charge in a uniform magnetic field for 1,000 periods: 1 C, 1 kg, 1 T, so that it turns by 1 rad/s.

The answer is the closed form with 40 digits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import mpmath
import numpy as np

import xpheve as xp
from benchmarks.smooth.problem import Bar, End, Ours, Problem, Slope, tolerances

PERIODS = 1000
SPAN = PERIODS * 2.0 * math.pi
VELOCITY = (1.0, 0.0, 0.1)


def build(engine: Any) -> Sequence[Any]:
    """The charge, beginning in the origin."""
    field = engine.add_law("basic:magnetic_field", field=(0.0, 0.0, 1.0))
    return [engine.add_object(xp.PhysicalObject(mass=1.0, charge=1.0, velocity=VELOCITY), laws=[field])]


def make(sqrt: Any) -> Any:
    """The slope of (x, v)."""

    def slope(t: Any, y: Any) -> Any:
        return (y[3], y[4], y[5], y[4], -y[3], 0.0 * y[5])

    return slope


def ends(y: Any) -> End:
    """The state of the slope as an end."""
    values = np.array([float(c) for c in y])
    return End(values[None, :3], values[None, 3:])


def error(end: End) -> float:
    """Distance [m] from the exact place."""
    with mpmath.workdps(40):
        t = mpmath.mpf(SPAN)
        place = (mpmath.sin(t), mpmath.cos(t) - 1, mpmath.mpf(VELOCITY[2]) * t)
        found = np.ravel(end.position)
        return float(mpmath.sqrt(sum((mpmath.mpf(float(a)) - b) ** 2 for a, b in zip(found, place, strict=True))))


def phase(end: End) -> float:
    """How far the velocity points from where it should [rad]."""
    with mpmath.workdps(40):
        vx, vy = (mpmath.mpf(float(c)) for c in np.ravel(end.velocity)[:2])
        t = mpmath.mpf(SPAN)
        return abs(
            float(mpmath.atan2(vy * mpmath.cos(t) + vx * mpmath.sin(t), vx * mpmath.cos(t) - vy * mpmath.sin(t)))
        )


def drift(end: End) -> float:
    """Change of the energy over the energy."""
    begin = np.array(VELOCITY, np.longdouble)
    v = np.asarray(end.velocity, np.longdouble).ravel()
    return float((v @ v - begin @ begin) / (begin @ begin))


PROBLEMS = [
    Problem(
        id="gyration",
        title="a charge in a uniform magnetic field, 1,000 periods",
        span=SPAN,
        metric="error of the place [m]",
        build=build,
        ours=[
            *(Ours("linear", "core:linear", {"dt": SPAN / (PERIODS * parts)}) for parts in (0.37, 10, 100)),
            Ours("linear", "core:linear", {"rtol": 1e-9}),
            *tolerances("core:adaptive", 9, 12),
            Ours("midpoint", "core:midpoint", {"dt": SPAN / (PERIODS * 100)}),
        ],
        error=error,
        drift=drift,
        slope=Slope((0.0, 0.0, 0.0, *VELOCITY), make, ends),
        peers={"scipy": [("DOP853", 1e-9), ("DOP853", 1e-12)], "heyoka": [1e-9, 0.0]},
        bars=[Bar("phase within 1e-9 at any dt", "value", method="linear", key="phase [rad]", ratio=1e-9)],
        measures={"phase [rad]": phase},
        short=10.0,
    )
]
