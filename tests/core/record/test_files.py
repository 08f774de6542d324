"""A record survives what can befall a file."""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
import time
from pathlib import Path

import pyarrow as pa
import pytest

from xpheve.errors import RecordError
from xpheve.record import Record, Recorder, files

CHILD = """
import sys
sys.path.insert(0, sys.argv[1])
from conftest import FakeSource
from xpheve.record import Recorder, files

files._BATCH_ROWS = 12
source = FakeSource(lambda k: [1, 2] if k % 7 else [1, 2, 3 + k % 90])
source.frame()  # numpy loads its random numbers
print("ready", flush=True)
sys.stdin.readline()
recorder = Recorder(source, sys.argv[2], {"run": "new"})
flush = recorder._sink.flush
def told():
    flush()
    print(len(recorder._index), flush=True)
recorder._sink.flush = told
for source.number in range(100_000):
    recorder.sample()
"""


def test_a_killed_run_leaves_a_record(fake, check, tmp_path) -> None:
    """Fifty times, sooner or later: all that was handed to the system is there, to the bit."""
    chance = random.Random(1)
    source = fake(lambda k: [1, 2] if k % 7 else [1, 2, 3 + k % 90])
    lengths = []
    for start in range(0, 50, 10):
        paths = [tmp_path / f"{start + k}.arrow" for k in range(10)]
        for path in paths[::2]:
            fake(lambda k: [1]).recorded(1, path, {"run": "old"})
        commands = [[sys.executable, "-c", CHILD, str(Path(__file__).parent), str(path)] for path in paths]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        children = [subprocess.Popen(command, **pipes) for command in commands]
        for path, child in zip(paths, children, strict=True):
            assert child.stdin is not None and child.stdout is not None
            assert child.stdout.readline() == "ready\n"
            child.stdin.write("go\n")
            child.stdin.flush()
            heard = [child.stdout.readline() for _ in range(chance.choice([0, 0, 1, 5, 30]))]
            time.sleep(0.01 * chance.random())
            child.kill()
            lines = [*heard, *child.stdout.read().splitlines(keepends=True)]
            told = [int(line) for line in lines if line.endswith("\n")]
            child.wait()
            child.stdin.close()
            child.stdout.close()
            if not path.exists():
                assert not told
                continue
            record = Record.open(path)
            if record.metadata["run"] == "old":
                assert not told and not record.torn
                continue
            assert record.torn
            assert len(record) >= (told[-1] if told else 0)
            lengths.append(len(record))
            for k, frame in enumerate(record):
                check(frame, source.frame_at(k))
    assert max(lengths) > 10  # some were killed well under way


def test_a_file_cut_anywhere_gives_its_complete_batches(fake, check, small_batches, tmp_path) -> None:
    sets = [[1, 2], [1, 2], [], [1, 3], [1, 3], [1, 3]]
    source = fake(lambda k: sets[k])
    path = tmp_path / "run.arrow"
    whole = source.recorded(len(sets), path)
    ends = [(batch.offset + batch.length, batch.first_frame) for batch in whole._store._batches]  # type: ignore[attr-defined]
    firsts = [first for _, first in ends[1:]] + [len(sets)]
    header = whole._store._batches[0].offset  # type: ignore[attr-defined]
    schema = pa.ipc.open_stream(path.read_bytes()).schema.serialize().size
    seen = set()
    for length in range(path.stat().st_size, -1, -1):
        os.truncate(path, length)
        if length < schema:
            with pytest.raises(RecordError, match=r"run\.arrow: is (empty|not a record)"):
                Record.open(path)
            continue
        record = Record.open(path)
        expected = sum(1 for end, _ in ends if end <= length)
        count = firsts[expected - 1] if expected else 0
        assert len(record) == count, length
        seen.add((count, record.torn))
        if length in {end for end, _ in ends} or length == header:
            for k, frame in enumerate(record):
                check(frame, source.frame_at(k))
    assert seen == {(0, True), *((first, True) for first in firsts), (len(sets), False)}


