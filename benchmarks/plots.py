"""Run time against error, one picture a scene: a line a method, ours bold, the front of all as steps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.front import Row, counted, error, front, is_ours

SMALLEST = 1e-17  # where an error of 0 is drawn
OURS = {
    "adaptive": "#d00000",
    "kepler": "#7f0000",
    "linear": "#d00000",
    "implicit": "#ff006e",
    "closed form": "#d00000",
    "symplectic8": "#e85d04",
    "symplectic6": "#f48c06",
    "symplectic4": "#faa307",
    "midpoint": "#c08497",
}
PEERS = {
    "REBOUND ias15": "#1d4e89",
    "REBOUND whfast": "#0096c7",
    "REBOUND whfast corrector 17": "#48cae4",
    "REBOUND saba(10,6,4)": "#3a86ff",
    "REBOUND bs": "#2a9d8f",
    "REBOUND leapfrog2": "#90a4ae",
    "REBOUND leapfrog8": "#5e548e",
    "heyoka Taylor": "#2d6a4f",
    "SciPy DOP853": "#8d6e63",
    "SciPy Radau": "#5d4037",
    "SciPy LSODA": "#bcaaa4",
    "SciPy BDF": "#a1887f",
    "MuJoCo RK4": "#6a4c93",
    "MuJoCo tuned": "#6a4c93",
    "MuJoCo default": "#b392ac",
    "Rapier default": "#90be6d",
    "Rapier tuned": "#2d6a4f",
    "DART default": "#d4a373",
    "DART tuned": "#8d6e63",
    "plain loop by hand": "#000000",
    "MuJoCo Euler": "#b392ac",
    "PyBullet default": "#adb5bd",
    "PyBullet tuned": "#495057",
}
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
    curves: dict[str, list[Row]] = {}
    for row in shown:
        curves.setdefault(row["engine"], []).append(row)
    for name in [name for name, rows_of in curves.items() if is_ours(rows_of[0])]:
        _curve(
            panel,
            name,
            curves.pop(name),
            OURS.get(name.partition(" ")[2].partition(",")[0], "#9d0208"),
            "*",
            12,
            2.2,
            5,
        )
    for rank, (name, rows_of) in enumerate(curves.items()):
        _curve(panel, name, rows_of, PEERS.get(name, "#6c757d"), MARKS[rank % len(MARKS)], 5, 1.1, 3)
    panel.set(xscale="log", yscale="log", xlabel="CPU time [s]", ylabel=metric)
    panel.set_title(title, fontsize=10)
    panel.grid(alpha=0.25)
    panel.margins(0.08)
    _front(panel, shown)
    panel.yaxis.label.set_size(8)
    panel.legend(fontsize=7.5, loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
    figure.savefig(path, dpi=80, metadata={"Software": None})
    return True


def _curve(
    panel: Any, name: str, rows: list[Row], color: str, mark: str, size: float, width: float, order: int
) -> None:
    panel.plot(
        [row["seconds"] for row in rows],
        [max(error(row), SMALLEST) for row in rows],
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
    """What nobody beats, as steps from the upper to the right edge."""
    best = front(rows)
    if not best:
        return
    (left, right), (low, high) = panel.get_xlim(), panel.get_ylim()
    times, errors = [row["seconds"] for row in best], [max(error(row), SMALLEST) for row in best]
    panel.step(
        [times[0], *times, right],
        [high, *errors, errors[-1]],
        where="post",
        color="#adb5bd",
        lw=5,
        alpha=0.5,
        label="the front",
        zorder=1,
    )
    panel.set(xlim=(left, right), ylim=(low, high))


def draw_growth(title: str, curves: dict[str, list[list[float]]], path: Path) -> bool:
    """Rms of the error of energy over steps, with the slope of a random walk, as a PNG; False without matplotlib or curves."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        return False
    if not curves:
        return False
    figure = Figure(figsize=(8.6, 4.3), layout="constrained")
    panel = figure.subplots()
    for rank, (name, (steps, rms)) in enumerate(curves.items()):
        ours = name.startswith("xPheve")
        color = OURS.get(name.partition(" ")[2], "#9d0208") if ours else PEERS.get(name, "#6c757d")
        mark, size, width = ("*", 12, 2.2) if ours else (MARKS[rank % len(MARKS)], 5, 1.1)
        panel.plot(steps, rms, marker=mark, ms=size, lw=width, color=color, label=name)
    least, most = (pick(steps[k] for steps, _ in curves.values()) for pick, k in ((min, 0), (max, -1)))
    panel.plot([least, most], [1e-16, 1e-16 * (most / least) ** 0.5], "--", color="#6c757d", lw=1, label="slope 1/2")
    panel.set(xscale="log", yscale="log", xlabel="steps", ylabel="rms of the relative error of energy")
    panel.set_title(title, fontsize=10)
    panel.grid(alpha=0.25)
    panel.legend(fontsize=7.5, loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
    figure.savefig(path, dpi=80, metadata={"Software": None})
    return True
