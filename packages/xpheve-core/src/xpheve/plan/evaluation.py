"""Laws evaluated over batches of objects in NumPy, and what they read."""

from __future__ import annotations

import inspect
import math
from bisect import bisect_right
from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from xpheve.bodies import STATE_WIDTHS, Bodies
from xpheve.errors import LawFailedError
from xpheve.kernels.clock import Instant
from xpheve.laws import ContinuousLaw, FieldLaw, FlowLaw, PairLaw, PhysicalLaw
from xpheve.laws.view import STATE, Batch, BodyView
from xpheve.objects import PhysicalObject
from xpheve.plan.hand_kernels import force_by_rows, formula_of, is_by_hand
from xpheve.plan.mapping import Mapping
from xpheve.plan.pairs import CROWDED, PairSet, add_opposite
from xpheve.steppers.contract import Array, Attraction, Rows, Signature
from xpheve.trace.graph import walk
from xpheve.trace.numpy_text import GraphFunction
from xpheve.trace.recorder import trace_law
from xpheve.trace.samples import parameters_of
from xpheve.trace.shadow import as_arrays
from xpheve.units import show

Fetch = Callable[[str], Array]
OTHERS = ("mass", "inertia", "volume", "since", "time", "up")
"""What laws read besides the state and columns."""
LISTABLE = 20_000_000
"""Pairs whose list memory bears."""
SPEED = frozenset({"velocity", "angular_velocity", "orientation"})
"""What a second evaluation at the middle of a step finds changed."""
UP: dict[str, tuple[float, float, float]] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


RUNAWAY = 1e30
"""Places [m] and speeds [m/s] beyond it come of steps that are too long."""


