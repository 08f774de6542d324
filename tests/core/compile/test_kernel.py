"""Calling a kernel: the arrays are looked at before anything happens, and moving them is seen."""

from __future__ import annotations

import gc
import math
import weakref
from typing import Any

import numpy as np
import pytest

from xpheve.compile import Kernel, compiled, interpreted
from xpheve.errors import InvalidValueError

TEXT = """
def entry(f, n):
    x = f[0]
    m = n[0]
    for i in range(m[0]):
        x[i] = 2.0 * x[i] + 1.0
    m[1] = m[1] + 5
    return m[0]
"""


@pytest.fixture(params=[interpreted, compiled], ids=["interpreted", "compiled"])
def kernel(request: pytest.FixtureRequest) -> Kernel:
    made: Kernel = request.param(TEXT)
    return made


def test_a_kernel_reads_and_writes_its_arrays_and_returns_a_number(kernel: Kernel) -> None:
    x, m = np.array([1.0, 2.0, 3.0]), np.array([2, 0])
    assert kernel([x], [m]) == 2
    assert x.tolist() == [3.0, 5.0, 3.0] and m.tolist() == [2, 5]


@pytest.mark.parametrize(
    ("floats", "ints", "says"),
    [
        ([np.zeros(3, np.float32)], [np.zeros(2, np.int64)], r"floats\[0\] of a kernel is float32"),
        ([np.zeros(3)], [np.zeros(2, np.int32)], r"ints\[0\] of a kernel is int32"),
        ([np.zeros(3, np.int64)], [np.zeros(2, np.int64)], r"floats\[0\] of a kernel is int64"),
        ([np.zeros(3)], [np.zeros(2)], r"ints\[0\] of a kernel is float64"),
        ([np.zeros((3, 2))], [np.zeros(2, np.int64)], r"floats\[0\] of a kernel is float64 \(3, 2\)"),
        ([np.zeros(3), np.zeros(6)[::2]], [np.zeros(2, np.int64)], r"floats\[1\].*numpy\.ascontiguousarray"),
        ([np.zeros(3).astype(">f8")], [np.zeros(2, np.int64)], r"floats\[0\]"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(kernel: Kernel, floats: list[Any], ints: list[Any], says: str) -> None:
    with pytest.raises(InvalidValueError, match=says):
        kernel(floats, ints)


def test_other_arrays_are_seen_even_in_the_same_list(kernel: Kernel) -> None:
    floats, ints = [np.ones(2)], [np.array([2, 0])]
    kernel(floats, ints)
    first = floats[0]
    floats[0] = np.full(2, 10.0)
    kernel(floats, ints)
    assert first.tolist() == [3.0, 3.0] and floats[0].tolist() == [21.0, 21.0]


def test_numbers_cannot_move_unseen() -> None:
    kernel, x, m = compiled(TEXT), np.ones(2), np.array([2, 0])
    kernel([x], [m])
    with pytest.raises(ValueError, match="resize"):
        x.resize(100000, refcheck=False)


def test_a_kernel_keeps_no_array_alive() -> None:
    kernel, x, m = compiled(TEXT), np.ones(2), np.array([2, 0])
    kernel([x], [m])
    gone = weakref.ref(x)
    del x
    gc.collect()
    assert gone() is None
    y = np.ones(2)
    kernel([y], [m])
    assert y.tolist() == [3.0, 3.0]


def test_empty_and_read_only_arrays_are_taken(kernel: Kernel) -> None:
    read_only = np.ones(3)
    read_only.flags.writeable = False
    assert kernel([np.zeros(0), read_only], [np.array([0, 0]), np.zeros(0, np.int64)]) == 0


def test_no_arrays_at_all() -> None:
    text = "def entry(f, n):\n    return 3\n"
    assert interpreted(text)([], []) == compiled(text)([], []) == 3


def test_infinite_and_no_numbers_pass_through(kernel: Kernel) -> None:
    x = np.array([math.inf, math.nan, -0.5])
    kernel([x], [np.array([3, 0])])
    assert x[0] == math.inf and math.isnan(x[1]) and x[2] == 0.0
