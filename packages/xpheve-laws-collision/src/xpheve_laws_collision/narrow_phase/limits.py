"""Which shapes the floats of this geometry can tell apart, and which not: sizes, and ratios of sizes.

Contact points, faces and edges are told apart by parts of the sizes of the pair (`clipping.SAME`, `cores.COPLANAR`): a body thinner
than those has no two sides.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from xpheve.errors import ContactError
from xpheve_laws_collision.narrow_phase.cores import KEPT, Core, cores_of

FLAT = 1e8  # times as large as one of the two is thick: 1e-9 of that are a tenth of it
ROUND = 1e10  # times as large as the radius of a core without faces: 1e-12 of that are a hundredth of it
SMALLEST, LARGEST = 1e-60, 1e60  # [m] of which products of four lengths are floats


class Extent(NamedTuple):
    """Greatest reach [m] of a shape, and the greatest reach [m] of a pair of which it may be one."""

    reach: float
    most: float


NONE = Extent(0.0, math.inf)
"""Of a plane, a point, a mesh: their geometry has no such limit."""

_known: dict[int, tuple[Any, Extent]] = {}


def extent_of(shape: Any) -> Extent:
    """How large ``shape`` is, and how large the two of a pair may be.

    Raises
    ------
    ContactError
        If it is too large, too small or too thin for floats.
    """
    held = _known.get(id(shape))
    if held is not None and held[0] is shape:
        return held[1]
    if len(_known) >= KEPT:
        _known.clear()
    found = _extent(shape)
    _known[id(shape)] = (shape, found)
    return found


def _extent(shape: Any) -> Extent:
    if shape.kind == "plane" or has_mesh(shape) or getattr(shape, "radius", 1.0) == 0.0:
        return NONE
    reach = float(shape.reach)
    if not SMALLEST <= reach <= LARGEST:
        raise ContactError(
            f"{shape!r} reaches {reach:.3g} m from its centre: contacts are computed from {SMALLEST:g} to {LARGEST:g} m. "
            "Choose other units of length"
        )
    if shape.kind == "sphere":
        return Extent(reach, math.inf)
    try:
        with np.errstate(all="ignore"):
            most = min(_most(core) for core in cores_of(shape))
    except (ValueError, ZeroDivisionError, IndexError):
        most = math.nan
    if not reach <= most:
        raise ContactError(
            f"{shape!r} is too thin for its size of {reach:.3g} m: contacts are computed of bodies up to {FLAT:g} times as large "
            "as they are thick. Make it thicker, or of several parts, or a Plane"
        )
    return Extent(reach, most)


def _most(core: Core) -> float:
    """The greatest reach of a pair that ``core`` may be one of."""
    if not core.solid:
        return ROUND * core.radius
    if len(core.normals) < 4:
        return math.nan
    heights = core.vertices @ core.normals.T
    return FLAT * float((heights.max(axis=0) - heights.min(axis=0)).min())


def has_mesh(shape: Any) -> bool:
    """Whether ``shape`` is a mesh, or has one among its parts."""
    return shape.kind == "mesh" or (shape.kind == "compound" and any(has_mesh(part.shape) for part in shape.parts))


def too_far_apart(large: Any, small: Any) -> str:
    """Say why contacts of the two cannot be computed, and the way out."""
    return (
        f"{large!r} reaches {extent_of(large).reach:.3g} m, beside which {small!r} has no shape in floats (it meets bodies of up to "
        f"{extent_of(small).most:.3g} m). Make the large one smaller, of several parts or a Plane, or the small one a Sphere or a point"
    )
