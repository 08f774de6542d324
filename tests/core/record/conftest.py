"""A source that needs no engine: frame k is a function of k alone, so that any frame can be checked to the bit."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from xpheve.record import Frame, Record, Recorder

COLUMNS = ("position", "velocity", "orientation", "angular_velocity")


class FakeSource:
    """Objects ``members(k)`` at frame k, a sphere each."""

    def __init__(
        self,
        members: Callable[[int], list[int]],
        *,
        energy: Callable[[int], tuple[float, float, float]] = lambda k: (1.0 + k, 2.0 - k, 0.5),
        names: dict[int, str] | None = None,
    ) -> None:
        self.members, self.energy, self.names = members, energy, names or {}
        self.number = 0
        self.asked = 0

    def frame(self) -> Frame:
        return self.frame_at(self.number)

    def frame_at(self, k: int) -> Frame:
        serial = np.array(self.members(k), dtype=np.int64)
        random = np.random.default_rng(k)
        # Drawn for 100 serials, so that an object's numbers do not depend on who else is there.
        values = {name: random.normal(size=(100, 4 if name == "orientation" else 3))[serial] for name in COLUMNS}
        return Frame(time=k / 60, serial=serial, energy=self.energy(k), **values)

    def object_table(self) -> list[dict[str, Any]]:
        self.asked += 1
        return [
            {
                "serial": serial,
                "name": self.names.get(serial),
                "shape": {"kind": "sphere", "radius": 0.1},
                "mass": math.inf if serial == 1 else 1.0,
                "fixed": serial == 1,
            }
            for serial in self.members(self.number)
        ]

    def recorded(self, frames: int, path: Path | None = None, metadata: dict[str, Any] | None = None) -> Record:
        recorder = Recorder(self, path, metadata)
        for self.number in range(frames):
            recorder.sample()
        return recorder.close()


def assert_is(frame: Frame, expected: Frame) -> None:
    """The same to the bit, whatever the order of rows."""
    order = np.argsort(expected.serial)
    assert frame.time == expected.time
    assert np.array(frame.energy).tobytes() == np.array(expected.energy).tobytes()
    assert frame.serial.tobytes() == expected.serial[order].tobytes()
    for name in COLUMNS:
        assert getattr(frame, name).tobytes() == getattr(expected, name)[order].tobytes(), name


@pytest.fixture
def fake() -> type[FakeSource]:
    return FakeSource


@pytest.fixture
def check() -> Callable[[Frame, Frame], None]:
    return assert_is


@pytest.fixture
def small_batches(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two frames of two objects a batch."""
    monkeypatch.setattr("xpheve.record.files._BATCH_ROWS", 4)
