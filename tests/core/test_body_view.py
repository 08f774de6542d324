"""What a law's view of bodies adds to columns: turning vectors, volumes, since when, and jumps in time."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import LawFailedError
from xpheve.kernels.quaternion import from_rotation_vector, normalize, rotate
from xpheve.laws.view import BodyView

number = st.floats(-10, 10)
vector = st.tuples(number, number, number)
turn = st.tuples(number, number, number, number).filter(lambda q: math.hypot(*q) > 0.1).map(normalize)


def view_of(*orientations: tuple[float, ...], reads: set[str] | None = None) -> BodyView:
    """Return a view of bodies that are turned."""
    columns = {"orientation": np.array(orientations)}
    return BodyView(lambda name: columns[name].copy(), set() if reads is None else reads, len(orientations))


@given(q=turn, p=turn, v=vector)
def test_to_world_turns_each_row_as_its_body_is_turned_and_to_body_turns_back(q: Any, p: Any, v: Any) -> None:
    body = view_of(q, p)
    turned = body.to_world(v)
    np.testing.assert_allclose(turned, [rotate(q, v), rotate(p, v)], atol=1e-13)
    np.testing.assert_allclose(body.to_body(turned), [v, v], atol=1e-13)


def test_a_quarter_turn_about_z_takes_x_to_y() -> None:
    reads: set[str] = set()
    body = view_of(from_rotation_vector((0, 0, math.pi / 2)), reads=reads)
    np.testing.assert_allclose(body.to_world((1, 0, 0)), [(0, 1, 0)], atol=1e-15)
    assert reads == {"orientation"}, "so that a law that turns with the body is not taken for constant"


class Tell(xp.FieldLaw):
    """Keeps what it saw."""

    id = "test:tell"
    seen: dict[float, tuple[float, float]] = {}  # noqa: RUF012

    def apply(self, body: Any) -> Any:
        rows = np.hstack([body.mass, body.volume, body.since]).tolist()
        self.seen.update({mass: (volume, since) for mass, volume, since in rows})
        return 0.0 * body.velocity


def test_volume_is_that_of_the_shape_and_nan_without_one() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law(Tell)
    shapes = [xp.Sphere(0.5), xp.Box((1, 2, 3)), None]
    for k, shape in enumerate(shapes):
        engine.add_object(xp.PhysicalObject(shape, mass=k + 1.0), laws=[law])
    engine.run(until=0.1, dt=0.1)
    ball, box, point = (Tell.seen[mass][0] for mass in (1.0, 2.0, 3.0))
    assert ball == pytest.approx(math.pi / 6)
    assert box == xp.Box((1, 2, 3)).volume
    assert math.isnan(point)


def test_since_is_when_the_object_was_mapped_or_the_law_enabled() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law(Tell)
    engine.add_object(xp.PhysicalObject(mass=1.0), laws=[law])
    late = engine.add_object(xp.PhysicalObject(mass=2.0))
    engine.run(until=0.3, dt=0.1)
    engine.map(late, law)
    engine.run(until=0.5, dt=0.1)
    assert (Tell.seen[1.0][1], Tell.seen[2.0][1]) == (0.0, 0.3)
    law.enabled = False
    engine.run(until=0.7, dt=0.1)
    law.enabled = True
    engine.run(until=0.8, dt=0.1)
    assert (Tell.seen[1.0][1], Tell.seen[2.0][1]) == (0.7, 0.7)


class Burst(xp.FieldLaw):
    """1 N along x from 0.3 s to 0.45 s after the start."""

    id = "test:burst"
    strength = xp.Constant((1.0, 0.0, 0.0), unit="N")
    delay, end = xp.Constant(0.3, unit="s"), xp.Constant(0.45, unit="s")

    def force(self, body: Any) -> Any:
        on = (body.time >= body.since + self.delay) & (body.time < body.since + self.end)
        return np.where(on, 1.0, 0.0) * self.strength

    def jumps(self, since: float) -> tuple[float, ...]:
        return since + 0.3, since + 0.45


@pytest.mark.parametrize("dt", [None, 1.0, 0.1, 0.07, 0.02])
def test_no_step_passes_a_jump_so_that_the_impulse_is_exact(dt: float | None) -> None:
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject(), laws=[engine.add_law(Burst)])
    engine.run(until=2.0, dt=dt)
    assert body.velocity[0] == pytest.approx(0.15, rel=1e-14)
    assert body.position[0] == pytest.approx(0.5 * 0.15**2 + 0.15 * (2.0 - 0.45), rel=1e-14)


@pytest.mark.parametrize("dt", [None, 0.1])
def test_looking_does_not_change_a_run_with_jumps_and_a_restored_one_goes_on_to_the_bit(dt: float | None) -> None:
    def scene() -> tuple[xp.PhysicsEngine, xp.PhysicalObject]:
        engine = xp.PhysicsEngine()
        laws = [engine.add_law(Burst), engine.add_law("basic:spring_to_point", stiffness=3.0)]
        return engine, engine.add_object(xp.PhysicalObject(position=(1, 0, 0), name="body"), laws=laws)

    engine, straight = scene()
    engine.run(until=1.0, dt=dt)
    looked, body = scene()
    looked.run(until=1.0, dt=dt, every=0.013)
    assert body.position == straight.position
    halved, body = scene()
    for until in (0.2, 0.33, 0.41, 1.0):
        halved.run(until=until, dt=dt)
        halved = xp.PhysicsEngine.restore(halved.checkpoint(), laws=[Burst])
    assert halved.object("body").position == straight.position


class Hungry(xp.FieldLaw):
    """Needs a column."""

    id = "test:hungry"
    columns = {"food": xp.Column(math.nan, unit="kg", doc="What it eats; must be given.")}  # noqa: RUF012
    singular = "Never at 0"
    appetite = xp.Constant(1.0, unit="N*m/kg")

    def force(self, body: Any) -> Any:
        return self.appetite * body.food / body.position.norm() * np.ones(3)


def test_the_error_of_a_force_that_is_not_finite_says_why() -> None:
    for given_columns, position, said in (
        ({}, (1, 0, 0), r"bob has no food: What it eats; must be given. Give PhysicalObject\(..., food=...\) in kg"),
        ({"food": 1.0}, (0, 0, 0), "Never at 0"),
    ):
        engine = xp.PhysicsEngine()
        body = xp.PhysicalObject(position=position, name="bob", **given_columns)
        engine.add_object(body, laws=[engine.add_law(Hungry)])
        with pytest.raises(LawFailedError, match=said):
            engine.run(until=1.0, dt=0.1)


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (None, r"test:burst.jumps\(0.0\) raised TypeError"),
        ((math.nan,), r"test:burst.jumps\(0.0\) gave \[nan\]: simulation times"),
    ],
)
def test_jumps_that_are_no_times_are_an_error_that_names_the_law(answer: Any, said: str) -> None:
    kind = type("Wrong", (Burst,), {"jumps": lambda self, since: answer})
    engine = xp.PhysicsEngine()
    engine.add_object(xp.PhysicalObject(), laws=[engine.add_law(kind)])
    with pytest.raises(LawFailedError, match=said):
        engine.run(until=1.0, dt=0.1)
