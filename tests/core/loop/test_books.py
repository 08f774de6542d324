"""Energy, momentum and angular momentum of loops: the books balance at any look, whatever happens between."""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import xpheve as xp


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A cache of compiled loops of its own."""
    home = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XPHEVE_CACHE_DIR", str(home))
        yield home


class Pull(xp.FieldLaw):
    """A spring to the origin, without a potential: all its work is booked."""

    id = "books:pull"
    stiffness = xp.Param(3.0, unit="N/m")

    def force(self, body: Any) -> Any:
        """Pull [N]."""
        return -self.stiffness * body.position


class Gust(xp.FieldLaw):
    """A push that grows with time."""

    id = "books:gust"
    push = xp.Param((0.3, 0.2, -0.1), unit="N/s")

    def force(self, body: Any) -> Any:
        """Push [N]."""
        return np.multiply(body.time, self.push)


def windy(count: int = 6, **options: Any) -> tuple[xp.PhysicsEngine, dict[str, xp.PhysicalLaw]]:
    """Bodies of four kinds of laws."""
    engine = xp.PhysicsEngine(**options)
    laws = {
        "weight": engine.add_law("basic:planet_gravity"),
        "drag": engine.add_law("basic:quadratic_drag"),
        "wind": engine.add_law("basic:wind", velocity=(4.0, -1.0, 0.0)),
        "tied": engine.add_law("basic:spring_to_point", stiffness=2.0),
        "pull": engine.add_law(Pull),
        "gust": engine.add_law(Gust),
        "thrust": engine.add_law("basic:thrust", thrust=(0.0, 0.0, 5.0), duration=0.333),
    }
    sets = [["weight", "drag"], ["weight", "wind", "tied"], ["pull", "gust"], ["tied", "thrust"]]
    chance = random.Random(3)
    for k in range(count):
        place = tuple(chance.uniform(-2.0, 2.0) for _ in range(3))
        speed = tuple(chance.uniform(-2.0, 2.0) for _ in range(3))
        obj = xp.PhysicalObject(
            mass=1.0 + 0.1 * k, position=place, velocity=speed, drag_area=0.05, name=f"b{k}", shape=xp.Sphere(0.1)
        )
        engine.add_object(obj, [laws[name] for name in sets[k % 4]])
    return engine, laws


def exact(compile: str) -> xp.PhysicsEngine:
    """Forces without potentials alone, whose work is force times way: there the books are exact for any step."""
    engine = xp.PhysicsEngine(compile=compile)
    drag, wind = engine.add_law("basic:quadratic_drag"), engine.add_law("basic:wind")
    gust, pull = engine.add_law(Gust), engine.add_law(Pull)
    chance = random.Random(4)
    for k in range(5):
        place, speed = (tuple(chance.uniform(-2.0, 2.0) for _ in range(3)) for _ in range(2))
        obj = xp.PhysicalObject(mass=1.0 + k, position=place, velocity=speed, drag_area=0.1, name=f"b{k}")
        engine.add_object(obj, [[drag, pull], [wind], [gust, pull], [pull], [drag, wind, pull]][k])
        if k > 2:
            obj.add_force((0.1, -0.2, 0.3))
    return engine


@pytest.mark.parametrize("compile", ["never", "always"])
def test_the_books_of_work_are_exact_over_many_steps_and_at_any_look(compile: str) -> None:
    engine = exact(compile)
    before = engine.energy().balance
    steps = 100_000 if compile == "always" else 300
    dt = 1e-3
    size = 0.0
    for until in (dt * 0.3, dt * 17.77, 0.1 * steps * dt, 0.777777 * steps * dt, steps * dt):
        engine.run(until=until, dt=dt)
        energy = engine.energy()
        size = max(size, energy.kinetic, abs(energy.work))
        assert abs(energy.balance - before) < 2e-15 * max(size, 1.0) * max(1.0, (until / dt) ** 0.5 * 0.2), until


@pytest.mark.parametrize("compile", ["never", "always"])
def test_events_in_mid_step_keep_the_books(compile: str) -> None:
    engine = exact(compile)
    objects = {obj.name: obj for obj in engine.objects}
    laws = {law.id: law for law in engine.laws}
    engine.run(until=0.1, dt=0.01)

    def same(act: Any) -> None:
        """``act`` in mid-step changes neither books nor what they hold."""
        nonlocal t
        t += 0.0173
        engine.run(until=t, dt=0.01)
        before = engine.energy()
        act()
        after = engine.energy()
        assert after.balance == pytest.approx(before.balance, abs=2e-14)
        engine.run(until=t + 0.0031, dt=0.01)
        assert engine.energy().balance == pytest.approx(after.balance, abs=2e-14), act

    t = 0.1
    same(lambda: setattr(laws["books:pull"], "stiffness", 7.0))
    same(lambda: setattr(laws["basic:wind"], "velocity", (-5.0, 0.0, 1.0)))
    same(lambda: setattr(laws["basic:quadratic_drag"], "enabled", False))
    same(lambda: setattr(laws["basic:quadratic_drag"], "enabled", True))
    same(lambda: setattr(laws["basic:quadratic_drag"], "enabled", False))
    same(lambda: setattr(laws["basic:quadratic_drag"], "enabled", True))
    same(lambda: objects["b1"].add_force((1.0, 2.0, 3.0), duration=0.0017))
    same(lambda: objects["b2"].add_force((1.0, 2.0, 3.0), duration=0.1))
    same(lambda: engine.unmap(objects["b3"], laws["books:pull"]))
    same(lambda: engine.map(objects["b3"], laws["books:pull"]))
    same(lambda: engine.map(objects["b3"], laws["books:gust"]))
    same(lambda: objects["b4"].__setitem__("drag_area", 0.3))
    same(lambda: objects["b1"].__setattr__("mass", objects["b1"].mass))


@pytest.mark.parametrize("compile", ["never", "always"])
def test_a_velocity_that_is_set_is_what_it_says_and_the_books_go_on(compile: str) -> None:
    engine = exact(compile)
    obj = engine.object("b0")
    engine.run(until=0.1234, dt=0.01)
    before, speed = engine.energy(), obj.velocity
    obj.velocity = (3.0, 0.1, 0.2)
    after = engine.energy()
    gained = 0.5 * obj.mass * (sum(v * v for v in (3.0, 0.1, 0.2)) - sum(v * v for v in speed))
    assert obj.velocity == (3.0, 0.1, 0.2)
    assert after.kinetic - before.kinetic == pytest.approx(gained, abs=1e-13)
    engine.run(until=1.0, dt=0.01)
    assert engine.energy().balance == pytest.approx(after.balance, abs=2e-13)


@pytest.mark.parametrize("compile", ["never", "always"])
def test_objects_that_come_and_go_take_their_share_only(compile: str) -> None:
    engine = exact(compile)
    pull, drag = engine.law("books:pull"), engine.law("basic:quadratic_drag")
    engine.run(until=0.1234, dt=0.01)
    before = engine.energy().balance
    fresh = xp.PhysicalObject(mass=2.0, position=(1.0, 0.0, 0.0), velocity=(0.0, 3.0, 0.0), drag_area=0.1, name="new")
    engine.add_object(fresh, [pull, drag])
    with_it = engine.energy().balance
    assert with_it - before == pytest.approx(0.5 * 2.0 * 9.0, abs=1e-13)
    engine.run(until=0.4567, dt=0.01)
    assert engine.energy().balance == pytest.approx(with_it, abs=1e-13)
    kinetic = 0.5 * fresh.mass * sum(v * v for v in fresh.velocity)
    balance, books = engine.energy().balance, engine.energy().work
    engine.remove_object(fresh)
    after = engine.energy()
    assert after.work == pytest.approx(books, abs=1e-13)
    assert after.balance == pytest.approx(balance - kinetic, abs=1e-13)
    engine.run(until=1.0, dt=0.01)
    assert engine.energy().balance == pytest.approx(after.balance, abs=2e-13)


@pytest.mark.parametrize("compile", ["never", "always"])
def test_potentials_and_work_close_to_second_order_with_all_kinds_of_laws(compile: str) -> None:
    drifts = []
    for dt in (0.01, 0.005):
        engine, _ = windy(8, compile=compile)
        before = engine.energy().balance
        engine.run(until=0.51, dt=dt)
        drifts.append(abs(engine.energy().balance - before))
    assert drifts[0] < 1e-2 and drifts[1] < 0.3 * drifts[0]


@pytest.mark.parametrize("compile", ["never", "always"])
def test_a_body_driven_and_released_keeps_the_books(compile: str) -> None:
    engine = exact(compile)
    obj = engine.object("b0")
    engine.run(until=0.1234, dt=0.01)
    engine.hold(obj)
    held = engine.energy().balance
    engine.run(until=0.2345, dt=0.01)
    assert engine.energy().balance == pytest.approx(held, abs=1e-13)
    engine.release(obj, velocity=(1.0, 0.0, 0.0))
    released = engine.energy().balance
    engine.run(until=0.5, dt=0.01)
    assert engine.energy().balance == pytest.approx(released, abs=1e-13)


@pytest.mark.parametrize("compile", ["never", "always"])
def test_pairs_keep_momentum_and_angular_momentum(compile: str) -> None:
    engine = xp.PhysicsEngine(compile=compile)
    chance = random.Random(1)
    objects = []
    for k in range(6):
        place, speed = (tuple(chance.uniform(-2.0, 2.0) for _ in range(3)) for _ in range(2))
        objects.append(
            engine.add_object(
                xp.PhysicalObject(mass=1.0 + k, position=place, velocity=speed, charge=1e-6, name=f"b{k}")
            )
        )
    engine.add_law("basic:spring", pairs=list(itertools.pairwise(objects)), stiffness=5.0)
    engine.add_law("basic:damper", pairs=list(itertools.combinations(objects, 2))[::2], damping=0.05)
    coulomb = engine.add_law("basic:coulomb")
    for obj in objects:
        engine.map(obj, coulomb)
    p, spin = engine.momentum(), engine.angular_momentum()
    steps = 10_000 if compile == "always" else 500
    engine.run(until=steps * 1e-3, dt=1e-3)
    size = sum(obj.mass for obj in objects) * 10.0
    assert max(abs(a - b) for a, b in zip(engine.momentum(), p, strict=True)) < 1e-13 * size
    assert max(abs(a - b) for a, b in zip(engine.angular_momentum(), spin, strict=True)) < 1e-13 * size
