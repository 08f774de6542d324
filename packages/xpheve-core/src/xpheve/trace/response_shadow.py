"""What ``respond`` is given while it is read: a contact, two objects and a ``self`` whose numbers record what is done with them.

Vectors are tuples of three numbers, as objects and contacts have them in Python, so that ``+`` and ``[k]`` mean here what they mean there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from types import FunctionType, MappingProxyType, MethodType
from typing import Any, NoReturn

from xpheve.errors import TraceError
from xpheve.laws import Contact, ResponseLaw
from xpheve.trace.graph import Node
from xpheve.trace.plain_python import Doors, shadows_are
from xpheve.trace.recording import Recording
from xpheve.trace.shadow import NOT_HERE, Shadow, ShadowType
from xpheve.trace.values import NUMBER, Traced
from xpheve.units import dimension

EXACT_CALLS = frozenset({"exp", "expm1", "log", "log1p", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "cbrt", "hypot"})  # fmt: skip
"""Operations of which NumPy's are off by a bit here and there; those of ``math`` are not."""

MOST_DECISIONS = 64
"""On one way through a response."""

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


class ResponseRecording(Recording):
    """One reading of ``respond`` along one way through its decisions.

    ``prefix`` says how the first of them are decided; those after it are taken for true. ``taken`` tells what was decided.
    """

    def __init__(self, label: str, graph: Any = None, prefix: Iterable[bool] = ()) -> None:
        super().__init__(label, pair=True)
        self.method = "respond"
        if graph is not None:
            self.graph = graph
        self.graph.check_dimensions = False
        self.prefix = list(prefix)
        self.taken: list[tuple[Node, bool]] = []
        self._known: dict[int, bool] = {}
        self._exact = 0

    @property
    def apply(self) -> str:
        """What an author may do instead."""
        return "leave it to Python, which is slower"

    def op(self, op: str, *nodes: Node) -> Node:
        if op in EXACT_CALLS and not self._exact:
            self.refuse(f"np.{op} of a traced value: it may differ from compiled code in its last bit; write math.{op}")
        return super().op(op, *nodes)

    def exactly(self, make: Any) -> Any:
        """What ``make()`` gives, which asks for functions of ``math``."""
        self._exact += 1
        try:
            return make()
        finally:
            self._exact -= 1

    def power(self, base: Node, exponent: float) -> Node:
        """As Python's ``**``: by the power of the C library, whatever the exponent."""
        return self.op("pow", base, self.graph.const(exponent))

    def whole_part(self) -> None:
        self.refuse("// and % of a traced value: Python rounds them in its own way")

    def decide(self, value: Traced) -> bool:
        """The answer on this way; the same question has the same answer."""
        if len(value.at) != 1:
            self.refuse("asks whether a vector is true: compare its components")
        return self._decided(self.truth(value.nodes[0]))

    def _decided(self, node: Node) -> bool:
        if node.op == "not":
            return not self._decided(node.args[0])
        if node.op == "and":
            return self._decided(node.args[0]) and self._decided(node.args[1])
        if node.op == "or":
            return self._decided(node.args[0]) or self._decided(node.args[1])
        if all(arg.op == "const" for arg in node.args):
            return bool(COMPARE[node.op](*(arg.value for arg in node.args)))
        if node.index not in self._known:
            k = len(self.taken)
            if k >= MOST_DECISIONS:
                self.refuse(
                    f"decides more than {MOST_DECISIONS} times on one way: a loop that ends by what it computes is no formula"
                )
            self._known[node.index] = self.prefix[k] if k < len(self.prefix) else True
            self.taken.append((node, self._known[node.index]))
        return self._known[node.index]


COMPARE: dict[str, Any] = {
    "<": float.__lt__,
    "<=": float.__le__,
    ">": float.__gt__,
    ">=": float.__ge__,
    "==": float.__eq__,
    "!=": float.__ne__,
}


