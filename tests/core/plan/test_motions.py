"""The forces that drivers call are those that laws give, interpreted and compiled, for rows that are carried along and rows that turn."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.compile import assemble, compiled, interpreted
from xpheve.kernels.clock import START
from xpheve.kernels.turning import spin_of
from xpheve.laws import FieldLaw, PairLaw, Param
from xpheve.plan.motions import Motion

DRIVER = """
def entry(f, n):
    d = n[2]
    return forces(f, n, 0, d[2], d[3], d[4], 0.25)
"""
STATE = ("position", "velocity", "orientation", "angular_velocity")


class Gust(FieldLaw):
    """A wind that turns with time, against the velocity."""

    strength = Param(0.3, unit="kg/s")
    rate = Param(1.0, unit="1/s")

    def force(self, body: Any) -> Any:
        slow = np.cos(body.time * self.rate)
        return -self.strength * body.velocity * slow


class Keel(FieldLaw):
    """Turns the body's x to where z points, and damps the spin."""

    stiffness = Param(2.0, unit="N m")
    damping = Param(0.1, unit="N m s")

    def torque(self, body: Any) -> Any:
        up = xp.vector(0.0, 0.0, 1.0)
        axis = body.to_world(xp.vector(1.0, 0.0, 0.0))
        return self.stiffness * axis.cross(up) - self.damping * body.angular_velocity


class Pull(PairLaw):
    """A spring of length 0 that is stronger for heavy bodies."""

    stiffness = Param(1.5, unit="N/(kg m)")

    def force(self, a: Any, b: Any) -> Any:
        return -self.stiffness * a.mass * (a.position - b.position)

    def potential(self, a: Any, b: Any) -> Any:
        d = a.position - b.position
        return 0.5 * self.stiffness * a.mass * d.dot(d)


def scene(seed: int, turning: bool, fixed: bool) -> xp.PhysicsEngine:
    rng = np.random.default_rng(seed)
    engine = xp.PhysicsEngine(up="z")
    laws = [
        engine.add_law("basic:universal_gravity", gravitational_constant=1.0, softening=0.1),
        engine.add_law(Gust()),
    ]
    laws += [engine.add_law(Keel())] if turning else []
    bodies = [
        engine.add_object(
            xp.PhysicalObject(
                position=tuple(rng.normal(size=3)),
                velocity=(0, 0, 0) if fixed and k == 2 else tuple(rng.normal(size=3)),
                angular_velocity=(0, 0, 0) if fixed and k == 2 else tuple(rng.normal(size=3)),
                mass=float(rng.uniform(1, 3)),
                inertia=(1.0, 2.0, 2.5),
                fixed=fixed and k == 2,
            ),
            laws=laws if k % 2 else laws[:1] + laws[2:],
        )
        for k in range(7)
    ]
    bodies[1].add_force((0.1, 0.2, 0.3))
    pull = engine.add_law(Pull, pairs=[(bodies[0], bodies[3]), (bodies[4], bodies[2])])
    for body in (bodies[0], bodies[3], bodies[4], bodies[2]):
        engine.map(body, pull)
    return engine


def motion_of(engine: xp.PhysicsEngine) -> tuple[Motion, Any, dict[str, Any]]:
    world = engine._world
    world.plan()
    batch = max(world.batches, key=lambda one: one.state.count)
    sources = world.sources(batch)
    assert sources is not None
    return sources.motion, sources, {name: world.bodies.arrays[name][:, batch.state.rows] for name in STATE}