def test_a_torn_record_can_be_saved_whole(fake, check, small_batches, tmp_path) -> None:
    source = fake(lambda k: [1, 2])
    path = tmp_path / "run.arrow"
    source.recorded(9, path)
    os.truncate(path, path.stat().st_size * 2 // 3)
    torn = Record.open(path)
    assert torn.torn and 0 < len(torn) < 9 and "torn" in repr(torn)
    torn.save(path)
    for record in (torn, Record.open(path)):
        assert not record.torn and len(record) == len(torn)
        for k, frame in enumerate(record):
            check(frame, source.frame_at(k))


def test_a_record_can_be_read_while_it_grows(fake, check, small_batches, tmp_path) -> None:
    source = fake(lambda k: [1, 2])
    recorder = Recorder(source, tmp_path / "run.arrow")
    assert len(Record.open(tmp_path / "run.arrow")) == 0  # readable from the first moment
    looks = []
    for source.number in range(10):
        recorder.sample()
        looks.append(Record.open(tmp_path / "run.arrow"))
        assert looks[-1].torn and len(looks[-1]) == (source.number + 1) // 2 * 2
    recorder.close()
    for record in looks:
        for k, frame in enumerate(record):
            check(frame, source.frame_at(k))


def test_a_batch_goes_out_after_a_second(fake, monkeypatch, tmp_path) -> None:
    now = [100.0]
    monkeypatch.setattr(files, "monotonic", lambda: now[0])
    source = fake(lambda k: [1])
    recorder = Recorder(source, tmp_path / "run.arrow")
    for source.number in range(5):
        recorder.sample()
        now[0] += 0.3
    assert len(Record.open(tmp_path / "run.arrow")) == 5  # the fifth came after 1.2 s
    recorder.close()


def test_damage_in_the_middle_is_met_with_an_error_or_an_end(fake, small_batches, tmp_path) -> None:
    path = tmp_path / "run.arrow"
    fake(lambda k: [1, 2]).recorded(6, path)
    good = path.read_bytes()
    chance = random.Random(2)
    for _ in range(300):
        bad = bytearray(good)
        for _ in range(chance.choice([1, 8])):
            bad[chance.randrange(len(bad))] = chance.randrange(256)
        path.write_bytes(bad)
        try:
            for _ in Record.open(path):
                pass
        except RecordError as error:
            assert "run.arrow" in str(error)


def test_what_is_no_record_is_refused_by_name(fake, tmp_path) -> None:
    def refused(name: str, message: str) -> None:
        with pytest.raises(RecordError, match=message) as caught:
            Record.open(tmp_path / name)
        assert name in str(caught.value)

    def stream(name: str, schema: pa.Schema) -> None:
        with pa.OSFile(str(tmp_path / name), "wb") as file, pa.ipc.new_stream(file, schema):
            pass

    refused("missing", "No such file")
    (tmp_path / "folder").mkdir()
    refused("folder", "cannot be read")
    (tmp_path / "empty").touch()
    refused("empty", "is empty")
    for name, content in [("text", b"time,x\n0,1\n"), ("zeros", bytes(1000)), ("ones", b"\xff" * 1000), ("one", b"A")]:
        (tmp_path / name).write_bytes(content)
        refused(name, "is not a record")
    with pa.OSFile(str(tmp_path / "arrow_file"), "wb") as file, pa.ipc.new_file(file, files._SCHEMA):
        pass
    refused("arrow_file", "is not a record")
    stream("other", pa.schema([("x", pa.int64())]))
    refused("other", "not a record of xPheve")
    stream("empty_header", files._SCHEMA.with_metadata({files.FORMAT: "{}"}))
    refused("empty_header", "header")
    said = {"format": files.FORMAT, "version": files.VERSION + 1, "metadata": {}, "objects": []}
    stream("newer", files._SCHEMA.with_metadata({files.FORMAT: json.dumps(said)}))
    refused("newer", f"format {files.VERSION + 1}.*use a newer xPheve")
    said["version"] = files.VERSION
    stream("columns", pa.schema([("x", pa.int64())], metadata={files.FORMAT: json.dumps(said)}))
    refused("columns", "columns")


def test_a_path_that_cannot_be_written_is_refused_before_the_run(fake, tmp_path) -> None:
    source = fake(lambda k: [1])
    with pytest.raises(RecordError, match=r"folder .*nowhere does not exist"):
        Recorder(source, tmp_path / "nowhere" / "run.arrow")
    with pytest.raises(RecordError, match="not a file"):
        Recorder(source, tmp_path)
    record = source.recorded(2)
    for export in (record.save, record.to_csv, record.to_parquet, record.plot):
        with pytest.raises(RecordError, match="does not exist"):
            export(tmp_path / "nowhere" / "out")
        with pytest.raises(RecordError, match="not a file"):
            export(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_an_old_record_stays_until_the_new_one_can_be_read(fake, monkeypatch, tmp_path) -> None:
    path = tmp_path / "run.arrow"
    fake(lambda k: [1]).recorded(3, path)
    monkeypatch.setattr(files.os, "replace", lambda *paths: (_ for _ in ()).throw(OSError(28, "No space left")))
    with pytest.raises(RecordError, match="No space left"):
        Recorder(fake(lambda k: [1]), path)
    assert len(Record.open(path)) == 3 and [entry.name for entry in tmp_path.iterdir()] == ["run.arrow"]


def test_an_interrupted_write_is_done_again(fake, check, small_batches, monkeypatch, tmp_path) -> None:
    source = fake(lambda k: [1, 2] if k < 2 else [1, 2, 3])
    recorder = Recorder(source, tmp_path / "run.arrow")
    write = files.Writer._write

    def interrupted(self: files.Writer, data: bytes) -> None:
        assert self._file is not None
        self._file.write(data[:100])
        monkeypatch.undo()
        raise KeyboardInterrupt

    for source.number in range(3):
        recorder.sample()
    monkeypatch.setattr(files.Writer, "_write", interrupted)
    source.number = 3
    with pytest.raises(KeyboardInterrupt):
        recorder.sample()
    assert files.Writer._write is write
    for record in (recorder.close(), Record.open(tmp_path / "run.arrow")):
        assert len(record) == 4 and not record.torn
        for k, frame in enumerate(record):
            check(frame, source.frame_at(k))


def test_a_full_disk_leaves_what_was_written(fake, check, small_batches, tmp_path) -> None:
    source = fake(lambda k: [1, 2])
    path = tmp_path / "run.arrow"
    recorder = Recorder(source, path)
    for source.number in range(4):
        recorder.sample()
    sink = recorder._sink
    real = sink._file  # type: ignore[union-attr]

    class Full:
        """Takes 100 bytes, then no more."""

        def __init__(self) -> None:
            self.room = 100

        def write(self, data: memoryview) -> int:
            if not self.room:
                raise OSError(28, "No space left on device")
            self.room = 0
            written: int = real.write(data[:100])  # type: ignore[union-attr]
            return written

        def truncate(self, length: int) -> int:
            done: int = real.truncate(length)  # type: ignore[union-attr]
            return done

        def __enter__(self) -> None: ...

        def __exit__(self, *error: object) -> None:
            real.close()  # type: ignore[union-attr]

    sink._file = Full()  # type: ignore[union-attr,assignment]
    with pytest.raises(RecordError, match=r"No space left on device.*the 4 frames before can be read"):
        for source.number in range(4, 8):
            recorder.sample()
    with pytest.raises(RecordError, match="failed before"):
        recorder.sample()
    for record in (recorder.close(), Record.open(path)):
        assert len(record) == 4 and record.torn
        for k, frame in enumerate(record):
            check(frame, source.frame_at(k))


def test_an_interrupt_waits_until_a_batch_is_written() -> None:
    import signal

    from xpheve.record.files import uninterrupted

    reached = []
    with pytest.raises(KeyboardInterrupt), uninterrupted():
        signal.raise_signal(signal.SIGINT)
        reached.append("the end")
    assert reached == ["the end"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
