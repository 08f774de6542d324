"""Faults that writing the documentation brought up, each wrong in silence or without end before it was mended."""

from typing import Any

import pytest

import xpheve as xp
from xpheve.errors import ContactError


def pressed(resting: str = "error", restitution: float = 0.5) -> tuple[xp.PhysicsEngine, Any, Any]:
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity")
    return engine, gravity, engine.add_law("collision:elastic", restitution=restitution, resting=resting)


@pytest.mark.parametrize("x", [0.2, 0.3, 0.31])
def test_a_ball_in_a_v_of_two_planes_is_refused_by_name_and_passes_through_neither(x: float) -> None:
    engine, gravity, bounce = pressed()
    for normal in ((1, 0, 1), (-1, 0, 1)):
        engine.add_object(xp.PhysicalObject(xp.Plane(normal), fixed=True), laws=[bounce])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(x, 0, 1), name="ball"), laws=[gravity, bounce])
    with pytest.raises(ContactError, match=r"ball.*second support"):
        engine.run(until=3.0)
    across, _, up = ball.position
    assert min(up + across, up - across) / 2**0.5 - 0.1 > -1e-12  # rounding of the way there


def test_a_held_ball_carries_the_one_on_it() -> None:
    engine, gravity, bounce = pressed("hold")
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce])
    lower = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(0, 0, 0.1)), laws=[gravity, bounce])
    upper = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(0, 0, 0.5)), laws=[gravity, bounce])
    engine.run(until=2.0)
    assert upper.position[2] - lower.position[2] == pytest.approx(0.2, abs=1e-9)  # held when bounces are this low


def test_a_ball_at_rest_inside_the_floor_is_refused_by_name() -> None:
    engine, gravity, bounce = pressed()
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True, name="floor"), laws=[bounce])
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(0, 0, 0.05), name="ball"), laws=[gravity, bounce])
    with pytest.raises(ContactError, match=r"overlap by 0\.05"):
        engine.run(until=1.0)


def test_the_last_frame_of_a_record_is_kept_once() -> None:
    engine = xp.PhysicsEngine()
    engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))
    times = engine.run(until=4.0, every=1 / 60).time
    assert times[-1] == 4.0 and len(times) == 241


def test_the_work_of_a_torque_along_the_way_is_booked() -> None:
    class Brake(xp.FieldLaw):
        """Friction of rotation."""

        id = "test:brake"
        strength = xp.Constant(0.5, unit="N*m*s")

        def torque(self, body: Any) -> Any:
            return -self.strength * body.angular_velocity

    engine = xp.PhysicsEngine()
    engine.add_object(
        xp.PhysicalObject(inertia=(1, 2, 3), angular_velocity=(0.1, 2, 0.3)), laws=[engine.add_law(Brake)]
    )
    before = engine.energy()
    engine.run(until=1.0, dt=0.01)
    after = engine.energy()
    assert after.work < -0.1
    assert after.balance == pytest.approx(before.balance, rel=1e-12)


def test_explain_counts_the_impacts_that_a_container_answered() -> None:
    engine, gravity, bounce = pressed(restitution=1.0)
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce])
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(0, 0, 1.1)), laws=[gravity, bounce])
    engine.run(until=2.0)
    data = engine.explain().data
    assert data["conditions"][0]["firings"] == data["contacts"]["impacts"] == 2
