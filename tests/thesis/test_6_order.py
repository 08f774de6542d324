"""Thesis chapter 6: laws in a given order, and what is said when two of them want the same."""

from __future__ import annotations

import re
import warnings
from typing import Any

import pytest

import xpheve as xp
from xpheve.errors import ConflictError, LawFailedError, OrderError, OrderWarning

when = xp.when


def setter(name: str, value: float, what: str = "velocity", **order: Any) -> type[xp.PhysicalLaw]:
    """A law class that sets ``what`` of its objects to (value, 0, 0)."""

    def enforce_this_law(self: xp.PhysicalLaw, event: xp.Event) -> None:
        for obj in self.objects:
            if what == "charge":
                obj["charge"] = value
            else:
                setattr(obj, what, (value, 0, 0))

    body = {"enforce_this_law": enforce_this_law, "__doc__": "Sets something.", **order}
    return type(name, (xp.PhysicalLaw,), body)


def scene(*kinds: type[xp.PhysicalLaw], apart: bool = False) -> tuple[xp.PhysicsEngine, xp.PhysicalObject]:
    """One object under laws of ``kinds``, which all wake at 1 s; each in a container of its own if ``apart``."""
    engine = xp.PhysicsEngine()
    shared = xp.LawContainer(when.Elapsed(1.0), name="clock")
    laws = [
        engine.add_law(kind(), container=xp.LawContainer(when.Elapsed(1.0), name=f"clock{k}") if apart else shared)
        for k, kind in enumerate(kinds)
    ]
    return engine, engine.add_object(xp.PhysicalObject(charge=0.0), laws=laws)


@pytest.mark.thesis("order-of-laws")
def test_6_before_and_after_put_laws_in_order_and_explain_says_so() -> None:
    engine, obj = scene(
        setter("Alpha", 1.0, after=("Beta",)), setter("Beta", 2.0), setter("Gamma", 3.0, before=("Beta",))
    )
    (told,) = engine.explain().data["order"]
    assert told["laws"] == ["Gamma", "Beta", "Alpha"] and told["because"] == ["before/after", "before/after"]
    assert "then Alpha (before/after)" in str(engine.explain())
    engine.run(until=1.0)
    assert obj.velocity == (1, 0, 0), "no warning: there is an order"


@pytest.mark.thesis("order-of-laws")
def test_6_priority_then_id_then_rank_order_the_others() -> None:
    engine, obj = scene(
        setter("Alpha", 1.0), setter("Beta", 2.0, "position", priority=5), setter("Gamma", 3.0, "angular_velocity")
    )
    (told,) = engine.explain().data["order"]
    assert told["laws"] == ["Beta", "Alpha", "Gamma"]
    assert told["because"][0] == "priority 5 above 0" and "id: Alpha sorts before Gamma" in told["because"][1]
    engine.run(until=1.0)
    assert obj.velocity == (1, 0, 0)


@pytest.mark.thesis("order-of-laws")
def test_6_an_order_that_goes_round_is_an_error_that_names_the_ring() -> None:
    engine, _ = scene(
        setter("Alpha", 1.0, after=("Beta",)),
        setter("Beta", 2.0, after=("Gamma",)),
        setter("Gamma", 3.0, after=("Alpha",)),
    )
    with pytest.raises(OrderError, match=r"ring: (\w+ -> ){3}\w+; drop one") as caught:
        engine.run(until=1.0)
    assert set(re.findall("Alpha|Beta|Gamma", str(caught.value))) == {"Alpha", "Beta", "Gamma"}
    assert "ring" in str(engine.explain())


@pytest.mark.thesis("order-of-laws")
@pytest.mark.parametrize("what", ["velocity", "position", "angular_velocity", "charge"])
def test_6_two_laws_that_set_the_same_with_no_order_between_them_are_reported_once(what: str) -> None:
    engine, obj = scene(setter("Alpha", 1.0, what), setter("Beta", 2.0, what))
    again = engine.add_object(xp.PhysicalObject(), laws=engine.laws)
    with pytest.warns(OrderWarning) as heard:
        engine.run(until=1.0)
    (one,) = heard
    for word in ("Alpha", "Beta", what, "t = 1.0 s", "before=", "priority", "filterwarnings"):
        assert word in str(one.message)
    assert again.engine is engine and obj.engine is engine
    assert engine.explain().data["conflicts"] == [str(one.message)]


@pytest.mark.thesis("order-of-laws")
def test_6_laws_in_different_containers_have_no_order_and_are_told_to_share_one() -> None:
    engine, _ = scene(setter("Alpha", 1.0, priority=3), setter("Beta", 2.0), apart=True)
    with pytest.warns(OrderWarning, match="put both into one container"):
        engine.run(until=1.0)


@pytest.mark.thesis("order-of-laws")
def test_6_what_is_no_conflict_is_not_reported() -> None:
    for kinds in (
        (setter("Alpha", 1.0), setter("Beta", 1.0)),  # the same value
        (setter("Alpha", 1.0), setter("Beta", 2.0, "position")),  # something else
        (setter("Alpha", 1.0), setter("Beta", 2.0, priority=1)),
    ):
        engine, _ = scene(*kinds)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            engine.run(until=2.0)
        assert engine.explain().data["conflicts"] == []


@pytest.mark.thesis("order-of-laws")
def test_6_a_host_that_makes_the_report_an_error_stands_before_the_event() -> None:
    engine, obj = scene(setter("Alpha", 1.0), setter("Beta", 2.0))
    with warnings.catch_warnings():
        warnings.simplefilter("error", OrderWarning)
        with pytest.raises((OrderWarning, LawFailedError)):
            engine.run(until=2.0)
    assert obj.velocity == (0, 0, 0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OrderWarning)
        engine.run(until=2.0)
    assert obj.velocity == (2, 0, 0)


@pytest.mark.thesis("order-of-laws")
def test_6_two_exclusive_laws_on_one_object_are_an_error_that_names_both_and_the_ways_out() -> None:
    engine = xp.PhysicsEngine()
    soft = engine.add_law("collision:elastic", name="soft", restitution=0.1)
    hard = engine.add_law("collision:elastic", name="hard", restitution=0.9)
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(1.0)), laws=[soft])
    for act in (
        lambda: engine.map(ball, hard),
        lambda: engine.add_object(xp.PhysicalObject(xp.Sphere(1.0)), laws=[soft, hard]),
    ):
        with pytest.raises(ConflictError, match="contact-response") as caught:
            act()
        for word in ("soft", "hard", "only one", "enabled = False", "unmap"):
            assert word in str(caught.value)
    assert ball.laws == (soft,)
    soft.enabled = False
    engine.map(ball, hard)
    with pytest.raises(ConflictError, match="soft"):
        soft.enabled = True
    assert not soft.enabled