class TracedObject:
    """``contact.body_a`` or ``body_b`` while a response is read."""

    def __init__(self, recording: Recording, law: ResponseLaw, side: str, columns: Iterable[str]) -> None:
        object.__setattr__(self, "_here", (recording, law, side, frozenset(columns)))

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        recording, _, side, columns = self._here
        if name in OF_BODY:
            return _read(recording, name, side, *OF_BODY[name])
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
        recording, _law, side, _columns = self._here
        recording.refuse(f"changes, calls or compares body_{side}: a response reads, and returns what happens")

    __setattr__ = __setitem__ = __eq__ = __ne__ = __bool__ = __call__ = _refuse  # type: ignore[assignment]
    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<traced body_{self._here[2]}>"


class TracedShape:
    """``shape`` of an object: of spheres the radius is known."""

    def __init__(self, recording: Recording, side: str) -> None:
        object.__setattr__(self, "_here", (recording, side))

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        recording, side = self._here
        if name == "radius":
            return _read(recording, "radius", side, 0, "m")
        recording.refuse(f"reads body_{side}.shape.{name}: of shapes compiled code knows the radius of spheres only")

    def _refuse(self, *_: Any) -> NoReturn:
        recording, side = self._here
        recording.refuse(f"changes or compares body_{side}.shape")

    __setattr__ = __eq__ = __ne__ = __bool__ = _refuse  # type: ignore[assignment]
    __hash__ = None  # type: ignore[assignment]


class TracedContact:
    """The contact while a response is read; its own properties and methods are those of `xpheve.laws.Contact`."""

    def __init__(self, recording: Recording, law: ResponseLaw, columns: Iterable[str], doors: Doors) -> None:
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
            return doors.copied(known.fget)(self)
        if isinstance(known, FunctionType):
            return MethodType(doors.copied(known), self)
        recording.refuse(
            f"reads contact.{name}, which compiled code does not have; it has body_a, body_b, {', '.join(OF_CONTACT)}"
        )

    def _relative_velocity(self) -> Any:
        return _read(self._here[0], "relative_velocity", "", 3, "m/s")

    def _refuse(self, *_: Any) -> NoReturn:
        self._here[0].refuse("changes or compares the contact: a response reads, and returns what happens")

    __setattr__ = __eq__ = __ne__ = __bool__ = _refuse  # type: ignore[assignment]
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
                return MethodType(doors.copied(declared), self)
            if isinstance(declared, property) and isinstance(declared.fget, FunctionType):
                return doors.copied(declared.fget)(self)
            if isinstance(declared, staticmethod):
                return doors.stand_in(declared.__func__, f"self.{name}")
            if isinstance(declared, (dict, list, set, MappingProxyType)):
                recording.refuse(
                    f"self.{name} is a {type(declared).__name__} of the class, which may change unseen: a tuple cannot"
                )
        return super().__getattribute__(name)


def _declared(law: ResponseLaw, name: str) -> Any:
    for base in type(law).__mro__:
        if name in base.__dict__:
            return base.__dict__[name]
    return None


def response_shadow(law: ResponseLaw, recording: Recording, doors: Doors) -> Any:
    """A ``self`` for ``respond`` of ``law``."""
    kind = ShadowType("Shadow", (ResponseShadow,), {"_law": law, "_recording": recording, "_doors": doors})
    made: Any = object.__new__
    return made(kind)


def _read(recording: Recording, name: str, side: str, count: int, unit: str) -> Any:
    """A number, or a tuple of ``count`` of them."""
    dim = dimension(unit)
    parts = [Traced(recording, [recording.graph.input(name, k, dim, side)], NUMBER) for k in range(count or 1)]
    return tuple(parts) if count else parts[0]


shadows_are(TracedObject, TracedContact, TracedShape, Shadow)
__all__ = ["ResponseRecording", "TraceError", "TracedContact", "TracedObject", "response_shadow"]
