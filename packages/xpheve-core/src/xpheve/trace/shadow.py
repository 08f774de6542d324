"""What a law's methods are given while they are read: a ``self`` and bodies that record, and refuse what no formula may do."""

from __future__ import annotations

from functools import cached_property
from types import FunctionType, MappingProxyType, MethodType
from typing import Any, NoReturn

import numpy as np

from xpheve.laws import Constant, ContinuousLaw, Param
from xpheve.laws.view import Batch
from xpheve.trace.recording import Recording
from xpheve.trace.values import COLUMN, NUMBER, VECTOR, VECTORS, Form, Traced, turned
from xpheve.units import dimension

PROPERTIES: dict[str, tuple[Form, str]] = {
    "position": (VECTORS, "m"),
    "velocity": (VECTORS, "m/s"),
    "angular_velocity": (VECTORS, "rad/s"),
    "orientation": (Form(True, 4), "1"),
    "mass": (COLUMN, "kg"),
    "inertia": (VECTORS, "kg*m^2"),
    "volume": (COLUMN, "m^3"),
    "since": (COLUMN, "s"),
    "time": (NUMBER, "s"),
    "up": (VECTOR, "1"),
}
"""What every object has, and what the scene has; all else are columns."""

SCENE = frozenset({"time", "up"})
"""Of the scene: the same on both sides of a pair."""

NOT_HERE = {
    "random": "draws random numbers: how often a formula is called is the stepper's affair. Draw them in a free-form law, which sets a "
    "column or a parameter",
    "state": "keeps a state between calls: how often a formula is called is the stepper's affair. Count in a free-form law",
    "engine": "asks the engine: a formula reads its objects, parameters, columns, body.time and body.up",
    "objects": "asks for its objects: a formula is said of each; what differs from object to object is a column",
    "between": "asks for its objects: a formula is said of each pair; what differs from object to object is a column",
    "containers": "asks for its containers: a formula reads its objects, parameters and columns",
    "evaluations": "counts its calls: how often a formula is called is the stepper's affair",
    "enabled": "asks whether it is enabled: a law that is not is not called",
    "name": "asks for its name: what chooses a formula is a Param with choices=(...)",
    "__dict__": "looks into itself: a formula reads parameters and constants by their names",
}
"""Attributes of laws that are no part of a formula."""


class TracedBody:
    """The objects as a law sees them while it is read; of a pair, those on one ``side``."""

    _recording: Recording

    def __init__(self, recording: Recording, columns: dict[str, Any], side: str) -> None:
        object.__setattr__(self, "_recording", recording)
        object.__setattr__(self, "_columns", columns)
        object.__setattr__(self, "_side", side)
        object.__setattr__(self, "_held", {})

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        if name == "count":
            self._recording.refuse(
                "body.count, the size of the batch, changes as objects come and go: a formula is said of each object, whatever their number"
            )
        held = self._held
        if name not in held:
            held[name] = self._fetched(name)
        return held[name]

    def _fetched(self, name: str) -> Traced:
        form, unit = PROPERTIES.get(name, (COLUMN, None))
        if unit is None and name in self._columns:
            unit = self._columns[name].unit
        dim = None if unit is None else dimension(unit)
        side = "" if name in SCENE else self._side
        nodes = [self._recording.graph.input(name, k, dim, side) for k in range(form.width or 1)]
        return Traced(self._recording, nodes, form, locked=f"{self._side or 'body'}.{name}")

    def to_world(self, vector: Any) -> Traced:
        """``vector`` of the body frame in the world frame."""
        return turned(self._recording, vector, self.orientation, 1.0)

    def to_body(self, vector: Any) -> Traced:
        """``vector`` of the world frame in the body frame."""
        return turned(self._recording, vector, self.orientation, -1.0)

    def __setattr__(self, name: str, value: Any) -> NoReturn:
        self._recording.refuse(
            f"sets {self._side or 'body'}.{name}, which is read-only in a formula: return the force, or write a free-form law"
        )

    def __iter__(self) -> NoReturn:
        self._recording.refuse(
            f"goes over the objects of {self._side or 'body'}, which stands for all of them at once: a formula is said of each, so leave the loop out"
        )

    def __repr__(self) -> str:
        return f"<traced {self._side or 'body'}>"


