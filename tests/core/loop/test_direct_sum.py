"""All pairs of many bodies at one instant, on one thread or two."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from xpheve.errors import InvalidValueError
from xpheve.laws import PairLaw, Param
from xpheve.loop.direct_sum import DirectSum
from xpheve_laws_basic import UniversalGravity


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XPHEVE_CACHE_DIR", str(tmp_path_factory.mktemp("cache")))
        yield


class Gust(PairLaw):
    """A drag between bodies that grows with time."""

    strength = Param(0.5, unit="kg/s^2")

    def force(self, a: Any, b: Any) -> Any:
        return -self.strength * a.time * (a.velocity - b.velocity)


class Short(Gust):
    """The same, near by only."""

    cutoff = 1.0


def places(n: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(n)
    return rng.normal(size=(3, n)), rng.uniform(1.0, 2.0, n)


@pytest.mark.parametrize("n", [1, 2, 100, 1100])
def test_forces_are_those_of_newton(n: int) -> None:
    x, m = places(n)
    found = DirectSum(UniversalGravity(gravitational_constant=1.0, softening=0.1), n).forces({"position": x, "mass": m})
    d = x[:, :, None] - x[:, None, :]
    square = (d * d).sum(axis=0) + 0.01
    exact = -(m[:, None] * m / (square * np.sqrt(square)) * d).sum(axis=2)
    assert found.shape == (3, n)
    assert np.abs(found - exact).max() <= 1e-14 * max(np.abs(exact).max(), 1e-300)


@pytest.mark.parametrize("n", [300, 2100])
def test_bits_are_the_same_for_any_number_of_threads(n: int) -> None:
    x, m = places(n)
    total = DirectSum(UniversalGravity(gravitational_constant=1.0), n)
    bits = {total.forces({"position": x, "mass": m}, threads).tobytes() for threads in (1, 2, 3)}
    assert len(bits) == 1
    assert (total.strips > 1) == (n >= 2000)


def test_parameters_columns_and_time_are_read_at_each_call() -> None:
    x, m = places(50)
    law = UniversalGravity(gravitational_constant=1.0)
    total = DirectSum(law, 50)
    once = total.forces({"position": x, "mass": m})
    law.set_parameter("gravitational_constant", 2.0)
    assert np.allclose(total.forces({"position": x, "mass": m}), 2.0 * once, rtol=1e-15)
    gust = DirectSum(Gust(), 50)
    assert np.allclose(gust.forces({"velocity": x}, time=2.0), -1.0 * (50 * x - x.sum(axis=1, keepdims=True)))


def test_what_cannot_be_summed_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="no cutoff"):
        DirectSum(Short(), 10)
    total = DirectSum(UniversalGravity(), 10)
    x, m = places(10)
    with pytest.raises(InvalidValueError, match=r"columns\['mass'\] must be an array of shape \(1, 10\)"):
        total.forces({"position": x})
    with pytest.raises(InvalidValueError, match="threads = 0"):
        total.forces({"position": x, "mass": m}, threads=0)
