"""xPheve: an extensible physics engine. Names are loaded when they are touched."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from xpheve import errors, orientation
    from xpheve.engine import PhysicsEngine
    from xpheve.forces import Force
    from xpheve.laws import (
        Column,
        Constant,
        Contact,
        Event,
        FieldLaw,
        FlowLaw,
        Grip,
        Impulse,
        LawContainer,
        PairLaw,
        Param,
        PhysicalLaw,
        ResponseLaw,
        Velocities,
    )
    from xpheve.laws import conditions as when
    from xpheve.objects import PhysicalObject
    from xpheve.observers import Observer, Probe
    from xpheve.plugins import hookimpl
    from xpheve.record import Record
    from xpheve.regions import Region
    from xpheve.shapes import Box, Capsule, Compound, Hull, Mesh, Part, Plane, Shape, Sphere
    from xpheve.trace.functions import vector, where
    from xpheve.trace.table import Table

_HOMES = {
    "PhysicsEngine": "engine",
    "Force": "forces",
    "PhysicalObject": "objects",
    "Observer": "observers",
    "Probe": "observers",
    "Record": "record",
    "Region": "regions",
    "Table": "trace.table",
    "hookimpl": "plugins",
    "vector": "trace.functions",
    "where": "trace.functions",
    **dict.fromkeys(("Box", "Capsule", "Compound", "Hull", "Mesh", "Part", "Plane", "Shape", "Sphere"), "shapes"),
    **dict.fromkeys(
        (
            "Column",
            "Constant",
            "Contact",
            "Event",
            "FieldLaw",
            "FlowLaw",
            "Grip",
            "Impulse",
            "LawContainer",
            "PairLaw",
            "Param",
            "PhysicalLaw",
            "ResponseLaw",
            "Velocities",
        ),
        "laws",
    ),
}
_MODULES = {"errors": "errors", "meshes": "meshes", "orientation": "orientation", "when": "laws.conditions"}

__all__ = [
    "Box",
    "Capsule",
    "Column",
    "Compound",
    "Constant",
    "Contact",
    "Event",
    "FieldLaw",
    "FlowLaw",
    "Force",
    "Grip",
    "Hull",
    "Impulse",
    "LawContainer",
    "Mesh",
    "Observer",
    "PairLaw",
    "Param",
    "Part",
    "PhysicalLaw",
    "PhysicalObject",
    "PhysicsEngine",
    "Plane",
    "Probe",
    "Record",
    "Region",
    "ResponseLaw",
    "Shape",
    "Sphere",
    "Table",
    "Velocities",
    "errors",
    "hookimpl",
    "orientation",
    "vector",
    "when",
    "where",
]


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name in _MODULES:
        found: Any = import_module(f"xpheve.{_MODULES[name]}")
    elif name in _HOMES:
        found = getattr(import_module(f"xpheve.{_HOMES[name]}"), name)
    else:
        raise AttributeError(f"module 'xpheve' has no attribute {name!r}")
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
