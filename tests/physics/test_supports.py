"""Supports: a ball put on a floor stays, slides, and leaves only when something makes it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import ContactError

G = 9.81


class Scene:
    """A plane through the origin, tilted by ``tilt`` about y, and a ball put on it."""

    def __init__(
        self,
        *,
        tilt: float = 0.0,
        velocity: Any = (0.0, 0.0, 0.0),
        restitution: float = 0.8,
        resting: str = "error",
        gravity: bool = True,
        radius: float = 0.1,
        mass: float = 1.0,
    ) -> None:
        self.engine = xp.PhysicsEngine(up="z")
        self.normal = (math.sin(tilt), 0.0, math.cos(tilt))
        self.gravity = self.engine.add_law("basic:planet_gravity", acceleration=G if gravity else 0.0)
        self.bounce = self.engine.add_law("collision:elastic", restitution=restitution, resting=resting)
        self.floor = self.engine.add_object(xp.PhysicalObject(xp.Plane(self.normal), fixed=True), laws=[self.bounce])
        position = tuple(radius * n for n in self.normal)
        self.ball = self.engine.add_object(
            xp.PhysicalObject(xp.Sphere(radius), mass=mass, position=position, velocity=velocity),
            laws=[self.gravity, self.bounce],
        )

    def supported(self) -> bool:
        return self.ball in self.engine._world.contacts.supports

    def height(self) -> float:
        """Of the ball's lowest point over the plane [m]."""
        return math.fsum(x * n for x, n in zip(self.ball.position, self.normal, strict=True)) - self.ball.shape.radius


# Staying


@pytest.mark.parametrize("dt", [None, 1.0])
@pytest.mark.parametrize("radius", [0.1, 1.0, 1e-6])
@pytest.mark.parametrize("mass", [1.0, 1e-9, 1e9])
def test_a_ball_put_on_the_floor_stays(radius: float, mass: float, dt: float | None) -> None:
    scene = Scene(radius=radius, mass=mass)
    scene.engine.run(until=1e3, dt=dt)
    assert scene.supported()
    assert scene.ball.position == (0.0, 0.0, radius)  # to the bit
    assert scene.ball.velocity == (0.0, 0.0, 0.0)
    assert scene.engine.energy().work == 0.0
    assert scene.engine._world.contacts.impacts == 0  # no micro-bounces


def test_a_resting_ball_costs_nothing() -> None:
    scene = Scene()
    scene.engine.run(until=1.0)
    before = scene.engine._world.contacts.predictions
    scene.engine.run(until=1e6)
    assert scene.engine._world.contacts.predictions == before


def test_the_floor_carries_just_the_weight() -> None:
    scene = Scene(mass=2.0)
    scene.engine.run(until=1.0)
    assert sum(f.vector[2] for f in scene.ball.forces) == 0.0
    assert sorted(f.vector[2] for f in scene.ball.forces) == [-2.0 * G, 2.0 * G]


def test_a_ball_that_rolled_onto_the_edge_of_a_scene_goes_on_for_ever() -> None:
    """Without friction nothing slows a ball on a floor."""
    scene = Scene(velocity=(3.0, -4.0, 0.0))
    scene.engine.run(until=1024.0)
    assert scene.ball.position == (3072.0, -4096.0, 0.1)
    assert scene.ball.velocity == (3.0, -4.0, 0.0)


def test_a_change_of_mass_or_gravity_keeps_the_ball_on_the_floor() -> None:
    scene = Scene()
    scene.engine.run(until=1.0)
    scene.ball.mass = 7.0
    scene.engine.run(until=2.0)
    scene.gravity.acceleration = 1.62
    scene.engine.run(until=3.0)
    assert scene.supported()
    assert (scene.ball.position, scene.ball.velocity) == ((0.0, 0.0, 0.1), (0.0, 0.0, 0.0))
    assert sum(f.vector[2] for f in scene.ball.forces) == pytest.approx(0.0, abs=2e-15)


