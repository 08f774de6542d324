"""Reading a law: its methods are called once with values that write down what is done to them.

They are called a second time, too: a formula that gives something else then (random numbers, clocks, counters) is no formula.

Source: recording by operator overloading, as in A. Griewank, A. Walther, Evaluating Derivatives (2nd ed. 2008), chapter 6.
"""

from __future__ import annotations

import inspect
import random
import re
import sys
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from linecache import getline
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from xpheve.errors import DimensionError, TraceError
from xpheve.laws import Constant, ContinuousLaw, FieldLaw, FlowLaw, PairLaw, Param, PhysicalLaw
from xpheve.trace.graph import HOUSE, Graph, Node, Place, at, equal, line_of, walk
from xpheve.trace.law_trace import LawTrace
from xpheve.trace.recording import Recording
from xpheve.trace.shadow import PROPERTIES, TracedBody, shadow_of
from xpheve.trace.values import NUMBER, Form, Traced, coerced
from xpheve.units import NONE, Dimension, dimension, name_of, show

UNITS = {"force": "N", "torque": "N m", "potential": "J"}
"""Methods that are read, and what they return."""

_TRACES: WeakKeyDictionary[type, dict[tuple[Any, ...], LawTrace]] = WeakKeyDictionary()
"""What was traced already, by class and by what chose the formula."""

_SOURCES: WeakKeyDictionary[type, list[Any]] = WeakKeyDictionary()
"""What the classes consisted of when they were traced."""


def why_untraced(law: PhysicalLaw) -> str:
    """Why ``law`` is not traced, as the end of a sentence; empty if it is."""
    if isinstance(law, FlowLaw):
        return "it is an exact flow, which is called in Python with NumPy views of all objects"
    if not isinstance(law, (FieldLaw, PairLaw)):
        return f"a {type(law).__mro__[1].__name__} is called in Python when its condition fires"
    if law.defines("apply"):
        return "it has apply, which is called in Python with NumPy views of all objects"
    if law.kernel and not (law.defines("force") or law.defines("torque")):
        return f"its force is the kernel {law.kernel}, written by hand"
    return ""


def trace_law(law: ContinuousLaw, columns: Iterable[str] | None = None) -> LawTrace | None:
    """What ``law`` computes, as a graph; None if it is not traced, and `why_untraced` says why.

    The numbers of its parameters are symbols, so that a changed number traces nothing anew. Text, switches, and parameters that are None choose the
    formula: each such choice of a class is traced once.

    Parameters
    ----------
    law
        A field or pair law.
    columns
        Columns that objects have besides those that the law declares; of these it may read any. None: all names are taken for columns,
        but for those that look like a slip of the finger.

    Raises
    ------
    TraceError
        If a method does what no formula may do, or does not return a vector (a number, if it is the potential); the author's line is named.
    DimensionError
        If it adds, compares or returns quantities that do not go together.
    TracedBranchError
        If it decides in Python on what is no number yet.
    """
    known = _TRACES.setdefault(type(law), {})
    key = _structure(law)
    found = known.get(key)
    if found is not None and columns is None:
        return found
    if why_untraced(law):
        return None
    columns = None if columns is None else list(columns)
    if found is None:
        found = _traced_twice(law, columns)
    _check_columns(law, found.graph, columns)
    known[key] = found
    return found


def forget_if_edited(kind: type) -> None:
    """Forget what was traced of the class ``kind`` if a method, a constant or a table of it is another since, as in an interactive session."""
    now, before = _sources(kind), _SOURCES.get(kind)
    if before is None or len(now) != len(before) or any(a is not b for a, b in zip(now, before, strict=True)):
        _TRACES.pop(kind, None)
        _SOURCES[kind] = now


def _sources(kind: type) -> list[Any]:
    """The code, and the values, of ``kind`` and its parents among laws of authors."""
    found: list[Any] = []
    for base in kind.__mro__:
        if base.__module__.startswith(HOUSE) or base is object:
            continue
        for name, value in vars(base).items():
            if not name.startswith("__"):
                function = getattr(value, "fget", None) or getattr(value, "__func__", value)
                found += [name, getattr(function, "__code__", function)]
    return found


