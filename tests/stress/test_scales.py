"""Bounces without end, and masses, radii and speeds of every size."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xpheve as xp

pytestmark = pytest.mark.stress


def court(**ball: Any) -> tuple[xp.PhysicsEngine, xp.PhysicalObject]:
    engine = xp.PhysicsEngine(up="z")
    laws = [engine.add_law("basic:planet_gravity", acceleration=9.81), engine.add_law("collision:elastic")]
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=laws[1:])
    return engine, engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), **ball), laws=laws)


def test_a_hundred_thousand_bounces_keep_their_energy() -> None:
    engine, _ = court(position=(0.0, 0.0, 0.1 + 1e-3))
    begin = engine.energy()
    exchanged = begin.total - 9.81 * 0.1
    period = 2.0 * math.sqrt(2.0 * 1e-3 / 9.81)
    worst = 0.0
    for block in range(1, 21):
        engine.run(until=5_000.25 * period * block)
        worst = max(worst, abs(engine.energy().total - begin.total))
    assert engine._world.contacts.impacts >= 99_999
    # The place of each impact is rounded to 1e-17 of 0.1 m, g times that 1e5 times over at random: sqrt(1e5) 1e-16 J.
    assert worst < 1e-11 * exchanged


def test_a_hundred_thousand_impacts_between_walls_keep_speed_to_the_bit() -> None:
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic")
    for side in (1.0, -1.0):
        engine.add_object(xp.PhysicalObject(xp.Plane((side, 0, 0), -1.0), fixed=True), laws=[bounce])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), velocity=(math.pi, 0.1, 0)), laws=[bounce])
    until = 1.8e5 / math.pi
    engine.run(until=until)
    assert engine._world.contacts.impacts in (99_999, 100_000, 100_001)
    assert abs(ball.velocity[0]) == math.pi
    assert ball.position[1] == pytest.approx(0.1 * until, rel=1e-10)  # each re-base rounds: 1e5 times 5e-13 at random


wide = settings(deadline=None, max_examples=100)


def powers(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers of every size between, evenly over their exponents."""
    return st.floats(math.log10(low), math.log10(high)).map(lambda x: 10.0**x)


@wide
@given(m1=powers(1e-12, 1e12), m2=powers(1e-12, 1e12), e=st.floats(0.0, 1.0), offset=st.floats(-1.8, 1.8))
def test_masses_of_every_size_keep_momentum_and_energy(m1: float, m2: float, e: float, offset: float) -> None:
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic", restitution=e)
    a = engine.add_object(
        xp.PhysicalObject(xp.Sphere(1.0), mass=m1, position=(-3, 0, 0), velocity=(2, 0, 0)), laws=[bounce]
    )
    b = engine.add_object(
        xp.PhysicalObject(xp.Sphere(1.0), mass=m2, position=(3, offset, 0), velocity=(-1, 0, 0)), laws=[bounce]
    )
    before, p = engine.energy(), engine.momentum()
    engine.run(until=2.5)
    assert engine._world.contacts.impacts == 1
    heavier = max(m1, m2)
    for k in range(3):
        # Velocities round to 2e-16 of 3 m/s, and the heavier's rounding is what shows.
        assert abs(engine.momentum()[k] - p[k]) <= 2e-15 * heavier
    reduced = m1 * m2 / (m1 + m2)
    assert abs(engine.energy().balance - before.total) <= 4e-15 * before.total
    # The lighter one's change is exact to its own size: relative speed along the normal turns by e.
    normal = [y - x for x, y in zip((0, 0, 0), (math.sqrt(1 - offset**2 / 4), offset / 2, 0), strict=True)]
    relative = sum((u - v) * n for u, v, n in zip(b.velocity, a.velocity, normal, strict=True))
    assert relative == pytest.approx(e * 3.0 * normal[0], abs=2e-14 / max(normal[0], 1e-3))
    assert reduced > 0.0


@wide
@given(radius=powers(1e-9, 1e6), other=powers(1e-9, 1e6), speed=powers(1e-9, 1e8), gap=powers(1e-3, 1e3))
def test_radii_and_speeds_of_every_size_meet_on_time(radius: float, other: float, speed: float, gap: float) -> None:
    """A sphere at rest, another a few radii away: they meet when the gap is closed, and bounce."""
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic")
    gap *= max(radius, other)
    a = engine.add_object(xp.PhysicalObject(xp.Sphere(radius), velocity=(speed, 0, 0)), laws=[bounce])
    b = engine.add_object(xp.PhysicalObject(xp.Sphere(other), position=(radius + other + gap, 0, 0)), laws=[bounce])
    exact = (b.position[0] - radius - other) / speed
    near = 4e-16 * (radius + other + gap) / speed + 1e-12 * (radius + other) / speed
    engine.run(until=max(exact - near, 0.0) * (1 - 1e-12))
    assert a.velocity == (speed, 0.0, 0.0)
    engine.run(until=(exact + near) * (1 + 1e-12))
    assert a.velocity[0] == pytest.approx(0.0, abs=1e-15 * speed)
    assert b.velocity[0] == pytest.approx(speed, rel=1e-15)


