"""A force with the rates of Robertson's reaction in place of accelerations.

Stiffness 1e4 and more, components from 1 to 1e-6, until t = 1e4.

m v' = F(v): F1 = -a v1 + b v2 v3, F2 = -F1 - c v2^2, F3 = c v2^2, with a = 0.04 kg/s, b = 1e4 kg/m, c = 3e7 kg/m. v1
+ v2 + v3 is conserved. The answer was made in long double (64 bits).

Source: H. H. Robertson, in J. Walsh (ed.), Numerical Analysis: an Introduction (1966), p. 178; E. Hairer, G. Wanner,
Solving Ordinary Differential Equations II (1996), equation IV.1.4.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

import xpheve as xp
from benchmarks import references
from benchmarks.smooth.problem import Bar, End, Ours, Problem, Slope

SPAN, NAME = 1e4, "robertson"
A, B, C = 0.04, 1e4, 3e7
SMALL = 1e-6  # [m/s] atol is rtol times this: the second component is some 1e-6


class Robertson(xp.FieldLaw):
    """F1 = -a v1 + b v2 v3, F2 = -F1 - c v2^2, F3 = c v2^2."""

    id = "benchmarks:robertson"

    slow = xp.Param(A, unit="kg/s", ge=0, doc="a.")
    mixed = xp.Param(B, unit="kg/m", ge=0, doc="b.")
    fast = xp.Param(C, unit="kg/m", ge=0, doc="c.")

    def force(self, body: Any) -> Any:
        """Force on each body [N]."""
        v = body.velocity
        first = self.mixed * v.y * v.z - self.slow * v.x
        third = self.fast * v.y * v.y
        return xp.vector(first, -first - third, third)


def build(engine: Any) -> Sequence[Any]:
    """One body, all of its velocity along x."""
    return [engine.add_object(xp.PhysicalObject(mass=1.0, velocity=(1.0, 0.0, 0.0)), laws=[engine.add_law(Robertson)])]


def make(sqrt: Any) -> Any:
    """The slope of (v1, v2, v3, x1, x2, x3)."""

    def slope(t: Any, y: Any) -> Any:
        first = B * y[1] * y[2] - A * y[0]
        third = C * y[1] * y[1]
        return (first, -first - third, third, y[0], y[1], y[2])

    return slope


def jacobian(t: float, y: Any) -> Any:
    """Of the slope."""
    p, q, r = B * y[2], B * y[1], 2.0 * C * y[1]
    return np.array(
        [
            [-A, p, q, 0.0, 0.0, 0.0],
            [A, -p - r, -q, 0.0, 0.0, 0.0],
            [0.0, r, 0.0, 0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        ]
    )


def ends(y: Any) -> End:
    """The state of the slope as an end."""
    values = np.array([float(c) for c in y])
    return End(values[None, 3:], values[None, :3])


def error(end: End) -> float:
    """The largest relative error of a component of the velocity."""
    known = references.load(NAME)[0]
    return float(np.abs((np.ravel(end.velocity) - known.high[:3] - known.low[:3]) / known.high[:3]).max())


PROBLEMS = [
    Problem(
        id="Robertson",
        title="a force with the rates of Robertson's reaction",
        span=SPAN,
        metric="largest error of a component of the velocity, relative",
        build=build,
        ours=[
            Ours("implicit", "core:implicit", {"rtol": 10.0**-p, "atol": 10.0**-p * SMALL})
            for p in (3, 4, 6, 8, 10, 12, 13)
        ],
        error=error,
        slope=Slope((1.0, 0.0, 0.0, 0.0, 0.0, 0.0), make, ends, jacobian),
        peers={
            "scipy": [
                *(("Radau", 10.0**-p, SMALL) for p in (3, 4, 6, 8, 10, 12)),
                *(("LSODA", 10.0**-p, SMALL) for p in (6, 9, 12)),
                ("BDF", 1e-6, SMALL),
            ],
        },
        bars=[Bar("on or ahead of SciPy Radau's front", "front", peer="SciPy Radau", method="implicit")],
        notes="heyoka's Taylor series, without implicit steps, took minutes for the answer, and is left out.",
        short=0.1,
    )
]
