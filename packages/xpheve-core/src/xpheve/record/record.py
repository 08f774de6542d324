"""What a run left behind."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from xpheve.errors import RecordError
from xpheve.record.frame import FloatArray, Frame, IntArray
from xpheve.record.store import Store, frozen

# Of the largest energy: below it an exchange of energy is not told from the rounding of a scene at rest.
_LEAST_EXCHANGE = 1e-6


class Record:
    """The frames of a run: k of them, each with n objects in rising serial.

    Made by ``engine.run(..., every=...)`` or `Record.open`. Arrays cannot be written. A record on a file reads a column
    when it is first asked for and then keeps it.
    """

    def __init__(self, store: Store) -> None:
        """Show what ``store`` holds."""
        self._store = store
        self._index = store.index
        self._columns: dict[str, FloatArray] = {}
        self._time: FloatArray = frozen(self._index.time)
        self._energy: FloatArray = frozen(self._index.energy)

    @classmethod
    def open(cls, path: str | os.PathLike[str]) -> Record:
        """Open the record in a file; of a torn one, all complete batches.

        Raises
        ------
        RecordError
            If there is no record, or one of a newer format.

        """
        from xpheve.record.files import open_store

        return cls(open_store(path))

    # What is known of the run

    @property
    def metadata(self) -> dict[str, Any]:
        """Version of xPheve, up, seed, choices of the plan."""
        return self._index.metadata

    @property
    def objects(self) -> list[dict[str, Any]]:
        """Serial, name, shape, mass and fixed of every object met, in rising serial."""
        return [self._index.objects[serial] for serial in sorted(self._index.objects)]

    @property
    def path(self) -> Path | None:
        """The file, or None for a record in memory."""
        return self._store.path

    @property
    def torn(self) -> bool:
        """Whether the file lacks its end: the run was killed or goes on, or the file is damaged there."""
        return self._store.torn

    # Columns

    @property
    def time(self) -> FloatArray:
        """Shape (k,) [s]."""
        return self._time

    @property
    def energy(self) -> FloatArray:
        """Kinetic, potential, and work done from outside, shape (k, 3) [J]; NaN where not known."""
        return self._energy

    @property
    def serial(self) -> IntArray:
        """The objects of every frame, shape (n,). Raises `RecordError` if they are not the same in all frames."""
        common = self._index.common()
        if common is None:
            changes = self._index.changes()
            raise RecordError(
                f"the objects change during the run ({len(changes)} times, first at {changes[0]} s), so no one array "
                "holds all; use record[obj], record[name] or record[serial], or go through the frames"
            )
        return frozen(common)  # type: ignore[no-any-return]

    @property
    def position(self) -> FloatArray:
        """Shape (k, n, 3) [m]."""
        return self._column("position")

    @property
    def velocity(self) -> FloatArray:
        """Shape (k, n, 3) [m/s]."""
        return self._column("velocity")

    @property
    def orientation(self) -> FloatArray:
        """Unit quaternions (w, x, y, z), body to world, shape (k, n, 4)."""
        return self._column("orientation")

    @property
    def angular_velocity(self) -> FloatArray:
        """Shape (k, n, 3) [rad/s]."""
        return self._column("angular_velocity")

    @property
    def energy_drift(self) -> float:
        """Largest departure of kinetic + potential - work from its first value, relative to the energy in play.

        In play is the largest of: kinetic energy, change of potential energy, change of work; but at least 1e-6 of the
        largest energy that occurs, so that the rounding of a scene at rest is no drift. Where potential energy has its
        zero does not matter. Frames with unknown energies do not count; NaN if all are unknown.
        """
        known = self._energy[np.isfinite(self._energy).all(axis=1)]
        if not len(known):
            return math.nan
        total = known[:, 0] + known[:, 1] - known[:, 2]
        change = float(np.abs(total - total[0]).max())
        if change == 0.0:
            return 0.0
        exchanged = max(float(np.abs(known[:, 0]).max()), *np.ptp(known[:, 1:], axis=0).tolist())
        return change / float(max(exchanged, _LEAST_EXCHANGE * float(np.abs(known).max())))

    # Objects and frames

    def __getitem__(self, key: Any) -> Track:
        """Track of an object, given itself, its name or its serial."""
        return Track(self, self._resolve(key))

    def __len__(self) -> int:
        """How many frames there are."""
        return len(self._index)

    def __iter__(self) -> Iterator[Frame]:
        """All frames, one at a time."""
        return self.frames(range(len(self)))

    def frame(self, number: int) -> Frame:
        """One frame; negative numbers count from the end. Raises `RecordError` if there is none of that number."""
        count = len(self)
        if not -count <= number < count:
            raise RecordError(f"frame {number}: the record has {count} frames")
        return next(iter(self._store.frames([number % count])))

    def frames(self, numbers: range | list[int]) -> Iterator[Frame]:
        """Frames of these numbers, one at a time, best in rising order."""
        return iter(self._store.frames(numbers))

    def __repr__(self) -> str:
        """Frames, time, objects and place."""
        span = f", {self._time[0]:g} to {self._time[-1]:g} s" if len(self) else ""
        count = len(self._index.objects)
        place = "in memory" if self.path is None else f"in {str(self.path)!r}{', torn' if self.torn else ''}"
        return f"<Record: {len(self)} frames{span}, {count} object{'' if count == 1 else 's'}, {place}>"

    # Files

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the record to a file, whole or not at all; a file of this name is replaced."""
        from xpheve.record.files import open_store, write_store

        target = write_store(path, self._store)
        if self.path is not None and target.resolve() == self.path.resolve():
            self._store = open_store(target)
            self._index = self._store.index
        return target

    def to_csv(self, path: str | os.PathLike[str]) -> Path:
        """Write a table as CSV, one row per frame and object; numbers keep their value. A file there is replaced."""
        from xpheve.record.tables import write_csv

        return write_csv(path, self._store)

    def to_parquet(self, path: str | os.PathLike[str]) -> Path:
        """Write a table as Parquet, one row per frame and object. A file of this name is replaced."""
        from xpheve.record.tables import write_parquet

        return write_parquet(path, self._store)

    def plot(self, path: str | os.PathLike[str]) -> Path:
        """Draw trajectories and energies into one PNG. Needs matplotlib. A file of this name is replaced."""
        from xpheve.record.plot import plot

        return plot(self, path)

    def animate(self, path: str | os.PathLike[str], *, frames: int = 120, size: tuple[int, int] = (640, 480)) -> Path:
        """Draw the motion into a ``.gif``, or a ``.html`` that needs no network. Needs matplotlib and pillow.

        Parameters
        ----------
        path
            A file of this name is replaced.
        frames
            How many pictures at most, evenly over the run.
        size
            Width and height [pixels].

        """
        from xpheve.record.animation import animate

        return animate(self, path, frames=frames, size=size)

    def export_glb(self, path: str | os.PathLike[str]) -> Path:
        """Write the motion as animated glTF 2.0, for standard viewers and modellers. A file of this name is replaced.

        Every frame becomes a key; in between viewers go straight. Times begin at 0; glTF's y is the scene's up.
        """
        from xpheve.record.gltf import export_glb

        return export_glb(self, path)

    def _column(self, name: str) -> FloatArray:
        count = len(self.serial)
        return self._flat(name).reshape(len(self), count, -1 if count and len(self) else self._flat(name).shape[1])

    def _flat(self, name: str) -> FloatArray:
        """All rows of all frames."""
        if name not in self._columns:
            self._columns[name] = frozen(self._store.column(name))
        return self._columns[name]

    def _resolve(self, key: Any) -> int:
        objects = self._index.objects
        given = key
        if not isinstance(key, str | int | np.integer):
            key = getattr(key, "serial", None)
            key = getattr(given, "name", None) if key is None else key
        if isinstance(key, str):
            found = [serial for serial, row in objects.items() if row["name"] == key]
            if len(found) > 1:
                raise RecordError(f"{len(found)} objects are named {key!r}; use their serials {sorted(found)[:8]}")
            if found:
                return found[0]
            names = sorted({row["name"] for row in objects.values() if row["name"] is not None})
            at_hand = ", ".join(map(repr, names[:8])) + (", ..." if len(names) > 8 else "")
            raise RecordError(f"no object is named {key!r} in the record; at hand: {at_hand or 'no names'}")
        if isinstance(key, int | np.integer) and not isinstance(key, bool) and int(key) in objects:
            return int(key)
        raise RecordError(f"record[{given!r}]: an object, name or serial of the record is needed; see record.objects")


