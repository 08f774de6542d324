"""One picture of a record: where things went, and what became of the energy. The one door to matplotlib."""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from xpheve.errors import RecordError
from xpheve.record.frame import FloatArray
from xpheve.record.paths import aside, writable
from xpheve.record.picture import COLOURS, FIXED, WAY_OUT, evenly, is_plane, label_of, paths_of, plane_of, up_of
from xpheve.record.record import Record

_FRAMES = 2000  # points a line: more cannot be seen
_OBJECTS = 200  # lines: more hide one another
_LABELS = 8
_FLAT = 1e-3  # motion across a plane or a line, relative to that along it, that cannot be seen
_ASPECT = 1.25  # width by height of the axes
_RADII = 0.004  # of the picture: a sphere smaller than this is drawn as a dot


def plot(record: Record, path: str | os.PathLike[str]) -> Path:
    """Draw trajectories (against time, in a plane or in space, as the motion is) and energies; see ``Record.plot``."""
    target = writable(path)
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise RecordError(f"{target}: a plot needs matplotlib ({error}); {WAY_OUT}") from error

    figure = Figure(figsize=(12.8, 5.6), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    _Trajectories(record).draw(figure)
    _draw_energies(record, figure.add_subplot(1, 2, 2))
    count, span = len(record.objects), f", {record.time[0]:g} to {record.time[-1]:g} s" if len(record) else ""
    figure.suptitle(f"{count} object{'' if count == 1 else 's'}{span}, {len(record)} frames", fontsize=11, color="0.35")
    with aside(target) as beside, warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph", category=UserWarning)  # names in scripts the font lacks
        with open(beside, "wb") as file:
            figure.savefig(file, format="png")
    return target


class _Trajectories:
    """Which objects to draw, and in what kind of picture."""

    def __init__(self, record: Record) -> None:
        rows = record.objects
        moving = [row for row in rows if not row["fixed"] and not is_plane(row)]
        picked = moving
        if len(moving) > _OBJECTS:
            picked = [moving[k] for k in np.linspace(0, len(moving) - 1, _OBJECTS).astype(int)]
        self.moving, self.picked = moving, picked
        self.fixed = [row for row in rows if row["fixed"] and not is_plane(row)][:_OBJECTS]
        self.up = up_of(record)
        numbers = evenly(record, _FRAMES)
        serials = np.array([row["serial"] for row in [*picked, *self.fixed]], dtype=np.int64)
        both = paths_of(record, numbers, serials)
        self.paths, self.places = both[:, : len(picked)], both[:, len(picked) :]
        self.time = record.time[numbers]
        self.planes = [plane for row in rows if is_plane(row) if (plane := _last_plane(record, row, self.up))]
        fade = 0.9 if len(picked) <= 10 else max(0.25, 6.0 / len(picked) ** 0.6)
        self.style = {"linewidth": 1.6 if len(picked) <= 10 else 0.9, "alpha": fade}

    def draw(self, figure: Any) -> None:
        steps = self.paths - _first_known(self.paths)
        known = steps[np.isfinite(steps).all(axis=2)]
        lengths, directions = np.zeros(3), np.eye(3)
        if len(known):
            spread = known / (np.abs(known).max() or 1.0)
            squares, directions = np.linalg.eigh(spread.T @ spread)  # rising
            lengths = np.sqrt(np.maximum(squares, 0.0))
        if lengths[1] <= _FLAT * lengths[2]:
            along = directions[:, 2] if lengths[2] else self.up
            self._draw_line(figure.add_subplot(1, 2, 1), _towards(along, self.up))
            return
        normal = directions[:, 0]
        level, vertical = abs(normal @ self.up) > 1 - _FLAT**2, abs(normal @ self.up) < _FLAT
        if lengths[0] > _FLAT * lengths[2] or not (level or vertical):
            self._draw_space(figure.add_subplot(1, 2, 1, projection="3d"))
            return
        first, second = _level_axes(self.up)
        if vertical:
            first, second = _towards(np.cross(self.up, normal), first + 1e-3 * second), self.up
        self._draw_plane(figure.add_subplot(1, 2, 1), first, second)

    def _draw_line(self, axes: Any, along: FloatArray) -> None:
        """Motion on lines of one direction, against time."""
        for k in range(len(self.picked)):
            axes.plot(self.time, self.paths[:, k] @ along, color=_colour(k, len(self.picked)), **self.style)
        for point, normal in self.planes:
            if abs(normal @ along) > 1 - _FLAT:
                axes.axhline(float(point @ along), color="0.45", linewidth=1.2, zorder=0)
        axes.set(xlabel="time [s]", ylabel=f"{_called(along)} [m]")
        axes.grid(alpha=0.25)
        self._finish(axes)

    def _draw_plane(self, axes: Any, first: FloatArray, second: FloatArray) -> None:
        """Motion in one plane, seen at a right angle."""
        from matplotlib.patches import Circle

        view = np.stack([first, second], axis=1)
        flat = self.paths @ view
        span = float(np.nanmax(np.ptp(np.nan_to_num(flat, nan=float(np.nanmean(flat))), axis=(0, 1)))) or 1.0
        for k, row in enumerate(self.picked):
            colour = _colour(k, len(self.picked))
            axes.plot(flat[:, k, 0], flat[:, k, 1], color=colour, **self.style)
            known = flat[np.isfinite(flat[:, k]).all(axis=1), k]
            if len(known):
                _draw_end(axes, row, known[-1], colour, span, Circle, len(self.picked))
        for k, row in enumerate(self.fixed):
            known = (self.places @ view)[:, k]
            known = known[np.isfinite(known).all(axis=1)]
            if len(known):
                _draw_end(axes, row, known[-1], FIXED, span, Circle, 1)
        axes.set(xlabel=f"{_called(first)} [m]", ylabel=f"{_called(second)} [m]")
        lines = [(point @ view, normal @ view) for point, normal in self.planes]
        lines = [(foot, edge) for foot, edge in lines if np.linalg.norm(edge) > 1 - _FLAT]
        low, high = _limits(axes, [float(foot[1]) for foot, edge in lines if edge[1] > 1 - _FLAT])
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), autoscale_on=False)
        far = 4 * float((high - low).max())
        for foot, edge in lines:
            middle = (low + high) / 2
            centre, way = middle - ((middle - foot) @ edge) * edge, np.array([-edge[1], edge[0]])
            line = np.array([centre - far * way, centre + far * way])
            axes.plot(*line.T, color="0.45", linewidth=1.2, zorder=0)
            axes.fill(*np.vstack([line, line[::-1] - far * edge]).T, color="0.92", zorder=-1)
        axes.grid(alpha=0.25)
        self._finish(axes)

    def _draw_space(self, axes: Any) -> None:
        """Motion in space."""
        axes.set_proj_type("persp", focal_length=1.2)
        first, second = _level_axes(self.up)
        view = np.stack([first, second, self.up], axis=1)
        turned = self.paths @ view
        for k in range(len(self.picked)):
            colour = _colour(k, len(self.picked))
            axes.plot(*turned[:, k].T, color=colour, **self.style)
            known = turned[np.isfinite(turned[:, k]).all(axis=1), k]
            if len(known):
                axes.scatter(*known[-1:].T, color=colour, s=18 if len(self.picked) <= 50 else 5, depthshade=False)
        still = (self.places @ view)[-1:].reshape(-1, 3)
        axes.scatter(*still.T, color=FIXED, s=24)
        low, high = np.nanmin(turned, axis=(0, 1)), np.nanmax(turned, axis=(0, 1))
        for point, normal in self.planes:
            tilt = normal @ view
            if tilt[2] > 0.1:  # steeper ones would hide the picture
                low[2] = min(low[2], point @ view[:, 2]) if tilt[2] > 1 - _FLAT else low[2]
                x, y = np.meshgrid(np.linspace(low[0], high[0], 9), np.linspace(low[1], high[1], 9))
                foot = point @ view
                z = foot[2] - ((x - foot[0]) * tilt[0] + (y - foot[1]) * tilt[1]) / tilt[2]
                axes.plot_surface(x, y, z, color="0.8", alpha=0.25, edgecolor="0.6", linewidth=0.4, shade=False)
        box = np.maximum(high - low, 0.15 * (high - low).max())
        box[2] = max(box[2], 0.3 * box.max())
        axes.set_box_aspect(box / box.max(), zoom=0.92)
        axes.locator_params(nbins=5)
        axes.locator_params(axis="z", nbins=4)
        names = [_called(axis) for axis in (first, second, self.up)]
        axes.set(xlabel=f"{names[0]} [m]", ylabel=f"{names[1]} [m]", zlabel=f"{names[2]} [m]")
        axes.tick_params(labelsize=8)
        self._finish(axes)

    def _finish(self, axes: Any) -> None:
        some = f": {len(self.picked)} of {len(self.moving)} moving objects" if self.picked != self.moving else ""
        axes.set_title(f"trajectories{some}", fontsize=11)
        if not self.picked:
            axes.text(0.5, 0.5, "nothing that could move", transform=axes.transAxes, ha="center", color="0.4")
            return
        from matplotlib.lines import Line2D

        count = len(self.picked)
        which = list(range(count)) if count <= _LABELS else np.linspace(0, count - 1, _LABELS - 1).astype(int).tolist()
        shown = [label_of(self.picked[k]) for k in which]
        lines = [Line2D([], [], color=_colour(k, count), linewidth=2) for k in which]
        if len(shown) < count:
            shown.append(f"and {len(self.moving) - len(shown)} more")
            lines.append(Line2D([], [], linestyle="none"))
        corner = "upper left" if axes.name == "3d" else "upper right"
        # Placeholders, as a legend leaves out names with a leading underscore and reads $ as mathematics.
        legend = axes.legend(lines, [str(k) for k in range(len(lines))], fontsize=8, loc=corner, framealpha=0.8)
        for text, name in zip(legend.get_texts(), shown, strict=True):
            text.set_parse_math(False)
            text.set_text(name)


