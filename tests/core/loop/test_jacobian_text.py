"""Derivatives of accelerations are those of the forces: against differences of `forces`, for fields, pairs, sources and laws that are off.

That both tiers give the same bits is held by `tests/core/steppers/test_implicit.py`, for whole runs.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.compile import assemble, interpreted
from xpheve.kernels.clock import START
from xpheve.laws import FieldLaw, PairLaw, Param
from xpheve.loop.drivers import driver_text
from xpheve.loop.drivers import implicit as at
from xpheve.loop.jacobian_text import DIFFERENCES, jacobian_text
from xpheve.plan.motions import Motion
from xpheve.steppers.implicit import _Buffers

ENTRY = """
def entry(f, n):
    d = n[2]
    jacobians(f, n, d[{x}], d[{v}], d[{matrices}], d[{matrices}] + d[{area}], 0.25)
    return forces(f, n, d[{x}], d[{v}], d[{a}], d[{w}], 0.25)
"""


class Curved(FieldLaw):
    """Depends on place, velocity, time, mass and a parameter, in all components."""

    k = Param(0.7, unit="N/m^3")
    c = Param(1.3, unit="N s^2/m^2")
    rate = Param(2.0, unit="1/s")

    def force(self, body: Any) -> Any:
        r, v = body.position, body.velocity
        swing = 1.5 + np.sin(body.time * self.rate)
        return -self.k * r.dot(r) * r * swing - self.c * v.norm() * v


class Rub(PairLaw):
    """Between two: a spring that hardens, and friction that grows with the distance; it reads the mass of one."""

    k = Param(2.0, unit="N/(m^3 kg)")
    c = Param(0.4, unit="kg/(m s)")

    def force(self, a: Any, b: Any) -> Any:
        d, w = a.position - b.position, a.velocity - b.velocity
        return -self.k * a.mass * d.dot(d) * d - self.c * d.norm() * w


def scene(seed: int, named: bool) -> tuple[xp.PhysicsEngine, list[Any]]:
    rng = np.random.default_rng(seed)
    engine = xp.PhysicsEngine(up="z")
    curved, drag = engine.add_law(Curved()), engine.add_law("basic:linear_drag")
    bodies = [
        engine.add_object(
            xp.PhysicalObject(
                position=tuple(rng.normal(size=3)),
                velocity=(0, 0, 0) if k == 3 else tuple(rng.normal(size=3)),
                mass=float(rng.uniform(0.5, 3.0)),
                fixed=k == 3,
            ),
            laws=[curved, drag] if k % 2 else [curved],
        )
        for k in range(6)
    ]
    pairs = [(bodies[0], bodies[4]), (bodies[1], bodies[3]), (bodies[4], bodies[5])]
    rub = engine.add_law(Rub, pairs=pairs) if named else engine.add_law(Rub)
    for body in bodies:
        engine.map(body, rub)
    return engine, bodies


class Runner:
    """Finds accelerations of a motion and their derivatives at any state, by ``run`` of the text."""

    def __init__(self, motion: Motion, run: Any, text: str = "") -> None:
        self.motion, self.held = motion, _Buffers(motion)
        self.held.s[at.NEXT], self.held.s[at.RTOL], self.held.s[at.ATOL] = 1.0, 1e-6, 1e-9
        entry = ENTRY.format(x=at.X, v=at.V, matrices=at.MATRICES, area=at.AREA, a=at.A, w=at.W_FORCE)
        functions = _functions() if text else ""
        self.kernel = run(assemble(motion.text.text() + (text or jacobian_text(motion.text)) + functions + entry, {}))

    def __call__(self, state: dict[str, Any]) -> tuple[Any, Any, Any]:
        """The matrices da/dx and da/dv of all blocks, one after another, and the accelerations."""
        held, motion = self.held, self.motion
        x, v = motion.pack(state, START)
        for name, values in ((at.X, x), (at.V, v)):
            held.vector(name)[...] = values
        first, area = int(held.d[at.MATRICES]), int(held.d[at.AREA])
        held.s[first : first + 2 * area] = 0.0
        buffers = [held.s, motion._parameters(), np.zeros(1), motion._constants(), np.zeros(1)]
        self.kernel(buffers, [motion._lists[0], motion._lists[1], held.d, *motion._lists[3:]])
        both = held.s[first : first + 2 * area].copy()
        return both[:area], both[area:], held.vector(at.A).copy()


def _functions() -> str:
    """The driver without its entry."""
    text = driver_text("implicit")
    begin = text.index("def entry(")
    return text[:begin] + text[text.index("def ", begin + 1) :]


def prepared(seed: int, named: bool) -> tuple[Motion, dict[str, Any]]:
    engine, _ = scene(seed, named)
    engine.stepper = "core:implicit"
    world = engine._world
    world.plan()
    batch = max(world.batches, key=lambda one: one.state.count)
    sources = world.sources(batch)
    assert sources is not None
    state = {name: world.bodies.arrays[name][:, batch.state.rows] for name in ("position", "velocity")}
    return sources.motion, state


@pytest.mark.parametrize("named", [False, True])
@pytest.mark.parametrize("seed", [1, 2])
def test_derivatives_are_those_of_the_forces(seed: int, named: bool) -> None:
    motion, state = prepared(seed, named)
    run = Runner(motion, interpreted)
    held = run.held
    by_x, by_v, _ = run(state)
    d, order = held.d, motion.held.order
    assert held.moving == 5 or named
    for matrix, name in ((by_x, "position"), (by_v, "velocity")):
        for block in range(int(d[at.BLOCKS])):
            first, count, place, _ = d[d[at.LISTS] + 4 * block : d[at.LISTS] + 4 * block + 4]
            members = d[first : first + count]
            found = matrix[place : place + 9 * count * count].reshape(3 * count, 3 * count)
            for column in range(3 * count):
                h = 1e-5
                parts = []
                for sign in (1.0, -1.0):
                    moved = {key: values.copy() for key, values in state.items()}
                    moved[name][column % 3, order[members[column // 3]]] += sign * h
                    parts.append(run(moved)[2])
                slope = (parts[0] - parts[1]) / (2.0 * h)
                expected = np.array([slope[r % 3, members[r // 3]] for r in range(3 * count)])
                np.testing.assert_allclose(found[:, column], expected, rtol=1e-6, atol=1e-7)


def test_differences_serve_where_no_trace_does() -> None:
    motion, state = prepared(3, True)
    for one, other in zip(
        Runner(motion, interpreted)(state)[:2], Runner(motion, interpreted, DIFFERENCES)(state)[:2], strict=True
    ):
        np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-5)
