"""The ways in which a loop runs give the same bits: interpreted, on NumPy arrays, compiled; in one call or in many."""

from __future__ import annotations

import itertools
import os
import random
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

import xpheve as xp
from xpheve.loop.program import COMPILED, INTERPRETED, NUMPY, Neighbours
from xpheve.plan import loops, tiers

ALL_TIERS = (INTERPRETED, NUMPY, COMPILED)


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """One cache of compiled loops for all tests here, that no other run has filled."""
    home = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XPHEVE_CACHE_DIR", str(home))
        yield home


def in_tier(engine: xp.PhysicsEngine, tier: str, patch: pytest.MonkeyPatch) -> xp.PhysicsEngine:
    """``engine``, all its loops in ``tier``, whatever their size."""
    engine._world.compile = "always" if tier == COMPILED else "never"
    patch.setattr(tiers, "FEW", 10**9 if tier == INTERPRETED else 0)
    return engine


def state(engine: xp.PhysicsEngine) -> dict[str, tuple[Any, ...]]:
    """What can be seen of the motion, by name of the object, to the bit; and the energies."""
    found: dict[str, tuple[Any, ...]] = {
        obj.name: tuple(value.hex() for value in (*obj.position, *obj.velocity)) for obj in engine.objects
    }
    found["energy"] = tuple(value.hex() for value in engine.energy())
    return found


def numbers(engine: xp.PhysicsEngine) -> np.ndarray:
    """Places and velocities, by name of the object."""
    return np.array([[*obj.position, *obj.velocity] for obj in sorted(engine.objects, key=lambda one: one.name)])


# Laws that use what the laws of the shipped packs do not


class Everything(xp.FieldLaw):
    """Every operation that a law can be written with, on numbers of places, velocities, time and masses."""

    id = "tiers:everything"
    length = xp.Constant(1.0, unit="m")
    speed = xp.Constant(1.0, unit="m/s")
    age = xp.Constant(1.0, unit="s")
    scale = xp.Param(0.125, unit="N")
    pull = xp.Param((0.5, -0.25, 1.0), unit="1")
    kind = xp.Param("odd", choices=("odd", "even"))

    def force(self, body: Any) -> Any:
        """A force [N] without any meaning."""
        x, v = body.position / self.length, body.velocity / self.speed
        t = body.time / self.age
        r, w = x.norm(), v.norm()
        bounded = np.sin(x.x) + np.cos(3.0 * x.y) * np.tanh(v.z) + np.arctan2(x.y, x.x) + np.tan(0.3 * np.sin(t))
        logs = np.log(1.0 + r) + np.log1p(w) + np.exp(-r) - np.expm1(-w * w) + np.cbrt(x.z) + np.power(1.0 + r, 0.3)
        trig = (
            np.arcsin(np.tanh(x.x))
            - np.arccos(np.tanh(v.y))
            + np.arctan(v.x)
            + np.sinh(np.tanh(x.y)) / np.cosh(x.z / (1.0 + r))
        )
        odd = (
            np.minimum(x.x, v.y)
            - np.maximum(x.y, -v.x)
            + np.abs(v.z) * np.sign(x.z)
            + np.hypot(x.x, v.y)
            + np.floor(x.y)
        )
        chosen = xp.where((x.x > 0.0) & (v.y <= 1.0) | ~(x.z != v.z), x.x / (1.0 + r), v.y - x.z)
        whole = (1.0 + r) ** -3 + x.z**3 / (1.0 + r**4) + np.sqrt(1.0 + w)
        turn = 1.0 if self.kind == "odd" else -1.0
        swing = xp.vector(bounded + logs, trig - odd, chosen + turn * whole)
        return self.scale * (0.1 * swing / (1.0 + swing.norm()) + 0.01 * body.up + 0.01 * x.cross(self.pull))


