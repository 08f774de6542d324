"""Conditions, observers and probes in scene files: written, read back the same, and refused in plain words."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import xpheve as xp
from xpheve.errors import SceneError

when = xp.when
BOX = xp.Region(xp.Box((1, 2, 3)), position=(5, 0, 0), orientation=(1, 2, 3, 4))
HALF = xp.Region(xp.Plane(normal=(1, 1, 1), offset=0.5))


def scene() -> xp.PhysicsEngine:
    """Return an engine with a container for each condition that a file can say."""
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", name="gravity")
    a = engine.add_object(xp.PhysicalObject(xp.Sphere(1.0), name="a", position=(0, 0, 5)), laws=[gravity])
    b = engine.add_object(xp.PhysicalObject(position=(7, 7, 7)))  # without a name: called by its place
    probe = engine.add_probe(xp.Probe("hand", position=(1, 2, 3)))
    engine.add_observer(xp.Observer("eye", attached=a, radius=2.0))
    engine.add_observer(xp.Observer("other", position=(9, 9, 9)))
    conditions = [
        when.Steps(2, passive=True),
        when.Elapsed(1.0, every=True) | when.Posted("x"),
        when.ContactBegin(a, b),
        when.ContactStay(moving=True),
        when.ContactClear(a),
        when.PoseChanged(a, tol=0.1),
        when.Changed("mass", obj=b),
        when.RegionActive(BOX),
        ~when.RegionInactive(HALF),
        when.ObserverEnter(BOX),
        when.ObserverExit(BOX),
        when.ProbeEnter(BOX, probe),
        when.ProbeExit(BOX, a),
        when.Input("key", match={"name": "a", "down": True}),
        when.Input("key", "a"),
        when.Paused(once=True),
        when.Resumed(),
        when.ObjectAdded("gravity"),
        when.ObjectRemoved(),
        when.ForceExpired("x"),
        when.Asleep(a),
        when.Awake(b),
        (when.Posted("a") | when.Posted("b") & when.Steps()) & when.AllNow(when.Posted(), ~when.Asleep(a), once=True),
        when.AnyOf(when.Started(), when.Elapsed(2.0), once=True),
    ]
    for k, condition in enumerate(conditions):
        engine.add_container(xp.LawContainer(condition, name=f"c{k:02d}"))
    return engine


@pytest.mark.parametrize("form", ["toml", "json"])
def test_conditions_observers_and_probes_come_back(form: str, tmp_path: Path) -> None:
    engine = scene()
    engine.save_scene(tmp_path / f"one.{form}")
    again = xp.PhysicsEngine.load_scene(tmp_path / f"one.{form}")
    again.save_scene(tmp_path / f"two.{form}")
    assert (tmp_path / f"one.{form}").read_bytes() == (tmp_path / f"two.{form}").read_bytes()
    for one, other in zip(engine.containers, again.containers, strict=True):
        assert str(one.condition).replace("#1", "") == str(other.condition).replace("#1", "")
    eye, other_eye = again.observers
    assert eye.attached is again.object("a") and (eye.radius, other_eye.position) == (2.0, (9, 9, 9))
    assert again.containers[11].condition.probe is again.probes[0]  # type: ignore[union-attr]


def test_checkpoints_copies_and_resets_keep_them_all() -> None:
    engine = scene()
    engine.run(until=1.0, dt=0.1)
    other = xp.PhysicsEngine.restore(engine.checkpoint())
    copy = engine.copy()
    for one in (engine, other, copy):
        one.post("a")
        one.run(until=2.0, dt=0.1)
    assert engine.checkpoint() == other.checkpoint() == copy.checkpoint()
    for one in (engine, copy):
        one.reset()
    assert engine.checkpoint() == copy.checkpoint()


def test_a_law_named_by_itself_is_written_by_name(tmp_path: Path) -> None:
    engine = xp.PhysicsEngine()
    gravity = engine.add_law("basic:planet_gravity", name="gravity")
    engine.add_container(xp.LawContainer(when.ObjectAdded(gravity), name="c"))
    engine.save_scene(tmp_path / "scene.toml")
    again = xp.PhysicsEngine.load_scene(tmp_path / "scene.toml")
    assert again.containers[0].condition == when.ObjectAdded("gravity")


def test_what_a_file_cannot_say_is_refused(tmp_path: Path) -> None:
    def refused(condition: Any) -> str:
        engine = xp.PhysicsEngine()
        engine.add_container(xp.LawContainer(condition, name="c"))
        with pytest.raises(SceneError) as told:
            engine.save_scene(tmp_path / "scene.toml")
        return str(told.value)

    assert "Python function" in refused(when.Posted() | when.Crosses(lambda body: body.mass))
    assert "not in this engine" in refused(when.Asleep(xp.PhysicalObject(name="free")))
    assert "not in this engine" in refused(when.ProbeEnter(BOX, xp.Probe("free")))


@pytest.mark.parametrize(
    ("condition", "said"),
    [
        ('{ kind = "AnyOf" }', "the key of is missing"),
        ('{ kind = "AnyOf", of = 3 }', "a list of conditions is needed"),
        ('{ kind = "Not", of = [{ kind = "Posted" }] }', "Levels are RegionActive"),
        ('{ kind = "Not", of = [{ kind = "Nothing" }] }', "no condition is called so"),
        ('{ kind = "RegionActive" }', "the key region is missing"),
        ('{ kind = "RegionActive", region = "here" }', "a table is needed"),
        ('{ kind = "RegionActive", region = { shape = "sphere", radius = -1.0 } }', "radius"),
        ('{ kind = "RegionActive", region = { shape = "sphere", size = 1.0 } }', "no such key"),
        ('{ kind = "Asleep", obj = "nobody" }', "no object of this file is called"),
        ('{ kind = "Asleep", obj = 3 }', "the name of an object is needed"),
        ('{ kind = "Crosses", expression = "z" }', "'z' cannot be said"),
        ('{ kind = "Crosses", expression = 3 }', "text that says an expression of the body is needed"),
        ('{ kind = "Crosses", expression = "body.position.z - body.time" }', "subtracts m and s"),
        ('{ kind = "Input" }', "the key input is missing"),
        ('{ kind = "Elapsed", seconds = 1.0, clock = "wall" }', "simulation time"),
    ],
)
def test_a_wrong_condition_is_named_with_its_place(condition: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(f'xpheve = 1\n[[containers]]\nname = "c"\ncondition = {condition}\n')
    with pytest.raises(SceneError) as told:
        xp.PhysicsEngine.load_scene(path)
    assert said in str(told.value) and "scene.toml" in str(told.value)
