"""A heavy symmetric top, held at one point, for 20 s.

Inertia (1, 1, 0.5) kg m^2 about that point, weight times arm 4 N m, 20 rad/s about its axis, let go.

It nutates with cusps. The answer was made in quadruple precision; a test holds it against the closed form by elliptic
functions.

Source: L. D. Landau, E. M. Lifshitz, Mechanics (3rd ed. 1976), section 35, problem 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

import xpheve as xp
from benchmarks import references
from benchmarks.smooth.problem import Bar, End, Problem, Slope, steps, tolerances
from benchmarks.smooth.turning import angle, quaternion_rate, to_body, to_world

NAME, SPAN = "heavy_top", 20.0
INERTIA = (1.0, 1.0, 0.5)
TURNING = (0.0, 0.0, 20.0)
UP = (0.0, 2.4, 3.2)  # [N m] weight times arm, upwards: the axis leans by atan(3/4), and begins along z


class HeavyTop(xp.FieldLaw):
    """Torque of the weight of a top held at a point of its axis: e x (-M), with the axis e and M = weight times arm, upwards."""

    id = "benchmarks:heavy_top"

    weight = xp.Param(UP, unit="N m", doc="M.")
    axis = xp.Param((0.0, 0.0, 1.0), unit="1", doc="e in the frame of the body.")

    def torque(self, body: Any) -> Any:
        """Torque on each body [N m]."""
        return -body.to_world(self.axis).cross(self.weight)

    def potential(self, body: Any) -> Any:
        """Potential energy [J]."""
        return body.to_world(self.axis).dot(self.weight)


def build(engine: Any) -> Sequence[Any]:
    """The top; its place stays where it is, as no force acts."""
    top = xp.PhysicalObject(mass=1.0, inertia=INERTIA, angular_velocity=TURNING)
    return [engine.add_object(top, laws=[engine.add_law(HeavyTop)])]


def make(sqrt: Any) -> Any:
    """The slope of (q, w in the body's frame)."""
    i1, _, i3 = INERTIA

    def slope(t: Any, y: Any) -> Any:
        q, w = (y[0], y[1], y[2], y[3]), (y[4], y[5], y[6])
        m = to_body(q, UP)
        rate = quaternion_rate(q, w)
        return (*rate, ((i1 - i3) * w[1] * w[2] + m[1]) / i1, ((i3 - i1) * w[2] * w[0] - m[0]) / i1, 0.0 * w[2])

    return slope


def ends(y: Any) -> End:
    """The state of the slope as an end."""
    q = np.array([float(c) for c in y[:4]])
    w = to_world(q / np.linalg.norm(q), [float(c) for c in y[4:7]])
    zero = np.zeros((1, 3))
    return End(zero, zero, q[None], np.array(w)[None])


def error(end: End) -> float:
    """Angle [rad] from the exact orientation."""
    known = references.load(NAME)[0]
    return angle(end.orientation, known.high[:4], known.low[:4])


def _parts(orientation: Any, turning: Any) -> tuple[Any, Any]:
    """Energy, and angular momentum along the weight, in long double."""
    long = np.longdouble
    q, w, up = np.asarray(orientation, long).ravel(), np.asarray(turning, long).ravel(), np.array(UP, long)
    q = q / np.sqrt(q @ q)
    body, m = np.array(to_body(q, w)), np.array(to_body(q, up))
    moments = np.array(INERTIA, long)
    return (moments * body * body).sum() / 2 + m[2], (moments * body * m).sum()


BEGIN = _parts((1.0, 0.0, 0.0, 0.0), TURNING)


def drift(end: End) -> float:
    """Change of the energy over the energy."""
    return float(_parts(end.orientation, end.turning)[0] / BEGIN[0] - 1)


def momentum(end: End) -> float:
    """Change of the angular momentum about the vertical, relative."""
    return abs(float(_parts(end.orientation, end.turning)[1] / BEGIN[1] - 1))


PROBLEMS = [
    Problem(
        id="heavy top",
        title="a heavy symmetric top, 20 s",
        span=SPAN,
        metric="angle from the exact orientation [rad]",
        build=build,
        ours=[
            *tolerances("core:adaptive", 6, 9, 12, 13),
            *steps("core:symplectic8", SPAN, 500, 1000, 2000, 4000),
            *steps("core:midpoint", SPAN, 2000, 20_000),
        ],
        error=error,
        drift=drift,
        slope=Slope((1.0, 0.0, 0.0, 0.0, *TURNING), make, ends),
        peers={"scipy": [("DOP853", 1e-6), ("DOP853", 1e-9), ("DOP853", 1e-13)], "heyoka": [1e-6, 1e-9, 1e-12, 0.0]},
        bars=[
            Bar("energy to 1e-12 at rtol 1e-13", "drift", error=1e-12, method="adaptive", setting="rtol 1e-13"),
            Bar(
                "momentum to 1e-12 at rtol 1e-13",
                "value",
                method="adaptive",
                setting="rtol 1e-13",
                key="momentum about the vertical",
                ratio=1e-12,
            ),
        ],
        measures={"momentum about the vertical": momentum},
        short=0.5,
    )
]