class ShadowType(type):
    """Class of a shadow: ``type(self)`` and ``cls`` of class methods; gives what the law's class has, under the same rules."""

    def __getattr__(cls, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return _of_class(cls, cls, name)


class Shadow(metaclass=ShadowType):
    """``self`` of a law that is being read: parameters are traced, methods and properties run on the shadow, all else is refused."""

    _law: ContinuousLaw
    _recording: Recording

    def __getattribute__(self, name: str) -> Any:
        kind = type(self)
        law, recording = kind._law, kind._recording
        if name == "__class__":
            return type(law)  # so that super() works
        if name in NOT_HERE:
            recording.refuse(f"self.{name}: the formula {NOT_HERE[name]}")
        if name.startswith("__"):
            return object.__getattribute__(self, name)
        if name == "parameters":
            return MappingProxyType({key: _parameter(recording, law, key) for key in law.params})
        if name in law.__dict__ and not isinstance(_static(law, name, None), (Param, Constant)):
            recording.refuse(_undeclared(name, law.__dict__[name], "was set on the law by hand"))
        return _of_class(kind, self, name)

    def __setattr__(self, name: str, value: Any) -> NoReturn:
        type(self)._recording.refuse(
            f"sets self.{name}: a formula has no memory, as how often it is called is the stepper's affair. Keep it in a local name; what "
            "changes in the course of a run is a column, a parameter, or the state of a free-form law"
        )

    __delattr__ = __setattr__  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<traced {type(self)._law.label()}>"


def shadow_of(law: ContinuousLaw, recording: Recording) -> Any:
    """A ``self`` for the methods of ``law``, which write into ``recording``."""
    kind = ShadowType("Shadow", (Shadow,), {"_law": law, "_recording": recording})
    made: Any = object.__new__
    return made(kind)


def _static(law: ContinuousLaw, name: str, *default: Any) -> Any:
    """What the law's class, or the nearest parent that has it, says ``name`` is, unbound; else ``default``, or `AttributeError`."""
    for base in type(law).__mro__:
        if name in base.__dict__:
            return base.__dict__[name]
    if default:
        return default[0]
    raise AttributeError(f"{type(law).__name__!r} object has no attribute {name!r}", name=name)


def _of_class(kind: Any, owner: Any, name: str) -> Any:
    """``name`` of the law's class, bound to ``owner``: the shadow, or its class."""
    law, recording = kind._law, kind._recording
    found = _static(law, name)
    if isinstance(found, Param):
        return found if owner is kind else _parameter(recording, law, found.name)
    if isinstance(found, Constant):
        return _constant(recording, found)
    if isinstance(found, staticmethod):
        return found.__func__
    if isinstance(found, classmethod):
        return MethodType(found.__func__, kind)
    if _has_numbers(found):
        recording.refuse(_undeclared(name, found, "is a plain number of the class"))
    if owner is kind:
        return found
    if isinstance(found, FunctionType):
        return MethodType(found, owner)
    if isinstance(found, property):
        return found.__get__(owner)
    if isinstance(found, cached_property):
        return found.func(owner)
    return found.__get__(owner, kind) if hasattr(type(found), "__get__") else found


def _undeclared(name: str, value: Any, why: str) -> str:
    shown = " ".join(repr(value).split())[:40]
    if not _has_numbers(value):
        return f"self.{name} {why}: {shown}. A change of it would go unnoticed: declare it as a Param (text with choices=(...), a switch, a number)"
    return (
        f"self.{name} {why}, {shown}: it has no unit, and a change of it would go unnoticed. Declare it in the class: "
        f"{name} = Param({shown}, unit=...), or Constant({shown}, unit=...) if it never changes"
    )


def _has_numbers(value: Any) -> bool:
    if isinstance(value, (bool, int, float, complex, np.generic, np.ndarray)):
        return True
    if isinstance(value, dict):
        return any(_has_numbers(one) for one in value.values())
    return isinstance(value, (tuple, list, set, frozenset)) and any(_has_numbers(one) for one in value)


def _parameter(recording: Recording, law: ContinuousLaw, name: str) -> Any:
    """Parameter ``name``: traced if it is a number or a vector; text, switches and None choose the formula, and stay as they are."""
    value = law.parameters[name]
    if value is None or isinstance(value, (str, bool)):
        return value
    dim = dimension(law.params[name].unit)
    if isinstance(value, tuple):
        nodes = [recording.graph.param(name, k, dim) for k in range(len(value))]
        return Traced(recording, nodes, Form(False, len(value)), locked=f"self.{name}")
    return Traced(recording, [recording.graph.param(name, 0, dim)], NUMBER, locked=f"self.{name}")


def _constant(recording: Recording, constant: Constant) -> Traced:
    dim = dimension(constant.unit)
    if isinstance(constant.value, tuple):
        nodes = [recording.graph.const(one, dim) for one in constant.value]
        return Traced(recording, nodes, Form(False, len(nodes)), locked=f"self.{constant.name}")
    return Traced(recording, [recording.graph.const(constant.value, dim)], NUMBER, locked=f"self.{constant.name}")


def as_arrays(law: ContinuousLaw) -> Any:
    """``law`` for a call of its methods with NumPy views: vectors among its parameters are `Batch` es (3,), as ``body.up`` is.

    So ``self.wind.norm()`` and ``2.0 * self.wind`` mean in NumPy what they mean when the law is traced. The parameters are those of now; a law
    without vectors is returned as it is.
    """
    vectors = {name: value for name, value in law.parameters.items() if isinstance(value, tuple)}
    if not vectors:
        return law
    twin = object.__new__(type(law))
    twin.__dict__.update(law.__dict__)
    arrays = {name: np.array(value).view(Batch) for name, value in vectors.items()}
    for array in arrays.values():
        array.flags.writeable = False
    twin.__dict__["parameters"] = law.parameters | arrays
    return twin
