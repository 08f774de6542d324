"""Containers: one condition for many laws; they refuse what does not fit, and are told of changes."""

from __future__ import annotations

from typing import Any

import pytest

import xpheve as xp
from xpheve.errors import NotAcceptedError

when = xp.when


class Count(xp.PhysicalLaw):
    """Do nothing but be counted."""

    condition = when.Elapsed(0.5, every=True)

    def enforce_this_law(self, event: Any) -> None:
        """Do nothing."""


class Told(xp.LawContainer):
    """Write down what it is told."""

    condition = when.Started()

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self.told: list[tuple[str, str, str]] = []

    def law_changed(self, law: Any, what: str, obj: Any = None) -> None:
        self.told.append((law.name, what, "" if obj is None else obj.name))


def test_the_container_is_told_of_every_change_of_its_laws() -> None:
    engine = xp.PhysicsEngine()
    holder = Told()
    law = engine.add_law(Count(name="law"), container=holder)
    other = engine.add_law(Count(name="other"))
    one = engine.add_object(xp.PhysicalObject(name="one"), laws=[law, other])
    two = engine.add_object(xp.PhysicalObject(name="two"))
    assert holder.told == [("law", "objects", "one")]
    engine.map(two, law)
    engine.map(two, law)
    engine.unmap(one, law)
    law.enabled = False
    law.enabled = False
    law.enabled = True
    engine.remove_object(two)
    assert holder.told[1:] == [
        ("law", "objects", "two"), ("law", "objects", "one"), ("law", "enabled", ""), ("law", "enabled", ""), ("law", "objects", "two"),
    ]  # fmt: skip


def test_laws_go_to_the_container_they_ask_for_and_share_it() -> None:
    engine = xp.PhysicsEngine()
    laws = [engine.add_law(Count(name=str(k))) for k in range(3)]
    assert len(engine.containers) == 1 and engine.containers[0].laws == laws
    engine.run(until=2.0)
    assert engine.containers[0].firings == 4 and [law.evaluations for law in laws] == [4, 4, 4]


def test_a_container_may_be_given_as_class_id_or_made() -> None:
    engine = xp.PhysicsEngine()
    engine.add_law(Count(), container=Told)
    engine.add_law("collision:elastic", container="collision:exact")
    engine.add_law(Count(), container=Told(when.Elapsed(1.0)))
    assert [str(c.condition) for c in engine.containers] == ["Started()", "Impact()", "Elapsed(seconds=1.0)"]


def test_roles_and_kinds() -> None:
    kind = type("Fields", (xp.LawContainer,), {"accepts": xp.FieldLaw, "condition": when.Started()})
    role = type("Gravity", (xp.LawContainer,), {"accepts_role": "gravity", "condition": when.Started()})
    engine = xp.PhysicsEngine()
    engine.add_law("basic:planet_gravity", container=kind)
    engine.add_law("basic:planet_gravity", container=role)
    for holder in (kind(), role()):
        with pytest.raises(NotAcceptedError):
            holder.add_law(Count())
        with pytest.raises(NotAcceptedError):
            holder.add_law("basic:planet_gravity")  # type: ignore[arg-type]
        assert holder.laws == []
    with pytest.raises(NotAcceptedError, match="gravity"):
        role().add_law(engine.registry.law("basic:linear_drag")())


def test_a_law_is_in_a_container_once() -> None:
    holder, law = Told(), Count()
    holder.add_law(law)
    holder.add_law(law)
    assert holder.laws == [law] and law.containers == [holder]
    holder.remove_law(law)
    holder.remove_law(law)
    assert holder.laws == [] and law.containers == []


def test_laws_that_are_in_it_come_with_it() -> None:
    engine = xp.PhysicsEngine()
    holder, law = Told(), Count()
    holder.add_law(law)
    engine.add_container(holder)
    assert law.engine is engine and engine.laws == (law,)
    assert engine.add_container(holder) is holder and len(engine.containers) == 1
    engine.run(until=1.0)
    assert law.evaluations == 1


def test_the_condition_given_stands_for_that_of_the_class() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law(Count(), container=Told(when.Elapsed(0.25)))
    engine.run(until=2.0)
    assert law.evaluations == 1


def test_an_empty_unnamed_container_goes_with_its_last_law() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law(Count())
    kept = engine.add_law(Count(), container=xp.LawContainer(when.Started(), name="kept"))
    engine.remove_law(law)
    engine.remove_law(kept)
    assert [c.name for c in engine.containers] == ["kept"]
    engine.run(until=1.0)
