"""Each subcommand: what it prints where, what it leaves, and how it ends."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import Result

from xpheve.errors import XpheveWarning
from xpheve.record import Record

Call = Callable[..., Result]


def test_help_names_all_commands_and_exit_codes(call: Call) -> None:
    told = call("--help")
    assert told.exit_code == 0
    for name in (
        "run",
        "explain",
        "warm",
        "laws",
        "show",
        "export",
        "doctor",
        "schema",
        "manifest",
        "Exit codes: 0 fine",
    ):
        assert name in told.stdout


@pytest.mark.parametrize("name", ["run", "explain", "warm", "laws", "show", "export", "doctor", "schema", "manifest"])
def test_each_command_has_help(name: str, call: Call) -> None:
    assert call(name, "-h").exit_code == 0


def test_the_version_is_shown(call: Call) -> None:
    from xpheve import __version__

    told = call("--version")
    assert (told.exit_code, told.stdout) == (0, f"xpheve {__version__}\n")


def test_wrong_usage_is_told_with_2(call: Call, scene: Path) -> None:
    for arguments, error in (
        (["rnu"], "no command 'rnu'. Did you mean \"run\"? Commands: run,"),
        (["run"], "Missing argument 'SCENE'"),
        (["run", scene, "--untl", "3"], "No such option"),
        (["run", scene, "--until", "3 m"], '"3 m": unit m is length, needs s. Did you mean 3 s?'),
        (["run", scene, "--until", "-1"], '"-1": a number from 0 is needed'),
        (["run", scene, "--compile", "yes"], "'yes' is not one of 'auto', 'always', 'never'"),
        (["run", scene, "--dt", "0"], '"0": a number above 0 is needed'),
        (["run", scene, "--rtol", "x"], '"x": a number is needed'),
        (["run", scene, "--out", scene], "this is a file; give a folder, or a record that ends in .arrow"),
        (["export", "run.arrow", "out.xyz"], "its ending says nothing; give --to csv|parquet|plot|html|gif|glb"),
        (["export", "run.arrow", "out.csv", "--to", "gif"], "with --to gif, its name ends in .gif"),
        (["manifest"], "which PACK? Installed: basic, collision"),
        (["manifest", "basic", "--write", "--check"], "--write and --check: give one of them"),
    ):
        told = call(*arguments)
        assert told.exit_code == 2, arguments
        assert error in told.stderr, told.stderr
        assert told.stdout == ""


# run


def test_run_tells_how_it_ended(call: Call, scene: Path) -> None:
    told = call("run", scene)
    assert told.exit_code == 0 and told.stderr == ""
    assert "t = 1 s, 2 objects" in told.stdout and "ball" in told.stdout and "drift" in told.stdout


def test_run_as_json_prints_one_document(call: Call, scene: Path) -> None:
    told = call("run", scene, "--json", "--until", "500 ms")
    found = json.loads(told.stdout)
    assert told.exit_code == 0 and told.stderr == ""
    assert found["time"] == found["until"] == 0.5 and found["error"] is None
    ball = next(row for row in found["objects"] if row["name"] == "ball")
    # It meets the floor at sqrt(2/9.81) s = 0.4515 s, with 4.4294 m/s, and leaves with 0.8 of that.
    fall = (2 / 9.81) ** 0.5
    assert ball["velocity"][2] == pytest.approx(0.8 * 9.81 * fall - 9.81 * (0.5 - fall), rel=1e-12)
    assert abs(found["energy_drift"]) < 1e-12


def test_run_out_leaves_record_explanation_and_summary(call: Call, scene: Path, tmp_path: Path) -> None:
    out = tmp_path / "out" / "run"
    told = call("run", scene, "--out", out, "--every", "0.1")
    assert told.exit_code == 0, told.stderr
    assert sorted(path.name for path in out.iterdir()) == ["explain.txt", "record.arrow", "summary.json"]
    record = Record.open(out / "record.arrow")
    assert len(record) == 11 and not record.torn
    summary = json.loads((out / "summary.json").read_text())
    assert summary["frames"] == 11 and summary["record"] == str(out / "record.arrow")
    assert "who moves whom" in (out / "explain.txt").read_text()
    assert call("run", scene, "--out", out, "--quiet").stdout == ""
    assert len(Record.open(out / "record.arrow")) == 501


def test_run_out_may_be_a_record_only(call: Call, scene: Path, tmp_path: Path) -> None:
    assert call("run", scene, "--out", tmp_path / "a.arrow").exit_code == 0
    assert len(Record.open(tmp_path / "a.arrow")) == 501
    (tmp_path / "b.arrow").mkdir()
    assert call("run", scene, "--out", tmp_path / "b.arrow").exit_code == 2


def test_options_go_before_what_the_scene_says(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "s.toml"
    path.write_text('xpheve = 1\n[run]\nuntil = 1\ndt = 0.25\nevery = 0.5\nrecord = "own.arrow"\n[[objects]]\n')
    assert call("run", path, "--quiet").exit_code == 0
    assert len(Record.open(tmp_path / "own.arrow")) == 3
    assert call("run", path, "--quiet", "--every", "0.25", "--rtol", "1e-9").exit_code == 0
    assert len(Record.open(tmp_path / "own.arrow")) == 5
    told = call("run", path, "--dt", "0.1", "--rtol", "1e-3")
    assert told.exit_code == 1 and "give dt, or rtol and atol, not both" in told.stderr


def test_a_law_can_be_left_out(call: Call, scene: Path) -> None:
    found = json.loads(call("run", scene, "--json", "--no-law", "gravity").stdout)
    assert next(row for row in found["objects"] if row["name"] == "ball")["position"] == [0.0, 0.0, 1.1]
    told = call("run", scene, "--no-law", "gravty")
    assert told.exit_code == 1 and 'Did you mean "gravity"?' in told.stderr


def test_a_scene_that_does_not_say_how_long_is_wrong_usage(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "s.toml"
    path.write_text("xpheve = 1\n")
    told = call("run", path)
    assert told.exit_code == 2 and "how long? Give --until, or write until = ... under [run]" in told.stderr


BAD = {
    "missing": ("", "cannot be read: No such file or directory"),
    "nan": ("[[objects]]\nmass = nan", "s.toml:3: object 1: mass = nan: a finite number in kg is needed"),
    "negative mass": ("[[objects]]\nmass = -1", "s.toml:3: object 1: mass = -1: a mass above 0 kg is needed"),
    "unknown law": ('[[laws]]\nid = "basic:planet_gravty"', 'Did you mean "basic:planet_gravity"'),
    "wrong unit": (
        '[[laws]]\nid = "basic:planet_gravity"\nacceleration = "9.81 N"',
        's.toml:4: basic:planet_gravity.acceleration = "9.81 N": unit N is kg*m/s^2 (force), needs m/s^2',
    ),
    "path outside": ('[run]\nrecord = "../run.arrow"', "leads out of the folder of the scene by .."),
    "binary": ("\x00", "this is no TOML"),
}


@pytest.mark.parametrize("command", ["run", "explain", "show"])
@pytest.mark.parametrize("text, error", BAD.values(), ids=BAD)
def test_bad_input_is_one_line_on_stderr_and_1(command: str, text: str, error: str, call: Call, tmp_path: Path) -> None:
    path = tmp_path / "s.toml"
    if text:
        path.write_text(f"xpheve = 1\n{text}\n")
    told = call(command, path, *(["--until", "1"] if command != "show" else []))
    if command == "show" and ("id =" in text or "record" in text):
        assert told.exit_code == 0  # it only looks at the file
        return
    assert told.exit_code == 1 and told.stdout == ""
    assert told.stderr.startswith("error: ") and error in told.stderr and "Traceback" not in told.stderr


def test_a_failing_run_says_why_and_keeps_what_it_had(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "s.toml"
    # Lands on the wedge between two planes: a second support on one object, which no law at hand resolves.
    path.write_text(
        'xpheve = 1\nup = "z"\n[[laws]]\nid = "basic:planet_gravity"\n[[laws]]\nid = "collision:elastic"\nrestitution = 0\n'
        '[[objects]]\nfixed = true\nshape = { kind = "plane", normal = [1, 0, 1] }\nlaws = ["collision:elastic"]\n'
        '[[objects]]\nfixed = true\nshape = { kind = "plane", normal = [-1, 0, 1] }\nlaws = ["collision:elastic"]\n'
        '[[objects]]\nname = "ball"\nshape = { kind = "sphere", radius = 0.1 }\nposition = [0, 0, 1]\n'
        'laws = ["basic:planet_gravity", "collision:elastic"]\n'
    )
    told = call("run", path, "--until", "5", "--out", tmp_path / "out", "--json")
    assert told.exit_code == 1
    found = json.loads(told.stdout)
    assert found["error"] and found["time"] < 5 and found["frames"] > 1
    assert "stopped at t = " in told.stderr and "error: " in told.stderr and "Traceback" not in told.stderr
    assert len(Record.open(tmp_path / "out" / "record.arrow")) == found["frames"]


def test_an_older_record_is_not_taken_for_that_of_a_run_that_failed_to_begin(call: Call, tmp_path: Path) -> None:
    path, out = tmp_path / "s.toml", tmp_path / "a.arrow"
    path.write_text("xpheve = 1\n[[objects]]\n")
    assert call("run", path, "--until", "1", "--out", out, "--quiet").exit_code == 0
    told = call("run", path, "--until", "1", "--out", out, "--dt", "1", "--rtol", "1", "--json")
    assert told.exit_code == 1 and json.loads(told.stdout)["record"] is None


def test_warnings_are_one_line(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "s.toml"
    path.write_text('xpheve = 1\n[run]\nuntil = 1\n[[objects]]\ncolumns = { drag_area = 1, drag_ara = 1 }\nlaws = ["d"]\n'
                    '[[laws]]\nid = "basic:quadratic_drag"\nname = "d"\n')  # fmt: skip
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("always", XpheveWarning)
        told = call("run", path, "--json")
    json.loads(told.stdout)
    assert told.stderr.startswith("warning: ") and 'Did you mean "drag_area"?' in told.stderr
    assert len(told.stderr.splitlines()) == 1


def test_names_cannot_steer_the_terminal(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "s.json"
    path.write_text(json.dumps({"xpheve": 1, "objects": [{"name": "\x1b[31mred\x07\u202e"}]}))
    for told in (call("run", path, "--until", "1"), call("show", path)):
        assert told.exit_code == 0 and "\x1b" not in told.stdout and "\\x1b[31mred" in told.stdout


# explain


def test_explain_plans_with_the_steps_that_the_scene_or_the_line_gives(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "three.toml"
    bodies = "".join(
        f'[[objects]]\nmass = 1.0\nposition = [{x}, 0, 0]\nlaws = ["basic:universal_gravity"]\n' for x in range(3)
    )
    law = '[[laws]]\nid = "basic:universal_gravity"\n'
    head = 'xpheve = 1\nstepper = "core:symplectic4"\n'

    def stepper(*line: str) -> str:
        (group,) = json.loads(call("explain", path, "--json", *line).stdout)["groups"]
        return str(group["stepper"])

    path.write_text(f"{head}{law}{bodies}")
    assert stepper() == "core:adaptive"
    assert stepper("--dt", "0.1") == "core:symplectic4"
    path.write_text(f"{head}[run]\nuntil = 1.0\ndt = 0.1\n{law}{bodies}")
    assert stepper() == "core:symplectic4"


def test_explain_says_who_serves_what(call: Call, scene: Path) -> None:
    assert "who moves whom" in call("explain", scene).stdout
    found = json.loads(call("explain", scene, "--until", "1", "--json").stdout)
    assert found["time"] == 1.0 and {law["id"] for law in found["laws"]} == {
        "basic:planet_gravity",
        "collision:elastic",
    }
    found = json.loads(call("explain", scene, "--json", "--no-law", "collision:elastic").stdout)
    assert found["time"] == 0.0 and len(found["laws"]) == 1


# laws, show


def test_laws_are_listed(call: Call) -> None:
    told = call("laws")
    assert told.exit_code == 0 and "basic:planet_gravity" in told.stdout and "collision:elastic" in told.stdout
    found = json.loads(call("laws", "--json").stdout)
    gravity = next(law for law in found if law["id"] == "basic:planet_gravity")
    assert gravity["pack"] == "basic" and gravity["params"][0]["name"] == "acceleration"
    assert {law["role"] for law in json.loads(call("laws", "--json", "--role", "drag").stdout)} == {"drag"}
    told = call("laws", "--role", "grafity")
    assert told.exit_code == 1 and "no law has the role 'grafity'. Did you mean \"gravity\"? Roles: " in told.stderr


def test_a_law_shows_its_card(call: Call) -> None:
    told = call("show", "basic:planet_gravity")
    assert told.exit_code == 0
    for part in ("F = m g d", "acceleration", "m/s^2", ">= 0", "Source: I. Newton", "xpheve-laws-basic"):
        assert part in told.stdout
    assert "drag_area" in call("show", "basic:quadratic_drag").stdout
    found = json.loads(call("show", "basic:planet_gravity", "--json").stdout)
    assert found["parameters"][0] == {
        "name": "acceleration", "kind": "number", "unit": "m/s^2", "default": 9.81, "bounds": ">= 0", "doc": "g of the planet.",
    }  # fmt: skip


@pytest.mark.parametrize(
    "what, error",
    [
        ("basic:planet_gravty", 'Did you mean "basic:planet_gravity"'),
        ("planet_gravity", "'planet_gravity' is neither a law nor a file. Did you mean \"basic:planet_gravity\"?"),
        ("ocean:wave", 'comes from pack "ocean", which is not installed'),
        ("none.arrow", "none.arrow"),
        ("none.toml", "none.toml: cannot be read: No such file or directory"),
    ],
)
def test_what_cannot_be_shown_is_told(what: str, error: str, call: Call) -> None:
    told = call("show", what)
    assert told.exit_code == 1 and error in told.stderr and told.stdout == ""


def test_records_and_scenes_are_shown(call: Call, scene: Path, tmp_path: Path) -> None:
    call("run", scene, "--out", tmp_path / "out")
    for path in (tmp_path / "out", tmp_path / "out" / "record.arrow"):
        told = call("show", path)
        assert told.exit_code == 0 and "record of 501 frames, 0 to 1 s" in told.stdout and "plane" in told.stdout
    found = json.loads(call("show", tmp_path / "out", "--json").stdout)
    assert found["frames"] == 501 and found["torn"] is False and found["metadata"]["up"] == "z"
    told = call("show", scene)
    assert (
        told.exit_code == 0
        and "scene of 2 objects" in told.stdout
        and "laws: gravity, collision:elastic" in told.stdout
    )
    assert json.loads(call("show", scene, "--json").stdout)["run"] == {"until": 1.0}


# export


@pytest.mark.parametrize(
    "form, name",
    [("csv", "t.csv"), ("parquet", "t.parquet"), ("plot", "t.png"), ("html", "t.html"), ("gif", "t.gif")],
)
def test_records_are_exported(form: str, name: str, call: Call, scene: Path, tmp_path: Path) -> None:
    if form in ("plot", "html", "gif"):
        pytest.importorskip("matplotlib")
    call("run", scene, "--out", tmp_path / "out", "--every", "0.2")
    told = call("export", tmp_path / "out", tmp_path / name, "--to", form, "--frames", "3")
    assert told.exit_code == 0, told.stderr
    assert (tmp_path / name).stat().st_size > 100 and "6 frames" in told.stdout
    assert call("export", tmp_path / "out" / "record.arrow", tmp_path / name, "--frames", "2").exit_code == 0


def test_a_torn_record_is_exported_as_far_as_it_goes(call: Call, scene: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.arrow"
    call("run", scene, "--out", path, "--every", "0.0001")
    data = path.read_bytes()
    path.write_bytes(data[: int(0.7 * len(data))])
    told = call("export", path, tmp_path / "t.csv")
    assert told.exit_code == 0 and "is torn; exporting the" in told.stderr
    assert "torn: the run was stopped hard" in call("show", path).stdout
    path.write_bytes(data[:40])
    told = call("export", path, tmp_path / "u.csv")
    assert told.exit_code == 1 and told.stderr.startswith("error: ") and not (tmp_path / "u.csv").exists()
    path.write_bytes(b"not a record")
    assert call("export", path, tmp_path / "u.csv").exit_code == 1
    assert call("export", tmp_path / "none.arrow", tmp_path / "u.csv").exit_code == 1


# doctor, schema, manifest


def test_the_doctor_finds_nothing(call: Call) -> None:
    told = call("doctor")
    assert told.exit_code == 0, told.output
    for part in ("xpheve-laws-basic", "loaded", "index cache: ", "Python 3.", "pyarrow", "all is well"):
        assert part in told.stdout
    found = json.loads(call("doctor", "--json").stdout)
    assert found["healthy"] is True and {pack["name"] for pack in found["packs"]} >= {"basic", "collision"}


def test_the_schema_is_printed_or_written(call: Call, tmp_path: Path) -> None:
    told = call("schema")
    found = json.loads(told.stdout)
    assert told.exit_code == 0 and found["title"] == "xPheve scene"
    assert call("schema", "--out", tmp_path / "s.json").exit_code == 0
    assert json.loads((tmp_path / "s.json").read_text()) == found


PACK = '''
"""A pack."""
from xpheve.laws import FieldLaw, Param

__all__ = ["Breeze"]


class Breeze(FieldLaw):
    """A breeze: F = c."""

    id = "cli_toy:breeze"
    c = Param(0.1, unit="N", doc="Push.")

    def force(self, body):
        return (self.c, 0.0, 0.0)
'''


def test_manifests_are_printed_written_and_checked(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "xpheve_cli_toy").mkdir()
    (tmp_path / "xpheve_cli_toy" / "__init__.py").write_text(PACK)
    (tmp_path / "xpheve_cli_broken.py").write_text("1 / 0")
    monkeypatch.syspath_prepend(tmp_path)
    assert json.loads(call("manifest", "xpheve_cli_toy").stdout)["laws"][0]["id"] == "cli_toy:breeze"
    told = call("manifest", "xpheve_cli_toy", "--check")
    assert told.exit_code == 1 and "there is no manifest" in told.stderr
    assert call("manifest", "--write", "xpheve_cli_toy").exit_code == 0
    assert (tmp_path / "xpheve_cli_toy" / "xpheve.json").exists()
    told = call("manifest", "--check", "xpheve_cli_toy")
    assert told.exit_code == 0 and "its manifest is fresh" in told.stdout
    assert json.loads(call("manifest", "basic").stdout)["pack"] == "basic"
    told = call("manifest", "bsic")
    assert (
        told.exit_code == 1
        and "'bsic' is neither a pack that is installed nor a module. Did you mean \"basic\"?" in told.stderr
    )
    told = call("manifest", "xpheve_cli_broken")
    assert told.exit_code == 1 and "failed while it was imported: ZeroDivisionError" in told.stderr


# What should not happen


def test_a_defect_is_one_line_that_says_how_to_see_more(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    from xpheve.plugins import Registry

    def fail(self: Any, role: str = "") -> None:
        raise RuntimeError("two\nlines")

    monkeypatch.setattr(Registry, "laws", fail)
    told = call("laws")
    assert told.exit_code == 1
    assert told.stderr == (
        "error: this should not happen: RuntimeError: two lines. "
        "To see where, say --traceback, or set XPHEVE_TRACEBACK=1\n"
    )
    for told in (call("laws", "--traceback"), call("--traceback", "laws")):
        assert told.exit_code == 1 and "Traceback (most recent call last)" in told.stderr
    monkeypatch.setenv("XPHEVE_TRACEBACK", "1")
    assert "Traceback (most recent call last)" in call("laws").stderr
    assert "Traceback (most recent call last)" in call("run", "none.toml").stderr


# compiling


WINDY = """xpheve = 1
compile = "never"

