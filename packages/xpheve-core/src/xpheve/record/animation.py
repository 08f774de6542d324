"""Moving pictures of a record.

The line of sight of every pixel is intersected with the shapes, so that what is in front is in front.
"""

from __future__ import annotations

import base64
import io
import os
from collections.abc import Iterator
from html import escape
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from xpheve.errors import RecordError
from xpheve.record.frame import FloatArray, Frame
from xpheve.record.paths import aside, writable
from xpheve.record.picture import COLOURS, FIXED, WAY_OUT, evenly, is_plane, matrix_of, paths_of, plane_of, up_of
from xpheve.record.rays import hit_of, reach_of
from xpheve.record.record import Record

_FINE = 2  # rays a pixel, along each axis; smooths edges
_DOT = 2.5  # [pixels] least radius drawn, and that of objects without shape
_TURN, _RISE = np.radians(20.0), np.radians(17.0)  # of the camera off the plane of most motion, and above the ground
_SMALL = 4.0  # [pixels] radius up to which a body of any shape is drawn as a sphere
_SHADOWS = 1000  # bodies; with more, shadows cost more than they tell
_TRAILS = 60  # moving objects; with more, trails hide the scene
_SECONDS = (2.0, 12.0)  # an animation takes as long as the run, within these
_PAPER = np.array([250.0, 250.0, 252.0])
_GROUND = np.array([232.0, 233.0, 236.0])


def animate(
    record: Record, path: str | os.PathLike[str], *, frames: int = 120, size: tuple[int, int] = (640, 480)
) -> Path:
    """Draw the motion into a GIF or an HTML page; see ``Record.animate``."""
    target = writable(path)
    kind = target.suffix.lower()
    if kind not in (".gif", ".html"):
        raise RecordError(f"{target}: animations are written as .gif or .html")
    if frames < 1 or min(size) < 16 or max(size) > 4096:
        asked = f"frames = {frames}, size = {size}"
        raise RecordError(f"{target}: {asked}: at least one frame, of 16 to 4096 pixels a side")
    if not len(record):
        raise RecordError(f"{target}: the record has no frames to show")
    try:
        from PIL import Image, ImageDraw, ImageFont
    except ImportError as error:
        raise RecordError(f"{target}: an animation needs pillow ({error}); {WAY_OUT}") from error

    numbers = evenly(record, frames)
    scene = _Scene(record, numbers, size)
    pictures = [_labelled(pixels, time, Image, ImageDraw, ImageFont) for time, pixels in scene.pictures()]
    duration = float(np.clip(record.time[-1] - record.time[0], *_SECONDS))
    milliseconds = max(20, 10 * round(100 * duration / max(len(pictures) - 1, 1)))  # GIF counts hundredths
    few = _with_few_colours(pictures, Image)
    with aside(target) as beside:
        if kind == ".gif":
            few[0].save(
                beside, save_all=True, append_images=few[1:], duration=milliseconds, loop=0, disposal=1, optimize=False
            )
        else:
            times = [float(record.time[number]) for number in numbers]
            beside.write_text(_page(few, times, milliseconds, target.stem), encoding="utf-8")
    return target