class Track:
    """One object's way through ``record``, over the m frames in which it is; ``serial`` is its number there."""

    def __init__(self, record: Record, serial: int) -> None:
        """Find the object in ``record``."""
        self._record = record
        self._frames, self._rows = record._index.find(serial)
        self.serial = serial
        self.description: dict[str, Any] = record._index.objects[serial]

    @property
    def name(self) -> str | None:
        """None if the object has none."""
        name: str | None = self.description["name"]
        return name

    @property
    def frame_numbers(self) -> IntArray:
        """Which frames, shape (m,)."""
        return frozen(self._frames)  # type: ignore[no-any-return]

    @property
    def time(self) -> FloatArray:
        """Shape (m,) [s]."""
        return frozen(self._record.time[self._frames])  # type: ignore[no-any-return]

    @property
    def position(self) -> FloatArray:
        """Shape (m, 3) [m]."""
        return self._of("position")

    @property
    def velocity(self) -> FloatArray:
        """Shape (m, 3) [m/s]."""
        return self._of("velocity")

    @property
    def orientation(self) -> FloatArray:
        """Unit quaternions (w, x, y, z), body to world, shape (m, 4)."""
        return self._of("orientation")

    @property
    def angular_velocity(self) -> FloatArray:
        """Shape (m, 3) [rad/s]."""
        return self._of("angular_velocity")

    def __len__(self) -> int:
        """How many frames the object is in."""
        return len(self._rows)

    def __repr__(self) -> str:
        """Which object, and in how many frames."""
        who = f"serial {self.serial}" if self.name is None else repr(self.name)
        return f"<Track of {who}: {len(self)} frames>"

    def _of(self, name: str) -> FloatArray:
        return frozen(self._record._flat(name)[self._rows])  # type: ignore[no-any-return]
