"""The power of a law, and the rate at which its potential changes, as nodes of its graph."""

from __future__ import annotations

from dataclasses import dataclass

from xpheve.trace.derivative import COMPONENTS, gradient, is_zero, unchecked
from xpheve.trace.graph import Graph, Input, Node, walk
from xpheve.trace.law_trace import LawTrace


@dataclass(frozen=True)
class Balance:
    """What a law gives to the motion, and takes from its potential.

    ``power`` [W] is F . v, and torque . w with it unless there is a potential that reads no orientation: that is of the force alone.
    ``rate`` [J/s] is dU/dt along the motion, 0 without a potential, ``size`` the sum of the sizes of the terms of both. ``turning`` and
    ``turning_size`` are the same of a torque that ``power`` leaves out.
    """

    power: Node
    rate: Node
    size: Node
    turning: Node
    turning_size: Node


def balance(trace: LawTrace) -> Balance:
    """The energy that the law gives to the motion, and takes from its potential, in each moment.

    For a pair the force acts on a, its opposite on b. The potential follows position and, if it reads that, orientation; time is held.
    """
    graph = trace.graph
    turns = trace.potential is not None and reads_orientation(trace.potential)
    with unchecked(graph):
        given: list[Node] = []
        taken: list[Node] = []
        apart: list[Node] = []
        for side, sign in (("a", 1.0), ("b", -1.0)) if trace.pair else (("", 1.0),):
            velocity, spin = _vector(graph, "velocity", side), _vector(graph, "angular_velocity", side)
            for one, rate in zip(trace.force or (), velocity, strict=trace.force is not None):
                term = _times(graph, one, rate)
                given.append(term if sign > 0.0 or is_zero(term) else graph.op("neg", term))
            for one, rate in zip(trace.torque or (), spin, strict=trace.torque is not None):
                (given if turns or trace.potential is None else apart).append(_times(graph, one, rate))
            if trace.potential is not None:
                slopes = gradient(trace, "position", side)
                taken += [_times(graph, one, rate) for one, rate in zip(slopes, velocity, strict=True)]
            if turns:
                slopes = gradient(trace, "orientation", side)
                motion = _turning(graph, side, spin)
                taken += [_times(graph, one, rate) for one, rate in zip(slopes, motion, strict=True)]
        return Balance(
            _sum(graph, given),
            _sum(graph, taken),
            _sum(graph, [graph.op("abs", term) for term in (*given, *taken)]),
            _sum(graph, apart),
            _sum(graph, [graph.op("abs", term) for term in apart]),
        )


def reads_orientation(node: Node) -> bool:
    """Whether ``node`` depends on how objects are turned."""
    return any(one.op == "input" and one.value.name == "orientation" for one in walk([node]))


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
    if is_zero(one) or is_zero(other):
        return graph.const(0.0)
    return graph.op("*", one, other)


def _sum(graph: Graph, terms: list[Node]) -> Node:
    total = graph.const(0.0)
    for term in terms:
        if not is_zero(term):
            total = graph.op("+", total, term)
    return total
