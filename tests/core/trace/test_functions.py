"""where and vector: on numbers, on arrays, and on traced values."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import TraceError


def test_where_and_vector_are_the_same_on_numbers_arrays_and_traced_values(bench: Any) -> None:
    bench.same(lambda body, wind: xp.vector(0.0, body.mass, wind[1]))
    bench.same(lambda body, wind: xp.vector(body.position.z, 1, body.time) * body.mass)
    bench.same(lambda body, wind: xp.where(body.mass > 1.0, body.position, wind).norm())
    assert xp.where(True, 1.0, 2.0) == 1.0
    np.testing.assert_array_equal(xp.vector(1, 2, 3), (1.0, 2.0, 3.0))
    assert xp.vector(3.0, 4.0, 0.0).norm() == 5.0
    with pytest.raises(xp.errors.InvalidValueError, match=r"vector\(\) of shapes \(7, 3\), \(\), \(\)"):
        xp.vector(bench.body.position, 0.0, 0.0)
    with pytest.raises(TraceError, match=r"vector\(\) of shapes \(n, 3\), \(\), \(\)"):
        xp.vector(bench.traced_body.position, 0.0, 0.0)