class Evaluator:
    """Evaluates laws over objects of an engine in NumPy: by their traces, or by calling those that have none."""

    def __init__(self, bodies: Bodies, up: str, mapping: Mapping) -> None:
        self.bodies = bodies
        self.mapping = mapping
        self.up = np.array(UP[up])
        self.seen: WeakKeyDictionary[ContinuousLaw, set[str]] = WeakKeyDictionary()
        """What laws that are called were seen to read."""

    def read(self, law: ContinuousLaw, name: str, rows: Rows, time: float, state: Fetch) -> Any:
        """What ``law`` calls ``name`` of ``rows``, shape (width, rows); of the scene a number, or shape (3,).

        ``state(name)`` gives the flying columns, shape (width, rows).
        """
        bodies = self.bodies
        if name in STATE_WIDTHS:
            return state(name)
        if name in ("mass", "inertia"):
            return bodies.arrays[name][:, rows]
        if name == "time":
            return time
        if name == "up":
            return self.up.copy()
        if name in bodies.columns:
            return bodies.columns[name][None, rows]
        if name == "volume":
            return self.volumes(rows)[None]
        if name == "since":
            return np.array([[self.since(law, bodies.objects[row]) for row in rows.tolist()]])
        raise self.unknown(law, name)

    def unknown(self, law: ContinuousLaw, name: str) -> LawFailedError:
        """The error of a law that reads what nobody declares."""
        from xpheve.plugins.suggest import did_you_mean

        known = [*STATE_WIDTHS, *OTHERS, *self.bodies.columns]
        near = did_you_mean(name, known)
        way_out = near or f' A law that needs it declares it: columns = {{"{name}": xp.Column(0.0, unit=...)}}'
        return LawFailedError(
            f"{law.label()} reads body.{name}, which is no property and no column that a law here declares; "
            f"at hand: {', '.join(known)}.{way_out}",
            law,
        )

    def require_columns(self, law: ContinuousLaw, names: Iterable[str]) -> None:
        """Raise `LawFailedError` if ``law`` reads what nobody declares."""
        known = {*STATE_WIDTHS, *OTHERS, *self.bodies.columns}
        for name in sorted(names):
            if name not in known:
                raise self.unknown(law, name)

    def view(self, law: ContinuousLaw, rows: Rows, time: float, state: Fetch, reads: set[str]) -> BodyView:
        """A view of ``rows`` for a law that is called."""

        def fetch(name: str) -> Any:
            found = self.read(law, name, rows, time, state)
            if name in ("time", "up"):
                return found
            if name in STATE_WIDTHS and len(rows) < 64:
                return np.ascontiguousarray(found.T)
            return found.T

        return BodyView(fetch, reads, len(rows))

    def remember(self, law: ContinuousLaw, reads: set[str]) -> None:
        """Keep what ``law``, which is called, was seen to read."""
        self.seen.setdefault(law, set()).update(reads)

    def volumes(self, rows: Rows) -> Array:
        """Volumes [m^3] of the shapes, asked for once a row and shape."""
        known = self.bodies.volume
        for row in rows[np.isnan(known[rows])].tolist():
            volume = volume_of(self.bodies.objects[row])
            known[row] = -1.0 if math.isnan(volume) else volume
        found: Array = known[rows]
        return np.where(found < 0.0, np.nan, found)

    def since(self, law: PhysicalLaw, obj: PhysicalObject) -> float:
        """When [s] ``obj`` came under ``law``, or ``law`` was enabled."""
        return self.mapping.laws(obj)[law][0]

    def field(
        self, law: FieldLaw, rows: Rows, time: float, state: Fetch, reads: set[str]
    ) -> tuple[Array | None, Array | None]:
        """Force and torque of a field law, shape (3, rows) each, or None where the law has none; ``reads`` gets what it reads."""
        trace = trace_law(law)
        if trace is None:
            view = self.view(law, rows, time, state, reads)
            found = self._checked(law, _called(law), (view,), rows, time)
            self.remember(law, reads)
            return found, None
        reads |= trace.reads
        found = self._run(law, trace.motion_arrays, {"": (rows, state)}, time)
        parts: list[Array | None] = [None, None]
        first = 0
        for k, (method, nodes) in enumerate((("force", trace.force), ("torque", trace.torque))):
            if nodes is not None:
                parts[k] = self.finite(law, method, found[first : first + 3], rows, time)
                first += 3
        return parts[0], parts[1]

    def pair(
        self, law: PairLaw, a: Rows, b: Rows, time: float, state: Callable[[str], Array], reads: set[str]
    ) -> Array:
        """Force on ``a`` of each pair, shape (3, pairs); ``state(name)`` is over all rows of the engine."""
        sides = {side: (rows, _part(state, rows)) for side, rows in (("a", a), ("b", b))}
        trace = trace_law(law)
        if trace is None:
            views = [self.view(law, rows, time, one, reads) for rows, one in sides.values()]
            found = self._checked(law, _called(law), views, a, time)
            self.remember(law, reads)
            return found
        reads |= trace.reads
        return self.finite(law, "force", self._run(law, trace.motion_arrays, sides, time), a, time)

    def potential(self, law: ContinuousLaw, sides: Sequence[Rows], time: float, state: Fetch) -> Array:
        """Potential energy [J] of each object or pair, shape (rows,); ``state(name)`` is over all rows of the engine."""
        trace = trace_law(law)
        if trace is None:
            views = [self.view(law, rows, time, _part(state, rows), set()) for rows in sides]
            return self._called_potential(law, views, sides[0], time)
        names = ("a", "b") if trace.pair else ("",)
        given = {side: (rows, _part(state, rows)) for side, rows in zip(names, sides, strict=True)}
        found: Array = self._run(law, trace.potential_arrays, given, time)[0]
        return found

    def _run(self, law: ContinuousLaw, run: GraphFunction, sides: dict[str, tuple[Rows, Fetch]], time: float) -> Array:
        """What ``run`` gives, shape (outputs, rows); ``sides`` has the rows of each side, and their state."""
        held: dict[tuple[str, str], Any] = {}
        rows, state = next(iter(sides.values()))
        inputs = {}
        for one in run.inputs:
            key = one.side, one.name
            if key not in held:
                own, flown = sides.get(one.side, (rows, state))
                held[key] = self.read(law, one.name, own, time, flown)
            inputs[one] = held[key] if one.name == "time" else held[key][one.component]
        found = np.empty((len(run.outputs), len(rows)))
        for k, values in enumerate(run(inputs, parameters_of(law, run.parameters))):
            found[k] = values
        return found

    def _checked(self, law: ContinuousLaw, method: str, views: Sequence[BodyView], rows: Rows, time: float) -> Array:
        result = self.call(law, method, views, rows, time)
        try:
            if np.iscomplexobj(result):
                raise TypeError("complex")
            full = np.broadcast_to(vectors(result, len(rows), views), (len(rows), 3)).T
        except (ValueError, TypeError):
            shape = (
                f"an array of shape {result.shape}"
                if isinstance(result, np.ndarray)
                else " ".join(repr(result).split())[:80]
            )
            raise LawFailedError(
                f"{law.label()}.{method} returned {shape}; real numbers of shape ({len(rows)}, 3) or (3,) are needed: one vector an object. "
                "A number times a direction is one: body.position.z * (0, 0, 1); so is xp.vector(fx, fy, fz)",
                law,
            ) from None
        return self.finite(law, method, full, rows, time)

    def finite(self, law: ContinuousLaw, method: str, full: Array, rows: Rows, time: float) -> Array:
        """``full``, shape (3, rows), if all of it is finite; else `LawFailedError` says whose is not."""
        if not np.isfinite(full).all():
            bad = int(np.flatnonzero(~np.isfinite(full).all(axis=0))[0])
            obj = self.bodies.objects[int(rows[bad])]
            value = tuple(full[:, bad].tolist())
            raise LawFailedError(
                f"{law.label()}.{method} gave {value} for {obj!r} at t = {time} s; the engine stands just before."
                f"{self._why(law, obj, int(rows[bad]))}",
                law,
            )
        return full

    def _why(self, law: ContinuousLaw, obj: PhysicalObject, row: int) -> str:
        """What may have made a force that is not finite: a column that was not given, or what the law itself says."""
        columns = self.bodies.columns
        missing = [
            name for name in law.columns if math.isnan(columns[name][row]) and math.isnan(law.columns[name].default)
        ]
        if missing:
            name, column = missing[0], law.columns[missing[0]]
            return f" {obj.label} has no {name}: {column.doc} Give PhysicalObject(..., {name}=...) in {column.unit}"
        if law.singular:
            return f" {law.singular}"
        if max(map(abs, (*obj.position, *obj.velocity))) > RUNAWAY:
            return f" Its position is {obj.position} m, its velocity {obj.velocity} m/s: dt may be too long for this law, try a smaller one"
        tables = [one for one in _tables(law) if one.outside == "error"]
        return f" Outside of its points a table gives NaN: {', '.join(map(_extent, tables))}" if tables else ""

    def call(self, law: ContinuousLaw, method: str, views: Sequence[Any], rows: Rows, time: float) -> Any:
        """What ``method`` of ``law`` returns for ``views``; raises `LawFailedError` in place of whatever it raises."""
        called = force_by_rows(law) if method == "force" else getattr(as_arrays(law), method)
        with np.errstate(all="ignore"):
            try:
                return called(*views)
            except LawFailedError:
                raise
            except Exception as error:
                names = ", ".join(self.bodies.objects[int(row)].label for row in rows[:3])
                more = ", ..." if len(rows) > 3 else ""
                raise LawFailedError(
                    f"{law.label()}.{method} raised {type(error).__name__}: {error}; at t = {time} s for {names}{more}",
                    law,
                ) from error

    def _called_potential(self, law: ContinuousLaw, views: Sequence[BodyView], rows: Rows, time: float) -> Array:
        result = self.call(law, "potential", views, rows, time)
        try:
            return np.broadcast_to(np.asarray(result, dtype=float), (len(rows), 1))[:, 0]
        except (ValueError, TypeError):
            shape = f"an array of shape {result.shape}" if isinstance(result, np.ndarray) else repr(result)[:80]
            raise LawFailedError(
                f"{law.label()}.potential returned {shape}; real numbers of shape ({len(rows)}, 1) are needed: one an object or pair. "
                "a.dot(b), v.norm() and v.x have it",
                law,
            ) from None


