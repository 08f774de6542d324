"""Thesis 3.3, figures 3-22 and 3-23: applications extend PhysicalObject; an overridden update is refused, all else is kept."""

from __future__ import annotations

import copy
import pickle

import pytest

import xpheve as xp
from xpheve.errors import LawDefinitionError, RecordError


class Car(xp.PhysicalObject):
    """An object with an attribute, a method and a constructor of its own."""

    def __init__(self, driver: str, power: float) -> None:
        super().__init__(xp.Box((4, 2, 1)), mass=1000.0, name=f"car of {driver}")
        self.driver = driver
        self.power = power
        self.stops = ["home"]

    def honk(self) -> str:
        """Say something."""
        return f"{self.driver} honks"


@pytest.mark.thesis("subclasses/decide")
def test_fig_3_22_an_overridden_update_is_refused_where_it_is_written() -> None:
    with pytest.raises(LawDefinitionError, match=r"Glass defines update.*FieldLaw.*condition"):

        class Glass(xp.PhysicalObject):
            """The thesis's way."""

            def update(self, t: float) -> None:
                """Never called."""


@pytest.mark.thesis("subclasses")
def test_fig_3_23_attributes_and_methods_of_a_subclass_work_in_an_engine() -> None:
    engine = xp.PhysicsEngine(up="z")
    car = engine.add_object(Car("Ann", 5.0), laws=[engine.add_law("basic:planet_gravity")])
    engine.run(until=1.0)
    assert car.honk() == "Ann honks" and car.velocity[2] < 0
    car.power = 6.0
    assert car.power == 6.0 and engine.objects[0] is car


@pytest.mark.thesis("subclasses")
def test_3_3_copies_and_pickles_keep_class_attributes_and_state() -> None:
    engine = xp.PhysicsEngine()
    car = engine.add_object(Car("Ann", 5.0))
    car.velocity = (1, 2, 3)
    for twin in (copy.copy(car), copy.deepcopy(car), pickle.loads(pickle.dumps(car))):
        assert type(twin) is Car and twin.engine is None
        assert (twin.driver, twin.power, twin.velocity, twin.mass) == ("Ann", 5.0, (1, 2, 3), 1000.0)
    assert copy.copy(car).stops is car.stops and copy.deepcopy(car).stops is not car.stops


@pytest.mark.thesis("subclasses")
def test_3_3_copied_and_restored_engines_keep_them_too() -> None:
    engine = xp.PhysicsEngine()
    engine.add_object(Car("Ann", 5.0))
    engine.run(until=1.0)
    for twin in (engine.copy(), xp.PhysicsEngine.restore(engine.checkpoint(), objects=[Car])):
        car = twin.objects[0]
        assert isinstance(car, Car) and car.honk() == "Ann honks" and car.stops == ["home"]
        twin.reset()
        assert isinstance(twin.objects[0], Car)
    with pytest.raises(RecordError, match=r"objects=\[Car\]"):
        xp.PhysicsEngine.restore(engine.checkpoint())


@pytest.mark.thesis("subclasses")
def test_3_3_a_checkpoint_refuses_what_it_cannot_keep_and_a_scene_file_says_what_it_leaves_out() -> None:
    engine = xp.PhysicsEngine()
    car = engine.add_object(Car("Ann", 5.0))
    car.owner = object()
    with pytest.raises(RecordError, match="owner"):
        engine.checkpoint()
    with pytest.warns(xp.errors.XpheveWarning, match="Car"):
        xp.scene.dumps(engine)


@pytest.mark.thesis("subclasses")
def test_3_3_reset_leaves_the_hosts_own_attributes_alone() -> None:
    engine = xp.PhysicsEngine()
    car = engine.add_object(Car("Ann", 5.0))
    engine.run(until=1.0)
    car.power = 9.0
    engine.reset()
    assert engine.objects[0] is car and car.power == 9.0
