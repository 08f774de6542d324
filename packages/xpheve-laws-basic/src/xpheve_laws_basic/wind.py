"""Air resistance in a wind."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from xpheve.laws import FieldLaw, Param
from xpheve_laws_basic.columns import DRAG_AREA

if TYPE_CHECKING:
    from xpheve.laws.view import BodyView


class Wind(FieldLaw):
    """Quadratic drag towards a uniform wind: F = -1/2 rho C_d A |u| u, where u = v - w.

    Holds in a fluid that moves at the velocity w everywhere, for Reynolds numbers (of the speed |u|) of about 1e3 to 2e5,
    where C_d of a sphere is nearly constant, and |u| well below the speed of sound. The wind has no gusts and does not
    fall off towards the ground; set ``velocity`` while the engine runs for a wind that changes. A is the area seen along
    u, pi r^2 for a sphere; it does not turn with the body. Every object needs ``drag_area``, as with
    ``basic:quadratic_drag``.

    Benefits and drawbacks: with w = 0 this is ``basic:quadratic_drag``, which saves a subtraction; the wind brings its
    own air resistance, so map one of the two, not both. ``basic:linear_drag`` is for creeping flow, and knows no wind.

    Units: density rho [kg/m^3], C_d [1], area A [m^2], velocities [m/s], force [N]. There is no potential; the work is
    reported.

    Cost: one evaluation a step, some twenty operations and a square root a body; O(n) for n bodies.
    Accuracy: as exact as the stepper; order 2 in dt with the midpoint.

    Source: G. K. Batchelor, An Introduction to Fluid Dynamics (1967), section 5.11; in the frame of the moving fluid by
    Galileo's principle.
    """

    id = "basic:wind"
    role = "drag"
    columns = {"drag_area": DRAG_AREA}

    velocity = Param((5.0, 0.0, 0.0), unit="m/s", doc="w, velocity of the fluid; world frame.")
    density = Param(1.225, unit="kg/m^3", ge=0, doc="Of the fluid; the default is air at sea level and 15 C.")
    coefficient = Param(0.47, unit="1", ge=0, doc="C_d; the default is that of a smooth sphere.")

    def force(self, body: BodyView) -> Any:
        """Drag on each body [N]."""
        u = body.velocity - self.velocity
        return -0.5 * self.density * self.coefficient * body.drag_area * u.norm() * u
