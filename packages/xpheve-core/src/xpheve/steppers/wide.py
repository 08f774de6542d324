"""Arrays of pairs of floats: ~32 digits, by the operations of the machine on ~16.

What a linear motion does over a long time hangs on small differences of large numbers: a stiff net drifts with the sum of forces that
cancel, slow modes are small beside stiff ones. Such sums are formed here, and rounded when they are small.

Sources: error-free sums and products of Knuth (The Art of Computer Programming 2, 4.2.2) and T. J. Dekker, Numer. Math. 18 (1971) 224; matrix
products out of exact ones of slices: K. Ozaki, T. Ogita, S. Oishi, S. M. Rump, Numer. Algorithms 59 (2012) 95. As every product of slices
is exact, the result has the same bits whatever library multiplies, in whatever order, on however many threads.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from xpheve.steppers.contract import Array
from xpheve.steppers.sums import two_products, two_sums

SLICES = 5  # of a matrix: with 20 bits each or more, nearly all that a pair has


class Wide:
    """An array as the unevaluated sum ``high + low``."""

    __slots__ = ("_left", "_right", "high", "low")
    __array_ufunc__ = None  # array * Wide is a Wide

    def __init__(self, high: Any, low: Any = None) -> None:
        self.high: Array = np.asarray(high, dtype=float)
        self.low: Array = np.zeros_like(self.high) if low is None else np.asarray(low, dtype=float)
        self._left: list[Array] | None = None
        self._right: Array | None = None

    # Shape

    @property
    def shape(self) -> tuple[int, ...]:
        return self.high.shape

    @property
    def transposed(self) -> Wide:
        """Rows and columns, the first two axes, exchanged."""
        return Wide(self.high.swapaxes(0, 1), self.low.swapaxes(0, 1))

    def __getitem__(self, key: Any) -> Wide:
        return Wide(self.high[key], self.low[key])

    def __setitem__(self, key: Any, value: Wide) -> None:
        self.high[key], self.low[key] = value.high, value.low
        self._left = self._right = None

    def copy(self) -> Wide:
        """An array of its own."""
        return Wide(self.high.copy(), self.low.copy())

    def key(self) -> tuple[Any, ...]:
        """What equal arrays have in common, and no others."""
        return self.shape, self.high.tobytes(), self.low.tobytes()

    # Arithmetic

    def __add__(self, other: Any) -> Wide:
        other = wide(other)
        s, e = two_sums(self.high, other.high)
        t, f = two_sums(self.low, other.low)
        s, e = _fast(s, e + t)
        return Wide(*_fast(s, e + f))

    def __sub__(self, other: Any) -> Wide:
        return self + -wide(other)

    def __neg__(self) -> Wide:
        return Wide(-self.high, -self.low)

    def __mul__(self, other: Any) -> Wide:
        other = wide(other)
        p, e = two_products(self.high, other.high)
        return Wide(*_fast(p, e + (self.high * other.low + self.low * other.high)))

    def __truediv__(self, other: Any) -> Wide:
        other = wide(other)
        with np.errstate(all="ignore"):
            first = self.high / other.high
            rest = self - other * Wide(first)
            second = rest.high / other.high
            rest = rest - other * Wide(second)
            s, e = _fast(first, second)
            s, e = _fast(s, e + rest.high / other.high)
            plain = np.isfinite(first)
        return Wide(np.where(plain, s, first), np.where(plain, e, 0.0))

    __radd__ = __add__
    __rmul__ = __mul__

    def __rsub__(self, other: Any) -> Wide:
        return wide(other) - self

    def __rtruediv__(self, other: Any) -> Wide:
        return wide(other) / self

    def root(self) -> Wide:
        """Square roots; NaN below 0."""
        with np.errstate(all="ignore"):
            x = np.sqrt(self.high)
            rest = self - Wide(*two_products(x, x))
            found = _fast(x, np.where(x > 0.0, rest.high / (2.0 * x), 0.0))
        return Wide(*found)

    def scaled(self, power: Any) -> Wide:
        """Times ``power``, powers of two: exact."""
        return Wide(self.high * power, self.low * power)

    def sum(self, axis: int = 0) -> Wide:
        """The sum along ``axis``, one after the other."""
        parts = np.moveaxis(self.high, axis, 0), np.moveaxis(self.low, axis, 0)
        total = Wide(np.zeros(parts[0].shape[1:]))
        for high, low in zip(*parts, strict=True):
            total = total + Wide(high, low)
        return total

    # Matrices

    def __matmul__(self, other: Any) -> Wide:
        other = wide(other)
        vector = len(other.shape) == 1
        if vector:
            other = other[:, None]
        left, right = self._slices_left(), other._slices_right()
        columns = other.shape[1]
        orders = [np.zeros((self.shape[0], columns)) for _ in range(SLICES)]
        for i, part in enumerate(left):
            found = part @ right[:, : columns * (SLICES - i)]
            for j in range(SLICES - i):  # products of one order are multiples of one unit: their sum is exact, too
                orders[i + j] += found[:, columns * j : columns * (j + 1)]
        total = Wide(*two_sums(orders[0], orders[1])) + Wide(*two_sums(orders[2], orders[3] + orders[4]))
        return total[:, 0] if vector else total

    def _slices_left(self) -> list[Array]:
        if self._left is None:
            self._left = _slices(self, 1)
        return self._left

    def _slices_right(self) -> Array:
        if self._right is None:
            self._right = np.concatenate(_slices(self, 0), axis=1)
        return self._right


def wide(value: Any) -> Wide:
    """``value`` as a `Wide`."""
    return value if isinstance(value, Wide) else Wide(value)


def identity(n: int) -> Wide:
    """The identity matrix of n rows."""
    return Wide(np.eye(n))


def stacked(parts: list[Wide]) -> Wide:
    """``parts`` along a new first axis."""
    return Wide(np.array([one.high for one in parts]), np.array([one.low for one in parts]))


def blocks(rows: list[list[Wide]]) -> Wide:
    """A matrix of matrices."""
    return Wide(
        np.block([[one.high for one in row] for row in rows]), np.block([[one.low for one in row] for row in rows])
    )


def _fast(a: Array, b: Array) -> tuple[Array, Array]:
    """`two_sums` where b is small beside a, or a is 0."""
    s = a + b
    return s, b - (s - a)


def _slices(matrix: Wide, axis: int) -> list[Array]:
    """Parts of ``matrix`` of so few bits, by row (axis 1) or column (axis 0), that products of them are summed without error."""
    terms = SLICES * max(1, matrix.shape[axis])
    bits = (53 - int(np.ceil(np.log2(terms)))) // 2
    high, low = matrix.high.copy(), matrix.low.copy()
    found = []
    top = np.abs(high).max(axis=axis, keepdims=True, initial=0.0)
    grid = np.ldexp(1.0, np.frexp(top)[1] + 53 - bits)
    for _ in range(SLICES):
        part = (high + grid) - grid
        found.append(part)
        high, low = two_sums(high - part, low)
        grid = np.ldexp(grid, -bits)
    return found
