"""Engine to file to engine: the same bits of state, forces, parameters and mapping; the text is stable."""

from __future__ import annotations

import contextlib
import json
import math
import os
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import InvalidValueError, SceneError
from xpheve.laws import FieldLaw, LawContainer, PhysicalLaw
from xpheve.laws.conditions import Condition, Elapsed, Posted, Started
from xpheve.plugins import Registry
from xpheve.scene import dumps, load, loads, save, schema

FORMS = pytest.mark.parametrize("form", ["toml", "json"])


def bits(engine: xp.PhysicsEngine) -> dict[str, Any]:
    """What a file must bring back, objects by name or place among the unnamed."""
    named = sorted(engine.objects, key=lambda obj: (not obj.name, obj.name, obj.serial))
    called = {obj: obj.name or f"#{k}" for k, obj in enumerate(named)}
    laws = sorted(engine.laws, key=lambda law: (not law.name, law.name, law.label(), engine.laws.index(law)))
    numbers = {law: k for k, law in enumerate(laws)}
    return {
        "scene": (engine.up, engine.seed),
        "objects": {
            called[obj]: {
                "state": [
                    [x.hex() for x in getattr(obj, name)]
                    for name in ("position", "velocity", "orientation", "angular_velocity", "inertia")
                ],
                "mass": obj.mass.hex(),
                "shape": repr(obj.shape),
                "fixed": obj.fixed,
                "columns": {name: value.hex() for name, value in obj.columns.items()},
                "forces": [repr(force) for force in engine.user_forces(obj)],
                "laws": sorted(numbers[law] for law in obj.laws),
            }
            for obj in named
        },
        "laws": [
            (
                law.label(),
                law.name,
                law.enabled,
                repr(law.parameters),
                [[called[obj] for obj in side] for side in getattr(law, "between", None) or ()],
                [(type(one), one.name, one.condition) for one in law.containers],
            )
            for law in laws
        ],
        "containers": sorted(
            str((type(one).__name__, one.name, one.condition, len(one.laws))) for one in engine.containers
        ),
    }


def full(registry: Registry, *, calm: bool = False) -> xp.PhysicsEngine:
    """A scene with something of everything; ``calm`` without the extremes of floats, so that it runs quickly."""
    engine = xp.PhysicsEngine(up="z", seed=7, registry=registry)
    gravity = engine.add_law("basic:planet_gravity", acceleration=9.81, direction=(1, 2, -3), name="gravity")
    wind = engine.add_law("toy:wind", push=(0.1, 1e-300, -0.0), strength=1 / 3, limit=None, mode="hard", gusty=True)
    charged = engine.add_law("toy:charged", name='na"me\n\t\x7f \u00e9\u4e16', enabled=False)
    everyone = engine.add_law("toy:pull", k=2.0)
    tick = engine.add_law("toy:tick", name="tick")
    slow = engine.add_law("toy:tick", LawContainer(Elapsed(2.5)), name="slow")
    idle = engine.add_law("toy:idle", "toy:at_start")
    shared = engine.add_container(LawContainer(Posted(id="go", once=True), name="shared"))
    first, second = engine.add_law("toy:idle", shared), engine.add_law("toy:idle", shared, name="second")
    engine.add_container(LawContainer(Started())).add_law(second)
    floor = xp.PhysicalObject(xp.Plane((1, 2, 3), 0.1), fixed=True, name="floor")
    ball = xp.PhysicalObject(
        xp.Sphere(0.1),
        density=1000.0,
        position=(0.1, 0.2, 1.0 if calm else 1e22),
        velocity=(1 / 3, -0.0, 0.1) if calm else (1 / 3, -2e-308, 5e-324),
        orientation=(1, 2, 3, 4),
        angular_velocity=(0.1, 0.2, 0.3),
        name="ball_10",
        charge=1e-9,
        glow=-0.0,
    )
    top = xp.PhysicalObject(inertia=(1, 2, 3), angular_velocity=(0.01, 2, 0.01), name="ball_2")
    dust = [xp.PhysicalObject(xp.Box((1, 2, 3)), mass=k + 0.1, position=(k, 0, 0)) for k in range(3)]
    ring = xp.PhysicalObject(registry.find("shape", "toy:ring")(0.5), mass=2)
    capsule = xp.PhysicalObject(xp.Capsule(0.1, 0.3), mass=2, position=(0, -0.0, 0))
    engine.add_object(floor)
    engine.add_object(ball, [gravity, charged, "second"])
    engine.add_objects([top, *dust], [everyone, tick, slow, idle])
    engine.add_objects([ring, capsule], [gravity, wind, first])
    engine.add_law("toy:pull", k=0.3, between=([dust[1]], [dust[2], ball]))
    engine.add_law("toy:pull", k=0.3, between=([top], [ball]), name="rope")
    ball.add_force((1, 2, 3), duration=1 / 3, id="push")
    ball.add_force((0.1, 0, 0))
    ball.add_force(xp.Force((0, 0, 0), 2.0, "twist", torque=(0, 1e-9, 0)))
    top.add_force((0, 0, 1), duration=5.0, id=-3)
    return engine


