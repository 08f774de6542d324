"""Gravity near the ground of a planet."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from xpheve.errors import ParameterError
from xpheve.laws import FieldLaw, Param

if TYPE_CHECKING:
    from xpheve.laws.view import BodyView


class Direction(Param):
    """A vector parameter of which only the direction counts; kept at length 1."""

    def check(self, value: Any, owner: str = "") -> Any:
        """Return ``value`` scaled to length 1, or None; raises `ParameterError` for (0, 0, 0) too."""
        vector = super().check(value, owner)
        if vector is None:
            return None
        largest = max(map(abs, vector))
        if largest == 0.0:
            raise ParameterError(
                f"{owner or self.owner}.{self.name} = {value!r}: this points nowhere; give a vector other than 0"
            )
        if abs(math.hypot(*vector) - 1.0) <= 1e-15:  # scaled before: the same bits when a scene is read again
            return vector
        scaled = [component / largest for component in vector]  # so that its square neither overflows nor vanishes
        length = math.hypot(*scaled)
        return tuple(component / length for component in scaled)


class PlanetGravity(FieldLaw):
    """Uniform gravity: F = m g d, where d points down.

    Holds as long as heights are small beside the planet's radius: the neglected change of g is 2 h/R, or 0.03 % for
    each kilometre above the Earth.

    Benefits and drawbacks: free along the way and exact in closed form, which ``basic:universal_gravity`` is not; but it knows no
    distance, so it makes no orbits, and objects do not pull one another. Other planets: ``xpheve_laws_basic.planets``.

    Units: acceleration g [m/s^2], mass m [kg], force [N]; the potential is m g h [J] with the height h [m] over the
    origin.

    Cost: none along the way; reads mass and parameters only, so that the force is stored once. O(n) for n bodies, once.
    Accuracy: exact, to rounding.

    Source: I. Newton, Principia (1687), definition VIII; the default of g is that of central Europe, standard
    gravity is 9.80665 m/s^2 by the 3rd CGPM (1901).
    """

    id = "basic:planet_gravity"
    role = "gravity"

    acceleration = Param(9.81, unit="m/s^2", ge=0, doc="g of the planet.")
    direction = Direction(None, size=3, doc="Where things fall; by default against the scene's up. Any length but 0.")

    def force(self, body: BodyView) -> Any:
        """Weight of each body [N]."""
        return self.acceleration * body.mass * self._down(body)

    def potential(self, body: BodyView) -> Any:
        """Potential energy [J], 0 at the height of the origin."""
        return -self.acceleration * body.mass * body.position.dot(self._down(body))

    def _down(self, body: BodyView) -> Any:
        return -body.up if self.direction is None else self.direction