def _draw_energies(record: Record, axes: Any) -> None:
    energy = record.energy
    numbers = evenly(record, _FRAMES)
    axes.set(xlabel="time [s]", ylabel="energy [J]")
    if not np.isfinite(energy).any():
        axes.set_title("energy", fontsize=11)
        axes.set(xticks=[], yticks=[], xlabel="", ylabel="")
        axes.text(0.5, 0.5, "energies are not known", transform=axes.transAxes, ha="center", color="0.4")
        return
    kinetic, potential, work = energy[numbers].T
    axes.plot(record.time[numbers], kinetic, color=COLOURS[0], label="kinetic", linewidth=1.3)
    axes.plot(record.time[numbers], potential, color=COLOURS[1], label="potential", linewidth=1.3)
    total = kinetic + potential - work
    axes.plot(record.time[numbers], total, color=COLOURS[2], label="total - work", linewidth=2.2)
    axes.grid(alpha=0.25)
    drift = record.energy_drift
    axes.set_title("energy" if np.isnan(drift) else f"energy, drift {drift:.1e}", fontsize=11)
    axes.legend(fontsize=8, loc="best", framealpha=0.8)


def _limits(axes: Any, floors: list[float]) -> tuple[FloatArray, FloatArray]:
    """Corners of what to show: all that is drawn, in true proportions unless that would leave a sliver."""
    axes.autoscale_view()
    data = axes.dataLim
    low, high = np.array([data.x0, data.y0]), np.array([data.x1, data.y1])
    size = np.maximum(high - low, 1e-3 * float((high - low).max()) or 1.0)
    low, high = low - 0.08 * size, high + 0.08 * size
    below = [floor for floor in floors if floor < high[1] and floor > low[1] - 3 * size[1]]
    if below:
        low[1] = min(low[1], min(below) - 0.12 * size[1])
    size = high - low
    if size.min() < size.max() / 8:
        return low, high
    axes.set_aspect("equal", adjustable="box")
    if size[0] < _ASPECT * size[1]:
        more = (_ASPECT * size[1] - size[0]) / 2
        aside = np.array([more, 0.0])
        return low - aside, high + aside
    more = size[0] / _ASPECT - size[1]
    share = 0.15 if below else 0.5  # a floor stays near the foot of the picture
    return low - np.array([0.0, share * more]), high + np.array([0.0, (1 - share) * more])


