"""Laws whose force is affine in positions and velocities with the numbers that their parameters have: F = A x + B v + c.

A, B and c may depend on what objects have of their own, such as mass and charge. They are nodes of a graph, evaluated in ~32 digits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from xpheve.laws import ContinuousLaw
from xpheve.steppers.wide import Wide, wide
from xpheve.trace.derivative import derivatives, is_zero
from xpheve.trace.emit import ARRAY
from xpheve.trace.fold import folded
from xpheve.trace.graph import Graph, Input, Node, walk
from xpheve.trace.law_trace import LawTrace
from xpheve.trace.nature import AFFINE, TIMED, degrees
from xpheve.trace.samples import parameters_of

KEPT = 32
"""Sets of numbers of one formula of which the result is kept."""
MOVING = ("position", "velocity")


@dataclass(frozen=True)
class AffineLaw:
    """A law whose force is affine.

    ``slopes`` has, by side ("" of a field law, else "a" and "b") and name ("position" or "velocity"), three rows of three nodes, the derivatives of
    the force, where not all are 0; ``graph`` has all nodes, ``force`` the force itself.
    """

    graph: Graph
    force: tuple[Node, ...]
    slopes: Mapping[tuple[str, str], tuple[tuple[Node, ...], ...]]

    @cached_property
    def outputs(self) -> list[Node]:
        """All slopes, then the force."""
        return [*(node for rows in self.slopes.values() for row in rows for node in row), *self.force]

    @cached_property
    def crosses(self) -> bool:
        """Whether a component of the force depends on another component of place or velocity."""
        return any(
            not is_zero(node)
            for rows in self.slopes.values()
            for i, row in enumerate(rows)
            for j, node in enumerate(row)
            if i != j
        )


_KNOWN: WeakKeyDictionary[LawTrace, dict[tuple[Any, ...], AffineLaw | None]] = WeakKeyDictionary()


def affine_law(law: ContinuousLaw, trace: LawTrace, points: bool) -> AffineLaw | None:
    """``law`` as an affine one; None if it is none, or turns what it acts on.

    Parameters
    ----------
    law
        Whose parameters' numbers count.
    trace
        Its trace.
    points
        Whether it acts on points alone, whose inertia is 0: they feel no torque that is in proportion to it.
    """
    numbers = parameters_of(law, trace.parameters)
    key = (points, *numbers.values())
    known = _KNOWN.setdefault(trace, {})
    if key not in known:
        if len(known) >= KEPT:
            known.clear()
        known[key] = _affine(trace, numbers, points)
    return known[key]


def _affine(trace: LawTrace, numbers: Mapping[Any, float], points: bool) -> AffineLaw | None:
    sides = ("a", "b") if trace.pair else ("",)
    inputs = {Input(side, "inertia", k): 0.0 for side in sides for k in range(3)} if points else {}
    graph, nodes = folded(trace.motion, numbers, inputs)
    count = 0 if trace.force is None else 3
    force, torque = nodes[:count], nodes[count:]
    if not all(map(is_zero, torque)):
        return None
    force = force or [graph.const(0.0)] * 3
    names = {node.value.name for node in walk(force) if node.op == "input"}
    if names & {"orientation", "angular_velocity", "time"}:
        return None
    if any(node.op in ("kernel", "pick") for node in walk(force)):
        return None
    if any(degree > AFFINE or degree == TIMED for degree in degrees(force)):
        return None
    slopes = {}
    for side in sides:
        for name in MOVING:
            columns = [derivatives(graph, force, graph.input(name, k, None, side)) for k in range(3)]
            rows = tuple(tuple(column[i] for column in columns) for i in range(3))
            if not all(is_zero(node) for row in rows for node in row):
                slopes[side, name] = rows
    return AffineLaw(graph, tuple(force), slopes)


def evaluated(nodes: list[Node], inputs: Mapping[Input, Any]) -> list[Wide]:
    """``nodes`` in ~32 digits, of arrays (n,) or numbers by input; functions other than roots are those of floats."""
    values: dict[int, Any] = {}
    with np.errstate(all="ignore"):
        for node in walk(nodes):
            values[node.index] = _value(node, [values[arg.index] for arg in node.args], inputs)
    return [values[node.index] for node in nodes]


def _value(node: Node, args: list[Any], inputs: Mapping[Input, Any]) -> Any:
    op = node.op
    if op == "const":
        return Wide(node.value)
    if op == "input":
        return wide(inputs[node.value])
    if op in EXACT:
        return EXACT[op](*args)
    plain = [arg.high if isinstance(arg, Wide) else arg for arg in args]
    if op == "where":
        which, (a, b) = plain[0], args[1:]
        return Wide(np.where(which, a.high, b.high), np.where(which, a.low, b.low))
    if op == "table":
        return Wide(node.value(np.asarray(plain[0])))
    if op in CHOICES:
        return CHOICES[op](*plain)
    return Wide(getattr(np, ARRAY[op].removeprefix("np."))(*plain))


EXACT: dict[str, Callable[..., Wide]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "neg": lambda a: -a,
    "sqrt": lambda a: a.root(),
}
CHOICES: dict[str, Callable[..., Any]] = {
    "<": np.less,
    "<=": np.less_equal,
    ">": np.greater,
    ">=": np.greater_equal,
    "==": np.equal,
    "!=": np.not_equal,
    "and": np.logical_and,
    "or": np.logical_or,
    "not": np.logical_not,
}
