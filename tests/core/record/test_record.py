"""Records in memory and in files say the same."""

from __future__ import annotations

import math
import os
import struct
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from xpheve.errors import RecordError
from xpheve.record import Frame, Record, Recorder

COLUMNS = ("position", "velocity", "orientation", "angular_velocity")


def both_ways(source: Any, frames: int, folder: Path, metadata: dict[str, Any] | None = None) -> list[Record]:
    """One run recorded in memory, in a file, that file opened anew, and the memory saved and opened."""
    memory = source.recorded(frames, None, metadata)
    written = source.recorded(frames, folder / "run.arrow", metadata)
    memory.save(folder / "saved.arrow")
    return [memory, written, Record.open(folder / "run.arrow"), Record.open(folder / "saved.arrow")]


@pytest.mark.parametrize("frames", [1, 2, 7])
def test_a_record_keeps_every_bit(fake, check, small_batches, tmp_path, frames) -> None:
    source = fake(lambda k: [5, 2, 9])
    for record in both_ways(source, frames, tmp_path):
        assert len(record) == frames and not record.torn
        for k, frame in enumerate(record):
            check(frame, source.frame_at(k))
            check(record.frame(k - frames), source.frame_at(k))
        assert record.serial.tolist() == [2, 5, 9]
        assert record.time.tolist() == [k / 60 for k in range(frames)]
        for name in COLUMNS:
            column = getattr(record, name)
            assert column.shape == (frames, 3, 4 if name == "orientation" else 3)
            for k, row in enumerate(column):
                assert row.tobytes() == getattr(source.frame_at(k), name)[[1, 0, 2]].tobytes()


def test_the_order_of_rows_does_not_matter(fake) -> None:
    plain = fake(lambda k: [1, 2, 3]).recorded(6)
    turned = fake(lambda k: [1, 2, 3][k % 3 :] + [1, 2, 3][: k % 3]).recorded(6)
    assert turned.position.tobytes() == plain.position.tobytes()


def test_objects_come_and_go(fake, check, small_batches, tmp_path) -> None:
    sets = [[1], [1, 2], [], [2], [2, 3, 1], [2, 3, 1], []]
    source = fake(lambda k: sets[k], names={1: "one", 2: "two"})
    for record in both_ways(source, len(sets), tmp_path):
        assert [frame.serial.tolist() for frame in record] == [sorted(members) for members in sets]
        for k, frame in enumerate(record):
            check(frame, source.frame_at(k))
        assert [row["serial"] for row in record.objects] == [1, 2, 3]
        assert record.objects[0]["mass"] == math.inf
        with pytest.raises(RecordError, match=r"change during the run .* record\[obj\]"):
            _ = record.position
        track = record["two"]
        assert track.frame_numbers.tolist() == [1, 3, 4, 5]
        assert track.time.tolist() == [1 / 60, 3 / 60, 4 / 60, 5 / 60]
        for name in COLUMNS:
            expected = [getattr(source.frame_at(k), name)[sets[k].index(2)] for k in (1, 3, 4, 5)]
            assert getattr(track, name).tobytes() == np.array(expected).tobytes()


def test_the_source_is_asked_for_descriptions_only_when_there_is_news(fake) -> None:
    source = fake(lambda k: [1, 2] if k < 5 else [1, 2, 3])
    source.recorded(10)
    assert source.asked == 2


def test_an_object_is_found_by_itself_its_name_and_its_serial(fake) -> None:
    record = fake(lambda k: [4, 7, 8], names={7: "球 ball", 8: "twin", 4: "twin"}).recorded(3)
    expected = record.position[:, 1].tobytes()
    added, nameless = SimpleNamespace(serial=7, name="other"), SimpleNamespace(serial=None, name="球 ball")
    for key in ("球 ball", 7, np.int64(7), added, nameless, SimpleNamespace(name="球 ball")):
        assert record[key].position.tobytes() == expected
    assert record[7].name == "球 ball" and len(record[7]) == 3
    with pytest.raises(RecordError, match=r"2 objects are named 'twin'.*\[4, 8\]"):
        record["twin"]
    with pytest.raises(RecordError, match=r"no object is named 'ball'.*at hand: 'twin', '球 ball'"):
        record["ball"]
    for key in (5, None, 1.0, True):
        with pytest.raises(RecordError, match=r"see record\.objects"):
            record[key]


