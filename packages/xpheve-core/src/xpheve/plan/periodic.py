"""What cannot live in a periodic scene, refused by name: what knows one image of each object. The arithmetic is in `xpheve.periodic`."""

from __future__ import annotations

import math
from typing import Any

from xpheve.errors import InvalidValueError, LawDefinitionError
from xpheve.kernels.quaternion import rotate
from xpheve.kernels.vector import Vec
from xpheve.laws import ContinuousLaw, FlowLaw, LawContainer, PairLaw, PhysicalLaw
from xpheve.laws.combinations import leaves
from xpheve.laws.conditions import Crosses

ALONG = 1e-12
"""A plane whose unit normal leans this little towards a periodic axis lies along it, but for rounding."""


def check_law(law: PhysicalLaw) -> None:
    """Raise `LawDefinitionError` if ``law`` acts along the way by where objects are, and does not say ``periodic = True``."""
    if not isinstance(law, ContinuousLaw) or law.periodic:
        return
    why = _why_not(law)
    if why:
        raise LawDefinitionError(
            f"{law.label()} {why}, and in a periodic scene an object is at many places at once: leave the law out, or periodic=; "
            f"if it gives the same force for every image of an object, say so: periodic = True in the class {type(law).__name__}"
        )


def _why_not(law: ContinuousLaw) -> str:
    if isinstance(law, FlowLaw):
        return "is a flow, called in NumPy, of which nobody knows whether it reads positions"
    from xpheve.plan.hand_kernels import formula_of

    trace = formula_of(law)
    if trace is None:
        return "has an apply in NumPy, of which nobody knows whether it reads positions"
    if "position" in trace.reads:
        return "reads position"
    limited = isinstance(law, PairLaw) and law.reach() < math.inf
    return "has a cutoff, a distance between positions" if limited else ""


def check_container(world: Any, container: LawContainer) -> None:
    """Raise `InvalidValueError` if ``container`` waits for, or looks for, something at a place."""
    if not container.periodic:
        raise InvalidValueError(
            f"{container.label()} compares positions, and knows one image of each object: it cannot serve a periodic scene. "
            "Leave out the container, or periodic="
        )
    for leaf in leaves(container.condition):
        if hasattr(leaf, "region"):
            raise InvalidValueError(
                f"{leaf}: regions know one image of each object: they cannot serve a periodic scene. Leave out the condition, or periodic="
            )
        if isinstance(leaf, Crosses):
            _check_expression(world, leaf)


def _check_expression(world: Any, leaf: Crosses) -> None:
    from xpheve.plan.wakeups.expressions import expression_of

    if "position" in expression_of(world, leaf.expression).reads:
        raise InvalidValueError(
            f"{leaf} reads position, which jumps in a periodic scene where an object flies through a face of the box: "
            "write it of velocities, columns or time, or leave out periodic="
        )


def check_shape(obj: Any, shape: Any, box: Vec, up: Vec) -> None:
    """Raise `InvalidValueError` if ``obj`` cannot have ``shape`` in the box: a plane that is not along all periodic axes."""
    if shape is None or shape.kind != "plane":
        return
    normal = rotate(obj.orientation, up if shape.normal is None else shape.normal)
    for axis, edge, lean in zip("xyz", box, normal, strict=True):
        if edge < math.inf and abs(lean) > ALONG:
            raise InvalidValueError(
                f"{obj!r}: a plane of normal {normal} stands across {axis}, along which the scene is periodic ({edge} m): it would be "
                f"there again every {edge} m. Leave out the plane, or the period: periodic=(..., None, ...)"
            )


__all__ = ["check_container", "check_law", "check_shape"]