class Rough(xp.FieldLaw):
    """Drag that grows with the third power of the speed beyond one, and the square root below; only + - * / and roots."""

    id = "tiers:rough"
    columns: ClassVar[dict[str, Any]] = {"area": xp.Column(1.0, unit="m^2", doc="Any.")}
    strength = xp.Param(0.02, unit="N/m^2")
    speed = xp.Constant(1.0, unit="m/s")

    def force(self, body: Any) -> Any:
        """Drag [N]."""
        w = body.velocity.norm() / self.speed
        size = xp.where(w > 1.0, w * w, np.sqrt(w))
        return -self.strength * body.area * size * (body.velocity / self.speed)


class Gust(xp.FieldLaw):
    """A push that turns on and off by the time since an object came under the law, and drifts with time."""

    id = "tiers:gust"
    push = xp.Param((0.3, 0.2, -0.1), unit="N")
    rate = xp.Param(0.5, unit="1/s")
    begin, end = xp.Constant(0.11, unit="s"), xp.Constant(0.43, unit="s")

    def force(self, body: Any) -> Any:
        """Push [N]."""
        age = body.time - body.since
        return xp.where((age >= self.begin) & (age < self.end), 1.0, 0.0) * (1.0 + self.rate * body.time) * self.push

    def jumps(self, since: float) -> tuple[float, ...]:
        """When it begins and ends."""
        return since + self.begin, since + self.end


class Friction(xp.PairLaw):
    """Friction between near bodies, by the difference of their velocities."""

    id = "tiers:friction"
    cutoff = xp.Param(1.5, unit="m", gt=0)
    rate = xp.Param(0.2, unit="N*s/m")

    def force(self, a: Any, b: Any) -> Any:
        """Force [N] on ``a``."""
        gap = (a.position - b.position).norm() / self.cutoff
        return -self.rate * (1.0 - gap) * (1.0 - gap) * (a.velocity - b.velocity)


class Repulsion(xp.PairLaw):
    """A soft repulsion of near bodies, with a potential."""

    id = "tiers:repulsion"
    cutoff = xp.Param(1.2, unit="m", gt=0)
    strength = xp.Param(2.0, unit="N/m")

    def force(self, a: Any, b: Any) -> Any:
        """Force [N] on ``a``."""
        d = a.position - b.position
        r = d.norm()
        return self.strength * (self.cutoff - r) * d / r

    def potential(self, a: Any, b: Any) -> Any:
        """Energy [J] of a pair."""
        gap = self.cutoff - (a.position - b.position).norm()
        return 0.5 * self.strength * gap * gap


# Scenes: each makes an engine; `order` shuffles the order in which objects are put in

Scene = Callable[[int], xp.PhysicsEngine]


def balls(count: int, seed: int, spread: float = 3.0, **columns: float) -> list[xp.PhysicalObject]:
    chance = random.Random(seed)
    found = []
    for k in range(count):
        place = tuple(chance.uniform(-spread, spread) for _ in range(3))
        speed = tuple(chance.uniform(-2.0, 2.0) for _ in range(3))
        given: Any = {name: value * (1.0 + 0.1 * chance.random()) for name, value in columns.items()}
        found.append(
            xp.PhysicalObject(
                mass=chance.uniform(0.5, 2.0), position=place, velocity=speed, name=f"ball{k:03}", **given
            )
        )
    return found


def put(engine: xp.PhysicsEngine, members: Sequence[tuple[xp.PhysicalObject, list[Any]]], order: int) -> None:
    """Add objects with their laws, in an order of lot number ``order``."""
    mixed = list(members)
    if order:
        random.Random(order).shuffle(mixed)
    for obj, laws in mixed:
        engine.add_object(obj, laws)


