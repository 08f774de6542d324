"""Thesis 3.2: containers, conditions, laws; figures 3-11 to 3-21."""

from __future__ import annotations

from typing import Any

import pytest

import xpheve as xp
from xpheve.errors import LawDefinitionError, NotAcceptedError


class Count(xp.PhysicalLaw):
    """Be counted."""

    def enforce_this_law(self, event: Any) -> None:
        """Do nothing."""


class Checks(xp.LawContainer):
    """Check each 10 ms; every tenth time something is there."""

    period = 0.01

    def detect(self) -> Any:
        return xp.Event(self.engine.time) if self.detections % 10 == 0 else None


@pytest.mark.thesis("one-detection-many-laws")
def test_fig_3_11_one_detection_serves_three_laws() -> None:
    engine = xp.PhysicsEngine()
    holder = Checks()
    laws = [engine.add_law(Count(name=name), container=holder) for name in "abc"]
    engine.run(until=1.0)
    assert holder.detections == 100 and holder.firings == 10
    assert [law.evaluations for law in laws] == [10, 10, 10]


@pytest.mark.thesis("container-is-told")
def test_fig_3_12_the_container_is_told_when_a_law_gains_or_loses_an_object() -> None:
    told: list[Any] = []
    kind = type(
        "Told",
        (xp.LawContainer,),
        {"condition": xp.when.Started(), "law_changed": lambda self, law, what, obj=None: told.append(obj)},
    )
    engine = xp.PhysicsEngine()
    law = engine.add_law(Count(), container=kind)
    one = engine.add_object(xp.PhysicalObject(), laws=[law])
    two = engine.add_object(xp.PhysicalObject())
    engine.map(two, law)
    engine.unmap(one, law)
    engine.remove_object(two)
    assert told == [one, two, one, two]


@pytest.mark.thesis("contact-is-handed-over")
def test_fig_3_14_the_container_hands_over_objects_normal_and_point() -> None:
    found: list[Any] = []
    kind = type("Hear", (xp.PhysicalLaw,), {"enforce_this_law": lambda self, event: found.extend(event.contacts)})
    engine = xp.PhysicsEngine()
    law = engine.add_law(kind(), container=xp.LawContainer(xp.when.Impact()))
    one = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), velocity=(1, 0, 0)), laws=[law])
    two = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(2, 0, 0)), laws=[law])
    engine.run(until=1.5)
    assert len(found) == 1 and {found[0].body_a, found[0].body_b} == {one, two}
    assert found[0].point == (1.5, 0, 0) and abs(found[0].normal[0]) == 1.0


@pytest.mark.thesis("container-refuses")
def test_fig_3_16_and_3_17_a_container_refuses_a_law_of_another_role() -> None:
    engine = xp.PhysicsEngine()
    with pytest.raises(NotAcceptedError, match=r"collision:exact accepts.*role 'collision'.*gravity"):
        engine.add_law("basic:planet_gravity", container="collision:exact")
    assert engine.laws == () and engine.containers == ()


@pytest.mark.thesis("container-refuses")
def test_4_10_the_startup_container_takes_any_law() -> None:
    engine = xp.PhysicsEngine()
    holder = xp.LawContainer(xp.when.Started())
    for law in ("basic:planet_gravity", "basic:linear_drag"):
        engine.add_law(law, container=holder)
    engine.add_law(Count(), container=holder)
    assert len(holder.laws) == 3


@pytest.mark.thesis("enforce-is-final", "enforce-is-final/fix")
def test_fig_3_18_and_3_19_disabled_laws_do_nothing_and_enforce_cannot_be_overridden() -> None:
    law = Count()
    assert law.enabled
    law.enforce(xp.Event(0.0))
    law.enabled = False
    law.enforce(xp.Event(0.0))
    assert law.evaluations == 1
    with pytest.raises(LawDefinitionError, match="final"):
        type("Cheat", (Count,), {"enforce": lambda self, event: None})


@pytest.mark.thesis("enforce-is-final")
def test_fig_3_18_nor_by_a_mixin() -> None:
    with pytest.raises(LawDefinitionError, match="final"):
        type("Cheat", (type("Mixin", (), {"enforce": lambda self, event: None}), Count), {})


@pytest.mark.thesis("called-once")
def test_fig_3_20_and_3_21_each_enabled_law_is_called_once_when_the_condition_is_met() -> None:
    engine = xp.PhysicsEngine()
    holder = xp.LawContainer(xp.when.Posted("now"))
    laws = [engine.add_law(Count(name=name), container=holder) for name in "abc"]
    laws[1].enabled = False
    engine.run(until=1.0)
    assert [law.evaluations for law in laws] == [0, 0, 0]
    engine.post("now")
    engine.run(until=2.0)
    assert [law.evaluations for law in laws] == [1, 0, 1]
    said = {one["name"]: one["evaluations"] for one in engine.explain().data["laws"]}
    assert said == {"a": 1, "b": 0, "c": 1}


class Pull(Count):
    """Weight as an engine without containers has it: looked at, and stored anew, at each update."""

    def enforce_this_law(self, event: Any) -> None:
        """Pull all down."""
        for obj in self.objects:
            obj.remove_force("weight") if obj.forces else None
            obj.add_force((0.0, -9.81 * obj.mass, 0.0), id="weight")


@pytest.mark.thesis("only-when-needed")
def test_1_4_laws_run_only_when_needed() -> None:
    """Beside an engine where every law runs at each of 1000 updates; the two move alike."""

    def fallen(weight: Any, condition: Any) -> tuple[Any, list[int]]:
        engine = xp.PhysicsEngine()
        holder = xp.LawContainer(condition)
        laws = [engine.add_law(weight) if isinstance(weight, str) else engine.add_law(weight, container=holder)]
        laws += [engine.add_law(Count(name=name), container=holder) for name in "ab"]
        ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1)), laws=laws)
        engine.run(until=10.0, dt=0.01)
        return ball.position, [law.evaluations for law in laws]

    place, needed = fallen("basic:planet_gravity", xp.when.Posted("never"))
    other, always = fallen(Pull(), xp.when.Steps())
    assert needed == [1, 0, 0] and always == [1000, 1000, 1000]
    assert place == pytest.approx(other, rel=1e-12)


@pytest.mark.thesis("pushed-car", "pushed-car/decide")
def test_fig_3_13_a_car_pushed_against_a_wall_neither_passes_nor_gains_energy() -> None:
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic", restitution=0.5)
    engine.add_object(xp.PhysicalObject(xp.Plane((-1, 0, 0), offset=-5), fixed=True), laws=[bounce])
    car = engine.add_object(xp.PhysicalObject(xp.Sphere(1.0), mass=10.0), laws=[bounce])
    car.add_force((20, 0, 0))
    record = engine.run(until=30.0, every=0.05)
    assert record[car].position[:, 0].max() <= 4.0 + 1e-12
    assert car.position == pytest.approx((4, 0, 0), abs=1e-12) and car.velocity == (0, 0, 0)
    assert engine.energy().kinetic == 0.0
