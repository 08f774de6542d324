"""Buoyancy in a fluid at rest."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from xpheve.laws import FieldLaw, Param
from xpheve_laws_basic.columns import DISPLACED_VOLUME, volume_of

if TYPE_CHECKING:
    from xpheve.laws.view import BodyView


class Buoyancy(FieldLaw):
    """Archimedes' buoyancy: F = rho g V_i up, where V_i is the volume immersed.

    Holds for a fluid at rest of uniform density under uniform gravity, as deep and as wide as needed. Without ``surface``
    everything is wholly immersed, V_i = V. With ``surface``, the height over the origin along the scene's up, a sphere of
    radius R that reaches h deep displaces the cap V_i = pi h^2 (3 R - h)/3, exactly, and V when it is below. An object of
    another shape, and a point, counts as the sphere of its volume around its centre of mass: exact above and below the
    surface, an approximation in it. The force acts at the centre of mass, so that nothing is turned upright.

    V is the volume of the object's shape; ``PhysicalObject(..., displaced_volume=0.01)`` says otherwise, and must for a
    point. The mass of the fluid that moves along (added mass) and its resistance are left out; for the second map
    ``basic:quadratic_drag`` too, with the density of the fluid. Weight is not in it: map ``basic:planet_gravity``.

    Benefits and drawbacks: beside a stored force (0, 0, rho g V) it knows the surface and has a potential. It knows no
    waves, no walls and no righting moment, so a ship does not heel with it.

    Units: density rho [kg/m^3], acceleration g [m/s^2], volume V [m^3], heights [m], force [N]; the potential [J] is 0 for a body
    above the surface, and at the height of the origin if there is no surface.

    Cost: none along the way without a surface: the force is stored once. With one, an evaluation a step of some twenty operations
    and a cubic root a body, and a call a body for its volume; O(n) for n bodies.
    Accuracy: exact without a surface; with one as exact as the stepper, order 2 in dt with the midpoint: the force has a kink in
    its second derivative where a sphere leaves the surface.

    Source: Archimedes, On Floating Bodies, book I, propositions 5 to 7; volume of a cap: Archimedes, On the Sphere and Cylinder, book
    II; L. D. Landau, E. M. Lifshitz, Fluid Mechanics (2nd ed. 1987), section 2; density of fresh water at 4 C.
    """

    id = "basic:buoyancy"
    role = "buoyancy"
    columns = {"displaced_volume": DISPLACED_VOLUME}
    singular = "It needs a shape with a volume, or PhysicalObject(..., displaced_volume=...) in m^3"

    density = Param(1000.0, unit="kg/m^3", ge=0, doc="rho of the fluid; the default is fresh water.")
    acceleration = Param(9.81, unit="m/s^2", ge=0, doc="g of the planet.")
    surface = Param(None, unit="m", doc="Height of the surface along up; none: all is immersed.")

    def force(self, body: BodyView) -> Any:
        """Buoyancy of each body [N]."""
        volume = volume_of(body)
        if self.surface is not None:
            volume = self._cap(body, volume)
        return self.density * self.acceleration * volume * body.up

    def potential(self, body: BodyView) -> Any:
        """Potential energy [J]: the work to push the body down to where it is."""
        volume = volume_of(body)
        if self.surface is None:
            return -self.density * self.acceleration * volume * body.position.dot(body.up)
        radius, depth = self._depth(body, volume)
        # The integral of the cap over its height h is pi h^3 (4 R - h)/12; at h = 2 R it is V R.
        partly = np.clip(depth, 0.0, 2.0 * radius)
        lifted = np.pi / 12.0 * partly**3 * (4.0 * radius - partly)
        return self.density * self.acceleration * (lifted + volume * np.maximum(depth - 2.0 * radius, 0.0))

    def _cap(self, body: BodyView, volume: Any) -> Any:
        """Volume [m^3] immersed, shape (n, 1)."""
        radius, depth = self._depth(body, volume)
        partly = np.clip(depth, 0.0, 2.0 * radius)
        return np.where(depth >= 2.0 * radius, volume, np.pi / 3.0 * partly**2 * (3.0 * radius - partly))

    def _depth(self, body: BodyView, volume: Any) -> tuple[Any, Any]:
        """Radius [m] of the sphere of each volume, and how deep [m] its lowest point is."""
        radius = np.cbrt(0.75 / np.pi * volume)
        return radius, self.surface + radius - body.position.dot(body.up)