def fields(order: int = 0) -> xp.PhysicsEngine:
    """Four sets of laws of one batch each or together: all fields of the basic pack that only need + - * / and roots."""
    engine = xp.PhysicsEngine()
    drag = engine.add_law("basic:quadratic_drag")
    wind = engine.add_law("basic:wind", velocity=(3.0, 1.0, 0.0))
    gale = engine.add_law("basic:wind", velocity=(-3.0, 1.0, 0.5), name="gale")
    linear = engine.add_law("basic:linear_drag", name="linear")
    magnet = engine.add_law("basic:magnetic_field", name="magnet")
    hole = engine.add_law("basic:black_hole_gravity", mass=1e11, name="hole")
    tied = engine.add_law("basic:spring_to_point", name="tied")
    calm = engine.add_law("basic:damper_to_point", name="calm")
    weight = engine.add_law("basic:planet_gravity", name="weight")
    sets = [[weight, drag], [weight, wind, gale], [linear, magnet], [tied, calm, hole, drag], [hole, magnet]]
    members = [(obj, sets[k % 5]) for k, obj in enumerate(balls(40, 3, drag_area=0.05, charge=0.3))]
    put(engine, members, order)
    for k, (obj, _) in enumerate(members):
        if k % 7 == 0:
            obj.add_force((0.1 * k, 0.2, -0.3))
        if k % 11 == 0:
            obj.add_force((0.1 * k, 0.2, -0.3), duration=0.1234)
    return engine


def operations(order: int = 0) -> xp.PhysicsEngine:
    """Every operation; two structures of one class, and two instances of it on one object."""
    engine = xp.PhysicsEngine(up="z")
    odd, even = engine.add_law(Everything, name="odd"), engine.add_law(Everything, kind="even", name="even")
    more = engine.add_law(Everything, scale=0.5, name="more")
    rough, gust = engine.add_law(Rough), engine.add_law(Gust)
    sets = [[odd, rough], [even, rough, gust], [odd, more], [gust], [even]]
    put(engine, [(obj, sets[k % 5]) for k, obj in enumerate(balls(35, 4, area=0.5))], order)
    return engine


def network(order: int = 0) -> xp.PhysicsEngine:
    """Springs and dampers between named pairs, several instances of each, one end of some fixed; wind and user forces."""
    engine = xp.PhysicsEngine()
    objects = balls(36, 5, drag_area=0.05)
    anchor = xp.PhysicalObject(mass=1.0, position=(0.0, 0.0, 4.0), fixed=True, name="anchor")
    pairs = list(itertools.pairwise(objects))
    wind = engine.add_law("basic:wind", velocity=(1.0, 0.5, 0.0))
    put(engine, [(obj, [wind]) for obj in objects] + [(anchor, [])], order)
    engine.add_law("basic:spring", pairs=pairs[:20], stiffness=30.0, rest_length=0.5, name="stiff")
    engine.add_law("basic:spring", pairs=pairs[20:], stiffness=10.0, rest_length=0.2, name="soft")
    engine.add_law("basic:spring", pairs=[(objects[k], anchor) for k in range(0, 36, 5)], name="held")
    engine.add_law("basic:damper", pairs=pairs[10:], damping=0.3, name="damped")
    engine.add_law("basic:damper", between=([objects[0], objects[3]], [objects[20], anchor]), damping=0.1, name="over")
    for obj in objects[::4]:
        obj.add_force((0.1, 0.0, 0.2))
    return engine


def gas(order: int = 0) -> xp.PhysicsEngine:
    """All pairs and near pairs, with and without velocities and potentials; a fixed body acts."""
    engine = xp.PhysicsEngine()

    charge = engine.add_law("basic:coulomb", name="charge")
    friction, repulsion = engine.add_law(Friction), engine.add_law(Repulsion)
    drag = engine.add_law("basic:linear_drag", name="drag")
    sets = [[charge, friction, repulsion], [friction, repulsion, drag], [charge, friction, repulsion, drag]]

    members: list[tuple[xp.PhysicalObject, list[Any]]] = [
        (obj, sets[k % 3]) for k, obj in enumerate(balls(70, 6, 2.0, charge=3e-6))
    ]
    members.append((xp.PhysicalObject(mass=1.0, charge=1e-5, fixed=True, name="post"), [charge, repulsion]))
    put(engine, members, order)
    return engine


