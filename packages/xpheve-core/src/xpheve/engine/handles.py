"""What the handles of objects ask for: their state, columns and forces."""

from __future__ import annotations

import math
from threading import get_ident
from typing import Any

from xpheve.bodies import STATE_WIDTHS
from xpheve.engine.looking import Looking
from xpheve.errors import InvalidValueError
from xpheve.forces import Force
from xpheve.kernels.clock import NEVER, Instant, later
from xpheve.laws.response import FILTER
from xpheve.objects import PhysicalObject
from xpheve.plan import driven, scenery
from xpheve.plan.stored import StoredForce
from xpheve.realtime.doors import door, look


class Handles(Looking):
    """The part of `PhysicsEngine` that objects read and write through."""

    @property
    def is_mine(self) -> bool:
        """Whether the calling thread may touch the scene itself; others see the last snapshot of a started engine."""
        live = self._live
        return live is None or live.holder == get_ident()

    def read_object(self, obj: PhysicalObject, name: str) -> Any:
        """A property of ``obj`` at the present time; in a handler of host steps, half a step ahead."""
        live = self._live
        if live is not None and live.holder != get_ident():
            shot = self._published[0]
            return shot.of(obj, name) if obj in shot.rows else obj._own[name]
        world = self._world
        t: Instant | None = None
        if world.ahead and world.transaction is not None and (obj, name) not in world.transaction.written:
            t = later(world.time, world.ahead)
        found = world.show_row(obj._row, name, t)
        return found[0] if name == "mass" else found

    @door()
    def write_object(self, obj: PhysicalObject, name: str, value: Any) -> None:
        """Set a property of ``obj`` at the present time."""
        world = self._world
        if name == "inertia" and not any(value) and any(any(one.force.torque) for one in world.forces.on(obj)):
            raise InvalidValueError(f"{obj!r}: inertia = {value} while a torque acts on it; remove the torque first")
        if name == "angular_velocity" and world.contacts is not None:
            world.contacts.check_turning(obj, value)
        if world.periodic is not None and name == "position":
            from xpheve.periodic import wrapped

            held = world.read_row(obj._row, name)
            value = wrapped(value, world.periodic)
            if value == wrapped(held, world.periodic):  # where it is already, as another image: nothing is written
                value = held
        with world.instant() as transaction:
            transaction.write(obj, name, value)
            if name in STATE_WIDTHS:
                driven.expect(world, transaction, obj, None)
            if name in ("mass", "inertia"):
                scenery.restore_constant_forces(world, obj, name)

    def read_column(self, obj: PhysicalObject, name: str) -> float:
        """Extra column ``name`` of ``obj``. Raises `InvalidValueError`."""
        live = self._live
        if live is not None and live.holder != get_ident():
            shot = self._published[0]
            if obj in shot.rows and name in shot.columns:
                return float(shot.columns[name][shot.rows[obj]])
            if name in obj._columns:  # no law reads it
                return obj._columns[name]
        columns = self._world.bodies.columns
        if name not in columns:
            raise InvalidValueError(f"no law here declares a column {name!r}; at hand: {', '.join(columns) or 'none'}")
        return float(columns[name][obj._row])

    @door()
    def write_column(self, obj: PhysicalObject, name: str, value: float) -> None:
        """Set extra column ``name`` of ``obj``."""
        world = self._world
        for law in world.mapping.laws(obj):
            if name in law.columns:
                value = law.columns[name].check(value, obj.label, name)
        old = obj._columns.get(name)
        before = world.bodies.columns[name][obj._row] if name in world.bodies.columns else old
        with world.instant() as transaction:
            transaction.undo.append(lambda: self._put_column(obj, name, old))
            self._put_column(obj, name, value)
            transaction.note(obj, name, value == before)
            if value != before:
                transaction.written[obj, name] = None
            transaction.refresh.add(obj)
            if name in FILTER and value != before:
                world.structure += 1  # who may meet whom is another question now
            if obj not in world.unplanned:
                scenery.restore_constant_forces(world, obj, name)
                if world.continuous_laws(obj):
                    transaction.touch(obj)
                    transaction.forced.add(obj)

    def _put_column(self, obj: PhysicalObject, name: str, value: float | None) -> None:
        columns = self._world.bodies.columns
        if value is None:
            obj._columns.pop(name, None)
            value = self._world.bodies.defaults.get(name, math.nan)
        else:
            obj._columns[name] = value
        if name in columns:
            columns[name][obj._row] = value

    # Forces

    @look
    def forces_of(self, obj: PhysicalObject) -> tuple[Force, ...]:
        """The forces on ``obj``, each with the time it still has."""
        now = self._world.time
        return tuple(
            Force(one.force.vector, one.remaining(now), one.force.id, torque=one.force.torque)
            for one in self._world.forces.on(obj)
        )

    @look
    def user_forces(self, obj: PhysicalObject) -> tuple[Force, ...]:
        """The forces on ``obj`` that no law stored."""
        now = self._world.time
        return tuple(
            Force(one.force.vector, one.remaining(now), one.force.id, torque=one.force.torque)
            for one in self._world.forces.on(obj)
            if one.owner is None
        )

    @door()
    def add_force(self, obj: PhysicalObject, force: Force) -> Force:
        """Let ``force`` act on ``obj`` from now on. In a handler it belongs to the law, and replaces the law's last one of that id."""
        self._check_own(obj)
        world = self._world
        law = world.acting
        if any(force.torque) and not any(obj.inertia):
            raise InvalidValueError(f"{obj!r} has no inertia, so no torque can turn it: give inertia=, or a shape")
        self._check_sum(obj, force)
        ident = force.id
        if ident is None:
            ident = world.ident(law) if law is not None else world.force_ids.new()
        elif law is None:
            world.force_ids.given(ident)
        named = Force(force.vector, force.duration, ident, torque=force.torque)
        if force.duration == 0.0:
            return named
        until = NEVER if force.duration == math.inf else later(world.time, force.duration)
        stored = StoredForce(named, law, until, False)
        with world.instant() as transaction:
            transaction.touch(obj)
            if law is None:
                world.forces.put(obj, stored)
                transaction.forced.add(obj)
            elif world.forces.replace(obj, stored):
                transaction.forced.add(obj)
            if law is not None:
                world.renewed.add((law, obj))
            world.watch_force(obj, stored)
            world.sum_forces(obj)
        return named

    def _check_sum(self, obj: PhysicalObject, force: Force) -> None:
        """Raise if ``force`` would make the sum on ``obj``, or its acceleration, overflow."""
        vectors = [*(one.force.vector for one in self._world.forces.on(obj)), force.vector]
        try:
            sums = [math.fsum(vector[k] for vector in vectors) / obj.mass for k in range(3)]
        except OverflowError:
            sums = [math.inf]
        if not all(map(math.isfinite, sums)):
            raise InvalidValueError(
                f"{obj!r}: with {force!r} its acceleration is beyond what a float can hold; give less"
            )

    def new_force_id(self) -> int | str:
        """An id that no force here has been given."""
        live = self._live
        if live is not None and live.holder != get_ident():
            given: str = live.new_force_id()
            return given
        return self._world.force_ids.new()

    @door(waits=True)
    def remove_force(self, obj: PhysicalObject, id: int | str) -> int:
        """Take away all of the user's forces on ``obj`` with ``id`` (in a handler, the law's); returns how many."""
        self._check_own(obj)
        world = self._world
        with world.instant() as transaction:
            transaction.touch(obj)
            held = world.forces.on(obj)
            gone = [one for one in held if one.force.id == id and one.owner in (None, world.acting)]
            if gone:
                held[:] = [one for one in held if one not in gone]
                transaction.forced.add(obj)
            world.sum_forces(obj)
        return len(gone)


__all__ = ["Handles"]
