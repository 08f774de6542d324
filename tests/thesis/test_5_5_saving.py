"""Thesis figure 5-5, 5-7: a scene built and edited live is saved and read back to the same bits; reset restores what was authored."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

import xpheve as xp
from xpheve.scene import dumps, loads


def bits(engine: xp.PhysicsEngine) -> list[Any]:
    """State, forces, laws and hands of all objects, to the bit."""
    found = []
    for obj in sorted(engine.objects, key=lambda one: one.name):
        state = [*obj.position, *obj.velocity, *obj.orientation, *obj.angular_velocity, *obj.inertia, obj.mass]
        forces = [(f.vector, f.torque, f.duration, f.id) for f in engine.user_forces(obj)]
        laws = [(law.name, law.enabled, repr(law.parameters)) for law in obj.laws]
        found.append((obj.name, [x.hex() for x in state], forces, laws, obj.driven, repr(obj.shape), obj.columns))
    return found


def edited() -> xp.PhysicsEngine:
    """A scene in which everything that can be changed live was changed."""
    engine = xp.PhysicsEngine(up="z", seed=4)
    gravity = engine.add_law("basic:planet_gravity", name="gravity", acceleration=9.81)
    bounce = engine.add_law("collision:elastic", name="bounce", restitution=0.5)
    gone = engine.add_law("basic:linear_drag", name="gone")
    for k in range(6):
        ball = xp.PhysicalObject(
            xp.Sphere(0.1),
            density=300.0,
            position=(k, 0, 2 + k),
            velocity=(0, 0.1 * k, 1 / 3),
            angular_velocity=(k, 0, 1),
            name=f'b"{k}é',
        )
        engine.add_object(ball, laws=[gravity, bounce])
    first, second, third, fourth, fifth, sixth = engine.objects
    first.add_force((1, 0, 0), 2.0)
    lost = first.add_force((5, 0, 0), 3.0)
    second.add_force((0, 1, 0), id="push")
    engine.run(until=0.75)
    gravity.acceleration = 1.62
    first.remove_force(lost.id)
    second.add_force((0, 0, 2), 0.3)
    second.shape = xp.Sphere(0.2)
    third.hold()
    third.carry((2, 2, 2), (0, 0.6, 0, 0.8), within=0.5)
    fourth.mass = 3.0
    engine.unmap(fifth, gravity)
    engine.remove_object(sixth)
    engine.remove_law(gone)
    bounce.enabled = False
    engine.run(until=1.0)
    return engine


@pytest.mark.thesis("edited-scene")
@pytest.mark.parametrize("form", ["toml", "json"])
def test_fig_5_5_a_scene_edited_live_comes_back_to_the_same_bits(form: str, tmp_path: Path) -> None:
    engine = edited()
    path = tmp_path / f"scene.{form}"
    engine.save_scene(path)
    twin = xp.PhysicsEngine.load_scene(path)
    assert bits(twin) == bits(engine) and twin.time == 0.0
    again = tmp_path / f"again.{form}"
    twin.save_scene(again)
    assert bits(xp.PhysicsEngine.load_scene(again)) == bits(engine)


@pytest.mark.thesis("edited-scene")
def test_fig_5_5_it_goes_on_as_the_original_does() -> None:
    """Time begins at 0 again, so instants are other floats: what is equal is the motion, to rounding."""
    engine = edited()
    twin = loads(dumps(engine))
    engine.run(until=3.0)
    twin.run(until=2.0)
    ends = [sorted((obj.name, obj.position, obj.velocity) for obj in one.objects) for one in (engine, twin)]
    for (name, x, v), (other, y, w) in zip(*ends, strict=True):
        assert name == other and x == pytest.approx(y, abs=1e-12) and v == pytest.approx(w, abs=1e-12)


@pytest.mark.thesis("edited-scene")
def test_fig_5_5_saved_before_it_runs_it_runs_to_the_same_bits() -> None:
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", name="g")
    for k in range(4):
        obj = engine.add_object(
            xp.PhysicalObject(inertia=(1, 2, 2.5), angular_velocity=(1, k, 0.1), velocity=(0.1, k, 3), name=f"o{k}"),
            laws=[gravity],
        )
        obj.add_force((1, k, 0), 0.7 + 0.1 * k)
    engine.object("o1").carry((1, 2, 3), within=0.6)
    engine.object("o2").hold()
    for form in ("toml", "json"):
        twin = loads(dumps(engine, form), form)
        original = engine.copy()
        for one in (original, twin):
            one.run(until=2.5)
        assert bits(twin) == bits(original)


@pytest.mark.thesis("edited-scene")
def test_fig_5_5_ids_go_on_after_loading_and_after_restoring_and_none_is_given_twice() -> None:
    engine = xp.PhysicsEngine()
    obj = engine.add_object(xp.PhysicalObject(name="a"))
    given = [obj.add_force((1, 0, 0)).id for _ in range(4)]
    obj.remove_force(given[3])
    twins = [loads(dumps(engine)), xp.PhysicsEngine.restore(engine.checkpoint()), engine.copy(), engine]
    assert [twin.object("a").add_force((1, 0, 0)).id for twin in twins] == [5, 5, 5, 5]


@pytest.mark.thesis("stop-time/decide")
def test_fig_5_7_reset_gives_back_the_full_time_of_forces_and_all_that_was_edited() -> None:
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", name="g", acceleration=10.0)
    obj = engine.add_object(xp.PhysicalObject(name="a"), laws=[gravity])
    obj.add_force((4, 0, 0), 2.0, "push")
    first = bits(engine)
    engine.run(until=1.5)
    gravity.acceleration = 1.0
    gravity.enabled = False
    obj.remove_force("push")
    obj.mass = 5.0
    engine.remove_object(obj)
    engine.add_object(xp.PhysicalObject(name="b"))
    engine.reset()
    assert engine.time == 0.0 and bits(engine) == first
    engine.run(until=3.0)
    assert obj.velocity == (8, 0, -30) and not any(math.isfinite(force.duration) for force in obj.forces)
