"""The way of a centre as functions of time that many instants are asked of together: a parabola, or a curve interpolated to rounding.

A curve is cut at halves until Chebyshev's interpolants of place and velocity at 25 points are resolved to rounding; their degree is above that of
every stepper's dense output, so that a step is one piece. Pieces are made from left to right, as far as somebody asks.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from xpheve.errors import XpheveError
from xpheve.kernels.clock import Instant, elapsed, later
from xpheve.kernels.vector import Vec
from xpheve_laws_collision.impact_time.chebyshev import DERIVATIVE, NODES, TO_COEFFICIENTS, polynomials

Array = NDArray[np.float64]

ROUNDING = 1e-14  # last coefficients against the largest
LATE = 16.0  # times what the last digit of time changes: finer than that nothing is known
SHORTEST = 2.0**-40  # of the window: no shorter pieces are made
MANY = 32  # pieces from which on no bound of the whole is given


class Track(Protocol):
    """Where a centre is, s [s] after some instant."""

    def place(self, s: Array) -> Array:
        """Places [m] at many s that lie within one piece, (3, n)."""
        ...

    def speed(self, s: Array) -> Array:
        """Velocities [m/s], (3, n)."""
        ...

    def box(self, low: float, high: float) -> tuple[Array, Array]:
        """The middle [m], (3,), of a box that all places from ``low`` to ``high`` are in, which lie in one piece, and half its edges."""
        ...

    def end_after(self, s: float) -> float:
        """Where the piece ends that goes on from ``s``; infinite if there is but one, ``s`` itself if nothing is known from there on."""
        ...


class Parabola:
    """A flight under constant acceleration, or of what does not move."""

    def __init__(self, position: Vec, velocity: Vec, acceleration: Vec) -> None:
        self.x, self.v, self.a = (np.array(one)[:, None] for one in (position, velocity, acceleration))

    def place(self, s: Array) -> Array:
        found: Array = self.x + s * (self.v + 0.5 * s * self.a)
        return found

    def speed(self, s: Array) -> Array:
        found: Array = self.v + s * self.a
        return found

    def box(self, low: float, high: float) -> tuple[Array, Array]:
        half, middle = 0.5 * (high - low), np.array([0.5 * (low + high)])
        edges = half * np.abs(self.speed(middle)[:, 0]) + 0.5 * half * half * np.abs(self.a[:, 0])
        return self.place(middle)[:, 0], edges

    def end_after(self, s: float) -> float:
        return math.inf


class Piece(NamedTuple):
    """From ``low`` to ``high`` [s] of a course: Chebyshev's coefficients of place [m] and velocity [m/s], (3, 25) each."""

    low: float
    high: float
    place: Array
    speed: Array
    edges: Array
    """Half the edges [m], (3,), of a box about the whole of it."""


Read = Callable[[str, Sequence[Instant]], Array]


