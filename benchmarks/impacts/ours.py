"""xPheve on a stage: one contender a setting."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from benchmarks.impacts.stage import LOOKS, Stage, Thing
from benchmarks.measure import Row
from benchmarks.problem import End, Scene
from benchmarks.turns import Contender

NAME = "xPheve"


@dataclass(frozen=True)
class Ours:
    """A setting of xPheve: in words, what the engine is told, and what a run is told besides the end."""

    setting: str = "-"
    engine: Mapping[str, Any] = field(default_factory=dict)
    run: Mapping[str, float] = field(default_factory=dict)


DEFAULT, ALWAYS = Ours(), Ours("compile always", {"compile": "always"})


def contenders(scene: Scene) -> list[Contender]:
    """All settings of xPheve for the scene."""
    return [contender(scene, one) for one in scene.ours]


def contender(scene: Scene, one: Ours) -> Contender:
    """One setting. The plan is made before; a run before has compiled what is compiled, so that neither is part of the time."""

    def made() -> tuple[Any, Sequence[Any]]:
        engine = new_engine(**one.engine)
        bodies = scene.build(engine)
        engine.run(until=0.0, **one.run)
        return engine, bodies

    def make() -> tuple[Callable[[], Any], Callable[[], End]]:
        engine, bodies = made()
        return (lambda: engine.run(until=scene.span, **one.run)), (lambda: read(bodies))

    def watch() -> list[End]:
        engine, bodies = made()
        seen = []
        for k in range(1, LOOKS + 1):
            engine.run(until=k / LOOKS * scene.span, **one.run)
            seen.append(read(bodies))
        return seen

    row = Row(scene.id, NAME, one.setting)
    row.more["ours"] = True
    return Contender(row, make, watch=watch)


def new_engine(**more: Any) -> Any:
    """An engine with z up."""
    import xpheve as xp

    return xp.PhysicsEngine(up="z", **more)


def fill(engine: Any, stage: Stage, law: str = "collision:elastic", **more: Any) -> Sequence[Any]:
    """Put a stage into an engine; the objects that move, in their order."""
    bounce = engine.add_law(law, **({"restitution": stage.restitution} | more))
    laws = [engine.add_law("basic:planet_gravity", acceleration=stage.gravity)] if stage.gravity else []
    engine.add_objects([thing(one) for one in stage.scenery], laws=[bounce])
    movers = [thing(one) for one in stage.movers]
    engine.add_objects(movers, laws=[*laws, bounce])
    return movers


def thing(one: Thing) -> Any:
    """A thing as an object."""
    import xpheve as xp

    still: dict[str, Any] = {"position": one.position}
    if one.shape != "plane":
        still["orientation"] = one.orientation
    if one.mass == 0:
        return xp.PhysicalObject(shape(one), fixed=True, **still)
    return xp.PhysicalObject(shape(one), mass=one.mass, velocity=one.velocity, angular_velocity=one.turning, **still)


def shape(one: Thing) -> Any:
    """Its shape."""
    import xpheve as xp

    if one.shape == "sphere":
        return xp.Sphere(one.size[0])
    if one.shape == "box":
        return xp.Box([2.0 * edge for edge in one.size])
    if one.shape == "capsule":
        return xp.Capsule(*one.size)
    return xp.Plane(one.size)


def read(bodies: Sequence[Any]) -> End:
    """Where all are."""
    columns = ("position", "velocity", "orientation", "angular_velocity")
    return End(*(np.array([getattr(one, name) for one in bodies]) for name in columns))


def listen(engine: Any, objects: Sequence[Any], to: Callable[[Any], None]) -> None:
    """Have ``to(event)`` called at each impact of the objects with one another."""
    import xpheve as xp

    class Told(xp.PhysicalLaw):
        id = "benchmarks:told"

        def enforce_this_law(self, event: Any) -> None:
            to(event)

    law = engine.add_law(Told, xp.LawContainer(xp.when.Impact()))
    for one in objects:
        engine.map(one, law)
