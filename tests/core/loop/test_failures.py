"""What fails in the midst of many steps: the engine stands just before, says what failed and where, and can go on."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import LawFailedError, XpheveWarning
from xpheve.loop.program import Program
from xpheve.plan import loops, tiers


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A cache of compiled loops of its own."""
    home = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XPHEVE_CACHE_DIR", str(home))
        yield home


ways = pytest.mark.parametrize(("compile", "count"), [("never", 2), ("never", 40), ("always", 40)])
"""Interpreted, on NumPy arrays, compiled."""


class Fading(xp.FieldLaw):
    """A pull that has no value from a time on."""

    id = "failing:fading"
    end = xp.Param(0.5, unit="s")
    strength = xp.Param(1.0, unit="N/m")
    age = xp.Constant(1.0, unit="s")

    def force(self, body: Any) -> Any:
        """Pull [N]."""
        return -self.strength * np.sqrt((self.end - body.time) / self.age) * body.position


class Burst(xp.FieldLaw):
    """A push outwards that grows with the distance: motion without end."""

    id = "failing:burst"
    strength = xp.Param(100.0, unit="N/m")

    def force(self, body: Any) -> Any:
        """Push [N]."""
        return self.strength * body.position

    def potential(self, body: Any) -> Any:
        """Energy [J]: so that no work is booked, which would leave the range of floats long before the burst does."""
        return -0.5 * self.strength * body.position.dot(body.position)


def scene(law: type[xp.FieldLaw], compile: str, count: int, **options: Any) -> tuple[xp.PhysicsEngine, Any]:
    engine = xp.PhysicsEngine(compile=compile, stepper="core:midpoint", **options)
    made, drag = engine.add_law(law), engine.add_law("basic:linear_drag")
    for k in range(count):
        place = (1.0, 0.1 * k, -1.0) if k == count - 1 or law is not Burst else (0.0, 0.0, 0.0)
        engine.add_object(xp.PhysicalObject(mass=1.0 + 0.1 * k, position=place, name=f"b{k:02}"), [made, drag])
    return engine, made


def state(engine: xp.PhysicsEngine) -> list[Any]:
    return [(obj.position, obj.velocity) for obj in engine.objects] + [engine.energy()]


@ways
def test_a_force_without_value_stops_the_run_just_before_its_step(compile: str, count: int) -> None:
    engine, law = scene(Fading, compile, count)
    with pytest.raises(
        LawFailedError, match=r"failing:fading\.force gave \(.*nan.*\) for .*'b00'.* at t = 0\.50[0-9]* s"
    ) as info:
        engine.run(until=3.0, dt=0.001)
    assert info.value.law is law
    assert engine.time == pytest.approx(0.5, abs=1e-12)
    other, twin = scene(Fading, compile, count)
    for _ in range(500):
        other.step(0.001)
    assert state(other) == state(engine)
    for one, its in ((engine, law), (other, twin)):
        its.end = 9.0
        one.run(until=1.0, dt=0.001)
    assert state(other) == state(engine) and np.isfinite(engine.bodies.position).all()


@ways
def test_a_law_that_fails_is_disabled_if_that_was_asked_for(compile: str, count: int) -> None:
    engine, law = scene(Fading, compile, count, on_law_error="disable")
    with pytest.warns(XpheveWarning, match="failing:fading.*disabled from here on"):
        engine.run(until=1.0, dt=0.001)
    assert not law.enabled and engine.time == 1.0
    other, twin = scene(Fading, compile, count)
    for _ in range(500):
        other.step(0.001)
    twin.enabled = False
    other.run(until=1.0, dt=0.001)
    assert state(other) == state(engine)


@ways
def test_motion_that_leaves_the_range_of_floats_names_the_object_and_leaves_it_finite(compile: str, count: int) -> None:
    engine, _ = scene(Burst, compile, count)
    name = f"b{count - 1:02}"
    with pytest.raises(LawFailedError, match=f"leaves the range of floats in the step from t = [0-9.]+ s on: .*{name}"):
        engine.run(until=1e3, dt=0.1)
    assert 0.0 < engine.time < 1e3
    assert np.isfinite(engine.bodies.position).all() and np.isfinite(engine.bodies.velocity).all()
    assert engine.object(name).position[0] > 1e100
    stood = engine.time
    with pytest.raises(LawFailedError, match=name):
        engine.run(until=1e3, dt=0.1)
    assert engine.time == stood and np.isfinite(engine.bodies.position).all()
    engine.object(name).position = engine.object(name).velocity = (0.0, 0.0, 0.0)
    engine.run(until=stood + 1.0, dt=0.1)
    assert engine.object(name).position == (0.0, 0.0, 0.0)


@ways
def test_the_last_flight_of_a_run_does_not_end_outside_the_range(compile: str, count: int) -> None:
    engine = xp.PhysicsEngine(compile=compile, stepper="core:midpoint")
    drag = engine.add_law("basic:linear_drag", coefficient=0.0)
    for k in range(count):
        speed = (1e308 if k == 1 else 1.0, 0.0, 0.0)
        engine.add_object(xp.PhysicalObject(mass=1.0, velocity=speed, name=f"b{k:02}"), [drag])
    with pytest.raises(LawFailedError, match=r"from t = 1\.[0-9]* s on: .*b01"):
        engine.run(until=1.9, dt=0.1)
    assert math.isfinite(engine.object("b01").position[0])


@ways
def test_an_interrupt_leaves_the_engine_as_it_was_at_some_step(
    compile: str, count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tiers, "cost_of_step", lambda tier, load: loops.STRIDE // 100)
    engine, _ = scene(Fading, compile, count)
    run, calls = Program.run, [0]

    def interrupted(self: Program, *given: Any) -> None:
        run(self, *given)
        calls[0] += 1
        if calls[0] == 3:
            raise KeyboardInterrupt

    monkeypatch.setattr(Program, "run", interrupted)
    with pytest.raises(KeyboardInterrupt):
        engine.run(until=0.4, dt=0.001)
    assert engine.time == pytest.approx(0.2)
    other, _ = scene(Fading, compile, count)
    other.run(until=0.4, dt=0.001)
    engine.run(until=0.4, dt=0.001)
    assert state(other) == state(engine)
