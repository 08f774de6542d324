"""Plain Python of authors, run on values that are no numbers yet: a copy of a function whose names lead to doors that record.

A response is written for floats: it calls ``math.sqrt``, ``min`` and ``sum``, reads constants of its module and asks ``if``. Here each
function is copied with the names it uses put in place of its globals, closure and defaults: functions of ``math`` that record,
other functions copied alike, containers that cannot be changed, and, for what may change unseen or has effects, a stranger that refuses.
"""

from __future__ import annotations

import builtins
import dis
import math
import sys
from collections.abc import Callable, Iterable
from enum import Enum
from functools import lru_cache
from types import BuiltinFunctionType, CellType, CodeType, FunctionType, MappingProxyType, MethodType, ModuleType
from typing import Any, NoReturn

import numpy as np

from xpheve.laws import Constant, Impulse, Param, Velocities
from xpheve.trace.response_recording import ResponseRecording
from xpheve.trace.values import NUMBER, Traced, chosen, coerced, elementwise, power

MATH = {
    "sqrt": "sqrt", "cbrt": "cbrt", "exp": "exp", "expm1": "expm1", "log1p": "log1p", "sin": "sin", "cos": "cos", "tan": "tan",
    "asin": "asin", "acos": "acos", "atan": "atan", "atan2": "atan2", "sinh": "sinh", "cosh": "cosh", "tanh": "tanh", "fabs": "abs",
}  # fmt: skip
"""Functions of ``math`` that are one operation of the graph: interpreted and compiled they give the bits that ``math`` gives."""

SAFE_MODULES = frozenset({"operator", "_operator", "itertools", "functools", "_functools", "builtins", "math"})
"""Modules of the standard library whose functions have no effects."""

NO_EFFECTS_HERE = (
    "print",
    "open",
    "input",
    "exec",
    "eval",
    "setattr",
    "delattr",
    "globals",
    "locals",
    "vars",
    "id",
    "hash",
)
STORES = {"STORE_ATTR", "DELETE_ATTR", "STORE_GLOBAL", "DELETE_GLOBAL"}


class GivenImpulse:
    """What `xpheve.Impulse` is while a response is read."""

    def __init__(self, vector: Iterable[Any]) -> None:
        self.vector = tuple(vector)


class GivenVelocities:
    """What `xpheve.Velocities` is while a response is read."""

    def __init__(self, a: Iterable[Any], b: Iterable[Any]) -> None:
        self.a, self.b = tuple(a), tuple(b)


class Stranger:
    """Something that a formula cannot reach: whatever is done with it is refused."""

    def __init__(self, doors: Doors, why: str) -> None:
        object.__setattr__(self, "_said", (doors, why))

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        doors: Doors
        doors, why = object.__getattribute__(self, "_said")
        doors.recording.refuse(why)

    def __getattr__(self, name: str) -> NoReturn:
        self._refuse()

    __call__ = __getitem__ = __iter__ = __next__ = __len__ = __bool__ = __contains__ = __setattr__ = __setitem__ = (
        _refuse
    )
    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = __float__ = _refuse
    __lt__ = __le__ = __gt__ = __ge__ = __eq__ = __ne__ = __neg__ = __enter__ = __exit__ = _refuse
    __hash__ = None  # type: ignore[assignment]


class Door:
    """A module whose attributes are looked at before they are handed out."""

    def __init__(self, module: ModuleType, doors: Doors) -> None:
        self._module, self._doors = module, doors

    def __getattr__(self, name: str) -> Any:
        return self._doors.stand_in(getattr(self._module, name), f"{self._module.__name__}.{name}")


