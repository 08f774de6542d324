"""Batches that go from impact to impact by themselves: how far they may go before the queue has its turn."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from xpheve.events import IMPACT
from xpheve.kernels.clock import Instant
from xpheve.plan import books

if TYPE_CHECKING:
    from xpheve.plan.groups import Batch
    from xpheve.plan.world import World


def advance(world: World, until: Instant, due: Instant) -> bool:
    """Let those that go from impact to impact do so, up to ``until`` or what is ``due`` in the queue; whether one of them did.

    Their impacts have their place among the stages of an instant: after forces that end and handlers, before last stages.
    """
    going = [one for one in world.batches if one.stepper.impacts and one.state.count]
    if not going:
        return False
    limit = due
    if due[0] > until[0]:
        limit = until[0], math.inf  # an event whose time reads as ``until`` belongs to this run
    elif world.queue.next_stage() >= IMPACT:
        limit = due[0], math.nextafter(due[1], math.inf)
    behind = [one for one in going if one.stepper.covered(one.state) < limit]
    for batch in behind:
        _fly(world, batch, limit)
    return bool(behind)


def _fly(world: World, batch: Batch, limit: Instant) -> None:
    """One more call of the stepper of ``batch``, before ``limit``."""
    assert world.contacts is not None
    before = books.snapshot(world, batch)
    server: Any = world.contacts
    stop = batch.stepper.advance(batch.state, world.bodies, limit, limit, world.settings, server)
    books.after_step(world, batch, before)
    if len(stop.rows):
        world.bodies.version[stop.rows] += 1
        world.bodies.change += 1
        world.wakeups.refresh(world.bodies.objects[row] for row in world.wakeups.followed(stop.rows))
    world.contacts.flown(stop.rows)
