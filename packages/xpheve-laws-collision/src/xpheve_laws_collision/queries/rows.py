"""Vectors and quaternions row by row, (n, 3) and (n, 4): the arithmetic of queries."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
Mask = NDArray[np.bool_]


def dots(a: Array, b: Array) -> Array:
    """Scalar products, (n,)."""
    return np.asarray(a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2])


def lengths(a: Array) -> Array:
    """Lengths, (n,)."""
    return np.asarray(np.sqrt(dots(a, a)))


def crosses(a: Array, b: Array) -> Array:
    """Vector products."""
    x = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    y = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    z = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return np.stack([x, y, z], axis=-1)


def turned(q: Array, v: Array) -> Array:
    """Vectors turned by unit quaternions, body to world."""
    t = 2.0 * crosses(q[..., 1:], v)
    return np.asarray(v + q[..., :1] * t + crosses(q[..., 1:], t))


def turned_back(q: Array, v: Array) -> Array:
    """Vectors turned back, world to body."""
    t = -2.0 * crosses(q[..., 1:], v)
    return np.asarray(v + q[..., :1] * t - crosses(q[..., 1:], t))


def units(v: Array, else_: tuple[float, float, float]) -> tuple[Array, Array]:
    """Lengths (n,), and ``v`` of length 1; ``else_`` where it is zero."""
    length = lengths(v)
    none = length == 0.0
    if not none.any():
        return length, v / length[..., None]
    return length, np.where(none[..., None], else_, v / np.where(none, 1.0, length)[..., None])