def _structure(law: ContinuousLaw) -> tuple[Any, ...]:
    """The values of parameters that choose a formula, and the sizes of the vectors."""
    return tuple(
        (
            name,
            type(value).__name__,
            value if isinstance(value, (str, bool)) else len(value) if isinstance(value, tuple) else None,
        )
        for name, value in law.parameters.items()
    )


def _traced_twice(law: ContinuousLaw, columns: Iterable[str] | None) -> LawTrace:
    before = _chance()
    first = _traced(law, columns)
    if _chance() != before:
        raise TraceError(
            f"{law.label()}: the formula draws random numbers: how often it is called is the stepper's affair. "
            f"Draw them in a free-form law, from self.random, which sets a column or a parameter. {at(_drawing_line(law))}".rstrip()
        )
    second = _traced(law, columns)
    _check_same(law.label(), first.graph.nodes, second.graph.nodes)
    _check_same(law.label(), _outputs(first), _outputs(second))
    return first


def _traced(law: ContinuousLaw, columns: Iterable[str] | None) -> LawTrace:
    """One reading of all methods of ``law``."""
    recording = Recording(law.label(), isinstance(law, PairLaw))
    shadow = shadow_of(law, recording)
    bodies = [TracedBody(recording, law.columns, side) for side in (("a", "b") if recording.pair else ("",))]
    read: dict[str, Any] = dict.fromkeys(UNITS)
    try:
        for method, unit in UNITS.items():
            if law.defines(method):
                recording.method = method
                recording.definition = _definition(law, method)
                result = _called(recording, shadow, method, bodies, law)
                nodes = _number_of(recording, result) if method == "potential" else _vector_of(recording, result)
                _check_dimension(recording, nodes, dimension(unit), unit)
                read[method] = nodes[0] if method == "potential" else nodes
    except TraceError:
        _check_columns(law, recording.graph, columns)  # a slip of the finger is the better news
        raise
    return LawTrace(recording.label, recording.pair, recording.graph, read["force"], read["torque"], read["potential"])


def _called(
    recording: Recording, shadow: Any, method: str, bodies: Sequence[TracedBody], law: ContinuousLaw | None = None
) -> Any:
    """What ``method`` returns; the first error is raised whatever the author's ``except`` did with it."""
    try:
        with np.errstate(all="ignore"):
            result = getattr(shadow, method)(*bodies)
    except Exception as error:
        if recording.error is not None:
            raise recording.error from None
        if isinstance(error, TraceError):
            raise
        place, way_out = _place_of(error), "" if law is None else _way_out(law, method, error)
        place = place if place[0] else recording.definition
        raise TraceError(
            f"{recording.where} raised {type(error).__name__}: {error}.{way_out} {at(place)}".rstrip()
        ) from error
    if recording.error is not None:
        raise recording.error
    return result


def _place_of(error: BaseException) -> Place:
    """The author's line that ``error`` passed last."""
    place, trail = ("", 0), error.__traceback__
    while trail is not None:
        if not str(trail.tb_frame.f_globals.get("__name__") or "").startswith(HOUSE):
            place = trail.tb_frame.f_code.co_filename, trail.tb_lineno
        trail = trail.tb_next
    return place


def _definition(law: ContinuousLaw, method: str) -> Place:
    """Where ``method`` of the class of ``law`` begins."""
    code = getattr(getattr(type(law), method), "__code__", None)
    return ("", 0) if code is None else (code.co_filename, code.co_firstlineno)


def _drawing_line(law: ContinuousLaw) -> Place:
    """The first line of the methods of ``law`` that seems to draw random numbers; else where its first method begins."""
    methods = [method for method in UNITS if law.defines(method)]
    codes = [getattr(getattr(type(law), method), "__code__", None) for method in methods]
    for code in (one for one in codes if one is not None):
        for _, _, line in code.co_lines():
            if line is not None and re.search("rand|normal|uniform|choice|shuffle", getline(code.co_filename, line)):
                return code.co_filename, line
    return _definition(law, methods[0])


