"""Thrust fixed in the body frame."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.kernels.quaternion import from_rotation_vector
from xpheve_laws_basic import Thrust

steps = pytest.mark.parametrize("dt", [None, 2.0, 0.3, 0.25, 0.01])


def test_it_turns_with_the_body(view: Any) -> None:
    quarter = [from_rotation_vector((0, 0, math.pi / 2)), (1, 0, 0, 0)]
    columns = {"orientation": np.array(quarter), "time": 0.0, "since": np.array([0.0, 0.0])}
    from xpheve.laws.view import BodyView

    body = BodyView(lambda name: columns[name], set(), 2)
    for duration in (None, 1.0):
        force = Thrust(thrust=("3 N", 0, "1 N"), duration=duration).force(body)
        np.testing.assert_allclose(force, [(0, 3, 1), (3, 0, 1)], atol=1e-15)


def rocket(dt: float | None, until: float, spin: float = 0.0, **given: Any) -> tuple[Any, xp.PhysicalObject]:
    """Return engine and body of 2 kg after a burn of 3 N along its own x."""
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("basic:thrust", thrust=(3.0, 0, 0), **given)
    shape = xp.Box((1, 2, 3))
    body = engine.add_object(
        xp.PhysicalObject(shape, mass=2.0, angular_velocity=(0, 0, spin), name="rocket"), laws=[law]
    )
    engine.run(until=until, dt=dt)
    return engine, body


@steps
def test_the_impulse_on_a_body_that_does_not_turn_is_exact_whatever_the_step(dt: float | None) -> None:
    engine, body = rocket(dt, 2.0, duration=0.777, delay=0.1)
    v = 3.0 / 2.0 * 0.777
    np.testing.assert_allclose(body.velocity, (v, 0, 0), rtol=1e-14)
    np.testing.assert_allclose(body.position, (0.5 * v * 0.777 + v * (2.0 - 0.877), 0, 0), rtol=1e-14)
    energy = engine.energy()
    assert energy.work == pytest.approx(energy.kinetic, rel=1e-13)


@settings(max_examples=25, deadline=None)
@given(dt=st.floats(0.05, 1.0), duration=st.floats(0.0, 1.0), delay=st.floats(0.0, 1.0))
def test_the_impulse_is_thrust_times_duration_for_any_step(dt: float, duration: float, delay: float) -> None:
    _, body = rocket(dt, 2.5, duration=duration, delay=delay)
    assert body.velocity[0] == pytest.approx(1.5 * duration, rel=1e-13, abs=1e-15)


def test_it_burns_for_ever_without_a_duration() -> None:
    _, body = rocket(0.1, 4.0)
    assert body.velocity[0] == pytest.approx(6.0, rel=1e-14)


def test_a_body_that_spins_about_a_principal_axis_follows_the_closed_form_with_order_two() -> None:
    w, burn, until = 2.0, 0.8, 1.0  # a burn that no step of these divides
    speed = 1.5 / w
    at_end = np.array([speed * math.sin(w * burn), speed * (1 - math.cos(w * burn)), 0.0])
    way = 1.5 / w**2 * np.array([1 - math.cos(w * burn), w * burn - math.sin(w * burn), 0.0])
    where = way + at_end * (until - burn)
    bodies = [rocket(1 / n, until, spin=w, duration=burn)[1] for n in (32, 64, 128)]
    for errors in (
        [math.dist(body.velocity, at_end) for body in bodies],
        [math.dist(body.position, where) for body in bodies],
    ):
        assert errors[2] < 1e-4
        for coarse, fine in pairwise(errors):
            assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.2)


def test_a_turn_that_is_whole_gives_no_speed() -> None:
    _, body = rocket(0.01, 2.0, spin=2 * math.pi, duration=1.0)
    np.testing.assert_allclose(body.velocity, (0, 0, 0), atol=1e-14)


@steps
def test_it_burns_from_when_an_object_is_mapped_each_its_own_time(dt: float | None) -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("basic:thrust", thrust=(1.0, 0, 0), duration=0.35)
    first = engine.add_object(xp.PhysicalObject(name="first"), laws=[law])
    second = engine.add_object(xp.PhysicalObject(name="second"))
    engine.run(until=0.21, dt=dt)
    engine.map(second, law)
    engine.run(until=1.0, dt=dt)
    assert first.velocity[0] == pytest.approx(0.35, rel=1e-14)
    assert second.velocity[0] == pytest.approx(0.35, rel=1e-14)
    assert first.position[0] - second.position[0] == pytest.approx(0.35 * 0.21, rel=1e-13)


@steps
def test_disabling_and_enabling_burns_again(dt: float | None) -> None:
    engine, body = rocket(dt, 1.0, duration=0.5)
    law: Any = engine.laws[0]
    law.enabled = False
    engine.run(until=1.5, dt=dt)
    law.enabled = True
    engine.run(until=3.0, dt=dt)
    assert body.velocity[0] == pytest.approx(2 * 1.5 * 0.5, rel=1e-14)


@steps
def test_a_duration_that_is_set_during_the_burn_takes_effect(dt: float | None) -> None:
    engine, body = rocket(dt, 0.4, duration=0.5)
    law: Any = engine.laws[0]
    law.duration = 1.1
    engine.run(until=3.0, dt=dt)
    assert body.velocity[0] == pytest.approx(1.5 * 1.1, rel=1e-14)


@pytest.mark.parametrize("dt", [None, 0.3])
def test_a_copy_and_a_reset_in_the_midst_of_the_burn_go_on_to_the_bit(dt: float | None) -> None:
    engine, body = rocket(dt, 2.0, spin=1.0, duration=0.777)
    cut, _ = rocket(dt, 0.5, spin=1.0, duration=0.777)
    copied = cut.copy()
    copied.run(until=2.0, dt=dt)
    assert copied.object("rocket").velocity == body.velocity
    engine.reset()
    engine.run(until=2.0, dt=dt)
    assert engine.object("rocket").velocity == copied.object("rocket").velocity


def test_other_forces_and_impacts_beside_it() -> None:
    engine = xp.PhysicsEngine(up="z")
    laws = [
        engine.add_law("basic:thrust", thrust=(0, 0, 3.0), duration=0.777),
        engine.add_law("basic:planet_gravity", acceleration=1.0),
        engine.add_law("collision:elastic"),
    ]
    engine.add_object(xp.PhysicalObject(xp.Plane((0, 0, -1)), position=(0, 0, 1.1), fixed=True), laws=laws[2:])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), mass=1.0, position=(0, 0, 0.5)), laws=laws)
    engine.run(until=0.9, dt=0.25)
    hit = math.sqrt(0.5)  # s: 1/2 2 t^2 = 0.5 m to the ceiling, then down at 2 hit
    v = -2 * hit + 2 * (0.777 - hit) - (0.9 - 0.777)
    assert ball.velocity[2] == pytest.approx(v, rel=1e-12)
