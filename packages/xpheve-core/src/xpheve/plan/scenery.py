"""Adding, removing and mapping: what changes a scene's structure, each checked whole before anything changes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from xpheve.errors import InvalidValueError, LawFailedError, OwnershipError
from xpheve.laws import ContinuousLaw, Event, FieldLaw, LawContainer, PairLaw, PhysicalLaw, ResponseLaw
from xpheve.laws import conditions as when
from xpheve.objects import FIELDS, PhysicalObject
from xpheve.plan import contacts_wanted, loops
from xpheve.plan.driven import dependents, immovable
from xpheve.plan.groups import targets_of
from xpheve.plan.world import World


def check_objects(world: World, engine: Any, objects: Sequence[PhysicalObject], laws: Sequence[PhysicalLaw]) -> None:
    """Raise if one of ``objects`` cannot be added with ``laws``."""
    named = any(isinstance(obj, PhysicalObject) and obj.name for obj in objects)
    names = {obj.name for obj in world.bodies.objects if obj.name} if named else set()
    coming = world.transaction.coming if world.transaction is not None else []
    seen = {id(obj) for obj in coming}
    names |= {obj.name for obj in coming if obj.name}
    for obj in objects:
        if not isinstance(obj, PhysicalObject):
            raise InvalidValueError(f"{obj!r} is no PhysicalObject")
        if obj._engine is not None or id(obj) in seen:
            where = (
                "this engine"
                if obj._engine is engine
                else "another engine"
                if obj._engine is not None
                else "the list twice"
            )
            raise OwnershipError(
                f"{obj!r} is in {where} already; an object is in one engine once: remove it there, or copy.copy it"
            )
        seen.add(id(obj))
        if obj.name:
            if obj.name in names:
                raise InvalidValueError(
                    f"an object named {obj.name!r} is in the engine already; names are unique: choose another"
                )
            names.add(obj.name)
        _check_values(obj, laws)
        if world.periodic is not None:
            from xpheve.plan.periodic import check_shape

            check_shape(obj, obj.shape, world.periodic, world.up_vector)
    for law in laws:
        if law.engine is not engine:
            raise OwnershipError(f"{law!r} is not in this engine: add it with engine.add_law first")
    if laws and objects:
        world.mapping.check(objects[0], laws)
    if laws and world.contacts is not None:
        for obj in {(obj.shape and obj.shape.kind, obj.fixed): obj for obj in objects}.values():
            world.contacts.check(obj, laws)


def _check_values(obj: PhysicalObject, laws: Iterable[PhysicalLaw]) -> None:
    if not obj._columns:
        return
    for law in laws:
        for name, column in law.columns.items():
            if name in obj._columns:
                column.check(obj._columns[name], obj.label if obj.name else "object", name)


def add_objects(world: World, engine: Any, objects: Sequence[PhysicalObject], laws: Sequence[PhysicalLaw]) -> None:
    """Add ``objects``, all under ``laws``, at the present time."""
    if not objects:
        return
    n = len(objects)
    values: dict[str, Any] = {name: np.array([obj._own[name] for obj in objects], dtype=float) for name in FIELDS}
    if world.periodic is not None:
        from xpheve.periodic import wrap_rows

        wrap_rows(values["position"].T, world.periodic)
    values["fixed"] = [obj.fixed for obj in objects]
    values["serial"] = np.arange(world._next_serial, world._next_serial + n)
    rows = world.bodies.append(objects, values, world.time)
    for k, (obj, row) in enumerate(zip(objects, rows, strict=True)):
        obj.serial = world._next_serial + k
        obj.rank = -1
        obj._row = row
        obj._engine = engine
        world.unplanned[obj] = None
    world._next_serial += n
    world.dirty = True
    for law in laws:
        _add_columns(world, law)
        for obj in objects:
            world.mapping.add(obj, law, world.time)
        for container in law.containers:
            if type(container).law_changed is not LawContainer.law_changed:
                for obj in objects:
                    container.law_changed(law, "objects", obj)
    _fill_columns(world, objects, laws)
    _tell_mapped(world, when.ObjectAdded, objects, laws)


def _add_columns(world: World, law: PhysicalLaw) -> None:
    for name, column in law.columns.items():
        world.bodies.add_column(name, column.default)


def _fill_columns(world: World, objects: Iterable[PhysicalObject], laws: Iterable[PhysicalLaw]) -> None:
    """Copy the objects' own values into the columns of ``laws``."""
    wanted = {name for law in laws for name in law.columns}
    if not wanted:
        return
    for obj in objects:
        for name in wanted & obj._columns.keys():
            world.bodies.columns[name][obj._row] = obj._columns[name]


