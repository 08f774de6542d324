"""Whether contacts of objects are looked for, and whether they are found on any flight, or along parabolas only."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from xpheve.laws import PhysicalLaw, ResponseLaw

if TYPE_CHECKING:
    from xpheve.objects import PhysicalObject
    from xpheve.plan.groups import Batch
    from xpheve.plan.world import World


def waits_for_contacts(law: PhysicalLaw) -> bool:
    """Whether ``law`` is enabled, and asks for contacts: it answers them, or a container tells it of them."""
    return law.enabled and (
        isinstance(law, ResponseLaw)
        or any(one.condition is not None and one.condition.served_by == "contacts" for one in law.containers)
    )


def contacts_concern(world: World, group: Iterable[PhysicalObject]) -> bool:
    """Whether contacts of one of ``group`` are looked for."""
    server = world.contacts
    return server is not None and any(
        any(map(waits_for_contacts, world.mapping.laws(obj))) and server.concerns(obj) for obj in group
    )


def meets(world: World, batch: Batch) -> bool:
    """Whether contacts of objects of ``batch`` are looked for, so that each of its steps is to be seen."""
    if world.contacts is None:
        return False
    rows = batch.state.rows
    if batch.met[0] != world.structure or batch.met[1] is not rows:
        objects = world.bodies.objects
        batch.met = (world.structure, rows, contacts_concern(world, (objects[row] for row in rows.tolist())))
    return batch.met[2]


def needs_parabolas(world: World, group: Iterable[PhysicalObject]) -> bool:
    """Whether contacts of one of ``group`` are looked for that the contact server finds along parabolas only."""
    server = world.contacts
    return server is not None and any(
        any(map(waits_for_contacts, world.mapping.laws(obj))) and server.concerns(obj) and bool(server.parabolas(obj))
        for obj in group
    )


def is_moved_along(world: World, obj: PhysicalObject) -> bool:
    """Whether something acts on ``obj`` along the way: all else flies along parabolas anyway."""
    from xpheve.plan.groups import torque_of

    return bool(world.continuous_laws(obj)) or torque_of(world, obj) == "general"


def wants_parabolas(world: World, group: Iterable[PhysicalObject]) -> bool:
    """Whether the stepper of ``group`` must be one that flies along parabolas, and there is a choice."""
    members = list(group)
    return needs_parabolas(world, members) and any(is_moved_along(world, obj) for obj in members)


def mark_changed(world: World, objects: Iterable[PhysicalObject] | None = None) -> set[PhysicalObject]:
    """Have those of ``objects``, by default of all, planned anew whose stepper was chosen when that was otherwise; returns them."""
    bodies = world.bodies
    if objects is None:
        batches = [one for one in world.batches if one.signature.evaluated]
        objects = [bodies.objects[row] for one in batches for row in one.state.rows.tolist()]
    marked: set[PhysicalObject] = set()
    done: set[PhysicalObject] = set()
    for obj in objects:
        number = int(bodies.batch[obj._row])
        if number < 0 or obj in done or obj in world.unplanned:
            continue
        group = world.group_of(obj)
        done.update(group)
        if wants_parabolas(world, group) != world.batches[number].signature.contacts:
            marked.update(group)
    for obj in world.in_rank_order(marked):
        world.mark(obj)
    return marked
