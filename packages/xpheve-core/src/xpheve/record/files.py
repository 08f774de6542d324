"""Records on disk, and the one door to pyarrow.

A record is an Arrow IPC stream that any Arrow reader can open: a long table, one row per frame and object. Metadata
of the schema hold the format and its version, the metadata of the run, and the objects known at the start. Each batch
holds whole frames; its own metadata hold what rows cannot: objects described since (``objects``), and frames without
objects (``empty``: frame, time, kinetic, potential, work). The last batch has no rows and says ``closed``; without it
the file is torn, and good up to its last complete batch. JSON is Python's, with NaN and Infinity.
"""

from __future__ import annotations

import io
import json
import os
import signal
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa

from xpheve.errors import RecordError
from xpheve.record.frame import WIDTHS, FloatArray, Frame, IntArray
from xpheve.record.paths import aside, writable
from xpheve.record.store import FrameIndex, Store

FORMAT = "xpheve.record"
VERSION = 1
_BATCH_ROWS = 8192  # about 1 MiB of rows
_TABLE_ROWS = 1 << 17
_BATCH_FRAMES = 8192  # the same for frames without objects
_BATCH_SECONDS = 1.0  # wall time between batches while samples come; what a kill may cost

_PARTS = {
    "position": ("x", "y", "z"),
    "velocity": ("vx", "vy", "vz"),
    "orientation": ("qw", "qx", "qy", "qz"),
    "angular_velocity": ("wx", "wy", "wz"),
}
_ENERGIES = ("kinetic", "potential", "work")
_HEADS = ("frame", "time", "serial")
_REPEATED = ["frame", "time", "serial", "name", "kinetic", "potential", "work"]
_FLOATS = [part for parts in _PARTS.values() for part in parts] + list(_ENERGIES)
_SCHEMA = pa.schema(
    [
        pa.field("frame", pa.int64(), nullable=False),
        pa.field("time", pa.float64(), nullable=False),
        pa.field("serial", pa.int64(), nullable=False),
        pa.field("name", pa.string()),
        *(pa.field(name, pa.float64(), nullable=False) for name in _FLOATS),
    ]
)
_PREFIX = _SCHEMA.serialize().to_pybytes()  # in front of any batch it makes a stream
_OPTIONS = pa.ipc.IpcWriteOptions(compression="lz4")  # fast, lossless, and repeated columns shrink to nothing


