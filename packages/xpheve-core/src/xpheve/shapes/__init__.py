"""Shapes as descriptions: parameters, volume, moments of inertia, bounds. Touching is for packs."""

from xpheve.shapes.base import Shape
from xpheve.shapes.box import Box
from xpheve.shapes.capsule import Capsule
from xpheve.shapes.plane import Plane
from xpheve.shapes.sphere import Sphere

__all__ = ["Box", "Capsule", "Plane", "Shape", "Sphere"]
