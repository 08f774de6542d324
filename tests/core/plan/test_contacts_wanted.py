"""Who has contacts looked for flies along parabolas: what asks for contacts later takes it off its curve."""

from __future__ import annotations

from typing import Any

import pytest

import xpheve as xp
from xpheve.plan.contacts_wanted import contacts_concern
from xpheve.plugins.registry import Registry

when = xp.when


def stepper_of(engine: xp.PhysicsEngine, obj: xp.PhysicalObject) -> str:
    """Return the id of the stepper that moves ``obj``."""
    world: Any = engine._world
    return str(world.batches[int(world.bodies.batch[obj._row])].stepper.id)


def curved(engine: xp.PhysicsEngine, obj: xp.PhysicalObject) -> bool:
    """Whether ``obj`` flies on a curve."""
    world: Any = engine._world
    return bool(world.flight(obj._row).curved)


@pytest.fixture
def scene(engine: xp.PhysicsEngine) -> tuple[xp.PhysicsEngine, xp.PhysicalObject, xp.PhysicalObject, Any]:
    """Return a ball on a spring, another, and a collision law with a wall, which none of them obeys."""
    bounce = engine.add_law("collision:elastic", restitution=1.0)
    engine.add_object(xp.PhysicalObject(xp.Plane((1, 0, 0), offset=-0.5), fixed=True), laws=[bounce])
    ball, other = (
        engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(1, y, 0)), laws=["spring"]) for y in (0, 5)
    )
    return engine, ball, other, bounce


def test_who_obeys_no_contact_law_stays_on_its_curve(scene: Any) -> None:
    engine, ball, other, _ = scene
    engine.run(until=3.0, dt=0.01)
    assert curved(engine, ball) and curved(engine, other)
    assert not contacts_concern(engine._world, [ball, other])


def test_a_response_law_mapped_in_mid_run_takes_it_off(scene: Any) -> None:
    engine, ball, other, bounce = scene
    engine.run(until=0.5, dt=0.001)
    engine.map(ball, bounce)
    engine.run(until=0.501, dt=0.001)
    assert stepper_of(engine, ball) == "core:midpoint" and not curved(engine, ball)
    assert curved(engine, other)
    engine.run(until=2.0, dt=0.001)
    # without the wall it would have swung to x = -1
    assert ball.position[0] >= -0.4 - 1e-9
    assert engine.energy().total == pytest.approx(0.5 * 4.0 * (1 + 26), rel=1e-5)


def test_unmapped_it_goes_back(scene: Any) -> None:
    engine, ball, _, bounce = scene
    engine.map(ball, bounce)
    engine.run(until=0.2, dt=0.01)
    assert not curved(engine, ball)
    engine.unmap(ball, bounce)
    engine.run(until=0.4, dt=0.01)
    assert curved(engine, ball)


def test_switching_the_law_does_the_same(scene: Any) -> None:
    engine, ball, _, bounce = scene
    bounce.enabled = False
    engine.map(ball, bounce)
    engine.run(until=0.2, dt=0.01)
    assert curved(engine, ball)
    bounce.enabled = True
    engine.run(until=0.3, dt=0.01)
    assert not curved(engine, ball)


class Listening(xp.PhysicalLaw):
    """Hear of contacts."""

    id = "curves:listening"

    def enforce_this_law(self, event: Any) -> None:
        pass


def test_a_container_that_listens_later_takes_it_off(scene: Any) -> None:
    engine, ball, _, _ = scene
    law = engine.add_law(Listening, container=xp.LawContainer(when.Posted("never")))
    engine.map(ball, law)
    engine.run(until=0.2, dt=0.01)
    assert curved(engine, ball)
    container = engine.add_container(xp.LawContainer(when.ContactBegin()))
    container.add_law(law)
    engine.run(until=0.3, dt=0.01)
    assert not curved(engine, ball)


def test_a_law_that_maps_in_its_handler_takes_it_off_at_that_instant(scene: Any) -> None:
    engine, ball, _, bounce = scene

    class Arm(xp.PhysicalLaw):
        """Map the collision law."""

        def enforce_this_law(self, event: Any) -> None:
            engine.map(ball, bounce)

    law = Arm()
    engine.add_law(law, container=xp.LawContainer(when.Crosses("body.position.x - 0.5")))
    engine.map(ball, law)
    engine.run(until=0.6, dt=0.001)
    assert not curved(engine, ball)
    engine.run(until=1.5, dt=0.001)
    assert ball.position[0] >= -0.4 - 1e-9


def test_what_flies_free_is_asked_nothing(registry: Registry) -> None:
    """Free balls fly along parabolas anyway: those with contacts and those without are one batch."""
    engine = xp.PhysicsEngine(registry=registry)
    bounce = engine.add_law("collision:elastic")
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.1)), laws=[bounce])
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(5, 0, 0)))
    engine.run(until=1.0)
    assert [group["objects"] for group in engine.explain().data["groups"]] == [2]
