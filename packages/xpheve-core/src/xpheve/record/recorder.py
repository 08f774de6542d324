"""Takes down a run, frame by frame."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from xpheve.errors import RecordError
from xpheve.record.frame import FrameSource, IntArray, in_order
from xpheve.record.record import Record
from xpheve.record.store import FrameIndex, MemoryStore, plain

if TYPE_CHECKING:
    from xpheve.record.files import Writer


class Recorder:
    """Samples a source, into memory or into a file that can be read at any moment.

    Parameters
    ----------
    source
        What to ask for frames, and for descriptions of objects not met before.
    path
        File to write, or None for memory. Its folder must exist; a file of this name is replaced once the new one can
        be read.
    metadata
        What is to be known of the run: up, seed, the choices of the plan. Plain values; ``xpheve`` is filled in.

    Raises
    ------
    RecordError
        Before anything is recorded: no such folder, no permission, metadata that JSON cannot hold.

    """

    def __init__(
        self,
        source: FrameSource,
        path: str | os.PathLike[str] | None = None,
        metadata: dict[str, Any] | None = None,
    ) -> None:
        """Write the header of a file, if there is to be one."""
        from xpheve import __version__

        said = {"xpheve": __version__, **(metadata or {})}
        index = FrameIndex(plain(said, "metadata of the record"), _described(source))
        self._source = source
        self._index = index
        self._serial: IntArray = np.zeros(0, dtype=np.int64)
        self._time = -np.inf
        self._record: Record | None = None
        self._sink: MemoryStore | Writer
        if path is None:
            self._sink = MemoryStore(index)
        else:
            from xpheve.record.files import Writer

            self._sink = Writer(path, index)

    def sample(self) -> None:
        """Keep the present moment. A file gets it within about a second of further samples, or at `close`."""
        if self._record is not None:
            raise RecordError("this recorder is closed; a new run needs a new one")
        frame = in_order(self._source.frame())
        if frame.time < self._time:
            raise RecordError(f"a frame at {frame.time} s after one at {self._time} s: time must not run back")
        if not np.array_equal(frame.serial, self._serial):
            self._meet(frame.serial)
        self._sink.append(frame)
        self._time = frame.time

    def close(self, note: dict[str, Any] | None = None) -> Record:
        """End the recording; the record. ``note`` is added to its metadata. Closing again gives the same."""
        if self._record is None:
            if note:
                self._index.metadata.update(plain(note, "note at the end of the record"))
                self._index.note = dict(note)
            self._record = Record(self._sink if isinstance(self._sink, MemoryStore) else self._sink.close())
        return self._record

    def _meet(self, serial: IntArray) -> None:
        known = self._index.objects
        if any(int(number) not in known for number in serial):
            self._index.describe(_described(self._source))
            missing = [int(number) for number in serial if int(number) not in known]
            if missing:
                raise RecordError(f"frames tell of the serials {missing[:5]}, which the object table does not list")
        self._serial = serial.copy()


def _described(source: FrameSource) -> list[dict[str, Any]]:
    table: list[dict[str, Any]] = plain(source.object_table(), "the object table")
    return sorted(table, key=lambda row: int(row["serial"]))
