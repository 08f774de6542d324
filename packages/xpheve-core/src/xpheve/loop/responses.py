"""Responses of collision laws as one text: ``respond(f, n)``, which the compiled loop of impacts calls.

Each law's ``respond`` is read by `xpheve.trace.response`. Laws of one class and of the same choices share a branch of the text; their
numbers come from a table. What Python would refuse (a division by zero, a root below it, a speed that is none) is given back to Python:
the text answers `xpheve.kernels.response.ASK`, and the law itself says what happens.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xpheve.errors import TraceError
from xpheve.kernels import response as layout
from xpheve.laws import ResponseLaw
from xpheve.trace.emit import Writer
from xpheve.trace.graph import Node
from xpheve.trace.response import Leaf, ResponseTrace, Tree, trace_response

PLACES = {
    "normal": layout.NORMAL,
    "point": layout.POINT,
    "approach_speed": layout.APPROACH,
    "separation": layout.SEPARATION,
    "instant": layout.TIME,
    "position": layout.POSITION,
    "velocity": layout.VELOCITY,
    "angular_velocity": layout.SPIN,
    "orientation": layout.ORIENTATION,
    "mass": layout.MASS,
    "inverse_mass": layout.INVERSE_MASS,
    "inertia": layout.INERTIA,
    "radius": layout.RADIUS,
}
BODIES = {"a": layout.BODY_A, "b": layout.BODY_B}


class Responses:
    """The responses of some laws, fused where they are formulas.

    Parameters
    ----------
    laws
        In the order in which a loop numbers them.
    columns
        Columns that objects have besides those that each law declares for itself.

    Attributes
    ----------
    text
        Defines ``respond(f, n)``; `xpheve.kernels.response` says what it finds where. It returns the kind of the answer.
    columns
        Names of the columns that a body's row has, in order; at most `xpheve.kernels.response.MOST_COLUMNS`.
    files
        Kernel files that the text calls, for `xpheve.compile.assemble`: none but xPheve's own.
    """

    def __init__(self, laws: Iterable[ResponseLaw], columns: Iterable[str] = ()) -> None:
        self.laws = tuple(laws)
        self.files: Mapping[str, str] = {}
        self._formulas = [_formula(law) for law in self.laws]
        self._branches: list[int] = []
        self._why: list[str] = []
        self._partly: list[str] = []
        traces = self._traced(list(columns))
        self.columns = self._columns_of(traces)
        self._traces = traces
        self.text = self._written(traces)

    def why(self, law: ResponseLaw) -> str:
        """Why ``law`` is asked in Python only; empty if it is fused."""
        return self._why[self._place(law)]

    def partly(self, law: ResponseLaw) -> str:
        """Why some ways through ``law``, which is fused, are left to Python; empty if none is."""
        return self._partly[self._place(law)]

    @property
    def current(self) -> bool:
        """Whether the text still says what the laws say: False once a choice among their parameters, or a value for a pair, is another."""
        return self._formulas == [_formula(law) for law in self.laws]

    def parameters(self) -> tuple[NDArray[np.float64], list[tuple[int, int]]]:
        """The numbers of all parameters as they are now, and for each law its branch (-1: Python only) and where its numbers begin."""
        numbers: list[float] = []
        found = []
        for law, trace, branch in zip(self.laws, self._traces, self._branches, strict=True):
            found.append((branch, len(numbers)))
            for one in trace.parameters if trace is not None else ():
                value = law.parameters[one.name]
                numbers.append(float(value[one.component] if isinstance(value, tuple) else value))
        return np.array(numbers or [0.0]), found

    def _place(self, law: ResponseLaw) -> int:
        return next(k for k, one in enumerate(self.laws) if one is law)

    def _traced(self, columns: list[str]) -> list[ResponseTrace | None]:
        known: dict[Any, ResponseTrace | str] = {}
        found: list[ResponseTrace | None] = []
        for law in self.laws:
            key = _formula(law)
            if key not in known:
                known[key] = _trace_or_why(law, columns)
            trace = known[key]
            found.append(None if isinstance(trace, str) else trace)
            self._why.append(trace if isinstance(trace, str) else "")
            self._partly.append("" if isinstance(trace, str) else trace.partly)
        return found

    def _columns_of(self, traces: list[ResponseTrace | None]) -> tuple[str, ...]:
        """The union of what is read; a law that would make it too long is left to Python."""
        found: list[str] = []
        for k, trace in enumerate(traces):
            more = [name for name in trace.columns if name not in found] if trace is not None else []
            if len(found) + len(more) > layout.MOST_COLUMNS:
                traces[k] = None
                self._why[k] = f"with it the laws here would read more than {layout.MOST_COLUMNS} columns"
                continue
            found += more
        return tuple(found)

    def _written(self, traces: Sequence[ResponseTrace | None]) -> str:
        bodies: dict[str, int] = {}
        for trace in traces:
            if trace is None:
                self._branches.append(-1)
            else:
                body = branch_text(trace, self.columns)
                self._branches.append(bodies.setdefault(body, len(bodies)))
        lines = [f"def response_{k}(f, n):\n{body}\n" for body, k in bodies.items()]
        lines += ["def respond(f, n):"]
        for k in range(len(bodies)):
            lines += [f"    if n[0][{layout.BRANCH}] == {k}:", f"        return response_{k}(f, n)"]
        return "\n".join([*lines, f"    f[0][{layout.KIND}] = {float(layout.ASK)}", f"    return {layout.ASK}", ""])


def _formula(law: ResponseLaw) -> tuple[Any, ...]:
    """What chooses the formula of ``law``: its class, the values that are no numbers, and what was set on it by hand."""
    values = tuple(
        (
            name,
            type(value).__name__,
            value if isinstance(value, (str, bool)) else len(value) if isinstance(value, tuple) else None,
        )
        for name, value in law.parameters.items()
    )
    return type(law), values, frozenset(law.__dict__), bool(getattr(law, "pair_values", None))


def _trace_or_why(law: ResponseLaw, columns: Sequence[str]) -> ResponseTrace | str:
    from xpheve.loop.response_check import difference

    if getattr(law, "pair_values", None):
        return f"{law.label()} has values for single pairs, which Python looks up"
    try:
        trace = trace_response(law, columns)
    except TraceError as error:
        return str(error)
    return difference(law, trace) or trace


# Text ----------------------------------------------------------------------------------------------------------------


class _Writer(Writer):
    """Writes assignments; names are unlike those of any other way."""

    def __init__(self, columns: Sequence[str], parameters: Sequence[Any]) -> None:
        super().__init__(self._leaf)
        self.columns = {name: layout.COLUMNS + k for k, name in enumerate(columns)}
        self.parameters = {one: k for k, one in enumerate(parameters)}
        self.ways = [0]

    def _leaf(self, node: Node) -> str:
        if node.op == "param":
            return f"p[at + {self.parameters[node.value]}]"
        side, name, component = node.value.side, node.value.name, node.value.component
        if side.endswith("[]"):
            return f"s[{BODIES[side[0]] + self.columns[name]}]"
        return f"s[{(BODIES[side] if side else 0) + PLACES[name] + component}]"

    def fork(self) -> _Writer:
        """A writer that knows what this one wrote, for one side of a branch."""
        other = object.__new__(_Writer)
        other.__dict__.update(self.__dict__)
        self.ways[0] += 1
        other.names, other.lines, other.prefix = dict(self.names), [], f"w{self.ways[0]}_"
        other.leaf = other._leaf
        return other


def branch_text(trace: ResponseTrace, columns: Sequence[str]) -> str:
    """The body of a function that answers as ``trace``, with ``columns`` as the rows of bodies have them."""
    writer = _Writer(columns, trace.parameters)
    lines = ["s = f[0]"]
    if trace.parameters:
        lines += ["p = f[1]", f"at = n[0][{layout.PARAMETERS}]"]
    return "\n".join(f"    {line}" for line in [*lines, *_tree_lines(trace.tree, writer)])


def _tree_lines(tree: Tree, writer: _Writer) -> list[str]:
    if isinstance(tree, Leaf):
        return _leaf_lines(tree, writer)
    (question,) = writer.write([tree.question])
    yes = writer.fork()
    no = writer.fork()
    inside = _tree_lines(tree.yes, yes)
    return [*writer.lines, f"if {question}:", *(f"    {line}" for line in inside), *_tree_lines(tree.no, no)]


def _leaf_lines(leaf: Leaf, writer: _Writer) -> list[str]:
    names = writer.write(leaf.values)
    kind = [f"s[{layout.KIND}] = {float(leaf.kind)}", f"return {leaf.kind}"]
    if leaf.kind == layout.ASK:
        return kind
    fit = _check_lines(leaf, writer)
    if leaf.kind == layout.SPEED:
        fit.append(f"0.0 <= {names[0]} < math.inf")
    else:
        fit += [f"{name} - {name} == 0.0" for name in dict.fromkeys(names)]
    ask = [f"    s[{layout.KIND}] = {float(layout.ASK)}", f"    return {layout.ASK}"]
    stored = [f"s[{layout.VALUES + k}] = {name}" for k, name in enumerate(names)]
    return [*writer.lines, f"if not ({' and '.join(fit)}):", *ask, *stored, *kind]


def _check_lines(leaf: Leaf, writer: _Writer) -> list[str]:
    """Write what must be finite, and give the questions whether it is; what is reached under a condition counts where that holds."""
    fit = []
    for node, condition in leaf.checks:
        (name,) = writer.write([node])
        if condition is None:
            fit.append(f"{name} - {name} == 0.0")
        else:
            (reached,) = writer.write([condition])
            fit.append(f"(not {reached} or {name} - {name} == 0.0)")
    return list(dict.fromkeys(fit))
