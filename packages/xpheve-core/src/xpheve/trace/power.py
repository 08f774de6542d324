"""The power of a law, and the rate at which its potential changes, as nodes of its graph."""

from __future__ import annotations

from dataclasses import dataclass

from xpheve.trace.derivative import COMPONENTS, gradient
from xpheve.trace.graph import Graph, Input, Node
from xpheve.trace.law_trace import LawTrace


@dataclass(frozen=True)
class Balance:
    """Power F . v + torque . w [W], dU/dt along that motion [J/s], 0 without a potential, and the sum of the sizes of all their terms."""

    power: Node
    rate: Node
    size: Node


def balance(trace: LawTrace) -> Balance:
    """The energy that the law gives to the motion, and takes from its potential, in each moment.

    For a pair the force acts on a, its opposite on b. The potential follows position and, if it reads that, orientation; time is held.
    """
    graph = trace.graph
    before, graph.check_dimensions = graph.check_dimensions, False
    try:
        given: list[Node] = []
        taken: list[Node] = []
        for side, sign in (("a", 1.0), ("b", -1.0)) if trace.pair else (("", 1.0),):
            velocity, spin = _vector(graph, "velocity", side), _vector(graph, "angular_velocity", side)
            for what, motion in ((trace.force, velocity), (trace.torque, spin)):
                for one, rate in zip(what or (), motion, strict=bool(what)):
                    term = _times(graph, one, rate)
                    given.append(term if sign > 0.0 else graph.op("neg", term))
            if trace.potential is not None:
                for one, rate in zip(gradient(trace, "position", side), velocity, strict=True):
                    taken.append(_times(graph, one, rate))
                if any(node.op == "input" and node.value.name == "orientation" for node in graph.nodes):
                    slopes = gradient(trace, "orientation", side)
                    for one, rate in zip(slopes, _turning(graph, side, spin), strict=True):
                        taken.append(_times(graph, one, rate))
        sizes = [graph.op("abs", term) for term in (*given, *taken)]
        return Balance(_sum(graph, given), _sum(graph, taken), _sum(graph, sizes))
    finally:
        graph.check_dimensions = before


def _vector(graph: Graph, name: str, side: str) -> list[Node]:
    have = {node.value: node for node in graph.nodes if node.op == "input"}
    keys = [Input(side, name, k) for k in range(COMPONENTS[name])]
    return [have[key] if key in have else graph.input(name, key.component, None, side) for key in keys]


def _turning(graph: Graph, side: str, spin: list[Node]) -> list[Node]:
    """dq/dt = (0, w) q / 2, w in the world frame (E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, VII.5)."""
    w, x, y, z = _vector(graph, "orientation", side)
    a, b, c = spin

    def add(*terms: tuple[float, Node, Node]) -> Node:
        total = graph.const(0.0)
        for sign, one, other in terms:
            total = graph.op("+" if sign > 0 else "-", total, graph.op("*", one, other))
        return graph.op("*", graph.const(0.5), total)

    return [
        add((-1, a, x), (-1, b, y), (-1, c, z)),
        add((1, a, w), (1, b, z), (-1, c, y)),
        add((1, b, w), (1, c, x), (-1, a, z)),
        add((1, c, w), (1, a, y), (-1, b, x)),
    ]


def _times(graph: Graph, one: Node, other: Node) -> Node:
    if any(node.op == "const" and node.value == 0.0 for node in (one, other)):
        return graph.const(0.0)
    return graph.op("*", one, other)


def _sum(graph: Graph, terms: list[Node]) -> Node:
    total = graph.const(0.0)
    for term in terms:
        if not (term.op == "const" and term.value == 0.0):
            total = graph.op("+", total, term)
    return total
