"""Where frames are kept: what is known of each without its rows, and the rows in memory."""

from __future__ import annotations

import json
from array import array
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from xpheve.errors import RecordError
from xpheve.record.frame import WIDTHS, FloatArray, Frame, IntArray

_BLOCK_ROWS = 1 << 20  # 24 to 32 MiB a block: what a last block may leave unused is small


class FrameIndex:
    """Times, energies and sets of objects of all frames; rows are counted through all frames.

    Holds five numbers a frame, and the serials only where the set of objects changes.
    """

    def __init__(self, metadata: dict[str, Any], objects: Iterable[dict[str, Any]]) -> None:
        """Start without frames."""
        self.metadata = metadata
        self.note: dict[str, Any] = {}
        """What was added to the metadata at the end."""
        self.objects: dict[int, dict[str, Any]] = {}
        self.describe(objects)
        self._time = array("d")
        self._energy = array("d")
        self._starts = array("q", [0])
        self._firsts: list[int] = []
        self._sets: list[IntArray] = []

    def __len__(self) -> int:
        """How many frames there are."""
        return len(self._time)

    def describe(self, objects: Iterable[dict[str, Any]]) -> list[dict[str, Any]]:
        """Take note of objects; those that were new. What was said first of an object stays."""
        new = [row for row in objects if int(row["serial"]) not in self.objects]
        self.objects.update({int(row["serial"]): row for row in new})
        return new

    def append(self, time: float, serial: IntArray, energy: tuple[float, float, float]) -> None:
        """One more frame, its serials rising."""
        if not self._sets or not np.array_equal(self._sets[-1], serial):
            self._firsts.append(len(self._time))
            self._sets.append(serial.copy())
        self._time.append(time)
        self._energy.extend(energy)
        self._starts.append(self._starts[-1] + len(serial))

    @property
    def row_count(self) -> int:
        """How many rows all frames have together."""
        return self._starts[-1]

    @property
    def time(self) -> FloatArray:
        """Shape (k,) [s]."""
        return np.array(self._time, dtype=np.float64)

    @property
    def energy(self) -> FloatArray:
        """Kinetic, potential, work, shape (k, 3) [J]."""
        return np.array(self._energy, dtype=np.float64).reshape(-1, 3)

    @property
    def starts(self) -> IntArray:
        """First row of each frame, and the count of all, shape (k + 1,)."""
        return np.array(self._starts, dtype=np.int64)

    def rows(self, frame: int) -> slice:
        """Rows of a frame."""
        return slice(self._starts[frame], self._starts[frame + 1])

    def serials(self, frame: int) -> IntArray:
        """Objects of a frame, in rising serial."""
        return self._sets[bisect_right(self._firsts, frame) - 1]

    def common(self) -> IntArray | None:
        """Objects of every frame, or None if they changed."""
        if not self._sets:
            return np.zeros(0, dtype=np.int64)
        return self._sets[0] if len(self._sets) == 1 else None

    def changes(self) -> list[float]:
        """When [s] frames had other objects than the frame before."""
        return [self._time[first] for first in self._firsts[1:]]

    def find(self, serial: int) -> tuple[IntArray, IntArray]:
        """Frames in which an object is, and its row in each."""
        starts = self.starts
        frames, rows = [], []
        ends = [*self._firsts, len(self)][1:]
        for first, end, members in zip(self._firsts, ends, self._sets, strict=True):
            place = int(np.searchsorted(members, serial))
            if place < len(members) and members[place] == serial:
                frames.append(np.arange(first, end, dtype=np.int64))
                rows.append(starts[first:end] + place)
        if not frames:
            return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
        return np.concatenate(frames), np.concatenate(rows)

    def frame(self, number: int, columns: Mapping[str, _Sliced], at: slice) -> Frame:
        """Frame ``number``, its rows being those ``at`` of ``columns``."""
        kinetic, potential, work = self._energy[3 * number : 3 * number + 3]
        parts: dict[str, Any] = {name: frozen(columns[name][at]) for name in WIDTHS}
        serial = frozen(self.serials(number))
        return Frame(time=self._time[number], serial=serial, energy=(kinetic, potential, work), **parts)


class _Sliced(Protocol):
    def __getitem__(self, rows: slice, /) -> FloatArray: ...


class Store(Protocol):
    """Frames at rest."""

    index: FrameIndex
    path: Path | None
    torn: bool

    def column(self, name: str) -> FloatArray:
        """One column of all rows of all frames, shape (rows, 3) or (rows, 4)."""

    def frames(self, numbers: Iterable[int]) -> Iterator[Frame]:
        """Frames of these numbers, best in rising order."""


class MemoryStore:
    """Frames in memory; one costs a copy of its arrays, and no Python object a row."""

    path: Path | None = None
    torn = False

    def __init__(self, index: FrameIndex) -> None:
        """Start without frames."""
        self.index = index
        self._columns = {name: _Column(width) for name, width in WIDTHS.items()}

    def append(self, frame: Frame) -> None:
        """Keep a copy of one more frame."""
        for name, column in self._columns.items():
            column.append(getattr(frame, name))
        self.index.append(frame.time, frame.serial, frame.energy)

    def column(self, name: str) -> FloatArray:
        """One column of all rows of all frames; no copy is made the second time."""
        return self._columns[name].joined()

    def frames(self, numbers: Iterable[int]) -> Iterator[Frame]:
        """Frames whose arrays are views."""
        for number in numbers:
            yield self.index.frame(number, self._columns, self.index.rows(number))


class _Column:
    """Rows in blocks, each twice as long as the one before, so that what is kept is never moved while a run goes on."""

    def __init__(self, width: int) -> None:
        self._width = width
        self._blocks: list[FloatArray] = []
        self._firsts: list[int] = []
        self._count = 0

    def append(self, values: FloatArray) -> None:
        if not self._blocks or self._count - self._firsts[-1] + len(values) > len(self._blocks[-1]):
            length = 2 * len(self._blocks[-1]) if self._blocks else len(values)
            self._blocks.append(np.empty((max(len(values), min(length, _BLOCK_ROWS)), self._width)))
            self._firsts.append(self._count)
        start = self._count - self._firsts[-1]
        self._blocks[-1][start : start + len(values)] = values
        self._count += len(values)

    def __getitem__(self, rows: slice) -> FloatArray:
        """Rows that were appended together."""
        place = max(bisect_right(self._firsts, rows.start) - 1, 0)
        first = self._firsts[place]
        return self._blocks[place][rows.start - first : rows.stop - first]

    def joined(self) -> FloatArray:
        if not self._blocks:
            return np.empty((0, self._width))
        if len(self._blocks) > 1:
            ends = [*self._firsts[1:], self._count]
            used = [b[: end - first] for b, first, end in zip(self._blocks, self._firsts, ends, strict=True)]
            self._blocks, self._firsts = [np.concatenate(used)], [0]
        return self._blocks[0][: self._count]


def frozen(values: Any) -> Any:
    """View that cannot be written through."""
    view = values.view()
    view.flags.writeable = False
    return view


def plain(value: Any, what: str) -> Any:
    """``value`` as JSON would give it back, so that a record says the same from memory and from a file."""
    try:
        return json.loads(json.dumps(value, default=_plain))
    except (TypeError, ValueError) as error:
        raise RecordError(f"{what} cannot be written as JSON: {error}; give plain values") from None


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if isinstance(value, set | frozenset):
        return sorted(value)
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"{value!r} is a {type(value).__name__}")
