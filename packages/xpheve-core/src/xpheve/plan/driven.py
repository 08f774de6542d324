"""Driven objects: the host prescribes how they move; they are sources for all others, and members of no group.

A driven object moves uniformly: ``velocity`` and ``angular_velocity`` constant in the world frame. It is outside the energy balance,
as a fixed object is: the work labelled ``driven`` is what it does on others, and what the host puts into or takes out of the scene
when it lets an object go or takes hold of it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from xpheve.errors import InvalidValueError, StateError
from xpheve.events import FORCE, Entry
from xpheve.forces import Vec
from xpheve.kernels.clock import Instant, later
from xpheve.kernels.quaternion import Quat, conjugate, multiply
from xpheve.kernels.vector import norm
from xpheve.laws import PairLaw

if TYPE_CHECKING:
    from xpheve.objects import PhysicalObject
    from xpheve.plan.transaction import Transaction
    from xpheve.plan.world import World

NONE: Vec = (0.0, 0.0, 0.0)
LABEL = "driven"


class Arrival(NamedTuple):
    """Where a carried object stands from ``at`` on."""

    at: Instant
    position: Vec
    orientation: Quat


def drive(
    world: World, obj: PhysicalObject, velocity: Vec | None, turning: Vec | None, arrival: Arrival | None = None
) -> None:
    """Let ``obj`` move uniformly from now on, until ``arrival`` if there is one; None keeps what it has."""
    from xpheve.plan.energy import share

    _check_can_be_driven(obj)
    with world.instant() as transaction:
        if not obj._driven and obj.rank >= 0:  # one that was never planned brings its energy with it when it is let go
            _book(world, -share(world, obj))
        transaction.touch(obj)
        _switch(world, transaction, obj, True)
        _set_motion(transaction, obj, velocity, turning)
        expect(world, transaction, obj, arrival)


def carry(world: World, obj: PhysicalObject, position: Vec | None, orientation: Quat | None, within: float) -> None:
    """Let ``obj`` move so that it arrives ``within`` seconds from now, and stands there."""
    _check_can_be_driven(obj)
    x: Vec = world.read_row(obj._row, "position")  # type: ignore[assignment]
    q: Quat = world.read_row(obj._row, "orientation")  # type: ignore[assignment]
    target, turned = x if position is None else position, q if orientation is None else orientation
    if world.periodic is not None:
        from xpheve.periodic import near_image

        target = near_image(target, x, world.periodic)
    way = [(there - here) / within for there, here in zip(target, x, strict=True)]
    turn = rotation_vector(multiply(turned, conjugate(q))) if turned != q else NONE
    turning = [angle / within for angle in turn]
    if not all(map(math.isfinite, [*way, *turning])):
        raise InvalidValueError(
            f"{obj!r}: carry from {x} to {target} within {within} s asks for a speed that no float can hold; give it longer"
        )
    arrival = Arrival(later(world.time, within), target, turned)
    drive(world, obj, (way[0], way[1], way[2]), (turning[0], turning[1], turning[2]), arrival)


def release(world: World, obj: PhysicalObject, velocity: Vec | None, turning: Vec | None) -> None:
    """Let ``obj`` go with the velocity it has, or the one given."""
    from xpheve.plan.energy import share

    if not obj._driven:
        raise StateError(f"release: {obj!r} is not driven; hold, carry or drive it first, or ask obj.driven")
    with world.instant() as transaction:
        transaction.touch(obj)
        _set_motion(transaction, obj, velocity, turning)
        expect(world, transaction, obj, None)
        _switch(world, transaction, obj, False)
        if obj.rank >= 0:
            _book(world, share(world, obj))


def _check_can_be_driven(obj: PhysicalObject) -> None:
    if obj.fixed:
        raise InvalidValueError(
            f"{obj!r} is fixed, so it cannot be held or carried: add it without fixed=True, and hold it where it is to stay"
        )


def _book(world: World, joules: float) -> None:
    if joules:
        world.add_work(LABEL, joules)


def _set_motion(transaction: Transaction, obj: PhysicalObject, velocity: Vec | None, turning: Vec | None) -> None:
    for name, value in (("velocity", velocity), ("angular_velocity", turning)):
        if value is not None:
            transaction.write(obj, name, value)
    transaction.forced.add(obj)


def _switch(world: World, transaction: Transaction, obj: PhysicalObject, driven: bool) -> None:
    """Take ``obj`` over from its group, or give it back, when the scene is planned next."""
    if obj._driven == driven:
        return

    def put(value: bool) -> None:
        obj._driven = value
        world.bodies.driven[obj._row] = value

    put(driven)
    transaction.undo.append(lambda: put(not driven))
    transaction.replan[obj] = None
    transaction.switched.add(obj)


def expect(world: World, transaction: Transaction, obj: PhysicalObject, arrival: Arrival | None) -> None:
    """``obj`` stops at ``arrival``, and nowhere else."""
    before = world.arrivals.get(obj)
    if before is None and arrival is None:
        return
    transaction.undo.append(lambda: _put_arrival(world, obj, before))
    _put_arrival(world, obj, arrival)
    if arrival is not None:
        watch(world, obj, arrival)


def _put_arrival(world: World, obj: PhysicalObject, arrival: Arrival | None) -> None:
    if arrival is None:
        world.arrivals.pop(obj, None)
    else:
        world.arrivals[obj] = arrival


def watch(world: World, obj: PhysicalObject, arrival: Arrival) -> None:
    """Queue ``arrival``."""
    end = _Arriving(world, obj, arrival)
    world.queue.push(Entry(arrival.at, FORCE, (obj.rank, obj.serial), end, stands=end.stands))


class _Arriving:
    """The end of a carry."""

    def __init__(self, world: World, obj: PhysicalObject, arrival: Arrival) -> None:
        self.world, self.obj, self.arrival = world, obj, arrival

    def stands(self) -> bool:
        """Whether the object is still expected there."""
        return self.world.arrivals.get(self.obj) is self.arrival

    def __call__(self, entries: list[Entry]) -> None:
        world, obj, arrival = self.world, self.obj, self.arrival
        if not self.stands():
            return
        with world.instant() as transaction:
            row = transaction.touch(obj)
            world.bodies.put("position", row, arrival.position)
            world.bodies.put("orientation", row, arrival.orientation)
            world.bodies.put("velocity", row, NONE)
            world.bodies.put("angular_velocity", row, NONE)
            transaction.forced.add(obj)
            expect(world, transaction, obj, None)


def immovable(obj: PhysicalObject) -> bool:
    """Whether nothing in the scene can change the motion of ``obj``: it is fixed, or driven."""
    return obj._fixed or obj._driven


def dependents(world: World, obj: PhysicalObject) -> list[PhysicalObject]:
    """The objects that pair laws let an immovable ``obj`` act on, by rank."""
    from xpheve.plan.groups import partners

    found: dict[PhysicalObject, None] = {}
    for law in world.mapping.laws(obj):
        if (
            isinstance(law, PairLaw)
            and law.enabled
            and not law.containers
            and (not law.one_sided or law.side_of(obj) == 1)
        ):
            for _, others in partners(world, law, obj):
                found.update((other, None) for other in others if other is not obj and not immovable(other))
    return world.in_rank_order(found)


def rotation_vector(q: Quat) -> Vec:
    """The turn ``q`` as axis times angle [rad], the shorter way round: angle at most pi."""
    w, x, y, z = q if q[0] >= 0.0 else (-q[0], -q[1], -q[2], -q[3])
    sine = norm((x, y, z))
    if sine == 0.0:
        return NONE
    angle = 2.0 * math.atan2(sine, w)
    return x / sine * angle, y / sine * angle, z / sine * angle
