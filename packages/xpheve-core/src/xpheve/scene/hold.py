"""Driven objects of a scene file: taken hold of as they moved when it was written, or sent on the way that it says."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from xpheve.errors import InvalidValueError
from xpheve.forces import Vec
from xpheve.kernels.flight import turn_uniformly
from xpheve.objects import Quat, quaternion

if TYPE_CHECKING:
    from xpheve.objects import PhysicalObject
    from xpheve.scene.model import ObjectTable

UNIT_LENGTH = 1e-14  # |q|^2 this near to 1 is rounding of a run and kept to the bit; what people round off is farther
ASTRAY = 1e-6  # of the way: what rounding leaves is far less, and who changes one number of a way goes farther astray


def take_hold(obj: PhysicalObject, table: ObjectTable) -> None:
    """Drive ``obj`` as its ``table`` says, to the bit of what was written."""
    there = table.arrival
    if there is None:
        obj.drive()
        return
    if not table.model_fields_set & {"velocity", "angular_velocity"}:
        obj.carry(there.position, there.orientation, within=there.within)
        return
    q = quaternion(there.orientation, "arrival: orientation")
    if abs(math.fsum(x * x for x in there.orientation) - 1.0) <= UNIT_LENGTH:
        q = there.orientation
    _check_way(obj, there.position, q, there.within)
    obj.engine.drive(obj, until=(there.position, q, there.within))


def _check_way(obj: PhysicalObject, position: Vec, orientation: Quat, within: float) -> None:
    """Raise unless the velocities of ``obj`` lead to ``position`` and ``orientation``."""
    ends = [x + within * v for x, v in zip(obj.position, obj.velocity, strict=True)]
    miss = math.hypot(*(a - b for a, b in zip(ends, position, strict=True)))
    size = max(1.0, *map(abs, (*obj.position, *position)), within * math.hypot(*obj.velocity))
    turned = turn_uniformly(obj.orientation, obj.angular_velocity, within)
    alike = abs(math.fsum(a * b for a, b in zip(turned, orientation, strict=True)))
    if not (miss <= ASTRAY * size and 1.0 - alike <= ASTRAY):
        raise InvalidValueError(
            f"arrival: at its velocities it comes to {tuple(ends)} after {within} s, not to {position}, or turned otherwise; "
            "leave velocity and angular_velocity out, and they follow from the arrival"
        )