def _way_out(law: ContinuousLaw, method: str, error: Exception) -> str:
    """What the author of ``method``, which raised ``error``, may have meant; a sentence after a blank, or nothing."""
    from xpheve.trace.table import Table

    bodies = "a, b" if isinstance(law, PairLaw) else "body"
    name = str(getattr(error, "name", None) or "")
    own = [one for one in dir(type(law)) if isinstance(_attribute(law, one), (Param, Constant, Table))]
    if isinstance(error, NameError) and name in own:
        return f" Write self.{name}."
    if isinstance(error, NameError) and (name in PROPERTIES or name in law.columns):
        return f" Write {bodies[0] if bodies == 'a, b' else bodies}.{name}."
    if isinstance(error, AttributeError) and str(error).startswith(f"{type(law).__name__!r} object"):
        near = get_close_matches(name, own, n=1)
        column = (
            f" What differs from object to object is {bodies.split(', ')[0]}.{name}." if name in law.columns else ""
        )
        meant = f' Did you mean "{near[0]}"?' if near else ""
        return column or f" The law declares: {', '.join(own) or 'nothing'}.{meant}"
    if isinstance(error, TypeError) and "'Table'" in str(error):
        return " A table is called like a function: self.table(x)."
    if isinstance(error, TypeError) and f".{method}() takes" in str(error):
        return f" Write def {method}(self, {bodies})."
    return ""


def _attribute(law: ContinuousLaw, name: str) -> Any:
    return inspect.getattr_static(type(law), name, None)


# What is returned


def _vector_of(recording: Recording, result: Any) -> tuple[Node, Node, Node]:
    """``result`` as three nodes: (n, 3), (3,), or 0; raises `TraceError`."""
    if result is None:
        recording.refuse("returned None: is a `return` missing? For no force return 0", recording.definition)
    wanted = (
        "real numbers of shape (n, 3) or (3,) are needed: one vector an object. A number times a direction is one: "
        "body.position.z * (0, 0, 1); so is xp.vector(fx, fy, fz)"
    )
    values = _returned(recording, result, wanted)
    nodes = tuple(recording.number(node) for node in values.nodes)
    if values.form == NUMBER and nodes[0].op == "const" and (nodes[0].value == 0.0 or nodes[0].value != nodes[0].value):
        nodes = nodes * 3
    elif values.form.width != 3:
        recording.error = TraceError(
            f"{recording.where} returned {_described(values)}; {wanted}. {at(_place_in(recording, result, nodes[0]))}".rstrip()
        )
        raise recording.error
    return nodes[0], nodes[1], nodes[2]


def _number_of(recording: Recording, result: Any) -> tuple[Node, ...]:
    """``result`` as one node: (n, 1) or a number; raises `TraceError`."""
    wanted = "real numbers of shape (n, 1) are needed: one an object or pair. a.dot(b), v.norm() and v.x have it"
    if result is None:
        recording.refuse("returned None: is a `return` missing?", recording.definition)
    values = _returned(recording, result, wanted)
    if values.form not in (NUMBER, Form(True, 1), Form(False, 1)):
        recording.error = TraceError(
            f"{recording.where} returned {_described(values)}; {wanted}. {at(_place_in(recording, result, values.nodes[0]))}".rstrip()
        )
        raise recording.error
    return (recording.number(values.nodes[0]),)


def _returned(recording: Recording, result: Any, wanted: str) -> Traced:
    try:
        return coerced(recording, result)
    except TraceError:
        shown = " ".join(repr(result).split())[:80]
        recording.error = TraceError(
            f"{recording.where} returned {shown}; {wanted}. {at(recording.definition)}".rstrip()
        )
        raise recording.error from None


def _place_in(recording: Recording, result: Any, node: Node) -> Place:
    """The line of ``node``; of a plain number, which has none, the method's first."""
    return node.place if isinstance(result, Traced) else recording.definition


def _described(values: Traced) -> str:
    if values.form == NUMBER and values.nodes[0].op == "const":
        return repr(values.nodes[0].value)
    return f"an array of shape {values.form}"


# Dimensions


def _check_dimension(recording: Recording, nodes: Sequence[Node], wanted: Dimension, unit: str) -> None:
    """Raise `DimensionError` unless ``nodes`` are in ``unit``. A plain number of the text is taken to be in it."""
    for node in nodes:
        if node.dim is None or equal(node.dim, wanted) or (node.op == "const" and equal(node.dim, NONE)):
            continue
        called = name_of(tuple(round(one, 9) for one in node.dim))
        text = f"{recording.where} returns {show(node.dim)}{f' ({called})' if called else ''}, not {unit}. {at(node.place)}"
        excess = tuple(a - b for a, b in zip(node.dim, wanted, strict=True))
        raise DimensionError(f"{text}{_hint(node, excess)}")


