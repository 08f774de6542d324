"""Scenery and laws that are newer than flights: nothing of them was there before."""

from __future__ import annotations

import numpy as np
import pytest
from tests.laws_collision.impact.loops import Restitution, at_time, flights, lattice, loop_of, plane, put, room, solid
from tests.laws_collision.impact.scenes import LOOP, SERVER, gas, states

import xpheve as xp
from xpheve_laws_collision.impact import rows

WALL = plane((-1.0, 0.0, 0.0), -1.0)


def test_a_wall_in_the_past_of_a_flight_was_never_hit() -> None:
    loop = loop_of(1, [WALL])
    put(loop, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    loop.since = (3.0, 0.0)
    loop.set_scenery([WALL, plane((-1.0, 0.0, 0.0), -5.0)], [0, 1])
    assert loop.next_time()[0] == pytest.approx(4.95, rel=1e-15)
    assert flights(loop)[6, 0] == 0.0, "the flight is the one that it was"


def test_what_stands_in_the_way_then_is_hit_at_once() -> None:
    loop = loop_of(1, [plane((-1.0, 0.0, 0.0), -9.0)])
    put(loop, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    assert loop.run((3.0, 0.0)).kind == "limit"
    loop.since = (3.0, 0.0)
    loop.set_scenery([WALL], [1])
    assert loop.next_time() == (3.0, 0.0)


@pytest.mark.parametrize("kind", [rows.SPHERE, rows.BOX, rows.CAPSULE])
def test_bounded_shapes_and_balls_begin_at_the_same_instant(kind: int) -> None:
    sizes = {rows.SPHERE: (0.5,), rows.BOX: (0.5, 0.5, 0.5), rows.CAPSULE: (0.5, 0.2)}[kind]
    loop = loop_of(2, [solid(kind, (2.0, 0.0, 0.0), sizes)])
    put(loop, [(0.0, 4.0), (0.0, 0.0), (0.0, 0.0)], [(1.0, -1.0), (0.0, 0.0), (0.0, 0.0)])
    loop.since = (3.7, 0.0)
    assert loop.next_time() == (np.inf, 0.0)
    loop.since = (1.0, 0.0)
    assert loop.next_time()[0] == pytest.approx(1.45, rel=1e-15)
    loop.set_scenery(np.zeros((0, rows.SCENERIES)), [])
    assert loop.next_time()[0] == pytest.approx(1.95, rel=1e-15)
    loop.since = (1.96, 0.0)
    assert loop.next_time() == (1.96, 0.0), "they overlap, and approach"


def test_flights_that_are_older_by_far_meet_as_those_that_begin_then() -> None:
    old, new = loop_of(40, room(1.2)), loop_of(40, room(1.2))
    x, v = lattice(40, 1.2, seed=3)
    put(old, x - 0.25 * v, v)
    put(new, x, v, clock=(0.25, 0.0))
    old.since = (0.25, 0.0)
    for loop in (old, new):
        assert loop.run((0.5, 0.0)).kind == "limit"
    assert old.impacts == new.impacts > 5
    assert np.allclose(at_time(old, 0.5), at_time(new, 0.5), rtol=0, atol=1e-12)


def test_balls_out_of_their_law_for_a_while_have_no_impact_of_the_past() -> None:
    def run(stepper: str) -> np.ndarray:
        engine, balls = gas(stepper, 60, size=4.0, speed=1.0)
        engine.run(until=0.1)
        for ball in balls[:20]:
            engine.unmap(ball, engine.laws[0])
        engine.run(until=1.1)
        for ball in balls[:20]:
            engine.map(ball, engine.laws[0])
        engine.run(until=2.0)
        return states(balls)

    assert np.allclose(run(LOOP), run(SERVER), rtol=0, atol=1e-9)


def test_a_wall_moved_into_the_past_of_flights_was_not_there() -> None:
    def run(stepper: str) -> np.ndarray:
        engine, balls = gas(stepper, 40, size=4.0, speed=1.0)
        post = xp.PhysicalObject(xp.Box((0.2, 0.2, 0.2)), fixed=True, position=(9.0, 9.0, 9.0))
        engine.add_object(post, laws=engine.laws[0])
        engine.run(until=0.5)
        ball = balls[7]
        post.position = tuple(c - 0.3 * v for c, v in zip(ball.position, ball.velocity, strict=True))
        engine.run(until=1.5)
        return states(balls)

    assert np.allclose(run(LOOP), run(SERVER), rtol=0, atol=1e-9)


def test_streaks_go_on_where_they_were_left() -> None:
    def between(**more: object) -> object:
        loop = loop_of(1, [plane((1.0, 0.0, 0.0), 0.0), plane((-1.0, 0.0, 0.0), -0.1 - 1e-8)], Restitution(0.9))
        put(loop, (0.05 + 5e-9, 0.0, 0.0), (1.0, 0.0, 0.0), **more)
        return loop

    whole = between()
    assert whole.run((1.0, 0.0)).kind == "streak"
    cut = between()
    cut.run((3e-8, 0.0))
    state, streak = flights(cut), cut.streaks([0])
    assert 1 <= streak[0, 0] < 7
    again = between()
    put(again, state[:3], state[3:6], clock=state[6:8], streak=streak)
    assert again.run((1.0, 0.0)) == whole.run((1.0, 0.0))
    assert flights(again).tobytes() == flights(whole).tobytes()


def test_a_quiet_place_tells_no_rest_until_it_is_loaded_again() -> None:
    loop = loop_of(1, [plane((0.0, 0.0, 1.0), 0.0)])
    put(loop, (0.0, 0.0, 0.05), (0.0, 0.0, 0.0), acceleration=(0.0, 0.0, -9.81))
    assert loop.run((1.0, 0.0)).kind == "rest"
    loop.quiet(0)
    assert loop.run((1.0, 0.0)).kind == "limit"
    put(loop, (0.0, 0.0, 0.05), (0.0, 0.0, 0.0), acceleration=(0.0, 0.0, -9.81))
    assert loop.run((1.0, 0.0)).kind == "rest"


class Heavy:
    """A law that parts the pair as fast as the fixed body weighs and stands, a kilogram and a metre to a metre a second."""

    text = """
def respond(f, n):
    c = f[0]
    c[112] = 0.0
    c[113] = c[64 + 13] + c[64 + 2] + 10.0 * c[64 + 15] + c[64 + 10] + c[64 + 24]
    return 0
"""
    columns = ("grip",)
    files: dict[str, str] = {}  # noqa: RUF012

    def parameters(self) -> tuple[list[float], list[tuple[int, int]]]:
        return [0.0], [(0, 0)]


def test_laws_read_of_a_fixed_body_what_it_is() -> None:
    body = [0.0, 0.0, -1.0, 0.0, 0.5, 0.0, 0.0, 2.0, 0.1, 0.1, 0.1]
    loop = loop_of(1, [plane((0.0, 0.0, 1.0), 0.0)], Heavy(), scenery_bodies=[body], scenery_columns={"grip": [0.25]})
    put(loop, (0.0, 0.0, 1.0), (0.0, 0.0, -1.0), columns={"grip": [7.0]})
    loop.run((2.0, 0.0))
    assert loop.impacts == 1 and flights(loop)[5, 0] == 2.0 - 1.0 + 1.0 + 0.5 + 0.25
