"""A satellite that turns under the gradient of gravity, and is pulled a little off its orbit by it.

8 orbits, and as many turns.

Force and torque follow from one potential, U = -mu m / r - mu (tr I - 3 r I r / r^2) / (2 r^3), so that energy and
the angular momentum of orbit and spin together are conserved. The answer was made in quadruple precision.

Source: P. C. Hughes, Spacecraft Attitude Dynamics (1986), sections 8.1 and 8.2 (MacCullagh's formula and the torque).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

import xpheve as xp
from benchmarks import references
from benchmarks.smooth.problem import Bar, End, Problem, Slope, steps, tolerances
from benchmarks.smooth.turning import angle, quaternion_rate, to_body, to_world

NAME, SPAN = "gravity_gradient", 50.0
INERTIA = (2 / 256, 4 / 256, 5 / 256)  # their sums and differences are exact in float64
PLACE, VELOCITY, TURNING = (1.0, 0.0, 0.0), (0.0, 1.05, 0.1), (0.1, 0.2, 1.1)


class GravityGradient(xp.FieldLaw):
    """Attraction to the origin of a body with extent, to the second order in its size over the distance."""

    id = "benchmarks:gravity_gradient"

    mu = xp.Param(1.0, unit="m^3/s^2", ge=0, doc="mu of what is in the origin.")

    def force(self, body: Any) -> Any:
        """Force on each body [N]: -dU/dr."""
        r = body.position
        square = r.dot(r)
        fifth = square * square * np.sqrt(square)
        pulled = body.to_world(body.inertia * body.to_body(r))
        whole = body.inertia.x + body.inertia.y + body.inertia.z
        outward = 7.5 * r.dot(pulled) / square - 1.5 * whole - body.mass * square
        return self.mu / fifth * (outward * r - 3.0 * pulled)

    def torque(self, body: Any) -> Any:
        """Torque on each body [N m]: 3 mu / r^5 r x I r."""
        r = body.position
        square = r.dot(r)
        pulled = body.to_world(body.inertia * body.to_body(r))
        return 3.0 * self.mu / (square * square * np.sqrt(square)) * r.cross(pulled)

    def potential(self, body: Any) -> Any:
        """Potential energy [J]."""
        r = body.position
        square = r.dot(r)
        turned = body.to_body(r)
        whole = body.inertia.x + body.inertia.y + body.inertia.z
        quadrupole = 0.5 * (whole - 3.0 * turned.dot(body.inertia * turned) / square) / square
        return -self.mu / np.sqrt(square) * (body.mass + quadrupole)


def build(engine: Any) -> Sequence[Any]:
    """The satellite."""
    body = xp.PhysicalObject(mass=1.0, inertia=INERTIA, position=PLACE, velocity=VELOCITY, angular_velocity=TURNING)
    return [engine.add_object(body, laws=[engine.add_law(GravityGradient)])]


def make(sqrt: Any) -> Any:
    """The slope of (x, v, q, w in the body's frame)."""
    i1, i2, i3 = INERTIA

    def slope(t: Any, y: Any) -> Any:
        q, w = (y[6], y[7], y[8], y[9]), (y[10], y[11], y[12])
        r = (y[0], y[1], y[2])
        square = r[0] * r[0] + r[1] * r[1] + r[2] * r[2]
        fifth = square * square * sqrt(square)
        b = to_body(q, r)
        pulled = (i1 * b[0], i2 * b[1], i3 * b[2])
        p = to_world(q, pulled)
        outward = 7.5 * (r[0] * p[0] + r[1] * p[1] + r[2] * p[2]) / square - 1.5 * (i1 + i2 + i3) - square
        ax, ay, az = (
            (outward * r[0] - 3.0 * p[0]) / fifth,
            (outward * r[1] - 3.0 * p[1]) / fifth,
            (outward * r[2] - 3.0 * p[2]) / fifth,
        )
        t1 = 3.0 * (b[1] * pulled[2] - b[2] * pulled[1]) / fifth
        t2 = 3.0 * (b[2] * pulled[0] - b[0] * pulled[2]) / fifth
        t3 = 3.0 * (b[0] * pulled[1] - b[1] * pulled[0]) / fifth
        rate = quaternion_rate(q, w)
        return (
            *(y[3], y[4], y[5], ax, ay, az),
            *rate,
            ((i2 - i3) * w[1] * w[2] + t1) / i1,
            ((i3 - i1) * w[2] * w[0] + t2) / i2,
            ((i1 - i2) * w[0] * w[1] + t3) / i3,
        )

    return slope


def ends(y: Any) -> End:
    """The state of the slope as an end."""
    values = np.array([float(c) for c in y])
    q = values[6:10] / np.linalg.norm(values[6:10])
    return End(values[None, :3], values[None, 3:6], q[None], np.array(to_world(q, values[10:]))[None])


def error(end: End) -> float:
    """Angle [rad] from the exact orientation, or distance [m] from the exact place if that is larger."""
    known = references.load(NAME)[0]
    off = float(np.linalg.norm(np.ravel(end.position) - known.high[:3] - known.low[:3]))
    return max(off, angle(end.orientation, known.high[6:10], known.low[6:10]))


def _parts(end: End) -> tuple[Any, Any]:
    """Energy, and angular momentum of orbit and spin, in long double."""
    long = np.longdouble
    assert end.orientation is not None and end.turning is not None
    x, v, q, w = (np.asarray(one, long).ravel() for one in end)
    q = q / np.sqrt(q @ q)
    moments, turned, body = np.array(INERTIA, long), np.array(to_body(q, x)), np.array(to_body(q, w))
    square = x @ x
    quadrupole = (moments.sum() - 3 * (turned * moments * turned).sum() / square) / (2 * square)
    energy = (v @ v + (moments * body * body).sum()) / 2 - (1 + quadrupole) / np.sqrt(square)
    return energy, np.cross(x, v) + np.array(to_world(q, moments * body))


BEGIN = _parts(End(np.array(PLACE), np.array(VELOCITY), np.array([1.0, 0.0, 0.0, 0.0]), np.array(TURNING)))


def drift(end: End) -> float:
    """Change of the energy over the energy."""
    return float(_parts(end)[0] / BEGIN[0] - 1)


def momentum(end: End) -> float:
    """Change of the angular momentum, relative."""
    off = _parts(end)[1] - BEGIN[1]
    return float(np.sqrt(off @ off) / np.sqrt(BEGIN[1] @ BEGIN[1]))


PROBLEMS = [
    Problem(
        id="gravity gradient",
        title="a satellite under the gradient of gravity, 8 orbits",
        span=SPAN,
        metric="angle from the exact orientation [rad], or distance from the exact place [m]",
        build=build,
        ours=[
            *tolerances("core:adaptive", 6, 9, 12, 13),
            *steps("core:symplectic8", SPAN, 1000, 2000, 4000, 8000),
            *steps("core:midpoint", SPAN, 5000, 50_000),
        ],
        error=error,
        drift=drift,
        slope=Slope((*PLACE, *VELOCITY, 1.0, 0.0, 0.0, 0.0, *TURNING), make, ends),
        peers={"scipy": [("DOP853", 1e-6), ("DOP853", 1e-9), ("DOP853", 1e-13)], "heyoka": [1e-6, 1e-9, 1e-12, 0.0]},
        bars=[
            Bar("energy to 1e-12 at rtol 1e-13", "drift", error=1e-12, method="adaptive", setting="rtol 1e-13"),
            Bar(
                "momentum to 1e-12 at rtol 1e-13",
                "value",
                method="adaptive",
                setting="rtol 1e-13",
                key="angular momentum",
                ratio=1e-12,
            ),
        ],
        measures={"angular momentum": momentum},
        short=0.5,
    )
]
