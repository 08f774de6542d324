"""Same bits in any order of adding: objects, laws, containers, mapping, forces."""

from __future__ import annotations

import itertools
import random
from typing import Any

import pytest

import xpheve as xp

when = xp.when


class Kick(xp.PhysicalLaw):
    """Change velocities one after another: order matters."""

    initial_state = {"x": 0.1}  # noqa: RUF012

    def enforce_this_law(self, event: Any) -> None:
        for obj in self.objects:
            self.state["x"] = 3.7 * self.state["x"] * (1 - self.state["x"])
            obj.velocity = [v + 0.1 * self.state["x"] for v in obj.velocity]
            obj.add_force((self.random.random(), 0, 0), 0.05, id="kick")


def scene(order: random.Random | None) -> dict[str, Any]:
    """Return the end of a scene put together in the order that ``order`` gives."""

    def shuffled(what: list[Any]) -> list[Any]:
        if order is not None:
            order.shuffle(what)
        return what

    engine = xp.PhysicsEngine(up="z", seed=7)
    makers: list[Any] = [
        ("gravity", lambda: engine.add_law("basic:planet_gravity", name="gravity")),
        ("pull", lambda: engine.add_law("basic:universal_gravity", name="pull", gravitational_constant=1e-3)),
        ("drag", lambda: engine.add_law("basic:linear_drag", name="drag", coefficient=0.1)),
        ("bounce", lambda: engine.add_law("collision:elastic", name="bounce", restitution=0.95)),
        ("kick", lambda: engine.add_law(Kick(name="kick"), container=xp.LawContainer(when.Elapsed(0.2, every=True)))),
        ("tick", lambda: engine.add_law(Kick(name="tick"), container=xp.LawContainer(when.Elapsed(0.1, every=True)))),
    ]
    for _, make in shuffled(makers):
        make()
    rng = random.Random(1)
    balls = [
        (
            f"ball{k}" if k % 2 else "",
            tuple(rng.uniform(-2, 2) for _ in range(3)),
            tuple(rng.uniform(-1, 1) for _ in range(3)),
        )
        for k in range(9)
    ]
    added = []
    for k, (name, x, v) in shuffled(list(enumerate(balls))):
        obj = engine.add_object(
            xp.PhysicalObject(
                xp.Sphere(0.2), name=name, position=(x[0], x[1], x[2] + 3), velocity=v, angular_velocity=v
            )
        )
        added.append((k, obj))
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True, name="floor"), laws=["bounce"])
    pairs = [(k, obj, law) for k, obj in added for law in ("gravity", "pull", "drag", "bounce", "kick", "tick")]
    for k, obj, law in shuffled(pairs):
        if not (k % 3 == 0 and law == "drag"):
            engine.map(obj, law)
    for k, obj in shuffled(added):
        for size in shuffled([1e8, 1.0, -1e8]):
            obj.add_force((size, 0, 0), 0.5 + k)
    engine.run(until=1.5, dt=0.02)
    states = {k: (obj.position, obj.velocity, obj.orientation, obj.rank) for k, obj in added}
    energy = engine.energy()
    return states | {"energy": energy[:2], "work": energy.work, "momentum": engine.momentum()}


def test_the_order_of_adding_leaves_no_bit() -> None:
    expected = scene(None)
    for seed in range(4):
        found = scene(random.Random(seed))
        assert found.pop("work") == pytest.approx(expected["work"], rel=1e-8)
        assert found == {name: value for name, value in expected.items() if name != "work"}


def test_the_order_of_adding_leaves_no_bit_in_the_work() -> None:
    assert len({scene(random.Random(seed))["work"] for seed in range(4)}) == 1


@pytest.mark.parametrize("named", [True, False])
def test_three_touching_at_once_in_any_order(named: bool) -> None:
    """One ball hits two that touch it at one instant."""
    ends = set()
    parts = [("a", (-1, 0, 0), (1, 0, 0)), ("b", (0, 0.1, 0), (0, 0, 0)), ("c", (0, -0.1, 0), (0, 0, 0))]
    for order in itertools.permutations(parts):
        engine = xp.PhysicsEngine()
        law = engine.add_law("collision:elastic")
        found = {}
        for name, x, v in order:
            obj = xp.PhysicalObject(xp.Sphere(0.1), position=x, velocity=v, name=name if named else "")
            found[name] = engine.add_object(obj, laws=[law])
        engine.run(until=2.0)
        ends.add(tuple((found[name].position, found[name].velocity) for name in "abc"))
        b, c = found["b"].velocity, found["c"].velocity
        assert b == (c[0], -c[1], c[2])
    assert len(ends) == 1


def test_ranks_are_appended_not_reshuffled() -> None:
    engine = xp.PhysicsEngine()
    late_name = [engine.add_object(xp.PhysicalObject(name=name)) for name in ("m", "k")]
    engine.run(until=1.0)
    first = engine.add_object(xp.PhysicalObject(name="a"))
    engine.run(until=2.0)
    assert [obj.name for obj in sorted(engine.objects, key=lambda obj: obj.rank)] == ["k", "m", "a"]
    assert first.rank > max(obj.rank for obj in late_name)
