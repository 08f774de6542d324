"""Faults by which drivers went on with numbers that were others by then: masses, columns, stored forces."""

from __future__ import annotations

from collections.abc import Callable

import pytest

import xpheve as xp


def three(stepper: str) -> xp.PhysicsEngine:
    """Three charged bodies that attract one another."""
    engine = xp.PhysicsEngine(compile="never", stepper=stepper)
    laws = [
        engine.add_law("basic:universal_gravity", gravitational_constant=1.0),
        engine.add_law("basic:coulomb", coulomb_constant=0.1),
    ]
    places = {"a": (1, 0, 0), "b": (-1, 0, 0.1), "c": (0, 1.5, 0)}
    for name, place in places.items():
        engine.add_object(xp.PhysicalObject(name=name, position=place, charge=1.0), laws=laws)
    return engine


def heavier(engine: xp.PhysicsEngine) -> None:
    """Another mass."""
    engine.object("a").mass = 2.0


def charged(engine: xp.PhysicsEngine) -> None:
    """Another charge."""
    engine.object("a")["charge"] = -3.0


def pushed(engine: xp.PhysicsEngine) -> None:
    """A stored force that ends."""
    engine.object("a").add_force((0.0, 0.0, 1.0), duration=0.1)


@pytest.mark.parametrize("act", [heavier, charged, pushed])
@pytest.mark.parametrize("stepper", ["core:adaptive", "core:implicit", "core:symplectic4"])
def test_what_is_set_between_two_runs_counts_from_then_on(
    stepper: str, act: Callable[[xp.PhysicsEngine], None]
) -> None:
    """Masses, columns and stored forces that were set live were passed over until something else made the loop anew."""
    how = {"dt": 1 / 32} if "symplectic" in stepper else {}
    plain = three(stepper)
    plain.run(until=0.2, **how)
    restored = xp.PhysicsEngine.restore(plain.checkpoint())
    found = []
    for engine in (plain, restored):
        act(engine)
        engine.run(until=0.4, **how)
        found.append([(obj.position, obj.velocity) for obj in engine.objects])
    assert found[0] == found[1]
