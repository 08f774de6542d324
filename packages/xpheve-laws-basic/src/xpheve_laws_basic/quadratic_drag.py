"""Air resistance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from xpheve.laws import FieldLaw, Param
from xpheve_laws_basic.columns import DRAG_AREA

if TYPE_CHECKING:
    from xpheve.laws.view import BodyView


class QuadraticDrag(FieldLaw):
    """Quadratic drag: F = -1/2 rho C_d A |v| v.

    Holds in a fluid at rest for Reynolds numbers of about 1e3 to 2e5, where C_d of a sphere is nearly constant, and
    speeds well below that of sound. A is the area of the body seen along its way, pi r^2 for a sphere; it does not
    turn with the body.

    Every object needs ``drag_area`` (``PhysicalObject(..., drag_area=0.01)``): there is no area that would be right
    for all, and one of 0 would leave the drag out without a word. An object without it stops the run with an error
    at the first evaluation. 0 is allowed, and means none.

    Benefits and drawbacks: right for balls, cars and people in air, where ``basic:linear_drag`` is not; slow flow, the drag crisis
    and the speed of sound are outside. ``basic:wind`` is this law in a fluid that moves.

    Units: density rho [kg/m^3], C_d [1], area A [m^2], velocity v [m/s], force [N]. There is no potential; the work
    is reported.

    Cost: one evaluation a step, some fifteen operations and a square root a body; O(n) for n bodies.
    Accuracy: as exact as the stepper; order 2 in dt with the midpoint.

    Source: G. K. Batchelor, An Introduction to Fluid Dynamics (1967), section 5.11; the density is that of the
    International Standard Atmosphere, ISO 2533 (1975).
    """

    id = "basic:quadratic_drag"
    role = "drag"
    columns = {"drag_area": DRAG_AREA}

    density = Param(1.225, unit="kg/m^3", ge=0, doc="Of the fluid; the default is air at sea level and 15 C.")
    coefficient = Param(0.47, unit="1", ge=0, doc="C_d; the default is that of a smooth sphere.")

    def force(self, body: BodyView) -> Any:
        """Drag on each body [N]."""
        return -0.5 * self.density * self.coefficient * body.drag_area * body.velocity.norm() * body.velocity