def _called(law: ContinuousLaw) -> str:
    """What is called for the force of a law that is not traced: its kernel, or `apply`."""
    return "force" if is_by_hand(law) else "apply"


def _part(state: Fetch, rows: Rows) -> Fetch:
    """``state`` of ``rows`` alone."""
    return lambda name: state(name)[:, rows]


def vectors(result: Any, count: int, views: Sequence[BodyView]) -> Any:
    """``result`` as vectors; raises `ValueError` where broadcasting would make a vector of what is none.

    A number, or a column (n, 1), would push along all three axes; 0 is no force. One number a row, such as ``body.position[:, 2]``, has
    the shape of a vector when there are three rows.
    """
    values = np.asarray(result, dtype=float)
    nothing = values.ndim == 0 and (values == 0.0 or np.isnan(values))
    column = values.shape == (3,) == (count,) and isinstance(result, Batch)
    if (values.shape[-1:] != (3,) and not nothing) or (column and any(view._reads - {"up", "time"} for view in views)):
        raise ValueError("no vector")
    return values


def _jumps_of(law: ContinuousLaw, since: float) -> list[float]:
    """When [s] the force of ``law`` on an object that came under it at ``since`` jumps; raises `LawFailedError`."""
    try:
        times = [float(time) for time in law.jumps(since)]
    except Exception as error:
        raise LawFailedError(f"{law.label()}.jumps({since}) raised {type(error).__name__}: {error}", law) from error
    if any(map(math.isnan, times)):
        raise LawFailedError(f"{law.label()}.jumps({since}) gave {times}: simulation times [s] are needed", law)
    return times


