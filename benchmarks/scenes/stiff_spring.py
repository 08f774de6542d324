"""A damped spring, k = 1e8 N/m, m = 1 kg, for 0.1 s: 159 periods, of which a host step of 1/60 s holds 27.

And an overdamped one.

The answer is the closed form with 40 digits.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mpmath
import numpy as np

import xpheve as xp
from benchmarks.smooth.problem import Bar, End, Ours, Problem, Slope

STIFFNESS, SPAN = 1e8, 0.1
WEAK, STRONG = 20.0, 1e7  # [kg/s]; damping ratios 1e-3 and 500, of which the slow part falls by e in 0.1 s


class LinearSpring(xp.FieldLaw):
    """A spring without length to a point: F = -k (x - p)."""

    id = "benchmarks:linear_spring"

    stiffness = xp.Param(1.0, unit="N/m", ge=0, doc="k.")
    anchor = xp.Param((0.0, 0.0, 0.0), unit="m", doc="p.")

    def force(self, body: Any) -> Any:
        """Force on each body [N]."""
        return -self.stiffness * (body.position - self.anchor)

    def potential(self, body: Any) -> Any:
        """Potential energy [J]."""
        d = body.position - self.anchor
        return 0.5 * self.stiffness * d.dot(d)


def exact(damping: float, t: float) -> tuple[Any, Any]:
    """Place and velocity at ``t`` of what is let go at 1 m, with 40 digits."""
    with mpmath.workdps(40):
        half, s = mpmath.mpf(damping) / 2, mpmath.mpf(t)
        omega = mpmath.sqrt(mpmath.mpc(mpmath.mpf(STIFFNESS) - half * half))
        fall = mpmath.exp(-half * s)
        x = fall * (mpmath.cos(omega * s) + half / omega * mpmath.sin(omega * s))
        v = -fall * mpmath.mpf(STIFFNESS) / omega * mpmath.sin(omega * s)
        return x.real, v.real


def problem(damping: float, name: str) -> Problem:
    """The spring with ``damping`` [kg/s]."""
    x_end, _ = exact(damping, SPAN)

    def build(engine: Any) -> Sequence[Any]:
        spring = engine.add_law(LinearSpring, stiffness=STIFFNESS)
        drag = engine.add_law("basic:linear_drag", coefficient=damping)
        return [engine.add_object(xp.PhysicalObject(mass=1.0, position=(1.0, 0.0, 0.0)), laws=[spring, drag])]

    def error(end: End) -> float:
        with mpmath.workdps(40):
            return abs(float(mpmath.mpf(float(np.ravel(end.position)[0])) - x_end))

    def make(sqrt: Any) -> Any:
        def slope(t: Any, y: Any) -> Any:
            return (y[1], -STIFFNESS * y[0] - damping * y[1])

        return slope

    def ends(y: Any) -> End:
        return End(np.array([[float(y[0]), 0.0, 0.0]]), np.array([[float(y[1]), 0.0, 0.0]]))

    def jacobian(t: float, y: Any) -> Any:
        return np.array([[0.0, 1.0], [-STIFFNESS, -damping]])

    ours = [Ours("linear", "core:linear", {"dt": dt}) for dt in (1 / 60, 1e-3, 1e-5)]
    return Problem(
        id=f"stiff spring, {name}",
        title=f"a spring of 1e8 N/m, {name}, 0.1 s",
        span=SPAN,
        metric="error of the place [m]",
        build=build,
        ours=[*ours, Ours("linear", "core:linear", {"rtol": 1e-9}), Ours("implicit", "core:implicit", {"rtol": 1e-9})],
        error=error,
        slope=Slope((1.0, 0.0), make, ends, jacobian),
        peers={
            "scipy": [("DOP853", 1e-10), ("Radau", 1e-6), ("LSODA", 1e-10)]
            if damping == WEAK
            else [("Radau", 1e-8), ("LSODA", 1e-10)],
            "heyoka": [1e-9, 0.0],
            "mujoco": [("Euler", 1e-5), ("Euler", 1e-6), ("RK4", 1e-5), ("RK4", 1e-6)][: 4 if damping == WEAK else 2],
        },
        models={"mujoco": lambda dt, integrator: mujoco_model(damping, dt, integrator)},
        bars=[Bar("1e-12, independent of dt", "all errors", error=1e-12, method="linear")],
        short=0.01,
    )


PROBLEMS = [problem(WEAK, "weakly damped"), problem(STRONG, "overdamped")]


def mujoco_model(damping: float, dt: float, integrator: str) -> str:
    """The same as a slide joint with a spring and a damper."""
    return (
        f'<mujoco><option timestep="{dt!r}" gravity="0 0 0" integrator="{integrator}"/><worldbody><body>'
        f'<joint type="slide" axis="1 0 0" stiffness="{STIFFNESS!r}" damping="{damping!r}" springref="0"/>'
        '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>'
    )
