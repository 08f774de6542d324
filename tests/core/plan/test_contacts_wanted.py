"""Who has contacts looked for stays on its curve, unless they are known along parabolas only: what makes that so later takes it off."""

from __future__ import annotations

import math
from typing import Any

import pytest

import xpheve as xp
from xpheve.plan.contacts_wanted import contacts_concern, needs_parabolas
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


MESH = xp.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])


def test_who_obeys_no_contact_law_stays_on_its_curve(scene: Any) -> None:
    engine, ball, other, _ = scene
    engine.run(until=3.0, dt=0.01)
    assert curved(engine, ball) and curved(engine, other)
    assert not contacts_concern(engine._world, [ball, other])


def test_a_response_law_mapped_in_mid_run_is_obeyed_on_the_curve(scene: Any) -> None:
    engine, ball, other, bounce = scene
    engine.run(until=0.5, dt=0.001)
    engine.map(ball, bounce)
    engine.run(until=2.0, dt=0.001)
    assert curved(engine, ball) and curved(engine, other)
    assert contacts_concern(engine._world, [ball]) and not needs_parabolas(engine._world, [ball])
    # from (1, 0, 0) by cos 2 t to the wall at -0.4, and back
    turn = math.acos(-0.4) / 2.0
    assert ball.position[0] == pytest.approx(math.cos(2.0 * (2.0 * turn - 2.0)), abs=1e-13)
    assert engine.energy().total == pytest.approx(0.5 * 4.0 * (1 + 26), rel=1e-12)


def test_a_mesh_among_the_objects_of_the_law_takes_it_off_and_back(scene: Any) -> None:
    engine, ball, other, bounce = scene
    engine.map(ball, bounce)
    engine.run(until=0.1, dt=0.001)
    assert curved(engine, ball)
    mesh = engine.add_object(xp.PhysicalObject(MESH, position=(50, 0, 0), fixed=True), laws=[bounce])
    engine.run(until=0.2, dt=0.001)
    assert stepper_of(engine, ball) == "core:midpoint" and not curved(engine, ball)
    assert curved(engine, other)
    refused = next(g for g in engine.explain().data["groups"] if g["stepper"] == "core:midpoint")["refused"]
    assert any("parabolas only" in reason or "contacts" in reason for reason in refused.values())
    engine.unmap(mesh, bounce)
    engine.run(until=0.3, dt=0.001)
    assert curved(engine, ball)


def test_a_shape_that_becomes_a_mesh_does_so_too(scene: Any) -> None:
    engine, ball, _, bounce = scene
    engine.map(ball, bounce)
    block = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(50, 0, 0), fixed=True), laws=[bounce])
    engine.run(until=0.1, dt=0.001)
    assert curved(engine, ball)
    block.shape = MESH
    engine.run(until=0.2, dt=0.001)
    assert not curved(engine, ball)


def test_switching_the_law_does_the_same(scene: Any) -> None:
    engine, ball, _, bounce = scene
    bounce.enabled = False
    engine.map(ball, bounce)
    engine.add_object(xp.PhysicalObject(MESH, position=(50, 0, 0), fixed=True), laws=[bounce])
    engine.run(until=0.2, dt=0.01)
    assert curved(engine, ball)
    bounce.enabled = True
    engine.run(until=0.3, dt=0.01)
    assert not curved(engine, ball)


class Listening(xp.PhysicalLaw):
    """Hear of contacts."""

    id = "curves:listening"

    def __init__(self, **parameters: Any) -> None:
        super().__init__(**parameters)
        self.heard: list[float] = []

    def enforce_this_law(self, event: Any) -> None:
        self.heard.append(event.time)


def test_a_container_that_listens_later_hears_of_contacts_on_the_curve(scene: Any) -> None:
    engine, ball, _, _ = scene
    law = engine.add_law(Listening, container=xp.LawContainer(when.Posted("never")))
    gate = engine.add_object(xp.PhysicalObject(xp.Plane((-1, 0, 0), offset=-0.5), fixed=True), laws=[law])
    engine.map(ball, law)
    engine.run(until=0.2, dt=0.01)
    assert contacts_concern(engine._world, [ball]) is False
    container = engine.add_container(xp.LawContainer(when.ContactEnd()))
    container.add_law(law)
    engine.run(until=1.0, dt=0.01)
    assert curved(engine, ball) and gate.fixed
    # a half-space beyond x = 0.5 that nobody answers for: a ball of 0.1 leaves it at x = 0.4
    assert law.heard == [pytest.approx(math.acos(0.4) / 2.0, abs=1e-12)]


def test_a_law_that_maps_in_its_handler_is_obeyed_from_that_instant_on(scene: Any) -> None:
    engine, ball, _, bounce = scene

    class Arm(xp.PhysicalLaw):
        """Map the collision law."""

        def enforce_this_law(self, event: Any) -> None:
            engine.map(ball, bounce)

    law = Arm()
    engine.add_law(law, container=xp.LawContainer(when.Crosses("body.position.x - 0.5")))
    engine.map(ball, law)
    engine.run(until=0.6, dt=0.001)
    assert curved(engine, ball)
    engine.run(until=1.5, dt=0.001)
    turn = math.acos(-0.4) / 2.0
    assert ball.position[0] == pytest.approx(math.cos(2.0 * (2.0 * turn - 1.5)), abs=1e-13)


def test_what_flies_free_is_asked_nothing(registry: Registry) -> None:
    """Free balls fly along parabolas anyway: pair by pair, those with contacts and those without are one batch."""
    engine = xp.PhysicsEngine(registry=registry, stepper="core:ballistic")
    bounce = engine.add_law("collision:elastic")
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.1)), laws=[bounce])
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(5, 0, 0)))
    engine.run(until=1.0)
    assert [group["objects"] for group in engine.explain().data["groups"]] == [2]
