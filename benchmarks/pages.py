"""What was found on scenes, for people: tables, files, plots, a section of the page of the documentation."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks import front, plots
from benchmarks.front import Row, seconds
from benchmarks.problem import Bar
from benchmarks.report import put_between

FIELDS = ("scene", "engine", "setting", "dt", "seconds", "spread", "error", "drift", "note")


@dataclass(frozen=True)
class Section:
    """A part of the page: the name of its files, and between which marks it stands."""

    name: str
    begin: str
    end: str

    def write(self, results: dict[str, Any], folder: Path) -> None:
        """NAME.json, NAME.csv, NAME.md and NAME/*.png, a plot a scene, in ``folder``."""
        write(self.name, results, folder)

    def put_into_page(self, text: str, page: Path) -> None:
        """Replace what stands between the two marks of the page."""
        put_between(text, page, self.begin, self.end)


def table(results: dict[str, Any]) -> str:
    """All results as Markdown."""
    parts = [_head(results), _bars(results)]
    parts += [_scene(scene, results) for scene in results["scenes"]]
    parts += [_special(special) for special in results["specials"]]
    return "\n\n".join(parts) + "\n"


def _head(results: dict[str, Any]) -> str:
    machine, fixed = results["machine"], results["calibration"]
    peers = (
        ", ".join(f"{name} {version or 'not installed'}" for name, version in results["peers"].items()) or "no peers"
    )
    return (
        f"Machine: {machine['cores']} ({machine['processor']}), Python {machine['python']}, NumPy {machine['numpy']}; {peers}. "
        f"CPU time, medians of up to {results['samples']}, in turns. "
        f"The fixed loop took {1e3 * fixed['python']:.1f} ms (Python) and {1e3 * fixed['numpy']:.1f} ms (NumPy)."
        + (" A QUICK run: for seeing that all works, not for comparing." if results["quick"] else "")
    )


def verdicts(results: dict[str, Any]) -> list[tuple[str, front.Verdict]]:
    """The bars of all scenes, with what was found."""
    found = []
    for scene in results["scenes"]:
        found += [(scene["id"], front.judge(Bar(**bar), scene["rows"])) for bar in scene["bars"]]
    for special in results["specials"]:
        found += [(special["id"], front.Verdict(bar["text"], bar["found"], bar["met"])) for bar in special["bars"]]
    return found


def _bars(results: dict[str, Any]) -> str:
    said = {True: "met", False: "**missed**", None: "-"}
    lines = ["### Bars", "", "| scene | bar | found | |", "| --- | --- | --- | --- |"]
    lines += [f"| {scene} | {one.text} | {one.found} | {said[one.met]} |" for scene, one in verdicts(results)]
    return "\n".join(lines)


def _scene(scene: dict[str, Any], results: dict[str, Any]) -> str:
    rows: list[Row] = scene["rows"]
    best = front.front(rows)
    has_drift = any(row["drift"] is not None for row in rows)
    measures = sorted({name for row in front.counted(rows) for name in row["more"].get("measures", {})})
    names = [
        "engine",
        "setting",
        "CPU time",
        "error",
        *(["energy error"] if has_drift else []),
        *measures,
        "paid once",
        "on the front",
        "note",
    ]
    lines = [f"### {scene['id']}: {scene['title']}", "", f"Error: {scene['metric']}.", ""]
    if scene["plot"]:
        lines += [f"![{scene['title']}: CPU time against error]({scene['plot']})", ""]
    lines += ["| " + " | ".join(names) + " |", "|" + " --- |" * len(names)]
    for row in front.counted(rows):
        cells = [row["engine"], row["setting"], seconds(row["seconds"]), _number(row["error"])]
        cells += [_number(row["drift"])] if has_drift else []
        cells += [_number(row["more"].get("measures", {}).get(name)) for name in measures]
        cells += [seconds(_once(row)), "yes" if row in best else "", _note(row, results)]
        lines.append("| " + " | ".join(cells) + " |")
    lines += ["", " ".join([*_standing(rows), *_missing(rows), scene["notes"]]).strip()]
    return "\n".join(lines)


def _once(row: Row) -> float:
    """Built, and what the first run took more than a later one: planning, compiling, loading."""
    return float(row["more"]["built"] + max(0.0, row["more"]["first"] - row["seconds"]))


def _note(row: Row, results: dict[str, Any]) -> str:
    count = row["more"].get("samples", results["samples"])
    few = "" if count == results["samples"] else f"{count} of {results['samples']} samples"
    warned = f"warned: {', '.join(row['more']['warned'])}" if row["more"].get("warned") else ""
    return "; ".join(part for part in (row["note"], warned, few) if part)


def _standing(rows: list[Row]) -> list[str]:
    found = front.standings(rows)
    if not found:
        return ["No row of ours."]
    if all(front.is_ours(row) for row in front.counted(rows)):
        return ["No peer in this run."]
    ahead = [one for one in found if not one.beaten_by]
    said = [f"{len(ahead)} of {len(found)} rows of ours are beaten by no peer in time and error together."]
    mine = front.front([one.row for one in found])
    behind = [one for one in found if one.beaten_by and one.row in mine]
    if behind:
        said.append(
            "Of our own front, behind: "
            + "; ".join(f"{_short(one.row)} by {_short(one.beaten_by[0])}" for one in behind)
            + "."
        )
    return said


def _short(row: Row) -> str:
    return f"{front.name(row)} ({row['error']:.0e} in {seconds(row['seconds'])})"


def _missing(rows: list[Row]) -> list[str]:
    """Rows without a result, put together by the reason."""
    counted = front.counted(rows)
    reasons: dict[str, list[str]] = {}
    for row in rows:
        if row not in counted:
            reasons.setdefault(row["note"] or "not finite", []).append(front.name(row))
    return [f"Without a result: {'; '.join(names)}: {reason}." for reason, names in reasons.items()]


def _number(value: float | None) -> str:
    return "-" if value is None else "0" if value == 0 else f"{value:.1e}"


def _special(special: dict[str, Any]) -> str:
    lines = [f"### {special['id']}: {special['title']}", ""]
    if special.get("plot"):
        lines += [f"![{special['title']}]({special['plot']})", ""]
    lines += ["| " + " | ".join(special["names"]) + " |", "|" + " --- |" * len(special["names"])]
    lines += ["| " + " | ".join(map(str, row)) + " |" for row in special["rows"]]
    return "\n".join([*lines, "", special["text"]]).strip()


def rounded(value: Any) -> Any:
    """The same with six digits a number: what was measured has no more, and files stay small."""
    if isinstance(value, dict):
        return {key: rounded(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [rounded(one) for one in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def write(name: str, results: dict[str, Any], folder: Path) -> None:
    """``name`` with .json, .csv, .md, and a plot a scene, in ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    pictures = folder / name
    pictures.mkdir(exist_ok=True)
    for old in pictures.glob("*.png"):
        old.unlink()
    for scene in results["scenes"]:
        scene["plot"] = ""
        if plots.draw(
            f"{scene['id']}: {scene['title']}", scene["metric"], scene["rows"], pictures / f"{scene['file']}.png"
        ):
            scene["plot"] = f"../benchmarks/results/{name}/{scene['file']}.png"
    for special in results["specials"]:
        if plots.draw_growth(special["title"], special.get("curves", {}), pictures / f"{special.get('file')}.png"):
            special["plot"] = f"../benchmarks/results/{name}/{special['file']}.png"
    (folder / f"{name}.json").write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    (folder / f"{name}.md").write_text(table(results), encoding="utf-8")
    with (folder / f"{name}.csv").open("w", newline="", encoding="utf-8") as file:
        lines = csv.DictWriter(file, FIELDS, extrasaction="ignore", lineterminator="\n")
        lines.writeheader()
        for scene in results["scenes"]:
            lines.writerows(scene["rows"])
