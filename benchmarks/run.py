"""Run the benchmarks and write what they found: a table, files, a plot."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from benchmarks import costs, ours, report
from benchmarks.ball import Ball
from benchmarks.calibrate import calibrate, machine
from benchmarks.measure import SAMPLES, Row, in_turns
from benchmarks.peers import ADAPTERS, adapter, version
from benchmarks.scenes import BALLS, s12_free_spheres

ROOT = Path(__file__).resolve().parent.parent
DTS = (1 / 60, 1 / 240, 1 / 1000, 1 / 4000)
SCENES = (*(scene.id for scene in BALLS), s12_free_spheres.ID)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; 1 if one of our own error bars is missed."""
    parser = argparse.ArgumentParser(prog="benchmarks/run", description=__doc__)
    parser.add_argument(
        "--scene", action="append", choices=[*SCENES, "costs", "none"], help="only this one; may be given again"
    )
    parser.add_argument("--peer", action="append", choices=[*ADAPTERS, "none"], help="only this one; 'none' for none")
    parser.add_argument(
        "--quick", action="store_true", help="few samples, coarse steps, 1,000 objects: to see that all works"
    )
    parser.add_argument(
        "--out", type=Path, help="folder for the results (default: benchmarks/results; of a part, .benchmarks)"
    )
    parser.add_argument("--page", action="store_true", help="put the results into docs/benchmarks.md, too")
    chosen = parser.parse_args(arguments)

    scenes = chosen.scene or [*SCENES, "costs"]
    names = [name for name in (chosen.peer or ADAPTERS) if name != "none"]
    whole = not chosen.quick and not chosen.scene and not chosen.peer
    out = chosen.out or ROOT / ("benchmarks/results" if whole else ".benchmarks")
    results = collect(scenes, {name: adapter(name) for name in names}, quick=chosen.quick)
    text = report.table(results)
    print(text)
    report.write(results, out)
    if chosen.page:
        report.put_into_page(text, ROOT / "docs" / "benchmarks.md")
    missed = report.missed(results)
    for line in missed:
        print(f"missed: {line}", file=sys.stderr)
    return 1 if any(line.startswith("error") for line in missed) else 0


def collect(scenes: Sequence[str], peers: dict[str, ModuleType | None], *, quick: bool) -> dict[str, Any]:
    """Everything measured, as plain values."""
    samples = 3 if quick else SAMPLES
    results: dict[str, Any] = {
        "machine": machine(),
        "calibration": calibrate(samples),
        "samples": samples,
        "quick": quick,
    }
    results["peers"] = {name: None if peer is None else version(name) for name, peer in peers.items()}
    rows: list[Row] = []
    for scene in BALLS:
        if scene.id in scenes:
            rows += ball_rows(scene, peers, samples, DTS[:2] if quick else DTS)
    if s12_free_spheres.ID in scenes:
        rows += s12_free_spheres.measure(peers, samples, quick)
    for row in rows:
        if row.seconds is not None:  # in units of the fixed loop, to compare machines
            row.more["loops"] = row.seconds / results["calibration"]["python"]
    results["rows"] = [row.plain() for row in rows]
    results["costs"] = [cost.plain() for cost in costs.measure(samples, quick)] if "costs" in scenes else []
    results["bars"] = {scene.id: {"error": scene.error_bar, "drift": scene.drift_bar} for scene in BALLS}
    results["bars"][s12_free_spheres.ID] = {"error": s12_free_spheres.ERROR_BAR, "ratio": s12_free_spheres.RATIO_BAR}
    results["titles"] = {scene.id: f"{scene.title}, {scene.span:g} s" for scene in BALLS}
    results["titles"][s12_free_spheres.ID] = s12_free_spheres.TITLE
    return results


def ball_rows(scene: Ball, peers: dict[str, ModuleType | None], samples: int, dts: Sequence[float]) -> list[Row]:
    """All rows of a scene of one sphere."""
    contenders = ours.ball(scene, (1 / 240,))
    missing = []
    for name, peer in peers.items():
        if peer is None:
            missing.append(Row(scene.id, name, "-", note="not installed"))
        else:
            contenders += peer.ball(scene, dts)
    in_turns(contenders, scene.errors, samples)
    return [*(one.row for one in contenders), *missing]


if __name__ == "__main__":
    sys.exit(main())