# One kind of NaN: a frame without objects is kept as text, which knows no other.
NUMBERS = st.floats(allow_nan=False) | st.just(math.nan)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    sets=st.lists(st.lists(st.integers(0, 99), unique=True, max_size=4), max_size=8),
    energies=st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS), min_size=8, max_size=8),
    names=st.dictionaries(st.integers(0, 99), st.text(), max_size=5),
)
def test_any_run_comes_back_from_a_file(fake, check, small_batches, tmp_path, sets, energies, names) -> None:
    source = fake(lambda k: sets[k] if sets else [], energy=lambda k: energies[k], names=names)
    for record in both_ways(source, len(sets), tmp_path):
        assert len(record) == len(sets)
        for k, frame in enumerate(record):
            expected = source.frame_at(k)
            check(frame, expected)
        for row in record.objects:
            assert row["name"] == names.get(row["serial"])


@pytest.mark.parametrize("value", [-0.0, 5e-324, math.inf, -math.inf, struct.unpack("<d", b"\1\0\0\0\0\0\xf8\x7f")[0]])
def test_extreme_numbers_keep_their_bits(fake, tmp_path, value) -> None:
    source = fake(lambda k: [1])
    usual = source.frame_at
    source.frame_at = lambda k: Frame(
        **{name: np.full_like(getattr(usual(k), name), value) for name in COLUMNS}, time=0.0, serial=usual(k).serial
    )
    for record in both_ways(source, 2, tmp_path):
        assert record.position.tobytes() == np.full((2, 1, 3), value).tobytes()
        assert np.isnan(record.energy).all() and math.isnan(record.energy_drift)


def test_an_empty_record(fake, tmp_path) -> None:
    for record in both_ways(fake(lambda k: [1, 2]), 0, tmp_path):
        assert len(record) == 0 and list(record) == [] and not record.torn
        assert record.time.shape == (0,) and record.energy.shape == (0, 3) and record.position.shape == (0, 0, 3)
        assert len(record[1]) == 0 and record[1].position.shape == (0, 3)
        assert [row["serial"] for row in record.objects] == [1, 2]
        record.to_csv(tmp_path / "run.csv")
        record.plot(tmp_path / "run.png")
        with pytest.raises(RecordError, match="has 0 frames"):
            record.frame(0)
        with pytest.raises(RecordError, match="no frames"):
            record.animate(tmp_path / "run.gif")


def test_frames_without_objects(fake, check, tmp_path) -> None:
    source = fake(lambda k: [])
    for record in both_ways(source, 3, tmp_path):
        assert record.time.tolist() == [0, 1 / 60, 2 / 60] and record.energy.shape == (3, 3)
        assert record.position.shape == (3, 0, 3)
        for k, frame in enumerate(record):
            check(frame, source.frame_at(k))


def test_metadata_are_the_same_from_memory_and_file(fake, tmp_path) -> None:
    said = {"up": "z", "seed": np.int64(7), "plan": {"groups": ("a", "b")}, "where": tmp_path, "π": np.array([1.0])}
    for record in both_ways(fake(lambda k: [1]), 1, tmp_path, said):
        assert record.metadata == {
            "xpheve": record.metadata["xpheve"],
            "up": "z",
            "seed": 7,
            "plan": {"groups": ["a", "b"]},
            "where": str(tmp_path),
            "π": [1.0],
        }
        assert isinstance(record.metadata["xpheve"], str)
    with pytest.raises(RecordError, match=r"metadata .* JSON"):
        Recorder(fake(lambda k: [1]), None, {"law": object()})


def test_the_source_may_reuse_its_arrays(fake, tmp_path) -> None:
    source = fake(lambda k: [1])
    frame = source.frame_at(0)
    for path in (None, tmp_path / "run.arrow"):
        recorder = Recorder(SimpleNamespace(frame=lambda: frame, object_table=source.object_table), path)
        for k in range(3):
            frame.position[:] = k
            recorder.sample()
        frame.position[:] = -1
        assert recorder.close().position[:, 0, 0].tolist() == [0, 1, 2]


def test_arrays_cannot_be_written(fake, tmp_path) -> None:
    for record in both_ways(fake(lambda k: [1]), 2, tmp_path):
        for array in (record.position, record.time, record.energy, record[1].velocity, record.frame(0).position):
            with pytest.raises(ValueError, match="read-only"):
                array[...] = 0


def test_drift_is_relative_to_the_energy_in_play(fake) -> None:
    def drift(*energies: tuple[float, float, float]) -> float:
        value: float = fake(lambda k: [1], energy=lambda k: energies[k]).recorded(len(energies)).energy_drift
        return value

    assert drift((0, 10, 0), (5, 5, 0), (10, 0, 0)) == 0.0
    assert drift((0, 10, 0), (10, 0.5, 0)) == pytest.approx(0.05)
    assert drift((0, 1010, 0), (10, 1000.5, 0)) == pytest.approx(0.05)  # wherever potential energy has its zero
    assert drift((0, 10, 0), (10, 10, 10)) == 0.0  # work from outside is accounted for
    assert drift((0, 10, 0), (math.nan, 0, 0), (10, 0.5, 0)) == pytest.approx(0.05)
    assert drift((0, 10, 0), (0, 10 * (1 + 4e-16), 0)) < 1e-9  # rounding at rest
    assert drift((0, 0, 0), (0, 0, 0)) == 0.0


