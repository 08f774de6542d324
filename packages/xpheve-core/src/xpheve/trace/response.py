"""Reading a response: ``respond`` is called once for each way through its decisions, with values that write down what is done to them.

What comes out is a tree: at each branch a question, at each leaf an answer. A way that does what no formula may do ends in a leaf that
asks the law in Python, so that what is fused is never anything but what the law says.

Source: recording by operator overloading, as in A. Griewank, A. Walther, Evaluating Derivatives (2nd ed. 2008), chapter 6; one way after
another by answering the last open question otherwise: depth first, as in J. C. King, Symbolic execution and program testing (1976).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from typing import Any

import numpy as np

from xpheve.errors import TraceError
from xpheve.kernels.response import ASK, IMPULSE, MOST_COLUMNS, SPEED, VELOCITIES
from xpheve.laws import ResponseLaw
from xpheve.trace.graph import Graph, Node, Parameter, walk
from xpheve.trace.plain_python import Doors, GivenImpulse, GivenVelocities
from xpheve.trace.recorder import _chance
from xpheve.trace.response_recording import ResponseRecording
from xpheve.trace.response_shadow import TracedContact, response_shadow
from xpheve.trace.values import NUMBER, coerced

MOST_WAYS = 64
"""Ways through one response that are read; others are left to Python."""


@dataclass(frozen=True)
class Leaf:
    """One way's answer: its kind, as `xpheve.kernels.response` numbers them, and its values; ``why`` says why Python is asked.

    ``checks`` are operations on the way that Python may refuse, each with the condition under which it is reached, None for always.
    """

    kind: int
    values: tuple[Node, ...] = ()
    checks: tuple[tuple[Node, Node | None], ...] = ()
    why: str = ""


@dataclass(frozen=True)
class Branch:
    """A question, and what follows if it holds, and if not."""

    question: Node
    yes: Tree
    no: Tree


Tree = Leaf | Branch
Way = tuple[list[tuple[Node, bool]], Leaf]
"""What was decided on it, and how it ended."""


@dataclass(frozen=True)
class ResponseTrace:
    """What a response computes, for one choice of its parameters that are no numbers.

    ``label`` is the law's, ``graph`` holds the nodes, ``tree`` the ways. ``columns`` are those that are read, ``parameters`` the numbers
    of parameters, each in a fixed order; ``partly`` says why some of its ways are left to Python, and is empty if none is.
    """

    label: str
    graph: Graph
    tree: Tree
    columns: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    partly: str


def trace_response(law: ResponseLaw, columns: Iterable[str] = ()) -> ResponseTrace:
    """What ``respond`` of ``law`` computes.

    Parameters
    ----------
    law
        Which need not be in an engine, and is not changed.
    columns
        Columns that objects have besides those that the law declares.

    Raises
    ------
    TraceError
        If no way through it can be read, if it draws random numbers, or asks for too much: the reason, with the line.
    """
    if "respond" in law.__dict__:
        raise TraceError(f"{law.label()}.respond was set on the law by hand")
    at_hand = [*law.columns, *columns]
    before = _chance()
    graph, tree = _read(law, at_hand)
    if _chance() != before:
        raise TraceError(f"{law.label()}.respond draws random numbers")
    leaves = _leaves(tree)
    asking = [leaf.why for leaf in leaves if leaf.kind == ASK]
    if len(asking) == len(leaves):
        raise TraceError(asking[0])
    needed = list(walk(_nodes(tree)))
    if any(node.op in ("table", "kernel", "pick") for node in needed):
        raise TraceError(f"{law.label()}.respond looks something up in a table")
    read = tuple(sorted({node.value.name for node in needed if node.op == "input" and node.value.side.endswith("[]")}))
    if len(read) > MOST_COLUMNS:
        raise TraceError(f"{law.label()}.respond reads {len(read)} columns, and {MOST_COLUMNS} is the most")
    parameters = tuple(sorted({node.value for node in needed if node.op == "param"}))
    return ResponseTrace(law.label(), graph, tree, read, parameters, asking[0] if asking else "")


def _read(law: ResponseLaw, columns: Sequence[str]) -> tuple[Graph, Tree]:
    """One reading along all ways, those with the first questions first; what is left over when there are too many asks Python."""
    graph, doors = Graph(law.label(), check_dimensions=False), Doors()
    ways: list[Way] = []
    open_ends: list[tuple[int, int, list[bool]]] = [(0, 0, [])]
    while open_ends and len(ways) < MOST_WAYS:
        _, _, prefix = heappop(open_ends)
        recording = ResponseRecording(law.label(), graph, prefix)
        leaf = _leaf(law, recording, columns, doors)
        ways.append((recording.ways[0].taken, leaf))
        for other in recording.ways[0].others():
            heappush(open_ends, (len(other), len(ways), other))
    too_many = Leaf(ASK, why=f"{law.label()}.respond has more than {MOST_WAYS} ways through its decisions")
    return graph, _tree(ways, 0, too_many)


def _tree(ways: Sequence[Way], depth: int, unread: Leaf) -> Tree:
    """The tree of ``ways`` that agree on all questions before ``depth``; where there is no way it is ``unread``."""
    if not ways:
        return unread
    taken, leaf = ways[0]
    if len(taken) <= depth:
        return leaf
    question = taken[depth][0]
    yes, no = (
        _tree([way for way in ways if way[0][depth][1] is answer], depth + 1, unread) for answer in (True, False)
    )
    if _same_leaf(yes, no):
        return yes
    return Branch(question, yes, no)


def _same_leaf(one: Tree, other: Tree) -> bool:
    """Whether two trees are leaves that answer alike."""
    if not (isinstance(one, Leaf) and isinstance(other, Leaf)) or one.kind == ASK:
        return False
    return one.kind == other.kind and [node.index for node in _nodes(one)] == [node.index for node in _nodes(other)]


def _leaves(tree: Tree) -> list[Leaf]:
    return [tree] if isinstance(tree, Leaf) else [*_leaves(tree.yes), *_leaves(tree.no)]


def _nodes(tree: Tree) -> list[Node]:
    """All questions and values."""
    if isinstance(tree, Leaf):
        return [*tree.values, *(node for check in tree.checks for node in check if node is not None)]
    return [tree.question, *_nodes(tree.yes), *_nodes(tree.no)]


def _leaf(law: ResponseLaw, recording: ResponseRecording, columns: Sequence[str], doors: Doors) -> Leaf:
    """The answer on the way that ``recording`` follows; what cannot be read, or raises, is left to Python."""
    doors.recording = recording
    try:
        shadow = response_shadow(law, recording, doors)
        with np.errstate(all="ignore"):
            answer = shadow.respond(TracedContact(recording, law, columns, doors))
        if recording.error is not None:
            raise recording.error
        return _answer(recording, answer)
    except Exception as error:
        why = recording.error or error
        said = str(why) if isinstance(why, TraceError) else f"{recording.where} raised {type(why).__name__}: {why}"
        return Leaf(ASK, why=said)


def _answer(recording: ResponseRecording, answer: Any) -> Leaf:
    kind, given = SPEED, (answer,)
    if isinstance(answer, GivenImpulse):
        kind, given = IMPULSE, answer.vector
    elif isinstance(answer, GivenVelocities):
        kind, given = VELOCITIES, (*answer.a, *answer.b)
    wanted = {SPEED: 1, IMPULSE: 3, VELOCITIES: 6}[kind]
    values = [coerced(recording, one) for one in given]
    if len(values) != wanted or any(len(value.at) != 1 or (kind == SPEED and value.form != NUMBER) for value in values):
        recording.refuse("returned what is neither a number, nor an Impulse, nor Velocities of three numbers each")
    return Leaf(kind, tuple(recording.number(value.nodes[0]) for value in values), tuple(recording.checks.values()))