def _is_of_orientation(law: ContinuousLaw) -> bool:
    """Whether the potential of ``law`` depends on the orientation, so that it stands for the work of the torque."""
    trace = formula_of(law)
    if trace is None or trace.potential is None:
        return False
    return any(node.op == "input" and node.value.name == "orientation" for node in walk([trace.potential]))


def volume_of(obj: PhysicalObject) -> float:
    """Volume [m^3] of the shape; NaN where there is none, or no end to it."""
    volume = math.nan if obj.shape is None else obj.shape.volume
    return volume if math.isfinite(volume) else math.nan


def is_constant(reads: set[str]) -> bool:
    """Whether a law that read ``reads`` reads neither state nor time."""
    return not (reads & STATE) and "time" not in reads


class _Effect(NamedTuple):
    """Force, torque and the force without potential of a law on some of the rows, (3, rows) each or None; and what it read."""

    which: Any
    force: Array | None
    torque: Array | None
    working: Array | None
    reads: set[str]


def _tables(law: ContinuousLaw) -> list[Any]:
    """The tables that the class of ``law`` declares."""
    from xpheve.trace.table import Table

    declared = [inspect.getattr_static(type(law), name) for name in dir(type(law))]
    return [one for one in declared if isinstance(one, Table)]


def _extent(table: Any) -> str:
    return f'{table.name} goes from {table.x[0]:g} to {table.x[-1]:g} {show(table.dim_x)}, unless it has outside="hold" or "extend"'


