"""PhysicsEngine: the front door, and the story of a run."""

from __future__ import annotations

import contextlib
import json
import math
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from threading import get_ident
from typing import Any

import numpy as np

from xpheve.bodies import STATE_WIDTHS, BodiesView
from xpheve.errors import (
    InvalidValueError,
    LawDefinitionError,
    LawFailedError,
    OwnershipError,
    PackError,
    RecordError,
    StateError,
    UnknownLawError,
    XpheveError,
)
from xpheve.forces import Force
from xpheve.kernels.clock import NEVER, Instant, elapsed, later, multiple
from xpheve.laws import Contact, ContinuousLaw, Event, FieldLaw, LawContainer, PairLaw, PhysicalLaw, ResponseLaw
from xpheve.laws import conditions as when
from xpheve.objects import PhysicalObject, Quat
from xpheve.observers import Observer, Probe
from xpheve.plan import driven, geometry, scenery
from xpheve.plan import energy as conserved
from xpheve.plan.energy import Energy
from xpheve.plan.stored import StoredForce
from xpheve.plan.wakeups.references import check_references
from xpheve.plan.world import World
from xpheve.plugins.registry import Registry
from xpheve.realtime.control import ATOL, RTOL, Control
from xpheve.realtime.control import seconds as _number
from xpheve.realtime.doors import door, look
from xpheve.realtime.states import check
from xpheve.shapes.base import Shape
from xpheve.steppers.contract import Settings, Stepper

Vec = tuple[float, float, float]


