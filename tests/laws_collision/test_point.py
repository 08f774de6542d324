"""The thesis's response: bodies answer as points along one normal."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import ConflictError, ParameterError


def meet(law: str, *bodies: xp.PhysicalObject, until: float = 1.0, **parameters: float) -> xp.PhysicsEngine:
    engine = xp.PhysicsEngine()
    made = engine.add_law(law, **parameters)
    engine.add_objects(list(bodies), laws=[made])
    engine.run(until=until)
    return engine


@settings(deadline=None, max_examples=30, derandomize=True)
@given(m1=st.floats(1e-3, 1e3), m2=st.floats(1e-3, 1e3), v1=st.floats(0.1, 10), v2=st.floats(-10, 0))
def test_two_movers_follow_the_formula_of_appendix_a_whatever_the_factor(
    m1: float, m2: float, v1: float, v2: float
) -> None:
    one = xp.PhysicalObject(xp.Sphere(0.5), mass=m1, velocity=(v1, 0.1, 0.7))
    two = xp.PhysicalObject(xp.Sphere(0.5), mass=m2, position=(1.001, 0, 0), velocity=(v2, 0.1, 0.7))
    meet("collision:point", one, two, factor=0.3)
    size = 1e-12 * (v1 - v2)
    assert one.velocity[0] == pytest.approx(((m1 - m2) * v1 + 2 * m2 * v2) / (m1 + m2), abs=size)
    assert two.velocity[0] == pytest.approx(((m2 - m1) * v2 + 2 * m1 * v1) / (m1 + m2), abs=size)
    assert one.velocity[1:] == two.velocity[1:] == (0.1, 0.7)


@pytest.mark.parametrize(("factor", "after"), [(1.0, 4.0), (0.5, 2.0), (0.0, 0.0)])
def test_what_meets_something_fixed_keeps_the_factor_of_its_normal_speed(factor: float, after: float) -> None:
    ball = xp.PhysicalObject(xp.Sphere(0.5), position=(0, 1, 0), velocity=(3, -4, 0))
    meet("collision:point", xp.PhysicalObject(xp.Plane(), fixed=True), ball, factor=factor)
    assert ball.velocity == (3, after, 0)


def test_a_box_hit_off_centre_answers_as_a_point_and_does_not_turn() -> None:
    ball = xp.PhysicalObject(xp.Sphere(0.1), position=(-1, 0.4, 0), velocity=(2, 0, 0))
    box = xp.PhysicalObject(xp.Box((1, 1, 1)))
    engine = meet("collision:point", ball, box)
    assert box.angular_velocity == (0, 0, 0) and box.velocity == (2, 0, 0) and ball.velocity == (0, 0, 0)
    assert engine.angular_momentum()[2] == pytest.approx(0.0) != -0.8  # the 0.8 of the ball is lost


def test_the_same_hit_turns_the_box_under_the_elastic_law_and_keeps_angular_momentum() -> None:
    ball = xp.PhysicalObject(xp.Sphere(0.1), position=(-1, 0.4, 0), velocity=(2, 0, 0))
    box = xp.PhysicalObject(xp.Box((1, 1, 1)))
    engine = meet("collision:elastic", ball, box)
    assert box.angular_velocity[2] < -0.5
    assert engine.angular_momentum()[2] == pytest.approx(-0.8, rel=1e-14)


def test_it_claims_the_answer_to_contacts_for_itself() -> None:
    engine = xp.PhysicsEngine()
    laws = [engine.add_law("collision:point"), engine.add_law("collision:elastic")]
    with pytest.raises(ConflictError, match="contact-response"):
        engine.add_object(xp.PhysicalObject(xp.Sphere(1.0)), laws=laws)
    with pytest.raises(ParameterError, match="factor"):
        engine.add_law("collision:point", factor=1.5)
