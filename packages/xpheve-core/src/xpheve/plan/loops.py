"""Loops of a world that is running: how many steps they make in one call, and how they are linked again when laws are switched or set."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from xpheve.kernels.clock import NEVER, Instant, elapsed, multiple
from xpheve.laws import ContinuousLaw, PairLaw
from xpheve.plan import books, contacts_wanted
from xpheve.plan.driven import immovable
from xpheve.plan.evaluation import BatchSources
from xpheve.plan.groups import Batch, form_of
from xpheve.plan.hand_kernels import formula_of
from xpheve.plan.scouts import may_be_scouted

if TYPE_CHECKING:
    from xpheve.plan.world import World

STRIDE = 100_000_000
"""Rows or pairs times compiled steps in one call: about a second, so that nobody waits long."""


def same_structure(world: World, law: ContinuousLaw) -> bool:
    """Whether the loops that ``law`` is in were made from the trace that it has now: only numbers are others."""
    trace = formula_of(law)
    return all(
        batch.sources is None or batch.sources.is_made_from(law, trace) for batch in world.batches if law in batch.laws
    )


def is_of_a_form(world: World, law: ContinuousLaw) -> bool:
    """Whether a batch that ``law`` is in was chosen for a form of its forces, which other numbers may change."""
    return any(batch.signature.form != "general" for batch in world.batches if law in batch.laws and batch.state.count)


def is_linked(world: World, law: ContinuousLaw) -> bool:
    """Whether ``law`` is known in the batches of all its objects."""
    batches = _batches_of(world, law)
    return bool(batches) and all(law in batch.laws for batch in batches)


def _batches_of(world: World, law: ContinuousLaw) -> list[Batch]:
    """The batches of the objects of ``law`` that move; none if one of them is not planned."""
    felt = law.moves if isinstance(law, PairLaw) else bool
    rows = [obj._row for obj in world.mapping.objects(law) if not immovable(obj) and felt(obj)]
    numbers = np.unique(world.bodies.batch[rows]).tolist() if rows and not world.unplanned else [-1]
    return [] if numbers[0] < 0 else [world.batches[number] for number in numbers]


def may_link_again(world: World, law: ContinuousLaw) -> bool:
    """Whether loops can do without ``law``, or take it up again, with everybody where he is.

    Each batch of its objects has another law on all its rows, by which it must be stepped anyway.
    """
    return all(_stands_without(world, batch, law) for batch in _batches_of(world, law))


def _stands_without(world: World, batch: Batch, law: ContinuousLaw) -> bool:
    objects = {world.bodies.objects[row] for row in batch.state.rows.tolist()}
    others = [one for one in batch.laws if one is not law and (one.enabled or world.is_switched(one))]
    return any(objects <= world.mapping.objects(one).keys() for one in others)


def renew(world: World, law: ContinuousLaw, linked_again: bool = False) -> None:
    """A number that ``law`` reads is another from now on: flights under way begin anew, and loops read it again.

    Or loops are ``linked_again``, without ``law`` or with it.
    """
    if world.transaction is not None:
        world.transaction.later.append(partial(renew, world, law, linked_again))
        return
    for batch in world.batches:
        if law not in batch.laws or not batch.state.count:
            continue
        if linked_again:
            batch.sources = None
        if _has_other_form(world, batch):
            for row in batch.state.rows.tolist():
                world.mark(world.bodies.objects[row])
            continue
        sources = world.sources(batch)
        assert sources is not None
        sources.renew()
        if batch.stepper.covered(batch.state) > world.time:
            _restart_batch(world, batch)


def _has_other_form(world: World, batch: Batch) -> bool:
    """Whether what was proved of the forces on ``batch`` does not hold any more, or more does."""
    world.affine.clear()
    group = world.group_of(world.bodies.objects[int(batch.state.rows[0])])
    laws = {law: None for obj in group for law in world.continuous_laws(obj)}
    return form_of(world, group, laws, batch.signature.torque, batch.signature.contacts) != batch.signature.form


def _restart_batch(world: World, batch: Batch) -> None:
    """All rows of ``batch`` start anew now, in the midst of a step."""
    before = books.snapshot(world, batch)
    rows = list(batch.stepper.restart(batch.state, world.bodies, world.time, world.sources(batch)))
    books.after_step(world, batch, before)
    world.bodies.version[rows] += 1
    world.bodies.change += 1
    objects = world.in_rank_order(world.bodies.objects[row] for row in rows)
    if world.contacts is not None:
        world.contacts.refresh([obj._row for obj in objects])
    world.wakeups.refresh(objects)
    for other in world.batches:  # what they act on follows them otherwise from now on
        if not other.state.count or batch not in world.acting_on(other):
            continue
        if not other.stepper.asks:
            for row in other.state.rows.tolist():
                world.mark(world.bodies.objects[row])
        elif other.stepper.covered(other.state) > world.time:
            _restart_batch(world, other)


def steps_at_once(world: World, batch: Batch, sources: BatchSources, begin: Instant, need: Instant) -> int:
    """How many host steps ``batch`` may make at once from ``begin``: until ``need``, the next jump of a force, or a pause for breath."""
    if (
        world.settings.dt is None
        or world.grid is None
        or len(sources.hands)
        or not stands_still(world, batch)
        or is_heard(world, batch)
    ):
        return 1
    from xpheve.plan.tiers import cost_of_step

    origin, dt, _ = world.grid
    number = number_at(world, begin)
    if number < 0:
        return 1
    end = min(need, sources.wall(begin, NEVER))
    load = max(batch.state.count, sources.load)
    most = max(1, STRIDE // cost_of_step(world.tier_of(sources), load))
    span = elapsed(end, begin) / dt
    steps = int(min(most, span)) if math.isfinite(span) else most
    if steps < most and multiple(origin, number + steps, dt) < end:
        steps += 1
    while steps > 1 and end != need and multiple(origin, number + steps, dt) > end:
        steps -= 1
    return max(1, steps)


def follow_sources(
    world: World, batch: Batch, sources: BatchSources, begin: Instant, wall: Instant, steps: int
) -> tuple[int, Instant]:
    """How many of ``steps`` ``batch`` may make, and where it must stop, because what acts on it is followed so far only in its loop."""
    if sources.courses is None or sources.held is None or not batch.stepper.loops:
        return steps, wall
    if world.settings.dt is None:
        return steps, wall if batch.stepper.asks else sources.courses.reach(begin, wall, begin)
    if steps <= 1:
        sources.courses.reach(begin, wall, wall)
        return 1, wall
    assert world.grid is not None
    origin, dt, _ = world.grid
    number = number_at(world, begin)
    known = sources.courses.reach(begin, multiple(origin, number + steps, dt), multiple(origin, number + 1, dt))
    while steps > 1 and multiple(origin, number + steps, dt) > known:
        steps = max(1, min(steps - 1, int(elapsed(known, begin) / dt)))  # `known` is past the first step
    return steps, wall


def not_ahead(world: World, batch: Batch, sources: BatchSources) -> list[Batch]:
    """The batches that act on ``batch`` and must be known to the end of each of its steps before it is made, so that it is no longer than that."""
    acting = world.acting_on(batch)
    loops = batch.stepper.loops and sources.courses is not None and sources.held is not None
    if not loops or not (batch.stepper.asks or world.settings.dt is not None):
        return acting
    return [one for one in acting if not may_be_scouted(world, one)]


def stands_still(world: World, batch: Batch) -> bool:
    """Whether all that acts on ``batch`` from another is known for ever, or can be found ahead."""
    sources = world.sources(batch)
    if sources is None:
        return True
    return all(one.stepper.covered(one.state) == NEVER for one in not_ahead(world, batch, sources))


def number_at(world: World, t: Instant) -> int:
    """The number of the host step that begins at ``t``; -1 if none does."""
    assert world.grid is not None
    origin, dt, _ = world.grid
    guess = round(elapsed(t, origin) / dt)
    return next((k for k in (guess, guess - 1, guess + 1) if k >= 0 and multiple(origin, k, dt) == t), -1)


def is_heard(world: World, batch: Batch) -> bool:
    """Whether somebody follows the flights of ``batch``, so that it may make one step at a time only."""
    objects = world.bodies.objects
    if contacts_wanted.meets(world, batch) or world.is_source(batch):
        return True
    return world.wakeups.tracker.follows_any(objects[row] for row in batch.state.rows)
