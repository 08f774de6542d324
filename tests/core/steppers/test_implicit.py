"""The implicit stepper: stiff forces to tolerances, at long steps and through events; what it refuses, and how it gives up."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import NoStepperError
from xpheve.laws import FieldLaw, PairLaw, Param

ID = "core:implicit"


class VanDerPol(FieldLaw):
    """x'' = mu (1 - x^2) x' - x for a mass of 1 kg; van der Pol, Phil. Mag. 2 (1926) 978."""

    damping = Param(1e4, unit="kg/s")
    stiffness = Param(1.0, unit="N/m")
    length = Param(1.0, unit="m")

    def force(self, body: Any) -> Any:
        u = body.position / self.length
        return self.damping * (1.0 - u.dot(u)) * body.velocity - self.stiffness * body.position


class Robertson(FieldLaw):
    """Robertson's reaction (Numerical Analysis, 1966, 178), with the components of the velocity for concentrations."""

    slow = Param(0.04, unit="kg/s")
    fast = Param(3e7, unit="kg/m")
    back = Param(1e4, unit="kg/m")

    def force(self, body: Any) -> Any:
        v = body.velocity
        first = self.slow * v.x - self.back * v.y * v.z
        second = self.fast * v.y * v.y
        return xp.vector(-first, first - second, second)


class Honey(FieldLaw):
    """A spring in honey: all the stiffness that one may wish for."""

    stiffness = Param(1e12, unit="N/m")
    damping = Param(1e9, unit="kg/s")

    def force(self, body: Any) -> Any:
        return -self.stiffness * body.position - self.damping * body.velocity


class Strut(PairLaw):
    """A damper between two that gets stronger the nearer they are."""

    damping = Param(1e5, unit="kg m/s")
    stiffness = Param(10.0, unit="N/m")

    def force(self, a: Any, b: Any) -> Any:
        d = a.position - b.position
        return -self.damping / d.norm() * (a.velocity - b.velocity) - self.stiffness * d


def scene(
    *laws: Any, bodies: Any = (((2.0, 0.0, 0.0), (0.0, 0.0, 0.0)),), compile: str = "never", stepper: str = ID
) -> xp.PhysicsEngine:
    engine = xp.PhysicsEngine(up="z", compile=compile)
    engine.stepper = stepper
    known = [engine.add_law(law) for law in laws]
    for position, velocity in bodies:
        engine.add_object(xp.PhysicalObject(position=position, velocity=velocity), laws=known)
    return engine


def van_der_pol(until: float, rtol: float, mu: float = 1e4, **more: Any) -> xp.PhysicsEngine:
    engine = scene(VanDerPol(damping=mu), **more)
    engine.run(until=until, rtol=rtol, atol=1e-3 * rtol)
    return engine


def numbers_of(engine: xp.PhysicsEngine) -> dict[str, float]:
    return next(b for b in engine._world.batches if b.state.count and b.stepper.id == ID).state.numbers


def state_of(engine: xp.PhysicsEngine) -> bytes:
    return engine.bodies.position.tobytes() + engine.bodies.velocity.tobytes()


# Accuracy


@pytest.mark.parametrize(("rtol", "error"), [(1e-3, 1e-4), (1e-6, 1e-7), (1e-9, 1e-10)])
def test_van_der_pol_keeps_its_tolerance_over_a_whole_swing(rtol: float, error: float) -> None:
    engine = van_der_pol(2e4, rtol)
    assert engine.bodies.position[0, 0] == pytest.approx(SWING[0], rel=error)
    assert engine.bodies.velocity[0, 0] == pytest.approx(SWING[1], rel=100 * error)
    assert numbers_of(engine)["steps"] < 500  # an explicit method needs some 2e8


@pytest.mark.parametrize(("rtol", "error"), [(1e-3, 1e-5), (1e-6, 1e-7), (1e-10, 1e-11)])
def test_robertsons_reaction_keeps_its_tolerance(rtol: float, error: float) -> None:
    engine = scene(Robertson(), bodies=[((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))])
    engine.run(until=1e4, rtol=rtol, atol=1e-3 * rtol)
    np.testing.assert_allclose(engine.bodies.velocity[0], REACTION, atol=error)
    assert engine.bodies.velocity[0, 1] == pytest.approx(REACTION[1], rel=100 * error)
    assert engine.bodies.velocity[0].sum() == pytest.approx(1.0, abs=1e-14)  # linear invariants are kept


