"""Where moving sources are, as loops see it: the same as their steppers say, to rounding, whoever asked before."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.compile import assemble, compiled, interpreted
from xpheve.kernels.course import follow
from xpheve.plan.courses import Courses
from xpheve.plugins.registry import Registry

DRIVER = """
def entry(f, n):
    d = n[2]
    s = f[0]
    return forces(f, n, 0, d[2], d[3], d[4], s[d[5]])
"""


class Chase(xp.PairLaw):
    """A spring and a damper between source and target."""

    id = "test:chase"
    k, c = xp.Param(2.0, unit="N/m"), xp.Param(0.3, unit="N s/m")

    def force(self, a: Any, b: Any) -> Any:
        return self.k * (b.position - a.position) + self.c * (b.velocity - a.velocity)


def scene(registry: Registry, law: str) -> tuple[xp.PhysicsEngine, xp.PhysicalObject, list[xp.PhysicalObject]]:
    """Return a source on a spring, and its targets."""
    engine = xp.PhysicsEngine(registry=registry)
    engine.add_law(law, name="spring")
    sun = engine.add_object(xp.PhysicalObject(name="sun", position=(1, 0.5, 0), velocity=(0, 0.2, 1)), laws=["spring"])
    dust = [
        engine.add_object(xp.PhysicalObject(name=f"d{k}", position=(k, 2, 0), velocity=(0, k, 1))) for k in range(3)
    ]
    engine.add_law(Chase(between=([sun], dust), one_sided=True))
    return engine, sun, dust


def place_of(courses: Courses, row: int, t: float) -> Any:
    """Return place and velocity of ``row`` at ``t`` as the kernel gives them."""
    s = [0.0] * 6
    follow(s, courses.numbers({row: 0}).tolist(), 1, 1, 0, 3, 1, t)
    return s


@pytest.mark.parametrize("until", [0.25, 3.0])
def test_a_course_is_the_way_of_its_source(registry: Registry, spring: str, until: float) -> None:
    engine, sun, _ = scene(registry, spring)
    engine.run(until=until)
    world: Any = engine._world
    courses = Courses(world, np.array([sun._row]))
    flight = world.flight(sun._row)
    begin = flight.t0 if spring != "curves:pull" else world.time
    end = flight.t1 if spring != "curves:pull" else (begin[0] + 50.0, 0.0)
    assert courses.reach(begin, end, end) == end
    for t in np.linspace(begin[0], end[0], 101).tolist():
        exact = [*world.read_row(sun._row, "position", (t, 0.0)), *world.read_row(sun._row, "velocity", (t, 0.0))]
        assert place_of(courses, sun._row, t) == pytest.approx(exact, abs=3e-14)


def test_a_course_is_the_same_to_the_bit_whoever_asked_before(registry: Registry) -> None:
    engine, sun, _ = scene(registry, "curves:pull")
    engine.run(until=0.1)
    world: Any = engine._world
    found = []
    for begins in ([0.1, 40.0, 71.3], [71.3], [0.1]):
        courses = Courses(world, np.array([sun._row]))
        for begin in begins:
            courses.reach((begin, 0.0), (90.0, 0.0), (90.0, 0.0))
        found.append([place_of(courses, sun._row, t) for t in np.linspace(71.3, 90.0, 50).tolist()])
    assert found[0] == found[1] == found[2]


def test_a_straight_way_takes_few_pieces() -> None:
    engine = xp.PhysicsEngine()
    sun = engine.add_object(xp.PhysicalObject(velocity=(1, 2, 3)))
    dust = engine.add_object(xp.PhysicalObject(position=(0, 1, 0)))
    engine.add_law(Chase(between=(sun, dust), one_sided=True))
    engine.run(until=1.0, dt=0.1)
    courses = Courses(engine._world, np.array([sun._row]))
    courses.reach((1.0, 0.0), (1e5, 0.0), (1e5, 0.0))
    assert place_of(courses, sun._row, 1e5) == pytest.approx([1e5, 2e5, 3e5, 1, 2, 3], rel=1e-15)
    assert len(courses.numbers({sun._row: 0})) < 20 * 160


@pytest.mark.parametrize("now", [0.3, 0.41])
def test_forces_in_a_loop_are_those_of_the_laws(registry: Registry, spring: str, now: float) -> None:
    engine, sun, dust = scene(registry, spring)
    engine.run(until=0.25)
    world: Any = engine._world
    covered = world.flight(sun._row).t1
    now = min(now, covered[0])
    batch = world.batches[int(world.bodies.batch[dust[0]._row])]
    sources = world.sources(batch)
    sources.courses.reach((0.25, 0.0), (now, 0.0), (now, 0.0))
    motion = sources.motion
    assert (motion.rows, motion.moving) == (4, 3) and motion.reads_time and motion.works
    found = {name: world.read_all(name, world.time)[:, batch.state.rows] for name in ("position", "velocity")}
    found |= {"orientation": np.zeros((4, 3)), "angular_velocity": np.zeros((3, 3))}
    x, v = motion.pack(found, world.time)
    ends = []
    for run in (interpreted, compiled):
        size = x.size
        s = np.concatenate([x.ravel(), v.ravel(), np.zeros(size), np.zeros(size), [now]])
        d = np.array([0, 0, size, 2 * size, 3 * size, 4 * size], dtype=np.int64)
        whole = [motion._lists[0], motion._lists[1], d, *motion._lists[3:]]
        places = {int(row): motion.moving + k for k, row in enumerate(motion.held.sources.tolist())}
        floats = [motion._parameters(), np.zeros(1), motion._constants(), sources.courses.numbers(places)]
        run(assemble(motion.text.text() + DRIVER, {}))([s, *floats], whole)
        ends.append(s)
    assert ends[0].tobytes() == ends[1].tobytes()
    found["position"], found["velocity"] = (motion.unpack(one) for one in (x, v))
    force, _, _ = sources.evaluate(batch.state.rows, (now, 0.0), found)
    a, w = ends[0][2 * x.size : 3 * x.size].reshape(3, 4), ends[0][3 * x.size : 4 * x.size].reshape(3, 4)
    np.testing.assert_allclose(motion.unpack(a), force, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(motion.unpack(w), force, rtol=1e-13, atol=1e-13)
    assert math.isfinite(ends[0].sum())