def test_a_push_along_the_floor_moves_the_ball_along_the_floor() -> None:
    scene = Scene(mass=2.0)
    scene.engine.run(until=1.0)
    scene.ball.add_force((3.0, 0.0, -5.0), duration=0.5)
    scene.engine.run(until=2.0)
    assert scene.supported()
    assert scene.ball.velocity == (0.75, 0.0, 0.0)
    assert scene.ball.position == (0.5625, 0.0, 0.1)  # 1.5 0.5^2 / 2 + 0.75 0.5


def test_gravity_that_begins_later_presses_a_touching_ball_on() -> None:
    scene = Scene(gravity=False)
    scene.engine.run(until=1.0)
    scene.gravity.acceleration = G
    scene.engine.run(until=2.0)
    assert scene.supported()
    assert scene.ball.position == (0.0, 0.0, 0.1)


# Slopes


@settings(deadline=None, max_examples=25)
@given(tilt=st.floats(0.01, 1.5), along=st.floats(-5.0, 5.0), across=st.floats(-5.0, 5.0), until=st.floats(0.1, 10.0))
def test_a_ball_slides_down_a_slope_with_g_sine(tilt: float, along: float, across: float, until: float) -> None:
    downhill = (math.cos(tilt), 0.0, -math.sin(tilt))
    velocity = tuple(along * d + across * s for d, s in zip(downhill, (0.0, 1.0, 0.0), strict=True))
    scene = Scene(tilt=tilt, velocity=velocity)
    start = np.array(scene.ball.position)
    scene.engine.run(until=until)
    assert scene.supported()
    way = along * until + G * math.sin(tilt) * until**2 / 2
    moved = np.array(scene.ball.position) - start
    size = 5.0 * until + G * until**2
    assert moved @ downhill == pytest.approx(way, abs=1e-15 * size)
    assert moved[1] == pytest.approx(across * until, abs=1e-15 * size)
    assert scene.height() == pytest.approx(0.0, abs=1e-15 * size)  # coordinates of that size round
    # The reaction does no work: energy is kept.
    assert scene.engine.energy().work == pytest.approx(0.0, abs=1e-15 * size * G)


def test_a_ball_slides_up_a_slope_and_comes_back() -> None:
    tilt = 0.5
    downhill = np.array((math.cos(tilt), 0.0, -math.sin(tilt)))
    scene = Scene(tilt=tilt, velocity=tuple(-2.0 * downhill))
    start = np.array(scene.ball.position)
    scene.engine.run(until=2.0 * 2.0 / (G * math.sin(tilt)))
    assert np.array(scene.ball.position) == pytest.approx(start, abs=2e-15)
    assert np.array(scene.ball.velocity) == pytest.approx(2.0 * downhill, abs=4e-15)


def test_a_collapse_on_a_slope_ends_in_sliding() -> None:
    """The component across the slope bounces to rest; the one along it knows nothing of that."""
    tilt = 0.4
    engine = xp.PhysicsEngine(up="z")
    laws = [
        engine.add_law("basic:planet_gravity", acceleration=G),
        engine.add_law("collision:elastic", restitution=0.5),
    ]
    normal, downhill = np.array((math.sin(tilt), 0, math.cos(tilt))), np.array((math.cos(tilt), 0, -math.sin(tilt)))
    engine.add_object(xp.PhysicalObject(xp.Plane(tuple(normal)), fixed=True), laws=laws[1:])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=tuple(1.1 * normal)), laws=laws)
    rest = math.sqrt(2.0 / (G * math.cos(tilt))) * 3.0
    engine.run(until=rest + 1.0)
    assert ball in engine._world.contacts.supports
    t = rest + 1.0
    assert np.dot(ball.position, downhill) == pytest.approx(G * math.sin(tilt) * t**2 / 2, rel=1e-14)
    assert np.dot(ball.velocity, downhill) == pytest.approx(G * math.sin(tilt) * t, rel=1e-14)
    assert np.dot(ball.position, normal) == pytest.approx(0.1, abs=2e-15)


# Leaving


