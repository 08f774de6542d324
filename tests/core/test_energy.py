"""Conserved quantities: each joule is booked once."""

from __future__ import annotations

import math
from typing import Any

import pytest

import xpheve as xp

when = xp.when


def test_free_fall_turns_potential_into_kinetic_to_rounding() -> None:
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("basic:planet_gravity", acceleration=10.0)
    engine.add_object(xp.PhysicalObject(mass=2.0, position=(0, 0, 5), velocity=(1, 0, 0)), laws=[law])
    assert engine.energy() == (1.0, 100.0, 0.0)
    for until in (0.3, 1.0, 2.0):
        engine.run(until=until)
        found = engine.energy()
        assert found.total == pytest.approx(101.0, rel=1e-14) and found.work == 0.0 and found.balance == found.total


def test_the_work_of_a_users_force_is_booked() -> None:
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject(mass=2.0))
    body.add_force((4, 0, 0), 1.5)
    for until in (0.5, 1.0, 3.0):
        engine.run(until=until)
        t = min(until, 1.5)
        assert engine.energy().kinetic == pytest.approx(0.5 * 2 * (2 * t) ** 2, rel=1e-14)
        assert engine.energy().balance == pytest.approx(0.0, abs=1e-14)
    assert engine.explain().data["energy"]["work_by"] == {"forces": pytest.approx(9.0)}


def test_the_work_of_drag_is_negative_and_balances() -> None:
    engine = xp.PhysicsEngine(up="z")
    laws = [engine.add_law("basic:planet_gravity"), engine.add_law("basic:linear_drag", coefficient=0.5)]
    engine.add_object(xp.PhysicalObject(velocity=(3, 0, 9)), laws=laws)
    first = engine.energy().balance
    engine.run(until=2.0, rtol=1e-9, atol=1e-11)
    found = engine.energy()
    assert found.work < -10.0 and found.balance == pytest.approx(first, rel=1e-6)
    assert list(engine.explain().data["energy"]["work_by"]) == ["basic:linear_drag"]


def test_an_impact_that_loses_energy_books_its_work() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic", restitution=0.5)
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), mass=2.0, velocity=(3, 1, 0)), laws=[law])
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), mass=1.0, position=(4, 0.0, 0), velocity=(0, 1, 0)), laws=[law])
    before = engine.energy()
    momentum = engine.momentum()
    engine.run(until=3.0)
    after = engine.energy()
    assert after.work < 0 and after.kinetic < before.kinetic
    assert after.balance == pytest.approx(before.balance, rel=1e-14)
    assert engine.momentum() == pytest.approx(momentum, abs=1e-14)


def test_a_torque_does_work() -> None:
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject(inertia=(1, 1, 2)))
    body.add_force(xp.Force(torque=(0, 0, 4), duration=1.0))
    engine.run(until=2.0)
    assert engine.energy().kinetic == pytest.approx(4.0) and engine.energy().balance == pytest.approx(0.0, abs=1e-13)


def test_angular_momentum_counts_orbit_and_spin() -> None:
    engine = xp.PhysicsEngine()
    engine.add_object(
        xp.PhysicalObject(
            mass=2.0, inertia=(1, 2, 3), position=(1, 0, 0), velocity=(0, 3, 0), angular_velocity=(0, 0, 5)
        )
    )
    assert engine.angular_momentum() == pytest.approx((0, 0, 2 * 3 + 3 * 5))
    engine.run(until=7.7)
    assert engine.angular_momentum() == pytest.approx((0, 0, 21), abs=1e-13)


def test_fixed_objects_count_for_nothing() -> None:
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("basic:planet_gravity")
    engine.add_object(xp.PhysicalObject(fixed=True, position=(0, 0, 99), mass=1e6), laws=[law])
    engine.run(until=1.0)
    assert engine.energy() == (0.0, 0.0, 0.0) and engine.momentum() == (0, 0, 0)


def test_momentum_is_kept_when_one_of_a_group_is_written() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("basic:spring", stiffness=50.0)
    bodies = [engine.add_object(xp.PhysicalObject(position=(x, 0, 0)), laws=[law]) for x in (0, 1, 3)]
    engine.run(until=0.05, dt=0.1)
    for body in bodies:
        before = engine.momentum()[0]
        change = 5.0 - body.velocity[0]
        body.velocity = (5, 0, 0)
        engine.run(until=engine.time + 0.11, dt=0.1)
        assert engine.momentum()[0] == pytest.approx(before + change, abs=1e-12)


def test_sums_do_not_depend_on_the_order_of_adding() -> None:
    def total(order: list[int]) -> Any:
        engine = xp.PhysicsEngine(up="z")
        law = engine.add_law("basic:planet_gravity")
        for k in order:
            engine.add_object(
                xp.PhysicalObject(
                    mass=10.0 ** (k - 5), position=(0.1 * k, k, 1 / (k + 1)), velocity=(k, 1e-5 * k, math.pi)
                ),
                laws=[law],
            )
        engine.run(until=0.77)
        return engine.energy(), engine.momentum(), engine.angular_momentum()

    assert total(list(range(12))) == total([5, 3, 11, 0, 1, 10, 2, 9, 4, 8, 7, 6])
