"""What plots and animations share: which frames, which way is up, and who gets which colour."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from xpheve.errors import RecordError
from xpheve.record.frame import FloatArray, IntArray
from xpheve.record.record import Record

WAY_OUT = 'pip install "xpheve-core[plot]"'

# Okabe and Ito (2008), told apart by nearly everyone; black is kept for text.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c564b", "#6a51a3")
FIXED = "#9a9a9a"


def up_of(record: Record) -> FloatArray:
    """Upward unit vector, from the metadata; y if they do not say."""
    said = record.metadata.get("up", "y")
    if isinstance(said, str):
        axis = "xyz".find(said.lower()) if len(said) == 1 else -1
        vector = np.eye(3)[axis] if axis >= 0 else np.zeros(3)
    else:
        vector = np.asarray(said, dtype=np.float64).reshape(-1)
    length = float(np.linalg.norm(vector))
    if vector.shape != (3,) or not 0.0 < length < np.inf:
        raise RecordError(f"metadata['up'] = {said!r}: 'x', 'y', 'z' or a vector is needed")
    return np.asarray(vector / length, dtype=np.float64)


def evenly(record: Record, count: int) -> list[int]:
    """At most ``count`` frames, evenly over time, the first and the last among them."""
    time = record.time
    if len(time) <= count:
        return list(range(len(time)))
    after = np.clip(np.searchsorted(time, np.linspace(time[0], time[-1], count)), 1, len(time) - 1)
    wanted = np.linspace(time[0], time[-1], count)
    nearest = np.where(wanted - time[after - 1] <= time[after] - wanted, after - 1, after)
    return sorted({int(number) for number in nearest} | {len(time) - 1} if count > 1 else {0})


def paths_of(record: Record, numbers: Iterable[int], serials: IntArray) -> FloatArray:
    """Positions of some objects in some frames, shape (frames, objects, 3) [m]; NaN where an object is not there."""
    found = []
    for frame in record.frames(list(numbers)):
        at = np.full((len(serials), 3), np.nan)
        if len(frame.serial):
            place = np.minimum(np.searchsorted(frame.serial, serials), len(frame.serial) - 1)
            there = frame.serial[place] == serials
            at[there] = frame.position[place[there]]
        at[~np.isfinite(at).all(axis=1)] = np.nan
        found.append(at)
    return np.array(found).reshape(len(found), len(serials), 3)


def label_of(row: dict[str, Any]) -> str:
    """Name of an object, cut to what a legend can hold; its serial if it has none."""
    name = row["name"]
    if name is None:
        return f"#{row['serial']}"
    clean = "".join(letter if letter.isprintable() else " " for letter in str(name))
    return clean if len(clean) <= 24 else clean[:23] + "…"


def turned(orientation: FloatArray, vector: Any) -> FloatArray:
    """``vector`` turned by the unit quaternion (w, x, y, z)."""
    return np.asarray(matrix_of(orientation) @ np.asarray(vector, dtype=np.float64))


def matrix_of(orientation: FloatArray) -> FloatArray:
    """Rotation, body to world, shape (3, 3)."""
    w, x, y, z = orientation / (np.linalg.norm(orientation) or 1.0)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def is_plane(row: dict[str, Any]) -> bool:
    """Whether an object is an unbounded plane."""
    return bool(row["shape"]) and row["shape"].get("kind") == "plane"


def plane_of(
    row: dict[str, Any], position: FloatArray, orientation: FloatArray, up: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Point [m] of a plane, and its normal, in the world frame."""
    normal = row["shape"].get("normal")
    direction = turned(orientation, up if normal is None else normal)
    return position + direction * float(row["shape"].get("offset", 0.0)), direction