@FORMS
def test_a_scene_comes_back_to_the_bit(form: str, registry: Registry) -> None:
    engine = full(registry)
    text = dumps(engine, form)
    back = loads(text, form, registry=registry)
    assert bits(back) == bits(engine)
    assert dumps(back, form) == text


@FORMS
def test_a_scene_comes_back_to_the_bit_after_it_ran(form: str, registry: Registry) -> None:
    engine = full(registry, calm=True)
    engine.run(until=0.2)
    text = dumps(engine, form)
    back = loads(text, form, registry=registry)
    assert bits(back) == bits(engine)
    push = next(force for force in back.object("ball_10").forces if force.id == "push")
    assert push.duration == pytest.approx(1 / 3 - 0.2, abs=1e-16)


def test_what_comes_back_runs_to_the_same_bits(registry: Registry) -> None:
    engine = full(registry, calm=True)
    back = loads(dumps(engine), registry=registry)
    engine.run(until=0.5)
    back.run(until=0.5)
    assert bits(back) == bits(engine)


def test_the_text_is_sorted_and_readable(registry: Registry) -> None:
    text = dumps(full(registry), run={"until": 3, "every": 0.1, "record": "run.arrow"})
    assert text.splitlines()[0] == f"# Written by xPheve {xp.__version__}."
    assert '[run]\nuntil = 3.0\nevery = 0.1\nrecord = "run.arrow"\n' in text
    data = tomllib.loads(text)
    assert [row.get("name", "") for row in data["objects"]][:4] == ["ball_2", "ball_10", "floor", ""]
    assert data["laws"][0]["name"] == "gravity"
    assert max(map(len, text.splitlines())) < 200
    assert "orientation = [0.18257418583505536, 0.3651483716701107, 0.5477225575051661, 0.7302967433402214]" in text


def test_the_text_does_not_depend_on_the_order_of_adding_named_objects(registry: Registry) -> None:
    def build(names: list[str]) -> str:
        engine = xp.PhysicsEngine(registry=registry)
        for name in names:
            engine.add_object(xp.PhysicalObject(name=name, position=(len(name), 0, 0)))
        return dumps(engine)

    assert build(["a", "bb", "c10", "c9"]) == build(["c9", "c10", "a", "bb"])


finite = st.floats(allow_nan=False, allow_infinity=False)
vectors = st.tuples(finite, finite, finite)
sizes = st.floats(1e-60, 1e60)
names = st.text(st.characters(exclude_categories=["Cs"]), max_size=8).filter(lambda name: not name.startswith("#"))
shapes = st.one_of(
    st.none(),
    st.builds(xp.Sphere, sizes),
    st.builds(xp.Capsule, sizes, sizes),
    st.builds(xp.Box, st.tuples(sizes, sizes, sizes)),
)
forces = st.builds(
    xp.Force,
    vectors,
    st.one_of(st.just(math.inf), st.floats(0, 1e300, exclude_min=True)),
    st.one_of(st.none(), st.integers(-(2**62), 2**62), names),
)


