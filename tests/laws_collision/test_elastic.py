"""Elastic collisions with restitution: of the law, of each object, and how two are combined."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import InvalidValueError, ParameterError


def collide(
    m1: float, m2: float, v1: Any, v2: Any, *, own: tuple[float | None, float | None] = (None, None), **law: Any
) -> tuple[xp.PhysicalObject, xp.PhysicalObject, xp.PhysicsEngine]:
    """Return two spheres after they met along x."""
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic", **law)
    bodies = []
    for mass, v, x, e in ((m1, v1, 0.0, own[0]), (m2, v2, 3.0, own[1])):
        columns = {} if e is None else {"restitution": e}
        velocity = (v, 0, 0) if isinstance(v, (int, float)) else v
        if math.isinf(mass):
            body = xp.PhysicalObject(xp.Sphere(0.5), fixed=True, position=(x, 0, 0), **columns)
        else:
            body = xp.PhysicalObject(xp.Sphere(0.5), mass=mass, position=(x, 0, 0), velocity=velocity, **columns)
        bodies.append(engine.add_object(body, laws=[bounce]))
    engine.run(until=20.0)
    return bodies[0], bodies[1], engine


masses = st.floats(1e-3, 1e3)
speeds = st.floats(0.1, 10.0)


@settings(deadline=None, max_examples=80, derandomize=True)
@given(m1=masses, m2=masses, v1=speeds, v2=st.floats(-10.0, 0.0), e=st.floats(0.0, 1.0))
def test_newtons_rule_and_momentum_hold(m1: float, m2: float, v1: float, v2: float, e: float) -> None:
    one, two, engine = collide(m1, m2, v1, v2, restitution=e)
    after = two.velocity[0] - one.velocity[0]
    size = v1 - v2
    assert after == pytest.approx(e * size, abs=1e-12 * size)
    assert engine.momentum()[0] == pytest.approx(m1 * v1 + m2 * v2, abs=1e-13 * (m1 + m2) * size)
    lost = 0.5 * (1 - e * e) * m1 * m2 / (m1 + m2) * size * size
    assert engine.energy().work == pytest.approx(-lost, abs=1e-12 * (m1 + m2) * size * size)


@pytest.mark.parametrize("rule", ["average", "minimum", "maximum", "multiply", "geometric"])
@pytest.mark.parametrize("own", [(0.25, 1.0), (1.0, 0.25), (None, 0.5), (0.5, None), (None, None), (0.0, 0.81)])
@pytest.mark.parametrize("fixed", [False, True])
def test_two_values_are_combined_by_the_rule(rule: str, own: tuple[float | None, float | None], fixed: bool) -> None:
    one, two, _ = collide(2.0, math.inf if fixed else 1.0, 3.0, 0.0, own=own, restitution=0.64, combine=rule)
    a, b = (0.64 if value is None else value for value in own)
    expected = {
        "average": (a + b) / 2, "minimum": min(a, b), "maximum": max(a, b), "multiply": a * b, "geometric": math.sqrt(a * b),
    }[rule]  # fmt: skip
    if own == (None, None):
        expected = 0.64
    assert two.velocity[0] - one.velocity[0] == pytest.approx(3.0 * expected, abs=1e-13)


def test_the_components_across_are_left_alone_to_the_bit() -> None:
    one, two, _ = collide(2.0, 1.0, (3.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert one.velocity[1:] == two.velocity[1:] == (0.0, 0.0)
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic", restitution=0.7)
    engine.add_object(xp.PhysicalObject(xp.Plane((0, 1, 0)), fixed=True), laws=[law])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(0, 1, 0), velocity=(0.1, -1, 0.3)), laws=[law])
    engine.run(until=2.0)
    assert ball.velocity == (0.1, 0.7, 0.3)


@pytest.mark.parametrize("bad", [-0.1, 1.1, math.nan, "bouncy", "0.5 m", None])
def test_restitution_lies_between_nothing_and_all(bad: Any) -> None:
    engine = xp.PhysicsEngine()
    with pytest.raises(InvalidValueError, match="restitution"):
        engine.add_law("collision:elastic", restitution=bad)
    law = engine.add_law("collision:elastic")
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(1)), laws=[law])
    if isinstance(bad, float):
        with pytest.raises(Exception, match="restitution"):
            ball["restitution"] = bad
    with pytest.raises(ParameterError, match="combine"):
        engine.add_law("collision:elastic", combine="both")


def test_restitution_changed_under_way_holds_from_then_on() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    for x in (-5.5, 5.5):
        engine.add_object(xp.PhysicalObject(xp.Plane((-x, 0, 0), offset=-5.5), fixed=True), laws=[law])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), velocity=(1, 0, 0)), laws=[law])
    engine.run(until=7.0)
    assert ball.velocity == (-1, 0, 0)
    law.restitution = 0.5  # type: ignore[attr-defined]
    engine.run(until=16.0)
    assert ball.velocity == (0.5, 0, 0)
    ball["restitution"] = 1.0
    engine.run(until=40.0)
    assert abs(ball.velocity[0]) == pytest.approx(0.375)


def test_what_is_not_mapped_is_passed_through_and_can_be_mapped_under_way() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    walls = [
        engine.add_object(xp.PhysicalObject(xp.Plane((-1, 0, 0), offset=-x), fixed=True), laws=[law] if x == 9 else [])
        for x in (3, 6, 9)
    ]
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), velocity=(1, 0, 0)), laws=[law])
    engine.run(until=4.0)
    assert ball.position == (4, 0, 0)
    engine.map(walls[1], law)
    engine.run(until=6.0)
    assert ball.velocity == (-1, 0, 0) and ball.position == pytest.approx((5, 0, 0), abs=1e-14)
    law.enabled = False
    engine.run(until=30.0)
    assert ball.position == pytest.approx((-19, 0, 0), abs=1e-13)


def test_nothing_tunnels_however_fast() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    engine.add_object(xp.PhysicalObject(xp.Sphere(1e-3), fixed=True, position=(1, 0, 0)), laws=[law])
    shot = engine.add_object(xp.PhysicalObject(xp.Sphere(1e-3), velocity=(1e6, 0, 0)), laws=[law])
    engine.run(until=1.0, dt=0.5)
    assert shot.velocity == (-1e6, 0, 0)


def test_a_receding_body_is_left_alone() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    engine.add_object(xp.PhysicalObject(xp.Plane((0, 1, 0)), fixed=True), laws=[law])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(0, 0.5, 0), velocity=(1, 2, 0)), laws=[law])
    inside = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(50, 0.4, 0), velocity=(0, 2, 0)), laws=[law])
    engine.run(until=1.0)
    assert ball.velocity == (1, 2, 0) and inside.velocity == (0, 2, 0) and law.evaluations == 0
