"""Thesis 2.8 and 3.1: the engine, its states and its clock."""

from __future__ import annotations

import itertools
from typing import Any

import pytest

import xpheve as xp
from xpheve.errors import StateError


class Count(xp.PhysicalLaw):
    """Be counted."""

    def enforce_this_law(self, event: Any) -> None:
        """Do nothing."""


@pytest.mark.thesis("order-of-setting-up")
def test_2_8_the_order_of_setting_up_does_not_matter() -> None:
    def end(order: tuple[int, ...]) -> Any:
        engine = xp.PhysicsEngine()
        body = xp.PhysicalObject(xp.Sphere(0.1), position=(0.1, 1, 0.2), velocity=(0.3, 0, 0))
        floor = xp.PhysicalObject(xp.Plane(), fixed=True)
        steps = [
            lambda: engine.add_law("basic:planet_gravity", name="g"),
            lambda: engine.add_law("collision:elastic", name="c", restitution=0.9),
            lambda: engine.add_object(body),
            lambda: engine.add_object(floor),
        ]
        for k in order:
            steps[k]()
        pairs = [(body, "c"), (floor, "c"), (body, "g")]
        for obj, law in pairs if sum(order[:2]) % 2 else reversed(pairs):
            engine.map(obj, law)
        engine.run(until=3.0)
        return body.position, body.velocity

    assert len({end(order) for order in itertools.permutations(range(4))}) == 1


@pytest.mark.thesis("never-inside")
def test_2_8_objects_never_move_inside_each_other() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    engine.add_object(xp.PhysicalObject(xp.Plane((-1, 0, 0), offset=-3), fixed=True), laws=[law])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), velocity=(100, 0, 0)), laws=[law])
    engine.step(0.02)
    assert ball.position[0] <= 2.5
    record = engine.run(until=1.0, dt=0.02, every=0.001)
    assert record[ball].position[:, 0].max() <= 2.5 + 1e-12


@pytest.mark.thesis("clock")
def test_3_1_2_suspended_time_does_not_pass() -> None:
    """System time 17, start 10, paused 3: simulation time 4."""
    engine = xp.PhysicsEngine()
    ball = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))
    engine.run(until=1.0)
    for until in (2.0, 4.0):
        engine.suspend()
        assert ball.position == (engine.time, 0, 0)
        with pytest.raises(StateError):
            engine.run(until=99.0)
        engine.resume()
        engine.run(until=until)
    assert engine.time == 4.0 and ball.position == (4, 0, 0) and ball.velocity == (1, 0, 0)


@pytest.mark.thesis("suspended-is-deaf")
def test_3_1_3_a_suspended_engine_monitors_nothing() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law(Count(), container=xp.LawContainer(xp.when.Elapsed(0.1, every=True)))
    engine.run(until=0.55)
    engine.suspend()
    engine.post("anything")
    assert law.evaluations == 5
    engine.resume()
    assert law.evaluations == 5


@pytest.mark.thesis("resume-is-no-start")
def test_3_1_3_resume_is_no_start_ten_times_over() -> None:
    engine = xp.PhysicsEngine()
    gravity = engine.add_law("basic:planet_gravity", acceleration=9.8)
    started = engine.add_law(Count(), container=xp.LawContainer(xp.when.Started()))
    ball = engine.add_object(xp.PhysicalObject(), laws=[gravity])
    for k in range(1, 11):
        engine.run(until=0.1 * k)
        engine.suspend()
        engine.resume()
    assert started.evaluations == 1 and len(ball.forces) == 1
    assert ball.velocity[1] == pytest.approx(-9.8, rel=1e-14)


@pytest.mark.thesis("stop-time")
def test_fig_5_7_stop_times_are_hit_exactly_and_reset_sets_zero() -> None:
    engine = xp.PhysicsEngine()
    ball = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0), position=(2, 0, 0)))
    for until in (0.1, 0.7, 1 / 3 + 1, 3.3):
        engine.run(until=until, dt=0.25)
        assert engine.time == until
    engine.reset()
    assert engine.time == 0.0 and ball.position == (2, 0, 0)
