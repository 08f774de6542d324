"""Lift on a spinning ball."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from xpheve.laws import FieldLaw, Param
from xpheve_laws_basic.columns import DISPLACED_VOLUME, volume_of

if TYPE_CHECKING:
    from xpheve.laws.view import BodyView


class Magnus(FieldLaw):
    """Magnus force on a spinning ball: F = C rho V w x v.

    Holds for balls in a fluid at rest. C = 3/4, the default, is the theory for a sphere at Reynolds numbers well below 1: F = pi
    rho r^3 w x v. For balls of sports (Reynolds numbers of 1e4 to 1e5, r w/v below about 0.3) the lift measured is about
    1/2 rho pi r^2 v (r w), which is C = 3/8; it depends on the surface, and may even turn round on a smooth ball near the drag crisis.
    The torque by which the fluid slows the spin is left out.

    V is the volume of the object's shape; ``PhysicalObject(..., displaced_volume=0.01)`` says otherwise, and must for a point.

    Benefits and drawbacks: linear in spin and speed, so that it is one law for slow flow and a fair fit for balls; lift
    that levels off at high spin needs a law of its own. It is no drag: map ``basic:quadratic_drag`` too.

    Units: C [1], density rho [kg/m^3], volume V [m^3], angular velocity w [rad/s], velocity v [m/s], force [N]. The force does no
    work: its potential is 0 [J].

    Cost: one evaluation a step, a dozen operations a body, and a call a body for its volume; O(n) for n bodies.
    Accuracy: as exact as the stepper; order 2 in dt with the midpoint. With w across v and no other force, the body circles with the angular
    velocity C rho V w/m.

    Source: S. I. Rubinow, J. B. Keller, J. Fluid Mech. 11, 447 (1961), equation 1; balls: R. D. Mehta, Annu. Rev. Fluid Mech. 17, 151
    (1985).
    """

    id = "basic:magnus"
    role = "lift"
    columns = {"displaced_volume": DISPLACED_VOLUME}
    singular = "It needs a shape with a volume, or PhysicalObject(..., displaced_volume=...) in m^3"

    coefficient = Param(0.75, unit="1", doc="C; 3/4 in slow flow, about 3/8 for balls of sports.")
    density = Param(1.225, unit="kg/m^3", ge=0, doc="rho of the fluid; the default is air at sea level and 15 C.")

    def force(self, body: BodyView) -> Any:
        """Lift on each body [N]."""
        return self.coefficient * self.density * volume_of(body) * body.angular_velocity.cross(body.velocity)

    def potential(self, body: BodyView) -> Any:
        """Potential energy [J]: 0, as the force is always across the velocity."""
        return 0.0