class Doors:
    """Copies of functions and of what they reach, for one reading of one law; ``recording`` is the way that it is on."""

    def __init__(self) -> None:
        self.recording = ResponseRecording("")
        self._copies: dict[int, Any] = {}
        self._kept: list[Any] = []  # so that no identity is used twice
        self._math = {id(getattr(math, name)): value for name, value in self._math_doors().items()}
        self._builtins: dict[str, Any] = {
            "float": self._float,
            "isinstance": self._isinstance,
            "min": self._extreme(min, "<"),
            "max": self._extreme(max, ">"),
            "sum": self._sum,
            "super": self._super,
            "type": self._type,
            **{name: Stranger(self, f"calls {name}(), which a formula has no use for") for name in NO_EFFECTS_HERE},
        }

    # Functions

    def joining(self, function: FunctionType) -> Any:
        """``function`` with doors, whose own decisions are joined where it is given plain values; `copied` for those that are no function."""
        plain = self.copied(function)
        if isinstance(plain, Stranger):
            return plain

        def call(*values: Any, **options: Any) -> Any:
            if not all(map(_is_unchanging, (*values, *options.values()))):
                return plain(*values, **options)
            return self.recording.joined(lambda: plain(*values, **options))

        return call

    def copied(self, function: FunctionType) -> Any:
        """``function`` with doors in place of what it reaches."""
        if id(function) in self._copies:
            return self._copies[id(function)]
        self._kept.append(function)
        code = function.__code__
        unfit = _effect_of(code)
        if unfit:
            return Stranger(self, unfit)
        space: dict[str, Any] = {
            "__name__": function.__globals__.get("__name__", ""),
            "__builtins__": builtins,
        }
        cells = tuple(CellType() for _ in function.__closure__ or ())
        found = FunctionType(code, space, function.__name__, None, cells)
        self._copies[id(function)] = found
        for name in _names(code):
            if name in function.__globals__:
                space[name] = self.stand_in(function.__globals__[name], name)
            elif name in self._builtins:
                space[name] = self._builtins[name]
        for cell, own, name in zip(cells, function.__closure__ or (), code.co_freevars, strict=True):
            try:
                cell.cell_contents = (
                    own.cell_contents if name == "__class__" else self.stand_in(own.cell_contents, name)
                )
            except ValueError:  # not bound yet
                continue
        if function.__defaults__:
            found.__defaults__ = tuple(self.stand_in(one, "a default") for one in function.__defaults__)
        if function.__kwdefaults__:
            found.__kwdefaults__ = {key: self.stand_in(one, key) for key, one in function.__kwdefaults__.items()}
        return found

    def stand_in(self, value: Any, name: str) -> Any:
        """What a formula gets for ``value``, which its author calls ``name``."""
        if value is None or isinstance(value, (bool, int, float, str, bytes, np.generic, type(...), Traced)):
            return value
        if value is Impulse:
            return GivenImpulse
        if value is Velocities:
            return GivenVelocities
        if isinstance(value, (list, tuple)) and type(value) in (list, tuple):
            return tuple(self.stand_in(one, name) for one in value)
        if type(value) in (set, frozenset):
            return frozenset(self.stand_in(one, name) for one in value)
        if type(value) is dict or isinstance(value, MappingProxyType):
            return MappingProxyType({key: self.stand_in(one, name) for key, one in value.items()})
        if isinstance(value, np.ndarray):
            own = value.copy()
            own.flags.writeable = False
            return own
        if isinstance(value, ModuleType):
            return value if value.__name__.split(".")[0] == "numpy" else Door(value, self)
        if isinstance(value, FunctionType):
            ready = value.__module__.startswith("xpheve.trace.") or value.__module__.split(".")[0] == "numpy"
            return value if ready or value.__module__ in SAFE_MODULES else self.joining(value)
        if isinstance(value, BuiltinFunctionType) and id(value) in self._math:
            return self._math[id(value)]
        if isinstance(value, BuiltinFunctionType) and value.__module__ == "math":
            return self._numbers_only(value)
        if isinstance(value, np.ufunc) or self._is_harmless(value):
            return value
        return Stranger(
            self,
            f"reaches {name} ({type(value).__name__}), which may change unseen, or do something that is no formula: what the formula needs "
            "is a Param, a column, or a plain constant",
        )

    def _is_harmless(self, value: Any) -> bool:
        module = getattr(value, "__module__", None) or ""
        if isinstance(value, (Param, Constant)):
            return True
        if isinstance(value, type):
            house = module.split(".")[0] in ("builtins", "numpy", "xpheve")
            frozen = getattr(value, "__dataclass_params__", None)
            record = (issubclass(value, tuple) and hasattr(value, "_fields")) or (frozen is not None and frozen.frozen)
            return house or record or issubclass(value, (BaseException, Enum))
        return callable(value) and (
            module in SAFE_MODULES or (module.split(".")[0] == "numpy" and "random" not in module)
        )

    # math

    def _math_doors(self) -> dict[str, Callable[..., Any]]:
        found: dict[str, Callable[..., Any]] = {
            name: self._one(name, op) for name, op in MATH.items() if hasattr(math, name)
        }
        found["log"] = self._log
        found["pow"] = self._composed(math.pow, lambda a, b: power(self.recording, a, b))
        found["isnan"] = self._composed(math.isnan, lambda x: elementwise(self.recording, "!=", x, x))
        found["isfinite"] = self._composed(math.isfinite, lambda x: elementwise(self.recording, "<", abs(x), math.inf))
        found["isinf"] = self._composed(math.isinf, lambda x: elementwise(self.recording, "==", abs(x), math.inf))
        found["radians"] = self._composed(math.radians, lambda x: x * (math.pi / 180.0))
        found["degrees"] = self._composed(math.degrees, lambda x: x * (180.0 / math.pi))
        return found

    def _one(self, name: str, op: str) -> Callable[..., Any]:
        plain = getattr(math, name)

        def called(*values: Any) -> Any:
            numbers = [self._float(value) for value in values]
            if not any(isinstance(one, Traced) for one in numbers):
                return plain(*numbers)
            return self.recording.exactly(lambda: elementwise(self.recording, op, *numbers))

        return called

    def _composed(self, plain: Any, make: Callable[..., Any]) -> Callable[..., Any]:
        def called(*values: Any) -> Any:
            numbers = [self._float(value) for value in values]
            return make(*numbers) if any(isinstance(one, Traced) for one in numbers) else plain(*numbers)

        return called

    def _log(self, x: Any, *base: Any) -> Any:
        if base:
            self.recording.refuse("math.log of two arguments: write math.log(x) / math.log(base)")
        return self._one("log", "log")(x)

    def _numbers_only(self, plain: Any) -> Callable[..., Any]:
        def called(*values: Any, **options: Any) -> Any:
            if any(_holds_traced(value) for value in values):
                self.recording.refuse(
                    f"math.{plain.__name__} of a traced value: compiled it would not be sure to give the same bits; "
                    "write it with +, -, *, / and math.sqrt"
                )
            return plain(*values, **options)

        return called

    # Builtins

    def _float(self, value: Any = 0.0) -> Any:
        if isinstance(value, Traced) and len(value.at) == 1:
            return Traced(self.recording, [self.recording.number(value.nodes[0])], NUMBER)
        if isinstance(value, (Stranger, *_SHADOWS)):
            self.recording.refuse(f"float() of {value!r}")
        return value if isinstance(value, Traced) else float(value)

    def _isinstance(self, value: Any, kinds: Any) -> bool:
        if isinstance(value, (Traced, *_SHADOWS)):
            self.recording.refuse(
                "asks isinstance() of a traced value: what chooses a formula is a Param with choices=(...)"
            )
        every = kinds if isinstance(kinds, tuple) else (kinds,)
        return isinstance(value, tuple(float if one == self._float else one for one in every))

    def _type(self, *given: Any) -> Any:
        if any(isinstance(value, (Traced, *_SHADOWS)) for value in given):
            self.recording.refuse("asks type() of a traced value: what chooses a formula is a Param with choices=(...)")
        return type(*given)

    def _extreme(self, plain: Callable[..., Any], sign: str) -> Callable[..., Any]:
        """``min`` or ``max``: the first of all to which none is preferred, as Python compares them."""

        def called(*given: Any, **options: Any) -> Any:
            values = list(given if len(given) > 1 else given[0])
            if options or not any(isinstance(one, Traced) for one in values):
                return plain(*given, **options) if len(given) > 1 else plain(values, **options)
            best = values[0]
            for one in values[1:]:
                preferred = elementwise(self.recording, sign, one, best)
                best = chosen(self.recording, preferred, one, best)
            return best

        return called

    def _sum(self, values: Iterable[Any], start: Any = 0) -> Any:
        """``sum`` as this Python has it: from 3.12 on floats are summed with a running compensation (Neumaier 1974)."""
        parts = list(values)
        if not any(isinstance(one, Traced) for one in (start, *parts)):
            return sum(parts, start)
        if sys.version_info < (3, 12) or any(isinstance(one, Traced) and one.form != NUMBER for one in (start, *parts)):
            total = start
            for one in parts:
                total = total + one
            return total
        total, carried = self._float(start), 0.0
        for one in parts:
            following = total + one
            larger = coerced(self.recording, abs(total)) >= abs(one)
            lost = chosen(self.recording, larger, (total - following) + one, (one - following) + total)
            total, carried = following, carried + lost
        usable = (coerced(self.recording, carried) != 0.0) & (abs(carried) < math.inf)
        return chosen(self.recording, usable, total + carried, total)

    def _super(self, *given: Any) -> Any:
        if given:
            after, shadow = given
        else:
            frame = sys._getframe(1)
            after, shadow = frame.f_locals["__class__"], frame.f_locals[frame.f_code.co_varnames[0]]
        return _Parent(self, after, shadow)


