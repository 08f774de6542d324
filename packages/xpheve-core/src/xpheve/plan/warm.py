"""Compiling before it is needed: the loops of a scene as it stands, or each installed law's alone."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

from xpheve.errors import XpheveError
from xpheve.objects import PhysicalObject
from xpheve.shapes import Sphere

if TYPE_CHECKING:
    from xpheve.engine import PhysicsEngine

PLACES = ((1e12, 2e12, 3e12), (-2e12, 1e12, 4e12))  # outside of any black hole
SPEEDS = ((1.0, 0.5, -0.5), (-0.5, 1.0, 0.25))


class Warmed(NamedTuple):
    """A loop: what it calculates, where its code came from and in what time [s]; or, with origin "none", why there is no code."""

    what: str
    origin: str
    seconds: float
    because: str = ""


def warm(engine: PhysicsEngine) -> Iterator[Warmed]:
    """Compile what ``engine``, planned as it stands, would compile when time passes; time does not.

    Raises
    ------
    LawFailedError, TraceError, CompileError
        From the laws, and from the compiler.
    """
    from xpheve.loop.program import COMPILED
    from xpheve.plan.tiers import choose_tier, why_tier

    world = engine._world
    world.plan()
    for batch in world.batches:
        sources = world.sources(batch) if batch.state.count else None
        if sources is None:
            continue
        program, what = sources.program, " + ".join(batch.signature.laws) or "torques"
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
            found = list(warm(_alone(kind, registry, info.id)))
        except XpheveError as error:
            yield Warmed(info.id, "none", 0.0, str(error))
            continue
        if found:
            yield from found
        else:
            yield Warmed(info.id, "none", 0.0, "constant: its force is stored, and needs no loop")


def _alone(kind: type[PhysicsEngine], registry: Any, ident: str) -> PhysicsEngine:
    engine = kind(registry=registry, compile="always")
    law = engine.add_law(ident)
    columns: dict[str, Any] = {name: 1.0 for name, column in law.columns.items() if math.isnan(column.default)}
    for place, speed in zip(PLACES, SPEEDS, strict=True):
        engine.add_object(PhysicalObject(Sphere(0.1), position=place, velocity=speed, **columns), laws=[law])
    return engine
