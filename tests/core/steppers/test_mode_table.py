"""Modes of many rows: each set of numbers once; one by one, at once, interpreted and compiled to the same bits."""

from __future__ import annotations

import numpy as np
import pytest

from xpheve.steppers.mode_table import ModeTable
from xpheve.steppers.wide import Wide


def some(count: int, seed: int = 0) -> tuple[Wide, Wide, Wide, Wide]:
    """a, b and their imaginary parts: springs, drag, gyrations."""
    rng = np.random.default_rng(seed)
    a = -(10.0 ** rng.uniform(-6.0, 6.0, count)) * (rng.random(count) < 0.8)
    b = -(10.0 ** rng.uniform(-6.0, 6.0, count)) * (rng.random(count) < 0.5)
    d = rng.normal(size=count) * (rng.random(count) < 0.3)
    return Wide(a, 1e-17 * a), Wide(b), Wide(np.zeros(count)), Wide(d)


def test_equal_numbers_are_one_mode() -> None:
    table = ModeTable()
    ones, none = Wide(np.array([-1.0, -2.0, -1.0, -0.0, 0.0])), Wide(np.zeros(5))
    assert table.numbers_of(ones, none, none, none).tolist() == [0, 1, 0, 2, 2]
    assert table.numbers_of(ones[1:3], none[1:3], none[1:3], none[1:3]).tolist() == [1, 0]
    assert table.count == 3


@pytest.mark.parametrize("count", [5, 100])
def test_one_mode_has_the_bits_that_it_has_beside_others(count: int) -> None:
    table = ModeTable()
    numbers = table.numbers_of(*some(count))
    rng = np.random.default_rng(1)
    for spans in (
        (np.full(count, 0.3), np.full(count, 1e-18)),
        (10.0 ** rng.uniform(-3.0, 3.0, count), np.zeros(count)),
    ):
        whole = table.at(numbers, spans)
        for k in range(count):
            alone = table.at(numbers[k : k + 1], (spans[0][k : k + 1], spans[1][k : k + 1]))
            assert (alone[:, 0] == whole[:, k]).all()


def test_compiled_and_interpreted_modes_have_the_same_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    found = []
    for many in (1, 10**9):
        monkeypatch.setattr("xpheve.steppers.mode_table.MANY", many)
        table = ModeTable()
        numbers = table.numbers_of(*some(300))
        found.append(table.at(numbers, (np.full(300, 0.7), np.zeros(300))))
    assert np.isfinite(found[0]).all()
    assert (found[0] == found[1]).all()


def test_a_table_grows() -> None:
    table = ModeTable()
    first = table.numbers_of(*some(10, 1))
    before = table.at(first, (np.ones(10), np.zeros(10)))
    table.numbers_of(*some(1000, 2))
    assert (table.at(first, (np.ones(10), np.zeros(10))) == before).all()
