"""Snapshot: a scene at one instant, for other threads. It never changes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from xpheve.bodies import AUTHORED_WIDTHS, STATE_WIDTHS
from xpheve.errors import InvalidValueError, OwnershipError
from xpheve.kernels.clock import Instant

if TYPE_CHECKING:
    from xpheve.objects import PhysicalObject

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """All objects at one time, n of them; row k of each array tells of ``objects[k]``. Arrays are read-only.

    ``position`` [m], ``velocity`` [m/s], ``angular_velocity`` [rad/s], ``inertia`` [kg m^2] (n, 3), ``orientation`` (n, 4) as
    (w, x, y, z), ``mass`` [kg] (n,), ``fixed`` (n,), ``columns`` by name, each (n,); ``rows`` says which row an object has.
    ``number`` counts the frames; ``time`` [s] is simulation time, and ``instant`` the same as (base, offset); ``state`` is the engine's;
    ``real_time_factor`` and ``lag`` [s] say how it keeps up with the clock.
    """

    number: int
    """Counts the frames."""
    time: float
    """Simulation time [s]."""
    instant: Instant
    """Simulation time as the engine keeps it, (base, offset)."""
    state: str
    """Of the engine, as `PhysicsEngine.state`."""
    real_time_factor: float
    """Simulated time that passed per time of the clock over the last second or so; 1 if the machine keeps up, NaN if not known."""
    lag: float
    """Simulation time [s] by which the scene is behind the clock."""
    objects: tuple[PhysicalObject, ...]
    rows: dict[PhysicalObject, int]
    position: Array
    velocity: Array
    orientation: Array
    angular_velocity: Array
    mass: Array
    inertia: Array
    fixed: NDArray[np.bool_]
    columns: dict[str, Array]

    def __len__(self) -> int:
        return len(self.objects)

    def __getitem__(self, name: str) -> Array:
        """The array of a property or column. Raises `InvalidValueError`."""
        if name in self.columns:
            return self.columns[name]
        if name in STATE_WIDTHS or name in AUTHORED_WIDTHS:
            found: Array = getattr(self, name)
            return found
        known = sorted([*STATE_WIDTHS, *AUTHORED_WIDTHS, *self.columns])
        raise InvalidValueError(f"no column {name!r}; at hand: {', '.join(known)}")

    def of(self, obj: PhysicalObject, name: str) -> Any:
        """Property or column ``name`` of ``obj`` as floats. Raises `OwnershipError` if ``obj`` was not in the scene."""
        row = self.rows.get(obj)
        if row is None:
            raise OwnershipError(f"{obj!r} is not in the snapshot of t = {self.time} s")
        value = self[name][row]
        return tuple(value.tolist()) if value.ndim else float(value)

    def later(self, time: float) -> Snapshot:
        """The same at ``time``, until which nothing changes."""
        return replace(self, time=time, instant=(time, 0.0), lag=0.0)


def take(
    world: Any, number: int, state: str, real_time_factor: float, lag: float, last: Snapshot | None = None
) -> Snapshot:
    """A snapshot of ``world`` now; what did not change is shared with the ``last`` one."""
    bodies, n = world.bodies, world.bodies.count
    objects = tuple(bodies.objects)
    same = last is not None and last.objects == objects
    rows = last.rows if same and last is not None else {obj: row for row, obj in enumerate(objects)}
    columns: dict[str, Any] = {name: _frozen(world.show_all(name).T) for name in STATE_WIDTHS}
    return Snapshot(
        number=number,
        time=world.time[0],
        instant=world.time,
        state=state,
        real_time_factor=real_time_factor,
        lag=lag,
        objects=objects,
        rows=rows,
        mass=_frozen(bodies.arrays["mass"][0, :n].copy()),
        inertia=_frozen(bodies.arrays["inertia"][:, :n].copy().T),
        fixed=_frozen(bodies.fixed[:n].copy()),
        columns={name: _frozen(array[:n].copy()) for name, array in bodies.columns.items()},
        **columns,
    )


def _frozen(array: Any) -> Any:
    array.flags.writeable = False
    return array


__all__ = ["Snapshot", "take"]
