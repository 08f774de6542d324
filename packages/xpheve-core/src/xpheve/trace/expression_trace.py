"""Reading an expression of one object, such as a condition asks for: once, into a graph.

It is a function of ``body`` that returns one number. Numbers in its text, and those that it closes over, have no unit: each takes the unit that
fits, in SI. What is read of the body has one, so that a sum of metres and seconds is refused. A factor may carry any unit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cached_property
from types import SimpleNamespace
from typing import Any

from xpheve.errors import TraceError
from xpheve.laws.view import STATE
from xpheve.trace.flight_polynomial import flight_polynomial
from xpheve.trace.graph import Graph, Node, Place, at, walk
from xpheve.trace.numpy_text import GraphFunction, array_function, scalar_function
from xpheve.trace.recorder import _called, _chance, _check_same, _described, _returned
from xpheve.trace.recording import Recording
from xpheve.trace.shadow import PROPERTIES, TracedBody
from xpheve.trace.values import LIST, NUMBER, Form
from xpheve.units import NONE, Dimension

WANTED = "one number an object is needed, of shape (n, 1), such as body.position.z or body.velocity.norm()"


@dataclass(frozen=True, eq=False)
class ExpressionTrace:
    """An expression of one object.

    ``value`` is a node of ``graph``, whose inputs are named as in `xpheve.laws.view.BodyView`, ``side`` "". ``dimension`` is None where a factor
    in the text may give it any.
    """

    label: str
    graph: Graph
    value: Node

    @property
    def dimension(self) -> Dimension | None:
        """What the value is measured in; None if any unit fits."""
        return self.value.dim

    @cached_property
    def inputs(self) -> tuple[Node, ...]:
        """The numbers that it reads."""
        return tuple(node for node in walk([self.value]) if node.op == "input")

    @cached_property
    def reads(self) -> frozenset[str]:
        """Names that it reads of the object, and ``time`` and ``up``."""
        return frozenset(node.value.name for node in self.inputs)

    @property
    def moves(self) -> bool:
        """Whether it reads what changes along a flight: state or time."""
        return bool(self.reads & (STATE | {"time"}))

    @cached_property
    def arrays(self) -> GraphFunction:
        """The value on arrays, one number a time."""
        return array_function([self.value])

    @cached_property
    def floats(self) -> GraphFunction:
        """The value on floats."""
        return scalar_function([self.value])

    @cached_property
    def polynomial(self) -> GraphFunction | None:
        """Its five coefficients by time along a ballistic flight, as `flight_polynomial` says; None if it is no such polynomial."""
        return flight_polynomial(self.value)


def trace_expression(
    function: Callable[[Any], Any], columns: Mapping[str, Any] | None = None, label: str = ""
) -> ExpressionTrace:
    """What ``function`` computes of a body, as a graph.

    Parameters
    ----------
    function
        Takes ``body`` and returns one number an object: shape (n, 1), (n,) or (). Numbers that it closes over are read now, and are constants.
    columns
        Columns that are known, with their ``unit``; others that it reads may have any.
    label
        What messages call it.

    Raises
    ------
    TraceError
        If it does what no formula may do, gives something else when it is read again, or returns no number; the author's line is named.
    DimensionError
        If it adds, compares or chooses between quantities that do not go together.
    TracedBranchError
        If it decides in Python on what is no number yet.
    """
    known = dict(columns or {})
    label = label or getattr(function, "__qualname__", type(function).__name__)
    before = _chance()
    first = _read(function, known, label)
    if _chance() != before:
        raise TraceError(
            f"{label} draws random numbers: how often it is called is the engine's affair. Draw them in a free-form law, from self.random, "
            "which sets a column"
        )
    second = _read(function, known, label)
    _check_same(label, first.graph.nodes, second.graph.nodes)
    _check_same(label, [first.value], [second.value])
    return first


class _Graph(Graph):
    """A graph in which a number of the text has the unit that fits."""

    def const(self, value: float, dim: Dimension | None = NONE) -> Node:
        return super().const(value, None if dim == NONE else dim)

    def _dimension(self, op: str, args: tuple[Node, ...]) -> Dimension | None:
        if op in _FREE:
            return NONE  # of a number in SI: a factor 1, of whatever unit, is left out
        return super()._dimension(op, args)


_FREE = frozenset(
    (
        "exp",
        "expm1",
        "log",
        "log1p",
        "sin",
        "cos",
        "tan",
        "asin",
        "acos",
        "atan",
        "sinh",
        "cosh",
        "tanh",
        "floor",
        "pow",
    )
)


class _Recording(Recording):
    """A reading of an expression, which is no method of a law."""

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.graph = _Graph(label)

    @property
    def apply(self) -> str:
        return "a free-form law woken by Elapsed, which may ask anything"

    @property
    def where(self) -> str:
        return self.label


def _read(function: Callable[[Any], Any], columns: Mapping[str, Any], label: str) -> ExpressionTrace:
    """One reading of ``function``."""
    recording = _Recording(label)
    body = TracedBody(recording, dict(columns), "")
    try:
        result = _called(recording, SimpleNamespace(expression=function), "expression", [body])
        value = _value_of(recording, result)
    except TraceError:
        _check_names(recording, columns)  # a slip of the finger is the better news
        raise
    _check_names(recording, columns)
    return ExpressionTrace(label, recording.graph, value)


def _value_of(recording: Recording, result: Any) -> Node:
    """``result`` as one node; raises `TraceError`."""
    if result is None:
        raise TraceError(f"{recording.where} returned None: is a `return` missing?")
    if isinstance(result, bool):
        raise TraceError(f"{recording.where} gave {result}, which goes through no zero; {WANTED}")
    values = _returned(recording, result, WANTED)
    if values.form not in (NUMBER, LIST, Form(True, 1), Form(False, 1)):
        raise TraceError(
            f"{recording.where} returned {_described(values)}; {WANTED}. {at(values.nodes[0].place)}".rstrip()
        )
    value = values.nodes[0]
    if value.truth:
        raise TraceError(
            f"{recording.where} gave True or False, which goes through no zero: give a difference, such as body.position.z - 2.0 for z > 2. "
            f"{at(value.place)}".rstrip()
        )
    return value


def _check_names(recording: Recording, columns: Mapping[str, Any]) -> None:
    """Raise `TraceError` for what an expression has not, and for a name that looks like a slip of the finger."""
    at_hand = [*(name for name in PROPERTIES if name != "since"), *columns]
    for node in recording.graph.nodes:
        if node.op != "input" or node.value.name in at_hand:
            continue
        name = node.value.name
        near = get_close_matches(name, at_hand, n=1, cutoff=0.8)
        if name == "since":
            raise TraceError(
                f"{recording.where} reads body.since, which is when an object came under a law; a condition has none: use body.time. {at(node.place)}"
            )
        if near:
            raise TraceError(
                f"{recording.where} reads body.{name}, which is no property and no column that a law here declares. "
                f'Did you mean "{near[0]}"? {at(node.place)}'
            )


def place_of(trace: ExpressionTrace, name: str) -> Place:
    """The author's line that reads ``name``."""
    return next(node.place for node in trace.inputs if node.value.name == name)


__all__ = ["ExpressionTrace", "place_of", "trace_expression"]
