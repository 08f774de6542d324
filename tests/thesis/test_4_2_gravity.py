"""Thesis 4.2.2: gravity as a force stored once; figures 4-5 to 4-10."""

from __future__ import annotations

import math

import pytest

import xpheve as xp
from xpheve_laws_basic.planets import SURFACE_GRAVITY


@pytest.fixture
def engine() -> xp.PhysicsEngine:
    """Return an engine with gravity."""
    made = xp.PhysicsEngine()
    made.add_law("basic:planet_gravity", acceleration=9.8, name="gravity")
    return made


def gravity_on(body: xp.PhysicalObject) -> list[tuple[float, ...]]:
    """Return the forces that laws stored."""
    return [force.vector for force in body.forces if isinstance(force.id, str)]


@pytest.mark.thesis("weight", "weight/fix")
def test_4_2_2_force_is_mass_times_acceleration(engine: xp.PhysicsEngine) -> None:
    body = engine.add_object(xp.PhysicalObject(mass=2.5), laws=["gravity"])
    engine.run(until=0.0)
    assert gravity_on(body) == [(0, -24.5, 0)]


@pytest.mark.thesis("stored-once")
def test_4_2_2_stored_once_no_work_per_update(engine: xp.PhysicsEngine) -> None:
    engine.add_objects([xp.PhysicalObject(position=(k, 0, 0)) for k in range(100)], laws=["gravity"])
    engine.run(until=10.0, dt=0.01)
    assert engine.law("gravity").evaluations == 1


@pytest.mark.thesis("stored-once")
def test_the_default_is_9_81() -> None:
    assert xp.PhysicsEngine().add_law("basic:planet_gravity").parameters["acceleration"] == 9.81


@pytest.mark.thesis("one-gravity-force", "one-gravity-force/fix", "each-start", "each-start/fix")
@pytest.mark.parametrize("container", [None, xp.when.Started()], ids=["its own", "the startup container"])
def test_fig_4_5_to_4_9_exactly_one_force_before_start_at_start_at_restart_and_while_running(container: object) -> None:
    engine = xp.PhysicsEngine()
    holder = None if container is None else xp.LawContainer(xp.when.Started())
    gravity = engine.add_law("basic:planet_gravity", container=holder, acceleration=9.8)
    body = engine.add_object(xp.PhysicalObject(), laws=[gravity])
    body.add_force((1, 0, 0))
    for _ in range(3):
        engine.run(until=0.0)
        assert gravity_on(body) == [(0, -9.8, 0)] and len(body.forces) == 2
        engine.run(until=1.0)
        gravity.enforce(xp.Event(engine.time))
        gravity.enforce(xp.Event(engine.time))
        assert gravity_on(body) == [(0, -9.8, 0)] and len(body.forces) == 2
        assert body.velocity == (1, -9.8, 0)
        engine.reset()
        assert body.velocity == (0, 0, 0)
        assert [force.vector for force in body.forces if isinstance(force.id, int)] == [(1, 0, 0)]


@pytest.mark.thesis("one-gravity-force")
def test_fig_4_10_mapped_while_running(engine: xp.PhysicsEngine) -> None:
    body = engine.add_object(xp.PhysicalObject())
    engine.run(until=1.0)
    engine.map(body, "gravity")
    engine.run(until=2.0)
    assert body.velocity == (0, -9.8, 0) and len(body.forces) == 1


@pytest.mark.thesis("disabled-gravity")
def test_fig_4_5_and_4_6_a_disabled_law_adds_none_and_enabling_restores(engine: xp.PhysicsEngine) -> None:
    gravity = engine.law("gravity")
    gravity.enabled = False
    body = engine.add_object(xp.PhysicalObject(), laws=[gravity])
    engine.run(until=1.0)
    assert body.forces == ()
    for _ in range(3):
        gravity.enabled = True
        engine.run(until=engine.time)
        assert gravity_on(body) == [(0, -9.8, 0)]
        gravity.enabled = False
        assert body.forces == ()


