"""The pairs that a pair law acts on, as arrays of indices: in the order of rank, and never more of them at once than memory bears."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from xpheve.steppers.contract import Array, Rows

if TYPE_CHECKING:
    from xpheve.laws import PairLaw
    from xpheve.objects import PhysicalObject

CHUNK = 32_768  # pairs at once: temporary arrays that a cache holds
KEPT = 1_000_000  # pairs whose indices are kept: 16 MB
CROWDED = 64  # pairs an object from which on those within a cutoff are looked for in cells
FAR = 1e150  # [m] a cutoff beyond it has no finite square, and leaves nothing out
CELLS = 2_000_000  # cells along an axis, so that the number of a cell fits into 63 bits

Mask = NDArray[np.bool_]
Pairs = tuple[Rows, Rows]


class PairSet:
    """The pairs of ``law`` among ``members``, ordered by the rank of the lower object, then of the higher.

    Pairs are found by the lower one: its partners are a range of ``_pool``. Objects that may be paired alike share one range, so
    that the pairs of n objects cost memory for n objects.

    Parameters
    ----------
    law
        Says by ``between``, ``pairs`` or neither which pairs, which of the two is ``a``, and with ``cutoff`` how far it reaches.
    members
        The objects mapped to the law, in rank order, n.
    still
        Members that make no pairs with one another, such as fixed ones, (n,).
    """

    def __init__(self, law: PairLaw, members: Sequence[PhysicalObject], still: Sequence[bool] | Mask) -> None:
        self.law = law
        self.rows: Rows = np.array([obj._row for obj in members], dtype=np.int64)
        """Rows of the members, by rank, (n,)."""
        self._still: Mask = np.asarray(still, dtype=bool)
        self._sides: tuple[Mask, Mask] | None = None
        self._swapped: Mask | None = None
        """Of the listed pairs, whether ``a`` is the higher."""
        if law.pairs is not None:
            self._list(law.pairs, {obj: k for k, obj in enumerate(members)})
        else:
            if law.between is not None:
                these, those = (set(side) for side in law.between)
                self._sides = tuple(  # type: ignore[assignment]
                    np.array([obj in side for obj in members], dtype=bool) for side in (these, those)
                )
            self._share()
        self.count = int((self._end - self._begin).sum())
        """Pairs, near or far."""
        self._whole: Pairs | None = None

    def _list(self, pairs: Sequence[tuple[PhysicalObject, PhysicalObject]], place: dict[PhysicalObject, int]) -> None:
        """Take the pairs as given, sorted."""
        a, b = (np.array([place.get(pair[k], -1) for pair in pairs], dtype=np.int64) for k in (0, 1))
        held = (a >= 0) & (b >= 0)
        held[held] = ~(self._still[a[held]] & self._still[b[held]])
        a, b = a[held], b[held]
        low, high = np.minimum(a, b), np.maximum(a, b)
        order = np.lexsort((high, low))
        self._pool, self._swapped = high[order], (a > b)[order]
        counts = np.bincount(low, minlength=len(self.rows))
        self._end = np.cumsum(counts)
        self._begin = self._end - counts
        self._used = np.bincount(np.concatenate([a, b]), minlength=len(self.rows)) > 0

    def _share(self) -> None:
        """Give each member the range of those that may be its partners, the same to members of one kind."""
        n = len(self.rows)
        every = np.ones(n, dtype=bool)
        first, second = self._sides or (every, every)
        kind = 4 * first + 2 * second + self._still
        self._begin, self._end = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64)
        self._used = np.zeros(n, dtype=bool)
        pool: list[Rows] = []
        size = 0
        for one in np.unique(kind).tolist():
            mine = np.flatnonzero(kind == one)
            may = (second if one & 4 else ~every) | (first if one & 2 else ~every)
            if one & 1:
                may &= ~self._still
            partners = np.flatnonzero(may)
            self._begin[mine] = size + np.searchsorted(partners, mine, side="right")
            size += len(partners)
            self._end[mine] = size
            self._used[mine] = len(partners) - may[mine] > 0
            pool.append(partners)
        self._pool = np.concatenate(pool) if pool else np.zeros(0, dtype=np.int64)

    @property
    def used(self) -> Rows:
        """Rows of the members that are in a pair, near or far, by rank."""
        return self.rows[self._used]

    def kinds(self) -> Rows:
        """Who makes pairs with whom, for `xpheve.kernels.neighbours.build`, of a law without a list of pairs, (n,).

        Bits 0 to 2: still (1), of the second side of ``between`` (2), of the first (4); from bit 3 on, one for each such number that
        pairs can be made with. Of a pair, the lower is ``a`` if it is of the first side and the higher of the second.
        """
        every = np.ones(len(self.rows), dtype=bool)
        first, second = self._sides or (every, every)
        numbers = range(8)
        masks = [
            sum(8 << n for n in numbers if not m & n & 1 and ((m & 4 and n & 2) or (m & 2 and n & 4))) for m in numbers
        ]
        kind = 4 * first + 2 * second + self._still
        found: Rows = (kind + np.array(masks)[kind]).astype(np.int64)
        return found

    def every(self) -> Pairs:
        """Rows of ``a`` and of ``b`` of all pairs, near or far, (count,) each: 16 bytes a pair."""
        if self._whole is None:
            parts = list(self._all_chunks())
            none = np.zeros(0, dtype=np.int64)
            i, j = (np.concatenate([none, *(part[k] for part in parts)]) for k in (0, 1))
            whole = self._oriented(i, j, self._swapped)
            if self.count > KEPT:
                return whole
            self._whole = whole
        return self._whole

    def chunks(self, position: Array) -> Iterator[Pairs]:
        """Rows of ``a`` and of ``b``, some at a time, in order; with a cutoff only of pairs that are closer.

        Parameters
        ----------
        position
            Position [m] by row, (3, all rows of the engine).

        A pair is closer if dx*dx + dy*dy + dz*dz < cutoff*cutoff, summed from the left; a pair with NaN or infinity in it is not.
        """
        reach = self.law.reach()
        if math.isfinite(reach) and reach < FAR and self._swapped is None and self.count > CROWDED * len(self.rows):
            yield from self._near_chunks(position, reach)
        elif self.count <= KEPT:
            a, b = self.every()
            for start in range(0, len(a), CHUNK):
                part = slice(start, start + CHUNK)
                yield self._closer(a[part], b[part], position, reach)
        else:
            start = 0
            for i, j in self._all_chunks():
                swapped = None if self._swapped is None else self._swapped[start : start + len(i)]
                start += len(i)
                yield self._closer(*self._oriented(i, j, swapped), position, reach)

    def _all_chunks(self) -> Iterator[Pairs]:
        """Places of the lower and the higher of all pairs."""
        counts = self._end - self._begin
        for low, high in _blocks(counts):
            mine = counts[low:high]
            yield np.repeat(np.arange(low, high), mine), self._pool[_ranges(self._begin[low:high], mine)]

    def _near_chunks(self, position: Array, reach: float) -> Iterator[Pairs]:
        """The pairs within ``reach`` that are in neighbouring cells; as pairs of rows, in order."""
        x = position[:, self.rows]
        places = np.flatnonzero(np.isfinite(x).all(axis=0))
        cells = np.array([_cells(along[places], reach) for along in x])
        width = int(cells.max(initial=0)) + 3
        number = (cells[0] * width + cells[1]) * width + cells[2]
        order = np.argsort(number, kind="stable")
        placed, sorted_number = places[order], number[order]
        # Cells that follow one another along z do so in number, too: nine ranges hold the 27 neighbours.
        columns = [(dx * width + dy) * width for dx in (-1, 0, 1) for dy in (-1, 0, 1)]
        begin = np.array([np.searchsorted(sorted_number, number + one - 1) for one in columns]).T
        end = np.array([np.searchsorted(sorted_number, number + one + 1, side="right") for one in columns]).T
        counts = end - begin
        totals = counts.sum(axis=1)
        for low, high in _blocks(totals):
            i = np.repeat(places[low:high], totals[low:high])
            j = placed[_ranges(begin[low:high].ravel(), counts[low:high].ravel())]
            later = j > i
            i, j = i[later], j[later]
            near = _within(x, i, j, reach) & self._allowed(i, j)
            i, j = i[near], j[near]
            sort = np.argsort(i * len(self.rows) + j)
            yield self._oriented(i[sort], j[sort], None)

    def _allowed(self, i: Rows, j: Rows) -> Mask:
        """Which pairs of places are pairs of the law, if it has no list."""
        found: Mask = ~(self._still[i] & self._still[j])
        if self._sides is not None:
            first, second = self._sides
            found &= (first[i] & second[j]) | (second[i] & first[j])
        return found

    def _oriented(self, i: Rows, j: Rows, swapped: Mask | None) -> Pairs:
        """The rows of ``a`` and ``b``: what was given first is ``a``, else the lower rank."""
        if swapped is None and self._sides is not None:
            first, second = self._sides
            swapped = ~(first[i] & second[j])
        if swapped is None:
            return self.rows[i], self.rows[j]
        return self.rows[np.where(swapped, j, i)], self.rows[np.where(swapped, i, j)]

    def _closer(self, a: Rows, b: Rows, position: Array, reach: float) -> Pairs:
        if math.isinf(reach):
            return a, b
        near = _within(position, a, b, reach)
        return a[near], b[near]


def add_opposite(total: Array, a: Rows, b: Rows, force: Array) -> None:
    """Add ``force`` on ``a`` of each pair and its opposite on ``b`` to ``total``, pair by pair, to the bits of that loop in scalars.

    Parameters
    ----------
    total
        Forces [N] summed so far, (3, n); written.
    a, b
        Places in ``total``, (pairs,); negative where nothing is to be added.
    force
        Forces [N], (3, pairs).
    """
    both = np.empty(2 * len(a), dtype=np.int64)
    both[0::2], both[1::2] = a, b
    inside = both >= 0
    where = both[inside]
    parts = np.empty(2 * len(a))
    for sum_, one in zip(total, force, strict=True):
        parts[0::2], parts[1::2] = one, -one
        np.add.at(sum_, where, parts[inside])  # one after the other, as they stand


def _within(x: Array, i: Rows, j: Rows, reach: float) -> Mask:
    """Whether the distance between columns ``i`` and ``j`` of ``x`` is below ``reach``, as kernels ask it."""
    with np.errstate(all="ignore"):
        dx, dy, dz = x[0][i] - x[0][j], x[1][i] - x[1][j], x[2][i] - x[2][j]
        found: Mask = dx * dx + dy * dy + dz * dz < reach * reach
    return found


def _cells(x: Array, reach: float) -> Rows:
    """For each coordinate the number of its cell, from 1: coordinates closer than ``reach`` differ by 1 at most.

    Gaps wider than a cell are closed up to one, so that there are at most as many cells as coordinates, wherever these lie.
    """
    n = len(x)
    size = reach * (1.0 + 1e-6 + 4e-16 * n * n)  # more than the sums can be wrong
    order = np.argsort(x)
    along = np.zeros(n)
    with np.errstate(over="ignore"):
        np.cumsum(np.minimum(np.diff(x[order]), size) / size, out=along[1:])
    found = np.empty(n, dtype=np.int64)
    found[order] = np.minimum(along, CELLS).astype(np.int64) + 1
    return found


def _blocks(counts: Rows) -> Iterator[tuple[int, int]]:
    """Ranges of ``counts`` whose sums are at most `CHUNK`, or of one."""
    ends = np.cumsum(counts)
    low, done = 0, 0
    while low < len(counts):
        high = max(low + 1, int(np.searchsorted(ends, done + CHUNK, side="right")))
        yield low, high
        low, done = high, int(ends[high - 1])


def _ranges(begin: Rows, counts: Rows) -> Rows:
    """The ranges from ``begin``, ``counts`` long, one after the other."""
    ends = np.cumsum(counts)
    found: Rows = np.arange(int(ends[-1]) if len(ends) else 0) + np.repeat(begin - (ends - counts), counts)
    return found
