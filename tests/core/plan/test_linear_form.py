"""Forces of groups as matrices, held against the laws themselves."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.laws import PairLaw, Param
from xpheve.plan.linear_form import LARGEST, linear_form


class Dashpot(PairLaw):
    """A damper that knows no direction, and pulls sideways a little."""

    damping, swirl = Param(0.7, unit="kg/s"), Param(0.2, unit="kg/s")

    def force(self, a: Any, b: Any) -> Any:
        v = a.velocity - b.velocity
        return -self.damping * v - self.swirl * v.cross((0.0, 0.0, 1.0)) * a.mass / b.mass


def scene(seed: int = 0, count: int = 6, **spring: Any) -> tuple[xp.PhysicsEngine, list[xp.PhysicalObject]]:
    """Two groups and a loner, one object of the first fixed."""
    rng = np.random.default_rng(seed)
    engine = xp.PhysicsEngine()
    objects = [
        engine.add_object(
            xp.PhysicalObject(
                mass=float(10.0 ** rng.uniform(-1.0, 1.0)),
                position=rng.normal(size=3),
                velocity=rng.normal(size=3) * (k != 1),
                fixed=k == 1,
                charge=float(rng.normal()),
            )
        )
        for k in range(count)
    ]
    first, second = objects[:3], objects[3:5]
    laws = [
        engine.add_law("basic:spring", stiffness=30.0, between=(first, first), **spring),
        engine.add_law("basic:spring", stiffness=5.0, pairs=[(objects[4], objects[3])]),
        engine.add_law(Dashpot(pairs=[(objects[0], objects[1]), (objects[2], objects[0])])),
        engine.add_law("basic:spring_to_point", stiffness=3.0, anchor=(0.3, -0.2, 0.1)),
        engine.add_law("basic:magnetic_field", field=(0.3, 0.2, 0.1)),
        engine.add_law("basic:linear_drag", coefficient=0.2),
    ]
    for law, members in zip(laws, (first, second, first, [*second, objects[5]], objects, objects[2:4]), strict=True):
        for obj in members:
            engine.map(obj, law)
    engine._world.plan()
    return engine, objects


def forces_of(engine: xp.PhysicsEngine, obj: xp.PhysicalObject) -> tuple[np.ndarray, np.ndarray]:
    """The rows of the group of ``obj``, and what the laws give for them now, (3, rows)."""
    world = engine._world
    batch = world.batches[int(world.bodies.batch[obj._row])]
    rows = batch.state.rows
    state = {
        name: world.read_all(name, world.time)[:, rows]
        for name in ("position", "velocity", "orientation", "angular_velocity")
    }
    return rows, world.sources(batch).evaluate(rows, world.time, state)[0]


@pytest.mark.parametrize("which", [0, 2, 3, 5])
def test_the_matrices_give_the_forces_of_the_laws(which: int) -> None:
    engine, objects = scene()
    world = engine._world
    group = world.group_of(objects[which])
    form = linear_form(world, group)
    assert form is not None
    x, v = (world.read_all(name, world.time)[:, form.rows] for name in ("position", "velocity"))
    _, damping = form.matrices(np.arange(len(group)))
    found = form.force(x).high + (damping.high @ v.T.ravel()).reshape(-1, 3).T
    rows, plain = forces_of(engine, objects[which])
    columns = [rows.tolist().index(row) for row in form.rows.tolist()]
    assert np.abs(found - plain[:, columns]).max() < 1e-13 * np.abs(plain).max()


def test_all_groups_of_a_batch_at_once_are_each_by_itself() -> None:
    engine, objects = scene()
    world = engine._world
    for obj in (objects[0], objects[3], objects[5]):
        batch = world.batches[int(world.bodies.batch[obj._row])]
        whole = world.sources(batch).linear(batch.state.rows)
        form = linear_form(world, world.group_of(obj))
        at = [batch.state.rows.tolist().index(row) for row in form.rows.tolist()]
        assert (whole.stiffness.high[:, :, at] == form.stiffness.high).all()
        assert (whole.constant.high[:, at] == form.constant.high).all()


def test_matrices_of_a_group_are_symmetric_where_forces_are_mutual() -> None:
    engine, objects = scene()
    form = linear_form(engine._world, engine._world.group_of(objects[3]))
    stiffness, _ = form.matrices(np.arange(2))
    assert (stiffness.high == stiffness.high.T).all()
    assert [one.tolist() for one in form.groups()] == [[0, 1]]


def test_what_has_a_potential_is_told_apart() -> None:
    engine, objects = scene()
    form = linear_form(engine._world, engine._world.group_of(objects[0]))
    assert form.works
    assert (form.held_matrix(np.arange(2)).high == form.matrices(np.arange(2))[0].high).all(), "all springs have one"


def test_a_rest_length_a_driven_partner_and_too_many_are_refused() -> None:
    engine, objects = scene(rest_length=0.5)
    assert linear_form(engine._world, engine._world.group_of(objects[0])) is None
    assert linear_form(engine._world, engine._world.group_of(objects[3])) is not None
    engine, objects = scene()
    objects[3].drive(velocity=(1.0, 0.0, 0.0))
    engine._world.plan()
    assert linear_form(engine._world, [objects[4]]) is None
    engine = xp.PhysicsEngine()
    spring = engine.add_law("basic:spring")
    many = [engine.add_object(xp.PhysicalObject(position=(k, 0.0, 0.0)), laws=[spring]) for k in range(LARGEST + 1)]
    engine._world.plan()
    assert linear_form(engine._world, many) is None
    engine.remove_object(many.pop())
    engine._world.plan()
    assert linear_form(engine._world, many) is not None


def test_a_law_that_is_off_does_nothing() -> None:
    engine, objects = scene()
    world = engine._world
    laws = [law for law in world.laws if law.label() == "basic:linear_drag"]
    before = linear_form(world, [objects[3], objects[4]])
    laws[0].enabled = False
    world.plan()
    after = linear_form(world, [objects[3], objects[4]])
    assert before.damping.high[0, 0].tolist() != after.damping.high[0, 0].tolist()
    assert after.damping.high[0, 0].tolist() == [0.0, 0.0]
