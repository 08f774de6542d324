"""What is asked of a law before it may act: how often, how long, and through which doors."""

from __future__ import annotations

import time
from typing import Any

import pytest

import xpheve as xp
from xpheve.errors import DimensionError, TracedBranchError, TraceError
from xpheve.plan.proof import prove, require_formula
from xpheve.trace import check
from xpheve.trace.recorder import trace_law


def spring() -> type[xp.FieldLaw]:
    """A class of its own, not met before."""

    class Spring(xp.FieldLaw):
        id = "test:spring"
        k = xp.Param(2.0, unit="N/m", ge=0)
        weak = xp.Param(False)

        def force(self, body: Any) -> Any:
            return -(0.5 * self.k if self.weak else self.k) * body.position

    return Spring


def branching() -> type[xp.FieldLaw]:
    """The same id, but no formula."""

    class Spring(xp.FieldLaw):
        id = "test:spring"
        k = xp.Param(2.0, unit="N/m", ge=0)
        weak = xp.Param(False)
        heavy = xp.Constant(1.0, unit="kg")

        def force(self, body: Any) -> Any:
            return -self.k * body.position if body.mass > self.heavy else -2.0 * self.k * body.position

    return Spring


@pytest.fixture
def tried(monkeypatch: pytest.MonkeyPatch) -> list[xp.FieldLaw]:
    """The laws that were tried by numbers."""
    found: list[Any] = []
    real = check.quick_check

    def counted(law: Any, trace: Any = None) -> None:
        found.append(law)
        real(law, trace)

    monkeypatch.setattr(check, "quick_check", counted)
    return found


def test_a_formula_is_tried_when_a_law_of_it_first_acts_and_never_again(tried: list[Any]) -> None:
    kind = spring()
    for stiffness in (1.0, 3.0):
        engine = xp.PhysicsEngine()
        law = engine.add_law(kind, k=stiffness)
        assert len(tried) == (stiffness == 3.0)
        engine.add_object(xp.PhysicalObject(position=(1, 0, 0)), laws=[law])
        for until in (0.1, 0.2):
            engine.run(until=until, dt=0.1)
            law.k = law.k + 1.0
    assert len(tried) == 1
    law.weak = True
    engine.run(until=0.3, dt=0.1)
    assert len(tried) == 2, "another formula"
    law.weak = False
    engine.run(until=0.4, dt=0.1)
    assert len(tried) == 2


def test_a_law_that_nobody_obeys_or_that_is_disabled_is_not_tried(tried: list[Any]) -> None:
    engine = xp.PhysicsEngine()
    engine.add_law(spring())
    off = engine.add_law(spring(), enabled=False, name="off")
    engine.add_object(xp.PhysicalObject(), laws=[off])
    engine.run(until=0.1, dt=0.1)
    assert tried == []
    off.enabled = True
    engine.run(until=0.2, dt=0.1)
    assert tried == [off]


def test_to_ask_again_costs_next_to_nothing() -> None:
    law = spring()()
    trace = trace_law(law)
    assert trace is not None
    prove(law, trace)
    begin = time.process_time()
    for _ in range(1000):
        require_formula(law)
        prove(law, trace)
    assert time.process_time() - begin < 0.1


@pytest.mark.parametrize("add", ["add_law", "container", "put", "restore"])
def test_no_door_lets_in_what_is_no_formula(add: str) -> None:
    engine = xp.PhysicsEngine()
    wrong = branching()
    if add == "restore":
        engine.add_law(spring())
        saved = engine.checkpoint()
        with pytest.raises(TracedBranchError, match=r"test:spring\.force"):
            xp.PhysicsEngine.restore(saved, laws=[wrong])
        return
    holder = xp.LawContainer(xp.when.Elapsed(1.0))
    if add == "put":
        engine.add_container(holder)
    doors = {
        "add_law": lambda law: engine.add_law(law),
        "container": lambda law: engine.add_law(law, container=holder),
        "put": holder.add_law,
    }
    law = wrong()
    with pytest.raises(TracedBranchError, match=r"test:spring\.force"):
        doors[add](law)
    assert engine.laws == () and law.engine is None and law.containers == [] and holder.laws == []


def test_a_switch_that_chooses_what_is_no_formula_is_refused_and_keeps_its_value() -> None:
    class Late(xp.FieldLaw):
        id = "test:late"
        odd = xp.Param(False)
        pull = xp.Constant(1.0, unit="1/s^2")

        def force(self, body: Any) -> Any:
            return body.velocity if self.odd else -self.pull * body.mass * body.position

    engine = xp.PhysicsEngine()
    law = engine.add_law(Late)
    body = engine.add_object(xp.PhysicalObject(position=(1, 0, 0)), laws=[law])
    engine.run(until=0.1, dt=0.1)
    before = body.position
    with pytest.raises(DimensionError, match="returns m/s"):
        law.odd = True
    assert law.odd is False and body.position == before
    engine.run(until=0.2, dt=0.1)
    assert engine.time == 0.2
    assert issubclass(DimensionError, TraceError)


def test_a_class_that_is_edited_is_read_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    class Pull(xp.FieldLaw):
        id = "proof:edited"
        stiffness = xp.Param(1.0, unit="N/m")

        def sense(self) -> float:
            return -1.0

        def force(self, body: Any) -> Any:
            return self.sense() * self.stiffness * body.position

    def speed() -> float:
        engine = xp.PhysicsEngine()
        thing = engine.add_object(xp.PhysicalObject(position=(1, 0, 0)), laws=[engine.add_law(Pull)])
        engine.run(until=0.125, dt=0.0625)
        return thing.velocity[0]

    before = speed()
    monkeypatch.setattr(Pull, "sense", lambda self: -2.0)
    assert speed() < 1.9 * before
    monkeypatch.setattr(Pull, "force", lambda self, body: 0.0 * self.stiffness * body.position)
    assert speed() == 0.0
    monkeypatch.undo()
    assert speed() == before
