"""Who stands on the front: a point is on it if no other is both faster and more accurate. And whether a bar is met.

A row is what `benchmarks.measure.Row.plain` gives; one without a time or an error is nowhere.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from benchmarks.problem import Bar

Row = dict[str, Any]
ROUNDING = 1e-17  # errors below are the same


class Standing(NamedTuple):
    """A point of ours beside the peers: those that are both faster and more accurate, and the fastest that is no less accurate."""

    row: Row
    beaten_by: list[Row]
    rival: Row | None

    @property
    def ahead(self) -> float:
        """How many times faster it is than the fastest peer of no larger error; infinite if there is none."""
        return math.inf if self.rival is None else self.rival["seconds"] / self.row["seconds"]


class Verdict(NamedTuple):
    """A bar, and what was found; ``met`` is None if it could not be told."""

    text: str
    found: str
    met: bool | None


def counted(rows: Sequence[Row]) -> list[Row]:
    """The rows that have a time and a finite error."""
    return [
        row for row in rows if row["seconds"] is not None and row["error"] is not None and math.isfinite(row["error"])
    ]


def is_ours(row: Row) -> bool:
    """Whether it is a row of xPheve."""
    return bool(row["more"].get("ours"))


def is_aside(row: Row) -> bool:
    """Whether it is no engine, but something to measure by: it counts where a bar names it, and on no front."""
    return bool(row["more"].get("aside"))


def error(row: Row) -> float:
    """Its error; 0 counts as the least that can be told."""
    return max(float(row["error"]), ROUNDING)


def front(rows: Sequence[Row]) -> list[Row]:
    """The rows that no other beats in time and error together, fastest first."""
    found: list[Row] = []
    for row in sorted(
        (row for row in counted(rows) if not is_aside(row)), key=lambda row: (row["seconds"], error(row))
    ):
        if not found or error(row) < error(found[-1]):
            found.append(row)
    return found


def standing(row: Row, peers: Sequence[Row]) -> Standing:
    """Where a point stands among ``peers``."""
    others = counted(peers)
    beaten = [one for one in others if one["seconds"] < row["seconds"] and error(one) < error(row)]
    as_good = [one for one in others if error(one) <= error(row)]
    rival = min(as_good, key=lambda one: one["seconds"]) if as_good else None
    return Standing(row, sorted(beaten, key=lambda one: one["seconds"]), rival)


def standings(rows: Sequence[Row]) -> list[Standing]:
    """Each of our points beside all peers."""
    peers = [row for row in rows if not is_ours(row) and not is_aside(row)]
    return [standing(row, peers) for row in counted(rows) if is_ours(row)]


def judge(bar: Bar, rows: Sequence[Row]) -> Verdict:
    """Whether ``bar`` is met by ``rows``."""
    mine = _chosen([row for row in rows if is_ours(row)], f"xPheve {bar.method}".rstrip(), bar.setting)
    if not mine:
        return Verdict(bar.text, "no such row of ours in this run", None)
    others = [row for row in rows if not is_ours(row) and (bar.peer or not is_aside(row))]
    peers = _chosen(others, bar.peer, bar.peer_setting)
    return JUDGES[bar.kind](bar, mine, peers)


def _chosen(rows: Sequence[Row], engine: str, setting: str) -> list[Row]:
    return [row for row in counted(rows) if row["engine"].startswith(engine) and row["setting"].startswith(setting)]


def _errors(bar: Bar, mine: list[Row], _: list[Row]) -> Verdict:
    worst = max(mine, key=error)
    return Verdict(bar.text, f"at most {worst['error']:.1e} ({name(worst)})", worst["error"] <= bar.error)


def _error(bar: Bar, mine: list[Row], _: list[Row]) -> Verdict:
    best = min(mine, key=error)
    return Verdict(bar.text, f"{best['error']:.1e} ({name(best)})", best["error"] <= bar.error)


def _drift(bar: Bar, mine: list[Row], _: list[Row]) -> Verdict:
    best = min(mine, key=lambda row: abs(row["drift"]))
    return Verdict(bar.text, f"{abs(best['drift']):.1e} ({name(best)})", abs(best["drift"]) <= bar.error)


def _value(bar: Bar, mine: list[Row], _: list[Row]) -> Verdict:
    worst = max(mine, key=lambda row: float(row["more"]["measures"][bar.key]))
    value = worst["more"]["measures"][bar.key]
    return Verdict(bar.text, f"at most {value:.1e} ({name(worst)})", value <= bar.ratio)


def _front(bar: Bar, mine: list[Row], peers: list[Row]) -> Verdict:
    exact = [row for row in mine if row["error"] <= bar.error]
    if not exact:
        best = min(mine, key=error)
        return Verdict(bar.text, f"least error {best['error']:.1e} ({name(best)})", False)
    if not peers:
        return Verdict(bar.text, "no peer in this run", None)
    if math.isinf(bar.error):  # the whole front is meant: each point of ours that matters
        return _whole_front(bar, front(mine), peers)
    best = max((standing(row, peers) for row in exact), key=lambda one: (not one.beaten_by, one.ahead))
    return Verdict(bar.text, _told(best), not best.beaten_by)


def _whole_front(bar: Bar, mine: list[Row], peers: list[Row]) -> Verdict:
    all_of_us = [standing(row, peers) for row in mine]
    behind = [one for one in all_of_us if one.beaten_by]
    if behind:
        worst = min(behind, key=lambda one: one.ahead)
        return Verdict(
            bar.text, f"{len(behind)} of {len(mine)} points of our front are behind, at worst: {_told(worst)}", False
        )
    nearest, finest, theirs = min(all_of_us, key=lambda one: one.ahead), mine[-1], min(peers, key=error)
    said = f"all {len(mine)} points of our front; the nearest to it: {_told(nearest)}"
    if error(theirs) < error(finest):
        said += f". Below our least error, {finest['error']:.1e}, is only the peer: {theirs['error']:.1e} in {seconds(theirs['seconds'])}"
    return Verdict(bar.text, said, True)


def _told(one: Standing) -> str:
    said = f"{one.row['error']:.1e} in {seconds(one.row['seconds'])} ({name(one.row)})"
    if one.rival is None:
        return f"{said}; no peer is as accurate"
    return f"{said}; the fastest peer that is as accurate takes {one.ahead:.2g} times as long ({name(one.rival)})"


def _ratio(bar: Bar, mine: list[Row], peers: list[Row]) -> Verdict:
    if not peers:
        return Verdict(bar.text, "no such peer in this run", None)
    rival = min(peers, key=(lambda row: (error(row), row["seconds"])) if bar.finest else (lambda row: row["seconds"]))
    limit = min(bar.error, error(rival)) if bar.no_larger else bar.error
    exact = [row for row in mine if error(row) <= limit]
    if not exact:
        best = min(mine, key=error)
        return Verdict(bar.text, f"least error {best['error']:.1e} ({name(best)}), wanted {limit:.1e}", False)
    best = min(exact, key=lambda row: row["seconds"])
    found = best["seconds"] / rival["seconds"]
    said = (
        f"{found:.2g} times the time of {name(rival)} ({rival['error']:.1e}), with {best['error']:.1e} ({name(best)})"
    )
    return Verdict(bar.text, said, found <= bar.ratio)


JUDGES = {
    "all errors": _errors,
    "error": _error,
    "drift": _drift,
    "value": _value,
    "front": _front,
    "ratio": _ratio,
}


def name(row: Row) -> str:
    """Engine and setting."""
    return f"{row['engine']}, {row['setting']}" if row["setting"] not in ("", "-") else str(row["engine"])


def seconds(value: float | None) -> str:
    """A time with its unit."""
    if value is None:
        return "-"
    return f"{1e6 * value:.1f} µs" if value < 1e-3 else f"{1e3 * value:.2f} ms" if value < 1 else f"{value:.2f} s"
