"""Laws tried by numbers: every law of the library holds, and the checks find what is there and nothing else."""

from __future__ import annotations

import dataclasses
import math
import time
from typing import Any

import numpy as np
import pytest

import xpheve as xp
import xpheve_laws_basic as basic
from xpheve.errors import TraceError
from xpheve.trace import check
from xpheve.trace.check import check_law, nature_of, quick_check, require_law
from xpheve.trace.graph import Node
from xpheve.trace.recorder import trace_law

LAWS = [getattr(basic, name) for name in basic.__all__]
OTHERS: list[Any] = [
    basic.Buoyancy(surface=1.0),
    basic.Thrust(thrust=(1.0, -2.0, 0.5), delay=1.0, duration=30.0),
    basic.RotatingFrame(angular_velocity=(0.1, 0.2, -0.3), point=(1.0, 2.0, 3.0)),
    basic.UniversalGravity(softening=0.5),
    basic.Spring(rest_length=0.4),
    basic.SpringToPoint(rest_length=0.4, anchor=(1.0, -2.0, 0.5)),
]
"""The other formulas of laws that choose one by their parameters."""


@pytest.mark.parametrize("law", [*(law() for law in LAWS), *OTHERS], ids=lambda law: law.id)
def test_every_law_of_the_library_is_what_its_trace_potential_and_derivatives_say(law: Any) -> None:
    assert [one.message for one in check_law(law, samples=48)] == []


@pytest.mark.parametrize("law", [law() for law in LAWS], ids=lambda law: law.id)
def test_a_law_is_finite_at_most_states_that_are_tried(law: Any) -> None:
    trial = check.Trial(law, check.Functions(trace_law(law)), 24, 1)  # type: ignore[arg-type]
    assert trial.finite.mean() > 0.7


def test_the_quick_check_is_quick() -> None:
    laws = [law() for law in LAWS]
    for law in laws:
        quick_check(law)
    spent = []
    for law in laws:
        best = math.inf
        for _ in range(5):
            began = time.process_time()
            quick_check(law)
            best = min(best, time.process_time() - began)
        spent.append(best)
    assert max(spent) < 0.015, "under 5 ms of processor time on a machine that is not throttled"


def test_a_check_changes_nothing_of_the_law() -> None:
    law = basic.Spring(stiffness=4.0, rest_length=0.1)
    before = (dict(law.parameters), dict(law.state), law.evaluations)
    require_law(law)
    assert (dict(law.parameters), dict(law.state), law.evaluations) == before


def test_a_check_finds_the_same_each_time() -> None:
    class Wrong(xp.FieldLaw):
        """Half of its potential."""

        id = "mine:wrong"
        stiffness = xp.Param(1.0, unit="N/m", doc="k.")

        def force(self, body: Any) -> Any:
            return -self.stiffness * body.position

        def potential(self, body: Any) -> Any:
            return self.stiffness * body.position.dot(body.position)

    assert check_law(Wrong()) == check_law(Wrong()) != []


def test_a_trace_that_is_not_the_method_is_found() -> None:
    law = basic.QuadraticDrag()
    trace = trace_law(law)
    assert trace is not None and trace.force is not None
    x, y, z = trace.force
    wrong = dataclasses.replace(trace, force=(x, z, y))
    with pytest.raises(TraceError, match=r"basic:quadratic_drag.force: called with arrays it gives \("):
        quick_check(law, wrong)
    assert {one.kind for one in check_law(law, trace=wrong)} == {"values"}


def test_derivatives_that_are_wrong_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    from xpheve.trace import derivative

    def half(rules: Any, node: Node) -> Node:
        return rules.graph.op("/", rules.const(0.25), node)

    monkeypatch.setitem(derivative.CHAIN, "sqrt", half)
    found = check_law(basic.QuadraticDrag())
    assert [one.kind for one in found] == ["jacobian"] and "differences give" in found[0].message


