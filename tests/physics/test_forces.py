"""Forces with durations act exactly, whatever the steps (thesis, 2.5); torques turn as they should."""

from __future__ import annotations

import itertools
import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.kernels.quaternion import conjugate, from_rotation_vector, multiply

relaxed = settings(deadline=None, max_examples=40)


def one_body(**options: Any) -> tuple[xp.PhysicsEngine, xp.PhysicalObject]:
    engine = xp.PhysicsEngine()
    return engine, engine.add_object(xp.PhysicalObject(**options))


@pytest.mark.parametrize("dt", [None, 1.0, 0.3, 1 / 60])
def test_twenty_newtons_for_a_quarter_of_a_second(dt: float | None) -> None:
    engine, body = one_body(mass=1.0)
    body.add_force((20.0, 0.0, 0.0), duration=0.25)
    engine.run(until=1.0, dt=dt)
    assert body.velocity == (5.0, 0.0, 0.0)
    assert body.position == (4.375, 0.0, 0.0)  # 0.625 while it acts, 3.75 thereafter: all exact in binary
    assert body.forces == ()


def test_twenty_newtons_by_single_steps() -> None:
    engine, body = one_body(mass=1.0)
    body.add_force((20.0, 0.0, 0.0), duration=0.25)
    engine.step(1.0)
    assert (body.velocity[0], body.position[0]) == (5.0, 4.375)


@relaxed
@given(
    force=st.floats(-1e3, 1e3),
    mass=st.floats(1e-3, 1e3),
    duration=st.one_of(st.floats(0.0, 3.0), st.just(math.inf)),
    steps=st.lists(st.floats(1e-3, 1.0), min_size=1, max_size=8),
    stepped=st.booleans(),
)
def test_an_impulse_is_force_times_the_time_it_had(
    force: float, mass: float, duration: float, steps: list[float], stepped: bool
) -> None:
    """Thesis 2.5, all its cases: after each of any steps the impulse is F min(duration, elapsed), and what is left is left."""
    engine, body = one_body(mass=mass)
    body.add_force((0.0, force, 0.0), duration)
    for step in steps:
        if stepped:
            engine.step(step)  # another dt anchors another grid
        else:
            engine.run(until=engine.time + step)
        t = Fraction(engine.time)
        acting = t if duration == math.inf else min(t, Fraction(duration))
        rate = Fraction(force) / Fraction(mass)
        speed = rate * acting
        way = rate * acting**2 / 2 + speed * (t - acting)
        # Four roundings: F / m, its product, and the sums.
        assert abs(Fraction(body.velocity[1]) - speed) <= Fraction(5e-16) * abs(speed) + Fraction(1e-300)
        assert abs(Fraction(body.position[1]) - way) <= Fraction(1e-15) * abs(way) + Fraction(1e-300)
        left = [f.duration for f in body.forces]
        if duration == math.inf:
            assert left == [math.inf]
        elif acting < Fraction(duration):
            assert left == [pytest.approx(float(Fraction(duration) - t), rel=1e-15)]
        else:
            assert left == []


number = st.integers(-64, 64).map(lambda n: n / 16)


@relaxed
@given(
    forces=st.lists(
        st.tuples(
            st.tuples(number, number, number),
            st.integers(0, 64).map(lambda n: n / 64),  # when it begins
            st.one_of(st.integers(0, 128).map(lambda n: n / 64), st.just(math.inf)),  # how long it acts
        ),
        max_size=30,
    ),
    dt=st.sampled_from([None, 1.0, 0.25, 0.37]),
)
def test_many_forces_overlap_as_in_exact_fractions(forces: list[Any], dt: float | None) -> None:
    """Sums and products of small binary fractions: nothing may round, so nothing may differ."""
    engine, body = one_body(mass=2.0, velocity=(1.0, 0.0, -1.0))
    for begin in sorted({begin for _, begin, _ in forces}):
        engine.run(until=begin, dt=dt)
        for vector, when, duration in forces:
            if when == begin:
                body.add_force(vector, duration)
    engine.run(until=2.0, dt=dt)
    for k in range(3):
        speed = Fraction((1, 0, -1)[k])
        way = 2 * speed
        for vector, begin, duration in forces:
            acting = min(Fraction(2.0 - begin), Fraction(duration) if duration != math.inf else Fraction(9))
            gained = Fraction(vector[k]) / 2 * acting
            speed += gained
            way += gained * acting / 2 + gained * (2 - Fraction(begin) - acting)
        assert Fraction(body.velocity[k]) == speed
        assert Fraction(body.position[k]) == way


@relaxed
@given(data=st.data(), n=st.integers(1, 40))
def test_many_forces_of_any_size_and_duration(data: st.DataObject, n: int) -> None:
    engine, body = one_body(mass=3.7)
    rate: list[tuple[Fraction, Fraction]] = []
    for _ in range(n):
        f, duration = data.draw(st.floats(-100.0, 100.0)), data.draw(st.floats(0.0, 5.0))
        body.add_force((f, 0.0, 0.0), duration)
        rate.append((Fraction(f), Fraction(duration)))
    engine.run(until=4.0)
    speed = sum((f * min(d, 4) for f, d in rate), Fraction(0)) / Fraction(3.7)
    way = sum((f * (min(d, 4) ** 2 / 2 + min(d, 4) * (4 - min(d, 4))) for f, d in rate), Fraction(0)) / Fraction(3.7)
    size = float(sum(abs(f) for f, _ in rate) / Fraction(3.7))
    # Each end of a force re-bases the flight: as many roundings of the largest speed and way there could be.
    assert abs(float(Fraction(body.velocity[0]) - speed)) <= 2.3e-16 * (n + 3) * 4.0 * size
    assert abs(float(Fraction(body.position[0]) - way)) <= 2.3e-16 * (n + 3) * 16.0 * size


