"""Run the benchmarks of sums over many bodies and write what they found."""

from __future__ import annotations

import argparse
import json
import statistics
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.calibrate import calibrate, machine
from benchmarks.long_range.contenders import OurDirect, OurTree, Rebound, errors, exact, plummer
from benchmarks.measure import SAMPLES, cpu_time
from benchmarks.report import put_between

BEGIN, END = "<!-- long range: written by benchmarks/long_range/run --page -->", "<!-- end of long range -->"
ROOT = Path(__file__).resolve().parents[2]
DIRECT_BAR, DIRECT_ERROR = 0.75, 1e-14
TREE_BAR, TREE_ERROR = 0.5, 1e-3
ERRORS, ANGLES = (3e-2, 1e-2, 1e-3, 1e-4), (1.0, 0.7, 0.5)
BARRED = 100_000
"""Bodies from which on the tree has a bar."""
LOOKED_AT = 1000
"""Bodies on which errors are measured."""


def in_turns(contenders: dict[str, Any], samples: int) -> dict[str, list[float]]:
    """CPU times [s] of one evaluation by each contender, turn after turn."""
    times: dict[str, list[float]] = {name: [] for name in contenders}
    for _ in range(samples):
        for name, one in contenders.items():
            times[name].append(cpu_time(one.act))
    return times