@st.composite
def scenes(draw: st.DrawFn) -> tuple[list[xp.PhysicalObject], list[Any]]:
    """Objects not yet added, and for each its laws and forces."""
    objects, rest = [], []
    for name in draw(st.lists(names, max_size=4, unique_by=lambda name: name or object())):
        turns = draw(st.tuples(*[st.floats(-1e3, 1e3)] * 4).filter(lambda q: math.hypot(*q) > 1e-3))
        columns = draw(
            st.dictionaries(st.sampled_from(["charge", "odd column", "\u00fc"]), st.floats(-1, 1), max_size=2)
        )
        try:
            obj = xp.PhysicalObject(
                draw(shapes),
                mass=draw(st.floats(1e-60, 1e60)),
                position=draw(vectors),
                velocity=draw(vectors),
                orientation=turns,
                angular_velocity=draw(vectors),
                inertia=draw(st.one_of(st.none(), st.floats(1e-300, 1e300))),
                name=name,
                **columns,
            )
        except InvalidValueError:  # moments of inertia that underflow
            continue
        objects.append(obj)
        rest.append((draw(st.sets(st.integers(0, 3))), draw(st.lists(forces, max_size=2))))
    return objects, rest


@FORMS
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(scene=scenes(), numbers=st.tuples(vectors, st.floats(0, 1e300), st.floats(0, 1e300)), up=st.sampled_from("xyz"))
def test_any_scene_comes_back_to_the_bit(form: str, scene: Any, numbers: Any, up: str, registry: Registry) -> None:
    engine = xp.PhysicsEngine(up=up, registry=registry)
    laws = [
        engine.add_law("toy:wind", push=numbers[0], strength=numbers[1]),
        engine.add_law("toy:wind", push=numbers[0], strength=numbers[1]),
        engine.add_law("toy:pull", k=numbers[2], name="pull"),
        engine.add_law("toy:charged"),
    ]
    for obj, (chosen, pushed) in zip(*scene, strict=True):
        engine.add_object(obj, [laws[k] for k in sorted(chosen)])
        for force in pushed:
            with contextlib.suppress(InvalidValueError):  # one that overflows on this mass is refused
                obj.add_force(force)
    text = dumps(engine, form)
    back = loads(text, form, registry=registry)
    assert bits(back) == bits(engine)
    assert dumps(back, form) == text


def test_new_forces_get_ids_of_their_own(registry: Registry) -> None:
    engine = xp.PhysicsEngine(registry=registry)
    ball = engine.add_object(xp.PhysicalObject(name="ball"))
    ball.add_force((1, 0, 0))
    ball.add_force((2, 0, 0))
    back = loads(dumps(engine), registry=registry)
    assert back.object("ball").add_force((3, 0, 0)).id == 3


def test_units_and_short_forms_are_read(registry: Registry) -> None:
    engine = loads(
        """
        xpheve = 1
        [[laws]]
        id = "toy:charged"
        [[laws]]
        id = "toy:pull"
        k = "2 N/mm"
        between = ["a", ["#2"]]
        [[laws]]
        id = "toy:wind"
        limit = "none"
        [[objects]]
        name = "a"
        mass = "500 g"
        position = ["1 km", 0, "3 mm"]
        angular_velocity = ["60 rpm", 0, 0]
        inertia = 2
        columns = { charge = "3 uC" }
        laws = ["toy:charged", "toy:charged"]
        forces = [{ vector = ["1 kN", 0, 0], duration = "1 min" }]
        [[objects]]
        shape = { kind = "sphere", radius = "3 cm" }
        density = "1 g/cm^3"
        """,
        registry=registry,
    )
    a, b = engine.objects
    assert (a.mass, a.position, a.inertia) == (0.5, (1000.0, 0.0, 0.003), (2.0, 2.0, 2.0))
    assert a.angular_velocity[0] == pytest.approx(2 * math.pi, rel=1e-15)
    assert a["charge"] == pytest.approx(3e-6, rel=1e-15)
    assert a.forces[0].vector == (1000.0, 0.0, 0.0) and a.forces[0].duration == 60.0
    assert b.mass == pytest.approx(1000 * 4 / 3 * math.pi * 0.03**3)
    assert engine.law("toy:pull").parameters["k"] == pytest.approx(2000.0)
    assert engine.law("toy:wind").parameters["limit"] is None
    assert set(a.laws) == {engine.law("toy:charged"), engine.law("toy:pull")} and b.laws == (engine.law("toy:pull"),)


