"""The whole text of a loop: one function a law set, one a pair law, and an entry that walks them step by step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from xpheve.loop.array_couples import ArrayPairText
from xpheve.loop.array_fields import ArrayFieldText
from xpheve.loop.couples import LISTED, NEAR, PairText
from xpheve.loop.fields import AXES, ORIGIN, FieldText
from xpheve.loop.terms import LANES, Slots, Term, columns_of
from xpheve.trace.table import packed, tables_of

CALL = "s, p, tables, g[5 * k + 1], g[5 * k + 2], g[5 * k + 3], g[5 * k + 4]"


FREE, TURN, ALL_TURN = "free", "turn", "all turn"
"""How rows turn in a loop: on their own, in closed form; in steps where a law asks for it; all in steps."""

REFERENCES = 3
"""The first of the buffers with places at which lists of neighbours were made."""
PER_COUPLES, FIRST_COUPLES = 3, 4
"""Counts of each set of pairs: how many pairs (or rows), where its parameters are, room in the list of neighbours."""
LISTS_PER_COUPLES = 4


class PairKind(NamedTuple):
    """A pair law class in a loop: which pairs, and whether all have one instance's parameters."""

    term: Term
    how: str
    shared: bool


class LoopText:
    """The text for rows of ``kinds`` (law sets) and pairs of ``pair_kinds``, as tiles, or for NumPy with ``arrays``.

    The buffers of the entry: ``f`` = state, parameters, tables, then one for each set of pairs (places at which a list of neighbours was made);
    ``n`` = counts, segments (kind, first, last, lanes of the last tile, place of the parameters), then four for each set of pairs. Counts:
    segments, steps, number of the first step on the grid, tiles (or rows), then three for each set of pairs. The entry gives 0, or k + 1 if it
    stopped before step k for want of room in a list of neighbours; how much is wanted stands in the counts then.
    """

    def __init__(
        self,
        kinds: Sequence[tuple[Term, ...]],
        pair_kinds: Sequence[PairKind],
        stored_work: bool,
        turning: str = FREE,
    ) -> None:
        self.turning = turning
        self.kinds, self.pair_kinds, self.stored_work = tuple(kinds), tuple(pair_kinds), stored_work
        terms = [term for kind in kinds for term in kind] + [kind.term for kind in pair_kinds]
        self.coupled = bool(pair_kinds)
        self.velocity_pairs = any(kind.term.of_velocity for kind in pair_kinds)
        turns = turning != FREE
        self.ages = max((sum("since" in term.trace.reads for term in kind) for kind in kinds), default=0)
        self.slots = Slots(columns_of(terms, turns), [kind.term for kind in pair_kinds], stored_work, turns, self.ages)
        tables = dict.fromkeys(table for term in terms for table in tables_of(term.trace.motion))
        self.tables, self.slots.starts = packed(list(tables))
        """The numbers of the tables that laws look up: constants of their classes, which the text does not hold."""
        self.reads_time = any("time" in term.trace.reads for term in terms)

    def text(self, arrays: bool) -> str:
        """The text that defines ``entry``."""
        lines: list[str] = []
        for number, kind in enumerate(self.kinds):
            lines += self._fields(number, kind, arrays).function()
            if self.velocity_pairs:
                lines += self._fields(number, kind, arrays).function(half_only=True)
        maker = ArrayPairText if arrays else PairText
        for number, pair in enumerate(self.pair_kinds):
            lines += maker(number, pair.term, self.slots, pair.how, pair.shared).function()
        if self.coupled:
            lines += self._middles(arrays)
        return "\n".join([*lines, *self._entry(arrays)]) + "\n"

    def _fields(self, number: int, kind: tuple[Term, ...], arrays: bool) -> FieldText:
        turning = self.turning == ALL_TURN or (self.turning == TURN and any(term.of_turning for term in kind))
        maker = ArrayFieldText if arrays else FieldText
        return maker(number, kind, self.slots, self.stored_work, turning)

    def _middles(self, arrays: bool) -> list[str]:
        """Functions that find the middles of all rows, and put the sums of pair forces to 0."""

        def place(name: str, c: int) -> str:
            at = self.slots.at(name, c)
            return f"s[{at // LANES}, first:last]" if arrays else f"s[i + {at}]"

        zero = "np.zeros(last - first)" if arrays else "0.0"
        middles = [f"{place('middle', c)} = {place('position', c)} + half * {place('velocity', c)}" for c in range(3)]
        middles += [f"{place(name, c)} = {zero}" for name in self._sums("pull") for c in range(3)]
        pushes = [f"{place(name, c)} = {zero}" for name in self._sums("push") for c in range(3)]
        lines: list[str] = []
        for name, body in (("middles", middles), ("no_push", pushes)):
            if not body:
                continue
            lines += [f"def {name}(s, p, first, last):", "    half = 0.5 * p[0]"]
            if arrays:
                lines += [f"    {line}" for line in body]
            else:
                lines += ["    for tile in range(first, last):", f"        base = tile * {self.slots.width * LANES}"]
                lines += [f"        for i in range(base, base + {LANES}):", *(f"            {line}" for line in body)]
            lines += ["    return 0", ""]
        return lines

    def _sums(self, kind: str) -> list[str]:
        """The slots that sum pair forces of a kind."""
        return [name for name in (kind, f"{kind}_working") if name in self.slots.first]

    def _entry(self, arrays: bool) -> list[str]:
        head = ["def entry(f, n):", "    s = f[0]", "    p = f[1]", "    tables = f[2]", "    c = n[0]", "    g = n[1]"]
        head += ["    steps = c[1]", "    number = c[2]"]
        if not self.coupled:
            return [*head, *self._segments("fields", "0", "steps", "    "), "    return 0"]
        head.append(f"    z = c[3] * {self.slots.width * LANES}")
        step: list[str] = ["middles(s, p, 0, c[3])"]
        if self.reads_time:
            step.append(
                f"now = clock__later(clock__multiple((p[{ORIGIN}], p[{ORIGIN + 1}]), number + t, p[0]), 0.5 * p[0])[0]"
            )
        else:
            step.append("now = 0.0")
        step += self._pairs(False, "position", arrays)
        if self.velocity_pairs:
            step += [
                "no_push(s, p, 0, c[3])",
                *self._pairs(True, "velocity", arrays),
                *self._segments("halves", "t", "t + 1", ""),
            ]
            step += ["no_push(s, p, 0, c[3])", *self._pairs(True, "middle_velocity", arrays)]
        step += self._segments("fields", "t", "t + 1", "")
        return [*head, "    for t in range(steps):", *(f"        {line}" for line in step), "    return 0"]

    def _segments(self, name: str, step: str, stop: str, indent: str) -> list[str]:
        lines = ["for k in range(c[0]):"]
        for number in range(len(self.kinds)):
            lines += [
                f"    if g[5 * k] == {number}:",
                f"        {name}_{number}({CALL}, {step}, {stop}, steps, number)",
            ]
        return [indent + line for line in lines]

    def _pairs(self, of_velocity: bool, speeds: str, arrays: bool) -> list[str]:
        lines = []
        for number, pair in enumerate(self.pair_kinds):
            if pair.term.of_velocity == of_velocity:
                at, c = 2 + LISTS_PER_COUPLES * number, FIRST_COUPLES + PER_COUPLES * number
                where = self.slots.at(speeds)
                if pair.how == NEAR and not arrays and speeds != "middle_velocity":
                    lines += self._neighbours(number, pair, at, c)
                lists = f"n[{at}], n[{at + 1}], n[{at + 2}]"
                lines.append(f"pairs_{number}(s, p, tables, {lists}, c[{c + 1}], c[{c}], {where}, now, z)")
        return lines

    def _neighbours(self, number: int, pair: PairKind, at: int, c: int) -> list[str]:
        """Make the list of neighbours again where it no longer serves."""
        slot, reference = self.slots.at("middle"), f"f[{REFERENCES + number}]"
        cutoff, reach = f"p[c[{c + 1}] + {pair.term.size - 2}]", f"p[c[{c + 1}] + {pair.term.size - 1}]"
        rows = f"n[{at}]"
        return [
            f"moved = neighbours__moved(s, {rows}, {slot}, c[{c}], {reference})",
            f"if not neighbours__serves(moved, {cutoff}, {reach}):",
            f"    found = neighbours__build(s, {rows}, {slot}, c[{c}], {rows}, 0, {reach}, {reference},"
            f" n[{at + 3}], n[{at + 1}], n[{at + 2}], c[{c + 2}])",
            "    if found < 0:",
            f"        c[{c + 2}] = -found",
            "        return t + 1",
        ]


__all__ = ["AXES", "LISTED", "LoopText", "PairKind"]
