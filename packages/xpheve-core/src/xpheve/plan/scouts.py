"""The steps that sources are going to make, found ahead of them, so that what they act on need not stop where each of them ends.

A copy of the sources' batch is stepped on by the same stepper, and the ways of its rows are kept, step by step. The batch itself goes on as ever, to
the same bits; where it does not, because an event has changed it, what was found ahead is void, and so are the flights of what it acts on.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple

from xpheve.errors import XpheveError
from xpheve.kernels.clock import NEVER, Instant
from xpheve.steppers.contract import STATE_NAMES, Array, State

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from xpheve.plan.courses import Piece
    from xpheve.plan.groups import Batch
    from xpheve.plan.world import World

MOST = 256
"""Steps that are kept."""


def may_be_scouted(world: World, batch: Batch) -> bool:
    """Whether the next steps of ``batch`` may be found ahead: nothing moves it but its own traced laws."""
    signature = batch.signature
    if batch.stepper.covered(batch.state) == NEVER or signature.level or signature.contacts or signature.flows:
        return False
    sources = world.sources(batch)
    return signature.traced and sources is not None and sources.held is not None and not len(sources.hands)


class Leg(NamedTuple):
    """A step: until when it goes, the ways of rows, and in what state it leaves the batch."""

    until: Instant
    ways: dict[int, list[Piece]]
    mark: bytes


class Scout:
    """Finds the steps of ``batch`` ahead; ``way`` gives the pieces of the way of a row over the present step.

    Attributes
    ----------
    legs
        The present step of the batch, and those that come, one after another.
    changes
        Goes up when these change.
    """

    def __init__(self, world: World, batch: Batch, way: Callable[[int], list[Piece]]) -> None:
        self.world, self.batch, self.way = world, batch, way
        self.legs: list[Leg] = []
        self.changes = 0
        self.rows: set[int] = set()
        self._seen: Any = None
        self._stuck = False
        self._state: State = batch.state
        self._held: dict[str, Array] = {}

    def reach(self, rows: Sequence[int], begin: Instant, end: Instant, least: Instant) -> Instant:
        """Find the ways of ``rows`` from ``begin`` on to ``least``, and on to ``end`` if that are not too many steps; until when they are known."""
        self._look(rows)
        over = next((k for k, leg in enumerate(self.legs) if leg.until > begin), len(self.legs))
        if over:
            del self.legs[:over]
            self.changes += 1
        while not self._stuck:
            known = self._known
            if known >= end or (known >= least and len(self.legs) >= MOST):
                break
            self._go_on()
        return min(self._known, end)

    @property
    def _known(self) -> Instant:
        return self.legs[-1].until if self.legs else self._until

    def _look(self, rows: Sequence[int]) -> None:
        """Begin anew if the batch is not where it was foreseen, or may go on otherwise."""
        world, batch = self.world, self.batch
        sources, settings = world.sources(batch), world.settings
        assert sources is not None
        numbers = tuple((law.enabled, tuple(law.parameters.values())) for law in sources.laws)
        future = (world.structure, numbers, settings.dt, settings.rtol, settings.atol, batch.stepper.id)
        seen = (future, tuple(world.bodies.version[batch.state.rows].tolist()))
        if seen == self._seen and self.rows.issuperset(rows):
            return
        same = self._seen is not None and self._seen[0] == future and self.rows.issuperset(rows)
        self._seen = seen
        mark = _mark(batch.state)
        if same and any(leg.mark == mark for leg in self.legs):
            return
        self.rows.update(rows)
        self._stuck = False
        self._state, self._held = _copied(batch.state), self._taken()
        self._until = batch.stepper.covered(batch.state)
        self.legs = []
        self.changes += 1
        if self._until > world.bodies.clock_of(int(batch.state.rows[0])):
            self.legs = [self._leg()]

    def _go_on(self) -> None:
        """Find one more step; none where it fails: that is told when the batch gets there."""
        world, batch = self.world, self.batch
        sources = world.sources(batch)
        assert sources is not None
        counted = {law: law.evaluations for law in sources.laws}
        try:
            with self._ahead():
                begin = batch.stepper.covered(batch.state)
                wall = sources.wall(begin, world.host_step_after(begin))
                batch.stepper.advance(batch.state, world.bodies, wall, wall, world.settings, sources)
                self._until = batch.stepper.covered(batch.state)
                self._stuck = not self._until > begin
                if not self._stuck:
                    self.legs.append(self._leg())
                    self.changes += 1
        except (XpheveError, ArithmeticError):
            self._stuck = True
        finally:
            for law, count in counted.items():
                law.evaluations = count

    def _leg(self) -> Leg:
        state = self.batch.state
        return Leg(self.batch.stepper.covered(state), {row: self.way(row) for row in sorted(self.rows)}, _mark(state))

    @contextmanager
    def _ahead(self) -> Iterator[None]:
        """The batch is where it was found to be going, within."""
        batch, bodies = self.batch, self.world.bodies
        real, held = batch.state, self._taken()
        batch.state = self._state
        self._put(self._held)
        try:
            yield
        finally:
            self._state, self._held = batch.state, self._taken()
            batch.state = real
            self._put(held)
            bodies.change += 1

    def _arrays(self) -> dict[str, Array]:
        bodies = self.world.bodies
        return {name: bodies.arrays[name] for name in STATE_NAMES} | {
            "clock": bodies.clock,
            "turn_clock": bodies.turn_clock,
        }

    def _taken(self) -> dict[str, Array]:
        rows = self.batch.state.rows
        return {name: array[:, rows] for name, array in self._arrays().items()}

    def _put(self, held: dict[str, Array]) -> None:
        rows = self.batch.state.rows
        for name, array in self._arrays().items():
            array[:, rows] = held[name]
        self.world.bodies.change += 1


def _copied(state: State) -> State:
    """``state`` with arrays of its own, and nothing of what can be made again."""
    found = copy.copy(state)
    found.rows = state.rows.copy()
    found.arrays = {name: array.copy() for name, array in state.arrays.items()}
    found.numbers = dict(state.numbers)
    for name, kept in vars(state).items():
        if isinstance(kept, dict) and name not in ("arrays", "numbers"):
            setattr(found, name, {})
    found.locate()
    return found


def _mark(state: State) -> bytes:
    """All that ``state`` is, to the bit."""
    arrays = b"".join(name.encode() + array.tobytes() for name, array in sorted(state.arrays.items()))
    return repr(sorted(state.numbers.items())).encode() + state.rows.tobytes() + arrays
