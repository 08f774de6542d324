"""Writes of one instant: kept whole, or taken back whole."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from xpheve.bodies import AUTHORED_WIDTHS, STATE_WIDTHS
from xpheve.plan.stored import StoredForce

if TYPE_CHECKING:
    from xpheve.laws import PhysicalLaw
    from xpheve.objects import PhysicalObject
    from xpheve.plan.world import World

NAMES = (*STATE_WIDTHS, *AUTHORED_WIDTHS)
MANY = 32  # objects from which on arrays are quicker than rows one by one
Values = dict[str, tuple[float, ...]]


class Touched:
    """An object that was materialised at this instant: what its row held before, and what flight had made of it."""

    __slots__ = ("clock", "driven", "flown", "forces", "held", "turn_clock")

    def __init__(
        self, held: Values, clock: tuple[float, float], flown: Values, forces: list[StoredForce], driven: bool
    ) -> None:
        self.held = held
        self.clock = clock
        self.flown = flown
        self.forces = forces
        self.turn_clock = clock
        """When what it held of its rotation was."""
        self.driven = driven
        """Whether it was driven until now: then no force did work on it."""


Clash = tuple["PhysicalLaw", "PhysicalLaw", str, "PhysicalObject"]
"""A law, the law that set the same anew, what, and of whom."""


class Transaction:
    """All writes between two commits. Reading meanwhile sees what was written."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.touched: dict[PhysicalObject, Touched] = {}
        self.forced: set[PhysicalObject] = set()
        """Objects whose stored forces changed."""
        self.written: dict[tuple[PhysicalObject, str], None] = {}
        """What was authored, by object and name."""
        self.setters: dict[tuple[PhysicalObject, str], PhysicalLaw] = {}
        """Which law set what last."""
        self.clashes: list[Clash] = []
        self.refresh: set[PhysicalObject] = set()
        """Objects whose contacts are to be predicted again although their flight is the same."""
        self.replan: dict[PhysicalObject, None] = {}
        self.switched: set[PhysicalObject] = set()
        """Objects that the host took hold of or let go: their steppers are asked when the scene is planned."""
        self.undo: list[Callable[[], None]] = []
        self.later: list[Callable[[], None]] = []
        """Structural changes, made at the end of the instant."""
        self.coming: list[PhysicalObject] = []
        """Objects that will be added then."""
        self.leaving: dict[PhysicalObject, None] = {}
        """Objects that others will take the place of then."""
        self.mapped: dict[PhysicalObject, list[PhysicalLaw]] = {}
        """Laws that objects will be mapped to then."""
        self._counts = (world.events, world.posts, dict(world.work))
        self._evaluations = [(law, law.evaluations) for law in world.laws]
        self._firings = [(container, container.firings, container.detections) for container in world.containers]

    def touch(self, obj: PhysicalObject) -> int:
        """Re-base the row of ``obj`` to this instant; returns the row."""
        world, bodies = self.world, self.world.bodies
        row = obj._row
        if obj not in self.touched:
            held = {name: bodies.get(name, row) for name in NAMES}
            flown = {name: world.read_row(row, name) for name in STATE_WIDTHS} | {
                name: held[name] for name in AUTHORED_WIDTHS
            }
            self.touched[obj] = Touched(held, bodies.clock_of(row), flown, list(world.forces.on(obj)), obj._driven)
            self.touched[obj].turn_clock = bodies.turn_clock_of(row)
            for name in STATE_WIDTHS:
                bodies.put(name, row, flown[name])
            bodies.re_base(row, world.time)
        return row

    def touch_all(self, objects: Sequence[PhysicalObject]) -> None:
        """`touch` each of ``objects``, their states read as arrays."""
        new = [obj for obj in dict.fromkeys(objects) if obj not in self.touched]
        if len(new) < MANY:
            for obj in new:
                self.touch(obj)
            return
        world, bodies = self.world, self.world.bodies
        rows = np.array([obj._row for obj in new], dtype=np.int64)
        held = {name: _tuples(bodies.arrays[name][:, rows]) for name in NAMES}
        now = {name: world.read_all(name, world.time)[:, rows] for name in STATE_WIDTHS}
        flown = held | {name: _tuples(values) for name, values in now.items()}
        clocks = _tuples(bodies.clock[:, rows])
        for k, obj in enumerate(new):
            before, after = ({name: values[k] for name, values in table.items()} for table in (held, flown))
            self.touched[obj] = Touched(before, clocks[k], after, list(world.forces.on(obj)), obj._driven)  # type: ignore[arg-type]
        for name, values in now.items():
            bodies.arrays[name][:, rows] = values
        bodies.clock[0, rows], bodies.clock[1, rows] = world.time
        bodies.change += 1

    def changed(self) -> list[PhysicalObject]:
        """The touched objects whose state or forces are other than flight had made them, in rank order."""
        bodies = self.world.bodies
        found = [
            obj
            for obj, touched in self.touched.items()
            if obj in self.forced or any(bodies.get(name, obj._row) != touched.flown[name] for name in NAMES)
        ]
        return self.world.in_rank_order(found)

    def put_back(self, obj: PhysicalObject) -> None:
        """Give the row of ``obj`` what it held before: nothing happened to it."""
        touched, bodies = self.touched[obj], self.world.bodies
        for name in NAMES:
            bodies.put(name, obj._row, touched.held[name])
        bodies.clock[:, obj._row] = touched.clock
        bodies.turn_clock[:, obj._row] = touched.turn_clock

    def roll_back(self) -> None:
        """Take everything back."""
        for act in reversed(self.undo):
            act()
        self.world.events, self.world.posts, self.world.work = self._counts
        for law, evaluations in self._evaluations:
            law.evaluations = evaluations
        for container, firings, detections in self._firings:
            container.firings, container.detections = firings, detections
        for obj, touched in self.touched.items():
            self.put_back(obj)
            self.world.forces.of[obj] = touched.forces
            self.world.sum_forces(obj)

    def write(self, obj: PhysicalObject, name: str, value: Any) -> None:
        """Set a property of ``obj``, as somebody's will."""
        row = self.touch(obj)
        self.note(obj, name, self.world.bodies.get(name, row) == (value if isinstance(value, tuple) else (value,)))
        self.world.bodies.put(name, row, value)
        self.written[obj, name] = None

    def note(self, obj: PhysicalObject, name: str, same: bool) -> None:
        """The law that acts now sets ``name`` of ``obj``; not to the ``same`` value that it has."""
        law = self.world.acting
        if law is None:
            return
        before = self.setters.get((obj, name))
        if before is not None and before is not law and not same:
            self.clashes.append((before, law, name, obj))
        self.setters[obj, name] = law


def _tuples(values: Any) -> list[tuple[float, ...]]:
    """The columns of ``values``, shape (width, n)."""
    return list(map(tuple, values.T.tolist()))