def evaluate(motion: Motion, found: dict[str, Any], run: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Places, velocities, accelerations and working forces, (width, N), by ``run`` of the text."""
    x, v = motion.pack(found, START)
    size, rows = x.size, motion.rows
    s = np.concatenate([x.ravel(), v.ravel(), np.full(size, np.nan), np.full(3 * rows, np.nan)])
    d = np.array([0, 0, size, 2 * size, 3 * size], dtype=np.int64)
    text = assemble(motion.text.text() + DRIVER, {})
    whole = [motion._lists[0], motion._lists[1], d, *motion._lists[3:]]
    assert run(text)([s, motion._parameters(), np.zeros(1), motion._constants(), np.zeros(1)], whole) == motion.moving
    parts = s[: 3 * size].reshape(3, motion.components, rows)
    return parts[0], parts[1], parts[2], s[3 * size :].reshape(3, rows)


@pytest.mark.parametrize("fixed", [False, True])
@pytest.mark.parametrize("turning", [False, True])
@pytest.mark.parametrize("seed", [1, 2])
def test_forces_are_those_of_the_laws(seed: int, turning: bool, fixed: bool) -> None:
    engine = scene(seed, turning, fixed)
    motion, sources, found = motion_of(engine)
    assert motion.components == (7 if turning else 3) and motion.works
    assert motion.rows == 7 and motion.moving == (6 if fixed else 7)
    x, v, a, w = evaluate(motion, found, interpreted)
    force, torque, _ = sources.evaluate(sources.rows, (0.25, 0.0), found)
    arrays, rows = engine._world.bodies.arrays, sources.rows
    expected = (arrays["force"][:, rows] + force) / arrays["mass"][:, rows]
    np.testing.assert_allclose(motion.unpack(a[:3]), expected, rtol=1e-13, atol=1e-13)
    working = sources.working + arrays["working"][:, rows]
    np.testing.assert_allclose(motion.unpack(w), working, rtol=1e-13, atol=1e-13)
    assert (a[:, motion.moving :] == 0.0).all()
    if turning:  # a small step by q'' changes the angular velocity as Euler's equations say
        from xpheve.kernels.quaternion import rotate, rotate_inverse

        q, rate, bend = (motion.unpack(one[3:]) for one in (x, v, a))
        for k in range(motion.moving):
            h = 1e-6
            ahead = q[:, k] + h * rate[:, k] + 0.5 * h * h * bend[:, k]
            spin = np.array(spin_of(tuple(ahead), tuple(rate[:, k] + h * bend[:, k])))
            w0, t = rotate_inverse(tuple(q[:, k]), tuple(found["angular_velocity"][:, k])), None
            t = rotate_inverse(tuple(q[:, k]), tuple(torque[:, k]))
            moments = np.array([1.0, 2.0, 2.5])
            euler = rotate(tuple(q[:, k]), tuple((np.array(t) - np.cross(w0, moments * w0)) / moments))
            np.testing.assert_allclose((spin - found["angular_velocity"][:, k]) / h, euler, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("turning", [False, True])
def test_compiled_forces_have_the_bits_of_interpreted_ones(turning: bool) -> None:
    motion, _, found = motion_of(scene(3, turning, True))
    by_python, by_machine = (evaluate(motion, found, run) for run in (interpreted, compiled))
    for one, other in zip(by_python, by_machine, strict=True):
        assert one.tobytes() == other.tobytes()


def test_a_body_that_no_law_turns_is_carried_with_three_components_and_keeps_its_closed_form() -> None:
    motion, _, _ = motion_of(scene(4, False, False))
    assert motion.components == 3


def test_what_a_motion_reads_is_known() -> None:
    motion, _, _ = motion_of(scene(5, False, False))
    assert motion.reads_velocity and motion.reads_time
    engine = xp.PhysicsEngine()
    pull = engine.add_law("basic:universal_gravity")
    for x in (0.0, 1.0):
        engine.add_object(xp.PhysicalObject(position=(x, 0, 0)), laws=[pull])
    motion, _, _ = motion_of(engine)
    assert not (motion.reads_velocity or motion.reads_time or motion.works)


def test_a_driver_is_compiled_once_for_all_laws() -> None:
    from xpheve.compile import facts

    for exponent in (0.11, 0.12):  # two law sets whose texts differ
        engine = xp.PhysicsEngine(compile="always", stepper="core:symplectic4")
        spring = engine.add_law("basic:spring_to_point", rest_length=exponent)
        drawn = [spring] if exponent == 0.11 else [spring, engine.add_law("basic:universal_gravity")]
        for x in (1.0, 2.0):
            engine.add_object(xp.PhysicalObject(position=(x, 0, 0)), laws=drawn)
        engine.run(until=0.1, dt=0.01)
    said = [one["what"] for one in facts() if one["origin"] != "interpreted"]
    assert said.count("driver composition") == 1
    assert {"forces: basic:spring_to_point", "forces: basic:spring_to_point + basic:universal_gravity"} <= set(said)
