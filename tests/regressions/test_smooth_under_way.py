"""Faults of scenes that smooth steppers could not carry on: at rest, at walls, under two laws of one kind."""

from __future__ import annotations

import math
import warnings

import pytest

import xpheve as xp


def test_a_body_that_comes_to_rest_stays_there() -> None:
    """What rounding does to forces at rest was taken for forces that change fast: steps fell until there were none."""
    engine = xp.PhysicsEngine(up="z", stepper="core:adaptive")
    laws = [
        engine.add_law("basic:spring_to_point", stiffness=20.0),
        engine.add_law("basic:linear_drag", coefficient=2.0),
        engine.add_law("basic:planet_gravity", acceleration=9.81),
    ]
    bob = engine.add_object(xp.PhysicalObject(position=(1.0, 0.3, 0.1)), laws=laws)
    engine.run(until=60.0)
    assert math.dist(bob.position, (0.0, 0.0, -9.81 / 20.0)) < 1e-9
    assert math.hypot(*bob.velocity) < 1e-9


def test_steps_end_at_walls_to_the_last_digit() -> None:
    """A step up to a host step fell short of it by a crumb of 1e-18 s, which took a step of its own, or ended the run."""
    engine = xp.PhysicsEngine(stepper="core:adaptive")
    gravity = engine.add_law("basic:universal_gravity", gravitational_constant=1.0)
    sun = xp.PhysicalObject(fixed=True)
    body = xp.PhysicalObject(mass=0.3, position=(1, 0, 0), velocity=(0, 0.6, 0.1))
    engine.add_objects([sun, body], laws=[gravity])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        engine.run(until=2.7, dt=1 / 32)
    assert engine.explain().data["groups"][0]["steps"] < 100  # a step is a host step, and a few are shorter; it was 118


@pytest.mark.parametrize("stepper", ["core:adaptive", "core:implicit", "core:symplectic4"])
def test_sources_under_another_law_of_the_same_kind_are_carried(stepper: str) -> None:
    """Among one another they obey the law that is mutual; the one-sided one of the same id was counted in, and no loop was made."""
    found = []
    for choice in (stepper, "core:midpoint"):
        engine = xp.PhysicsEngine(stepper=choice)
        heavy = [xp.PhysicalObject(mass=1.0), xp.PhysicalObject(mass=0.5, position=(1, 0, 0), velocity=(0, 1.2, 0))]
        dust = xp.PhysicalObject(mass=1e-6, position=(2, 0.1, 0), velocity=(0, 0.6, 0.1))
        engine.add_objects(heavy, laws=[engine.add_law("basic:universal_gravity", gravitational_constant=1.0)])
        engine.add_object(dust)
        engine.add_law(
            "basic:universal_gravity", gravitational_constant=1.0, between=(heavy, [dust]), one_sided=True, name="pull"
        )
        engine.run(until=0.5, **({"dt": 1 / 256} if "symplectic" in stepper else {}))
        found.append((heavy[1].position, dust.position))
        if choice == stepper:
            assert stepper in [group["stepper"] for group in engine.explain().data["groups"]]
    for mine, theirs in zip(*found, strict=True):
        assert math.dist(mine, theirs) < 1e-4


def test_energy_beyond_the_range_of_floats_is_told_as_such() -> None:
    """Its sums raised, and with them `explain`, after the motion had run away."""
    engine = xp.PhysicsEngine()
    engine.add_objects([xp.PhysicalObject(velocity=(v, 0, 0)) for v in (1.3e154, 1.2e154, 1.3e154)])
    engine.run(until=1.0)
    assert engine.energy().kinetic == math.inf
    assert not math.isfinite(engine.energy().balance)
    assert str(engine.explain())
