"""The scene at work: bodies, laws, forces, batches, queue; how it is planned, and how one instant passes."""

from __future__ import annotations

import contextlib
import math
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from xpheve.bodies import STATE_WIDTHS, WIDTHS, Bodies
from xpheve.errors import InvalidValueError, LawFailedError, StateError, TraceError, XpheveError, XpheveWarning
from xpheve.events import AFTER, FORCE, Entry, EventQueue, Guard, Rank
from xpheve.forces import Force, ForceIds
from xpheve.kernels.clock import NEVER, Instant
from xpheve.kernels.clock import START as ZERO
from xpheve.laws import ContinuousLaw, Event, FieldLaw, FlowLaw, LawContainer, PairLaw, PhysicalLaw, ResponseLaw
from xpheve.laws import conditions as when
from xpheve.objects import PhysicalObject
from xpheve.plan import books, contacts_wanted, flights_to_impacts, loops
from xpheve.plan.driven import Arrival, dependents, immovable
from xpheve.plan.evaluation import UP, BatchSources, Evaluator, is_constant
from xpheve.plan.flows import prove_flow
from xpheve.plan.forms import form_changed
from xpheve.plan.groups import (
    Batch,
    Choice,
    Facts,
    choose,
    downstream,
    find_group,
    targets_of,
    torque_of,
)
from xpheve.plan.hand_kernels import formula_of, is_by_hand
from xpheve.plan.looks import Looks
from xpheve.plan.mapping import Mapping
from xpheve.plan.order import positions, report_clashes
from xpheve.plan.proof import prove
from xpheve.plan.ranks import Ranks
from xpheve.plan.stored import StoredForce, StoredForces
from xpheve.plan.transaction import MANY, Transaction
from xpheve.plan.wakeups import steps
from xpheve.plan.wakeups.changes import tell_changed
from xpheve.plan.wakeups.delivery import signal
from xpheve.plan.wakeups.motion import motion_of
from xpheve.plan.wakeups.wakeups import Wakeups
from xpheve.steppers.contract import Array, ContactServer, Flight, Grid, Settings, Signature, Stepper
from xpheve.trace.law_trace import LawTrace

WISHES = ("auto", "always", "never")
"""Which loops are compiled."""
BUSY_INSTANT = 100_000  # stages of one instant; a scene that needs more repeats itself without end


