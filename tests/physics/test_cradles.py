"""Balls on a line: Newton's cradles and gases of rods, which have an exact answer however many meet, and a rack that is run backwards."""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from tests.physics.impact_oracle import Ball, Wall
from tests.physics.impact_scenes import Scene, by_all_ways, states

RADIUS = 0.1
ASKED = 1e-12  # the most that a cradle may deviate, m and m/s
TOUCH = 1e-12  # [m] what is nearer touches: its gap is not flown through, and the ball at the end starts so much ahead
DIRECTIONS = [(1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (1.0, 2.0, 3.0), (1.0, 1e-3, 0.0), (-0.6, 0.0, 0.8)]


def rods(
    places: Sequence[float], speeds: Sequence[float], until: float, walls: tuple[float, float] | None = None
) -> tuple[Any, Any]:
    """Where equal balls on a line are, and how fast, each exactly: (balls,), as floats.

    Equal balls exchange their speeds: less the balls before it, each place flies on through all others, and only who is who changes
    (Tonks 1936). Between walls the places of points are folded.
    """
    length = 2 * Fraction(RADIUS)
    points = []
    for k, (place, speed) in enumerate(zip(places, speeds, strict=True)):
        there, going = Fraction(place) - k * length + Fraction(speed) * Fraction(until), Fraction(speed)
        if walls is not None:
            low = Fraction(walls[0]) + Fraction(RADIUS)
            wide = Fraction(walls[1]) - Fraction(RADIUS) - (len(places) - 1) * length - low
            turns, rest = divmod(there - low, wide)
            there, going = (low + rest, going) if turns % 2 == 0 else (low + wide - rest, -going)
        points.append((there, going))
    points.sort()
    return np.array([float(x + k * length) for k, (x, _) in enumerate(points)]), np.array([float(v) for _, v in points])


def on_a_line(places: Sequence[float], speeds: Sequence[float], direction: Sequence[float]) -> tuple[list[Ball], Any]:
    along = np.array(direction) / math.hypot(*direction)
    balls = [
        Ball(RADIUS, 1.0, tuple((x * along).tolist()), tuple((v * along).tolist()))
        for x, v in zip(places, speeds, strict=True)
    ]
    return balls, along


def deviation(
    scene: Scene,
    until: float,
    along: Any,
    exact: tuple[Any, Any],
    way: dict[str, Any],
    fall: float = 0.0,
    gaps: float = 0.0,
) -> float:
    """The greatest of places [m] and velocities [m/s] from the exact ones, across the line too; all falls with ``fall`` [m/s^2].

    Places may be off by ``gaps`` [m] besides, the sum of the gaps that count as none.
    """
    engine, bodies = scene.engine(**way)
    if fall:
        gravity = engine.add_law("basic:planet_gravity", acceleration=fall)
        for body in bodies:
            engine.map(body, gravity)
    engine.run(until=until)
    positions, velocities = states(bodies)
    positions += [0.0, 0.0, 0.5 * fall * until * until]
    velocities += [0.0, 0.0, fall * until]
    found = np.abs(positions - np.outer(exact[0], along)).max(), np.abs(velocities - np.outer(exact[1], along)).max()
    return float(max(found[0] - gaps, found[1]))


def cradle(count: int, strikers: int, gap: Any) -> tuple[list[float], list[float]]:
    """Places and speeds of ``count`` balls, the last of them from 0 on; the first ``strikers`` touch one another and come in at 1 m/s."""
    places = [-1.0 - 2 * RADIUS * k for k in reversed(range(strikers))]
    here = 0.0
    for k in range(count - strikers):
        places.append(here)
        here += 2 * RADIUS + gap(k)
    return places, [1.0] * strikers + [0.0] * (count - strikers)


CASES = [(n, k) for n in (2, 3, 5, 6, 8, 13, 20) for k in (1, 2, 3, 5) if k < n]


@by_all_ways
@pytest.mark.parametrize(("count", "strikers"), CASES)
def test_a_cradle_of_balls_that_touch_is_exact(count: int, strikers: int, way: dict[str, Any]) -> None:
    places, speeds = cradle(count, strikers, lambda k: 0.0)
    for direction in DIRECTIONS[: 1 + count % 3]:
        balls, along = on_a_line(places, speeds, direction)
        exact = rods(places, speeds, 1.5)
        assert deviation(Scene(balls), 1.5, along, exact, way) < ASKED


@pytest.mark.stress
@by_all_ways
@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("fall", [0.0, 9.81])
def test_all_cradles_are_exact(direction: Any, fall: float, way: dict[str, Any]) -> None:
    for count in range(2, 21):
        for strikers in range(1, min(6, count)):
            places, speeds = cradle(count, strikers, lambda k: 0.0)
            balls, along = on_a_line(places, speeds, direction)
            assert deviation(Scene(balls), 1.5, along, rods(places, speeds, 1.5), way, fall) < ASKED


@by_all_ways
@pytest.mark.parametrize("gap", [1e-15, 1e-13, 1e-12, 1e-11, 1e-9, 1e-6, 1e-2])
@pytest.mark.parametrize("strikers", [1, 2, 5])
def test_a_cradle_with_unequal_gaps_is_exact(gap: float, strikers: int, way: dict[str, Any]) -> None:
    for count in (strikers + 2, 12):
        places, speeds = cradle(count, strikers, lambda k: gap * (1 + k % 3))
        for direction in ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)):
            balls, along = on_a_line(places, speeds, direction)
            assert deviation(Scene(balls), 1.5, along, rods(places, speeds, 1.5), way, gaps=ignored(places)) < ASKED


