"""What kind of law a trace is: what it depends on, whether it is constant, linear, invariant, conservative; what it costs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from xpheve.laws.view import STATE
from xpheve.trace.derivative import is_zero, jacobian
from xpheve.trace.graph import COMPARISONS, LOGIC, Node, walk
from xpheve.trace.law_trace import LawTrace

MOVING = ("position", "velocity", "orientation", "angular_velocity")
"""State, in the order in which it is named."""


class Operations(NamedTuple):
    """Operations an object (or pair) and evaluation; what all objects share, parameters alone, is not counted.

    ``plain`` are sums, products, comparisons and choices, ``functions`` are powers, exponentials, sines and the like.
    """

    plain: int
    divisions: int
    roots: int
    functions: int
    tables: int

    def __str__(self) -> str:
        parts = [f"{self.plain} operation{'s' * (self.plain != 1)}"]
        for count, one in zip(self[1:], ("division", "root", "function", "table"), strict=True):
            if count:
                parts.append(f"{count} {one}{'s' * (count != 1)}")
        return ", ".join(parts)


@dataclass(frozen=True)
class Nature:
    """What follows from the expressions of a law, for any numbers of its parameters.

    Attributes
    ----------
    pair
        Whether it acts between two objects.
    reads
        Names that force and torque read, by side: "a" and "b" of a pair law, else "". ``time`` and ``up`` are in each that exists.
    constant
        Reads neither state nor time.
    linear
        Force = A x + B v + f(t) with A and B that depend on no state and no time, and there is no torque; proven from the expression.
    translation
        Reads positions of a pair only as their difference; of a field law: reads no position.
    galilean
        The same, and of velocities too.
    conservative
        "yes": the potential is that of the force. "workless": no potential, and no power at any state tried. "no": the power depends on
        velocity, time or path, or the potential does not match. "unknown": no potential is given.
    operations
        Of force and torque together.
    """

    pair: bool
    reads: Mapping[str, frozenset[str]]
    constant: bool
    linear: bool
    translation: bool
    galilean: bool
    conservative: str
    operations: Operations

    @property
    def names(self) -> frozenset[str]:
        """What is read of any side."""
        return frozenset[str]().union(*self.reads.values())

    @property
    def time_dependent(self) -> bool:
        """Whether time is read."""
        return "time" in self.names

    def depends_on(self, name: str, side: str | None = None) -> bool:
        """Whether ``name`` is read, of ``side`` or of any."""
        return name in (self.names if side is None else self.reads.get(side, frozenset()))

    @property
    def velocity_dependent(self) -> bool:
        """Whether velocity or angular velocity is read."""
        return bool(self.names & {"velocity", "angular_velocity"})

    def words(self) -> str:
        """The same for people, such as ``"depends on velocity; not linear; takes or gives work; 14 operations, 1 root"``."""
        parts = [self._kind()]
        if self.linear and not self.constant:
            parts.append("linear")
        if self.pair:
            parts.append("the same everywhere and at any common speed" if self.galilean else "")
            parts.append("the same everywhere" if self.translation and not self.galilean else "")
        parts.append(
            {
                "yes": "conservative",
                "workless": "does no work",
                "no": "not conservative: its work is reported",
                "unknown": "no potential: its work is reported",
            }[self.conservative]
        )
        parts.append(str(self.operations))
        return "; ".join(part for part in parts if part)

    def _kind(self) -> str:
        if self.constant:
            return "constant"
        moving = [name for name in MOVING if name in self.names]
        if self.time_dependent:
            moving.append("time")
        return "depends on " + _listed([name.replace("_", " ") for name in moving])


def _listed(words: Sequence[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def nature(trace: LawTrace, potential_matches: bool | None = None, workless: bool = False) -> Nature:
    """The nature of a traced law.

    Parameters
    ----------
    trace
        The law's.
    potential_matches
        Whether the potential is that of the force, and whether the law never does work: numbers say that, see `xpheve.trace.check`.
    """
    reads = _reads(trace)
    names = frozenset[str]().union(*reads.values())
    constant = not names & STATE and "time" not in names
    return Nature(
        trace.pair,
        reads,
        constant,
        _is_linear(trace, names),
        _only_differences(trace, ("position",)),
        _only_differences(trace, ("position", "velocity")),
        _conservative(trace, names, potential_matches, workless),
        operations(trace.motion),
    )


def _reads(trace: LawTrace) -> dict[str, frozenset[str]]:
    sides = ("a", "b") if trace.pair else ("",)
    inputs = [node.value for node in walk(trace.motion) if node.op == "input"]
    return {side: frozenset(one.name for one in inputs if one.side in (side, "")) for side in sides}


def operations(nodes: Sequence[Node]) -> Operations:
    """How many operations an object ``nodes`` need."""
    counts = dict.fromkeys(Operations._fields, 0)
    own: dict[int, bool] = {}
    for node in walk(nodes):
        own[node.index] = node.op == "input" or any(own[arg.index] for arg in node.args)
        if own[node.index] and node.op != "input":
            counts[COSTS.get(node.op, "functions")] += 1
    return Operations(**counts)


COSTS = {
    **dict.fromkeys(
        ("+", "-", "*", "neg", "abs", "sign", "floor", "min", "max", "where", *COMPARISONS, *LOGIC), "plain"
    ),
    "/": "divisions",
    "sqrt": "roots",
    "hypot": "roots",
    "table": "tables",
}
"""What an operation counts as; all others are functions."""


# Linear: degrees in position and velocity, 0 or 1; a coefficient that changes in time is of degree TIMED.
FREE, TIMED, AFFINE, BEYOND = 0, 1, 2, 3


def _is_linear(trace: LawTrace, names: frozenset[str]) -> bool:
    """Whether the force is proven to be A x + B v + f(t)."""
    if names & {"orientation", "angular_velocity"} or trace.force is None or not all(map(is_zero, trace.torque or ())):
        return False
    return all(degree <= AFFINE for degree in degrees(trace.force))


def degrees(nodes: Sequence[Node]) -> list[int]:
    """How position and velocity are in ``nodes``: FREE, TIMED, AFFINE (to the first power, coefficients constant), or BEYOND."""
    degree: dict[int, int] = {}
    for node in walk(nodes):
        degree[node.index] = _degree(node, [degree[arg.index] for arg in node.args])
    return [degree[node.index] for node in nodes]


def _degree(node: Node, args: Sequence[int]) -> int:
    if node.op == "input":
        return AFFINE if node.value.name in ("position", "velocity") else TIMED if node.value.name == "time" else FREE
    most = max(args, default=FREE)
    if most <= TIMED:
        return most
    if node.op in ("+", "-", "neg"):
        return most
    if node.op == "*":
        return AFFINE if sorted(args) == [FREE, AFFINE] else BEYOND
    if node.op == "/":
        return AFFINE if list(args) == [AFFINE, FREE] else BEYOND
    if node.op == "where" and args[0] == FREE:
        return most
    return BEYOND


def _only_differences(trace: LawTrace, names: tuple[str, ...]) -> bool:
    """Whether inputs called ``names`` are read only as that of a minus that of b, or the other way about, or not at all."""
    outputs = [*trace.motion, *([trace.potential] if trace.potential is not None else [])]
    if any(node.op == "input" and node.value.name in names for node in outputs):
        return False
    for node in walk(outputs):
        inside = [arg.value for arg in node.args if arg.op == "input" and arg.value.name in names]
        if inside and not (
            node.op == "-"
            and len(inside) == 2
            and inside[0][1:] == inside[1][1:]
            and {inside[0].side, inside[1].side} == {"a", "b"}
        ):
            return False
    return True


def _conservative(trace: LawTrace, names: frozenset[str], matches: bool | None, workless: bool) -> str:
    if trace.potential is not None:
        return {True: "yes", False: "no", None: "unknown"}[matches]
    if workless:
        return "workless"
    if "time" in names or names & {"velocity", "angular_velocity"}:
        return "no"
    if trace.pair or trace.force is None or "orientation" in names:
        return "unknown"
    slopes = jacobian(trace, "position")
    curls = [(slopes[i][j], slopes[j][i]) for i, j in ((0, 1), (0, 2), (1, 2))]
    # A gradient has a symmetric Jacobian: where one entry is 0 everywhere and its mirror is not, there is no potential.
    return "no" if any(is_zero(one) != is_zero(other) for one, other in curls) else "unknown"
