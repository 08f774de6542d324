"""A pack of one law."""

import xpheve as xp

__all__ = ["QuadraticDrag"]


class QuadraticDrag(xp.FieldLaw):
    """Quadratic drag in a fluid at rest: F = -c |v| v.

    Source: I. Newton, Principia (1687), book 2, section 2.
    """

    id = "outside:quadratic_drag"
    columns = {"drag_constant": xp.Column(0.01, unit="kg/m", ge=0, doc="c.")}  # noqa: RUF012

    def force(self, body):
        """Drag on each body [N]."""
        return -body.drag_constant * body.velocity.norm() * body.velocity
