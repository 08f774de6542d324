"""The exact flow of M x'' = K x + D x' + c with constant matrices: by modes where there are any, else by a ladder of doubled exponentials.

With y = x - x(0), the velocity v and the acceleration f that x(0) at rest would have, y'' = A y + B y' + f: what a flow computes is
y = S v + T f and y' = S' v + S f, with S the answer to a push and T its integral. Nothing is stepped: any span is one evaluation from the start.

*Modes.* Where A and B have common eigenvectors after scaling by the roots of the masses (no damping, or damping in proportion), each mode
is a closed form of `xpheve.kernels.linear_mode`. A plane in which the motion looks alike in every direction, as that of a charge across a
magnetic field, is one mode with complex numbers. Eigenvectors are refined to ~30 digits, so that slow modes beside stiff ones, free
directions among them, have all their digits, and phases hold over long times.

*Ladder.* Everything else: exponentials of h, 2h, 4h, ... of the augmented matrix, h short enough for a power series, each the
square of the last in ~30 digits; a span is the product of those of its binary digits, applied to the vector.

Sources: C. Moler, C. Van Loan, SIAM Review 45 (2003) 3: scaling and squaring; C. F. Van Loan, IEEE Trans. Autom. Control 23 (1978) 395: the
augmented matrix, which asks for no inverse; T. Ogita, K. Aishima, Japan J. Indust. Appl. Math. 35 (2018) 1007: refinement of eigenvectors.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from xpheve.kernels import linear_mode
from xpheve.steppers.wide import Wide, blocks, identity, stacked, wide

Array = NDArray[np.float64]
Span = tuple[float, float]
"""A time [s] as a pair of floats."""
Coefficients = NDArray[np.complex128]
"""S, S' and T of each mode, shape (3, modes)."""

ALIKE = 1e-27
"""Of the largest element: what pairs of floats cannot tell from 0."""
ROUNDS = 6
"""Of refining eigenvectors, at most; each squares the error."""
MIX = 0.7390851332151607
"""How much of B is added to A to find eigenvectors of both; no ratio that occurs."""
SERIES = 18
"""Terms of the power series of exp(F h), |F h| <= 1/16, in ~32 digits."""
PAIRS, FLOATS = 8, 15
"""Terms of it that are summed in pairs when it acts on a vector, and in all."""
STEP = 0.03125
"""h, in units of the fastest rate."""


REMEMBERED = 60
"""Coordinates of a ladder up to which the slices of its rungs are kept."""


class Mode(NamedTuple):
    """z'' = a z + b z' of one coordinate, or of a complex one, made of two."""

    constants: tuple[linear_mode.Wide, ...]
    places: tuple[int, ...]
    """Which coordinate it is; for a complex one real and imaginary part."""


class Flow(ABC):
    """The flow of one block of coordinates, for any number of objects that share its numbers."""

    size: int
    """Coordinates."""

    @abstractmethod
    def begin(self, velocity: Wide, pull: Wide) -> Array:
        """What a start amounts to, shape (k, objects): of velocities and of accelerations at rest, shape (size, objects)."""

    @abstractmethod
    def coefficients(self, span: Span) -> Coefficients:
        """What the span [s] amounts to; shape (3, modes), without modes of no use."""

    @abstractmethod
    def end(self, start: Array, spans: Sequence[Span], found: Coefficients) -> tuple[Array, Array]:
        """Ways [m] and velocities [m/s] after spans, shape (size, objects), of what `begin` gave.

        ``spans`` of each object; ``found`` are their `coefficients`, shape (3, modes, objects).
        """


