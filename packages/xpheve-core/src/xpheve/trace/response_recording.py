"""One reading of a response: values that ask Python's ``if`` are told to go one way, and what was asked is kept."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

import numpy as np

from xpheve.trace.graph import Graph, Node
from xpheve.trace.recording import Recording
from xpheve.trace.values import NUMBER, Traced, chosen, coerced

Made = TypeVar("Made")

OWN_ROUNDING = frozenset("exp expm1 log log1p sin cos tan asin acos atan atan2 sinh cosh tanh cbrt hypot".split(" "))
"""Operations of which NumPy's are off by a bit here and there; those of ``math`` are not."""

MOST_DECISIONS = 64
"""On one way through a response."""

MOST_SIDE_WAYS = 16
"""Ways through one call that are joined."""

MAY_RAISE = frozenset(
    {"/", "sqrt", "exp", "expm1", "log", "log1p", "sin", "cos", "tan", "asin", "acos", "sinh", "cosh", "pow"}
)
"""Operations of which Python refuses some: where their result is not finite, Python is asked."""


class Way:
    """Decisions one after another: those of ``prefix`` first, then all for true; ``taken`` tells what was decided."""

    def __init__(self, prefix: Iterable[bool] = ()) -> None:
        self.prefix = list(prefix)
        self.taken: list[tuple[Node, bool]] = []
        self.known: dict[int, bool] = {}

    def decide(self, node: Node) -> bool:
        """The next answer."""
        answer = self.prefix[len(self.taken)] if len(self.taken) < len(self.prefix) else True
        self.known[node.index] = answer
        self.taken.append((node, answer))
        return answer

    def others(self) -> Iterable[list[bool]]:
        """The prefixes of ways that part from this one after its own prefix."""
        answers = [answer for _, answer in self.taken]
        return [[*answers[:k], False] for k in range(len(self.prefix), len(answers))]


class Apart(Exception):
    """The ways through a call end in what cannot be one value."""


class ResponseRecording(Recording):
    """One reading of ``respond`` along one way through its decisions.

    Calls of functions in it are read along all of their own ways, and joined to one value where that can be: ``ways`` are those that are
    followed now, the first of them that of the response. ``checks`` are the operations that Python may refuse, each with the condition under
    which it is reached, or None.
    """

    def __init__(self, label: str, graph: Graph | None = None, prefix: Iterable[bool] = ()) -> None:
        super().__init__(label, pair=True)
        self.method = "respond"
        if graph is not None:
            self.graph = graph
        self.graph.check_dimensions = False
        self.ways = [Way(prefix)]
        self.checks: dict[tuple[int, int], tuple[Node, Node | None]] = {}
        self._exact = 0

    @property
    def apply(self) -> str:
        """What an author may do instead."""
        return "leave it to Python, which is slower"

    def op(self, op: str, *nodes: Node) -> Node:
        if op in OWN_ROUNDING and not self._exact:
            self.refuse(f"np.{op} of a traced value: it may differ from compiled code in its last bit; write math.{op}")
        found = super().op(op, *nodes)
        if found.op in MAY_RAISE:
            self.check(found)
        return found

    def check(self, node: Node) -> None:
        """Where ``node`` is not finite, Python is to be asked."""
        condition = self._condition()
        self.checks[node.index, -1 if condition is None else condition.index] = node, condition

    def _condition(self) -> Node | None:
        """What has been decided in the calls that are followed now."""
        found: Node | None = None
        for way in self.ways[1:]:
            for question, answer in way.taken:
                one = question if answer else self.graph.op("not", question)
                found = one if found is None else self.graph.op("and", found, one)
        return found

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
        for way in self.ways:
            if node.index in way.known:
                return way.known[node.index]
        if sum(len(way.taken) for way in self.ways) >= MOST_DECISIONS:
            self.refuse(
                f"decides more than {MOST_DECISIONS} times on one way: a loop that ends by what it computes is no formula"
            )
        return self.ways[-1].decide(node)

    # Calls

    def joined(self, call: Callable[[], Any]) -> Any:
        """What ``call()`` gives, whatever it decides; if its ways cannot be joined, its decisions are those of whoever calls."""
        error, checks, depth = self.error, dict(self.checks), len(self.ways)
        try:
            ways: list[tuple[list[tuple[Node, bool]], Any]] = []
            open_ends = [list[bool]()]
            while open_ends:
                way = Way(open_ends.pop(0))
                self.ways.append(way)
                value = call()
                del self.ways[depth:]
                if self.error is not error or len(ways) >= MOST_SIDE_WAYS:
                    raise Apart
                ways.append((way.taken, value))
                open_ends += way.others()
            return self._one_of(ways, 0)
        except Exception:
            del self.ways[depth:]
            self.error, self.checks = error, checks
        return call()

    def _one_of(self, ways: Sequence[tuple[list[tuple[Node, bool]], Any]], depth: int) -> Any:
        """The value of ``ways`` that agree on all questions before ``depth``."""
        taken, value = ways[0]
        if len(taken) <= depth:
            return value
        question = Traced(self, [taken[depth][0]], NUMBER)
        yes, no = (
            self._one_of([way for way in ways if way[0][depth][1] is answer], depth + 1) for answer in (True, False)
        )
        return self._either(question, yes, no)

    def _either(self, question: Traced, yes: Any, no: Any) -> Any:
        """``yes`` or ``no``, component by component; raises `Apart` where they are not of one kind."""
        if yes is no or (type(yes) is type(no) and isinstance(yes, (str, float, int)) and yes == no):
            return yes
        if type(yes) is type(no) and isinstance(yes, (tuple, list)) and len(yes) == len(no):
            parts = [self._either(question, a, b) for a, b in zip(yes, no, strict=True)]
            return type(yes)(*parts) if hasattr(yes, "_fields") else type(yes)(parts)
        if not all(isinstance(one, (Traced, bool, int, float, np.floating)) for one in (yes, no)):
            raise Apart
        one, other = coerced(self, yes), coerced(self, no)
        if one.form != other.form or one.is_truth != other.is_truth:
            raise Apart
        return chosen(self, question, one, other)


COMPARE: dict[str, Any] = {
    "<": float.__lt__,
    "<=": float.__le__,
    ">": float.__gt__,
    ">=": float.__ge__,
    "==": float.__eq__,
    "!=": float.__ne__,
}