def test_a_quaternion_that_people_rounded_off_is_made_a_unit(registry: Registry) -> None:
    engine = loads("xpheve = 1\n[[objects]]\norientation = [0.7071068, 0, 0, 0.7071068]", registry=registry)
    assert math.fsum(x * x for x in engine.objects[0].orientation) == pytest.approx(1.0, abs=4e-16)


def test_what_was_left_out_does_not_act(registry: Registry, tmp_path: Path) -> None:
    from xpheve.scene import read

    path = tmp_path / "s.toml"
    path.write_text(
        'xpheve = 1\n[[laws]]\nid = "ocean:wave"\nname = "wave"\n[[laws]]\nid = "toy:pull"\nbetween = ["a", "a"]\n'
        '[[objects]]\nname = "a"\nlaws = ["wave"]\n'
    )
    assert read(path).build(registry=registry, without=["wave", "toy:pull"]).laws == ()
    with pytest.raises(
        SceneError, match=r'no law of this file is called "wav", so it cannot be left out. Did you mean "wave"'
    ):
        read(path).build(registry=registry, without=["wav"])


# Files -----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".toml", ".json"])
def test_files_are_written_whole_and_read_back(suffix: str, registry: Registry, tmp_path: Path) -> None:
    engine = full(registry)
    path = tmp_path / f"scene{suffix}"
    path.write_text("old")
    engine.save_scene(path)
    assert os.listdir(tmp_path) == [path.name]
    assert bits(xp.PhysicsEngine.load_scene(path, registry=registry)) == bits(engine)


def test_a_file_that_cannot_be_written_leaves_the_old_one(registry: Registry, tmp_path: Path) -> None:
    engine = xp.PhysicsEngine(registry=registry)
    path = tmp_path / "scene.toml"
    path.write_text("old")
    engine.add_object(xp.PhysicalObject(name="\ud800"))
    with pytest.raises(SceneError, match="half of a surrogate pair, which is no character; rename it"):
        save(engine, path)
    assert path.read_text() == "old" and os.listdir(tmp_path) == [path.name]
    with pytest.raises(SceneError, match=r"scene\.toml: cannot be written: No such file or directory"):
        save(xp.PhysicsEngine(registry=registry), tmp_path / "none" / "scene.toml")
    with pytest.raises(SceneError, match=r"scene files end in \.toml or \.json"):
        save(engine, tmp_path / "scene.yaml")


# What a file cannot say ------------------------------------------------------------------------------------------------


class Script(FieldLaw):
    """A law of no pack."""

    def force(self, body: Any) -> Any:
        return (0.0, 0.0, 0.0)


class Impostor(Script):
    """A law that takes another's id."""

    id = "toy:wind"


class Unfindable(Script):
    """A law of a pack that nobody has."""

    id = "mine:law"


class ScriptContainer(LawContainer):
    """A container of no pack."""

    condition = Started()


class Odd(Condition):
    """A condition of no pack."""


class Word(PhysicalLaw):
    """A handler of no pack."""

    condition: ClassVar[Condition | None] = Started()


def with_law(law: Any, container: Any = None) -> Callable[[xp.PhysicsEngine], Any]:
    return lambda engine: engine.add_law(law, container)


def force_number(engine: xp.PhysicsEngine) -> None:
    engine.add_law("toy:wind").parameters["strength"] = math.inf


