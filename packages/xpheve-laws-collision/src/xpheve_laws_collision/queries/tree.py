"""A tree of boxes over many boxes: which of them rays may meet, for many rays at once.

Boxes near each other along a Z-order curve (Morton, IBM report, 1966) are put together by eights, and these again; the tree is gone down level by
level, all pairs of a ray and a box in one array (the breadth-first form of Kay & Kajiya, SIGGRAPH 1986).
"""

from __future__ import annotations

import numpy as np

from xpheve_laws_collision.queries.rows import Array, Mask, Rows

FAN = 8
TOP = 16  # boxes on the highest level, at most
BITS = 10  # of each coordinate along the curve


class Tree:
    """Boxes (n, 3) low and high, in the order of the curve."""

    def __init__(self, low: Array, high: Array) -> None:
        self.order: Rows = np.argsort(_curve(0.5 * (low + high)), kind="stable") if len(low) else np.zeros(0, np.int64)
        self.levels: list[tuple[Array, Array]] = [(low[self.order], high[self.order])]
        while len(self.levels[-1][0]) > TOP:
            below, above = self.levels[-1]
            starts = np.arange(0, len(below), FAN)
            self.levels.append((np.minimum.reduceat(below, starts), np.maximum.reduceat(above, starts)))

    def met_by(self, origin: Array, direction: Array, length: Array) -> tuple[Rows, Rows]:
        """Pairs of a ray and a box that it meets within its length: numbers of rays, numbers of boxes as given."""
        inverse = inverses(direction)
        low, high = self.levels[-1]
        ray = np.repeat(np.arange(len(origin)), len(low))
        box = np.tile(np.arange(len(low)), len(origin))
        for level in range(len(self.levels) - 1, -1, -1):
            low, high = self.levels[level]
            hit = meets(origin[ray], inverse[ray], length[ray], low[box], high[box])
            ray, box = ray[hit], box[hit]
            if level:
                ray = np.repeat(ray, FAN)
                box = (box[:, None] * FAN + np.arange(FAN)).reshape(-1)
                inside = box < len(self.levels[level - 1][0])
                ray, box = ray[inside], box[inside]
        return ray, self.order[box]


def inverses(direction: Array) -> Array:
    """1 / direction, finite also where a component is 0: so large that only what lies in the slab passes."""
    return np.asarray(1.0 / np.where(np.abs(direction) < 1e-300, 1e-300, direction))


def meets(origin: Array, inverse: Array, length: Array, low: Array, high: Array) -> Mask:
    """Whether each ray meets its box, by slabs."""
    with np.errstate(over="ignore", invalid="ignore"):
        near: Array = np.zeros(len(origin))
        far = length
        for k in range(3):
            one = (low[:, k] - origin[:, k]) * inverse[:, k]
            two = (high[:, k] - origin[:, k]) * inverse[:, k]
            near = np.maximum(near, np.minimum(one, two))
            far = np.minimum(far, np.maximum(one, two))
        return np.asarray(near <= far)


def _curve(centre: Array) -> Rows:
    """Places along the Z-order curve."""
    low = centre.min(axis=0)
    extent = float(np.ptp(centre, axis=0).max())
    scale = (2**BITS - 1) / extent if extent > 0.0 else 0.0
    cells = np.minimum((centre - low) * scale, 2**BITS - 1).astype(np.int64)
    code = np.zeros(len(centre), dtype=np.int64)
    for bit in range(BITS):
        for k in range(3):
            code |= ((cells[:, k] >> bit) & 1) << (3 * bit + k)
    return code