def _tell_mapped(
    world: World, kind: type[when.Condition], objects: Sequence[PhysicalObject], laws: Sequence[PhysicalLaw]
) -> None:
    if not world.wakeups.armed.of(kind):
        return
    world.tell(
        kind,
        lambda container, leaf: any(
            law in container.laws if leaf.law is None else leaf.law in (law, law.name, law.label()) for law in laws
        ),
        Event(world.time[0], objects=tuple(objects)),
    )


def remove_object(world: World, obj: PhysicalObject) -> None:
    """Take ``obj`` out; it owns its last state again."""
    world.wakeups.let_go(obj)
    state = {name: world.show_row(obj._row, name) for name in FIELDS}
    state["mass"] = state["mass"][0]  # type: ignore[assignment]
    group = [other for other in world.groups.get(obj, []) if other is not obj]
    if immovable(obj):
        group = dependents(world, obj)
    group += [other for other in targets_of(world, obj) if other not in group]
    laws = list(world.mapping.laws(obj))
    _tell_mapped(world, when.ObjectRemoved, [obj], laws)
    for law in laws:
        for container in law.containers:
            container.law_changed(law, "objects", obj)
    world._rebase_row(obj)
    for other in group:
        world._rebase_row(other)
        world.mark(other)
    for law in world.mapping.remove_object(obj):
        if isinstance(law, ContinuousLaw):
            _forget_sources(world, law)
    for law in world.laws:
        if isinstance(law, PairLaw) and law.pairs is not None and law.joined(obj):
            law.pairs = tuple(pair for pair in law.pairs if obj not in pair)
    for law in laws:
        if isinstance(law, ResponseLaw):
            law.forget_object(obj)
    world.forces.of.pop(obj, None)
    world.groups.pop(obj, None)
    world.unplanned.pop(obj, None)
    row = obj._row
    bodies = world.bodies
    moved = bodies.remove(row)
    if moved != row:
        other = bodies.objects[row]
        other._row = row
        number = int(bodies.batch[row])
        if number >= 0:
            batch = world.batches[number]
            batch.state.rows[int(bodies.local[row])] = row
            batch.state.locate()
            batch.sources = None
    for batch in world.batches:
        batch.sources = None
    if world.contacts is not None:
        world.contacts.removed(obj, row, moved)
    obj._own.update(state)  # first, for readers on other threads
    world.arrivals.pop(obj, None)
    obj._driven = False
    obj._engine = None
    obj._row = -1
    obj.rank = -1


def _forget_sources(world: World, law: ContinuousLaw) -> None:
    for batch in world.batches:
        if law in batch.laws:
            batch.sources = None


def map_law(world: World, obj: PhysicalObject, law: PhysicalLaw) -> None:
    """Let ``obj`` obey ``law`` from now on; nothing happens if it does."""
    if law in world.mapping.laws(obj):
        return
    world.mapping.check(obj, [law])
    _check_values(obj, [law])
    if world.contacts is not None:
        world.contacts.check(obj, [law])
    _add_columns(world, law)
    world.mapping.add(obj, law, world.time)
    _fill_columns(world, [obj], [law])
    try:
        for container in law.containers:
            container.law_changed(law, "objects", obj)
    except Exception as error:
        world.mapping.remove(obj, law)
        raise LawFailedError(
            f"{container.label()}.law_changed raised {type(error).__name__}: {error}; {obj!r} is not mapped to {law!r}",
            law,
        ) from error
    after_mapping(world, law, [obj])
    _tell_mapped(world, when.ObjectAdded, [obj], [law])


def unmap_law(world: World, obj: PhysicalObject, law: PhysicalLaw) -> None:
    """Let ``obj`` no longer obey ``law``; nothing happens if it does not."""
    if law not in world.mapping.laws(obj):
        return
    _tell_mapped(world, when.ObjectRemoved, [obj], [law])
    world.mapping.remove(obj, law)
    if isinstance(law, ResponseLaw):
        law.forget_object(obj)
    withdraw(world, law, [obj])
    after_mapping(world, law, [obj])
    for container in law.containers:
        container.law_changed(law, "objects", obj)


