"""Gravity of a black hole that does not rotate, as a force of Newton's kind."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from xpheve.laws import FieldLaw, Param

if TYPE_CHECKING:
    from xpheve.laws.view import BodyView

SPEED_OF_LIGHT = 299792458.0  # [m/s], exact


class BlackHoleGravity(FieldLaw):
    """Pseudo-Newtonian gravity of a black hole: F = -G M m d / (r (r - r_s)^2), d = x - p, r = |d|, r_s = 2 G M/c^2.

    Holds for matter on nearly circular orbits around a hole without spin. As in Schwarzschild's solution, circles are stable
    outside r = 3 r_s only, are bound outside 2 r_s only, and the force is infinite at r_s. It is no relativity: speeds may
    exceed c, clocks do not slow, the perihelion far out turns by 2/3 of Einstein's angle, light is not bent as it is. The
    hole is a point of the world that nothing moves. A body at r <= r_s is an error: nothing comes back from there; remove objects
    before they fall in, for instance in a container that detects it.

    Benefits and drawbacks: beside ``basic:universal_gravity`` with a fixed mass it has the last stable orbit and the infall; far out
    both agree to 2 r_s/r. Beside an integration of geodesics it costs no more than Newton's force, and any other force may act too; errors
    of some ten per cent in frequencies and energies close to the hole are its price.

    Units: mass M [kg], point p [m], G [m^3/(kg s^2)], force [N]; the potential is -G M m/(r - r_s) [J], 0 far out.

    Cost: one evaluation a step, some twenty operations, a square root and two divisions a body; O(n) for n bodies.
    Accuracy: the force is exact to rounding in r - r_s; trajectories are as exact as the stepper, order 2 in dt with the midpoint.

    Source: B. Paczynski, P. J. Wiita, Astron. Astrophys. 88, 23 (1980); M. A. Abramowicz, Astron. Astrophys. 500, 213 (2009);
    G of CODATA 2018, mass of the Sun by the IAU's G M (2015 resolution B3).
    """

    id = "basic:black_hole_gravity"
    role = "gravity"
    singular = "At and inside the Schwarzschild radius 2 G M/c^2 there is no force: remove objects before they fall in"

    mass = Param(1.98841e30, unit="kg", ge=0, doc="M of the hole; the default is the Sun's.")
    position = Param((0.0, 0.0, 0.0), unit="m", doc="p, where the hole is; world frame.")
    gravitational_constant = Param(6.67430e-11, unit="m^3/(kg s^2)", ge=0, doc="G; relative uncertainty 2.2e-5.")
    speed_of_light = Param(
        SPEED_OF_LIGHT, unit="m/s", gt=0, doc="c; less of it makes a larger hole, for a scene on a table."
    )

    @property
    def schwarzschild_radius(self) -> Any:
        """r_s = 2 G M/c^2 [m]."""
        return 2.0 * self.gravitational_constant * self.mass / self.speed_of_light**2

    def force(self, body: BodyView) -> Any:
        """Force on each body [N]; NaN at and inside r_s."""
        d = body.position - self.position
        r, gap = self._distances(d)
        return -self.gravitational_constant * self.mass * body.mass / (r * gap**2) * d

    def potential(self, body: BodyView) -> Any:
        """Potential energy [J], 0 far out; NaN at and inside r_s."""
        _, gap = self._distances(body.position - self.position)
        return -self.gravitational_constant * self.mass * body.mass / gap

    def _distances(self, d: Any) -> tuple[Any, Any]:
        """Distance [m] from the hole and from its horizon; the latter NaN where there is none."""
        r = d.norm()
        return r, np.where(r > self.schwarzschild_radius, r - self.schwarzschild_radius, np.nan)
