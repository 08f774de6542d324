"""An engine whose law allows an error sums by a tree, says so, and keeps to the paths of exact sums within it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import xpheve as xp
from xpheve.loop import long_range

N, STEPS, DT = 200, 3, 1 / 64


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Trees from a few bodies on."""
    monkeypatch.setattr(long_range, "TREE_FROM", 0)
    monkeypatch.setattr(long_range, "LEAST_TREE", 50)
    yield


def swarm(error: float) -> xp.PhysicsEngine:
    rng = np.random.default_rng(6)
    engine = xp.PhysicsEngine(up="z", compile="never", stepper="core:symplectic2")
    law = engine.add_law("basic:universal_gravity", gravitational_constant=1.0, softening=0.1, error=error)
    places, speeds = rng.normal(size=(N, 3)), 0.3 * rng.normal(size=(N, 3))
    columns = zip(places.tolist(), speeds.tolist(), strict=True)
    engine.add_objects([xp.PhysicalObject(position=x, velocity=v, mass=1.0 / N) for x, v in columns], laws=[law])
    return engine


def places(engine: xp.PhysicsEngine) -> np.ndarray:
    return np.array([one.position for one in engine.objects])


def summed(engine: xp.PhysicsEngine) -> str:
    (law,) = engine.explain().data["laws"]
    return str(law["summed"])


def test_paths_differ_by_the_error_that_is_allowed_and_explain_tells_which_sum_it_was() -> None:
    exact, loose = swarm(0.0), swarm(0.05)
    begin = places(exact)
    for engine in (exact, loose):
        engine.run(until=STEPS * DT, dt=DT)
    pulled = np.abs(places(exact) - begin).max()
    off = np.abs(places(exact) - places(loose)).max()
    assert 0.0 < off < 0.05 * pulled
    assert summed(exact) == f"all pairs of {N} bodies, by tiles"
    assert summed(loose).startswith(f"{N} bodies by a tree, error 0.05 allowed: at most 0.0")
    assert f"sum: {summed(loose)}" in str(loose.explain())


def test_an_error_that_is_allowed_later_is_used_from_then_on() -> None:
    one, other = swarm(0.0), swarm(0.0)
    for engine in (one, other):
        engine.run(until=DT, dt=DT)
    assert places(one).tobytes() == places(other).tobytes()
    other.laws[0].set_parameter("error", 0.05)
    for engine in (one, other):
        engine.run(until=4 * DT, dt=DT)
    assert places(one).tobytes() != places(other).tobytes()
    assert "by a tree" in summed(other) and "by tiles" in summed(one)


def test_a_copy_goes_on_to_the_same_bits() -> None:
    engine = swarm(0.05)
    engine.run(until=2 * DT, dt=DT)
    other = xp.PhysicsEngine.restore(engine.checkpoint())
    for one in (engine, other):
        one.run(until=3 * DT, dt=DT)
    assert places(engine).tobytes() == places(other).tobytes()
