"""Functions made of a graph: on NumPy arrays of one number an object, or on floats. Each shared node is computed once a call."""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from xpheve.trace.emit import SCALAR, Writer
from xpheve.trace.graph import Input, Node, Parameter, walk
from xpheve.trace.table import ARRAYS, FLOATS, packed, tables_of


@dataclass(frozen=True)
class GraphFunction:
    """A function that computes some nodes of a graph.

    ``inputs`` and ``parameters`` are what it needs, in order; ``text`` is what it runs, for the nodes ``outputs``. Called, it gives a list
    of one result a node: for `array_function` an array of shape (n,), or a float where nothing that differs from object to object is read.
    """

    inputs: tuple[Input, ...]
    parameters: tuple[Parameter, ...]
    outputs: tuple[Node, ...] = field(repr=False)
    text: str
    run: Callable[..., list[Any]] = field(repr=False)
    """With the values of ``inputs``, then of ``parameters``, one after another."""

    def __call__(self, inputs: Mapping[Input, Any], parameters: Mapping[Parameter, float]) -> list[Any]:
        """The nodes, of values by name; more of them than are needed may be given."""
        return self.run(*(inputs[one] for one in self.inputs), *(parameters[one] for one in self.parameters))


def array_function(outputs: Sequence[Node]) -> GraphFunction:
    """``outputs`` on arrays of shape (n,), one number an object; parameters are floats. Divisions by zero and the like give inf or NaN."""
    made = _made(outputs, arrays=True, names={"np": np, **{f"np_table__{kind}": read for kind, read in ARRAYS.items()}})
    plain = made.run

    def quiet(*values: Any) -> list[Any]:
        with np.errstate(all="ignore"):
            return plain(*map(np.asarray, values))  # floats of NumPy: theirs divide by zero

    return replace(made, run=quiet)


def scalar_function(outputs: Sequence[Node]) -> GraphFunction:
    """``outputs`` on floats: the text that is compiled, interpreted."""
    from xpheve.kernels import ieee

    names = {f"table__{kind}": read for kind, read in FLOATS.items()}
    for name in SCALAR.values():
        if name.startswith("ieee__"):
            names[name] = getattr(ieee, name.removeprefix("ieee__"))
    return _made(outputs, arrays=False, names=names)


def _made(outputs: Sequence[Node], arrays: bool, names: dict[str, Any]) -> GraphFunction:
    leaves = list(walk(outputs))
    inputs = sorted((node for node in leaves if node.op == "input"), key=lambda node: node.value)
    parameters = sorted((node for node in leaves if node.op == "param"), key=lambda node: node.value)
    called = {node.index: f"i{k}" for k, node in enumerate(inputs)}
    called.update({node.index: f"p{k}" for k, node in enumerate(parameters)})
    numbers, starts = packed(tables_of(outputs))
    writer = Writer(lambda node: called[node.index], arrays=arrays, starts=starts)
    results = writer.write(outputs)
    lines = [f"def run({', '.join(called.values())}):", *(f"    {line}" for line in writer.lines)]
    text = "\n".join([*lines, f"    return [{', '.join(results)}]", ""])
    room: dict[str, Any] = {"math": math, "tables": numbers if arrays else memoryview(array("d", numbers)), **names}
    exec(compile(text, "<traced law>", "exec"), room)
    return GraphFunction(
        tuple(node.value for node in inputs),
        tuple(node.value for node in parameters),
        tuple(outputs),
        text,
        room["run"],
    )
