"""What ``respond`` is given while it is read: a contact, two objects and a ``self`` whose numbers record what is done with them.

Vectors are tuples of three numbers, as objects and contacts have them in Python, so that ``+`` and ``[k]`` mean here what they mean there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from types import FunctionType, MappingProxyType, MethodType
from typing import Any, NoReturn

from xpheve.kernels.vector import add, cross, dot, scale, sub
from xpheve.laws import Contact, ResponseLaw
from xpheve.trace.plain_python import Doors, shadows_are
from xpheve.trace.response_recording import ResponseRecording
from xpheve.trace.shadow import NOT_HERE, Shadow, ShadowType
from xpheve.trace.values import NUMBER, Traced, chosen
from xpheve.units import dimension

OF_BODY: dict[str, tuple[int, str]] = {
    "position": (3, "m"),
    "velocity": (3, "m/s"),
    "angular_velocity": (3, "rad/s"),
    "orientation": (4, "1"),
    "mass": (0, "kg"),
    "inertia": (3, "kg*m^2"),
}
"""What an object has: how many components, 0 for a number, and the unit."""

OF_CONTACT: dict[str, tuple[int, str]] = {
    "normal": (3, "1"),
    "point": (3, "m"),
    "approach_speed": (0, "m/s"),
    "separation": (0, "m"),
    "instant": (2, "s"),
}

AFTERWARDS = frozenset({"impulse", "impulse_vector"})
"""What a contact has for those who are told of an impact after it."""

OUT_OF_REACH = {
    "random": "draws random numbers, which come from the scene's seed",
    "state": "keeps a state between calls",
    "engine": "asks the engine",
    "objects": "asks for its objects",
    "containers": "asks for its containers",
    "evaluations": "counts its calls",
    "name": "asks for its name",
    "enabled": "asks whether it is enabled",
    "parameters": "reads self.parameters: a parameter is read by its name",
    "__dict__": "looks into itself",
}


class TracedObject:
    """``contact.body_a`` or ``body_b`` while a response is read."""

    def __init__(self, recording: ResponseRecording, law: ResponseLaw, side: str, columns: Iterable[str]) -> None:
        object.__setattr__(self, "_here", (recording, law, side, frozenset(columns)))

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        recording, _, side, columns = self._here
        if name in OF_BODY:
            found = _read(recording, name, side, *OF_BODY[name])
            if name == "mass":
                recording.check(found.nodes[0])  # what never moves may come with none
            return found
        if name == "fixed":
            return _read(recording, "inverse_mass", side, 0, "1/kg") == 0.0
        if name == "driven":
            return False  # what the host drives is answered in Python
        if name == "shape":
            return TracedShape(recording, side)
        if name in columns:
            return self[name]
        recording.refuse(
            f"reads body_{side}.{name}, which compiled code does not have; it has {', '.join(OF_BODY)}, fixed, shape.radius and the columns "
            f"that laws declare{': ' + ', '.join(sorted(columns)) if columns else ''}"
        )

    def __getitem__(self, name: Any) -> Traced:
        recording, law, side, columns = self._here
        if name not in columns:
            recording.refuse(f"reads body_{side}[{name!r}], a column that no law here declares")
        unit = law.columns[name].unit if name in law.columns else None
        dim = None if unit is None else dimension(unit)
        return Traced(recording, [recording.graph.input(name, 0, dim, f"{side}[]")], NUMBER)

    def _refuse(self, *_: Any) -> NoReturn:
        recording: ResponseRecording
        recording, _law, side, _columns = self._here
        recording.refuse(f"changes, calls or compares body_{side}: a response reads, and returns what happens")

    __setattr__ = __setitem__ = __eq__ = __ne__ = __bool__ = __call__ = _refuse
    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<traced body_{self._here[2]}>"


class TracedShape:
    """``shape`` of an object: of spheres the radius is known."""

    def __init__(self, recording: ResponseRecording, side: str) -> None:
        object.__setattr__(self, "_here", (recording, side))

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        recording, side = self._here
        if name == "radius":
            found = _read(recording, "radius", side, 0, "m")
            if found != found:
                recording.refuse(f"reads body_{side}.shape.radius of what is no sphere")
            return found
        recording.refuse(f"reads body_{side}.shape.{name}: of shapes compiled code knows the radius of spheres only")

    def _refuse(self, *_: Any) -> NoReturn:
        recording: ResponseRecording
        recording, side = self._here
        recording.refuse(f"changes or compares body_{side}.shape")

    __setattr__ = __eq__ = __ne__ = __bool__ = _refuse
    __hash__ = None  # type: ignore[assignment]


class TracedContact:
    """The contact while a response is read; its own properties and methods are those of `xpheve.laws.Contact`."""

    def __init__(self, recording: ResponseRecording, law: ResponseLaw, columns: Iterable[str], doors: Doors) -> None:
        sides = {f"body_{side}": TracedObject(recording, law, side, columns) for side in "ab"}
        object.__setattr__(self, "_here", (recording, sides, doors))

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        recording, sides, doors = self._here
        if name in sides:
            return sides[name]
        known = getattr(Contact, name, None)
        if name in OF_CONTACT and known is not None:
            return _read(recording, name, "", *OF_CONTACT[name])
        if name in AFTERWARDS and known is not None:
            return math.nan if name == "impulse" else (math.nan, math.nan, math.nan)
        if name == "relative_velocity" and known is not None:
            return self._relative_velocity()
        if isinstance(known, property) and isinstance(known.fget, FunctionType):
            return doors.joining(known.fget)(self)
        if isinstance(known, FunctionType):
            return MethodType(doors.joining(known), self)
        recording.refuse(
            f"reads contact.{name}, which compiled code does not have; it has body_a, body_b, {', '.join(OF_CONTACT)}"
        )

    def _relative_velocity(self) -> Any:
        """As the contact server has it: the arm of a ball is along the normal, to the bit."""
        speeds = []
        for obj in (self.body_a, self.body_b):
            recording, law, side, _ = obj._here
            if not law.lever_arms:
                speeds.append(obj.velocity)
                continue
            radius, arm = _read(recording, "radius", side, 0, "m"), sub(self.point, obj.position)
            along = scale(self.normal, dot(self.normal, arm))
            arm = _chosen(recording, radius == radius, along, arm)
            speeds.append(add(obj.velocity, cross(obj.angular_velocity, arm)))
        return sub(speeds[1], speeds[0])

    def _refuse(self, *_: Any) -> NoReturn:
        recording: ResponseRecording = self._here[0]
        recording.refuse("changes or compares the contact: a response reads, and returns what happens")

    __setattr__ = __eq__ = __ne__ = __bool__ = _refuse
    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return "<traced contact>"


class ResponseShadow(Shadow):
    """``self`` of a response that is being read: vectors among its parameters are tuples, and its methods go through doors."""

    _doors: Doors

    def __getattribute__(self, name: str) -> Any:
        kind = type(self)
        law, recording, doors = kind._law, kind._recording, kind._doors
        if name in OUT_OF_REACH or (name in NOT_HERE and name != "__class__"):
            recording.refuse(
                f"self.{name}: it {OUT_OF_REACH.get(name, 'reaches for what compiled code does not have')}"
            )
        if name.startswith("__"):
            return super().__getattribute__(name)
        if name in law.params and name not in law.__dict__:
            found = super().__getattribute__(name)
            return tuple(found) if isinstance(found, Traced) and found.form.width else found
        declared = _declared(law, name)
        if name not in law.__dict__ and not name.startswith("__"):
            if isinstance(declared, FunctionType):
                return MethodType(doors.copied(declared) if name == "respond" else doors.joining(declared), self)
            if isinstance(declared, property) and isinstance(declared.fget, FunctionType):
                return doors.joining(declared.fget)(self)
            if isinstance(declared, staticmethod):
                return doors.stand_in(declared.__func__, f"self.{name}")
            if isinstance(declared, (dict, list, set, MappingProxyType)):
                recording.refuse(
                    f"self.{name} is a {type(declared).__name__} of the class, which may change unseen: a tuple cannot"
                )
        return super().__getattribute__(name)


def _chosen(recording: ResponseRecording, condition: Any, one: Any, other: Any) -> Any:
    """``one`` or ``other``, component by component."""
    return tuple(chosen(recording, condition, a, b) for a, b in zip(one, other, strict=True))


def _declared(law: Any, name: str) -> Any:
    for base in type(law).__mro__:
        if name in base.__dict__:
            return base.__dict__[name]
    return None


def response_shadow(law: ResponseLaw, recording: ResponseRecording, doors: Doors) -> Any:
    """A ``self`` for ``respond`` of ``law``."""
    kind = ShadowType("Shadow", (ResponseShadow,), {"_law": law, "_recording": recording, "_doors": doors})
    made: Any = object.__new__
    return made(kind)


def _read(recording: ResponseRecording, name: str, side: str, count: int, unit: str) -> Any:
    """A number, or a tuple of ``count`` of them."""
    dim = dimension(unit)
    parts = [Traced(recording, [recording.graph.input(name, k, dim, side)], NUMBER) for k in range(count or 1)]
    return tuple(parts) if count else parts[0]


shadows_are(TracedObject, TracedContact, TracedShape, Shadow)