def ignored(places: Sequence[float]) -> float:
    gaps = [b - a - 2 * RADIUS for a, b in itertools.pairwise(places)]
    return math.fsum(gap for gap in gaps if 0.0 < gap <= TOUCH)


@by_all_ways
@pytest.mark.parametrize("fall", [0.0, 9.81])
def test_a_slanted_cradle_with_small_gaps_is_exact_be_it_falling(fall: float, way: dict[str, Any]) -> None:
    for gap in (1e-13, 1e-10, 1e-5):
        for direction in DIRECTIONS:
            places, speeds = cradle(9, 2, lambda k, gap=gap: gap * (1 + k % 2))
            balls, along = on_a_line(places, speeds, direction)
            assert deviation(Scene(balls), 1.5, along, rods(places, speeds, 1.5), way, fall, ignored(places)) < ASKED


@by_all_ways
@pytest.mark.parametrize("count", [4, 60])
@pytest.mark.parametrize("walled", [False, True])
def test_a_gas_of_rods_is_exact(count: int, walled: bool, way: dict[str, Any]) -> None:
    """Hundreds of impacts on a line, each ball with a speed of its own.

    No three meet at once: what touches is solved together, so that three that all approach do not simply exchange speeds.
    """
    chance = random.Random(count)
    places: list[float] = []
    here = 0.0
    for _ in range(count):
        here += 2 * RADIUS + chance.choice([1e-9, 1e-6, 1e-3, chance.uniform(0.01, 0.2)])
        places.append(here)
    speeds = [chance.uniform(-1.0, 1.0) for _ in places]
    ends = (places[0] - 0.3, places[-1] + 0.3)
    walls = [Wall("plane", (1.0, 0.0, 0.0, ends[0])), Wall("plane", (-1.0, 0.0, 0.0, -ends[1]))] if walled else []
    balls, along = on_a_line(places, speeds, (1.0, 0.0, 0.0))
    until = 3.0
    exact = rods(places, speeds, until, ends if walled else None)
    # Places of up to 18 m are rounded to 4e-15 at each of some 50 impacts in a row.
    assert deviation(Scene(balls, walls), until, along, exact, way) < ASKED


@by_all_ways
def test_many_cradles_far_apart_at_one_instant_are_all_exact(way: dict[str, Any]) -> None:
    """12 cradles of 5, as many balls as the compiled stepper asks for; all are struck at once."""
    places, speeds = cradle(5, 1, lambda k: 0.0)
    balls = []
    for row in range(12):
        line, _ = on_a_line(places, speeds, (1.0, 0.0, 0.0))
        balls += [Ball(b.radius, b.mass, (b.position[0], 0.5 * row, 0.0), b.velocity) for b in line]
    engine, bodies = Scene(balls).engine(**way)
    engine.run(until=1.5)
    positions, velocities = states(bodies)
    exact = rods(places, speeds, 1.5)
    for row in range(12):
        here = slice(5 * row, 5 * row + 5)
        assert (
            np.abs(positions[here, 0] - exact[0]).max() < ASKED and np.abs(velocities[here, 0] - exact[1]).max() < ASKED
        )
        assert np.all(positions[here, 1] == 0.5 * row) and not velocities[here, 1:].any()


@by_all_ways
@pytest.mark.parametrize("masses", [(1.0, 2.0, 1.0), (3.0, 1.0, 1.0, 1.0, 7.0), (1.0, 1e6, 1.0), (1e2, 1.0, 1e2)])
def test_unequal_cradles_with_gaps_go_through_their_impacts_one_by_one(
    masses: Sequence[float], way: dict[str, Any]
) -> None:
    """On a line, in fractions."""
    places = [-1.0, *(0.25 * k + 0.01 * math.sin(k) for k in range(len(masses) - 1))]  # no three at once
    speeds = [1.0] + [0.0] * (len(masses) - 1)
    until = 2.0
    exact_places, exact_speeds = line_of_fractions(places, speeds, masses, until)
    balls = [Ball(RADIUS, m, (x, 0.0, 0.0), (v, 0.0, 0.0)) for x, v, m in zip(places, speeds, masses, strict=True)]
    engine, bodies = Scene(balls).engine(**way)
    engine.run(until=until)
    positions, velocities = states(bodies)
    assert positions[:, 0] == pytest.approx(exact_places, abs=1e-12) and velocities[:, 0] == pytest.approx(
        exact_speeds, abs=1e-12
    )


