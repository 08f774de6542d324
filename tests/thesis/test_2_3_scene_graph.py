"""Thesis 2.3 and 1.7: an object takes one or many geometries of an existing scene graph and drives their node."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import xpheve as xp
from xpheve.errors import MeshError
from xpheve.meshes import Bridge


def balloon_and_car() -> trimesh.Scene:
    """A host's own scene: a balloon, and a car of a body and two wheels under a node of its own."""
    scene = trimesh.Scene()
    lift = trimesh.transformations.translation_matrix
    scene.add_geometry(trimesh.creation.icosphere(subdivisions=2), node_name="balloon", transform=lift((0, 5, 0)))
    scene.graph.update("car", scene.graph.base_frame, matrix=lift((3, 0, 0)))
    scene.add_geometry(trimesh.creation.box((2, 1, 1)), node_name="body", parent_node_name="car")
    for x in (-0.7, 0.7):
        wheel = trimesh.creation.cylinder(0.3, 0.2)
        scene.add_geometry(wheel, node_name=f"wheel {x}", parent_node_name="car", transform=lift((x, -0.5, 0.6)))
    return scene


@pytest.mark.thesis("scene-graph")
def test_objects_take_the_hosts_geometry_and_drive_its_nodes_which_stay_what_they_are() -> None:
    scene = balloon_and_car()
    nodes, geometry = set(scene.graph.nodes), set(scene.geometry)
    bridge = Bridge.of(scene, ["balloon", "car"], density=1.0)
    engine = xp.PhysicsEngine()
    gravity = engine.add_law("basic:planet_gravity", acceleration=9.8)
    engine.add_objects(bridge.objects, laws=[gravity])
    wheel = np.array(scene.graph.get("wheel 0.7")[0])
    engine.run(until=1.0)
    assert bridge.update() == 2
    assert scene.graph.get("balloon")[0][1, 3] == pytest.approx(5 - 4.9)
    assert scene.graph.get("wheel 0.7")[0] == pytest.approx(
        trimesh.transformations.translation_matrix((0, -4.9, 0)) @ wheel
    )
    assert set(scene.graph.nodes) == nodes and set(scene.geometry) == geometry
    assert len(engine.object("car").shape.parts) == 3


@pytest.mark.thesis("scene-graph/decide")
def test_decided_objects_under_a_moved_turned_and_scaled_parent_drive_their_node_in_the_world() -> None:
    """Decision 0015: equal scale goes into the geometry; unequal scale above a node is refused by name."""
    scene = trimesh.Scene()
    group = trimesh.transformations.rotation_matrix(0.5, (0, 1, 0), (1, 2, 3)) @ np.diag([3, 3, 3, 1.0])
    scene.graph.update("group", scene.graph.base_frame, matrix=group)
    scene.add_geometry(trimesh.creation.box((1, 1, 1)), node_name="box", parent_node_name="group")
    bridge = Bridge.of(scene, ["box"], density=1.0)
    (box,) = bridge.objects
    assert box.mass == pytest.approx(27.0)
    box.position = (7, 8, 9)
    bridge.update()
    assert scene.graph.get("box")[0][:3, 3] == pytest.approx((7, 8, 9))
    scene.graph.update("group", scene.graph.base_frame, matrix=np.diag([1, 2, 1, 1.0]))
    with pytest.raises(MeshError, match="'box' stands under 'group'"):
        Bridge.of(scene, ["box"])


@pytest.mark.thesis("scene-graph/decide")
def test_decided_geometry_added_to_or_removed_from_an_object_changes_mass_inertia_and_bounds() -> None:
    """Decision 0015."""
    scene = balloon_and_car()
    bridge = Bridge.of(scene, ["car"], density=2.0)
    (car,) = bridge.objects
    whole = car.mass, car.inertia, car.shape.reach
    scene.graph.transforms.remove_node("wheel 0.7")
    assert bridge.refresh() == (car,)
    wheel = abs(trimesh.creation.cylinder(0.3, 0.2).volume)
    assert car.mass == pytest.approx(whole[0] - 2 * wheel) and car.inertia != whole[1]
    assert car.position[0] < 3.0, "the centre of mass moves from the wheel that is gone"
    assert car.pose == pytest.approx(np.array(scene.graph.get("car")[0])), "the node does not"


@pytest.mark.thesis("scene-graph/decide")
def test_decided_a_node_moved_by_the_host_is_taken_up_when_pulled() -> None:
    """Decision 0015."""
    scene = balloon_and_car()
    bridge = Bridge.of(scene, ["balloon"])
    engine = xp.PhysicsEngine()
    engine.add_objects(bridge.objects)
    scene.graph.update("balloon", scene.graph.base_frame, matrix=trimesh.transformations.translation_matrix((1, 2, 3)))
    assert bridge.pull() == bridge.objects and bridge.objects[0].position == pytest.approx((1, 2, 3))
