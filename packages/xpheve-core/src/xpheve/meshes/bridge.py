"""The engine drives the nodes of an existing `trimesh.Scene`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from xpheve.errors import InvalidValueError, MeshError
from xpheve.kernels.vector import add, cross, sub
from xpheve.meshes.nodes import below, rigid_part, scene_objects, shape_of_node, world_of
from xpheve.objects import PhysicalObject
from xpheve.orientation import RIGID
from xpheve.shapes import Shape
from xpheve.shapes.polyhedron import Array


class _Link:
    """An object, its node, the node's factors, and what was last seen of both."""

    def __init__(self, obj: PhysicalObject, node: str, factors: Array, solid: str) -> None:
        self.obj, self.node, self.factors, self.solid = obj, node, factors, solid
        self.world: Array = np.eye(4)
        self.wanted: Array | None = None
        self.fingerprint: Any = None


class Bridge:
    """Objects and the nodes of a `trimesh.Scene` that show them.

    ``update()`` writes the objects' poses into the nodes, ``pull()`` takes up nodes that the host has moved, and ``refresh()``
    geometry that it has added, changed or removed. Poses are those of the world: an object stays where it is when only a
    node above its own is moved, unless that is pulled.

    Parameters
    ----------
    scene
        A `trimesh.Scene`; its nodes and geometry stay what they are.
    objects
        Objects made by `xpheve.meshes.scene_objects`, each driving the node of its name; others are joined by `attach`.
    """

    def __init__(self, scene: Any, objects: Iterable[PhysicalObject] = ()) -> None:
        self.scene = scene
        self._links: dict[str, _Link] = {}
        for obj in objects:
            self.attach(obj, obj.name)

    @classmethod
    def of(
        cls, scene: Any, nodes: Iterable[str] | None = None, *, density: float | None = None, solid: str = ""
    ) -> Bridge:
        """A bridge with an object for each node; as `scene_objects`."""
        bridge = cls(scene)
        for obj in scene_objects(scene, nodes, density=density, solid=solid):
            bridge.attach(obj, obj.name, solid=solid)
        return bridge

    @property
    def objects(self) -> tuple[PhysicalObject, ...]:
        """All objects here, in the order in which they came."""
        return tuple(link.obj for link in self._links.values())

    def node_of(self, obj: PhysicalObject) -> str:
        """Return the node that ``obj`` drives. Raises `MeshError`."""
        for link in self._links.values():
            if link.obj is obj:
                return link.node
        raise MeshError(f"{obj!r} drives no node of this scene; join them with attach")

    def attach(self, obj: PhysicalObject, node: str, *, solid: str = "") -> None:
        """Let ``obj`` drive ``node`` and all below it; the node is not moved before `update`.

        Raises
        ------
        MeshError
            For a node that does not exist, is the base frame, is driven already, sheared, or stands under unequal scale.
        """
        if node in self._links:
            raise MeshError(f"node {node!r} is driven by {self._links[node].obj!r} already")
        if any(link.obj is obj for link in self._links.values()):
            raise MeshError(f"{obj!r} drives node {self.node_of(obj)!r} already")
        _, factors = rigid_part(self.scene, node)
        if node == self.scene.graph.base_frame:
            raise MeshError(f"node {node!r} is the base frame, which nothing moves; drive a node below it")
        self._check_above(node)
        link = _Link(obj, node, factors, solid)
        link.world = world_of(self.scene, node)
        link.fingerprint = self._fingerprint(node)
        self._links[node] = link

    def detach(self, obj: PhysicalObject) -> None:
        """Let ``obj`` and its node go; the node stays where it is."""
        del self._links[self.node_of(obj)]

    def _check_above(self, node: str) -> None:
        above = self._parent(node)
        while above is not None and above != self.scene.graph.base_frame:
            sizes = np.abs(rigid_part(self.scene, above)[1])
            if np.ptp(sizes) > RIGID * sizes.max():
                raise MeshError(
                    f"node {node!r} stands under {above!r}, which is scaled by {np.round(sizes, 6).tolist()}: turned, it would be "
                    "sheared; apply that scale to the geometry below, or drive the upper node"
                )
            above = self._parent(above)

    def _parent(self, node: str) -> str | None:
        found: str | None = self.scene.graph.transforms.parents.get(node)
        return found

    def _depth(self, node: str) -> int:
        depth, above = 0, self._parent(node)
        while above is not None:
            depth, above = depth + 1, self._parent(above)
        return depth

    def update(self) -> int:
        """Write the present pose of each object into its node, upper nodes first; returns how many nodes were moved."""
        moved = 0
        for link in self._from_above():
            wanted = link.obj.pose
            wanted[:3, :3] *= link.factors
            stands = world_of(self.scene, link.node)
            kept = (
                link.wanted is not None and np.array_equal(wanted, link.wanted) and np.array_equal(stands, link.world)
            )
            if kept or np.array_equal(wanted, stands):
                continue  # rounding of nodes above is not written again
            link.wanted = wanted
            parent = self._parent(link.node)
            over = world_of(self.scene, parent) if parent is not None else np.eye(4)
            local = wanted if np.array_equal(over, np.eye(4)) else np.linalg.solve(over, wanted)
            local[3] = (0.0, 0.0, 0.0, 1.0)
            self.scene.graph.update(frame_to=link.node, frame_from=parent, matrix=local)
            moved += 1
        for link in self._links.values():
            link.world = world_of(self.scene, link.node)
        return moved

    def pull(self) -> tuple[PhysicalObject, ...]:
        """Take up nodes that the host has moved since the last `update`, `pull` or `attach`; returns their objects.

        A node counts as moved when its place in the world changed, whether by itself or by one above it. Velocities stay.

        Raises
        ------
        MeshError
            If a node was sheared or scaled meanwhile; no object has been moved then. See `refresh` for scale.
        """
        found = []
        for link in self._from_above():
            if np.array_equal(world_of(self.scene, link.node), link.world):
                continue
            pose, factors = rigid_part(self.scene, link.node)
            if not np.allclose(factors, link.factors, rtol=RIGID, atol=0.0):
                raise MeshError(
                    f"node {link.node!r} was scaled from {link.factors.tolist()} to {factors.tolist()}: call refresh, "
                    "which makes its shape anew"
                )
            found.append((link, pose))
        for link, pose in found:
            link.obj.pose = pose
            link.world = world_of(self.scene, link.node)
        return tuple(link.obj for link, _ in found)

    def refresh(self) -> tuple[PhysicalObject, ...]:
        """Take up geometry added, changed or removed under the nodes; returns the objects that have a new shape.

        The new shape keeps the old density; the node stays where the object has it, and the new centre of mass moves as that
        point of the old body did. Needs an object whose shape may change.

        Raises
        ------
        MeshError
            If nothing is left under a node; no object has been changed then.
        """
        changed = []
        for link in self._from_above():
            _, factors = rigid_part(self.scene, link.node)
            fingerprint = self._fingerprint(link.node)
            if fingerprint != link.fingerprint or not np.allclose(factors, link.factors, rtol=RIGID, atol=0.0):
                shape = shape_of_node(self.scene, link.node, without=self._links, solid=link.solid)
                changed.append((link, shape, factors, fingerprint))
        for link, shape, factors, fingerprint in changed:
            reshape(link.obj, shape)
            link.factors, link.fingerprint = factors, fingerprint
        return tuple(link.obj for link, *_ in changed)

    def _from_above(self) -> list[_Link]:
        return sorted(self._links.values(), key=lambda link: self._depth(link.node))

    def _fingerprint(self, node: str) -> Any:
        """What the shape under ``node`` follows from: matrices below it, which `update` leaves alone, and contents of geometry."""
        found = []
        for name, _, geometry in below(self.scene, node, set(self._links) - {node}):
            mesh = self.scene.geometry[geometry]
            relative = np.asarray(self.scene.graph.get(name, frame_from=node)[0])
            content = np.asarray(mesh.vertices).tobytes(), np.asarray(mesh.faces).tobytes()
            found.append((name, relative.tobytes(), hash(content)))
        return found


def reshape(obj: PhysicalObject, shape: Shape) -> None:
    """Give ``obj`` another ``shape`` of the same density, its authored frame where it was; it goes on moving as it did."""
    old = obj.shape
    pose, mass, at = obj.pose, obj.mass, obj.position
    v, w = obj.velocity, obj.angular_velocity
    if shape.solid and old is not None and old.solid and old.volume > 0.0:
        mass = mass / old.volume * shape.volume
    elif not obj.fixed and not shape.solid:
        raise InvalidValueError(f"{obj!r}: {shape.why_hollow()}")
    obj.shape = shape
    obj.mass = mass
    obj.inertia = shape.inertia(mass) if shape.solid else (0.0, 0.0, 0.0)
    obj.pose = pose
    if not obj.fixed:
        obj.velocity = add(v, cross(w, sub(obj.position, at)))
