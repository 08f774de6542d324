"""Derivatives of graphs: against differences, and at the points where limits are defined."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from xpheve.errors import InvalidValueError
from xpheve.trace.derivative import derivative, derivatives, gradient, is_zero, jacobian
from xpheve.trace.graph import ARITHMETIC, COMPARISONS, LOGIC, Graph, Input, Node, walk
from xpheve.trace.law_trace import LawTrace
from xpheve.trace.numpy_text import array_function
from xpheve.trace.table import Table
from xpheve.units import dimension

LINES = Table((-3.0, -1.0, 0.3, 2.1, 5.0), (1.0, -0.4, 0.7, 0.2, 3.0), outside="extend")
CURVE = Table((-3.0, -1.0, 0.3, 2.1, 5.0), (1.0, -0.4, 0.7, 0.2, 3.0), kind="cubic", outside="hold")

Build = Callable[[Graph, Node, Node], Node]


def c(graph: Graph, value: float) -> Node:
    return graph.const(value)


def square_plus(graph: Graph, u: Node, value: float) -> Node:
    return graph.op("+", graph.op("*", u, u), graph.const(value))


def tame(graph: Graph, u: Node, size: float = 0.9) -> Node:
    return graph.op("*", graph.const(size), graph.op("tanh", u))


FORMS: dict[str, Build] = {
    "+": lambda g, a, b: g.op("+", a, b),
    "-": lambda g, a, b: g.op("-", a, b),
    "*": lambda g, a, b: g.op("*", a, b),
    "/": lambda g, a, b: g.op("/", a, square_plus(g, b, 0.7)),
    "neg": lambda g, a, b: g.op("neg", a),
    "sqrt": lambda g, a, b: g.op("sqrt", square_plus(g, a, 0.4)),
    "cbrt": lambda g, a, b: g.op("cbrt", square_plus(g, a, 0.4)),
    "pow": lambda g, a, b: g.power(square_plus(g, a, 0.3), 1.7),
    "pow of a half": lambda g, a, b: g.power(square_plus(g, a, 0.3), -2.5),
    "cube": lambda g, a, b: g.power(tame(g, a), 3.0),
    "pow both": lambda g, a, b: g.op("pow", square_plus(g, a, 0.3), tame(g, b)),
    "exp": lambda g, a, b: g.op("exp", tame(g, a)),
    "expm1": lambda g, a, b: g.op("expm1", tame(g, a)),
    "log": lambda g, a, b: g.op("log", square_plus(g, a, 0.6)),
    "log1p": lambda g, a, b: g.op("log1p", square_plus(g, a, 0.1)),
    "sin": lambda g, a, b: g.op("sin", a),
    "cos": lambda g, a, b: g.op("cos", a),
    "tan": lambda g, a, b: g.op("tan", tame(g, a)),
    "asin": lambda g, a, b: g.op("asin", tame(g, a)),
    "acos": lambda g, a, b: g.op("acos", tame(g, a)),
    "atan": lambda g, a, b: g.op("atan", a),
    "atan2": lambda g, a, b: g.op("atan2", a, g.op("+", b, c(g, 0.2))),
    "sinh": lambda g, a, b: g.op("sinh", tame(g, a)),
    "cosh": lambda g, a, b: g.op("cosh", tame(g, a)),
    "tanh": lambda g, a, b: g.op("tanh", a),
    "floor": lambda g, a, b: g.op("*", g.op("floor", a), b),
    "hypot": lambda g, a, b: g.op("hypot", a, b),
    "min": lambda g, a, b: g.op("min", a, b),
    "max": lambda g, a, b: g.op("max", a, g.op("*", b, b)),
    "abs": lambda g, a, b: g.op("abs", a),
    "sign": lambda g, a, b: g.op("*", g.op("sign", a), b),
    "where": lambda g, a, b: g.op("where", g.op("<", a, b), g.op("*", a, b), b),
    "where not": lambda g, a, b: g.op("where", g.op("not", g.op(">=", a, b)), a, g.op("sin", b)),
    "where both": lambda g, a, b: g.op("where", g.op("and", g.op(">", a, b), g.op("!=", a, c(g, 0.0))), b, a),
    "linear table": lambda g, a, b: g.table(LINES, a, LINES.dim),
    "cubic table": lambda g, a, b: g.table(CURVE, a, CURVE.dim),
}
"""One form for each operation of a graph, of two arguments, somewhere smooth."""


def values(nodes: list[Node], x: float, y: float) -> list[float]:
    given = {Input("", "x", 0): np.array([x]), Input("", "y", 0): np.array([y])}
    return [float(np.broadcast_to(one, 1)[0]) for one in array_function(nodes)(given, {})]


def size_of(nodes: list[Node], x: float, y: float) -> float:
    """The largest number that occurs: what rounding is relative to."""
    every = [node for node in walk(nodes) if not node.truth]
    return max(1.0, *(abs(one) for one in values(every, x, y)))


def agrees_with_differences(node: Node, slope: Node, x: float, y: float, along: int) -> bool:
    """Whether ``slope`` is the derivative: central differences at h and h/2, whose own error is what they differ by."""

    def at(step: float) -> float:
        return values([node], x + step * (along == 0), y + step * (along == 1))[0]

    h = 1e-4
    wide, near = (at(h) - at(-h)) / (2 * h), (at(h / 2) - at(-h / 2)) / h
    found = values([slope], x, y)[0]
    rounding = 1e-15 * size_of([node], x, y) ** 2 / h  # products of products may lose what their factors have
    return abs((4 * near - wide) / 3 - found) <= 2 * abs(near - wide) + rounding + 1e-9 * max(1.0, abs(found))


@pytest.mark.parametrize("name", FORMS)
def test_every_operation_has_the_slope_that_differences_show(name: str) -> None:
    graph = Graph()
    x, y = graph.input("x"), graph.input("y")
    node = FORMS[name](graph, x, y)
    for at_x, at_y in ((0.37, -1.21), (-1.73, 0.61), (1.9, 0.83), (-0.11, -2.3)):
        for k, wrt in enumerate((x, y)):
            assert agrees_with_differences(node, derivative(graph, node, wrt), at_x, at_y, k), (name, at_x, at_y, k)


def test_no_operation_was_forgotten() -> None:
    graph = Graph()
    x, y = graph.input("x"), graph.input("y")
    seen = {node.op for form in FORMS.values() for node in walk([form(graph, x, y)])}
    from xpheve.trace.emit import ARRAY, SCALAR

    known = {*ARITHMETIC, *SCALAR, *ARRAY, "where", "table"}
    assert known - seen == set(), "add a form for it"
    assert seen & set(COMPARISONS) and seen & set(LOGIC)


@st.composite
def expressions(draw: st.DrawFn) -> Build:
    steps = draw(
        st.lists(
            st.tuples(st.sampled_from(sorted(FORMS)), st.integers(0, 5), st.integers(0, 5)), min_size=1, max_size=7
        )
    )

    def build(graph: Graph, x: Node, y: Node) -> Node:
        made = [x, y]
        for name, i, j in steps:
            made.append(FORMS[name](graph, made[-1 - i % len(made)], made[-1 - j % len(made)]))
        return made[-1]

    return build


@given(expressions(), st.integers(0, 2**31))
def test_random_expressions_have_the_slopes_that_differences_show(build: Build, seed: int) -> None:
    graph = Graph()
    x, y = graph.input("x"), graph.input("y")
    node = build(graph, x, y)
    slopes = [derivative(graph, node, x), derivative(graph, node, y)]
    for at_x, at_y in np.random.default_rng(seed).uniform(-2.5, 2.5, (3, 2)).tolist():
        if size_of([node], at_x, at_y) < 1e4:
            for k in (0, 1):
                assert agrees_with_differences(node, slopes[k], at_x, at_y, k)


@given(expressions())
def test_a_derivative_is_not_much_larger_than_what_it_derives(build: Build) -> None:
    graph = Graph()
    node = build(graph, graph.input("x"), graph.input("y"))
    size = len(list(walk([node])))
    both = derivatives(graph, [node], graph.input("x")) + derivatives(graph, [node], graph.input("y"))
    assert len(list(walk([node, *both]))) <= 15 * size


def drag(graph: Graph) -> LawTrace:
    speed = [graph.input("velocity", k, dimension("m/s")) for k in range(3)]
    square = graph.op("*", speed[0], speed[0])
    for one in speed[1:]:
        square = graph.op("+", square, graph.op("*", one, one))
    factor = graph.op("*", graph.param("c", 0, dimension("kg/m")), graph.op("sqrt", square))
    force = tuple(graph.op("neg", graph.op("*", factor, one)) for one in speed)
    return LawTrace("mine:drag", False, graph, force, None, None)  # type: ignore[arg-type]


def evaluated(trace: LawTrace, rows: tuple[tuple[Node, ...], ...], velocity: tuple[float, float, float]) -> np.ndarray:
    from xpheve.trace.graph import Parameter

    inputs = {Input("", "velocity", k): np.array([velocity[k]]) for k in range(3)}
    flat = [one for row in rows for one in row]
    found = array_function(flat)(inputs, {Parameter("c", 0): 2.0})
    return np.array([float(np.broadcast_to(one, 1)[0]) for one in found]).reshape(len(rows), -1)


def test_the_jacobian_of_quadratic_drag_is_that_of_the_books_and_zero_at_rest() -> None:
    trace = drag(Graph("mine:drag"))
    rows = jacobian(trace, "velocity")
    v = np.array([3.0, -4.0, 12.0])
    expected = -2.0 * (13.0 * np.eye(3) + np.outer(v, v) / 13.0)
    np.testing.assert_allclose(evaluated(trace, rows, tuple(v)), expected, rtol=4e-16 * 8)
    assert (evaluated(trace, rows, (0.0, 0.0, 0.0)) == 0.0).all(), "d|v|/dv at v = 0 is 0"
    assert np.isfinite(evaluated(trace, rows, (1e-160, 0.0, 0.0))).all()
    assert np.isnan(evaluated(trace, rows, (math.nan, 0.0, 0.0))).any(), "NaN does not vanish"


def test_the_jacobian_of_quadratic_drag_is_small() -> None:
    trace = drag(Graph("mine:drag"))
    rows = jacobian(trace, "velocity")
    nodes = list(walk([*trace.motion, *(one for row in rows for one in row)]))
    assert sum(node.op in ("/", "sqrt") for node in nodes) == 2, "one root and one division serve all nine"
    assert len(nodes) <= 70


def test_what_is_not_read_has_derivative_zero_and_nothing_is_written_for_it() -> None:
    trace = drag(Graph("mine:drag"))
    before = len(trace.graph.nodes)
    rows = jacobian(trace, "position")
    assert all(is_zero(one) for row in rows for one in row) and [len(row) for row in rows] == [3, 3, 3]
    assert len(trace.graph.nodes) <= before + 1
    assert [len(row) for row in jacobian(trace, "orientation")] == [4, 4, 4]


def test_terms_that_are_zero_vanish() -> None:
    graph = Graph()
    x, y = graph.input("x"), graph.input("y")
    assert is_zero(derivative(graph, graph.op("*", y, graph.op("exp", y)), x))
    assert derivative(graph, graph.op("+", graph.op("*", x, y), graph.op("sin", y)), x) is y
    assert is_zero(derivative(graph, graph.op("floor", x), x)) and is_zero(derivative(graph, graph.const(math.nan), x))
    hidden = graph.op("where", graph.op(">", x, graph.const(0.0)), x, graph.const(math.nan))
    assert values([derivative(graph, hidden, x)], 2.0, 0.0) == [1.0]


@pytest.mark.parametrize(
    "build",
    [
        lambda g, x: g.op("sqrt", g.op("*", x, x)),
        lambda g, x: g.op("cbrt", x),
        lambda g, x: g.op("abs", x),
        lambda g, x: g.op("hypot", x, x),
        lambda g, x: g.power(x, 0.75),
        lambda g, x: g.op("atan2", x, x),
        lambda g, x: g.op("sign", x),
    ],
    ids=["sqrt", "cbrt", "abs", "hypot", "pow", "atan2", "sign"],
)
def test_where_there_is_no_slope_it_is_taken_as_zero(build: Callable[[Graph, Node], Node]) -> None:
    graph = Graph()
    x = graph.input("x")
    assert values([derivative(graph, build(graph, x), x)], 0.0, 0.0) == [0.0]


def test_derivatives_have_the_dimension_that_a_quotient_has() -> None:
    trace = drag(Graph("mine:drag"))
    for row in jacobian(trace, "velocity"):
        for one in row:
            assert one.dim is not None and tuple(one.dim) == tuple(dimension("N*s/m"))


def test_of_what_a_law_has_not_there_is_no_derivative() -> None:
    trace = drag(Graph("mine:drag"))
    with pytest.raises(InvalidValueError, match="mine:drag has no torque"):
        jacobian(trace, "velocity", of="torque")
    with pytest.raises(InvalidValueError, match="mine:drag has no potential"):
        gradient(trace, "position")


def test_both_sides_of_a_pair_share_what_differs_in_sign_only() -> None:
    import xpheve_laws_basic as basic
    from xpheve.trace.recorder import trace_law

    trace = trace_law(basic.UniversalGravity())
    assert trace is not None
    rows = [jacobian(trace, "position", side) for side in ("a", "b")]
    flat = [[one for row in side for one in row] for side in rows]
    costly = [
        sum(node.op in ("/", "sqrt") for node in walk([*trace.motion, *one])) for one in (flat[0], flat[0] + flat[1])
    ]
    assert costly[0] == costly[1] <= 5, "the other side divides nothing anew"
    inputs = {
        Input(side, name, k): np.array([0.3 + k * 0.7 - (side == "b")])
        for side in "ab"
        for name in ("position", "mass")
        for k in range(3)
    }
    run = array_function(flat[0] + flat[1])
    found = np.array(run(inputs, {one: 2.0 for one in run.parameters})).reshape(2, 9)
    np.testing.assert_array_equal(found[0], -found[1])