def line_of_fractions(
    places: Sequence[float], speeds: Sequence[float], masses: Sequence[float], until: float
) -> tuple[list[float], list[float]]:
    """Balls on a line at ``until`` [s], without a rounding."""
    x, v, m = ([Fraction(c) for c in row] for row in (places, speeds, masses))
    now, end = Fraction(0), Fraction(until)
    for _ in range(1000):
        due = [
            ((x[k + 1] - x[k] - 2 * Fraction(RADIUS)) / (v[k] - v[k + 1]), k)
            for k in range(len(x) - 1)
            if v[k] > v[k + 1]
        ]
        step = min(due)[0] if due else end - now
        if now + step >= end:
            break
        x = [a + step * b for a, b in zip(x, v, strict=True)]
        now += step
        k = min(due)[1]
        mean = (m[k] * v[k] + m[k + 1] * v[k + 1]) / (m[k] + m[k + 1])
        v[k], v[k + 1] = 2 * mean - v[k], 2 * mean - v[k + 1]
    return [float(a + (end - now) * b) for a, b in zip(x, v, strict=True)], [float(b) for b in v]


def rack(gap: float, seed: int) -> Scene:
    """A cue ball before a triangle of 15, about ``gap`` [m] between neighbours."""
    chance = random.Random(seed)
    step = 2 * RADIUS + gap
    places = [(row * step * math.sqrt(0.75), step * (k - row / 2), 0.0) for row in range(5) for k in range(row + 1)]
    balls = [
        Ball(RADIUS, 1.0, tuple(c + gap * chance.uniform(-0.1, 0.1) for c in place), (0.0, 0.0, 0.0))
        for place in places
    ]
    return Scene([Ball(RADIUS, 1.0, (-1.0, 0.01, 0.003), (5.0, 0.0, 0.0)), *balls])


@by_all_ways
@pytest.mark.parametrize("seed", range(3))
def test_a_break_run_backwards_comes_back(seed: int, way: dict[str, Any]) -> None:
    """Through some tens of impacts; each enlarges a deviation by about 2 l / r, l the way since the last."""
    scene = rack(0.02, seed)
    start = np.array([ball.position for ball in scene.balls]), np.array([ball.velocity for ball in scene.balls])
    engine, bodies = scene.engine(**way)
    engine.run(until=0.26)
    there = engine.explain().data["contacts"]["impacts"]
    assert there >= 10 and len(bodies) == 16
    for body in bodies:
        body.velocity = tuple(-c for c in body.velocity)
    engine.run(until=0.52)
    assert engine.explain().data["contacts"]["impacts"] == 2 * there
    positions, velocities = states(bodies)
    assert np.abs(positions - start[0]).max() < 1e-11 and np.abs(velocities + start[1]).max() < 1e-9


@by_all_ways
@pytest.mark.parametrize("strikers", [1, 3])
def test_a_tight_break_keeps_energy_and_momentum(strikers: int, way: dict[str, Any]) -> None:
    """Balls that touch, 30 contacts at one instant, among others far off."""
    scene = rack(0.0, 1)
    balls = [*scene.balls]
    for k in range(1, strikers):
        balls.append(Ball(RADIUS, 1.0, (-1.0 - 0.3 * k, 0.0, 0.0), (5.0, 0.0, 0.0)))
    balls += [Ball(RADIUS, 1.0, (5.0 + 0.5 * k, 9.0, 0.0), (0.0, 0.0, 0.0)) for k in range(30)]
    engine, _ = Scene(balls).engine(**way)
    energy, momentum = engine.energy().total, engine.momentum()
    engine.run(until=1.0)
    assert engine.energy().total == pytest.approx(energy, rel=1e-13)
    assert engine.momentum() == pytest.approx(momentum, abs=1e-13 * 5.0 * strikers)


def test_the_exact_answers_agree_where_both_are_known() -> None:
    """Rods by exchange, and balls by fractions impact by impact."""
    chance = random.Random(4)
    places = [0.5 * k + chance.uniform(0.0, 0.2) for k in range(6)]
    speeds = [chance.uniform(-1.0, 1.0) for _ in places]
    by_exchange = rods(places, speeds, 3.0)
    by_impacts = line_of_fractions(places, speeds, [1.0] * 6, 3.0)
    assert by_exchange[0] == pytest.approx(by_impacts[0], rel=1e-15) and by_exchange[1] == pytest.approx(
        by_impacts[1], rel=1e-15
    )
