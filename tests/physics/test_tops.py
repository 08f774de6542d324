"""Free rotation through the engine (S4): a body of inertia (1, 2, 3) for 60 s, about its middle axis."""

from __future__ import annotations

import importlib.util
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.kernels.quaternion import conjugate, from_rotation_vector, multiply, rotate, rotate_inverse

_home = Path(__file__).parents[1] / "core" / "kernels" / "test_free_rotation.py"
_spec = importlib.util.spec_from_file_location("free_rotation_reference", _home)
assert _spec is not None and _spec.loader is not None
_module = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(_module)

REFERENCE: dict[Any, tuple[str, ...]] = _module.REFERENCE  # Taylor series, right to 20 digits
STILL = (1.0, 0.0, 0.0, 0.0)


def angle_between(q: Any, p: Any) -> float:
    """Angle [rad] between two orientations."""
    return 2.0 * math.asin(min(1.0, math.hypot(*multiply(conjugate(tuple(q)), tuple(p))[1:])))


def spinning(rates: Any, inertia: Any = (1, 2, 3), **options: Any) -> tuple[xp.PhysicsEngine, xp.PhysicalObject]:
    engine = xp.PhysicsEngine()
    return engine, engine.add_object(xp.PhysicalObject(inertia=inertia, angular_velocity=rates, **options))


def length_of_momentum(inertia: Any, q: Any, omega: Any) -> float:
    """|L| [kg m^2/s], from moments about the body's own axes."""
    own = rotate_inverse(tuple(q), tuple(omega))
    return math.hypot(*(i * w for i, w in zip(inertia, own, strict=True)))


@pytest.mark.parametrize("every", [None, 0.01, 0.7])
@pytest.mark.parametrize(("rates", "t"), list(REFERENCE))
def test_a_top_flips_over_when_its_taylor_series_says(rates: Any, t: float, every: float | None) -> None:
    if every is not None and t > 100.0:
        every *= 100.0
    engine, top = spinning(rates)
    engine.run(until=t, every=every)
    expected = [float(text) for text in REFERENCE[rates, t]]
    assert angle_between(top.orientation, expected[:4]) < 4e-15  # 1e-11 was asked for
    own = rotate_inverse(top.orientation, top.angular_velocity)
    assert own == pytest.approx(expected[4:], rel=0.0, abs=2e-14)  # a rounding of the time of the flip, see there


@pytest.mark.parametrize("rates", [(0.01, 2.0, 0.01), (1e-4, 2.0, 1e-4), (1e-8, 2.0, 1e-8), (0.0, 2.0, 0.0)])
def test_a_record_of_a_top_keeps_its_angular_momentum_in_length_and_direction(rates: Any) -> None:
    engine, top = spinning(rates)
    begin, energy = engine.angular_momentum(), engine.energy().kinetic
    record = engine.run(until=60.0, every=0.1)
    track, size = record[top], math.hypot(*begin)
    lengths = [
        length_of_momentum((1.0, 2.0, 3.0), q, w)
        for q, w in zip(track.orientation, track.angular_velocity, strict=True)
    ]
    assert np.abs(np.array(lengths) / size - 1.0).max() < 2e-15  # 1e-14 was asked for; q, w and this sum round
    assert np.abs(record.energy[:, 0] / energy - 1.0).max() < 4e-15
    assert math.dist(engine.angular_momentum(), begin) < 4e-15 * size
    assert np.abs(np.linalg.norm(track.orientation, axis=1) - 1.0).max() < 4e-16


def test_a_spin_about_the_middle_axis_alone_goes_on() -> None:
    engine, top = spinning((0.0, 2.0, 0.0))
    record = engine.run(until=60.0, every=1.0)
    for t, q, w in zip(record.time, record[top].orientation, record[top].angular_velocity, strict=True):
        assert tuple(w) == (0.0, 2.0, 0.0)
        assert angle_between(q, from_rotation_vector((0.0, 2.0 * math.fmod(t, math.pi), 0.0))) < 1e-14  # pi rounds