class World:
    """Everything an engine holds between two calls."""

    def __init__(
        self,
        up: str,
        seed: int,
        steppers: Callable[[bool], Iterable[Stepper]],
        periodic: tuple[float, float, float] | None = None,
    ) -> None:
        self.up = up
        self.periodic = periodic
        """Edges [m] of the box whose opposite faces are one, infinite along an axis without period; None where there is none."""
        self.seed = seed
        self.time: Instant = ZERO
        self.bodies = Bodies()
        self.mapping = Mapping()
        self.forces = StoredForces()
        self.force_ids = ForceIds()
        self.ranks = Ranks()
        self.laws: dict[PhysicalLaw, int] = {}
        """Laws with their serial numbers."""
        self.containers: list[LawContainer] = []
        self.batches: list[Batch] = []
        self.choices: dict[Signature, Choice] = {}
        self.groups: dict[PhysicalObject, list[PhysicalObject]] = {}
        self.proven: WeakKeyDictionary[ContinuousLaw, LawTrace] = WeakKeyDictionary()
        """Laws that were tried by numbers, with the trace that they had."""
        self.constant: dict[ContinuousLaw, set[str]] = {}
        """Laws whose force is stored, with what they read."""
        self.varying: WeakKeyDictionary[ContinuousLaw, None] = WeakKeyDictionary()
        """Laws that were found to read state or time when they were evaluated."""
        self.contacts: ContactServer | None = None
        self.queue = EventQueue(self._is_live)
        self.evaluator = Evaluator(self.bodies, up, self.mapping)
        self.settings = Settings()
        self.grid: tuple[Instant, float, int] | None = None
        self.host_step_after: Callable[[Instant], Instant] = _never
        """The first host step after an instant, of the present run."""
        self.spent: set[LawContainer] = set()
        """Containers that fire no more."""
        self.streams: dict[PhysicalLaw, Any] = {}
        self.work: dict[str, float] = {}
        """Work [J] done by what has no potential, by label."""
        self.arrivals: dict[PhysicalObject, Arrival] = {}
        """Objects that the host carries, and where they will stand."""
        self.transaction: Transaction | None = None
        self.acting: PhysicalLaw | None = None
        self.ahead = 0.0
        """Time [s] by which handlers of host steps read ahead."""
        self.renewed: set[tuple[PhysicalLaw, PhysicalObject]] = set()
        """What laws stored in the present host step."""
        self.events = 0
        self.posts = 0
        self.unplanned: dict[PhysicalObject, None] = {}
        self.dirty = True
        self.structure = 0
        """Goes up when laws, containers or mapping change."""
        self._contacts_seen = -1
        """The structure when it was last asked whose contacts are looked for."""
        self._waiting: set[PhysicalLaw] = set()
        """The laws that waited for contacts then."""
        self.on_law_error = "raise"
        self.failed: dict[PhysicalLaw, str] = {}
        """Laws that were disabled because they failed, with what they did."""
        self.clashes: dict[tuple[PhysicalLaw, PhysicalLaw, str], str] = {}
        """Laws that set the same at one event with no order between them, and what was said of it."""
        self.compile = "auto"
        self.looked_at: set[tuple[Signature, float]] = set()
        """Of whom it is known whether host steps of that length [s] resolve the forces."""
        self.wish = ""
        """The id of the stepper that the user asked for, where it offers."""
        self.facts: dict[Any, Facts] = {}
        """What sets of laws have in common, by their traces."""
        self.affine: dict[tuple[ContinuousLaw, bool], Any] = {}
        """Laws as affine ones, for a plan: forgotten when the next is made."""
        self.tiers: dict[Signature, str] = {}
        """How the loops of each signature run, chosen from the scene when they first do."""
        self.switches: dict[PhysicalLaw, int] = {}
        """How often each law was switched off or on."""
        self._whole: tuple[int, Batch | None] = (-1, None)
        self._steppers = steppers
        self._next_serial = 0
        self.law_positions: dict[str, int] = {}
        self.wakeups = Wakeups(self)

    # Reading

    def read_row(self, row: int, name: str, t: Instant | None = None) -> tuple[float, ...]:
        """Column ``name`` of ``row`` at ``t``, by default now."""
        number = int(self.bodies.batch[row])
        if number < 0 or name not in STATE_WIDTHS:
            return self.bodies.get(name, row)
        batch = self.batches[number]
        return batch.stepper.read_row(
            batch.state, self.bodies, self.time if t is None else t, name, int(self.bodies.local[row])
        )

    def read_times(self, row: int, name: str, times: Sequence[Instant]) -> Array:
        """Column ``name`` of ``row`` at many ``times``, shape (width, times)."""
        number = int(self.bodies.batch[row])
        if number < 0 or name not in STATE_WIDTHS:
            return np.array([self.bodies.get(name, row)] * len(times)).T
        batch = self.batches[number]
        return batch.stepper.read_times(batch.state, self.bodies, times, name, int(self.bodies.local[row]))

    def read_all(self, name: str, t: Instant, out: Array | None = None) -> Array:
        """Column ``name`` of all rows at ``t``, shape (width, count), into ``out`` if it fits."""
        bodies = self.bodies
        n = bodies.count
        if out is None or out.shape != (WIDTHS[name], n):
            out = np.empty((WIDTHS[name], n))
        whole = self._whole_batch(n)
        if whole is not None:
            whole.stepper.read(whole.state, bodies, t, name, out)
            return out
        live = [batch for batch in self.batches if batch.state.count]
        if sum(batch.state.count for batch in live) < n:
            out[...] = bodies.arrays[name][:, :n]
        for batch in live:
            where = batch.state.where
            if isinstance(where, slice):
                batch.stepper.read(batch.state, bodies, t, name, out[:, where])
            else:
                part = np.empty((WIDTHS[name], len(where)))
                batch.stepper.read(batch.state, bodies, t, name, part)
                out[:, where] = part
        return out

    def show_row(self, row: int, name: str, t: Instant | None = None) -> tuple[float, ...]:
        """`read_row` as users see it: in a periodic scene the image in the box, whichever the row holds."""
        found = self.read_row(row, name, t)
        if self.periodic is None or name != "position":
            return found
        from xpheve.periodic import wrapped

        return wrapped(found, self.periodic)

    def show_all(self, name: str, out: Array | None = None) -> Array:
        """`read_all` now, as users see it: in a periodic scene the images in the box."""
        found = self.read_all(name, self.time, out)
        if self.periodic is not None and name == "position":
            from xpheve.periodic import wrap_rows

            wrap_rows(found, self.periodic)
        return found

    def _whole_batch(self, n: int) -> Batch | None:
        """The batch that holds all rows in their order, if one does."""
        change, found = self._whole
        if change != self.bodies.change:
            full = (
                [
                    b
                    for b in self.batches
                    if b.state.count == n and isinstance(b.state.where, slice) and b.state.where.start == 0
                ]
                if n
                else []
            )
            found = full[0] if full else None
            self._whole = (self.bodies.change, found)
        return found

    def flight(self, row: int) -> Flight:
        """How ``row`` moves until further notice."""
        number = int(self.bodies.batch[row])
        if number < 0:
            still = (0.0, 0.0, 0.0)
            x: Any = self.bodies.get("position", row)
            return Flight(self.bodies.clock_of(row), NEVER, x, still, still, 0.0)
        batch = self.batches[number]
        return batch.stepper.flight(batch.state, self.bodies, int(self.bodies.local[row]))

    def pace(self, row: int) -> float:
        """For how long [s] the flight of ``row``, which is curved, stays near its parabola: its time scale, to a factor of four."""
        curve = motion_of(self, self.bodies.objects[row]).curve
        assert curve is not None
        return curve.pace()

    def in_rank_order(self, objects: Iterable[PhysicalObject]) -> list[PhysicalObject]:
        """``objects`` by rank; those not ranked yet come last, as added."""
        return sorted(objects, key=lambda obj: (obj.rank < 0, obj.rank, obj.serial))

    def ordered_laws(self, laws: Iterable[PhysicalLaw]) -> list[PhysicalLaw]:
        """``laws`` by rank."""
        ranks = self.ranks.law_ranks
        return sorted(laws, key=lambda law: (ranks.get(law, math.inf), self.laws[law]))

    def continuous_laws(self, obj: PhysicalObject) -> list[ContinuousLaw]:
        """The enabled laws of ``obj`` that are evaluated along the way; a driven object asks for none."""
        if obj._driven:
            return []
        return [
            law
            for law in self.mapping.laws(obj)
            if isinstance(law, ContinuousLaw)
            and (law.enabled or self.is_switched(law))
            and not law.containers
            and law not in self.constant
            and not (isinstance(law, PairLaw) and law.one_sided and not law.moves(obj))
        ]

    def is_moved_along(self, obj: PhysicalObject) -> bool:
        """Whether laws are evaluated along the way of ``obj``, as far as that is known before it is planned."""
        return any(not self._is_stored(law) for law in self.continuous_laws(obj))

    def _is_stored(self, law: ContinuousLaw) -> bool:
        """Whether the force of ``law``, which is not stored yet, will be: of what is no formula only its first evaluation shows."""
        if not isinstance(law, FieldLaw) or law in self.varying:
            return False
        trace = None if is_by_hand(law) else formula_of(law)
        return trace is None or is_constant(set(trace.reads))

    def is_switched(self, law: PhysicalLaw) -> bool:
        """Whether ``law`` was switched off and on again: it stays in its loops from then on, put out by a number."""
        if self.switches.get(law, 0) < 2 or not isinstance(law, ContinuousLaw):
            return False
        trace = formula_of(law)
        return trace is not None and not is_constant(set(trace.reads))

    def reads_of(self, law: ContinuousLaw) -> frozenset[str]:
        """What a traced law reads; nothing is known of others."""
        trace = formula_of(law)
        return frozenset() if trace is None else trace.reads

    def group_of(self, obj: PhysicalObject) -> list[PhysicalObject]:
        """The group of ``obj``."""
        return self.groups.get(obj, [obj])

    # Writing

    @contextlib.contextmanager
    def instant(self) -> Iterator[Transaction]:
        """The open transaction, or a new one that is committed at the end, or taken back if something raises."""
        if self.transaction is not None:
            yield self.transaction
            return
        transaction = self.transaction = Transaction(self)
        try:
            yield transaction
            if transaction.clashes:
                report_clashes(self, transaction.clashes)
            new = self._commit(transaction)
        except BaseException:
            transaction.roll_back()
            raise
        finally:
            self.transaction = None
        new.update(obj for obj in transaction.refresh if obj._engine is not None)
        if new:
            if self.contacts is not None:
                self.contacts.refresh([obj._row for obj in self.in_rank_order(new)])
            self.wakeups.refresh(new)
        for act in transaction.later:
            act()

    def _commit(self, transaction: Transaction) -> set[PhysicalObject]:
        """Make the writes lasting; returns the objects whose flight is new."""
        changed = transaction.changed()
        kept = set(changed)
        for obj in transaction.touched:
            if obj not in kept:
                transaction.put_back(obj)
        for obj in changed:
            touched = transaction.touched[obj]
            if not touched.driven:
                books.account(self, obj, touched.held, touched.clock, touched.flown)
        self.sum_all(transaction.forced)
        rows = self._restart(changed, transaction)
        for obj, name in transaction.written:
            flown = transaction.touched[obj].flown if obj in transaction.touched else {}
            if name not in flown or (obj in kept and flown[name] != self.bodies.get(name, obj._row)):
                tell_changed(self, obj, name, flown.get(name))
        return {self.bodies.objects[row] for row in rows}

    def _restart(self, changed: list[PhysicalObject], transaction: Transaction) -> set[int]:
        """Tell the steppers; returns all rows whose flight is new."""
        bodies = self.bodies
        by_batch: dict[int, list[int]] = {}
        moved: dict[int, dict[int, None]] = {}
        for obj in changed:
            number = int(bodies.batch[obj._row])
            if obj in self.unplanned or obj in transaction.switched:
                continue
            if immovable(obj):
                for other in dependents(self, obj):
                    moved.setdefault(int(bodies.batch[other._row]), {})[other._row] = None
            if number >= 0 and (torque_of(self, obj) != self._torque_served(obj, number) or form_changed(self, obj)):
                transaction.replan[obj] = None
            bent = (
                number >= 0
                and self.batches[number].signature.form == "linear"
                and (obj, "inertia") in transaction.written
            )
            if bent or (number >= 0 and self._parts(obj, number)):
                transaction.replan[obj] = None
                continue
            by_batch.setdefault(number, []).append(obj._row)
        for obj in transaction.replan:
            self.mark(obj)
        found: set[int] = set()
        while by_batch or moved:
            number = min({*by_batch, *moved}, key=self._order_of_batch)  # sources before what they act on
            rows, pulled = by_batch.pop(number, []), moved.pop(number, {})
            if number >= 0:
                batch = self.batches[number]
                asked = list(dict.fromkeys([*rows, *pulled]))
                if pulled and self._cannot_follow(batch, asked):
                    for row in asked:
                        self.mark(bodies.objects[row])
                    continue
                before = books.snapshot(self, batch)
                sources = self.sources(batch)
                if sources is not None:
                    sources.forget_rows()
                new = batch.stepper.changed(batch.state, bodies, asked, self.time, sources)
                books.after_step(self, batch, before, rows)
                rows = list(new)
                if self.is_source(batch):
                    for row in rows:
                        for other in targets_of(self, bodies.objects[row]):
                            moved.setdefault(int(bodies.batch[other._row]), {})[other._row] = None
                    moved.pop(-1, None)  # they are about to be planned
            bodies.version[rows] += 1
            found.update(rows)
        bodies.change += 1
        return found

    def _order_of_batch(self, number: int) -> tuple[int, int]:
        return (self.batches[number].signature.level if number >= 0 else -1, number)

    def _cannot_follow(self, batch: Batch, rows: Sequence[int]) -> bool:
        """Whether ``rows``, on which something acts otherwise in the midst of a step, must be planned anew: what acts is not known to its end."""
        covered = batch.stepper.covered(batch.state)
        if covered <= self.time:
            return False
        acting = [] if batch.stepper.asks else self.acting_on(batch)  # who asks makes the step as long as it is known
        short = any(one.stepper.covered(one.state) < covered for one in acting)
        return short or (batch.stepper.parts and batch.state.count > len(rows))

    def _parts(self, obj: PhysicalObject, number: int) -> bool:
        """Whether ``obj``, changed in the midst of a step, leaves its batch with its group, because others are in it whose step goes on."""
        batch = self.batches[number]
        if not batch.stepper.parts or batch.stepper.covered(batch.state) <= self.time:
            return False
        return batch.state.count > len(self.group_of(obj))

    def _torque_served(self, obj: PhysicalObject, number: int) -> str:
        served = self.batches[number].signature
        own = torque_of(self, obj)
        order = ("none", "principal", "general")
        return own if order.index(own) <= order.index(served.torque) else served.torque

    def sum_forces(self, obj: PhysicalObject) -> None:
        """Write the sums of the stored forces of ``obj``."""
        force, torque = self.forces.total(obj)
        self.bodies.put("force", obj._row, force)
        self.bodies.put("torque", obj._row, torque)
        self.bodies.put("working", obj._row, self.forces.working(obj)[0])

    def sum_all(self, objects: Iterable[PhysicalObject]) -> None:
        """`sum_forces` of each of ``objects``."""
        found = list(objects)
        if not found:
            return
        rows = np.array([obj._row for obj in found], dtype=np.int64)
        totals = [self.forces.total(obj) for obj in found]
        sums = {
            "force": [force for force, _ in totals],
            "torque": [torque for _, torque in totals],
            "working": [self.forces.working(obj)[0] for obj in found],
        }
        for name, values in sums.items():
            self.bodies.arrays[name][:, rows] = np.array(values).T
        self.bodies.change += 1

    # Work of what has no potential

    def add_work(self, label: str, joules: float) -> None:
        """Book work done by what has no potential."""
        self.work[label] = self.work.get(label, 0.0) + joules

    # Batches

    def sources(self, batch: Batch) -> BatchSources | None:
        """What acts along the way on ``batch``; found when first asked for."""
        if not batch.signature.evaluated:
            return None
        if batch.sources is None:
            objects = [self.bodies.objects[row] for row in batch.state.rows.tolist()]
            laws = self.ordered_laws(self._felt(objects))
            batch.laws = [law for law in laws if isinstance(law, ContinuousLaw) and self._belongs(law, batch.signature)]
            acting = [law for law in batch.laws if law.enabled or self.is_switched(law)]
            batch.sources = BatchSources(self, acting, objects, batch.signature)
            batch.lent = batch.sources.lent
        return batch.sources

    def _felt(self, objects: Sequence[PhysicalObject]) -> dict[PhysicalLaw, None]:
        """The laws of ``objects``, but for one-sided ones of which they are sources only."""
        found: dict[PhysicalLaw, None] = {}
        for obj in objects:
            for law in self.mapping.laws(obj):
                if law not in found and not (isinstance(law, PairLaw) and law.one_sided and not law.moves(obj)):
                    found[law] = None
        return found

    def _belongs(self, law: ContinuousLaw, signature: Signature) -> bool:
        """Whether ``law`` is evaluated along the way in batches of ``signature``, or would be if it were not off."""
        if law.containers or law in self.constant or law.label() not in signature.laws:
            return False
        trace = None if law.enabled else formula_of(law)
        return law.enabled or (trace is not None and not is_constant(set(trace.reads)))

    def advance(self, batch: Batch, need: Instant, wall: Instant) -> None:
        """One more step of ``batch``, which is known for the shortest time: so all is known until where it begins."""
        begin = batch.stepper.covered(batch.state)
        self._merge_into(batch, begin)
        sources = self.sources(batch)
        before = books.snapshot(self, batch, sources)
        done = batch.state.numbers.get("steps", 0.0)
        steps = 1
        if sources is not None:
            steps = loops.steps_at_once(self, batch, sources, begin, need)
            wall = sources.wall(begin, wall)
            if batch.signature.level:
                wall = min([wall, *(one.stepper.covered(one.state) for one in loops.not_ahead(self, batch, sources))])
                steps, wall = loops.follow_sources(self, batch, sources, begin, wall, steps)
        if steps > 1:
            assert self.grid is not None
            grid = Grid(self.grid[0], self.grid[1], loops.number_at(self, begin))
            stop = batch.stepper.stride(batch.state, self.bodies, grid, steps, self.settings, sources)
        else:
            go = batch.stepper.advance if sources is None or loops.is_heard(self, batch) else batch.stepper.leap
            stop = go(batch.state, self.bodies, min(need, wall), wall, self.settings, sources)
        books.after_step(self, batch, before)
        self.time = max(self.time, begin)
        if len(stop.rows):
            everyone = len(stop.rows) == batch.state.count
            # By the steps, however many were made in one call: that depends on who looks.
            made = max(1, int(batch.state.numbers.get("steps", 0.0) - done))
            self.bodies.version[batch.state.where if everyone else list(stop.rows)] += made
            self.bodies.change += 1
            if self.contacts is not None:
                self.contacts.refresh(sorted(stop.rows, key=lambda row: self.bodies.objects[row].rank))
            self.wakeups.refresh(self.bodies.objects[row] for row in map(int, stop.rows))

    def acting_on(self, batch: Batch) -> list[Batch]:
        """The batches whose objects act on ``batch`` by one-sided laws."""
        sources = self.sources(batch) if batch.signature.level else None
        if sources is None:
            return []
        numbers = np.unique(self.bodies.batch[sources.suns]).tolist()
        return [self.batches[number] for number in numbers if number >= 0 and number != batch.number]

    def is_source(self, batch: Batch) -> bool:
        """Whether objects of ``batch`` act on another batch by one-sided laws."""
        level = batch.signature.level
        return any(
            batch in self.acting_on(other)
            for other in self.batches
            if other.signature.level > level and other.state.count
        )

    def tier_of(self, sources: BatchSources) -> str:
        """How the loop of ``sources`` runs: chosen from the scene alone when it first does, and kept."""
        signature = sources.signature
        if signature not in self.tiers:
            from xpheve.plan.tiers import choose_tier

            self.tiers[signature] = choose_tier(self.compile, sources.load)
        return self.tiers[signature]

    def wish_compiled(self, wish: str) -> None:
        """Compile by ``wish``: "auto", "always" or "never"; how each loop runs is chosen again when it runs next. Raises `InvalidValueError`."""
        if not isinstance(wish, str) or wish not in WISHES:
            raise InvalidValueError(f"compile = {wish!r}: choose 'auto', 'always' or 'never'")
        if wish != self.compile:
            self.compile = wish
            self.tiers.clear()

    def wish_stepper(self, wish: str) -> None:
        """Choose stepper ``wish`` wherever it offers; empty for none. Raises `InvalidValueError` for an unknown id."""
        known = sorted(stepper.id for stepper in self._steppers(True)) if wish else []
        if not isinstance(wish, str) or (wish and wish not in known):
            raise InvalidValueError(f"stepper = {wish!r}: choose '' for none, or one of {', '.join(known)}")
        if wish != self.wish:
            self.wish = wish
            self._choose_again()

    def set_out(self, settings: Settings) -> None:
        """Keep ``settings`` from now on; who serves laws along the way is chosen again if steps give way to tolerances, or the other way round."""
        other = (settings.dt is None) != (self.settings.dt is None)
        self.settings = settings
        if other:
            self._choose_again()

    def _choose_again(self) -> None:
        """Plan anew all that is evaluated along the way."""
        for batch in self.batches:
            if batch.signature.evaluated:
                for row in batch.state.rows.tolist():
                    self.mark(self.bodies.objects[row])

    def _merge_into(self, batch: Batch, begin: Instant) -> None:
        """Join to ``batch`` those of its kind that came later and are in step with it by now."""
        for other in self.batches[batch.number + 1 :]:
            if (
                other.state.count
                and other.signature == batch.signature
                and other.choice is batch.choice
                and other.stepper.covered(other.state) == begin
                and not (self._jumps_after(begin, batch) or self._jumps_after(begin, other))
                and batch.stepper.merge(batch.state, other.state, self.bodies, self.settings)
            ):
                self.bodies.batch[other.state.rows] = batch.number
                self.bodies.change += 1
                batch.sources = other.sources = None
                other.state = other.stepper.start(other.state.rows[:0], self.bodies, begin, None)

    def _jumps_after(self, t: Instant, batch: Batch) -> bool:
        """Whether a force on ``batch`` will jump, which ends the steps of all its rows."""
        sources = self.sources(batch)
        return sources is not None and sources.wall(t, NEVER) != NEVER

    def mark(self, obj: PhysicalObject) -> None:
        """``obj`` is to be planned anew."""
        self.unplanned[obj] = None
        self.dirty = True

    def leave_batch(self, obj: PhysicalObject) -> None:
        """Take ``obj`` out of its batch, its row re-based to now."""
        bodies, row = self.bodies, obj._row
        number = int(bodies.batch[row])
        if number < 0:
            return
        batch = self.batches[number]
        local = int(bodies.local[row])
        if batch.stepper.books_work:
            books.take_work(self, batch, [local])
        last = int(batch.state.rows[-1])
        batch.stepper.leave(batch.state, local)
        batch.state.locate()
        bodies.local[last] = local
        bodies.batch[row] = -1
        bodies.change += 1
        batch.sources = None

    def join_batch(self, objects: Sequence[PhysicalObject], signature: Signature) -> None:
        """Put ``objects``, re-based to now, into the batch of ``signature``."""
        choice = self.choices.get(signature)
        if choice is None:
            choice = self.choices[signature] = choose(signature, self._steppers(signature.evaluated))
        rows = np.array(sorted(obj._row for obj in objects), dtype=np.int64)
        for batch in self.batches:
            # A batch in the midst of a step of its own is left alone.
            free = batch.stepper.impacts or batch.stepper.covered(batch.state) in (NEVER, self.time)
            if batch.signature == signature and batch.stepper is choice.stepper and (free or not batch.state.count):
                if not batch.state.count:
                    batch.state = choice.stepper.start(rows, self.bodies, self.time, None)
                else:
                    batch.stepper.join(batch.state, rows, self.bodies, self.time)
                break
        else:
            state = choice.stepper.start(rows, self.bodies, self.time, None)
            batch = Batch(len(self.batches), signature, choice, state)
            self.batches.append(batch)
        batch.state.locate()
        batch.sources = None
        self.bodies.batch[rows] = batch.number
        self.bodies.version[rows] += 1
        self.bodies.change += 1

    # Planning

    def plan(self) -> None:
        """Give what is new or changed its rank, stored forces, group, stepper and servers."""
        if self.contacts is not None:
            self.contacts.plan()
            if self.structure != self._contacts_seen:
                self._contacts_seen = self.structure
                contacts_wanted.mark_changed(self)
                self._listen()
        if self.dirty:
            self._plan_motion()
            if self.contacts is not None:
                self.contacts.plan()  # now it is known which forces are constant
                if self.dirty:
                    self._plan_motion(again=True)
        self.wakeups.plan()

    def note_listeners(self) -> None:
        """The laws that wait for contacts now have done so before: nothing is to be predicted for their sake."""
        self._waiting = {law for law in self.laws if contacts_wanted.waits_for_contacts(law)}

    def _listen(self) -> None:
        """Have contacts predicted of objects on whose laws containers have begun to wait for them, and that are not about to be planned anyway."""
        assert self.contacts is not None
        before = self._waiting
        self.note_listeners()
        new = self._waiting - before
        found = {obj for law in new for obj in self.mapping.objects(law) if obj.rank >= 0 and obj not in self.unplanned}
        if found:
            self.contacts.refresh([obj._row for obj in self.in_rank_order(found)])

    def _plan_motion(self, again: bool = False) -> None:
        """Plan who is marked; ``again``: only who moves them is another one, so that their constant forces are stored already."""
        self._prove_laws()
        self.ranks.freeze_laws(self.laws, self.laws)
        self.ranks.freeze_containers(self.containers)
        self.law_positions = positions(self.laws)
        new = [obj for obj in self.unplanned if obj.rank < 0]
        self.ranks.freeze_objects(new, self.bodies, self.mapping)
        marked = self.in_rank_order(self.unplanned)
        rebased = self._rebase(marked)
        if not again:
            self._store_constant_forces(rebased)
        affected = self._regroup(rebased)
        self.ranks.epoch += 1
        self.unplanned.clear()
        self.dirty = False
        if self.contacts is not None and affected:
            self.contacts.refresh([obj._row for obj in affected])
        self.wakeups.refresh(affected)

    def _prove_laws(self) -> None:
        """Refuse what is wrong with a law that now acts for the first time, before anything changes."""
        for law in list(self.laws):
            if not (isinstance(law, ContinuousLaw) and law.enabled and self.mapping.objects(law)):
                continue
            if isinstance(law, FlowLaw):
                self._prove_flow(law)
                continue
            trace = formula_of(law)
            if trace is None or self.proven.get(law) is trace:
                continue
            try:
                prove(law, trace)
                self.evaluator.require_columns(law, trace.columns)
            except (TraceError, LawFailedError) as error:
                self.give_up(error, law)
            else:
                self.proven[law] = trace

    def _prove_flow(self, law: FlowLaw) -> None:
        """Try ``law`` if it was never called."""
        if law in self.evaluator.seen:
            return
        try:
            prove_flow(self, law)
        except LawFailedError as error:
            self.give_up(error, law)

    def _rebase(self, objects: list[PhysicalObject]) -> list[PhysicalObject]:
        """Bring the rows of ``objects`` and their old groups to now, out of their batches."""
        old = {other: None for obj in objects for other in [obj, *self.groups.get(obj, [])] if other._row >= 0}
        old.update(dict.fromkeys(downstream(self, old)))
        found = self.in_rank_order(old)
        states = self._states_of(found)
        for obj in found:
            self._rebase_row(obj, states.get(obj))
        return found

    def _states_of(self, objects: Sequence[PhysicalObject]) -> dict[PhysicalObject, tuple[tuple[float, ...], ...]]:
        """The states of ``objects`` now, in the order of `STATE_WIDTHS`, where they are many enough to be read as arrays."""
        if len(objects) < MANY:
            return {}
        rows = [obj._row for obj in objects]
        columns = [map(tuple, self.read_all(name, self.time)[:, rows].T.tolist()) for name in STATE_WIDTHS]
        return dict(zip(objects, zip(*columns, strict=True), strict=True))

    def _rebase_row(self, obj: PhysicalObject, state: tuple[tuple[float, ...], ...] | None = None) -> None:
        """Bring the row of ``obj`` to now, out of its batch; ``state`` is what it is now, if that is known."""
        bodies, row = self.bodies, obj._row
        number = int(bodies.batch[row])
        if number < 0:
            bodies.re_base(row, self.time)
            return
        clock = bodies.clock_of(row)
        if clock != self.time or bodies.turn_clock_of(row) != self.time:
            held = {name: bodies.get(name, row) for name in STATE_WIDTHS}
            if state is None:
                state = tuple(self.read_row(row, name) for name in STATE_WIDTHS)
            flown = dict(zip(STATE_WIDTHS, state, strict=True))
            if not obj._driven:
                books.account(self, obj, held, clock, flown)
            for name in STATE_WIDTHS:
                bodies.put(name, row, flown[name])
            bodies.re_base(row, self.time)
        self.leave_batch(obj)

    def _store_constant_forces(self, objects: list[PhysicalObject]) -> None:
        """Evaluate the laws that read neither state nor time, once, and store their forces."""
        members: dict[FieldLaw, list[PhysicalObject]] = {}
        for obj in objects:
            for law in self.mapping.laws(obj):
                if isinstance(law, FieldLaw) and law.enabled and not law.containers:
                    members.setdefault(law, []).append(obj)
        for law in self.ordered_laws(members):
            assert isinstance(law, FieldLaw)
            self.store_if_constant(law, members[law])
        self.sum_all(obj for obj in objects if self.forces.on(obj))

    def store_if_constant(self, law: FieldLaw, objects: list[PhysicalObject]) -> bool:
        """Evaluate ``law`` for ``objects`` and store its force if it is constant; whether it is."""
        trace = None if is_by_hand(law) else formula_of(law)  # a kernel shows by a call whether it gives forces
        reads: set[str] = set() if trace is None else set(trace.reads)
        rows = np.array([obj._row for obj in objects], dtype=np.int64)
        if is_constant(reads):
            force, torque = self.evaluator.field(
                law, rows, self.time[0], lambda name: self.read_rows(rows, name), reads
            )
        if not is_constant(reads):
            self.constant.pop(law, None)
            self.varying[law] = None
            return False
        law.evaluations += 1
        self.constant[law] = reads
        self._store(law, objects, force, torque)
        return True

    def read_rows(self, rows: Any, name: str) -> Array:
        """Column ``name`` of ``rows`` now, shape (width, rows)."""
        if len(rows) >= MANY:
            return self.read_all(name, self.time)[:, rows]
        return np.array([self.read_row(int(row), name) for row in rows]).T.reshape(WIDTHS[name], len(rows))

    def _store(self, law: FieldLaw, objects: list[PhysicalObject], force: Array | None, torque: Array | None) -> None:
        """Put the force of ``law`` on each of ``objects`` in place of its last one."""
        accounted = law.defines("potential") and not law.containers
        none = np.zeros((3, len(objects)))
        vectors = ((none if force is None else force) + 0.0).T.tolist()
        torques = ((none if torque is None else torque) + 0.0).T.tolist()
        ident = self.ident(law)
        transaction = self.transaction
        if transaction is not None:
            transaction.touch_all([obj for obj in objects if obj not in self.unplanned])
        for obj, vector, twist in zip(objects, vectors, torques, strict=True):
            stored = StoredForce(_force(vector, ident, twist), law, NEVER, accounted)
            if transaction is not None and obj not in self.unplanned:
                if self.forces.replace(obj, stored):
                    transaction.forced.add(obj)
            else:
                self.forces.replace(obj, stored)

    def _regroup(self, objects: list[PhysicalObject]) -> list[PhysicalObject]:
        """Find the groups of ``objects`` anew, and a stepper for each; returns all objects concerned."""
        affected: dict[PhysicalObject, None] = dict.fromkeys(objects)
        self.affine.clear()
        looks = Looks(self)
        done: set[PhysicalObject] = set()
        for obj in objects:
            self.groups.pop(obj, None)
        for obj in objects:
            if obj._fixed or obj in done or looks.take_alone(obj):
                continue
            joins = any(isinstance(law, PairLaw) for law in self.continuous_laws(obj))
            group = find_group(self, obj) if joins else [obj]
            if joins:
                for member in group:
                    if member not in affected:
                        self._rebase_row(member)
                        affected[member] = None
                    self.groups[member] = group
                done.update(group)
            looks.take(group)
        by_signature = looks.found
        for signature in sorted(by_signature, key=repr):
            self.join_batch(by_signature[signature], signature)
        return self.in_rank_order(affected)

    # Conditions

    def tell(self, kind: type[when.Condition], fits: Callable[[LawContainer, Any], bool], event: Event) -> None:
        """Queue ``event`` now for every container armed with a condition of ``kind`` that ``fits`` takes."""
        self.wakeups.tell(kind, fits, event)

    def signal(self, container: Any, leaf: when.Condition | None, event: Event) -> None:
        """``leaf`` fired: let ``container`` fire if that is its condition, or completes it."""
        signal(self, container, leaf, event)

    def fire(self, container: LawContainer, event: Event) -> None:
        """Let ``container`` enforce its laws."""
        if container in self.spent:
            return
        condition = container.condition
        if condition is not None and condition.once:
            self.spend(container)
        self.events += 1
        container.laws.sort(key=self.law_order)
        before = self.acting
        try:
            container.enforce_laws(event)
        except LawFailedError:
            raise
        except Exception as error:
            law = self.acting
            label = law.label() if law is not None else container.label()
            names = ", ".join(obj.label for obj in event.objects[:3]) or "no object in particular"
            failure = LawFailedError(
                f"{label} raised {type(error).__name__}: {error}; at t = {self.time[0]} s for {names}. "
                "The engine stands just before that event",
                law,
            )
            raise failure from error
        finally:
            self.acting = before

    def spend(self, container: LawContainer) -> None:
        """``container`` fires no more."""
        self.spent.add(container)
        if self.transaction is not None:
            self.transaction.undo.append(lambda: self.spent.discard(container))

    def poll(self, container: LawContainer, span: float) -> None:
        """Ask a container that detects for itself, ``span`` [s] before the next time."""
        container.detections += 1
        container.span = span
        try:
            event = container.detect()
        except Exception as error:
            raise LawFailedError(
                f"{container.label()}.detect raised {type(error).__name__}: {error}; at t = {self.time[0]} s"
            ) from error
        if event is not None and not isinstance(event, Event):
            raise LawFailedError(f"{container.label()}.detect returned {event!r}; an Event, or None, is needed")
        if event is not None:
            self.fire(container, event)

    def objects_under(self, container: LawContainer) -> tuple[PhysicalObject, ...]:
        """The objects of the laws in ``container``, in rank order."""
        return tuple(self.in_rank_order({obj for law in container.laws for obj in self.mapping.objects(law)}))

    def host_step_listeners(self, demanding: bool = False) -> list[LawContainer]:
        """The containers that ask for host steps; ``demanding``: without those that only take what comes."""
        return steps.listeners(self, demanding)

    def host_step(self, number: int, dt: float) -> None:
        """Step ``number`` begins now: call its listeners, who read half a step ahead."""
        steps.host_step(self, number, dt)

    def ident(self, law: PhysicalLaw) -> str:
        """The id of the forces that ``law`` stores."""
        return f"{law.label()}#{self.laws[law]}"

    def law_order(self, law: PhysicalLaw) -> tuple[int, int, str, int]:
        """Where ``law`` stands among those that answer one event: the least comes first."""
        return (self.law_positions.get(law.label(), 0), -law.priority, law.label(), self.ranks.law_ranks.get(law, 0))

    # Time

    def _is_live(self, entry: Entry) -> bool:
        if not entry.alive or not (entry.stands is None or entry.stands()):
            return False
        version = self.bodies.version
        return all(obj._row >= 0 and version[obj._row] == seen for obj, seen in entry.guards)

    def schedule(
        self,
        instant: Instant,
        stage: int,
        rank: Rank,
        act: Callable[[list[Entry]], None],
        guards: tuple[Guard, ...] = (),
    ) -> Entry:
        """Put something into the queue."""
        return self.queue.push(Entry(instant, stage, rank, act, guards))

    def pass_time(self, until: Instant, host_step: Callable[[Instant], Instant]) -> None:
        """Carry everything to ``until``, event by event; ``host_step(t)`` is the first host step after ``t``."""
        self.host_step_after = host_step
        busy, last = 0, NEVER
        begun = (-math.inf, 0.0)
        """Where the last step began."""
        while True:
            try:
                self.plan()
                due = self.queue.next_time()
                # An event whose time reads as ``until`` belongs to this run, whatever its offset.
                ends = due[0] > until[0]
                horizon = until if ends else due
                if flights_to_impacts.advance(self, until, due):
                    continue
                lagging = self._lagging(horizon)
                if lagging is not None:
                    known = lagging.stepper.covered(lagging.state)
                    if known > begun and self.stopped():  # a run that ends at `known` has made the same steps
                        self.time = max(self.time, known)
                        return
                    begun = known
                    self.advance(lagging, horizon, host_step(known))
                    continue
            except LawFailedError as error:
                self.time = max(self.time, self._known_until())
                self.give_up(error)
                continue
            except BaseException:
                self.time = max(self.time, self._known_until())
                raise
            if ends:
                break
            busy = busy + 1 if due == last else 0
            last = due
            if busy > BUSY_INSTANT:
                raise StateError(
                    f"more than {BUSY_INSTANT} events at t = {due[0]} s: laws that wake one another without end?"
                )
            self.happen(due)
            if self.stopped():
                return
        self.time = max(self.time, until)

    def _lagging(self, horizon: Instant) -> Batch | None:
        """The batch that is known for the shortest time, if that is before ``horizon``."""
        found = [
            b for b in self.batches if b.state.count and not b.stepper.impacts and b.stepper.covered(b.state) < horizon
        ]
        # Sources before what they act on, which asks where they are.
        return min(
            found,
            key=lambda b: (b.stepper.covered(b.state), b.signature.level, b.signature.laws, b.number),
            default=None,
        )

    def _known_until(self) -> Instant:
        """Until when all batches are known, after one failed to go on; the present time if all are in closed form."""
        known = [b.stepper.covered(b.state) for b in self.batches if b.state.count and not b.stepper.impacts]
        first = min(known, default=NEVER)
        return self.time if first == NEVER else first

    def give_up(self, error: LawFailedError | TraceError, failed: object = None) -> None:
        """Disable the law that failed, with a warning, if that was asked for; else raise ``error``."""
        law = failed if failed is not None or not isinstance(error, LawFailedError) else error.law
        if self.on_law_error != "disable" or not isinstance(law, PhysicalLaw) or not law.enabled:
            raise error
        warnings.warn(f"{error} (the law is disabled from here on)", XpheveWarning, stacklevel=2)
        self.failed[law] = str(error)
        law.enabled = False

    def stopped(self) -> bool:
        """Whether a handler suspended or terminated the engine, or a frame in real time has taken too long; set by the engine."""
        return False

    def happen(self, due: Instant) -> None:
        """One stage of one instant."""
        entries = self.queue.pop_stage(due)
        if not entries:
            return
        self.time = max(self.time, entries[0].instant)
        acts: dict[int, tuple[Callable[[list[Entry]], None], list[Entry]]] = {}
        for entry in entries:
            acts.setdefault(_identity(entry.act), (entry.act, []))[1].append(entry)
        try:
            with self.instant():
                for act, members in acts.values():
                    act(members)
        except BaseException as error:
            for entry in entries:
                self.queue.push(entry)
            if not isinstance(error, LawFailedError):
                raise
            self.give_up(error)

    # Force ends

    def watch_force(self, obj: PhysicalObject, stored: StoredForce) -> None:
        """Queue the end of a force that has one."""
        if stored.until != NEVER:
            end = _ForceEnd(self, obj, stored)
            self.queue.push(Entry(stored.until, FORCE, (obj.rank, obj.serial), end, stands=end.stands))

    def end_forces(self, ended: list[tuple[PhysicalObject, StoredForce]]) -> None:
        """Forces whose time is over."""
        with self.instant() as transaction:
            for obj, stored in ended:
                held = self.forces.on(obj)
                if obj._row < 0 or stored not in held:
                    continue
                transaction.touch(obj)
                held.remove(stored)
                transaction.forced.add(obj)
                ident = stored.force.id
                self.tell(
                    when.ForceExpired,
                    partial(_asks_for, ident),
                    Event(self.time[0], objects=(obj,), id=stored.force.id, force=stored.force),
                )

    # What the contact server asks for

    @property
    def up_vector(self) -> tuple[float, float, float]:
        """Unit vector against gravity, by the scene's setting."""
        return UP[self.up]

    def response_law(self, a: PhysicalObject, b: PhysicalObject) -> tuple[ResponseLaw, Instant] | None:
        """The enabled response law that both obey and that waits for contacts, and since when."""
        laws_a, laws_b = self.mapping.laws(a), self.mapping.laws(b)
        if len(laws_a) > len(laws_b):
            laws_a, laws_b = laws_b, laws_a
        for law, since in laws_a.items():
            if isinstance(law, ResponseLaw) and law.enabled and law in laws_b and _waits_for_contacts(law):
                return law, max(since, laws_b[law])
        return None

    def listeners(self, kind: type[when.Condition]) -> list[LawContainer]:
        """The containers that wait for contacts of ``kind``, in rank order."""
        return list(dict.fromkeys(container for container, _ in self.hearers(kind)))

    def hearers(self, kind: type[when.Condition]) -> list[tuple[LawContainer, when.Condition]]:
        """Who waits for ``kind``, in rank order, each with its condition of that kind, also one inside a combination."""
        return [(container, leaf) for container, leaf in self.wakeups.armed.hearers(kind) if container.laws]

    def put_reaction(
        self,
        obj: PhysicalObject,
        owner: Any,
        ident: str,
        force: tuple[float, float, float] | None,
        torque: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> None:
        """Store (or, with None, withdraw) a reaction force, and torque, of the contact server on ``obj``."""
        with self.instant() as transaction:
            transaction.touch(obj)
            held = self.forces.on(obj)
            mine = [one for one in held if one.owner is owner and one.force.id == ident]
            if force is None:
                if mine:
                    held[:] = [one for one in held if one not in mine]
                    transaction.forced.add(obj)
            elif self.forces.replace(obj, StoredForce(Force(force, id=ident, torque=torque), owner, NEVER, True)):
                transaction.forced.add(obj)
            if obj in transaction.forced:
                self.sum_forces(obj)


def _never(t: Instant) -> Instant:
    """No host step comes after ``t``."""
    return NEVER


class _ForceEnd:
    """The end of a force."""

    def __init__(self, world: World, obj: PhysicalObject, stored: StoredForce) -> None:
        self.world, self.obj, self.stored = world, obj, stored

    def stands(self) -> bool:
        """Whether the force still acts."""
        return self.stored in self.world.forces.on(self.obj)

    def __call__(self, entries: list[Entry]) -> None:
        self.world.end_forces([(self.obj, self.stored)])


def _waits_for_contacts(law: PhysicalLaw) -> bool:
    """Whether ``law`` is in a container that the contact server serves; a polled one finds contacts itself."""
    return any(c.condition is not None and c.condition.served_by == "contacts" for c in law.containers)


def _asks_for(ident: Any, container: LawContainer, condition: Any) -> bool:
    """Whether a condition with an id waits for ``ident``."""
    return condition.id in (None, ident)


def _identity(act: Callable[[list[Entry]], None]) -> int:
    """Bound methods of one object are one act."""
    owner = getattr(act, "__self__", None)
    return id(act) if owner is None else hash((id(owner), getattr(act, "__name__", "")))


def _force(vector: list[float], ident: str, torque: list[float]) -> Force:
    """A `Force` of values that were checked already."""
    force = object.__new__(Force)
    force.vector = (vector[0], vector[1], vector[2])
    force.torque = (torque[0], torque[1], torque[2])
    force.duration = math.inf
    force.id = ident
    return force


__all__ = ["AFTER", "World", "XpheveError"]