class BatchSources:
    """What acts along the way on the rows of a batch; see `xpheve.steppers.contract.Sources`."""

    def __init__(
        self, world: Any, laws: Sequence[ContinuousLaw], objects: Sequence[PhysicalObject], signature: Signature
    ) -> None:
        self.world = world
        self.signature = signature
        self.laws = laws
        self.working: Array = np.zeros((3, 0))
        bodies: Bodies = world.bodies
        rows = {obj: obj._row for obj in objects}
        self.fields: list[tuple[FieldLaw, Array]] = []
        self.pairs: list[tuple[PairLaw, PairSet]] = []
        self.flows: list[tuple[FlowLaw, Array]] = []
        self._standing: dict[ContinuousLaw, _Effect] = {}
        """What the last evaluation found of laws that read neither velocity nor orientation."""
        self._traces = {law: formula_of(law) for law in laws}
        self.jumps: list[float] = self._jumps(objects)
        for law in laws:
            members = world.in_rank_order(world.mapping.objects(law))
            if isinstance(law, FieldLaw | FlowLaw):
                mask = np.zeros(bodies.capacity, dtype=bool)
                mask[[rows[obj] for obj in members if obj in rows]] = True
                if isinstance(law, FieldLaw):
                    self.fields.append((law, mask))
                else:
                    self.flows.append((law, mask))
            elif isinstance(law, PairLaw):
                if law.one_sided:  # targets of other batches are no affair of this one
                    members = [obj for obj in members if obj in rows or law.side_of(obj) == 1]
                self.pairs.append((law, PairSet(law, members, [obj not in rows for obj in members])))
        self.masks = dict(self.fields)
        self.sets = dict(self.pairs)
        sources = [pairs.used for _, pairs in self.pairs]
        used = np.unique(np.concatenate(sources)) if sources else np.zeros(0, dtype=np.int64)
        self.hands: Rows = used[bodies.driven[used]]
        """The rows of driven objects that act on the batch."""
        apart = used[~(bodies.fixed[used] | bodies.driven[used])]
        self.suns: Rows = apart[~np.isin(apart, list(rows.values()))]
        """The rows of moving objects of other batches that act on the batch by one-sided laws."""
        self.ring = any(
            law.one_sided and law.between is not None and any(obj in rows for obj in law.between[0])
            for law, _ in self.pairs
        )
        """Whether a one-sided law acts from one row of the batch on another."""
        self.lent = (*(["driven"] if len(self.hands) else []), *(["sources"] if len(self.suns) or self.ring else []))
        """Who acts on the batch and shares no potential energy with it; see `xpheve.plan.groups.Batch`."""
        self.rows: Rows = np.array([obj._row for obj in objects], dtype=np.int64)
        self.twists = np.zeros(bodies.capacity, dtype=bool)
        self.working_twists = np.zeros(bodies.capacity, dtype=bool)
        """Which rows a law turns that has a torque, and no potential of orientations."""
        for law, mask in self.fields:
            if law.defines("torque"):
                self.twists |= mask
                if not _is_of_orientation(law):
                    self.working_twists |= mask
        self._program: Any = None
        self._motion: Any = None
        self.why_alone = ""
        """Why there is no program: what must be evaluated law by law."""

    @cached_property
    def _readers(self) -> tuple[Any, Any]:
        """Which rows obey a law that reads their orientation, and which one that reads their angular velocity."""
        need, need_spin = np.zeros_like(self.twists), np.zeros_like(self.twists)
        for law, mask in self.fields:
            reads = self.world.reads_of(law)
            if "orientation" in reads:
                need |= mask
            if "angular_velocity" in reads:
                need_spin |= mask
        return need, need_spin

    @cached_property
    def reads_turning(self) -> bool:
        """Whether a law reads orientation or angular velocity, for all that is known."""
        return any(self._reads_rotation(law) for law in self.laws if not isinstance(law, FlowLaw))

    @cached_property
    def turning_pairs(self) -> bool:
        """Whether a law between two objects does."""
        return any(self._reads_rotation(law) for law in self.laws if isinstance(law, PairLaw))

    def _reads_rotation(self, law: ContinuousLaw) -> bool:
        trace = formula_of(law)
        return trace is None or bool(trace.reads & {"orientation", "angular_velocity"})

    def stepped(self, rows: Rows) -> Array:
        """How ``rows`` turn; see `xpheve.steppers.contract.Sources`."""
        arrays = self.world.bodies.arrays
        torque = arrays["torque"][:, rows].any(axis=0)
        need, need_spin = self._readers
        if not (torque.any() or self.twists.any() or need.any() or need_spin.any()):
            return np.zeros((1, len(rows)))
        inertia = arrays["inertia"][:, rows]
        spins = arrays["angular_velocity"][:, rows].any(axis=0)
        uneven = (inertia[0] != inertia[1]) | (inertia[1] != inertia[2])
        needed = spins & (need[rows] | (need_spin[rows] & uneven))
        twisted = (inertia[0] > 0.0) & (torque | self.twists[rows])
        return np.where(twisted, 2.0, np.where(needed, 1.0, 0.0))[None]

    def _jumps(self, objects: Sequence[PhysicalObject]) -> list[float]:
        """When [s] the force of a law on one of ``objects`` jumps, ascending."""
        found: set[float] = set()
        since = self.world.evaluator.since
        for law in self.laws:
            if law.defines("jumps"):
                began = {since(law, obj) for obj in objects if law in self.world.mapping.laws(obj)}
                found.update(time for one in sorted(began) for time in _jumps_of(law, one))
        return sorted(found)

    @property
    def program(self) -> Any:
        """The loop of the batch; None if a law must be evaluated by itself."""
        if len(self.suns):  # its loops know no time of day for what acts
            return None
        held = self.held
        return None if held is None else held.program

    @property
    def load(self) -> int:
        """About how many rows and pairs a step has."""
        return len(self.rows) + sum(self._acting(law, pairs) for law, pairs in self.pairs)

    @staticmethod
    def _acting(law: PairLaw, pairs: PairSet) -> int:
        """About how many of ``pairs`` are near enough."""
        near = law.named is None and math.isfinite(law.reach())
        return min(pairs.count, CROWDED * len(pairs.used)) if near else pairs.count

    def counts(self) -> list[tuple[ContinuousLaw, int]]:
        """About how many rows, or pairs, each law acts on."""
        fields: list[tuple[ContinuousLaw, int]] = [(law, int(mask[self.rows].sum())) for law, mask in self.fields]
        return fields + [(law, self._acting(law, pairs)) for law, pairs in self.pairs]

    @property
    def held(self) -> Any:
        """The program with the places of its rows, made when first asked for."""
        if self._program is None and not self.why_alone:
            from xpheve.plan.programs import BatchProgram, term_of

            terms = {law: self._term(term_of(self.world, law), law) for law in self.laws}
            alone = [law.label() for law, term in terms.items() if term is None]
            if len(self.hands):
                self.why_alone = "objects that the host carries act on it"
            elif self.ring:
                self.why_alone = "one-sided laws act from one of its objects on another"
            elif any(law.named is not None and pairs.count > LISTABLE for law, pairs in self.pairs):
                self.why_alone = f"more than {LISTABLE} pairs between objects that are named"
            elif alone:
                self.why_alone = f"evaluated law by law: {', '.join(alone)}"
            else:
                self._try_kernels()
                self._program = BatchProgram(self.world, self.rows, self.laws, terms, self.pairs)
        return self._program

    def attractions(self, rows: Sequence[int]) -> dict[int, Attraction]:
        """What attracts each of ``rows``; see `xpheve.steppers.contract.Sources`."""
        from xpheve.plan.forms import attractions

        return attractions(self, rows)

    def _term(self, term: Any, law: ContinuousLaw) -> Any:
        """``term`` of ``law``; where sources move, what it does is booked as work."""
        moved = isinstance(law, PairLaw) and law.one_sided and len(self.suns)
        return term._replace(accounted=False) if term is not None and moved else term

    @cached_property
    def courses(self) -> Any:
        """The `xpheve.plan.courses.Courses` of what moves and acts on the batch by one-sided laws; None if nothing does."""
        if not len(self.suns):
            return None
        from xpheve.plan.courses import Courses

        return Courses(self.world, self.suns)

    def follow(self, begin: Instant, end: Instant, least: Instant) -> Instant:
        """See `xpheve.steppers.contract.Sources`."""
        known: Instant = end if self.courses is None else self.courses.reach(begin, end, least)
        return known

    @property
    def motion(self) -> Any:
        """The `xpheve.plan.motions.Motion` of the batch, made when first asked for; None if laws must be evaluated one by one."""
        if self.held is None:
            return None
        if self._motion is None or not self._motion.fits():
            from xpheve.plan.motions import Motion

            self._motion = Motion(self)
        return self._motion

    @property
    def made_motion(self) -> Any:
        """The motion if it was made already; None else."""
        return self._motion

    def _try_kernels(self) -> None:
        """Call kernels written by hand once, for their errors: before anything moves."""
        world = self.world

        def now(name: str) -> Array:
            found: Array = world.read_all(name, world.time)
            return found

        for field_law, mask in self.fields:
            rows = self.rows[mask[self.rows]]
            if is_by_hand(field_law) and field_law.enabled and len(rows):
                world.evaluator.field(field_law, rows, world.time[0], lambda name, rows=rows: now(name)[:, rows], set())
        for law, pairs in self.pairs:
            if is_by_hand(law) and law.enabled and pairs.count:
                a, b = next(iter(pairs.chunks(now("position"))), (self.rows[:0], self.rows[:0]))
                if len(a):
                    world.evaluator.pair(law, a[:1], b[:1], world.time[0], now, set())

    def renew(self) -> None:
        """A parameter has another value, or a law was switched."""
        self.jumps = self._jumps([self.world.bodies.objects[row] for row in self.rows.tolist()])
        if self._program is not None:
            self._program.forget_parameters()
        self.forget_rows()

    def forget_rows(self) -> None:
        """Masses, columns or stored forces of some rows are others."""
        if self._motion is not None:
            self._motion.forget()

    def linear(self, rows: Rows) -> Any:
        """What acts on ``rows``, complete groups, as matrices; see `xpheve.plan.linear_form`."""
        from xpheve.plan.linear_form import form_of_rows

        return form_of_rows(self.world, self.laws, rows, self.sets)

    def is_made_from(self, law: ContinuousLaw, trace: Any) -> bool:
        """Whether these sources were made when ``law`` had ``trace``; of a law without one, nothing is known."""
        return trace is not None and self._traces.get(law) is trace

    def pack(self, state: Any, found: dict[str, Array]) -> Array:
        """The numbers of the program's rows."""
        packed: Array = self.held.pack(found)
        return packed

    def run(self, numbers: Array, grid: Any, steps: int) -> None:
        """Run the program, and count its evaluations."""
        program = self.held.program
        tier = self.world.tier_of(self)
        try:
            program.run(tier, numbers, steps, grid.dt, grid.origin, grid.number, self.world.up_vector)
        except ArithmeticError as error:
            raise self._kernel_failed(error) from error
        except ValueError as error:
            if not program.files:
                raise
            raise self._kernel_failed(error) from error
        for law, term in self.held.terms.items():
            if law.enabled:
                law.evaluations += steps * (2 if term.of_velocity else 1)

    def _kernel_failed(self, error: Exception) -> LawFailedError:
        """What to raise when a kernel written by hand raised ``error``: interpreted, Python raises where the machine goes on."""
        laws = [law for law in self.laws if is_by_hand(law)] or list(self.laws)
        names = " + ".join(law.label() for law in laws)
        return LawFailedError(
            f"{names}: force raised {type(error).__name__}: {error}; the engine stands before this step", laws[0]
        )

    def unpack(self, numbers: Array) -> dict[str, Array]:
        """What a run changed."""
        unpacked: dict[str, Array] = self.held.unpack(numbers)
        return unpacked

    def label(self, place: int) -> str:
        """The object at ``place`` of the program."""
        held = self.held
        row = held.rows[held.order[place]]
        return str(self.world.bodies.objects[int(row)].label)

    def wall(self, t: Instant, wall: Instant) -> Instant:
        """``wall``, or the first jump after ``t`` if that comes before it: no step may pass it."""
        place = bisect_right(self.jumps, t[0])
        return min(wall, (self.jumps[place], 0.0)) if place < len(self.jumps) else wall

    def joined(self, rows: Sequence[int]) -> list[int]:
        """``rows`` and all that pair laws join with them, ascending."""
        objects = self.world.bodies.objects
        found = {other._row for row in rows for other in self.world.group_of(objects[row])}
        return sorted(found)

    def evaluate(
        self, rows: Rows, t: Instant, state: dict[str, Array], again: bool = False
    ) -> tuple[Array, Array, bool]:
        """Sums of forces and torques over the laws, in rank order.

        ``again``: the same rows at the same places and time, so that what reads neither velocity nor orientation stands.
        """
        force, torque = np.zeros((3, len(rows))), np.zeros((3, len(rows)))
        self.working = np.zeros((3, len(rows)))
        known = self._standing if again else {}
        self._standing = {}
        reads_velocity = False
        for law in (*self.masks, *self.sets):
            if not law.enabled:
                continue
            effect = known[law] if law in known else self._effect(law, rows, t, state)
            if effect is None:
                continue
            law.evaluations += law not in known
            if not effect.reads & SPEED:
                self._standing[law] = effect
            reads_velocity |= bool(effect.reads & {"velocity", "angular_velocity"})
            if effect.force is not None:
                force[:, effect.which] += effect.force
            if effect.working is not None:
                self.working[:, effect.which] += effect.working
            if effect.torque is not None:
                torque[:, effect.which] += effect.torque
        return force, torque, reads_velocity

    def flow(
        self, rows: Rows, t: Instant, state: dict[str, Array], span: float, backwards: bool = False
    ) -> tuple[set[str], Array]:
        """Let the flow laws act on ``state``; see `xpheve.steppers.contract.Sources`."""
        from xpheve.plan.flows import flow_all

        acting = [(law, mask) for law, mask in self.flows if law.enabled]
        twisted = self.working_twists[rows] | self.world.bodies.arrays["torque"][:, rows].any(axis=0)
        return flow_all(self.world.evaluator, acting[::-1] if backwards else acting, rows, t, state, span, twisted)

    def _effect(self, law: ContinuousLaw, rows: Rows, t: Instant, state: dict[str, Array]) -> _Effect | None:
        """What ``law`` does to ``rows``; None if it concerns none of them."""
        reads: set[str] = set()
        if law in self.masks:
            assert isinstance(law, FieldLaw)
            inside = np.flatnonzero(self.masks[law][rows])
            if not len(inside):
                return None
            every = len(inside) == len(rows)
            which = slice(None) if every else inside
            force, torque = self.world.evaluator.field(
                law, rows[which], t[0], lambda name: state[name] if every else state[name][:, inside], reads
            )
            return _Effect(which, force, torque, None if law.defines("potential") else force, reads)
        assert isinstance(law, PairLaw)
        return self._paired(law, self.sets[law], rows, t, state, reads)

    def _paired(
        self, law: PairLaw, pairs: PairSet, rows: Rows, t: Instant, state: dict[str, Array], reads: set[str]
    ) -> _Effect | None:
        """The forces of ``law`` on ``rows``, summed from 0 in the order of the pairs."""
        bodies: Bodies = self.world.bodies
        place = np.full(bodies.count, -1, dtype=np.int64)
        place[rows] = np.arange(len(rows))
        acting = np.zeros(bodies.count, dtype=bool)
        acting[rows] = True
        if not acting[pairs.used].any():
            return None
        held: dict[str, Array] = {}

        def everywhere(name: str) -> Array:
            if name not in held:
                whole: Array = bodies.arrays[name][:, : bodies.count].copy()
                whole[:, rows] = state[name]
                for row in (*self.hands.tolist(), *self.suns.tolist()):
                    whole[:, row] = self.world.read_row(row, name, t)
                held[name] = whole
            return held[name]

        total, lent = np.zeros((3, len(rows))), np.zeros((3, len(rows)))
        for a, b in pairs.chunks(everywhere("position")):
            ours = acting[a] | acting[b]
            if not ours.all():
                a, b = a[ours], b[ours]
            if not len(a):
                continue
            found = self.world.evaluator.pair(law, a, b, t[0], everywhere, reads)
            felt = np.full(len(a), -1) if law.one_sided else place[a]
            add_opposite(total, felt, place[b], found)
            if self.lent:
                moved = bodies.driven[a] | bodies.driven[b] | (law.one_sided & ~bodies.fixed[a])
                add_opposite(lent, felt[moved], place[b[moved]], found[:, moved])
        return _Effect(slice(None), total, None, lent if law.defines("potential") else total, reads)
