"""What tracing a law gives: its graph, and what follows from it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from xpheve.trace.graph import Graph, Node, Parameter, walk

Triple = tuple[Node, Node, Node]


@dataclass(frozen=True)
class LawTrace:
    """The expressions of one law, for one choice of its parameters that are no numbers (text, switches, None).

    ``force`` and ``torque`` are three nodes each, ``potential`` is one; None where the law has no such method. Inputs are named as in
    `xpheve.laws.view.BodyView`; of a pair law's, ``side`` is "a" or "b", but for ``time`` and ``up``, which are the scene's.
    """

    label: str
    pair: bool
    graph: Graph
    force: Triple | None
    torque: Triple | None
    potential: Node | None

    @property
    def motion(self) -> list[Node]:
        """What acts on the motion: force and torque."""
        return [*(self.force or ()), *(self.torque or ())]

    @cached_property
    def reads(self) -> frozenset[str]:
        """Names that force and torque read of the objects, and ``time`` and ``up``."""
        return frozenset(node.value.name for node in walk(self.motion) if node.op == "input")

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """The numbers of parameters that force, torque and potential read, in the order of the parameter table."""
        outputs = [*self.motion, *([self.potential] if self.potential is not None else [])]
        return tuple(sorted({node.value for node in walk(outputs) if node.op == "param"}))
