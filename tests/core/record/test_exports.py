"""Tables equal the record; pictures are pictures."""

from __future__ import annotations

import csv
import json
import re
import struct
import sys

import numpy as np
import pytest
from PIL import Image
from pyarrow import parquet

from xpheve.errors import RecordError
from xpheve.record import Frame, Record, Recorder

PARTS = ("x", "y", "z", "vx", "vy", "vz", "qw", "qx", "qy", "qz", "wx", "wy", "wz")
NAMES = {1: 'a "quoted", name\nin two lines', 2: "球", 4: ""}


def bits(value: float) -> bytes:
    return struct.pack("<d", value)


def rows_of(record: Record) -> list[tuple[int, float, int, list[float], tuple[float, float, float]]]:
    rows = []
    for k, frame in enumerate(record):
        for j, serial in enumerate(frame.serial):
            values = [*frame.position[j], *frame.velocity[j], *frame.orientation[j], *frame.angular_velocity[j]]
            rows.append((k, frame.time, int(serial), values, frame.energy))
    return rows


@pytest.fixture(params=["memory", "file"])
def record(request, fake, tmp_path) -> Record:
    sets = [[1, 2, 3], [1, 2, 3, 4], [], [4]]
    source = fake(lambda k: sets[k], names=NAMES, energy=lambda k: (k / 3, np.nan, -0.0))
    made: Record = source.recorded(4, None if request.param == "memory" else tmp_path / "run.arrow", {"up": "z"})
    return made


def test_csv_holds_the_same_numbers(record, tmp_path) -> None:
    path = record.to_csv(tmp_path / "run.csv")
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    expected = rows_of(record)
    assert len(rows) == len(expected) == 8
    for row, (k, time, serial, values, energy) in zip(rows, expected, strict=True):
        assert (int(row["frame"]), float(row["time"]), int(row["serial"])) == (k, time, serial)
        assert row["name"] == NAMES.get(serial, "")
        assert [bits(float(row[part])) for part in PARTS] == [bits(value) for value in values]
        assert [bits(float(row[part])) for part in ("kinetic", "potential", "work")] == [bits(e) for e in energy]


def test_parquet_holds_the_same_numbers(record, tmp_path) -> None:
    path = record.to_parquet(tmp_path / "run.parquet")
    table = parquet.read_table(path)
    for row, (k, time, serial, values, energy) in zip(table.to_pylist(), rows_of(record), strict=True):
        assert (row["frame"], row["time"], row["serial"], row["name"]) == (k, time, serial, NAMES.get(serial))
        assert [bits(row[part]) for part in PARTS] == [bits(value) for value in values]
        assert [bits(row[part]) for part in ("kinetic", "potential", "work")] == [bits(e) for e in energy]
    said = json.loads(table.schema.metadata[b"xpheve.record"])
    assert said["metadata"] == record.metadata and said["objects"] == record.objects


def test_an_export_replaces_a_file_whole_or_not_at_all(record, monkeypatch, tmp_path) -> None:
    path = tmp_path / "out"
    path.write_text("old")
    monkeypatch.setattr("xpheve.record.files.tables", lambda store: iter([None]))
    for export in (record.to_csv, record.to_parquet):
        with pytest.raises((TypeError, AttributeError)):
            export(path)
        assert path.read_text() == "old"
    monkeypatch.undo()
    record.to_csv(path)
    assert path.read_text(encoding="utf-8").startswith('"frame"')
    assert sorted(entry.name for entry in tmp_path.iterdir() if entry.name != "run.arrow") == ["out"]


SHAPES = [
    {"kind": "plane", "normal": None, "offset": 0.0},
    {"kind": "sphere", "radius": 0.2},
    {"kind": "box", "size": [0.3, 0.2, 0.1]},
    {"kind": "capsule", "radius": 0.1, "length": 0.4},
    None,
    {"kind": "mesh_of_a_pack", "file": "x.obj"},
]


class Scene:
    """All kinds of shapes, thrown in the directions given."""

    def __init__(self, velocity: list[tuple[float, float, float]]) -> None:
        self.velocity = np.array([(0.0, 0.0, 0.0), *velocity])
        self.time = 0.0
        self.names = ["floor", "球 $\\frac{", "_hidden", "<b>&", None, "\x00\n"]

    def frame(self) -> Frame:
        count = len(self.velocity)
        position = self.velocity * self.time + np.arange(count)[:, None] * [0.5, 0.2, 0.4]
        angle = self.time * np.arange(count)
        turn = np.stack([np.cos(angle), np.sin(angle), 0 * angle, 0 * angle], axis=1)
        energy = (self.time, 1 - self.time, 0.0)
        return Frame(self.time, np.arange(count), position, self.velocity, 0 * self.velocity, turn, energy)

    def object_table(self) -> list[dict[str, object]]:
        return [
            {"serial": k, "name": self.names[k % 6], "shape": SHAPES[k % 6], "mass": 1.0, "fixed": k == 0}
            for k in range(len(self.velocity))
        ]

    def recorded(self, frames: int = 12, up: object = "z") -> Record:
        recorder = Recorder(self, None, {"up": up})
        for k in range(frames):
            self.time = k / 10
            recorder.sample()
        return recorder.close()


