"""A law's graph with the present numbers of its parameters in it, and what follows from them taken out: 0 x = 0, x + 0 = x, u/u = 1.

A spring without rest length is linear, F = -k (|d|/|d|) d, but only by its numbers. Arithmetic of other numbers than 0 and 1 is left
standing, so that it can be done with more digits than a float has.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from xpheve.kernels import ieee
from xpheve.trace.emit import SCALAR
from xpheve.trace.graph import COMPARISONS, LOGIC, Graph, Input, Node, Parameter, walk

TINY = 1e-100
"""A bound below it keeps a length from being 0 where one divides by it, and means nothing else."""

Factors = tuple[tuple[Node, ...], tuple[Node, ...]]
"""A product, as what is above and what is below its line."""


def folded(
    nodes: Sequence[Node], parameters: Mapping[Parameter, float], inputs: Mapping[Input, float] | None = None
) -> tuple[Graph, list[Node]]:
    """``nodes`` in a graph of their own, with numbers in the place of parameters, and of some ``inputs``."""
    folder = _Folder(parameters, inputs or {})
    return folder.graph, folder.fold(nodes)


class Unrounded(Graph):
    """A graph that leaves arithmetic of numbers standing, so that nothing is rounded."""

    def _fold(self, op: str, args: tuple[Node, ...]) -> Node | None:
        found = super()._fold(op, args)
        return None if found is not None and found.op == "const" and op in ("+", "-", "*", "/", "sqrt") else found


class _Folder:
    def __init__(self, parameters: Mapping[Parameter, float], inputs: Mapping[Input, float]) -> None:
        self.graph = Unrounded(check_dimensions=False)
        self.parameters, self.inputs = parameters, inputs
        self.factors: dict[int, Factors] = {}
        self.values: dict[int, float | None] = {}

    def fold(self, nodes: Sequence[Node]) -> list[Node]:
        made: dict[int, Node] = {}
        for node in walk(nodes):
            made[node.index] = self._made(node, [made[arg.index] for arg in node.args])
        return [made[node.index] for node in nodes]

    def _const(self, value: float) -> Node:
        return self.graph.const(value, None)

    def _made(self, node: Node, args: list[Node]) -> Node:
        if node.op == "const":
            return self._const(node.value)
        if node.op == "param":
            return self._const(self.parameters[node.value])
        if node.op == "input":
            if node.value in self.inputs:
                return self._const(self.inputs[node.value])
            return self.graph.input(node.value.name, node.value.component, None, node.value.side)
        if node.op == "table":
            return self.graph.table(node.value, args[0], None)
        if node.op in ("kernel", "pick"):
            return self.graph._node(node.op, tuple(args), node.value, None, False)
        rule = RULES.get(node.op)
        return rule(self, *args) if rule else self._plain(node.op, *args)

    def _plain(self, op: str, *args: Node) -> Node:
        """The operation itself; a number where it is a decision, or 0, of numbers."""
        found = self.graph._node(op, args, None, None, op in COMPARISONS or op in LOGIC)
        value = self.value(found)
        return self._const(0.0) if value == 0.0 and op not in COMPARISONS and op not in LOGIC else found

    def value(self, node: Node) -> float | None:
        """What ``node`` is if it is made of numbers alone; None if it is not."""
        if node.index not in self.values:
            args = [self.value(arg) for arg in node.args]
            known = node.op not in ("input", "kernel", "pick") and None not in args
            self.values[node.index] = _computed(node, args) if known else None
        return self.values[node.index]

    def is_zero(self, node: Node) -> bool:
        return node.op == "const" and node.value == 0.0

    # Rules

    def plus(self, a: Node, b: Node) -> Node:
        if self.is_zero(a):
            return b
        return a if self.is_zero(b) else self._plain("+", a, b)

    def minus(self, a: Node, b: Node) -> Node:
        if a is b:
            return self._const(0.0)
        if self.is_zero(b):
            return a
        return self.negative(b) if self.is_zero(a) else self._plain("-", a, b)

    def negative(self, a: Node) -> Node:
        if self.is_zero(a):
            return a
        found = a.args[0] if a.op == "neg" else self._plain("neg", a)
        above, below = self._factors_of(a)
        self.factors.setdefault(found.index, ((self._const(-1.0), *above), below))
        return found

    def times(self, a: Node, b: Node) -> Node:
        if self.is_zero(a) or self.is_zero(b):
            return self._const(0.0)
        for one, other in ((a, b), (b, a)):
            if self.value(one) == 1.0:
                return other
        (up, down), (more, less) = self._factors_of(a), self._factors_of(b)
        return self._cancelled((*up, *more), (*down, *less)) or self._product("*", a, b, (*up, *more), (*down, *less))

    def over(self, a: Node, b: Node) -> Node:
        if self.is_zero(a) and not self.is_zero(b):
            return a
        if self.value(b) == 1.0:
            return a
        (up, down), (more, less) = self._factors_of(a), self._factors_of(b)
        return self._cancelled((*up, *less), (*down, *more)) or self._product("/", a, b, (*up, *less), (*down, *more))

    def where(self, which: Node, a: Node, b: Node) -> Node:
        if a is b:
            return a
        value = self.value(which)
        return self._plain("where", which, a, b) if value is None else a if value else b

    # Products

    def _factors_of(self, node: Node) -> Factors:
        return self.factors.get(node.index, ((node,), ()))

    def _product(self, op: str, a: Node, b: Node, above: tuple[Node, ...], below: tuple[Node, ...]) -> Node:
        found = self._plain(op, a, b)
        self.factors.setdefault(found.index, (above, below))
        return found

    def _cancelled(self, above: Sequence[Node], below: Sequence[Node]) -> Node | None:
        """The product without factors that are above and below the line; None if there are none.

        ``u / max(u, tiny)`` goes only beside a factor that is no larger than u: what is changed then, where u < tiny, is smaller yet.
        """
        up, down = list(above), list(below)
        for one in below:
            u = self._kept_from_zero(one)
            if one in up and self.value(one) is None:
                up.remove(one)
                down.remove(one)
            elif u is not None and u in up and any(_is_within(w, u) for w in up):
                up.remove(u)
                down.remove(one)
        if len(down) == len(below):
            return None
        found = self._const(1.0)
        for one in up:
            found = self.times(found, one)
        for one in down:
            found = self.over(found, one)
        return found

    def _kept_from_zero(self, node: Node) -> Node | None:
        """u of max(u, tiny)."""
        if node.op != "max":
            return None
        for u, bound in (node.args, node.args[::-1]):
            value = self.value(bound)
            if value is not None and 0.0 < value <= TINY:
                return u
        return None


RULES: dict[str, Callable[..., Node]] = {
    "+": _Folder.plus,
    "-": _Folder.minus,
    "*": _Folder.times,
    "/": _Folder.over,
    "neg": _Folder.negative,
    "where": _Folder.where,
}


def _is_within(w: Node, u: Node) -> bool:
    """Whether |w| <= u follows from how u is made: the root of a sum of squares, w w among them."""
    if u.op == "abs":
        return u.args[0] is w
    if u.op == "hypot":
        return any(arg is w or _is_within(w, arg) for arg in u.args)
    if u.op != "sqrt":
        return False
    terms = [u.args[0]]
    squares = []
    while terms:
        one = terms.pop()
        if one.op == "+":
            terms += one.args
        elif one.op == "*" and one.args[0] is one.args[1]:
            squares.append(one.args[0])
        else:
            return False
    return w in squares


def _computed(node: Node, args: Sequence[Any]) -> float:
    """The operation of ``node`` on numbers, as any tier does it."""
    op = node.op
    if op == "const":
        return float(node.value)
    if op == "table":
        return float(node.value(args[0]))
    return float(DECISIONS[op](*args) if op in DECISIONS else _function(op)(*args))


def _function(op: str) -> Callable[..., float]:
    name = SCALAR[op]
    if name.startswith("ieee__"):
        found: Callable[..., float] = getattr(ieee, name.removeprefix("ieee__"))
        return found
    return abs if name == "abs" else getattr(math, name.removeprefix("math."))


DECISIONS: dict[str, Callable[..., Any]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "neg": lambda a: -a,
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
    "==": lambda a, b: a == b,
    "!=": lambda a, b: a != b,
    "and": lambda a, b: a and b,
    "or": lambda a, b: a or b,
    "not": lambda a: not a,
    "where": lambda which, a, b: a if which else b,
}
"""Operations that the scalar text spells with signs."""
