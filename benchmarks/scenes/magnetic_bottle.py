"""A charge to and fro in a magnetic bottle, 20 times: B = (-x z, -y z, a^2 + z^2) / a^2 T, which has no sources.

The length a is 20 m.

The magnetic moment, m v_across^2 / (2 B), is an adiabatic invariant: it swings at each passage, but keeps its mean;
what the exact motion has in the end, the computed one should have. The answer was made in quadruple precision.

Source: J. D. Jackson, Classical Electrodynamics (3rd ed. 1999), section 12.5.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

import xpheve as xp
from benchmarks import references
from benchmarks.smooth.problem import Bar, End, Problem, Slope, steps, tolerances

NAME, LENGTH = "magnetic_bottle", 20.0
SPAN = 2500.0  # [s] some 20 times to and fro
PLACE, VELOCITY = (1.0, 0.0, 0.0), (0.0, -1.0, 1.0)


class Bottle(xp.FieldLaw):
    """F = q v x B, with B = B0 (-x z, -y z, a^2 + z^2) / a^2: twice as strong at z = a as in the middle."""

    id = "benchmarks:magnetic_bottle"
    columns: ClassVar = {"charge": xp.Column(0.0, unit="C", doc="q.")}

    field = xp.Param(1.0, unit="T", doc="B0.")
    length = xp.Param(LENGTH, unit="m", gt=0, doc="a.")

    def force(self, body: Any) -> Any:
        """Force on each body [N]."""
        x = body.position / self.length
        b = self.field * xp.vector(-x.x * x.z, -x.y * x.z, 1.0 + x.z * x.z)
        return body.charge * body.velocity.cross(b)

    def potential(self, body: Any) -> Any:
        """Potential energy [J]: 0, as the force is always across the velocity."""
        return 0.0


def build(engine: Any) -> Sequence[Any]:
    """The charge, in the middle of the bottle."""
    body = xp.PhysicalObject(mass=1.0, charge=1.0, position=PLACE, velocity=VELOCITY)
    return [engine.add_object(body, laws=[engine.add_law(Bottle)])]


def make(sqrt: Any) -> Any:
    """The slope of (x, v)."""

    def slope(t: Any, y: Any) -> Any:
        x, u, z = y[0] / LENGTH, y[1] / LENGTH, y[2] / LENGTH
        bx, by, bz = -x * z, -u * z, 1.0 + z * z
        return (y[3], y[4], y[5], y[4] * bz - y[5] * by, y[5] * bx - y[3] * bz, y[3] * by - y[4] * bx)

    return slope


def ends(y: Any) -> End:
    """The state of the slope as an end."""
    values = np.array([float(c) for c in y])
    return End(values[None, :3], values[None, 3:])


def error(end: End) -> float:
    """Distance [m] from the exact place."""
    known = references.load(NAME)[0]
    return float(np.linalg.norm(np.ravel(end.position) - known.high[:3] - known.low[:3]))


def drift(end: End) -> float:
    """Change of the energy over the energy."""
    begin, v = np.array(VELOCITY, np.longdouble), np.asarray(end.velocity, np.longdouble).ravel()
    return float((v @ v - begin @ begin) / (begin @ begin))


def moment(x: Any, v: Any) -> float:
    """The magnetic moment [J/T]."""
    s = np.asarray(x) / LENGTH
    b = np.array([-s[0] * s[2], -s[1] * s[2], 1.0 + s[2] ** 2])
    strength = math.sqrt(b @ b)
    along = (v @ b) / strength
    return float((v @ v - along * along) / (2.0 * strength))


def invariant(end: End) -> float:
    """How far the magnetic moment is from that of the exact motion at the end, relative."""
    known = references.load(NAME)[0].high
    exact = moment(known[:3], known[3:])
    return abs(moment(np.ravel(end.position), np.ravel(end.velocity)) / exact - 1.0)


PROBLEMS = [
    Problem(
        id="magnetic bottle",
        title="a charge in a magnetic bottle, to and fro 20 times",
        span=SPAN,
        metric="error of the place [m]",
        build=build,
        ours=[
            *tolerances("core:adaptive", 6, 9, 11, 13),
            *steps("core:midpoint", SPAN, 40_000, 400_000),
        ],
        error=error,
        drift=drift,
        slope=Slope((*PLACE, *VELOCITY), make, ends),
        peers={
            "scipy": [("DOP853", 1e-6), ("DOP853", 1e-9), ("DOP853", 1e-13), ("LSODA", 1e-12)],
            "heyoka": [1e-6, 1e-9, 1e-12, 0.0],
        },
        bars=[
            Bar("on or ahead of SciPy DOP853's front", "front", peer="SciPy DOP853"),
            Bar(
                "the adiabatic invariant kept to 1e-9",
                "value",
                method="adaptive",
                setting="rtol 1e-13",
                key="invariant, relative",
                ratio=1e-9,
            ),
        ],
        measures={"invariant, relative": invariant},
        short=10.0,
    )
]
