"""A law costs nothing where it has no work: `explain` counts its evaluations."""

from __future__ import annotations

from typing import Any

import pytest

import xpheve as xp


class Noted(xp.PhysicalLaw):
    """A handler that does nothing but be counted."""

    def enforce_this_law(self, event: Any) -> None:
        """Nothing."""


class Push(xp.FieldLaw):
    """A constant force, put into a container of events."""

    def force(self, body: Any) -> Any:
        """One newton."""
        return (1.0, 0.0, 0.0)


NEVER_FIRING = {
    "a time after the end": xp.when.Elapsed(100.0),
    "a post that nobody sends": xp.when.Posted("nothing"),
    "a force that never ends": xp.when.ForceExpired("wind"),
    "an impact that does not happen": xp.when.Impact(),
    "a contact that does not begin": xp.when.ContactBegin(),
    "a contact that does not end": xp.when.ContactEnd(),
    "a removal": xp.when.ObjectRemoved(),
    "a change": xp.when.Changed("mass"),
}


def evaluations(engine: xp.PhysicsEngine) -> dict[str, int]:
    """By id, what `explain` says."""
    return {one["id"]: one["evaluations"] for one in engine.explain().data["laws"]}


@pytest.mark.parametrize("kind", [Noted, Push])
@pytest.mark.parametrize("name", list(NEVER_FIRING))
@pytest.mark.parametrize("options", [{}, {"dt": 0.01}])
def test_a_law_whose_condition_never_fires_is_never_evaluated(
    name: str, kind: type[xp.PhysicalLaw], options: Any
) -> None:
    engine = xp.PhysicsEngine()
    idle = engine.add_law(kind(), container=xp.LawContainer(NEVER_FIRING[name]))
    gravity = engine.add_law("basic:planet_gravity")
    bodies = [xp.PhysicalObject(xp.Sphere(0.1), position=(k, 0, 0)) for k in range(3)]
    engine.add_objects(bodies, laws=[idle, gravity])
    bodies[0].add_force((0.0, 0.0, 1.0), duration=1.0)
    engine.run(until=3.0, every=0.1, **options)
    assert evaluations(engine)[idle.label()] == idle.evaluations == 0
    assert evaluations(engine)["basic:planet_gravity"] == 1
    assert all(holder.firings == 0 for holder in idle.containers)


def test_laws_without_objects_disabled_or_along_no_way_are_never_evaluated() -> None:
    engine = xp.PhysicsEngine()
    drag = engine.add_law("basic:linear_drag")  # nobody is mapped
    off = engine.add_law("basic:quadratic_drag", enabled=False)
    spring = engine.add_law("basic:spring")  # one object makes no pair
    bounce = engine.add_law("collision:elastic")  # nothing to hit
    body = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)), laws=[off, bounce])
    engine.run(until=5.0, dt=0.1)
    assert {law.label(): law.evaluations for law in (drag, off, spring, bounce)} == {
        "basic:linear_drag": 0,
        "basic:quadratic_drag": 0,
        "basic:spring": 0,
        "collision:elastic": 0,
    }
    assert body.position == (5.0, 0.0, 0.0)


def test_a_constant_law_is_evaluated_again_only_when_what_it_reads_is_set() -> None:
    engine = xp.PhysicsEngine()
    gravity = engine.add_law("basic:planet_gravity")
    body = engine.add_object(xp.PhysicalObject(), laws=[gravity])
    engine.run(until=1.0, dt=0.001, every=0.01)
    assert gravity.evaluations == 1
    body.velocity = (1.0, 0.0, 0.0)  # not read
    engine.run(until=2.0)
    assert gravity.evaluations == 1
    body.mass = 2.0
    engine.run(until=3.0)
    assert gravity.evaluations == 2
    gravity.acceleration = 1.6
    engine.run(until=4.0)
    assert gravity.evaluations == 3


def test_reading_evaluates_nothing() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("basic:spring_to_point")
    body = engine.add_object(xp.PhysicalObject(position=(1, 0, 0)), laws=[law])
    engine.run(until=1.0, dt=0.1)
    before = law.evaluations
    for _ in range(10):
        _ = body.position, engine.bodies.velocity, engine.momentum(), engine.explain(), engine.checkpoint()
    assert law.evaluations == before
