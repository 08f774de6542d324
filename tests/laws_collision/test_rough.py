"""Rough elastic bodies: superballs, against the closed form of Garwin (1969), bounce after bounce."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import ParameterError

RADIUS = 0.1


def superball(velocity: Any, spin: Any, **law: Any) -> tuple[xp.PhysicsEngine, xp.PhysicalObject]:
    """Return a ball between a floor at z = 0 and a ceiling at z = 1."""
    engine = xp.PhysicsEngine(up="z")
    rough = engine.add_law("collision:rough", **law)
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[rough])
    engine.add_object(xp.PhysicalObject(xp.Plane((0, 0, -1), offset=-1.0), fixed=True), laws=[rough])
    ball = xp.PhysicalObject(
        xp.Sphere(RADIUS), position=(0, 0, 0.5), velocity=velocity, angular_velocity=spin, mass=0.3
    )
    return engine, engine.add_object(ball, laws=[rough])


def after(bounces: int, vx: float, spin: float) -> tuple[float, float]:
    """Return velocity along x and spin about y by Garwin's formula: v' = (1 - a) / (1 + a) v + ..., slip reversed, a = I / m r^2."""
    a, down = 0.4, True
    for _ in range(bounces):
        side = 1.0 if down else -1.0  # the contact is below the centre, then above
        slip = vx - side * RADIUS * spin
        push = -2.0 * slip / (1.0 + 1.0 / a)
        vx, spin = vx + push, spin - side * push / (a * RADIUS)
        down = not down
    return vx, spin


@pytest.mark.parametrize(("vx", "spin"), [(1.0, 0.0), (0.7, -31.0), (-2.0, 55.0)])
def test_bounce_after_bounce_is_the_closed_form(vx: float, spin: float) -> None:
    engine, ball = superball((vx, 0.0, -2.0), (0.0, spin, 0.0))
    energy = engine.energy().kinetic
    for bounces in range(1, 40):
        engine.run(until=0.2 + (bounces - 1) * 0.4 + 0.1)
        expected = after(bounces, vx, spin)
        assert ball.velocity[0] == pytest.approx(expected[0], abs=1e-12)
        assert RADIUS * ball.angular_velocity[1] == pytest.approx(RADIUS * expected[1], abs=1e-12)
        assert abs(ball.velocity[2]) == pytest.approx(2.0, rel=1e-15)
    assert engine.energy().kinetic == pytest.approx(energy, rel=1e-13)


def test_thrown_under_a_table_it_comes_back_after_three_bounces() -> None:
    engine, ball = superball((1.0, 0.0, -2.0), (0.0, 0.0, 0.0))
    engine.run(until=1.1)  # floor, table, floor
    assert ball.velocity[0] == pytest.approx(after(3, 1.0, 0.0)[0], abs=1e-14)
    assert ball.velocity[0] < -0.9 and ball.velocity[2] > 0.0  # Garwin: -333/343
    assert ball.velocity[0] == pytest.approx(-333.0 / 343.0, abs=1e-14)


def test_two_bounces_of_the_same_side_undo_each_other() -> None:
    engine = xp.PhysicsEngine(up="z")
    gravity, rough = engine.add_law("basic:planet_gravity", acceleration=10.0), engine.add_law("collision:rough")
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[rough])
    ball = xp.PhysicalObject(xp.Sphere(RADIUS), position=(0, 0, 0.6), velocity=(1, 2, 0), angular_velocity=(3, 40, 5))
    engine.add_object(ball, laws=[gravity, rough])
    engine.run(until=1.2)
    assert ball.velocity[:2] == pytest.approx((1.0, 2.0), abs=1e-13)
    assert ball.angular_velocity == pytest.approx((3, 40, 5), abs=1e-12)


def test_about_the_contact_the_angular_momentum_is_kept() -> None:
    engine, ball = superball((1.0, -0.4, -2.0), (3.0, 8.0, -2.0))
    arm = np.array((0.0, 0.0, RADIUS))

    def about() -> Any:
        spin = 0.4 * RADIUS**2 * np.array(ball.angular_velocity)
        return ball.mass * (np.cross(arm, ball.velocity) + spin)

    before = about()
    engine.run(until=0.3)
    assert np.abs(about() - before).max() < 1e-15


def test_reversed_velocities_and_spins_lead_back() -> None:
    engine, ball = superball((1.0, -0.4, -2.0), (3.0, 8.0, -2.0))
    engine.run(until=4.1)
    ball.velocity = tuple(-v for v in ball.velocity)
    ball.angular_velocity = tuple(-w for w in ball.angular_velocity)
    engine.run(until=8.2)
    assert ball.position == pytest.approx((0, 0, 0.5), abs=1e-12)
    assert ball.velocity == pytest.approx((-1.0, 0.4, 2.0), abs=1e-12)


@pytest.mark.parametrize(("beta", "slips"), [(-1.0, 1.0), (0.0, 0.0), (0.5, -0.5)])
def test_beta_is_the_part_of_the_slip_that_is_reversed(beta: float, slips: float) -> None:
    engine, ball = superball((1.0, 0.0, -2.0), (0.0, 0.0, 0.0), restitution=0.5, beta=beta)
    engine.run(until=0.3)
    assert ball.velocity[0] - RADIUS * ball.angular_velocity[1] == pytest.approx(slips, abs=1e-14)
    assert ball.velocity[2] == 1.0


@settings(deadline=None, max_examples=12, derandomize=True, phases=[Phase.generate])
@given(seed=st.integers(0, 10**6))
def test_two_rough_balls_keep_energy_and_momenta(seed: int) -> None:
    rng = np.random.default_rng(seed)
    engine = xp.PhysicsEngine()
    rough = engine.add_law("collision:rough")
    for x, v in ((0.0, 1.0), (2.0, -1.0)):
        ball = xp.PhysicalObject(
            xp.Sphere(0.4),
            mass=float(rng.uniform(0.1, 5)),
            position=(x, *rng.normal(size=2) * 0.1),
            velocity=(v, *rng.normal(size=2) * 0.1),
            angular_velocity=tuple(rng.normal(size=3) * 5),
        )
        engine.add_object(ball, laws=[rough])
    before = engine.energy().kinetic, engine.momentum(), engine.angular_momentum()
    engine.run(until=2.0)
    assert engine.explain().data["contacts"]["impacts"] == 1
    assert engine.energy().kinetic == pytest.approx(before[0], rel=1e-13)
    assert engine.momentum() == pytest.approx(before[1], abs=1e-13)
    assert engine.angular_momentum() == pytest.approx(before[2], abs=1e-13)


@pytest.mark.parametrize("bad", [{"beta": -1.1}, {"beta": 2.0}, {"restitution": -1}])
def test_numbers_that_no_surface_has_are_refused(bad: dict[str, float]) -> None:
    with pytest.raises(ParameterError, match=next(iter(bad))):
        xp.PhysicsEngine().add_law("collision:rough", **bad)
