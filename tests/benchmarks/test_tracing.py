"""Traced laws beside laws by hand: all end in the same place, the peers are as good as they claim, results are told as found."""

from __future__ import annotations

import dataclasses
import importlib
import json
import platform
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
RESULTS = ROOT / "benchmarks" / "results"


def load(name: str) -> Any:
    if str(ROOT) not in sys.path:
        sys.path.insert(0, str(ROOT))
    return importlib.import_module(f"benchmarks.tracing{name and '.'}{name}")


air, cutoff, springs = load("air"), load("cutoff"), load("springs")
air_peers, cutoff_peers, springs_peers = load("air_peers"), load("cutoff_peers"), load("springs_peers")
groups, outside, report, starts = load("groups"), load("outside"), load("report"), load("starts")

SCENES = {
    "air": (air.start(43), air.DT, {**air_peers.COMPILED, **air_peers.NUMPY}, air),
    "springs": (springs.start(30, 80), springs.DT, springs_peers.COMPILED, springs),
    "cutoff": (cutoff.start(80), cutoff.DT, cutoff_peers.COMPILED, cutoff),
}
PEERS = [(scene, name) for scene, (_, _, peers, _) in SCENES.items() for name in peers]


def ended(make: Any, begin: Any, dt: float, steps: int) -> tuple[Any, Any]:
    runner = make(begin, dt)
    runner.advance(steps - steps // 3)
    runner.advance(steps // 3)
    return runner.read()


def off(one: Any, other: Any) -> float:
    """Largest difference over the largest number: of places, and of velocities."""
    return max(float(np.abs(a - b).max() / np.abs(b).max()) for a, b in zip(one, other, strict=True))


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    pytest.importorskip("pip")
    from xpheve.plugins import Registry

    folder = outside.install(tmp_path_factory.mktemp("pack"))
    sys.path.append(str(folder))
    Registry.default().refresh()
    yield folder
    sys.path.remove(str(folder))
    sys.modules.pop(outside.MODULE, None)
    Registry.default().refresh()


@pytest.mark.parametrize("scene", SCENES)
def test_all_peers_of_a_scene_end_in_the_same_place(scene: str) -> None:
    begin, dt, peers, _ = SCENES[scene]
    found = [ended(make, begin, dt, 60) for make in peers.values()]
    assert np.abs(found[0][0] - begin.position).max() > 0.01
    for other in found[1:]:
        assert off(other, found[0]) < 1e-12


@pytest.mark.parametrize(("scene", "name"), PEERS)
def test_every_peer_is_of_second_order_against_a_reference_of_another_method(scene: str, name: str) -> None:
    begin, dt, peers, module = SCENES[scene]
    expected = module.reference(begin, 32 * dt)
    errors = [groups.error(peers[name], begin, dt / k, 32 * k, expected) for k in (1, 2, 4)]
    assert errors[0] < 1e-3
    assert 1.9 < np.log2(errors[1] / errors[2]) < 2.1


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("compile", ["never", "always"])
def test_the_engine_ends_where_the_peers_do(scene: str, compile: str) -> None:
    begin, dt, peers, module = SCENES[scene]
    ours = ended(module.engine(compile=compile), begin, dt, 30)
    assert off(ours, ended(next(iter(peers.values())), begin, dt, 30)) < 1e-12


@pytest.mark.parametrize("compile", ["never", "always"])
def test_a_law_of_a_pack_outside_the_repository_does_the_same(pack: Path, compile: str) -> None:
    begin, dt, peers, _ = SCENES["air"]
    ours = ended(air.engine(air.OUTSIDE, compile), begin, dt, 30)
    assert Path(sys.modules[outside.MODULE].__file__).parent == pack
    assert off(ours, ended(peers["NumPy"], begin, dt, 30)) < 1e-12


def test_quadratic_drag_as_a_pack_takes_at_most_seven_lines(tmp_path: Path) -> None:
    assert 5 <= outside.lines() <= 7
    other = tmp_path / "other.py"
    other.write_text(
        '"""Doc\n\nstring."""\n\n# a comment\nx = """\ncounts\n"""\n\n\ndef f():\n    """Doc."""\n    return x  # counts\n'
    )
    assert outside.lines(other) == 5


def test_a_list_with_a_skin_is_made_anew_when_it_must_be() -> None:
    begin = cutoff.start(300)
    hot = dataclasses.replace(begin, velocity=4.0 * begin.velocity)
    found = [ended(make, hot, cutoff.DT, 90) for make in cutoff_peers.COMPILED.values()]
    assert np.linalg.norm(found[0][0] - hot.position, axis=1).max() > cutoff_peers.SKIN
    assert max(off(other, found[0]) for other in found[1:]) < 1e-11


@pytest.mark.parametrize("scene", ["springs", "cutoff"])
def test_the_energy_by_which_drift_is_told_is_that_of_the_forces(scene: str) -> None:
    begin, dt, peers, module = SCENES[scene]
    before = module.energy(begin, begin.position, begin.velocity)
    make = next(iter(peers.values()))
    drifts = [abs(module.energy(begin, *ended(make, begin, dt / k, 90 * k)) / before - 1.0) for k in (1, 2)]
    assert 0.0 < drifts[1] < 0.3 * drifts[0] < 1e-4


def test_the_smooth_force_and_its_slope_end_at_the_cutoff() -> None:
    q, small = cutoff.CUTOFF**2, 1e-5
    assert cutoff.slope() == pytest.approx((cutoff.level(q + small) - cutoff.level(q - small)) / (2 * small), rel=1e-8)
    assert cutoff.level(2.0 ** (1 / 3)) == pytest.approx(0.0, abs=1e-12)  # the bottom of the plain potential


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="looks for the names of x86-64 instructions")
@pytest.mark.parametrize(
    ("function", "instruction"),
    [
        (air_peers.tiled, "sqrtpd"),
        (air_peers.separate, "sqrtpd"),
        (cutoff_peers.forces, "divpd"),
        (springs_peers.stretched, "sqrtpd"),
    ],
)
def test_the_peers_run_in_vectors(function: Any, instruction: str) -> None:
    for make in (*air_peers.COMPILED.values(),):
        make(air.start(3), air.DT).advance(1)
    springs_peers.passes(springs.start(8, 12), springs.DT).advance(1)
    cutoff_peers.neighbours_in_vectors(cutoff.start(8), cutoff.DT).advance(1)
    text = "".join(function.inspect_asm().values())
    assert any(instruction in line and ("ymm" in line or "xmm" in line or "zmm" in line) for line in text.splitlines())


def test_the_first_bodies_of_more_are_the_fewer() -> None:
    few, many = air.start(10), air.start(1000)
    assert (few.position == many.position[:10]).all() and (few.more["drag"] == many.more["drag"][:10]).all()


def test_a_start_that_fails_is_an_error_and_a_start_has_a_home_of_its_own(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="no_such_module"):
        starts.child("import no_such_module", tmp_path)
    found = starts.child("import json, os\nprint(json.dumps({'home': os.path.expanduser('~')}))", tmp_path)
    assert found["home"] == str(tmp_path) and 0.0 < found["cpu"] < 60.0


def test_bars_of_starts_are_not_met_by_a_run_that_was_not_compiled() -> None:
    row = {"clock": 0.1, "cpu": 0.1, "numba": False, "llvmlite": False}
    rows = {name: row | {"tiers": [tier]} for name, tier in (("small", "interpreted"), ("cold", "-"), ("warm", "-"))}
    assert [line["met"] for line in starts.verdicts(rows, 1.0)] == [True, False, False, False, False]
    rows |= {name: row | {"tiers": ["compiled"]} for name in ("cold", "warm")}
    assert all(line["met"] for line in starts.verdicts(rows, 1.0))
    rows["small"] = rows["small"] | {"numba": True}
    assert not starts.verdicts(rows, 1.0)[0]["met"]


def test_a_quick_run_writes_its_files_and_measures_everything(
    pack: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert load("__main__").main(["--quick", "--samples", "2", "--out", str(tmp_path)]) == 0
    assert "### A network of springs" in capsys.readouterr().out
    results = json.loads((tmp_path / "tracing.json").read_text())
    assert [(one["scene"], one["tier"]) for one in results["groups"]] == [
        *2 * [("air", "compiled")], *2 * [("outside", "compiled")], *2 * [("air", "NumPy")], ("springs", "compiled"), ("cutoff", "compiled"),
    ]  # fmt: skip
    for one in results["groups"]:
        ratios = {row["engine"]: row["ratio"] for row in one["rows"]}
        assert ratios.pop("xPheve") == 1.0 and one["ratio"] == max(ratios.values()) > 0.0
        errors = [row["error"] for row in one["rows"]]
        assert max(errors) < 1e-4 and max(errors) < 1.001 * min(errors)
    for one in results["order"]:
        assert all(1.9 < told["order"] < 2.1 for told in one["found"].values())
    assert results["starts"]["same bits"] and len(results["switching"]["switches"]) == 10
    assert report.tables(results) == (tmp_path / "tracing.md").read_text()


@pytest.mark.skipif(not (RESULTS / "tracing.json").exists(), reason="benchmarks/tracing/run --page was not run yet")
def test_the_page_and_the_table_are_made_from_the_results_in_the_repository() -> None:
    text = (RESULTS / "tracing.md").read_text(encoding="utf-8")
    results = json.loads((RESULTS / "tracing.json").read_text(encoding="utf-8"))
    assert report.tables(results) == text
    assert text.strip() in (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")
    assert not results["quick"] and results["samples"] == 9