def test_a_kick_upwards_lifts_the_ball_off() -> None:
    scene = Scene()
    scene.engine.run(until=1.0)
    scene.ball.velocity = (1.0, 0.0, 2.0)
    scene.engine.run(until=1.1)
    assert not scene.supported()
    assert scene.ball.position[2] == pytest.approx(0.1 + 2.0 * 0.1 - G * 0.1**2 / 2, abs=2e-16)
    scene.engine.run(until=10.0)
    assert scene.supported()  # and comes to rest again, sliding
    assert (scene.ball.position[2], scene.ball.velocity[2]) == (0.1, 0.0)
    assert scene.ball.velocity[0] == 1.0


def test_a_kick_into_the_floor_bounces() -> None:
    scene = Scene(restitution=0.5)
    scene.engine.run(until=1.0)
    scene.ball.velocity = (0.0, 0.0, -2.0)
    scene.engine.run(until=1.05)
    assert scene.ball.velocity[2] == pytest.approx(1.0 - G * 0.05, abs=1e-15)


def test_a_ball_that_is_lifted_off_falls_back() -> None:
    scene = Scene()
    scene.engine.run(until=1.0)
    scene.ball.position = (0.0, 0.0, 0.6)
    scene.engine.run(until=1.2)
    assert not scene.supported()
    assert scene.ball.position[2] == pytest.approx(0.6 - G * 0.2**2 / 2, abs=2e-16)


def test_a_pull_stronger_than_weight_lifts_the_ball_off_and_drops_it_when_it_ends() -> None:
    scene = Scene(restitution=0.5)
    scene.engine.run(until=1.0)
    scene.ball.add_force((0.0, 0.0, 4.0 * G), duration=0.5)
    scene.engine.run(until=1.25)
    assert not scene.supported()
    assert scene.ball.position[2] == pytest.approx(0.1 + 3.0 * G * 0.25**2 / 2, abs=4e-16)
    scene.engine.run(until=1.75)
    assert scene.ball.velocity[2] == pytest.approx(3.0 * G * 0.5 - G * 0.25, abs=4e-15)
    scene.engine.run(until=20.0)
    assert scene.supported()


def test_a_pull_weaker_than_weight_lifts_nothing() -> None:
    scene = Scene()
    scene.ball.add_force((0.0, 0.0, 0.999 * G))
    scene.engine.run(until=100.0)
    assert scene.supported()
    assert scene.ball.position == (0.0, 0.0, 0.1)


def test_a_ball_leaves_when_the_force_that_pressed_it_ends_and_another_pulls() -> None:
    scene = Scene(gravity=False)
    scene.ball.add_force((0.0, 0.0, -5.0), duration=1.0)
    scene.ball.add_force((0.0, 0.0, 2.0))
    scene.engine.run(until=3.0)
    assert not scene.supported()
    assert scene.ball.position[2] == pytest.approx(0.1 + 2.0 * 2.0**2 / 2, rel=1e-15)


@pytest.mark.parametrize(
    "let_go",
    [
        lambda s: s.engine.unmap(s.ball, s.bounce),
        lambda s: s.engine.unmap(s.floor, s.bounce),
        lambda s: s.engine.remove_object(s.floor),
        lambda s: s.engine.remove_law(s.bounce),
        lambda s: setattr(s.bounce, "enabled", False),
        lambda s: setattr(s.floor, "position", (0.0, 0.0, -1e9)),
    ],
    ids=["ball unmapped", "floor unmapped", "floor removed", "law removed", "law disabled", "floor lowered"],
)
def test_a_ball_falls_when_nothing_carries_it_any_more(let_go: Callable[[Scene], None]) -> None:
    scene = Scene()
    scene.engine.run(until=1.0)
    assert scene.supported()
    let_go(scene)
    scene.engine.run(until=2.0)
    assert not scene.supported()
    assert scene.ball.position[2] == pytest.approx(0.1 - G / 2, abs=1e-15)
    assert scene.ball.velocity[2] == -G


def test_a_ball_floats_when_gravity_goes() -> None:
    scene = Scene()
    scene.engine.run(until=1.0)
    scene.engine.unmap(scene.ball, scene.gravity)
    scene.engine.run(until=2.0)
    assert scene.ball.position == (0.0, 0.0, 0.1)
    assert scene.ball.forces == () or all(f.vector == (0.0, 0.0, 0.0) for f in scene.ball.forces)
    scene.ball.velocity = (0.0, 0.0, 1.0)
    scene.engine.run(until=3.0)
    assert scene.ball.position == (0.0, 0.0, 1.1)


