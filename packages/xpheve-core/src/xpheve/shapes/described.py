"""Shapes from their descriptions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from xpheve.errors import InvalidValueError
from xpheve.shapes.base import Shape
from xpheve.shapes.box import Box
from xpheve.shapes.capsule import Capsule
from xpheve.shapes.compound import Compound, Part
from xpheve.shapes.hull import Hull
from xpheve.shapes.mesh import Mesh
from xpheve.shapes.plane import Plane
from xpheve.shapes.sphere import Sphere

CORE: dict[str, type[Shape]] = {
    "sphere": Sphere,
    "box": Box,
    "capsule": Capsule,
    "plane": Plane,
    "compound": Compound,
    "hull": Hull,
    "mesh": Mesh,
}
"""The shapes of core by kind."""


def from_description(described: Mapping[str, Any]) -> Shape:
    """The shape whose ``describe()`` gave ``described``, to the same bits. Raises `InvalidValueError`."""
    given = dict(described)
    kind = given.pop("kind", None)
    if kind not in CORE:
        raise InvalidValueError(f"no shape of core is called {kind!r}; there are {', '.join(CORE)}")
    try:
        if kind == "compound":
            return Compound([_part(part) for part in given["parts"]])
        return CORE[kind](**given)
    except (TypeError, KeyError) as wrong:
        raise InvalidValueError(f"this describes no {kind}: {wrong}") from None


def _part(described: Mapping[str, Any]) -> Part:
    given = dict(described)
    return Part(from_description(given.pop("shape")), **given)