class Course:
    """A curve from ``begin`` to ``end``, which ``read(name, instants)`` gives as columns, (3, n)."""

    def __init__(self, read: Read, begin: Instant, end: Instant) -> None:
        self.read, self.begin, self.end = read, begin, end
        self.span = elapsed(end, begin)
        self.reads = 0
        self._most: float | None = None
        self._pieces: list[Piece] = []
        self._waiting: list[tuple[float, float]] = [(0.0, self.span)]

    def pieces(self) -> Iterator[Piece]:
        """All pieces, from left to right; made when asked for."""
        k = 0
        while k < len(self._pieces) or self._go_on():
            yield self._pieces[k]
            k += 1

    def piece_at(self, s: float, forwards: bool = True) -> Piece | None:
        """The piece that holds ``s``; at the border of two that which goes on from there, or that which ends there. None beyond what is known."""
        last = None
        for piece in self.pieces():
            if (piece.low <= s < piece.high) or (not forwards and piece.low < s <= piece.high):
                return piece
            last = piece
            if s < piece.low:
                break
        return last if last is not None and s == last.high else None

    @property
    def last(self) -> Piece:
        """The last piece that was made: that which an instant belongs to that rounding puts beyond its end."""
        return self._pieces[-1]

    def _go_on(self) -> bool:
        """Make one more piece; False if there is none, or what comes cannot be read."""
        while self._waiting:
            low, high = self._waiting.pop()
            shortest = max(SHORTEST * self.span, 64.0 * math.ulp(self.begin[0] + high))
            piece = self._piece(low, high, high - low <= shortest)
            if piece is not None:
                self._pieces.append(piece)
                return True
            if high - low <= shortest:
                self._waiting.clear()
                return False
            middle = 0.5 * (low + high)
            self._waiting += [(middle, high), (low, middle)]
        return False

    def _piece(self, low: float, high: float, last: bool) -> Piece | None:
        half = 0.5 * (high - low)
        instants = [later(self.begin, s) for s in (low + half * (NODES + 1.0)).tolist()]
        self.reads += len(instants)
        try:
            with np.errstate(all="ignore"):
                place, speed = (self.read(name, instants) @ TO_COEFFICIENTS.T for name in ("position", "velocity"))
        except (XpheveError, ArithmeticError):
            return None
        if not (np.isfinite(place).all() and np.isfinite(speed).all()):
            return None
        if not last:
            fastest = float(np.abs(speed).sum(axis=1).max())
            bend = float(np.abs(speed[:, 1:]).max()) / half
            late = LATE * math.ulp(abs(self.begin[0]) + high)
            if float(np.abs(speed[:, -3:]).max()) > ROUNDING * fastest + late * bend:
                return None
            if float(np.abs(place[:, -3:]).max()) > ROUNDING * float(np.abs(place).max()) + late * fastest:
                return None
        return Piece(low, high, place, speed, np.abs(place[:, 1:]).sum(axis=1))

    def most(self) -> float:
        """A bound [m/s^2] on the acceleration all along; infinite if none is known."""
        if self._most is None:
            self._most = self._bend()
        return self._most

    def _bend(self) -> float:
        found = 0.0
        for k, piece in enumerate(self.pieces()):
            if k >= MANY:
                return math.inf
            bend = np.abs(piece.speed @ DERIVATIVE.T).sum(axis=1) * (2.0 / (piece.high - piece.low))
            found = max(found, float(np.sqrt((bend * bend).sum())))
        return found if self._pieces and self._pieces[-1].high >= self.span else math.inf

    def acceleration(self, s: float) -> Vec | None:
        """The acceleration [m/s^2] after ``s`` [s]; None beyond what is known."""
        piece = self.piece_at(s)
        if piece is None:
            return None
        half = 0.5 * (piece.high - piece.low)
        found = piece.speed @ (DERIVATIVE.T @ polynomials(np.array([(s - piece.low) / half - 1.0]))) / half
        return float(found[0, 0]), float(found[1, 0]), float(found[2, 0])


class Since:
    """A course, as seen from an instant ``shift`` [s] after its beginning."""

    def __init__(self, course: Course, shift: float) -> None:
        self.course, self.shift = course, shift

    def _piece(self, middle: float) -> Piece:
        return self.course.piece_at(middle) or self.course.piece_at(middle, forwards=False) or self.course.last

    def _at(self, s: Array, speed: bool) -> Array:
        when = s + self.shift
        piece = self._piece(float(when[len(when) // 2]))
        half = 0.5 * (piece.high - piece.low)
        found: Array = (piece.speed if speed else piece.place) @ polynomials((when - piece.low) / half - 1.0)
        return found

    def box(self, low: float, high: float) -> tuple[Array, Array]:
        piece = self._piece(0.5 * (low + high) + self.shift)
        return piece.place[:, 0], piece.edges

    def place(self, s: Array) -> Array:
        return self._at(s, False)

    def speed(self, s: Array) -> Array:
        return self._at(s, True)

    def end_after(self, s: float) -> float:
        piece = self.course.piece_at(s + self.shift)
        return s if piece is None else max(piece.high - self.shift, s)


def segments(tracks: Sequence[Track], low: float, high: float) -> Iterator[tuple[float, float]]:
    """The parts of [``low``, ``high``] in each of which all ``tracks`` have one piece; they end where something is not known."""
    s = low
    while s < high:
        end = min(high, *(track.end_after(s) for track in tracks))
        if not end > s:
            return
        yield s, end
        s = end
