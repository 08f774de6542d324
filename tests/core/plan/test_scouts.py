"""Targets of sources that are stepped themselves: as in one joint integration, whoever compiled, stopped or hit the source on the way."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import xpheve as xp

RUN = {"rtol": 1e-12, "atol": 1e-14}


class Pull(xp.PairLaw):
    """A softened attraction, of which no closed form is known."""

    id = "test:pull"
    k, e = xp.Param(1.0, unit="N m^2"), xp.Param(0.3, unit="m")

    def force(self, a: Any, b: Any) -> Any:
        d = b.position - a.position
        square = d.dot(d) + self.e * self.e
        return self.k / (square * np.sqrt(square)) * d


def scene(joint: bool, n: int = 5, **settings: Any) -> tuple[xp.PhysicsEngine, Any, Any]:
    """Return two suns about one another, and dust that feels both: one-sided, or so light that it pulls neither."""
    engine = xp.PhysicsEngine(stepper="core:adaptive")
    engine.compile = settings.pop("compile", "auto")
    suns = [xp.PhysicalObject(position=(s, 0, 0), velocity=(0, 0.5 * s, 0.1)) for s in (1.0, -1.0)]
    light = 1e-18 if joint else 1.0
    dust = [xp.PhysicalObject(mass=light, position=(2.5 + 0.3 * k, 0.2 * k, 0), velocity=(0, 0.7, 0)) for k in range(n)]
    engine.add_objects([*suns, *dust])
    engine.add_law(Pull(between=([suns[0]], [suns[1]])))
    engine.add_law(Pull(k=light, between=(suns, dust), one_sided=not joint, **settings))
    return engine, suns, dust


def places(objects: Any) -> Any:
    return np.array([[*one.position, *one.velocity] for one in objects])


def test_targets_of_stepped_sources_move_as_in_one_joint_integration() -> None:
    apart, suns, dust = scene(joint=False)
    together, both, all_dust = scene(joint=True)
    for engine in (apart, together):
        engine.run(until=20.0, **RUN)
    np.testing.assert_allclose(places(suns), places(both), atol=1e-12)
    np.testing.assert_allclose(places(dust), places(all_dust), atol=1e-10)


def test_steps_of_targets_are_not_cut_where_those_of_sources_end() -> None:
    engine, _, _ = scene(joint=False)
    engine.run(until=20.0, **RUN)
    world: Any = engine._world
    steps = [b.state.numbers["steps"] for b in world.batches if b.state.count]
    assert min(steps) > 10
    alone, _, _ = scene(joint=True)
    alone.run(until=20.0, **RUN)
    (joint,) = [b.state.numbers["steps"] for b in alone._world.batches if b.state.count]  # type: ignore[attr-defined]
    assert max(steps) <= 1.1 * joint + 2


def test_they_move_to_the_same_bits_however_they_are_run() -> None:
    found = []
    for compile, stops in (("never", [7.0]), ("always", [7.0]), ("always", [0.1, 2.5, 2.6, 7.0])):
        engine, suns, dust = scene(joint=False, compile=compile)
        for stop in stops:
            engine.run(until=stop, **RUN)
        found.append(places([*suns, *dust]).tobytes())
    assert found[0] == found[1] == found[2]


@pytest.mark.parametrize("when", [3.0, 3.37])
def test_an_event_at_a_source_bends_its_targets_from_then_on(when: float) -> None:
    ends = []
    for joint in (False, True):
        engine, suns, dust = scene(joint)
        engine.run(until=when, **RUN)
        suns[0].velocity = (0.3, 0.2, 0.4)
        engine.run(until=9.0, **RUN)
        ends.append(places([*suns, *dust]))
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-10)


def test_another_number_in_the_law_of_the_sources_bends_all_from_then_on() -> None:
    ends = []
    for joint in (False, True):
        engine, suns, dust = scene(joint)
        engine.run(until=3.3, **RUN)
        engine.laws[0].k = 2.0
        engine.run(until=9.0, **RUN)
        ends.append(places([*suns, *dust]))
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-10)


def test_the_books_of_work_balance() -> None:
    engine, _, _ = scene(joint=False)
    engine.run(until=1.0, **RUN)
    before = engine.energy().balance
    engine.run(until=12.0, **RUN)
    assert engine.energy().balance == pytest.approx(before, abs=1e-9)