@pytest.mark.parametrize("inertia", [1.0, (2.0, 2.0, 2.0), 0.4])
@pytest.mark.parametrize("rates", [(0.01, 2.0, 0.01), (1.0, -2.0, 0.5)])
def test_a_ball_spins_about_what_it_spins_about(inertia: Any, rates: Any) -> None:
    engine, top = spinning(rates, inertia)
    record = engine.run(until=60.0, every=1.0)
    for t, q, w in zip(record.time, record[top].orientation, record[top].angular_velocity, strict=True):
        assert tuple(w) == rates
        angle = float(t) * math.hypot(*rates)
        near = angle_between(q, from_rotation_vector(tuple(w_k * float(t) for w_k in rates)))
        assert near < 2e-15 + 3e-16 * angle  # the angle itself rounds


@pytest.mark.parametrize("inertia", [(2.0, 2.0, 3.0), (2.0, 3.0, 2.0)])
def test_a_symmetric_top_precesses_about_its_angular_momentum(inertia: Any) -> None:
    """L / I turns it in the world, and (1 - I_axis / I) w_axis about its own axis."""
    rates, t = (0.3, 1.0, 0.5), 60.0
    engine, top = spinning(rates, inertia)
    begin = engine.angular_momentum()
    engine.run(until=t)
    axis = 2 if inertia[0] == inertia[1] else 1
    across = inertia[0]
    own = [0.0, 0.0, 0.0]
    own[axis] = rates[axis] * (1.0 - inertia[axis] / across) * t
    world = from_rotation_vector(tuple(component * t / across for component in begin))
    assert angle_between(top.orientation, multiply(world, from_rotation_vector(tuple(own)))) < 1e-13  # angles of 1e2


def test_looking_at_a_top_changes_nothing() -> None:
    engine, top = spinning((1e-4, 2.0, 1e-4))
    other, twin = spinning((1e-4, 2.0, 1e-4))
    engine.run(until=60.0)
    for k in range(600):
        other.run(until=0.1 * k)
        _ = twin.orientation, other.energy()
    other.run(until=60.0)
    assert (top.orientation, top.angular_velocity) == (twin.orientation, twin.angular_velocity)


def test_a_thrown_top_spins_as_one_in_place() -> None:
    """Gravity at the centre of mass turns nothing; host steps neither."""
    still, top = spinning((0.01, 2.0, 0.01))
    still.run(until=20.0)
    engine = xp.PhysicsEngine()
    gravity = engine.add_law("basic:planet_gravity")
    thrown = engine.add_object(
        xp.PhysicalObject(inertia=(1, 2, 3), angular_velocity=(0.01, 2.0, 0.01), velocity=(1, 100, 0)), laws=[gravity]
    )
    engine.run(until=20.0, dt=1 / 60)
    assert (thrown.orientation, thrown.angular_velocity) == (top.orientation, top.angular_velocity)


def test_a_turned_frame_turns_the_motion() -> None:
    """The same body, seen from a frame turned by 2 rad about (1, 2, 2) / 3."""
    turn = from_rotation_vector((2 / 3, 4 / 3, 4 / 3))
    engine, top = spinning((0.3, 1.0, 0.5))
    turned, other = spinning(rotate(turn, (0.3, 1.0, 0.5)), orientation=turn)
    engine.run(until=10.0)
    turned.run(until=10.0)
    # The state turned is rounded (1e-16) and that grows as exp(lambda t), lambda = 0.5 / s at most, at a flip.
    assert angle_between(other.orientation, multiply(turn, top.orientation)) < 1e-13


def test_a_top_late_and_far_spins_alike() -> None:
    engine = xp.PhysicsEngine()
    engine.run(until=1e6)
    top = engine.add_object(
        xp.PhysicalObject(inertia=(1, 2, 3), angular_velocity=(1e-4, 2.0, 1e-4), position=(1e9, 0, 0))
    )
    engine.run(until=1e6 + 60.0)
    expected = [float(text) for text in REFERENCE[(1e-4, 2.0, 1e-4), 60.0]]
    assert angle_between(top.orientation, expected[:4]) < 4e-15
