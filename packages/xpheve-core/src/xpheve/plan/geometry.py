"""A new shape for an object that is in an engine: bounds, contacts, mass and inertia follow, or nothing changes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from xpheve.errors import InvalidValueError
from xpheve.objects import PhysicalObject, inertia_with, mass_with
from xpheve.shapes.base import Shape

if TYPE_CHECKING:
    from xpheve.plan.world import World


def check_shape(world: World, obj: PhysicalObject, shape: Shape | None) -> None:
    """Raise if ``obj`` cannot have ``shape`` where it is, under its laws and forces."""
    if world.periodic is not None:
        from xpheve.plan import periodic

        periodic.check_shape(obj, shape, world.periodic, world.up_vector)
    mass = mass_with(obj, shape)
    inertia = inertia_with(obj, shape, mass)
    if not any(inertia) and any(any(one.force.torque) for one in world.forces.on(obj)):
        raise InvalidValueError(
            f"{obj!r}: shape = {shape!r} has no inertia while a torque acts; remove the torque first"
        )
    if world.contacts is None:
        return
    held, obj._shape = obj._shape, shape
    try:
        world.contacts.check(obj, list(world.mapping.laws(obj)))
    finally:
        obj._shape = held


def set_shape(world: World, obj: PhysicalObject, shape: Shape | None) -> None:
    """Give ``obj`` its new shape at this instant."""
    from xpheve.plan.scenery import restore_constant_forces

    check_shape(world, obj, shape)
    mass = mass_with(obj, shape)
    inertia = inertia_with(obj, shape, mass)
    held = obj._shape
    if world.contacts is not None:
        world.structure += 1  # flights that contacts are known along may be others now
    with world.instant() as transaction:
        transaction.touch(obj)
        transaction.undo.append(lambda: _put(world, obj, held))
        _put(world, obj, shape)
        transaction.write(obj, "mass", mass)
        transaction.write(obj, "inertia", inertia)
        # Forced: the version of the flight moves on, so that no contact foreseen for the old shape happens.
        transaction.forced.add(obj)
        transaction.refresh.add(obj)
        if obj not in world.unplanned:
            for name in ("mass", "inertia", "volume"):
                restore_constant_forces(world, obj, name)


def _put(world: World, obj: PhysicalObject, shape: Shape | None) -> None:
    """Let ``obj`` have ``shape``; its volume is to be asked for anew."""
    obj._shape = shape
    world.bodies.volume[obj._row] = math.nan
