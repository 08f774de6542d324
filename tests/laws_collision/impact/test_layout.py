"""Cells: never narrower than a diameter, never many more than there are places."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from xpheve_laws_collision.impact import rows
from xpheve_laws_collision.impact.layout import grid_for


def balls(count: int, size: float, radius: float, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    state = np.zeros((count, rows.STATES))
    state[:, :3] = rng.uniform(0.0, size, (count, 3))
    state[:, 3:6] = rng.normal(size=(count, 3))
    state[:, rows.RADIUS] = radius
    return state


@given(some.integers(1, 300), some.floats(1e-3, 1e3), some.floats(0.0, 10.0))
def test_cells_are_wide_enough_and_few_enough(count: int, size: float, radius: float) -> None:
    grid = grid_for(balls(count, size, radius), (0.0, 0.0), None, False)
    assert min(grid.widths) > 2.0 * radius and math.prod(grid.sizes) <= 5 * count + 8


@given(some.integers(1, 300), some.floats(2.0, 50.0), some.sampled_from([0.1, 0.5]))
def test_cells_fill_a_periodic_box(count: int, size: float, radius: float) -> None:
    grid = grid_for(balls(count, size, radius), (0.0, 0.0), (size, math.inf, size), True)
    for c in (0, 2):
        assert grid.sizes[c] * grid.widths[c] == pytest.approx(size, rel=1e-14) and grid.origin[c] == 0.0
        assert grid.widths[c] >= 2.0 * radius
    assert grid.velocity == (0.0, 0.0, 0.0)


def test_free_cells_fly_along() -> None:
    state = balls(50, 3.0, 0.1)
    grid = grid_for(state, (1.0, 0.0), None, True)
    assert np.allclose(grid.velocity, state[:, 3:6].mean(axis=0))
    assert grid_for(state, (1.0, 0.0), None, False).velocity == (0.0, 0.0, 0.0)
