"""The program of the front page, as written, against closed forms."""

from __future__ import annotations

import math
from types import SimpleNamespace

import mpmath as mp
import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

import xpheve as xp


@pytest.fixture(scope="module")
def front() -> SimpleNamespace:
    """What the program leaves behind; its middle part is copied from the design, letter by letter."""
    # fmt: off
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", acceleration=9.81)      # container: the law's own default
    bounce = engine.add_law("collision:elastic", restitution=0.8)            # or add_law(MyLaw(...), container=MyContainer(...))

    floor = engine.add_object(xp.PhysicalObject(shape=xp.Plane(), fixed=True), laws=[bounce])
    ball = engine.add_object(
        xp.PhysicalObject(shape=xp.Sphere(0.1), mass=1.0, position=(0, 0, 1.1), velocity=(0, 0, 0)),
        laws=[gravity, bounce],
    )
    top = engine.add_object(xp.PhysicalObject(mass=1.0, inertia=(1, 2, 3), angular_velocity=(0.01, 2, 0.01), position=(5, 0, 5)))

    engine.run(until=3.0)                        # exact where possible, else to rtol, atol; run(until=3.0, dt=1/240) steps
    halfway = (ball.position, ball.velocity, engine.energy())
    record = engine.run(until=10.0, every=1/60)  # the same, keeping a record; the ball comes to rest at 4.06 s
    print(engine.time, ball.position, ball.velocity, top.orientation, top.angular_velocity)
    print(engine.energy(), engine.momentum(), engine.angular_momentum())
    print(engine.explain())
    # fmt: on
    return SimpleNamespace(**locals())


def test_the_ball_is_where_the_closed_form_says_after_three_seconds(front, bounced) -> None:
    height, speed = bounced(1.1 - 0.1, 9.81, 0.8, 3.0)
    position, velocity, _ = front.halfway
    # Heights are held beside 0.1 m of radius and times rounded 4 times: some 1e-16 each.
    assert abs(position[2] - 0.1 - height) < 1e-15
    assert abs(velocity[2] - speed) < 1e-14
    assert position[:2] == velocity[:2] == (0.0, 0.0)


def test_the_ball_ends_on_the_floor_at_rest(front) -> None:
    assert front.ball.position == (0.0, 0.0, 0.1)
    assert front.ball.velocity == (0.0, 0.0, 0.0)


def test_the_record_shows_the_ball_at_rest_from_its_instant_on(front, bounced) -> None:
    track = front.record[front.ball]
    resting = [math.sqrt(2.0 / 9.81) * 9.0 <= t for t in track.time]
    assert resting == [not speed for speed in track.velocity[:, 2]]
    for t, z, v in zip(track.time, track.position[:, 2], track.velocity[:, 2], strict=True):
        height, speed = bounced(1.1 - 0.1, 9.81, 0.8, float(t))
        assert abs(z - 0.1 - height) < 1e-15
        assert abs(v - speed) < 1e-14  # the rounding of a moment of 4 s, times g


def test_the_frames_are_sixtieths_of_a_second_and_the_end(front) -> None:
    expected = [3.0 + k / 60 for k in range(421)]  # 10 s is 420 frames later, but for the rounding of 1/60
    assert front.record.time[:420] == pytest.approx(expected[:420], rel=1e-15)
    assert front.record.time[-1] == front.engine.time == 10.0


def test_the_work_of_the_impacts_is_the_height_that_is_lost(front) -> None:
    energy = front.engine.energy()
    assert energy.work == pytest.approx(-9.81 * (1.1 - 0.1), rel=1e-15)
    assert energy.balance == pytest.approx(front.halfway[2].balance, rel=1e-15)
    assert front.record.energy_drift < 1e-14


def test_the_free_top_keeps_its_angular_momentum(front) -> None:
    assert front.engine.momentum() == (0.0, 0.0, 0.0)
    # The ball lies at rest, so that all there is belongs to the top; its |L| is 4.
    assert np.subtract(front.engine.angular_momentum(), (0.01, 4.0, 0.03)) == pytest.approx(0.0, abs=4e-15)


def test_nobody_stepped(front) -> None:
    laws = {law["id"]: law for law in front.engine.explain().data["laws"]}
    assert laws["basic:planet_gravity"]["evaluations"] == 1
    assert laws["collision:elastic"]["evaluations"] == 103  # one an impact, until flights last under 1e-10 s


def test_the_rest_instant_of_the_front_page() -> None:
    with mp.workdps(20):
        assert mp.nstr(rest_instant(mp.mpf(1), mp.mpf("9.81"), mp.mpf("0.8")), 13).startswith("4.0637127688")
    assert float(rest_instant(1.1 - 0.1, 9.81, 0.8)) == pytest.approx(4.063712768871, abs=1e-12)


def rest_instant(h: float, g: float, e: float) -> mp.mpf:
    """Instant [s] at which a ball dropped from ``h`` has made all its bounces: t1 (1 + e) / (1 - e)."""
    with mp.workdps(30):
        return mp.sqrt(2 * mp.mpf(h) / mp.mpf(g)) * (1 + mp.mpf(e)) / (1 - mp.mpf(e))


@settings(deadline=None, max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(h=st.floats(0.01, 100.0), g=st.floats(0.1, 100.0), e=st.sampled_from([0.0, 0.3, 0.5, 0.8, 0.9]))
@example(h=1.0, g=9.81, e=0.8)
@example(h=1.0, g=9.81, e=0.95)
def test_a_ball_comes_to_rest_when_all_its_bounces_are_over(court, h: float, g: float, e: float) -> None:
    """Nonzero just before, and exactly 0 just after, to 1e-12 of the time."""
    engine, ball, _ = court(height=h, gravity=g, restitution=e)
    rest = float(rest_instant(ball.position[2] - 0.1, g, e))
    engine.run(until=rest * (1.0 - 1e-12))
    assert ball.velocity[2] != 0.0
    engine.run(until=rest * (1.0 + 1e-12))
    assert ball.velocity == (0.0, 0.0, 0.0)
    assert ball.position == (0.0, 0.0, 0.1)
