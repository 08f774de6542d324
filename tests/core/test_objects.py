"""Handles: what they own before, in and after an engine."""

from __future__ import annotations

import copy
import math

import pytest

import xpheve as xp
from xpheve.errors import InvalidValueError


def test_a_free_object_owns_its_state() -> None:
    body = xp.PhysicalObject(xp.Sphere(0.5), density=1000.0, position=(1, 2, 3), name="ball", charge=2.0)
    assert body.mass == pytest.approx(1000 * math.pi / 6)
    assert body.inertia == pytest.approx((0.4 * body.mass * 0.25,) * 3)
    assert body.position == (1, 2, 3) and body.columns == {"charge": 2.0} and body["charge"] == 2.0
    body.position = [4, 5, 6]
    assert body.position == (4.0, 5.0, 6.0) and all(isinstance(c, float) for c in body.position)
    assert body.forces == () and body.laws == () and body.engine is None


def test_state_moves_in_and_out() -> None:
    engine = xp.PhysicsEngine()
    body = xp.PhysicalObject(velocity=(1, 0, 0), mass=3.0, inertia=(1, 2, 3), angular_velocity=(0, 2, 0))
    engine.add_object(body)
    engine.run(until=2.0)
    engine.remove_object(body)
    q = body.orientation
    assert body.position == (2, 0, 0) and body.mass == 3.0 and body.inertia == (1, 2, 3)
    assert q == pytest.approx((math.cos(2), 0, math.sin(2), 0), abs=1e-14)
    engine.run(until=5.0)
    assert body.position == (2, 0, 0)
    other = xp.PhysicsEngine()
    other.add_object(body)
    other.run(until=1.0)
    assert body.position == (3, 0, 0) and body.engine is other


def test_orientations_are_made_units_and_stay_if_they_are() -> None:
    body = xp.PhysicalObject(orientation=(0, 3, 0, 4))
    assert body.orientation == (0, 0.6, 0, 0.8)
    body.orientation = body.orientation
    assert body.orientation == (0, 0.6, 0, 0.8)
    body.orientation = (1e-90, 0, 0, 0)
    assert body.orientation == (1, 0, 0, 0)
    with pytest.raises(InvalidValueError):
        body.orientation = (1e-120, 0, 0, 0)


def test_copies_are_free() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("basic:planet_gravity")
    body = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0), name="ball", charge=3.0), laws=[law])
    engine.run(until=1.0)
    twin = copy.copy(body)
    assert twin.engine is None and twin.position == body.position and twin.velocity == body.velocity
    assert twin.name == "ball" and twin.columns == {"charge": 3.0} and twin.forces == ()
    twin.position = (0, 0, 0)
    assert body.position != (0, 0, 0)


def test_a_deep_copy_or_pickle_does_not_drag_the_engine_along() -> None:
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))
    twin = copy.deepcopy(body)
    assert twin.engine is None and twin.velocity == (1, 0, 0) and body.engine is engine


def test_a_misspelt_attribute_is_not_silently_made() -> None:
    body = xp.PhysicalObject()
    with pytest.raises(AttributeError):
        body.velocty = (1, 0, 0)  # type: ignore[attr-defined]
    with pytest.raises(AttributeError):
        body.velocty  # noqa: B018


@pytest.mark.parametrize("wrong", ["positon", "velocty", "orientaton", "masss", "inertai", "fixd", "densty", "shap"])
def test_a_misspelt_argument_is_not_silently_a_column(wrong: str) -> None:
    with pytest.raises(InvalidValueError, match="did you mean"):
        xp.PhysicalObject(**{wrong: 1.0})  # type: ignore[arg-type]


def test_fixed_is_not_taken_back_under_way() -> None:
    """Whether an object moves is part of the plan: setting it takes effect, or is refused; it is not ignored."""
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))
    engine.run(until=1.0)
    try:
        body.fixed = True
    except (AttributeError, InvalidValueError):
        assert not body.fixed
    else:
        engine.run(until=2.0)
        assert body.position == (1, 0, 0) and body.velocity == (0, 0, 0)


def test_the_shape_is_not_changed_under_way_without_effect() -> None:
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic")
    body = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), velocity=(1, 0, 0)), laws=[bounce])
    engine.add_object(xp.PhysicalObject(xp.Plane((-1, 0, 0), -5.0), fixed=True), laws=[bounce])
    engine.run(until=1.0)
    try:
        body.shape = xp.Sphere(1.5)
    except (AttributeError, InvalidValueError):
        assert body.shape == xp.Sphere(0.5)
    else:
        engine.run(until=5.0)
        assert body.position[0] == pytest.approx(3.5 - 1.5, abs=1e-12)


def test_reprs_name_them() -> None:
    assert "'ball'" in repr(xp.PhysicalObject(xp.Sphere(1), name="ball")) and "Sphere" in repr(
        xp.PhysicalObject(xp.Sphere(1))
    )
    assert "fixed" in repr(xp.PhysicalObject(fixed=True))


@pytest.mark.parametrize("name", ["position", "velocity", "angular_velocity"])
def test_minus_zero_is_zero(name: str) -> None:
    body = xp.PhysicalObject(**{name: (-0.0, 0.0, -0.0)})
    assert all(math.copysign(1.0, c) == 1.0 for c in getattr(body, name))


def test_subclasses_may_add_behaviour_and_an_overridden_update_is_not_ignored() -> None:
    class Car(xp.PhysicalObject):
        def press(self) -> None:
            self.add_force((1, 0, 0), id="engine")

    engine = xp.PhysicsEngine()
    car = engine.add_object(Car())
    assert isinstance(car, Car)
    car.press()
    engine.run(until=1.0)
    assert car.velocity == (1, 0, 0)


def test_many_at_once_are_all_or_none() -> None:
    engine = xp.PhysicsEngine()
    objects = [xp.PhysicalObject(position=(k, 0, 0)) for k in range(1000)]
    engine.add_objects(objects)
    assert engine.objects == tuple(objects) and engine.bodies.position.shape == (1000, 3)
    engine.run(until=1.0)
    for body in objects[10:]:
        engine.remove_object(body)
    assert sorted(obj.position[0] for obj in engine.objects) == list(range(10))


def test_an_iterator_of_objects_is_taken() -> None:
    engine = xp.PhysicsEngine()
    assert len(engine.add_objects(xp.PhysicalObject() for _ in range(3))) == 3
    assert engine.add_objects([]) == ()
