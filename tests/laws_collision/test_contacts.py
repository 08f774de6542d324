"""Laws that answer contacts themselves, and contacts of one instant."""

from __future__ import annotations

import math
from typing import Any

import pytest

import xpheve as xp
from xpheve.errors import ContactError, InvalidValueError

when = xp.when


class Hear(xp.PhysicalLaw):
    """Keep what it is told."""

    condition = when.Impact()

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        self.events: list[Any] = []

    def enforce_this_law(self, event: Any) -> None:
        self.events.append(event)


class Stick(xp.ResponseLaw):
    """Take the pair over with an impulse that leaves no approach."""

    seen: list[Any]

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        self.seen = []

    def respond(self, contact: Any) -> Any:
        self.seen.append(contact)
        a, b = contact.body_a, contact.body_b
        reduced = 1.0 / (1.0 / a.mass + (0.0 if b.fixed else 1.0 / b.mass))
        return xp.Impulse([reduced * contact.approach_speed * (1 + 1e-12) * n for n in contact.normal])


def spheres(engine: xp.PhysicsEngine, laws: Any, *at: tuple[Any, Any], radius: float = 0.5) -> list[xp.PhysicalObject]:
    """Return spheres at positions with velocities."""
    return [engine.add_object(xp.PhysicalObject(xp.Sphere(radius), position=x, velocity=v), laws=laws) for x, v in at]


def test_an_impulse_takes_the_pair_over() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law(Stick())
    one, two = spheres(engine, [law], ((0, 0, 0), (1, 0, 0)), ((3, 0, 0), (0, 0, 0)))
    engine.run(until=4.0)
    assert one.velocity[0] == pytest.approx(0.5) and two.velocity[0] == pytest.approx(0.5)
    assert len(law.seen) == 1 and engine.momentum()[0] == pytest.approx(1.0, abs=1e-15)
    assert engine.energy().balance == pytest.approx(0.5, abs=1e-14)


def test_a_contact_says_where_and_how() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law(Stick())
    spheres(engine, [law], ((0, 0, 0), (2, 0, 0)), ((3, 0, 0), (-1, 0, 0)))
    engine.run(until=1.0)
    contact = law.seen[0]
    assert contact.approach_speed == 3.0 and abs(contact.separation) < 1e-12
    assert abs(contact.normal[0]) == 1.0
    side = contact.body_b.position[0] - contact.body_a.position[0]
    assert math.copysign(1.0, side) == contact.normal[0]
    assert contact.point[0] == pytest.approx(0.5 + 2 * 2 / 3, abs=1e-14)


def test_five_balls_each_touching_pair_once() -> None:
    engine = xp.PhysicsEngine()
    hear, bounce = engine.add_law(Hear()), engine.add_law("collision:elastic")
    ring = [(math.cos(a), math.sin(a), 0.0) for a in (0.0, math.pi / 2, math.pi, 3 * math.pi / 2)]
    spheres(engine, [hear, bounce], ((0, 0, 0), (0, 0, 0)), *[([3 * c for c in x], [-c for c in x]) for x in ring])
    engine.run(until=2.5)
    pairs = [frozenset((one.body_a, one.body_b)) for event in hear.events for one in event.contacts]
    assert len(pairs) == len(set(pairs)) == 4
    times = {event.time for event in hear.events}
    assert max(times) - min(times) < 1e-14


def test_a_third_body_touching_a_pair_is_reported_too() -> None:
    engine = xp.PhysicsEngine()
    hear, bounce = engine.add_law(Hear()), engine.add_law("collision:elastic")
    spheres(engine, [hear, bounce], ((0, 0, 0), (1, 0, 0)), ((2, 0, 0), (0, 0, 0)), ((3, 0, 0), (0, 0, 0)))
    engine.run(until=3.0)
    reported = {frozenset((one.body_a, one.body_b)) for event in hear.events for one in event.contacts}
    assert len(reported) == 2