def _hint(node: Node, excess: Dimension) -> str:
    """Which of what the law reads is there too often, or too seldom, where it is one alone."""
    names: dict[str, Dimension] = {}
    for one in walk([node]):
        if one.op in ("input", "param") and one.dim is not None and not equal(one.dim, NONE):
            vector = one.value.name in PROPERTIES and PROPERTIES[one.value.name][0].width == 3
            names.setdefault(f"|{one.value.name}|" if vector else one.value.name, one.dim)
    for power, many in ((1, "one"), (2, "two"), (3, "three"), (0.5, "a square root of")):
        for name, dim in names.items():
            for sign, what in ((1, "too many"), (-1, "too few")):
                if equal(excess, tuple(sign * power * one for one in dim)):
                    return f" Hint: {many} {name} {what}."
    missing = tuple(-one for one in excess)
    return _missing_unit(node, "N" if equal(missing, dimension("N")) else show(missing))


def _missing_unit(node: Node, unit: str) -> str:
    """Which parameter, or number of the text, was to have ``unit``, where there is one."""
    nodes = list(walk([node]))
    pure = {one.value.name for one in nodes if one.op == "param" and one.dim is not None and equal(one.dim, NONE)}
    if len(pure) == 1:
        return f" Hint: {unit} is missing, and {pure.pop()} has no unit: Param(..., unit={unit!r})."
    numbers = {abs(one.value) for one in nodes if one.op == "const" and one.dim is not None and equal(one.dim, NONE)}
    own = sorted(numbers - {0.5, 1.0, 2.0})
    if pure or not numbers:
        return ""
    shown = own[0] if len(own) == 1 else 1.0
    return f" Hint: a number in the text has no unit: declare it, Constant({shown!r}, unit={unit!r}), or as a Param."


# What is read, and whether it is a formula


def _check_columns(law: ContinuousLaw, graph: Graph, columns: Iterable[str] | None) -> None:
    """Raise `TraceError` for a name that is no property and no column."""
    own = [*PROPERTIES, *law.columns]
    at_hand = own if columns is None else [*own, *columns]
    for node in graph.nodes:
        if node.op != "input" or node.value.name in at_hand:
            continue
        name = node.value.name
        near = get_close_matches(name, at_hand, n=1, cutoff=0.8 if columns is None else 0.6)
        near = near or [one for one in PROPERTIES if len(name) > 2 and one.startswith(name)]
        if columns is None and not near:
            continue
        meant = f' Did you mean "{near[0]}"?' if near else ""
        raise TraceError(
            f"{law.label()} reads {node.value.side or 'body'}.{name}, which is no property and no column that a law here declares; "
            f"at hand: {', '.join(at_hand)}.{meant} {at(node.place)}"
        )


def _outputs(trace: LawTrace) -> list[Node]:
    return [*trace.motion, *([trace.potential] if trace.potential is not None else [])]


def _check_same(label: str, first: Sequence[Node], second: Sequence[Node]) -> None:
    """Raise `TraceError` unless two readings wrote the same."""
    for one, other in zip(first, second, strict=False):
        if _essence(one) != _essence(other):
            break
    else:
        if len(first) == len(second):
            return
        one = other = max(first, second, key=len)[min(len(first), len(second))]
    shown = [f"{node.value!r}" if node.op == "const" else node.op for node in (one, other)]
    here, there = line_of(one.place), line_of(other.place)
    places = f"At {here}" if here == there else f"At {here}, then at {there}"
    raise TraceError(
        f"{label}: the formula, read twice, says two things: {shown[0]}, then {shown[1]}. {places}. Random numbers, clocks and counters are no part "
        "of a formula: use body.time, a Param or a column, or write a free-form law"
    )


def _essence(node: Node) -> tuple[Any, ...]:
    value = node.value.hex() if isinstance(node.value, float) else node.value
    return node.op, tuple(arg.index for arg in node.args), value, node.index


def _chance() -> tuple[Any, ...]:
    """States of the random generators that all modules share."""
    found: tuple[Any, ...] = (random.getstate(),)
    if "numpy.random" in sys.modules:
        state = np.random.get_state(legacy=False)  # noqa: NPY002
        words = {
            name: value.tobytes() if isinstance(value, np.ndarray) else value for name, value in state["state"].items()
        }
        found += (words, state.get("has_gauss"))
    return found
