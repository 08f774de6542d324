"""Sums over many bodies by tiles are those pair after pair, to rounding; a tree's are within the error that a law allows."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.compile import assemble, compiled, interpreted
from xpheve.errors import LawDefinitionError, ParameterError
from xpheve.kernels.clock import START
from xpheve.laws import PairLaw, Param
from xpheve.loop import long_range
from xpheve.loop.couples import ALL, LISTED, NEAR
from xpheve.loop.long_range import TILES, TREE, how_to_sum, pays
from xpheve.plan.motions import Motion

DRIVER = """
def entry(f, n):
    d = n[2]
    return forces(f, n, 0, d[2], d[3], d[4], 0.25)
"""
STATE = ("position", "velocity", "orientation", "angular_velocity")


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XPHEVE_CACHE_DIR", str(tmp_path_factory.mktemp("cache")))
        yield


class Swarm(PairLaw):
    """Keeps neither energy nor symmetry: what acts on a depends on both masses, on velocities, time and spins, in different ways."""

    strength = Param(0.2, unit="N/m")
    drag = Param(0.1, unit="kg/s")
    rate = Param(2.0, unit="1/s")
    size = Param(1.0, unit="m")

    def force(self, a: Any, b: Any) -> Any:
        d = a.position - b.position
        tug = np.where(a.mass > b.mass, 1.0, 0.3) * np.cos(self.rate * a.time)
        pull = self.strength * tug / (1.0 + d.dot(d) / self.size**2) * d
        return -pull - self.drag * (a.velocity - 0.5 * b.velocity)


class Steered(PairLaw):
    """A force along the attitude of the second body."""

    strength = Param(0.2, unit="N s^2")

    def force(self, a: Any, b: Any) -> Any:
        return self.strength * b.to_world(xp.vector(1.0, 0.0, 0.0)) * a.angular_velocity.dot(b.angular_velocity)


def scene(n: int, *laws: Any, fixed: int = 0, part: int = 1) -> xp.PhysicsEngine:
    """``n`` bodies, of which ``fixed`` stand, under ``laws``; every ``part``-th is under the first of them."""
    rng = np.random.default_rng(n)
    engine = xp.PhysicsEngine(up="z", stepper="core:symplectic2")
    added = [engine.add_law(law) for law in laws]
    for k in range(n):
        stands = k < fixed
        engine.add_object(
            xp.PhysicalObject(
                position=tuple(rng.normal(size=3)),
                velocity=(0, 0, 0) if stands else tuple(rng.normal(size=3)),
                angular_velocity=(0, 0, 0) if stands else tuple(rng.normal(size=3)),
                mass=float(rng.uniform(1.0, 3.0)),
                inertia=(1.0, 2.0, 2.5),
                fixed=stands,
            ),
            laws=added if k % part == 0 else added[1:],
        )
    return engine


def motion_of(engine: xp.PhysicsEngine) -> tuple[Motion, dict[str, Any]]:
    world = engine._world
    world.plan()
    batch = max(world.batches, key=lambda one: one.state.count)
    sources = world.sources(batch)
    assert sources is not None
    sources._motion = None
    return sources.motion, {name: world.bodies.arrays[name][:, batch.state.rows] for name in STATE}


def evaluate(engine: xp.PhysicsEngine, run: Any, how: str) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations and working forces by ``run`` of the text, summed in the way ``how``."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(long_range, "TILES_FROM", 1 if how == TILES else 10**9)
        patch.setattr(long_range, "TREE_FROM", 0)
        patch.setattr(long_range, "LEAST_TREE", 1 if how == TREE else 10**9)
        motion, found = motion_of(engine)
    assert how in motion._hows
    x, v = motion.pack(found, START)
    size, rows = x.size, motion.rows
    s = np.concatenate([x.ravel(), v.ravel(), np.full(size, np.nan), np.full(3 * rows, np.nan)])
    d = np.array([0, 0, size, 2 * size, 3 * size], dtype=np.int64)
    text = assemble(motion.text.text() + DRIVER, {})
    room = np.zeros(long_range.scratch(motion.text.terms))
    floats = [s, motion._parameters(), np.zeros(1), motion._constants(), np.zeros(1), room, *motion._own]
    assert run(text)(floats, [motion._lists[0], motion._lists[1], d, *motion._lists[3:]]) == motion.moving
    return s[2 * size : 3 * size].reshape(-1, rows), s[3 * size :].reshape(3, rows)[:, : motion.moving]


def gravity(**more: Any) -> Any:
    from xpheve_laws_basic import UniversalGravity

    return UniversalGravity(**({"gravitational_constant": 1.0, "softening": 0.1} | more))


@pytest.mark.parametrize("n", [2, 31, 32, 33, 64, 77])
@pytest.mark.parametrize("fixed", [0, 1])
def test_tiles_sum_what_pairs_sum(n: int, fixed: int) -> None:
    engine = scene(n, gravity(), Swarm(), fixed=fixed)
    (a, w), (b, u) = (evaluate(engine, interpreted, how) for how in (ALL, TILES))
    assert np.abs(a - b).max() <= 1e-14 * np.abs(a).max()
    assert np.abs(u - w).max() <= 1e-14 * np.abs(w).max() and np.abs(w).max() > 0.0
    assert not b[:, n - fixed :].any()


def test_tiles_take_the_bodies_of_the_law_only() -> None:
    engine = scene(100, gravity(), Swarm(), part=3)
    (a, _), (b, _) = (evaluate(engine, interpreted, how) for how in (ALL, TILES))
    assert np.abs(a - b).max() <= 1e-14 * np.abs(a).max()


def test_tiles_know_how_bodies_turn() -> None:
    engine = scene(40, Steered())
    (a, _), (b, _) = (evaluate(engine, interpreted, how) for how in (ALL, TILES))
    assert np.abs(a - b).max() <= 1e-14 * np.abs(a).max()
    assert np.abs(a[:3]).max() > 0.0


@pytest.mark.parametrize("laws", [(gravity, Swarm), (Steered,)])
def test_tiles_have_the_same_bits_interpreted_and_compiled(laws: Any) -> None:
    engine = scene(75, *(law() for law in laws), fixed=1 if len(laws) > 1 else 0)
    for one, other in zip(evaluate(engine, interpreted, TILES), evaluate(engine, compiled, TILES), strict=True):
        assert one.tobytes() == other.tobytes()


def test_momentum_is_kept_by_tiles() -> None:
    engine = scene(100, gravity())
    a, _ = evaluate(engine, interpreted, TILES)
    motion, _ = motion_of(engine)
    mass = 1.0 / motion._constants().reshape(-1, motion.rows)[motion.text.slots.first["inverse_mass"]]
    assert np.abs((mass * a).sum(axis=1)).max() <= 1e-13 * np.abs(mass * a).sum()


@pytest.mark.parametrize("error", [1e-2, 1e-4])
def test_a_tree_sums_within_the_error_that_the_law_allows(error: float) -> None:
    engine = scene(600, gravity(error=error, softening=0.01), fixed=2)
    exact, _ = evaluate(engine, compiled, TILES)
    found, _ = evaluate(engine, compiled, TREE)
    off = np.linalg.norm(found - exact, axis=0) / np.maximum(np.linalg.norm(exact, axis=0), 1e-300)
    assert 0.0 < np.percentile(off, 99) < 2.0 * error
    assert not found[:, 598:].any()


def test_a_tree_has_the_same_bits_interpreted_and_compiled() -> None:
    engine = scene(70, gravity(error=1e-2))
    for one, other in zip(evaluate(engine, interpreted, TREE), evaluate(engine, compiled, TREE), strict=True):
        assert one.tobytes() == other.tobytes()


@pytest.mark.parametrize("signs", [(1.0,), (1.0, -1.0)])
def test_a_tree_sums_charges_of_both_signs(signs: tuple[float, ...]) -> None:
    from xpheve_laws_basic import Coulomb

    rng = np.random.default_rng(4)
    engine = xp.PhysicsEngine(up="z", stepper="core:symplectic2")
    law = engine.add_law(Coulomb(coulomb_constant=1.0, softening=0.05, error=1e-3, relative_permittivity=2.0))
    for _ in range(250):
        mass, charge = float(rng.uniform(1.0, 2.0)), float(rng.choice(signs) * rng.uniform(0.0, 2.0))
        body = xp.PhysicalObject(position=tuple(rng.normal(size=3)), mass=mass, charge=charge)
        engine.add_object(body, laws=[law])
    exact, _ = evaluate(engine, interpreted, TILES)
    found, _ = evaluate(engine, interpreted, TREE)
    off = np.linalg.norm(found - exact, axis=0) / np.linalg.norm(exact, axis=0)
    assert 0.0 < np.percentile(off, 99) < 2e-3


def test_a_law_that_is_put_out_by_a_number_acts_by_no_tree() -> None:
    law = gravity(error=1e-2)
    engine = scene(40, law, Swarm())
    law.enabled = False
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(type(engine._world), "is_switched", lambda self, one: one is law)
        out, _ = evaluate(engine, interpreted, TREE)
        law.enabled = True
        acts, _ = evaluate(engine, interpreted, TREE)
    alone, _ = evaluate(scene(40, Swarm(), gravity(enabled=False)), interpreted, TILES)
    assert np.allclose(out, alone, rtol=1e-12, atol=1e-14) and not np.allclose(acts, alone, rtol=1e-3)


def test_ways_to_sum_are_chosen_by_size_and_allowed_error() -> None:
    engine = scene(50, gravity(), gravity(error=1e-3))
    motion, _ = motion_of(engine)
    exact, loose = (one.laws[0] for one in motion.couples)
    term = motion.couples[0].term
    if exact.error:
        exact, loose = loose, exact
    assert how_to_sum(ALL, 10, term, exact) == ALL
    assert how_to_sum(ALL, 100, term, exact) == how_to_sum(ALL, 10**6, term, exact) == TILES
    assert how_to_sum(ALL, 3000, term, loose) == TILES and how_to_sum(ALL, 10**5, term, loose) == TREE
    assert how_to_sum(LISTED, 10**5, term, loose) == LISTED and how_to_sum(NEAR, 10**5, term, loose) == NEAR
    assert pays(20_000, 1e-4) and not pays(20_000, 1e-6) and not pays(10**9, 0.0) and not pays(1999, 0.1)


def test_a_law_that_falls_otherwise_is_never_summed_by_a_tree() -> None:
    swarm = Swarm()
    swarm.error = 1e-3
    motion, _ = motion_of(scene(50, swarm))
    assert how_to_sum(ALL, 10**5, motion.couples[0].term, swarm) == TILES


def test_a_tree_is_for_steps_of_given_length_only() -> None:
    motion, _ = motion_of(scene(50, gravity(error=1e-3)))
    term, law = motion.couples[0].term, motion.couples[0].laws[0]
    assert how_to_sum(ALL, 10**5, term, law, steady=False) == TILES
    assert "steps follow from their errors" in long_range.why_no_tree(10**5, term, law, False)
    assert long_range.why_no_tree(100, term, law, True) == "a tree would be slower"
    assert long_range.why_no_tree(10**5, term, law, True) == ""
    engine = xp.PhysicsEngine(up="z", stepper="core:implicit")
    law = engine.add_law(gravity(error=1e-3))
    engine.add_objects([xp.PhysicalObject(position=(k, 0, 0), mass=1.0) for k in range(70)], laws=[law])
    motion, _ = motion_of(engine)
    assert motion._hows == [TILES] and "which a tree's error would spoil" in motion.sums()[law]


def test_a_motion_fits_as_long_as_the_way_to_sum_does() -> None:
    law = gravity()
    engine = scene(70, law)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(long_range, "TREE_FROM", 0)
        patch.setattr(long_range, "LEAST_TREE", 1)
        motion, _ = motion_of(engine)
        assert motion._hows == [TILES] and motion.fits()
        law.set_parameter("softening", 0.2)
        assert motion.fits()
        law.set_parameter("error", 1e-3)
        assert not motion.fits()


def test_what_is_told_of_a_sum_names_the_error_that_was_measured() -> None:
    engine = scene(300, gravity(error=1e-2))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(long_range, "TREE_FROM", 0)
        patch.setattr(long_range, "LEAST_TREE", 1)
        motion, _ = motion_of(engine)
    ((law, words),) = motion.sums().items()
    assert "300 bodies by a tree" in words and "0.01 allowed" in words and "not run yet" in words
    motion._own[0][-2:] = 0.0031, 2.0
    assert "0.0031" in motion.sums()[law] and "2 walks" in motion.sums()[law]


@pytest.mark.parametrize("wrong", [-1e-3, 0.2, float("nan"), "some", None, True])
def test_an_error_that_is_none_is_refused(wrong: Any) -> None:
    law = Swarm()
    law.error = wrong
    with pytest.raises(LawDefinitionError, match=r"from 0, for exact sums, to 0\.1"):
        law.allowed_error()


def test_an_error_of_the_laws_of_the_pack_is_checked_when_given() -> None:
    with pytest.raises(ParameterError, match="error"):
        gravity(error=0.2)
    assert gravity().allowed_error() == 0.0 and gravity(error=1e-3).allowed_error() == 1e-3