class PhysicsEngine(Control):
    """Objects, laws and time.

    Parameters
    ----------
    up
        The axis that points up: ``"x"``, ``"y"`` or ``"z"``.
    seed
        Of the laws' random numbers.
    registry
        Where packs are found; by default the installed ones.
    disable
        Packs, distributions or ids that must not be used.
    on_law_error
        ``"raise"``, or ``"disable"`` to switch off a law that fails, with a warning, and go on.

    Raises
    ------
    InvalidValueError
        If a setting is not one of those.
    """

    def __init__(
        self,
        *,
        up: str = "y",
        seed: int = 0,
        registry: Registry | None = None,
        disable: Sequence[str] = (),
        on_law_error: str = "raise",
    ) -> None:
        if up not in ("x", "y", "z"):
            raise InvalidValueError(f"up = {up!r}: choose 'x', 'y' or 'z'")
        if on_law_error not in ("raise", "disable"):
            raise InvalidValueError(f"on_law_error = {on_law_error!r}: choose 'raise' or 'disable'")
        if not isinstance(seed, int) or seed < 0:
            raise InvalidValueError(f"seed = {seed!r}: a whole number from 0 up is needed")
        self._registry = registry
        self._disable = tuple(disable)
        self._on_law_error = on_law_error
        self._state = "ready"
        self._started = False
        self._running = False
        self._authored: Any = None
        self._prepare_control()
        self._view = BodiesView(lambda: self._world.bodies, self._now, self._read_column, lambda: self.snapshot)
        self._renew(World(up, seed, self._all_steppers))
        registry_now = self.registry
        registry_now.call("xpheve_engine_created", engine=self)

    def _renew(self, world: World) -> None:
        """Take up ``world``."""
        self._world = world
        world.on_law_error = self._on_law_error
        world.stopped = self._halted  # type: ignore[method-assign]

    @property
    def registry(self) -> Registry:
        """Where packs are found."""
        if self._registry is None:
            self._registry = Registry(disable=self._disable) if self._disable else Registry.default()
        return self._registry

    def _all_steppers(self) -> list[Stepper]:
        from xpheve.steppers.ballistic import Ballistic
        from xpheve.steppers.midpoint import Midpoint

        return [Ballistic(), Midpoint(), *(found() for found in self.registry.steppers().values())]

    # What is in the engine

    @property
    def time(self) -> float:
        """Simulation time [s]."""
        live = self._live
        if live is not None and live.holder != get_ident():
            return self._seen(live).time
        return self._world.time[0]

    @property
    def up(self) -> str:
        """The axis that points up."""
        return self._world.up

    @property
    def seed(self) -> int:
        """Seed of the laws' random numbers."""
        return self._world.seed

    @property
    def state(self) -> str:
        """``"ready"``, ``"running"``, ``"suspended"``, ``"failed"`` or ``"terminated"``."""
        return self._state

    @property
    def objects(self) -> tuple[PhysicalObject, ...]:
        """All objects, in the order of the rows of `bodies`; removing one moves the last into its place."""
        live = self._live
        if live is not None and live.holder != get_ident():
            return self._seen(live).objects
        return tuple(self._world.bodies.objects)

    @property
    def laws(self) -> tuple[PhysicalLaw, ...]:
        """All laws, as added."""
        return tuple(self._world.laws)

    @property
    def containers(self) -> tuple[LawContainer, ...]:
        """All containers, as added."""
        return tuple(self._world.containers)

    @property
    def bodies(self) -> BodiesView:
        """All objects as read-only arrays at the present time."""
        return self._view

    def object(self, name: str) -> PhysicalObject:
        """The object called ``name``. Raises `InvalidValueError`."""
        for obj in self.objects:
            if obj.name == name:
                return obj
        from xpheve.plugins.suggest import did_you_mean

        names = [obj.name for obj in self.objects if obj.name]
        raise InvalidValueError(f"no object is named {name!r}.{did_you_mean(name, names)}")

    def law(self, name: str) -> PhysicalLaw:
        """The law called ``name``, or with that id if there is one only. Raises `UnknownLawError`."""
        found = [law for law in self._world.laws if law.name == name] or [
            law for law in self._world.laws if law.label() == name
        ]
        if len(found) == 1:
            return found[0]
        if found:
            raise UnknownLawError(f"{len(found)} laws here are {name!r}: give them names, and ask by name")
        at_hand = ", ".join(law.name or law.label() for law in self._world.laws) or "none"
        raise UnknownLawError(f"no law here is {name!r}; at hand: {at_hand}")

    # Laws and containers

    @door(waits=True)
    def add_law(
        self,
        law: str | PhysicalLaw | type[PhysicalLaw],
        container: LawContainer | type[LawContainer] | str | None = None,
        **parameters: Any,
    ) -> PhysicalLaw:
        """Add a law by id, by class, or made; ``parameters``, ``name``, ``enabled`` and ``between`` go to the first two.

        ``container`` says when it is enforced; by default what the law itself asks for.

        Raises
        ------
        UnknownLawError, BrokenPackError, ParameterError, LawDefinitionError, NotAcceptedError, OwnershipError
            Before anything changes.
        """
        made = self._make_law(law, parameters)
        world = self._world
        if made.engine is not None:
            where = "this engine already" if made.engine is self else "another engine"
            raise OwnershipError(f"{made!r} is in {where}; make another: type(law)(**law.parameters)")
        if made.name and any(other.name == made.name for other in self._world.laws):
            raise InvalidValueError(
                f"a law named {made.name!r} is in the engine already; names are unique: choose another"
            )
        for side in getattr(made, "between", None) or ():
            for obj in side:
                if obj._engine is not self:
                    raise OwnershipError(
                        f"{made.label()}: between names {obj!r}, which is not in this engine: add it first"
                    )
        holder = self._container_for(made, container)
        if holder is not None:
            holder.check(made)
        if holder is not None and holder.engine is None:
            self.add_container(holder)
        self._take_law(made)
        if holder is not None:
            holder.add_law(made)
        if isinstance(made, PairLaw) and made.between is not None:
            for obj in {obj: None for side in made.between for obj in side}:
                scenery.map_law(world, obj, made)
        return made

    def _make_law(self, law: str | PhysicalLaw | type[PhysicalLaw], parameters: dict[str, Any]) -> PhysicalLaw:
        if isinstance(law, PhysicalLaw):
            if parameters:
                raise InvalidValueError(f"{law!r} is made already; set {', '.join(parameters)} on it before adding")
            if not law.is_concrete():
                raise LawDefinitionError(f"{law!r} says nothing yet: write its force, respond or enforce_this_law")
            return law
        kind = self.registry.law(law) if isinstance(law, str) else law
        if not (isinstance(kind, type) and issubclass(kind, PhysicalLaw)):
            raise InvalidValueError(
                f"{law!r} is no law: give an id such as 'basic:planet_gravity', a PhysicalLaw class, or a law"
            )
        if not kind.is_concrete():
            raise LawDefinitionError(f"{kind.__name__} says nothing yet: write its force, respond or enforce_this_law")
        if not isinstance(law, str) and kind.id:
            from xpheve.plugins.spec import check_spec, spec_of

            check_spec(spec_of(kind), kind)
        return kind(**parameters)

    def _container_for(
        self, law: PhysicalLaw, container: LawContainer | type[LawContainer] | str | None
    ) -> LawContainer | None:
        """The container for ``law``: the one given, one of the same kind and condition, or a new one; None for laws that act all the time."""
        if isinstance(container, LawContainer):
            if container.engine is not self:
                self._check_container(container)
            return container
        if container is not None and not isinstance(container, str):
            if not (isinstance(container, type) and issubclass(container, LawContainer)):
                raise InvalidValueError(f"container = {container!r}: give a LawContainer, its class, or its id")
        if container is None:
            if law.container:
                container = law.container
            elif law.condition is None:
                if not isinstance(law, ContinuousLaw):
                    raise InvalidValueError(
                        f"{law!r} does not say when: give add_law(law, container=LawContainer(condition)), or set `condition` on the class"
                    )
                return None
        kind = self.registry.container(container) if isinstance(container, str) else container or LawContainer
        condition = None if kind.condition is not None or kind.detects() else law.condition
        usual = {key: param.default for key, param in kind.params.items()}
        for held in self._world.containers:
            same = held.condition == (kind.condition if condition is None else condition) and held.parameters == usual
            if type(held) is kind and same and not held.name and held not in self._world.spent:
                return held
        return kind(condition)

    @door(waits=True)
    def add_container(self, container: LawContainer) -> LawContainer:
        """Add a container; laws may be in it already or come later (`LawContainer.add_law`)."""
        world = self._world
        if isinstance(container, LawContainer) and container.engine is self:
            return container
        self._check_container(container)
        if container.condition is not None and container.condition.served_by == "contacts":
            self._serve_contacts()
        container.engine = self
        world.structure += 1
        world.containers.append(container)
        world.dirty = True
        if world.transaction is not None:
            world.transaction.undo.append(lambda: scenery.remove_container(world, container))
        for law in container.laws:
            if law.engine is None:
                self._take_law(law)
        return container

    def _check_container(self, container: LawContainer) -> None:
        """Raise if ``container`` cannot be added."""
        if not isinstance(container, LawContainer):
            raise InvalidValueError(f"container = {container!r}: give a LawContainer")
        if container.engine is not None:
            raise OwnershipError(f"{container!r} is in another engine")
        if container.condition is None and not container.is_polled:
            raise InvalidValueError(f"{container!r} has no condition: LawContainer(condition), or override detect")
        check_references(self, container)
        period = container.period
        if (
            container.is_polled
            and period is not None
            and not (isinstance(period, (int, float)) and 0 < period < math.inf)
        ):
            raise InvalidValueError(
                f"{container!r}: period = {period!r}: a finite time above 0 s is needed, or None for host steps"
            )
        if container.name and any(other.name == container.name for other in self._world.containers):
            raise InvalidValueError(
                f"a container named {container.name!r} is in the engine already; names are unique: choose another"
            )
        for law in container.laws:
            if law.engine not in (None, self):
                raise OwnershipError(f"{container!r} holds {law!r}, which is in another engine")

    def _take_law(self, law: PhysicalLaw) -> None:
        """``law``, checked, is in this engine from now on."""
        world = self._world
        world.laws[law] = max(world.laws.values(), default=0) + 1
        law.engine = self
        world.structure += 1
        world.dirty = True
        if world.transaction is not None:
            world.transaction.undo.append(lambda: scenery.forget_law(world, law))

    def adopt_law(self, law: PhysicalLaw) -> None:
        """``law`` is about to be put into a container of this engine: it comes along, unless it is elsewhere."""
        if law.engine is None:
            self._check_law_name(law)
            self._take_law(law)
        elif law.engine is not self:
            raise OwnershipError(f"{law!r} is in another engine; make another: type(law)(**law.parameters)")
        self._world.structure += 1

    @door(waits=True)
    def put_law(self, container: LawContainer, law: PhysicalLaw) -> None:
        """Put ``law`` into ``container`` of this engine: `LawContainer.add_law`."""
        container.check(law)
        self.adopt_law(law)
        container.put(law)

    @door(waits=True)
    def take_law_out(self, container: LawContainer, law: PhysicalLaw) -> None:
        """Take ``law`` out of ``container`` of this engine: `LawContainer.remove_law`."""
        container.take_out(law)

    def _check_law_name(self, law: PhysicalLaw) -> None:
        if law.name and any(other.name == law.name for other in self._world.laws):
            raise InvalidValueError(
                f"a law named {law.name!r} is in the engine already; names are unique: choose another"
            )

    def _serve_contacts(self) -> None:
        """Take up the contact server of the pack that offers one."""
        if self._world.contacts is not None:
            return
        servers = self.registry.contact_servers()
        if not servers:
            with contextlib.suppress(UnknownLawError):
                self.registry.find("contact_server", "collision:exact_server")
            servers = self.registry.contact_servers()
        if not servers:
            raise UnknownLawError("no pack at hand finds contacts: pip install xpheve-laws-collision")
        server = servers[min(servers)]()
        server.attach(self._world)
        self._world.contacts = server

    @door(waits=True)
    def remove_law(self, law: PhysicalLaw | str) -> None:
        """Take a law out with its mappings; forces it stored are withdrawn."""
        found = self._own_law(law)
        self._structurally(lambda: scenery.remove_law(self._world, found) if found.engine is self else None)

    @door(waits=True)
    def remove_container(self, container: LawContainer) -> None:
        """Take a container out; its laws stay in the engine."""
        if not isinstance(container, LawContainer) or container.engine is not self:
            raise OwnershipError(f"{container!r} is no container of this engine")
        self._structurally(lambda: scenery.remove_container(self._world, container))

    def _own_law(self, law: PhysicalLaw | str) -> PhysicalLaw:
        found = self.law(law) if isinstance(law, str) else law
        if not isinstance(found, PhysicalLaw) or found.engine is not self:
            raise OwnershipError(f"{law!r} is not in this engine: add it with engine.add_law first")
        return found

    # Objects and mapping

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

    def _structurally(self, act: Callable[[], None]) -> None:
        """Do ``act`` now, or at the end of the instant while a handler runs."""
        transaction = self._world.transaction
        if transaction is None:
            act()
        else:
            transaction.later.append(act)

    def _check_own(self, obj: PhysicalObject) -> None:
        if not isinstance(obj, PhysicalObject) or obj._engine is not self:
            raise OwnershipError(f"{obj!r} is not in this engine: add it with engine.add_object")

    def owns(self, obj: PhysicalObject) -> bool:
        """Whether the handle ``obj`` stands for the row it names."""
        live = self._live
        if live is not None and live.holder != get_ident():
            return True  # it is here, and rows may be on the move; a write looks again when it is done
        objects = self._world.bodies.objects
        return 0 <= obj._row < len(objects) and objects[obj._row] is obj

    @look
    def laws_of(self, obj: PhysicalObject) -> tuple[PhysicalLaw, ...]:
        """The laws that ``obj`` obeys, in rank order."""
        return tuple(self._world.ordered_laws(self._world.mapping.laws(obj)))

    @look
    def objects_of(self, law: PhysicalLaw) -> tuple[PhysicalObject, ...]:
        """The objects that obey ``law``, in rank order."""
        return tuple(self._world.in_rank_order(self._world.mapping.objects(law)))

    # What handles ask for

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
        found = world.read_row(obj._row, name, t)
        return found[0] if name == "mass" else found

    @door()
    def write_object(self, obj: PhysicalObject, name: str, value: Any) -> None:
        """Set a property of ``obj`` at the present time."""
        world = self._world
        if name == "inertia" and not any(value) and any(any(one.force.torque) for one in world.forces.on(obj)):
            raise InvalidValueError(f"{obj!r}: inertia = {value} while a torque acts on it; remove the torque first")
        with world.instant() as transaction:
            transaction.write(obj, name, value)
            if name in STATE_WIDTHS:
                driven.expect(world, transaction, obj, None)
            if name in ("mass", "inertia"):
                scenery.restore_constant_forces(world, obj, name)

    @property
    def is_mine(self) -> bool:
        """Whether the calling thread may touch the scene itself; others see the last snapshot of a started engine."""
        live = self._live
        return live is None or live.holder == get_ident()

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

    # What laws ask for (xpheve.laws.law.LawHost)

    @contextlib.contextmanager
    def acting(self, law: PhysicalLaw) -> Iterator[None]:
        """While ``law`` runs: what it adds is its own; its declared state is taken back if it fails."""
        world = self._world
        before, world.acting = world.acting, law
        kept = {key: list(value) if isinstance(value, list) else value for key, value in law.state.items()}
        if world.transaction is not None:
            world.transaction.undo.append(lambda: _put_state(law, kept))
        try:
            yield
        except BaseException:
            raise  # `acting` stays, so that the error can name the law
        world.acting = before

    @door()
    def set_parameter(self, law: PhysicalLaw, name: str, value: Any) -> None:
        """Set a parameter of ``law``, checked: `PhysicalLaw.set_parameter`."""
        law.put_parameter(name, value)

    @door(waits=True)
    def set_enabled(self, law: PhysicalLaw, value: bool) -> None:
        """Switch ``law``: `PhysicalLaw.enabled`."""
        law.put_enabled(value)

    def law_changed(self, law: PhysicalLaw, what: str, old: Any) -> None:
        """A parameter of ``law``, or whether it is enabled, was set: it takes effect now, or not at all."""
        world = self._world
        try:
            if world.transaction is not None:
                world.transaction.undo.append(lambda: _put_law(law, what, old))
                if what == "enabled":
                    world.transaction.later.append(lambda: scenery.law_changed(world, law, what))
                    return
            scenery.law_changed(world, law, what)
        except BaseException:
            _put_law(law, what, old)
            raise

    def evaluate_and_store(self, law: PhysicalLaw) -> None:
        """Evaluate a field law in an event container once, and store its force until the next event."""
        world = self._world
        if not isinstance(law, FieldLaw):
            raise InvalidValueError(f"{law!r}: only field laws can be stored at events; leave container=None")
        objects = [obj for obj in world.in_rank_order(world.mapping.objects(law)) if not obj.fixed]
        if not objects:
            return
        rows = np.array([obj._row for obj in objects], dtype=np.int64)
        time = later(world.time, world.ahead) if world.ahead else world.time
        force, torque = world.evaluator.field(
            law,
            rows,
            time[0],
            lambda name: np.array([self._world.read_row(int(row), name, time) for row in rows]).T,
            set(),
        )
        with world.instant():
            world._store(law, objects, force, torque)
            world.renewed.update((law, obj) for obj in objects)
            for obj in objects:
                world.sum_forces(obj)

    def answer_contacts(self, law: ResponseLaw, contacts: tuple[Contact, ...]) -> None:
        """Let ``law`` answer ``contacts`` that a polled container found now; those that approach get impulses."""
        if contacts:
            self._serve_contacts()
            with self._world.instant():
                assert self._world.contacts is not None
                self._world.contacts.answer(law, contacts)

    def random_stream(self, law: PhysicalLaw) -> np.random.Generator:
        """The random numbers of ``law``: seeded by the scene's seed and the law's rank."""
        world = self._world
        if law not in world.streams:
            rank = world.ranks.law_ranks.get(law, world.laws[law])
            world.streams[law] = np.random.default_rng([world.seed, rank])
        stream: np.random.Generator = world.streams[law]
        if world.transaction is not None:
            kept = stream.bit_generator.state
            world.transaction.undo.append(lambda: setattr(stream.bit_generator, "state", kept))
        return stream

    @door()
    def post(self, id: Any, data: Any = None, source: Any = None) -> None:
        """Post ``id``: containers armed with a fitting `xpheve.when.Posted` wake at this instant of simulation time."""
        world = self._world
        sender = source if source is not None else world.acting
        self._structurally(
            lambda: world.tell(
                when.Posted,
                lambda container, condition: condition.id in (None, id) and condition.source in (None, sender),
                Event(world.time[0], id=id, data=data, source=sender),
            )
        )

    @door()
    def input(self, kind: str, data: Any = None) -> None:
        """Hand ``data`` in: containers armed with a fitting `xpheve.when.Input` wake at this instant, with all inputs of it together."""
        self._structurally(lambda: self._world.wakeups.inputs.put(kind, data))

    # Observers and probes

    @property
    def observers(self) -> tuple[Observer, ...]:
        """All observers, as added."""
        return tuple(one for one in self._world.wakeups.points.values() if isinstance(one, Observer))

    @property
    def probes(self) -> tuple[Probe, ...]:
        """All probes, as added."""
        return tuple(one for one in self._world.wakeups.points.values() if not isinstance(one, Observer))

    @door(waits=True)
    def add_observer(self, observer: Observer) -> Observer:
        """Add an observer, for conditions of regions; returns it. Raises `InvalidValueError`, `OwnershipError`."""
        found: Observer = self._world.wakeups.add_point(self, observer, Observer)
        return found

    @door(waits=True)
    def add_probe(self, probe: Probe) -> Probe:
        """Add a probe, for conditions of regions; returns it. Raises `InvalidValueError`, `OwnershipError`."""
        found: Probe = self._world.wakeups.add_point(self, probe, Probe)
        return found

    @door(waits=True)
    def remove_observer(self, observer: Observer) -> None:
        """Take an observer out. Raises `OwnershipError`."""
        self._world.wakeups.remove_point(self, observer)

    @door(waits=True)
    def remove_probe(self, probe: Probe) -> None:
        """Take a probe out. Raises `OwnershipError`."""
        self._world.wakeups.remove_point(self, probe)

    @door()
    def move_point(self, point: Probe, position: Vec) -> None:
        """Put an observer or probe at ``position`` [m], checked: `Probe.position`."""
        self._world.wakeups.move_point(point, position)

    # Time

    def run(
        self,
        until: float,
        *,
        dt: float | None = None,
        rtol: float | None = None,
        atol: float | None = None,
        every: float | None = None,
        record: str | os.PathLike[str] | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> Any:
        """Carry the scene to simulation time ``until`` [s], events at ``until`` included.

        Parameters
        ----------
        dt
            Length [s] of a host step; without it motion is exact or kept to the tolerances.
        rtol, atol
            Relative and absolute tolerance in SciPy's meaning, where motion is not exact; not with ``dt``.
        every
            Keep a record with a frame each ``every`` [s]; it never changes the motion.
        record
            A file for the record in place of memory.
        progress
            Called with the time [s] after each frame.

        Returns
        -------
        xpheve.record.Record or None
            With ``every`` the record, else None.

        Raises
        ------
        StateError
            If the engine is suspended, terminated or running, or the scene needs steps and has none.
        InvalidValueError
            If ``until`` lies in the past, or a number makes no sense.
        LawFailedError, ContactError, NoStepperError
            From the scene; the engine then stands just before the failing event.
        """
        end, settings = self._check_run(until, dt, rtol, atol, every)
        if record is not None and every is None:
            raise InvalidValueError("record= needs every=: how often [s] to keep a frame")
        self._begin(settings)
        recorder = None
        try:
            self._running = True
            self._state = "running"
            if every is not None:
                from xpheve.record import Recorder

                recorder = Recorder(self, record, self._metadata(every))
            self._carry(end, every, recorder, progress)
        finally:
            self._running = False
            if self._state == "running":
                self._state = "ready"
            failed = {law.label(): what for law, what in self._world.failed.items()}
            note = {"disabled_by_error": failed} if failed else None
            found = recorder.close(note) if recorder is not None else None
        return found

    def _check_run(
        self, until: float, dt: float | None, rtol: float | None, atol: float | None, every: float | None
    ) -> tuple[Instant, Settings]:
        self._surface()
        check(self, "run")
        end = _number(until, "until")
        if end < self.time:
            raise InvalidValueError(
                f"until = {end} s lies before the present time {self.time} s; reset() goes back to 0"
            )
        for value, name in ((dt, "dt"), (rtol, "rtol"), (atol, "atol"), (every, "every")):
            if value is not None and _number(value, name) <= 0:
                raise InvalidValueError(f"{name} = {value}: a number above 0 is needed")
        if dt is not None and (rtol is not None or atol is not None):
            raise InvalidValueError("give dt, or rtol and atol, not both: with dt every step has that length")
        self._check_contacts_of_steps(dt)
        return (max((end, 0.0), self._world.time)), Settings(dt, rtol or RTOL, atol or ATOL)

    def _check_contacts_of_steps(self, dt: float | None) -> None:
        listeners = self._world.host_step_listeners(demanding=True)
        if dt is None and listeners:
            raise StateError(
                f"{listeners[0]!r} asks for host steps, and run(until=...) has none; event-driven motion has no steps. "
                "Give run(until=..., dt=...), or a condition in time such as Elapsed(seconds, every=True)"
            )

    def _begin(self, settings: Settings) -> None:
        """What happens once before time passes."""
        world = self._world
        if not self._started:
            try:
                world.plan()
            except LawFailedError as error:
                world.give_up(error)
                self._begin(settings)
                return
            self._authored = self._save()
            self._started = True
            world.tell(when.Started, lambda container, condition: True, Event(self.time, objects=()))
        world.settings = settings
        if settings.dt is not None and (world.grid is None or world.grid[1] != settings.dt):
            world.grid = (world.time, settings.dt, -1)

    def _carry(
        self, end: Instant, every: float | None, recorder: Any, progress: Callable[[float], None] | None
    ) -> None:
        """To ``end``, with a frame each ``every``."""
        begin, k = self._world.time, 0
        while every is not None:
            sample = multiple(begin, k, every)
            if sample[0] > end[0]:
                break
            if not self._pass_time(min(sample, end)):  # a frame that reads as the end is the end: looking moves nothing
                return
            recorder.sample()
            if progress is not None:
                progress(self.time)
            k += 1
        if (
            self._pass_time(end)
            and recorder is not None
            and (k == 0 or multiple(begin, k - 1, every or 0.0)[0] < end[0])
        ):
            recorder.sample()
        if progress is not None:
            progress(self.time)

    def _pass_time(self, end: Instant) -> bool:
        """To ``end``, host step by host step if somebody listens to them; False if a handler stopped the engine."""
        world = self._world
        while world.settings.dt is not None and world.host_step_listeners():
            origin, dt, done = world.grid  # type: ignore[misc]
            start = multiple(origin, done + 1, dt)
            if start[0] < world.time[0]:  # steps went by while nobody listened
                number = max(done + 1, int(elapsed(world.time, origin) / dt) - 1)
                while multiple(origin, number, dt)[0] < world.time[0]:
                    number += 1
                world.grid = (origin, dt, number - 1)
                continue
            if start[0] >= end[0]:
                end = min(end, start)  # a step that begins as the run ends is the next run's, at its own exact instant
                break
            world.pass_time(start, self._next_host_step)
            if self._halted():
                return False
            try:
                world.plan()
                world.host_step(done + 1, dt)
            except LawFailedError as error:
                world.give_up(error)
                continue
            world.grid = (origin, dt, done + 1)
            if self._halted():
                return False
        world.pass_time(end, self._next_host_step)
        return self._state == "running"

    def _next_host_step(self, t: Instant) -> Instant:
        """The first host step after ``t``; never, without ``dt``."""
        world = self._world
        if world.settings.dt is None or world.grid is None:
            return NEVER
        origin, dt, _ = world.grid
        number = max(0, int(elapsed(t, origin) / dt) - 1)
        while multiple(origin, number, dt) <= t:
            number += 1
        return multiple(origin, number, dt)

    def step(self, dt: float) -> None:
        """One host step: to the next point of the grid of ``dt`` [s]; the same grid as ``run(dt=...)``."""
        self._surface()
        check(self, "step")
        if _number(dt, "dt") <= 0:
            raise InvalidValueError(f"dt = {dt}: a number above 0 is needed")
        self._begin(Settings(dt, RTOL, ATOL))
        end = self._next_host_step(self._world.time)
        try:
            self._running, self._state = True, "running"
            self._pass_time(end)
        finally:
            self._running = False
            if self._state == "running":
                self._state = "ready"

    # Looking

    def _now(self) -> Any:
        """What `bodies` depends on."""
        world = self._world
        return id(world), world.time, world.bodies.change

    def _read_column(self, name: str, spare: Any) -> Any:
        return self._world.read_all(name, self._world.time, spare)

    @look
    def energy(self) -> Energy:
        """Kinetic and potential energy [J], and the work [J] done so far by what has no potential."""
        return conserved.energy(self._world)

    @look
    def momentum(self) -> Vec:
        """Momentum [kg m/s] of all moving objects."""
        return conserved.momentum(self._world)

    @look
    def angular_momentum(self) -> Vec:
        """Angular momentum [kg m^2/s] of all moving objects about the origin."""
        return conserved.angular_momentum(self._world)

    @look
    def explain(self) -> Any:
        """Who serves what and why, what was skipped, and the drift; ``str()`` for people, ``.data`` and ``.to_json()``."""
        from xpheve.plan.explain import explain

        return explain(self)

    @look
    def frame(self) -> Any:
        """The present state for a record (`xpheve.record.frame.Frame`)."""
        from xpheve.record.frame import Frame

        world = self._world
        columns = {name: np.ascontiguousarray(world.read_all(name, world.time).T) for name in STATE_WIDTHS}
        serial = world.bodies.serial[: world.bodies.count].copy()
        return Frame(time=self.time, serial=serial, energy=(*self.energy(),), **columns)

    @look
    def object_table(self) -> list[dict[str, Any]]:
        """What a record says of each object."""
        return [
            {
                "serial": obj.serial,
                "name": obj.name,
                "shape": None if obj.shape is None else self._described(obj.shape),
                "mass": obj.mass,
                "fixed": obj.fixed,
            }
            for obj in self._world.bodies.objects
        ]

    def _described(self, shape: Any) -> dict[str, Any]:
        described: dict[str, Any] = shape.describe()
        if described.get("normal", ...) is None:
            described["normal"] = list(self._world.up_vector)
        return described

    def _metadata(self, every: float) -> dict[str, Any]:
        from xpheve import __version__

        choices = {batch.stepper.id: batch.state.count for batch in self._world.batches if batch.state.count}
        return {
            "xpheve": __version__,
            "up": self.up,
            "seed": self.seed,
            "every": every,
            "steppers": choices,
        }

    # Saving

    def _save(self) -> Any:
        from xpheve.plan.saved import save

        return save(self._world, self._started)

    def _take_up(self, saved: Any) -> None:
        from xpheve.plan.saved import restore_into

        restore_into(self, saved)

    @look
    def checkpoint(self, path: str | os.PathLike[str] | None = None) -> bytes:
        """Everything that a run depends on, as bytes, and in a file if ``path`` is given (written aside, then renamed)."""
        from xpheve.plan.saved import attributes_of
        from xpheve.record.checkpoint import pack, write

        if self._world.transaction is not None:
            raise StateError("a handler cannot take a checkpoint: the instant is not over; take it between runs")
        saved = self._save()
        saved.check_functions()
        header, arrays = saved.portable(self._authored)
        for serial, kept in attributes_of(self).items():
            _check_plain(serial, kept)
            header.setdefault("attributes", {})[str(serial)] = kept
        data = pack((header, arrays))
        if path is not None:
            write(Path(path), data)
        return data

    @classmethod
    def restore(
        cls,
        checkpoint: bytes | str | os.PathLike[str],
        *,
        laws: Sequence[type[PhysicalLaw]] = (),
        containers: Sequence[type[LawContainer]] = (),
        objects: Sequence[type[PhysicalObject]] = (),
        functions: Sequence[Callable[..., Any]] = (),
        registry: Registry | None = None,
    ) -> PhysicsEngine:
        """An engine that goes on to the bit where `checkpoint` was taken.

        ``laws`` and ``containers`` are the classes that no installed pack offers, ``objects`` the subclasses of `PhysicalObject`,
        ``functions`` those of `xpheve.when.Crosses`, by their names.

        Raises
        ------
        RecordError
            If it is no checkpoint, torn, or of a newer version.
        UnknownLawError
            If it needs a law that is not at hand.
        """
        from xpheve.plan.saved import give_attributes, revive
        from xpheve.record.checkpoint import TORN, unpack

        portable = unpack(checkpoint)
        kinds: dict[str, type[PhysicalObject]] = {"": PhysicalObject} | {kind.__qualname__: kind for kind in objects}

        def class_of(entry: dict[str, Any]) -> type[PhysicalObject]:
            kind = entry.get("kind", "")
            if kind not in kinds:
                raise RecordError(f"the checkpoint holds objects of the class {kind}: restore(..., objects=[{kind}])")
            return kinds[kind]

        try:
            engine: PhysicsEngine = revive(cls, portable, laws, containers, registry, class_of, functions)
            give_attributes(engine, {int(key): kept for key, kept in portable[0].get("attributes", {}).items()})
        except (UnknownLawError, PackError, RecordError):
            raise
        except (XpheveError, AssertionError, *TORN) as error:
            raise RecordError(f"the checkpoint is damaged ({type(error).__name__}: {error}); take another") from error
        return engine

    @look
    def copy(self) -> Any:
        """An engine of its own in the same state, with copies of all objects and laws (same order, names, serial numbers)."""
        from xpheve.plan.saved import attributes_of, give_attributes, revive

        laws = [type(law) for law in self._world.laws]
        containers = [type(container) for container in self._world.containers]
        if self._authored is not None:
            laws += [type(law) for law in self._authored.laws]
            containers += [type(container) for container in self._authored.containers]
        held = [*self._world.bodies.objects, *(self._authored.objects if self._authored is not None else ())]
        kinds = {obj.serial: type(obj) for obj in held}
        saved, first = self._save(), self._authored
        made = revive(
            type(self),
            saved.portable(first),
            laws,
            containers,
            self._registry,
            lambda entry: kinds.get(entry["serial"], PhysicalObject),
            saved.functions,
            True,
            first.functions if first is not None else (),
        )
        give_attributes(made, attributes_of(self))
        return made

    @look
    def save_scene(self, path: str | os.PathLike[str]) -> None:
        """Write the scene as a TOML or JSON file, by the ending of ``path``."""
        from xpheve.scene import save

        save(self, path)

    @classmethod
    def load_scene(cls, path: str | os.PathLike[str], **options: Any) -> PhysicsEngine:
        """An engine with the scene of a TOML or JSON file. Raises `SceneError`."""
        from xpheve.scene import load

        engine: PhysicsEngine = load(path, **options)
        return engine

    def __repr__(self) -> str:
        world = self._world
        return f"<PhysicsEngine t = {self.time} s, {world.bodies.count} objects, {len(world.laws)} laws, {self._state}>"


def _put_law(law: PhysicalLaw, what: str, value: Any) -> None:
    """Set a parameter, or ``enabled``, without telling the engine."""
    if what == "enabled":
        law._enabled = value
    else:
        law.parameters[what] = value


def _check_plain(serial: int, kept: dict[str, Any]) -> None:
    """Raise unless what a subclass keeps beside the state can be written into a checkpoint."""
    for name, value in kept.items():
        try:
            same = json.loads(json.dumps(value)) == value
        except (TypeError, ValueError):
            same = False
        if not same:
            raise RecordError(
                f"object #{serial}: {name} = {value!r:.80}: a checkpoint keeps numbers, texts, lists and tables; "
                "keep other things in a table of your own, by the object's name"
            )


def _put_state(law: PhysicalLaw, kept: dict[str, Any]) -> None:
    """Give ``law`` back the state it had."""
    law.state.clear()
    law.state.update(kept)


__all__ = ["Energy", "PhysicsEngine"]
