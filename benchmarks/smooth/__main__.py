"""Run the benchmarks of smooth motion: tables, files, plots, the page; 1 if a bar of error is missed."""

from __future__ import annotations

import argparse
import statistics
import sys
import time
import warnings
from collections.abc import Sequence
from dataclasses import asdict, replace
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

from benchmarks.calibrate import calibrate, machine
from benchmarks.measure import SAMPLES, Row
from benchmarks.peers import SMOOTH, adapter, version
from benchmarks.smooth import measure, ours, report
from benchmarks.smooth.problem import Problem

ROOT = Path(__file__).resolve().parents[2]
SCENES = (
    "thrown",
    "s04_free_spin",
    "kepler",
    "figure_eight",
    "pythagorean",
    "outer_solar_system",
    "stiff_spring",
    "stiff_chain",
    "van_der_pol",
    "robertson",
    "gyration",
    "magnetic_bottle",
    "heavy_top",
    "gravity_gradient",
)
SPECIALS = ("kepler_outputs", "energy_growth", "dust")


def main(arguments: Sequence[str] | None = None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="benchmarks/smooth/run", description=__doc__)
    parser.add_argument(
        "--scene", action="append", choices=[*SCENES, *SPECIALS], help="only this one; may be given again"
    )
    parser.add_argument("--peer", action="append", choices=[*SMOOTH, "none"], help="only this one; 'none' for none")
    parser.add_argument("--quick", action="store_true", help="one sample, few starts: to see that all works")
    parser.add_argument(
        "--out", type=Path, help="folder for the results (default: benchmarks/results; of a part, .benchmarks)"
    )
    parser.add_argument("--page", action="store_true", help="put the results into docs/benchmarks.md, too")
    chosen = parser.parse_args(arguments)

    names = [name for name in (chosen.peer or SMOOTH) if name != "none"]
    whole = not chosen.quick and not chosen.scene and not chosen.peer
    out = chosen.out or ROOT / ("benchmarks/results" if whole else ".benchmarks")
    peers = {name: adapter(name, SMOOTH) for name in names}
    results = report.rounded(collect(chosen.scene or [*SCENES, *SPECIALS], peers, quick=chosen.quick))
    report.write(results, out)
    text = report.table(results)
    print(text)
    if chosen.page:
        report.put_into_page(text, ROOT / "docs" / "benchmarks.md")
    missed = [f"{scene}: {one.text}: {one.found}" for scene, one in report.verdicts(results) if one.met is False]
    for line in missed:
        print(f"missed: {line}", file=sys.stderr)
    return 1 if missed else 0


def collect(names: Sequence[str], peers: dict[str, ModuleType | None], *, quick: bool) -> dict[str, Any]:
    """Everything measured, as plain values."""
    samples = 1 if quick else SAMPLES
    results: dict[str, Any] = {
        "machine": machine(),
        "calibration": calibrate(3 if quick else samples),
        "samples": samples,
        "quick": quick,
        "peers": {name: None if peer is None else version(name) for name, peer in peers.items()},
        "scenes": [],
        "specials": [],
    }
    # What a row warned of at its first run stands in the row.
    warnings.simplefilter("ignore")
    installed = {name: peer for name, peer in peers.items() if peer is not None}
    for name in names:
        begin = time.perf_counter()
        module = import_module(f"benchmarks.scenes.{name}")
        if name in SPECIALS:
            results["specials"].append(module.measure(samples, quick, tuple(installed)))
        elif name == "pythagorean":
            results["scenes"].append(many_starts(module.VARIANTS[: 3 if quick else None], installed, samples))
        else:
            results["scenes"] += [one_scene(problem, installed, samples) for problem in module.PROBLEMS]
        print(f"{name}: {time.perf_counter() - begin:.1f} s", file=sys.stderr, flush=True)
    return results


def one_scene(problem: Problem, peers: dict[str, ModuleType], samples: int) -> dict[str, Any]:
    """The rows of a scene, and what is needed to tell of them."""
    contenders = ours.contenders(problem)
    for peer in peers.values():
        contenders += peer.smooth(problem)
    return _told(problem, measure.take_turns(problem, contenders, samples))


def many_starts(variants: Sequence[Problem], peers: dict[str, ModuleType], samples: int) -> dict[str, Any]:
    """The same with several starts: each row is the median error, and the time of one run, over all."""
    each = [ours.contenders(problem) for problem in variants]
    for peer in peers.values():
        for problem, found in zip(variants, each, strict=True):
            found += peer.smooth(problem)
    together = [measure.together(column) for column in zip(*each, strict=True)]

    def error(ends: Any) -> float:
        return statistics.median(problem.error(end) for problem, end in zip(variants, ends, strict=True))

    def drift(ends: Any) -> float:
        return statistics.median(
            abs(problem.drift(end)) for problem, end in zip(variants, ends, strict=True) if problem.drift
        )

    return _told(
        variants[0], measure.take_turns(replace(variants[0], error=error, drift=drift), together, min(samples, 5))
    )


def _told(problem: Problem, rows: Sequence[Row]) -> dict[str, Any]:
    return {
        "id": problem.id,
        "title": problem.title,
        "metric": problem.metric,
        "file": problem.file,
        "notes": problem.notes,
        "bars": [asdict(bar) for bar in problem.bars],
        "rows": [row.plain() for row in rows],
    }


if __name__ == "__main__":
    sys.exit(main())
