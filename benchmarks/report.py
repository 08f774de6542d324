"""What was found, for people: tables, files, a plot, the page of the documentation."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

BEGIN, END = "<!-- results: written by benchmarks/run --page -->", "<!-- end of results -->"
SMALLEST = 1e-17  # where an error of 0 is drawn
FIELDS = ("scene", "engine", "setting", "dt", "seconds", "spread", "error", "drift", "note")


def table(results: dict[str, Any]) -> str:
    """All results as Markdown."""
    parts = [_head(results)]
    for scene, title in results["titles"].items():
        rows = [row for row in results["rows"] if row["scene"] == scene]
        if rows:
            parts.append(_scene(scene, title, rows, results["bars"][scene]))
    if results["costs"]:
        parts.append(_costs(results["costs"]))
    return "\n\n".join(parts) + "\n"


def _head(results: dict[str, Any]) -> str:
    machine, fixed = results["machine"], results["calibration"]
    peers = (
        ", ".join(f"{name} {version or 'not installed'}" for name, version in results["peers"].items()) or "no peers"
    )
    return (
        f"Machine: {machine['cores']} ({machine['processor']}), Python {machine['python']}, NumPy {machine['numpy']}; {peers}. "
        f"CPU time, medians of {results['samples']}, in turns. "
        f"The fixed loop took {1e3 * fixed['python']:.1f} ms (Python) and {1e3 * fixed['numpy']:.1f} ms (NumPy)."
        + (" A QUICK run: for seeing that all works, not for comparing." if results["quick"] else "")
    )


def _scene(scene: str, title: str, rows: list[dict[str, Any]], bars: dict[str, float]) -> str:
    single = "drift" in bars
    lines = [f"### {scene}: {title}", "", *_table_head(single)]
    for row in rows:
        cells = [row["engine"], row["setting"], _step(row["dt"]), _seconds(row["seconds"]), _number(row["error"])]
        if single:
            cells.append(_number(row["drift"]))
        lines.append("| " + " | ".join([*cells, row["note"]]) + " |")
    return "\n".join([*lines, "", verdict(rows)])


def _table_head(single: bool) -> list[str]:
    names = ["engine", "setting", "dt [s]", "CPU time" if single else "CPU time a step", "position error [m]"]
    names += ["energy error", "note"] if single else ["note"]
    return ["| " + " | ".join(names) + " |", "|" + " --- |" * len(names)]


def _step(dt: float | None) -> str:
    return "none" if dt is None else f"1/{round(1 / dt)}"


def _seconds(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{1e6 * value:.1f} µs" if value < 1e-3 else f"{1e3 * value:.2f} ms" if value < 1 else f"{value:.2f} s"


def _number(value: float | None) -> str:
    return "-" if value is None else "0" if value == 0 else f"{value:.1e}"


def verdict(rows: list[dict[str, Any]]) -> str:
    """Whether a peer is both faster and more accurate, and how far the nearest error is."""
    ours = [row for row in rows if row["engine"] == "xPheve" and row["error"] is not None]
    peers = [row for row in rows if row["engine"] != "xPheve" and row["error"] is not None]
    if not ours or not peers:
        return "No peer in this run to compare with."
    mine = min(ours, key=lambda row: row["seconds"])
    beaten = [p for p in peers if p["seconds"] < mine["seconds"] and p["error"] < mine["error"]]
    near = min(peers, key=lambda p: p["error"])
    faster = [p for p in peers if p["seconds"] < mine["seconds"]]
    said = []
    if beaten:
        first = min(beaten, key=lambda p: p["seconds"])
        said.append(f"**Not on the front**: {_name(first)} is faster and more accurate than our quickest row.")
    else:
        said.append("On the Pareto front: no peer is both faster and more accurate.")
    said.append(
        f"The most accurate peer, {_name(near)}, has an error of {_number(near['error'])} m "
        f"in {near['seconds'] / mine['seconds']:.1f} times our time; ours is {_number(mine['error'])} m."
    )
    if faster:
        best = min(faster, key=lambda p: p["error"])
        said.append(
            f"Where we are not ahead: {len(faster)} of {len(peers)} rows of peers take less time, the best of them, "
            f"{_name(best)}, {best['seconds'] / mine['seconds']:.2f} times ours with an error of {_number(best['error'])} m."
        )
    else:
        said.append("No row of a peer takes less time.")
    return " ".join(said)


def _name(row: dict[str, Any]) -> str:
    return f"{row['engine']} {row['setting']} at {_step(row['dt'])}"


def _costs(costs: list[dict[str, Any]]) -> str:
    lines = ["### Costs paid once", "", "| what | found | bar | | note |", "| --- | --- | --- | --- | --- |"]
    for cost in costs:
        unit = f" {cost['unit']}"
        found = "-" if cost["value"] is None else f"{cost['value']:.3g}{unit}"
        bar = "-" if cost["bar"] is None else f"{cost['bar']:g}{unit}"
        met = {True: "met", False: "**missed**", None: "-"}[cost["met"]]
        lines.append(f"| {cost['name']} | {found} | {bar} | {met} | {cost['note']} |")
    return "\n".join(lines)


def missed(results: dict[str, Any]) -> list[str]:
    """The bars that were missed, as sentences; those of error first."""
    found = []
    for row in results["rows"]:
        bar = results["bars"][row["scene"]]
        if row["engine"] != "xPheve":
            continue
        if row["error"] is None or not row["error"] <= bar["error"]:
            found.append(f"error of {_name(row)} on {row['scene']}: {row['error']} m, bar {bar['error']}")
        if "drift" in bar and not abs(row["drift"]) <= bar["drift"]:
            found.append(f"error of energy of {_name(row)} on {row['scene']}: {row['drift']}, bar {bar['drift']}")
        if row["more"].get("nothing_computed") is False:
            found.append(f"error: something was computed between reads on {row['scene']}")
    for row in results["rows"]:
        if row["more"].get("ratio", 0.0) > row["more"].get("bar", 1.0):
            found.append(
                f"time on {row['scene']}: {row['more']['ratio']:.2f} times NumPy, {row['setting']}; bar {row['more']['bar']}"
            )
    for cost in results["costs"]:
        if cost["met"] is False:
            found.append(f"time: {cost['name']}: {cost['value']:.3g} {cost['unit']}, bar {cost['bar']}")
    return found


def write(results: dict[str, Any], folder: Path) -> None:
    """results.json, results.csv, results.md and run_time_against_error.png in ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "results.json").write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    (folder / "results.md").write_text(table(results), encoding="utf-8")
    with (folder / "results.csv").open("w", newline="", encoding="utf-8") as file:
        lines = csv.DictWriter(file, FIELDS, extrasaction="ignore", lineterminator="\n")
        lines.writeheader()
        lines.writerows(results["rows"])
    plot(results, folder / "run_time_against_error.png")