class ModalFlow(Flow):
    """Coordinates x = W z, where each z (or two of them) moves by itself."""

    def __init__(self, basis: Wide, inverse: Wide, modes: Sequence[Mode]) -> None:
        self.size = basis.shape[0]
        self.basis, self.inverse, self.modes = basis, inverse, list(modes)
        self.plain = bool((basis.high == np.eye(self.size)).all() and not basis.low.any())
        """Whether the coordinates are the modes."""

    def begin(self, velocity: Wide, pull: Wide) -> Array:
        if not self.plain:
            velocity, pull = self.inverse @ velocity, self.inverse @ pull
        return np.concatenate([velocity.high, pull.high])

    def coefficients(self, span: Span) -> Coefficients:
        found = np.empty((3, len(self.modes)), dtype=complex)
        for k, mode in enumerate(self.modes):
            for j, (real, imaginary) in enumerate(linear_mode.flow(mode.constants, span)):  # type: ignore[arg-type]
                found[j, k] = complex(real, imaginary)
        return found

    def end(self, start: Array, spans: Sequence[Span], found: Coefficients) -> tuple[Array, Array]:
        n = self.size
        push, pull = start[:n], start[n:]
        way, speed = np.empty_like(push), np.empty_like(push)
        real = [k for k, mode in enumerate(self.modes) if len(mode.places) == 1]
        if real:
            places = [self.modes[k].places[0] for k in real]
            s, rate, t = found[:, real].real
            way[places] = s * push[places] + t * pull[places]
            speed[places] = rate * push[places] + s * pull[places]
        for k, mode in enumerate(self.modes):
            if len(mode.places) == 2:
                i, j = mode.places
                s, rate, t = found[:, k]
                for out, one, other in ((way, s, t), (speed, rate, s)):
                    out[i] = (one.real * push[i] - one.imag * push[j]) + (other.real * pull[i] - other.imag * pull[j])
                    out[j] = (one.real * push[j] + one.imag * push[i]) + (other.real * pull[j] + other.imag * pull[i])
        if self.plain:
            return way, speed
        return self._out(way), self._out(speed)

    def _out(self, z: Array) -> Array:
        """W z, each object summed by itself, so that its bits do not depend on who else is asked."""
        w = self.basis.high
        if self.size <= 3:
            found = w[:, :1] * z[:1]
            for k in range(1, self.size):
                found = found + w[:, k : k + 1] * z[k : k + 1]
            return found
        return _times(w, z)


