"""Nodes of a `trimesh.Scene` as shapes and objects."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from xpheve.errors import InvalidValueError, MeshError, MeshWarning
from xpheve.meshes.repair import Repaired, repaired
from xpheve.objects import PhysicalObject
from xpheve.orientation import RIGID, stretch, to_pose
from xpheve.shapes import Compound, Mesh, Part, Shape
from xpheve.shapes.polyhedron import Array, Polyhedron

Piece = tuple[str, Array, str]
"""A node, its matrix (4, 4), and the name of its geometry."""


def scene_objects(
    scene: Any,
    nodes: Iterable[str] | None = None,
    *,
    density: float | None = None,
    fixed: bool = False,
    solid: str = "",
) -> list[PhysicalObject]:
    """An object for each node named, with all geometry at and below it, placed as the node is and called as it.

    Parameters
    ----------
    scene
        A `trimesh.Scene`.
    nodes
        By default those right under the base frame that have geometry. Nodes below one another become objects of their own.
    density
        [kg/m^3]; by default each has the mass 1 kg.
    fixed
        Whether they never move; needed for meshes with holes, unless ``solid`` is ``"hull"`` (see `xpheve.Mesh`).

    Raises
    ------
    MeshError
        For a node that does not exist, has no geometry, or is sheared.
    """
    named = list(top_nodes(scene) if nodes is None else nodes)
    made = []
    for node in named:
        shape = shape_of_node(scene, node, without=named, solid=solid)
        rigid, _ = rigid_part(scene, node)
        try:
            heavy = None if fixed else density
            made.append(PhysicalObject(shape, pose=rigid, density=heavy, fixed=fixed, name=node))
        except InvalidValueError as wrong:
            raise MeshError(f"node {node!r}: {wrong}") from None
    return made


def shape_of_node(scene: Any, node: str, *, without: Iterable[str] = (), solid: str = "") -> Shape:
    """Shape of all geometry at and below ``node``, in the node's frame freed of scale; nodes in ``without`` keep theirs."""
    rigid, _ = rigid_part(scene, node)
    back = np.linalg.inv(rigid)
    found = [(name, back @ matrix, geometry) for name, matrix, geometry in below(scene, node, set(without) - {node})]
    if not found:
        raise MeshError(f"node {node!r} has no triangles at or below it; at hand: {_listed(top_nodes(scene))}")
    return shape_of(scene, found, solid, f"node {node!r}")


def shape_of(scene: Any, pieces: list[Piece], solid: str, what: str) -> Shape:
    """One shape of several nodes' geometry: a mesh of one, a compound of more."""
    sound: dict[str, Repaired] = {}
    for _, _, name in pieces:
        if name not in sound:
            geometry = scene.geometry[name]
            sound[name] = repaired(geometry.vertices, geometry.faces, f"{what}: geometry {name!r}")
            if sound[name].repairs:
                told = (*sound[name].repairs, *sound[name].tidied)
                warnings.warn(MeshWarning(f"{what}: geometry {name!r}", told), stacklevel=3)
    made: dict[tuple[str, bytes], Mesh] = {}
    try:
        if len(pieces) == 1:
            return _mesh(sound[pieces[0][2]], pieces[0][1], solid)
        parts = []
        for _, matrix, name in pieces:
            rigid, linear = split(matrix)
            key = name, linear.tobytes()
            if key not in made:
                made[key] = _mesh(sound[name], linear, solid)
            parts.append(Part(made[key], pose=rigid))
        return Compound(parts)
    except InvalidValueError as wrong:
        raise MeshError(f"{what}: {wrong}") from None


def _mesh(sound: Repaired, matrix: Array, solid: str) -> Mesh:
    """Mesh of vertices moved by an affine ``matrix``; a mirrored one is turned inside out."""
    if np.array_equal(matrix, np.eye(4)):
        return Mesh(sound.vertices, sound.faces, solid)
    v = sound.vertices
    places = np.stack([v[:, 0] * r[0] + v[:, 1] * r[1] + v[:, 2] * r[2] + r[3] for r in matrix[:3]], axis=1)
    mirrored = float(np.linalg.det(matrix[:3, :3])) < 0.0
    return Mesh(places, sound.faces[:, ::-1] if mirrored else sound.faces, solid)


