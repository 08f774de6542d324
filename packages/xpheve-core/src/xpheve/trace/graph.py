"""A law's arithmetic as a graph of scalar operations. Equal nodes are one node, so common parts are computed once.

Vectors are three nodes, quaternions four: there is no other arithmetic than that of one float with another, so that every tier (text that
is interpreted, compiled, or run on NumPy arrays) makes the same roundings in the same order.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

from xpheve.errors import DimensionError
from xpheve.units import NONE, Dimension, show

# What an operation asks of the dimensions of its arguments, and gives.
SAME = ("+", "-", "min", "max")
COMPARISONS = ("<", "<=", ">", ">=", "==", "!=")
LOGIC = ("and", "or", "not")


class Input(NamedTuple):
    """One number that is given to a law for each object: ``side`` is "a" or "b" for pairs, else ""."""

    side: str
    name: str
    component: int


class Parameter(NamedTuple):
    """One number of a law's parameter, the same for all objects."""

    name: str
    component: int


class Node:
    """One operation. ``op`` is "const", "input", "param", "table", "kernel", "pick", or an operation on ``args``; ``value`` belongs to the first six.

    ``dim`` is None where any dimension fits: zero, infinity, NaN. ``truth`` tells comparisons from numbers. ``place`` is the author's line.
    """

    __slots__ = ("args", "dim", "index", "op", "place", "truth", "value")

    def __init__(
        self, index: int, op: str, args: tuple[Node, ...], value: Any, dim: Dimension | None, truth: bool, place: Place
    ) -> None:
        self.index, self.op, self.args, self.value = index, op, args, value
        self.dim, self.truth, self.place = dim, truth, place

    def __repr__(self) -> str:
        inside = ", ".join(str(a.index) for a in self.args) if self.args else repr(self.value)
        return f"<{self.index}: {self.op}({inside})>"


