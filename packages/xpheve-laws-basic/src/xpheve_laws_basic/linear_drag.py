"""Drag in proportion to speed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from xpheve.laws import FieldLaw, Param

if TYPE_CHECKING:
    from xpheve.laws.view import BodyView


class LinearDrag(FieldLaw):
    """Linear drag: F = -b v.

    Holds for creeping flow, Reynolds numbers below about 0.1, in a fluid at rest; b = 6 pi mu r for a sphere of
    radius r in a fluid of viscosity mu (Stokes). Also the usual model of a viscous damper.

    Benefits and drawbacks: the cheapest drag, smooth everywhere, with closed forms to check against; but a
    ball in air obeys ``basic:quadratic_drag`` from a millimetre a second up. Neither knows wind: ``basic:wind`` does.

    Units: coefficient b [kg/s], velocity v [m/s], force [N]. There is no potential; the work is reported.

    Cost: one evaluation a step, three multiplications a body; O(n) for n bodies.
    Accuracy: exact, to rounding, where all that acts is linear; else as exact as the stepper; order 2 in dt with the
    midpoint, stable while b dt / m < 2.

    Source: G. G. Stokes, Trans. Camb. Phil. Soc. 9, part II, 8 (1851); G. K. Batchelor, An Introduction to Fluid
    Dynamics (1967), section 4.9.
    """

    id = "basic:linear_drag"
    role = "drag"

    coefficient = Param(1.0, unit="kg/s", ge=0, doc="b, the same for every object of the law.")

    def force(self, body: BodyView) -> Any:
        """Drag on each body [N]."""
        return -self.coefficient * body.velocity