class _Scene:
    """The camera, which sees all of the motion, and what stands before it."""

    def __init__(self, record: Record, numbers: list[int], size: tuple[int, int]) -> None:
        self.record, self.numbers = record, numbers
        self.rows = {int(row["serial"]): row for row in record.objects}
        self.up = up_of(record)
        self.width, self.height = size[0] * _FINE, size[1] * _FINE
        bodies = [row for row in record.objects if not is_plane(row)]
        moving = [row for row in bodies if not row["fixed"]]
        serials = np.array([row["serial"] for row in bodies], dtype=np.int64)
        self.paths = paths_of(record, numbers, serials)
        known = np.isfinite(self.paths).all(axis=2)
        points = self.paths[known] if known.any() else np.zeros((1, 3))
        reach = np.broadcast_to(np.array([reach_of(row["shape"]) for row in bodies]), known.shape)[known]
        if not len(reach):
            reach = np.ones(1)
        self.right, self.top, self.towards = _camera(points, self.up)
        flat = points @ np.stack([self.right, self.top], axis=1)
        low, high = (flat - reach[:, None]).min(axis=0), (flat + reach[:, None]).max(axis=0)
        middle, extent = (low + high) / 2, np.maximum(high - low, 1e-12 + 1e-3 * float(np.max(high - low)))
        room = np.array([self.width * 0.9, self.height * 0.82])
        self.scale = float((room / extent).min())  # pixels a metre
        self.centre = np.stack([self.right, self.top], axis=1) @ middle
        self.middle = points.mean(axis=0)
        self.extent = float(np.linalg.norm([self.width, self.height])) / self.scale
        self.colours = _colours(bodies)
        self.trails = [k for k, row in enumerate(bodies) if not row["fixed"]] if len(moving) <= _TRAILS else []
        self.serials = serials
        columns = (np.arange(self.width) + 0.5 - self.width / 2) / self.scale
        lines = (self.height / 2 - np.arange(self.height) - 0.5) / self.scale
        self.columns, self.lines = columns, lines
        light = self.up + 0.6 * self.towards - 0.5 * self.right
        self.light = light / np.linalg.norm(light)
        self._ground: tuple[Any, Any] = (None, None)
        self._traced = 0

    def pictures(self) -> Iterator[tuple[float, Any]]:
        """Time [s] and pixels, shape (height, width, 3), of each frame."""
        for k, frame in enumerate(self.record.frames(self.numbers)):
            image = self._draw(frame, k)
            coarse = sum(image[i::_FINE, j::_FINE] for i in range(_FINE) for j in range(_FINE)) / _FINE**2
            yield frame.time, np.clip(coarse + 0.5, 0, 255).astype(np.uint8)

    def _draw(self, frame: Frame, k: int) -> Any:
        alive = [
            (self.rows[int(serial)], frame.position[j], matrix_of(frame.orientation[j]), frame.orientation[j])
            for j, serial in enumerate(frame.serial)
            if np.isfinite(frame.position[j]).all() and np.isfinite(frame.orientation[j]).all()
        ]
        planes = [plane_of(row, at, q, self.up) for row, at, _, q in alive if is_plane(row)]
        image, depth = self._background(planes, k)
        bodies = [(row, at, turn) for row, at, turn, _ in alive if not is_plane(row)]
        for plane in planes if len(bodies) <= _SHADOWS else ():
            self._shade(image, depth, plane, bodies)
        small = [reach_of(row["shape"]) * self.scale <= _SMALL * _FINE for row, _, _ in bodies]
        for (row, at, turn), is_small in zip(bodies, small, strict=True):
            if not is_small:
                self._put(image, depth, row, at, turn)
        self._put_small(image, depth, [body for body, is_small in zip(bodies, small, strict=True) if is_small])
        return image

    def _background(self, planes: list[tuple[FloatArray, FloatArray]], k: int) -> tuple[Any, Any]:
        """Paper, planes as grids, and trails up to frame ``k``; kept while the planes stay where they are."""
        key = [plane.tobytes() for pair in planes for plane in pair]
        if self._ground[0] != key:
            image = np.broadcast_to(_PAPER, (self.height, self.width, 3)).astype(np.float32)
            depth = np.full((self.height, self.width), -np.inf, dtype=np.float64)
            for point, normal in planes:
                self._rule(image, depth, point, normal)
            self._ground = (key, (image, depth))
            self._traced = 0
        image, depth = self._ground[1]
        self._trace(image, self._traced, k)
        self._traced = k
        return image.copy(), depth.copy()

    def _rule(self, image: Any, depth: Any, point: FloatArray, normal: FloatArray) -> None:
        """Draw a plane as a grid that fades into the paper; from behind, as if of glass."""
        facing = float(normal @ self.towards)
        if abs(facing) < 0.02:
            return
        where, far = self._hits(point, normal, slice(None), slice(None))
        first = self.right - (self.right @ normal) * normal
        first = first / np.linalg.norm(first) if np.linalg.norm(first) > 1e-6 else np.cross(normal, self.up)
        if np.linalg.norm(np.cross(normal, self.up)) < 1e-6:  # the ground is ruled along the axes of the world
            axis = np.eye(3)[int(np.argmin(np.abs(normal)))]
            first = axis - (axis @ normal) * normal
            first /= np.linalg.norm(first)
        second = np.cross(normal, first)
        spacing = _nice(self.extent / 12)
        pixel = 0.75 * _FINE / self.scale
        line = np.zeros(far.shape, dtype=bool)
        for axis in (first, second):
            along = where @ axis
            slope = max(float(np.linalg.norm([axis @ self.right, axis @ self.top])), 0.05)
            line |= np.abs(along - spacing * np.round(along / spacing)) < pixel / max(slope, 0.3) * 0.6
        away = np.linalg.norm(where - self.middle, axis=2) / (0.62 * self.extent)
        fade = np.clip(1.6 - 1.6 * away, 0.0, 1.0)[..., None]
        ground = np.where(line[..., None], _GROUND - 38.0, _GROUND)
        fade = fade if facing > 0 else fade * 0.35
        seen = far > depth
        image[seen] = (image * (1 - fade) + ground * fade)[seen]
        if facing > 0:
            depth[seen] = far[seen] - 1e-9 * self.extent

    def _hits(self, point: FloatArray, normal: FloatArray, rows: slice, columns: slice) -> tuple[Any, Any]:
        """Where lines of sight meet a plane, shape (h, w, 3), and how near to the eye that is."""
        x, y = self.columns[columns][None, :, None], self.lines[rows][:, None, None]
        start = self.centre + x * self.right + y * self.top
        far = ((point - start) @ normal) / float(normal @ self.towards)
        return start + far[..., None] * self.towards, far

    def _shade(self, image: Any, depth: Any, plane: tuple[FloatArray, FloatArray], bodies: list[Any]) -> None:
        """Shadows straight down on what is nearly level ground, which tell how high things are."""
        point, normal = plane
        if normal @ self.up < 0.7 or normal @ self.towards < 0.02:
            return
        for row, at, turn in bodies:
            height = float((at - point) @ normal) / float(normal @ self.up)
            if height < 0:
                continue
            reach = max(reach_of(row["shape"]), _DOT * _FINE / self.scale)
            foot = at - height * self.up
            rows, columns = self._window(foot, reach * 1.5)
            if rows.start >= rows.stop or columns.start >= columns.stop:
                continue
            where, far = self._hits(point, normal, rows, columns)
            hit, _ = hit_of(row["shape"], reach)((where - at) @ turn, self.up @ turn)
            dark = np.isfinite(hit) & (np.abs(far - depth[rows, columns]) < 1e-6 * self.extent)
            image[rows, columns][dark] *= 0.80

    def _trace(self, image: Any, first: int, last: int) -> None:
        """Where moving objects have been between two frames."""
        view = np.stack([self.right, -self.top], axis=1) * self.scale
        middle = np.array([self.width / 2, self.height / 2])
        for j in self.trails:
            dots = (self.paths[first : last + 1, j] - self.centre) @ view + middle
            colour = np.array(self.colours[int(self.serials[j])])
            for start, end in pairwise(dots):
                if not (np.isfinite(start).all() and np.isfinite(end).all()):
                    continue
                steps = int(min(np.abs(end - start).max(), 4000)) + 1
                x, y = (start + (end - start) * (np.arange(steps) / steps)[:, None]).astype(int).T
                for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
                    inside = (x + dx >= 0) & (x + dx < self.width) & (y + dy >= 0) & (y + dy < self.height)
                    at = (y[inside] + dy, x[inside] + dx)
                    image[at] = 0.5 * image[at] + 0.5 * (0.6 * colour + 0.4 * 255.0)

    def _put(self, image: Any, depth: Any, row: dict[str, Any], at: FloatArray, turn: FloatArray) -> None:
        """Draw one body where it is in front."""
        least = _DOT * _FINE / self.scale
        reach = max(reach_of(row["shape"]), least)
        rows, columns = self._window(at, reach)
        if rows.start >= rows.stop or columns.start >= columns.stop:
            return
        x, y = self.columns[columns][None, :, None], self.lines[rows][:, None, None]
        start = self.centre + x * self.right + y * self.top
        start = start + (float(at @ self.towards) + 2 * reach - start @ self.towards)[..., None] * self.towards
        hit, normal = hit_of(row["shape"], least)((start - at) @ turn, -self.towards @ turn)
        near = (start @ self.towards) - hit
        seen = np.isfinite(hit) & (near > depth[rows, columns])
        if not seen.any():
            return
        outward = normal[seen] @ turn.T
        bright = 0.52 + 0.48 * np.clip(outward @ self.light, 0.0, 1.0)
        colour = np.broadcast_to(self.colours[int(row["serial"])], (int(seen.sum()), 3))
        if (row["shape"] or {}).get("kind") == "sphere" and reach * self.scale > 6 * _FINE:
            stripe = np.abs(normal[seen][:, :1]) < 0.16  # about the body's x axis, so that turning shows
            colour = np.where(stripe, 0.45 * colour + 0.55 * 255.0, colour)
        shine = 70.0 * np.clip(outward @ _halfway(self.light, self.towards), 0.0, 1.0) ** 24
        image[rows, columns][seen] = np.minimum(colour * bright[:, None] + shine[:, None], 255.0)
        depth[rows, columns][seen] = near[seen]

    def _put_small(self, image: Any, depth: Any, bodies: list[tuple[dict[str, Any], FloatArray, FloatArray]]) -> None:
        """Draw what is a few pixels wide, all at once, as spheres."""
        if not bodies:
            return
        at = np.array([at for _, at, _ in bodies]) - self.centre
        radius = np.maximum([reach_of(row["shape"]) * self.scale for row, _, _ in bodies], _DOT * _FINE).round()
        colour = np.array([self.colours[int(row["serial"])] for row, _, _ in bodies], dtype=np.float64)
        near = (at + self.centre) @ self.towards
        order = np.argsort(near, kind="stable")  # of those on one pixel, the last written is the nearest
        at, radius, colour, near = at[order], radius[order], colour[order], near[order]
        x = np.clip(at @ self.right * self.scale + self.width / 2, -1e7, 1e7).astype(int)
        y = np.clip(self.height / 2 - at @ self.top * self.scale, -1e7, 1e7).astype(int)
        for size in np.unique(radius):
            reach = int(size)
            for dy in range(-reach, reach + 1):
                for dx in range(-reach, reach + 1):
                    rise = size * size - dx * dx - dy * dy
                    if rise < 0:
                        continue
                    bulge = np.sqrt(rise)
                    outward = (dx * self.right - dy * self.top + bulge * self.towards) / size
                    bright = 0.52 + 0.48 * max(float(outward @ self.light), 0.0)
                    i, j = x + dx, y + dy
                    seen = (radius == size) & (i >= 0) & (i < self.width) & (j >= 0) & (j < self.height)
                    i, j = i[seen], j[seen]
                    high = near[seen] + bulge / self.scale
                    front = high > depth[j, i]
                    image[j[front], i[front]] = colour[seen][front] * bright
                    depth[j[front], i[front]] = high[front]

    def _window(self, at: FloatArray, reach: float) -> tuple[slice, slice]:
        """Pixels that may see what is within ``reach`` of a point."""
        x = (float((at - self.centre) @ self.right) * self.scale) + self.width / 2
        y = self.height / 2 - float((at - self.centre) @ self.top) * self.scale
        half = reach * self.scale + 1
        x, y = float(np.clip(x, -1e7, 1e7)), float(np.clip(y, -1e7, 1e7))
        half = min(half, 1e7)
        rows = slice(max(int(y - half), 0), min(int(y + half) + 1, self.height))
        return rows, slice(max(int(x - half), 0), min(int(x + half) + 1, self.width))