[run]
until = 0.1
dt = 0.01

[[laws]]
id = "basic:quadratic_drag"

[[objects]]
columns = { drag_area = 0.1 }
velocity = [1.0, 0.0, 0.0]
laws = ["basic:quadratic_drag"]
"""


@pytest.fixture
def windy(tmp_path: Path) -> Path:
    """The file of a scene with a loop."""
    path = tmp_path / "windy.toml"
    path.write_text(WINDY)
    return path


def test_compile_goes_before_what_the_scene_says(call: Call, windy: Path) -> None:
    ways = {}
    for choice in ("never", "always"):
        told = json.loads(call("explain", windy, "--until", "0.1", "--compile", choice, "--json").stdout)
        ways[choice] = (told["compile"], told["groups"][0]["tier"])
    assert ways == {"never": ("never", "interpreted"), "always": ("always", "compiled")}
    assert json.loads(call("explain", windy, "--json").stdout)["compile"] == "never"
    runs = [json.loads(call("run", windy, "--json", *more).stdout)["objects"] for more in ([], ["--compile", "always"])]
    assert runs[0] == runs[1]


def test_warm_compiles_what_a_scene_needs_and_runs_nothing(
    call: Call, windy: Path, scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from xpheve.compile import tiers

    monkeypatch.setenv("XPHEVE_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(tiers, "_compiled", {})
    told = call("warm", windy)
    assert (
        told.exit_code == 0
        and 'not compiled: compile="never"; 1 rows and pairs' in told.stdout
        and "0 loops ready" in told.stdout
    )
    told = call("warm", windy, scene, "--compile", "always")
    assert (
        told.exit_code == 0 and "1 loop ready" in told.stdout and "compiled now, and kept for later runs" in told.stdout
    )
    assert len(list((tmp_path / "cache" / "kernels").iterdir())) == 1
    monkeypatch.setattr(tiers, "_compiled", {})  # as another process
    (found,) = json.loads(call("warm", windy, "--compile", "always", "--json").stdout)
    assert found["origin"] == "cache" and found["what"] == "basic:quadratic_drag" and found["scene"] == str(windy)
    explained = json.loads(call("explain", windy, "--until", "0.1", "--compile", "always", "--json").stdout)
    assert explained["groups"][0]["kernel"]["origin"] == "cache"
    assert len(list((tmp_path / "cache" / "kernels").iterdir())) == 1


def test_warm_compiles_the_driver_and_the_forces_of_a_scene_to_tolerances(call: Call, windy: Path) -> None:
    windy.write_text("\n".join(line for line in WINDY.splitlines() if not line.startswith("dt")))
    told = json.loads(call("warm", windy, "--compile", "always", "--json").stdout)
    assert [one["what"] for one in told] == ["forces: basic:quadratic_drag", "driver radau15"]
    assert {one["origin"] for one in told} <= {"compiled", "cache", "memory"}
    (left,) = json.loads(call("warm", windy, "--json").stdout)
    assert left["because"] == 'not compiled: compile="never"'
    windy.write_text(WINDY.replace("basic:quadratic_drag", "basic:linear_drag").replace("\ndrag_area", "\n# drag_area"))
    (exact,) = json.loads(call("warm", windy, "--compile", "always", "--json").stdout)
    assert exact["because"] == "in closed form: core:linear"


def test_warm_without_a_scene_compiles_each_law_of_the_packs(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from xpheve.compile import tiers

    monkeypatch.setenv("XPHEVE_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(tiers, "_compiled", {})
    told = json.loads(call("warm", "--json").stdout)
    ready = {one["what"] for one in told if one["origin"] == "compiled"}
    assert {"basic:quadratic_drag", "basic:wind", "basic:spring", "basic:universal_gravity"} <= ready
    (gravity,) = (one for one in told if one["what"] == "basic:planet_gravity")
    assert gravity["origin"] == "none" and "constant" in gravity["because"]
    assert len(list((tmp_path / "cache" / "kernels").iterdir())) == len(ready)


def test_warm_says_what_is_wrong_with_a_scene(call: Call, tmp_path: Path) -> None:
    told = call("warm", tmp_path / "nothing.toml")
    assert told.exit_code == 1 and told.stderr.startswith("error: ")
