"""Contacts at the ends of what there is: driven through planes, wedged, far too fast, sunk for good."""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import ContactError
from xpheve_laws_collision.impact_time.advancement import UndecidedError
from xpheve_laws_collision.impact_time.path import Path, angular_acceleration
from xpheve_laws_collision.narrow_phase import Mover, family_of
from xpheve_laws_collision.narrow_phase.convex import CorePair

when = xp.when
STILL = (0.0, 0.0, 0.0)


class Hear(xp.PhysicalLaw):
    """Keep when it was told of what."""

    def __init__(self, heard: list[tuple[str, float]], **given: Any) -> None:
        super().__init__(**given)
        self.heard = heard

    def enforce_this_law(self, event: Any) -> None:
        self.heard.append((type(event.condition).__name__, event.time))


def floor_and(shape: Any, height: float, listen: bool) -> tuple[xp.PhysicsEngine, xp.PhysicalObject, list[Any]]:
    """A floor, something above it, and what listeners hear of the two."""
    engine = xp.PhysicsEngine(up="z")
    heard: list[tuple[str, float]] = []
    laws = [engine.add_law("collision:elastic")]
    if listen:
        for condition in (when.ContactBegin(), when.ContactEnd()):
            laws.append(engine.add_law(Hear(heard), container=xp.LawContainer(condition)))
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True, name="floor"), laws=laws)
    body = engine.add_object(xp.PhysicalObject(shape, position=(0, 0, height), name="body"), laws=laws)
    return engine, body, heard


SHAPES = [xp.Sphere(0.1), xp.Box((0.2, 0.2, 0.2))]


@pytest.mark.parametrize("shape", SHAPES, ids=repr)
@pytest.mark.parametrize("rounding", [0.0, 1e-13, -1e-13])
@pytest.mark.parametrize("listen", [False, True])
def test_what_is_driven_through_a_plane_is_told_once_and_answered_by_nobody(
    shape: Any, rounding: float, listen: bool
) -> None:
    for height in (0.1, 0.5):
        engine, body, heard = floor_and(shape, height + rounding, listen)
        body.drive(velocity=(0.3, 0, -1))
        engine.run(until=2.0)
        body.drive(velocity=(0, 0, 1))
        engine.run(until=8.0)
        assert body.velocity == (0, 0, 1)
        told = (
            [name for name, _ in heard if name == "ContactBegin"],
            [name for name, _ in heard if name == "ContactEnd"],
        )
        assert told == ((["ContactBegin"], ["ContactEnd"]) if listen else ([], []))
        assert engine.explain().data["contacts"]["impacts"] == 0
        if not listen:
            assert engine.explain().data["contacts"]["touching"] == []


@pytest.mark.parametrize("shape", SHAPES, ids=repr)
def test_what_is_let_go_under_the_floor_falls_on_for_ever(shape: Any) -> None:
    engine, body, heard = floor_and(shape, 0.5, True)
    body.drive(velocity=(0.1, 0, -1))
    engine.run(until=2.0)
    body.release()
    engine.run(until=1e6)
    assert body.position[2] == pytest.approx(0.5 - 1e6)
    assert [name for name, _ in heard] == ["ContactBegin"]


def test_what_is_driven_along_in_a_floor_asks_for_no_search() -> None:
    engine, body, heard = floor_and(xp.Box((0.2, 0.2, 0.2)), 0.05, True)
    body.drive(velocity=(1, 0, 0))
    engine.run(until=5.0)
    assert [name for name, _ in heard] == ["ContactBegin"] and body.position == pytest.approx((5, 0, 0.05))


def test_what_turns_for_ever_half_in_the_floor_is_asked_again_and_again() -> None:
    engine, body, heard = floor_and(xp.Box((0.2, 0.2, 0.2)), 0.05, True)
    body.drive(velocity=STILL, angular_velocity=(1, 2, 0))
    engine.run(until=5.0)
    assert [name for name, _ in heard] == ["ContactBegin"]
    a = Mover((0, 0, 0.05), STILL, STILL, (1.0, 0.0, 0.0, 0.0), body.shape, (1.0, 2.0, 0.0))
    b = Mover(STILL, STILL, STILL, (1.0, 0.0, 0.0, 0.0), xp.Plane((0, 0, 1)))
    family, _ = family_of("box", "plane")
    with pytest.raises(UndecidedError) as undecided:
        family.leave_time(a, b, family.gap(a, b), math.inf)
    assert undecided.value.until > 5.0


