"""Smooth flights that collide, by whatever stepper: at the instants of closed forms and of a reference in 34 digits."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest

import xpheve as xp
from xpheve.kernels.clock import elapsed

ROOT = Path(__file__).resolve().parents[2]
TIGHT = {"rtol": 1e-13, "atol": 1e-13}


def stepper_of(engine: xp.PhysicsEngine, obj: xp.PhysicalObject) -> str:
    world: Any = engine._world
    return str(world.batches[int(world.bodies.batch[obj._row])].stepper.id)


def impacts_of(engine: xp.PhysicsEngine) -> int:
    return int(engine.explain().data["contacts"]["impacts"])


def add_floor(engine: xp.PhysicsEngine, bounce: Any) -> xp.PhysicalObject:
    return engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce])


# Bars


def windy() -> tuple[Any, Any]:
    """The reference of bounces in a wind, and its numbers."""
    if str(ROOT) not in sys.path:
        sys.path.insert(0, str(ROOT))
    from benchmarks import references
    from benchmarks.references import bounces_in_wind

    return references.load("bounces_in_wind")[0], bounces_in_wind


@pytest.mark.parametrize(("tolerance", "bar"), [(1e-10, 1e-11), (1e-13, 1e-12)])
def test_ten_bounces_under_drag_and_wind_are_where_the_reference_is(tolerance: float, bar: float) -> None:
    reference, one = windy()
    engine = xp.PhysicsEngine(up="z")
    bounce = engine.add_law("collision:elastic", restitution=one.RESTITUTION)
    laws = [
        bounce,
        engine.add_law("basic:planet_gravity", acceleration=one.WEIGHT),
        engine.add_law("basic:wind", velocity=one.WIND, density=one.DENSITY, coefficient=one.COEFFICIENT),
    ]
    add_floor(engine, bounce)
    ball = xp.PhysicalObject(
        xp.Sphere(one.RADIUS), mass=one.MASS, position=one.POSITION, velocity=one.VELOCITY, drag_area=one.AREA
    )
    engine.add_object(ball, laws=laws)
    engine.run(until=one.SPAN, rtol=tolerance, atol=tolerance)
    assert stepper_of(engine, ball) == "core:adaptive" and impacts_of(engine) == one.BOUNCES
    error = (np.array([*ball.position, *ball.velocity]) - reference.high) - reference.low
    assert np.abs(error[:3]).max() < bar and np.abs(error[3:]).max() < 10.0 * bar


def linear_bounces(drag: float, weight: float, restitution: float, height: float, end: float) -> tuple[Any, Any, int]:
    """Height above the floor and speed of a point under linear drag (mass 0.5) after ``end`` [s], and how often it bounced, in 30 digits."""
    with mpmath.workdps(30):
        exact = mpmath.mpf
        k, g, e, z, v, left = (
            exact(drag) / exact(0.5),
            exact(weight),
            exact(restitution),
            exact(height),
            exact(0),
            exact(end),
        )
        count = 0
        while True:
            fallen = lambda s, z=z, v=v: z - g / k * s + (v + g / k) / k * (1 - mpmath.exp(-k * s))  # noqa: E731
            free = (v + mpmath.sqrt(v * v + 2 * g * z)) / g
            s = mpmath.findroot(fallen, free if count == 0 else free * exact("0.97"))
            if s > left:
                return fallen(left), (v + g / k) * mpmath.exp(-k * left) - g / k, count
            z, v, left, count = exact(0), -e * ((v + g / k) * mpmath.exp(-k * s) - g / k), left - s, count + 1


def test_a_ball_under_linear_drag_bounces_as_the_closed_form_says() -> None:
    engine = xp.PhysicsEngine(up="z")
    bounce = engine.add_law("collision:elastic", restitution=0.9)
    laws = [
        bounce,
        engine.add_law("basic:planet_gravity", acceleration=9.81),
        engine.add_law("basic:linear_drag", coefficient=0.3),
    ]
    add_floor(engine, bounce)
    point = engine.add_object(xp.PhysicalObject(mass=0.5, position=(0, 0, 1.875), velocity=(3.0, 1.0, 0.0)), laws=laws)
    engine.run(until=5.0, dt=0.25)
    assert stepper_of(engine, point) == "core:linear"
    z, v, count = linear_bounces(0.3, 9.81, 0.9, 1.875, 5.0)
    assert impacts_of(engine) == count == 12
    assert abs(point.position[2] - float(z)) < 1e-14 and abs(point.velocity[2] - float(v)) < 1e-12
    assert point.position[0] == pytest.approx(5.0 * (1.0 - math.exp(-3.0)), rel=1e-14)


@pytest.mark.parametrize("rest_length", [0.0, 0.2])
def test_a_ball_on_a_spring_hits_a_wall(rest_length: float) -> None:
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic", restitution=1.0)
    spring = engine.add_law("basic:spring_to_point", stiffness=4.0, rest_length=rest_length)
    engine.add_object(xp.PhysicalObject(xp.Plane((1, 0, 0), offset=-0.5), fixed=True), laws=[bounce])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(1, 0.3, 0)), laws=[bounce, spring])
    energy = engine.energy().total
    engine.run(until=20.0, **TIGHT)
    assert stepper_of(engine, ball) == ("core:adaptive" if rest_length else "core:linear")
    assert impacts_of(engine) >= 9
    assert engine.energy().total == pytest.approx(energy, rel=1e-13)
    if not rest_length:
        turn = math.acos(-0.4) / 2.0
        since = (20.0 - turn) % (2.0 * turn)
        assert ball.position[0] == pytest.approx(math.cos(2.0 * (turn - since)), abs=1e-13)
        assert ball.position[1] == pytest.approx(0.3 * math.cos(40.0), abs=1e-13)


@pytest.mark.parametrize(("stepper", "end"), [("", 8.5), ("core:adaptive", 8.5)])
def test_two_balls_that_attract_each_other_bounce_twenty_times_and_keep_their_energy(stepper: str, end: float) -> None:
    engine = xp.PhysicsEngine(stepper=stepper)
    laws = [
        engine.add_law("collision:elastic", restitution=1.0),
        engine.add_law("basic:universal_gravity", gravitational_constant=1.0),
    ]
    state = [(1.0, (-0.25, 0, 0), (0, 0.1, 0)), (2.0, (0.25, 0, 0), (0, -0.05, 0))]
    for mass, position, velocity in state:
        engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), mass=mass, position=position, velocity=velocity), laws=laws)
    energy, spin = engine.energy().total, np.array(engine.angular_momentum())
    engine.run(until=end, **TIGHT)
    one, _ = engine.objects
    assert stepper_of(engine, one) == (stepper or "core:kepler")
    assert impacts_of(engine) >= 20
    assert abs(engine.energy().total / energy - 1.0) < 1e-11
    assert np.abs(np.array(engine.angular_momentum()) - spin).max() < 1e-12
    assert np.abs(engine.momentum()).max() < 1e-12


# Who flies by what


def test_a_ball_under_drag_comes_to_rest_along_parabolas_and_rests() -> None:
    engine = xp.PhysicsEngine(up="z")
    bounce = engine.add_law("collision:elastic", restitution=0.5)
    laws = [bounce, engine.add_law("basic:planet_gravity"), engine.add_law("basic:linear_drag", coefficient=0.1)]
    floor = add_floor(engine, bounce)
    ball = engine.add_object(
        xp.PhysicalObject(xp.Sphere(0.1), mass=1.0, position=(0, 0, 1), velocity=(1, 0, 0)), laws=laws
    )
    engine.run(until=1.0)
    assert stepper_of(engine, ball) == "core:linear"
    engine.run(until=3.0)
    report = engine.explain().data["contacts"]
    assert report["supports"] == [f"{ball.label} on {floor.label}"]
    assert stepper_of(engine, ball) == "core:midpoint"
    assert report["parabolas"] == [f"{ball.label}: it rests on {floor.label}"]
    assert ball.position[2] == pytest.approx(0.1, abs=1e-15) and ball.velocity[2] == 0.0
    assert ball.velocity[0] == pytest.approx(math.exp(-0.3), rel=1e-4)
    ball.velocity = (0, 0, 2)  # thrown up, it flies on its curve again
    engine.run(until=3.1)
    assert stepper_of(engine, ball) == "core:linear"


def test_an_impact_cuts_no_step_of_others() -> None:
    """Of balls far apart under one law, only that which hits a wall is stepped on its own from then on."""

    def fly(wall: bool) -> tuple[float, ...]:
        engine = xp.PhysicsEngine(up="z")
        bounce = engine.add_law("collision:elastic", restitution=1.0)
        laws = [bounce, engine.add_law("basic:quadratic_drag")]
        for y in (0.0, 10.0):
            ball = xp.PhysicalObject(xp.Sphere(0.1), position=(0, y, 0), velocity=(5, 0, 1), drag_area=0.05)
            engine.add_object(ball, laws=laws)
        if wall:
            engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(1.5, 0, 0), fixed=True), laws=[bounce])
        engine.run(until=1.0)
        assert impacts_of(engine) == wall
        return tuple(engine.objects[1].position) + tuple(engine.objects[1].velocity)

    assert fly(True) == fly(False)


def test_a_fast_ball_under_drag_misses_no_thin_one() -> None:
    engine = xp.PhysicsEngine()
    laws = [engine.add_law("collision:elastic", restitution=1.0), engine.add_law("basic:quadratic_drag", density=1e-3)]
    thin = engine.add_object(xp.PhysicalObject(xp.Sphere(1e-3), position=(500.0, 0, 0), fixed=True), laws=laws[:1])
    bullet = xp.PhysicalObject(xp.Sphere(1e-3), velocity=(1e4, 0, 0), drag_area=1e-3)
    engine.add_object(bullet, laws=laws)
    engine.run(until=0.1)
    assert impacts_of(engine) == 1 and bullet.velocity[0] < 0.0 and thin.fixed


def test_listeners_hear_who_flies_through_without_an_answer() -> None:
    heard: list[tuple[str, float]] = []

    class Gate(xp.PhysicalLaw):
        """Write down."""

        id = "curves:gate"

        def enforce_this_law(self, event: Any) -> None:
            heard.append((type(event.condition).__name__, event.time))

    engine = xp.PhysicsEngine()
    containers = [engine.add_container(xp.LawContainer(kind())) for kind in (xp.when.ContactBegin, xp.when.ContactEnd)]
    law = Gate()
    for container in containers:
        container.add_law(law)
    spring = engine.add_law("basic:spring_to_point", stiffness=4.0)
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(1, 0, 0)), laws=[law, spring])
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.2), fixed=True), laws=[law])
    engine.run(until=3.0)
    into, out = math.acos(0.3) / 2.0, math.acos(-0.3) / 2.0
    half = math.pi / 2.0
    assert [name for name, _ in heard] == ["ContactBegin", "ContactEnd"] * 2
    assert [t for _, t in heard] == pytest.approx([into, out, half + into, half + out], abs=1e-13)
    assert ball.position[0] == pytest.approx(math.cos(6.0), abs=1e-13)


@pytest.mark.parametrize("count", [6, 20, 50])
def test_balls_under_drag_and_weight_bounce_as_tighter_tolerances_say(count: int) -> None:
    """Few pairs asked all, near ones, and those of a sweep: the same impacts to different tolerances."""

    def run(tolerance: float, until: float) -> tuple[Any, int]:
        rng = np.random.default_rng(count)
        engine = xp.PhysicsEngine(up="z")
        bounce = engine.add_law("collision:elastic", restitution=0.9)
        laws = [bounce, engine.add_law("basic:planet_gravity"), engine.add_law("basic:quadratic_drag")]
        add_floor(engine, bounce)
        for k in range(count):
            x, y, z = (0.3 * c for c in (k % 4, k // 4 % 4, k // 16))
            ball = xp.PhysicalObject(
                xp.Sphere(0.1), position=(x, y, 0.3 + z), velocity=tuple(2.0 * rng.normal(size=3)), drag_area=0.03
            )
            engine.add_object(ball, laws=laws)
        engine.run(until=until, rtol=tolerance, atol=tolerance)
        assert {group["stepper"] for group in engine.explain().data["groups"]} == {"core:adaptive", "none"}
        places = np.array([ball.position for ball in engine.objects[1:]])
        apart = np.sqrt(((places[:, None] - places[None]) ** 2).sum(axis=2)) + 9.0 * np.eye(count)
        assert apart.min() > 0.2 - 1e-12 and places[:, 2].min() > 0.1 - 1e-12
        return places, impacts_of(engine)

    until = 0.06 if count > 20 else 0.2
    loose, tight = run(1e-8, until), run(1e-11, until)
    assert loose[1] == tight[1] > 2
    assert np.abs(loose[0] - tight[0]).max() < 1e-6


# Bodies with corners


def test_a_tumbling_box_under_drag_comes_down_on_a_corner_and_loses_nothing_by_it() -> None:
    engine = xp.PhysicsEngine(up="z")
    bounce = engine.add_law("collision:elastic", restitution=1.0)
    laws = [bounce, engine.add_law("basic:planet_gravity"), engine.add_law("basic:linear_drag", coefficient=0.2)]
    add_floor(engine, bounce)
    box = xp.PhysicalObject(
        xp.Box((0.4, 0.3, 0.2)), position=(0, 0, 1.0), velocity=(1, 0, 0), angular_velocity=(1, 2, 3)
    )
    engine.add_object(box, laws=laws)
    energy = engine.energy()
    engine.run(until=1.2)
    assert stepper_of(engine, box) == "core:linear" and impacts_of(engine) >= 1
    now = engine.energy()
    assert now.total - now.work == pytest.approx(energy.total, rel=1e-11)
    lowest = min(
        box.position[2] + 0.5 * sum(s * c * a[2] for s, c, a in zip(signs, (0.4, 0.3, 0.2), axes_of(box), strict=True))
        for signs in [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    )
    assert lowest > -1e-12


def axes_of(body: xp.PhysicalObject) -> list[Any]:
    """Its three axes in the world."""
    from xpheve.kernels.quaternion import rotate

    return [rotate(body.orientation, axis) for axis in ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))]


def test_a_box_that_does_not_turn_meets_the_floor_as_a_point_at_its_face_would() -> None:
    times: list[float] = []

    class Hear(xp.PhysicalLaw):
        """Write down."""

        id = "curves:hear"

        def enforce_this_law(self, event: Any) -> None:
            times.append(event.time)

    for shape, height in ((xp.Box((0.4, 0.3, 0.2)), 1.1), (xp.Sphere(0.1), 1.1), (None, 1.0)):
        engine = xp.PhysicsEngine(up="z")
        bounce = engine.add_law("collision:elastic", restitution=1.0)
        hear = engine.add_law(Hear, container=xp.LawContainer(xp.when.ContactBegin(once=True)))
        laws = [
            bounce,
            hear,
            engine.add_law("basic:planet_gravity"),
            engine.add_law("basic:linear_drag", coefficient=0.2),
        ]
        engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce, hear])
        engine.add_object(xp.PhysicalObject(shape, mass=1.0, position=(0, 0, height)), laws=laws)
        engine.run(until=0.6)
    assert len(times) == 3 and times[1:] == pytest.approx([times[0]] * 2, abs=1e-12)


# Windows


def test_windows_follow_from_the_flight_alone() -> None:
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic")
    spring = engine.add_law("basic:spring_to_point", stiffness=4.0)
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(1, 0, 0)), laws=[bounce, spring])
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(0, 5, 0), fixed=True), laws=[bounce])
    world: Any = engine._world
    last, lengths = None, []
    for k in range(1, 120):
        engine.run(until=0.5 * k)
        low, high = world.contacts.curves.window(ball, world.flight(ball._row))
        assert low <= world.time <= high
        if last is not None and low != last[0]:
            assert low >= last[1]
            lengths.append(elapsed(high, low))
        last = low, high
    assert lengths == sorted(lengths) and max(lengths) < 1e3


def test_a_checkpoint_goes_on_to_the_same_bits() -> None:
    def scene() -> xp.PhysicsEngine:
        engine = xp.PhysicsEngine()
        bounce = engine.add_law("collision:elastic", restitution=1.0)
        spring = engine.add_law("basic:spring_to_point", stiffness=4.0)
        engine.add_object(xp.PhysicalObject(xp.Plane((1, 0, 0), offset=-0.5), fixed=True), laws=[bounce])
        engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(1, 0.3, 0)), laws=[bounce, spring])
        return engine

    whole, halves = scene(), scene()
    whole.run(until=9.0)
    halves.run(until=4.0)
    saved = halves.checkpoint()
    halves.run(until=7.0)
    halves.restore(saved)
    halves.run(until=9.0)
    assert halves.objects[1].position == whole.objects[1].position
    assert halves.objects[1].velocity == whole.objects[1].velocity
