"""Whether fixed steps resolve the motion: before a run by the rates at which forces change along it, after a run by the energy."""

from __future__ import annotations

import math
import warnings
from typing import TYPE_CHECKING

import numpy as np

from xpheve.errors import ResolutionWarning, XpheveError
from xpheve.kernels.clock import Instant, elapsed
from xpheve.plan.energy import Energy, energy
from xpheve.plan.groups import Batch
from xpheve.steppers.contract import STATE_NAMES, Array

if TYPE_CHECKING:
    from xpheve.plan.world import World

GOOD = 0.1
"""Steps times rate that a second-order step resolves to about a thousandth: GOOD^2 / 12."""
LOST = 0.1
"""Energy that a run may lose or make, of all there is, before somebody is told."""
LONG = 500
"""Host steps from which on a run looks at its energy."""
MOST = 20_000
"""Rows and pairs up to which that is asked."""
SHORT = 1e-3
"""Of a step: how far along its way a body is moved to see how its force changes."""


def warn_of_steps(world: World) -> None:
    """Warn of batches whose forces change too fast for the host steps; looked at once for each signature and length of step.

    With w the rate [1/s] at which the acceleration changes along the way that a group goes, w^2 = |da| / |dx| or w = |da| / |dv|, an explicit
    symmetric step h is stable for h w < 2 (Hairer, Lubich, Wanner, Geometric Numerical Integration, I.1.4).
    """
    dt = world.settings.dt
    if dt is None:
        return
    for batch in world.batches:
        asked = batch.signature, dt
        if not batch.signature.laws or not batch.state.count or asked in world.looked_at:
            continue
        limit = batch.stepper.limit
        if not math.isfinite(limit) or batch.choice.offers[batch.stepper.id].exact:
            continue
        world.looked_at.add(asked)
        rate, row = rate_of(world, batch, dt)
        if dt * rate <= limit:
            continue
        name = world.bodies.objects[row].label
        warnings.warn(
            f"dt = {dt} s does not resolve the forces of {', '.join(batch.signature.laws)} on {name}: at t = {world.time[0]} s they change "
            f"at a rate of {rate:.3g} /s, and {batch.stepper.id} is unstable beyond dt = {limit / rate:.2g} s. Take dt = {GOOD / rate:.1g} s, "
            "or run(until=...) without dt, to tolerances",
            ResolutionWarning,
            stacklevel=4,
        )


def rate_of(world: World, batch: Batch, dt: float) -> tuple[float, int]:
    """The fastest rate [1/s] at which accelerations in ``batch`` change along the way, and the row it was found at; 0 where it is not asked."""
    sources = world.sources(batch)
    rows = batch.state.rows
    if sources is None or sources.load > MOST or not all(math.isfinite(v) for v in (dt, *world.time)):
        return 0.0, 0
    counted = {law: law.evaluations for law in sources.laws}
    state = {name: world.read_rows(rows, name) for name in STATE_NAMES}
    mass = world.bodies.arrays["mass"][0, rows]
    stored = world.bodies.arrays["force"][:, rows] / mass
    try:
        with np.errstate(all="ignore"):

            def acceleration(**other: Array) -> Array:
                force, _, _ = sources.evaluate(rows, world.time, state | other)
                found: Array = stored + force / mass
                return found

            a = acceleration()
            short = SHORT * dt
            step = short * state["velocity"] + (0.5 * short * short) * a
            by_place = _ratios(world, batch, acceleration(position=state["position"] + step) - a, step)
            by_speed = _ratios(world, batch, acceleration(velocity=state["velocity"] + short * a) - a, short * a)
    except XpheveError:  # the step itself will say what is wrong, and where
        return 0.0, 0
    finally:
        for law, count in counted.items():
            law.evaluations = count
    rates = np.fmax(np.sqrt(by_place), by_speed)
    worst = int(np.argmax(rates)) if len(rates) else 0
    return (float(rates[worst]), int(rows[worst])) if len(rates) else (0.0, 0)


def _ratios(world: World, batch: Batch, gained: Array, moved: Array) -> Array:
    """|gained| / |moved| of each row, over all that laws join with it; 0 where nothing moved that counts."""
    top, bottom = (gained * gained).sum(axis=0), (moved * moved).sum(axis=0)
    if batch.signature.coupled:
        mass = world.bodies.arrays["mass"][0, batch.state.rows]
        kind = _groups(world, batch)
        top, bottom = (np.bincount(kind, mass * one)[kind] for one in (top, bottom))
    ratios: Array = np.sqrt(np.divide(top, bottom, out=np.zeros_like(top), where=bottom > 1e-290))
    return np.where(np.isfinite(ratios), ratios, 0.0)


def _groups(world: World, batch: Batch) -> Array:
    """The number of each row's group."""
    objects = world.bodies.objects
    numbers: dict[int, int] = {}
    return np.array([numbers.setdefault(id(world.group_of(objects[row])), len(numbers)) for row in batch.state.rows])


class Watch:
    """Looks at the energy before and after a run in fixed steps, where that costs little."""

    def __init__(self, world: World, end: Instant) -> None:
        self.world = world
        self.before: Energy | None = None
        dt = world.settings.dt
        if dt is None or not elapsed(end, world.time) >= LONG * dt:
            return
        evaluated = [batch for batch in world.batches if batch.signature.laws and batch.state.count]
        if not all(
            batch.signature.conservative for batch in evaluated
        ):  # what works may be far more than what is there in the end
            return
        sources = [world.sources(batch) for batch in evaluated]
        if evaluated and sum(one.load for one in sources if one is not None) <= MOST:
            self.before = self._energy()

    def _energy(self) -> Energy | None:
        try:
            found = energy(self.world)
        except XpheveError:
            return None
        return found if all(map(math.isfinite, found)) else None

    def report(self) -> None:
        """Warn if the run made or lost energy that no law accounts for."""
        after = None if self.before is None else self._energy()
        if self.before is None or after is None:
            return
        scale = max(one.kinetic + abs(one.potential) for one in (self.before, after))
        drift = after.balance - self.before.balance
        if abs(drift) <= LOST * scale or not scale > 0.0:
            return
        dt = self.world.settings.dt
        warnings.warn(
            f"energy changed by {drift:.3g} J up to t = {self.world.time[0]} s that no law accounts for, of {scale:.3g} J in all: "
            f"dt = {dt} s did not resolve the motion. Take dt = {0.1 * (dt or 0.0):.1g} s or less, or run(until=...) without dt, to tolerances",
            ResolutionWarning,
            stacklevel=4,
        )
