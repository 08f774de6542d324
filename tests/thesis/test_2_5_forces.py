"""Thesis 2.5: forces with durations and ids, figures 2-7 to 2-9."""

from __future__ import annotations

import math

import pytest

import xpheve as xp
from xpheve.errors import InvalidValueError

DT = 0.02


def test_fig_2_7_the_sum_of_the_forces_moves_the_object() -> None:
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject(mass=2.0))
    for vector, duration in (((2, 0, 0), 1.0), ((0, 4, 0), 0.5), ((-1, 0, 1), math.inf)):
        body.add_force(vector, duration)
    engine.run(until=1.0)
    assert body.velocity == (0.5, 1.0, 0.5) and len(body.forces) == 1


@pytest.mark.parametrize(
    ("duration", "impulses"), [(0.010, (0.2, 0.0)), (0.020, (0.4, 0.0)), (0.030, (0.4, 0.2))], ids=["(1)", "(2)", "(3)"]
)
def test_fig_2_8_impulse_is_force_times_the_lesser_of_duration_and_dt(
    duration: float, impulses: tuple[float, float]
) -> None:
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject())
    body.add_force((20, 0, 0), duration)
    last = 0.0
    for impulse in impulses:
        engine.step(DT)
        assert body.velocity[0] - last == pytest.approx(impulse, abs=1e-15)
        last = body.velocity[0]
    assert body.forces == ()


def test_2_5_a_force_that_ends_inside_a_step_is_exact_in_position_too() -> None:
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject())
    body.add_force((20, 0, 0), 0.25)
    engine.step(1.0)
    assert body.velocity == (5, 0, 0) and body.position == (4.375, 0, 0)


def test_2_5_for_ever_is_inf_and_minus_one_is_refused() -> None:
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject())
    body.add_force((1, 0, 0), math.inf)
    with pytest.raises(InvalidValueError, match=r"math\.inf"):
        body.add_force((1, 0, 0), -1)
    engine.run(until=1e6)
    assert body.velocity == (1e6, 0, 0) and body.forces[0].duration == math.inf


def test_fig_2_9_one_id_names_many_forces_and_removes_them_all() -> None:
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject())
    id = engine.new_force_id()
    for k in range(3):
        body.add_force((1, k, 0), id=id)
    other = body.add_force((0, 0, 1))
    assert other.id != id
    assert body.remove_force(id) == 3 and body.forces == (other,)


def test_2_5_1_the_car_presses_and_releases() -> None:
    engine = xp.PhysicsEngine()
    car = engine.add_object(xp.PhysicalObject(mass=1000.0))
    for _ in range(2):
        car.add_force((5000, 0, 0), id="pedal")
        engine.run(until=engine.time + 1.0)
        car.remove_force("pedal")
        engine.run(until=engine.time + 1.0)
    assert car.velocity == (10, 0, 0)


def test_2_5_1_a_key_that_repeats_does_not_accelerate_twice() -> None:
    """The host takes the last press away before it adds one: one id is one pedal."""
    engine = xp.PhysicsEngine()
    car = engine.add_object(xp.PhysicalObject(mass=1000.0))
    for _ in range(5):
        car.remove_force("pedal")
        car.add_force((5000, 0, 0), id="pedal")
    engine.run(until=1.0)
    assert car.velocity == (5, 0, 0)


def test_3_1_2_half_a_second_left_before_a_pause_is_half_a_second_after() -> None:
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject())
    body.add_force((1, 0, 0), 1.5)
    engine.run(until=1.0)
    engine.suspend()
    assert body.forces[0].duration == 0.5
    engine.resume()
    assert body.forces[0].duration == 0.5
    engine.run(until=9.0)
    assert body.velocity == (1.5, 0, 0)
