"""The self of a law that is being read, and the self of one that is called with arrays."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
import pytest

import xpheve as xp
import xpheve_laws_basic as basic
from xpheve.trace.recorder import trace_law
from xpheve.trace.shadow import as_arrays


class Base(xp.FieldLaw):
    """Methods and properties of all kinds."""

    id = "test:base"
    b = xp.Param(2.0, unit="kg/s")
    wind = xp.Param((1.0, 2.0, 2.0), unit="m/s")
    limit = xp.Constant(4.0, unit="m/s")
    axis = xp.Constant((0.0, 3.0, 4.0))

    def force(self, body: Any) -> Any:
        return -self.b * (body.velocity - self.wind)

    @property
    def unit_axis(self) -> Any:
        return self.axis / self.axis.norm()

    @cached_property
    def slow(self) -> Any:
        return self.wind.norm() / self.limit

    @staticmethod
    def squared(value: Any) -> Any:
        return value * value

    @classmethod
    def halved(cls, value: Any) -> Any:
        return 0.5 * value if cls.label() else value


class Child(Base):
    """Reaches its parent by super()."""

    id = "test:child"

    def force(self, body: Any) -> Any:
        extra = self.parameters["b"] * self.limit * self.unit_axis * self.squared(self.slow)
        assert isinstance(self, Child)
        return self.halved(super().force(body)) + extra


def test_methods_properties_constants_and_super_run_on_the_shadow(bench: Any) -> None:
    law = Child(b=3.0)
    trace = trace_law(law)
    assert trace is not None and trace.force is not None
    v = bench.state["velocity"]
    expected = -1.5 * (v - (1.0, 2.0, 2.0)) + 3.0 * 4.0 * np.array((0.0, 0.6, 0.8)) * 0.75**2
    np.testing.assert_allclose(as_arrays(law).force(bench.body), expected, rtol=1e-15)
    bench.parameters = law.parameters
    np.testing.assert_allclose(np.stack(bench.run(list(trace.force)), axis=1), expected, rtol=1e-15)


def test_vectors_of_parameters_are_vectors_in_numpy_too() -> None:
    law = Base()
    arrays = as_arrays(law)
    assert law.wind == (1.0, 2.0, 2.0), "for users it stays a tuple"
    assert float(arrays.wind.norm()[0]) == 3.0 and arrays.wind[1] == 2.0 and float(arrays.wind.z[0]) == 2.0
    with pytest.raises(ValueError, match="read-only"):
        arrays.wind += 1.0
    drag = basic.LinearDrag()
    assert as_arrays(drag) is drag
