"""Arithmetic that never raises: NumPy says what IEEE 754 asks for."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from xpheve.kernels import ieee

SPECIAL = [
    0.0,
    -0.0,
    math.inf,
    -math.inf,
    math.nan,
    5e-324,
    -5e-324,
    2.2e-308,
    1.0,
    -1.0,
    1.5,
    -1.5,
    2.0,
    -2.0,
    3.0,
    -3.0,
    1e308,
    -1e308,
]
anything = st.one_of(st.sampled_from(SPECIAL), st.floats(), st.floats(-10.0, 10.0), st.integers(-9, 9).map(float))

TO_THE_BIT: dict[str, Callable[..., object]] = {"sqrt": np.sqrt, "floor": np.floor, "sign": np.sign}
TO_A_FEW_ULP: dict[str, Callable[..., object]] = {
    "cbrt": np.cbrt, "exp": np.exp, "expm1": np.expm1, "log": np.log, "log1p": np.log1p, "sin": np.sin, "cos": np.cos,
    "tan": np.tan, "asin": np.arcsin, "acos": np.arccos, "sinh": np.sinh, "cosh": np.cosh,
}  # fmt: skip


def numpys(function: Callable[..., object], *x: float) -> float:
    with np.errstate(all="ignore"):
        return float(function(*(np.float64(value) for value in x)))  # type: ignore[arg-type]


def same(a: float, b: float) -> bool:
    """Equal to the bit, the sign of zero included; any NaN is as good as another."""
    return (a != a and b != b) or (a == b and math.copysign(1.0, a) == math.copysign(1.0, b))


def near(a: float, b: float, ulps: int = 8) -> bool:
    if same(a, b):
        return True
    return math.isfinite(a) and math.isfinite(b) and abs(a - b) <= ulps * max(math.ulp(a), math.ulp(b))


def test_division_is_that_of_the_machine() -> None:
    for a in SPECIAL:
        for b in SPECIAL:
            assert same(ieee.divide(a, b), numpys(np.divide, a, b)), (a, b)
    assert ieee.divide(1.0, -0.0) == -math.inf
    assert math.isnan(ieee.divide(0.0, 0.0))


@given(anything, anything)
def test_any_division_is_that_of_the_machine(a: float, b: float) -> None:
    assert same(ieee.divide(a, b), numpys(np.divide, a, b))


@pytest.mark.parametrize("name", TO_THE_BIT)
@given(x=anything)
@example(x=-0.5)
@example(x=4503599627370497.0)
@example(x=-4503599627370495.5)
def test_roots_floors_and_signs_have_the_bits_of_numpy(name: str, x: float) -> None:
    assert same(getattr(ieee, name)(x), numpys(TO_THE_BIT[name], x))


@pytest.mark.parametrize("name", TO_A_FEW_ULP)
@given(x=anything)
@example(x=710.0)
@example(x=-0.9999999999999999)
def test_functions_are_those_of_numpy_to_a_few_ulp_and_never_raise(name: str, x: float) -> None:
    assert near(getattr(ieee, name)(x), numpys(TO_A_FEW_ULP[name], x)), (name, x)


@pytest.mark.parametrize("name", TO_A_FEW_ULP)
def test_functions_at_special_values(name: str) -> None:
    for x in SPECIAL:
        assert near(getattr(ieee, name)(x), numpys(TO_A_FEW_ULP[name], x)), (name, x)


@given(anything, anything)
def test_powers_are_those_of_numpy_and_never_complex(a: float, b: float) -> None:
    assert near(ieee.power(a, b), numpys(np.power, a, b)), (a, b)


def test_powers_at_special_values() -> None:
    for a in SPECIAL:
        for b in SPECIAL:
            assert near(ieee.power(a, b), numpys(np.power, a, b)), (a, b)
    assert ieee.power(-0.0, -3.0) == -math.inf
    assert ieee.power(-1e200, 3.0) == -math.inf
    assert math.isnan(ieee.power(-1.0, 1.5))


@given(anything, anything)
def test_the_hypotenuse_neither_overflows_nor_vanishes(a: float, b: float) -> None:
    assert near(ieee.hypot(a, b), numpys(np.hypot, a, b)), (a, b)


@given(anything, anything)
def test_lesser_and_greater_pass_on_nan(a: float, b: float) -> None:
    for mine, numpys_own in ((ieee.minimum, np.minimum), (ieee.maximum, np.maximum)):
        x, y = mine(a, b), numpys(numpys_own, a, b)
        assert same(x, y) or x == y == 0.0, (a, b)
