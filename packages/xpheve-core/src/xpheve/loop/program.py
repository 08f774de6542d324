"""A loop for the rows of one batch: its text, its numbers, and a run of many steps in one call."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from xpheve.kernels.clock import Instant
from xpheve.kernels.neighbours import room
from xpheve.loop.array_run import array_entry
from xpheve.loop.couples import ALL, LISTED, NEAR, scratch
from xpheve.loop.fields import PARAMETERS
from xpheve.loop.terms import CHANGING, LANES, Term
from xpheve.loop.text import FIRST_COUPLES, FREE, PER_COUPLES, LoopText, PairKind
from xpheve.trace.graph import walk

Array = NDArray[np.float64]
Places = NDArray[np.int64]

INTERPRETED, NUMPY, COMPILED = "interpreted", "numpy", "compiled"

MODEST = 1e70
"""Numbers below it, and steps, cannot make a flight leave the range of floats, nor its work."""


class Segment(NamedTuple):
    """Rows ``first`` to ``last`` of a program that obey the same laws, in order of rank, as ``terms`` say."""

    laws: tuple[Any, ...]
    terms: tuple[Term, ...]
    first: int
    last: int


class Couples(NamedTuple):
    """The pairs of one pair law class: rows ``left`` and ``right`` of the program, or all or the near ones of the rows ``left``.

    ``laws`` are the instances, ``which`` says which one each pair belongs to; None if there is one. ``near`` finds the near ones for the NumPy
    tier: it takes places (3, rows) and gives rows left and right, some at a time.
    """

    term: Term
    laws: tuple[Any, ...]
    how: str
    left: Places
    right: Places
    which: Places | None
    near: Callable[[Array], Iterator[tuple[Places, Places]]] | None = None


class Program:
    """What runs the rows of a batch: ``moving`` rows in segments, and after them rows that only act (``sources``).

    Parameters
    ----------
    segments, couples
        Laws and who obeys them.
    moving, sources
        How many rows move, and how many only act on them.
    stored_work
        Whether stored forces without potential act on a row.
    turning
        How rows turn: "free", "turn" where a law asks for it, or "all turn"; see `xpheve.loop.text`.
    """

    def __init__(
        self,
        segments: Sequence[Segment],
        couples: Sequence[Couples],
        moving: int,
        sources: int,
        stored_work: bool,
        turning: str = FREE,
    ) -> None:
        self.segments, self.couples = tuple(segments), tuple(couples)
        self.moving, self.sources, self._stored_work = moving, sources, stored_work
        kinds = list(dict.fromkeys(one.terms for one in segments))
        pair_kinds = [PairKind(one.term, one.how, one.which is None) for one in couples]
        self.loop = LoopText(kinds, pair_kinds, stored_work, turning)
        self._kinds = [kinds.index(one.terms) for one in segments]
        self._lay_tiles()
        self.neighbours = {k: Neighbours(len(one.left)) for k, one in enumerate(self.couples) if one.how == NEAR}
        self._table: Array | None = None
        self._entries: dict[str, Callable[..., int]] = {}
        self._flat = self.tiles * self.loop.slots.width * LANES
        self._tiles_buffer = np.zeros(self._flat + scratch(one.term for one in couples))

    # Numbers

    @property
    def rows(self) -> int:
        """All rows: those that move, and those that only act."""
        return self.moving + self.sources

    @property
    def work(self) -> int:
        """About how many operations on rows and pairs a step has; what the choice of a tier goes by."""
        pairs = sum(len(c.left) * (len(c.left) - 1) // 2 if c.how == ALL else len(c.left) for c in self.couples)
        return self.moving + pairs

    @property
    def terms(self) -> list[Term]:
        """The law classes that act, each once."""
        return list(dict.fromkeys([*(t for s in self.segments for t in s.terms), *(c.term for c in self.couples)]))

    @property
    def files(self) -> dict[str, str]:
        """Kernel files written by hand that the text calls: name and path."""
        found = [n.value[0] for term in self.terms for n in walk(term.trace.motion) if n.op == "kernel"]
        return {name: path for name, path, _ in found}

    def _lay_tiles(self) -> None:
        """Where each row lies: a segment begins with a tile of its own."""
        parts = [(one.first, one.last) for one in self.segments]
        if self.sources:
            parts.append((self.moving, self.rows))
        self.parts: list[tuple[int, int, int, int]] = []
        """First and last row, first and last tile of each segment, the sources last."""
        self.addresses: Places = np.zeros(self.rows, dtype=np.int64)
        tile = 0
        for first, last in parts:
            count = -(-(last - first) // LANES)
            self.parts.append((first, last, tile, tile + count))
            within = np.arange(last - first)
            self.addresses[first:last] = (tile + within // LANES) * self.loop.slots.width * LANES + within % LANES
            tile += count
        self.tiles = tile

    def forget_parameters(self) -> None:
        """A parameter has another value, or a law was switched; a list of neighbours may have been made for another cutoff."""
        self._table = None
        for neighbours in self.neighbours.values():
            neighbours.forget()

    def table(self, up: Sequence[float]) -> Array:
        """Length of a step, origin, up, then the parameters of each instance: segments first, then pairs."""
        if self._table is None:
            numbers = [0.0] * PARAMETERS
            numbers[3:6] = [float(one) for one in up]
            self._places: list[list[int]] = []
            for segment in self.segments:
                self._places.append([len(numbers)])
                for law, term in zip(segment.laws, segment.terms, strict=True):
                    numbers += values_of(law, term)
            for couples in self.couples:
                places = []
                for law in couples.laws:
                    places.append(len(numbers))
                    numbers += values_of(law, couples.term)
                self._places.append(places)
            self._table = np.array(numbers)
        return self._table

    # Text

    def text(self, arrays: bool) -> str:
        """The text of the loop."""
        return self.loop.text(arrays)

    def entry(self, tier: str) -> Callable[..., int]:
        """What runs the loop in ``tier``."""
        found = self._entries.get(tier)
        if found is None:
            found = self._entries[tier] = self._make(tier)
        return found

    def made(self, tier: str) -> Any:
        """What runs the loop in ``tier`` if it was made already; None else."""
        return self._entries.get(tier)

    def _make(self, tier: str) -> Callable[..., int]:
        files = self.files
        if tier == NUMPY and not files:
            return array_entry(self.text(arrays=True))
        from xpheve.compile import assemble, compiled, interpreted

        if tier == NUMPY:
            wanted = ", ".join(f"{name}__force" for name in files)
            return array_entry(self.text(arrays=True), assemble(f"def entry(f, n):\n    return ({wanted},)\n", files))
        text = assemble(self.text(arrays=False), files)
        if tier == INTERPRETED:
            return interpreted(text)
        return compiled(text, what=" + ".join(dict.fromkeys(term.trace.label for term in self.terms)))

    # Running

    def run(
        self, tier: str, numbers: Array, steps: int, h: float, origin: Instant, number: int, up: Sequence[float]
    ) -> None:
        """Make ``steps`` steps of ``h`` [s] from step ``number`` of the grid on; ``numbers`` (slots, rows) are changed in place.

        The last step is left under way: place and velocity are those of its beginning, and ``acceleration`` acts over it.
        """
        table = self.table(up)
        table[0], table[1], table[2] = h, origin[0], origin[1]
        entry = self.entry(tier)
        if tier == NUMPY:
            floats, ints = self._buffers(numbers, table, steps, number, np.arange(self.rows), rows=True)
            entry(floats, ints)
            return
        tiled = self._to_tiles(numbers)
        while True:
            floats, ints = self._buffers(tiled, table, steps, number, self.addresses, rows=False)
            stopped = entry(floats, ints)
            if not stopped:
                break
            number, steps = number + stopped - 1, steps - stopped + 1
            self._make_room(ints[0])
        self._from_tiles(tiled, numbers)

    def strays(self, numbers: Array, h: float) -> NDArray[np.bool_]:
        """Which moving rows have left the range of floats after a run, or will by the end of the step of ``h`` [s] that is under way."""
        slots = self.loop.slots
        changed = numbers[: slots.changing, : self.moving]
        if self.moving and max(changed.max(), -changed.min()) < MODEST and h < MODEST and not self._stored_work:
            return np.zeros(self.moving, dtype=bool)
        part = {name: changed[slots.first[name] : slots.first[name] + width] for name, width in CHANGING.items()}
        with np.errstate(all="ignore"):
            way = h * (part["velocity"] + 0.5 * h * part["acceleration"])
            force = part["working"]
            if self._stored_work:
                first = slots.first["stored_working"]
                force = force + numbers[first : first + 3, : self.moving]
            ends = [part["position"] + way, part["velocity"] + h * part["acceleration"]]
            ends.append(part["work"] + (force * way).sum(axis=0))
        strays: NDArray[np.bool_] = ~np.isfinite(np.concatenate([changed, *ends])).all(axis=0)
        return strays

    def _make_room(self, counts: Places) -> None:
        """Room in the lists of neighbours for what was wanted, and some more."""
        for k, neighbours in self.neighbours.items():
            wanted = int(counts[FIRST_COUPLES + PER_COUPLES * k + 2])
            if wanted > neighbours.capacity:
                neighbours.grow(wanted + wanted // 4)

    def _buffers(
        self, state: Array, table: Array, steps: int, number: int, places: Places, rows: bool
    ) -> tuple[list[Array], list[Any]]:
        """What the entry is called with: numbers, and whole numbers."""
        segments = []
        for k, (first, last, tile, end) in enumerate(self.parts[: len(self.segments)]):
            over = (last - first) % LANES or LANES
            if not rows:
                segments.append([self._kinds[k], tile, end, over, self._places[k][0]])
                continue
            most = last - first if self.couples else ARRAY_ROWS
            for begin in range(first, last, most):
                segments.append([self._kinds[k], begin, min(begin + most, last), over, self._places[k][0]])
        flat = np.array(segments, dtype=np.int64).ravel() if segments else np.zeros(5, dtype=np.int64)
        counts = [len(segments), steps, number, self.rows if rows else self.tiles]
        tables = self.loop.tables if len(self.loop.tables) else _NO_TABLES
        floats: list[Array] = [state, table, tables]
        lists: list[Any] = []
        for k, (couples, at) in enumerate(zip(self.couples, self._places[len(self.segments) :], strict=True)):
            neighbours = None if rows else self.neighbours.get(k)
            counts += [len(couples.left), at[0], neighbours.capacity if neighbours else 0]
            floats.append(neighbours.reference if neighbours else _NO_TABLES)
            lists += self._lists(couples, at, places, neighbours, rows)
        return floats, [np.array(counts, dtype=np.int64), flat, *lists]

    def _lists(self, couples: Couples, at: list[int], places: Places, neighbours: Any, rows: bool) -> list[Any]:
        """The four lists of a set of pairs."""
        left = places[couples.left]
        if couples.how == LISTED:
            which = _NOTHING if couples.which is None else np.array(at, dtype=np.int64)[couples.which]
            return [left, places[couples.right], which, _NOTHING]
        if couples.how == NEAR:
            if rows:
                return [couples.near, _NOTHING, _NOTHING, _NOTHING]
            return [left, neighbours.first, neighbours.partners, neighbours.work]
        return [left, _NOTHING, _NOTHING, _NOTHING]

    def _to_tiles(self, numbers: Array) -> Array:
        """``numbers`` (slots, rows) in tiles; lanes that no row has repeat the last row, so that they hold nothing odd."""
        width = self.loop.slots.width
        tiled = self._tiles_buffer[: self._flat].reshape(self.tiles, width, LANES)
        for first, last, tile, end in self.parts:
            count = end - tile
            padded = np.empty((width, count * LANES))
            padded[:, : last - first] = numbers[:, first:last]
            padded[:, last - first :] = numbers[:, last - 1 : last]
            tiled[tile:end] = padded.reshape(width, count, LANES).transpose(1, 0, 2)
        return self._tiles_buffer

    def _from_tiles(self, buffer: Array, numbers: Array) -> None:
        """What a run changes, back into ``numbers``."""
        changing = self.loop.slots.changing
        tiled = buffer[: self._flat].reshape(self.tiles, self.loop.slots.width, LANES)
        for (first, last, tile, end), _ in zip(self.parts, self.segments, strict=False):
            part = tiled[tile:end, :changing].transpose(1, 0, 2).reshape(changing, (end - tile) * LANES)
            numbers[:changing, first:last] = part[:, : last - first]


_NO_TABLES = np.zeros(1)
_NOTHING = np.zeros(1, dtype=np.int64)
ARRAY_ROWS = 4096
"""Rows that NumPy carries through all steps of a call before the next ones: so many numbers stay in a cache."""
SKIN = 0.12
"""How much farther than the cutoff lists of neighbours reach, of the cutoff: they serve until a body has gone half of that."""


class Neighbours:
    """The list of neighbours of one set of pairs: buffers, kept from call to call."""

    def __init__(self, count: int) -> None:
        self.reference = np.full(6 * count, np.nan)
        self.first = np.zeros(count + 1, dtype=np.int64)
        self.work = np.zeros(room(count), dtype=np.int64)
        self.capacity = 0
        self.grow(16 * count + 16)

    def grow(self, capacity: int) -> None:
        """Make room for ``capacity`` pairs; the list has to be made again."""
        self.capacity = capacity
        self.partners = np.zeros(2 * capacity + 1, dtype=np.int64)
        self.forget()

    def forget(self) -> None:
        """The list has to be made again."""
        self.reference[:] = np.nan


def values_of(law: Any, term: Term) -> list[float]:
    """The numbers of ``law`` in the parameter table."""
    numbers = []
    for name, component in term.trace.parameters:
        value = getattr(law, name)
        numbers.append(float(value[component] if isinstance(value, tuple) else value))
    numbers.append(1.0 if law.enabled else 0.0)
    if term.near:
        reach = law.reach()
        numbers += [reach * reach, reach, reach * (1.0 + SKIN)]
    return numbers


__all__ = ["ALL", "COMPILED", "INTERPRETED", "LISTED", "NEAR", "NUMPY", "Couples", "Program", "Segment"]