def split(matrix: Array) -> tuple[Array, Array]:
    """Rigid and linear part of an affine matrix, ``matrix = rigid @ linear``; all of a shear is in the second."""
    linear, rigid = np.eye(4), np.eye(4)
    rigid[:3, 3] = matrix[:3, 3]
    factors, rest = _factors(matrix)
    if is_sheared(rest):
        linear[:3, :3] = matrix[:3, :3]
    else:
        linear[(0, 1, 2), (0, 1, 2)] = factors
        rigid[:3, :3] = rest
    return rigid, linear


def rigid_part(scene: Any, node: str) -> tuple[Array, Array]:
    """World pose (4, 4) of ``node`` freed of scale, and its three factors. Raises `MeshError` for shear."""
    matrix = world_of(scene, node)
    try:
        factors, rest = _factors(matrix)
    except InvalidValueError as wrong:
        raise MeshError(f"node {node!r}: {wrong}") from None
    if is_sheared(rest):
        raise MeshError(
            f"node {node!r} is sheared (a turned node under one of unequal scale does that): an object moves, it does not lean; "
            "apply the scale to the geometry, or take a node above it"
        )
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rest, matrix[:3, 3]
    return pose, factors


def _factors(matrix: Array) -> tuple[Array, Array]:
    factors, rest = stretch(matrix)
    near = np.abs(np.abs(factors) - 1.0) <= RIGID  # what float32 leaves of 1
    return np.where(near, np.sign(factors), factors), rest


def is_sheared(rest: Array) -> bool:
    """Whether unit columns are not at right angles."""
    return max(abs(float(rest[:, i] @ rest[:, j])) for i, j in ((0, 1), (0, 2), (1, 2))) > RIGID


def world_of(scene: Any, node: str) -> Array:
    """World matrix (4, 4) of ``node``. Raises `MeshError` if there is none, or it is not finite."""
    if node not in scene.graph.nodes:
        raise MeshError(f"the scene has no node {node!r}; at hand: {_listed(sorted(map(str, scene.graph.nodes)))}")
    try:
        matrix = np.array(scene.graph.get(node)[0], dtype=np.float64)
    except ValueError:
        raise MeshError(f"node {node!r} hangs on nothing: no way leads to it from {scene.graph.base_frame!r}") from None
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
        raise MeshError(f"node {node!r}: its matrix is not finite")
    return matrix


def children_of(scene: Any, node: str) -> list[str]:
    """Nodes right below ``node``, in the order of the graph."""
    return list(scene.graph.transforms.children.get(node, ()))


def below(scene: Any, node: str, without: set[str]) -> Iterator[Piece]:
    """All nodes with triangles at and below ``node``, but not at or below those in ``without``."""
    waiting = [node]
    while waiting:
        name = waiting.pop()
        if name in without:
            continue
        geometry = scene.graph[name][1]
        mesh = scene.geometry.get(geometry) if geometry is not None else None
        if mesh is not None and len(getattr(mesh, "faces", ())):
            yield name, world_of(scene, name), geometry
        waiting.extend(reversed(children_of(scene, name)))


def top_nodes(scene: Any) -> list[str]:
    """The nodes right under the base frame that have triangles at or below them."""
    return [
        node for node in children_of(scene, scene.graph.base_frame) if next(below(scene, node, set()), None) is not None
    ]


def points_of(shape: Shape) -> Array:
    """All vertices of meshes and hulls in ``shape``, in the frame it was authored in, shape (n, 3)."""
    if isinstance(shape, Polyhedron):
        return shape.authored_vertices
    if not isinstance(shape, Compound):
        raise MeshError(f"a {shape.kind} has no vertices")
    found = []
    for part in shape.authored_parts:
        if not isinstance(part.shape, Polyhedron):
            raise MeshError(f"a {part.shape.kind} has no vertices")
        pose = to_pose(part.position, part.orientation)
        found.append(part.shape.vertices @ pose[:3, :3].T + pose[:3, 3])
    return np.concatenate(found)


def _listed(names: list[str]) -> str:
    return (", ".join(map(repr, names[:8])) + (", ..." if len(names) > 8 else "")) or "none"
