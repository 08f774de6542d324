"""The books of work: what is done by forces and torques without a potential, law by law."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from xpheve.kernels.clock import Instant
from xpheve.objects import PhysicalObject
from xpheve.plan.energy import label_of, spin_energy, twist_label, twisted
from xpheve.plan.evaluation import BatchSources
from xpheve.plan.groups import Batch
from xpheve.steppers.contract import Array

if TYPE_CHECKING:
    from xpheve.plan.world import World


def account(
    world: World,
    obj: PhysicalObject,
    held: dict[str, tuple[float, ...]],
    clock: Instant,
    flown: dict[str, tuple[float, ...]],
) -> None:
    """Add the work that the stored forces of ``obj`` without potential did over the flight that ends now."""
    transaction = world.transaction
    stored = transaction.touched[obj].forces if transaction is not None else world.forces.on(obj)
    number = int(world.bodies.batch[obj._row])
    turned = number >= 0 and bool(twisted(world, world.batches[number])[int(world.bodies.local[obj._row])])
    works = number >= 0 and world.batches[number].working is not None
    if not works and not turned and all(one.accounted for one in stored):
        return
    way = [x1 - x0 for x1, x0 in zip(flown["position"], held["position"], strict=True)]
    work: dict[str, list[float]] = {}
    for one in stored:
        if not one.accounted:
            label = one.owner.label() if one.owner is not None else "forces"
            work.setdefault(label, []).extend(f * d for f, d in zip(one.force.vector, way, strict=True))
    for label, parts in sorted(work.items()):
        world.add_work(label, math.fsum(parts))
    if number < 0:
        return
    batch, local = world.batches[number], int(world.bodies.local[obj._row])
    if works and batch.working is not None:
        force = batch.working[:, local]
        world.add_work(label_of(batch), math.fsum((force * np.array(way)).tolist()))
    if turned:
        inertia = world.bodies.arrays["inertia"][:, [obj._row]]
        after, before = (
            spin_energy(np.array([one["orientation"]]).T, np.array([one["angular_velocity"]]).T, inertia)[0]
            for one in (flown, held)
        )
        world.add_work(twist_label(batch), float(after - before))


def take_work(world: World, batch: Batch, locals_: Sequence[int]) -> None:
    """Book what the stepper kept of the work done on rows of ``batch``."""
    kept = [batch.state.arrays[name] for name in ("work", "work_rest")]
    which = np.array(locals_, dtype=np.int64)
    running = batch.stepper.running_work(batch.state, world.bodies, world.time, which).tolist()
    joules = math.fsum([*running, *(value for array in kept for value in array[0, locals_].tolist())])
    if joules:
        world.add_work(label_of(batch), joules)
    for array in kept:
        array[0, locals_] = 0.0


def snapshot(world: World, batch: Batch, sources: BatchSources | None = None) -> dict[str, Array] | None:
    """The flights of a batch that end now, if work is to be booked over them, and over those to come under ``sources``."""
    under_torque = twisted(world, batch)
    if sources is not None:
        under_torque = under_torque | sources.working_twists[batch.state.rows]
    rows, bodies = batch.state.rows, world.bodies
    works = not batch.stepper.books_work and (
        batch.working is not None or bool(bodies.arrays["working"][:, rows].any())
    )
    if not works and not under_torque.any():
        return None
    force = np.zeros((3, len(rows)))
    if works:
        force = bodies.arrays["working"][:, rows] + (0.0 if batch.working is None else batch.working)
    turned = rows[under_torque]
    energy = spin_energy(
        bodies.arrays["orientation"][:, turned],
        bodies.arrays["angular_velocity"][:, turned],
        bodies.arrays["inertia"][:, turned],
    )
    return {
        "position": bodies.arrays["position"][:, rows].copy(),
        "force": force,
        "turned": turned,
        "energy": energy,
    }


def after_step(world: World, batch: Batch, before: dict[str, Array] | None, skip: Iterable[int] = ()) -> None:
    """Book the work over the flights that a step ended, but for rows whose flight an event ended."""
    if before is None:
        return
    bodies = world.bodies
    left = ~np.isin(batch.state.rows, list(skip))
    way = (bodies.arrays["position"][:, batch.state.rows] - before["position"])[:, left]
    joules = math.fsum((before["force"][:, left] * way).ravel().tolist())
    if joules:
        world.add_work(label_of(batch), joules)
    turned = before["turned"]
    if len(turned):
        now = spin_energy(
            bodies.arrays["orientation"][:, turned],
            bodies.arrays["angular_velocity"][:, turned],
            bodies.arrays["inertia"][:, turned],
        )
        gained = (now - before["energy"])[~np.isin(turned, list(skip))]
        world.add_work(twist_label(batch), math.fsum(gained.tolist()))
