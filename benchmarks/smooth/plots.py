"""Run time against error, one picture a scene: a line a method, ours bold, the front of all as steps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.smooth.front import Row, counted, error, front, is_ours

SMALLEST = 1e-17  # where an error of 0 is drawn
OURS = ("#c1121f", "#e85d04", "#9d0208", "#ff8fa3", "#6a040f")
PEERS = (
    "#1d4e89",
    "#2a9d8f",
    "#6c757d",
    "#7b2cbf",
    "#588157",
    "#0096c7",
    "#8d6e63",
    "#495057",
    "#b5838d",
    "#3a5a40",
    "#5e548e",
)
MARKS = "osv^D<>phX"


def draw(title: str, metric: str, rows: list[Row], path: Path) -> bool:
    """The picture as a PNG of at most 60 kB; False without matplotlib, or if there is nothing to show."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        return False
    shown = counted(rows)
    if not shown:
        return False
    figure = Figure(figsize=(8.6, 4.3), layout="constrained")
    panel = figure.subplots()
    _front(panel, shown)
    curves: dict[str, list[Row]] = {}
    for row in shown:
        curves.setdefault(row["engine"], []).append(row)
    for rank, ours in enumerate(
        sorted({name for name, all_of in curves.items() if is_ours(all_of[0])}, key=list(curves).index)
    ):
        _curve(panel, ours, curves[ours], OURS[rank % len(OURS)], "*", 12, 2.2, 5)
    others = [name for name, all_of in curves.items() if not is_ours(all_of[0])]
    for rank, name in enumerate(others):
        _curve(panel, name, curves[name], PEERS[rank % len(PEERS)], MARKS[rank % len(MARKS)], 5, 1.1, 3)
    panel.set(xscale="log", yscale="log", xlabel="CPU time [s]", ylabel=metric)
    panel.set_title(title, fontsize=10)
    panel.grid(alpha=0.25)
    panel.margins(0.06)
    panel.yaxis.label.set_size(8)
    panel.legend(fontsize=7.5, loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
    figure.savefig(path, dpi=80, metadata={"Software": None})
    return True


def _curve(
    panel: Any, name: str, rows: list[Row], color: str, mark: str, size: float, width: float, order: int
) -> None:
    points = sorted((max(error(row), SMALLEST), row["seconds"]) for row in rows)
    panel.plot(
        [t for _, t in points],
        [e for e, _ in points],
        marker=mark,
        ms=size,
        lw=width,
        color=color,
        label=name,
        zorder=order,
        mec="white" if mark == "*" else color,
        mew=0.6,
    )


def _front(panel: Any, rows: list[Row]) -> None:
    best = front(rows)
    panel.step(
        [row["seconds"] for row in best],
        [max(error(row), SMALLEST) for row in best],
        where="post",
        color="#adb5bd",
        lw=5,
        alpha=0.5,
        label="the front",
        zorder=1,
        solid_capstyle="round",
    )
