"""Containers that look for contacts themselves: boxes and picks, how laws answer there, and that they are saved."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

import xpheve as xp
from xpheve.errors import LawFailedError, NotAcceptedError, ParameterError
from xpheve_laws_collision import BoundingBoxes, Picking
from xpheve_laws_collision.bounds import bounds_of

DIAGONAL = (math.cos(math.pi / 8), 0.0, 0.0, math.sin(math.pi / 8))  # 45 degrees about z


def two(container: Any, law: str = "collision:point", gap: float = 0.0, **parameters: Any) -> tuple[Any, ...]:
    """Return an engine with two balls of radius 0.5 along x, the first at 6 m/s."""
    engine = xp.PhysicsEngine()
    made = engine.add_law(law, container=container, **parameters)
    one = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), velocity=(6, 0, 0)), laws=[made])
    other = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(1 + gap, 0, 0)), laws=[made])
    return engine, made, one, other


def test_turned_boxes_and_capsules_have_the_box_about_them() -> None:
    low, high = bounds_of(xp.Box((2, 2, 1)), (1, 0, 0), DIAGONAL)
    assert low == pytest.approx((1 - math.sqrt(2), -math.sqrt(2), -0.5)) and high[2] == 0.5
    low, high = bounds_of(xp.Capsule(0.5, 2.0), (0, 0, 0), (1, 0, 0, 0))
    assert low == (-0.5, -0.5, -1.5) and high == (0.5, 0.5, 1.5)
    assert bounds_of(None, (1, 2, 3), (1, 0, 0, 0)) == ((1, 2, 3), (1, 2, 3))


def test_a_box_stands_on_the_lowest_corner_of_its_bounds_on_a_plane() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:point", container="collision:bounding_box")
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[law])
    box = xp.PhysicalObject(xp.Box((2, 2, 2)), position=(0, 1.5, 0), velocity=(0, -1, 0), orientation=DIAGONAL)
    engine.add_object(box, laws=[law])
    engine.run(until=0.2, dt=0.01)
    assert box.velocity == (0, 1, 0)  # its corner reaches 1.414 below the centre
    engine.run(until=1.0, dt=0.01)
    assert box.velocity == (0, 1, 0)  # overlapping, and left alone while it recedes


@pytest.mark.parametrize("law", ["collision:elastic", "collision:point"])
def test_laws_of_exact_contacts_answer_in_a_polled_container_too(law: str) -> None:
    engine, made, one, other = two("collision:bounding_box", law, gap=0.3)
    engine.run(until=0.5, dt=0.01)
    assert one.velocity == (0, 0, 0) and other.velocity == (6, 0, 0) and made.evaluations >= 1
    assert one.position[0] == pytest.approx(0.3, abs=0.07)


def test_a_free_law_of_the_role_collision_hears_of_contacts_with_normal_and_point() -> None:
    heard: list[Any] = []
    kind = type(
        "Hear",
        (xp.PhysicalLaw,),
        {"role": "collision", "enforce_this_law": lambda self, event: heard.extend(event.contacts)},
    )
    engine = xp.PhysicsEngine()
    law = engine.add_law(kind(), container=BoundingBoxes(period=0.05))
    for x, v in ((0, 1), (1.2, 0), (2.4, -1)):
        engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(x, 0, 0), velocity=(v, 0, 0)), laws=[law])
    engine.run(until=0.25)
    assert {frozenset((c.body_a.position[0], c.body_b.position[0])) for c in heard} == {
        frozenset((0.25, 1.2)),
        frozenset((1.2, 2.15)),
    }
    first = heard[0]
    middle = 0.7 if first.body_a.position[0] < 1 else 1.7
    assert (
        abs(first.normal[0]) == 1.0 and first.normal[1:] == (0, 0) and first.point[0] == pytest.approx(middle, abs=0.1)
    )
    assert -0.06 < first.separation <= 0.0 and first.approach_speed == 1.0


def test_a_period_of_its_own_does_without_host_steps_and_none_needs_them() -> None:
    engine, *_ = two(BoundingBoxes(period=0.01))
    engine.run(until=1.0)
    assert engine.containers[0].detections == 100
    engine, *_ = two("collision:bounding_box")
    engine.run(until=1.0, dt=0.1)
    assert engine.containers[0].detections == 10


def test_parameters_of_containers_are_checked_and_stay_once_in_an_engine() -> None:
    for given in ({"factor": -1.0}, {"period": 0.0}, {"tolerance": 1.0}):
        with pytest.raises(ParameterError, match=next(iter(given))):
            Picking(**given)
    held = Picking(factor=3.0)
    two(held)
    with pytest.raises(ParameterError, match="make another"):
        held.factor = 2.0
    with pytest.raises(NotAcceptedError, match=r"picking accepts.*role 'collision'"):
        xp.PhysicsEngine().add_law("basic:planet_gravity", container=Picking())


def test_a_law_that_fails_in_a_polled_container_leaves_the_engine_just_before() -> None:
    kind = type("Bad", (xp.ResponseLaw,), {"id": "mine:bad", "respond": lambda self, contact: -1.0})
    engine = xp.PhysicsEngine()
    law = engine.add_law(kind(), container=BoundingBoxes(period=0.1))
    for x in (0.0, 0.9):
        engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(x, 0, 0), velocity=(1 - x, 0, 0)), laws=[law])
    with pytest.raises(LawFailedError, match=r"mine:bad\.respond gave -1\.0"):
        engine.run(until=1.0)
    assert [obj.velocity[0] for obj in engine.objects] == pytest.approx([1.0, 0.1]) and law.evaluations == 0


@pytest.mark.parametrize("container", [BoundingBoxes, Picking])
def test_checkpoints_and_copies_keep_the_container_and_its_parameters(container: Any) -> None:
    engine, _, _, _ = two(container(period=0.03), gap=1.0)
    engine.run(until=0.1)
    twin, copy = xp.PhysicsEngine.restore(engine.checkpoint()), engine.copy()
    for one in (engine, twin, copy):
        one.run(until=1.0)
        assert one.containers[0].parameters == engine.containers[0].parameters
        assert [obj.velocity for obj in one.objects] == [(0, 0, 0), (6, 0, 0)]
        assert one.bodies.position.tobytes() == engine.bodies.position.tobytes()


@pytest.mark.parametrize("container", [BoundingBoxes(period=0.03), Picking(factor=3.0), Picking()])
@pytest.mark.parametrize("law", ["collision:point", "collision:reverse", "collision:stop", "collision:elastic"])
def test_scene_files_keep_the_container_its_parameters_and_its_laws(container: Any, law: str, tmp_path: Path) -> None:
    held = type(container)(**container.parameters)
    engine, *_ = two(held, law)
    engine.save_scene(tmp_path / "scene.toml")
    again = xp.PhysicsEngine.load_scene(tmp_path / "scene.toml")
    assert type(again.containers[0]) is type(held) and again.containers[0].parameters == held.parameters
    assert [one.label() for one in again.containers[0].laws] == [law] and again.containers[0].condition is None


def test_response_laws_of_polled_containers_are_not_predicted() -> None:
    engine, *_ = two(BoundingBoxes(period=0.5), gap=1.0)
    engine.run(until=0.4)
    assert engine.objects[0].position[0] == pytest.approx(2.4)  # through the other, between two looks
    assert "contacts" not in engine.explain().data or not engine.explain().data["contacts"]
