"""Text of pair forces for NumPy: the same sums in the same order, a chunk of pairs at a time."""

from __future__ import annotations

from xpheve.loop.couples import ALL, LISTED, PairText, variable
from xpheve.loop.terms import LANES, slot_of
from xpheve.trace.emit import Writer
from xpheve.trace.graph import Input


class ArrayPairText(PairText):
    """As `PairText`, for ``s`` of shape (slots, rows) and lists of row numbers."""

    arrays = True

    def _place(self, one: Input) -> str:
        if one.name == "position":
            return str(self.slots.at("middle", one.component) // LANES)
        if one.name == "velocity":
            return f"speeds // {LANES} + {one.component}"
        return str(self.slots.at(slot_of(one.name), one.component) // LANES)

    def _loads(self, side: str) -> list[str]:
        return [f"{variable(one)} = s[{self._place(one)}, {side}]" for one in self._inputs(side)]

    def _force(self, writer: Writer) -> tuple[list[str], list[str]]:
        arrays = Writer(writer.leaf, arrays=True, prefix="t", starts=self.slots.starts)
        arrays.names.update(writer.names)
        return super()._force(arrays)

    def _act(self, names: list[str]) -> list[str]:
        lines = []
        for target in self._targets():
            for c, name in enumerate(names):
                lines.append(f"add_pairs(s[{self.slots.at(target, c) // LANES}], a, b, {name})")
        return lines

    def _keep_near(self) -> list[str]:
        """Keep the pairs closer than the cutoff."""
        place = self.slots.at("middle") // LANES
        gaps = [f"d{c} = s[{place + c}, a] - s[{place + c}, b]" for c in range(3)]
        reach = self._reach if self.shared else self._reach.replace("q", "rows[k]")
        keep = ["near = np.flatnonzero(d0 * d0 + d1 * d1 + d2 * d2 < " + reach + ")", "a = a[near]", "b = b[near]"]
        return [*gaps, *keep] if self.shared else [*gaps, *keep, "k = np.arange(count)[k][near]"]

    def function(self) -> list[str]:
        writer, parameters, fixed = self._writer()
        force, names = self._force(writer)
        inner = [*self._loads("a"), *self._loads("b")]
        head = [f"def pairs_{self.number}(s, p, tables, left, right, rows, q, count, speeds, now, z):"]
        if self.shared:
            head += [f"    {line}" for line in parameters + fixed]
        else:
            inner += ["q = rows[k]", *parameters, *fixed]
        if self.how == LISTED:
            head.append("    for k in chunks(count):")
            inner = ["a = left[k]", "b = right[k]", *inner]
        elif self.how == ALL:
            head.append("    for a, b in all_pairs(left, count):")
        else:
            head.append(f"    for a, b in left(s[{self.slots.at('middle') // LANES}:]):")
        if self.how == LISTED and self.term.near:
            inner = [*inner[:2], *self._keep_near(), *inner[2:]]
        return [*head, *(f"        {line}" for line in [*inner, *force, *self._act(names)]), "    return 0", ""]


__all__ = ["ArrayPairText"]