def direct(count: int, samples: int) -> dict[str, Any]:
    """All pairs of ``count`` bodies: times, errors, and whether bits are the same for one thread and two."""
    x = plummer(count)
    which = np.arange(0, count, max(1, count // LOOKED_AT))
    right = exact(x, which)
    contenders = {"xpheve": OurDirect(x), "REBOUND basic": Rebound(x, "basic")}
    times = in_turns(contenders, samples)
    rows = {
        name: {"seconds": statistics.median(times[name]), "p99": errors(one.read()[:, which], right)[1]}
        for name, one in contenders.items()
    }
    ratio = statistics.median(a / b for a, b in zip(*times.values(), strict=True))
    same = OurDirect(x, 2).read().tobytes() == contenders["xpheve"].read().tobytes()
    met = ratio <= DIRECT_BAR and rows["xpheve"]["p99"] <= DIRECT_ERROR and same
    return {"n": count, "rows": rows, "ratio": ratio, "same bits": same, "met": met}


def by_tree(count: int, samples: int) -> dict[str, Any]:
    """A tree for some errors beside REBOUND's for some angles; each of REBOUND's is held against our cheapest that is no worse."""
    x = plummer(count)
    which = np.arange(0, count, max(1, count // LOOKED_AT))
    right = exact(x, which)
    ours = {f"xpheve {error:g}": OurTree(x, error) for error in ERRORS}
    theirs = {f"REBOUND tree {angle:g}": Rebound(x, "tree", angle) for angle in ANGLES}
    times = in_turns(ours | theirs, samples)
    rows: dict[str, Any] = {}
    for name, one in (ours | theirs).items():
        median, p99 = errors(one.read()[:, which], right)
        rows[name] = {"seconds": statistics.median(times[name]), "median": median, "p99": p99}
        if isinstance(one, OurTree):
            rows[name] |= {"told": one.told, "walks": one.walks}
    ratios = {}
    for name in theirs:
        good = [one for one in ours if rows[one]["p99"] <= rows[name]["p99"]]
        best = min(good, key=lambda one: rows[one]["seconds"]) if good else ""
        pairs = zip(times.get(best, []), times[name], strict=False)
        ratios[name] = {"ours": best, "ratio": statistics.median(a / b for a, b in pairs) if good else None}
    return {"n": count, "rows": rows, "ratios": ratios, "met": tree_met(count, rows, ratios)}


def tree_met(count: int, rows: dict[str, Any], ratios: dict[str, Any]) -> bool | None:
    """Whether the bar is met, which is one for many bodies; None of fewer."""
    if count < BARRED:
        return None
    held = rows[f"xpheve {TREE_ERROR:g}"]["p99"] <= TREE_ERROR
    return held and all(one["ratio"] is not None and one["ratio"] <= TREE_BAR for one in ratios.values())


def tables(results: dict[str, Any]) -> str:
    """All results as Markdown."""
    fixed, about = results["calibration"], results["machine"]
    lines = [
        f"Machine: {about['cores']} ({about['processor']}), Python {about['python']}, NumPy {about['numpy']}. CPU time of one evaluation, "
        f"medians of {results['samples']}, in turns. The fixed loop took {1e3 * fixed['python']:.1f} ms (Python) and "
        f"{1e3 * fixed['numpy']:.1f} ms (NumPy)."
        + (" A QUICK run: it says nothing of time." if results["quick"] else ""),
        "",
        "### All pairs of a Plummer sphere",
        "",
        f"| bodies | who | time [ms] | p99 error | ours over it, bar {DIRECT_BAR:g} | 1 thread and 2: same bits |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for one in results["direct"]:
        for name, row in one["rows"].items():
            mine = name == "xpheve"
            ratio = "" if mine else f"{one['ratio']:.2f}"
            same = ("yes" if one["same bits"] else "**no**") if mine else ""
            lines.append(
                f"| {one['n']:,} | {name} | {1e3 * row['seconds']:.2f} | {row['p99']:.1e} | {ratio} | {same} |"
            )
    lines += ["", "### By a tree", ""]
    lines += [
        f"| bodies | who, error or angle | time [ms] | median error | p99 error | told | ours, no worse, over it; bar {TREE_BAR:g} for {BARRED:,} |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for one in results["tree"]:
        for name, row in one["rows"].items():
            against = one["ratios"].get(name)
            ratio = (
                ""
                if against is None
                else "none is"
                if against["ratio"] is None
                else f"{against['ratio']:.2f} ({against['ours']})"
            )
            told = f"{row['told']:.1e}, {row['walks']} walks" if "told" in row else ""
            cells = [
                f"{one['n']:,}",
                name,
                f"{1e3 * row['seconds']:.1f}",
                f"{row['median']:.1e}",
                f"{row['p99']:.1e}",
                told,
                ratio,
            ]
            lines.append(f"| {' | '.join(cells)} |")
    lines.append("")
    lines.append(
        "Ours includes the build of the tree and the measurement of its error; errors are of 1,000 bodies, against sums in long double."
    )
    return "\n".join(lines) + "\n"


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; 1 if a bar is missed, but for a quick run, which says nothing about time."""
    parser = argparse.ArgumentParser(prog="benchmarks/long_range/run", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="few samples of small scenes: to see that all works")
    parser.add_argument("--samples", type=int, help=f"turns that each contender has (default: {SAMPLES})")
    parser.add_argument(
        "--out", type=Path, help="folder for the results (default: benchmarks/results; with --quick .benchmarks)"
    )
    parser.add_argument("--page", action="store_true", help="put the results into docs/benchmarks.md, too")
    chosen = parser.parse_args(arguments)
    samples = chosen.samples or (2 if chosen.quick else SAMPLES)
    results: dict[str, Any] = {
        "machine": machine(),
        "calibration": calibrate(samples),
        "samples": samples,
        "quick": chosen.quick,
        "direct": [direct(n, samples) for n in ((200, 1100) if chosen.quick else (1000, 10_000))],
        "tree": [by_tree(n, samples) for n in ((2000,) if chosen.quick else (10_000, 100_000))],
    }
    text = tables(results)
    print(text)
    out = chosen.out or ROOT / (".benchmarks" if chosen.quick else "benchmarks/results")
    out.mkdir(parents=True, exist_ok=True)
    (out / "long_range.json").write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    (out / "long_range.md").write_text(text, encoding="utf-8")
    if chosen.page:
        put_between(text, ROOT / "docs" / "benchmarks.md", BEGIN, END)
    missed = [
        f"{part}, {one['n']:,} bodies" for part in ("direct", "tree") for one in results[part] if one["met"] is False
    ]
    for line in missed:
        print(f"missed: {line}", file=sys.stderr)
    return 1 if missed and not chosen.quick else 0


if __name__ == "__main__":
    sys.exit(main())
