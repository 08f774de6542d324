"""One moment of a run, and who can tell of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from xpheve.errors import RecordError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

WIDTHS: Final = {"position": 3, "velocity": 3, "orientation": 4, "angular_velocity": 3}
"""The columns of a frame and how many numbers of each an object has."""


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """All objects at one time, n of them; a row is an object.

    Parameters
    ----------
    time
        [s], the engine's.
    serial
        Which object a row tells of, shape (n,): a number that no other object of the engine ever had.
    position, velocity, angular_velocity
        World frame, shape (n, 3) [m, m/s, rad/s].
    orientation
        Unit quaternions (w, x, y, z), body to world, shape (n, 4).
    energy
        Kinetic and potential energy and the work done by outside forces so far [J]; NaN where not known.

    """

    time: float
    serial: IntArray
    position: FloatArray
    velocity: FloatArray
    angular_velocity: FloatArray
    orientation: FloatArray
    energy: tuple[float, float, float] = (math.nan, math.nan, math.nan)


class FrameSource(Protocol):
    """What a recorder asks; looking must not change it."""

    def frame(self) -> Frame:
        """All objects now. The arrays may be reused afterwards."""

    def object_table(self) -> list[dict[str, Any]]:
        """Of each object: ``serial``, ``name``, ``shape`` (a plain dict, or None), ``mass`` [kg], ``fixed``."""


def in_order(frame: Frame) -> Frame:
    """``frame`` as float64 and int64 with its rows in rising serial; raises `RecordError` if it cannot be one."""
    serial = np.asarray(frame.serial, dtype=np.int64)
    count = serial.shape[0] if serial.ndim == 1 else -1
    columns: dict[str, Any] = {name: np.asarray(getattr(frame, name), dtype=np.float64) for name in WIDTHS}
    for name, values in columns.items():
        if values.shape != (count, WIDTHS[name]):
            raise RecordError(
                f"frame at {frame.time} s: {name} has shape {values.shape} where serial has {serial.shape}; "
                f"(n, {WIDTHS[name]}) and (n,) are needed"
            )
    if not math.isfinite(frame.time):
        raise RecordError(f"frame at {frame.time} s: a finite time is needed")
    if count > 1 and not (serial[1:] > serial[:-1]).all():
        order = np.argsort(serial, kind="stable")
        serial = serial[order]
        if not (serial[1:] > serial[:-1]).all():
            twice = serial[1:][serial[1:] == serial[:-1]][0]
            raise RecordError(f"frame at {frame.time} s: the serial {twice} occurs twice")
        columns = {name: values[order] for name, values in columns.items()}
    kinetic, potential, work = frame.energy
    energy = (float(kinetic), float(potential), float(work))
    return replace(frame, time=float(frame.time), serial=serial, energy=energy, **columns)
