"""The objects of an engine: which laws they obey, and what the host prescribes of them."""

from __future__ import annotations

from collections.abc import Iterable

from xpheve.engine.laws import Laws
from xpheve.errors import InvalidValueError
from xpheve.kernels.clock import later
from xpheve.kernels.vector import Vec
from xpheve.laws import PhysicalLaw
from xpheve.objects import PhysicalObject, Quat
from xpheve.plan import driven, geometry, scenery, successors
from xpheve.realtime.doors import door
from xpheve.shapes.base import Shape


class Objects(Laws):
    """The part of `PhysicsEngine` that takes objects in and out, maps them, and moves them for the host."""

    def add_object(self, obj: PhysicalObject, laws: Iterable[PhysicalLaw | str] = ()) -> PhysicalObject:
        """Add one object, obeying ``laws`` (laws of this engine, or their names), at the present time; returns it."""
        return self.add_objects([obj], laws)[0]

    @door(waits=True)
    def add_objects(
        self, objects: Iterable[PhysicalObject], laws: Iterable[PhysicalLaw | str] = ()
    ) -> tuple[PhysicalObject, ...]:
        """Add many objects, all obeying ``laws``; all or none.

        Raises
        ------
        OwnershipError
            If an object or law belongs elsewhere.
        InvalidValueError
            If a name is taken.
        ConflictError
            If two of the laws exclude one another.
        """
        if isinstance(objects, PhysicalObject):
            raise InvalidValueError(f"add_objects({objects!r}): many are needed, as a list; add_object takes one")
        added = tuple(objects)
        obeyed = [self._own_law(law) for law in ([laws] if isinstance(laws, (str, PhysicalLaw)) else laws)]
        scenery.check_objects(self._world, self, added, obeyed)
        if self._world.transaction is not None:
            self._world.transaction.coming += added
        self._structurally(lambda: scenery.add_objects(self._world, self, added, obeyed))
        return added

    @door(waits=True)
    def remove_object(self, obj: PhysicalObject) -> PhysicalObject:
        """Take an object out; it keeps its last state. In a handler: at the end of the instant."""
        self._check_own(obj)
        self._structurally(lambda: scenery.remove_object(self._world, obj) if obj._engine is self else None)
        return obj

    @door(waits=True)
    def replace_object(
        self,
        obj: PhysicalObject,
        new: PhysicalObject | Iterable[PhysicalObject],
        laws: Iterable[PhysicalLaw | str] | None = None,
    ) -> tuple[PhysicalObject, ...]:
        """Take ``obj`` out and ``new`` objects in, at this instant; in a handler at its end, after all handlers. Returns the new ones.

        They obey ``laws``; None stands for those of ``obj``, but for pair laws that name their objects. Their states are their own.

        Raises
        ------
        InvalidValueError
            If ``obj`` has a successor at this instant already; and as `add_objects` does.
        """
        added, obeyed = self._successors(obj, new, laws)
        successors.check_once(self._world, obj)
        self._coming(added)
        self._structurally(
            lambda: successors.replace(self._world, self, obj, added, obeyed) if obj._engine is self else None
        )
        return added

    @door(waits=True)
    def split_object(
        self,
        obj: PhysicalObject,
        parts: Iterable[PhysicalObject],
        laws: Iterable[PhysicalLaw | str] | None = None,
        *,
        conserve: bool = True,
    ) -> tuple[PhysicalObject, ...]:
        """Let ``obj`` come apart into ``parts`` at this instant; in a handler at its end, after all handlers. Returns the parts.

        Parts are put where their ``position`` says, and move on as the rigid ``obj`` moves there; their own ``velocity`` and
        ``angular_velocity`` come on top. Mass, momentum and angular momentum are kept; kinetic energy that they gain is work of ``"split"``.

        Parameters
        ----------
        obj
            What comes apart; neither fixed nor driven.
        parts
            New objects, in no engine, none of them fixed.
        laws
            As in `replace_object`.
        conserve
            Whether parts that would change mass, momentum or angular momentum are refused.

        Raises
        ------
        InvalidValueError
            If they are refused, with the numbers; and as in `replace_object`.
        """
        added, obeyed = self._successors(obj, parts, laws)
        successors.check_parts(obj, added, conserve)
        successors.check_once(self._world, obj)
        self._coming(added)
        world, here = self._world, obj.position
        self._structurally(
            lambda: successors.split(world, self, obj, added, obeyed, here, conserve) if obj._engine is self else None
        )
        return added

    def _successors(
        self,
        obj: PhysicalObject,
        new: PhysicalObject | Iterable[PhysicalObject],
        laws: Iterable[PhysicalLaw | str] | None,
    ) -> tuple[tuple[PhysicalObject, ...], list[PhysicalLaw]]:
        """What takes the place of ``obj``, and the laws it will obey, both checked."""
        self._check_own(obj)
        added = (new,) if isinstance(new, PhysicalObject) else tuple(new)
        obeyed = successors.laws_of(self._world, obj) if laws is None else [self._own_law(law) for law in laws]
        scenery.check_objects(self._world, self, added, obeyed)
        return added, obeyed

    def _coming(self, added: tuple[PhysicalObject, ...]) -> None:
        if self._world.transaction is not None:
            self._world.transaction.coming += added

    @door(waits=True)
    def map(self, obj: PhysicalObject, law: PhysicalLaw | str) -> None:
        """Let ``obj`` obey ``law`` from now on."""
        self._check_own(obj)
        found = self._own_law(law)
        transaction = self._world.transaction
        coming = transaction.mapped.setdefault(obj, []) if transaction is not None else []
        self._world.mapping.check(obj, [*coming, found])
        coming.append(found)
        self._structurally(lambda: scenery.map_law(self._world, obj, found))

    @door(waits=True)
    def unmap(self, obj: PhysicalObject, law: PhysicalLaw | str) -> None:
        """Let ``obj`` no longer obey ``law``; forces the law stored on it are withdrawn."""
        self._check_own(obj)
        found = self._own_law(law)
        self._structurally(lambda: scenery.unmap_law(self._world, obj, found))

    # What the host prescribes

    @door()
    def hold(self, obj: PhysicalObject) -> None:
        """Let ``obj`` stand where it is; see `PhysicalObject.hold`."""
        self.drive(obj, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

    @door()
    def drive(
        self,
        obj: PhysicalObject,
        velocity: Vec | None = None,
        angular_velocity: Vec | None = None,
        until: tuple[Vec, Quat, float] | None = None,
    ) -> None:
        """Let ``obj`` move uniformly; see `PhysicalObject.drive`.

        ``until`` is a position and an orientation that it has after a time [s] and keeps then; for scene files, whose velocities lead there.
        """
        self._check_own(obj)
        world = self._world
        arrival = None if until is None else driven.Arrival(later(world.time, until[2]), until[0], until[1])
        driven.drive(world, obj, velocity, angular_velocity, arrival)

    @door()
    def carry(self, obj: PhysicalObject, position: Vec | None, orientation: Quat | None, within: float) -> None:
        """Let ``obj`` move so that it arrives after ``within`` [s]; see `PhysicalObject.carry`."""
        self._check_own(obj)
        driven.carry(self._world, obj, position, orientation, within)

    @door()
    def release(self, obj: PhysicalObject, velocity: Vec | None = None, angular_velocity: Vec | None = None) -> None:
        """Let ``obj`` go; see `PhysicalObject.release`."""
        self._check_own(obj)
        driven.release(self._world, obj, velocity, angular_velocity)

    @door(waits=True)
    def set_shape(self, obj: PhysicalObject, shape: Shape | None) -> None:
        """Give ``obj`` another shape: at once, or at the end of the instant while a handler runs."""
        self._check_own(obj)
        geometry.check_shape(self._world, obj, shape)
        self._structurally(lambda: geometry.set_shape(self._world, obj, shape) if obj._engine is self else None)


__all__ = ["Objects"]
