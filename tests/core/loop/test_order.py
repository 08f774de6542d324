"""Second order in the step, down to the rounding of the answer; contacts and conditions between the steps of loops."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

import xpheve as xp


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A cache of compiled loops of its own."""
    home = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XPHEVE_CACHE_DIR", str(home))
        yield home


class Breeze(xp.FieldLaw):
    """Drag towards a wind that swells with time."""

    id = "order:breeze"
    wind = xp.Param((2.0, -1.0, 0.5), unit="m/s")
    rate = xp.Param(3.0, unit="1/s")
    drag = xp.Param(0.3, unit="N*s/m")

    def force(self, body: Any) -> Any:
        """Drag [N]."""
        return -self.drag * (body.velocity - np.multiply(np.sin(self.rate * body.time), self.wind))


def dragged(engine: xp.PhysicsEngine) -> None:
    drag = engine.add_law("basic:quadratic_drag")
    engine.add_object(xp.PhysicalObject(mass=1.0, velocity=(3.0, 4.0, 0.0), drag_area=1.0, name="a"), [drag])


def blown(engine: xp.PhysicsEngine) -> None:
    laws = [engine.add_law("basic:quadratic_drag"), engine.add_law(Breeze)]
    laws.append(engine.add_law("basic:spring_to_point", stiffness=4.0))
    thing = xp.PhysicalObject(mass=1.0, velocity=(3.0, 4.0, 0.0), position=(1.0, 0.0, -1.0), drag_area=0.3, name="a")
    engine.add_object(thing, laws)


def damped(engine: xp.PhysicsEngine) -> None:
    a = engine.add_object(xp.PhysicalObject(mass=1.0, position=(1.0, 0.0, 0.0), velocity=(0.0, 1.0, 0.3), name="a"))
    b = engine.add_object(xp.PhysicalObject(mass=2.0, position=(-1.0, 0.5, 0.0), velocity=(1.0, 0.0, 0.0), name="b"))
    engine.add_law("basic:damper", pairs=[(a, b)], damping=0.7)
    engine.add_law("basic:spring", pairs=[(a, b)], stiffness=3.0, rest_length=1.0)
    for obj in (a, b):
        obj.add_force((0.1, 0.2, 0.3))


@pytest.mark.parametrize("scene", [dragged, blown, damped])
def test_halving_the_step_quarters_the_error(scene: Any) -> None:
    def ends(steps: int) -> np.ndarray:
        engine = xp.PhysicsEngine(compile="always")
        scene(engine)
        engine.run(until=1.0, dt=1.0 / steps)
        return np.array([[*obj.position, *obj.velocity] for obj in engine.objects])

    truth = ends(1 << 19)
    errors = [float(np.abs(ends(1 << k) - truth).max()) for k in (8, 9, 12, 13, 14)]
    ratios = [a / b for a, b in itertools.pairwise(errors)]
    assert 3.7 < ratios[0] < 4.3 and 60.0 < ratios[1] < 68.0 and 3.99 < ratios[2] < 4.01, ratios
    assert errors[-1] < 1e-8
    floor = errors[-2] / float(np.abs(ends(1 << 18) - truth).max())
    assert 1350.0 < floor < 1380.0  # (4^-13 - 4^-19) / (4^-18 - 4^-19): a quarter of a million roundings do not add up


def test_a_million_steps_lose_nothing_that_the_method_does_not() -> None:
    """A spring at steps so small that the method is all but exact; the same steps without remainders lose fifty times as much."""
    dt, steps, rate = 2.0**-18, 1 << 20, 9.0
    engine = xp.PhysicsEngine(compile="always", stepper="core:midpoint")
    spring = engine.add_law("basic:spring_to_point", stiffness=rate)
    thing = engine.add_object(xp.PhysicalObject(mass=1.0, position=(1.0, 0.0, 0.0), velocity=(0.0, 2.0, 0.5)), [spring])
    engine.run(until=steps * dt, dt=dt)
    # Drift-kick-drift turns the phase of a step by 2 asin(w h / 2), on an ellipse v^2 + w^2 (1 - (w h / 2)^2) x^2.
    omega = math.sqrt(rate)
    half = 0.5 * omega * dt
    phase = steps * 2.0 * math.asin(half)
    root = math.sqrt(1.0 - half * half)
    start = [(1.0, 0.0), (0.0, 2.0), (0.0, 0.5)]
    exact = [x * math.cos(phase) + v * root / omega * math.sin(phase) for x, v in start]
    error = max(abs(a - b) for a, b in zip(thing.position, exact, strict=True))
    x, v = [x for x, _ in start], [v for _, v in start]
    for _ in range(steps):
        for k in (0, 1):
            a = -rate * (x[k] + 0.5 * dt * v[k])
            x[k] += dt * (v[k] + 0.5 * dt * a)
            v[k] += dt * a
    plain = max(abs(a - b) for a, b in zip(x[:2], exact, strict=False))
    assert error < 4e-15
    assert plain > 50.0 * error


def over_a_metre(body: Any) -> Any:
    """Height [m] over one metre."""
    return body.position[:, 2] - 1.0


class Heard(xp.PhysicalLaw):
    """Notes when a height was crossed."""

    id = "order:heard"
    condition = xp.when.Crosses(over_a_metre)
    initial_state: ClassVar[dict[str, Any]] = {"times": []}

    def enforce_this_law(self, event: Any) -> None:
        """Note the time."""
        self.state["times"] = [*self.state["times"], event.time]


def watched(compile: str, every: float | None = None) -> list[Any]:
    engine = xp.PhysicsEngine(compile=compile, up="z")
    weight, drag = engine.add_law("basic:planet_gravity"), engine.add_law("basic:quadratic_drag")
    bounce, heard = engine.add_law("collision:elastic", restitution=0.8), engine.add_law(Heard)
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True, name="floor"), [bounce])
    for k in range(5):
        ball = xp.PhysicalObject(
            xp.Sphere(0.1),
            mass=0.1,
            position=(k, 0.0, 1.5 + 0.3 * k),
            velocity=(0.0, 0.3, 0.0),
            drag_area=0.03,
            name=f"b{k}",
        )
        engine.add_object(ball, [weight, drag, bounce, heard] if k < 4 else [weight, drag])
    engine.run(until=2.0, dt=0.01, every=every)
    return [
        *[tuple(x.hex() for x in (*obj.position, *obj.velocity)) for obj in engine.objects],
        [time.hex() for time in heard.state["times"]],
        *[x.hex() for x in engine.energy()],
    ]


def test_impacts_and_crossings_between_steps_have_the_same_bits_compiled() -> None:
    plain = watched("never")
    assert len(plain[6]) > 4
    assert watched("always") == plain
    assert watched("always", 0.0123) == plain