def switched(order: int = 0) -> xp.PhysicsEngine:
    """Laws that are put out by a number, of fields and of pairs."""
    engine = xp.PhysicsEngine()
    objects = balls(34, 8, drag_area=0.05)
    drag = engine.add_law("basic:quadratic_drag", name="drag")
    wind = engine.add_law("basic:wind", name="wind")
    put(engine, [(obj, [drag, wind]) for obj in objects], order)
    spring = engine.add_law("basic:spring", pairs=list(itertools.pairwise(objects)), name="spring")
    damper = engine.add_law("basic:damper", pairs=list(itertools.pairwise(objects)), name="damper")
    for law in (drag, wind, spring, damper):  # laws that were switched twice stay in their loops, put out by a number
        law.enabled = False
        law.enabled = True
    for k, law in enumerate((drag, spring, damper, drag, wind, damper)):
        engine.run(until=0.017 * (k + 1), dt=0.01)
        law.enabled = not law.enabled
    return engine


EXACT: list[Scene] = [fields, network, gas, switched]
"""Scenes of + - * / and square roots alone."""
SCENES: list[Scene] = [*EXACT, operations]


def ran(scene: Scene, tier: str, order: int = 0, looks: Sequence[float] = (0.6,), **how: Any) -> xp.PhysicsEngine:
    """``scene`` after runs to each of ``looks``, all its loops in ``tier``."""
    make = xp.PhysicsEngine
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(xp, "PhysicsEngine", lambda **given: in_tier(make(**given), tier, patch))
        engine = scene(order)
        for until in looks:
            engine.run(until=until, dt=0.01, **how)
    assert set(engine._world.tiers.values()) == {tier}
    batches = [batch for batch in engine._world.batches if batch.state.count and batch.sources is not None]
    assert batches and all(batch.sources.program is not None for batch in batches)
    return engine


@pytest.mark.parametrize("scene", SCENES)
def test_interpreted_and_compiled_are_the_same_to_the_bit(scene: Scene) -> None:
    assert state(ran(scene, INTERPRETED)) == state(ran(scene, COMPILED))


@pytest.mark.parametrize("scene", EXACT)
def test_numpy_is_the_same_to_the_bit_where_all_round_alike(scene: Scene) -> None:
    assert state(ran(scene, INTERPRETED)) == state(ran(scene, NUMPY))


def test_numpy_is_near_where_functions_differ_by_an_ulp() -> None:
    one, other = numbers(ran(operations, INTERPRETED)), numbers(ran(operations, NUMPY))
    assert np.abs(one - other).max() < 1e-12


def library(order: int = 0) -> xp.PhysicsEngine:
    """Every law of the basic pack at once, on balls that spin: the pairs among the first of them."""
    import xpheve_laws_basic as basic

    engine = xp.PhysicsEngine()
    kinds = [getattr(basic, name) for name in basic.__all__]
    given: dict[str, dict[str, Any]] = {
        "basic:black_hole_gravity": {"mass": 1e11},
        "basic:buoyancy": {"surface": 0.5},
        "basic:thrust": {"thrust": (0.1, 0.2, -0.1), "delay": 0.1, "duration": 0.3},
        "basic:rotating_frame": {"angular_velocity": (0.1, -0.2, 0.3)},
        "basic:universal_gravity": {"softening": 0.1},
    }
    laws = [engine.add_law(kind, **given.get(kind.id, {})) for kind in kinds]
    chance = random.Random(12)
    objects = []
    for k in range(16):
        place, speed, spin = ([chance.uniform(-3.0, 3.0) for _ in range(3)] for _ in range(3))
        obj = xp.PhysicalObject(
            xp.Sphere(0.1), mass=1.0 + 0.1 * k, position=place, velocity=speed, angular_velocity=spin, name=f"ball{k:02}",
            **({name: 0.01 for name in sorted({name for law in laws for name in law.columns})} | {"charge": 1e-4}),
        )  # fmt: skip
        objects.append((obj, [law for law in laws if k < 6 or isinstance(law, xp.FieldLaw)]))
    put(engine, objects, order)
    return engine


