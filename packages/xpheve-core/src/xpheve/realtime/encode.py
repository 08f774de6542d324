"""Arguments of doors as JSON values and back: objects and laws by serial number, new ones by their description."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import Any

import numpy as np

from xpheve.errors import InvalidValueError, OwnershipError, RecordError, UnknownLawError, XpheveError
from xpheve.forces import Force
from xpheve.laws import LawContainer, PhysicalLaw
from xpheve.laws import conditions as when
from xpheve.laws.conditions.text import TextExpression
from xpheve.objects import FIELDS, PhysicalObject
from xpheve.observers import Observer, Probe
from xpheve.regions import Region
from xpheve.shapes.base import Shape

CONDITIONS: dict[str, Any] = {
    name: kind
    for name in when.__all__
    if isinstance(kind := getattr(when, name), type) and issubclass(kind, when.Condition)
}
"""Those that files may name."""
KINDS = frozenset(
    (
        *("tuple", "dict", "force", "object", "new object", "law", "new law", "container", "new container"),
        *("point", "new point", "shape", "region", "condition", "class"),
    )
)
"""The things that stand in a dict of one key."""


def plain(value: Any, what: str) -> Any:
    """``value``, copied, if a file can hold it: numbers, text, None, and tuples, lists and dicts of them.

    Raises
    ------
    InvalidValueError
        If it is something else.
    """
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, (tuple, list)):
        return type(value)([plain(one, what) for one in value])
    if isinstance(value, dict) and all(isinstance(key, str) for key in value):
        return {key: plain(one, what) for key, one in value.items()}
    if isinstance(value, np.generic):
        return value.item()
    raise InvalidValueError(
        f"{what} = {value!r}: plain values only (numbers, text, tuples, lists, dicts), so that it can be replayed"
    )


def encode(engine: Any, value: Any) -> Any:
    """``value`` as a JSON value; tuples and things are marked by a dict of one key."""
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, list):
        return [encode(engine, one) for one in value]
    if isinstance(value, tuple):
        return {"tuple": [encode(engine, one) for one in value]}
    if isinstance(value, dict):
        return {"dict": [[encode(engine, key), encode(engine, one)] for key, one in value.items()]}
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Force):
        return {"force": [list(value.vector), value.duration, value.id, list(value.torque)]}
    if isinstance(value, PhysicalObject):
        return {"object": value.serial} if value._engine is engine else {"new object": _object(engine, value)}
    if isinstance(value, PhysicalLaw):
        serial = engine._world.laws.get(value)
        return {"new law": _law(engine, value)} if serial is None else {"law": serial}
    if isinstance(value, LawContainer):
        if value.engine is engine:
            return {"container": engine._world.containers.index(value)}
        return {
            "new container": [
                value.label(),
                value.name,
                encode(engine, value.condition),
                [encode(engine, law) for law in value.laws],
            ]
        }
    if isinstance(value, Probe):
        if value.engine is engine:
            return {"point": value.name}
        attached = None if value.attached is None else encode(engine, value.attached)
        return {"new point": [value.kind, value.name, list(value.position), value.radius, attached]}
    if isinstance(value, Shape):
        return {"shape": value.describe()}
    if isinstance(value, Region):
        return {"region": [value.shape.describe(), list(value.position), list(value.orientation)]}
    if isinstance(value, TextExpression):
        return value.text
    if isinstance(value, when.Condition):
        return {"condition": _condition(engine, value)}
    if isinstance(value, type) and issubclass(value, (PhysicalLaw, LawContainer)):
        return {"class": value.label()}
    if isinstance(value, Iterable):
        return [encode(engine, one) for one in value]
    raise InvalidValueError(f"{value!r}: it cannot be written down, so it could not be replayed; give plain values")


def _condition(engine: Any, condition: when.Condition) -> list[Any]:
    kind = type(condition)
    if CONDITIONS.get(kind.__name__) is not kind:
        raise InvalidValueError(
            f"{condition!r}: a condition of no pack cannot be written down, so it could not be replayed"
        )
    fields = {
        one.name: encode(engine, getattr(condition, one.name)) for one in dataclasses.fields(condition) if one.init
    }
    return [kind.__name__, fields]


def _object(engine: Any, obj: PhysicalObject) -> dict[str, Any]:
    if obj._engine is not None:
        raise OwnershipError(f"{obj!r} is in another engine")
    return {
        "name": obj.name,
        "class": "" if type(obj) is PhysicalObject else type(obj).__qualname__,
        "attributes": _attributes(obj),
        "shape": None if obj.shape is None else obj.shape.describe(),
        "fixed": obj.fixed,
        "density": obj._density,
        "state": {name: encode(engine, obj._own[name]) for name in FIELDS},
        "columns": obj.columns,
    }


def _attributes(obj: PhysicalObject) -> dict[str, Any]:
    """Plain ones of a subclass; a host's pictures and callbacks are none of the scene's."""
    found = {}
    for name, value in getattr(obj, "__dict__", {}).items():
        try:
            found[name] = encode(None, plain(value, name))
        except InvalidValueError:
            continue
    return found


def _law(engine: Any, law: PhysicalLaw) -> dict[str, Any]:
    between = getattr(law, "between", None)
    pairs = getattr(law, "pairs", None)
    return {
        "id": law.label(),
        "name": law.name,
        "enabled": law.enabled,
        "parameters": encode(engine, dict(law.parameters)),
        "state": encode(engine, dict(law.state)),
        "between": None if between is None else [[encode(engine, obj) for obj in side] for side in between],
        "pairs": None if pairs is None else [[encode(engine, obj) for obj in pair] for pair in pairs],
    }


class Decoder:
    """Back, in ``engine``; ``classes`` are the law and container classes that no pack offers."""

    def __init__(self, engine: Any, classes: Iterable[Any] = ()) -> None:
        self.engine = engine
        world = engine._world
        here = [*(type(law) for law in world.laws), *(type(container) for container in world.containers)]
        given = list(classes)
        self.objects: dict[str, type[PhysicalObject]] = {"": PhysicalObject} | {
            kind.__qualname__: kind for kind in given if issubclass(kind, PhysicalObject)
        }
        laws = [kind for kind in given if not issubclass(kind, PhysicalObject)]
        self.classes = {kind.label(): kind for kind in (*here, LawContainer, *laws)}

    def __call__(self, value: Any) -> Any:
        """What ``value`` stands for. Raises `RecordError` or `UnknownLawError`."""
        if isinstance(value, list):
            return [self(one) for one in value]
        if not isinstance(value, dict):
            return value
        try:
            ((kind, given),) = value.items()
            if kind not in KINDS:
                raise LookupError(kind)
            return getattr(self, "_" + kind.replace(" ", "_"))(given)
        except XpheveError:
            raise
        except (TypeError, ValueError, LookupError, AttributeError, RecursionError) as wrong:
            shown = repr(value)[:200]
            raise RecordError(f"the inputs hold {shown}, which this xpheve does not know ({wrong})") from None

    def _tuple(self, given: Any) -> Any:
        return tuple(self(one) for one in given)

    def _dict(self, given: Any) -> Any:
        return {self(key): self(one) for key, one in given}

    def _force(self, given: Any) -> Force:
        vector, duration, ident, torque = given
        return Force(vector, duration, ident, torque=torque)

    def _object(self, serial: int) -> PhysicalObject:
        for obj in self.engine._world.bodies.objects:
            if obj.serial == serial:
                found: PhysicalObject = obj
                return found
        raise RecordError(
            f"the inputs name object #{serial}, which is not here: replay them on a copy of the scene they began with"
        )

    def _law(self, serial: int) -> PhysicalLaw:
        for law, number in self.engine._world.laws.items():
            if number == serial:
                found: PhysicalLaw = law
                return found
        raise RecordError(
            f"the inputs name law {serial}, which is not here: replay them on a copy of the scene they began with"
        )

    def _container(self, number: int) -> LawContainer:
        try:
            found: LawContainer = self.engine._world.containers[number]
        except IndexError:
            raise RecordError(f"the inputs name container {number}, which is not here") from None
        return found

    def _region(self, given: Any) -> Region:
        shape, position, orientation = given
        return Region(self._shape(shape), position, orientation)

    def _condition(self, given: Any) -> when.Condition:
        name, fields = given
        named = {key: self(value) for key, value in fields.items()}
        members = named.pop("of", ())
        found: when.Condition = CONDITIONS[name](*members, **named)
        return found

    def _class(self, label: str) -> Any:
        if label in self.classes:
            return self.classes[label]
        if ":" not in label:
            raise UnknownLawError(f"the inputs need the class {label}, of no pack: replay(..., classes=[{label}])")
        registry = self.engine.registry
        try:
            found: Any = registry.law(label)
        except UnknownLawError:
            found = registry.container(label)
        return found

    def _point(self, name: str) -> Probe:
        found: Probe | None = self.engine._world.wakeups.points.get(name)
        if found is None:
            raise RecordError(f"the inputs name the observer or probe {name!r}, which is not here")
        return found

    def _new_point(self, given: Any) -> Probe:
        kind, name, position, radius, attached = given
        place: dict[str, Any] = {"position": position} if attached is None else {"attached": self(attached)}
        return Observer(name, radius=radius, **place) if kind == "observer" else Probe(name, **place)

    def _shape(self, given: Any) -> Any:
        from xpheve.shapes.described import from_description

        return None if given is None else from_description(given)

    def _new_object(self, given: Any) -> PhysicalObject:
        from xpheve.plan.saved import _revive_object

        arrays = {
            f"bodies.{name}": np.array(self(value), dtype=float).reshape(-1, 1)
            for name, value in given["state"].items()
        }
        fixed = {"row.fixed": np.array([given["fixed"]])}
        label = given.get("class", "")
        if label not in self.objects:
            raise RecordError(f"the inputs add an object of class {label}: replay(..., classes=({label},))")
        shape = self._shape(given["shape"])
        entry = given | {"shape": None if shape is None else 0}
        obj = _revive_object(entry, [shape], arrays | fixed, 0, lambda entry: self.objects[label])
        for name, value in given.get("attributes", {}).items():
            obj.__dict__[name] = self(value)
        obj._density = given["density"]
        return obj

    def _new_law(self, given: Any) -> PhysicalLaw:
        which = {key: self(given[key]) for key in ("between", "pairs") if given.get(key) is not None}
        kind = self._class(given["id"])
        law: PhysicalLaw = kind(name=given["name"], enabled=given["enabled"], **self(given["parameters"]), **which)
        law.state = self(given["state"])
        return law

    def _new_container(self, given: Any) -> LawContainer:
        label, name, condition, laws = given
        container: LawContainer = self._class(label)(self(condition), name=name)
        for law in laws:
            container.add_law(self(law))
        return container


__all__ = ["Decoder", "encode", "plain"]
