"""The driver of implicit steps: order of convergence for each number of stages, its polynomials, damping, and how it gives up."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.kernels.clock import START, multiple
from xpheve.laws import FieldLaw, Param
from xpheve.loop.drivers import implicit as at
from xpheve.steppers.implicit import _Buffers


class Duffing(FieldLaw):
    """x'' = -x^3 - c x' + cos t: nonlinear, damped and driven, so that places, velocities and time all count."""

    hardness = Param(1.0, unit="N/m^3")
    damping = Param(0.3, unit="kg/s")
    drive = Param(1.0, unit="N")
    rate = Param(1.0, unit="1/s")

    def force(self, body: Any) -> Any:
        r = body.position
        push = xp.vector(1.0, 0.0, 0.0) * (self.drive * np.cos(body.time * self.rate))
        return -self.hardness * r.dot(r) * r - self.damping * body.velocity + push


class Run:
    """A driver with one body, under ``law``, ready to step."""

    def __init__(
        self, law: FieldLaw, stages: int, position: Any = (1.0, 0.2, 0.0), velocity: Any = (0.0, 0.5, 0.0)
    ) -> None:
        engine = xp.PhysicsEngine(up="z", compile="never")
        engine.stepper = "core:implicit"
        engine.add_object(xp.PhysicalObject(position=position, velocity=velocity), laws=[engine.add_law(law)])
        world = engine._world
        world.plan()
        (batch,) = [one for one in world.batches if one.state.count]
        sources = world.sources(batch)
        assert sources is not None
        self.motion = sources.motion
        self.held = _Buffers(self.motion)
        self.held.load(batch.state, self.motion, START, world.bodies)  # type: ignore[arg-type]
        self.s, self.d = self.held.s, self.held.d
        self.d[at.STAGES] = self.d[at.LEAST] = self.d[at.MOST] = stages
        self.s[at.RTOL], self.s[at.ATOL], self.s[at.WALL] = 1e-13, 1e-16, np.inf

    def steps(self, h: float, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Place and velocity after ``count`` steps of ``h``."""
        self.d[at.FIXED] = 1
        self.s[at.GRID] = h
        self.s[at.NEED : at.NEED + 2] = multiple(START, count, h)
        while self.go() == at.PAUSED:
            pass
        assert self.d[at.STEPS] == count
        return self.state()

    def to(self, t: float) -> int:
        self.s[at.NEED] = t
        status = at.PAUSED
        while status == at.PAUSED:
            status = self.go()
        return status

    def go(self) -> int:
        return int(self.motion.run("implicit", self.s, self.d))

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        return self.held.vector(at.X)[:, 0].copy(), self.held.vector(at.V)[:, 0].copy()


@pytest.mark.parametrize(("stages", "counts"), [(3, (16, 32, 64)), (5, (5, 8, 12)), (7, (3, 4, 6))])
def test_order_is_twice_the_stages_less_one(stages: int, counts: tuple[int, ...]) -> None:
    end = 3.2
    exact = np.concatenate(Run(Duffing(), 7).steps(end / 64, 64))
    errors = [np.abs(np.concatenate(Run(Duffing(), stages).steps(end / one, one)) - exact).max() for one in counts]
    orders = -np.diff(np.log(errors)) / np.diff(np.log(counts))
    assert (np.abs(orders - (2 * stages - 1)) < 1.5).all(), (orders, errors)


@pytest.mark.parametrize("stages", [3, 5, 7])
def test_polynomials_of_a_step_join_without_a_bend(stages: int) -> None:
    run = Run(Duffing(), stages)
    run.steps(0.3, 2)
    v0, q = run.held.vector(at.V_BEGIN)[:, 0], run.held.curve().reshape(7, 3)
    x0, h = run.held.vector(at.X_BEGIN)[:, 0], run.s[at.LAST]
    x1, v1 = run.state()
    np.testing.assert_allclose(v0 + q.sum(axis=0), v1, atol=1e-14)
    np.testing.assert_allclose(x0 + h * (v0 + (q / np.arange(2, 9)[:, None]).sum(axis=0)), x1, atol=1e-14)
    # the velocity's polynomial goes the way of the force at the last node, which is the end
    slope = (q * np.arange(1, 8)[:, None]).sum(axis=0) / h
    np.testing.assert_allclose(slope, run.held.vector(at.A)[:, 0], atol=1e-11)


@pytest.mark.parametrize("stages", [3, 5, 7])
def test_what_is_infinitely_stiff_is_damped_at_once(stages: int) -> None:
    law = Duffing(hardness=0.0, damping=1e12, drive=0.0)
    run = Run(law, stages, position=(0.0, 0.0, 0.0), velocity=(1.0, 2.0, 3.0))
    x, v = run.steps(1.0, 1)
    assert (np.abs(v) < 1e-10).all() and (np.abs(x) < 1e-10).all()


@pytest.mark.parametrize(("stages", "rtol"), [(3, 1e-4), (3, 1e-8), (5, 1e-4), (5, 1e-8), (7, 1e-6), (7, 1e-12)])
def test_tolerances_are_kept(stages: int, rtol: float) -> None:
    end = 10.0
    exact = Run(Duffing(), 7)
    exact.s[at.RTOL], exact.s[at.ATOL], exact.s[at.WALL] = 1e-14, 1e-16, end
    run = Run(Duffing(), stages)
    run.s[at.RTOL], run.s[at.ATOL], run.s[at.WALL] = rtol, rtol, end
    assert exact.to(end) == run.to(end) == at.DONE
    assert run.s[at.TIME] == end
    for one, other in zip(run.state(), exact.state(), strict=True):
        np.testing.assert_allclose(one, other, atol=50.0 * rtol)


def test_a_wall_is_hit_and_costs_the_next_step_nothing() -> None:
    run = Run(Duffing(), 5)
    run.s[at.RTOL] = run.s[at.ATOL] = 1e-6
    run.s[at.WALL] = 5.0
    assert run.to(5.0) == at.DONE and tuple(run.s[at.TIME : at.TIME + 2]) == (5.0, 0.0)
    wanted = run.s[at.NEXT]
    run.s[at.WALL] = 5.0 + 1e-3 * wanted
    assert run.to(5.0 + 1e-3 * wanted) == at.DONE
    assert run.s[at.NEXT] >= wanted


class Cliff(FieldLaw):
    """A force that is no number beyond a place."""

    push = Param(1.0, unit="N")
    size = Param(1.0, unit="m")

    def force(self, body: Any) -> Any:
        return xp.vector(1.0, 0.0, 0.0) * (self.push * np.sqrt(1.0 - body.position.x / self.size))


def test_forces_that_end_stop_the_steps_just_before() -> None:
    run = Run(Cliff(), 5, position=(0.0, 0.0, 0.0), velocity=(1.0, 0.0, 0.0))
    run.s[at.RTOL] = run.s[at.ATOL] = 1e-6
    assert run.to(2.0) == at.STUCK
    assert 0.99 < run.state()[0][0] <= 1.0
    assert run.d[at.LAST_ROW] == 0