CANNOT = {
    "a law of a script": (
        with_law(Script()),
        "law Script: the class Script is of no pack, so that a file cannot name it. Put it",
    ),
    "a named law of a script": (with_law(Script(name="a")), 'law "a" (Script): the class Script is of no pack'),
    "a law with another's id": (with_law(Impostor()), "law toy:wind: its class "),
    "a law of no pack": (
        with_law(Unfindable()),
        "law mine:law: the class Unfindable is of no pack that can be found (",
    ),
    "a container of a script": (
        lambda engine: engine.add_law("toy:idle", ScriptContainer()),
        "the class ScriptContainer is of no pack",
    ),
    "a named container of a script": (
        lambda engine: engine.add_law("toy:idle", ScriptContainer(name="c")),
        'container "c": the class ScriptContainer is of no pack',
    ),
    "a condition of a script": (
        lambda engine: engine.add_law("toy:idle", LawContainer(Odd())),
        "law toy:idle: its condition Odd() is none of xpheve.when, so a scene file cannot say it",
    ),
    "a post of an object": (
        lambda engine: engine.add_law("toy:idle", LawContainer(Posted(source=engine))),
        "of its condition: a scene file has numbers and texts only",
    ),
    "a law in no container": (
        lambda engine: engine.remove_container(engine.add_law("toy:tick").containers[0]),
        "law toy:tick: it is in no container, so it never acts; put it into one, or remove it",
    ),
    "a name like a place": (
        lambda engine: engine.add_object(xp.PhysicalObject(name="#1")),
        'object "#1": in scene files "#" stands for places, and begins no name; rename it',
    ),
    "a text that is not given": (
        lambda engine: engine.add_law("toy:wind").parameters.__setitem__("mode", None),
        "law toy:wind: mode = None: a scene file cannot say that; set a text",
    ),
    "infinity": (force_number, "law toy:wind: strength = inf: a scene file has finite numbers only"),
}


@pytest.mark.parametrize("build, error", CANNOT.values(), ids=CANNOT)
def test_what_a_file_cannot_say_is_told(
    build: Callable[[xp.PhysicsEngine], Any], error: str, registry: Registry
) -> None:
    engine = xp.PhysicsEngine(registry=registry)
    build(engine)
    with pytest.raises(SceneError) as told:
        dumps(engine)
    assert error in str(told.value)


def test_settings_of_a_run_are_checked(registry: Registry) -> None:
    engine = xp.PhysicsEngine(registry=registry)
    with pytest.raises(SceneError, match=r"run has no 'utnil'. Did you mean \"until\"\? It has: until, dt, every"):
        dumps(engine, run={"utnil": 3})
    with pytest.raises(SceneError, match=r"run\.until = nan: a scene file has finite numbers only"):
        dumps(engine, run={"until": math.nan})
    with pytest.raises(SceneError, match="form = 'yaml': choose 'toml' or 'json'"):
        dumps(engine, "yaml")


# The schema --------------------------------------------------------------------------------------------------------------


def test_the_schema_knows_the_parameters_of_all_laws(registry: Registry) -> None:
    found = schema(registry)
    json.dumps(found, allow_nan=False)
    laws = {law["title"]: law for law in found["$defs"]["LawTable"]["oneOf"]}
    assert {"basic:planet_gravity", "collision:elastic", "toy:wind"} <= laws.keys()
    wind = laws["toy:wind"]
    assert wind["additionalProperties"] is False and wind["required"] == ["id"]
    assert wind["properties"]["id"] == {"const": "toy:wind"}
    assert wind["properties"]["push"]["unit"] == "N"
    assert wind["properties"]["mode"]["enum"] == ["soft", "hard"]
    assert {"name", "enabled", "between", "container", "condition"} <= wind["properties"].keys()
    assert found["$defs"]["ConditionTable"]["properties"]["kind"]["enum"][0] == "Started"
    tables = {"run", "containers", "laws", "objects", "observers", "probes"}
    assert (
        set(found["properties"])
        == {"xpheve", "up", "seed", "compile", "stepper", "periodic", "force_ids", "$schema"} | tables
    )


def test_a_scene_may_name_its_schema(registry: Registry) -> None:
    assert loads('{"$schema": "scene.schema.json", "xpheve": 1}', "json", registry=registry).objects == ()


def test_reading_does_not_import_packs(tmp_path: Path) -> None:
    path = tmp_path / "s.toml"
    path.write_text('xpheve = 1\n[[laws]]\nid = "ocean:wave"\n')
    from xpheve.scene import read

    assert read(path).table.laws[0].id == "ocean:wave"
    with pytest.raises(SceneError, match="is not installed"):
        load(path)