class _Batch(NamedTuple):
    offset: int
    length: int
    first_frame: int
    first_row: int
    row_count: int


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Let Ctrl-C wait for the end of what is done here, which must not be done by half; in other threads it does not come."""
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield
        return
    came: list[Any] = []
    signal.signal(signal.SIGINT, lambda *what: came.append(what))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        if came:
            before(*came[0])


class Writer:
    """Appends batches to a file that is a readable record from its first moment on."""

    def __init__(self, path: str | os.PathLike[str], index: FrameIndex) -> None:
        """Write the header aside and move it into place."""
        self.path = writable(path)
        self.index = index  # of what the file holds
        self._batches: list[_Batch] = []
        self._pending: list[Frame] = []
        self._pending_rows = 0
        self._described = len(index.objects)  # how many objects the file tells of
        self._names = _Names(index)
        self._bytes = io.BytesIO()
        self._stream = pa.ipc.new_stream(self._bytes, _schema_for(index), options=_OPTIONS)
        self._stream.write_batch(_batch_of([], 0, self._names))  # the schema is not written before a first batch
        header = self._take()
        with aside(self.path) as beside:
            beside.write_bytes(header)
        try:
            self._file: io.FileIO | None = open(self.path, "ab", buffering=0)
        except OSError as error:
            raise RecordError(f"{self.path}: cannot be written ({error.strerror})") from error
        self._end = len(header)
        self._flushed = monotonic()

    def append(self, frame: Frame) -> None:
        """Keep a copy of the frame for the next batch, which follows at once if it is time."""
        if self._file is None:
            raise RecordError(f"{self.path}: writing failed before; what it holds can be read")
        copies: dict[str, Any] = {name: getattr(frame, name).copy() for name in ("serial", *WIDTHS)}
        self._pending.append(Frame(time=frame.time, energy=frame.energy, **copies))
        self._pending_rows += len(frame.serial)
        full = self._pending_rows >= _BATCH_ROWS or len(self._pending) >= _BATCH_FRAMES
        if full or monotonic() - self._flushed >= _BATCH_SECONDS:
            self.flush()

    def flush(self) -> None:
        """Hand all frames so far to the operating system, as one batch."""
        if not self._pending and self._described == len(self.index.objects):
            return
        with uninterrupted():
            first = len(self.index)
            news, described = self._news(first), len(self.index.objects)
            self._put(_batch_of(self._pending, first, self._names), news, len(self._pending))
            self._described = described
            for frame in self._pending:
                self.index.append(frame.time, frame.serial, frame.energy)
            self._pending, self._pending_rows = [], 0
            self._flushed = monotonic()

    def close(self) -> FileStore:
        """Write what is left and the mark of the end; the file as it can now be read."""
        if self._file is None:
            return FileStore(self.path, self.index, self._batches, torn=True)
        self.flush()
        self._put(_batch_of([], len(self.index), self._names), {"closed": True, "note": self.index.note}, 0)
        self._stream.close()
        self._write(self._take())
        self._file.close()
        self._file = None
        return FileStore(self.path, self.index, self._batches, torn=False)

    def _news(self, first: int) -> dict[str, Any]:
        news: dict[str, Any] = {}
        rows = list(self.index.objects.values())[self._described :]
        empty = [[first + k, f.time, *f.energy] for k, f in enumerate(self._pending) if not len(f.serial)]
        if rows:
            news["objects"] = rows
        if empty:
            news["empty"] = empty
        return news

    def _put(self, batch: pa.RecordBatch, news: dict[str, Any], frame_count: int) -> None:
        self._take()
        self._stream.write_batch(batch, custom_metadata={FORMAT: json.dumps(news)} if news else None)
        data = self._take()
        start = self._end
        self._write(data)
        if frame_count:
            self._batches.append(_Batch(start, len(data), len(self.index), self.index.row_count, batch.num_rows))

    def _take(self) -> bytes:
        data = self._bytes.getvalue()
        self._bytes.seek(0)
        self._bytes.truncate()
        return data

    def _write(self, data: bytes) -> None:
        assert self._file is not None
        rest = memoryview(data)
        try:
            self._file.truncate(self._end)  # a write that was interrupted, by Ctrl-C say, may have left a part
            while rest:
                rest = rest[self._file.write(rest) :]
        except OSError as error:
            file, self._file = self._file, None
            with file:
                file.truncate(self._end)  # so that no half batch stays
            raise RecordError(
                f"{self.path}: writing failed ({error.strerror}); the {len(self.index)} frames before can be read"
            ) from error
        self._end += len(data)


class FileStore:
    """The frames in a file; opened for each reading, so that nothing is held between."""

    def __init__(self, path: Path, index: FrameIndex, batches: list[_Batch], *, torn: bool) -> None:
        """Know the file at ``path`` by what ``index`` and ``batches`` say of it."""
        self.path: Path | None = path
        self.index = index
        self.torn = torn
        self._file = path.absolute()
        self._batches = batches
        self._stamp = self._stamp_of(os.stat(path))

    def column(self, name: str) -> FloatArray:
        """One column of all rows of all frames, read anew."""
        values = np.empty((self.index.row_count, WIDTHS[name]))
        with self._opened() as file:
            for batch in self._batches:
                table = self._read(file, batch, _PARTS[name])
                for k, part in enumerate(_PARTS[name]):
                    values[batch.first_row : batch.first_row + batch.row_count, k] = table.column(part).to_numpy()
        return values

    def frames(self, numbers: Iterable[int]) -> Iterator[Frame]:
        """Frames, with the batch of the last one in memory."""
        firsts = np.array([batch.first_frame for batch in self._batches], dtype=np.int64)
        place, columns = -1, {}
        for number in numbers:
            wanted = int(np.searchsorted(firsts, number, side="right")) - 1
            batch = self._batches[wanted]
            if wanted != place:
                with self._opened() as file:
                    table = self._read(file, batch, _FLOATS)
                columns = {
                    name: np.column_stack([table.column(part).to_numpy() for part in parts])
                    for name, parts in _PARTS.items()
                }
                place = wanted
            rows = self.index.rows(number)
            at = slice(rows.start - batch.first_row, rows.stop - batch.first_row)
            yield self.index.frame(number, columns, at)

    def _opened(self) -> io.BufferedReader:
        try:
            file = open(self._file, "rb")
        except OSError as error:
            raise RecordError(f"{self.path}: can no longer be read ({error.strerror})") from error
        if self._stamp_of(os.fstat(file.fileno())) != self._stamp:
            file.close()
            raise RecordError(f"{self.path}: has been replaced since it was opened; open it again")
        return file

    def _stamp_of(self, stat: os.stat_result) -> tuple[int, ...]:
        # A torn record may still be growing.
        return (stat.st_dev, stat.st_ino, *(() if self.torn else (stat.st_size, stat.st_mtime_ns)))

    def _read(self, file: io.BufferedReader, batch: _Batch, names: Iterable[str]) -> pa.RecordBatch:
        file.seek(batch.offset)
        stream = io.BytesIO(_PREFIX + file.read(batch.length))
        options = pa.ipc.IpcReadOptions(included_fields=[_SCHEMA.get_field_index(name) for name in names])
        try:
            read = pa.ipc.open_stream(stream, options=options).read_next_batch()
            read.validate()
        except (pa.ArrowException, OSError, StopIteration) as error:
            raise RecordError(f"{self.path}: damaged at byte {batch.offset} ({error})") from error
        if read.num_rows != batch.row_count or any(column.null_count for column in read.columns):
            raise RecordError(f"{self.path}: damaged at byte {batch.offset}")
        return read


def open_store(path: str | os.PathLike[str]) -> FileStore:
    """Read heads and energies of all frames in a file; see ``Record.open``."""
    place = Path(path)
    try:
        size = place.stat().st_size
        file = pa.OSFile(str(place))
    except OSError as error:
        raise RecordError(f"{place}: cannot be read ({error.strerror or error})") from error
    with file:
        if size == 0:
            raise RecordError(f"{place}: is empty; it is not a record")
        names = [*_HEADS, *_ENERGIES]
        options = pa.ipc.IpcReadOptions(included_fields=[_SCHEMA.get_field_index(name) for name in names])
        try:
            schema = pa.ipc.open_stream(file).schema
            index = _index_of(place, schema)
            file.seek(0)
            stream = pa.ipc.open_stream(file, options=options)
        except (pa.ArrowException, OSError, EOFError, ValueError) as error:
            raise RecordError(
                f"{place}: is not a record, or is torn within its header; records are made by run(..., every=..., path)"
            ) from error
        batches: list[_Batch] = []
        closed = False
        while not closed:
            start = file.tell()
            try:
                batch, said = stream.read_next_batch_with_custom_metadata()
                news = json.loads(said[FORMAT]) if said is not None and FORMAT in said else {}
                heads = _heads_of(batch, news.get("empty", ()), len(index))
                index.describe(news.get("objects", ()))
            except (StopIteration, pa.ArrowException, OSError, ValueError, TypeError, LookupError, AttributeError):
                break  # all before is good
            closed = bool(news.get("closed"))
            index.metadata.update(news.get("note") or {})
            if heads:
                batches.append(_Batch(start, file.tell() - start, len(index), index.row_count, batch.num_rows))
            for time, members, energy in heads:
                index.append(time, members, energy)
    return FileStore(place, index, batches, torn=not closed)


def write_store(path: str | os.PathLike[str], store: Store) -> Path:
    """Write a whole record aside and move it into place."""
    target = writable(path)
    described = FrameIndex(store.index.metadata, store.index.objects.values())
    with aside(target) as beside:
        writer = Writer(beside, described)
        for frame in store.frames(range(len(store.index))):
            writer.append(frame)
        writer.close()
    return target


def tables(store: Store) -> Iterator[pa.RecordBatch]:
    """All rows, in batches of about 20 MiB, which is what a Parquet row group should hold at least."""
    names = _Names(store.index)
    pending: list[Frame] = []
    first = rows = 0
    for frame in store.frames(range(len(store.index))):
        pending.append(frame)
        rows += len(frame.serial)
        if rows >= _TABLE_ROWS:
            yield _batch_of(pending, first, names)
            first, rows, pending = first + len(pending), 0, []
    yield _batch_of(pending, first, names)


def csv_writer(path: Path, index: FrameIndex) -> Any:
    """Open a CSV file as a context that takes batches by ``write_batch``."""
    from pyarrow import csv

    return csv.CSVWriter(str(path), _SCHEMA)


def parquet_writer(path: Path, index: FrameIndex) -> Any:
    """Open a Parquet file, likewise; the metadata of a record go along."""
    from pyarrow import parquet

    return parquet.ParquetWriter(str(path), _schema_for(index), compression="zstd", use_dictionary=_REPEATED)


class _Names:
    """Names as an Arrow array, to be picked from by serial; follows the index as it grows."""

    def __init__(self, index: FrameIndex) -> None:
        self._index = index
        self._serials = np.zeros(0, dtype=np.int64)
        self._names = pa.array([], pa.string())

    def of(self, serial: Any) -> pa.Array:
        objects = self._index.objects
        if len(objects) != len(self._serials):
            self._serials = np.array(sorted(objects), dtype=np.int64)
            names = (objects[int(number)]["name"] for number in self._serials)
            # A lone surrogate has no UTF-8; the object table keeps it.
            clean = [None if name is None else str(name).encode("utf-8", "replace").decode() for name in names]
            self._names = pa.array(clean, pa.string())
        return self._names.take(pa.array(np.searchsorted(self._serials, serial)))


def _batch_of(frames: list[Frame], first: int, names: _Names) -> pa.RecordBatch:
    if not frames:
        return pa.RecordBatch.from_pylist([], schema=_SCHEMA)
    counts = [len(frame.serial) for frame in frames]
    serial = np.concatenate([frame.serial for frame in frames])
    columns = [
        pa.array(np.repeat(np.arange(first, first + len(frames), dtype=np.int64), counts)),
        pa.array(np.repeat(np.array([frame.time for frame in frames]), counts)),
        pa.array(serial),
        names.of(serial),
    ]
    for name in _PARTS:
        joined = np.concatenate([getattr(frame, name) for frame in frames])
        columns += [pa.array(column) for column in np.ascontiguousarray(joined.T)]
    energy = np.repeat(np.array([frame.energy for frame in frames]), counts, axis=0)
    columns += [pa.array(column) for column in np.ascontiguousarray(energy.T)]
    return pa.RecordBatch.from_arrays(columns, schema=_SCHEMA)


def _schema_for(index: FrameIndex) -> pa.Schema:
    said = {
        "format": FORMAT,
        "version": VERSION,
        "metadata": index.metadata,
        "objects": list(index.objects.values()),
    }
    return _SCHEMA.with_metadata({FORMAT: json.dumps(said)})


def _index_of(path: Path, schema: pa.Schema) -> FrameIndex:
    said = (schema.metadata or {}).get(FORMAT.encode())
    if said is None:
        raise RecordError(f"{path}: is an Arrow stream, but not a record of xPheve")
    try:
        header = json.loads(said)
        version = header["version"]
        if version != VERSION:
            raise RecordError(
                f"{path}: is a record of format {version}, and this xPheve reads format {VERSION}; use a newer xPheve"
            )
        index = FrameIndex(header["metadata"], header["objects"])
    except (ValueError, KeyError, TypeError) as error:
        raise RecordError(f"{path}: is not a record: its header cannot be understood ({error})") from error
    if schema.remove_metadata() != _SCHEMA:
        raise RecordError(f"{path}: is not a record: its columns are others")
    return index


_Head = tuple[float, IntArray, tuple[float, float, float]]


def _heads_of(batch: pa.RecordBatch, empty: Iterable[list[float]], first: int) -> list[_Head]:
    """Time, serials and energies of the frames of a batch, from ``first`` on, those without rows in their places."""
    batch.validate()
    number, time, serial = (batch.column(name).to_numpy() for name in _HEADS)
    energies = np.column_stack([batch.column(name).to_numpy() for name in _ENERGIES]).tolist()
    none = np.zeros(0, dtype=np.int64)
    heads: dict[int, _Head] = {int(e[0]): (float(e[1]), none, (float(e[2]), float(e[3]), float(e[4]))) for e in empty}
    starts = np.flatnonzero(np.diff(number, prepend=-1))
    ends = np.append(starts, len(number))[1:]
    for start, end in zip(starts, ends, strict=True):
        kinetic, potential, work = energies[start]
        heads[int(number[start])] = (float(time[start]), serial[start:end], (kinetic, potential, work))
    if sorted(heads) != list(range(first, first + len(heads))):
        raise ValueError(f"frames {sorted(heads)[:5]} where {first} was to come")
    return [heads[k] for k in sorted(heads)]
