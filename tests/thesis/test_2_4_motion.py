"""Thesis 2.1 to 2.4: objects and their motion, figures 2-5, 2-6 and 2-12."""

from __future__ import annotations

import math
from typing import Any

import pytest

import xpheve as xp


@pytest.mark.parametrize("mass", [1e-6, 1.0, 1e6])
def test_2_4_free_fall_does_not_depend_on_mass(mass: float) -> None:
    engine = xp.PhysicsEngine()
    gravity = engine.add_law("basic:planet_gravity", acceleration=9.8)
    body = engine.add_object(xp.PhysicalObject(mass=mass), laws=[gravity])
    engine.run(until=1.0)
    assert body.velocity == pytest.approx((0, -9.8, 0), rel=1e-15)
    assert body.position == pytest.approx((0, -4.9, 0), rel=1e-15)


def test_2_4_weight_of_two_kilograms() -> None:
    engine = xp.PhysicsEngine()
    gravity = engine.add_law("basic:planet_gravity", acceleration=9.8)
    body = engine.add_object(xp.PhysicalObject(mass=2.0), laws=[gravity])
    engine.run(until=0.0)
    assert [force.vector for force in body.forces] == [(0, -19.6, 0)]


@pytest.mark.parametrize("force", [(3.0, 0.0, 0.0), (-1.0, 2.0, 0.5)])
def test_2_4_acceleration_is_force_over_mass(force: Any) -> None:
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject(mass=4.0, velocity=(1, 1, 1)))
    body.add_force(force)
    engine.run(until=2.0)
    assert body.velocity == tuple(1 + f / 4 * 2 for f in force)
    assert body.position == tuple(2 * 1 + f / 4 * 2 for f in force)


@pytest.mark.parametrize(
    "cuts",
    [[], [0.5], [0.02 * k for k in range(1, 50)], [0.001, 0.0011, 0.4, 0.41, 0.9999999]],
    ids=["whole", "half", "20 ms", "odd"],
)
def test_fig_2_5_and_2_6_irregular_updates_give_the_same_motion(cuts: list[float]) -> None:
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))
    body.add_force((0, -9.8, 0))
    for until in [*cuts, 1.0]:
        engine.run(until=until)
    assert body.position == (1.0, -4.9, 0.0) and body.velocity == (1.0, -9.8, 0.0)


def test_fig_2_5_an_object_added_at_five_starts_at_five() -> None:
    engine = xp.PhysicsEngine()
    engine.run(until=5.0)
    body = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))
    engine.run(until=6.0)
    assert body.position == (1, 0, 0)


@pytest.mark.parametrize("dt", [None, 0.02, 0.3, 1.0, 2.0])
def test_fig_2_12_twenty_newtons_for_one_second(dt: float | None) -> None:
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject(mass=1.0))
    body.add_force((20, 0, 0), 1.0)
    engine.run(until=1.0, dt=dt)
    assert body.velocity == (20, 0, 0) and body.position == (10, 0, 0)
    engine.run(until=2.0, dt=dt)
    assert body.velocity == (20, 0, 0) and body.position == (30, 0, 0)


def test_2_1_orientation_is_read_and_set() -> None:
    body = xp.PhysicalObject(orientation=(math.cos(0.5), 0, math.sin(0.5), 0))
    assert body.orientation == pytest.approx((math.cos(0.5), 0, math.sin(0.5), 0), abs=1e-16)
