"""Where the moving sources of one-sided laws are, as polynomials that loops evaluate at any instant: sampled from their steppers to rounding."""

from __future__ import annotations

import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from xpheve.kernels.clock import NEVER, Instant, elapsed, later
from xpheve.kernels.course import HEAD
from xpheve.plan.scouts import Scout, may_be_scouted
from xpheve.plan.wakeups.motion import Motion, motion_of
from xpheve.steppers.contract import Array, Rows

DEGREE = 24
ROUNDING = 2e-15  # last coefficients against the largest
NOISY = 8.0  # times the difference between neighbouring floats of time: shorter pieces say no more than that
PACES = 64.0  # in a window of a source that is known without end
MOST = 256  # pieces that are kept for many steps
SHORTEST = 2.0**-30  # of the window: no shorter pieces are made


class Piece(NamedTuple):
    """The way from ``begin`` on for ``span`` [s].

    ``coefficients`` are Chebyshev's of positions and velocities, (6, `DEGREE` + 1); or position, velocity and acceleration, (9,), of a parabola.
    """

    begin: Instant
    span: float
    coefficients: Array


class Courses:
    """The ways of ``rows`` of the engine, that move and act on a batch by one-sided laws.

    The way of a row is cut into windows, and a window into pieces, by the flight of the row alone: so that what is found for a time does
    not depend on who asked before, or where a run stopped.
    """

    def __init__(self, world: Any, rows: Rows) -> None:
        self.world, self.rows = world, rows
        self.changes = 0
        """Goes up when pieces change."""
        self._seen: tuple[int, ...] = ()
        self._windows: dict[int, dict[float, list[Piece]]] = {}
        """By row, then by the beginning of the window [s]; of rows that are not scouted."""
        self._scouts: dict[int, Scout] = {}
        """By row."""
        self._scouted = 0

    def reach(self, begin: Instant, end: Instant, least: Instant) -> Instant:
        """Follow all from ``begin`` on to ``end``; until when all are followed: at least to the end of a window, and to ``least``.

        The steps of sources that are stepped are found ahead (`xpheve.plan.scouts`), where that can be done.
        """
        known = self._scout(begin, end, least)
        plain = [row for row in self.rows.tolist() if row not in self._scouts]
        versions = (*plain, *self.world.bodies.version[plain].tolist())
        if versions != self._seen:
            self._seen, self._windows = versions, {row: {} for row in plain}
            self.changes += 1
        for row, windows in self._windows.items():
            known = min(known, self._follow(row, windows, begin, end, least))
        return known

    def _scout(self, begin: Instant, end: Instant, least: Instant) -> Instant:
        """`reach` for the rows whose steps are found ahead."""
        world, known = self.world, end
        self._scouts = {}
        numbers = world.bodies.batch[self.rows]
        changes = 0
        for number in np.unique(numbers).tolist():
            batch = world.batches[number]
            if not may_be_scouted(world, batch):
                continue
            if batch.scout is None:
                batch.scout = Scout(world, batch, self._way)
            rows = self.rows[numbers == number].tolist()
            known = min(known, batch.scout.reach(rows, begin, end, least))
            self._scouts.update(dict.fromkeys(rows, batch.scout))
            changes += batch.scout.changes + number
        if changes != self._scouted:
            self._scouted = changes
            self.changes += 1
        return known

    def _way(self, row: int) -> list[Piece]:
        """The pieces of the present step of ``row``."""
        motion = motion_of(self.world, self.world.bodies.objects[row])
        if motion.curve is None:
            return [self._parabola(row, motion)]
        return self._pieces(row, motion.begin, later(motion.begin, motion.span))

    def _follow(
        self, row: int, windows: dict[float, list[Piece]], begin: Instant, end: Instant, least: Instant
    ) -> Instant:
        motion = motion_of(self.world, self.world.bodies.objects[row])
        at, wanted = begin, []
        while True:
            low, high = _window(motion, at)
            first = low[0] + low[1]
            wanted.append(first)
            if first not in windows:
                self.changes += 1
                straight = motion.curve is None
                windows[first] = [self._parabola(row, motion)] if straight else self._pieces(row, low, high)
            at = high
            count = sum(len(windows[one]) for one in wanted)
            if math.isfinite(motion.span) or at >= end or (at >= least and count >= MOST):
                break
            if least <= begin:
                break
        for one in [one for one in windows if one not in wanted]:
            del windows[one]
            self.changes += 1
        return min(at, end)

    def _parabola(self, row: int, motion: Motion) -> Piece:
        """All of a way under constant acceleration: as exact as the flight itself, however long."""
        x, v = (self.world.read_row(row, name, motion.begin) for name in ("position", "velocity"))
        return Piece(motion.begin, motion.span, np.array([*x, *v, *motion.a]))

    def _pieces(self, row: int, begin: Instant, end: Instant) -> list[Piece]:
        """Pieces, halved until each is resolved to rounding, from ``begin`` to ``end``."""
        span = elapsed(end, begin)
        found: list[Piece] = []
        waiting = [(0.0, span)]
        while waiting:
            first, length = waiting.pop()
            at = later(begin, first)
            coefficients = self._resolved(
                row, at, length, length <= SHORTEST * span or len(found) + len(waiting) >= MOST
            )
            if coefficients is not None:
                found.append(Piece(at, length, coefficients))
            else:
                waiting += [(first + 0.5 * length, 0.5 * length), (first, 0.5 * length)]
        return found

    def _resolved(self, row: int, begin: Instant, length: float, last: bool) -> Array | None:
        """The coefficients of a piece; None if it is to be halved, and is not the ``last``."""
        nodes, matrix = _chebyshev()
        times = 0.5 * length * (nodes + 1.0)
        values = self._read(row, begin, times)
        coefficients: Array = values @ matrix.T
        left = np.abs(coefficients[:, -3:]).max(axis=1)
        largest = np.abs(coefficients).max(axis=1)
        if last or (left <= ROUNDING * largest).all():
            return coefficients
        late = math.ulp(abs(begin[0]) + length)
        noise = NOISY * np.abs(self._read(row, begin, times - np.copysign(late, times - 0.5 * length)) - values).max(
            axis=1
        )
        return coefficients if (left <= np.maximum(noise, ROUNDING * largest)).all() else None

    def _read(self, row: int, begin: Instant, times: Array) -> Array:
        """Position and velocity at ``times`` [s] since ``begin``, (6, n)."""
        read = self.world.read_row
        instants = [later(begin, s) for s in times.tolist()]
        return np.array([(*read(row, "position", t), *read(row, "velocity", t)) for t in instants]).T

    def numbers(self, places: dict[int, int]) -> Array:
        """What `xpheve.kernels.course` reads; ``places`` says which row of a loop each row is."""
        head: list[float] = []
        parts: list[Array] = []
        at = HEAD * len(self.rows)
        for row in self.rows.tolist():
            if row in self._scouts:
                pieces = [piece for leg in self._scouts[row].legs for piece in leg.ways[row]]
            else:
                windows = self._windows[row]
                pieces = [piece for first in sorted(windows) for piece in windows[first]]
            straight = pieces[0].coefficients.ndim == 1
            head += [float(places[row]), float(len(pieces)), -2.0 if straight else float(DEGREE), float(at)]
            for one in pieces:
                begin = one.begin if straight else (one.begin[0] + one.begin[1], 2.0 / one.span)
                parts.append(np.concatenate([begin, one.coefficients.ravel()]))
                at += len(parts[-1])
        return np.concatenate([np.array(head), *parts])


def _window(motion: Motion, t: Instant) -> tuple[Instant, Instant]:
    """The window of ``motion`` that holds ``t``: all of it, if it ends; else one of a row that the motion alone decides."""
    if math.isfinite(motion.span):
        return motion.begin, later(motion.begin, motion.span)
    if motion.curve is None:
        return motion.begin, NEVER
    now = t[0] + t[1]
    width = 2.0 ** math.ceil(math.log2(PACES * motion.curve.pace()))
    first = math.floor(now / width) * width
    return max((first, 0.0), motion.begin), (first + width, 0.0)


@cache
def _chebyshev() -> tuple[Array, Array]:
    """Points of the first kind, and the matrix that makes coefficients of values there (`xpheve.plan.wakeups.crossings`)."""
    from xpheve.plan.wakeups.crossings import NODES, TO_COEFFICIENTS

    assert len(NODES) == DEGREE + 1
    nodes: Array = NODES
    matrix: Array = np.asarray(TO_COEFFICIENTS, dtype=float)
    return nodes, matrix
