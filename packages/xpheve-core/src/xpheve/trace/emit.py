"""Text of a graph: straight-line assignments on floats (interpreted or compiled), or on NumPy arrays of one number an object.

Every operation is spelled once a node, in the order of `walk`, so that all tiers round alike. Where Python raises and IEEE does not (division,
roots, powers, ...) the scalar text calls a helper of `xpheve.kernels.ieee` by the name ``ieee__divide`` and so on; `xpheve.compile` puts
the machine's own operation in its place.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from xpheve.trace.graph import Node, walk

INFIX = {"+": "+", "-": "-", "*": "*"}
COMPARE = {"<": "<", "<=": "<=", ">": ">", ">=": ">=", "==": "==", "!=": "!="}

SCALAR = {
    "/": "ieee__divide", "sqrt": "ieee__sqrt", "cbrt": "ieee__cbrt", "pow": "ieee__power", "exp": "ieee__exp", "expm1": "ieee__expm1",
    "log": "ieee__log", "log1p": "ieee__log1p", "sin": "ieee__sin", "cos": "ieee__cos", "tan": "ieee__tan", "asin": "ieee__asin",
    "acos": "ieee__acos", "atan": "math.atan", "atan2": "math.atan2", "sinh": "ieee__sinh", "cosh": "ieee__cosh",
    "tanh": "math.tanh", "floor": "ieee__floor", "hypot": "ieee__hypot", "min": "ieee__minimum", "max": "ieee__maximum",
    "abs": "abs", "sign": "ieee__sign",
}  # fmt: skip
"""Functions of the scalar text. `xpheve.kernels.ieee` defines them so that they never raise."""

ARRAY = {
    "sqrt": "np.sqrt", "cbrt": "np.cbrt", "pow": "np.power", "exp": "np.exp", "expm1": "np.expm1", "log": "np.log",
    "log1p": "np.log1p", "sin": "np.sin", "cos": "np.cos", "tan": "np.tan", "asin": "np.arcsin", "acos": "np.arccos",
    "atan": "np.arctan", "atan2": "np.arctan2", "sinh": "np.sinh", "cosh": "np.cosh", "tanh": "np.tanh",
    "floor": "np.floor", "hypot": "np.hypot", "min": "np.minimum", "max": "np.maximum", "abs": "np.abs", "sign": "np.sign",
}  # fmt: skip
"""Functions of the array text: NumPy's, to the bit for + - * / and sqrt, to a few ulp elsewhere."""

Leaf = Callable[[Node], str]
"""What an input or a parameter is called in the text."""


def literal(value: float) -> str:
    """``value`` as text that reads back to the same bits."""
    if value != value:
        return "math.nan"
    if value in (float("inf"), float("-inf")):
        return "math.inf" if value > 0 else "(-math.inf)"
    return repr(value) if value >= 0 and str(value)[0] != "-" else f"({value!r})"


class Writer:
    """Writes assignments for nodes that have none yet; names are ``prefix`` and a number.

    ``starts`` says, for each `xpheve.trace.table.Table`, where its numbers begin in the buffer that the text calls ``tables``: a number,
    or the name of one.
    """

    def __init__(
        self, leaf: Leaf, arrays: bool = False, prefix: str = "t", starts: Mapping[Any, int | str] | None = None
    ) -> None:
        self.leaf, self.arrays, self.prefix = leaf, arrays, prefix
        self.starts = starts if starts is not None else {}
        self.names: dict[int, str] = {}
        self.lines: list[str] = []

    def write(self, outputs: Sequence[Node], given: Mapping[int, str] | None = None) -> list[str]:
        """The names of ``outputs``; assignments that were missing are added to ``lines``. ``given`` names nodes known beforehand."""
        self.names.update(given or {})
        for node in walk(outputs):
            if node.index in self.names:
                continue
            text = self._text(node)
            if node.op in ("const", "input", "param"):
                self.names[node.index] = text
                continue
            name = self.names[node.index] = f"{self.prefix}{len(self.lines)}"
            self.lines.append(f"{name} = {text}")
        return [self.names[node.index] for node in outputs]

    def _text(self, node: Node) -> str:
        op = node.op
        if op == "const":
            return literal(node.value)
        if op in ("input", "param"):
            return self.leaf(node)
        args = [self.names[arg.index] for arg in node.args]
        if op in INFIX or op in COMPARE:
            return f"{args[0]} {INFIX.get(op) or COMPARE[op]} {args[1]}"
        if op == "/" and self.arrays:
            if all(arg.op == "const" for arg in node.args):  # two floats, of which Python would refuse to divide by 0
                return f"np.divide({args[0]}, {args[1]})"
            return f"{args[0]} / {args[1]}"
        if op == "neg":
            return f"-{args[0]}"
        if op == "where":
            if self.arrays:
                return f"np.where({args[0]}, {args[1]}, {args[2]})"
            return f"{args[1]} if {args[0]} else {args[2]}"
        if op == "not":
            return f"np.logical_not({args[0]})" if self.arrays else f"not {args[0]}"
        if op in ("and", "or"):
            return f"np.logical_{op}({args[0]}, {args[1]})" if self.arrays else f"({args[0]} {op} {args[1]})"
        if op == "kernel":
            return self._call_text(node, args)
        if op == "pick":
            return f"{args[0]}[{node.value}]"
        if op == "table":
            return self.table_text(node, args[0])
        return f"{(ARRAY if self.arrays else SCALAR)[op]}({', '.join(args)})"

    def _call_text(self, node: Node, args: list[str]) -> str:
        """The call of a kernel written by hand; for arrays it is called row by row."""
        (name, _, _), widths = node.value
        given, at = [], 0
        for width in widths:
            given.append(f"({', '.join(args[at : at + width])})" if width else args[at])
            at += width or 1
        if self.arrays:
            return f"by_rows({', '.join([f'{name}__force', *given])})"
        return f"{name}__force({', '.join(given)})"

    def table_text(self, node: Node, x: str) -> str:
        """The call that looks up a table: a function of `xpheve.kernels.table`, or its sibling for arrays."""
        table = node.value
        name = f"np_table__{table.kind}" if self.arrays else f"table__{table.kind}"
        return f"{name}(tables, {self.starts[table.base]}, {table.base.count}, {x})"
