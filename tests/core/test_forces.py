"""Forces with durations act exactly, whatever the steps; ids name many."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xpheve as xp


def pushed(*forces: xp.Force, **given: Any) -> tuple[xp.PhysicsEngine, xp.PhysicalObject]:
    """Return an engine with one point under ``forces``."""
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject(**given))
    for force in forces:
        body.add_force(force)
    return engine, body


def test_a_force_is_a_value() -> None:
    force = xp.Force((1, 2, 3), 4.0, "id", torque=(5, 6, 7))
    assert force == xp.Force((1, 2, 3), 4.0, "id", torque=(5, 6, 7)) != xp.Force((1, 2, 3), 4.0, "id")
    assert hash(force) == hash(xp.Force((1, 2, 3), 4.0, "id", torque=(5, 6, 7)))
    assert eval(repr(force), {"Force": xp.Force, "inf": math.inf}) == force
    assert xp.Force().duration == math.inf and xp.Force((-0.0, 0, 0)).vector[0].hex() == "0x0.0p+0"


@pytest.mark.parametrize("dt", [None, 1.0, 0.3, 0.25, 0.1])
def test_a_force_that_ends_inside_a_step_ends_at_its_instant(dt: float | None) -> None:
    engine, body = pushed(xp.Force((20, 0, 0), 0.25))
    engine.run(until=1.0, dt=dt)
    assert body.velocity == (5, 0, 0) and body.position == (4.375, 0, 0) and body.forces == ()


durations = st.floats(0.0, 3.0)
steps = st.lists(st.floats(1e-3, 0.7), min_size=1, max_size=12)


@settings(deadline=None, max_examples=60, derandomize=True)
@given(durations=st.lists(durations, max_size=4), steps=steps, data=st.data())
def test_the_impulse_is_force_times_the_lesser_of_duration_and_time(
    durations: list[float], steps: list[float], data: st.DataObject
) -> None:
    forces = [xp.Force((1.0 + k, -k, 0.5), duration) for k, duration in enumerate(durations)]
    engine, body = pushed(*forces, mass=2.0)
    time = 0.0
    for step in steps:
        time += step
        engine.run(until=time, dt=data.draw(st.sampled_from([None, 0.1])))
    v, x = [Fraction(0)] * 3, [Fraction(0)] * 3
    for force in forces:
        d, end = Fraction(force.duration), Fraction(time)
        acting = min(d, end)
        for k in range(3):
            a = Fraction(force.vector[k]) / 2
            v[k] += a * acting
            x[k] += a * acting * acting / 2 + a * acting * (end - acting)
    assert body.velocity == pytest.approx([float(c) for c in v], abs=1e-13, rel=1e-13)
    assert body.position == pytest.approx([float(c) for c in x], abs=1e-13, rel=1e-13)
    assert len(body.forces) == sum(duration > time for duration in durations)


def test_remaining_times_run_down_and_survive_a_pause_and_a_checkpoint() -> None:
    engine, body = pushed(xp.Force((1, 0, 0), 2.0, "a"), xp.Force((0, 1, 0), id="b"))
    engine.run(until=0.5)
    engine.suspend()
    assert [force.duration for force in body.forces] == [1.5, math.inf]
    engine.resume()
    twin = xp.PhysicsEngine.restore(engine.checkpoint())
    for one in (engine, twin):
        assert [(force.duration, force.id) for force in one.objects[0].forces] == [(1.5, "a"), (math.inf, "b")]
        one.run(until=3.0)
        assert one.objects[0].velocity == (2, 3, 0)


def test_a_force_without_duration_does_nothing() -> None:
    engine, body = pushed(xp.Force((1, 0, 0), 0.0))
    assert body.forces == ()
    engine.run(until=1.0)
    assert body.velocity == (0, 0, 0)


def test_the_shortest_and_the_longest() -> None:
    engine, body = pushed(xp.Force((1, 0, 0), 5e-324), xp.Force((0, 1e-3, 0), 1e308))
    engine.run(until=1.0)
    assert body.velocity == pytest.approx((0, 1e-3, 0), abs=1e-300)


def test_ids_are_given_per_engine_and_in_order() -> None:
    for _ in range(2):
        _, body = pushed()
        assert [body.add_force((1, 0, 0)).id for _ in range(3)] == [1, 2, 3]


def test_a_given_number_is_not_given_again() -> None:
    """A user's own number id does not collide with those that the engine gives."""
    _, body = pushed()
    body.add_force((1, 0, 0), id=1)
    assert body.add_force((0, 1, 0)).id != 1


def test_opposite_forces_cancel_to_the_bit_in_any_order() -> None:
    big = [xp.Force((1e16, 0, 0)), xp.Force((1, 0, 0)), xp.Force((-1e16, 0, 0))]
    for order in ((0, 1, 2), (1, 0, 2), (2, 1, 0), (0, 2, 1)):
        engine, body = pushed(*(big[k] for k in order))
        engine.run(until=1.0)
        assert body.velocity == (1, 0, 0)


def test_a_torque_turns() -> None:
    engine, body = pushed(xp.Force(torque=(0, 0, 3), duration=1.0), inertia=(1, 1, 1.5))
    engine.run(until=2.0)
    assert body.angular_velocity == pytest.approx((0, 0, 2), abs=1e-15) and body.position == (0, 0, 0)
    angle = 1.0 + 2.0
    assert body.orientation == pytest.approx((math.cos(angle / 2), 0, 0, math.sin(angle / 2)), abs=1e-14)


def test_a_force_added_by_its_parts_or_whole_is_the_same() -> None:
    engine, body = pushed()
    one = body.add_force((1, 2, 3), 4.0, "x")
    other = body.add_force(xp.Force((1, 2, 3), 4.0, "x"))
    assert one == other and body.forces == (one, other)
    engine.run(until=1.0)
    assert body.velocity == (2, 4, 6)