def test_a_stiff_strut_keeps_momentum_and_its_books() -> None:
    engine = scene(Strut(), bodies=[((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), ((1.0, 0.5, 0.0), (0.0, 1.0, 0.0))])
    engine.run(until=100.0, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(engine.bodies.velocity.sum(axis=0), (0.0, 1.0, 0.0), atol=1e-12)
    energy = engine.energy()
    potential = 5.0 * float(np.sum((engine.bodies.position[0] - engine.bodies.position[1]) ** 2))
    before = 0.5 + 5.0 * 1.25
    kinetic = 0.5 * float(np.sum(engine.bodies.velocity**2))
    assert energy.work == pytest.approx(kinetic - 0.5, abs=1e-6)
    assert kinetic + potential < before


def test_overdamped_motion_goes_to_rest_in_long_steps() -> None:
    # R(z) of Radau IIA is about 3 / z for large z: L-stable (Hairer, Wanner, Solving ODEs II, IV.5). Here z = -1e6 dt.
    engine = scene(Honey(damping=2e6))
    engine.run(until=10.0, dt=10.0)
    assert numbers_of(engine)["steps"] == 1
    assert abs(engine.bodies.position[0, 0]) < 2.0 * 10.0 / 1e7
    engine.run(until=60.0, dt=10.0)
    assert abs(engine.bodies.position[0, 0]) < 1e-20 and abs(engine.bodies.velocity[0, 0]) < 1e-15


def test_what_creeps_in_honey_creeps_at_the_right_pace() -> None:
    engine = scene(Honey())
    engine.run(until=2e-3, rtol=1e-8, atol=1e-12)
    assert engine.bodies.position[0, 0] == pytest.approx(
        2.0 * math.exp(-2.0), rel=2e-6
    )  # k / c = 1000 / s, but for k / c^2
    assert numbers_of(engine)["steps"] < 100


def test_fixed_steps_have_order_five() -> None:
    def run(dt: float) -> float:
        engine = scene(VanDerPol(damping=1.0))
        engine.run(until=2.0, dt=dt)
        return float(engine.bodies.position[0, 0])

    exact = van_der_pol(2.0, 1e-13, mu=1.0).bodies.position[0, 0]
    errors = [abs(run(dt) - exact) for dt in (0.2, 0.1, 0.05)]
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert (orders > 4.5).all() and orders[-1] < 6.5


# Bits


def test_where_somebody_looks_changes_no_bit() -> None:
    once = van_der_pol(50.0, 1e-6, mu=10.0)
    often = scene(VanDerPol(damping=10.0))
    for t in np.linspace(0.7, 50.0, 37):
        often.run(until=float(t), rtol=1e-6, atol=1e-9)
    assert state_of(once) == state_of(often) and once.energy() == often.energy()


def test_interpreted_and_compiled_steps_have_the_same_bits() -> None:
    bodies = [
        ((2.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        ((1.0, 0.5, 0.3), (0.0, 1.0, 0.0)),
        ((0.0, 1.0, 0.0), (0.3, 0.0, 0.0)),
    ]
    found = []
    for how in ("never", "always"):
        engine = scene(VanDerPol(damping=30.0), Strut(), bodies=bodies, compile=how)
        engine.run(until=5.0, rtol=1e-8, atol=1e-11)
        found.append((state_of(engine), engine.energy(), numbers_of(engine)))
    assert found[0] == found[1]


def test_a_restored_run_goes_on_to_the_bit() -> None:
    engine = van_der_pol(13.0, 1e-6, mu=10.0)
    twin = xp.PhysicsEngine.restore(engine.checkpoint(), laws=[VanDerPol])
    assert twin.energy() == engine.energy()
    for one in (engine, twin):
        one.run(until=40.0, rtol=1e-6, atol=1e-9)
    assert state_of(engine) == state_of(twin) and twin.energy() == engine.energy()


# Events


def test_a_kick_in_the_midst_of_a_step_starts_from_where_the_body_is() -> None:
    engine = van_der_pol(17.3, 1e-9, mu=10.0)
    fresh = scene(
        VanDerPol(damping=10.0),
        bodies=[(tuple(engine.bodies.position[0]), tuple(engine.bodies.velocity[0] + np.array((0.0, 0.4, 0.0))))],
    )
    (obj,) = engine.objects
    obj.velocity = tuple(engine.bodies.velocity[0] + np.array((0.0, 0.4, 0.0)))
    engine.run(until=30.0, rtol=1e-9, atol=1e-12)
    fresh.run(until=12.7, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(engine.bodies.position, fresh.bodies.position, rtol=1e-7, atol=1e-7)
    energy = engine.energy()
    assert energy.kinetic - energy.work == pytest.approx(0.5 * 0.4**2, abs=1e-6)  # what the kick gave is nobody's work


def test_a_kicked_body_leaves_the_steps_of_others_alone() -> None:
    bodies = [((2.0, 0.0, 0.0), (0.0, 0.0, 0.0)), ((1.9, 0.0, 0.0), (0.0, 0.0, 0.0))]
    engine, alone = scene(VanDerPol(), bodies=bodies), scene(VanDerPol(), bodies=bodies[1:])
    engine.run(until=1234.5, rtol=1e-7, atol=1e-10)
    before = numbers_of(engine)["base"]
    engine.objects[0].velocity = (0.0, 1e-3, 0.0)
    engine.run(until=1234.6, rtol=1e-7, atol=1e-10)
    batches = [one for one in engine._world.batches if one.state.count]
    assert len(batches) == 2
    assert max(one.state.numbers["base"] for one in batches) >= before > 1234.5  # the other's step was not cut
    for one in (engine, alone):
        one.run(until=5000.0, rtol=1e-7, atol=1e-10)
    assert engine.bodies.position[1, 0] == pytest.approx(alone.bodies.position[0, 0], rel=1e-6)


def test_separate_groups_have_matrices_of_their_own() -> None:
    bodies = [((2.0 + 1e-3 * k, 0.0, 0.0), (0.0, 0.0, 0.0)) for k in range(40)]
    engine = scene(VanDerPol(damping=1000.0), bodies=bodies)
    engine.run(until=10.0, rtol=1e-6, atol=1e-9)
    batch = next(one for one in engine._world.batches if one.state.count)
    assert batch.state.count == 40
    held = engine._world.sources(batch).motion.buffers["implicit"]  # type: ignore[union-attr]
    assert int(held.d[11]) == 40 and int(held.d[21]) == 40 * 9  # blocks, and the numbers of a matrix of each


# Choice, refusals, failure


def test_it_is_chosen_for_stiff_forces_and_tolerances_only() -> None:
    for law, stiff in ((VanDerPol(), True), (VanDerPol(damping=1.0), False)):
        engine = scene(law, stepper="")
        engine.run(until=0.01, rtol=1e-6, atol=1e-9)
        (batch,) = [one for one in engine._world.batches if one.state.count]
        assert (batch.stepper.id == ID) == stiff
        assert stiff or batch.choice.refusals[ID] == "the forces are not stiff"
    engine = scene(VanDerPol(), stepper="")
    engine.run(until=1e-5, dt=1e-5)
    (batch,) = [one for one in engine._world.batches if one.state.count]
    assert batch.choice.refusals[ID].startswith("steps of a given length")


class Vane(FieldLaw):
    """Turns with the body."""

    strength = Param(1.0, unit="N")

    def force(self, body: Any) -> Any:
        return body.to_world(xp.vector(1.0, 0.0, 0.0)) * self.strength


def test_rotation_is_refused_by_name() -> None:
    engine = scene(Vane())
    engine.run(until=0.1, rtol=1e-6, atol=1e-9)
    (batch,) = [one for one in engine._world.batches if one.state.count]
    assert "carries no rotation" in batch.choice.refusals[ID]


class Runaway(FieldLaw):
    """v' = v^2: infinite after a second."""

    strength = Param(1.0, unit="kg/m")

    def force(self, body: Any) -> Any:
        return self.strength * body.velocity.norm() * body.velocity


def test_motion_that_ends_stops_with_an_error_that_names_the_object() -> None:
    engine = scene(Runaway(), bodies=[((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))])
    with pytest.raises(
        NoStepperError, match=r"core:implicit cannot keep rtol=1e-06, atol=1e-09 at t = (0.9999|1.0000)"
    ):
        engine.run(until=2.0, rtol=1e-6, atol=1e-9)
    assert engine.time == pytest.approx(1.0, abs=1e-6)


SWING = (1.705575181181707, -8.934452884311261e-05)
REACTION = (0.10730042853780404, 4.8001669725716497e-07, 0.8926990914454987)
"""Both by `make_stiff_reference.py`."""
