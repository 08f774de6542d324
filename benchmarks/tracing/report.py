"""What was found about traced laws, for people: tables, and the page of the documentation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.report import _number, _seconds
from benchmarks.tracing.groups import OURS, SPAN, TITLES

BEGIN, END = "<!-- traced laws: written by benchmarks/tracing/run --page -->", "<!-- end of traced laws -->"


def tables(results: dict[str, Any]) -> str:
    """All results as Markdown."""
    parts = [_head(results)]
    for scene, title in TITLES.items():
        found = [one for one in results["groups"] if one["scene"] == scene]
        if found:
            parts.append(_scene(title, found))
    if results["order"]:
        parts.append(_order(results["order"]))
    if results["switching"]:
        about = results["switching"]
        title = f"### Switching a law, {about['n']:,} bodies"
        parts.append("\n".join([title, "", *_verdicts(about["verdicts"])]))
    if results["starts"]:
        parts.append(_starts(results["starts"]))
    return "\n\n".join(parts) + "\n"


def _head(results: dict[str, Any]) -> str:
    machine, fixed = results["machine"], results["calibration"]
    return (
        f"Machine: {machine['cores']} ({machine['processor']}), Python {machine['python']}, NumPy {machine['numpy']}, numba {machine['numba']}. "
        f"CPU time, medians of {results['samples']}, in turns. "
        f"The fixed loop took {1e3 * fixed['python']:.1f} ms (Python) and {1e3 * fixed['numpy']:.1f} ms (NumPy). "
        f"The law of the pack outside has {results['pack lines']} lines (at most 7)."
        + ("" if results["loop"] else " This engine has NO compiled loop: nothing here speaks for one.")
        + (" A QUICK run: for seeing that all works, not for comparing." if results["quick"] else "")
    )


def _table(names: list[str], rows: list[list[str]]) -> list[str]:
    return [f"| {' | '.join(names)} |", "|" + " --- |" * len(names), *(f"| {' | '.join(row)} |" for row in rows)]


def _met(met: bool | None) -> str:
    return {None: "", True: "met", False: "**missed**"}[met]


def _scene(title: str, found: list[dict[str, Any]]) -> str:
    drifts = "drift" in found[0]["rows"][0]
    names = [
        "bodies",
        "tier",
        "who",
        f"ns a {found[0]['unit']} and step",
        "CPU time a step",
        "ours over it",
        "bar",
        "",
        "error [m]",
    ]
    names += ["energy drift"] if drifts else []
    rows = []
    for one in found:
        for row in one["rows"]:
            ours, decides = row["engine"] == OURS, row["engine"] == one["against"] and one["bar"] is not None
            cells = [f"{one['n']:,}", one["tier"], row["engine"], f"{row['ns']:.2f}", _seconds(row["seconds"])]
            cells += ["" if ours else f"{row['ratio']:.2f}"]
            cells += [f"{one['bar']:g}", _met(one["met"])] if decides else ["", ""]
            cells += [_number(row["error"])] + ([_number(row["drift"])] if drifts else [])
            rows.append(cells)
    first = found[0]
    after = f"Error: of the worst body after {SPAN} steps of 1/{round(1 / first['dt'])} s, against DOP853 at 1e-13."
    if drifts:
        after += f" Energy drift: relative, at the end of all turns ({first['steps']:,} steps each)."
    if first["timed_dt"] != first["dt"]:
        after += f" Timed with steps of 1/{round(1 / first['timed_dt'])} s, so that nothing comes to rest."
    ran = "; ".join(
        f"{one['n']:,}, {one['tier']}: " + ", ".join(f"{count} x {tier}" for tier, count in one["tiers"].items())
        for one in found
    )
    paid = "; ".join(
        f"{one['n']:,}, {one['tier']}: {_seconds(one['rows'][0]['built'])}, {_seconds(one['rows'][0]['first'])}"
        for one in found
    )
    after += (
        f" Where our laws ran, as `explain` says: {ran}. "
        f"Paid once, on the clock, to build and for the first step (plan, trace, compile or load): {paid}."
    )
    return "\n".join([f"### {title[0].upper()}{title[1:]}", "", *_table(names, rows), "", after])


def _order(found: list[dict[str, Any]]) -> str:
    rows = []
    for one in found:
        for name, told in one["found"].items():
            cells = [one["scene"], f"{one['n']:,}", one["tier"], name, *(_number(error) for error in told["errors"])]
            rows.append([*cells, f"{told['order']:.2f}"])
    names = ["scene", "bodies", "tier", "who", "error at dt [m]", "dt/2", "dt/4", "order"]
    return "\n".join(["### Error against the step", "", *_table(names, rows)])


def _verdicts(found: list[dict[str, Any]]) -> list[str]:
    rows = []
    for one in found:
        unit = " times" if one["unit"] == "times" else " s"
        value = (
            f"{one['value']:.2f}{unit}" if unit == " times" or one["value"] >= 0.1 else _seconds(max(one["value"], 0.0))
        )
        bar = "" if one["bar"] is None else f"{one['bar']:g}{unit}"
        rows.append([one["what"], value, bar, _met(one["met"]), one["note"]])
    return _table(["what", "found", "bar", "", "note"], rows)


def _starts(found: dict[str, Any]) -> str:
    rows = []
    for name, row in found["rows"].items():
        loaded = ", ".join(module for module in ("numba", "llvmlite") if row.get(module)) or (
            "none" if "numba" in row else "-"
        )
        rows.append(
            [name, f"{row['clock']:.2f} s", f"{row['cpu']:.2f} s", loaded, ", ".join(row.get("tiers", [])) or "-"]
        )
    same = "the same" if found["same bits"] else "**not the same**"
    return "\n".join(
        [
            "### Processes, start to end",
            "",
            *_verdicts(found["verdicts"]),
            "",
            f"Gravity, drag and wind on {found['n']:,} objects, {found['steps']} steps, in a home folder of its own; "
            f"cold and warm end in {same} bits. "
            "Medians on the clock; in detail:",
            "",
            *_table(["process", "clock", "CPU time", "of numba and llvmlite, imported", "laws ran"], rows),
        ]
    )


def missed(results: dict[str, Any]) -> list[str]:
    """Every bar that was missed."""
    said = [
        f"{one['scene']}, {one['n']:,}, {one['tier']}: {one['ratio']:.2f} x {one['against']}, bar {one['bar']:g}"
        for one in results["groups"]
        if one["met"] is False
    ]
    for part in ("switching", "starts"):
        said += [
            f"{one['what']}: {one['value']:.3g}, bar {one['bar']:g}"
            for one in (results[part] or {}).get("verdicts", ())
            if one["met"] is False
        ]
    return said


def put_into_page(text: str, page: Path) -> None:
    """Replace what stands between the two marks of the page."""
    before, _, rest = page.read_text(encoding="utf-8").partition(BEGIN)
    _, _, after = rest.partition(END)
    page.write_text(f"{before}{BEGIN}\n\n{text}\n{END}{after}", encoding="utf-8")
