"""Free flight (S1): a thrown sphere, wherever and whenever, looked at as often as one likes."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xpheve as xp

START, THROW = (0.0, 0.0, 100.0), (3.0, 4.0, 5.0)


def thrown(**options: Any) -> tuple[xp.PhysicsEngine, xp.PhysicalObject]:
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", acceleration=9.81)
    state = {"mass": 1.0, "position": START, "velocity": THROW} | options
    return engine, engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), **state), laws=[gravity])


def parabola(t: float, start: Any = START, throw: Any = THROW, g: float = 9.81) -> list[Fraction]:
    """x0 + v0 t - g t^2 / 2 from the floats given, without rounding."""
    time = Fraction(t)
    fall = (0, 0, Fraction(g) * time**2 / 2)
    return [Fraction(x) + Fraction(v) * time - f for x, v, f in zip(start, throw, fall, strict=True)]


def error_of(position: Any, t: float, **given: Any) -> float:
    """Distance [m] from the parabola, relative to how far from the origin that is."""
    exact = parabola(t, **given)
    gap = sum((Fraction(x) - y) ** 2 for x, y in zip(position, exact, strict=True))
    return float(gap / sum(y * y for y in exact)) ** 0.5


@pytest.mark.parametrize("spacing", [4.0, 1.0, 1 / 60, 0.1, 1e-3])
def test_a_thrown_sphere_follows_the_parabola_at_any_output_spacing(spacing: float) -> None:
    engine, ball = thrown()
    record = engine.run(until=4.0, every=spacing)
    track = record[ball]
    # Four roundings of a closed form; 1e-12 was asked for.
    assert max(error_of(x, float(t)) for t, x in zip(track.time, track.position, strict=True)) < 5e-16


@settings(deadline=None, max_examples=50)
@given(
    times=st.lists(st.floats(0.0, 4.0), min_size=1, max_size=20).map(sorted),
    stepped=st.sampled_from([None, 0.1, 1 / 60]),
)
def test_when_one_looks_does_not_matter(times: list[float], stepped: float | None) -> None:
    engine, ball = thrown()
    for t in times:
        engine.run(until=t, dt=stepped)
        assert error_of(ball.position, t) < 5e-16
    engine.run(until=4.0, dt=stepped)
    other, same = thrown()
    other.run(until=4.0)
    assert (ball.position, ball.velocity) == (same.position, same.velocity)


@settings(deadline=None, max_examples=50)
@given(mass=st.floats(1e-12, 1e12), g=st.floats(0.0, 1e3), vz=st.floats(-1e3, 1e3), t=st.floats(0.0, 1e3))
def test_all_masses_fall_alike(mass: float, g: float, vz: float, t: float) -> None:
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", acceleration=g)
    ball = engine.add_object(xp.PhysicalObject(mass=mass, position=START, velocity=(3.0, 4.0, vz)), laws=[gravity])
    engine.run(until=t)
    exact = parabola(t, throw=(3.0, 4.0, vz), g=g)
    # m g is rounded and divided by m again: 2 more roundings of the largest term.
    size = 100.0 + abs(vz) * t + 0.5 * g * t * t
    assert abs(float(Fraction(ball.position[2]) - exact[2])) < 8e-16 * size
    assert abs(ball.velocity[2] - (vz - g * t)) <= 8e-16 * (abs(vz) + g * t)


@pytest.mark.parametrize("begin", [1e6, 1e9])
def test_a_scene_that_starts_late_falls_alike(begin: float) -> None:
    engine = xp.PhysicsEngine(up="z")
    engine.run(until=begin)
    gravity = engine.add_law("basic:planet_gravity", acceleration=9.81)
    ball = engine.add_object(xp.PhysicalObject(position=START, velocity=THROW), laws=[gravity])
    engine.run(until=begin + 1 / 3)
    engine.run(until=begin + 4.0)
    assert error_of(ball.position, 4.0) < 5e-16  # clocks are read as differences, without loss


@pytest.mark.parametrize("far", [1e3, 1e6, 1e12])
def test_a_scene_far_away_falls_alike(far: float) -> None:
    start = (far, -far, far)
    engine, ball = thrown(position=start)
    engine.run(until=4.0)
    assert error_of(ball.position, 4.0, start=start) < 3e-16


def test_two_thousand_spheres_fall_as_one_does() -> None:
    """The arithmetic over arrays is that of a single row, to the bit."""
    random = np.random.default_rng(1)
    states = random.normal(size=(2000, 6))
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", acceleration=9.81)
    many = engine.add_objects(
        [xp.PhysicalObject(mass=1.0 + abs(s[0]), position=s[:3], velocity=s[3:]) for s in states], laws=[gravity]
    )
    engine.run(until=1.7)
    positions = engine.bodies.position.copy()
    for k in range(0, 2000, 97):
        alone, ball = thrown(mass=1.0 + abs(states[k, 0]), position=states[k, :3], velocity=states[k, 3:])
        alone.run(until=1.7)
        assert ball.position == many[k].position == tuple(positions[k].tolist())


def test_what_obeys_no_law_moves_straight_on() -> None:
    engine = xp.PhysicsEngine()
    thing = engine.add_object(xp.PhysicalObject(position=(1.0, 2.0, 3.0), velocity=(0.5, -0.25, 2.0)))
    engine.run(until=1024.0)
    assert thing.position == (513.0, -254.0, 2051.0)  # all representable
    assert thing.velocity == (0.5, -0.25, 2.0)


def test_energy_and_momentum_follow_a_thrown_sphere() -> None:
    engine, ball = thrown(mass=2.5)
    record = engine.run(until=4.0, every=0.01)
    assert record.energy_drift < 5e-16  # m v^2 / 2 + m g h, four roundings of terms beside 2.5 kJ
    momentum = np.array([v for v in record[ball].velocity]) * 2.5
    expected = 2.5 * (np.array(THROW) - np.outer(record.time, (0.0, 0.0, 9.81)))
    assert np.abs(momentum - expected).max() < 3e-14
    assert engine.momentum() == tuple(2.5 * np.array(ball.velocity))
