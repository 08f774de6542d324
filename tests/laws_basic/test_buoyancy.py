"""Archimedes' buoyancy."""

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
from xpheve_laws_basic import Buoyancy

UP = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
BALL = 4 / 3 * math.pi * 0.5**3  # [m^3], of radius 0.5 m


def test_what_is_wholly_immersed_loses_the_weight_of_the_fluid_it_displaces(view: Any) -> None:
    force = Buoyancy(density=800.0, acceleration=10.0).force(
        view(volume=[BALL, math.nan], displaced_volume=[math.nan, 0.25], up=(0, 1, 0))
    )
    np.testing.assert_allclose(force, [(0, 8000 * BALL, 0), (0, 2000, 0)], rtol=1e-15)


def test_a_sphere_displaces_its_cap_found_by_quadrature(view: Any) -> None:
    law = Buoyancy(density=1.0, acceleration=1.0, surface=0.2)
    for z in (-0.9, -0.31, -0.1, 0.2, 0.4, 0.69, 0.9):
        edges = np.linspace(z - 0.5, min(max(0.2, z - 0.5), z + 0.5), 20001)
        heights = 0.5 * (edges[1:] + edges[:-1])  # discs of the sphere below the surface, by the midpoint rule
        discs = math.pi * (0.25 - (heights - z) ** 2) * np.diff(edges)
        force = np.asarray(law.force(view(position=(3, 4, z), volume=BALL, displaced_volume=math.nan)))
        np.testing.assert_allclose(force[0], (0, 0, discs.sum()), atol=1e-8)


@given(z=st.floats(-1.5, 1.5), surface=st.floats(-0.5, 0.5), up=st.sampled_from("xyz"))
def test_force_is_the_downhill_slope_of_the_potential(
    view: Any, minus_gradient: Any, z: float, surface: float, up: str
) -> None:
    law = Buoyancy(density=2.0, acceleration=3.0, surface=surface)

    def body(x: Any) -> Any:
        return view(position=x, volume=BALL, displaced_volume=math.nan, up=UP[up])

    x = np.array([(0.3, -0.2, 0.1)]) + z * np.array(UP[up])
    np.testing.assert_allclose(law.force(body(x)), minus_gradient(lambda x: law.potential(body(x)), x), atol=1e-6)


def test_the_potential_of_all_space_falls_with_height(view: Any, minus_gradient: Any) -> None:
    law = Buoyancy()

    def body(x: Any) -> Any:
        return view(position=x, volume=BALL, displaced_volume=math.nan)

    x = np.array([(1.0, 2.0, 3.0)])
    np.testing.assert_allclose(law.force(body(x)), minus_gradient(lambda x: law.potential(body(x)), x), rtol=1e-9)


def test_without_a_surface_it_is_stored_and_a_balloon_rises_by_the_closed_form() -> None:
    engine = xp.PhysicsEngine(up="z")
    laws = [engine.add_law("basic:planet_gravity"), engine.add_law("basic:buoyancy", density=1.2)]
    balloon = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), mass=0.4), laws=laws)
    engine.run(until=3.0)
    a = 9.81 * (1.2 * BALL / 0.4 - 1)
    np.testing.assert_allclose(balloon.position, (0, 0, 4.5 * a), rtol=1e-14)
    assert laws[1].evaluations == 1
    energy = engine.energy()
    assert energy.total == pytest.approx(0.0, abs=1e-12 * energy.kinetic)


def bobbing(dt: float) -> xp.PhysicalObject:
    """Return a ball of half the water's density a quarter of its period after it was pressed down by 1 mm."""
    engine = xp.PhysicsEngine(up="y")
    laws = [engine.add_law("basic:planet_gravity"), engine.add_law("basic:buoyancy", surface=2.0)]
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), density=500.0, position=(0, 1.999, 0)), laws=laws)
    engine.run(until=0.5 * math.pi / math.sqrt(1000 * 9.81 * math.pi * 0.25 / (500 * BALL)), dt=dt)
    return ball


def test_a_floating_ball_bobs_with_the_frequency_of_its_waterline() -> None:
    # m w^2 = rho g pi R^2; the cubic term of the cap changes it by 1e-6 at 1 mm of 0.5 m.
    ball = bobbing(1e-3)
    omega = math.sqrt(1000 * 9.81 * math.pi * 0.25 / (500 * BALL))
    assert ball.position[1] == pytest.approx(2.0, abs=2e-8)
    assert ball.velocity[1] == pytest.approx(1e-3 * omega, rel=1e-5)


def plunge(dt: float) -> tuple[float, float]:
    """Return the largest and the last error of the energy of a light ball that falls into water and comes up again."""
    engine = xp.PhysicsEngine(up="z")
    laws = [engine.add_law("basic:planet_gravity"), engine.add_law("basic:buoyancy", surface=0.0)]
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), density=300.0, position=(0, 0, 2)), laws=laws)
    start = engine.energy()
    record = engine.run(until=4.0, dt=dt, every=dt)
    drift = np.abs(np.asarray(record.energy)[:, :2].sum(axis=1) - start.total) / start.total
    return float(drift.max()), float(drift[-1])


def test_energy_is_kept_through_the_surface_with_order_two() -> None:
    worst = [plunge(0.02 / 2**k)[0] for k in range(3)]
    assert worst[2] < 1e-4
    for coarse, fine in pairwise(worst):
        assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.3)


def test_a_point_without_a_volume_is_an_error_that_says_what_is_needed() -> None:
    for surface in (None, 1.0):
        engine = xp.PhysicsEngine(up="z")
        law = engine.add_law("basic:buoyancy", surface=surface)
        with pytest.raises(LawFailedError, match=r"cork has no displaced_volume: .*displaced_volume=\.\.\."):
            engine.add_object(xp.PhysicalObject(name="cork"), laws=[law])
            engine.run(until=1.0, dt=0.1)
