"""A uniform magnetic field."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from xpheve.laws import FieldLaw, Param
from xpheve_laws_basic.columns import CHARGE

if TYPE_CHECKING:
    from xpheve.laws.view import BodyView


class MagneticField(FieldLaw):
    """Uniform magnetic field: F = q v x B.

    Holds for speeds well below that of light and fields that hardly change over a gyration. The charge circles around B with the
    angular velocity -q B/m on a radius m v/(|q| B) of the speed v across B; along B it flies on freely. Radiation is left
    out. Every object needs ``charge``; 0 is a neutral one. A magnetic moment, such as that of a compass needle, is not in it.

    Benefits and drawbacks: with ``basic:electric_field`` on the same objects it makes the Lorentz force, and any other force may
    act beside it. Alone, or beside other linear forces, the circle is in closed form. Beside others it is stepped; the energy that a
    step of dt of the midpoint adds by its error is (w dt)^4/4 of the kinetic energy across B, where w = |q| B/m: with 100 steps a gyration
    4e-4 of it is gained each
    gyration.

    Units: field B [T], charge q [C], velocity v [m/s], force [N]. The force does no work: its potential is 0 [J].

    Cost: one evaluation a step, nine multiplications a body; O(n) for n bodies.
    Accuracy: exact, to rounding, where all that acts is linear; else as exact as the stepper; order 2 in dt with the midpoint, whose speed
    grows by (w dt)^4/8 a step: keep w dt < 0.1.

    Source: J. D. Jackson, Classical Electrodynamics (3rd ed. 1999), sections 5.1 and 12.2.
    """

    id = "basic:magnetic_field"
    role = "electromagnetic"
    columns = {"charge": CHARGE}

    field = Param((0.0, 0.0, 0.0), unit="T", doc="B; world frame.")

    def force(self, body: BodyView) -> Any:
        """Force on each body [N]."""
        return body.charge * body.velocity.cross(self.field)

    def potential(self, body: BodyView) -> Any:
        """Potential energy [J]: 0, as the force is always across the velocity."""
        return 0.0
