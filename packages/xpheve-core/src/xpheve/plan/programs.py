"""From a batch and its laws to the loop that runs it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xpheve.errors import LawFailedError
from xpheve.laws import ContinuousLaw, FieldLaw, PairLaw
from xpheve.loop.array_spin import moments
from xpheve.loop.program import ALL, LISTED, NEAR, Couples, Program, Segment
from xpheve.loop.terms import WIDTHS, Term, slot_of
from xpheve.loop.text import ALL_TURN, FREE, TURN
from xpheve.plan.hand_kernels import formula_of
from xpheve.plan.pairs import PairSet
from xpheve.steppers.contract import Array, Rows

Places = NDArray[np.int64]


def inverse_masses(world: Any, rows: Rows | slice) -> Array:
    """1 / m [1/kg] of ``rows``, (1, rows); raises `LawFailedError` where that is beyond all floats."""
    mass = world.bodies.arrays["mass"][:, rows]
    with np.errstate(over="ignore"):
        found: Array = 1.0 / mass
    for k in np.flatnonzero(~np.isfinite(found[0])).tolist()[:1]:
        label = world.bodies.objects[int(np.arange(world.bodies.count)[rows][k])].label
        raise LawFailedError(
            f"{label} has a mass of {mass[0, k]} kg, and 1 / mass is beyond the range of a float; use other units"
        )
    return found


def term_of(world: Any, law: ContinuousLaw) -> Term | None:
    """``law`` as a term of a loop; None if it cannot be one."""
    trace = formula_of(law)
    if trace is None or (isinstance(law, PairLaw) and "since" in trace.reads):  # a row has a time for each instance
        return None
    near = isinstance(law, PairLaw) and math.isfinite(law.reach())
    return Term(trace, law.defines("potential"), world.is_switched(law), near)


class BatchProgram:
    """The program of a batch, and how its rows lie in it.

    ``order`` are the places of the batch's rows in the order of the program: by law set, then rank. ``sources`` are rows of other batches, or of
    none, that act on it.
    """

    def __init__(
        self,
        world: Any,
        rows: Rows,
        laws: Sequence[ContinuousLaw],
        terms: dict[ContinuousLaw, Term],
        pairs: Sequence[tuple[PairLaw, PairSet]],
    ) -> None:
        self.world, self.rows = world, rows
        self.terms = terms
        objects = [world.bodies.objects[row] for row in rows.tolist()]
        fields = [law for law in laws if isinstance(law, FieldLaw)]
        sets = self._law_sets(objects, fields)
        # Without pairs nothing is summed over rows, and they stay as they lie.
        ranks = np.array([obj.rank for obj in objects]) if pairs else np.arange(len(objects))
        firsts = {one: k for k, one in enumerate(sorted(set(sets), key=lambda s: tuple(laws.index(law) for law in s)))}
        keys = np.array([firsts[one] for one in sets], dtype=np.int64)
        self.order: Places = np.lexsort((ranks, keys))
        segments = self._segments(keys[self.order], list(firsts))
        self.sources: Rows = np.zeros(0, dtype=np.int64)
        couples = self._couples(pairs)
        self._parts = segments, couples
        self._programs: dict[tuple[bool, str], Program] = {}
        self.program = self._program_of(FREE)

    def _program_of(self, turning: str) -> Program:
        """The program for rows that turn so, and have the stored forces that they have."""
        stored_work = bool(self.world.bodies.arrays["working"][:, self.rows].any())
        found = self._programs.get((stored_work, turning))
        if found is None:
            segments, couples = self._parts
            found = Program(segments, couples, len(self.rows), len(self.sources), stored_work, turning)
            self._programs[stored_work, turning] = found
        return found

    def forget_parameters(self) -> None:
        """A parameter has another value, or a law was switched."""
        for program in self._programs.values():
            program.forget_parameters()

    def _turning(self, stepped: Array) -> str:
        """How rows turn that turn as ``stepped`` says, in the order of the batch."""
        if not stepped.any():
            return FREE
        asked = np.zeros(len(self.rows), dtype=bool)
        for segment in self._parts[0]:
            asked[segment.first : segment.last] = any(term.of_turning for term in segment.terms)
        stored = self.world.bodies.arrays["torque"][:, self.rows].any()
        return ALL_TURN if stored or (stepped[0, self.order].astype(bool) & ~asked).any() else TURN

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

    def _couples(self, pairs: Sequence[tuple[PairLaw, PairSet]]) -> list[Couples]:
        """The pairs of each class; rows that act and are not the batch's own become its sources."""
        own = set(self.rows.tolist())
        used = {int(row) for _, one in pairs for row in one.used.tolist()} - own
        objects = self.world.bodies.objects
        self.sources = np.array(
            [obj._row for obj in self.world.in_rank_order(objects[row] for row in used)], dtype=np.int64
        )
        self.place = np.full(self.world.bodies.count, -1, dtype=np.int64)
        self.place[self.rows[self.order]] = np.arange(len(self.rows))
        self.place[self.sources] = len(self.rows) + np.arange(len(self.sources))
        listed: dict[Term, list[tuple[PairLaw, PairSet]]] = {}
        found = []
        for law, one in pairs:
            term = self.terms[law]
            if law.named is not None:
                listed.setdefault(term, []).append((law, one))
            elif one.count:
                rows = self.place[one.used]
                near = partial(self._near, one) if term.near else None
                found.append(Couples(term, (law,), NEAR if term.near else ALL, rows, rows[:0], None, near))
        return [*(self._listed(term, held) for term, held in listed.items()), *found]

    def _listed(self, term: Term, held: list[tuple[PairLaw, PairSet]]) -> Couples:
        parts = [one.every() for _, one in held]
        left, right = (self.place[np.concatenate([part[k] for part in parts])] for k in (0, 1))
        which = np.repeat(np.arange(len(held)), [len(part[0]) for part in parts]) if len(held) > 1 else None
        return Couples(term, tuple(law for law, _ in held), LISTED, left, right, which)

    def _near(self, pairs: PairSet, places: Array) -> Iterator[tuple[Places, Places]]:
        """Rows of the program that are near one another, by the places (3, rows) that they have."""
        position = np.full((3, len(self.place)), np.nan)
        mine = np.concatenate([self.rows[self.order], self.sources])
        position[:, mine] = places[:3]
        for a, b in pairs.chunks(position):
            yield self.place[a], self.place[b]

    # Numbers

    @cached_property
    def _take(self) -> slice | Places:
        """The batch's rows in the order of the program; all as they are, if that is theirs."""
        plain = bool((self.order == np.arange(len(self.order))).all())
        return slice(None) if plain else self.order

    @cached_property
    def _placed(self) -> slice | Rows:
        """The engine's rows in the order of the program; a slice if they lie side by side."""
        rows = self.rows[self.order]
        side_by_side = len(rows) > 0 and bool((np.diff(rows) == 1).all())
        return slice(int(rows[0]), int(rows[-1]) + 1) if side_by_side else rows

    @cached_property
    def _everyone(self) -> Rows:
        """The engine's rows in the order of the program, and those that only act."""
        return np.concatenate([self.rows[self.order], self.sources])

    def pack(self, found: dict[str, Array]) -> Array:
        """The numbers of the program's rows: ``found`` of the batch's, by name; masses, stored forces and columns as they are."""
        program = self.program = self._program_of(self._turning(found["stepped"]))
        slots, bodies = program.loop.slots, self.world.bodies
        numbers = np.empty((slots.width, program.rows))
        moving = program.moving
        rows = self._placed
        for name in ("acceleration", "working"):
            numbers[slots.first[name] : slots.first[name] + 3] = 0.0
        for name in ("position", "velocity", "position_rest", "velocity_rest", "work", "work_rest"):
            first, given = slots.first[name], found[name]
            numbers[first : first + len(given), :moving] = given[:, self._take]
            numbers[first : first + len(given), moving:] = 0.0
        if "spread" in slots.first:
            self._put_rotation(numbers, found, rows)
        inverse = inverse_masses(self.world, rows)
        mass = bodies.arrays["mass"][0, rows]
        at = slots.first["stored"]
        numbers[at : at + 3, :moving] = bodies.arrays["force"][:, rows] / mass
        numbers[slots.first["inverse_mass"], :moving] = inverse[0]
        if "stored_working" in slots.first:
            at = slots.first["stored_working"]
            numbers[at : at + 3, :moving] = bodies.arrays["working"][:, rows]
        everyone: Rows | slice = rows
        if len(self.sources):
            everyone = self._everyone
            numbers[slots.first["position"] : slots.first["position"] + 3, moving:] = bodies.arrays["position"][
                :, self.sources
            ]
            for name in ("stored", "inverse_mass", "stored_working", "middle_velocity", "middle_spin"):
                if name in slots.first:
                    at = slots.first[name]
                    numbers[at : at + (1 if name == "inverse_mass" else 3), moving:] = 0.0
        for name in slots.columns:
            self._put_column(numbers, name, everyone)
        return numbers

    def _put_rotation(self, numbers: Array, found: dict[str, Array], rows: Rows | slice) -> None:
        """Rotation, stored torques and moments; of rows that only act, none."""
        slots, bodies, moving = self.program.loop.slots, self.world.bodies, self.program.moving
        excess, spread, inverse = moments(bodies.arrays["inertia"][:, rows])
        values = {
            "orientation": found["orientation"][:, self._take],
            "angular_velocity": found["angular_velocity"][:, self._take],
            "torque": np.zeros((3, moving)),
            "stored_torque": bodies.arrays["torque"][:, rows],
            "excess": excess,
            "spread": spread,
            "inverse_moment": inverse[None],
        }
        for name, value in values.items():
            at = slots.first[name]
            numbers[at : at + len(value)] = 0.0
            numbers[at : at + len(value), :moving] = value

    def _put_column(self, numbers: Array, name: str, rows: Rows | slice) -> None:
        at = self.program.loop.slots.first[slot_of(name)]
        values = self.column(name, rows, self.program.loop.ages)
        numbers[at : at + len(values)] = values

    def column(self, name: str, rows: Rows | slice, ages: int) -> Array:
        """What laws call ``name`` of ``rows``, which are all rows of the program, (width, rows); of "since", ``ages`` times."""
        bodies = self.world.bodies
        found: Array
        if name == "mass" or name in WIDTHS:
            found = bodies.arrays[name][:, rows]
        elif name in bodies.columns:
            found = bodies.columns[name][rows][None]
        elif name == "volume":
            found = self.world.evaluator.volumes(self._everyone)[None]
        else:
            found = self._since(self._everyone, ages)
        return found

    def _since(self, rows: Rows, ages: int) -> Array:
        """When [s] each row came under the laws of its segment that read it, one after another; shape (ages, rows)."""
        objects, since = self.world.bodies.objects, self.world.evaluator.since
        found = np.zeros((ages, len(rows)))
        for segment in self.program.segments:
            own = [objects[row] for row in rows[segment.first : segment.last].tolist()]
            asking = [law for law, term in zip(segment.laws, segment.terms, strict=True) if "since" in term.trace.reads]
            for k, law in enumerate(asking):
                found[k, segment.first : segment.last] = [since(law, obj) for obj in own]
        return found

    def unpack(self, numbers: Array) -> dict[str, Array]:
        """What a run changed, in the order of the batch's rows."""
        slots, moving = self.program.loop.slots, self.program.moving
        found = {}
        for name, width in slots.run.items():
            first = slots.first[name]
            values = numbers[first : first + width, :moving]
            if isinstance(self._take, slice):
                found[name] = values
                continue
            found[name] = np.empty((width, moving))
            found[name][:, self.order] = values
        return found
