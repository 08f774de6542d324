"""A uniform electric field."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from xpheve.laws import FieldLaw, Param
from xpheve_laws_basic.columns import CHARGE

if TYPE_CHECKING:
    from xpheve.laws.view import BodyView


class ElectricField(FieldLaw):
    """Uniform electric field: F = q E.

    Holds between wide parallel plates and wherever else the field hardly changes over the way, for charges too small to move the
    charges that make the field. Neither radiation nor the forces of the objects on one another are in it; for the
    latter map ``basic:coulomb`` too. Every object needs ``charge``; 0 is a neutral one.

    Benefits and drawbacks: beside ``basic:coulomb`` with the sources as objects it costs nothing along the way and is exact, but it
    has one value for all of space. With ``basic:magnetic_field`` on the same objects it makes the Lorentz force.

    Units: field E [V/m], charge q [C], force [N]; the potential is -q E . x [J], 0 at the origin.

    Cost: none along the way; reads charge and parameters only, so that the force is stored once. O(n) for n bodies, once.
    Accuracy: exact, to rounding.

    Source: J. D. Jackson, Classical Electrodynamics (3rd ed. 1999), section 1.2.
    """

    id = "basic:electric_field"
    role = "electromagnetic"
    columns = {"charge": CHARGE}

    field = Param((0.0, 0.0, 0.0), unit="V/m", doc="E; world frame.")

    def force(self, body: BodyView) -> Any:
        """Force on each body [N]."""
        return body.charge * self.field

    def potential(self, body: BodyView) -> Any:
        """Potential energy [J], 0 at the origin."""
        return -body.charge * body.position.dot(self.field)
