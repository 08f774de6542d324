"""Views of bodies made by hand, so that a law's force can be asked for without an engine."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from xpheve.laws.view import BodyView

Array = NDArray[np.float64]
Views = Callable[..., BodyView]


@pytest.fixture(scope="session")
def view() -> Views:
    """Return a maker of views: ``view(position=..., mass=...)``, one row an object; what a law reads must be given."""

    def make(*, up: Any = (0.0, 0.0, 1.0), reads: set[str] | None = None, **given: Any) -> BodyView:
        columns = {name: np.array(value, dtype=float) for name, value in given.items()}
        columns = {
            name: np.atleast_2d(value) if name in ("position", "velocity", "angular_velocity") else np.atleast_1d(value)
            for name, value in columns.items()
        }
        count = max(len(value) for value in columns.values())
        columns["up"] = np.array(up, dtype=float)
        return BodyView(lambda name: columns[name].copy(), set() if reads is None else reads, count)

    return make


@pytest.fixture(scope="session")
def minus_gradient() -> Callable[[Callable[[Array], Any], Array], Array]:
    """Return a function that gives -grad U at positions ``x``, shape (n, 3), by central differences of order 4."""

    def differentiate(potential: Callable[[Array], Any], x: Array) -> Array:
        found = np.zeros_like(x)
        step = 1e-3 * np.maximum(1.0, np.abs(x).max())
        for k in range(3):
            shift = np.zeros(3)
            shift[k] = step
            near = np.asarray(potential(x + shift)) - np.asarray(potential(x - shift))
            far = np.asarray(potential(x + 2 * shift)) - np.asarray(potential(x - 2 * shift))
            found[:, k] = -((8 * near - far) / (12 * step))[:, 0]
        return found

    return differentiate