def test_what_a_recorder_refuses(fake) -> None:
    good = fake(lambda k: [1, 2]).frame_at(0)
    parts = {name: getattr(good, name) for name in ("time", "serial", *COLUMNS)}
    for change, message in [
        ({"position": np.zeros((3, 3))}, r"position has shape \(3, 3\)"),
        ({"serial": np.array([1, 1])}, "serial 1 occurs twice"),
        ({"time": math.nan}, "finite time"),
        ({"serial": np.array([1, 50])}, r"\[50\], which the object table does not list"),
    ]:
        source = fake(lambda k: [1, 2])
        source.frame_at = lambda k, change=change: Frame(**(parts | change))
        recorder = Recorder(source)
        with pytest.raises(RecordError, match=message):
            recorder.sample()
        assert len(recorder.close()) == 0
    source = fake(lambda k: [1])
    recorder = Recorder(source)
    source.number = 3
    recorder.sample()
    source.number = 1
    with pytest.raises(RecordError, match="time must not run back"):
        recorder.sample()
    assert recorder.close() is recorder.close()
    with pytest.raises(RecordError, match="closed"):
        recorder.sample()


def test_repr_says_what_there_is(fake, tmp_path) -> None:
    source = fake(lambda k: [1, 2])
    assert repr(source.recorded(61)) == "<Record: 61 frames, 0 to 1 s, 2 objects, in memory>"
    assert "run.arrow" in repr(source.recorded(1, tmp_path / "run.arrow"))
    assert repr(source.recorded(2)[1]) == "<Track of serial 1: 2 frames>"


def test_a_long_run_of_many_objects_grows_without_loss(fake) -> None:
    count = 3000
    position = np.arange(3.0 * count).reshape(count, 3)
    serial = np.arange(count)
    table = [{"serial": k, "name": None, "shape": None, "mass": 1.0, "fixed": False} for k in range(count)]
    now = SimpleNamespace(k=0)

    def frame() -> Frame:
        quaternion = np.zeros((count, 4))
        return Frame(float(now.k), serial, position + now.k, position, position, quaternion)

    recorder = Recorder(SimpleNamespace(frame=frame, object_table=lambda: table))
    for now.k in range(500):
        recorder.sample()
    record = recorder.close()
    assert record.frame(499).position.tobytes() == (position + 499).tobytes()  # before and after the blocks are joined
    assert record.position.shape == (500, count, 3)
    assert (record.position == position + np.arange(500)[:, None, None]).all()
    assert record.frame(499).position.tobytes() == (position + 499).tobytes()


def test_saving_over_itself(fake, check, tmp_path) -> None:
    source = fake(lambda k: [1])
    record = source.recorded(4, tmp_path / "run.arrow")
    record.save(tmp_path / "run.arrow")
    for k, frame in enumerate(record):
        check(frame, source.frame_at(k))
    assert [path.name for path in tmp_path.iterdir()] == ["run.arrow"]


def test_a_file_replaced_meanwhile_is_noticed(fake, tmp_path) -> None:
    record = fake(lambda k: [1]).recorded(4, tmp_path / "run.arrow")
    fake(lambda k: [1, 2]).recorded(9, tmp_path / "run.arrow")
    with pytest.raises(RecordError, match="replaced"):
        _ = record.position
    os.remove(tmp_path / "run.arrow")
    with pytest.raises(RecordError, match="no longer"):
        record.frame(0)


def test_any_arrow_reader_reads_a_record(fake, tmp_path) -> None:
    source = fake(lambda k: [2, 1], names={1: "äöü"})
    source.recorded(3, tmp_path / "run.arrow")
    with pa.OSFile(str(tmp_path / "run.arrow")) as file:
        table = pa.ipc.open_stream(file).read_all()
    assert table.column("frame").to_pylist() == [0, 0, 1, 1, 2, 2]
    assert table.column("name").to_pylist() == ["äöü", None] * 3
    assert table.column("wz").to_pylist()[1] == source.frame_at(0).angular_velocity[0, 2]
    assert table.column("potential").to_pylist() == [2.0, 2.0, 1.0, 1.0, 0.0, 0.0]


def test_nothing_heavy_is_imported_before_it_is_needed() -> None:
    heavy = "pyarrow", "matplotlib", "PIL", "pandas"
    script = (
        "import sys, xpheve.record\n"
        "from xpheve.record import Frame, FrameSource, Record, Recorder, Track\n"
        f"print([name for name in {heavy!r} if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
