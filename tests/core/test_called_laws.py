"""Laws with `apply`, which are called in NumPy, beside the same law as a formula, which is traced."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import LawDefinitionError, LawFailedError


class Formula(xp.FieldLaw):
    """A spring and a steady wind."""

    id = "test:formula"
    k = xp.Param(2.0, unit="N/m")
    wind = xp.Param((0.1, -0.3, 0.2), unit="N")

    def force(self, body: Any) -> Any:
        return self.wind - self.k * body.position

    def potential(self, body: Any) -> Any:
        return 0.5 * self.k * body.position.dot(body.position) - self.wind.dot(body.position)  # type: ignore[attr-defined]


class Called(xp.FieldLaw):
    """The same in NumPy."""

    id = "test:called"
    k, wind = Formula.k, Formula.wind

    def apply(self, body: Any) -> Any:
        return Formula.force(self, body)  # type: ignore[arg-type]

    def potential(self, body: Any) -> Any:
        return Formula.potential(self, body)  # type: ignore[arg-type]


class PairFormula(xp.PairLaw):
    """A spring without length."""

    id = "test:pair_formula"
    k = xp.Param(2.0, unit="N/m")

    def force(self, a: Any, b: Any) -> Any:
        return -self.k * (a.position - b.position)


class PairCalled(xp.PairLaw):
    """The same in NumPy."""

    id = "test:pair_called"
    k = PairFormula.k

    def apply(self, a: Any, b: Any) -> Any:
        return -self.k * (a.position - b.position)


def scene(*kinds: type[xp.PhysicalLaw], count: int = 3) -> xp.PhysicsEngine:
    """An engine with ``count`` objects under laws of ``kinds``, and drag, in steps of the midpoint rule: what is traced would have better."""
    engine = xp.PhysicsEngine(stepper="core:midpoint")
    laws = [engine.add_law(kind) for kind in kinds] + [engine.add_law("basic:linear_drag", coefficient=0.1)]
    engine.add_objects(
        [xp.PhysicalObject(position=(1.0 + k, 0.3 * k, -k), mass=1.0 + k, velocity=(0, 1, k)) for k in range(count)],
        laws=laws,
    )
    return engine


def state(engine: xp.PhysicsEngine) -> list[Any]:
    return [(obj.position, obj.velocity) for obj in engine.objects]


@pytest.mark.parametrize("count", [1, 3, 70])
@pytest.mark.parametrize(("formula", "called"), [(Formula, Called), (PairFormula, PairCalled)])
def test_by_tolerances_a_formula_and_a_call_have_the_same_bits(formula: Any, called: Any, count: int) -> None:
    traced, plain = scene(formula, count=count), scene(called, count=count)
    for engine in (traced, plain):
        engine.run(until=0.4, rtol=1e-5)
    assert state(traced) == state(plain)
    assert traced.energy() == plain.energy()
    assert traced.laws[0].evaluations == plain.laws[0].evaluations
    assert traced.laws[0].evaluations > 0 or (count == 1 and formula is PairFormula)


@pytest.mark.parametrize(("formula", "called"), [(Formula, Called), (PairFormula, PairCalled)])
def test_by_steps_they_agree_to_rounding_and_explain_says_which_steps_alone(formula: Any, called: Any) -> None:
    traced, plain = scene(formula), scene(called)
    for engine in (traced, plain):
        engine.run(until=1.0, dt=0.01)
    np.testing.assert_allclose(state(plain), state(traced), rtol=0, atol=1e-14)
    told = plain.explain().data["laws"][0]
    assert told["reads"] == ["position"] and "not traced: it has apply" in told["kind"]
    assert "law by law" in str(plain.explain()) and "law by law" not in str(traced.explain())


def test_what_reads_no_velocity_is_evaluated_once_a_step_and_the_drag_twice() -> None:
    engine = scene(Called)
    engine.run(until=1.0, dt=0.1)
    spring, drag = engine.laws
    assert (spring.evaluations, drag.evaluations) == (10, 20)


@pytest.mark.parametrize("method", ["force", "torque"])
def test_there_is_no_other_method_beside_apply(method: str) -> None:
    with pytest.raises(LawDefinitionError, match=f"both {method} and apply"):
        type("Both", (Called,), {method: lambda self, body: (0.0, 0.0, 0.0)})


def test_a_called_law_that_reads_neither_state_nor_time_is_stored() -> None:
    class Still(xp.FieldLaw):
        def apply(self, body: Any) -> Any:
            return np.asarray(body.mass) * (0.0, 0.0, 2.0)

    engine = xp.PhysicsEngine()
    law = engine.add_law(Still())
    body = engine.add_object(xp.PhysicalObject(mass=2.0), laws=[law])
    engine.run(until=1.0)
    assert [one.vector for one in body.forces] == [(0.0, 0.0, 4.0)] and body.position == (0, 0, 1.0)
    assert law.evaluations == 1


@pytest.mark.parametrize("count", [2, 3, 4])
def test_a_vector_for_all_is_one_however_many_objects_there_are(count: int) -> None:
    """With three objects a vector (3,) has the shape of one number an object."""

    class Gust(xp.FieldLaw):
        wind = xp.Param((1.0, 2.0, 3.0), unit="N/s")

        def force(self, body: Any) -> Any:
            return self.wind * body.time

    engine = xp.PhysicsEngine()
    law = engine.add_law(Gust())
    engine.add_objects([xp.PhysicalObject() for _ in range(count)], laws=[law])
    engine.run(until=1.0, dt=0.5)
    assert [obj.velocity for obj in engine.objects] == [pytest.approx((0.5, 1.0, 1.5), rel=1e-15)] * count


def test_an_error_of_a_called_pair_law_names_what_is_needed() -> None:
    kind = type("Odd", (PairCalled,), {"apply": lambda self, a, b: a.mass})
    with pytest.raises(
        LawFailedError, match=r"apply returned an array of shape \(1, 1\); .* \(1, 3\) or \(3,\) are needed"
    ):
        scene(kind, count=2).run(until=1.0, dt=0.1)
