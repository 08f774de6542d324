"""One reading of a law: its graph, and the first error, which no ``except`` of the author's can swallow."""

from __future__ import annotations

import linecache
import re
from typing import Any, NoReturn

from xpheve.errors import TracedBranchError, TraceError
from xpheve.trace.graph import Graph, Node, Place, at, author_place, line_of

MOST_NODES = 20_000
"""Operations of one law. Beyond it a loop was meant for `apply`: text of this length takes minutes to compile."""


class Recording:
    """What a law's methods write into while they are read, and how they are told what does not go.

    Parameters
    ----------
    label
        The law's, for messages.
    pair
        Whether its methods take two sides.
    """

    def __init__(self, label: str, pair: bool = False) -> None:
        self.label = label
        self.pair = pair
        self.graph = Graph(label)
        self.method = "force"
        self.definition: Place = ("", 0)
        """Where the method begins, for messages on what it returns."""
        self.error: TraceError | None = None
        """The first error."""

    @property
    def apply(self) -> str:
        """The method that is never traced, as an author writes it."""
        return "apply(self, a, b)" if self.pair else "apply(self, body)"

    @property
    def where(self) -> str:
        """The method that is being read, for messages."""
        return f"{self.label}.{self.method}"

    def note(self, error: TraceError) -> None:
        """Keep ``error`` if it is the first."""
        self.error = self.error or error

    def refuse(self, text: str, place: Place | None = None) -> NoReturn:
        """Raise `TraceError`; ``place``, or else the author's line, is named."""
        error = TraceError(f"{self.where}: {text}. {at(author_place() if place is None else place)}".rstrip())
        self.note(error)
        raise error

    def decide(self, value: Any) -> bool:
        """What Python's ``if`` takes ``value`` for: a formula is said of many objects at once, and cannot tell."""
        self.branch()

    def whole_part(self) -> None:
        """Called before a whole part of a quotient is written."""

    def branch(self, doing: str = "") -> NoReturn:
        """Raise `TracedBranchError` for a Python decision on a value that is no number yet; ``doing`` names a call such as ``float()``."""
        place = author_place()
        text = linecache.getline(*place).strip()
        said = f"{line_of(place).removesuffix(text)}`{text}`" if text else line_of(place)
        if doing:
            found = f"{doing} of a traced value, which is no number yet. {_instead_of(doing, text)}"
        else:
            found = f"branches on a traced value. {_instead_of_branch(text)}"
        error = TracedBranchError(f"{self.where}: {said} {'asks for ' if doing else ''}{found}, or write {self.apply}")
        self.note(error)
        raise error

    def op(self, op: str, *nodes: Node) -> Node:
        """The node of ``op``; raises `DimensionError`, and `TraceError` where a law has too many operations."""
        try:
            found = self.graph.op(op, *nodes)
        except TraceError as error:
            self.note(error)
            raise
        self._count()
        return found

    def power(self, base: Node, exponent: float) -> Node:
        """``base`` to the literal ``exponent``."""
        found = self.graph.power(base, exponent)
        self._count()
        return found

    def number(self, node: Node) -> Node:
        """``node`` as a number: 1 or 0 if it is a truth."""
        if not node.truth:
            return node
        return self.op("where", node, self.graph.const(1.0), self.graph.const(0.0))

    def truth(self, node: Node) -> Node:
        """``node`` as a truth: whether it is not 0."""
        return node if node.truth else self.op("!=", node, self.graph.const(0.0))

    def _count(self) -> None:
        if len(self.graph.nodes) > MOST_NODES:
            self.refuse(
                f"more than {MOST_NODES:,} operations: every turn of a loop is written out in the traced law. "
                f"Write {self.apply}, which is not traced"
            )


def _unchained(text: str) -> str:
    """``text`` with ``(a < x) & (x < b)`` for ``a < x < b``."""
    atom, sign = r"(-?[\w.]+(?:\(\))?)", r"\s*([<>]=?)\s*"
    return re.sub(atom + sign + atom + sign + atom, r"(\1 \2 \3) & (\3 \4 \5)", text)


def _instead_of_branch(text: str) -> str:
    """What an author may write in place of the branch on the line ``text``."""
    chained, text = text, _unchained(text)
    ternary = re.search(r"(?:return|[=(,])\s*([^=(,]+?) if (.+?) else (.+?)\)?$", text)
    plain = re.match(r"(?:el)?if (.+):|while (.+):|assert (.+?)(?:,|$)", text)
    if ternary:
        condition, chosen = ternary[2], f"np.where({ternary[2]}, {ternary[1]}, {ternary[3]})"
    elif plain:
        condition = next(group for group in plain.groups() if group)
        chosen = f"np.where({condition}, a, b)"
    elif re.search(r"\b(min|max)\(", text):
        return "Use np.minimum(a, b) or np.maximum(a, b)"
    else:
        condition, chosen = text, "np.where(condition, a, b)"
    if re.search(r"\b(and|or|not)\b", condition):
        return "Use np.where(condition, a, b), with (p) & (q) for `p and q`, (p) | (q) for `p or q`, ~(p) for `not p`"
    if text != chained and not (ternary or plain):
        return f"Use (a < x) & (x < b) for `a < x < b`: {text}"
    return f"Use {chosen}"


def _instead_of(doing: str, text: str) -> str:
    """What an author may write in place of a call that asks for a number."""
    called = re.search(r"math\.(\w+)\(", text)
    if doing == "float()" and not called and re.match(r"[\w.]+\[[^=]*\]\s*[-+*/]?=[^=]", text):
        return "A NumPy array holds numbers only: put components together by xp.vector(x, y, z)"
    if doing == "float()" and called:
        name = {"fabs": "abs", "asin": "arcsin", "acos": "arccos", "atan": "arctan", "atan2": "arctan2", "pow": "power"}
        return f"Use np.{name.get(called[1], called[1])}"
    return {
        "float()": "Leave float() out",
        "int()": "Use np.floor",
        "an index": "Use np.where, or a Param with choices=(...) if it chooses the formula",
        "iteration": "Use .x, .y and .z for components",
        "len()": "A formula says it for each object, whatever their number",
        "round()": "Use np.floor(x + 0.5)",
    }.get(doing, "Use np.where(condition, a, b)")
