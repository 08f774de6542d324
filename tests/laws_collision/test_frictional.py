"""Impacts with friction: closed forms of bounces with spin, momentum, energy, and what is refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import ContactError, ParameterError

RADIUS = 0.1
INERTIA = 0.4  # of m r^2, a solid ball


def bounce(velocity: Any, spin: Any, **law: Any) -> xp.PhysicalObject:
    """Return a ball that fell on a floor, just after."""
    engine = xp.PhysicsEngine(up="z")
    rub = engine.add_law("collision:friction", **law)
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[rub])
    ball = xp.PhysicalObject(xp.Sphere(RADIUS), position=(0, 0, 1), velocity=velocity, angular_velocity=spin, mass=2.0)
    engine.add_object(ball, laws=[rub])
    engine.run(until=0.91 / -velocity[2])
    return ball


def test_a_ball_that_sticks_leaves_rolling() -> None:
    ball = bounce((3.0, 0.0, -5.0), (0.0, 0.0, 0.0), restitution=0.5, friction=1.0)
    rolling = 3.0 / (1.0 + INERTIA)  # Garwin 1969 with no tangential restitution
    assert ball.velocity == pytest.approx((rolling, 0.0, 2.5), abs=1e-14)
    assert ball.angular_velocity == pytest.approx((0.0, rolling / RADIUS, 0.0), abs=1e-13)


def test_a_ball_that_slides_loses_mu_times_the_normal_impulse() -> None:
    ball = bounce((30.0, 0.0, -5.0), (0.0, 0.0, 7.0), restitution=0.8, friction=0.1)
    push = 1.8 * 5.0  # for each kilogram
    assert ball.velocity == pytest.approx((30.0 - 0.1 * push, 0.0, 4.0), rel=1e-14)
    assert ball.angular_velocity == pytest.approx((0.0, 0.1 * push * RADIUS / (INERTIA * RADIUS**2), 7.0), rel=1e-13)


@pytest.mark.parametrize("friction", [0.05, 5.0])
def test_a_ball_with_backspin_comes_back(friction: float) -> None:
    ball = bounce((1.0, 0.0, -4.0), (0.0, -150.0, 0.0), restitution=0.9, friction=friction)
    slip = 1.0 + 150.0 * RADIUS
    stuck = slip / (1.0 + 1.0 / INERTIA)
    lost = min(stuck, friction * 1.9 * 4.0)
    assert ball.velocity[0] == pytest.approx(1.0 - lost, abs=1e-13)
    assert (ball.velocity[0] < 0.0) == (friction > 1.0)
    assert ball.angular_velocity[1] == pytest.approx(-150.0 + lost / (INERTIA * RADIUS), rel=1e-13)


def test_the_tangential_restitution_reverses_the_slip() -> None:
    ball = bounce((2.0, -1.0, -4.0), (3.0, 5.0, 0.0), friction=9.0, tangential=0.6)
    x, y = (ball.velocity[0] - RADIUS * ball.angular_velocity[1], ball.velocity[1] + RADIUS * ball.angular_velocity[0])
    assert (x, y) == pytest.approx((-0.6 * (2.0 - 0.5), -0.6 * (-1.0 + 0.3)), abs=1e-14)


def test_friction_of_nothing_is_the_elastic_law() -> None:
    ball = bounce((2.0, -1.0, -4.0), (3.0, 5.0, 0.0), restitution=0.5, friction=0.0)
    assert ball.velocity == (2.0, -1.0, 2.0) and ball.angular_velocity == (3.0, 5.0, 0.0)


@pytest.mark.parametrize("rule", ["average", "minimum", "maximum", "multiply", "geometric"])
@pytest.mark.parametrize("own", [(None, None), (0.2, None), (0.2, 0.6)])
def test_two_frictions_are_combined_by_the_rule(rule: str, own: tuple[float | None, float | None]) -> None:
    engine = xp.PhysicsEngine(up="z")
    rub = engine.add_law("collision:friction", friction=0.4, combine_friction=rule)
    columns: list[dict[str, float]] = [{} if mu is None else {"friction": mu} for mu in own]
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True, **columns[0]), laws=[rub])
    ball = xp.PhysicalObject(xp.Sphere(RADIUS), position=(0, 0, 1), velocity=(90.0, 0, -1.0), **columns[1])
    engine.add_object(ball, laws=[rub])
    engine.run(until=1.0)
    a, b = (0.4 if mu is None else mu for mu in own)
    mixed = {
        "average": (a + b) / 2, "minimum": min(a, b), "maximum": max(a, b), "multiply": a * b, "geometric": math.sqrt(a * b),
    }[rule]  # fmt: skip
    assert ball.velocity[0] == pytest.approx(90.0 - 2.0 * (0.4 if own == (None, None) else mixed), rel=1e-14)


def two_bodies(seed: int, **law: Any) -> tuple[xp.PhysicsEngine, list[tuple[float, Any, Any]]]:
    """Return an engine with two random bodies that meet, and a list for energy, momentum and angular momentum after their first impact."""
    rng = np.random.default_rng(seed)
    engine = xp.PhysicsEngine()
    rub = engine.add_law("collision:friction", resting="hold", **law)
    after: list[tuple[float, Any, Any]] = []

    class Witness(xp.PhysicalLaw):
        def enforce_this_law(self, event: xp.Event) -> None:
            if not after:
                after.append((engine.energy().kinetic, engine.momentum(), engine.angular_momentum()))
                rub.enabled = witness.enabled = False

    witness = engine.add_law(Witness(), xp.LawContainer(xp.when.Impact()))
    for place, speed in ((0.0, 2.0), (3.0, -1.0)):
        shape = xp.Box(tuple(rng.uniform(0.2, 2.0, 3))) if rng.random() < 0.7 else xp.Sphere(0.6)
        q = rng.normal(size=4)
        body = xp.PhysicalObject(
            shape,
            mass=float(rng.uniform(0.1, 5)),
            position=(place, *rng.normal(size=2) * 0.2),
            velocity=(speed, *rng.normal(size=2) * 0.2),
            orientation=tuple(q / np.linalg.norm(q)),
            angular_velocity=tuple(rng.normal(size=3) * 3),
        )
        engine.add_object(body, laws=[rub, witness])
    return engine, after


@settings(deadline=None, max_examples=25, derandomize=True, phases=[Phase.generate])
@given(
    seed=st.integers(0, 10**6),
    e=st.sampled_from([0.0, 0.3, 1.0]),
    mu=st.sampled_from([0.05, 0.5, 4.0]),
    beta=st.sampled_from([-0.5, 0.0, 1.0]),
)
def test_momenta_are_kept_and_energy_never_rises(seed: int, e: float, mu: float, beta: float) -> None:
    engine, after = two_bodies(seed, restitution=e, friction=mu, tangential=beta)
    before = engine.energy().kinetic, engine.momentum(), engine.angular_momentum()
    engine.run(until=3.0)
    for energy, momentum, angular in after:
        assert energy <= before[0] * (1 + 1e-13)
        assert momentum == pytest.approx(before[1], abs=1e-12)
        assert angular == pytest.approx(before[2], abs=1e-11)
        assert engine.energy().balance == pytest.approx(before[0], rel=1e-12)


def test_kanes_paradox_does_not_arise() -> None:
    """A double pendulum's end, or a rod that slides along the floor at an angle, would gain energy by Newton's law with sliding."""
    for angle in np.linspace(0.05, 1.5, 25):
        engine = xp.PhysicsEngine(up="z")
        rub = engine.add_law("collision:friction", restitution=1.0, friction=0.9)
        engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[rub])
        half = (math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0)
        rod = xp.PhysicalObject(
            xp.Capsule(0.02, 2.0),
            position=(0, 0, 2),
            orientation=half,
            velocity=(-4.0, 0, -1.0),
            angular_velocity=(0, 0.5, 0),
        )
        engine.add_object(rod, laws=[rub])
        before = engine.energy().kinetic
        engine.run(until=2.5)
        assert engine.explain().data["contacts"]["impacts"] >= 1
        assert engine.energy().kinetic <= before * (1 + 1e-13)


def test_a_box_that_lands_flat_and_slides_stays_flat() -> None:
    engine = xp.PhysicsEngine(up="z")
    rub = engine.add_law("collision:friction", restitution=0.5, friction=0.2)
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[rub])
    box = xp.PhysicalObject(xp.Box((1, 1, 0.02)), position=(0, 0, 1), velocity=(9.0, 0, -2.0))
    engine.add_object(box, laws=[rub])
    engine.run(until=0.5)
    assert box.velocity[1] == pytest.approx(0.0, abs=1e-13) and 9.0 - 1.01 * 0.6 < box.velocity[0] < 9.0 - 0.5 * 0.6
    assert box.angular_velocity[0] == pytest.approx(0.0, abs=1e-12) == box.angular_velocity[2]


def test_a_break_that_is_symmetrical_stays_so() -> None:
    engine = xp.PhysicsEngine()
    rub = engine.add_law("collision:friction", restitution=0.9, friction=0.4)
    cue = xp.PhysicalObject(xp.Sphere(0.1), position=(-1, 0, 0), velocity=(3, 0, 0))
    left, right = (xp.PhysicalObject(xp.Sphere(0.1), position=(0, y, 0)) for y in (0.1, -0.1))
    engine.add_objects([cue, left, right], laws=[rub])
    before = engine.energy().kinetic
    engine.run(until=1.0)
    assert left.velocity == pytest.approx((right.velocity[0], -right.velocity[1], 0.0), abs=1e-14)
    assert left.angular_velocity[2] == pytest.approx(-right.angular_velocity[2], abs=1e-13) and left.angular_velocity[2]
    assert cue.angular_velocity == pytest.approx((0, 0, 0), abs=1e-13) and cue.velocity[1] == pytest.approx(
        0.0, abs=1e-15
    )
    assert engine.energy().kinetic < before
    assert engine.momentum() == pytest.approx((3 * cue.mass, 0, 0), abs=1e-14)


def test_many_contacts_at_one_instant_lose_energy_and_keep_momentum() -> None:
    engine = xp.PhysicsEngine()
    rub = engine.add_law("collision:friction", restitution=0.7, friction=0.5)
    rng = np.random.default_rng(3)
    rack = [(math.sqrt(3) * 0.1 * row, 0.2 * k - 0.1 * row, 0.0) for row in range(4) for k in range(row + 1)]
    balls = [
        xp.PhysicalObject(xp.Sphere(0.1), position=place, angular_velocity=tuple(rng.normal(size=3) * 20))
        for place in rack
    ]
    cue = xp.PhysicalObject(xp.Sphere(0.1), position=(-1, 0, 0), velocity=(9, 0, 0), angular_velocity=(0, 0, 50))
    engine.add_objects([cue, *balls], laws=[rub])
    before = engine.energy().kinetic, engine.angular_momentum()
    engine.run(until=1.0)
    assert engine.energy().kinetic < before[0]
    assert engine.energy().balance == pytest.approx(before[0], rel=1e-12)
    assert engine.momentum() == pytest.approx((9 * cue.mass, 0, 0), abs=1e-12)
    assert engine.angular_momentum() == pytest.approx(before[1], abs=1e-12)


def test_a_conveyor_takes_a_ball_along_and_its_work_is_booked() -> None:
    engine = xp.PhysicsEngine(up="z")
    rub = engine.add_law("collision:friction", restitution=0.5, friction=0.2)
    belt = engine.add_object(xp.PhysicalObject(xp.Box((20, 20, 1)), position=(0, 0, -0.5)), laws=[rub])
    ball = xp.PhysicalObject(xp.Sphere(RADIUS), position=(0, 0, 1), velocity=(0, 0, -3.0))
    engine.add_object(ball, laws=[rub])
    belt.drive(velocity=(5.0, 0.0, 0.0))
    before = engine.energy().balance
    engine.run(until=0.4)
    assert ball.velocity == pytest.approx((0.2 * 4.5, 0.0, 1.5), abs=1e-13)
    assert engine.energy().balance == pytest.approx(before, abs=1e-12)


def test_under_gravity_the_bounces_end_and_the_ball_rests() -> None:
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity")
    rub = engine.add_law("collision:friction", restitution=0.5, friction=0.3)
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[rub])
    ball = xp.PhysicalObject(xp.Sphere(RADIUS), position=(0, 0, 1), velocity=(1.0, 0, 0))
    engine.add_object(ball, laws=[gravity, rub])
    start = engine.energy().balance
    engine.run(until=10.0)
    rolling = 1.0 / (1.0 + INERTIA)
    assert ball.velocity == pytest.approx((rolling, 0, 0), abs=1e-12)
    assert ball.angular_velocity == pytest.approx((0, rolling / RADIUS, 0), abs=1e-11)
    assert engine.energy().balance == pytest.approx(start, rel=1e-12)


@pytest.mark.parametrize("container", ["collision:bounding_box", "collision:picking"])
def test_polled_containers_take_it_too(container: str) -> None:
    engine = xp.PhysicsEngine()
    rub = engine.add_law("collision:friction", container=container, friction=0.1)
    one = engine.add_object(
        xp.PhysicalObject(xp.Sphere(0.5), velocity=(3, 0, 0), angular_velocity=(0, 0, 9)), laws=[rub]
    )
    two = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(2, 0, 0)), laws=[rub])
    before = engine.energy().kinetic
    engine.run(until=1.0, dt=0.01)
    assert two.velocity[0] == pytest.approx(3.0) and two.velocity[1] == pytest.approx(0.3)  # 0.1 x the normal impulse
    assert one.angular_velocity[2] < 9.0 and engine.energy().kinetic < before


@pytest.mark.parametrize(
    "bad",
    [{"friction": -0.1}, {"friction": math.inf}, {"tangential": 1.5}, {"restitution": 2}, {"combine_friction": "x"}],
)
def test_numbers_that_no_surface_has_are_refused(bad: dict[str, Any]) -> None:
    with pytest.raises(ParameterError, match=next(iter(bad))):
        xp.PhysicsEngine().add_law("collision:friction", **bad)


def test_a_friction_of_an_object_below_nothing_is_refused() -> None:
    engine = xp.PhysicsEngine()
    rub = engine.add_law("collision:friction")
    with pytest.raises(ParameterError, match="friction"):
        engine.add_object(xp.PhysicalObject(xp.Sphere(1), friction=-1.0), laws=[rub])


def test_a_grip_that_no_surface_has_is_an_error_of_the_law() -> None:
    class Odd(xp.ResponseLaw):
        container = "collision:exact"

        def respond(self, contact: xp.Contact) -> float:
            return 0.0

        def grip(self, contact: xp.Contact) -> xp.Grip:
            return xp.Grip(0.5, -1.0)

    engine = xp.PhysicsEngine()
    odd = engine.add_law(Odd())
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), velocity=(3, 0, 0)), laws=[odd])
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(2, 0, 0)), laws=[odd])
    with pytest.raises(xp.errors.LawFailedError, match="grip gave"):
        engine.run(until=1.0)


def test_two_that_rest_on_each_other_are_still_refused() -> None:
    engine = xp.PhysicsEngine(up="z")
    gravity, rub = engine.add_law("basic:planet_gravity"), engine.add_law("collision:friction", restitution=0.0)
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[rub])
    for z in (0.1, 0.5):
        engine.add_object(xp.PhysicalObject(xp.Sphere(RADIUS), position=(0, 0, z)), laws=[gravity, rub])
    with pytest.raises(ContactError, match="rests on"):
        engine.run(until=1.0)
