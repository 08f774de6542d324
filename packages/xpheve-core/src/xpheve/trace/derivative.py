"""Derivatives of a law's graph: forward, node by node, with common parts made once.

The chain rule is applied in the order of `walk` (forward mode; A. Griewank, A. Walther, Evaluating Derivatives, 2nd ed. 2008, chapter
3). The graph keeps equal nodes once, so that slopes are shared by all inputs and with the value itself; terms that are exactly zero are
never written.

Where a slope is infinite or has no direction it is *taken as zero*, so that the Jacobian of quadratic drag |v| v at rest is 0 and not NaN:
the slope of sqrt, cbrt, hypot and powers between 0 and 1 at 0, of abs and sign at 0, and of atan2 at the origin. For the length of a vector
that is the middle of its slopes in all directions. At a tie min and max have the slope of their first argument. Elsewhere the slopes are
those of IEEE arithmetic, such as infinity for asin at 1.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from xpheve.errors import InvalidValueError
from xpheve.trace.graph import COMPARISONS, LOGIC, Graph, Input, Node, walk
from xpheve.trace.law_trace import LawTrace
from xpheve.units import NONE

COMPONENTS = {"position": 3, "velocity": 3, "angular_velocity": 3, "inertia": 3, "up": 3, "orientation": 4}
"""Numbers of an input; all others have one."""
SCENE = ("time", "up")
"""Inputs that belong to the scene: they have no side."""

Row = tuple[Node, ...]


def derivative(graph: Graph, node: Node, wrt: Node) -> Node:
    """The derivative of ``node`` with respect to ``wrt``, an input or parameter; a node of ``graph``.

    Limits are defined as the module says: sqrt has slope 0 at 0. A derivative that is zero everywhere is the constant 0.
    """
    return derivatives(graph, (node,), wrt)[0]


def derivatives(graph: Graph, nodes: Sequence[Node], wrt: Node) -> list[Node]:
    """The derivatives of all ``nodes`` with respect to ``wrt``, in one pass."""
    with unchecked(graph):
        rules = _Rules(graph)
        found: dict[int, Node] = {wrt.index: graph.const(1.0)}
        for one in walk(nodes):
            if one.index not in found:
                found[one.index] = rules.slope(one, [found[arg.index] for arg in one.args])
        return [found[one.index] for one in nodes]


def jacobian(trace: LawTrace, name: str, side: str = "", of: str = "force") -> tuple[Row, ...]:
    """The derivatives of ``of``, "force" or "torque", with respect to the input ``name``.

    Parameters
    ----------
    trace
        Of a law that has such a method.
    name
        Such as "velocity", "position", "orientation" or "time".
    side
        "a" or "b" for a pair law; else "".

    Returns
    -------
    tuple
        Three rows, one an output component, each of as many nodes as the input has components: 3 x 3 for "velocity".

    Raises
    ------
    InvalidValueError
        If the law has no such output.
    """
    outputs: Sequence[Node] | None = {"force": trace.force, "torque": trace.torque}.get(of)
    if outputs is None:
        raise InvalidValueError(f"{trace.label} has no {of}, so it has no Jacobian of it")
    columns = [_column(trace.graph, outputs, wrt) for wrt in inputs_of(trace.graph, name, side)]
    return tuple(tuple(column[k] for column in columns) for k in range(len(outputs)))


def gradient(trace: LawTrace, name: str, side: str = "") -> Row:
    """The derivatives of the potential with respect to the components of the input ``name``.

    Raises
    ------
    InvalidValueError
        If the law has no potential.
    """
    if trace.potential is None:
        raise InvalidValueError(f"{trace.label} has no potential, so it has no gradient")
    return tuple(_column(trace.graph, (trace.potential,), wrt)[0] for wrt in inputs_of(trace.graph, name, side))


def inputs_of(graph: Graph, name: str, side: str = "") -> list[Node | None]:
    """The input nodes of ``name``, one a component; None for those that the graph does not read."""
    where = "" if name in SCENE else side
    have = {node.value: node for node in graph.nodes if node.op == "input"}
    return [have.get(Input(where, name, k)) for k in range(COMPONENTS.get(name, 1))]


def _column(graph: Graph, nodes: Sequence[Node], wrt: Node | None) -> list[Node]:
    return [graph.const(0.0)] * len(nodes) if wrt is None else derivatives(graph, nodes, wrt)


@contextmanager
def unchecked(graph: Graph) -> Iterator[None]:
    """No dimension is checked inside: derivatives of formulas that were checked are in order."""
    before, graph.check_dimensions = graph.check_dimensions, False
    try:
        yield
    finally:
        graph.check_dimensions = before


def is_zero(node: Node) -> bool:
    """Whether ``node`` is the constant 0."""
    return node.op == "const" and node.value == 0.0


class _Rules:
    """The slope of each operation, from the slopes of its arguments."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self.zero = graph.const(0.0)

    def slope(self, node: Node, slopes: Sequence[Node]) -> Node:
        """The derivative of ``node``, whose arguments have the derivatives ``slopes``."""
        if all(map(is_zero, slopes)) or node.op in COMPARISONS or node.op in LOGIC:
            return self.zero
        if node.op in CHAIN:
            return self.times(CHAIN[node.op](self, node), slopes[0])
        return RULES[node.op](self, node, slopes)

    # Arithmetic that knows 0

    def const(self, value: float) -> Node:
        return self.graph.const(value)

    def plus(self, a: Node, b: Node) -> Node:
        if is_zero(a):
            return b
        if is_zero(b):
            return a
        if a.op == b.op == "neg":
            return self.negative(self.plus(a.args[0], b.args[0]))
        return self.graph.op("+", a, b)

    def minus(self, a: Node, b: Node) -> Node:
        if is_zero(a):
            return self.negative(b)
        if is_zero(b):
            return a
        if a.op == b.op == "neg":
            return self.negative(self.minus(a.args[0], b.args[0]))
        return self.graph.op("-", a, b)

    def negative(self, a: Node) -> Node:
        return a if is_zero(a) else self.graph.op("neg", a)

    def times(self, a: Node, b: Node) -> Node:
        if is_zero(a) or is_zero(b):
            return self.zero
        for one, other in ((a, b), (b, a)):
            if one.op == "neg":  # signs outside, so that products are shared
                return self.negative(self.times(one.args[0], other))
            if one.op == "const" and one.value == -1.0 and one.dim == NONE:
                return self.negative(other)
        return self.graph.op("*", a, b)

    def over(self, a: Node, b: Node) -> Node:
        """a / b as a (1 / b): one division serves all inputs."""
        return self.times(a, self.graph.op("/", self.const(1.0), b))

    def unless_zero(self, what: Node, value: Node) -> Node:
        """``value``, but 0 where ``what`` is 0; NaN stays NaN."""
        return self.graph.op("where", self.graph.op("==", what, self.zero), self.zero, value)

    # One argument: its slope

    def of_sqrt(self, node: Node) -> Node:
        return self.unless_zero(node, self.graph.op("/", self.const(0.5), node))

    def of_cbrt(self, node: Node) -> Node:
        return self.unless_zero(node, self.graph.op("/", self.const(1.0 / 3.0), self.graph.op("*", node, node)))

    def of_log1p(self, node: Node) -> Node:
        return self.over(self.const(1.0), self.graph.op("+", self.const(1.0), node.args[0]))

    def of_tan(self, node: Node) -> Node:
        return self.graph.op("+", self.const(1.0), self.graph.op("*", node, node))

    def of_asin(self, node: Node) -> Node:
        # (1 - u)(1 + u) keeps the digits that 1 - u^2 loses near the ends
        one, u = self.const(1.0), node.args[0]
        inside = self.graph.op("*", self.graph.op("-", one, u), self.graph.op("+", one, u))
        return self.graph.op("/", one, self.graph.op("sqrt", inside))

    def of_atan(self, node: Node) -> Node:
        one, u = self.const(1.0), node.args[0]
        return self.graph.op("/", one, self.graph.op("+", one, self.graph.op("*", u, u)))

    def of_tanh(self, node: Node) -> Node:
        one = self.const(1.0)
        return self.graph.op("*", self.graph.op("-", one, node), self.graph.op("+", one, node))

    def of_table(self, node: Node) -> Node:
        slope = node.value.slope
        if slope is None:
            return self.zero
        return self.graph.table(slope, node.args[0], slope.dim)

    # More arguments

    def plus_rule(self, node: Node, slopes: Sequence[Node]) -> Node:
        return self.plus(slopes[0], slopes[1])

    def minus_rule(self, node: Node, slopes: Sequence[Node]) -> Node:
        return self.minus(slopes[0], slopes[1])

    def times_rule(self, node: Node, slopes: Sequence[Node]) -> Node:
        a, b = node.args
        if a is b:
            return self.times(self.graph.op("*", self.const(2.0), a), slopes[0])
        return self.plus(self.times(slopes[0], b), self.times(a, slopes[1]))

    def divide_rule(self, node: Node, slopes: Sequence[Node]) -> Node:
        return self.over(self.minus(slopes[0], self.times(node, slopes[1])), node.args[1])

    def power_rule(self, node: Node, slopes: Sequence[Node]) -> Node:
        base, exponent = node.args
        if exponent.op == "const":
            steep = self.times(exponent, self.graph.power(base, exponent.value - 1.0))
            if 0.0 < exponent.value < 1.0:
                steep = self.unless_zero(base, steep)
            return self.times(steep, slopes[0])
        below = self.graph.op("-", exponent, self.const(1.0))
        by_base = self.times(self.times(exponent, self.graph.op("pow", base, below)), slopes[0])
        grows = self.unless_zero(node, self.graph.op("*", node, self.graph.op("log", base)))
        return self.plus(by_base, self.times(grows, slopes[1]))

    def hypot_rule(self, node: Node, slopes: Sequence[Node]) -> Node:
        a, b = node.args
        inverse = self.unless_zero(node, self.graph.op("/", self.const(1.0), node))
        return self.times(self.plus(self.times(a, slopes[0]), self.times(b, slopes[1])), inverse)

    def atan2_rule(self, node: Node, slopes: Sequence[Node]) -> Node:
        y, x = node.args
        square = self.graph.op("+", self.graph.op("*", x, x), self.graph.op("*", y, y))
        inverse = self.unless_zero(square, self.graph.op("/", self.const(1.0), square))
        return self.times(self.minus(self.times(x, slopes[0]), self.times(y, slopes[1])), inverse)

    def min_rule(self, node: Node, slopes: Sequence[Node]) -> Node:
        return self.graph.op("where", self.graph.op("<=", *node.args), *slopes)

    def max_rule(self, node: Node, slopes: Sequence[Node]) -> Node:
        return self.graph.op("where", self.graph.op(">=", *node.args), *slopes)

    def where_rule(self, node: Node, slopes: Sequence[Node]) -> Node:
        return self.graph.op("where", node.args[0], slopes[1], slopes[2])

    def flat(self, node: Node, slopes: Sequence[Node]) -> Node:
        return self.zero

    def negative_rule(self, node: Node, slopes: Sequence[Node]) -> Node:
        return self.negative(slopes[0])


