"""Van der Pol's oscillator with mu = 1e4, until t = 1e4.

It creeps along a slow curve, jumps at some 8.1e3, and creeps again.

As a law in units: F = mu (1 - (x/a)^2) v - k x. The answer was made in long double (64 bits).

Source: B. van der Pol, Philosophical Magazine 2, 978 (1926); E. Hairer, G. Wanner, Solving Ordinary Differential
Equations II (1996), section IV.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

import xpheve as xp
from benchmarks import references
from benchmarks.smooth.problem import Bar, End, Problem, Slope, tolerances

MU, SPAN, NAME = 1e4, 1e4, "van_der_pol"


class VanDerPol(xp.FieldLaw):
    """Damping that drives within |x| < a and brakes outside, and a spring: F = mu (1 - (x/a)^2) v - k x, along x."""

    id = "benchmarks:van_der_pol"

    damping = xp.Param(MU, unit="kg/s", ge=0, doc="mu.")
    width = xp.Param(1.0, unit="m", gt=0, doc="a.")
    stiffness = xp.Param(1.0, unit="N/m", ge=0, doc="k.")

    def force(self, body: Any) -> Any:
        """Force on each body [N]."""
        x = body.position.x / self.width
        along = self.damping * (1.0 - x * x) * body.velocity.x - self.stiffness * body.position.x
        return xp.vector(along, 0.0 * along, 0.0 * along)


def build(engine: Any) -> Sequence[Any]:
    """One body, let go at x = 2."""
    return [engine.add_object(xp.PhysicalObject(mass=1.0, position=(2.0, 0.0, 0.0)), laws=[engine.add_law(VanDerPol)])]


def make(sqrt: Any) -> Any:
    """The slope of (x, v)."""

    def slope(t: Any, y: Any) -> Any:
        return (y[1], MU * (1.0 - y[0] * y[0]) * y[1] - y[0])

    return slope


def jacobian(t: float, y: Any) -> Any:
    """Of the slope."""
    return np.array([[0.0, 1.0], [-2.0 * MU * y[0] * y[1] - 1.0, MU * (1.0 - y[0] * y[0])]])


def ends(y: Any) -> End:
    """The state of the slope as an end."""
    return End(np.array([[float(y[0]), 0.0, 0.0]]), np.array([[float(y[1]), 0.0, 0.0]]))


def error(end: End) -> float:
    """Error of the place [m]."""
    known = references.load(NAME)[0]
    return abs(float(np.ravel(end.position)[0] - known.high[0] - known.low[0]))


PROBLEMS = [
    Problem(
        id="van der Pol",
        title="van der Pol's oscillator, mu = 1e4",
        span=SPAN,
        metric="error of the place [m]",
        build=build,
        ours=tolerances("core:implicit", 3, 4, 6, 8, 10, 12, 13),
        error=error,
        slope=Slope((2.0, 0.0), make, ends, jacobian),
        peers={
            "scipy": [
                *(("Radau", 10.0**-p) for p in (3, 4, 6, 8, 10, 12)),
                *(("LSODA", 10.0**-p) for p in (6, 9, 12)),
                ("BDF", 1e-6),
            ],
        },
        bars=[Bar("on or ahead of SciPy Radau's front", "front", peer="SciPy Radau", method="implicit")],
        notes="heyoka's Taylor series, without implicit steps, took minutes for the answer, and is left out.",
        short=1.0,
    )
]
