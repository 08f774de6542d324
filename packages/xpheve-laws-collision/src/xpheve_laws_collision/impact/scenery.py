"""Fixed shapes as rows of numbers for the impact loop."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from xpheve.kernels.quaternion import rotate
from xpheve.kernels.vector import dot
from xpheve_laws_collision.impact.rows import BOX, CAPSULE, CENTRE, KIND, PLANE, SCENERIES, SIZE, SPHERE, TURN

Array = NDArray[np.float64]
REACH = SIZE + 3
"""Where a row has the shape's reach [m]."""
STANDING = ("position", "orientation", "mass", "inertia")
"""What laws may read of a fixed body."""
AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Surroundings(NamedTuple):
    """What flights are among: fixed shapes, and who shares which law with whom.

    Attributes
    ----------
    rows
        Fixed shapes, (m, `SCENERIES`).
    masks
        Bits of the laws of each that answer, and of those that listen (2, m).
    bodies
        Their numbers as laws read them, those of `STANDING`, (m, 11).
    columns
        Their columns by name, (m,).
    place_masks
        As ``masks``, of what flies.
    laws_of_bit
        Numbers of the laws of the bits; -1 for those that only listen.
    """

    rows: Array
    masks: NDArray[np.int64]
    bodies: Array
    columns: dict[str, Array]
    place_masks: NDArray[np.int64]
    laws_of_bit: list[int]

    def mark(self) -> int:
        """A number that is another one where shapes or masks are; what laws answer does not count."""
        found = zlib.crc32(self.rows.tobytes())
        for masks in (self.masks, self.place_masks):
            found = zlib.crc32(np.ascontiguousarray(masks).tobytes(), found)
        return found

    def read(self) -> tuple[Any, ...]:
        """What of it laws read."""
        return (
            self.bodies.tobytes(),
            {name: values.tobytes() for name, values in self.columns.items()},
            self.laws_of_bit,
        )


def scenery_rows(shapes: Sequence[Any], bodies: Any, rows: Sequence[int]) -> Array:
    """The numbers of fixed ``shapes``, which stand where ``rows`` do, shape (rows, `SCENERIES`)."""
    found = np.zeros((len(rows), SCENERIES))
    for line, shape, row in zip(found, shapes, rows, strict=True):
        position, q = bodies.get("position", row), bodies.get("orientation", row)
        line[CENTRE : CENTRE + 3] = position
        line[TURN : TURN + 9] = np.array([rotate(q, axis) for axis in AXES]).T.ravel()
        if shape.kind == "plane":
            normal = rotate(q, shape.normal)
            line[KIND], line[CENTRE : CENTRE + 3] = PLANE, normal
            line[SIZE], line[REACH] = dot(normal, position) + shape.offset, np.inf
        elif shape.kind == "box":
            line[KIND], line[SIZE : SIZE + 3] = BOX, [0.5 * edge for edge in shape.size]
            line[REACH] = shape.reach
        elif shape.kind == "capsule":
            line[KIND], line[SIZE : SIZE + 2] = CAPSULE, (shape.radius, 0.5 * shape.length)
            line[REACH] = shape.reach
        else:
            line[KIND], line[SIZE], line[REACH] = SPHERE, shape.radius, shape.radius
    return found
