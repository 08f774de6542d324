"""Flow laws: what they may return, what is checked before they act, and how their faults are told."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import LawDefinitionError, LawFailedError, NotAcceptedError, XpheveWarning


def law(name: str, flow: Any, **more: Any) -> Any:
    """A flow law of the test."""
    return type(name, (xp.FlowLaw,), {"id": f"test:{name.lower()}", "__doc__": "A flow.", "flow": flow} | more)


def run(kind: Any, count: int = 2, **options: Any) -> Any:
    engine = xp.PhysicsEngine(**options)
    made = engine.add_law(kind)
    engine.add_objects(
        [xp.PhysicalObject(name=f"body{k}", mass=1.0 + k, velocity=(1.0, 2.0, 3.0 + k)) for k in range(count)],
        laws=[made],
    )
    engine.run(until=1.0, dt=0.1)
    return engine


@pytest.mark.parametrize(
    ("result", "said"),
    [
        (lambda body, dt: body.velocity, "returned an array of shape (2, 3); what it changes is needed by name"),
        (lambda body, dt: {"position": body.position}, "'position', which a flow leaves alone: it follows from velocity"),
        (lambda body, dt: {"velocty": body.velocity}, 'which is none of velocity, angular_velocity. Did you mean "velocity"?'),
        (lambda body, dt: {"velocity": body.mass}, "returned an array of shape (2, 1) for velocity; real numbers of shape (2, 3)"),
        (lambda body, dt: {"velocity": 1j * body.velocity}, "for velocity; real numbers"),
        (lambda body, dt: {"velocity": body.velocity * math.nan}, "gave (nan, nan, nan) for <PhysicalObject 'body0'>"),
        (lambda body, dt: {"velocity": body.speed}, "test:odd reads body.speed, which is no property and no column"),
        (lambda body, dt: {"velocity": 1 / 0}, "test:odd.flow raised ZeroDivisionError"),
    ],
)  # fmt: skip
def test_what_a_flow_may_not_return_is_told_before_anything_moves(result: Any, said: str) -> None:
    engine = xp.PhysicsEngine()
    made = engine.add_law(law("Odd", lambda self, body, dt: result(body, dt)))
    bodies = engine.add_objects([xp.PhysicalObject(name=f"body{k}", velocity=(1, 0, 0)) for k in range(2)], laws=[made])
    with pytest.raises(LawFailedError) as failure:
        engine.run(until=1.0, dt=0.1)
    assert said in str(failure.value)
    assert engine.time == 0.0 and bodies[0].position == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("flow", "said"),
    [
        (lambda self, body, dt: {"velocity": body.velocity * (1.0 - dt)}, "flowing for 0.0375 s and then for 0.0625 s gives"),
        (lambda self, body, dt: {"velocity": 0.5 * body.velocity}, "flowing for"),
        (lambda self, body, dt: {"velocity": np.random.default_rng().normal(size=(2, 3))}, "flowing for"),
    ],
    ids=["a step of Euler's", "no time needed", "chance"],
)  # fmt: skip
def test_what_is_no_exact_solution_is_refused(flow: Any, said: str) -> None:
    with pytest.raises(LawFailedError, match=r"is no exact solution: of velocity of .*body0") as failure:
        run(law("Odd", flow))
    assert said in str(failure.value) and "write it as the force of a FieldLaw" in str(failure.value)


def test_a_flow_may_depend_on_time() -> None:
    def flow(self: Any, body: Any, dt: float) -> Any:
        gained = math.sin(body.time + dt) - math.sin(body.time)
        return {"velocity": body.velocity + gained * np.array([1.0, 0.0, 0.0])}

    engine = run(law("Swing", flow))
    assert engine.objects[0].velocity[0] == pytest.approx(1.0 + math.sin(1.0), abs=1e-13)


def test_columns_parameters_and_masses_are_read_as_in_other_laws() -> None:
    def flow(self: Any, body: Any, dt: float) -> Any:
        return {"velocity": body.velocity * np.exp(-body.area * self.rate * dt / body.mass)}

    kind = law("Drag", flow, columns={"area": xp.Column(2.0, unit="m^2")}, rate=xp.Param(0.5, unit="kg/(m^2 s)"))
    engine = run(kind)
    for k, body in enumerate(engine.objects):
        assert body.velocity[1] == pytest.approx(2.0 * math.exp(-1.0 / (1.0 + k)), rel=1e-13)


def test_flows_act_in_order_of_rank_whatever_the_order_of_adding() -> None:
    def ends(order: tuple[int, int]) -> tuple[float, ...]:
        turn = law("Turn", lambda self, body, dt: {"velocity": rotated(body.velocity, dt)}, priority=1)
        stop = law("Stop", lambda self, body, dt: {"velocity": body.velocity * np.exp(-dt * np.array([1.0, 0.0, 0.0]))})
        engine = xp.PhysicsEngine()
        laws = [engine.add_law((turn, stop)[k], name=("turn", "stop")[k]) for k in order]
        body = engine.add_object(xp.PhysicalObject(velocity=(1.0, 2.0, 3.0)), laws=laws)
        engine.run(until=1.0, dt=0.1)
        return tuple(body.velocity)

    assert ends((0, 1)) == ends((1, 0))


def rotated(v: Any, angle: float) -> Any:
    """``v`` turned about z."""
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(v) @ turn.T


def test_a_flow_that_fails_can_be_disabled() -> None:
    bad = law("Odd", lambda self, body, dt: {"velocity": body.velocity * (1.0 - dt)})
    with pytest.warns(XpheveWarning, match="no exact solution"):
        engine = run(bad, on_law_error="disable")
    assert engine.time == 1.0 and not engine.laws[0].enabled


def test_a_class_says_one_thing() -> None:
    with pytest.raises(LawDefinitionError, match="is a FlowLaw and has force, which would act twice"):
        law("Both", lambda self, body, dt: {}, force=lambda self, body: body.velocity)
    with pytest.raises(LawDefinitionError, match=r"kernel = 'some\.file': a FlowLaw has none"):
        law("Kernel", lambda self, body, dt: {}, kernel="some.file")
    with pytest.raises(LawDefinitionError, match="says nothing yet"):
        xp.PhysicsEngine().add_law(type("Nothing", (xp.FlowLaw,), {"id": "test:nothing"}))


def test_a_flow_goes_into_no_container() -> None:
    engine = xp.PhysicsEngine()
    drag = law("Drag", lambda self, body, dt: {"velocity": body.velocity * np.exp(-dt)})
    with pytest.raises(NotAcceptedError, match="acts all the time, and goes into no container"):
        engine.add_law(drag, container=xp.LawContainer(xp.when.Elapsed(1.0)))
    assert not engine.laws


def test_packs_may_offer_flows() -> None:
    from xpheve.plugins.spec import check_spec, spec_of

    drag = law("Drag", lambda self, body, dt: {"velocity": body.velocity * np.exp(-dt)}, rate=xp.Param(1.0, unit="1/s"))
    spec = spec_of(drag)
    check_spec(spec, drag, pack="test")
    assert (spec.kind, spec.form, spec.has_potential) == ("flow", "", False)
    named = law("Named", lambda self, body, dt: {}, flow_rate=xp.Param(1.0, unit="1/s"))
    assert spec_of(named).params[0].name == "flow_rate"
