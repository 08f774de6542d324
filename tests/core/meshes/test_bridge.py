"""The engine drives the nodes of an existing `trimesh.Scene`."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import xpheve as xp
from xpheve.errors import MeshError
from xpheve.meshes import Bridge, scene_objects

BOX = trimesh.creation.box((1.0, 2.0, 3.0))


def at(
    x: float = 0, y: float = 0, z: float = 0, angle: float = 0.0, axis: tuple[float, float, float] = (0, 0, 1)
) -> np.ndarray:
    matrix = trimesh.transformations.rotation_matrix(angle, axis)
    matrix[:3, 3] = x, y, z
    return matrix


def nested() -> trimesh.Scene:
    """A group that is moved, turned and scaled, two boxes in it, one on the other; and a box beside it."""
    scene, box = trimesh.Scene(), BOX.copy()  # a test scales it
    scene.graph.update("group", scene.graph.base_frame, matrix=at(1, 2, 3, 0.7, (1, 1, 0)) @ np.diag([2, 2, 2, 1.0]))
    scene.add_geometry(box, geom_name="box", node_name="lower", parent_node_name="group", transform=at(1, 0, 0, 0.2))
    scene.add_geometry(
        box, geom_name="box", node_name="upper", parent_node_name="lower", transform=at(0, 5, 0, 0.3, (1, 0, 0))
    )
    scene.add_geometry(box, geom_name="box", node_name="beside", transform=at(9, 0, 0))
    return scene


def world(scene: trimesh.Scene, node: str) -> np.ndarray:
    return np.array(scene.graph.get(node)[0])


def run(bridge: Bridge, until: float = 1.0, **motion: object) -> xp.PhysicsEngine:
    engine = xp.PhysicsEngine()
    engine.add_objects(bridge.objects)
    for obj in bridge.objects:
        obj.velocity, obj.angular_velocity = motion.get("velocity", (1, 0, 0)), motion.get("spin", (0.3, 1, 0.2))
    engine.run(until=until)
    return engine


@pytest.mark.parametrize("nodes", [None, ["lower", "beside"], ["upper", "lower", "beside"], ["upper"]])
def test_objects_stand_where_their_nodes_do_and_drive_them(nodes: list[str] | None) -> None:
    scene = nested()
    before = {node: world(scene, node) for node in scene.graph.nodes}
    bridge = Bridge.of(scene, nodes, density=1.0)
    assert sum(obj.mass for obj in bridge.objects) == pytest.approx(
        48.0 * (1 if nodes == ["upper"] else 2) + 6 * (nodes != ["upper"])
    )
    bridge.update()
    assert all(np.allclose(world(scene, node), before[node], atol=1e-13) for node in before)
    run(bridge)
    assert bridge.update() == len(bridge.objects) and bridge.update() == 0
    for obj in bridge.objects:
        moved = world(scene, bridge.node_of(obj))
        assert np.allclose(moved[:3, 3], obj.pose[:3, 3], atol=1e-12)
        scale = 1.0 if obj.name == "beside" else 2.0
        assert np.allclose(moved[:3, :3], scale * obj.pose[:3, :3], atol=1e-12)


def test_what_hangs_on_a_node_keeps_its_pose_relative_to_it() -> None:
    scene = nested()
    bridge = Bridge.of(scene, ["lower"])
    relative = np.linalg.inv(world(scene, "lower")) @ world(scene, "upper")
    run(bridge, 3.0)
    bridge.update()
    assert np.allclose(np.linalg.inv(world(scene, "lower")) @ world(scene, "upper"), relative, atol=1e-12)
    corners = trimesh.transform_points(BOX.vertices, world(scene, "upper"))
    shape, body = (
        bridge.objects[0].shape,
        xp.orientation.to_pose(bridge.objects[0].position, bridge.objects[0].orientation),
    )
    part = shape.parts[1]
    pose = body @ xp.orientation.to_pose(part.position, part.orientation)
    drawn = trimesh.transform_points(part.shape.vertices, pose)
    assert np.allclose(np.sort(drawn, axis=0), np.sort(corners, axis=0), atol=1e-11)


def test_a_node_moved_by_the_host_is_taken_up() -> None:
    scene = nested()
    bridge = Bridge.of(scene, ["lower", "upper", "beside"])
    assert bridge.pull() == ()
    engine = run(bridge)
    bridge.update()
    velocity = engine.object("beside").velocity
    scene.graph.update("beside", scene.graph.base_frame, matrix=at(0, 7, 0, 0.5))
    assert [obj.name for obj in bridge.pull()] == ["beside"] and bridge.pull() == ()
    assert (
        engine.object("beside").pose == pytest.approx(at(0, 7, 0, 0.5)) and engine.object("beside").velocity == velocity
    )


def test_a_node_above_moved_by_the_host_moves_the_objects_if_pulled_and_else_not() -> None:
    for pulled in (True, False):
        scene = nested()
        bridge = Bridge.of(scene, ["lower", "upper"])
        run(bridge, 0.5)
        bridge.update()
        before = {obj.name: obj.pose for obj in bridge.objects}
        shift = at(10, 0, 0)
        scene.graph.update("group", scene.graph.base_frame, matrix=shift @ world(scene, "group"))
        if pulled:
            assert len(bridge.pull()) == 2
        bridge.update()
        for obj in bridge.objects:
            wanted = shift @ before[obj.name] if pulled else before[obj.name]
            assert np.allclose(obj.pose, wanted, atol=1e-12)
            assert np.allclose(world(scene, obj.name)[:3, 3], wanted[:3, 3], atol=1e-12)


def test_sheared_nodes_and_those_under_unequal_scale_are_refused_by_name() -> None:
    scene = trimesh.Scene()
    scene.graph.update("stretched", scene.graph.base_frame, matrix=np.diag([1, 2, 3, 1.0]))
    scene.add_geometry(BOX, geom_name="box", node_name="straight", parent_node_name="stretched")
    scene.add_geometry(BOX, geom_name="box", node_name="turned", parent_node_name="stretched", transform=at(angle=0.5))
    with pytest.raises(MeshError, match="node 'turned' is sheared"):
        scene_objects(scene, ["turned"])
    with pytest.raises(MeshError, match=r"'straight' stands under 'stretched', which is scaled by \[1.0, 2.0, 3.0\]"):
        Bridge.of(scene, ["straight"])
    (whole,) = scene_objects(scene, ["stretched"], density=1.0)
    assert whole.mass == pytest.approx(72.0)  # the upper node can be taken; what leans below is geometry


def test_a_mirrored_node_is_taken_with_its_mirror() -> None:
    scene = trimesh.Scene()
    corner = trimesh.Trimesh(
        [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)], process=False
    )
    scene.add_geometry(corner, geom_name="c", node_name="mirror", transform=np.diag([1, 1, -2, 1.0]))
    bridge = Bridge.of(scene)
    before = world(scene, "mirror")
    assert bridge.objects[0].shape.volume == pytest.approx(1 / 3)
    bridge.update()
    assert np.allclose(world(scene, "mirror"), before, atol=1e-14)
    assert bridge.objects[0].position == pytest.approx((0.25, 0.25, -0.5))


@pytest.mark.parametrize(
    ("nodes", "said"),
    [
        (["none"], "no node 'none'; at hand: 'beside'"),
        (["world"], "'world' is the base frame"),
        (["beside", "beside"], "driven by"),
    ],
)
def test_nodes_that_cannot_be_driven_are_refused(nodes: list[str], said: str) -> None:
    with pytest.raises(MeshError, match=said):
        Bridge.of(nested(), nodes)


def test_a_node_without_triangles_is_refused() -> None:
    scene = nested()
    scene.graph.update("lamp", scene.graph.base_frame, matrix=at(1))
    with pytest.raises(MeshError, match="'lamp' has no triangles at or below it; at hand: 'group', 'beside'"):
        scene_objects(scene, ["lamp"])


def test_geometry_added_and_removed_changes_mass_inertia_and_bounds() -> None:
    scene = nested()
    bridge = Bridge.of(scene, ["beside"], density=2.0)
    (obj,) = bridge.objects
    obj.velocity, obj.angular_velocity = (1, 0, 0), (0, 0, 2)
    assert bridge.refresh() == ()
    mass, moments, reach = obj.mass, obj.inertia, obj.shape.reach
    scene.add_geometry(BOX, geom_name="more", node_name="trailer", parent_node_name="beside", transform=at(1, 0, 0))
    assert bridge.refresh() == (obj,) and bridge.refresh() == ()
    assert obj.mass == pytest.approx(2 * mass)
    assert obj.inertia == pytest.approx(xp.Box((2, 2, 3)).inertia(2 * mass)) and obj.shape.reach == pytest.approx(
        xp.Box((2, 2, 3)).reach
    )
    assert obj.pose == pytest.approx(at(9, 0, 0)), "the node stays"
    assert obj.position == pytest.approx((9.5, 0, 0)) and obj.velocity == pytest.approx((1, 1, 0)), "v + w x d"
    bridge.update()
    assert np.allclose(world(scene, "beside"), at(9, 0, 0), atol=1e-13)
    scene.graph.transforms.remove_node("trailer")
    assert bridge.refresh() == (obj,)
    assert (
        obj.mass == pytest.approx(mass)
        and obj.inertia == pytest.approx(moments)
        and obj.shape.reach == pytest.approx(reach)
    )
    assert obj.velocity == pytest.approx((1, 0, 0))
    scene.geometry["box"].apply_scale(2.0)
    assert bridge.refresh() == (obj,) and obj.mass == pytest.approx(8 * mass)


def test_a_node_scaled_by_the_host_is_refused_by_pull_and_taken_up_by_refresh() -> None:
    scene = nested()
    bridge = Bridge.of(scene, ["beside"])
    (obj,) = bridge.objects
    scene.graph.update("beside", scene.graph.base_frame, matrix=at(9) @ np.diag([2, 2, 2, 1.0]))
    with pytest.raises(MeshError, match="'beside' was scaled from"):
        bridge.pull()
    assert bridge.refresh() == (obj,) and obj.mass == pytest.approx(8.0)
    bridge.update()
    assert np.allclose(world(scene, "beside"), at(9) @ np.diag([2, 2, 2, 1.0]))


def test_looking_through_a_bridge_changes_nothing_and_repeats_to_the_bit() -> None:
    ends = []
    for looks in (0, 50):
        bridge = Bridge.of(nested(), ["lower", "beside"])
        engine = xp.PhysicsEngine()
        engine.add_objects(bridge.objects)
        for obj in bridge.objects:
            obj.velocity, obj.angular_velocity = (1, 0, 0), (0.3, 1, 0.2)
        for k in range(looks):
            engine.run(until=k / 50)
            bridge.update()
        engine.run(until=1.0)
        ends.append([(obj.position, obj.orientation) for obj in bridge.objects])
    assert ends[0] == ends[1]


def test_detached_nodes_stay() -> None:
    scene = nested()
    bridge = Bridge.of(scene, ["beside"])
    (obj,) = bridge.objects
    bridge.detach(obj)
    obj.position = (0, 0, 0)
    assert bridge.update() == 0 and world(scene, "beside")[0, 3] == 9
    with pytest.raises(MeshError, match="drives no node"):
        bridge.node_of(obj)
