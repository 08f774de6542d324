"""Split, replace and remove at an instant: order, momentum, angular momentum, energy, laws, and what is refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import InvalidValueError, LawFailedError, OwnershipError


def halves(obj: xp.PhysicalObject, kick: float = 0.0, **more: Any) -> list[xp.PhysicalObject]:
    """Return two balls beside each other in place of one."""
    x, y, z = obj.position
    r = 0.05
    return [
        xp.PhysicalObject(
            xp.Sphere(r), mass=obj.mass / 2, position=(x + s * r, y, z), velocity=(s * kick, 0, 0), **more
        )
        for s in (1, -1)
    ]


class Breaks(xp.PhysicalLaw):
    """Splits the large ball that meets the floor."""

    def enforce_this_law(self, event: xp.Event) -> None:
        for contact in event.contacts:
            ball = contact.body_b if contact.body_a.fixed else contact.body_a
            if ball.mass > 1.5:
                event.split(ball, halves(ball, 1.0))
                told.append((ball.velocity, event.time, len(event.objects)))


told: list[Any] = []


def falling(law: xp.PhysicalLaw, condition: Any = None) -> tuple[xp.PhysicsEngine, xp.PhysicalObject]:
    """Return a ball of 2 kg that falls on a floor, both under ``law`` too."""
    told.clear()
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", acceleration=10.0, name="gravity")
    bounce = engine.add_law("collision:elastic", name="bounce")
    listens = engine.add_law(law, xp.LawContainer(condition or xp.when.Impact()))
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True, name="floor"), laws=[bounce, listens])
    ball = xp.PhysicalObject(
        xp.Sphere(0.1), mass=2.0, position=(0, 0, 1.1), velocity=(0.5, 0, 0), angular_velocity=(0, 3, 0), name="ball"
    )
    engine.add_object(ball, laws=[gravity, bounce, listens])
    return engine, ball


def test_a_ball_splits_at_the_exact_instant_of_its_impact() -> None:
    engine, ball = falling(Breaks())
    fall = math.sqrt(0.2)
    before = engine.energy().balance
    engine.run(until=2 * fall)
    ((velocity, time, objects),) = told  # after the bounce, and it was still there
    assert velocity == pytest.approx((0.5, 0.0, 10 * fall)) and abs(time - fall) < 1e-15 and objects == 2
    assert ball not in engine.objects and len(engine.objects) == 3
    parts = [obj for obj in engine.objects if not obj.fixed]
    assert sorted(part.velocity[0] for part in parts) == pytest.approx([-0.5, 1.5], abs=1e-14)
    turning = parts[0].angular_velocity[1]
    lift = [10 * fall - s * turning * 0.05 for s in (1, -1)]
    top = [0.1 + v * fall - 5.0 * fall * fall for v in lift]
    assert sorted(part.position[2] for part in parts) == pytest.approx(sorted(top), abs=1e-13)
    assert engine.momentum()[0] == pytest.approx(1.0, abs=1e-14)
    assert engine.energy().balance == pytest.approx(before, abs=1e-12)
    assert engine.explain().data["energy"]["work_by"]["split"] > 0.9  # 1 J of the kicks
    assert all({law.name for law in part.laws} >= {"gravity", "bounce"} for part in parts)


def test_all_handlers_of_the_instant_see_the_object_as_it_is() -> None:
    seen = []

    class Looks(xp.PhysicalLaw):
        def enforce_this_law(self, event: xp.Event) -> None:
            seen.append([obj.label for obj in event.objects])
            assert all(obj.velocity is not None and obj._engine is engine for obj in event.objects)

    engine, _ = falling(Breaks())
    looks = engine.add_law(Looks(), xp.LawContainer(xp.when.Impact()))
    for obj in engine.objects:
        engine.map(obj, looks)
    engine.run(until=0.5)
    assert seen == [["ball", "floor"]]


def random_body(seed: int) -> tuple[xp.PhysicsEngine, xp.PhysicalObject, list[xp.PhysicalObject]]:
    rng = np.random.default_rng(seed)
    engine = xp.PhysicsEngine()
    q = rng.normal(size=4)
    parts = [
        xp.PhysicalObject(
            xp.Box(tuple(rng.uniform(0.1, 0.5, 3))),
            mass=float(rng.uniform(0.5, 2.0)),
            position=tuple(rng.normal(size=3)),
        )
        for _ in range(int(rng.integers(2, 6)))
    ]
    masses = np.array([part.mass for part in parts])
    centre = (masses[:, None] * np.array([part.position for part in parts])).sum(axis=0) / masses.sum()
    whole = xp.PhysicalObject(
        xp.Box(tuple(rng.uniform(0.5, 2.0, 3))),
        mass=float(masses.sum()),
        position=tuple(centre.tolist()),
        orientation=tuple(q / np.linalg.norm(q)),
        velocity=tuple(rng.normal(size=3)),
        angular_velocity=tuple(rng.normal(size=3)),
    )
    return engine, engine.add_object(whole), parts


@settings(deadline=None, max_examples=20, derandomize=True, phases=[Phase.generate])
@given(seed=st.integers(0, 10**6))
def test_momentum_and_angular_momentum_are_kept_and_the_energy_is_booked(seed: int) -> None:
    engine, whole, parts = random_body(seed)
    before = engine.momentum(), engine.angular_momentum(), engine.energy().balance
    assert engine.split_object(whole, parts) == tuple(parts)
    assert engine.objects == tuple(parts) and whole._engine is None
    assert engine.momentum() == pytest.approx(before[0], abs=1e-12)
    assert engine.angular_momentum() == pytest.approx(before[1], abs=1e-12)
    assert engine.energy().balance == pytest.approx(before[2], abs=1e-12)


def test_parts_of_a_turning_rod_fly_on_along_their_tangents() -> None:
    engine = xp.PhysicsEngine()
    rod = xp.PhysicalObject(xp.Box((2.0, 0.1, 0.1)), mass=2.0, velocity=(0, 0, 1), angular_velocity=(0, 0, 3))
    engine.add_object(rod)
    ends = [xp.PhysicalObject(xp.Box((1.0, 0.1, 0.1)), mass=1.0, position=(s * 0.5, 0, 0)) for s in (1, -1)]
    engine.split_object(rod, ends)
    for s, end in zip((1, -1), ends, strict=True):
        assert end.velocity == pytest.approx((0, s * 1.5, 1), abs=1e-14)
        assert end.angular_velocity == pytest.approx((0, 0, 3), abs=1e-14)  # true parts turn as the whole did
    assert engine.energy().work == pytest.approx(0.0, abs=1e-14)


@pytest.mark.parametrize(
    ("masses", "places", "kicks", "says"),
    [
        ((1.0, 0.9), (0.5, -0.5), (0, 0), "1.9 kg together"),
        ((1.0, 1.0), (0.5, 0.5), (0, 0), "centre of mass of its parts"),
        ((1.0, 1.0), (0.5, -0.5), (1, 0), "momentum"),
    ],
)
def test_parts_that_change_mass_or_momentum_are_refused_unless_told(
    masses: Any, places: Any, kicks: Any, says: str
) -> None:
    def scene() -> tuple[xp.PhysicsEngine, xp.PhysicalObject, list[xp.PhysicalObject]]:
        engine = xp.PhysicsEngine()
        whole = engine.add_object(xp.PhysicalObject(xp.Sphere(1), mass=2.0, velocity=(0, 0, 1)))
        parts = [
            xp.PhysicalObject(xp.Sphere(0.1), mass=m, position=(x, 0, 0), velocity=(0, k, 0))
            for m, x, k in zip(masses, places, kicks, strict=True)
        ]
        return engine, whole, parts

    engine, whole, parts = scene()
    with pytest.raises(InvalidValueError, match=says):
        engine.split_object(whole, parts)
    assert engine.objects == (whole,) and parts[0].velocity == (0, kicks[0], 0)
    engine.split_object(whole, parts, conserve=False)
    assert engine.objects == tuple(parts) and parts[0].velocity == (0, kicks[0], 1)


def test_points_that_cannot_carry_the_spin_are_refused() -> None:
    engine = xp.PhysicsEngine()
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(1), mass=2.0, angular_velocity=(1, 0, 0)))
    points = [xp.PhysicalObject(mass=1.0, position=(s * 0.5, 0, 0)) for s in (1, -1)]
    with pytest.raises(InvalidValueError, match="angular momentum"):
        engine.split_object(ball, points)


def test_what_has_no_momentum_to_share_is_replaced_instead() -> None:
    engine = xp.PhysicsEngine()
    wall = engine.add_object(xp.PhysicalObject(xp.Box((1, 1, 1)), fixed=True))
    with pytest.raises(InvalidValueError, match="replace it"):
        engine.split_object(wall, [xp.PhysicalObject()])
    (new,) = engine.replace_object(wall, xp.PhysicalObject(xp.Sphere(1), fixed=True))
    assert engine.objects == (new,)
    free = engine.add_object(xp.PhysicalObject(xp.Sphere(1)))
    with pytest.raises(InvalidValueError, match="no parts"):
        engine.split_object(free, [])


class Replaces(xp.PhysicalLaw):
    """Puts two slow balls in place of the one that meets the floor."""

    def enforce_this_law(self, event: xp.Event) -> None:
        for obj in event.objects:
            if obj.name == "ball":
                told.extend(event.replace(obj, halves(obj, 2.0), laws=["bounce"]))


def test_a_replacement_keeps_its_own_state_and_obeys_the_laws_it_is_given() -> None:
    engine, ball = falling(Replaces())
    engine.run(until=0.5)
    assert ball not in engine.objects and all(one in engine.objects for one in told)
    assert [one.velocity for one in told] == [(2, 0, 0), (-2, 0, 0)]
    assert [[law.name for law in one.laws] for one in told] == [["bounce"], ["bounce"]]


class Removes(xp.PhysicalLaw):
    """Takes out the ball that meets the floor."""

    def enforce_this_law(self, event: xp.Event) -> None:
        for obj in event.objects:
            if obj.name == "ball":
                event.remove(obj)
                told.append(obj in engine_of(obj).objects)


def engine_of(obj: xp.PhysicalObject) -> Any:
    return obj._engine


def test_what_is_removed_goes_at_the_end_of_the_instant() -> None:
    engine, ball = falling(Removes())
    engine.run(until=0.5)
    assert told == [True] and ball._engine is None and len(engine.objects) == 1
    assert ball.velocity == pytest.approx((0.5, 0, 10 * math.sqrt(0.2)))
    with pytest.raises(OwnershipError, match="in no engine"):
        xp.Event(0.0).remove(ball)


class Twice(xp.PhysicalLaw):
    """Splits one ball two times at one instant."""

    def enforce_this_law(self, event: xp.Event) -> None:
        ball = next(obj for obj in event.objects if not obj.fixed)
        event.split(ball, halves(ball))
        event.replace(ball, halves(ball))


def test_an_object_has_one_successor() -> None:
    engine, ball = falling(Twice())
    with pytest.raises(LawFailedError, match="one successor"):
        engine.run(until=0.5)
    assert ball in engine.objects and len(engine.objects) == 2
    engine.laws[-1].enabled = False
    engine.run(until=0.5)
    assert ball.velocity[2] > 0


def test_parts_go_along_where_another_handler_moves_the_object() -> None:
    class Moves(xp.PhysicalLaw):
        after = ("Breaks",)

        def enforce_this_law(self, event: xp.Event) -> None:
            for obj in event.objects:
                if not obj.fixed and obj.mass > 1.5:
                    obj.position = (5.0, 0.0, 2.0)

    engine, _ = falling(Breaks())
    moves = engine.add_law(Moves(), engine.containers[-1])
    for obj in engine.objects:
        engine.map(obj, moves)
    engine.run(until=math.sqrt(0.2) + 1e-9)
    places = sorted(obj.position for obj in engine.objects if not obj.fixed)
    assert places == [pytest.approx((4.95, 0, 2.0), abs=1e-7), pytest.approx((5.05, 0, 2.0), abs=1e-7)]


def test_the_same_bits_again_and_from_a_checkpoint() -> None:
    def finish(engine: xp.PhysicsEngine) -> list[Any]:
        engine.run(until=3.0)
        return [(obj.position, obj.velocity, obj.angular_velocity) for obj in engine.objects]

    first, _ = falling(Breaks())
    second, _ = falling(Breaks())
    second.run(until=0.1)
    third = xp.PhysicsEngine.restore(second.checkpoint(), laws=[Breaks])
    fourth, _ = falling(Breaks())
    fourth.run(until=0.6)
    assert finish(first) == finish(second) == finish(third) == finish(fourth)
