"""Which pairs may touch: a filter that leaves out only those that cannot."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Rows = NDArray[np.int64]
SLACK = 1e-9  # of all lengths at hand: far above the rounding of the filter, far below what it could cost
FEW = 12  # below this many, asking each is quicker than filtering


class BroadPhase:
    """Leaves out partners that a sphere flying on as it does cannot reach before a horizon.

    All flights are parabolas; with the same acceleration two approach along a straight line, so that the closest approach is known.
    """

    def __init__(self, world: Any) -> None:
        self.world = world
        self._at = -1
        self._acceleration: NDArray[np.float64] = np.zeros((3, 0))
        self._radius: NDArray[np.float64] = np.zeros(0)

    def _refresh(self) -> bool:
        """Gather accelerations and radii anew if rows changed; False if a stepper's flights are not known here."""
        bodies = self.world.bodies
        if self._at == bodies.change:
            return True
        n = bodies.count
        if len(self._radius) != n:
            self._radius = np.array([_reach(obj) for obj in bodies.objects])
        self._acceleration = np.zeros((3, n))
        for batch in self.world.batches:
            if batch.state.count:
                if "acceleration" not in batch.state.arrays:
                    return False
                self._acceleration[:, batch.state.rows] = batch.state.arrays["acceleration"]
        self._at = bodies.change
        return True

    def forget(self) -> None:
        """Rows came or went."""
        self._at, self._radius = -1, np.zeros(0)

    def near(self, row: int, partners: Rows, horizon: float) -> Rows:
        """Those of ``partners`` that ``row`` may meet within ``horizon`` [s] after its last re-base."""
        if len(partners) < FEW or not self._refresh():
            return partners
        bodies = self.world.bodies
        base, offset = bodies.clock[0], bodies.clock[1]
        ahead = np.maximum((base[partners] - base[row]) + (offset[partners] - offset[row]), 0.0)
        behind = np.maximum((base[row] - base[partners]) + (offset[row] - offset[partners]), 0.0)
        gap2 = np.zeros(len(partners))
        closing = np.zeros(len(partners))
        speed2 = np.zeros(len(partners))
        bend2 = np.zeros(len(partners))
        size2 = np.zeros(len(partners))
        x, v, a = bodies.arrays["position"], bodies.arrays["velocity"], self._acceleration
        for k in range(3):
            own = x[k, row] + ahead * (v[k, row] + 0.5 * ahead * a[k, row])
            other = x[k, partners] + behind * (v[k, partners] + 0.5 * behind * a[k, partners])
            d = other - own
            w = (v[k, partners] + behind * a[k, partners]) - (v[k, row] + ahead * a[k, row])
            gap2 += d * d
            closing -= d * w
            speed2 += w * w
            bend2 += (a[k, partners] - a[k, row]) ** 2
            size2 = np.maximum(size2, np.maximum(np.abs(own), np.abs(other)))
        if horizon == np.inf:
            reach = np.where(bend2 > 0.0, np.inf, 0.0)
        else:
            reach = 0.5 * np.sqrt(bend2) * horizon * horizon
        reach = reach + self._radius[row] + self._radius[partners] + SLACK * (1.0 + size2)
        with np.errstate(divide="ignore", invalid="ignore"):
            when = np.where(speed2 > 0.0, np.clip(closing / speed2, 0.0, horizon), 0.0)
            closest2 = gap2 - when * (2.0 * closing - when * speed2)
            far = closest2 > reach * reach * (1.0 + SLACK) + SLACK * gap2
        found: Rows = partners[~far]
        return found


def _reach(obj: Any) -> float:
    reach = 0.0 if obj.shape is None else obj.shape.reach
    return reach if np.isfinite(reach) else 1e300