def gap_filled(velocity: Any, restitution: float = 1.0, gravity: bool = False) -> tuple[Any, Any]:
    """A ball that fills the gap between two planes."""
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("collision:elastic", restitution=restitution)
    pull = [engine.add_law("basic:planet_gravity")] if gravity else []
    engine.add_object(xp.PhysicalObject(xp.Plane((0, 0, 1)), fixed=True, name="floor"), laws=[law])
    engine.add_object(xp.PhysicalObject(xp.Plane((0, 0, -1), offset=-0.2), fixed=True, name="ceiling"), laws=[law])
    ball = xp.PhysicalObject(xp.Sphere(0.1), position=(0, 0, 0.1), velocity=velocity, name="ball")
    return engine, engine.add_object(ball, laws=[law, *pull])


def test_a_ball_that_fills_a_gap_moves_along_it() -> None:
    engine, ball = gap_filled((1, 0.5, 0))
    engine.run(until=2.0)
    assert ball.position == (2, 1, 0.1) and ball.velocity == (1, 0.5, 0)
    assert engine.explain().data["contacts"]["impacts"] == 0


def test_a_ball_that_fills_a_gap_rests_on_the_plane_it_is_pressed_on() -> None:
    engine, ball = gap_filled((1, 0, 0), gravity=True)
    engine.run(until=2.0)
    assert ball.position == (2, 0, 0.1)
    assert engine.explain().data["contacts"]["supports"] == ["ball on floor"]


def test_a_ball_that_fills_a_gap_and_goes_across_is_refused_by_name() -> None:
    engine, _ = gap_filled((1, 0, -1))
    with pytest.raises(ContactError, match=r"ball.*ceiling|ceiling.*ball"):
        engine.run(until=2.0)


def test_a_ball_that_fills_a_gap_loses_its_speed_across_to_restitution() -> None:
    engine, ball = gap_filled((1, 0, -1), restitution=0.5)
    engine.run(until=2.0)
    assert ball.position == pytest.approx((2, 0, 0.1)) and abs(ball.velocity[2]) < 1e-12


@pytest.mark.parametrize("speed", [1.0, 1e20, 1e80, 1e155, 1e300])
@pytest.mark.parametrize("miss", [0.0, 0.05, 0.1999, 0.2001])
def test_balls_meet_alike_at_any_speed_that_floats_hold(speed: float, miss: float) -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    one = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1)), laws=[law])
    other = xp.PhysicalObject(xp.Sphere(0.1), position=(1, miss, 0), velocity=(-speed, 0, 0))
    engine.add_object(other, laws=[law])
    engine.run(until=2.0 / speed)
    along = 0.0 if miss > 0.2 else 1.0 - (miss / 0.2) ** 2
    assert one.velocity[0] / speed == pytest.approx(-along, abs=1e-9)
    assert other.velocity[0] / speed == pytest.approx(along - 1.0, abs=1e-9)


@pytest.mark.parametrize("shape", SHAPES, ids=repr)
def test_what_slides_faster_than_the_root_of_the_greatest_float_slides_on(shape: Any) -> None:
    engine, body, _ = floor_and(shape, 0.1, False)
    body.velocity = (1e155, 0, 0)
    engine.run(until=2.0)
    assert body.position == (2e155, 0, 0.1)


def test_boxes_that_turn_beyond_the_range_of_floats_are_refused() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    engine.add_object(xp.PhysicalObject(xp.Box((0.2, 0.2, 0.2))), laws=[law])
    spinning = xp.PhysicalObject(
        xp.Box((0.2, 0.2, 0.2)), position=(1, 0, 0), velocity=(-1e155, 0, 0), angular_velocity=(1e160, 1e159, 0)
    )
    with pytest.raises(ContactError, match="no float holds"):
        engine.add_object(spinning, laws=[law])
        engine.run(until=1.0)


