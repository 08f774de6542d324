"""Implicit: L-stable steps of high order for stiff forces, with the Jacobians of the laws' traces."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from xpheve.bodies import Bodies
from xpheve.errors import NoStepperError
from xpheve.kernels.clock import Instant
from xpheve.loop.couples import ALL
from xpheve.loop.drivers import implicit as at
from xpheve.steppers import radau_tables
from xpheve.steppers.contract import (
    Array,
    Grid,
    Offer,
    Refusal,
    Rows,
    Settings,
    Signature,
    Sources,
    State,
    Stop,
)
from xpheve.steppers.flights import FlightState
from xpheve.steppers.smooth import Smooth
from xpheve.steppers.sums import spans_since, two_sums

DRIVER = "implicit"  # of xpheve.loop.drivers
MOST_STAGES = radau_tables.STAGES[-1]
TOGETHER = 1000
"""Most objects of one group: their matrices are dense, 9 of 9 numbers a pair of objects, which is 650 MB here."""
LOOSE, TIGHT = 1e-3, 1e-6
"""Relative tolerances from which on steps have 3 stages or more, and up to which 7; 5 or more between. So van der Pol's oscillator and Robertson's
reaction cost least."""
EXACT = 1e-12, 1e-15
"""To what the equations of steps of a given length are solved."""

ARRAYS = {"end": 12, "from": 3, "curve": 3 * MOST_STAGES, "work": 1, "work_rest": 1, "gain": 1, "power": MOST_STAGES}
"""What a row keeps: place, velocity and what rounding lost of them at the end of the step under way; the place where that begins; the coefficients
of theta, theta^2, ... of what its velocity gains in it; the work of forces without potential before it; that of the laws in the whole of it, and its
coefficients."""
KEPT = {
    "next": at.NEXT, "last": at.LAST, "before": at.BEFORE, "before_error": at.BEFORE_ERROR, "theta": at.THETA, "rate": at.RATE,
}  # fmt: skip
COUNTED = {
    "evaluations": at.EVALUATIONS, "stages": at.STAGES, "fresh": at.FRESH, "steps": at.STEPS, "rejected": at.REJECTED,
    "settled": at.SINCE, "kept": at.KEPT, "jacobians": at.JACOBIANS,
}  # fmt: skip
"""Numbers that the driver keeps between calls, and where it has them."""


class Implicit(Smooth):
    """Radau IIA with 3, 5 or 7 stages (order 5, 9, 13): what decays fast costs no steps, however stiff; see `xpheve.loop.drivers.implicit`.

    Steps follow the tolerances; with ``dt`` a step is a host step, with 3 stages, and shorter only where its equations cannot be solved. All
    rows of a batch share a step; each group has matrices of its own, so that separate groups cost as much as they are many. Rotation is
    left to closed form. Between steps a row is read from the step's own polynomials (Hairer, Wanner, Solving ODEs II, IV.8, (8.15)), places
    from the integral of the velocity's: they join without a bend.
    """

    id: ClassVar[str] = "core:implicit"
    promise: ClassVar[str] = "L-stable, order 5 to 13, for stiff forces"
    books_work: ClassVar[bool] = True
    driver: ClassVar[str] = DRIVER
    parts: ClassVar[bool] = True
    limit: ClassVar[float] = math.inf

    def offer(self, signature: Signature) -> Offer | Refusal:
        reason = self.refusal(signature)
        if not reason and (signature.torque != "none" or {"orientation", "angular_velocity"} & set(signature.reads)):
            reason = "it carries no rotation, and a law reads how objects turn, or a torque turns them"
        if not reason and signature.wish != self.id:
            if signature.fixed_step:
                reason = "steps of a given length; ask for it by stepper='core:implicit'"
            elif not signature.stiff:
                reason = "the forces are not stiff"
        return Refusal(reason) if reason else Offer(13.0, 400.0, False)

    def start(self, rows: Rows, bodies: Bodies, t: Instant, sources: Sources | None) -> State:
        numbers = dict.fromkeys((*KEPT, *COUNTED), 0.0) | {"base": t[0], "offset": t[1], "fresh": 1.0, "rate": 1.0}
        state = self.new_state(ARRAYS, numbers)
        self.join(state, rows, bodies, t)
        return state

    def join(self, state: State, rows: Rows, bodies: Bodies, t: Instant) -> None:
        assert isinstance(state, FlightState)
        first = state.count
        super().join(state, rows, bodies, t)
        if first == 0:
            state.numbers |= {"base": t[0], "offset": t[1], "last": 0.0, "fresh": 1.0}
        state.numbers |= {"next": 0.0, "before_error": 0.0, "rate": 1.0}
        self._begin_anew(state, bodies, np.arange(first, state.count))

    def covered(self, state: State) -> Instant:
        return state.numbers["base"], state.numbers["offset"]

    # Reading

    def curve(self, state: FlightState, bodies: Bodies, t: Instant, places: slice | Rows) -> tuple[Array, Array]:
        end = state.arrays["end"][:, places]
        if t == self.covered(state):
            return end[:3], end[3:6]
        rows = state.rows[places]
        x, v = bodies.arrays["position"][:, rows], bodies.arrays["velocity"][:, rows]
        h = state.numbers["last"]
        if h == 0.0:
            return x, v
        since, q = state.arrays["since"][:, places], state.arrays["curve"][:, places]
        span = spans_since(t, since[0], since[1])
        theta = span / h
        gain, way = np.zeros_like(x), np.zeros_like(x)
        for k in range(MOST_STAGES - 1, -1, -1):
            gain = (gain + q[3 * k : 3 * k + 3]) * theta
            way = (way + q[3 * k : 3 * k + 3] / (k + 2)) * theta
        return x + (span * v + span * way), v + gain

    def running_work(self, state: State, bodies: Bodies, t: Instant, places: slice | Rows) -> Array:
        arrays = state.arrays
        if t == self.covered(state):
            return arrays["gain"][0, places].copy()
        since, power, h = arrays["since"][:, places], arrays["power"][:, places], state.numbers["last"]
        total = np.zeros(power.shape[1])
        if h > 0.0:
            theta = spans_since(t, since[0], since[1]) / h
            for k in range(MOST_STAGES - 1, -1, -1):
                total = (total + power[k]) * theta
        return total

    # Steps

    def advance(
        self, state: State, bodies: Bodies, need: Instant, wall: Instant, settings: Settings, sources: Sources | None
    ) -> Stop:
        return self._go(state, bodies, need, wall, settings, sources, once=True)

    def leap(
        self, state: State, bodies: Bodies, need: Instant, wall: Instant, settings: Settings, sources: Sources | None
    ) -> Stop:
        return self._go(state, bodies, need, wall, settings, sources, once=False)

    def stride(
        self, state: State, bodies: Bodies, grid: Grid, steps: int, settings: Settings, sources: Sources | None
    ) -> Stop:
        end = grid.point(steps)
        stop = Stop(self.covered(state), ())
        while self.covered(state) < end:
            stop = self._go(state, bodies, end, end, settings, sources, once=False, grid=grid)
            grid = Grid(grid.origin, grid.dt, int(state.numbers["number"]))
        return stop

    def _go(
        self,
        state: State,
        bodies: Bodies,
        need: Instant,
        wall: Instant,
        settings: Settings,
        sources: Sources | None,
        once: bool,
        grid: Grid | None = None,
    ) -> Stop:
        """Make one step, or those up to ``need``; the last may pass it."""
        assert isinstance(state, FlightState) and sources is not None
        begin = self.covered(state)
        if begin >= need:
            return Stop(begin, ())
        motion = sources.motion
        if motion is None or motion.turning:
            raise NoStepperError(
                "core:implicit cannot serve these laws: "
                + ("they turn objects" if motion is not None else "one must be evaluated on its own")
                + "; choose another stepper, such as engine.stepper = 'core:midpoint'"
            )
        numbers = state.numbers
        fixed = settings.dt is not None
        held = motion.buffers.get(DRIVER) or motion.buffers.setdefault(DRIVER, _Buffers(motion))
        held.load(state, motion, begin, bodies)
        s, d = held.s, held.d
        s[at.NEED : at.NEED + 2], s[at.WALL : at.WALL + 2] = need, wall
        s[at.RTOL], s[at.ATOL] = EXACT if fixed else (settings.rtol, settings.atol)
        d[at.ONCE], d[at.FIXED] = int(once and not fixed), int(fixed)
        least = 3 if fixed or settings.rtol >= LOOSE else 5 if settings.rtol > TIGHT else MOST_STAGES
        d[at.LEAST], d[at.MOST] = least, least if fixed else MOST_STAGES
        d[at.STAGES] = min(max(d[at.STAGES], least), d[at.MOST])
        s[at.GRID] = 0.0
        if grid is not None:
            s[at.ORIGIN : at.ORIGIN + 2], s[at.GRID], d[at.NUMBER] = grid.origin, grid.dt, grid.number
        before = int(d[at.STEPS])
        status = motion.run(DRIVER, s, d)
        for name, place in KEPT.items():
            numbers[name] = float(s[place])
        for name, place in COUNTED.items():
            numbers[name] = float(d[place])
        numbers["number"] = float(d[at.NUMBER])
        if d[at.STEPS] > before:
            self._take(state, bodies, motion, held)
        now = self.covered(state)
        if status in (at.STUCK, at.LOST):
            self._fail(state, status, now, motion, held, settings, sources)
        return Stop(now, state.rows)

    def _take(self, state: FlightState, bodies: Bodies, motion: Any, held: _Buffers) -> None:
        """Take over the last step: its beginning goes to the bodies, its end and its polynomials are kept."""
        s, arrays = held.s, state.arrays
        rows = state.where
        for name, place in (("position", at.X_BEGIN), ("velocity", at.V_BEGIN)):
            bodies.arrays[name][:, rows] = motion.unpack(held.vector(place))
        bodies.clock[0, rows], bodies.clock[1, rows] = s[at.BEGIN : at.BEGIN + 2]
        ends = [motion.unpack(held.vector(place)) for place in (at.X, at.V, at.X_REST, at.V_REST)]
        arrays["end"][...] = np.concatenate(ends)
        arrays["from"][...] = bodies.arrays["position"][:, rows]
        arrays["curve"][...] = motion.unpack(held.curve())
        arrays["acceleration"][...] = arrays["curve"][:3] / s[at.LAST]
        if motion.works:
            work = held.vector(at.WORK)
            arrays["work"][...], arrays["work_rest"][...], arrays["gain"][...] = (
                motion.unpack(work[k : k + 1]) for k in range(3)
            )
            arrays["power"][...] = motion.unpack(held.power())
        state.numbers |= {"base": float(s[at.TIME]), "offset": float(s[at.TIME + 1])}
        self.begin(state, bodies, slice(None))
        bodies.change += 1

    def _fail(
        self,
        state: FlightState,
        status: int,
        now: Instant,
        motion: Any,
        held: _Buffers,
        settings: Settings,
        sources: Sources,
    ) -> None:
        """Raise what keeps the batch from going on."""
        end = state.arrays["end"]
        found = {"position": end[:3], "velocity": end[3:6]}
        if status == at.LOST:
            rest = {
                name: np.zeros((width, state.count)) for name, width in (("orientation", 4), ("angular_velocity", 3))
            }
            rest["orientation"][0] = 1.0
            raise motion.fail(now, found | rest)
        label = sources.label(int(held.d[at.LAST_ROW]))
        what = (
            "solve the equations of its steps"
            if settings.dt is not None
            else f"keep rtol={settings.rtol}, atol={settings.atol}"
        )
        raise NoStepperError(
            f"core:implicit cannot {what} at t = {now[0]} s: they fell to {float(held.s[at.NEXT])} s, because of {label}. "
            "Look whether its forces jump, or grow without bound; else loosen the tolerances"
        )

    # What an event wrote

    def changed(
        self, state: State, bodies: Bodies, rows: Sequence[int], t: Instant, sources: Sources | None
    ) -> Sequence[int]:
        """The groups of ``rows`` start anew at ``t``; if that is in the midst of a step, they are all that is in the batch."""
        assert isinstance(state, FlightState)
        together = self.together(bodies, rows, sources)
        if t < self.covered(state):
            together = state.rows.tolist()
        self._restart(state, bodies, self.changed_locals(bodies, together), t)
        return together

    def restart(self, state: State, bodies: Bodies, t: Instant, sources: Sources | None) -> Sequence[int]:
        assert isinstance(state, FlightState)
        self._restart(state, bodies, np.arange(state.count), t)
        return state.rows.tolist()  # type: ignore[no-any-return]

    def _restart(self, state: FlightState, bodies: Bodies, places: Rows, t: Instant) -> None:
        """Let the rows at ``places`` begin at ``t``, with the state that they have then, or that was written."""
        rows = state.rows[places]
        rest = places[(bodies.clock[0, rows] != t[0]) | (bodies.clock[1, rows] != t[1])]
        arrays = state.arrays
        joules = self.running_work(state, bodies, t, places)
        way = self.curve(state, bodies, t, rest)[0] - arrays["from"][:, rest]
        joules[np.isin(places, rest)] += (bodies.arrays["working"][:, state.rows[rest]] * way).sum(axis=0)
        work, left = two_sums(arrays["work"][0, places], joules + arrays["work_rest"][0, places])
        arrays["work"][0, places], arrays["work_rest"][0, places] = work, left
        lost = arrays["end"][6:, rest] if t == self.covered(state) else 0.0
        self.rebase(state, bodies, places, t)
        self._begin_anew(state, bodies, places)
        arrays["end"][6:, rest] = lost
        state.numbers |= {"next": 0.0, "before_error": 0.0, "rate": 1.0}
        if t < self.covered(state):
            state.numbers |= {"base": t[0], "offset": t[1], "last": 0.0, "fresh": 1.0}

    def _begin_anew(self, state: FlightState, bodies: Bodies, places: Rows) -> None:
        """From their clocks on the rows at ``places`` have no step behind them."""
        rows, arrays = state.rows[places], state.arrays
        self.begin(state, bodies, places)
        arrays["end"][:3, places], arrays["end"][3:6, places] = (
            bodies.arrays["position"][:, rows],
            bodies.arrays["velocity"][:, rows],
        )
        arrays["end"][6:, places] = 0.0
        arrays["from"][:, places] = arrays["end"][:3, places]
        for name in ("curve", "gain", "power"):
            arrays[name][:, places] = 0.0


# The driver's buffers ------------------------------------------------------------------------------------------------


class _Buffers:
    """What the driver works on, laid out for one motion; nothing in it outlives a call but its layout."""

    def __init__(self, motion: Any) -> None:
        rows, moving = motion.rows, motion.moving
        blocks = blocks_of(motion)
        largest = max(len(block) for block in blocks)
        if largest > TOGETHER:
            raise NoStepperError(
                f"core:implicit solves for all objects that laws join at once: {largest} are too many (at most {TOGETHER}). "
                "Choose another stepper, such as engine.stepper = 'core:midpoint'"
            )
        self.rows, self.moving = rows, moving
        area = sum((3 * len(block)) ** 2 for block in blocks)
        lists = at.HEADER + 3 * moving
        members = lists + 4 * len(blocks)
        pivots = members + moving
        d = self.d = np.zeros(pivots + 3 * moving * (1 + MOST_STAGES // 2), dtype=np.int64)
        d[at.ROWS], d[at.MOVING], d[at.BLOCKS], d[at.AREA] = rows, moving, len(blocks), area
        d[at.WORKS], d[at.LISTS] = int(motion.works), lists
        place = 0
        for number, block in enumerate(blocks):
            count = len(block)
            d[lists + 4 * number : lists + 4 * number + 4] = members, count, place, pivots
            d[members : members + count] = block
            d[at.HEADER + block] = place + 9 * count * np.arange(count)
            d[at.HEADER + moving + block] = 3 * count
            d[at.HEADER + 2 * moving + block] = 3 * np.arange(count)
            members, place, pivots = (
                members + count,
                place + 9 * count * count,
                pivots + 3 * count * (1 + MOST_STAGES // 2),
            )
        end = at.NUMBERS + len(radau_tables.TABLES)
        for name in range(at.X, at.CURVE + 1):
            d[name] = end
            end += 3 * rows * (1 if name < at.GAIN else MOST_STAGES)
        d[at.MATRICES] = end
        self.s = np.zeros(end + area * (2 + MOST_STAGES))
        self.s[at.NUMBERS : at.NUMBERS + len(radau_tables.TABLES)] = radau_tables.TABLES
        for stages in radau_tables.STAGES:
            d[at.TABLE + (stages - 3) // 2] = at.NUMBERS + radau_tables.start(stages)

    def vector(self, name: int) -> Array:
        """A vector of the driver's, (3, N)."""
        first = self.d[name]
        return self.s[first : first + 3 * self.rows].reshape(3, self.rows)

    def curve(self) -> Array:
        """The coefficients of what velocities gain, (21, N)."""
        first = self.d[at.CURVE]
        return self.s[first : first + 3 * MOST_STAGES * self.rows].reshape(3 * MOST_STAGES, self.rows)

    def power(self) -> Array:
        """The coefficients of the work of a step, (7, N)."""
        first = self.d[at.POWER]
        return self.s[first : first + MOST_STAGES * self.rows].reshape(MOST_STAGES, self.rows)

    def load(self, state: FlightState, motion: Any, t: Instant, bodies: Bodies) -> None:
        """Put in what the state keeps of ``t``, where it is covered to."""
        arrays, numbers, order = state.arrays, state.numbers, motion.held.order
        end = arrays["end"]
        x, v = motion.pack({"position": end[:3], "velocity": end[3:6]}, t)
        for name, values in ((at.X, x), (at.V, v), (at.X_STAGE, x), (at.V_STAGE, v)):
            self.vector(name)[...] = values
        for name, first in ((at.X_REST, 6), (at.V_REST, 9)):
            self.vector(name)[:, : self.moving] = end[first : first + 3, order]
        self.curve()[:, : self.moving] = arrays["curve"][:, order]
        self.vector(at.X_BEGIN)[:, : self.moving] = arrays["from"][:, order]
        self.vector(at.STORED)[:, : self.moving] = bodies.arrays["working"][:, state.rows[order]]
        work = self.vector(at.WORK)
        for k, one in enumerate(("work", "work_rest", "gain")):
            work[k, : self.moving] = arrays[one][0, order]
        for one, place in KEPT.items():
            self.s[place] = numbers[one]
        for one, place in COUNTED.items():
            self.d[place] = int(numbers[one])
        self.s[at.TIME : at.TIME + 2] = t


def blocks_of(motion: Any) -> list[Rows]:
    """The rows of a motion that pairs join, ascending: none acts on one in another block. Rows that do not move join nothing."""
    leader = list(range(motion.moving))

    def first(row: int) -> int:
        while leader[row] != row:
            leader[row] = leader[leader[row]]
            row = leader[row]
        return row

    def join(a: int, b: int) -> None:
        a, b = first(a), first(b)
        leader[max(a, b)] = min(a, b)

    for couples in motion.couples:
        left = couples.left.tolist()
        if couples.how == ALL:
            own = [row for row in left if row < motion.moving]
            for row in own[1:]:
                join(own[0], row)
        else:
            for a, b in zip(left, couples.right.tolist(), strict=True):
                if a < motion.moving and b < motion.moving:
                    join(a, b)
    found: dict[int, list[int]] = {}
    for row in range(motion.moving):
        found.setdefault(first(row), []).append(row)
    return [np.array(block, dtype=np.int64) for block in found.values()]
