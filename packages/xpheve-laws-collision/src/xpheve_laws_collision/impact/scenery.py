"""Fixed shapes as rows of numbers for the impact loop."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xpheve.kernels.quaternion import rotate
from xpheve.kernels.vector import dot

Array = NDArray[np.float64]
WIDTH = 24
KIND, CENTRE, ROTATION, SIZES, REACH = 0, 1, 4, 13, 16
"""Where a row has its kind; its centre [m], or a plane's unit normal; its rotation, row by row; its sizes [m], or a plane's level; its reach [m]."""
SPHERE, PLANE, BOX, CAPSULE = range(4)
AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def scenery_rows(shapes: Sequence[Any], bodies: Any, rows: Sequence[int]) -> Array:
    """The numbers of fixed ``shapes``, which stand where ``rows`` do, shape (rows, `WIDTH`)."""
    found = np.zeros((len(rows), WIDTH))
    for line, shape, row in zip(found, shapes, rows, strict=True):
        position, q = bodies.get("position", row), bodies.get("orientation", row)
        line[CENTRE : CENTRE + 3] = position
        line[ROTATION : ROTATION + 9] = np.array([rotate(q, axis) for axis in AXES]).T.ravel()
        if shape.kind == "plane":
            normal = rotate(q, shape.normal)
            line[KIND], line[CENTRE : CENTRE + 3] = PLANE, normal
            line[SIZES], line[REACH] = dot(normal, position) + shape.offset, np.inf
        elif shape.kind == "box":
            line[KIND], line[SIZES : SIZES + 3] = BOX, [0.5 * edge for edge in shape.size]
            line[REACH] = shape.reach
        elif shape.kind == "capsule":
            line[KIND], line[SIZES : SIZES + 2] = CAPSULE, (shape.radius, 0.5 * shape.length)
            line[REACH] = shape.reach
        else:
            line[KIND], line[SIZES], line[REACH] = SPHERE, shape.radius, shape.radius
    return found
