"""Scene files with objects of many parts, and every form of a pose; written and read back to the same bits."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve import scene
from xpheve.errors import SceneError
from xpheve.shapes.triangles import triangles

HEAD = 'xpheve = 1\n[[objects]]\nname = "a"\n'
TURN = xp.orientation.from_axis_angle((0, 0, 1), math.pi / 2)


def bits(obj: xp.PhysicalObject) -> list[Any]:
    values = [*obj.position, *obj.orientation, *obj.velocity, *obj.angular_velocity, *obj.inertia, obj.mass]
    return [value.hex() for value in values]


def many() -> xp.PhysicsEngine:
    rng = np.random.default_rng(4)
    hull, large = xp.Hull(rng.normal(size=(30, 3))), xp.Mesh(*triangles(xp.Sphere(1.0), 48))
    skin = xp.Mesh(rng.normal(size=(9, 3)), [[0, 1, 2], [3, 4, 5], [6, 7, 8]])
    inner = xp.Compound([(xp.Box((1, 2, 3)), (1, 0, 0)), (xp.Capsule(0.5, 1), (0, 2, 0), (1, 2, 3, 4))])
    car = xp.Compound(
        [xp.Part(inner, (0, 0, 1), TURN, 3.0), xp.Part(hull, pose=np.eye(4), density=2.0), xp.Part(large, density=1.0)]
    )
    engine = xp.PhysicsEngine(up="z")
    spin = {"angular_velocity": (0.1, 2, 0.3), "velocity": (1, 2, 3)}
    engine.add_objects(
        [
            xp.PhysicalObject(car, name="car", **spin),
            xp.PhysicalObject(hull, name="hull", pose=xp.orientation.to_pose((1, 2, 3), TURN), density=2.0, **spin),
            xp.PhysicalObject(large, name="large", mass=0.1, **spin),
            xp.PhysicalObject(xp.Mesh(skin.vertices, skin.faces, "hull"), name="filled", **spin),
            xp.PhysicalObject(skin, name="skin", mass=2.0, inertia=(1, 1, 1), **spin),
            xp.PhysicalObject(skin, name="dust", mass=2.0, inertia=0.0),
            xp.PhysicalObject(skin, name="room", fixed=True),
            xp.PhysicalObject(car, name="parked", fixed=True, position=(9, 0, 0)),
        ]
    )
    return engine


@pytest.mark.parametrize("form", ["toml", "json"])
def test_objects_of_many_parts_come_back_to_the_bit_in_the_middle_of_a_run(form: str) -> None:
    engine = many()
    engine.run(until=0.7)
    text = scene.dumps(engine, form)
    again = scene.loads(text, form)
    for obj in engine.objects:
        other = again.object(obj.name)
        assert other.shape == obj.shape and bits(other) == bits(obj), obj.name
        assert other.pose.tobytes() == obj.pose.tobytes() and other.shape.frame == obj.shape.frame
    assert scene.dumps(again, form).splitlines()[1:] == text.splitlines()[1:]
    engine.run(until=1.7)
    again.run(until=1.0)
    assert again.object("car").orientation == pytest.approx(engine.object("car").orientation, abs=1e-12)


@pytest.mark.parametrize(
    "given",
    [
        'orientation = { axis = [0, 0, 2], angle = "90 deg" }',
        f"orientation = {{ axis = [0, 0, 1], angle = {math.pi / 2} }}",
        'orientation = { euler = ["0 deg", "0 deg", "90 deg"] }',
        'orientation = { euler = ["90 deg", "0 deg", "0 deg"], order = "ZYX" }',
        f"orientation = {list(TURN)}",
        "pose = [[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]",
    ],
)
def test_every_form_of_an_orientation_is_read(given: str) -> None:
    box = 'shape = { kind = "box", size = [1, 2, 3] }\n'
    obj = scene.loads(HEAD + box + given).object("a")
    assert abs(np.dot(obj.orientation, TURN)) == pytest.approx(1.0, abs=1e-14)
    part = scene.loads(
        HEAD + f'shape = {{ kind = "compound", parts = [{{ shape = {{ kind = "sphere", radius = 1 }}, {given} }}] }}'
    )
    assert abs(np.dot(part.object("a").shape.authored_parts[0].orientation, TURN)) == pytest.approx(1.0, abs=1e-14)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("pose = [[2, 0, 0, 0], [0, 2, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]]", "scale 2, 2, 2"),
        ("pose = [[1, 0], [0, 1]]", "four rows of four numbers"),
        ("orientation = { axis = [0, 0, 1] }", "a quaternion .w, x, y, z., . axis"),
        ("orientation = { axis = [0, 0, 0], angle = 1 }", "a finite direction other than 0"),
        ('orientation = { euler = [0, 0, 1], order = "abc" }', "order = 'abc'"),
        ('orientation = { euler = ["1 m", 0, 1] }', "unit m is length"),
        ("shape = { kind = 'compound', parts = [] }", "no parts"),
        ("shape = { kind = 'compound', parts = [{ shape = { kind = 'plane' } }] }", "a plane has no end"),
        ("shape = { kind = 'compound', parts = [{ }] }", "the key shape is missing"),
        ("shape = { kind = 'compound', parts = [{ shape = { kind = 'spere' } }] }", 'Did you mean "sphere"'),
        ("shape = { kind = 'hull', points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]] }", "one plane"),
        ("shape = { kind = 'hull', points = 'base64:AAAA' }", "places of shape"),
        ("shape = { kind = 'mesh', vertices = 'x', faces = [[0, 1, 2]] }", "places, lists of three numbers"),
        ("shape = { kind = 'mesh', vertices = [[0, 0, 0]], faces = [[0, 1, 2.5]] }", "row 1 is .0, 1, 2.5."),
        ("shape = { kind = 'mesh', file = '/etc/passwd' }", "leads out of the folder"),
        ("shape = { kind = 'mesh', file = 'a.glb', vertices = [[0, 0, 0]] }", "give one or the other"),
    ],
)
def test_what_is_wrong_is_said_with_line_and_object(given: str, said: str) -> None:
    with pytest.raises(SceneError, match=said) as told:
        scene.loads(HEAD + given)
    assert str(told.value).startswith("scene:4: ")


def test_compounds_may_be_nested_but_not_without_end() -> None:
    shape = '{ kind = "sphere", radius = 1 }'
    for _ in range(2):
        shape = f'{{ kind = "compound", parts = [{{ shape = {shape}, position = [1, 0, 0] }}] }}'
    assert scene.loads(HEAD + f"shape = {shape}").object("a").shape.authored_parts[0].position == (1, 0, 0)
    for _ in range(40):
        shape = f'{{ kind = "compound", parts = [{{ shape = {shape} }}] }}'
    with pytest.raises(SceneError, match="nested more than"):
        scene.loads(HEAD + f"shape = {shape}")
