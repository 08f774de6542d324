"""Impulses at contact points: momentum, angular momentum and energy are kept, and central hits are as those of points."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import ContactError

unit = st.floats(-1.0, 1.0)
vectors = st.tuples(unit, unit, unit)
sizes = st.floats(0.2, 1.0)
shapes = st.one_of(
    st.builds(lambda x, y, z: xp.Box((x, y, z)), sizes, sizes, sizes),
    st.builds(lambda radius, length: xp.Capsule(0.5 * radius, length), sizes, sizes),
)


def turned(axis: tuple[float, float, float], angle: float) -> tuple[float, float, float, float]:
    length = math.hypot(*axis)
    s = math.sin(0.5 * angle) / length if length else 0.0
    return (math.cos(0.5 * angle), s * axis[0], s * axis[1], s * axis[2])


@settings(deadline=None, max_examples=8, derandomize=True)
@given(
    first=shapes, second=shapes, spins=st.tuples(vectors, vectors), axes=st.tuples(vectors, vectors), offset=st.tuples(unit, unit),
    mass=st.floats(1e-3, 1e3),
)  # fmt: skip
def test_two_bodies_keep_momentum_angular_momentum_and_energy(
    first: Any, second: Any, spins: Any, axes: Any, offset: Any, mass: float
) -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    engine.add_object(
        xp.PhysicalObject(
            first, position=(-2, 0, 0), velocity=(2, 0, 0), angular_velocity=spins[0], orientation=turned(axes[0], 1.0)
        ),
        laws=[law],
    )
    engine.add_object(
        xp.PhysicalObject(
            second,
            mass=mass,
            position=(0, 0.3 * offset[0], 0.3 * offset[1]),
            angular_velocity=spins[1],
            orientation=turned(axes[1], 2.0),
        ),
        laws=[law],
    )
    before = engine.energy().kinetic, engine.momentum(), engine.angular_momentum()
    engine.run(until=2.0)
    assume(law.evaluations > 0)
    assert engine.energy().kinetic == pytest.approx(before[0], rel=1e-12)
    size = 4.0 + mass
    assert engine.momentum() == pytest.approx(before[1], abs=1e-13 * size)
    assert engine.angular_momentum() == pytest.approx(before[2], abs=1e-12 * size)


def test_a_box_that_falls_flat_gets_four_equal_impulses_and_does_not_turn() -> None:
    engine = xp.PhysicsEngine()
    gravity, law = engine.add_law("basic:planet_gravity"), engine.add_law("collision:elastic")
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[law])
    box = engine.add_object(
        xp.PhysicalObject(xp.Box((1, 2, 0.7)), position=(0, 3, 0), velocity=(1, 0, 0)), laws=[gravity, law]
    )
    before = engine.energy().total
    engine.run(until=10.0)
    assert box.angular_velocity == (0, 0, 0) and law.evaluations > 20
    assert engine.energy().total == pytest.approx(before, rel=1e-12)


def test_a_central_hit_of_a_box_is_that_of_a_sphere() -> None:
    after = []
    for shape in (xp.Box((1, 1, 1)), xp.Sphere(0.5)):
        engine = xp.PhysicsEngine()
        law = engine.add_law("collision:elastic", restitution=0.7)
        engine.add_object(
            xp.PhysicalObject(xp.Sphere(0.25), mass=3.0, position=(-2, 0, 0), velocity=(2, 0, 0)), laws=[law]
        )
        hit = engine.add_object(xp.PhysicalObject(shape, mass=1.5), laws=[law])
        engine.run(until=2.0)
        assert hit.angular_velocity == (0, 0, 0)
        after.append([obj.velocity for obj in engine.objects])
    assert after[0] == after[1]


def test_a_hit_on_the_end_of_a_rod_has_the_closed_form_of_the_lever() -> None:
    """A ball of mass m at u on a rod (M, I) at the arm r: K = 1/m + 1/M + r^2/I, impulse 2 u / K."""
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    rod = engine.add_object(xp.PhysicalObject(xp.Box((0.2, 2.0, 0.2)), mass=2.0), laws=[law])
    ball = engine.add_object(
        xp.PhysicalObject(xp.Sphere(0.1), mass=0.5, position=(-1, 0.8, 0), velocity=(3, 0, 0)), laws=[law]
    )
    engine.run(until=0.5)
    inertia = rod.inertia[2]
    impulse = 2 * 3 / (1 / 0.5 + 1 / 2 + 0.8**2 / inertia)
    assert ball.velocity[0] == pytest.approx(3 - impulse / 0.5, rel=1e-13)
    assert rod.velocity[0] == pytest.approx(impulse / 2, rel=1e-13)
    assert rod.angular_velocity[2] == pytest.approx(-0.8 * impulse / inertia, rel=1e-13)


def test_a_mirror_scene_stays_a_mirror_scene_to_the_bit() -> None:
    found = []
    for side in (1.0, -1.0):
        engine = xp.PhysicsEngine()
        law = engine.add_law("collision:elastic")
        engine.add_object(xp.PhysicalObject(xp.Plane((0, 1, 0)), fixed=True), laws=[law])
        box = engine.add_object(
            xp.PhysicalObject(
                xp.Box((0.4, 0.3, 0.5)), position=(side * 0.1, 1, 0), velocity=(side * 0.3, -2, 0.1),
                orientation=(0.9, 0.3, side * 0.2, side * 0.1), angular_velocity=(0.5, side * 0.7, side * 0.2),
            ),
            laws=[law],
        )  # fmt: skip
        engine.run(until=0.6)
        assert law.evaluations > 0
        found.append((box.velocity, box.angular_velocity))
    (v, w), (u, s) = found
    assert (v[0], v[1], v[2]) == (-u[0], u[1], u[2]) and (w[0], w[1], w[2]) == (s[0], -s[1], -s[2])


class Kick(xp.ResponseLaw):
    """Takes impacts over with twice the impulse that would stop the approach of points."""

    id = "mine:kick"

    def respond(self, contact: Any) -> Any:
        """Return an impulse on body b."""
        size = 2 * contact.approach_speed / (1 / contact.body_a.mass + 1 / contact.body_b.mass)
        return xp.Impulse([size * c for c in contact.normal])


def test_an_impulse_of_a_law_acts_at_the_contact_point() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law(Kick())
    rod = engine.add_object(xp.PhysicalObject(xp.Box((0.2, 2.0, 0.2))), laws=[law])
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(-1, 0.8, 0), velocity=(3, 0, 0)), laws=[law])
    before = engine.angular_momentum()
    engine.run(until=0.5)
    assert rod.velocity[0] == pytest.approx(3.0) and rod.angular_velocity[2] == pytest.approx(-0.8 * 3 / rod.inertia[2])
    assert engine.angular_momentum() == pytest.approx(before, abs=1e-14)


def test_listeners_are_told_the_size_of_the_impulse() -> None:
    heard: list[Any] = []
    kind = type("Hear", (xp.PhysicalLaw,), {"enforce_this_law": lambda self, event: heard.extend(event.contacts)})
    engine = xp.PhysicsEngine()
    laws = [engine.add_law("collision:elastic")]
    for condition in (xp.when.Impact(), xp.when.ContactEnd()):
        laws.append(engine.add_law(kind(), container=xp.LawContainer(condition)))
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=laws)
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), mass=2.0, position=(0, 1, 0), velocity=(1, -3, 0)), laws=laws)
    engine.run(until=1.0)
    assert [one.impulse for one in heard[:1]] == [12.0] and math.isnan(heard[1].impulse)


def slide(resting: str, restitution: float) -> tuple[xp.PhysicsEngine, xp.PhysicalObject]:
    """Return a box pushed against a wall by a lasting force."""
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic", restitution=restitution, resting=resting)
    engine.add_object(xp.PhysicalObject(xp.Plane((-1, 0, 0), offset=-5), fixed=True, name="wall"), laws=[law])
    car = engine.add_object(xp.PhysicalObject(xp.Box((4, 1.5, 2)), mass=10.0, name="car"), laws=[law])
    car.add_force((20, 0, 0))
    return engine, car


def test_a_body_that_comes_to_rest_is_held_or_named() -> None:
    engine, car = slide("hold", 0.5)
    engine.run(until=30.0)
    assert car.velocity == (0, 0, 0) and car.position[0] == pytest.approx(3.0, abs=1e-9)
    engine, car = slide("error", 0.5)
    with pytest.raises(ContactError, match=r"wall.*car|car.*wall"):
        engine.run(until=30.0)


@pytest.mark.parametrize("restitution", [0.5, 1.0])
def test_boxes_in_a_room_do_not_leave_it_nor_gain_energy_and_go_on_to_the_same_bits_after_a_checkpoint(
    restitution: float,
) -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic", restitution=restitution, resting="hold")
    for k in range(6):
        normal = tuple((1.0 if k < 3 else -1.0) * (k % 3 == axis) for axis in range(3))
        engine.add_object(xp.PhysicalObject(xp.Plane(normal, -1.0), fixed=True), laws=[law])
    for k in range(3):
        body = xp.PhysicalObject(
            xp.Box((0.2, 0.3, 0.4)), mass=1.0 + k, position=(-0.65 + 0.65 * k, 0.1 * k, 0), velocity=(1.0 - k, 0.7, 0.4 * k),
            orientation=turned((1, k, 2), 1.0 + k), angular_velocity=(1.0, -2.0 + k, 0.5),
        )  # fmt: skip
        engine.add_object(body, laws=[law])
    before = engine.energy().kinetic
    engine.run(until=0.7)
    twin = xp.PhysicsEngine.restore(engine.checkpoint())
    engine.run(until=1.5)
    for until in (1.1, 1.5):
        twin.run(until=until)
    for name in ("position", "velocity", "orientation", "angular_velocity"):
        assert getattr(engine.bodies, name).tobytes() == getattr(twin.bodies, name).tobytes()
    energy = engine.energy()
    assert energy.kinetic - energy.work == pytest.approx(before, rel=1e-12)
    assert energy.kinetic == pytest.approx(before, rel=1e-12) if restitution == 1.0 else energy.kinetic < before
    assert all(max(map(abs, obj.position)) < 1.0 for obj in engine.objects if not obj.fixed)
