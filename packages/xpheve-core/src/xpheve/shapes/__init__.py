"""Shapes as descriptions: parameters, volume, moments of inertia, bounds. Touching is for packs."""

from xpheve.shapes.base import Shape
from xpheve.shapes.box import Box
from xpheve.shapes.capsule import Capsule
from xpheve.shapes.compound import Compound, Part
from xpheve.shapes.described import CORE, from_description
from xpheve.shapes.hull import Hull
from xpheve.shapes.mesh import Mesh
from xpheve.shapes.plane import Plane
from xpheve.shapes.sphere import Sphere

__all__ = [
    "CORE",
    "Box",
    "Capsule",
    "Compound",
    "Hull",
    "Mesh",
    "Part",
    "Plane",
    "Shape",
    "Sphere",
    "from_description",
]
