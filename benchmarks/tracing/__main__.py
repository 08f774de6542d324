"""Run the benchmarks of traced laws and write what they found."""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from benchmarks.calibrate import calibrate, machine
from benchmarks.measure import SAMPLES
from benchmarks.tracing import groups, outside, report, starts, switching
from benchmarks.tracing.runner import has_loop

ROOT = Path(__file__).resolve().parents[2]
PARTS = (*groups.TITLES, "order", "starts", "switching")


def collect(parts: Sequence[str], samples: int, quick: bool) -> dict[str, Any]:
    """Everything measured, as plain values."""
    results: dict[str, Any] = {
        "machine": machine() | {"numba": version("numba")},
        "calibration": calibrate(samples),
        "samples": samples,
        "quick": quick,
        "loop": has_loop(),
        "pack lines": outside.lines(),
    }
    results["groups"] = [
        told(groups.measure(one, samples, quick)) for one in groups.groups(quick) if one.scene in parts
    ]
    results["order"] = [groups.order(one) for one in groups.refined(quick)] if "order" in parts else []
    results["switching"] = switching.measure(samples, *((20, 3) if quick else ())) if "switching" in parts else None
    results["starts"] = starts.measure(samples, *((20, 8) if quick else ())) if "starts" in parts else None
    return results


def told(found: dict[str, Any]) -> dict[str, Any]:
    """Say how far we are; the whole takes minutes."""
    print(
        f"{found['scene']}, {found['n']:,} bodies, {found['tier']}: {found['ratio']:.2f} x {found['against']}",
        file=sys.stderr,
        flush=True,
    )
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; 1 if a bar is missed, but for a quick run, which says nothing about time."""
    parser = argparse.ArgumentParser(prog="benchmarks/tracing/run", description=__doc__)
    parser.add_argument("--part", action="append", choices=PARTS, help="only this one; may be given again")
    parser.add_argument("--quick", action="store_true", help="few samples of tiny scenes: to see that all works")
    parser.add_argument("--samples", type=int, help=f"turns that each contender has (default: {SAMPLES})")
    parser.add_argument(
        "--out",
        type=Path,
        help="folder for the results (default: benchmarks/results; of a part or --quick, .benchmarks)",
    )
    parser.add_argument("--page", action="store_true", help="put the tables into docs/benchmarks.md, too")
    chosen = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        sys.path.append(str(outside.install(Path(folder))))
        try:
            results = collect(chosen.part or PARTS, chosen.samples or (2 if chosen.quick else SAMPLES), chosen.quick)
        finally:
            sys.path.pop()
    text = report.tables(results)
    print(text)
    whole = not chosen.quick and not chosen.part
    out = chosen.out or ROOT / ("benchmarks/results" if whole else ".benchmarks")
    out.mkdir(parents=True, exist_ok=True)
    (out / "tracing.json").write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    (out / "tracing.md").write_text(text, encoding="utf-8")
    if chosen.page:
        report.put_into_page(text, ROOT / "docs" / "benchmarks.md")
    missed = report.missed(results)
    for line in missed:
        print(f"missed: {line}", file=sys.stderr)
    return 1 if missed and not chosen.quick else 0


if __name__ == "__main__":
    sys.exit(main())
