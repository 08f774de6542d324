"""Paczynski and Wiita's gravity. A hole with G M = 1 and r_s = 0.1 m stands for all: c^2 = 20."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import LawFailedError
from xpheve_laws_basic import BlackHoleGravity, UniversalGravity

RS = 0.1
HOLE: dict[str, Any] = {"gravitational_constant": 1.0, "mass": 1.0, "speed_of_light": math.sqrt(20.0)}
unit = st.floats(-1, 1)
direction = st.tuples(unit, unit, unit).filter(lambda d: math.hypot(*d) > 0.1)


def test_the_sun_has_a_schwarzschild_radius_of_three_kilometres() -> None:
    assert BlackHoleGravity().schwarzschild_radius == pytest.approx(2953.25, abs=0.1)
    assert BlackHoleGravity(**HOLE).schwarzschild_radius == pytest.approx(RS, rel=1e-15)


def test_the_force_is_newtons_with_r_less_r_s(view: Any) -> None:
    law = BlackHoleGravity(position=(1, 0, 0), **HOLE)
    force = law.force(view(position=[(1, 0.6, 0), (1, 0, -2)], mass=[2.0, 3.0]))
    np.testing.assert_allclose(force, [(0, -2 / 0.25, 0), (0, 0, 3 / 1.9**2)], rtol=1e-14)


@given(d=direction, r=st.floats(1.0, 10.0))
def test_force_is_the_downhill_slope_of_the_potential(view: Any, minus_gradient: Any, d: Any, r: float) -> None:
    law = BlackHoleGravity(**HOLE)
    x = np.array([d]) * r / math.hypot(*d)
    slope = minus_gradient(lambda x: law.potential(view(position=x, mass=2.0)), x)
    np.testing.assert_allclose(law.force(view(position=x, mass=2.0)), slope, atol=1e-6)


@given(d=direction, r=st.floats(1e3, 1e6))
def test_far_out_it_is_newtons_to_two_r_s_over_r(view: Any, d: Any, r: float) -> None:
    x = np.array([d]) * r / math.hypot(*d)
    newton = UniversalGravity(gravitational_constant=1.0)
    expected = newton.force(view(position=x, mass=2.0), view(position=(0, 0, 0), mass=1.0))
    found = BlackHoleGravity(**HOLE).force(view(position=x, mass=2.0))
    np.testing.assert_allclose(found, expected * (1 + 2 * RS / r), rtol=4 * (RS / r) ** 2 + 1e-15, atol=1e-300)


def scene(r: float, speed: float, radial: float = 0.0) -> tuple[xp.PhysicsEngine, xp.PhysicalObject]:
    """Return engine and a body at (r, 0, 0)."""
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("basic:black_hole_gravity", **HOLE)
    body = xp.PhysicalObject(mass=2.0, position=(r, 0, 0), velocity=(radial, speed, 0), name="probe")
    return engine, engine.add_object(body, laws=[law])


def circular(r: float) -> float:
    """Speed of the circle: v^2 = G M r/(r - r_s)^2."""
    return math.sqrt(r) / (r - RS)


def test_circles_have_the_frequency_of_the_closed_form_with_order_two() -> None:
    r = 5 * RS
    quarter = 0.5 * math.pi * r / circular(r)
    errors = []
    for n in (16, 32, 64):
        engine, body = scene(r, circular(r))
        engine.run(until=quarter, dt=quarter / n)
        errors.append(math.dist(body.position, (0, r, 0)) / r)
    assert errors[2] < 1e-3
    for coarse, fine in pairwise(errors):
        assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize(("radii", "stable"), [(3.2, True), (2.8, False)])
def test_circles_are_stable_outside_three_schwarzschild_radii_only(radii: float, stable: bool) -> None:
    r = radii * RS
    engine, body = scene(r, circular(r), radial=-1e-3 * circular(r))
    period = 2 * math.pi * r / circular(r)

    def run() -> None:
        engine.run(until=20 * period, dt=period / 200)

    if stable:
        run()
        assert math.hypot(*body.position) == pytest.approx(r, rel=0.02)
    else:
        with pytest.raises(LawFailedError, match=r"probe.*Schwarzschild radius"):
            run()


def test_a_circle_at_two_schwarzschild_radii_is_bound_by_nothing() -> None:
    engine, _ = scene(2 * RS, circular(2 * RS))
    energy = engine.energy()
    assert energy.total == pytest.approx(0.0, abs=1e-13 * energy.kinetic)


def between(near: float, far: float) -> tuple[float, float, float]:
    """Speed at the far end, and time and angle from there to the near end and back, by quadrature of the radial equation."""
    u = [-1 / (r - RS) for r in (near, far)]
    square = 2 * (u[1] - u[0]) / (1 / near**2 - 1 / far**2)  # L^2
    energy = u[1] + 0.5 * square / far**2
    theta = (np.arange(4000) + 0.5) * math.pi / 4000
    r = 0.5 * (far + near) + 0.5 * (far - near) * np.cos(theta)  # takes the roots at both ends away
    radial = np.sqrt(2 * energy + 2 / (r - RS) - square / r**2)
    dt = 0.5 * (far - near) * np.sin(theta) / radial * math.pi / 4000
    return math.sqrt(square) / far, 2 * float(dt.sum()), 2 * float((math.sqrt(square) / r**2 * dt).sum())


def test_the_apsides_turn_by_what_quadrature_says() -> None:
    speed, period, angle = between(1.0, 2.0)
    assert angle - 2 * math.pi > 0.5, "no small effect here"
    engine, body = scene(2.0, speed)
    start = engine.energy().total
    engine.run(until=period, dt=period / 4000)
    np.testing.assert_allclose(body.position, (2 * math.cos(angle), 2 * math.sin(angle), 0), atol=2e-5)
    assert engine.energy().total == pytest.approx(start, rel=1e-5)


def test_far_out_the_apsides_turn_by_two_thirds_of_einsteins_angle() -> None:
    near, far = 1000.0, 2000.0
    _, _, angle = between(near, far)
    p = 2 / (1 / near + 1 / far)
    einstein = 6 * math.pi / (20.0 * p)  # 6 pi G M/(c^2 p)
    assert angle - 2 * math.pi == pytest.approx(einstein * 2 / 3, rel=1e-3)


@pytest.mark.parametrize("r", [0.999 * RS, 0.5 * RS, 0.0])
def test_a_body_at_or_inside_the_horizon_is_an_error_that_names_it(r: float) -> None:
    engine, _ = scene(r, 0.0)
    with pytest.raises(LawFailedError, match=r"probe.*Schwarzschild radius"):
        engine.run(until=1.0, dt=0.1)
