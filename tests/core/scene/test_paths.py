"""Paths in a scene file stay below its folder."""

from __future__ import annotations

from pathlib import Path

import pytest

from xpheve.errors import SceneError
from xpheve.scene import read


def scene(folder: Path, record: str) -> Path:
    path = folder / "s.toml"
    path.write_text(f"xpheve = 1\n[run]\nuntil = 1\nrecord = '{record}'\n")
    return path


@pytest.mark.parametrize("record", ["run.arrow", "out/run.arrow", "./run.arrow", "a..b.arrow"])
def test_a_path_below_the_folder_is_taken(tmp_path: Path, record: str) -> None:
    assert read(scene(tmp_path, record)).record == tmp_path / record


@pytest.mark.parametrize(
    "record, reason",
    [
        ("/tmp/run.arrow", "this leads out of the folder of the scene; paths stay below"),
        ("../run.arrow", r"this leads out of the folder of the scene by \.\.; paths stay below"),
        ("a/../../run.arrow", r"by \.\."),
        ("C:/run.arrow", "this leads out of the folder of the scene; paths stay below"),
        (r"C:\run.arrow", "this leads out of the folder of the scene; paths stay below"),
        (r"\\server\share\run.arrow", "this leads out of the folder of the scene; paths stay below"),
        (r"..\run.arrow", r"by \.\."),
        ("~/run.arrow", "this leads out of the folder of the scene; paths stay below"),
        ("link/run.arrow", "by a symbolic link to"),
        ("loop/run.arrow", "this is no path|by a symbolic link"),
        ("", "this is no path"),
    ],
)
def test_a_path_that_leads_out_is_refused(tmp_path: Path, record: str, reason: str) -> None:
    folder = tmp_path / "scenes"
    folder.mkdir()
    (folder / "link").symlink_to(tmp_path)
    (folder / "loop").symlink_to(folder / "loop")
    path = scene(folder, record)
    with pytest.raises(SceneError, match=rf"s\.toml:4: run\.record = .*({reason})"):
        read(path)


def test_a_null_character_is_no_path(tmp_path: Path) -> None:
    path = tmp_path / "s.json"
    path.write_text('{"xpheve": 1, "run": {"record": "a\\u0000b"}}')
    with pytest.raises(SceneError, match=r"run\.record = \"a\\u0000b\": this is no path"):
        read(path)


def test_outside_is_allowed_when_asked_for(tmp_path: Path) -> None:
    assert read(scene(tmp_path, "../run.arrow"), allow_outside=True).record == tmp_path / "../run.arrow"
