"""Functions made of graphs: on arrays, on floats, compiled; each shared node computed once."""

from __future__ import annotations

import math
from array import array
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import xpheve_laws_basic as basic
from xpheve.compile import assemble, compiled, interpreted
from xpheve.trace.emit import Writer
from xpheve.trace.graph import Graph, Input, Node, Parameter
from xpheve.trace.numpy_text import array_function, scalar_function
from xpheve.trace.recorder import trace_law
from xpheve.trace.table import Table, packed, tables_of

X = Input("", "x", 0)
Y = Input("", "y", 0)


def test_a_shared_node_is_computed_once() -> None:
    graph = Graph()
    x = graph.input("x")
    root = graph.op("sqrt", x)
    for make in (array_function, scalar_function):
        run = make([graph.op("*", root, x), graph.op("+", root, x), root])
        assert run.text.count("sqrt(") == 1


def test_results_that_no_object_changes_are_numbers() -> None:
    graph = Graph()
    k, x = graph.param("k"), graph.input("x")
    run = array_function([graph.op("*", k, k), graph.op("*", k, x), graph.const(3.0)])
    alone, whole, three = run({X: np.array([1.0, 2.0])}, {Parameter("k", 0): 2.0})
    assert (float(alone), whole.tolist(), float(three)) == (4.0, [2.0, 4.0], 3.0) and np.ndim(alone) == 0
    assert (run.inputs, run.parameters) == ((X,), (Parameter("k", 0),))


@pytest.mark.parametrize("make", [array_function, scalar_function])
def test_what_python_refuses_is_infinite_or_no_number(make: Any) -> None:
    graph = Graph()
    x, k = graph.input("x"), graph.param("k")
    zero = graph.const(0.0)
    nodes = [
        graph.op("/", graph.const(1.0), x),
        graph.op("/", k, zero),
        graph.op("/", graph.const(1.0), zero),
        graph.op("sqrt", graph.op("-", x, graph.const(1.0))),
        graph.op("log", x),
        graph.op("exp", graph.op("+", x, graph.const(1e4))),
        graph.power(graph.op("-", x, graph.const(1.0)), 1.5),
    ]
    found = make(nodes)({X: np.zeros(1) if make is array_function else 0.0}, {Parameter("k", 0): 2.0})
    numbers = [float(np.ravel(one)[0]) for one in found]
    assert (
        numbers[:3] == [math.inf] * 3
        and math.isnan(numbers[3])
        and numbers[4:6] == [-math.inf, math.inf]
        and math.isnan(numbers[6])
    )


EXACT = ("+", "-", "*", "/", "sqrt", "min", "max", "where", "neg", "abs", "sign", "floor")
numbers = st.floats(-1e6, 1e6) | st.sampled_from([0.0, -0.0, 1.0, math.inf, -math.inf, math.nan])


@given(
    st.lists(st.tuples(st.sampled_from(EXACT), st.integers(0, 4), st.integers(0, 4)), max_size=12),
    st.lists(st.tuples(numbers, numbers), min_size=1),
)
def test_arithmetic_has_the_same_bits_on_arrays_and_on_floats(
    steps: list[tuple[str, int, int]], given: list[tuple[float, float]]
) -> None:
    graph = Graph()
    made = [graph.input("x"), graph.input("y"), graph.const(0.3)]
    for op, i, j in steps:
        a, b = made[-1 - i % len(made)], made[-1 - j % len(made)]
        if op == "where":
            made.append(graph.op("where", graph.op("<", a, b), a, graph.op("*", b, b)))
        else:
            made.append(graph.op(op, *((a,) if op in ("sqrt", "neg", "abs", "sign", "floor") else (a, b))))
    outputs: list[Node] = made[2:]
    x, y = (np.array([pair[k] for pair in given]) for k in (0, 1))
    whole = np.array([np.broadcast_to(one, len(given)) for one in array_function(outputs)({X: x, Y: y}, {})])
    alone = scalar_function(outputs)
    for k, (at_x, at_y) in enumerate(given):
        np.testing.assert_array_equal(whole[:, k], np.array(alone({X: at_x, Y: at_y}, {})))


def test_a_law_on_arrays_is_the_law_on_each_object() -> None:
    trace = trace_law(basic.Damper())
    assert trace is not None and trace.force is not None
    whole, alone = array_function(trace.force), scalar_function(trace.force)
    rng = np.random.default_rng(3)
    inputs = {one: rng.normal(size=50) for one in whole.inputs}
    parameters = {one: 0.7 for one in whole.parameters}
    together = np.array(whole(inputs, parameters))
    for k in range(50):
        assert together[:, k].tolist() == alone({one: float(x[k]) for one, x in inputs.items()}, parameters)


@pytest.mark.parametrize("kind", ["linear", "cubic"])
@pytest.mark.parametrize("outside", ["error", "hold", "extend"])
def test_a_table_has_the_same_bits_interpreted_compiled_and_on_arrays(kind: str, outside: str) -> None:
    table = Table((0.0, 1.0, 2.5, 3.0, 7.0), (1.0, 3.0, 3.0, -1.0, -2.0), kind=kind, outside=outside)
    other = Table((-1.0, 1.0), (0.1, 0.2), kind=kind, outside="hold")
    graph = Graph()
    x = graph.input("x")
    outputs = [graph.table(other, x, other.dim), graph.table(table, x, table.dim)]
    assert table.slope is not None
    outputs.append(graph.table(table.slope, x, table.slope.dim))
    data, starts = packed(tables_of(outputs))
    writer = Writer(lambda node: "x", starts=starts)
    names = writer.write(outputs)
    body = "\n".join(
        [
            "def entry(f, n):",
            "    tables = f[0]",
            "    for i in range(n[0][0]):",
            "        x = f[1][i]",
            *(f"        {line}" for line in writer.lines),
            *(f"        f[{2 + k}][i] = {name}" for k, name in enumerate(names)),
            "    return 0",
            "",
        ]
    )
    text = assemble(body)
    at = np.concatenate([np.linspace(-2.0, 9.0, 111), table.x, [math.inf, -math.inf, math.nan, -0.0]])
    whole = array_function(outputs)({X: at}, {})
    for kernel in (interpreted(text), compiled(text, what="tables")):
        found = [np.zeros_like(at) for _ in outputs]
        assert kernel([data.copy(), at.copy(), *found], [np.array([len(at)])]) == 0
        for one, expected in zip(found, whole, strict=True):
            np.testing.assert_array_equal(one, expected)


def test_the_tables_of_a_function_are_where_its_text_says() -> None:
    one, two = Table((0.0, 1.0), (1.0, 2.0)), Table((0.0, 1.0), (5.0, 6.0), kind="cubic")
    data, starts = packed([one, two])
    assert starts == {one: 0, two: len(one.numbers())} and len(data) == len(one.numbers()) + len(two.numbers())
    assert array("d", data)[starts[two] + 4 + 3] == 5.0
