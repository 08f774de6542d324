"""Faults that made the motion of smooth steppers depend on how a run was cut into pieces."""

from __future__ import annotations

import warnings

import pytest

import xpheve as xp


def circling(**settings: object) -> xp.PhysicsEngine:
    """A body about a fixed one."""
    engine = xp.PhysicsEngine(compile="never", **settings)  # type: ignore[arg-type]
    gravity = engine.add_law("basic:universal_gravity", gravitational_constant=1.0)
    engine.add_object(xp.PhysicalObject(fixed=True), laws=[gravity])
    body = xp.PhysicalObject(mass=0.3, position=(1, 0, 0), velocity=(0, 0.6, 0.1), name="body")
    engine.add_object(body, laws=[gravity])
    return engine


@pytest.mark.parametrize("stepper", ["core:adaptive", "core:implicit"])
def test_steps_shorter_than_dt_are_the_same_wherever_a_run_ends(stepper: str) -> None:
    """Where many host steps were asked for at once, one was made in place of those that a host step needs, and walls were passed."""
    found = set()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for stops in ((1.0,), (0.1, 1.0), (0.3, 0.7, 1.0)):
            engine = circling(stepper=stepper)
            for until in stops:
                engine.run(until=until, dt=1 / 32)
            body = engine.object("body")
            found.add((body.position, body.velocity))
    assert len(found) == 1
