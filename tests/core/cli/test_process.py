"""The command line as a process: how fast it starts, what it imports, and what signals leave behind."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from xpheve.record import Record

Process = Callable[..., "subprocess.CompletedProcess[str]"]

TEN = "".join(
    f'[[objects]]\nname = "ball_{k}"\nshape = {{ kind = "sphere", radius = 0.1 }}\nposition = [{k}, 0, 1.1]\n'
    'laws = ["basic:planet_gravity", "collision:elastic"]\n'
    for k in range(9)
)


def test_a_small_run_takes_less_than_a_second_of_computing(process: Process, scene: Path) -> None:
    scene.write_text(scene.read_text().replace('"gravity"', '"basic:planet_gravity"') + TEN)
    taken = []
    for _ in range(4):  # the first one writes the index of packs and perhaps bytecode
        before = os.times()
        told = process("run", scene)
        after = os.times()
        taken.append(after.children_user + after.children_system - before.children_user - before.children_system)
        assert told.returncode == 0, told.stderr
    assert min(taken) < 1.0


def test_what_a_run_does_not_need_is_not_imported(scene: Path) -> None:
    program = (
        "import sys, json\n"
        "from xpheve.cli.commands import commands\n"
        "try:\n    commands.main(sys.argv[1:])\nexcept SystemExit as end:\n    assert end.code == 0\n"
        "print(json.dumps(sorted(sys.modules)), file=sys.stderr)\n"
    )

    def modules(*arguments: Any) -> set[str]:
        command = [sys.executable, "-c", program, *map(str, arguments)]
        told = subprocess.run(command, capture_output=True, text=True, timeout=60)
        assert told.returncode == 0, told.stderr
        return set(json.loads(told.stderr.splitlines()[-1]))

    heavy = {"rich", "pyarrow", "matplotlib", "PIL", "tomli_w", "numba", "trimesh", "scipy"}
    assert not heavy & modules("run", scene)
    assert not (heavy | {"numpy", "pydantic", "pluggy"}) & modules("--version")
    assert not (heavy | {"xpheve_laws_basic"}) & modules("laws")


def test_an_error_is_one_line_without_a_traceback(process: Process, tmp_path: Path) -> None:
    told = process("run", tmp_path / "none.toml")
    assert told.returncode == 1 and told.stdout == ""
    assert told.stderr == f"error: {tmp_path / 'none.toml'}: cannot be read: No such file or directory\n"
    assert process("run").returncode == 2


def test_the_doctor_exits_with_1_when_a_pack_is_broken(process: Process, tmp_path: Path) -> None:
    site = tmp_path / "site"
    info = site / "xpheve_bad-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: xpheve-bad\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[xpheve.packs]\nbad = xpheve_bad\n")
    (site / "xpheve_bad.py").write_text("import no_such_module\n")
    told = process("doctor", site=site)
    assert told.returncode == 1
    assert "broken: xpheve-bad 1.0" in told.stdout and "pip install no_such_module" in told.stdout
    assert "something is broken" in told.stdout
    found = json.loads(process("doctor", "--json", site=site).stdout)
    assert found["healthy"] is False and found["broken"][0]["distribution"] == "xpheve-bad"
    told = process("laws", site=site)
    assert told.returncode == 0 and "basic:planet_gravity" in told.stdout
    assert "warning: bad is broken; see xpheve doctor" in told.stderr


def started(scene: Path, record: Path, tmp_path: Path) -> subprocess.Popen[str]:
    """A run that lasts, whose record has begun."""
    command = [
        sys.executable,
        "-m",
        "xpheve",
        "run",
        str(scene),
        "--until",
        "1e6",
        "--every",
        "0.001",
        "--out",
        str(record),
    ]
    running = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path)
    deadline = time.monotonic() + 30
    while time.monotonic() < deadline and running.poll() is None:
        if record.exists() and record.stat().st_size > 20_000:
            return running
        time.sleep(0.05)
    running.kill()
    raise AssertionError(f"no record appeared: {running.communicate()}")


@pytest.mark.skipif(os.name != "posix", reason="sends signals")
def test_ctrl_c_leaves_a_readable_record(scene: Path, tmp_path: Path) -> None:
    record = tmp_path / "a.arrow"
    running = started(scene, record, tmp_path)
    running.send_signal(signal.SIGINT)
    _, stderr = running.communicate(timeout=30)
    assert running.returncode == 130
    found = Record.open(record)
    assert not found.torn and len(found) > 100
    assert f"{record} holds the {len(found)} frames until then" in stderr and stderr.startswith("interrupted at t = ")
    assert "Traceback" not in stderr


@pytest.mark.skipif(os.name != "posix", reason="sends signals")
def test_kill_leaves_a_readable_record(scene: Path, tmp_path: Path, process: Process) -> None:
    record = tmp_path / "a.arrow"
    running = started(scene, record, tmp_path)
    running.kill()
    running.communicate(timeout=30)
    found = Record.open(record)
    assert found.torn and len(found) > 100
    told = process("export", record, tmp_path / "t.csv")
    assert told.returncode == 0 and "is torn" in told.stderr


@pytest.mark.skipif(os.name != "posix", reason="opens a terminal")
def test_a_terminal_gets_a_table_and_a_progress_bar(scene: Path, tmp_path: Path) -> None:
    import pty

    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "xpheve", "run", str(scene)]
    environment = {**os.environ, "COLUMNS": "100", "TERM": "xterm"}
    told = subprocess.run(command, stdout=theirs, stderr=theirs, timeout=60, env=environment, cwd=tmp_path)
    os.close(theirs)
    text = b""
    while True:
        try:
            part = os.read(ours, 65536)
        except OSError:  # all is read and nobody writes any more
            break
        if not part:
            break
        text += part
    os.close(ours)
    assert told.returncode == 0, text
    assert b"position [m]" in text and b"ball" in text and b"of 1 s" in text


def test_a_reader_that_has_seen_enough_is_no_error() -> None:
    command = f"{sys.executable} -m xpheve schema | head -c 10"
    told = subprocess.run(["/bin/sh", "-c", command], capture_output=True, text=True, timeout=60)
    assert told.stdout.startswith("{") and "Traceback" not in told.stderr and "Error" not in told.stderr
