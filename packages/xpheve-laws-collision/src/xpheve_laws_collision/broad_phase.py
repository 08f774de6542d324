"""Which pairs may touch before a given time: only those are asked for their exact instant.

Nothing here decides an outcome: a pair that is named too often costs a prediction, and none that may meet is left out.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from xpheve.kernels.clock import Instant
from xpheve.laws.response import ALL_GROUPS
from xpheve_laws_collision.what_is_ahead import SLACK, WhatIsAhead, extremes, plane_facts

if TYPE_CHECKING:
    from xpheve_laws_collision.server.curves import Curves

Rows = NDArray[np.int64]
Array = NDArray[np.float64]

MANY = 48  # from this many moving bodies on, pairs are found window by window
USUAL = (1, int(ALL_GROUPS))  # collision group and mask of bodies that were given none
FAR = 1e140  # [m] the squares of lengths up to this have a sum
BULLETS = 16  # so many bodies may be far faster than the others
PART = 0.25  # of the mean distance between bodies that they fly through in a window: few pairs, seldom asked


class _Flights(NamedTuple):
    """Clocks (2, rows), places, velocities and accelerations (3, rows), and bounds [m/s^2] on what bends rows besides; None if nothing does."""

    clock: Array
    x: Array
    v: Array
    a: Array
    bend: Array | None


class BroadPhase:
    """Rows that somebody asks contacts of, and where they may get to while they fly on as they do.

    What flies on a curve is taken as straight from where its window begins, with a bound on the acceleration that bends it.
    """

    def __init__(self, world: Any, curves: Curves) -> None:
        self.world = world
        self.curves = curves
        self._curved: list[int] = []
        """Rows that fly on curves, of those that somebody asks contacts of."""
        self._followed: Rows = np.zeros(0, dtype=np.int64)
        """Those whose windows are known: by versions of their flights, until when [s], and as what they begin."""
        self._seen: Rows = np.zeros(0, dtype=np.int64)
        self._ends: Array = np.zeros(0)
        self._tangents: Array = np.zeros((9, 0))
        """Instant (2), place (3), velocity (3), and a bound [m/s^2] on the acceleration."""
        self._structure = -1
        self._change = -1
        self.fixed = WhatIsAhead(self)
        self._numbers: dict[Any, int] = {}
        self._stale = True
        self._rows: Rows = np.zeros(0, dtype=np.int64)
        self.planes: list[Any] = []
        """Unbounded bodies with contact laws."""
        self._moving = 0
        self._mask: NDArray[np.uint64] = np.zeros(0, dtype=np.uint64)
        """By row: the laws that hear contacts, a bit each; 0 where there are none."""
        self._groups: NDArray[np.uint64] = np.zeros((2, 0), dtype=np.uint64)
        """By row: the collision groups a body is in, and those it meets, a bit each."""
        self._grouped = 0
        """How many rows have others than the usual ones."""
        self._bounded: NDArray[np.bool_] = np.zeros(0, dtype=bool)
        self.radii: Array = np.zeros(0)
        self.accelerations: Array = np.zeros((3, 0))

    def gather(self, laws_of: Any, rows: Any) -> None:
        """Take up what ``rows`` hold; all rows if laws, containers or mapping changed. ``laws_of(obj)`` are those that hear contacts."""
        world = self.world
        if len(self._mask) < world.bodies.count:
            size = world.bodies.capacity
            self._mask, self._bounded, self.radii = (
                np.concatenate([old, np.zeros(size - len(old), dtype=old.dtype)])
                for old in (self._mask, self._bounded, self.radii)
            )
            usual = np.tile(np.array(USUAL, dtype=np.uint64)[:, None], size - self._groups.shape[1])
            self._groups = np.concatenate([self._groups, usual], axis=1)
        if self._structure != world.structure:
            self._structure = world.structure
            self._numbers, self.planes = {}, []
            self._mask[:] = 0
            rows = range(world.bodies.count)
        objects = world.bodies.objects
        for row in rows:
            self._take(row, objects[row], laws_of)

    def _take(self, row: int, obj: Any, laws_of: Any) -> None:
        mask = 0
        if obj.rank >= 0:
            for law in laws_of(obj):
                mask |= 1 << (self._numbers.setdefault(law, len(self._numbers)) % 63)
        bounded = obj.shape is None or obj.shape.reach < np.inf
        radius = 0.0 if obj.shape is None or not bounded else obj.shape.reach
        if mask and not bounded and obj not in self.planes:
            self.planes.append(obj)
        if mask != self._mask[row] or bounded != self._bounded[row]:
            self._stale = True
        own = obj._columns
        groups = (int(own.get("group", USUAL[0])), int(own.get("mask", USUAL[1]))) if own else USUAL
        self._put_groups(row, groups)
        self._mask[row], self._bounded[row], self.radii[row] = mask, bounded, radius

    def _put_groups(self, row: int, groups: tuple[int, int]) -> None:
        held = (int(self._groups[0, row]), int(self._groups[1, row]))
        if held != groups:
            self._grouped += (groups != USUAL) - (held != USUAL)
            self._groups[:, row] = groups

    def joint(self, i: Any, j: Any) -> NDArray[np.bool_]:
        """Whether rows ``i`` and ``j`` have a law in common, and are in groups that meet."""
        found: NDArray[np.bool_] = (self._mask[i] & self._mask[j]) != 0
        if self._grouped:
            found &= ((self._groups[0, i] & self._groups[1, j]) != 0) & ((self._groups[1, i] & self._groups[0, j]) != 0)
        return found

    def forget(self) -> None:
        """Other objects are asked from now on: take up all rows."""
        self._structure = -1

    def removed(self, obj: Any, row: int, moved: int) -> None:
        """Row ``row`` has what row ``moved`` had."""
        if moved < len(self._mask):
            for array in (self._mask, self._bounded, self.radii):
                array[row] = array[moved]
            self._mask[moved] = 0
            self._put_groups(row, (int(self._groups[0, moved]), int(self._groups[1, moved])))
            self._put_groups(moved, USUAL)
        self.planes = [plane for plane in self.planes if plane is not obj]
        self._stale = True
        self._change = -1
        self._followed = np.zeros(0, dtype=np.int64)

    @property
    def rows(self) -> Rows:
        """Bounded bodies with contact laws."""
        if self._stale:
            n = self.world.bodies.count
            self._rows = np.flatnonzero((self._mask[:n] != 0) & self._bounded[:n])
            self._moving = int((~self.world.bodies.fixed[self._rows]).sum())
            self._stale = False
        return self._rows

    @property
    def moving(self) -> int:
        """How many of them move."""
        return self._moving if len(self.rows) else 0

    def knows_flights(self) -> bool:
        """Gather accelerations anew if rows changed; False if a stepper's flights are not known as arrays."""
        bodies = self.world.bodies
        if self._change == bodies.change and self.accelerations.shape[1] == bodies.count:
            return True
        self.accelerations = np.zeros((3, bodies.count))
        for batch in self.world.batches:
            if batch.state.count:
                if "acceleration" not in batch.state.arrays:
                    return False
                self.accelerations[:, batch.state.rows] = batch.state.arrays["acceleration"]
        self._curved = self._on_curves()
        self._change = bodies.change
        return True

    def _on_curves(self) -> list[int]:
        """The rows that fly on curves, of those that somebody asks contacts of."""
        found: list[int] = []
        for batch in self.world.batches:
            if batch.state.count and self.world.flight(int(batch.state.rows[0])).curved:
                rows = batch.state.rows
                found += rows[self._mask[rows] != 0].tolist()
        return found

    def _straight(self) -> _Flights:
        """What `_out_of_reach` goes by: flights as the bodies have them, but of rows on curves."""
        bodies, n = self.world.bodies, self.world.bodies.count
        found = _Flights(bodies.clock, bodies.arrays["position"], bodies.arrays["velocity"], self.accelerations, None)
        if not self._curved:
            return found
        rows = self._follow()
        clock, x, v, a = (array[:, :n].copy() for array in found[:4])
        bend = np.zeros(n)
        kept = self._tangents
        clock[:, rows], x[:, rows], v[:, rows], a[:, rows], bend[rows] = kept[:2], kept[2:5], kept[5:8], 0.0, kept[8]
        return _Flights(clock, x, v, a, bend)

    def _follow(self) -> Rows:
        """The rows on curves, of which `_tangents` says how they enter their windows: found anew where flight or window are others."""
        world, rows = self.world, np.array(self._curved, dtype=np.int64)
        if len(self._followed) != len(rows) or (self._followed != rows).any():
            self._followed, self._seen = rows, np.full(len(rows), -1, dtype=np.int64)
            self._tangents, self._ends = np.zeros((9, len(rows))), np.zeros(len(rows))
        versions = world.bodies.version[rows]
        for k in np.flatnonzero((versions != self._seen) | (self._ends <= world.time[0])).tolist():
            row = int(rows[k])
            obj, flight = world.bodies.objects[row], world.flight(row)
            course = self.curves.course(obj, flight)
            if course is None:  # of its next step, when that is made
                tangent: Any = (*flight.t0, *flight.position, *flight.velocity, 0.0)
            else:
                tangent = (*course.begin, *self.curves.tangent(obj, course.begin, flight), course.most())
            self._tangents[:, k] = tangent
            self._seen[k], self._ends[k] = versions[k], -np.inf if course is None else course.end[0]
        return rows

    def _at(self, rows: Rows, t: Instant) -> tuple[Array, Array, Array]:
        """Positions, velocities and accelerations of ``rows`` at ``t``, (3, rows)."""
        bodies = self.world.bodies
        s = (t[0] - bodies.clock[0, rows]) + (t[1] - bodies.clock[1, rows])
        x, v, a = bodies.arrays["position"][:, rows], bodies.arrays["velocity"][:, rows], self.accelerations[:, rows]
        x, v = x + s * (v + 0.5 * s * a), v + s * a
        for row in self._curved:
            place = int(np.searchsorted(rows, row))
            if place < len(rows) and rows[place] == row:
                obj = bodies.objects[row]
                x[:, place], v[:, place], a[:, place] = self.curves.centre(obj, t, self.world.flight(row))
        return x, v, a

    def _bent(self, rows: Rows) -> Array | None:
        """Bounds [m/s^2] on the accelerations of ``rows`` that fly on curves, 0 of others; None if none does."""
        if not self._curved:
            return None
        found = np.zeros(self.world.bodies.count)
        curved = self._follow()
        found[curved] = self._tangents[8]
        bends: Array = found[rows]
        return bends

    def near(self, row: int, horizon: float, fixed: bool = True) -> Rows:
        """The rows that ``row`` may meet within ``horizon`` [s] after its last re-base, or the beginning of its window on a curve.

        Those that move only, if not ``fixed``.
        """
        n = self.world.bodies.count
        joint = self.joint(slice(0, n), row)
        joint &= self._bounded[:n]
        joint[row] = False
        if not fixed or self.world.bodies.fixed[row]:
            joint &= ~self.world.bodies.fixed[:n]
        crowded = 2 * int(np.count_nonzero(joint)) > n
        which: slice | Rows = slice(0, n) if crowded else np.flatnonzero(joint)
        if (n if crowded else len(which)) < 12 or not self.knows_flights():  # type: ignore[arg-type]
            return np.flatnonzero(joint)
        far = self._out_of_reach(row, which, horizon)
        if crowded:
            joint &= ~far
            return np.flatnonzero(joint)
        found: Rows = which[~far]  # type: ignore[index]
        return found

    def _out_of_reach(self, row: int, which: slice | Rows, horizon: float) -> NDArray[np.bool_]:
        """Which of ``which`` the row cannot meet, by the closest approach of straight relative paths and what bends them."""
        bodies = self.world.bodies
        clock, x, v, a, curve = self._straight()
        late = (clock[0, which] - clock[0, row]) + (clock[1, which] - clock[1, row])
        shared = len(late) > 0 and bool((late == late[0]).all())
        since: Any = float(late[0]) if shared else late  # one number where all were re-based together
        behind, ahead = np.maximum(-since, 0.0), np.maximum(since, 0.0)
        gap2: Any = 0.0
        closing: Any = 0.0
        speed2: Any = 0.0
        bend2: Any = 0.0
        size = 0.0
        with np.errstate(
            all="ignore"
        ):  # what is beyond floats is infinite or no number here, and then not out of reach
            for k in range(3):  # a component at a time: its arrays stay in the cache, and are not fresh pages each time
                own_x = x[k, row] + ahead * (v[k, row] + 0.5 * ahead * a[k, row])
                d = x[k, which] + behind * (v[k, which] + (0.5 * behind) * a[k, which]) - own_x
                w = v[k, which] + behind * a[k, which] - (v[k, row] + ahead * a[k, row])
                bend = a[k, which] - a[k, row]
                gap2, speed2, bend2 = gap2 + d * d, speed2 + w * w, bend2 + bend * bend
                closing = closing - d * w
                size = max(size, float(d.max()), float(-d.min())) + 2.0 * abs(float(x[k, row]))
            radius = self.radii[: bodies.count][which]
            reach = self.radii[row] + radius + SLACK * (1e-3 * size + radius)
            bent = bend2 > 0.0
            if bent.any():
                reach[bent] += 0.5 * np.sqrt(bend2[bent]) * horizon * horizon if horizon < np.inf else np.inf
                if curve is not None:
                    own, others = curve[row] * (horizon + ahead) ** 2, curve[which] * (horizon + behind) ** 2
                    reach += 0.5 * (np.nan_to_num(own, posinf=np.inf) + np.nan_to_num(others, posinf=np.inf))
            when = np.where(speed2 > 0.0, np.clip(closing / speed2, 0.0, horizon), 0.0)
            closest2 = gap2 - when * (2.0 * closing - when * speed2)
            far: NDArray[np.bool_] = closest2 > reach * reach * (1.0 + SLACK) + SLACK * gap2
        return far

    def window(self) -> float:
        """A length [s] of time in which bodies fly a part of the way to their neighbours."""
        if not self.knows_flights() or not len(self.rows):
            return np.inf
        x, v, a = self._at(self.rows, self.world.time)
        moving = ~self.world.bodies.fixed[self.rows]
        extent = np.ptp(x, axis=1)
        spread = np.maximum(extent, extent.max() * 1e-3)
        with np.errstate(over="ignore"):
            distance = max(float(np.prod(spread ** (1 / 3)) / len(self.rows) ** (1 / 3)), float(self.radii.max()))
        spacing = PART * distance
        speeds, bends = (_sizes(one[:, moving] - _common(one[:, moving])) for one in (v, a))
        times = [_window(speeds, distance), math.sqrt(2.0 * _window(bends, distance))]
        falling = [float(np.median(_sizes(one[:, moving]))) for one in (v, a)]
        if self.planes:
            times += [8 * spacing / falling[0] if falling[0] else np.inf]
            times += [math.sqrt(16 * spacing / falling[1]) if falling[1] else np.inf]
        return min(times)

    def sweep(self, span: float) -> tuple[list[tuple[int, int]], list[tuple[int, int]]] | None:
        """Pairs of bounded rows, and pairs of a row and a number of a plane, that may touch within ``span`` [s] from now.

        Boxes about the paths, seen from the mean motion (which changes no pair's relative motion), sorted along one axis.
        """
        if not self.knows_flights():
            return None
        rows = self.rows
        x, v, a = self._at(rows, self.world.time)
        moving = ~self.world.bodies.fixed[rows]
        bends = self._bent(rows)
        extra = np.zeros(len(rows))
        if bends is not None:
            a = np.where(bends > 0.0, 0.0, a)
            extra = np.nan_to_num(0.5 * bends * (span * span), posinf=np.inf)
        pairs_of_planes = self._near_planes(x, v, a, moving, span, extra)
        if moving.all():
            v = v - _common(v)
            a = a - _common(a)
        low, high = extremes(x, v, a, span)
        margin = self.radii[rows] * (1.0 + SLACK) + SLACK * np.abs(x).max(axis=0)
        if extra.any():  # what has no bound may be wherever another is
            widest = float((high + margin).max() - (low - margin).min())
            margin = margin + np.minimum(extra, widest)
        low, high = low - margin, high + margin
        k = _best_axis(low, high)
        order = np.argsort(low[k], kind="stable")
        low, high, moving, rows = low[:, order], high[:, order], moving[order], rows[order]
        last = np.searchsorted(low[k], high[k], side="right")
        counts = np.maximum(last - np.arange(len(rows)) - 1, 0)
        found: list[tuple[int, int]] = []
        for begin in range(0, len(rows), 2048):
            part = slice(begin, min(begin + 2048, len(rows)))
            first = np.repeat(np.arange(part.start, part.stop), counts[part])
            if not len(first):
                continue
            starts = np.repeat(np.cumsum(counts[part]) - counts[part], counts[part])
            second = first + 1 + (np.arange(len(first)) - starts)
            keep = moving[first] | moving[second]
            for axis in range(3):
                if axis != k:
                    keep &= (low[axis, first] <= high[axis, second]) & (low[axis, second] <= high[axis, first])
            i, j = rows[first[keep]], rows[second[keep]]
            joint = self.joint(i, j)
            found += zip(i[joint].tolist(), j[joint].tolist(), strict=True)
        return found, pairs_of_planes

    def _near_planes(
        self, x: Array, v: Array, a: Array, moving: Any, span: float, extra: Array
    ) -> list[tuple[int, int]]:
        found: list[tuple[int, int]] = []
        for number, plane in enumerate(self.planes):
            normal, level = plane_facts(self.world, plane)
            low, _ = extremes((normal @ x)[None, :], (normal @ v)[None, :], (normal @ a)[None, :], span)
            reach = level + self.radii[self.rows] * (1.0 + SLACK) + SLACK * np.abs(x).max(axis=0) + extra
            joint = self.joint(self.rows, plane._row)
            found += [(row, number) for row in self.rows[(low[0] <= reach) & moving & joint].tolist()]
        return found


