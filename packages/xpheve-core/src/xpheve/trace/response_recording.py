"""One reading of a response: values that ask Python's ``if`` are told to go one way, and what was asked is kept."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from xpheve.trace.graph import Graph, Node
from xpheve.trace.recording import Recording
from xpheve.trace.values import Traced

Made = TypeVar("Made")

OWN_ROUNDING = frozenset("exp expm1 log log1p sin cos tan asin acos atan atan2 sinh cosh tanh cbrt hypot".split(" "))
"""Operations of which NumPy's are off by a bit here and there; those of ``math`` are not."""

MOST_DECISIONS = 64
"""On one way through a response."""


class ResponseRecording(Recording):
    """One reading of ``respond`` along one way through its decisions.

    ``prefix`` says how the first of them are decided; those after it are taken for true. ``taken`` tells what was decided.
    """

    def __init__(self, label: str, graph: Graph | None = None, prefix: Iterable[bool] = ()) -> None:
        super().__init__(label, pair=True)
        self.method = "respond"
        if graph is not None:
            self.graph = graph
        self.graph.check_dimensions = False
        self.prefix = list(prefix)
        self.taken: list[tuple[Node, bool]] = []
        self._known: dict[int, bool] = {}
        self._exact = 0

    @property
    def apply(self) -> str:
        """What an author may do instead."""
        return "leave it to Python, which is slower"

    def op(self, op: str, *nodes: Node) -> Node:
        if op in OWN_ROUNDING and not self._exact:
            self.refuse(f"np.{op} of a traced value: it may differ from compiled code in its last bit; write math.{op}")
        return super().op(op, *nodes)

    def exactly(self, make: Callable[[], Made]) -> Made:
        """What ``make()`` gives, which asks for functions of ``math``."""
        self._exact += 1
        try:
            return make()
        finally:
            self._exact -= 1

    def power(self, base: Node, exponent: float) -> Node:
        """As Python's ``**``: by the power of the C library, whatever the exponent."""
        return self.op("pow", base, self.graph.const(exponent))

    def whole_part(self) -> None:
        self.refuse("// and % of a traced value: Python rounds them in its own way")

    def decide(self, value: Traced) -> bool:
        """The answer on this way; the same question has the same answer."""
        if len(value.at) != 1:
            self.refuse("asks whether a vector is true: compare its components")
        return self._decided(self.truth(value.nodes[0]))

    def _decided(self, node: Node) -> bool:
        if node.op == "not":
            return not self._decided(node.args[0])
        if node.op == "and":
            return self._decided(node.args[0]) and self._decided(node.args[1])
        if node.op == "or":
            return self._decided(node.args[0]) or self._decided(node.args[1])
        if all(arg.op == "const" for arg in node.args):
            return bool(COMPARE[node.op](*(arg.value for arg in node.args)))
        if node.index not in self._known:
            k = len(self.taken)
            if k >= MOST_DECISIONS:
                self.refuse(
                    f"decides more than {MOST_DECISIONS} times on one way: a loop that ends by what it computes is no formula"
                )
            self._known[node.index] = self.prefix[k] if k < len(self.prefix) else True
            self.taken.append((node, self._known[node.index]))
        return self._known[node.index]


COMPARE: dict[str, Any] = {
    "<": float.__lt__,
    "<=": float.__le__,
    ">": float.__gt__,
    ">=": float.__ge__,
    "==": float.__eq__,
    "!=": float.__ne__,
}
