"""Text of the part of a loop that sums the forces of pair laws onto rows."""

from __future__ import annotations

from collections.abc import Iterable

from xpheve.loop.fields import AXES, PARAMETERS, UP
from xpheve.loop.terms import LANES, SCENE, Slots, Term, depends, rowwise, shared_nodes, slot_of
from xpheve.trace.emit import Writer
from xpheve.trace.graph import Input, Node, walk

LISTED, ALL, NEAR = "listed", "all", "near"
"""Which pairs: those of a list; all of a list of rows; those of a list of rows that are near one another, found through cells."""


GATHERED = 64
"""Partners of a row that are gathered at a time."""


class PairText:
    """Writes function ``pairs_<number>``: the force of ``term`` on the rows of each pair, added in the order of the pairs.

    Lists hold addresses: where in ``s`` the first number of a row lies. ``shared`` says that all pairs have one instance's parameters.
    """

    arrays = False

    def __init__(self, number: int, term: Term, slots: Slots, how: str, shared: bool) -> None:
        self.number, self.term, self.slots, self.how, self.shared = number, term, slots, how, shared

    def function(self) -> list[str]:
        """The lines of the function."""
        if self.how == LISTED:
            return self._listed()
        return self._of_rows()

    # What a node is called

    def _writer(self) -> tuple[Writer, list[str], list[str]]:
        """The writer of one pair's force; the lines of parameters, and of what depends on them alone."""
        term = self.term
        parameters = [f"k{m} = p[q + {m}]" for m in range(len(term.trace.parameters))]
        names = {one: f"k{m}" for m, one in enumerate(term.trace.parameters)}
        if term.switch:
            parameters.append(f"on = p[q + {len(names)}]")

        def leaf(node: Node) -> str:
            if node.op == "param":
                return names[node.value]
            if node.value.name == "time":
                return "now"
            if node.value.name == "up":
                return f"p[{UP + node.value.component}]"
            return variable(node.value)

        outputs = term.trace.force or ()
        own = rowwise(outputs) | depends(outputs, ("time",))
        head = Writer(leaf, self.arrays and not self.shared, prefix="f", starts=self.slots.starts)
        head.write(shared_nodes(outputs, own))
        writer = Writer(leaf, prefix="t", starts=self.slots.starts)
        writer.names.update(head.names)
        return writer, parameters, head.lines

    def _inputs(self, side: str) -> list[Input]:
        """What the force reads of one side, sorted; of near pairs always the place."""
        found = {
            n.value
            for n in walk(self.term.trace.force or ())
            if n.op == "input" and n.value.side == side and n.value.name not in SCENE
        }
        if self.term.near:
            found |= {Input(side, "position", c) for c in range(3)}
        return sorted(found)

    def _loads(self, side: str) -> list[str]:
        return [f"{variable(one)} = s[{side} + {self._place(one)}]" for one in self._inputs(side)]

    def _place(self, one: Input) -> str:
        if one.name == "position":
            return str(self.slots.at("middle", one.component))
        if one.name == "velocity":
            return f"speeds + {one.component * LANES}"
        return str(self.slots.at(slot_of(one.name), one.component))

    def _targets(self) -> tuple[str, ...]:
        return self.slots.sums[self.term]

    @property
    def _reach(self) -> str:
        """Where the square of the cutoff is."""
        return f"p[q + {self.term.size - 3}]"

    def _near(self, lines: list[str]) -> list[str]:
        """``lines``, done for pairs closer than the cutoff only."""
        if not self.term.near:
            return lines
        gaps = [f"d{c} = a{c}_position - b{c}_position" for c in range(3)]
        return [*gaps, "if d0 * d0 + d1 * d1 + d2 * d2 < reach_squared:", *(f"    {line}" for line in lines)]

    def _force(self, writer: Writer) -> tuple[list[str], list[str]]:
        """Lines that find the force on ``a``, and its components."""
        names = writer.write(list(self.term.trace.force or ()))
        lines = list(writer.lines)
        if self.term.switch:
            lines += [f"o{axis} = {name} if on != 0.0 else 0.0" for axis, name in zip(AXES, names, strict=True)]
            names = [f"o{axis}" for axis in AXES]
        return lines, names

    def _add(self, row: str, sign: str, names: list[str]) -> list[str]:
        lines = []
        for target in self._targets():
            for c, name in enumerate(names):
                place = f"s[{row} + {self.slots.at(target, c)}]"
                lines.append(f"{place} = {place} {sign} {name}")
        return lines

    # The three ways

    def _listed(self) -> list[str]:
        writer, parameters, fixed = self._writer()
        force, names = self._force(writer)
        head = [f"def pairs_{self.number}(s, p, tables, left, right, rows, q, count, speeds, now, z):"]
        inner = ["a = left[k]", "b = right[k]"]
        if self.shared:
            head += [f"    {line}" for line in parameters + fixed]
        else:
            inner += ["q = rows[k]", *parameters, *fixed]
        if self.term.near:
            reach = f"reach_squared = {self._reach}"
            (head if self.shared else inner).append(f"    {reach}" if self.shared else reach)
        act = [*force, *self._add("a", "+", names), *self._add("b", "-", names)]
        inner += [*self._loads("a"), *self._loads("b"), *self._near(act)]
        return [*head, "    for k in range(count):", *(f"        {line}" for line in inner), "    return 0", ""]

    def _of_rows(self) -> list[str]:
        """All pairs of rows, or those within reach, row by row.

        The partners of a row are gathered, `GATHERED` at a time, into scratch of which compilers make vectors; what acts on the row is
        summed in variables, pair after pair.
        """
        writer, parameters, fixed = self._writer()
        force, names = self._force(writer)
        targets = [(target, c) for target in self._targets() for c in range(3)]
        inputs = self._inputs("b")
        outputs = len(inputs)
        gather = [f"s[l + {m * GATHERED}] = s[b + {self._place(one)}]" for m, one in enumerate(inputs)]
        loads = [f"{variable(one)} = s[l + {m * GATHERED}]" for m, one in enumerate(inputs)]
        act = [*loads, *force]
        if self.term.near:
            act += [f"d{c} = a{c}_position - b{c}_position" for c in range(3)]
            act.append("near = d0 * d0 + d1 * d1 + d2 * d2 < reach_squared")
            names = [f"({name} if near else 0.0)" for name in names]
        act += [f"s[l + {(outputs + c) * GATHERED}] = {name}" for c, name in enumerate(names)]
        spread = [f"e{c} = s[l + {(outputs + c) * GATHERED}]" for c in range(3)]
        spread += [f"r{m} = r{m} + e{c}" for m, (_, c) in enumerate(targets)]
        spread += self._add("b", "-", [f"e{c}" for c in range(3)])
        partner = "rows[j + l - z]" if self.how == ALL else "rows[partners[j + l - z]]"
        lanes = f"for l in range(z, z + min({GATHERED}, end - j)):"
        # What is left over of the last partners is computed along: vectors have no loose ends then.
        padded = f"for l in range(z, z + ((min({GATHERED}, end - j) + 7) & -8)):"
        head = [f"def pairs_{self.number}(s, p, tables, rows, first, partners, q, count, speeds, now, z):"]
        head += [f"    {line}" for line in parameters + fixed]
        if self.term.near:
            head.append(f"    reach_squared = {self._reach}")
        body = ["for i in range(count):", "    a = rows[i]", *(f"    {line}" for line in self._loads("a"))]
        body += [f"    r{m} = s[a + {self.slots.at(target, c)}]" for m, (target, c) in enumerate(targets)]
        body += (
            ["    begin = i + 1", "    end = count"]
            if self.how == ALL
            else ["    begin = first[i]", "    end = first[i + 1]"]
        )
        body.append(f"    for j in range(begin, end, {GATHERED}):")
        for over, lines in ((lanes, [f"b = {partner}", *gather]), (padded, act), (lanes, [f"b = {partner}", *spread])):
            body += [f"        {over}", *(f"            {line}" for line in lines)]
        body += [f"    s[a + {self.slots.at(target, c)}] = r{m}" for m, (target, c) in enumerate(targets)]
        return [*head, *(f"    {line}" for line in body), "    return 0", ""]


def scratch(terms: Iterable[Term]) -> int:
    """Numbers of scratch behind the tiles that `PairText` needs."""
    inputs = max(
        (3 + len({n.value for n in walk(term.trace.force or ()) if n.op == "input"}) for term in terms), default=0
    )
    return (inputs + 3) * GATHERED


def variable(one: Input) -> str:
    """What a number of a pair is called."""
    return f"{one.side}{one.component}_{one.name}"


__all__ = ["ALL", "LISTED", "NEAR", "PARAMETERS", "PairText", "scratch", "variable"]