def test_a_torque_turns_nothing_that_has_no_inertia() -> None:
    path = Path(Mover(STILL, STILL, STILL, (1.0, 0.0, 0.0, 0.0), None, STILL, STILL, (0.0, 0.0, 1.0)))
    assert path.window(0.0) == math.inf and path.bounds(0.0, 1.0) == (0.0, 0.0)


@pytest.mark.parametrize("size", [(2.0, 0.01, 0.05), (1.0, 1.0, 0.001), (1.0, 0.8, 0.6)])
@pytest.mark.parametrize("spin", [(300.0, 1.0, 20.0), (1e-6, 400.0, 1e-3), (3.0, -2.0, 400.0)])
def test_bounds_on_a_free_rotation_hold_and_are_close(size: Any, spin: Any) -> None:
    box = xp.Box(size)
    path = Path(Mover(STILL, STILL, STILL, (0.8, 0.0, 0.6, 0.0), box, spin, box.inertia(1.0)))
    rate, change = path.bounds(0.0, math.inf)
    seen = [path.at(0.0002 * k) for k in range(2000)]
    rates = [math.hypot(*one.angular_velocity) for one in seen]
    assert max(rates) <= rate <= 1.5 * max(rates)
    assert max(math.hypot(*angular_acceleration(one)) for one in seen) <= change


def test_a_thin_rod_that_tumbles_between_planes_is_followed_in_few_steps(monkeypatch: Any) -> None:
    looks = 0
    stand = CorePair.stand

    def counted(self: CorePair, s: float) -> Any:
        nonlocal looks
        looks += 1
        return stand(self, s)

    monkeypatch.setattr(CorePair, "stand", counted)
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    for normal in ((0, 0, 1), (0, 0, -1)):
        engine.add_object(xp.PhysicalObject(xp.Plane(normal, offset=-1.5), fixed=True), laws=[law])
    rod = xp.PhysicalObject(xp.Box((2.0, 0.01, 0.05)), velocity=(0, 0, 2), angular_velocity=(60, 250, 280))
    engine.add_object(rod, laws=[law])
    before = engine.energy().total
    engine.run(until=1.0)
    impacts = engine.explain().data["contacts"]["impacts"]
    assert engine.energy().total == pytest.approx(before, rel=1e-12)
    assert impacts >= 1 and looks < 2_000 * (impacts + 1)


@pytest.mark.parametrize("kind", [xp.Capsule(0.2, 0.6), xp.Hull([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])], ids=str)
def test_bodies_that_overlap_and_come_apart_while_they_turn_are_followed_in_seconds(kind: xp.Shape) -> None:
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic")
    box = xp.PhysicalObject(xp.Box((1, 0.5, 0.3)), orientation=(1, 2, -1, 3), angular_velocity=(3, -2, 1))
    other = xp.PhysicalObject(
        kind, position=(0.2, 0.2, 0.2), orientation=(2, -1, 1, 1), velocity=(0.8, 0.9, 0.7), angular_velocity=(-1, 4, 2)
    )
    engine.add_objects([box, other], laws=[bounce])
    begun = time.process_time()
    engine.run(until=1.0)
    assert time.process_time() - begun < 15.0  # in steps of the clock's last place it was minutes
    assert np.linalg.norm(np.subtract(other.position, box.position)) > 0.9


def test_an_impulse_beyond_floats_is_an_error_that_names_the_pair() -> None:
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic")
    crate = xp.PhysicalObject(xp.Box((1, 1, 1)), mass=1e300, velocity=(0, -1e10, 0), position=(0, 5, 0), name="crate")
    engine.add_object(crate, laws=[bounce])
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True, name="floor"), laws=[bounce])
    with pytest.raises(ContactError, match=r"crate.*floor|floor.*crate"):
        engine.run(until=1.0)


def test_moments_of_inertia_near_the_least_float_are_followed() -> None:
    speck = Path(
        Mover(
            (0, 0, 0), (0, 0, 0), (0, 0, 0), (1, 0, 0, 0), xp.Box((1, 1, 1)), angular_velocity=(1, 2, 3),
            inertia=(3e-310, 2e-310, 4e-310), torque=(0, 0, 0),
        )
    )  # fmt: skip
    rate, _ = speck.bounds(0.0, 1.0)
    assert math.sqrt(14.0) <= rate < 10.0
