"""An expression of an object as a polynomial in the time since its flight began, where it is one by its structure.

Along a ballistic flight the position is x + v s + a s^2 / 2, the velocity v + a s and the time t0 + s. Sums and products of polynomials are
polynomials; so is a quotient by, and any function of, what no flight changes. The coefficients are a graph of their own, computed once a flight.
"""

from __future__ import annotations

from collections.abc import Sequence

from xpheve.laws.view import STATE
from xpheve.trace.graph import Graph, Node, walk
from xpheve.trace.numpy_text import GraphFunction, scalar_function

DEGREE = 4
"""The highest that `xpheve.kernels.polynomial` takes."""

MOST = 2000
"""Operations of the coefficients; beyond it windows are cheaper."""

Coefficients = tuple[Node, ...]
"""From the constant upwards; no trailing zeros, but for the constant itself."""


def flight_polynomial(value: Node) -> GraphFunction | None:
    """The five coefficients of ``value`` by time since the flight began; None if it is no polynomial of degree at most four.

    Inputs of the function are those of the flight's beginning: ``position``, ``velocity``, ``acceleration``, ``time``, and what does not change.
    """
    graph = Graph(check_dimensions=False)
    made: dict[int, Coefficients] = {}
    for node in walk([value]):
        found = _leaf(graph, node) if not node.args else _combined(graph, node, [made[arg.index] for arg in node.args])
        if found is None or len(graph.nodes) > MOST:
            return None
        made[node.index] = found
    found = made[value.index]
    return scalar_function([*found, *([graph.const(0.0)] * (DEGREE + 1 - len(found)))])


def _leaf(graph: Graph, node: Node) -> Coefficients | None:
    if node.op == "const":
        return (graph.const(node.value),)
    if node.op != "input":
        return None
    name, k = node.value.name, node.value.component
    if name in ("position", "velocity"):
        v, a = graph.input("velocity", k), graph.input("acceleration", k)
        if name == "velocity":
            return v, a
        return graph.input("position", k), v, graph.op("*", graph.const(0.5), a)
    if name in STATE:
        return None
    start = graph.input(name, k)
    return (start, graph.const(1.0)) if name == "time" else (start,)


def _combined(graph: Graph, node: Node, args: Sequence[Coefficients]) -> Coefficients | None:
    """The coefficients of an operation on polynomials."""
    op = node.op
    if all(len(one) == 1 for one in args):
        return (_again(graph, node, [one[0] for one in args]),)
    if op in ("+", "-"):
        return _sum(graph, op, *args)
    if op == "neg":
        return tuple(graph.op("neg", one) for one in args[0])
    if op == "*":
        return _product(graph, *args)
    if op == "/" and len(args[1]) == 1:
        return tuple(graph.op("/", one, args[1][0]) for one in args[0])
    if op == "where" and len(args[0]) == 1:
        size = max(len(args[1]), len(args[2]))
        one, other = ([*c, *([graph.const(0.0)] * (size - len(c)))] for c in args[1:])
        return tuple(graph.op("where", args[0][0], p, q) for p, q in zip(one, other, strict=True))
    return None


def _again(graph: Graph, node: Node, args: Sequence[Node]) -> Node:
    """The operation ``node`` on what no flight changes."""
    if node.op == "table":
        return graph.table(node.value, args[0], None)
    if node.op == "pow" and args[1].op == "const":
        return graph.power(args[0], args[1].value)
    return graph.op(node.op, *args)


def _sum(graph: Graph, op: str, one: Coefficients, other: Coefficients) -> Coefficients:
    found = []
    for k in range(max(len(one), len(other))):
        if k >= len(other):
            found.append(one[k])
        elif k >= len(one):
            found.append(graph.op("neg", other[k]) if op == "-" else other[k])
        else:
            found.append(graph.op(op, one[k], other[k]))
    return tuple(found)


def _product(graph: Graph, one: Coefficients, other: Coefficients) -> Coefficients | None:
    if len(one) + len(other) - 2 > DEGREE:
        return None
    found: list[Node] = []
    for k in range(len(one) + len(other) - 1):
        total: Node | None = None
        for i in range(max(0, k + 1 - len(other)), min(k, len(one) - 1) + 1):
            term = graph.op("*", one[i], other[k - i])
            total = term if total is None else graph.op("+", total, term)
        assert total is not None
        found.append(total)
    return tuple(found)
