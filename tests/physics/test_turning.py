"""Bodies that turn while laws act along the way: order, tiers, closed forms and books."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import LawFailedError
from xpheve.kernels import free_rotation

TOP: Any = (1.0, 2.0, 2.5)
Build = Callable[..., tuple[xp.PhysicsEngine, list[xp.PhysicalObject]]]


class Twist(xp.FieldLaw):
    """A torque that slows the spin, and one that turns the body back."""

    damping = xp.Param(0.2, unit="N*m*s", doc="Of the spin.")
    stiffness = xp.Param(0.3, unit="N*m", doc="Of the first axis against z.")

    def torque(self, body: Any) -> Any:
        """T = -c w + k x cross z [N m], with x the body's first axis."""
        nose = body.to_world(np.array((1.0, 0.0, 0.0)))
        return -self.damping * body.angular_velocity + self.stiffness * nose.cross(np.array((0.0, 0.0, 1.0)))


class Runaway(xp.FieldLaw):
    """A torque that feeds on the spin."""

    feed = xp.Param(1e9, unit="N*m*s", doc="Torque by spin.")

    def torque(self, body: Any) -> Any:
        """T = c w [N m]."""
        return self.feed * body.angular_velocity


def several(laws: Sequence[tuple[Any, dict[str, Any]]], count: int, **more: Any) -> Any:
    """An engine with ``count`` tops under ``laws``."""
    engine = xp.PhysicsEngine(up="z")
    mapped = [engine.add_law(law, **options) for law, options in laws]
    bodies = []
    for k in range(count):
        given = {"mass": 2.0, "inertia": TOP, "position": (1.0, k, 0.0), "velocity": (0.5, 0.1, 0.2)} | more
        omega = (0.2, 3.0 + 0.1 * k, 0.1)
        bodies.append(engine.add_object(xp.PhysicalObject(angular_velocity=omega, **given), laws=mapped))
    return engine, bodies


def turntable(count: int = 1) -> Any:
    """Tops in a frame that turns."""
    return several([("basic:rotating_frame", {"angular_velocity": (0.0, 0.3, 0.9)})], count)


def rockets(count: int = 1) -> Any:
    """Tops with engines."""
    laws = [("basic:thrust", {"thrust": (3.0, 0.0, 1.0)}), ("basic:linear_drag", {"coefficient": 0.1})]
    return several(laws, count)


def balls(count: int = 1) -> Any:
    """Balls with lift and drag."""
    laws = [("basic:planet_gravity", {}), ("basic:magnus", {}), ("basic:quadratic_drag", {})]
    return several(laws, count, inertia=(0.1, 0.1, 0.1), displaced_volume=0.2, drag_area=0.05)


def uneven_balls(count: int = 1) -> Any:
    """Stones with lift: their spin changes while nothing turns them."""
    return several([("basic:magnus", {})], count, displaced_volume=0.5)


def twisted(count: int = 1) -> Any:
    """Tops under a law of their own."""
    return several([(Twist, {})], count)


def pulled_up(count: int = 1) -> Any:
    """Tops under drag and a torque that is stored."""
    engine, bodies = several([("basic:linear_drag", {"coefficient": 0.1})], count)
    for body in bodies:
        body.add_force(xp.Force((0.0, 0.0, 0.0), torque=(0.1, 0.0, 0.3)))
    return engine, bodies


class Spun(xp.PairLaw):
    """A pull that follows the spins of both."""

    strength = xp.Param(0.2, unit="N*s/rad", doc="k.")

    def force(self, a: Any, b: Any) -> Any:
        """F = k (w_a + w_b) [N]."""
        return self.strength * (a.angular_velocity + b.angular_velocity)


def coupled_spins(count: int = 2) -> Any:
    """Tops whose pull on one another follows their spins."""
    return several([(Spun, {})], max(count, 2))


def netted(count: int = 2) -> Any:
    """Tops on a turntable, joined by springs and dampers."""
    engine, bodies = turntable(max(count, 2))
    for law, options in (("basic:spring", {"stiffness": 3.0}), ("basic:damper", {"damping": 0.4})):
        added = engine.add_law(law, **options)
        for body in bodies:
            engine.map(body, added)
    return engine, bodies