@wide
@given(
    speed=powers(1e-9, 1e8),
    radius=powers(1e-9, 1.0),
    steps=st.sampled_from([None, 1, 7]),
    begin=st.sampled_from([0.0, 1e3, 1e6]),
)
def test_a_bullet_never_goes_through_a_wall(speed: float, radius: float, steps: int | None, begin: float) -> None:
    """Two planes back to back, 0.01 m apart, on both sides of which there is room: whatever the speed and the step."""
    engine = xp.PhysicsEngine()
    engine.run(until=begin)
    bounce = engine.add_law("collision:elastic")
    engine.add_object(xp.PhysicalObject(xp.Plane((-1, 0, 0), -10.0), fixed=True), laws=[bounce])  # solid beyond x = 10
    engine.add_object(xp.PhysicalObject(xp.Plane((1, 0, 0), 0.0), fixed=True), laws=[bounce])  # and below 0
    bullet = engine.add_object(
        xp.PhysicalObject(xp.Sphere(radius), position=(5, 0, 0), velocity=(speed, 0.1 * speed, 0)), laws=[bounce]
    )
    span = 1000.0 / speed
    until = begin + span
    if until == begin:
        return
    engine.run(until=until, dt=None if steps is None else span / steps)
    assert radius - 1e-9 <= bullet.position[0] <= 10.0 - radius + 1e-9
    assert abs(bullet.velocity[0]) == speed
    assert engine._world.contacts.impacts >= 90


@wide
@given(
    speed=powers(1e-3, 1e8),
    target=powers(1e-6, 0.1),
    offset=st.floats(-0.99, 0.99),
    steps=st.sampled_from([None, 1, 3]),
)
def test_a_bullet_never_misses_a_small_target(speed: float, target: float, offset: float, steps: int | None) -> None:
    """A point that flies at a sphere of a micrometre, from 10 m away, in one step: it hits if it is aimed."""
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic")
    bullet = engine.add_object(
        xp.PhysicalObject(position=(-10, offset * target, 0), velocity=(speed, 0, 0)), laws=[bounce]
    )
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(target)), laws=[bounce])
    before = engine.energy().total
    span = 20.0 / speed
    engine.run(until=span, dt=None if steps is None else span / steps)
    assert engine._world.contacts.impacts == 1
    assert ball.velocity != (0.0, 0.0, 0.0)
    assert engine.energy().total == pytest.approx(before, rel=1e-14)
    # Its place along the way is known to 2e-15 of 10 m, beside the target's radius.
    along = math.sqrt(1.0 - offset**2)
    assert ball.velocity[0] == pytest.approx(speed * along**2, rel=1e-13 / target + 1e-12)
    del bullet


@wide
@given(speed=powers(1e-3, 1e8), offset=st.floats(1.001, 100.0))
def test_a_bullet_aimed_past_a_target_misses_it(speed: float, offset: float) -> None:
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic")
    engine.add_object(xp.PhysicalObject(position=(-10, offset * 1e-3, 0), velocity=(speed, 0, 0)), laws=[bounce])
    engine.add_object(xp.PhysicalObject(xp.Sphere(1e-3)), laws=[bounce])
    engine.run(until=20.0 / speed)
    assert engine._world.contacts.impacts == 0


@wide
@given(g=powers(1e-9, 1e9), height=powers(1e-6, 1e6), radius=powers(1e-6, 1e3), e=st.sampled_from([0.0, 0.5, 0.9]))
def test_a_ball_comes_to_rest_at_every_size(g: float, height: float, radius: float, e: float) -> None:
    engine = xp.PhysicsEngine(up="z")
    laws = [engine.add_law("basic:planet_gravity", acceleration=g), engine.add_law("collision:elastic", restitution=e)]
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=laws[1:])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(radius), position=(0, 0, radius + height)), laws=laws)
    rest = math.sqrt(2.0 * (ball.position[2] - radius) / g) * (1.0 + e) / (1.0 - e)
    # The height is known to the rounding of radius + height, and touching is 1e-12 of the size.
    near = 1e-12 + 1e-11 * radius / height
    engine.run(until=rest * (1.0 + near))
    assert ball.velocity == (0.0, 0.0, 0.0)
    assert ball.position[2] == pytest.approx(radius, rel=1e-15)
    engine.run(until=rest * 1e6)
    assert ball.position[2] == pytest.approx(radius, rel=1e-15)
