"""Periodic space: a box whose opposite faces are one; which image of a place is in it, and which is nearest to another.

Rows hold any image of an object, so that a flight through a face is no event and changes no bit. Who reads gets the image in [0, L):
remainders of floats are exact from 0 up, and below 0 to half an ulp of L (Allen & Tildesley, Computer Simulation of Liquids, 1987, 1.5).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xpheve.errors import InvalidValueError
from xpheve.kernels.vector import Vec

Array = NDArray[np.float64]


def periods(value: Any) -> Vec | None:
    """``value`` as three edges [m] of the box, infinite where there is no period; None where there is none at all.

    Raises
    ------
    InvalidValueError
        If it is not three lengths above 0, each finite, infinite or None.
    """
    if value is None:
        return None
    given = tuple(value) if isinstance(value, (tuple, list, np.ndarray)) else ()
    if len(given) != 3:
        raise InvalidValueError(
            f"periodic = {value!r}: three lengths [m] are needed, (Lx, Ly, Lz); None along an axis without period"
        )
    x, y, z = (_period(one, value) for one in given)
    return None if x == y == z == math.inf else (x, y, z)


def _period(one: Any, whole: Any) -> float:
    if one is None:
        return math.inf
    if isinstance(one, (int, float, np.integer, np.floating)) and not isinstance(one, bool) and one > 0:
        try:
            return float(one)
        except OverflowError:
            pass
    raise InvalidValueError(f"periodic = {whole!r}: {one!r}: a length above 0 m is needed, or None for no period")


def wrapped(x: tuple[float, ...], box: Vec) -> Vec:
    """The image in the box of the place ``x`` [m]."""
    a, b, c = (_wrapped(one, edge) for one, edge in zip(x, box, strict=True))
    return a, b, c


def _wrapped(x: float, edge: float) -> float:
    if edge == math.inf:
        return x
    found = x % edge
    return 0.0 if found >= edge else found  # a little below 0 is rounded up to the far face, which is the near one


def wrap_rows(positions: Array, box: Vec) -> Array:
    """The images in the box of ``positions`` (3, n) [m], in place; to the bits of `wrapped`."""
    for row, edge in zip(positions, box, strict=True):
        if edge < math.inf:
            np.mod(row, edge, out=row)
            row[row >= edge] = 0.0
    return positions


def shortest(way: tuple[float, ...], box: Vec) -> Vec:
    """``way`` [m] from one place to the nearest image of another (minimum image)."""
    a, b, c = (one if edge == math.inf else math.remainder(one, edge) for one, edge in zip(way, box, strict=True))
    return a, b, c


def shortest_rows(ways: Array, box: Vec) -> Array:
    """Each of ``ways`` (..., 3) [m] to the nearest image; half a period may become minus half a period."""
    found = ways.copy()
    for k, edge in enumerate(box):
        if edge < math.inf:
            rest = np.fmod(found[..., k], edge)
            found[..., k] = rest - np.where(np.abs(rest) > 0.5 * edge, np.copysign(edge, rest), 0.0)
    return found


def near_image(place: Vec, beside: tuple[float, ...], box: Vec) -> Vec:
    """The image of ``place`` that is nearest to ``beside``."""
    way = shortest((place[0] - beside[0], place[1] - beside[1], place[2] - beside[2]), box)
    return beside[0] + way[0], beside[1] + way[1], beside[2] + way[2]


__all__ = ["near_image", "periods", "shortest", "shortest_rows", "wrap_rows", "wrapped"]
