"""Periodic space: a box whose opposite faces are one; what cannot live in it is refused by name.

Rows hold any image of an object, so that a flight through a face is no event and changes no bit. Who reads gets the image in [0, L):
remainders of floats are exact from 0 up, and below 0 to half an ulp of L (Allen & Tildesley, Computer Simulation of Liquids, 1987, 1.5).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xpheve.errors import InvalidValueError, LawDefinitionError
from xpheve.kernels.quaternion import rotate
from xpheve.kernels.vector import Vec
from xpheve.laws import ContinuousLaw, FlowLaw, LawContainer, PairLaw, PhysicalLaw
from xpheve.laws.combinations import leaves
from xpheve.laws.conditions import Crosses

Array = NDArray[np.float64]

ALONG = 1e-12
"""A plane whose unit normal leans this little towards a periodic axis lies along it, but for rounding."""


def periods(value: Any) -> Vec | None:
    """``value`` as three edges [m] of the box, infinite where there is no period; None where there is none at all.

    Raises
    ------
    InvalidValueError
        If it is not three lengths above 0, each finite, infinite or None.
    """
    if value is None:
        return None
    given = tuple(value) if isinstance(value, (tuple, list, np.ndarray)) else ()
    if len(given) != 3:
        raise InvalidValueError(
            f"periodic = {value!r}: three lengths [m] are needed, (Lx, Ly, Lz); None along an axis without period"
        )
    x, y, z = (_period(one, value) for one in given)
    return None if x == y == z == math.inf else (x, y, z)


def _period(one: Any, whole: Any) -> float:
    if one is None:
        return math.inf
    if isinstance(one, (int, float, np.integer, np.floating)) and not isinstance(one, bool) and one > 0:
        try:
            return float(one)
        except OverflowError:
            pass
    raise InvalidValueError(f"periodic = {whole!r}: {one!r}: a length above 0 m is needed, or None for no period")


def wrapped(x: tuple[float, ...], box: Vec) -> Vec:
    """The image in the box of the place ``x`` [m]."""
    a, b, c = (_wrapped(one, edge) for one, edge in zip(x, box, strict=True))
    return a, b, c


def _wrapped(x: float, edge: float) -> float:
    if edge == math.inf:
        return x
    found = x % edge
    return 0.0 if found >= edge else found  # a little below 0 is rounded up to the far face, which is the near one


def wrap_rows(positions: Array, box: Vec) -> Array:
    """The images in the box of ``positions`` (3, n) [m], in place; to the bits of `wrapped`."""
    for row, edge in zip(positions, box, strict=True):
        if edge < math.inf:
            np.mod(row, edge, out=row)
            row[row >= edge] = 0.0
    return positions


def shortest(way: tuple[float, ...], box: Vec) -> Vec:
    """``way`` [m] from one place to the nearest image of another (minimum image)."""
    a, b, c = (one if edge == math.inf else math.remainder(one, edge) for one, edge in zip(way, box, strict=True))
    return a, b, c


def shortest_rows(ways: Array, box: Vec) -> Array:
    """Each of ``ways`` (..., 3) [m] to the nearest image; half a period may become minus half a period."""
    found = ways.copy()
    for k, edge in enumerate(box):
        if edge < math.inf:
            rest = np.fmod(found[..., k], edge)
            found[..., k] = rest - np.where(np.abs(rest) > 0.5 * edge, np.copysign(edge, rest), 0.0)
    return found


def near_image(place: Vec, beside: tuple[float, ...], box: Vec) -> Vec:
    """The image of ``place`` that is nearest to ``beside``."""
    way = shortest((place[0] - beside[0], place[1] - beside[1], place[2] - beside[2]), box)
    return beside[0] + way[0], beside[1] + way[1], beside[2] + way[2]


# What cannot live in it ---------------------------------------------------------------------------------------------------


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


__all__ = ["check_container", "check_law", "check_shape", "near_image", "periods", "shortest", "shortest_rows"]
__all__ += ["wrap_rows", "wrapped"]