def mixed(count: int = 3) -> Any:
    """Objects that springs join: tops under a torque, stones with lift, a free top, and one that does not spin."""
    engine, bodies = several([], max(count, 4), displaced_volume=0.5)
    spring = engine.add_law("basic:spring", stiffness=2.0)
    laws = [engine.add_law(Twist), engine.add_law("basic:magnus"), engine.add_law("basic:linear_drag", coefficient=0.1)]
    for k, body in enumerate(bodies):
        engine.map(body, spring)
        if k % 4 < 3:
            engine.map(body, laws[k % 4])
        else:
            body.angular_velocity = (0.0, 0.0, 0.0)
    return engine, bodies


SCENES: dict[str, Build] = {
    "net": netted,
    "mixed": mixed,
    "frame": turntable,
    "thrust": rockets,
    "lift": balls,
    "uneven": uneven_balls,
    "torque": twisted,
    "stored": pulled_up,
}
every_scene = pytest.mark.parametrize("name", list(SCENES))


def state(bodies: Sequence[xp.PhysicalObject]) -> Any:
    """All numbers of all bodies."""
    return np.array([[*b.position, *b.velocity, *b.orientation, *b.angular_velocity] for b in bodies])


def after(name: str, count: int, until: float, dt: float, wish: str = "never") -> Any:
    engine, bodies = SCENES[name](count)
    engine._world.compile = wish
    engine.run(until=until, dt=dt)
    return state(bodies), set(engine._world.tiers.values())


@every_scene
def test_half_the_step_is_a_quarter_of_the_error(name: str) -> None:
    found = [after(name, 1, 1.0, 1.0 / n)[0] for n in (64, 128, 256, 512)]
    first, second, third = (np.abs(a - b) for a, b in itertools.pairwise(found))
    for part in (slice(0, 3), slice(3, 6), slice(6, 10), slice(10, 13)):
        if first[:, part].max() > 1e-12:
            assert first[:, part].max() / second[:, part].max() == pytest.approx(4.0, rel=0.1)
            assert second[:, part].max() / third[:, part].max() == pytest.approx(4.0, rel=0.1)


@every_scene
@pytest.mark.parametrize(("count", "tier"), [(2, "interpreted"), (20, "numpy")])
def test_all_tiers_give_the_same_bits(name: str, count: int, tier: str) -> None:
    compiled, compiled_tier = after(name, count, 0.5, 1 / 64, "always")
    other, other_tier = after(name, count, 0.5, 1 / 64)
    assert (compiled_tier, other_tier) == ({"compiled"}, {tier})
    assert (compiled == other).all()


@every_scene
def test_looking_between_steps_changes_nothing(name: str) -> None:
    engine, bodies = SCENES[name](2)
    for time in np.linspace(0.013, 0.99, 29).tolist():
        engine.run(until=time, dt=1 / 64)
        state(bodies)
    engine.run(until=1.0, dt=1 / 64)
    assert (state(bodies) == after(name, 2, 1.0, 1 / 64)[0]).all()


@every_scene
def test_a_run_goes_on_from_a_checkpoint_as_it_would_have_gone_on(name: str) -> None:
    engine, bodies = SCENES[name](2)
    engine.run(until=0.3, dt=1 / 64)
    kept = engine.checkpoint()
    engine.run(until=1.0, dt=1 / 64)
    again = xp.PhysicsEngine.restore(kept, laws=[Twist] if name in ("torque", "mixed") else [])
    again.run(until=1.0, dt=1 / 64)
    assert (state(again.objects) == state(bodies)).all()


@pytest.mark.parametrize("dt", [0.5, 0.01, None])
def test_a_free_top_beside_drag_keeps_its_closed_form_whatever_the_step(dt: float | None) -> None:
    engine, (body,) = several([("basic:linear_drag", {"coefficient": 0.3})], 1)
    omega: Any = body.angular_velocity
    for until in (0.7, 3.2, 7.0):
        engine.run(until=until, dt=dt)
        q, spin = free_rotation.turn(free_rotation.prepare((1.0, 0.0, 0.0, 0.0), omega, TOP), until)
        assert np.array(body.orientation) == pytest.approx(np.array(q), abs=1e-12)
        assert np.array(body.angular_velocity) == pytest.approx(np.array(spin), abs=1e-12)


