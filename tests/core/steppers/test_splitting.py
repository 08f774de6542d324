"""Exact flows, split off the rest: second order, exact where nothing else acts, and stiff for nothing."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import NoStepperError
from xpheve.steppers.contract import Offer, Refusal, Signature
from xpheve.steppers.splitting import Splitting


class Gyration(xp.FlowLaw):
    """A uniform magnetic field: the velocity turns about it at the rate -q B / m."""

    id = "test:gyration"
    columns: ClassVar[dict[str, xp.Column]] = {"charge": xp.Column(1.0, unit="C")}
    field = xp.Param((0.0, 0.0, 1.0), unit="T")

    def flow(self, body: Any, dt: float) -> Any:
        size = np.linalg.norm(self.field)
        axis = self.field / size
        angle = -body.charge / body.mass * size * dt
        along = body.velocity.dot(axis) * axis
        across = body.velocity - along
        return {"velocity": along + np.cos(angle) * across + np.sin(angle) * np.cross(axis, across)}

    def potential(self, body: Any) -> Any:
        return 0.0 * body.mass


class Drag(xp.FlowLaw):
    """Linear drag: v decays at the rate k / m."""

    id = "test:drag"
    rate = xp.Param(0.5, unit="kg/s", ge=0)

    def flow(self, body: Any, dt: float) -> Any:
        return {"velocity": body.velocity * np.exp(-self.rate / body.mass * dt)}


class Brake(xp.FlowLaw):
    """The spin decays."""

    id = "test:brake"
    rate = xp.Param(0.4, unit="1/s")

    def flow(self, body: Any, dt: float) -> Any:
        return {"angular_velocity": body.angular_velocity * math.exp(-self.rate * dt)}


class Well(xp.FieldLaw):
    """A spring to the origin."""

    id = "test:well"
    stiffness = xp.Param(1.0, unit="N/m")

    def force(self, body: Any) -> Any:
        return -self.stiffness * body.position

    def potential(self, body: Any) -> Any:
        return 0.5 * self.stiffness * body.position.dot(body.position)


class Bowl(xp.FieldLaw):
    """A spring that stiffens, and no potential is known."""

    id = "test:bowl"
    stiffness = xp.Param(1.0, unit="N/m")
    size = xp.Param(1.0, unit="m")

    def force(self, body: Any) -> Any:
        return -self.stiffness * (1.0 + body.position.dot(body.position) / self.size**2) * body.position


class Tilt(xp.FieldLaw):
    """A torque that lines the body up."""

    id = "test:tilt"
    moment = xp.Param(1.0, unit="N m")

    def torque(self, body: Any) -> Any:
        return self.moment * body.to_world(xp.vector(0.0, 0.0, 1.0)).cross(xp.vector(0.0, 0.0, 1.0))


def scene(*laws: Any, **options: Any) -> tuple[Any, Any]:
    engine = xp.PhysicsEngine()
    body = xp.PhysicalObject(mass=1.0, position=(1.0, 0.0, 0.0), velocity=(0.0, 1.0, 0.3), **options)
    return engine, engine.add_object(body, laws=[engine.add_law(law) for law in laws])


def exact(t: float) -> np.ndarray:
    """Position and velocity under gyration, drag and the well, which are linear together."""
    a = np.zeros((6, 6))
    a[:3, 3:], a[3:, :3] = np.eye(3), -np.eye(3)
    a[3:, 3:] = -0.5 * np.eye(3) + np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    values, vectors = np.linalg.eig(a)
    start = np.array([1.0, 0.0, 0.0, 0.0, 1.0, 0.3])
    found: np.ndarray = (vectors @ (np.exp(values * t) * np.linalg.solve(vectors, start))).real
    return found


@pytest.mark.parametrize("until", [2.0, 1.987])
def test_several_flows_and_a_force_are_of_second_order(until: float) -> None:
    gaps = []
    for steps in (20, 40, 80):
        engine, body = scene(Gyration, Drag, Well)
        engine.run(until=until, dt=2.0 / steps)
        gaps.append(np.abs(np.array([*body.position, *body.velocity]) - exact(until)).max())
        assert abs(engine.energy().balance - 1.045) < 0.3 / steps**2 * 4
    assert gaps[0] < 2e-3
    assert np.log2(np.array(gaps[:-1]) / gaps[1:]) == pytest.approx([2.0, 2.0], abs=0.1)


def test_one_flow_alone_keeps_its_velocities_exactly_at_any_step() -> None:
    engine, body = scene(Gyration)
    engine.laws[0].field = (0.0, 0.0, 5.0)
    engine.run(until=100.0, dt=0.5)
    assert np.abs(np.subtract(body.velocity, (math.sin(500.0), math.cos(500.0), 0.3))).max() < 2e-13
    assert abs(engine.energy().total - 0.545) < 1e-13


def test_a_flow_as_stiff_as_can_be_is_stable() -> None:
    """What the force moves in the midst of a step is an error of the first order then, so the body creeps."""
    engine, body = scene(Drag, Well)
    engine.laws[0].rate = 1e9
    engine.run(until=1.0, dt=0.01)
    assert abs(body.velocity[0]) < 1e-6
    assert body.position[0] == pytest.approx(1.0, abs=0.51 * 0.01)


def test_spins_flow_beside_torques_to_second_order() -> None:
    def spun(steps: int) -> np.ndarray:
        engine, body = scene(Brake, Tilt, inertia=(1.0, 2.0, 2.5), angular_velocity=(0.5, 1.0, 2.0))
        engine.run(until=1.0, dt=1.0 / steps)
        return np.array([*body.orientation, *body.angular_velocity])

    best = spun(256)
    gaps = [np.abs(spun(steps) - best).max() for steps in (32, 64)]
    assert gaps[0] < 1e-3 and math.log2(gaps[0] / gaps[1]) == pytest.approx(2.0, abs=0.15)


def test_work_of_flows_and_forces_without_potential_is_booked() -> None:
    engine, body = scene(Drag, Bowl)
    body.add_force((0.0, 0.0, 0.2))
    before = engine.energy().balance
    for t in (0.313, 0.9, 1.0, 2.0):
        engine.run(until=t, dt=0.005)
        assert abs(engine.energy().balance - before) < 2.5e-5
    assert engine.energy().work < -0.1


def test_an_event_inside_a_step_divides_it() -> None:
    def kicked(dt: float) -> np.ndarray:
        engine, body = scene(Gyration, Drag, Well)
        kick = type(
            "Kick",
            (xp.PhysicalLaw,),
            {
                "id": "test:kick",
                "__doc__": "Sets the velocity.",
                "condition": xp.when.Elapsed(0.777),
                "enforce_this_law": lambda self, event: setattr(body, "velocity", (0.3, 1.1, 0.1)),
            },
        )
        engine.map(body, engine.add_law(kick))
        engine.run(until=2.0, dt=dt)
        return np.array(body.position)

    fine = kicked(0.005)
    assert np.abs(kicked(0.1) - fine).max() < 4e-3
    assert np.abs(kicked(0.02) - fine).max() < 1.5e-4


def test_looking_in_between_changes_no_bit_and_a_copy_goes_on() -> None:
    engine, body = scene(Gyration, Drag, Bowl)
    other, seen = scene(Gyration, Drag, Bowl)
    engine.run(until=2.0, dt=0.1)
    for t in (0.05, 0.1, 0.31, 1.7):
        other.run(until=t, dt=0.1)
    copy = other.copy()
    for one in (other, copy):
        one.run(until=2.0, dt=0.1)
    assert body.position == seen.position == copy.objects[0].position
    assert body.velocity == seen.velocity == copy.objects[0].velocity


def test_a_flow_that_is_switched_off_flows_no_more() -> None:
    engine, body = scene(Drag)
    engine.run(until=1.0, dt=0.1)
    engine.laws[0].enabled = False
    speed = body.velocity
    engine.run(until=2.0, dt=0.1)
    assert body.velocity == speed
    engine.laws[0].enabled = True
    engine.run(until=3.0, dt=0.1)
    assert body.velocity[1] == pytest.approx(math.exp(-1.0), rel=1e-13)


def test_explain_names_flows_and_who_serves_them() -> None:
    engine, _ = scene(Drag, Well)
    engine.run(until=1.0, dt=0.1)
    data = engine.explain().data
    assert data["groups"][0]["stepper"] == "core:splitting"
    assert "exact flow" in data["groups"][0]["refused"]["core:midpoint"]
    law = data["laws"][0]
    assert law["evaluations"] == 20 and law["kind"].startswith("split off") and law["reads"] == ["mass", "velocity"]


def test_without_steps_flows_are_refused_with_the_way_out() -> None:
    engine, _ = scene(Drag, Well)
    with pytest.raises(NoStepperError, match=r"core:splitting: exact flows are split off at host steps: run\(dt=...\)"):
        engine.run(until=1.0)


def test_offers() -> None:
    flows = Signature(("a:b",), "none", traced=False, flows=("a:b",))
    assert Splitting().offer(flows) == Offer(2.0, 200.0, False)
    for signature, why in (
        (Signature(("a:b",), "none"), "no law is an exact flow"),
        (Signature(("a:b",), "none", flows=("a:b",), fixed_step=False), "run(dt=...)"),
        (Signature(("a:b",), "none", flows=("a:b",), contacts=True), "contacts"),
    ):
        answer = Splitting().offer(signature)
        assert isinstance(answer, Refusal) and why in answer.reason
