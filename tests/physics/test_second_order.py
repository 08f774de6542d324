"""The second-order stepper: order in the step, what it keeps, tolerances, and impacts in the midst of steps."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

import xpheve as xp

Build = Callable[[], tuple[xp.PhysicsEngine, list[xp.PhysicalObject]]]


class Magnetic(xp.FieldLaw):
    """F = q v x B: of velocity, and does no work."""

    charge = xp.Param(2.0, unit="C", doc="q.")
    field = xp.Param((0.0, 0.0, 1.5), unit="T", doc="B.")

    def force(self, body: Any) -> Any:
        """Lorentz force [N]."""
        return self.charge * body.velocity.cross(self.field)


class Swing(xp.FieldLaw):
    """A force of time alone."""

    acceleration, frequency = xp.Constant((1.0, 0.0, 0.0), unit="m/s^2"), xp.Constant(3.0, unit="1/s")

    def force(self, body: Any) -> Any:
        """F = m cos(3 t) x [N]."""
        return body.mass * np.cos(self.frequency * body.time) * self.acceleration


def dragged() -> Any:
    engine = xp.PhysicsEngine(up="z", stepper="core:midpoint")
    laws = [engine.add_law("basic:planet_gravity"), engine.add_law("basic:linear_drag", coefficient=0.5)]
    return engine, [engine.add_object(xp.PhysicalObject(mass=2.0, velocity=(3, 0, 5)), laws=laws)]


def dragged_hard() -> Any:
    engine = xp.PhysicsEngine(up="z", stepper="core:midpoint")
    laws = [engine.add_law("basic:planet_gravity"), engine.add_law("basic:quadratic_drag")]
    return engine, [engine.add_object(xp.PhysicalObject(mass=0.1, velocity=(3, 0, 5), drag_area=0.05), laws=laws)]


def sprung() -> Any:
    engine = xp.PhysicsEngine(stepper="core:midpoint")
    law = engine.add_law("basic:spring_to_point", stiffness=9.0, rest_length=0.7, anchor=(0.1, 0.2, 0.3))
    return engine, [engine.add_object(xp.PhysicalObject(position=(1, 0, 0), velocity=(0, 1, 0.5)), laws=[law])]


def netted() -> Any:
    """Five bodies, each joined with each by springs and dampers."""
    engine = xp.PhysicsEngine(stepper="core:midpoint")
    laws = [engine.add_law("basic:spring", stiffness=5.0, rest_length=1.0), engine.add_law("basic:damper", damping=0.1)]
    places = [(0, 0, 0), (1, 0.1, 0), (0, 1.2, 0.3), (-0.9, 0, 0.4), (0.2, -1, 0.1)]
    return engine, [
        engine.add_object(xp.PhysicalObject(mass=1 + k, position=p), laws=laws) for k, p in enumerate(places)
    ]


def orbiting() -> Any:
    engine = xp.PhysicsEngine(stepper="core:midpoint")
    law = engine.add_law("basic:universal_gravity", gravitational_constant=1.0)
    sun = xp.PhysicalObject(mass=3.0, velocity=(0, -0.25, 0))
    return engine, [
        engine.add_object(body, laws=[law])
        for body in (sun, xp.PhysicalObject(position=(1, 0, 0), velocity=(0, 1.5, 0.5)))
    ]


def circling() -> Any:
    engine = xp.PhysicsEngine(stepper="core:midpoint")
    return engine, [engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0.5)), laws=[engine.add_law(Magnetic())])]


def swinging() -> Any:
    engine = xp.PhysicsEngine(stepper="core:midpoint")
    return engine, [engine.add_object(xp.PhysicalObject(), laws=[engine.add_law(Swing())])]


SCENES: dict[str, Build] = {
    "linear drag": dragged,
    "quadratic drag": dragged_hard,
    "spring": sprung,
    "springs and dampers": netted,
    "two bodies": orbiting,
    "magnetic": circling,
    "of time": swinging,
}


def state(bodies: Sequence[xp.PhysicalObject]) -> Any:
    return np.array([[*body.position, *body.velocity] for body in bodies])


def after(build: Build, until: float, **options: Any) -> Any:
    engine, bodies = build()
    engine.run(until=until, **options)
    return state(bodies)


def falling_with_linear_drag(t: float) -> Any:
    """m = 2, b = 0.5, thrown at (3, 0, 5): v = (v0 + g m / b) exp(-b t / m) - g m / b."""
    rate, g = 0.25, np.array((0.0, 0.0, -9.81))
    gone = math.exp(-rate * t)
    v0 = np.array((3.0, 0.0, 5.0))
    velocity = (v0 - g / rate) * gone + g / rate
    return np.array([[*((v0 - g / rate) * (1 - gone) / rate + g / rate * t), *velocity]])


def circle(t: float) -> Any:
    """Angular frequency q B / m = 3; v turns clockwise about B."""
    w = 3.0
    velocity = (math.cos(w * t), -math.sin(w * t), 0.5)
    return np.array([[math.sin(w * t) / w, (math.cos(w * t) - 1) / w, 0.5 * t, *velocity]])


def swing(t: float) -> Any:
    return np.array([[(1 - math.cos(3 * t)) / 9, 0, 0, math.sin(3 * t) / 3, 0, 0]])


EXACT = {"linear drag": falling_with_linear_drag, "magnetic": circle, "of time": swing}


@pytest.mark.parametrize("name", list(SCENES))
def test_half_the_step_is_a_quarter_of_the_error(name: str) -> None:
    build, until = SCENES[name], 1.0
    if name in EXACT:
        reference = EXACT[name](until)
    else:  # by Richardson from the two finest, of fourth order
        fine, finest = after(build, until, dt=1 / 1024), after(build, until, dt=1 / 2048)
        reference = finest + (finest - fine) / 3
    errors = [np.abs(after(build, until, dt=1 / n) - reference).max() for n in (32, 64, 128, 256)]
    assert errors[-1] < 1e-3
    orders = [math.log2(a / b) for a, b in itertools.pairwise(errors)]
    assert 1.97 < orders[-1] < 2.03, orders
    assert all(1.8 < order < 2.2 for order in orders), orders


def test_a_free_form_law_of_host_steps_is_of_second_order() -> None:
    class Drag(xp.PhysicalLaw):
        condition = xp.when.Steps()

        def enforce_this_law(self, event: Any) -> None:
            for obj in event.objects:
                obj.add_force(tuple(-0.5 * v for v in obj.velocity))

    def build() -> Any:
        engine = xp.PhysicsEngine(up="z", stepper="core:midpoint")
        laws = [engine.add_law("basic:planet_gravity"), engine.add_law(Drag())]
        return engine, [engine.add_object(xp.PhysicalObject(mass=2.0, velocity=(3, 0, 5)), laws=laws)]

    reference = falling_with_linear_drag(1.0)
    errors = [np.abs(after(build, 1.0, dt=1 / n) - reference).max() for n in (32, 64, 128, 256)]
    assert all(1.9 < math.log2(a / b) < 2.1 for a, b in itertools.pairwise(errors)), errors


# What is kept


def test_a_spring_keeps_its_energy_over_a_thousand_periods() -> None:
    """Symplectic: the error swings with the period and does not grow. 1,000 periods of 20 steps."""
    engine = xp.PhysicsEngine(stepper="core:midpoint")
    spring = engine.add_law("basic:spring_to_point", stiffness=4.0 * math.pi**2)
    body = engine.add_object(xp.PhysicalObject(position=(1, 0, 0)), laws=[spring])
    begin = engine.energy().total
    dt = 1 / 20
    worst = []
    for block in range(10):
        record = engine.run(until=100.0 * (block + 1), dt=dt, every=0.7)
        worst.append(float(np.abs(record.energy[:, :2].sum(axis=1) / begin - 1.0).max()))
    bound = (2.0 * math.pi * dt) ** 2 / 4.0  # of drift-kick-drift for a linear spring, relative
    assert max(worst) < 1.05 * bound
    assert max(worst) / min(worst) < 1.01
    del body


def test_two_bodies_keep_momentum_angular_momentum_and_energy() -> None:
    engine, _ = orbiting()
    p, angular, total = engine.momentum(), engine.angular_momentum(), engine.energy().total
    record = engine.run(until=20.0, dt=0.01, every=0.1)
    assert np.subtract(engine.momentum(), p) == pytest.approx(0.0, abs=1e-13)
    assert np.subtract(engine.angular_momentum(), angular) == pytest.approx(0.0, abs=1e-13)  # kicks are central
    assert np.abs(record.energy[:, :2].sum(axis=1) / total - 1.0).max() < 1e-3  # of order 2, at 0.01 of a time unit


def test_springs_and_dampers_between_bodies_keep_momentum_to_rounding() -> None:
    engine, _ = netted()
    engine.run(until=10.0, dt=0.02)
    assert np.abs(engine.momentum()).max() < 1e-13
    assert np.abs(engine.angular_momentum()).max() < 1e-13


def test_the_work_of_drag_is_what_is_lost() -> None:
    """The work is booked as force times way over each step: kinetic energy changes by just that, at any step."""
    for dt in (0.1, 0.01):
        engine, _ = dragged_hard()
        begin = engine.energy().balance
        record = engine.run(until=2.0, dt=dt, every=0.033)
        balance = record.energy[:, 0] + record.energy[:, 1] - record.energy[:, 2]
        assert np.abs(balance - begin).max() < 1e-13 * begin
        assert engine.energy().work < 0.0


def test_a_magnetic_force_keeps_speed_as_the_midpoint_rule_does() -> None:
    errors = []
    for n in (32, 64):
        body = after(circling, 2.0, dt=1 / n)[0]
        errors.append(abs(math.hypot(*body[3:]) / math.hypot(1.0, 0.5) - 1.0))
    # |v| grows by (w dt)^4 / 8 a step: of third order in all.
    assert errors[0] < 2.0 * 32 * (3 / 32) ** 4 / 8
    assert 2.8 < math.log2(errors[0] / errors[1]) < 3.2


# Tolerances


@pytest.mark.parametrize("name", ["linear drag", "magnetic", "of time"])
def test_the_error_follows_the_tolerance(name: str) -> None:
    """Each step keeps its own error, so that the sum goes with rtol^(2/3): order 2 with step control."""
    exact = EXACT[name](1.0)
    tolerances = [1e-4, 1e-5, 1e-6, 1e-7]
    errors = [np.abs(after(SCENES[name], 1.0, rtol=r, atol=r * 1e-3) - exact).max() for r in tolerances]
    for coarse, fine in itertools.pairwise(errors):
        assert coarse / fine > 3.0
    assert math.log10(errors[0] / errors[-1]) / 3 == pytest.approx(2 / 3, abs=0.15)
    assert errors[-1] < 1e-4


@pytest.mark.parametrize("name", list(SCENES))
def test_the_default_tolerance_gives_more_than_three_digits(name: str) -> None:
    build = SCENES[name]
    fine, finest = after(build, 1.0, dt=1 / 512), after(build, 1.0, dt=1 / 1024)
    reference = finest + (finest - fine) / 3
    found = after(build, 1.0)
    assert np.abs(found - reference).max() < 3e-4 * np.abs(reference).max()


@pytest.mark.parametrize("options", [{}, {"dt": 1 / 30}])
@pytest.mark.parametrize("name", list(SCENES))
def test_looking_between_steps_changes_nothing(name: str, options: dict[str, float]) -> None:
    plain = after(SCENES[name], 1.0, **options)
    looked = after(SCENES[name], 1.0, every=0.0173, **options)
    assert plain.tobytes() == looked.tobytes()
    engine, bodies = SCENES[name]()
    for until in (0.1, 0.10001, 0.5, 0.77, 1.0):
        engine.run(until=until, **options)
        _ = engine.energy(), state(bodies)
    assert plain.tobytes() == state(bodies).tobytes()


# With impacts


def over_a_floor(law: str, **parameters: Any) -> Build:
    def build() -> Any:
        engine = xp.PhysicsEngine(up="z", stepper="core:midpoint")
        bounce = engine.add_law("collision:elastic", restitution=0.9)
        laws = [engine.add_law("basic:planet_gravity"), engine.add_law(law, **parameters), bounce]
        engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce])
        ball = xp.PhysicalObject(xp.Sphere(0.1), position=(0, 0, 1.1), velocity=(1, 0, 0), drag_area=0.1)
        return engine, [engine.add_object(ball, laws=laws)]

    return build


FLOORS = {
    "linear drag": over_a_floor("basic:linear_drag", coefficient=0.3),
    "quadratic drag": over_a_floor("basic:quadratic_drag"),
    "spring": over_a_floor("basic:spring_to_point", stiffness=3.0, rest_length=0.5, anchor=(0.2, 0.0, 1.0)),
}


@pytest.mark.parametrize("name", list(FLOORS))
def test_what_is_stepped_bounces_in_the_midst_of_steps(name: str) -> None:
    """Bounces split steps and keep the order: at 1/64 s several happen inside of steps."""
    build, until = FLOORS[name], 1.7
    reference = after(build, until, dt=1 / 4096)  # its own error is 1/256 of the least below, or less
    errors = {n: np.abs(after(build, until, dt=1 / n) - reference).max() for n in (32, 64, 128, 256)}
    assert errors[64] < 2e-3
    # The error depends on where in a step the bounces fall, so that single ratios scatter about 4.
    assert 1.7 < math.log2(errors[32] / errors[256]) / 3 < 2.4, errors
    assert np.abs(after(build, until) - reference).max() < 1e-3


@pytest.mark.parametrize("name", list(FLOORS))
@pytest.mark.parametrize("options", [{"dt": 1 / 60}, {}])
def test_what_is_stepped_never_sinks_into_the_floor(name: str, options: dict[str, float]) -> None:
    engine, bodies = FLOORS[name]()
    record = engine.run(until=3.0, every=0.005, **options)
    assert record[bodies[0]].position[:, 2].min() > 0.1 - 1e-12  # the touch tolerance: 1e-12 of the size, and rounding


def test_a_force_that_ends_inside_a_step_ends_there_for_what_is_stepped_too() -> None:
    """With linear drag: v = F/b (1 - e^(-b T/m)) e^(-b (t - T)/m)."""
    b, force, duration, until = 0.5, 20.0, 0.26, 1.0
    expected = force / b * (1 - math.exp(-b * duration)) * math.exp(-b * (until - duration))
    errors = []
    for n in (16, 32, 64, 128):
        engine = xp.PhysicsEngine(stepper="core:midpoint")
        body = engine.add_object(xp.PhysicalObject(), laws=[engine.add_law("basic:linear_drag", coefficient=b)])
        body.add_force((force, 0.0, 0.0), duration)
        engine.run(until=until, dt=1 / n)
        errors.append(abs(body.velocity[0] - expected))
    assert 1.8 < math.log2(errors[0] / errors[-1]) / 3 < 2.2, errors


def test_a_ball_on_a_spring_rests_where_the_spring_carries_it() -> None:
    """Critically damped: x = m g / k below the anchor, after enough of its times."""
    engine = xp.PhysicsEngine(up="z", stepper="core:midpoint")
    laws = [
        engine.add_law("basic:planet_gravity", acceleration=10.0),
        engine.add_law("basic:spring_to_point", stiffness=100.0),
        engine.add_law("basic:damper_to_point", damping=20.0),
    ]
    body = engine.add_object(xp.PhysicalObject(position=(0, 0, 0.3)), laws=laws)
    engine.run(until=10.0, dt=0.01)
    assert body.position[2] == pytest.approx(-0.1, abs=1e-12)
    assert math.hypot(*body.velocity) < 1e-12
