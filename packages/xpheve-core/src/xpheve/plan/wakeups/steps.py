"""Host steps: who listens to them, and what a law gets that is enforced at one."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

from xpheve.events import START, Entry
from xpheve.kernels.clock import multiple
from xpheve.laws import Event, LawContainer
from xpheve.laws import conditions as when
from xpheve.laws.combinations import leaves, plain
from xpheve.plan.wakeups.delivery import Delivery


def listeners(world: Any, demanding: bool = False) -> list[LawContainer]:
    """The containers that ask for host steps; ``demanding``: without those that only take what comes."""
    found: dict[LawContainer, None] = {}
    armed = world.wakeups.armed
    for kind in (when.Steps, when.ContactStay):
        for leaf, containers in armed.of(kind):
            if not (demanding and getattr(leaf, "passive", False)):
                found.update(dict.fromkeys(containers))
    return [c for c in world.containers if c not in world.spent and c.laws and (c in found or _is_asked(c))]


def _is_asked(container: LawContainer) -> bool:
    return container.is_polled and container.period is None


def host_step(world: Any, number: int, dt: float) -> None:
    """Step ``number`` begins now: call its listeners, who read half a step ahead."""
    with world.instant() as transaction:
        counted: set[Any] = set()
        heard = listeners(world)
        for container in sorted(heard, key=lambda c: world.ranks.container_ranks.get(c, 0)):
            if _is_asked(container):
                world.poll(container, dt)
                continue
            own = dict.fromkeys(plain(leaf) for leaf in leaves(container.condition) if isinstance(leaf, when.Steps))
            for leaf in own:
                if number % (leaf.n + 1) != 0:
                    continue
                if leaf not in counted:
                    counted.add(leaf)
                    world.wakeups.armed.count(leaf)
                event = Event(0.0, leaf, world.objects_under(container), dt=dt * (leaf.n + 1))
                if leaf.at == "middle":
                    middle = multiple(world.time, 1, 0.5 * event.dt)
                    rank = (1, world.posts, world.ranks.container_ranks.get(container, 0))
                    entry = Entry(middle, START, rank, Delivery(world, container, leaf, event))
                    transaction.later.append(partial(world.queue.push, entry))
                else:
                    _step_laws(world, container, leaf, event)
        if world.contacts is not None and any(
            container not in world.spent and container.laws
            for _, containers in world.wakeups.armed.of(when.ContactStay)
            for container in containers
        ):
            world.contacts.host_step()


def _step_laws(world: Any, container: LawContainer, leaf: Any, event: Event) -> None:
    """Fire at the beginning of a step, reading at its middle; what a law stored last time and not now is withdrawn."""
    before = {
        (law, obj): [one for one in world.forces.on(obj) if one.owner is law and one.force.id == world.ident(law)]
        for law in container.laws
        for obj in world.mapping.objects(law)
    }
    world.ahead = 0.5 * event.dt
    world.renewed = set()
    try:
        world.signal(container, leaf, replace(event, time=world.time[0] + world.ahead))
    finally:
        world.ahead = 0.0
    for (law, obj), stale in before.items():
        if stale and (law, obj) not in world.renewed and obj._row >= 0:
            world.transaction.touch(obj)
            held = world.forces.on(obj)
            held[:] = [one for one in held if one not in stale]
            world.transaction.forced.add(obj)