def _best_axis(low: Array, high: Array) -> int:
    """The axis along which boxes are spread most, beside their widths; lengths beyond `FAR` count as that."""
    with np.errstate(over="ignore", invalid="ignore"):
        middles, widths = np.clip(low + high, -FAR, FAR), np.clip(high - low, 1e-300, FAR)
    return int(np.argmax(np.nan_to_num(middles).std(axis=1) / widths.mean(axis=1)))


def _common(vectors: Array) -> Array:
    """The motion (3, 1) that most of ``vectors`` (3, n) have in common: the median, which one that is 1e12 times as fast does not move."""
    middle: Array = np.median(vectors, axis=1, keepdims=True)
    return middle


def _sizes(vectors: Array) -> Array:
    """Lengths (n,) of vectors (3, n), infinite where no float holds them."""
    with np.errstate(over="ignore"):
        lengths: Array = np.hypot(np.hypot(vectors[0], vectors[1]), vectors[2])
    return lengths


def _window(rates: Array, distance: float) -> float:
    """The time in which bodies go `PART` of the mean ``distance`` between them, on average.

    Up to `BULLETS` that are far faster than the others count little: each may pass all others in a window, which costs a prediction
    for each, where windows as short as it asks for would never end.
    """
    ordered = np.sort(rates)[::-1]
    count = len(ordered)
    cap = PART * count / (BULLETS + 1)  # distances that one body counts at most
    with np.errstate(over="ignore", invalid="ignore"):
        rest = np.append(np.cumsum(ordered[::-1])[::-1], 0.0)  # of those from the k-th on
    for fast in range(min(BULLETS, count) + 1):
        if rest[fast] == 0.0:
            return math.inf
        span = distance * (PART * count - fast * cap) / float(rest[fast])
        if fast == count or float(ordered[fast]) * span <= cap * distance:
            return span
    return span