def test_a_push_along_the_way_leaves_the_rotation_of_a_free_top_alone() -> None:
    engine, (body,) = several([("basic:linear_drag", {"coefficient": 0.3})], 1)
    omega: Any = body.angular_velocity
    engine.run(until=1.3, dt=0.1)
    body.velocity = (1.0, 2.0, 3.0)
    engine.run(until=4.0, dt=0.1)
    q, spin = free_rotation.turn(free_rotation.prepare((1.0, 0.0, 0.0, 0.0), omega, TOP), 4.0)
    assert np.array(body.orientation) == pytest.approx(np.array(q), abs=1e-12)
    assert np.array(body.angular_velocity) == pytest.approx(np.array(spin), abs=1e-12)


def test_a_top_that_spins_costs_the_others_no_bit() -> None:
    alone, (quiet,) = several([("basic:linear_drag", {"coefficient": 0.3})], 1)
    both, (same, other) = several([("basic:linear_drag", {"coefficient": 0.3})], 2)
    quiet.angular_velocity = same.angular_velocity = (0.0, 0.0, 0.0)
    other.angular_velocity = (5.0, 4.0, 3.0)
    for engine in (alone, both):
        engine.run(until=2.0, dt=0.05)
    assert quiet.position == same.position
    assert same.orientation == (1.0, 0.0, 0.0, 0.0)


@every_scene
@pytest.mark.parametrize("dt", [1 / 64, 1 / 128])
def test_what_laws_without_potential_do_is_booked(name: str, dt: float) -> None:
    engine, _ = SCENES[name](2)
    before = engine.energy().balance
    engine.run(until=1.0, dt=dt)
    gap = abs(engine.energy().balance - before)
    assert gap < 40.0 * dt * dt
    assert math.isfinite(gap)


def test_the_work_of_a_torque_is_what_rotation_gains() -> None:
    engine, (body,) = several([(Twist, {})], 1, velocity=(0.0, 0.0, 0.0))
    before = engine.energy()
    engine.run(until=3.0, dt=0.01)
    now = engine.energy()
    assert now.work == pytest.approx(now.kinetic - before.kinetic, abs=1e-12)
    assert now.work < -0.5
    assert body.position == (1.0, 0.0, 0.0)


def test_a_spin_that_goes_beyond_all_floats_is_an_error_that_names_the_object() -> None:
    engine, (body,) = several([(Runaway, {})], 1)
    with pytest.raises(LawFailedError, match=body.label):
        engine.run(until=100.0, dt=0.1)


@pytest.mark.parametrize("wish", ["never", "always"])
@pytest.mark.parametrize("count", [2, 20])
def test_a_torque_that_is_put_out_acts_no_more(wish: str, count: int) -> None:
    engine, bodies = several([(Twist, {"stiffness": 0.0})], count)
    engine._world.compile = wish
    (law,) = engine.laws
    for k in range(6):
        law.enabled = k % 2 == 0
        before = engine.angular_momentum()
        engine.run(until=0.25 * (k + 1), dt=1 / 64)
        lost = np.linalg.norm(before) - np.linalg.norm(engine.angular_momentum())
        assert lost > 0.1 if law.enabled else abs(lost) < 1e-11 * np.linalg.norm(before)
    assert np.isfinite(state(bodies)).all()


def test_a_law_between_objects_that_turn_has_order_two_and_leaves_their_rotation_in_closed_form() -> None:
    found = []
    for n in (32, 64, 128, 256):
        engine, bodies = coupled_spins()
        omega: Any = bodies[0].angular_velocity
        engine.run(until=1.0, dt=1.0 / n)
        found.append(state(bodies))
    first, second, third = (np.abs(a - b)[:, :6].max() for a, b in itertools.pairwise(found))
    assert first / second == pytest.approx(4.0, rel=0.1)
    assert second / third == pytest.approx(4.0, rel=0.1)
    q, spin = free_rotation.turn(free_rotation.prepare((1.0, 0.0, 0.0, 0.0), omega, TOP), 1.0)
    assert np.array(bodies[0].orientation) == pytest.approx(np.array(q), abs=1e-12)
    assert np.array(bodies[0].angular_velocity) == pytest.approx(np.array(spin), abs=1e-12)
