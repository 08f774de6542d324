"""From a batch and its laws to the loop that runs it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xpheve.laws import ContinuousLaw, FieldLaw, PairLaw
from xpheve.loop.program import ALL, LISTED, Couples, Program, Segment
from xpheve.loop.terms import Term
from xpheve.steppers.contract import Array, Rows
from xpheve.trace.recorder import trace_law

Places = NDArray[np.int64]


def term_of(world: Any, law: ContinuousLaw) -> Term | None:
    """``law`` as a term of a loop; None if it cannot be one."""
    trace = trace_law(law)
    if trace is None or law.defines("torque"):
        return None
    return Term(trace, law.defines("potential"), world.is_switched(law))


class BatchProgram:
    """The program of a batch, and how its rows lie in it.

    ``order`` are the places of the batch's rows in the order of the program: by law set, then rank. ``sources`` are rows of other batches, or of
    none, that act on it.
    """

    def __init__(self, world: Any, rows: Rows, laws: Sequence[ContinuousLaw], terms: dict[ContinuousLaw, Term]) -> None:
        self.world, self.rows = world, rows
        self.terms = terms
        objects = [world.bodies.objects[row] for row in rows.tolist()]
        fields = [law for law in laws if isinstance(law, FieldLaw)]
        sets = self._law_sets(objects, fields)
        ranks = np.array([obj.rank for obj in objects])
        firsts = {one: k for k, one in enumerate(sorted(set(sets), key=lambda s: tuple(laws.index(law) for law in s)))}
        keys = np.array([firsts[one] for one in sets], dtype=np.int64)
        self.order: Places = np.lexsort((ranks, keys))
        segments = self._segments(keys[self.order], list(firsts))
        self.sources: Rows = np.zeros(0, dtype=np.int64)
        couples = self._couples([law for law in laws if isinstance(law, PairLaw)])
        stored_work = bool(world.bodies.arrays["working"][:, rows].any())
        self.program = Program(segments, couples, len(rows), len(self.sources), stored_work)

    def _law_sets(self, objects: Sequence[Any], fields: Sequence[FieldLaw]) -> list[tuple[FieldLaw, ...]]:
        """The field laws of each object, in order of rank; equal sets are one tuple."""
        members = {law: self.world.mapping.objects(law) for law in fields}
        known: dict[tuple[FieldLaw, ...], tuple[FieldLaw, ...]] = {}
        found = []
        for obj in objects:
            own = tuple(law for law in fields if obj in members[law])
            found.append(known.setdefault(own, own))
        return found

    def _segments(self, keys: Places, sets: list[tuple[FieldLaw, ...]]) -> list[Segment]:
        found = []
        for k, laws in enumerate(sets):
            first, last = int(np.searchsorted(keys, k)), int(np.searchsorted(keys, k, side="right"))
            found.append(Segment(laws, tuple(self.terms[law] for law in laws), first, last))
        return found

    # Pairs

    def _couples(self, laws: Sequence[PairLaw]) -> list[Couples]:
        """The pairs of each class; rows that act and are not the batch's own become its sources."""
        from xpheve.plan.evaluation import pairs_of

        world = self.world
        by_term: dict[Term, list[tuple[PairLaw, list[tuple[Any, Any]]]]] = {}
        own = set(self.rows.tolist())
        for law in laws:
            members = world.in_rank_order(world.mapping.objects(law))
            pairs = [pair for pair in pairs_of(law, members) if pair[0]._row in own or pair[1]._row in own]
            if pairs:
                by_term.setdefault(self.terms[law], []).append((law, pairs))
        used = {obj._row: obj for held in by_term.values() for _, pairs in held for pair in pairs for obj in pair}
        self.sources = np.array(
            [obj._row for obj in world.in_rank_order(o for r, o in used.items() if r not in own)], dtype=np.int64
        )
        places = {int(self.rows[k]): at for at, k in enumerate(self.order.tolist())}
        places |= {row: len(self.rows) + at for at, row in enumerate(self.sources.tolist())}
        found = []
        for term, held in by_term.items():
            left = np.array([places[a._row] for _, pairs in held for a, _ in pairs], dtype=np.int64)
            right = np.array([places[b._row] for _, pairs in held for _, b in pairs], dtype=np.int64)
            which = np.repeat(np.arange(len(held)), [len(pairs) for _, pairs in held]) if len(held) > 1 else None
            found.append(Couples(term, tuple(law for law, _ in held), LISTED, left, right, which))
        return found

    # Numbers

    def pack(self, found: dict[str, Array]) -> Array:
        """The numbers of the program's rows: ``found`` of the batch's, by name; masses, stored forces and columns as they are."""
        slots, bodies, program = self.program.loop.slots, self.world.bodies, self.program
        numbers = np.empty((slots.width, program.rows))
        moving = program.moving
        rows = self.rows[self.order]
        numbers[: slots.changing] = 0.0
        for name in ("position", "velocity", "position_rest", "velocity_rest", "work", "work_rest"):
            first, given = slots.first[name], found[name]
            numbers[first : first + len(given), :moving] = given[:, self.order]
        mass = bodies.arrays["mass"][0, rows]
        at = slots.first["stored"]
        numbers[at : at + 3, :moving] = bodies.arrays["force"][:, rows] / mass
        numbers[slots.first["inverse_mass"], :moving] = 1.0 / mass
        if "stored_working" in slots.first:
            at = slots.first["stored_working"]
            numbers[at : at + 3, :moving] = bodies.arrays["working"][:, rows]
        everyone = rows
        if len(self.sources):
            everyone = np.concatenate([rows, self.sources])
            numbers[slots.first["position"] : slots.first["position"] + 3, moving:] = bodies.arrays["position"][
                :, self.sources
            ]
            for name in ("stored", "inverse_mass", "stored_working", "middle_velocity"):
                if name in slots.first:
                    at = slots.first[name]
                    numbers[at : at + (1 if name == "inverse_mass" else 3), moving:] = 0.0
        for name in slots.columns:
            self._put_column(numbers, name, everyone)
        return numbers

    def _put_column(self, numbers: Array, name: str, rows: Rows) -> None:
        at, bodies = self.program.loop.slots.first[name], self.world.bodies
        if name in bodies.arrays:
            values = bodies.arrays[name][:, rows]
            numbers[at : at + len(values)] = values
        elif name in bodies.columns:
            numbers[at] = bodies.columns[name][rows]
        elif name == "volume":
            numbers[at] = self.world.evaluator.volumes(rows)
        else:
            numbers[at] = self._since(rows)

    def _since(self, rows: Rows) -> Array:
        """When [s] each row came under the laws that read it; a segment has one law that does, or one answer for all."""
        world = self.world
        found = np.zeros(len(rows))
        for segment in self.program.segments:
            asking = [law for law, term in zip(segment.laws, segment.terms, strict=True) if "since" in term.trace.reads]
            for place in range(segment.first, segment.last):
                obj = world.bodies.objects[int(rows[place])]
                times = {world.evaluator.since(law, obj) for law in asking}
                found[place] = min(times, default=0.0)
        return found

    def unpack(self, numbers: Array) -> dict[str, Array]:
        """What a run changed, in the order of the batch's rows."""
        slots, moving = self.program.loop.slots, self.program.moving
        found = {}
        for name in (
            "position",
            "velocity",
            "position_rest",
            "velocity_rest",
            "acceleration",
            "working",
            "work",
            "work_rest",
        ):
            first = slots.first[name]
            width = 1 if name in ("work", "work_rest") else 3
            values = np.empty((width, moving))
            values[:, self.order] = numbers[first : first + width, :moving]
            found[name] = values
        return found
