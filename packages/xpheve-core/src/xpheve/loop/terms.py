"""What a loop is made of: the laws that act, as terms, and where the numbers of a row lie."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from xpheve.trace.graph import Input, Node, walk
from xpheve.trace.law_trace import LawTrace

LANES = 32
"""Rows of a tile. A tile holds its numbers lane by lane at constant distances, so that compilers see what overlaps, and caches hold it."""

WIDTHS = {"inertia": 3, "orientation": 4, "angular_velocity": 3}
"""Numbers of a row that a loop leaves as they are, where they are more than one."""

CHANGING = {
    "position": 3, "velocity": 3, "position_rest": 3, "velocity_rest": 3, "acceleration": 3, "working": 3, "work": 1, "work_rest": 1,
}  # fmt: skip
"""What a run changes of a row, with the numbers it has."""

TURNING = {"orientation": 4, "angular_velocity": 3, "torque": 3}
"""What a run changes besides where rows turn; `Slots` adds what it needs for that: the stored torque and the moments, in units of the middle one."""
MOMENTS = {"stored_torque": 3, "excess": 3, "spread": 3, "inverse_moment": 1}

MOVING = ("position", "velocity")
OWN = ("mass", "inertia", "orientation", "angular_velocity", "volume", "since")
"""What laws read of a row, besides `MOVING`, that is no column."""
SCENE = ("time", "up")
"""Inputs that are the same for all rows."""


class Term(NamedTuple):
    """A law class in a loop.

    ``accounted`` if a potential stands for its force, ``switch`` if it can be put out by a number, ``near`` if it has a cutoff.
    """

    trace: LawTrace
    accounted: bool
    switch: bool = False
    near: bool = False

    @property
    def of_velocity(self) -> bool:
        """Whether force or torque depends on a velocity, or on an angular velocity."""
        return bool(self.trace.reads & {"velocity", "angular_velocity"})

    @property
    def of_turning(self) -> bool:
        """Whether it needs to know how a row turns, or turns it."""
        return self.trace.torque is not None or bool(self.trace.reads & {"orientation", "angular_velocity"})

    @property
    def size(self) -> int:
        """Numbers of an instance in the parameter table.

        Its parameters, whether it is on, and of a cutoff the square, itself, and how far lists of neighbours reach.
        """
        return len(self.trace.parameters) + (4 if self.near else 1)


def summation_order(terms: Sequence[Term]) -> list[int]:
    """The places of ``terms`` in the order in which their forces are summed: those without velocities first, as they are found once a step."""
    return sorted(range(len(terms)), key=lambda k: (terms[k].of_velocity, k))


class Slots:
    """Where the numbers of a row lie: slot k of the row in lane l of a tile is at ``tile * width * LANES + k * LANES + l``."""

    def __init__(
        self, columns: Iterable[str], pairs: Sequence[Term], stored_work: bool, turning: bool = False, ages: int = 1
    ) -> None:
        self.first: dict[str, int] = {}
        self.width = 0
        self.starts: dict[Any, int] = {}
        """Where the numbers of each table begin in the buffer of all."""
        self.run = CHANGING | TURNING if turning else CHANGING
        """What a run changes, with the numbers it has."""
        for name, width in self.run.items():
            self._add(name, width)
        self.changing = self.width
        """Slots that a run changes; they come first."""
        self._add("stored", 3)
        self._add("inverse_mass", 1)
        for name, width in MOMENTS.items() if turning else ():
            self._add(name, width)
        if stored_work:
            self._add("stored_working", 3)
        if pairs:
            self._add("middle", 3)
        if any(term.of_velocity for term in pairs):
            self._add("middle_velocity", 3)
            if turning:
                self._add("middle_spin", 3)
        self.sums, self.pair_work = _sums(pairs)
        for names in self.sums.values():
            for name in names:
                self._add(name, 3)
        self.columns = tuple(name for name in columns if not (turning and name in TURNING))
        for name in self.columns:
            self._add(slot_of(name), ages if name == "since" else WIDTHS.get(name, 1))
        self.width += 1 - self.width % 2
        # An odd number of slots: so the tiles' equal slots are spread over all sets of a cache, where an even one would put them into few.

    def _add(self, name: str, width: int) -> None:
        if name in self.first:
            return
        self.first[name] = self.width
        self.width += width

    def at(self, name: str, component: int = 0) -> int:
        """The distance of a component from the first number of its row, in a tile."""
        return (self.first[name] + component) * LANES


def slot_of(name: str) -> str:
    """The slot of what laws call ``name``; that of a column is none of the loop's own, whatever the column is called."""
    return name if name in (*MOVING, *OWN) else f"column {name}"


def _sums(pairs: Sequence[Term]) -> tuple[dict[Term, tuple[str, ...]], tuple[str, ...]]:
    """The slots that sum the forces of each pair law, and those that hold what works.

    "pull" is found once a step, "push" again with the velocity of the middle. Where some have a potential and others have none, what works is
    summed beside.
    """
    sums: dict[Term, tuple[str, ...]] = {}
    work: list[str] = []
    for name in ("pull", "push"):
        mine = [term for term in pairs if term.of_velocity == (name == "push")]
        mixed = len({term.accounted for term in mine}) > 1
        for term in mine:
            sums[term] = (name, f"{name}_working") if mixed and not term.accounted else (name,)
        if any(not term.accounted for term in mine):
            work.append(f"{name}_working" if mixed else name)
    return sums, tuple(work)


def columns_of(terms: Iterable[Term], turning: bool = False) -> tuple[str, ...]:
    """What ``terms`` read of a row besides place and velocity, in order of name; for torques, too, if rows are ``turning``."""
    found: set[str] = set()
    for term in terms:
        outputs = term.trace.motion if turning else term.trace.force or ()
        found.update(node.value.name for node in walk(outputs) if node.op == "input")
    return tuple(sorted(found - {*MOVING, *SCENE}))


def depends(outputs: Sequence[Node], names: Sequence[str]) -> set[int]:
    """Indices of the nodes of ``outputs`` that change with an input of ``names``."""
    found: set[int] = set()
    for node in walk(outputs):
        reads = node.op == "input" and node.value.name in names
        if reads or any(arg.index in found for arg in node.args):
            found.add(node.index)
    return found


def rowwise(outputs: Sequence[Node]) -> set[int]:
    """Indices of the nodes of ``outputs`` that differ from row to row."""
    found: set[int] = set()
    for node in walk(outputs):
        own = node.op == "input" and node.value.name not in SCENE
        if own or any(arg.index in found for arg in node.args):
            found.add(node.index)
    return found


def shared_nodes(outputs: Sequence[Node], without: set[int]) -> list[Node]:
    """The nodes of ``outputs`` outside ``without`` that nodes inside need, or that are outputs themselves."""
    wanted: dict[int, Node] = {}
    for node in walk(outputs):
        for arg in node.args:
            if node.index in without and arg.index not in without:
                wanted[arg.index] = arg
    for node in outputs:
        if node.index not in without:
            wanted[node.index] = node
    return list(wanted.values())


__all__ = [
    "LANES",
    "Input",
    "Slots",
    "Term",
    "columns_of",
    "depends",
    "rowwise",
    "shared_nodes",
    "slot_of",
    "summation_order",
]