def _draw_end(
    axes: Any, row: dict[str, Any], at: FloatArray, colour: str, span: float, circle: Any, count: int
) -> None:
    """Where an object ended, at its size if that can be seen."""
    radius = float((row["shape"] or {}).get("radius", 0.0)) if (row["shape"] or {}).get("kind") == "sphere" else 0.0
    if radius > _RADII * span:
        axes.add_patch(circle((at[0], at[1]), radius, facecolor=colour, alpha=0.35, edgecolor=colour, zorder=3))
    else:
        axes.plot(*at, marker="o", markersize=5 if count <= 50 else 2.5, color=colour, zorder=3)


def _last_plane(record: Record, row: dict[str, Any], up: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    track = record[row["serial"]]
    if not len(track):
        return None
    frame = record.frame(int(track.frame_numbers[-1]))
    at = int(np.searchsorted(frame.serial, row["serial"]))
    return plane_of(row, frame.position[at], frame.orientation[at], up)


def _first_known(paths: FloatArray) -> FloatArray:
    """First known position of each object, shape (objects, 3)."""
    if not len(paths):
        return np.zeros((paths.shape[1], 3))
    first = np.argmax(np.isfinite(paths).all(axis=2), axis=0)
    return np.asarray(np.take_along_axis(paths, first[None, :, None], axis=0)[0])


def _level_axes(up: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two world axes, or near them, that span the ground; with ``up`` they are right-handed."""
    first = np.eye(3)[0] if abs(up[0]) < 0.9 else np.eye(3)[1]
    first = first - (first @ up) * up
    first /= np.linalg.norm(first)
    return first, np.cross(up, first)


def _towards(direction: FloatArray, other: FloatArray) -> FloatArray:
    """``direction`` or its opposite, whichever is nearer to ``other``; world axes to the bit."""
    chosen = direction if direction @ other >= 0 else -direction
    chosen = np.where(np.abs(chosen) < _FLAT, 0.0, chosen)
    return np.asarray(chosen / np.linalg.norm(chosen))


def _called(direction: FloatArray) -> str:
    for sign in (1.0, -1.0):
        for axis, name in enumerate("xyz"):
            if sign * direction[axis] > 1 - _FLAT**2:
                return name if sign > 0 else f"-{name}"
    return "along ({:.2g}, {:.2g}, {:.2g})".format(*direction)


def _colour(k: int, count: int) -> Any:
    if count <= len(COLOURS):
        return COLOURS[k]
    from matplotlib import colormaps

    return colormaps["viridis"](0.92 * k / (count - 1))
