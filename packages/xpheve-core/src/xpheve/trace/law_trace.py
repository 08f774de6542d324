"""What tracing a law gives: its graph, and what follows from it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from xpheve.trace.graph import Graph, Node, Parameter, walk
from xpheve.trace.numpy_text import GraphFunction, array_function

Triple = tuple[Node, Node, Node]


@dataclass(frozen=True)
class LawTrace:
    """The expressions of one law, for one choice of its parameters that are no numbers (text, switches, None).

    ``label`` is the law's, ``pair`` says whether it acts between two, ``graph`` holds the nodes. ``force`` and ``torque`` are three nodes
    each, ``potential`` is one; None where the law has no such method. Inputs are named as in `xpheve.laws.view.BodyView`; of a pair law's,
    ``side`` is "a" or "b", but for ``time`` and ``up``, which are the scene's.
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
    def columns(self) -> frozenset[str]:
        """All names that force, torque and potential read."""
        own = frozenset(node.value.name for node in walk(self._potentials) if node.op == "input")
        return self.reads | own

    @cached_property
    def _potentials(self) -> list[Node]:
        return [] if self.potential is None else [self.potential]

    @cached_property
    def motion_arrays(self) -> GraphFunction:
        """``motion`` on NumPy arrays."""
        return array_function(self.motion)

    @cached_property
    def potential_arrays(self) -> GraphFunction:
        """``potential`` on NumPy arrays; there must be one."""
        return array_function(self._potentials)

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """The numbers of parameters that force, torque and potential read, in the order of the parameter table."""
        outputs = [*self.motion, *self._potentials]
        return tuple(sorted({node.value for node in walk(outputs) if node.op == "param"}))