@pytest.mark.slow
def test_all_laws_of_the_pack_together_agree_in_all_tiers() -> None:
    one, other, arrays = (
        ran(library, tier, looks=(0.25, 0.5)) for tier in ALL_TIERS[:1] + ALL_TIERS[2:] + ALL_TIERS[1:2]
    )
    programs = [
        batch.sources.program for batch in other._world.batches if batch.state.count and batch.sources is not None
    ]
    acting = {term.trace.label for program in programs if program is not None for term in program.terms}
    assert {law.id for law in other.laws} - acting == {
        "basic:planet_gravity",
        "basic:electric_field",
    }  # constant: they are stored
    assert state(one) == state(other)
    a, b = numbers(one), numbers(arrays)
    assert np.isfinite(a).all() and np.abs(a - b).max() < 1e-11 * np.abs(a).max()


# What bits do not depend on

EVERY = [NUMPY, COMPILED]


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("tier", EVERY)
def test_a_run_in_parts_has_the_bits_of_one(scene: Scene, tier: str) -> None:
    whole = state(ran(scene, tier))
    assert state(ran(scene, tier, looks=(0.15, 0.155, 0.2, 0.4999, 0.6))) == whole
    assert state(ran(scene, tier, every=0.013)) == whole


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("order", [1, 2])
def test_the_order_in_which_objects_came_changes_no_bit(scene: Scene, order: int) -> None:
    assert state(ran(scene, COMPILED, order)) == state(ran(scene, COMPILED))


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("stride", [1, 7 * 70, 7 * 10_070, 10**15])
def test_how_many_steps_a_call_makes_changes_no_bit(scene: Scene, stride: int, monkeypatch: pytest.MonkeyPatch) -> None:
    expected = state(ran(scene, COMPILED))
    monkeypatch.setattr(loops, "STRIDE", stride)
    for tier in (COMPILED, NUMPY) if scene in EXACT else (COMPILED,):
        assert state(ran(scene, tier)) == expected


def test_room_for_neighbours_changes_no_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    expected = state(ran(gas, COMPILED))
    grow, grown = Neighbours.grow, []

    def small(self: Neighbours, capacity: int) -> None:
        grown.append(capacity)
        grow(self, capacity if len(grown) > 2 else 1)

    monkeypatch.setattr(Neighbours, "grow", small)
    assert state(ran(gas, COMPILED)) == expected
    assert len(grown) > 2


def test_the_skin_of_neighbours_changes_no_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    from xpheve.loop import program

    expected = state(ran(gas, COMPILED))
    for skin in (0.01, 1.0):
        monkeypatch.setattr(program, "SKIN", skin)
        assert state(ran(gas, COMPILED)) == expected


@pytest.mark.parametrize("tier", ALL_TIERS)
def test_another_batch_changes_no_bit(tier: str) -> None:
    def with_others(order: int) -> xp.PhysicsEngine:
        engine = fields(order)
        engine.add_object(xp.PhysicalObject(mass=1.0, velocity=(1.0, 0.0, 0.0), name="free"))
        gust = engine.add_law(Gust)
        engine.add_object(xp.PhysicalObject(mass=1.0, name="blown"), [gust])
        return engine

    alone, company = state(ran(fields, tier)), state(ran(with_others, tier))
    assert {name: company[name] for name in alone if name != "energy"} == {
        name: value for name, value in alone.items() if name != "energy"
    }


def test_a_thread_changes_no_bit() -> None:
    from concurrent.futures import ThreadPoolExecutor

    expected = state(ran(network, COMPILED))
    engines = [network(0) for _ in range(3)]
    for engine in engines:
        engine._world.compile = "always"
    with ThreadPoolExecutor(3) as pool:
        list(pool.map(lambda engine: engine.run(until=0.6, dt=0.01), engines))
    assert [state(engine) for engine in engines] == [expected] * 3


TEXT = """
import sys, importlib.util
spec = importlib.util.spec_from_file_location("tiers_of_another", sys.argv[1])
module = importlib.util.module_from_spec(spec)
sys.modules["tiers_of_another"] = module
spec.loader.exec_module(module)
import hashlib
for scene in [getattr(module, name) for name in sys.argv[2:]]:
    for tier in (module.COMPILED, module.INTERPRETED):
        print(hashlib.sha256(repr(sorted(module.state(module.ran(scene, tier)).items())).encode()).hexdigest())
"""