class LadderFlow(Flow):
    """Matrices without common eigenvectors."""

    def __init__(self, a: Wide, b: Wide) -> None:
        self.size = a.shape[0]
        scale = max(float(np.sqrt(_norm(a))), _norm(b))
        self.rate = float(2.0 ** np.ceil(np.log2(scale))) if scale > 0.0 else 1.0
        """The fastest rate [1/s], as a power of two: time is counted in its inverse."""
        self.a, self.b = a.scaled(1.0 / self.rate / self.rate), b.scaled(1.0 / self.rate)
        self.rungs: list[Wide] = []

    def begin(self, velocity: Wide, pull: Wide) -> Array:
        v, f = velocity.scaled(1.0 / self.rate), pull.scaled(1.0 / self.rate / self.rate)
        return np.concatenate([v.high, v.low, f.high, f.low])

    def coefficients(self, span: Span) -> Coefficients:
        return np.empty((3, 0), dtype=complex)

    def end(self, start: Array, spans: Sequence[Span], found: Coefficients) -> tuple[Array, Array]:
        n = self.size
        way, speed = np.empty((n, start.shape[1])), np.empty((n, start.shape[1]))
        for span in dict.fromkeys(spans):
            which = [k for k, one in enumerate(spans) if one == span]
            v, f = (Wide(start[j : j + n, which], start[j + n : j + 2 * n, which]) for j in (0, 2 * n))
            z = self._after(v, f, span)
            way[:, which], speed[:, which] = z.high[:n], self.rate * z.high[n:]
        return way, speed

    def _after(self, velocity: Wide, pull: Wide, span: Span) -> Wide:
        """Way and velocity, in units of the ladder."""
        high, low = span[0] * self.rate, span[1] * self.rate
        count = int(high // STEP)
        rest = (high - count * STEP) + low
        if rest < 0.0:
            count, rest = count - 1, rest + STEP
        z = self._short(velocity, pull, rest)
        level = 0
        while count:
            if count & 1:
                rung = self._rung(level)
                if self.size > REMEMBERED:
                    rung = rung.copy()
                z = rung @ Wide(np.concatenate([z.high, pull.high]), np.concatenate([z.low, pull.low]))
            count >>= 1
            level += 1
        return z

    def _short(self, velocity: Wide, pull: Wide, span: float) -> Wide:
        """Way and velocity after a span below `STEP`, as power series; its small terms need no pairs."""
        # terms of y, each but for a power of the span over its factorial: y_2 = B v + f, y_(k+2) = A y_k + B y_(k+1)
        before, term = velocity, self.b @ velocity + pull
        factor = Wide(span)
        way, speed = velocity * factor, velocity
        for k in range(2, PAIRS):
            speed = speed + term * factor
            factor = factor * Wide(span) / float(k)
            way = way + term * factor
            before, term = term, self.a @ before + self.b @ term
        old, new, power = before.high, term.high, float(factor.high)
        more, faster = np.zeros_like(new), np.zeros_like(new)
        for k in range(PAIRS, FLOATS):
            faster += new * power
            power *= span / k
            more += new * power
            old, new = new, _times(self.a.high, old) + _times(self.b.high, new)
        way, speed = way + Wide(more), speed + Wide(faster)
        return Wide(np.concatenate([way.high, speed.high]), np.concatenate([way.low, speed.low]))

    def _rung(self, level: int) -> Wide:
        """The matrix [C S T; C' S' S] of 2^level steps, shape (2 size, 3 size)."""
        n = self.size
        while len(self.rungs) <= level:
            if not self.rungs:
                self.rungs.append(self._first())
                continue
            last = self.rungs[-1]
            double = last[:, : 2 * n].copy() @ last
            double[:, 2 * n :] = double[:, 2 * n :] + last[:, 2 * n :]
            self.rungs.append(double)
        return self.rungs[level]

    def _first(self) -> Wide:
        """The rung of one step. S and T are power series; C = 1 + T A, C' = S A."""
        one, none = identity(self.size), Wide(np.zeros((self.size, self.size)))
        before, term, factor = none, one, Wide(1.0)
        push, rate, way = none, one, none
        for k in range(1, SERIES):
            factor = factor.scaled(STEP) / float(k)
            push = push + term * factor
            way = way + term * (factor.scaled(STEP) / float(k + 1))
            before, term = term, self.a @ before + self.b @ term
            rate = rate + term * factor
        return blocks([[one + way @ self.a, push, way], [push @ self.a, rate, push]])


# Finding the flow


def flow_of(stiffness: Wide, damping: Wide, mass: Array) -> Flow:
    """The flow of M x'' = K x + D x'.

    Parameters
    ----------
    stiffness, damping
        K [N/m] and D [kg/s], shape (n, n).
    mass
        The diagonal of M [kg], shape (n,).
    """
    root = wide(mass).root()
    scale = root[:, None] * root[None, :]
    k, d = stiffness / scale, damping / scale
    found = _common_modes(k, d, root) or _planes(k, d)
    if found is not None:
        return found
    m = wide(mass)[:, None]
    return LadderFlow(stiffness / m, damping / m)


def parts_of(stiffness: Wide, damping: Wide) -> list[NDArray[np.int64]]:
    """Coordinates that act on one another, ascending, by the first of each part."""
    touch = (stiffness.high != 0.0) | (damping.high != 0.0)
    touch |= touch.T
    left = np.ones(len(touch), dtype=bool)
    found = []
    while left.any():
        part = np.zeros(len(touch), dtype=bool)
        part[int(left.argmax())] = True
        while True:
            more = part | touch[part].any(axis=0)
            if (more == part).all():
                break
            part = more
        left &= ~part
        found.append(np.flatnonzero(part))
    return found


def mode_of(a: Wide, b: Wide, c: Wide | None = None, d: Wide | None = None) -> tuple[linear_mode.Wide, ...]:
    """The constants of z'' = (a + i c) z + (b + i d) z', of single numbers."""
    zero = Wide(0.0)
    pairs = [(float(one.high), float(one.low)) for one in (a, c or zero, b, d or zero)]
    return linear_mode.prepared((pairs[0], pairs[1]), (pairs[2], pairs[3]))


def _times(matrix: Array, columns: Array) -> Array:
    """Matrix times columns, each by itself, so that its bits do not depend on who else is asked."""
    return np.stack([(matrix * column).sum(axis=1) for column in columns.T], axis=1)


def _norm(a: Wide) -> float:
    """The largest sum of a row."""
    return float(np.abs(a.high).sum(axis=-1).max(initial=0.0))


def _largest(a: Wide) -> float:
    return float(np.abs(a.high).max(initial=0.0))


def _is_symmetric(a: Wide) -> bool:
    return _largest(a - a.transposed) <= ALIKE * _largest(a)


def _common_modes(k: Wide, d: Wide, root: Wide) -> ModalFlow | None:
    """Modes of symmetric matrices, scaled by masses, that have common eigenvectors; None if they have not."""
    if not (_is_symmetric(k) and _is_symmetric(d)):
        return None
    n = k.shape[0]
    x = identity(n)
    diagonal = [_is_diagonal(one) for one in (k, d)]
    if not all(diagonal):
        x = eigenvectors(_mixed(k, d))
        k, d = (x.transposed @ (one @ x) for one in (k, d))
        if not (_is_diagonal(k) and _is_diagonal(d)):
            return None
    modes = [Mode(mode_of(k[i, i], d[i, i]), (i,)) for i in range(n)]
    if all(diagonal):
        return ModalFlow(x, x, modes)
    return ModalFlow(x / root[:, None], x.transposed * root[None, :], modes)


def _is_diagonal(a: Wide) -> bool:
    off = np.abs(a.high)
    np.fill_diagonal(off, 0.0)
    return float(off.max(initial=0.0)) <= ALIKE * _largest(a)


def _mixed(k: Wide, d: Wide) -> Wide:
    """A matrix whose eigenvectors are those of both, if there are such."""
    sizes = [_largest(one) for one in (k, d)]
    if not sizes[1]:
        return k
    if not sizes[0]:
        return d
    one, other = (part.scaled(2.0 ** -np.frexp(size)[1]) for part, size in zip((k, d), sizes, strict=True))
    return one + other * MIX


def eigenvectors(a: Wide) -> Wide:
    """The eigenvectors of a symmetric matrix as columns, refined until they make it diagonal to ~30 digits of its norm.

    Ogita and Aishima, algorithm 1. Eigenvalues too close to be told apart are taken together, and their part of the matrix, which is small,
    is diagonalised by itself.
    """
    a = _evened(a)
    n, norm = a.shape[0], _norm(a)
    every = np.arange(n)
    x = Wide(np.linalg.eigh(a.high)[1])
    for _ in range(ROUNDS):
        turned = x.transposed
        # Symmetric to the last bit: close eigenvalues make much of what is not, and columns oblique.
        rest = _evened(identity(n) - turned @ x).high
        d = _evened(turned @ (a @ x))
        off = d.high - np.diag(d.high.diagonal())
        if np.abs(off).max(initial=0.0) + norm * np.abs(rest).max(initial=0.0) <= 0.01 * ALIKE * norm:
            break
        values = d[every, every] + d[every, every] * Wide(rest.diagonal())
        gaps = (values[None, :] - values[:, None]).high
        room = 2.0 * (float(np.linalg.norm(off)) + norm * float(np.linalg.norm(rest)))
        apart = np.abs(gaps) > room
        with np.errstate(all="ignore"):
            change = np.where(apart, (off + values.high[None, :] * rest) / gaps, 0.5 * rest)
        x = _untangled(x + x @ Wide(change), d, rest, apart)
    return x


def _evened(a: Wide) -> Wide:
    """The symmetric part."""
    return (a + a.transposed).scaled(0.5)


def _untangled(x: Wide, d: Wide, rest: Array, apart: NDArray[np.bool_]) -> Wide:
    """Columns of ``x`` of close eigenvalues turned among themselves so that their part of ``d`` is diagonal."""
    order = np.argsort(d.high.diagonal(), kind="stable")
    first = 0
    for k in range(1, len(order) + 1):
        if k < len(order) and not apart[order[k - 1], order[k]]:
            continue
        own, first = order[first:k], k
        if len(own) == 1:
            continue
        part = np.ix_(own, own)
        middle = d[own[0], own[0]]
        inner = (d[part] + middle * Wide(rest[part]) - identity(len(own)) * middle).high
        turn = Wide(np.linalg.eigh(0.5 * (inner + inner.T))[1])
        turn = turn + turn @ (identity(len(own)) - turn.transposed @ turn).scaled(0.5)
        x[:, own] = x[:, own] @ turn
    return x


def _planes(k: Wide, d: Wide) -> ModalFlow | None:
    """Motion that looks alike in all directions about an axis: one mode along it, and one complex mode across."""
    if k.shape[0] == 2:
        found = _turning_mode(k, d, (0, 1), max(_largest(k), 0.0), _largest(d))
        return None if found is None else ModalFlow(identity(2), identity(2), [found])
    if k.shape[0] != 3:
        return None
    basis = _axis_frame(k, d)
    if basis is None:
        return None
    turned = basis.transposed
    k, d = (turned @ (one @ basis) for one in (k, d))
    sizes = _largest(k), _largest(d)
    for one, size in zip((k, d), sizes, strict=True):
        if max(_largest(one[2, :2]), _largest(one[:2, 2])) > ALIKE * size:
            return None
    across = _turning_mode(k, d, (0, 1), *sizes)
    if across is None:
        return None
    return ModalFlow(basis, turned, [across, Mode(mode_of(k[2, 2], d[2, 2]), (2,))])


def _turning_mode(k: Wide, d: Wide, places: tuple[int, int], *sizes: float) -> Mode | None:
    """The complex mode of two coordinates, if both matrices only turn and stretch their plane."""
    i, j = places
    numbers = []
    for one, size in zip((k, d), sizes, strict=True):
        uneven = max(_largest(one[i, i] - one[j, j]), _largest(one[i, j] + one[j, i]))
        if uneven > ALIKE * size:
            return None
        numbers.append((one[i, i], one[j, i]))
    return Mode(mode_of(numbers[0][0], numbers[1][0], numbers[0][1], numbers[1][1]), places)


def _axis_frame(k: Wide, d: Wide) -> Wide | None:
    """Columns: two directions across the axis about which a matrix turns, and the axis; orthonormal in ~30 digits. None without one."""
    for one in (d, k):
        skew = (one - one.transposed).scaled(0.5)
        axis = stacked([skew[2, 1], skew[0, 2], skew[1, 0]])
        if _largest(axis) > ALIKE * _largest(one):
            break
    else:
        return None
    axis = axis.scaled(2.0 ** -np.frexp(_largest(axis))[1])
    axis = axis / (axis * axis).sum().root()
    least = int(np.abs(axis.high).argmin())
    across = Wide(np.eye(3)[least]) - axis * axis[least]
    across = across / (across * across).sum().root()
    other = _cross(axis, across)
    return stacked([across, other, axis]).transposed


def _cross(a: Wide, b: Wide) -> Wide:
    return stacked([a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3] for k in range(3)])
