"""A ball on a floor: S2 (restitution 1, 10 s) and S2b (restitution 0.8, 3 s), and the same later, farther, and elsewhere."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import xpheve as xp

relaxed = settings(deadline=None, max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.mark.parametrize(("restitution", "until"), [(1.0, 10.0), (0.8, 3.0), (0.5, 1.0), (0.95, 10.0)])
def test_a_ball_bounces_as_the_closed_form_says(court, bounced, restitution: float, until: float) -> None:
    engine, ball, _ = court(restitution=restitution)
    begin = engine.energy()
    record = engine.run(until=until, every=0.05)
    for t, z in zip(record.time, record[ball].position[:, 2], strict=True):
        # Issue 2 asks for 1e-11 m; what is left are roundings of 11 bounces at up to 4.4 m/s.
        assert abs(z - 0.1 - bounced(1.1 - 0.1, 9.81, restitution, float(t))[0]) < 2e-14
    end = engine.energy()
    assert abs(end.balance / begin.total - 1.0) < 1e-13
    if restitution == 1.0:
        assert abs(end.total / begin.total - 1.0) < 2e-15


@pytest.mark.parametrize("dt", [1 / 240, 0.3])
def test_host_steps_do_not_change_a_bounce(court, dt: float) -> None:
    exact, ball, _ = court(restitution=0.8)
    exact.run(until=3.0)
    stepped, other, _ = court(restitution=0.8)
    stepped.run(until=3.0, dt=dt)
    assert (other.position, other.velocity) == (ball.position, ball.velocity)


@pytest.mark.parametrize(("restitution", "until"), [(1.0, 10.0), (0.8, 3.0)])
@pytest.mark.parametrize("begin", [1e3, 1e6, 1e9])
def test_a_scene_that_starts_late_bounces_alike(court, restitution: float, until: float, begin: float) -> None:
    """Times are kept in two parts, so that nothing is lost but where one looks."""
    engine, ball, _ = court(restitution=restitution)
    engine.run(until=until)
    late, other, _ = court(restitution=restitution, begin=begin)
    late.run(until=begin + until)
    # The state itself knows no time; the moments of the impacts are added in another order: a rounding of 1e-32.
    assert other.position[2] == pytest.approx(ball.position[2], abs=1e-14)
    assert other.velocity[2] == pytest.approx(ball.velocity[2], abs=1e-13)


def test_a_late_ball_comes_to_rest_in_time(court) -> None:
    engine, ball, _ = court(restitution=0.8, begin=1e6)
    rest = math.sqrt(2.0 / 9.81) * 9.0
    engine.run(until=1e6 + rest - 1e-9)  # the nearest floats to 1e6 s lie 1e-10 s apart
    assert ball.velocity[2] != 0.0
    engine.run(until=1e6 + rest + 1e-9)
    assert ball.velocity == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(("restitution", "until"), [(1.0, 10.0), (0.8, 3.0)])
@pytest.mark.parametrize("across", [1e3, 1e6, -1e9])
def test_a_ball_far_along_the_floor_bounces_alike(court, restitution: float, until: float, across: float) -> None:
    engine, ball, _ = court(restitution=restitution)
    engine.run(until=until)
    far, other, _ = court(restitution=restitution, across=across)
    far.run(until=until)
    assert (other.position[2], other.velocity[2]) == (ball.position[2], ball.velocity[2])
    assert other.position[0] == across


@pytest.mark.parametrize("ground", [1e3, -1e6])
def test_a_high_floor_bounces_alike_to_the_rounding_of_its_height(court, bounced, ground: float) -> None:
    engine, ball, _ = court(restitution=0.8, ground=ground)
    height = ball.position[2] - ground - 0.1  # exact: the two differ by little
    engine.run(until=3.0)
    expected = bounced(height, 9.81, 0.8, 3.0)[0]
    ulp = float(np.spacing(abs(ground)))
    # An impact is found to the rounding of the height, some ulp / v late: each bounce moves the next ones by as much.
    assert abs((ball.position[2] - ground - 0.1) - expected) < 20 * ulp


@relaxed
@given(
    h=st.floats(0.01, 50.0),
    g=st.floats(0.5, 50.0),
    e=st.one_of(st.just(1.0), st.floats(0.1, 0.95)),
    up=st.floats(-10.0, 10.0),
    share=st.floats(0.0, 1.2),
)
def test_any_ball_bounces_as_the_closed_form_says(
    court, bounced, h: float, g: float, e: float, up: float, share: float
) -> None:
    """Thrown up or down: the same as a ball dropped from its highest point, a while before or later."""
    engine, ball, _ = court(height=h, gravity=g, restitution=e, velocity=(0.0, 0.0, up))
    h = ball.position[2] - 0.1
    top = h + up * up / (2.0 * g)
    since = -up / g  # the time since it was, or until it is, at the top
    first = math.sqrt(2.0 * top / g)
    until = share * (first * (1.0 + e) / (1.0 - e) if e < 1.0 else 20.0 * first)
    if until + since < 0.0:
        return
    engine.run(until=until)
    height, speed = bounced(top, g, e, until + since)
    impact = math.sqrt(2.0 * g * top)
    bounces = 20.0 if e == 1.0 else 1.0 / (1.0 - e)
    near = 1e-14 * (1.0 + bounces) * (until + abs(since) + first) * impact
    assert abs(ball.position[2] - 0.1 - height) < near + 1e-15
    if height > 1e-6 * top:  # at an impact the speed jumps
        assert abs(ball.velocity[2] - speed) < g * near / impact + 1e-14 * impact


def test_a_lively_ball_comes_to_rest_too(court) -> None:
    """e = 0.995: some 4,700 bounces, 1,400 of them less than 1e-7 s apart."""
    engine, ball, _ = court(restitution=0.995, height=0.01)
    rest = math.sqrt(2.0 * (ball.position[2] - 0.1) / 9.81) * 1.995 / (1.0 - 0.995)
    engine.run(until=rest * (1.0 - 1e-11))
    assert ball.velocity[2] != 0.0
    engine.run(until=rest * (1.0 + 1e-11))  # 1 - e keeps 1e-14 of e's digits
    assert ball.velocity == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("tilt", [0.0, 0.3, 1.0])
def test_a_bounce_on_a_slope_turns_the_normal_component_alone(tilt: float) -> None:
    engine = xp.PhysicsEngine(up="z")
    bounce = engine.add_law("collision:elastic", restitution=0.5)
    normal = (math.sin(tilt), 0.0, math.cos(tilt))
    engine.add_object(xp.PhysicalObject(xp.Plane(normal), fixed=True), laws=[bounce])
    ball = engine.add_object(
        xp.PhysicalObject(xp.Sphere(0.1), position=(0.0, 0.0, 3.0), velocity=(0.2, 0.4, -2.0)), laws=[bounce]
    )
    engine.run(until=3.0)
    before, n = np.array((0.2, 0.4, -2.0)), np.array(normal)
    assert np.subtract(ball.velocity, before - 1.5 * (before @ n) * n) == pytest.approx(0.0, abs=1e-15)


def test_each_object_may_have_its_own_restitution() -> None:
    def speed_after(rule: str, **own: float) -> float:
        engine = xp.PhysicsEngine(up="z")
        bounce = engine.add_law("collision:elastic", restitution=0.9, combine=rule)
        engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce])
        ball = engine.add_object(
            xp.PhysicalObject(xp.Sphere(0.5), position=(0, 0, 1), velocity=(0, 0, -1), **own), laws=[bounce]
        )
        engine.run(until=1.0)
        return float(ball.velocity[2])

    assert speed_after("average") == 0.9
    assert speed_after("average", restitution=0.5) == 0.7
    assert speed_after("minimum", restitution=0.5) == 0.5
    assert speed_after("maximum", restitution=0.5) == 0.9
    assert speed_after("multiply", restitution=0.5) == 0.45
    assert speed_after("geometric", restitution=0.4) == pytest.approx(0.6, rel=4e-16)


def test_two_floors_make_a_clockwork() -> None:
    """Between two walls without gravity a ball of restitution 1 keeps its period for ever: 2 m at 2 m/s."""
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic")
    for side in (1.0, -1.0):
        engine.add_object(xp.PhysicalObject(xp.Plane((side, 0, 0), -0.625), fixed=True), laws=[bounce])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.125), velocity=(2.0, 0, 0)), laws=[bounce])
    record = engine.run(until=1000.0, every=1.0)
    assert np.abs(record[ball].position[:, 0]).max() == 0.0  # powers of two: no rounding at all
    assert set(np.abs(record[ball].velocity[:, 0]).tolist()) == {2.0}
