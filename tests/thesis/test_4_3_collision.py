"""Thesis 4.3 and appendix A: collisions with what is fixed and between two bodies."""

from __future__ import annotations

import math

import pytest

import xpheve as xp
from xpheve.errors import InvalidValueError


def bounced(velocity: tuple[float, float, float], factor: float, height: float = 1.0) -> tuple[float, ...]:
    """Return the velocity after meeting a floor with normal (0, 1, 0), without gravity."""
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic", restitution=factor)
    engine.add_object(xp.PhysicalObject(xp.Plane((0, 1, 0)), fixed=True), laws=[law])
    ball = engine.add_object(
        xp.PhysicalObject(xp.Sphere(0.5), position=(0, 0.5 + height, 0), velocity=velocity), laws=[law]
    )
    engine.run(until=1.0)
    return ball.velocity


@pytest.mark.parametrize(("factor", "after"), [(1.0, (3, 4, 0)), (0.5, (3, 2, 0)), (0.0, (3, 0, 0))])
def test_4_3_2_1_fig_4_13_to_4_16(factor: float, after: tuple[float, ...]) -> None:
    assert bounced((3, -4, 0), factor) == pytest.approx(after, abs=1e-15)


def test_4_3_2_1_head_on() -> None:
    assert bounced((0, -4, 0), 1.0) == (0, 4, 0)


def test_4_3_2_1_a_receding_body_is_left_alone() -> None:
    assert bounced((3, 4, 0), 1.0, height=0.0) == (3, 4, 0)


@pytest.mark.parametrize("factor", [-0.1, 1.01, math.nan])
def test_4_3_2_1_a_factor_outside_0_to_1_is_refused(factor: float) -> None:
    with pytest.raises(InvalidValueError, match="restitution"):
        xp.PhysicsEngine().add_law("collision:elastic", restitution=factor)


def dropped(factor: float, g: float = 9.8) -> tuple[xp.PhysicsEngine, xp.PhysicalObject]:
    """Return a ball let go 1 m over the floor."""
    engine = xp.PhysicsEngine()
    gravity = engine.add_law("basic:planet_gravity", acceleration=g)
    law = engine.add_law("collision:elastic", restitution=factor)
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[law])
    return engine, engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(0, 1.5, 0)), laws=[gravity, law])


def test_4_3_2_1_heights_after_bounces() -> None:
    engine, ball = dropped(0.8)
    fall = math.sqrt(2 / 9.8)
    engine.run(until=math.nextafter(fall, 0.0))
    assert ball.velocity[1] == pytest.approx(-4.4272, abs=5e-5)
    time = fall
    for n in range(1, 9):
        rise = 0.8**n * fall
        engine.run(until=time + rise)
        assert ball.position[1] - 0.5 == pytest.approx(0.8 ** (2 * n), rel=1e-12)
        assert ball.velocity[1] == pytest.approx(0.0, abs=1e-12)
        time += 2 * rise


def test_4_3_2_1_at_rest_after_4_0658_seconds() -> None:
    engine, ball = dropped(0.8)
    rest = math.sqrt(2 / 9.8) * 1.8 / 0.2
    assert rest == pytest.approx(4.0658, abs=5e-5)
    engine.run(until=rest - 1e-6)
    assert ball.velocity != (0, 0, 0)
    engine.run(until=rest + 1e-6)
    assert ball.velocity == (0, 0, 0) and ball.position == pytest.approx((0, 0.5, 0), abs=1e-14)
    engine.run(until=1000.0)
    assert ball.velocity == (0, 0, 0) and ball.position == pytest.approx((0, 0.5, 0), abs=1e-14)


EXCHANGES = [
    (2, 1, 3, 0, 1, 4),
    (1, 3, 4, 0, -2, 2),
    (1, 2, 3, -3, -5, 1),
    (1, 1, 3, -2, -2, 3),
    (5, 5, 7, 0, 0, 7),
]


@pytest.mark.parametrize(("m1", "m2", "v1", "v2", "w1", "w2"), EXCHANGES)
def test_appendix_a_exchange(m1: float, m2: float, v1: float, v2: float, w1: float, w2: float) -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    one = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), mass=m1, velocity=(v1, 0, 0)), laws=[law])
    two = engine.add_object(
        xp.PhysicalObject(xp.Sphere(0.5), mass=m2, position=(2, 0, 0), velocity=(v2, 0, 0)), laws=[law]
    )
    before = engine.energy().total
    engine.run(until=2.0)
    assert (one.velocity[0], two.velocity[0]) == pytest.approx((w1, w2), abs=1e-14)
    assert two.velocity[0] - one.velocity[0] == pytest.approx(-(v2 - v1), abs=1e-14)
    assert engine.momentum()[0] == pytest.approx(m1 * v1 + m2 * v2, abs=1e-14)
    assert engine.energy().total == pytest.approx(before, rel=1e-15)


def test_appendix_a_an_infinite_mass_reverses() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    one = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), mass=3.0, velocity=(4, 0, 0)), laws=[law])
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(2, 0, 0), fixed=True), laws=[law])
    engine.run(until=1.0)
    assert one.velocity == (-4, 0, 0)


def test_4_3_2_2_fig_4_17_the_surface_component_is_unchanged_to_the_bit() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    one = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), mass=2.0, velocity=(3, 0.1, 0.7)), laws=[law])
    two = engine.add_object(
        xp.PhysicalObject(xp.Sphere(0.5), mass=1.0, position=(2, 0, 0), velocity=(0, 0.1, 0.7)), laws=[law]
    )
    engine.run(until=1.0)
    assert one.velocity[1:] == two.velocity[1:] == (0.1, 0.7)
    assert (one.velocity[0], two.velocity[0]) == pytest.approx((1, 4), abs=1e-14)


@pytest.mark.parametrize(
    ("own", "law_value", "expected"),
    [((None, None), 0.5, 0.5), ((0.2, None), 0.6, 0.4), ((0.2, 0.8), 1.0, 0.5), ((0.0, 0.0), 1.0, 0.0)],
)
@pytest.mark.parametrize("moving", [True, False], ids=["two movers", "one fixed"])
def test_4_3_2_3_fig_4_18_restitution_global_and_per_object(
    own: tuple[float | None, float | None], law_value: float, expected: float, moving: bool
) -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic", restitution=law_value)
    given = [{} if value is None else {"restitution": value} for value in own]
    one = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), velocity=(2, 0, 0), **given[0]), laws=[law])
    two = engine.add_object(
        xp.PhysicalObject(xp.Sphere(0.5), position=(2, 0, 0), fixed=not moving, **given[1]), laws=[law]
    )
    engine.run(until=2.0)
    assert two.velocity[0] - one.velocity[0] == pytest.approx(2 * expected, abs=1e-15)


def test_4_3_3_fig_4_19_objects_added_to_a_live_law_are_watched_and_removed_ones_are_not() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    wall = engine.add_object(xp.PhysicalObject(xp.Plane((-1, 0, 0), offset=-10), fixed=True), laws=[law])
    balls = [
        engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(0, 3 * k, 0), velocity=(1, 0, 0)))
        for k in range(3)
    ]
    engine.run(until=1.0)
    engine.map(balls[0], law)
    engine.map(balls[1], law)
    engine.run(until=5.0)
    engine.unmap(balls[1], law)
    late = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(0, -9, 0), velocity=(1, 0, 0)), laws=[law])
    engine.run(until=20.0)
    assert [ball.velocity[0] for ball in (*balls, late)] == [-1, 1, 1, -1] and wall.position == (0, 0, 0)