def test_a_moving_plane_or_a_pair_without_a_family_is_named() -> None:
    with pytest.raises(InvalidValueError, match="fixed"):
        xp.PhysicalObject(xp.Plane(), velocity=(1, 0, 0))
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    skin = xp.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])
    crate = engine.add_object(xp.PhysicalObject(skin, name="crate"))
    ball = engine.add_object(
        xp.PhysicalObject(xp.Box((1, 1, 1)), name="box", position=(5, 0, 0), velocity=(-1, 0, 0)), laws=[law]
    )
    engine.run(until=1.0)
    for _ in range(2):
        with pytest.raises(ContactError, match=r"(?s)crate.*mesh|mesh.*crate"):
            engine.map(crate, law)
            engine.run(until=10.0)
        assert engine.time == 1.0 and engine.state == "ready" and ball.position == (4, 0, 0)
    engine.unmap(crate, law)
    engine.run(until=10.0)
    assert ball.position == (-5, 0, 0)


def test_two_planes_and_other_fixed_things_never_meet() -> None:
    engine = xp.PhysicsEngine()
    hear, bounce = engine.add_law(Hear()), engine.add_law("collision:elastic")
    for normal in ((0, 1, 0), (1, 0, 0)):
        engine.add_object(xp.PhysicalObject(xp.Plane(normal), fixed=True), laws=[hear, bounce])
    engine.add_object(xp.PhysicalObject(xp.Sphere(1), fixed=True), laws=[hear, bounce])
    engine.run(until=10.0)
    assert hear.events == []


@pytest.mark.parametrize("resting", ["error", "hold"])
def test_a_second_support_is_an_error_or_held(resting: str) -> None:
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", direction=(-1, 0, -1))
    law = engine.add_law("collision:elastic", restitution=0.0, resting=resting)
    for normal, name in (((0, 0, 1), "floor"), ((1, 0, 0), "wall")):
        engine.add_object(xp.PhysicalObject(xp.Plane(normal), fixed=True, name=name), laws=[law])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(2, 0, 1), name="ball"), laws=[gravity, law])
    if resting == "error":
        with pytest.raises(ContactError, match=r"ball.*(wall|floor).*hold"):
            engine.run(until=9.0)
    else:
        engine.run(until=9.0)
        assert ball.velocity == (0, 0, 0) and ball.position == pytest.approx((0.5, 0, 0.5), abs=1e-12)


def test_a_ball_slides_down_a_slope_as_if_on_rails() -> None:
    engine = xp.PhysicsEngine(up="z")
    gravity, law = (
        engine.add_law("basic:planet_gravity", acceleration=10.0),
        engine.add_law("collision:elastic", restitution=0.5),
    )
    engine.add_object(xp.PhysicalObject(xp.Plane((0.6, 0, 0.8)), fixed=True), laws=[law])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(0.3, 0, 0.4)), laws=[gravity, law])
    engine.run(until=2.0)
    way = 0.5 * 6.0 * 4.0
    assert ball.position == pytest.approx((0.3 + 0.8 * way, 0, 0.4 - 0.6 * way), abs=1e-12)
    assert engine.energy().balance == pytest.approx(4.0, abs=1e-12)


def test_the_servers_choice_survives_a_checkpoint_at_any_moment() -> None:
    engine = xp.PhysicsEngine(up="z")
    gravity, law = engine.add_law("basic:planet_gravity"), engine.add_law("collision:elastic", restitution=0.7)
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[law])
    for k in range(4):
        engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(0.5 * k, 0, 1 + 0.3 * k)), laws=[gravity, law])
    whole = engine.copy()
    whole.run(until=6.0)
    for until in (0.4, 0.44, 1.0, 2.5, 2.6, 4.0, 6.0):
        engine.run(until=until)
        engine = xp.PhysicsEngine.restore(engine.checkpoint())
    assert [(o.position, o.velocity) for o in engine.objects] == [(o.position, o.velocity) for o in whole.objects]


@pytest.mark.parametrize("names", [("b", "a"), ("a", "b")])
@pytest.mark.parametrize("floor_first", [False, True])
def test_the_error_says_which_of_two_rests_on_which(names: tuple[str, str], floor_first: bool) -> None:
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity")
    bounce = engine.add_law("collision:elastic", restitution=0.5)
    box = xp.PhysicalObject(xp.Box((1, 1, 1)), position=(0, 0, 0.5), name=names[0])
    floor = xp.PhysicalObject(xp.Plane(), fixed=True, name=names[1])
    for obj in (floor, box) if floor_first else (box, floor):
        engine.add_object(obj, laws=[bounce] if obj is floor else [gravity, bounce])
    with pytest.raises(ContactError, match=rf"'{names[0]}' Box.* rests on .*'{names[1]}' Plane"):
        engine.run(until=1.0)
