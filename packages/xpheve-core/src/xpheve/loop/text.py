"""The whole text of a loop: one function a law set, one a pair law, and an entry that walks them step by step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from xpheve.loop.array_couples import ArrayPairText
from xpheve.loop.couples import LISTED, PairText
from xpheve.loop.fields import AXES, ORIGIN, FieldText
from xpheve.loop.terms import LANES, Slots, Term, columns_of

CALL = "s, p, w, g[5 * k + 1], g[5 * k + 2], g[5 * k + 3], g[5 * k + 4]"


class PairKind(NamedTuple):
    """A pair law class in a loop: which pairs, and whether all have one instance's parameters."""

    term: Term
    how: str
    shared: bool


class LoopText:
    """The text for rows of ``kinds`` (law sets) and pairs of ``pair_kinds``, as tiles, or for NumPy with ``arrays``.

    The buffers of the entry: ``f`` = state, parameters, tables; ``n`` = counts, segments (kind, first, last, lanes of the last tile, place of the
    parameters), then three for each pair kind. Counts: segments, steps, number of the first step on the grid, tiles (or rows), then for each pair
    kind how many pairs (or rows) and where its parameters are.
    """

    def __init__(self, kinds: Sequence[tuple[Term, ...]], pair_kinds: Sequence[PairKind], stored_work: bool) -> None:
        self.kinds, self.pair_kinds, self.stored_work = tuple(kinds), tuple(pair_kinds), stored_work
        terms = [term for kind in kinds for term in kind] + [kind.term for kind in pair_kinds]
        self.coupled = bool(pair_kinds)
        self.velocity_pairs = any(kind.term.of_velocity for kind in pair_kinds)
        self.slots = Slots(columns_of(terms), self.coupled, self.velocity_pairs, stored_work)
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
        return "\n".join([*lines, *self._entry()]) + "\n"

    def _fields(self, number: int, kind: tuple[Term, ...], arrays: bool) -> FieldText:
        return FieldText(number, kind, self.slots, self.stored_work, arrays)

    def _middles(self, arrays: bool) -> list[str]:
        """Functions that find the middles of all rows, and put the sums of pair forces to 0."""

        def place(name: str, c: int) -> str:
            at = self.slots.at(name, c)
            return f"s[{at // LANES}, first:last]" if arrays else f"s[i + {at}]"

        zero = "np.zeros(last - first)" if arrays else "0.0"
        middles = [f"{place('middle', c)} = {place('position', c)} + half * {place('velocity', c)}" for c in range(3)]
        middles += [f"{place(name, c)} = {zero}" for name in ("pull", "pull_working") for c in range(3)]
        pushes = (
            [f"{place(name, c)} = {zero}" for name in ("push", "push_working") for c in range(3)]
            if self.velocity_pairs
            else []
        )
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

    def _entry(self) -> list[str]:
        head = ["def entry(f, n):", "    s = f[0]", "    p = f[1]", "    w = f[2]", "    c = n[0]", "    g = n[1]"]
        head += ["    steps = c[1]", "    number = c[2]"]
        if not self.coupled:
            return [*head, *self._segments("fields", "0", "steps", "    "), "    return 0"]
        step: list[str] = ["middles(s, p, 0, c[3])"]
        if self.reads_time:
            step.append(
                f"now = clock__later(clock__multiple((p[{ORIGIN}], p[{ORIGIN + 1}]), number + t, p[0]), 0.5 * p[0])[0]"
            )
        else:
            step.append("now = 0.0")
        step += self._pairs(False, "position")
        if self.velocity_pairs:
            step += [
                "no_push(s, p, 0, c[3])",
                *self._pairs(True, "velocity"),
                *self._segments("halves", "t", "t + 1", ""),
            ]
            step += ["no_push(s, p, 0, c[3])", *self._pairs(True, "middle_velocity")]
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

    def _pairs(self, of_velocity: bool, speeds: str) -> list[str]:
        lines = []
        for number, pair in enumerate(self.pair_kinds):
            if pair.term.of_velocity == of_velocity:
                at = 2 + 3 * number
                count, place = f"c[{4 + 2 * number}]", f"c[{5 + 2 * number}]"
                where = self.slots.at(speeds)
                lines.append(
                    f"pairs_{number}(s, p, w, n[{at}], n[{at + 1}], n[{at + 2}], {place}, {count}, {where}, now)"
                )
        return lines


__all__ = ["AXES", "LISTED", "LoopText", "PairKind"]
