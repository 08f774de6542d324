"""All objects of an engine as arrays: one row an object, one array a column."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from threading import get_ident
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from xpheve.errors import InvalidValueError
from xpheve.kernels.clock import Instant

if TYPE_CHECKING:
    from xpheve.objects import PhysicalObject

Array = NDArray[np.float64]

STATE_WIDTHS = {"position": 3, "velocity": 3, "orientation": 4, "angular_velocity": 3}
"""What flight changes, with the numbers a row has of it."""
AUTHORED_WIDTHS = {"mass": 1, "inertia": 3}
DERIVED_WIDTHS = {"force": 3, "torque": 3, "working": 3}
"""Sums of the stored forces of a row, kept by the engine; ``working`` is the part of ``force`` that no potential stands for."""
WIDTHS = STATE_WIDTHS | AUTHORED_WIDTHS | DERIVED_WIDTHS


class Bodies:
    """Structure of arrays. Vectors are stored component first, shape (width, rows), so that a component is contiguous.

    A row holds the values at its last re-base, at the instant ``clock[:, row]`` = (base, offset). Orientation and angular velocity have a
    ``turn_clock`` of their own: free rotation is in closed form and goes on where places are re-based. Rows 0 to ``count - 1`` are in use;
    removing one moves the last into the gap. ``version`` goes up whenever a row's flight becomes another.
    """

    def __init__(self) -> None:
        self.count = 0
        self.objects: list[PhysicalObject] = []
        self.columns: dict[str, Array] = {}
        self.defaults: dict[str, float] = {}
        self.change = 0
        """Goes up with every write, so that what was computed from the arrays can be kept until then."""
        self._allocate(16)

    def _allocate(self, capacity: int) -> None:
        self.capacity = capacity
        self.arrays: dict[str, Array] = {name: np.zeros((width, capacity)) for name, width in WIDTHS.items()}
        self.clock: Array = np.zeros((2, capacity))
        self.turn_clock: Array = np.zeros((2, capacity))
        self.fixed = np.zeros(capacity, dtype=bool)
        self.driven = np.zeros(capacity, dtype=bool)
        self.serial = np.zeros(capacity, dtype=np.int64)
        self.version = np.zeros(capacity, dtype=np.int64)
        self.batch = np.full(capacity, -1, dtype=np.int64)
        self.local = np.zeros(capacity, dtype=np.int64)
        self.volume: Array = np.full(capacity, np.nan)
        """Volume [m^3] of the shape, by whoever asked for it first, -1 where there is none; NaN until then, and after a new shape."""

    def _plain(self) -> list[NDArray[Any]]:
        plain = [
            self.clock,
            self.turn_clock,
            self.fixed,
            self.driven,
            self.serial,
            self.version,
            self.batch,
            self.local,
        ]
        return [*plain, self.volume]

    def reserve(self, rows: int) -> None:
        """Make room for ``rows`` more."""
        if self.count + rows <= self.capacity:
            return
        old, old_plain, n = self.arrays, self._plain(), self.count
        self._allocate(max(2 * self.capacity, (self.count + rows) * 9 // 8))
        for name, array in old.items():
            self.arrays[name][:, :n] = array[:, :n]
        for new, array in zip(self._plain(), old_plain, strict=True):
            new[..., :n] = array[..., :n]
        for name, array in self.columns.items():
            self.columns[name] = np.full(self.capacity, self.defaults[name])
            self.columns[name][:n] = array[:n]

    def append(self, objects: Sequence[PhysicalObject], values: dict[str, Any], clock: Instant) -> range:
        """Add rows for ``objects``; ``values`` holds (rows, width) arrays of state, mass and inertia, and ``fixed``."""
        n = len(objects)
        self.reserve(n)
        rows = range(self.count, self.count + n)
        where = slice(rows.start, rows.stop)
        for name in (*STATE_WIDTHS, *AUTHORED_WIDTHS):
            self.arrays[name][:, where] = np.asarray(values[name], dtype=float).reshape(n, -1).T
        for name in DERIVED_WIDTHS:
            self.arrays[name][:, where] = 0.0
        self.fixed[where] = values["fixed"]
        self.driven[where] = False
        self.serial[where] = values["serial"]
        self.clock[0, where], self.clock[1, where] = clock
        self.turn_clock[:, where] = self.clock[:, where]
        self.version[where] += 1
        self.batch[where] = -1
        self.volume[where] = np.nan
        for name, default in self.defaults.items():
            self.columns[name][where] = default
        self.objects.extend(objects)
        self.count += n
        self.change += 1
        return rows

    def remove(self, row: int) -> int:
        """Take ``row`` out by moving the last row into it; returns the row that was moved, or ``row`` if it was the last."""
        last = self.count - 1
        if row != last:
            for array in (*self.arrays.values(), *self._plain(), *self.columns.values()):
                array[..., row] = array[..., last]
            self.objects[row] = self.objects[last]
        self.objects.pop()
        self.count = last
        self.change += 1
        return last

    def add_column(self, name: str, default: float) -> Array:
        """The array of the extra column ``name``, made with ``default`` if it is new."""
        if name not in self.columns:
            self.defaults[name] = default
            self.columns[name] = np.full(self.capacity, default)
        return self.columns[name]

    def get(self, name: str, row: int) -> tuple[float, ...]:
        """The stored values of ``row`` as floats."""
        return tuple(self.arrays[name][:, row].tolist())

    def put(self, name: str, row: int, value: Sequence[float]) -> None:
        """Store the values of ``row``."""
        self.arrays[name][:, row] = value
        self.change += 1

    def clock_of(self, row: int) -> Instant:
        """When ``row`` was last re-based."""
        return float(self.clock[0, row]), float(self.clock[1, row])

    def turn_clock_of(self, row: int) -> Instant:
        """When orientation and angular velocity of ``row`` were last re-based."""
        return float(self.turn_clock[0, row]), float(self.turn_clock[1, row])

    def re_base(self, row: int, t: Instant) -> None:
        """All that ``row`` holds is at ``t``."""
        self.clock[:, row] = t
        self.turn_clock[:, row] = t


class BodiesView:
    """All objects of an engine as read-only arrays at the engine's time, rows in the order of ``engine.objects``.

    ``position`` [m], ``velocity`` [m/s], ``angular_velocity`` [rad/s], ``inertia`` [kg m^2] (n, 3); ``orientation`` (n, 4); ``mass`` [kg] (n,);
    extra columns by name, (n,). Values are computed when asked for and kept until time or state moves on.
    """

    __slots__ = ("_bodies", "_held", "_live", "_now", "_pool", "_reader", "_shot")

    def __init__(
        self,
        bodies: Callable[[], Bodies],
        now: Callable[[], Any],
        reader: Callable[[str, Array | None], Array],
        shot: Callable[[], Any] = lambda: None,
    ) -> None:
        self._live: Any = None
        """While the engine is started: who holds the scene; on other threads the snapshot is read."""
        self._shot = shot
        self._bodies = bodies
        self._now = now
        self._reader = reader
        self._held: dict[str, tuple[Any, Array]] = {}
        self._pool: dict[str, list[Array]] = {}

    def _elsewhere(self) -> bool:
        """Whether another thread than this one holds the scene."""
        return self._live is not None and self._live.holder != get_ident()

    def __len__(self) -> int:
        return len(self._shot()) if self._elsewhere() else self._bodies().count

    @property
    def position(self) -> Array:
        """Position [m] of the centre of mass, shape (n, 3)."""
        return self._read("position")

    @property
    def velocity(self) -> Array:
        """Velocity [m/s] of the centre of mass, shape (n, 3)."""
        return self._read("velocity")

    @property
    def orientation(self) -> Array:
        """Quaternion (w, x, y, z), body to world, shape (n, 4)."""
        return self._read("orientation")

    @property
    def angular_velocity(self) -> Array:
        """Angular velocity [rad/s], world frame, shape (n, 3)."""
        return self._read("angular_velocity")

    def _read(self, name: str) -> Array:
        """Column ``name`` at the present time; kept until time or state moves on, in buffers that nobody else holds."""
        live = self._live
        if live is not None and live.holder != get_ident():
            found: Array = self._shot()[name]
            return found
        key = self._now()
        held = self._held.get(name)
        if held is not None and held[0] == key:
            return held[1]
        owner = self._reader(name, self._spare(name))
        view = owner.T
        view.flags.writeable = False
        self._held[name] = (key, view)
        return view

    def _spare(self, name: str) -> Array | None:
        """A buffer of column ``name`` that nobody looks at any more, or None. Two are kept, as one is often still held."""
        pool = self._pool.setdefault(name, [])
        current = self._held.pop(name, None)
        if current is not None:
            pool.append(current[1])
            del current
        for k in range(len(pool)):
            # The view: the pool's reference and the argument. Its owner: the view's reference and the argument.
            if sys.getrefcount(pool[k]) == 2 and sys.getrefcount(pool[k].base) == 2:
                found: Array = pool.pop(k).base  # type: ignore[assignment]
                return found
        del pool[:-1]
        return None

    @property
    def mass(self) -> Array:
        """Mass [kg], shape (n,)."""
        if self._elsewhere():
            return self._shot().mass  # type: ignore[no-any-return]
        return _frozen(self._bodies().arrays["mass"][0, : len(self)])

    @property
    def inertia(self) -> Array:
        """Principal moments [kg m^2], shape (n, 3)."""
        if self._elsewhere():
            return self._shot().inertia  # type: ignore[no-any-return]
        return _frozen(self._bodies().arrays["inertia"][:, : len(self)]).T

    @property
    def fixed(self) -> NDArray[np.bool_]:
        """Whether each object never moves, shape (n,)."""
        if self._elsewhere():
            return self._shot().fixed  # type: ignore[no-any-return]
        return _frozen(self._bodies().fixed[: len(self)])

    @property
    def driven(self) -> NDArray[np.bool_]:
        """Whether the host moves each object, shape (n,)."""
        return _frozen(self._bodies().driven[: len(self)])

    def __getitem__(self, name: str) -> Array:
        if self._elsewhere():
            shown: Array = self._shot()[name]
            return shown
        bodies = self._bodies()
        if name in bodies.columns:
            return _frozen(bodies.columns[name][: len(self)])
        known = sorted([*STATE_WIDTHS, *AUTHORED_WIDTHS, *bodies.columns])
        if name in known:
            found: Array = getattr(self, name)
            return found
        raise InvalidValueError(f"no column {name!r}; at hand: {', '.join(known)}")


def _frozen(array: NDArray[Any]) -> NDArray[Any]:
    copy = array.copy()
    copy.flags.writeable = False
    return copy