def test_a_removed_ball_takes_no_reaction_along() -> None:
    scene = Scene()
    scene.engine.run(until=1.0)
    scene.engine.remove_object(scene.ball)
    scene.engine.add_object(scene.ball, laws=[scene.gravity])
    scene.engine.run(until=2.0)
    assert scene.ball.velocity == (0.0, 0.0, -G)


# Meeting others


def test_a_ball_that_slides_on_the_floor_bounces_off_a_wall() -> None:
    scene = Scene(velocity=(2.0, 1.0, 0.0), restitution=0.5)
    scene.engine.add_object(xp.PhysicalObject(xp.Plane((-1, 0, 0), -4.1), fixed=True), laws=[scene.bounce])
    scene.engine.run(until=4.0)
    assert scene.supported()
    assert scene.ball.velocity == (-1.0, 1.0, 0.0)
    # 4.1 - 0.1 m at 2 m/s, then 2 s at 1 m/s
    assert scene.ball.position == pytest.approx((2.0, 4.0, 0.1), abs=1e-15)
    assert scene.ball.position[2] == 0.1


def test_a_ball_that_slides_on_the_floor_hits_a_resting_one() -> None:
    scene = Scene(velocity=(2.0, 0.0, 0.0), restitution=1.0)
    other = scene.engine.add_object(
        xp.PhysicalObject(xp.Sphere(0.1), position=(2.2, 0.0, 0.1)), laws=[scene.gravity, scene.bounce]
    )
    scene.engine.run(until=2.0)
    assert scene.ball.velocity == (0.0, 0.0, 0.0)
    assert other.velocity == pytest.approx((2.0, 0.0, 0.0), abs=1e-15)
    assert (scene.ball.position[2], other.position[2]) == (0.1, 0.1)
    assert other.position[0] == pytest.approx(4.2, abs=2e-15)


def test_a_small_ball_under_a_large_one_that_slides_is_pressed_and_the_floor_answers() -> None:
    """Balls of two sizes on a floor: their line of centres is askew, so that the floor must take part in the impact."""
    scene = Scene(velocity=(1.0, 0.0, 0.0), restitution=1.0)
    large = scene.engine.add_object(
        xp.PhysicalObject(xp.Sphere(0.4), mass=4.0, position=(2.0, 0.0, 0.4)), laws=[scene.gravity, scene.bounce]
    )
    before = scene.engine.energy().total
    scene.engine.run(until=10.0)
    assert scene.engine.energy().total == pytest.approx(before, rel=1e-13)
    assert scene.ball.mass * scene.ball.velocity[0] + 4.0 * large.velocity[0] == pytest.approx(1.0, abs=1e-14)
    assert scene.height() >= -1e-13
    assert large.position[2] >= 0.4 - 1e-13


def test_a_ball_that_falls_on_a_resting_one_presses_it_not_through_the_floor() -> None:
    scene = Scene(restitution=0.5)
    scene.engine.run(until=1.0)
    top = scene.engine.add_object(
        xp.PhysicalObject(xp.Sphere(0.1), position=(0.05, 0.0, 1.0)), laws=[scene.gravity, scene.bounce]
    )
    record = scene.engine.run(until=2.0, every=0.005)
    lowest = min(record[scene.ball].position[:, 2].min(), record[top].position[:, 2].min())
    assert lowest > 0.1 - 1e-12


# What is refused, and held


def valley(resting: str) -> tuple[xp.PhysicsEngine, xp.PhysicalObject]:
    """Two planes at 45 degrees and a ball that falls between them."""
    engine = xp.PhysicsEngine(up="z")
    laws = [
        engine.add_law("basic:planet_gravity", acceleration=G),
        engine.add_law("collision:elastic", restitution=0.5, resting=resting),
    ]
    for side, name in ((1, "left"), (-1, "right")):
        engine.add_object(xp.PhysicalObject(xp.Plane((side, 0, 1)), fixed=True, name=name), laws=laws[1:])
    ball = xp.PhysicalObject(xp.Sphere(0.1), position=(0, 0, 1), name="ball")
    return engine, engine.add_object(ball, laws=laws)


