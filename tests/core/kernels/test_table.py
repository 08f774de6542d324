"""Tables in a flat buffer: the search, and what lies outside."""

from __future__ import annotations

import math
from array import array
from bisect import bisect_right

import pytest
from hypothesis import given
from hypothesis import strategies as st

from xpheve.kernels import table as kernel
from xpheve.trace.table import Table

increasing = st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=40, unique=True).map(sorted)


def buffer(table: Table, before: int = 0) -> memoryview:
    return memoryview(array("d", [math.nan] * before + table.numbers().tolist()))


@given(st.integers(2, 70), st.floats(-5.0, 80.0))
def test_the_search_counts_the_points_that_are_not_beyond(count: int, x: float) -> None:
    numbers = buffer(Table(range(count), [0.0] * count))
    assert kernel.piece(numbers, 0, count, x) == bisect_right(range(count), x)


@pytest.mark.parametrize("count", range(2, 20))
def test_the_search_finds_each_point_itself(count: int) -> None:
    numbers = buffer(Table(range(count), [0.0] * count), before=7)
    assert [kernel.piece(numbers, 7, count, float(k)) for k in range(-1, count + 1)] == [*range(count + 1), count]


class Watched(list[float]):
    """Numbers that refuse places before the first and after the last."""

    def __getitem__(self, place: int) -> float:  # type: ignore[override]
        assert 0 <= place < len(self), place
        return super().__getitem__(place)


@pytest.mark.parametrize("kind", ["linear", "cubic"])
@pytest.mark.parametrize("outside", ["error", "hold", "extend"])
@pytest.mark.parametrize("x", [math.inf, -math.inf, math.nan, 1e308, -1e308, 5e-324, 0.0, 3.0])
def test_no_place_outside_the_buffer_is_ever_read(kind: str, outside: str, x: float) -> None:
    table = Table((0.0, 1.0, 3.0), (2.0, 5.0, 4.0), kind=kind, outside=outside)
    numbers = Watched(table.numbers().tolist())
    further = ("slope",) if kind == "linear" else ("slope", "bend", "third")
    for name in (kind, *(f"{kind}_{one}" for one in further)):
        found = getattr(kernel, name)(numbers, 0, 3, x)
        assert isinstance(found, float)
        if math.isnan(x) or (outside == "error" and not 0.0 <= x <= 3.0):
            assert math.isnan(found)
        elif outside == "hold" or math.isfinite(x):
            assert math.isfinite(found) or abs(x) > 1e300