def plot(results: dict[str, Any], path: Path) -> None:
    """One panel a scene: CPU time across, error upwards; nothing without matplotlib."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        return
    scenes = [s for s in results["titles"] if any(r["scene"] == s and r["error"] is not None for r in results["rows"])]
    if not scenes:
        return
    figure = Figure(figsize=(3.6 * len(scenes), 3.6), layout="constrained")
    panels = figure.subplots(1, len(scenes), squeeze=False)[0]
    for panel, scene in zip(panels, scenes, strict=True):
        _draw(panel, [row for row in results["rows"] if row["scene"] == scene and row["error"] is not None])
        panel.set(xscale="log", yscale="log", title=scene, xlabel="CPU time [s]", ylabel="position error [m]")
        panel.grid(alpha=0.3)
        panel.legend(fontsize=7)
    figure.savefig(path, dpi=80, metadata={"Software": None})


def _draw(panel: Any, rows: list[dict[str, Any]]) -> None:
    curves: dict[str, list[tuple[float, float]]] = {}
    for row in rows:
        setting = "" if row["engine"] == "xPheve" else f" {row['setting']}"
        curves.setdefault(row["engine"] + setting, []).append((row["seconds"], max(row["error"], SMALLEST)))
    for k, (name, points) in enumerate(curves.items()):
        star = name == "xPheve"
        panel.plot(
            *zip(*points, strict=True), "*" if star else "o-", ms=12 if star else 4, lw=1, color=f"C{k}", label=name
        )


def put_into_page(text: str, page: Path) -> None:
    """Replace what stands between the two marks of the page."""
    put_between(text, page, BEGIN, END)


def put_between(text: str, page: Path, begin: str, end: str) -> None:
    """Replace what stands between the marks ``begin`` and ``end`` of the page."""
    before, _, rest = page.read_text(encoding="utf-8").partition(begin)
    _, _, after = rest.partition(end)
    page.write_text(f"{before}{begin}\n\n{text}\n{end}{after}", encoding="utf-8")
