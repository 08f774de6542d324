"""Laws switched and set while time passes: numbers of their loops, linked once, compiled once, and the same bits in every way of running."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import xpheve as xp
from xpheve.compile import facts, store
from xpheve.compile import tiers as kept_kernels
from xpheve.plan import tiers

DT = 1.0 / 128.0  # a binary fraction: points of the grid are numbers that can be named
COUNT = 40


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that has compiled nothing yet, and a cache of its own."""
    monkeypatch.setenv("XPHEVE_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(kept_kernels, "_compiled", {})
    monkeypatch.setattr(store, "_warned", False)


def scene(compile: str = "never") -> xp.PhysicsEngine:
    """Gravity for all, drag for all, wind for every second."""
    engine = xp.PhysicsEngine(up="z", compile=compile)
    gravity = engine.add_law("basic:planet_gravity", name="gravity")
    drag = engine.add_law("basic:quadratic_drag", name="drag")
    wind = engine.add_law("basic:wind", name="wind")
    for k in range(COUNT):
        obj = xp.PhysicalObject(
            name=f"o{k}", mass=1.0 + 0.1 * k, position=(k, 0, 0), velocity=(1, -0.3 * k, 5), drag_area=0.1 + 0.01 * k
        )
        engine.add_object(obj, laws=[gravity, drag, *([wind] if k % 2 else [])])
    return engine


def bits(engine: xp.PhysicsEngine) -> list[Any]:
    return [*((obj.position, obj.velocity) for obj in engine.objects), tuple(engine.energy())]


def compiled() -> int:
    """Loops that were compiled, or loaded, so far."""
    return sum(one["origin"] != "interpreted" for one in facts())


def programs(engine: xp.PhysicsEngine) -> list[Any]:
    """The loops of the batches, by number."""
    world = engine._world
    return [world.sources(batch).program for batch in world.batches if batch.state.count and batch.signature.laws]


def labels(engine: xp.PhysicsEngine) -> set[str]:
    """The laws whose text is in a loop."""
    return {term.trace.label for program in programs(engine) for term in program.terms}


def switch(engine: xp.PhysicsEngine, name: str, times: int, first: float) -> float:
    """Switch a law off and on, ``times`` in all, with 4 steps before each; returns the time."""
    law, t = engine.law(name), first
    for _ in range(times):
        t += 4 * DT
        engine.run(t, dt=DT)
        law.enabled = not law.enabled
    return t


# Linked once


def test_a_law_that_is_off_is_in_no_loop_and_one_that_is_switched_stays_in_it() -> None:
    engine = scene()
    engine.run(4 * DT, dt=DT)
    assert labels(engine) == {"basic:quadratic_drag", "basic:wind"}
    wind = engine.law("wind")
    wind.enabled = False
    engine.run(8 * DT, dt=DT)
    assert labels(engine) == {"basic:quadratic_drag"}
    wind.enabled = True
    engine.run(12 * DT, dt=DT)
    linked = programs(engine)
    assert labels(engine) == {"basic:quadratic_drag", "basic:wind"} and engine._world.is_switched(wind)
    for step in range(4, 12):
        wind.enabled = not wind.enabled
        engine.run(4 * step * DT, dt=DT)
        assert all(one is other for one, other in zip(programs(engine), linked, strict=True))


def test_a_law_that_is_added_off_is_in_no_loop() -> None:
    engine = scene()
    engine.law("drag").enabled = False
    engine.run(4 * DT, dt=DT)
    assert labels(engine) == {"basic:wind"}


def test_a_law_put_out_by_a_number_does_nothing_and_no_work() -> None:
    engine = scene()
    t = switch(engine, "drag", 2, 0.0)
    engine.law("wind").enabled = False
    engine.law("drag").enabled = False
    assert engine._world.is_switched(engine.law("drag"))
    engine.run(t + DT, dt=DT)
    before = engine.energy().work
    velocities = {obj.name: obj.velocity for obj in engine.objects}
    engine.run(t + 129 * DT, dt=DT)
    assert engine.energy().work == before
    for obj in engine.objects:
        x, y, z = velocities[obj.name]
        assert obj.velocity == pytest.approx((x, y, z - 9.81), rel=1e-14)


# Same bits


def script(engine: xp.PhysicsEngine) -> list[list[Any]]:
    """Run with laws switched and set on the grid and between its points; what was seen on the way."""
    seen = []
    drag, wind = engine.law("drag"), engine.law("wind")
    acts: list[tuple[float, Callable[[], None]]] = [
        (0.1, lambda: setattr(drag, "enabled", False)),
        (16 * DT, lambda: setattr(drag, "enabled", True)),
        (0.2, lambda: setattr(drag, "enabled", False)),
        (32 * DT, lambda: setattr(wind, "velocity", (3.0, 2.0, 1.0))),
        (0.3, lambda: setattr(drag, "enabled", True)),
        (0.31, lambda: setattr(drag, "density", 2.5)),
        (0.4, lambda: engine.object("o3").__setitem__("drag_area", 0.77)),
        (0.45, lambda: setattr(engine.object("o4"), "mass", 3.25)),
        (0.5, lambda: setattr(wind, "enabled", False)),
        (0.5, lambda: setattr(engine.law("gravity"), "acceleration", 1.62)),
        (0.6, lambda: setattr(drag, "enabled", False)),
        (0.61, lambda: setattr(drag, "density", 0.5)),
        (0.7, lambda: setattr(drag, "enabled", True)),
    ]
    for time, act in acts:
        engine.run(time, dt=DT)
        act()
        seen.append(bits(engine))
    engine.run(1.0, dt=DT)
    return [*seen, bits(engine)]


def test_switching_and_setting_gives_the_same_bits_in_every_way_of_running(monkeypatch: pytest.MonkeyPatch) -> None:
    by_arrays = scene("never")
    found = script(by_arrays)
    assert set(by_arrays._world.tiers.values()) == {tiers.NUMPY}
    assert script(scene("always")) == found
    monkeypatch.setattr(tiers, "FEW", 1000)
    one_by_one = scene("never")
    assert script(one_by_one) == found
    assert set(one_by_one._world.tiers.values()) == {tiers.INTERPRETED}


def test_switching_twice_at_a_point_of_the_grid_changes_no_bit() -> None:
    engine, twin = scene(), scene()
    for one in (engine, twin):
        t = switch(one, "drag", 2, 0.0)
        one.run(t + 4 * DT, dt=DT)
    drag = engine.law("drag")
    for _ in range(3):
        drag.enabled = False
        drag.enabled = True
    drag.density, kept = 9.0, drag.density
    drag.density = kept
    for one in (engine, twin):
        one.run(1.0, dt=DT)
    assert bits(engine) == bits(twin)


def test_switching_the_first_time_changes_no_more_than_rounding() -> None:
    engine, twin = scene(), scene()
    for one in (engine, twin):
        one.run(32 * DT, dt=DT)
    engine.law("drag").enabled = False
    engine.law("drag").enabled = True
    for one in (engine, twin):
        one.run(1.0, dt=DT)
    for obj, other in zip(engine.objects, twin.objects, strict=True):
        assert obj.position == pytest.approx(other.position, rel=1e-13, abs=1e-13)
        assert obj.velocity == pytest.approx(other.velocity, rel=1e-13, abs=1e-13)


class Toggle(xp.PhysicalLaw):
    """Switch drag, whenever called."""

    def enforce_this_law(self, event: Any) -> None:
        """Switch it."""
        drag = self.engine.law("drag")
        drag.enabled = not drag.enabled


@pytest.mark.parametrize("period", [16 * DT, 0.1])
def test_a_law_may_switch_another_while_time_passes(period: float) -> None:
    found = []
    for choice in ("never", "always"):
        engine = scene(choice)
        engine.add_law(Toggle(), container=xp.LawContainer(xp.when.Elapsed(period, every=True)))
        engine.run(1.0, dt=DT)
        found.append(bits(engine))
    assert found[0] == found[1]
    plain = scene()
    plain.run(1.0, dt=DT)
    assert bits(plain) != found[0]


# Compiled once


def test_each_combination_is_compiled_once() -> None:
    engine = scene("always")
    engine.run(4 * DT, dt=DT)
    counts = [compiled()]
    t = 4 * DT
    for _ in range(6):
        t = switch(engine, "wind", 1, t)
        engine.run(t + DT, dt=DT)
        counts.append(compiled())
    assert counts[0] >= 1
    assert (
        counts[1] <= counts[0] + 1 and counts[2] <= counts[1] + 1
    )  # off: without it; on: with a number that puts it out
    assert counts[2:] == counts[2:3] * 5
    again = scene("always")
    again.run(4 * DT, dt=DT)
    t = 4 * DT
    for _ in range(4):
        t = switch(again, "wind", 1, t)
        again.run(t + DT, dt=DT)
    assert compiled() == counts[-1]


def test_a_number_that_changes_compiles_nothing() -> None:
    engine = scene("always")
    engine.run(4 * DT, dt=DT)
    before, linked = compiled(), programs(engine)
    drag = engine.law("drag")
    drag.density = 3.0
    engine.run(0.1, dt=DT)
    drag.coefficient = 1.1
    engine.law("wind").velocity = (0.0, 1.0, 2.0)
    engine.object("o1")["drag_area"] = 4.0
    engine.object("o2").mass = 9.0
    engine.law("gravity").acceleration = 3.7
    engine.run(0.3, dt=DT)
    engine.object("o5").velocity = (1.0, 2.0, 3.0)
    engine.run(0.5, dt=DT)
    assert compiled() == before
    assert all(one is other for one, other in zip(programs(engine), linked, strict=True))


def test_another_process_takes_what_this_one_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    engine = scene("always")
    script(engine)
    first = compiled()
    monkeypatch.setattr(kept_kernels, "_compiled", {})  # as in another process
    again = scene("always")
    assert script(again)[-1] == bits(engine)
    assert compiled() == first
    assert {one["origin"] for one in facts() if one["origin"] != "interpreted"} == {"cache"}


@pytest.mark.parametrize("windy", [0, 10, 20], ids=["alone", "with wind on half", "with wind on all"])
def test_a_law_that_was_switched_off_and_on_acts_again_on_everybody(windy: int) -> None:
    """Also on those whose only law it is, and whose motion was in closed form while it was off."""
    engine = xp.PhysicsEngine(compile="never")
    drag = engine.add_law("basic:linear_drag", coefficient=1.0)
    wind = engine.add_law("basic:wind", velocity=(0.0, 0.0, 0.0), density=0.0)
    objects = [xp.PhysicalObject(velocity=(1.0 + k, 0, 0), drag_area=0.1) for k in range(20)]
    for k, obj in enumerate(objects):
        engine.add_object(obj, laws=[drag, *([wind] if k < windy else [])])
    for step in range(6):
        before = [obj.velocity[0] for obj in objects]
        engine.run((step + 1) * 32 * DT, dt=DT)
        slower = [obj.velocity[0] / first for obj, first in zip(objects, before, strict=True)]
        expected = math.exp(-32 * DT) if drag.enabled else 1.0
        assert slower == pytest.approx([expected] * 20, rel=1e-4)
        drag.enabled = not drag.enabled
