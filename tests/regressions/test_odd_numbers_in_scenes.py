"""Scenes with odd values end in an error of xPheve or a finite answer."""

from __future__ import annotations

from typing import Any

import pytest

import xpheve as xp
from xpheve.errors import InvalidValueError, SceneError
from xpheve.scene import loads

when = xp.when
CORNERS = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
FACES = [[0, 1, 3], [0, 2, 1], [0, 3, 2], [1, 2, 3]]


@pytest.mark.parametrize("shape", ['{"kind": {}}', "[]", "[1]", "null", "3", '"ring"', '{"kind": "box"}'])
def test_a_region_whose_shape_is_no_name_is_refused(shape: str) -> None:
    region = f'{{"kind": "RegionActive", "region": {{"shape": {shape}}}}}'
    with pytest.raises(SceneError, match=r"a table is needed, such as \{ shape = "):
        loads(f'{{"xpheve": 1, "containers": [{{"name": "c", "condition": {region}}}]}}', "json")


@pytest.mark.parametrize("shape", [xp.Box((1, 1, 1)), xp.Sphere(1.0), xp.Plane(normal=(0, 0, 1))], ids=repr)
@pytest.mark.parametrize("far", [5e200, -1e160, 1e308])
@pytest.mark.parametrize("radius", [0.0, 2.0])
def test_a_region_out_of_reach_is_not_entered(shape: xp.Shape, far: float, radius: float) -> None:
    engine = xp.PhysicsEngine()
    region = xp.Region(shape, position=(far, 0, 0) if not isinstance(shape, xp.Plane) else (0, 0, -abs(far)))
    told: list[Any] = []

    class Tell(xp.PhysicalLaw):
        def enforce_this_law(self, event: Any) -> None:
            told.append(event)

    container = xp.LawContainer(when.RegionActive(region) | when.ObserverEnter(region) | when.ProbeEnter(region))
    engine.add_law(Tell(), container=container)
    ball = engine.add_object(xp.PhysicalObject(velocity=(1, 2, 3)))
    engine.add_observer(xp.Observer("eye", position=(9, 0, 0), radius=radius))
    engine.add_observer(xp.Observer("rider", attached=ball, radius=radius))
    engine.add_probe(xp.Probe("tip", attached=ball))
    engine.step(0.1)
    engine.run(until=1.0)
    assert not told and ball.position == (1, 2, 3)


@pytest.mark.parametrize(
    ("points", "faces", "said"),
    [
        ([*CORNERS, CORNERS[0]], FACES, "vertex 4 is .*: no face has it as a corner; .*Leave the faces out"),
        ([*CORNERS, (0.1, 0.1, 0.1)], FACES, "vertex 4 is .*: no face has it as a corner"),
        (
            [*CORNERS, CORNERS[0]],
            [[0, 1, 3], [4, 2, 1], [0, 3, 2], [1, 2, 3]],
            "vertex 0 is .*: another one lies at the same place",
        ),
        ([*CORNERS[:3], (0.0, 0.0, 1e21)], FACES, "in one plane, to rounding"),
        ([*CORNERS[:3], (0.0, 0.0, 1e30)], FACES, "in one plane, to rounding"),
        ([*CORNERS[:2], (0.0, float(1 << 70), 0.0), CORNERS[3]], FACES, "in one plane, to rounding"),
    ],
)
def test_a_hull_with_faces_is_made_of_its_corners_and_has_a_thickness(points: Any, faces: Any, said: str) -> None:
    with pytest.raises(InvalidValueError, match=said):
        xp.Hull(points, faces)


def test_a_long_value_in_a_region_makes_no_long_error() -> None:
    region = f'{{"kind": "RegionActive", "region": {{"shape": "box", "size": [1, 1, "{"a" * 5000}"]}}}}'
    with pytest.raises(SceneError) as told:
        loads(f'{{"xpheve": 1, "containers": [{{"name": "c", "condition": {region}}}]}}', "json")
    assert len(str(told.value)) < 3000