@pytest.mark.thesis("one-gravity-force", "one-gravity-force/fix", "disabled-gravity")
def test_fig_5_5_the_users_forces_stay(engine: xp.PhysicsEngine) -> None:
    gravity = engine.law("gravity")
    body = engine.add_object(xp.PhysicalObject(), laws=[gravity])
    mine = body.add_force((1, 2, 3), 100.0)
    engine.run(until=0.0)
    for act in (
        lambda: setattr(gravity, "enabled", False),
        lambda: setattr(gravity, "enabled", True),
        lambda: engine.unmap(body, gravity),
        lambda: engine.remove_law(gravity),
    ):
        act()
        assert mine in body.forces


@pytest.mark.thesis("disabled-gravity/fix")
def test_4_2_2_two_gravity_laws_have_ids_of_their_own(engine: xp.PhysicsEngine) -> None:
    moon = engine.add_law("basic:planet_gravity", acceleration=1.6, direction=(0, 1, 0))
    body = engine.add_object(xp.PhysicalObject(), laws=["gravity", moon])
    engine.run(until=0.0)
    assert len({force.id for force in body.forces}) == 2
    engine.unmap(body, moon)
    assert gravity_on(body) == [(0, -9.8, 0)]


@pytest.mark.thesis("other-gravities")
@pytest.mark.parametrize("world", ["Earth", "Moon", "Mars", "Jupiter"])
def test_4_2_other_planets_are_the_same_law_with_their_acceleration(world: str) -> None:
    engine = xp.PhysicsEngine()
    engine.add_law("basic:planet_gravity", acceleration=SURFACE_GRAVITY[world], name="gravity")
    body = engine.add_object(xp.PhysicalObject(mass=2.5, position=(0, 10, 0)), laws=["gravity"])
    engine.run(until=1.0)
    assert body.position[1] == pytest.approx(10 - 0.5 * SURFACE_GRAVITY[world], rel=1e-15)


@pytest.mark.thesis("other-gravities")
def test_4_2_universal_gravity_near_the_ground_is_planet_gravity() -> None:
    mass, radius = 5.9722e24, 6.371e6
    engine = xp.PhysicsEngine()
    earth = engine.add_object(xp.PhysicalObject(mass=mass, fixed=True))
    apple = engine.add_object(xp.PhysicalObject(position=(0, radius + 10, 0)))
    engine.add_law("basic:universal_gravity", between=([earth], [apple]))
    engine.run(until=1.0, dt=0.01)
    g = 6.67430e-11 * mass / (radius + 10) ** 2
    assert apple.velocity[1] == pytest.approx(-g, rel=2e-6)  # g grows by 2 h/R over the way of 5 m
    assert g == pytest.approx(SURFACE_GRAVITY["Earth"], rel=3e-3)


@pytest.mark.thesis("other-gravities", "other-gravities/black-hole")
def test_4_2_a_black_hole_pulls_harder_than_newton_and_lets_nothing_back() -> None:
    accelerations = []
    for law, given in (
        ("basic:universal_gravity", {}),
        ("basic:black_hole_gravity", {"mass": 1.0, "speed_of_light": math.sqrt(20.0)}),
    ):
        engine = xp.PhysicsEngine()
        hole = engine.add_object(xp.PhysicalObject(mass=1.0, fixed=True))
        body = engine.add_object(xp.PhysicalObject(position=(0.5, 0, 0)))
        between = {"between": ([hole], [body])} if law == "basic:universal_gravity" else {}
        made = engine.add_law(law, gravitational_constant=1.0, **given, **between)
        if not between:
            engine.map(body, made)
        engine.run(until=1e-4, dt=1e-5)
        accelerations.append(-body.velocity[0] / 1e-4)
    assert accelerations[0] == pytest.approx(1 / 0.5**2, rel=1e-6)
    assert accelerations[1] == pytest.approx(1 / 0.4**2, rel=1e-6)  # r_s = 0.1 m
    with pytest.raises(xp.errors.LawFailedError, match="Schwarzschild radius"):
        engine.run(until=10.0, dt=1e-3)


@pytest.mark.thesis("other-gravities")
def test_4_2_universal_gravity_holds_a_moon_on_its_circle() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("basic:universal_gravity", gravitational_constant=1.0)
    engine.add_object(xp.PhysicalObject(mass=1.0, fixed=True), laws=[law])
    moon = engine.add_object(xp.PhysicalObject(mass=1e-3, position=(1, 0, 0), velocity=(0, 1, 0)), laws=[law])
    engine.run(until=6.283185307179586, dt=1e-2)
    assert moon.position == pytest.approx((1, 0, 0), abs=1e-3)
