"""``xpheve.where`` and ``xpheve.vector``: the same on numbers, on NumPy arrays, and in laws that are traced."""

from __future__ import annotations

from typing import Any

import numpy as np

from xpheve.errors import InvalidValueError
from xpheve.laws.view import Batch
from xpheve.trace.values import Traced, packed


def where(condition: Any, a: Any, b: Any) -> Any:
    """``a`` where ``condition`` holds, else ``b``.

    Both are computed, so that a division by 0 in the one that is not taken does no harm, but costs its time.

    Parameters
    ----------
    condition
        A truth, or one an object, shape (n, 1).
    a, b
        Numbers, vectors (3,), or one an object, (n, 1) or (n, 3). Broadcast to one another, as by `numpy.where`.
    """
    found = np.where(condition, a, b)
    if not isinstance(found, np.ndarray):
        return found
    if any(isinstance(one, Batch) for one in (condition, a, b)):
        return found.view(Batch)
    return found if found.ndim else found[()]


def vector(x: Any, y: Any, z: Any) -> Any:
    """The vector (x, y, z), one an object where a component is one an object.

    Parameters
    ----------
    x, y, z
        Numbers, or one an object, shape (n, 1); they may be mixed, as in ``vector(0, 0, -k * body.position.z)``.

    Returns
    -------
    array
        Shape (n, 3), or (3,) if all three are numbers.

    Raises
    ------
    InvalidValueError
        If a component is neither a number nor a column.
    """
    parts = (x, y, z)
    traced = [part for part in parts if isinstance(part, Traced)]
    if traced:
        return packed(traced[0].recording, parts)
    arrays = [np.asarray(part, dtype=float) for part in parts]
    if all(array.ndim == 0 for array in arrays):
        return np.array(parts, dtype=float).view(Batch)
    columns = np.broadcast_arrays(*arrays)
    if columns[0].ndim != 2 or columns[0].shape[1] != 1:
        shapes = ", ".join(str(array.shape) for array in arrays)
        raise InvalidValueError(
            f"vector() of shapes {shapes}: numbers, and columns (n, 1) such as body.position.z, are needed"
        )
    return np.concatenate(columns, axis=1).view(Batch)