def test_a_ball_in_a_valley_is_refused_by_name() -> None:
    engine, ball = valley("error")
    with pytest.raises(ContactError, match=r"ball.*(left|right).*hold|(left|right).*ball.*hold"):
        engine.run(until=10.0)
    assert engine.time < 10.0
    assert math.isfinite(ball.position[2])


def test_a_ball_in_a_valley_is_held() -> None:
    engine, ball = valley("hold")
    engine.run(until=10.0)
    assert ball.velocity == (0.0, 0.0, 0.0)
    rest = ball.position
    assert rest == pytest.approx((0.0, 0.0, 0.1 * math.sqrt(2.0)), abs=1e-7)
    engine.run(until=1000.0)
    assert ball.position == rest


def test_a_ball_against_a_wall_on_the_floor_is_refused_when_pressed_and_held_when_asked() -> None:
    for resting in ("error", "hold"):
        scene = Scene(resting=resting)
        scene.engine.add_object(
            xp.PhysicalObject(xp.Plane((-1, 0, 0), -0.1), fixed=True, name="wall"), laws=[scene.bounce]
        )
        scene.engine.run(until=1.0)  # touches the wall, and nothing presses it there
        assert scene.ball.position == (0.0, 0.0, 0.1)
        scene.ball.add_force((3.0, 0.0, 0.0))
        if resting == "error":
            with pytest.raises(ContactError, match="wall"):
                scene.engine.run(until=2.0)
            continue
        scene.engine.run(until=2.0)
        assert (scene.ball.position, scene.ball.velocity) == ((0.0, 0.0, 0.1), (0.0, 0.0, 0.0))


def test_a_ball_that_comes_to_rest_upon_another_is_refused_by_name() -> None:
    scene = Scene(restitution=0.5)
    scene.engine.add_object(
        xp.PhysicalObject(xp.Sphere(0.1), position=(0.0, 0.0, 0.5), name="upper"), laws=[scene.gravity, scene.bounce]
    )
    with pytest.raises(ContactError, match="upper"):
        scene.engine.run(until=10.0)
    assert 0.2 < scene.engine.time < 3.0  # near the end of its bounces


def test_a_ball_that_comes_to_rest_upon_another_is_held_if_asked() -> None:
    scene = Scene(restitution=0.5, resting="hold")
    upper = scene.engine.add_object(
        xp.PhysicalObject(xp.Sphere(0.1), position=(0.0, 0.0, 0.5)), laws=[scene.gravity, scene.bounce]
    )
    scene.engine.run(until=10.0)
    assert upper.velocity == scene.ball.velocity == (0.0, 0.0, 0.0)
    assert upper.position[2] == pytest.approx(0.3, abs=1e-6)
    assert scene.ball.position[2] == pytest.approx(0.1, abs=1e-6)


def test_what_is_held_goes_when_it_is_kicked() -> None:
    engine, ball = valley("hold")
    engine.run(until=10.0)
    ball.velocity = (0.0, 0.0, 3.0)
    engine.run(until=10.1)
    assert ball.velocity[2] == pytest.approx(3.0 - G * 0.1, abs=1e-14)


@pytest.mark.parametrize("law", ["basic:linear_drag", "basic:spring_to_point"])
def test_a_ball_under_a_law_along_the_way_rests_too(law: str) -> None:
    """The reaction follows forces that change: drag slows what slides; a soft spring upwards carries a part of it."""
    scene = Scene(velocity=(2.0, 0.0, 0.0))
    extra = (
        scene.engine.add_law(law) if law == "basic:linear_drag" else scene.engine.add_law(law, anchor=(0.0, 0.0, 1.0))
    )
    scene.engine.map(scene.ball, extra)
    scene.engine.run(until=3.0, dt=0.01)
    assert scene.ball.position[2] == pytest.approx(0.1, abs=1e-12)
    if law == "basic:linear_drag":
        assert scene.ball.velocity[0] == pytest.approx(2.0 * math.exp(-3.0), rel=1e-4)
    else:
        assert scene.ball.position[0] == pytest.approx(2.0 * math.sin(3.0), abs=1e-3)