class Graph:
    """Makes nodes, each once. ``check_dimensions`` is off where a graph is made of formulas that were checked already."""

    def __init__(self, label: str = "", check_dimensions: bool = True) -> None:
        self.label = label
        self.check_dimensions = check_dimensions
        self.nodes: list[Node] = []
        self._known: dict[tuple[Any, ...], Node] = {}

    # Leaves

    def const(self, value: float, dim: Dimension | None = NONE) -> Node:
        """A number of the text itself; 0, infinity and NaN fit any dimension."""
        value = float(value)
        free = value == 0.0 or not math.isfinite(value)
        key = (value.hex(), None if free else dim)
        return self._node("const", (), value, None if free else dim, False, key)

    def input(self, name: str, component: int = 0, dim: Dimension | None = NONE, side: str = "") -> Node:
        """A number that each object has."""
        return self._node("input", (), Input(side, name, component), dim, False)

    def param(self, name: str, component: int = 0, dim: Dimension | None = NONE) -> Node:
        """A number of a parameter."""
        return self._node("param", (), Parameter(name, component), dim, False)

    # Operations

    def op(self, op: str, *args: Node) -> Node:
        """The node of ``op`` on ``args``, its dimension checked.

        Raises
        ------
        DimensionError
            If quantities are added, compared or given to a function that do not go together; the author's line is named.
        """
        folded = self._fold(op, args)
        if folded is not None:
            return folded
        dim = self._dimension(op, args)
        return self._node(op, args, None, dim, op in COMPARISONS or op in LOGIC)

    def power(self, base: Node, exponent: float) -> Node:
        """``base`` to a constant ``exponent``: by multiplications for small whole ones, by roots for halves; else by "pow"."""
        if exponent == 0.0:
            return self.const(1.0)
        if exponent == int(exponent) and 1 <= abs(exponent) <= 8:
            found = self._whole_power(base, int(abs(exponent)))
            return found if exponent > 0 else self.op("/", self.const(1.0), found)
        if exponent == 0.5:
            return self.op("sqrt", base)
        dim = None if base.dim is None else tuple(one * exponent for one in base.dim)
        return self._node("pow", (base, self.const(exponent)), None, dim, False)

    def _whole_power(self, base: Node, exponent: int) -> Node:
        if exponent == 1:
            return base
        half = self._whole_power(base, exponent // 2)
        square = self.op("*", half, half)
        return self.op("*", square, base) if exponent % 2 else square

    def table(self, table: Any, x: Node, dim: Dimension | None) -> Node:
        """What ``table``, an `xpheve.trace.table.Table`, gives at ``x``."""
        return self._node("table", (x,), table, dim, False, (id(table),))

    def call(self, kernel: tuple[str, str, str], args: Sequence[Node], widths: Sequence[int], count: int) -> list[Node]:
        """The ``count`` numbers that ``force`` of a kernel file written by hand gives for ``args``.

        ``kernel`` is its name in texts, its path and a hash of it; ``widths`` says which args go together as tuples, 0 being a number.
        """
        called = self._node("kernel", tuple(args), (kernel, tuple(widths)), None, False)
        return [self._node("pick", (called,), c, None, False) for c in range(count)]

    # Inside

    def _node(
        self,
        op: str,
        args: tuple[Node, ...],
        value: Any,
        dim: Dimension | None,
        truth: bool,
        mark: tuple[Any, ...] = (),
    ) -> Node:
        key = (op, *(arg.index for arg in args), *(mark or (value,)))
        found = self._known.get(key)
        if found is None:
            found = self._known[key] = Node(len(self.nodes), op, args, value, dim, truth, author_place())
            self.nodes.append(found)
        return found

    def _fold(self, op: str, args: tuple[Node, ...]) -> Node | None:
        """The result where it is known beforehand and no bit can differ."""
        if op == "*":
            for one, other in (args, args[::-1]):
                if one.op == "const" and one.value == 1.0 and one.dim == NONE:
                    return other
        if op == "/" and args[1].op == "const" and args[1].value == 1.0 and args[1].dim == NONE:
            return args[0]
        if op == "neg" and args[0].op == "neg":
            return args[0].args[0]
        if op in ARITHMETIC and all(arg.op == "const" for arg in args):
            try:
                value = ARITHMETIC[op](*(arg.value for arg in args))
            except (ZeroDivisionError, OverflowError, ValueError):
                return None
            return self.const(value, self._dimension(op, args))
        if op == "where" and args[1] is args[2]:
            return args[1]
        return None

    def _dimension(self, op: str, args: tuple[Node, ...]) -> Dimension | None:
        dims = [arg.dim for arg in args]
        if op in ("*", "/"):
            if dims[0] is None or dims[1] is None:
                return None
            sign = 1 if op == "*" else -1
            return tuple(a + sign * b for a, b in zip(dims[0], dims[1], strict=True))
        if op in ("neg", "abs"):
            return dims[0]
        if op == "sqrt":
            return None if dims[0] is None else tuple(0.5 * one for one in dims[0])
        if op == "cbrt":
            return None if dims[0] is None else tuple(one / 3.0 for one in dims[0])
        if op in ("sign", *LOGIC):
            return NONE
        if op == "where":
            return self._same(op, args[1:])
        if op in COMPARISONS or op == "atan2":
            self._same(op, args)
            return NONE
        if op in (*SAME, "hypot"):
            return self._same(op, args)
        # what is left takes pure numbers: exp, sin, floor, pow with a varying exponent
        for arg in args:
            if self.check_dimensions and arg.dim is not None and not equal(arg.dim, NONE):
                raise DimensionError(
                    f"{self.label}: {op} of {show(arg.dim)}: it takes a pure number, so divide by a scale first. {at(author_place())}"
                )
        return NONE

    def _same(self, op: str, args: Sequence[Node]) -> Dimension | None:
        """The dimension that all ``args`` have."""
        given = [arg.dim for arg in args if arg.dim is not None]
        if not given:
            return None
        if self.check_dimensions:
            for arg in args:
                if arg.dim is not None and not equal(arg.dim, given[0]):
                    raise DimensionError(self._mixed(op, given[0], arg.dim, args))
        return given[0]

    def _mixed(self, op: str, one: Dimension, other: Dimension, args: Sequence[Node]) -> str:
        verb = {"+": "adds", "-": "subtracts", "where": "chooses between"}.get(op, "compares")
        hint = ""
        literal = [arg for arg in args if arg.op == "const" and arg.dim == NONE]
        if literal:
            unit = show(next(d for d in (one, other) if not equal(d, NONE)))
            hint = f" A number in the text has no unit: declare it, Constant({literal[0].value!r}, unit={unit!r}), or as a Param."
        return f"{self.label} {verb} {show(one)} and {show(other)}. {at(author_place())}{hint}"


ARITHMETIC: dict[str, Callable[..., float]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "neg": lambda a: -a,
    "abs": abs,
    "sqrt": math.sqrt,
}
"""Operations that are folded where all arguments are numbers of the text: those that every tier rounds alike."""


def equal(a: Dimension, b: Dimension) -> bool:
    """Whether two dimensions are one; exponents of roots are compared with room for rounding."""
    return all(abs(x - y) < 1e-9 for x, y in zip(a, b, strict=True))


def at(place: Place) -> str:
    """``place`` as the end of a message."""
    return f"At {line_of(place)}." if place[0] else ""


HOUSE = (
    "xpheve.trace",
    "xpheve.laws",
    "xpheve.loop",
    "xpheve.plan",
    "xpheve.engine",
    "xpheve.scene",
    "xpheve.realtime",
    "numpy",
)
"""Modules whose frames are never the author's line."""

Place = tuple[str, int]
"""A file and a line of it."""


def author_place() -> Place:
    """Where the innermost frame stands that is not the tracer's own."""
    frame: Any = sys._getframe(2)
    while frame is not None:
        module = frame.f_globals.get("__name__") or ""
        if not module.startswith(HOUSE):
            return frame.f_code.co_filename, frame.f_lineno
        frame = frame.f_back
    return "", 0


def line_of(place: Place) -> str:
    """``file:line: text`` of ``place``; without the text where there is none to read, as at a prompt."""
    import linecache

    name, line = place
    if not name:
        return ""
    text = linecache.getline(name, line).strip()
    return f"{name.replace(chr(92), '/').rpartition('/')[2]}:{line}{text and ': '}{text}"


def walk(outputs: Sequence[Node]) -> Iterator[Node]:
    """Every node that ``outputs`` need, arguments first, each once; in an order that depends on the graph alone."""
    seen: set[int] = set()
    stack: list[tuple[Node, bool]] = [(node, False) for node in reversed(outputs)]
    while stack:
        node, done = stack.pop()
        if done:
            yield node
            continue
        if node.index in seen:
            continue
        seen.add(node.index)
        stack.append((node, True))
        stack.extend((arg, False) for arg in reversed(node.args) if arg.index not in seen)
