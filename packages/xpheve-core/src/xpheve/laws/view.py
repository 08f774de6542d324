"""Batched NumPy views that a law's ``force`` gets, and what it read of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xpheve.errors import InvalidValueError

Array = NDArray[np.float64]


class Batch(np.ndarray[Any, np.dtype[np.float64]]):
    """Vectors (n, 3), or numbers (n, 1), one row an object, so that expressions of both broadcast.

    ``batch[2]`` would be the third object, where a formula means the third component: it is refused, with the way out.
    """

    def __getitem__(self, key: Any) -> Any:
        if self.ndim == 2 and isinstance(key, (int, np.integer)):
            component = f"write .{'xyz'[key]}" if 0 <= key < 3 and self.shape[1] == 3 else "write [:, k]"
            raise InvalidValueError(
                f"[{key}] of a batch of shape {self.shape} is the row of one object, not a component of all: {component} "
                f"for the component, or np.asarray(...)[{key}] for that row"
            )
        return super().__getitem__(key)

    def __iter__(self) -> Iterator[Any]:
        return iter(np.asarray(self))

    def norm(self) -> Batch:
        """Length of each vector, shape (n, 1)."""
        return _batch(np.sqrt(self.dot(self)))

    def dot(self, other: Any, out: Any = None) -> Batch:  # type: ignore[override]
        """Scalar product row by row, shape (n, 1)."""
        product = np.asarray(np.multiply(self, other))
        return _batch((product[..., 0:1] + product[..., 1:2]) + product[..., 2:3])

    def cross(self, other: Any) -> Batch:
        """Vector product row by row, shape (n, 3)."""
        return _batch(np.cross(self, other))

    @property
    def x(self) -> Batch:
        """First component, shape (n, 1)."""
        return _batch(self[..., 0:1])

    @property
    def y(self) -> Batch:
        """Second component, shape (n, 1)."""
        return _batch(self[..., 1:2])

    @property
    def z(self) -> Batch:
        """Third component, shape (n, 1)."""
        return _batch(self[..., 2:3])


def _batch(values: Any) -> Batch:
    """``values`` as a `Batch`."""
    found: Batch = np.asanyarray(values).view(Batch)
    return found


def _turned(vector: Any, q: Batch, sense: float) -> Batch:
    """``vector`` turned by the unit quaternions ``q`` (sense 1), or back (-1): v + 2 (w u x v + u x (u x v))."""
    values = np.asarray(vector, dtype=float)
    w, u = q[:, 0:1], sense * q[:, 1:4]
    twice = 2.0 * np.cross(u, values)
    return _batch(values + w * twice + np.cross(u, twice))


STATE = frozenset({"position", "velocity", "orientation", "angular_velocity"})
"""What flight changes; a law that reads none of it, nor time, is constant."""


class BodyView:
    """The objects of a batch as a law sees them; read-only.

    ``position`` [m], ``velocity`` [m/s], ``angular_velocity`` [rad/s] (n, 3) in the world frame, ``orientation`` (n, 4), ``mass``
    [kg] and every column (n, 1), ``inertia`` [kg m^2] (n, 3); ``volume`` [m^3] (n, 1) is that of the shape, NaN for a point and for a
    shape without end; ``since`` [s] (n, 1) is when the object came under the law, or the law was enabled; ``time`` [s] and ``up`` (3,)
    are of the scene.
    """

    __slots__ = ("_fetch", "_held", "_reads", "count")

    def __init__(self, fetch: Callable[[str], Any], reads: set[str], count: int) -> None:
        object.__setattr__(self, "_fetch", fetch)
        object.__setattr__(self, "_held", {})
        object.__setattr__(self, "_reads", reads)
        object.__setattr__(self, "count", count)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        self._reads.add(name)
        held = self._held
        if name not in held:
            value = self._fetch(name)
            if isinstance(value, np.ndarray) and value.ndim:
                value = (value if value.ndim == 2 or name == "up" else value[:, None]).view(Batch)
                value.flags.writeable = False
            held[name] = value
        return held[name]

    def to_world(self, vector: Any) -> Batch:
        """``vector`` of the body frame, shape (n, 3) or (3,), in the world frame, shape (n, 3)."""
        return _turned(vector, self.orientation, 1.0)

    def to_body(self, vector: Any) -> Batch:
        """``vector`` of the world frame, shape (n, 3) or (3,), in the body frame, shape (n, 3)."""
        return _turned(vector, self.orientation, -1.0)

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"body.{name} is read-only in a force law; return the force, or write a free-form law")