CHAIN: dict[str, Callable[[_Rules, Node], Node]] = {
    "sqrt": _Rules.of_sqrt,
    "cbrt": _Rules.of_cbrt,
    "exp": lambda rules, node: node,
    "expm1": lambda rules, node: rules.graph.op("exp", node.args[0]),
    "log": lambda rules, node: rules.over(rules.const(1.0), node.args[0]),
    "log1p": _Rules.of_log1p,
    "sin": lambda rules, node: rules.graph.op("cos", node.args[0]),
    "cos": lambda rules, node: rules.graph.op("neg", rules.graph.op("sin", node.args[0])),
    "tan": _Rules.of_tan,
    "asin": _Rules.of_asin,
    "acos": lambda rules, node: rules.graph.op("neg", rules.of_asin(node)),
    "atan": _Rules.of_atan,
    "sinh": lambda rules, node: rules.graph.op("cosh", node.args[0]),
    "cosh": lambda rules, node: rules.graph.op("sinh", node.args[0]),
    "tanh": _Rules.of_tanh,
    "abs": lambda rules, node: rules.graph.op("sign", node.args[0]),
    "table": _Rules.of_table,
}
"""Slopes of functions of one argument."""

RULES: dict[str, Callable[[_Rules, Node, Sequence[Node]], Node]] = {
    "+": _Rules.plus_rule,
    "-": _Rules.minus_rule,
    "*": _Rules.times_rule,
    "/": _Rules.divide_rule,
    "neg": _Rules.negative_rule,
    "pow": _Rules.power_rule,
    "hypot": _Rules.hypot_rule,
    "atan2": _Rules.atan2_rule,
    "min": _Rules.min_rule,
    "max": _Rules.max_rule,
    "where": _Rules.where_rule,
    "floor": _Rules.flat,
    "sign": _Rules.flat,
    "const": _Rules.flat,
    "input": _Rules.flat,
    "param": _Rules.flat,
}
"""Derivatives of the other operations."""