MOTIONS = {
    "rest": [(0, 0, 0)] * 5,
    "line": [(0, 0, k) for k in range(5)],
    "side": [(k, 0, 2 - k) for k in range(5)],
    "oblique side": [(k, k, 2 - k) for k in range(5)],
    "top": [(k, 2 - k * k, 0) for k in range(5)],
    "oblique plane": [(k, 2 - k * k, k) for k in range(5)],
    "space": [(k, 2 - k * k, 3 - k**3) for k in range(5)],
    "many": [(np.sin(k), np.cos(3 * k), np.sin(k * k)) for k in range(300)],
    "only a floor": [],
    "far": [(1e6 * k, 0, 1e-3) for k in range(5)],
    "tiny": [(1e-9 * k, 1e-10, 0) for k in range(5)],
}


@pytest.mark.parametrize("motion", MOTIONS)
def test_every_motion_can_be_plotted(motion, tmp_path) -> None:
    for up in ("z", "y", [1, 1, 0]):
        path = Scene(MOTIONS[motion]).recorded(up=up).plot(tmp_path / "run.png")
        with Image.open(path) as image:
            assert image.format == "PNG" and image.width > 1000
            assert len(image.convert("L").getcolors(256)) > 20  # something was drawn
    assert [entry.name for entry in tmp_path.iterdir()] == ["run.png"]


@pytest.mark.parametrize("motion", MOTIONS)
def test_every_motion_can_be_animated(motion, tmp_path) -> None:
    record = Scene(MOTIONS[motion]).recorded()
    path = record.animate(tmp_path / "run.gif", frames=4, size=(96, 64))
    with Image.open(path) as image:
        assert image.format == "GIF" and image.size == (96, 64) and image.n_frames == 4
        for k in range(image.n_frames):
            image.seek(k)
            image.load()


def test_objects_that_come_and_go_can_be_pictured(fake, tmp_path) -> None:
    sets = [[1, 2], [2, 3], [], [4, 2]]
    nowhere = fake(lambda k: sets[k])
    usual = nowhere.frame_at

    def frame_at(k: int) -> Frame:
        frame = usual(k)
        frame.position[:1] = np.nan if k == 3 else frame.position[:1]
        return frame

    nowhere.frame_at = frame_at
    for source in (fake(lambda k: sets[k]), nowhere):
        record = source.recorded(4)
        record.plot(tmp_path / "run.png")
        record.animate(tmp_path / "run.gif", size=(64, 64))


def test_a_page_needs_no_network(tmp_path) -> None:
    path = Scene(MOTIONS["side"]).recorded().animate(tmp_path / "<run>.html", frames=5, size=(96, 64))
    page = path.read_text(encoding="utf-8")
    bare = re.sub(r"data:image/png;base64,[^\"]+", "", page)
    assert not re.search(r"https?:|//\w|(src|href)=|<link|@import|import\(|url\(|fetch\(|XMLHttp", bare)
    assert page.count("data:image/png;base64,") == 5
    assert "<title>&lt;run&gt;</title>" in page


def test_an_animation_is_as_long_as_the_run(tmp_path) -> None:
    record = Scene(MOTIONS["side"]).recorded(frames=31)  # 3 s
    with Image.open(record.animate(tmp_path / "run.gif", frames=16, size=(64, 48))) as image:
        assert image.n_frames == 16
        assert image.info["duration"] == 200
    with Image.open(record.animate(tmp_path / "run.gif", frames=1, size=(64, 48))) as image:
        assert image.n_frames == 1


def test_what_an_animation_refuses(tmp_path) -> None:
    record = Scene(MOTIONS["side"]).recorded()
    for path, options, message in [
        ("run.mp4", {}, r"\.gif or \.html"),
        ("run.gif", {"frames": 0}, "at least one frame"),
        ("run.gif", {"size": (8, 8)}, "16 to 4096"),
    ]:
        with pytest.raises(RecordError, match=message):
            record.animate(tmp_path / path, **options)
    with pytest.raises(RecordError, match=r"metadata\['up'\] = 'w'"):
        Scene([]).recorded(up="w").plot(tmp_path / "run.png")


@pytest.mark.parametrize(("module", "export", "name"), [("matplotlib", "plot", "a.png"), ("PIL", "animate", "a.gif")])
def test_a_missing_library_is_named_with_the_way_out(monkeypatch, tmp_path, module, export, name) -> None:
    record = Scene(MOTIONS["side"]).recorded()
    for loaded in [loaded for loaded in sys.modules if loaded.split(".")[0] == module]:
        monkeypatch.delitem(sys.modules, loaded)
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(RecordError, match=r'pip install "xpheve-core\[plot\]"'):
        getattr(record, export)(tmp_path / name)