def test_texts_that_differ_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    from xpheve.kernels import ieee

    monkeypatch.setattr(ieee, "sqrt", lambda x: math.nextafter(math.sqrt(x), math.inf))
    found = check_law(basic.Wind())
    assert [one.kind for one in found] == ["text"], "a unit in the last place is seen"
    assert "one object at a time it is" in found[0].message


def test_a_law_that_is_not_traced_is_not_refused() -> None:
    class Free(xp.FieldLaw):
        """Not traced."""

        id = "mine:free"

        def apply(self, body: Any) -> Any:
            return 0.0 * np.asarray(body.velocity)

    found = check_law(Free())
    assert [one.error for one in found] == [None] and "mine:free is not traced" in found[0].message
    quick_check(Free())
    assert nature_of(Free()) is None


def test_a_potential_that_changes_in_time_is_remarked() -> None:
    class Tide(xp.FieldLaw):
        """A spring that grows stiffer."""

        id = "mine:tide"
        stiffness = xp.Param(1.0, unit="N/(m s)", doc="k per second.")

        def force(self, body: Any) -> Any:
            return -self.stiffness * body.time * body.position

        def potential(self, body: Any) -> Any:
            return 0.5 * self.stiffness * body.time * body.position.dot(body.position)

    found = check_law(Tide())
    assert [(one.kind, one.error) for one in found] == [("potential", None)] and "reads time" in found[0].message


def test_forces_that_do_no_work_may_stand_beside_a_potential() -> None:
    class Trap(xp.FieldLaw):
        """A spring, and a force across the velocity."""

        id = "mine:trap"
        stiffness = xp.Param(1.0, unit="N/m", doc="k.")
        twist = xp.Param((0.1, 0.2, 3.0), unit="kg/s", doc="B.")

        def force(self, body: Any) -> Any:
            return -self.stiffness * body.position + body.velocity.cross(self.twist)

        def potential(self, body: Any) -> Any:
            return 0.5 * self.stiffness * body.position.dot(body.position)

    assert check_law(Trap()) == []
    found = nature_of(Trap())
    assert found is not None and found.conservative == "yes" and found.linear


def test_a_compass_needle_has_a_potential_of_its_orientation() -> None:
    class Needle(xp.FieldLaw):
        """A magnetic moment in a field."""

        id = "mine:needle"
        moment = xp.Param((2.0, 0.0, 0.5), unit="A*m^2", doc="m, body frame.")
        field = xp.Param((0.0, 0.3, 0.1), unit="T", doc="B.")

        def torque(self, body: Any) -> Any:
            return body.to_world(self.moment).cross(self.field)

        def potential(self, body: Any) -> Any:
            return -body.to_world(self.moment).dot(self.field)

    assert check_law(Needle()) == []
    found = nature_of(Needle())
    assert found is not None and found.conservative == "yes" and found.depends_on("orientation")


def test_a_law_with_tables_holds_too() -> None:
    class Air(xp.FieldLaw):
        """Quadratic drag, thinner with height."""

        id = "mine:air"
        area = xp.Param(0.1, unit="m^2", gt=0, doc="C A.")
        density = xp.Table(
            (0, 5, 11, 20), (1.2250, 0.7364, 0.3639, 0.0880), unit_x="km", unit="kg/m^3", kind="cubic", outside="hold"
        )

        def force(self, body: Any) -> Any:
            rho = self.density(body.position.dot(body.up))
            return -0.5 * rho * self.area * body.velocity.norm() * body.velocity

    assert check_law(Air()) == []
    found = nature_of(Air())
    assert found is not None and "1 root, 1 table" in found.words()


def test_a_table_over_another_quantity_is_refused() -> None:
    class Mixed(xp.FieldLaw):
        """Looks up a height by a speed."""

        id = "mine:mixed"
        strength = xp.Table((0.0, 1.0), (1.0, 2.0), unit_x="m", unit="N", outside="hold")

        def force(self, body: Any) -> Any:
            return self.strength(body.velocity.norm()) * body.up

    with pytest.raises(
        xp.errors.DimensionError, match=r"mine:mixed.force: the table strength is over m, not over m/s. At .*strength\("
    ):
        check_law(Mixed())