def after_mapping(world: World, law: PhysicalLaw, objects: Sequence[PhysicalObject]) -> None:
    """``objects`` came under ``law``, left it, or the law was switched."""
    world.structure += 1
    if isinstance(law, ContinuousLaw) and not law.containers:
        for obj in objects:
            if not isinstance(law, PairLaw) or law.moves(obj):
                world.mark(obj)
            else:  # what it acts on is moved otherwise from now on, and nothing else
                for other in law.between[1] if law.between is not None else ():
                    if other in world.mapping.objects(law) and not other.fixed:
                        world.mark(other)
        _forget_sources(world, law)
    elif isinstance(law, ResponseLaw) or any(
        c.condition is not None and c.condition.served_by == "contacts" for c in law.containers
    ):
        # Who leaves its batch is predicted anew when it is planned.
        marked = contacts_wanted.mark_changed(world, objects) if world.contacts is not None else set()
        with world.instant() as transaction:
            transaction.refresh.update(obj for obj in objects if obj not in marked)


def withdraw(world: World, law: PhysicalLaw, objects: Iterable[PhysicalObject]) -> None:
    """Take away the forces that ``law`` stored on ``objects``."""
    with world.instant() as transaction:
        held = [obj for obj in world.in_rank_order(objects) if any(one.owner is law for one in world.forces.on(obj))]
        planned = [obj for obj in held if obj not in world.unplanned]
        transaction.touch_all(planned)
        transaction.forced.update(planned)
        for obj in held:
            world.forces.withdraw(obj, law)


def law_changed(world: World, law: PhysicalLaw, what: str) -> None:
    """A parameter of ``law`` changed, or it was switched: correct what rests on it, at this instant."""
    objects = world.in_rank_order(world.mapping.objects(law))
    if what == "enabled":
        for obj in objects if law.enabled else ():
            world.mapping.check(obj, [law])
        world.switches[law] = world.switches.get(law, 0) + 1
    if isinstance(law, ContinuousLaw) and _in_loops(world, law, what):
        loops.renew(world, law, linked_again=what == "enabled" and world.switches[law] <= 2)
        return
    if what == "enabled":
        if law.enabled:
            for obj in objects:
                world.mapping.add(obj, law, world.time)
        else:
            withdraw(world, law, objects)
            if isinstance(law, ContinuousLaw):
                world.constant.pop(law, None)
        after_mapping(world, law, objects)
        for container in law.containers:
            container.law_changed(law, "enabled")
        return
    if not objects or not law.enabled:
        return
    if isinstance(law, FieldLaw) and law in world.constant:
        planned = [obj for obj in objects if obj not in world.unplanned]
        with world.instant():
            if planned and not world.store_if_constant(law, planned):
                withdraw(world, law, objects)
                after_mapping(world, law, objects)
    elif isinstance(law, ContinuousLaw) and not law.containers:
        after_mapping(world, law, objects)
    else:
        after_mapping(world, law, objects)


def _in_loops(world: World, law: ContinuousLaw, what: str) -> bool:
    """Whether the change is no more than another number, or another text, for the loops that ``law`` is in: nobody need be planned anew."""
    if law.containers or law in world.constant or not loops.is_linked(world, law):
        return False
    if what != "enabled":
        return law.enabled and loops.same_structure(world, law) and not loops.is_of_a_form(world, law)
    if "since" in world.reads_of(law) or law.defines("jumps") or law.defines("torque") or law.defines("apply"):
        return False
    return world.is_switched(law) or loops.may_link_again(world, law)


def restore_constant_forces(world: World, obj: PhysicalObject, name: str) -> None:
    """``name`` of ``obj`` was written: store anew the forces of constant laws that read it."""
    for law, reads in list(world.constant.items()):
        if name in reads and law in world.mapping.laws(obj) and isinstance(law, FieldLaw):
            world.store_if_constant(law, [obj])


def remove_law(world: World, law: PhysicalLaw) -> None:
    """Take ``law`` out of the scene with its mappings and forces."""
    objects = world.in_rank_order(world.mapping.objects(law))
    withdraw(world, law, objects)
    for obj in objects:
        unmap_law(world, obj, law)
    if isinstance(law, ContinuousLaw):
        world.constant.pop(law, None)
    for container in list(law.containers):
        container.remove_law(law)
        if not container.laws and not container.name:
            remove_container(world, container)
    forget_law(world, law)


def forget_law(world: World, law: PhysicalLaw) -> None:
    """``law`` is in no engine any more."""
    world.mapping.remove_law(law)
    for container in list(law.containers):
        container.remove_law(law)
    del world.laws[law]
    world.ranks.law_ranks.pop(law, None)
    world.structure += 1
    law.engine = None


def remove_container(world: World, container: LawContainer) -> None:
    """Take ``container`` out; its laws stay, in no container."""
    for law in list(container.laws):
        container.remove_law(law)
    world.containers.remove(container)
    world.structure += 1
    world.wakeups.forget(container)
    world.spent.discard(container)
    container.engine = None
