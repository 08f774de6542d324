"""Thesis 3.1.1, 3.5: memory stays constant, however long the engine runs."""

from __future__ import annotations

import gc
import random
import tracemalloc
from collections.abc import Callable

import pytest

import xpheve as xp

FEW = 60_000
"""[bytes], about what entries in the queue come and go by; a thousand events that each left an object behind would be 100,000 and more."""


def growth(work: Callable[[], object], warm: Callable[[], object]) -> int:
    """Bytes that are held after ``work`` more than before it; ``warm`` goes first, to fill what is of fixed size."""
    tracemalloc.start()  # before, since what is exchanged counts as new otherwise
    try:
        warm()
        gc.collect()
        before = tracemalloc.get_traced_memory()[0]
        work()
        gc.collect()
        return tracemalloc.get_traced_memory()[0] - before
    finally:
        tracemalloc.stop()


def room(count: int) -> xp.PhysicsEngine:
    """Balls in a box without loss, a clock, and a watched region."""
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic", restitution=1.0)
    chance = random.Random(1)
    for axis in range(3):
        for side in (1.0, -1.0):
            normal = tuple(side if k == axis else 0.0 for k in range(3))
            engine.add_object(xp.PhysicalObject(xp.Plane(normal, offset=-1.0), fixed=True), laws=[bounce])
    middle = xp.Region(xp.Sphere(0.5))
    condition = xp.when.Elapsed(0.1, every=True) | xp.when.ProbeEnter(middle) | xp.when.ContactBegin()
    law = engine.add_law(Told(), container=xp.LawContainer(condition))
    for k in range(count):
        velocity = [chance.uniform(-9.0, 9.0) for _ in range(3)]
        place = (-0.6 + 0.6 * (k % 3), -0.6 + 0.6 * (k // 3 % 3), -0.6 + 0.6 * (k // 9))
        ball = engine.add_object(
            xp.PhysicalObject(xp.Sphere(0.1), position=place, velocity=velocity), laws=[bounce, law]
        )
    engine.add_probe(xp.Probe("rider", attached=ball))
    return engine


class Told(xp.PhysicalLaw):
    """Count events, and keep a force that comes and goes."""

    told = 0

    def enforce_this_law(self, event: xp.Event) -> None:
        """One more."""
        self.told += 1


@pytest.mark.thesis("keeping-up")
def test_3_1_1_a_long_run_with_many_impacts_holds_no_more_memory_at_its_end() -> None:
    engine = room(3)

    def on(seconds: float) -> Callable[[], object]:
        return lambda: engine.run(until=engine.time + seconds)

    told = engine.laws[1]
    grown = growth(on(45.0), warm=on(15.0))
    assert told.told > 800  # type: ignore[attr-defined]
    assert grown < FEW, grown


@pytest.mark.thesis("keeping-up")
def test_3_1_1_a_run_in_real_time_that_keeps_no_inputs_holds_no_more_memory() -> None:
    engine = room(4)
    engine.start(keep_inputs=False, updates=200.0)

    def on(seconds: float) -> Callable[[], object]:
        def wait() -> None:
            for _ in range(20):
                engine.post("tick")
                assert engine.wait(until=engine.time + seconds / 20, timeout=60)

        return wait

    try:
        assert growth(on(2.0), warm=on(1.0)) < FEW
    finally:
        engine.terminate()
