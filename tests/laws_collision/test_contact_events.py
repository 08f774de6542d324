"""What listeners are told of contacts: all pairs, point, normal, velocities before, impulses, exact instant."""

from __future__ import annotations

import math
from typing import Any

import pytest

import xpheve as xp
from xpheve.kernels.clock import elapsed


class Ear(xp.PhysicalLaw):
    """Keeps the events it is told of."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.heard: list[xp.Event] = []

    def enforce_this_law(self, event: xp.Event) -> None:
        self.heard.append(event)

    @property
    def contacts(self) -> list[xp.Contact]:
        """All contacts told so far."""
        return [contact for event in self.heard for contact in event.contacts]


def scene(law: str, *conditions: Any, **numbers: Any) -> tuple[xp.PhysicsEngine, Any, list[Ear]]:
    engine = xp.PhysicsEngine(up="z")
    response = engine.add_law(law, **numbers)
    ears = [engine.add_law(Ear(), xp.LawContainer(condition)) for condition in conditions]
    return engine, response, ears  # type: ignore[return-value]


def test_an_impact_tells_the_velocity_before_the_impulse_and_the_exact_instant() -> None:
    engine, rub, (ear,) = scene("collision:friction", xp.when.Impact(), restitution=0.5, friction=0.1)
    gravity = engine.add_law("basic:planet_gravity", acceleration=10.0)
    floor = engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[rub, ear])
    ball = xp.PhysicalObject(
        xp.Sphere(0.1), mass=2.0, position=(0, 0, 0.6), velocity=(3, 0, 0), angular_velocity=(0, 4, 0)
    )
    engine.add_object(ball, laws=[gravity, rub, ear])
    engine.run(until=0.5)
    (contact,) = ear.contacts
    fall = math.sqrt(0.1)
    assert (contact.body_a, contact.body_b) == (floor, ball) and contact.normal == (0, 0, 1)
    assert contact.relative_velocity == pytest.approx((3.0 - 0.4, 0.0, -10 * fall), abs=1e-14)
    assert contact.tangential_velocity == pytest.approx((2.6, 0.0, 0.0), abs=1e-14)
    assert contact.approach_speed == pytest.approx(10 * fall, abs=1e-14)
    push = 2.0 * 1.5 * 10 * fall
    assert contact.impulse_vector == pytest.approx((-0.1 * push, 0.0, push), abs=1e-13)
    assert contact.impulse == pytest.approx(push * math.hypot(1.0, 0.1), rel=1e-14)
    assert contact.time == ear.heard[0].time == contact.instant[0]
    assert abs(elapsed(contact.instant, (fall, 0.0))) < 1e-16


def test_momentum_changes_by_the_impulses_that_are_told() -> None:
    engine, bounce, (ear,) = scene("collision:elastic", xp.when.Impact())
    balls = [
        engine.add_object(
            xp.PhysicalObject(xp.Sphere(0.5), mass=m, position=(x, y, 0), velocity=(v, 0, 0)), laws=[bounce, ear]
        )
        for m, x, y, v in ((1.0, -2.0, 0.0, 3.0), (2.0, 0.0, 0.5, 0.0), (4.0, 0.0, -0.5, 0.0))
    ]
    before = [ball.velocity for ball in balls]
    engine.run(until=1.0)
    assert len(ear.heard) >= 1 and len(ear.heard[0].contacts) == 2
    for ball, old in zip(balls, before, strict=True):
        total = [0.0, 0.0, 0.0]
        for contact in ear.contacts:
            for body, sign in ((contact.body_a, -1.0), (contact.body_b, 1.0)):
                if body is ball and not math.isnan(contact.impulse):
                    total = [t + sign * p for t, p in zip(total, contact.impulse_vector, strict=True)]
        assert [ball.mass * (new - v) for new, v in zip(ball.velocity, old, strict=True)] == pytest.approx(
            total, abs=1e-13
        )


def test_a_flat_box_tells_one_contact_with_the_sum_of_its_corners() -> None:
    engine, bounce, (ear,) = scene("collision:elastic", xp.when.Impact())
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce, ear])
    box = engine.add_object(
        xp.PhysicalObject(xp.Box((1, 1, 1)), mass=3.0, position=(0, 0, 1), velocity=(0, 0, -2)), laws=[bounce, ear]
    )
    engine.run(until=0.5)
    (contact,) = ear.contacts
    assert contact.impulse == pytest.approx(12.0) and contact.impulse_vector == pytest.approx((0, 0, 12.0))
    assert contact.relative_velocity == (0, 0, -2) and box.velocity == (0, 0, 2)


@pytest.mark.parametrize(
    "law", ["collision:reverse", "collision:stop", "collision:stick", "collision:rough", "collision:point"]
)
def test_all_responses_tell_what_they_gave(law: str) -> None:
    engine, response, (ear,) = scene(law, xp.when.Impact())
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[response, ear])
    ball = xp.PhysicalObject(xp.Sphere(0.1), mass=2.0, position=(0, 0, 1), velocity=(1, 0, -3))
    engine.add_object(ball, laws=[response, ear])
    engine.run(until=0.5)
    given = [2.0 * (new - old) for new, old in zip(ball.velocity, (1, 0, -3), strict=True)]
    assert ear.contacts[0].impulse_vector == pytest.approx(given, abs=1e-14)


def test_begin_tells_the_velocity_before_and_end_the_one_after() -> None:
    engine, bounce, (begin, end) = scene(
        "collision:elastic", xp.when.ContactBegin(), xp.when.ContactEnd(), restitution=0.5
    )
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce, begin, end])
    ball = xp.PhysicalObject(xp.Sphere(0.1), position=(0, 0, 1), velocity=(1, 0, -3))
    engine.add_object(ball, laws=[bounce, begin, end])
    engine.run(until=0.5)
    assert begin.contacts[0].relative_velocity == (1, 0, -3) and begin.contacts[0].impulse == 4.5
    assert end.contacts[0].relative_velocity == (1, 0, 1.5) and math.isnan(end.contacts[0].impulse)
    assert begin.contacts[0].instant == end.contacts[0].instant


def test_where_nobody_answers_the_velocities_are_told_and_no_impulse() -> None:
    engine = xp.PhysicsEngine()
    ear = engine.add_law(Ear(), xp.LawContainer(xp.when.ContactBegin()))
    for x, v in ((0.0, 2.0), (3.0, -1.0)):
        engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(x, 0, 0), velocity=(v, 0, 0)), laws=[ear])
    engine.run(until=1.0)
    (contact,) = ear.contacts  # type: ignore[attr-defined]
    assert contact.relative_velocity == (-3, 0, 0) and math.isnan(contact.impulse_vector[0])
    assert contact.time == 2.0 / 3.0


def test_a_law_reads_velocity_and_instant_when_it_is_asked() -> None:
    asked = []

    class Curious(xp.ResponseLaw):
        container = "collision:exact"

        def respond(self, contact: xp.Contact) -> float:
            asked.append((contact.relative_velocity, contact.time, contact.impulse))
            return 0.0

    engine = xp.PhysicsEngine()
    curious = engine.add_law(Curious())
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), velocity=(4, 0, 0)), laws=[curious])
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(3, 0, 0)), laws=[curious])
    engine.run(until=1.0)
    assert asked[0][:2] == ((-4, 0, 0), 0.5) and math.isnan(asked[0][2])


def test_a_checkpoint_in_a_combination_keeps_what_was_told() -> None:
    engine, bounce, (ear,) = scene("collision:elastic", xp.when.ContactBegin() & xp.when.Elapsed(0.8))
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce, ear])
    ball = xp.PhysicalObject(xp.Sphere(0.1), position=(0, 0, 1), velocity=(1, 0, -3))
    engine.add_object(ball, laws=[bounce, ear])
    engine.run(until=0.5)
    twin = xp.PhysicsEngine.restore(engine.checkpoint(), laws=[Ear])
    for one in (engine, twin):
        one.run(until=1.0)
    first, second = (next(law for law in one.laws if isinstance(law, Ear)).heard[0].parts for one in (engine, twin))
    told = [next(event for _, event in parts if event.contacts).contacts[0] for parts in (first, second)]
    for name in ("relative_velocity", "impulse_vector", "impulse", "instant", "normal", "point"):
        assert getattr(told[0], name) == getattr(told[1], name)
    assert told[0].relative_velocity == (1, 0, -3)
