"""`ImpactLoop`: the event loop with its buffers, interpreted or compiled to the same bits."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from xpheve.compile import assemble, compiled
from xpheve.errors import ContactError
from xpheve.kernels import response
from xpheve.kernels.clock import NEVER, Instant
from xpheve_laws_collision.impact import rows
from xpheve_laws_collision.impact.declared import DECLARED
from xpheve_laws_collision.impact.layout import Grid, grid_for
from xpheve_laws_collision.impact.loop import LOOK, NEAR, RUN
from xpheve_laws_collision.impact.shelves import bounds, is_bounded, shelves_for, with_reach

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

ROOM = os.path.dirname(os.path.abspath(__file__))
TIMES = os.path.join(os.path.dirname(ROOM), "impact_time")
FILES = {
    **{
        name: os.path.join(ROOM, f"{name}.py")
        for name in (
            "cells", "declared", "exchange", "limits", "loop", "meetings", "predict", "rows", "since", "solids", "strike",
            "tournament"
        )
    },
    **{name: os.path.join(TIMES, f"{name}.py") for name in ("rounded_box", "sphere_plane", "sphere_sphere")},
}  # fmt: skip
ENTRY = "def entry(f, n):\n    return loop__entry(f, n)\n"
RESPOND = "def entry(f, n):\n    return respond(f, n)\n"
LINKED = f"def respond(f, n):\n    return machine__linked(n[{rows.COUNTS}][{rows.ADDRESS}], f, n)\n\n"
SOLIDS = {
    True: "def solid_time(shape, c, x, v, pull, radius):\n    return solids__solid_time(shape, c, x, v, pull, radius)\n\n"
    "def solid_gap(shape, c, x, v, pull, radius):\n    return solids__solid_gap(shape, c, x, v, pull, radius)\n\n",
    False: "def solid_time(shape, c, x, v, pull, radius):\n    return (math.inf, 0)\n\n"
    "def solid_gap(shape, c, x, v, pull, radius):\n    return (math.inf, (0.0, 0.0, 1.0), 0.0)\n\n",
}
"""Boxes and capsules, where there are any: the text with them takes longer to compile."""

FEW = 12
"""Up to so many places all pairs are looked at, without cells."""
FEW_SHAPES = 48
"""Up to so many bounded shapes few places look at all of them."""
WIDEST = 1e60
"""Cells are made at most so many times as wide as the places need; if that is too narrow there are none."""
SPARSE, WIDE = 64, 4.0
"""Places from which on, and widths of cells in diameters, an instant is looked for before which nothing meets."""
KINDS = ("limit", "law", "touch", "rest", "collapse", "streak", "busy", "failed", "watched", "pause")
PAIRWISE, BULLET = 4_000, 100.0
"""So many places may be looked at pair by pair; so many times as fast as most is what should not hold them up."""
LINE = 8
"""Numbers in a line of the processor's cache."""
BREATH = {True: 1_000_000, False: 2_000}
"""Events of one call, compiled and interpreted, after which Python may be interrupted."""


class Answers(Protocol):
    """The laws' answers as text: see `xpheve.kernels.response` for the layout of a contact."""

    text: str
    columns: Any
    files: Any

    def parameters(self) -> tuple[Any, Sequence[Any]]:
        """The table of parameters, and each law's branch (negative if it has none) and where its parameters begin."""
        ...


class Outcome(NamedTuple):
    """Why the loop stopped.

    Attributes
    ----------
    kind
        ``"limit"``: no event is left before the limit. ``"watched"``: the impact has happened. Of all others nothing has happened:
        ``"law"`` that only Python can ask; ``"touch"``, another contact at the same instant; ``"rest"``; ``"collapse"``, bounces too short to
        tell apart; ``"streak"``, losing impacts in too close succession; ``"busy"``, too many at one instant; ``"failed"``, no finite answer.
    instant
        When; of ``"limit"`` the limit.
    place, partner, is_scenery
        Which pair: a place, and another or a row of the scenery; -1 for ``"limit"``.
    """

    kind: str
    instant: Instant
    place: int = -1
    partner: int = -1
    is_scenery: bool = False


