"""Live edits of laws and mapping: exactly one force of each constant law, and always the right one."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

import xpheve as xp
from xpheve.errors import ConflictError

when = xp.when


@pytest.fixture
def engine() -> xp.PhysicsEngine:
    """Return an engine with gravity of 10 m/s^2, z up."""
    made = xp.PhysicsEngine(up="z")
    made.add_law("basic:planet_gravity", acceleration=10.0, name="g")
    return made


def ball(engine: xp.PhysicsEngine, *laws: Any, **given: Any) -> xp.PhysicalObject:
    """Return a point of 2 kg under ``laws``."""
    return engine.add_object(xp.PhysicalObject(**({"mass": 2.0} | given)), laws=laws)


def weights(body: xp.PhysicalObject) -> list[tuple[float, ...]]:
    """Return the forces of laws on ``body``; those of the user have number ids."""
    return [force.vector for force in body.forces if not isinstance(force.id, int)]


EDITS: dict[str, Callable[[xp.PhysicsEngine, Any, Any], float]] = {
    "run": lambda e, b, g: e.run(until=e.time + 0.25) or -20.0,
    "suspend and resume": lambda e, b, g: (e.suspend(), e.resume(), -20.0)[-1],
    "ten pauses": lambda e, b, g: [(e.suspend(), e.resume(), e.run(until=e.time + 0.01)) for _ in range(10)] and -20.0,
    "map again": lambda e, b, g: (e.map(b, g), -20.0)[-1],
    "unmap and map": lambda e, b, g: (e.unmap(b, g), e.map(b, g), -20.0)[-1],
    "disable and enable": lambda e, b, g: (setattr(g, "enabled", False), setattr(g, "enabled", True), -20.0)[-1],
    "enable again": lambda e, b, g: (setattr(g, "enabled", True), -20.0)[-1],
    "enforce twice": lambda e, b, g: (g.enforce(xp.Event(e.time)), g.enforce(xp.Event(e.time)), -20.0)[-1],
    "heavier": lambda e, b, g: (setattr(b, "mass", 3.0), -30.0)[-1],
    "same mass": lambda e, b, g: (setattr(b, "mass", 2.0), -20.0)[-1],
    "the Moon": lambda e, b, g: (setattr(g, "acceleration", 1.5), -3.0)[-1],
    "both": lambda e, b, g: (setattr(g, "acceleration", 1.5), setattr(b, "mass", 4.0), -6.0)[-1],
    "nothing weighs": lambda e, b, g: (setattr(g, "acceleration", 0.0), 0.0)[-1],
    "by another engine object": lambda e, b, g: (ball(e, g, position=(5, 5, 5)), -20.0)[-1],
    "disabled while edited": lambda e, b, g: (
        setattr(g, "enabled", False), setattr(g, "acceleration", 1.5), setattr(b, "mass", 4.0), setattr(g, "enabled", True), -6.0,
    )[-1],
    "unmapped while edited": lambda e, b, g: (
        e.unmap(b, g), setattr(g, "acceleration", 1.5), setattr(b, "mass", 4.0), e.map(b, g), -6.0,
    )[-1],
    "pulled elsewhere": lambda e, b, g: (setattr(g, "direction", (0, 0, 1)), 20.0)[-1],
    "removed and added": lambda e, b, g: (e.remove_object(b), e.add_object(b, laws=[g]), -20.0)[-1],
}  # fmt: skip


@pytest.mark.parametrize("edit", EDITS)
@pytest.mark.parametrize("begin", [None, 0.0, 1.0], ids=["before", "at start", "under way"])
def test_exactly_one_right_force_after_every_edit(engine: xp.PhysicsEngine, edit: str, begin: float | None) -> None:
    gravity = engine.law("g")
    body = ball(engine, gravity)
    if begin is not None:
        engine.run(until=begin)
        assert weights(body) == [(0, 0, -20.0)]
    if edit != "removed and added":
        body.add_force((1, 0, 0), id=7)
    expected = EDITS[edit](engine, body, gravity)
    time, v, x = engine.time, body.velocity, body.position
    engine.run(until=time)
    assert weights(body) == [(0, 0, expected)]
    engine.run(until=time + 1.0)
    assert weights(body) == [(0, 0, expected)]
    assert body.velocity[2] == pytest.approx(v[2] + expected / body.mass, abs=1e-13)
    assert body.position[2] == pytest.approx(x[2] + v[2] + expected / body.mass / 2, abs=1e-13)
    if edit != "removed and added":
        assert [force.id for force in body.forces if isinstance(force.id, int)] == [7]


def test_a_mass_changed_in_flight_acts_from_that_instant_on(engine: xp.PhysicsEngine) -> None:
    """A force that is not gravity keeps its size: the acceleration changes."""
    body = ball(engine, "g")
    body.add_force((4, 0, 0))
    engine.run(until=1.0)
    body.mass = 4.0
    engine.run(until=2.0)
    assert body.velocity == (3.0, 0, -20.0)
    assert body.position == (1.0 + 2.0 + 0.5, 0, -20.0)


@pytest.mark.parametrize("how", ["unmap", "disable", "remove law", "remove object"])
def test_unmapping_disabling_and_removing_withdraw_and_the_users_forces_stay(
    engine: xp.PhysicsEngine, how: str
) -> None:
    gravity = engine.law("g")
    body = ball(engine, gravity)
    body.add_force((2, 0, 0))
    engine.run(until=1.0)
    {
        "unmap": lambda: engine.unmap(body, gravity),
        "disable": lambda: setattr(gravity, "enabled", False),
        "remove law": lambda: engine.remove_law(gravity),
        "remove object": lambda: engine.remove_object(body),
    }[how]()
    assert weights(body) == []
    if how == "remove object":
        assert body.forces == () and body.velocity == (1, 0, -10) and body.position == (0.5, 0, -5)
        return
    engine.run(until=2.0)
    assert body.velocity == (2, 0, -10) and body.position == (2.0, 0, -15.0)
    assert len(body.forces) == 1


def test_a_law_mapped_while_disabled_adds_no_force(engine: xp.PhysicsEngine) -> None:
    gravity = engine.law("g")
    gravity.enabled = False
    body = ball(engine, gravity)
    engine.run(until=1.0)
    assert body.forces == () and gravity.evaluations == 0
    gravity.enabled = True
    engine.run(until=2.0)
    assert body.position == (0, 0, -5)


def test_two_gravities_are_two_forces(engine: xp.PhysicsEngine) -> None:
    other = engine.add_law("basic:planet_gravity", acceleration=1.0, direction=(1, 0, 0))
    body = ball(engine, "g", other)
    engine.run(until=1.0)
    assert sorted(weights(body)) == [(0, 0, -20), (2, 0, 0)]
    other.enabled = False
    assert weights(body) == [(0, 0, -20)]


def test_a_constant_law_is_evaluated_once_however_long_the_run(engine: xp.PhysicsEngine) -> None:
    for k in range(50):
        ball(engine, "g", position=(k, 0, 0))
    engine.run(until=100.0, dt=0.1)
    assert engine.law("g").evaluations == 1


def test_a_law_that_is_constant_or_not_by_its_parameters(engine: xp.PhysicsEngine) -> None:
    class Either(xp.FieldLaw):
        moving = xp.Param(False, doc="Whether it looks at the velocity.")
        rate, pull = xp.Constant(1.0, unit="1/s"), xp.Constant((0.0, 0.0, -2.0), unit="m/s^2")

        def force(self, body: Any) -> Any:
            return -self.rate * body.velocity * body.mass if self.moving else self.pull * body.mass

    law = engine.add_law(Either())
    body = ball(engine, law)
    engine.run(until=1.0)
    assert weights(body) == [(0, 0, -4.0)]
    law.moving = True  # type: ignore[attr-defined]
    engine.run(until=2.0, rtol=1e-10, atol=1e-12)
    assert weights(body) == [] and body.velocity[2] == pytest.approx(-2.0 * math.exp(-1.0), rel=1e-6)
    law.moving = False  # type: ignore[attr-defined]
    engine.run(until=3.0)
    assert weights(body) == [(0, 0, -4.0)] and body.velocity[2] == pytest.approx(-2.0 * math.exp(-1.0) - 2.0, rel=1e-6)


def test_edits_by_a_handler_take_effect_at_its_instant(engine: xp.PhysicsEngine) -> None:
    class Edit(xp.PhysicalLaw):
        def enforce_this_law(self, event: Any) -> None:
            body.mass = 4.0
            gravity.acceleration = 1.0  # type: ignore[attr-defined]

    gravity = engine.law("g")
    engine.add_law(Edit(), container=xp.LawContainer(when.Elapsed(1.0)))
    body = ball(engine, gravity)
    engine.run(until=2.0)
    assert weights(body) == [(0, 0, -4.0)] and body.velocity == (0, 0, -11)


def test_mapping_in_a_handler_is_made_at_the_end_of_the_instant(engine: xp.PhysicsEngine) -> None:
    class Edit(xp.PhysicalLaw):
        def enforce_this_law(self, event: Any) -> None:
            engine.map(body, "g")
            seen.append(len(body.laws))

    seen: list[int] = []
    engine.add_law(Edit(), container=xp.LawContainer(when.Elapsed(1.0)))
    body = ball(engine)
    engine.run(until=2.0)
    assert seen == [0] and len(body.laws) == 1 and body.velocity == (0, 0, -10)


def test_an_object_with_no_law_moves_freely_among_others(engine: xp.PhysicsEngine) -> None:
    engine.add_law("collision:elastic")
    body = ball(engine, velocity=(1, 2, 3))
    ball(engine, "g")
    engine.run(until=2.0)
    assert body.position == (2, 4, 6) and body.forces == ()


def test_an_object_added_under_way_starts_then(engine: xp.PhysicsEngine) -> None:
    first = ball(engine, "g")
    engine.run(until=5.0)
    late = ball(engine, "g", velocity=(1, 0, 0))
    engine.run(until=6.0)
    assert late.position == (1, 0, -5) and first.position == (0, 0, -180)


def test_ids_of_forces(engine: xp.PhysicsEngine) -> None:
    body = ball(engine)
    for id in ("a", "a", "b", 5, "a"):
        body.add_force((1, 0, 0), id=id)
    assert body.remove_force("a") == 3
    assert body.remove_force("a") == 0 and body.remove_force("unknown") == 0
    assert [force.id for force in body.forces] == ["b", 5]
    engine.run(until=2.0)
    assert body.velocity == (2, 0, 0)


def test_a_user_cannot_take_away_what_a_law_stored(engine: xp.PhysicsEngine) -> None:
    body = ball(engine, "g")
    engine.run(until=0.0)
    assert body.remove_force(body.forces[0].id) == 0
    assert weights(body) == [(0, 0, -20)]


def test_removing_one_among_many_keeps_the_others(engine: xp.PhysicsEngine) -> None:
    bodies = [ball(engine, "g", position=(k, 0, 0), velocity=(0, k, 0)) for k in range(20)]
    engine.run(until=1.0)
    for body in bodies[::3]:
        engine.remove_object(body)
    engine.run(until=2.0)
    for k, body in enumerate(bodies):
        gone = k % 3 == 0
        assert (body.engine is None) == gone
        assert body.position == pytest.approx((k, k if gone else 2 * k, -5 if gone else -20), abs=1e-12)


def test_exclusive_laws_are_refused_when_mapped_live_and_by_add(engine: xp.PhysicsEngine) -> None:
    one, two = engine.add_law("collision:elastic", name="one"), engine.add_law("collision:elastic", name="two")
    body = ball(engine, one, shape=xp.Sphere(0.1))
    with pytest.raises(ConflictError):
        engine.map(body, two)
    engine.unmap(body, one)
    engine.map(body, two)
    assert body.laws == (two,)


def test_a_column_changed_live_stores_the_force_again() -> None:
    class Lift(xp.FieldLaw):
        columns = {"charge": xp.Column(1.0, unit="C", doc="Charge.")}  # noqa: RUF012
        field = xp.Constant((0.0, 0.0, 1.0), unit="N/C")

        def force(self, body: Any) -> Any:
            return self.field * body.charge

    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law(Lift())
    body = engine.add_object(xp.PhysicalObject(), laws=[law])
    engine.run(until=1.0)
    body["charge"] = 3.0
    assert [force.vector for force in body.forces] == [(0, 0, 3)]
    engine.run(until=2.0)
    assert body.velocity == (0, 0, 4) and law.evaluations == 2
