"""Conditions, observers and probes in scene files, both ways.

What a condition names is written by name: objects and laws as elsewhere in a file, probes by theirs. A region is its shape with a pose. The members
of a combination are tables under ``of``. A function cannot be written, but the text of an expression can.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import Any

from xpheve.errors import SceneError
from xpheve.laws import PhysicalLaw
from xpheve.laws import conditions as when
from xpheve.laws.combinations import _Combination
from xpheve.laws.conditions.text import TextExpression
from xpheve.objects import PhysicalObject
from xpheve.observers import Observer, Probe
from xpheve.regions import Region
from xpheve.shapes import Box, Plane, Shape, Sphere

Plain = dict[str, Any]
CONDITIONS: dict[str, type[when.Condition]] = {
    name: getattr(when, name) for name in when.__all__ if name != "Condition"
}
REGIONS: dict[str, type[Shape]] = {"sphere": Sphere, "box": Box, "plane": Plane}
KEYS = {"kind": "input"}
"""Fields that a file calls otherwise: ``kind`` is the condition's own."""


def required(kind: type[when.Condition]) -> list[str]:
    """The keys that cannot be left out."""
    from dataclasses import MISSING

    return [one.name for one in fields(kind) if one.init and one.default is MISSING and one.default_factory is MISSING]


def write_condition(condition: Any, label: str, called: Callable[[Any], str]) -> Plain:
    """The table of ``condition``; ``called`` is the name by which a file knows an object, probe or law. Raises `SceneError`."""
    kind = type(condition)
    if CONDITIONS.get(kind.__name__) is not kind:
        raise SceneError(f"{label}: its condition {condition} is none of xpheve.when, so a scene file cannot say it")
    table: Plain = {"kind": kind.__name__}
    for field in fields(condition):
        value = getattr(condition, field.name)
        if not field.init or (value == field.default and type(value) is type(field.default)):
            continue
        if isinstance(condition, _Combination) and field.name == "of":
            table["of"] = [write_condition(one, label, called) for one in value]
        elif isinstance(value, Region):
            table["region"] = _write_region(value)
        elif isinstance(value, (PhysicalObject, Probe, PhysicalLaw)):
            table[field.name] = called(value)
        elif isinstance(value, TextExpression):
            table[field.name] = value.text
        elif callable(value):
            raise SceneError(
                f"{label}: its condition {condition} holds a Python function, which a scene file cannot say: give its text, "
                'Crosses("body.position.z - 2.0"), or add this container by a script'
            )
        elif field.name == "match" and isinstance(value, tuple):
            table["match"] = dict(value)
        elif isinstance(value, (bool, int, float, str)):
            table[KEYS.get(field.name, field.name)] = float(value) if str(field.type) == "float" else value
        else:
            raise SceneError(
                f"{label}: {field.name} = {value!r} of its condition: a scene file has numbers and texts only"
            )
    return table


def _write_region(region: Region) -> Plain:
    table: Plain = {"shape": region.shape.kind}
    table |= {key: value for key, value in region.shape.describe().items() if key != "kind"}
    table["position"] = list(region.position)
    if region.orientation != (1.0, 0.0, 0.0, 0.0):
        table["orientation"] = list(region.orientation)
    return table


def read_region(table: Any) -> Region:
    """The region of a table, to the bit. Raises ValueError or an `XpheveError`."""
    if not isinstance(table, dict) or str(table.get("shape")) not in REGIONS:
        raise ValueError('a table is needed, such as { shape = "sphere", radius = 1.0, position = [0.0, 0.0, 0.0] }')
    given = {key: value for key, value in table.items() if key not in ("shape", "position", "orientation")}
    try:
        shape = REGIONS[table["shape"]](**given)
    except TypeError as wrong:
        raise ValueError(f"a {table['shape']} has no such key: {wrong}") from None
    region = Region(shape, table.get("position", (0.0, 0.0, 0.0)), table.get("orientation", (1.0, 0.0, 0.0, 0.0)))
    # A unit vector made unit again may be another in its last bit.
    if "orientation" in table and _is_unit(table["orientation"]):
        object.__setattr__(region, "orientation", tuple(float(x) for x in table["orientation"]))
    if isinstance(shape, Plane) and _is_unit(table["normal"]):
        object.__setattr__(shape, "normal", tuple(float(x) for x in table["normal"]))  # to the bit
    return region


def _is_unit(vector: Any) -> bool:
    return abs(sum(float(x) * float(x) for x in vector) - 1.0) <= 1e-14


def write_point(point: Probe, called: Callable[[Any], str]) -> Plain:
    """The table of an observer or probe."""
    table: Plain = {"name": point.name}
    if point.attached is not None:
        table["attached"] = called(point.attached)
    else:
        table["position"] = list(point.position)
    if isinstance(point, Observer):
        table["radius"] = point.radius
    return table


def make_point(kind: type[Probe], table: Any, attached: PhysicalObject | None) -> Probe:
    """The observer or probe of a table."""
    given: Plain = {"attached": attached} if attached is not None else {"position": table.position}
    if kind is Observer:
        return Observer(table.name, radius=table.radius, **given)
    return Probe(table.name, **given)


__all__ = ["CONDITIONS", "KEYS", "make_point", "read_region", "required", "write_condition", "write_point"]
