"""Compiling before it is needed: the loops of a scene as it stands, or each installed law's alone."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from xpheve.errors import XpheveError
from xpheve.objects import PhysicalObject
from xpheve.shapes import Sphere

if TYPE_CHECKING:
    from xpheve.engine import PhysicsEngine
    from xpheve.plan.groups import Batch
    from xpheve.plan.world import World

PLACES = ((1e12, 2e12, 3e12), (-2e12, 1e12, 4e12))  # outside of any black hole
SPEEDS = ((1.0, 0.5, -0.5), (-0.5, 1.0, 0.25))


class Warmed(NamedTuple):
    """A loop: what it calculates, where its code came from and in what time [s]; or, with origin "none", why there is no code."""

    what: str
    origin: str
    seconds: float
    because: str = ""


def warm(engine: PhysicsEngine, dt: float | None = None) -> Iterator[Warmed]:
    """Compile what ``engine``, planned as it stands, would compile in ``run(dt=dt)``, if that is long enough; no time passes.

    Raises
    ------
    LawFailedError, TraceError, CompileError
        From the laws, and from the compiler.
    """
    world = engine._world
    world.set_out(replace(world.settings, dt=dt))
    world.plan()
    for batch in world.batches:
        sources = world.sources(batch) if batch.state.count else None
        if sources is None:
            continue
        what = " + ".join(batch.signature.laws) or "torques"
        if batch.choice.offers[batch.stepper.id].exact:
            yield Warmed(what, "none", 0.0, f"in closed form: {batch.stepper.id}")
        elif batch.stepper.driver and sources.motion is not None:
            yield from _driver(world, batch, what)
        else:
            yield from _loop(world, batch, what)


def _driver(world: World, batch: Batch, what: str) -> Iterator[Warmed]:
    """The driver of ``batch``, and the forces that it calls; how much work there will be, nobody knows yet."""
    sources = world.sources(batch)
    assert sources is not None and sources.motion is not None
    if world.compile == "never":
        yield Warmed(what, "none", 0.0, 'not compiled: compile="never"')
        return
    for kernel in sources.motion.compile(batch.stepper.driver):
        yield Warmed(kernel.what, kernel.origin, kernel.seconds)


def _loop(world: World, batch: Batch, what: str) -> Iterator[Warmed]:
    """The loop of ``batch`` that is written around its own steps."""
    from xpheve.loop.program import COMPILED
    from xpheve.plan.tiers import choose_tier, why_tier

    sources = world.sources(batch)
    assert sources is not None
    program = sources.program
    if program is None:
        yield Warmed(what, "none", 0.0, sources.why_alone)
    elif choose_tier(world.compile, sources.load) != COMPILED:
        yield Warmed(what, "none", 0.0, f"not compiled: {why_tier(world.compile, sources.load)}")
    else:
        kernel = program.entry(COMPILED)
        yield Warmed(kernel.what, kernel.origin, kernel.seconds)


def warm_laws(kind: type[PhysicsEngine], registry: Any) -> Iterator[Warmed]:
    """Compile each law of ``registry`` that acts along the way in a loop of its own, with its usual parameters, on two objects."""
    for info in registry.laws():
        if info.kind not in ("field", "pair"):
            continue
        try:
            found = list(_loops(_alone(kind, registry, info.id)))
        except XpheveError as error:
            yield Warmed(info.id, "none", 0.0, str(error))
            continue
        if found:
            yield from found
        else:
            yield Warmed(info.id, "none", 0.0, "constant: its force is stored, and needs no loop")


def _loops(engine: PhysicsEngine) -> Iterator[Warmed]:
    """The loops of fixed steps, also where two objects alone have a closed form."""
    world = engine._world
    world.plan()
    for batch in world.batches:
        if batch.state.count and world.sources(batch) is not None:
            yield from _loop(world, batch, " + ".join(batch.signature.laws) or "torques")


def _alone(kind: type[PhysicsEngine], registry: Any, ident: str) -> PhysicsEngine:
    engine = kind(registry=registry, compile="always")
    law = engine.add_law(ident)
    columns: dict[str, Any] = {name: 1.0 for name, column in law.columns.items() if math.isnan(column.default)}
    for place, speed in zip(PLACES, SPEEDS, strict=True):
        engine.add_object(PhysicalObject(Sphere(0.1), position=place, velocity=speed, **columns), laws=[law])
    return engine
