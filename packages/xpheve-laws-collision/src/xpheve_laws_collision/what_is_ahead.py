"""What lies ahead: which fixed bodies one that moves may meet, and not before when.

Thousands of fixed boxes and planes are looked through as arrays. In the order of the earliest times only the first few have to be asked
for the exact instant: the rest comes after it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from xpheve.kernels.quaternion import rotate
from xpheve.kernels.vector import Vec
from xpheve_laws_collision.impact_time.box_times import box_times

if TYPE_CHECKING:
    from xpheve_laws_collision.broad_phase import BroadPhase

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

SLACK = 1e-9  # of all lengths at hand: far above the rounding of the filter, far below what it could cost
FEW = 12  # fewer are all asked


class WhatIsAhead:
    """The fixed bodies of a broad phase."""

    def __init__(self, broad: BroadPhase) -> None:
        self.broad = broad
        self.bodies = broad.world.bodies
        self._versions: tuple[int, ...] = ()
        self._planes: list[Any] = []
        self._facts: tuple[Array, Array] = (np.zeros((0, 3)), np.zeros(0))
        """Normals and levels of the planes."""

    def ahead(self, obj: Any, horizon: float) -> list[tuple[float, Any]]:
        """The fixed bodies and the planes that ``obj`` may meet, each with a time [s] after its last re-base before which it cannot.

        In the order of these times, up to ``horizon`` [s]. ``obj`` moves and is bounded.
        """
        planes, rows = self.broad.planes, self._bounded_with(obj._row)
        known = self.broad.knows_flights()
        found = (
            self._planes_ahead(obj._row, horizon) if known and len(planes) >= FEW else [(0.0, one) for one in planes]
        )
        if known and len(rows) >= FEW:
            found += self._boxes_ahead(obj._row, rows, horizon)
        else:
            found += [(0.0, self.bodies.objects[one]) for one in rows.tolist()]
        found.sort(key=lambda one: one[0])
        return found

    def _bounded_with(self, row: int) -> Rows:
        """Fixed bounded bodies that ``row`` has a law in common with."""
        rows = self.broad.rows
        rows = rows[self.bodies.fixed[rows]]
        found: Rows = rows[self.broad.joint(rows, row)]
        return found

    def _path(self, row: int) -> tuple[Vec, Vec, Vec]:
        """Position, velocity and acceleration of a row at its last re-base."""
        arrays = (self.bodies.arrays["position"], self.bodies.arrays["velocity"], self.broad.accelerations)
        x, v, a = ((float(one[0, row]), float(one[1, row]), float(one[2, row])) for one in arrays)
        return x, v, a

    def _boxes_ahead(self, row: int, rows: Rows, horizon: float) -> list[tuple[float, Any]]:
        """When the centre comes into the boxes about the fixed bodies, larger by what is about its own."""
        x, v, a = self._path(row)
        places, radii = self.bodies.arrays["position"][:, rows], self.broad.radii
        reach = (radii[rows] + radii[row]) * (1.0 + SLACK) + SLACK * (float(np.abs(places).max()) + max(map(abs, x)))
        if horizon < np.inf:  # most are nowhere near the path
            low, high = extremes(np.array(x)[:, None], np.array(v)[:, None], np.array(a)[:, None], horizon)
            inside = ((places + reach >= low) & (places - reach <= high)).all(axis=0)
            rows, places, reach = rows[inside], places[:, inside], reach[inside]
        first, _ = box_times(x, v, a, (places - reach).T, (places + reach).T)
        met = np.flatnonzero((first <= horizon) & (first < np.inf))
        objects = self.bodies.objects
        return [(float(first[k]), objects[int(rows[k])]) for k in met.tolist()]

    def _planes_ahead(self, row: int, horizon: float) -> list[tuple[float, Any]]:
        """When the ball about the body comes down to the planes. Of those that move nothing is said."""
        planes = self.broad.planes
        rows = np.array([plane._row for plane in planes])
        normals, levels = self._facts_of(planes, rows)
        x, v, a = (np.array(one) for one in self._path(row))
        radius = float(self.broad.radii[row])
        gap = normals @ x - levels - radius - SLACK * (np.abs(levels) + np.abs(x).max() + radius)
        speed, pull = normals @ v, normals @ a
        with np.errstate(all="ignore"):
            inside = speed * speed - 2.0 * pull * gap
            root = np.sqrt(np.maximum(inside, 0.0))
            times = np.where(speed < 0.0, 2.0 * gap / (root - speed), -(speed + root) / pull) * (1.0 - SLACK)
            never = np.where(speed < 0.0, inside < 0.0, pull >= 0.0)
        arrays = self.bodies.arrays
        moves = ~self.bodies.fixed[rows] | (arrays["velocity"][:, rows] != 0.0).any(axis=0)
        moves |= (arrays["angular_velocity"][:, rows] != 0.0).any(axis=0)
        times = np.where((gap <= 0.0) | moves, 0.0, np.where(never, np.inf, times))
        met = np.flatnonzero(self.broad.joint(rows, row) & (times <= horizon) & (times < np.inf))
        return [(float(times[k]), planes[k]) for k in met.tolist()]

    def _facts_of(self, planes: list[Any], rows: Rows) -> tuple[Array, Array]:
        """Normals and levels, gathered anew when a plane was moved."""
        versions = tuple(self.bodies.version[rows].tolist())
        if self._versions != versions or self._planes != planes:
            self._versions, self._planes = versions, list(planes)
            found = [plane_facts(self.broad.world, plane) for plane in planes]
            self._facts = (np.array([one[0] for one in found]), np.array([one[1] for one in found]))
        return self._facts


def extremes(x: Array, v: Array, a: Array, span: float) -> tuple[Array, Array]:
    """Least and greatest x + s v + s^2 a / 2 for s from 0 to ``span``."""
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):  # what flies beyond all floats ends at infinity
        end = x + span * (v + 0.5 * span * a)
        turn = np.clip(np.where(a != 0.0, -v / a, 0.0), 0.0, span)
    extreme = x + turn * (v + 0.5 * turn * a)
    return np.minimum(np.minimum(x, end), extreme), np.maximum(np.maximum(x, end), extreme)


def plane_facts(world: Any, plane: Any) -> tuple[Array, float]:
    """Outward normal and level of a plane in the world."""
    row = plane._row
    given = plane.shape.normal or world.up_vector
    normal = np.array(rotate(world.bodies.get("orientation", row), given))
    return normal, float(normal @ np.array(world.bodies.get("position", row))) + plane.shape.offset