def _camera(points: FloatArray, up: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Right, top and towards the eye: across the way of most motion, and a little above it."""
    start = np.eye(3)[0] if abs(up[0]) < 0.9 else np.eye(3)[1]
    first = start - (start @ up) * up
    first /= np.linalg.norm(first)
    second = np.cross(up, first)
    level = (points - points.mean(axis=0)) @ np.stack([first, second], axis=1)
    level = level / (np.abs(level).max() or 1.0)
    squares, ways = np.linalg.eigh(level.T @ level)
    if squares[1] > 1.5 * squares[0]:  # otherwise no way stands out
        way = ways[:, 1] * (1.0 if ways[0, 1] > 0 or (ways[0, 1] == 0 and ways[1, 1] > 0) else -1.0)
        first = way[0] * first + way[1] * second
    back = np.cross(first, up)
    eye = np.cos(_TURN) * back + np.sin(_TURN) * first
    rise = _RISE if np.ptp(points @ up) > 0.05 * np.abs(level).max() else 2.2 * _RISE
    towards = np.cos(rise) * eye + np.sin(rise) * up
    right = np.cross(up, towards)
    right /= np.linalg.norm(right)
    return right, np.cross(towards, right), towards


def _colours(bodies: list[dict[str, Any]]) -> dict[int, tuple[int, int, int]]:
    """Red, green, blue of each serial; what is fixed is grey."""
    colours, moving = {}, 0
    for row in bodies:
        code = FIXED if row["fixed"] else COLOURS[moving % len(COLOURS)]
        moving += not row["fixed"]
        colours[int(row["serial"])] = (int(code[1:3], 16), int(code[3:5], 16), int(code[5:7], 16))
    return colours


def _halfway(one: FloatArray, other: FloatArray) -> FloatArray:
    middle = one + other
    return np.asarray(middle / np.linalg.norm(middle))


def _nice(length: float) -> float:
    """1, 2 or 5 times a power of ten, not below ``length``."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(power * next(step for step in (1, 2, 5, 10) if step * power >= length * (1 - 1e-9)))


def _labelled(pixels: Any, time: float, image: Any, draw: Any, font: Any) -> Any:
    picture = image.fromarray(pixels)
    height = max(10, min(pixels.shape[:2]) // 32)
    place, ink = (0.8 * height, 0.6 * height), (70, 70, 75)
    draw.Draw(picture).text(place, f"{time:.3f} s", fill=ink, font=font.load_default(height))
    return picture


def _with_few_colours(pictures: list[Any], image: Any) -> list[Any]:
    """Put the pictures on one palette of 256, so that what rests stays the same to the pixel and costs nothing."""
    few = [pictures[k] for k in sorted({0, len(pictures) // 3, 2 * len(pictures) // 3, len(pictures) - 1})]
    width, height = few[0].size
    sheet = image.new("RGB", (width, height * len(few)))
    for k, picture in enumerate(few):
        sheet.paste(picture, (0, k * height))
    palette = sheet.quantize(256, method=image.Quantize.MEDIANCUT)
    return [picture.quantize(palette=palette, dither=image.Dither.NONE) for picture in pictures]


def _page(pictures: list[Any], times: list[float], milliseconds: int, title: str) -> str:
    """All in one page: pictures as data, and a player of a few lines."""
    sources = []
    for picture in pictures:
        data = io.BytesIO()
        picture.save(data, format="PNG", optimize=True)
        sources.append('"data:image/png;base64,' + base64.b64encode(data.getvalue()).decode() + '"')
    return (
        _PAGE.replace("@title@", escape(title))
        .replace("@width@", str(pictures[0].width))
        .replace("@height@", str(pictures[0].height))
        .replace("@last@", str(len(pictures) - 1))
        .replace("@times@", ", ".join(f"{time:.6g}" for time in times))
        .replace("@pause@", str(milliseconds))
        .replace("@sources@", ",\n".join(sources))
    )


_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>@title@</title>
<style>
body { font: 15px system-ui, sans-serif; color: #333; margin: 2em auto; max-width: @width@px; }
img { width: 100%; height: auto; border: 1px solid #ddd; border-radius: 4px; display: block; }
div { display: flex; gap: 0.8em; align-items: center; margin-top: 0.6em; }
input { flex: 1; }
button { width: 5em; }
output { width: 7em; text-align: right; font-variant-numeric: tabular-nums; }
</style>
</head>
<body>
<img id="picture" width="@width@" height="@height@" alt="The run, frame by frame">
<div>
<button id="play" type="button">pause</button>
<input id="place" type="range" min="0" max="@last@" value="0" step="1" aria-label="frame">
<output id="time"></output>
</div>
<script>
"use strict";
const times = [@times@];
const sources = [
@sources@
];
const picture = document.getElementById("picture"), place = document.getElementById("place");
const play = document.getElementById("play"), time = document.getElementById("time");
let timer = null;
function show(k) {
  place.value = k;
  picture.src = sources[k];
  time.textContent = times[k].toFixed(3) + " s";
}
function run(on) {
  clearInterval(timer);
  timer = on ? setInterval(() => show((Number(place.value) + 1) % sources.length), @pause@) : null;
  play.textContent = on ? "pause" : "play";
}
play.addEventListener("click", () => run(timer === null));
place.addEventListener("input", () => { run(false); show(Number(place.value)); });
show(0);
run(sources.length > 1);
</script>
</body>
</html>
"""
