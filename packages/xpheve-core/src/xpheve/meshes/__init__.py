"""Meshes from files and scene graphs, and the one door to trimesh, which is imported when something here is called.

`load` makes a shape of a file, `load_objects` objects; `scene_objects` and `Bridge` join a `trimesh.Scene` to an engine.
"""

from xpheve.errors import MeshError, MeshWarning
from xpheve.meshes.bridge import Bridge
from xpheve.meshes.files import load, load_objects, load_scene
from xpheve.meshes.nodes import points_of, scene_objects, shape_of_node
from xpheve.meshes.repair import repaired

__all__ = [
    "Bridge",
    "MeshError",
    "MeshWarning",
    "load",
    "load_objects",
    "load_scene",
    "points_of",
    "repaired",
    "scene_objects",
    "shape_of_node",
]