@pytest.mark.parametrize("cache_is", ["warm", "cold", "read-only"])
def test_another_process_has_the_same_bits_whatever_its_cache_and_hashes(cache_is: str, tmp_path: Path) -> None:
    import hashlib

    scenes: list[Scene] = [network, operations] if cache_is == "warm" else [network]
    expected = []
    for scene in scenes:
        shown = repr(sorted(state(ran(scene, COMPILED)).items())).encode()
        expected += [hashlib.sha256(shown).hexdigest()] * 2
    given = dict(os.environ, PYTHONHASHSEED="3" if cache_is == "warm" else "77")
    if cache_is == "cold":
        given["XPHEVE_CACHE_DIR"] = str(tmp_path)
    if cache_is == "read-only":  # a home in which nobody, not even root, can make a folder
        (tmp_path / "file").write_text("")
        del given["XPHEVE_CACHE_DIR"]
        given |= {name: str(tmp_path / "file" / "home") for name in ("HOME", "USERPROFILE", "LOCALAPPDATA")}
    command = [sys.executable, "-c", TEXT, __file__, *(scene.__name__ for scene in scenes)]
    answer = subprocess.run(command, env=given, capture_output=True, text=True, check=True, timeout=300)
    assert answer.stdout.split() == expected
    assert answer.stderr.count("CompileWarning") == (cache_is == "read-only")


def test_copies_and_restored_engines_go_on_with_the_same_bits() -> None:
    for scene in SCENES:
        expected = state(ran(scene, COMPILED))
        half = ran(scene, COMPILED, looks=(0.2345,))
        kept = half.checkpoint()
        copy = half.copy()
        back = xp.PhysicsEngine.restore(kept, laws=(Everything, Rough, Gust, Friction, Repulsion))
        for other in (half, copy, back):
            other._world.compile = "always"
            other.run(until=0.6, dt=0.01)
            assert state(other) == expected, scene


@pytest.mark.parametrize("tier", ALL_TIERS)
def test_each_law_counts_its_own_time_since_an_object_came_under_it(tier: str, monkeypatch: pytest.MonkeyPatch) -> None:
    engine = in_tier(xp.PhysicsEngine(), tier, monkeypatch)
    laws = [
        engine.add_law("basic:thrust", thrust=tuple(float(c == k) for c in range(3)), duration=0.2, name=f"thrust{k}")
        for k in range(3)
    ]
    obj = engine.add_object(xp.PhysicalObject(mass=1.0), laws[:1])
    for k in (1, 2):
        engine.run(until=0.301 * k, dt=0.01)
        engine.map(obj, laws[k])
    engine.run(until=1.0, dt=0.01)
    assert obj.velocity == pytest.approx((0.2, 0.2, 0.2), abs=1e-14)


class Stiff(xp.PairLaw):
    """A spring whose columns are called as components of a place might be."""

    id = "tiers:stiff"
    columns: ClassVar[dict[str, Any]] = {
        name: xp.Column(2.0, unit="m", doc="Any.") for name in ("position1", "velocity_0")
    }
    stiffness = xp.Param(1.0, unit="N/m^2")

    def force(self, a: Any, b: Any) -> Any:
        """Force [N] on ``a``."""
        return -self.stiffness * (a.position1 + b.velocity_0) * (a.position - b.position)


@pytest.mark.parametrize("tier", ALL_TIERS)
def test_columns_are_not_mistaken_for_components(tier: str, monkeypatch: pytest.MonkeyPatch) -> None:
    engine = in_tier(xp.PhysicsEngine(), tier, monkeypatch)
    law = engine.add_law(Stiff)
    for k in (-1, 1):
        engine.add_object(xp.PhysicalObject(mass=1.0, position=(k, 7.0 * k, 0.0)), [law])
    engine.run(until=1e-3, dt=1e-3)
    assert engine.objects[1].velocity == pytest.approx((-8e-3, -56e-3, 0.0), rel=1e-5)