class Changed(NamedTuple):
    """What has another flight since last asked.

    Attributes
    ----------
    places
        Ascending (k,), with position [m] and velocity [m/s] (3, k) at their clocks (2, k).
    flights
        How many new flights each of ``places`` had.
    turned
        Those whose spin is another, (t,), with spin [rad/s] (3, t), and orientation (4, t) at ``turn_clock`` (2, t).
    """

    places: Ints
    position: Floats
    velocity: Floats
    clock: Floats
    turned: Ints
    spin: Floats
    orientation: Floats
    turn_clock: Floats
    flights: Ints


class Counts(NamedTuple):
    """What was done since last asked: numbers, and for each law how often it was asked and its work [J]."""

    impacts: int
    predictions: int
    crossings: int
    evaluations: list[int]
    work: list[float]


@lru_cache(maxsize=2)
def _compiled_text(solids: bool) -> str:
    return assemble(LINKED + SOLIDS[solids] + ENTRY, FILES, declared=DECLARED)


class ImpactLoop:
    """Spheres and points on ballistic flights among fixed shapes, from impact to impact.

    Parameters
    ----------
    count
        How many places for spheres there are; they are empty until `load`.
    scenery
        Fixed shapes (m, 24): kind, centre or normal, rotation matrix, sizes; see `xpheve_laws_collision.impact.rows`.
    scenery_masks
        Bits of the laws each obeys (m,).
    responses
        The laws' answers.
    laws_of_bit
        For each bit of a mask the number of the law that answers; -1 for one that only Python can ask.
    scenery_heard
        Bits of the laws that listen to each (m,): where both sides of a pair have one, Python answers.
    scenery_columns
        Columns of the fixed shapes, as those of places: by name, or (columns, m).
    scenery_bodies
        Position [m], orientation, mass [kg] and moments of inertia [kg m^2] of each (m, 11), as laws read them; by default those of a
        shape without mass that stands at its centre.
    periodic
        Lengths [m] of a periodic box from 0 on, infinite along open axes; None for none.
    compiled
        Whether the loop is compiled. Both ways give the same bits.
    cells
        Whether cells are used; None for what suits the number of places. No bit depends on it.

    Raises
    ------
    ContactError
        A periodic box that is too narrow, or has scenery that is no plane along it.
    """

    def __init__(
        self,
        count: int,
        scenery: Any,
        scenery_masks: Any,
        responses: Answers,
        laws_of_bit: Sequence[int],
        *,
        scenery_heard: Any = None,
        scenery_columns: Any = None,
        scenery_bodies: Any = None,
        periodic: Sequence[float] | None = None,
        compiled: bool,
        cells: bool | None = None,
    ) -> None:
        self.count, self.responses, self.compiled = count, responses, compiled
        self.columns = tuple(responses.columns)
        self._solids = False
        self.periodic = None if periodic is None else tuple(float(one) for one in periodic)
        self._cells = cells
        self.celled = False
        self.grid: Grid | None = None
        self._asked_cells: float = 0.0
        leaves = 1 << max(0, count - 1).bit_length()
        self.f: list[Floats] = [np.zeros(1) for _ in range(11)]
        self.n: list[Ints] = [np.zeros(1, dtype=np.int64) for _ in range(11)]
        f, n = self.f, self.n
        f[rows.CONTACT] = np.zeros(response.SCRATCH)
        f[rows.STATE] = _lines(rows.STATES * max(1, count), np.float64)
        f[rows.EVENT] = _lines(rows.EVENTS * max(1, count), np.float64)
        f[rows.COLD] = _lines(rows.COLDS * max(1, count), np.float64)
        f[rows.SPACE] = np.zeros(rows.SPACES)
        f[rows.KEYS] = np.full(2 * leaves, math.inf)
        f[rows.KEYS][1::2] = 0.0
        f[rows.PAIR] = np.zeros(2 * rows.STATES)
        n[rows.LAW] = np.zeros(4, dtype=np.int64)
        n[rows.PLACE] = _lines(rows.PLACES * max(1, count), np.int64)
        n[rows.LINK] = _lines(rows.LINKS * max(1, count), np.int64)
        n[rows.COUNTS] = np.zeros(rows.COUNTED, dtype=np.int64)
        n[rows.TREE] = _nobody_first(leaves)
        n[rows.NEARBY] = np.zeros(rows.NEARS * (rows.LAST_NEARBY + 1), dtype=np.int64)
        n[rows.HEADS] = np.full(1, -1, dtype=np.int64)
        self._state = f[rows.STATE].reshape(-1, rows.STATES)
        self._event = f[rows.EVENT].reshape(-1, rows.EVENTS)
        self._cold = f[rows.COLD].reshape(-1, rows.COLDS)
        self._place = n[rows.PLACE].reshape(-1, rows.PLACES)
        self._link = n[rows.LINK].reshape(-1, rows.LINKS)
        self._counts, self._space = n[rows.COUNTS], f[rows.SPACE]
        for at in (rows.MEETS, rows.HITS, rows.LEAVES):
            self._event[:, at] = math.inf
        self._event[:, rows.LAST] = -math.inf
        self._place[:, [rows.CELL, rows.SKIP, rows.PARTNER, rows.WALL]] = -1
        self._place[:, rows.RANK] = np.arange(max(1, count))
        counts = self._counts
        counts[rows.COUNT], counts[rows.LEAVES_OF_TREE] = count, leaves
        counts[rows.OWN_COLUMNS] = len(responses.columns)
        counts[rows.MOST_AT_ONCE] = max(1000, 100 * count)
        self._space[rows.BUSY_AT], self._space[rows.SINCE] = math.nan, -math.inf
        self._now: Instant = (-math.inf, 0.0)
        self._quiet: Instant = (-math.inf, 0.0)
        """Before this nothing meets, whatever cells are left."""
        self._laid_again, self._coarser = False, 1.0
        """Whether cells were laid out anew because too many were left; how much wider they are than the places need."""
        self._restless = False
        """No such instant was found for the places as they are."""
        self._linked: Any = None
        self._kernel: Any = None
        self.set_laws(laws_of_bit)
        self.set_scenery(scenery, scenery_masks, scenery_columns, scenery_heard, scenery_bodies)
        if self.periodic is not None:
            self._begin_periodic(self.periodic)

    # What is there

    def _begin_periodic(self, lengths: tuple[float, ...]) -> None:
        for c, length in enumerate(lengths):
            if not length > 0.0:
                raise ContactError(f"periodic[{c}] = {length} m: give a length above 0, or infinity for an open axis")
            closed = length < math.inf
            self._counts[rows.PERIODIC + c] = closed
            self._space[rows.BOX + c] = length if closed else 0.0
        closed_axes = np.isfinite(np.array(lengths))
        shapes = self.f[rows.SCENERY][: rows.SCENERIES * int(self._counts[rows.SCENES])].reshape(-1, rows.SCENERIES)
        for row, shape in enumerate(shapes):
            if int(shape[rows.KIND]) != rows.PLANE or shape[rows.CENTRE : rows.CENTRE + 3][closed_axes].any():
                raise ContactError(
                    f"fixed shape {row} stands in a periodic box {lengths} m: only planes along its periodic axes can be there so far"
                )

    def set_laws(self, laws_of_bit: Sequence[int]) -> None:
        """Take over the laws of the bits, and the laws' parameters as they are now."""
        table, each = self.responses.parameters()
        self.f[1] = np.ascontiguousarray(np.append(np.asarray(table, dtype=np.float64), 0.0))
        laws = np.full(rows.BITS + rows.LAW_ROWS * max(1, len(each)), -1, dtype=np.int64)
        laws[: len(laws_of_bit)] = laws_of_bit
        counts_before: Any = (
            self.n[rows.LAWS][rows.BITS :].reshape(-1, rows.LAW_ROWS)[:, rows.ASKED] if self._kernel else []
        )
        for law, one in enumerate(each):
            at = rows.BITS + rows.LAW_ROWS * law
            branch, offset = (-1, 0) if one is None else one
            laws[at : at + rows.LAW_ROWS] = branch, offset, 0, 0
            if law < len(counts_before):
                laws[at + rows.ASKED] = counts_before[law]
        self.n[rows.LAWS] = laws
        if len(self.f[rows.WORK]) != 2 * max(1, len(each)):
            self.f[rows.WORK] = np.zeros(2 * max(1, len(each)))
        self.laws = len(each)

    def set_scenery(self, scenery: Any, masks: Any, columns: Any = None, heard: Any = None, bodies: Any = None) -> None:
        """Other fixed shapes: all places are predicted anew."""
        shapes = np.asarray(scenery, dtype=np.float64).reshape(-1, rows.SCENERIES)
        shapes = with_reach(shapes)
        self.f[rows.SCENERY] = np.append(shapes.ravel(), 0.0)
        both = np.zeros((len(shapes) + 1, 2), dtype=np.int64)
        both[: len(shapes), 0] = np.asarray(masks, dtype=np.int64).ravel()
        both[: len(shapes), 1] = 0 if heard is None else heard
        self.n[rows.MASKS] = both.ravel()
        own = np.full((len(shapes) + 1, rows.FIXED), np.nan)
        own[:-1, : rows.ITS] = 0.0
        own[:-1, rows.FACES], own[:-1, rows.WEIGHS] = 1.0, math.inf
        of_planes = shapes[:, rows.KIND] == rows.PLANE
        centres = shapes[:, rows.CENTRE : rows.CENTRE + 3]
        own[:-1, :3] = np.where(of_planes[:, np.newaxis], 0.0, centres)
        if bodies is not None:
            own[:-1, :11] = np.asarray(bodies, dtype=np.float64).reshape(len(shapes), 11)
        if columns is not None:
            own[: len(shapes), rows.ITS : rows.ITS + len(self.columns)] = self._in_order(columns, len(shapes))
        solids = bool((shapes[:, rows.KIND] >= rows.BOX).any())
        if solids != self._solids:
            self._solids, self._kernel = solids, None
        self.f[rows.COLUMNS] = own.ravel()
        self._counts[rows.SCENES] = len(shapes)
        self._bounded = is_bounded(shapes)
        self._choose_cells(int(self._bounded.sum()))
        places = max(1, self.count)
        self.n[rows.LISTS] = np.zeros(3 * places + len(shapes), dtype=np.int64)
        self._counts[rows.DIRTIES] = 0
        self._place[:, rows.DIRTY] = 0
        self._mark(np.flatnonzero(self._place[: self.count, rows.PRESENT]))
        self._counts[rows.CHANGES] = 0
        self._list_changes(np.flatnonzero(self._place[: self.count, rows.CHANGED]))

    def _choose_cells(self, shapes: int) -> None:
        """Whether there are cells; the lists of fixed shapes are made with them."""
        wanted = self.count > FEW or shapes > FEW_SHAPES
        self.celled = self.periodic is not None or (wanted if self._cells is None else self._cells)
        self._counts[rows.CELLED], self.grid = self.celled, None
        self._counts[rows.ENDLESS], self.n[rows.SHELVES] = shelves_for(self._shapes, None)

    @property
    def _shapes(self) -> Floats:
        found: Floats = self.f[rows.SCENERY][:-1].reshape(-1, rows.SCENERIES)
        return found

    @property
    def since(self) -> Instant:
        """From when on scenery and laws are as they are: what they would have done to older flights before is none."""
        return float(self._space[rows.SINCE]), float(self._space[rows.SINCE + 1])

    @since.setter
    def since(self, instant: Instant) -> None:
        if self.since != instant:
            self._space[rows.SINCE : rows.SINCE + 2] = instant
            self._now = max(self._now, instant)
            self._mark(np.flatnonzero(self._place[: self.count, rows.PRESENT]))

    def _in_order(self, columns: Any, count: int) -> Floats:
        """Columns by name, or (columns, count), as (count, columns)."""
        if isinstance(columns, Mapping):
            columns = [columns[name] for name in self.columns]
        found: Floats = np.asarray(columns, dtype=np.float64).reshape(len(self.columns), count).T
        return found

    def _list_changes(self, places: Ints) -> None:
        self.n[rows.LISTS][self.count : self.count + len(places)] = places
        self._counts[rows.CHANGES] = len(places)

    def _mark(self, places: Ints) -> None:
        """Have ``places`` predicted when the loop runs next."""
        self._quiet, self._restless = (-math.inf, 0.0), False
        fresh = places[self._place[places, rows.DIRTY] == 0]
        if len(fresh):
            first = int(self._counts[rows.DIRTIES])
            self.n[rows.LISTS][first : first + len(fresh)] = fresh
            self._counts[rows.DIRTIES] = first + len(fresh)
            self._place[fresh, rows.DIRTY] = 1

    def load(
        self,
        places: Any,
        *,
        position: Any,
        velocity: Any,
        acceleration: Any,
        clock: Any,
        spin: Any,
        radius: Any,
        mass: Any,
        inertia: Any,
        mask: Any,
        heard: Any,
        rank: Any,
        columns: Any,
        orientation: Any = None,
        turn_clock: Any = None,
        streak: Any = None,
    ) -> None:
        """Put flights into ``places`` (k,): vectors (3, k), clocks (2, k), all else (k,); columns by name, or (columns, k).

        ``inertia`` may be (k,) or (3, k); ``orientation`` (4, k) is that at ``turn_clock`` (2, k), by default upright at ``clock``.
        A mask of 0 empties a place. ``streak`` (4, k) is as `streaks` has it; by default that of the place stays.
        """
        at = np.asarray(places, dtype=np.int64).reshape(-1)
        state, cold, place = self._state, self._cold, self._place
        state[at, rows.X : rows.X + 3] = np.asarray(position, dtype=np.float64).T
        state[at, rows.V : rows.V + 3] = np.asarray(velocity, dtype=np.float64).T
        state[at, rows.PULL : rows.PULL + 3] = np.asarray(acceleration, dtype=np.float64).T
        times = np.asarray(clock, dtype=np.float64)
        state[at, rows.TIME : rows.TIME + 2] = times.T
        state[at, rows.RADIUS] = radius
        state[at, rows.INVERSE] = 1.0 / np.asarray(mass, dtype=np.float64)
        state[at, rows.WRAPS : rows.WRAPS + 3] = 0.0
        cold[at, rows.SPIN : rows.SPIN + 3] = np.asarray(spin, dtype=np.float64).T
        cold[at, rows.MASS] = mass
        moments = np.asarray(inertia, dtype=np.float64)
        cold[at, rows.INERTIA : rows.INERTIA + 3] = moments.T if moments.ndim == 2 else moments[..., np.newaxis]
        cold[at, rows.TURNING : rows.TURNING + 4] = (
            (1.0, 0.0, 0.0, 0.0) if orientation is None else np.asarray(orientation, dtype=np.float64).T
        )
        cold[at, rows.TURN_TIME : rows.TURN_TIME + 2] = times.T if turn_clock is None else np.asarray(turn_clock).T
        if self.columns:
            cold[at, rows.OWN : rows.OWN + len(self.columns)] = self._in_order(columns, len(at))
        if streak is not None:
            found = np.asarray(streak, dtype=np.float64)
            place[at, rows.STREAK], place[at, rows.STREAK_WITH] = found[0], found[3]
            self._event[at, rows.LAST : rows.LAST + 2] = found[1:3].T
        place[at, rows.QUIET] = 0
        self._link[at, rows.MASK], place[at, rows.HEARD], place[at, rows.RANK] = mask, heard, rank
        place[at, rows.PRESENT] = self._link[at, rows.MASK] != 0
        if len(at):
            latest = max((float(high), float(low)) for high, low in times.T) if len(at) < 64 else _latest(times)
            self._now = max(self._now, latest)
        if self.periodic is not None:
            self._wrap(at)
        self._mark(at)
        if self.grid is not None and len(at):
            self.grid = self.grid if 2.0 * float(np.max(state[at, rows.RADIUS])) <= self.grid.diameter else None

    def _wrap(self, at: Ints) -> None:
        """Bring positions into the periodic box."""
        assert self.periodic is not None
        for c, length in enumerate(self.periodic):
            if length < math.inf:
                x = self._state[at, rows.X + c]
                x = x - np.floor(x / length) * length
                self._state[at, rows.X + c] = np.where(x < length, x, np.nextafter(length, 0.0))

    def set_skip(self, place: int, scenery_row: int) -> None:
        """Do not look at a fixed shape, on which the place rests; -1 for none."""
        self._place[place, rows.SKIP] = scenery_row
        self._mark(np.array([place]))

    def quiet(self, place: int) -> None:
        """Report no rest of ``place`` until it is loaded again, or has had an impact: nothing comes of it."""
        self._place[place, rows.QUIET] = 1
        self._mark(np.array([place]))

    def streaks(self, places: Any) -> Floats:
        """Losing impacts of ``places`` in close succession (4, k): how many, the instant of the last, the partner (shapes: -1 less their row)."""
        at = np.asarray(places, dtype=np.int64)
        last = self._event[at, rows.LAST : rows.LAST + 2]
        return np.stack([self._place[at, rows.STREAK], last[:, 0], last[:, 1], self._place[at, rows.STREAK_WITH]])

    def watch(self, places: Any) -> None:
        """Stop after each impact of these places, and of no others."""
        self._place[:, rows.WATCHED] = 0
        self._place[np.asarray(places, dtype=np.int64), rows.WATCHED] = 1

    # The loop

    def _call(self, job: int) -> int:
        if self._kernel is None:
            self._make()
        self._counts[rows.JOB] = job
        return int(self._kernel(self.f, self.n))

    def _make(self) -> None:
        responses = self.responses
        if not self.compiled:
            from xpheve_laws_collision.impact.as_files import AsFiles

            self._kernel = AsFiles(responses.text, dict(responses.files), self._solids)
            return
        text = assemble(responses.text + "\n\n" + RESPOND, responses.files)
        self._linked = compiled(text, what="answers of collision laws")
        self._counts[rows.ADDRESS] = self._linked.address
        self._kernel = compiled(_compiled_text(self._solids), what="impact loop")

    def _prepare(self) -> None:
        """Have cells that suit the places."""
        if self.celled and self.grid is None and self._place[: self.count, rows.PRESENT].any():
            self._lay_out()

    def _lay_out(self) -> None:
        present = np.flatnonzero(self._place[: self.count, rows.PRESENT])
        shapes = self._shapes
        solid = bounds(shapes[self._bounded]) if self._bounded.any() else None
        self.grid = grid = grid_for(
            self._state[present], self._now, self.periodic, not self._counts[rows.SCENES], solid, self._coarser
        )
        self._counts[rows.ENDLESS], self.n[rows.SHELVES] = shelves_for(shapes, grid)
        counts, space = self._counts, self._space
        counts[rows.GRID : rows.GRID + 3] = grid.sizes
        space[rows.WIDTH : rows.WIDTH + 3] = grid.widths
        space[rows.FRAME_TIME : rows.FRAME_TIME + 2] = grid.time
        space[rows.FRAME : rows.FRAME + 9] = (*grid.origin, *grid.velocity, *grid.acceleration)
        self.n[rows.HEADS] = np.full(math.prod(grid.sizes), -1, dtype=np.int64)
        self._place[:, rows.CELL] = -1
        self._mark(present)
        self._asked_cells = self._crowd()

    def _widen(self) -> None:
        """Lay cells out anew; far wider, if that was done before for the same reason: something is too fast for any that suit the others."""
        if self._laid_again and self._has_bullets():
            self._coarser = max(8.0, self._coarser * self._coarser)
        self._laid_again = True
        if self._coarser <= WIDEST:
            self._lay_out()
        else:
            self._go_without_cells()

    def _has_bullets(self) -> bool:
        """Whether an impact costs more crossings than there are pairs to look at, by few places or among few: no thin gas is meant."""
        if self.crossings <= self.count * max(1, self.impacts):
            return False
        speeds = np.max(np.abs(self._state[: self.count, rows.V : rows.V + 3]), axis=1)
        return self.count <= PAIRWISE or float(np.max(speeds)) > BULLET * float(np.quantile(speeds, 0.9))

    def _go_without_cells(self) -> None:
        """All look at all from now on."""
        self._cells = self.celled = False
        self._counts[rows.CELLED], self.grid = 0, None
        self._counts[rows.ENDLESS], self.n[rows.SHELVES] = shelves_for(self._shapes, None)
        self._place[:, rows.CELL] = -1
        self._event[:, rows.LEAVES : rows.LEAVES + 2] = (math.inf, 0.0)
        self._mark(np.flatnonzero(self._place[: self.count, rows.PRESENT]))

    def _crowd(self) -> float:
        """Cells left, beyond those that impacts pay for."""
        return float(self._counts[rows.CROSSINGS] - 20 * self._counts[rows.IMPACTS])

    def next_time(self) -> Instant:
        """When there is something to do: no impact is before; `NEVER` for nothing."""
        self._prepare()
        self._call(LOOK)
        at = int(self.n[rows.TREE][1])
        high, low = self.f[rows.KEYS][2 * at : 2 * at + 2].tolist()
        return NEVER if high == math.inf else max((high, low), self._look_for_quiet(at, (high, low)))

    def _look_for_quiet(self, first: int, due: Instant) -> Instant:
        """Until when nothing meets, if what is ``due`` at place ``first`` is no more than leaving a cell, and places are few and far between."""
        event, grid = self._event, self.grid
        if self._restless or grid is None or self.periodic is not None or self.count < SPARSE or self._quiet > due:
            return self._quiet
        leaves = (event[first, rows.LEAVES], event[first, rows.LEAVES + 1]) == due
        apart = not self._bounded.any() and min(grid.widths) > WIDE * grid.diameter
        if not (leaves and apart and self._now[0] > -math.inf):
            return self._quiet
        from xpheve_laws_collision.impact.quiet import quiet_span

        state = self._state[: self.count][self._place[: self.count, rows.PRESENT] != 0]
        span = (self._now[0] - state[:, rows.TIME]) + (self._now[1] - state[:, rows.TIME + 1])
        x, v, a = (state[:, at : at + 3] for at in (rows.X, rows.V, rows.PULL))
        s = span[:, np.newaxis]
        found = quiet_span(x + s * (v + 0.5 * s * a), v + s * a, a, state[:, rows.RADIUS])
        self._restless = found == 0.0
        self._quiet = (min(self._now[0] + found, float(event[: self.count, rows.HITS].min())), -math.inf)
        return self._quiet

    def run(self, limit: Instant) -> Outcome:
        """Let all events strictly before ``limit`` happen; its offset may be infinite."""
        self._prepare()
        if limit <= self._quiet and not self._counts[rows.DIRTIES]:
            return self._reached(limit)
        self._space[rows.LIMIT : rows.LIMIT + 2] = limit
        while True:
            self._counts[rows.BUDGET] = BREATH[self.compiled]
            kind = KINDS[self._call(RUN)]
            if kind != "pause":
                break
            if self.celled and self.periodic is None and self._crowd() - self._asked_cells > 50 * self.count:
                self._now = max(self._now, self._latest_event())
                self._widen()
        if kind == "limit":
            return self._reached(limit)
        counts = self._counts
        instant = float(self._space[rows.AT]), float(self._space[rows.AT + 1])
        self._now = max(self._now, instant)
        place, partner = int(counts[rows.WHO]), int(counts[rows.WITH])
        is_scenery = bool(counts[rows.WITH_SCENERY])
        return Outcome(kind, instant, place, partner, is_scenery)

    def _reached(self, limit: Instant) -> Outcome:
        if limit[0] < math.inf:
            self._now = max(self._now, (limit[0], 0.0))
        return Outcome("limit", limit)

    def _latest_event(self) -> Instant:
        at = int(self.n[rows.TREE][1])
        high, low = self.f[rows.KEYS][2 * at : 2 * at + 2].tolist()
        return (high, low) if high < math.inf else self._now

    def near(self, place: int, instant: Instant | None = None) -> list[tuple[int, bool]]:
        """Who touches ``place`` at ``instant``, by default that for which the loop stopped last: (partner, whether it is scenery)."""
        if instant is not None:
            self._space[rows.AT : rows.AT + 2] = instant
        self._counts[rows.GIVEN] = place
        found = self._call(NEAR)
        listed = self.n[rows.LISTS][2 * self.count : 2 * self.count + found].tolist()
        return [(one, False) if one >= 0 else (-1 - one, True) for one in listed]

    def due(self, instant: Instant) -> list[tuple[int, int, bool]]:
        """The pairs whose impacts are due at ``instant``, as (place, partner, whether it is scenery)."""
        keys = self.f[rows.KEYS][: 2 * self.count].reshape(-1, 2)
        found: list[tuple[int, int, bool]] = []
        for at in np.flatnonzero((keys[:, 0] == instant[0]) & (keys[:, 1] == instant[1])).tolist():
            event, place = self._event[at], self._place[at]
            if (event[rows.HITS], event[rows.HITS + 1]) == instant:
                found.append((at, int(place[rows.WALL]), True))
            elif (event[rows.MEETS], event[rows.MEETS + 1]) == instant:
                partner = int(place[rows.PARTNER])
                if self._link[partner, rows.STAMP] == place[rows.SEEN]:
                    found.append((at, partner, False))
        return found

    # What has happened

    def changed(self) -> Changed:
        """Places whose flight has changed since last asked, and their state, each at its own clock."""
        counts = self._counts
        first = self.count
        at = np.sort(self.n[rows.LISTS][first : first + int(counts[rows.CHANGES])])
        counts[rows.CHANGES] = 0
        flown = self._place[at, rows.CHANGED]
        self._place[at, rows.CHANGED] = 0
        turned = at[self._place[at, rows.TURNED] != 0]
        self._place[turned, rows.TURNED] = 0
        state, cold = self._state[at], self._cold[turned]
        return Changed(
            at,
            state[:, rows.X : rows.X + 3].T.copy(),
            state[:, rows.V : rows.V + 3].T.copy(),
            state[:, rows.TIME : rows.TIME + 2].T.copy(),
            turned,
            cold[:, rows.SPIN : rows.SPIN + 3].T.copy(),
            cold[:, rows.TURNING : rows.TURNING + 4].T.copy(),
            cold[:, rows.TURN_TIME : rows.TURN_TIME + 2].T.copy(),
            flown,
        )

    def take_counts(self) -> Counts:
        """What was done since last asked; the counts begin again."""
        found = Counts(self.impacts, self.predictions, self.crossings, self.evaluations, self.work)
        self._asked_cells -= self._crowd()
        self._counts[[rows.IMPACTS, rows.PREDICTIONS, rows.CROSSINGS, rows.STALE]] = 0
        self.n[rows.LAWS][rows.BITS :].reshape(-1, rows.LAW_ROWS)[:, rows.ASKED] = 0
        self.f[rows.WORK][:] = 0.0
        return found

    @property
    def impacts(self) -> int:
        """Impacts so far."""
        return int(self._counts[rows.IMPACTS])

    @property
    def predictions(self) -> int:
        """Pairs looked at so far."""
        return int(self._counts[rows.PREDICTIONS])

    @property
    def crossings(self) -> int:
        """How often a place left its cell."""
        return int(self._counts[rows.CROSSINGS])

    @property
    def stale(self) -> int:
        """How often an event was looked for again, because the partner had changed."""
        return int(self._counts[rows.STALE])

    @property
    def evaluations(self) -> list[int]:
        """How often each law was asked."""
        table = self.n[rows.LAWS][rows.BITS :].reshape(-1, rows.LAW_ROWS)
        return [int(table[law, rows.ASKED]) for law in range(self.laws)]

    @property
    def work(self) -> list[float]:
        """The work [J] of each law."""
        sums = self.f[rows.WORK].tolist()
        return [sums[2 * law] + sums[2 * law + 1] for law in range(self.laws)]


def _lines(size: int, kind: type) -> Any:
    """Zeros that begin where a line of the processor's cache does, so that a row lies in as few of them as it can."""
    room: Any = np.zeros(size + LINE, dtype=kind)
    first = (-room.ctypes.data // room.itemsize) % LINE
    return room[first : first + size]


def _nobody_first(leaves: int) -> Ints:
    """A tournament in which no place has an event."""
    tree = np.arange(-leaves, leaves, dtype=np.int64)
    for node in range(leaves - 1, 0, -1):
        tree[node] = tree[2 * node]
    return tree


def _latest(times: Floats) -> Instant:
    high = float(np.max(times[0]))
    return high, float(np.max(times[1][times[0] == high]))