def test_a_force_ends_at_its_instant_late_in_a_run() -> None:
    engine = xp.PhysicsEngine()
    engine.run(until=1e9)
    body = engine.add_object(xp.PhysicalObject())
    body.add_force((1.0, 0.0, 0.0), 1e-9)  # less than the distance of floats at 1e9 s
    engine.run(until=1e9 + 1.0)
    assert body.velocity[0] == pytest.approx(1e-9, rel=1e-15)


def test_forces_add_up_without_regard_to_order() -> None:
    """1e16 + 1 - 1e16 is 1, in whatever order they come."""
    for order in itertools.permutations((1e16, 1.0, -1e16)):
        engine, body = one_body()
        for f in order:
            body.add_force((f, 0.0, 0.0))
        engine.run(until=1.0)
        assert body.velocity[0] == 1.0


def test_a_removed_force_acts_no_more() -> None:
    engine, body = one_body(mass=2.0)
    force = body.add_force((4.0, 0.0, 0.0))
    body.add_force((0.0, 2.0, 0.0), id="wind")
    body.add_force((0.0, 2.0, 0.0), id="wind")
    engine.run(until=1.0)
    assert body.remove_force(force.id) == 1 and body.remove_force("wind") == 2 and body.remove_force("wind") == 0
    engine.run(until=2.0)
    assert body.velocity == (2.0, 2.0, 0.0)
    assert body.position == (3.0, 3.0, 0.0)


def test_the_work_of_forces_is_accounted() -> None:
    engine, body = one_body(mass=2.0, velocity=(1.0, 0.0, 0.0))
    body.add_force((3.0, 1.0, 0.0), 0.7)
    record = engine.run(until=2.0, every=0.03)
    balance = record.energy[:, 0] - record.energy[:, 2]
    assert np.abs(balance - 1.0).max() < 4e-15  # terms of 5 J
    assert engine.energy().balance == pytest.approx(1.0, abs=4e-15)


# Torques


@pytest.mark.parametrize("dt", [None, 0.1])
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("spin", [0.0, 1.5, -2.0])
def test_a_torque_about_a_principal_axis_turns_in_closed_form(axis: int, spin: float, dt: float | None) -> None:
    inertia, torque = (1.0, 2.0, 2.5), 3.0
    way = np.eye(3)[axis]
    engine, body = one_body(inertia=inertia, angular_velocity=spin * way)
    body.add_force(xp.Force(torque=torque * way, duration=1.25))
    engine.run(until=2.0, dt=dt)
    rate = torque / inertia[axis]
    angle = spin * 2.0 + rate * 1.25**2 / 2 + rate * 1.25 * 0.75
    assert np.subtract(body.angular_velocity, (spin + rate * 1.25) * way) == pytest.approx(0.0, abs=2e-15)
    found = multiply(conjugate(body.orientation), from_rotation_vector(tuple(angle * way)))
    assert math.hypot(*found[1:]) < 2e-15
    work = 0.5 * inertia[axis] * ((spin + rate * 1.25) ** 2 - spin**2)
    assert engine.energy().work == pytest.approx(work, rel=1e-14)


def turned(dt: float) -> tuple[Any, Any]:
    """Orientation and angular velocity of a body after 2 s under a torque askew."""
    engine, body = one_body(inertia=(1.0, 2.0, 2.5), angular_velocity=(0.3, 1.0, -0.2))
    body.add_force(xp.Force(torque=(0.4, -0.3, 0.5), duration=1.5))
    engine.run(until=2.0, dt=dt)
    return np.array(body.orientation), np.array(body.angular_velocity)


def test_a_general_torque_is_of_second_order() -> None:
    finest = turned(1 / 1024)
    errors = [max(np.abs(a - b).max() for a, b in zip(turned(1 / n), finest, strict=True)) for n in (8, 16, 32, 64)]
    assert errors[-1] < 3e-5
    for coarse, fine in itertools.pairwise(errors):
        assert 1.9 < math.log2(coarse / fine) < 2.1


def test_a_general_torque_gives_its_angular_impulse_exactly() -> None:
    """L grows by torque times time, at any step: each kick is exact, and free turns keep L."""
    engine, body = one_body(inertia=(1.0, 2.0, 2.5), angular_velocity=(0.3, 1.0, -0.2))
    before = np.array(engine.angular_momentum())
    body.add_force(xp.Force(torque=(0.4, -0.3, 0.5), duration=1.5))
    engine.run(until=2.0, dt=0.25)
    gained = np.array(engine.angular_momentum()) - before
    assert gained == pytest.approx(np.array((0.6, -0.45, 0.75)), abs=1e-14)  # some ten roundings of 2