_SHADOWS: tuple[type, ...] = ()
"""Classes of what stands for objects, contacts and the law; `xpheve.trace.response_shadow` fills it."""


def shadows_are(*kinds: type) -> None:
    """Say which classes stand for what is no number."""
    global _SHADOWS
    _SHADOWS = kinds


class _Parent:
    """``super()`` of a law that is being read."""

    def __init__(self, doors: Doors, after: type, shadow: Any) -> None:
        self._doors, self._after, self._shadow = doors, after, shadow

    def __getattr__(self, name: str) -> Any:
        line = self._shadow.__class__.__mro__
        for base in line[line.index(self._after) + 1 :]:
            found = base.__dict__.get(name)
            if isinstance(found, FunctionType):
                return MethodType(self._doors.joining(found), self._shadow)
            if found is not None:
                break
        self._doors.recording.refuse(f"super().{name} is no method of a parent that can be read")


@lru_cache(maxsize=256)
def _names(code: CodeType) -> list[str]:
    """Names of globals and attributes that ``code`` uses, and what is written inside of it."""
    found = list(code.co_names)
    for one in code.co_consts:
        if isinstance(one, CodeType):
            found += _names(one)
    return list(dict.fromkeys(found))


@lru_cache(maxsize=256)
def _effect_of(code: CodeType) -> str:
    """What ``code`` does that no formula may do, in words; empty if nothing is seen."""
    before: Any = None
    for step in dis.get_instructions(code):
        if step.opname in STORES:
            return f"sets {step.argval}: a formula has no memory, and nobody would see it change"
        if step.opname == "STORE_DEREF" and step.argval in code.co_freevars:
            return f"sets {step.argval}, a name of the function around it: a formula has no memory"
        if step.opname == "IS_OP" and not (before is not None and before.opname == "LOAD_CONST"):
            return "asks with `is` which object it has: what differs from object to object is a column"
        if step.opname in ("IMPORT_NAME", "YIELD_VALUE", "GET_AWAITABLE") and not _is_comprehension(code):
            return "imports, or yields, inside of the formula"
        before = step
    for one in code.co_consts:
        if isinstance(one, CodeType):
            inner = _effect_of(one)
            if inner:
                return inner
    return ""


def _is_comprehension(code: CodeType) -> bool:
    return code.co_name in ("<genexpr>", "<listcomp>", "<setcomp>", "<dictcomp>")


def _is_unchanging(value: Any) -> bool:
    """Whether a call can be made twice with ``value``: nothing that it could change or use up."""
    if isinstance(value, tuple):
        return all(map(_is_unchanging, value))
    return value is None or isinstance(
        value, (bool, int, float, str, np.generic, MappingProxyType, type, Traced, *_SHADOWS)
    )


def _holds_traced(value: Any) -> bool:
    return isinstance(value, (Traced, *_SHADOWS)) or (
        isinstance(value, (tuple, list)) and any(map(_holds_traced, value))
    )
