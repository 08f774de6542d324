"""Text that moves rows, for NumPy: a row loop is an array operation, and the three components of a vector are one."""

from __future__ import annotations

from xpheve.loop.fields import AXES, FieldText
from xpheve.loop.terms import LANES, depends, shared_nodes

CHANGE = ("position", "velocity", "orientation", "angular_velocity", "time")
"""Inputs that are others in every step."""


class ArrayFieldText(FieldText):
    """As `FieldText`, for ``s`` of shape (slots, rows): the same roundings in the same order."""

    arrays = True

    def load(self, name: str, component: int = 0) -> str:
        return f"s[{self.slots.at(name, component) // LANES}, first:last]"

    def _block(self, name: str, width: int = 3) -> str:
        """All components, where they lie."""
        first = self.slots.at(name) // LANES
        return f"s[{first}:{first + width}, first:last]"

    def _begin(self) -> None:
        self.once = [f"X = {self._block('position')}", f"V = {self._block('velocity')}", f"W = {self._block('stored')}"]
        self.once += [f"im = {self.load('inverse_mass')}", "vx, vy, vz = V"]
        for k in range(len(self.terms)):
            self._write_once(k)
        self.body += ["M = half * V", "M += X", "mx, my, mz = M"]

    def _write_once(self, k: int) -> None:
        """What a term makes of columns alone: found once a call."""
        outputs = self._outputs(self.terms[k])
        writer, body = self.writers[k], self.body
        self.body = []
        at = len(writer.lines)
        writer.write(shared_nodes(outputs, depends(outputs, CHANGE)))
        self.once += self.body + writer.lines[at:]
        self.body = body

    def _sum(self, prefix: str, parts: list[list[str]]) -> list[str]:
        """The sums, as rows of one array; ``e`` and ``z`` have theirs, which serves all steps."""
        block = prefix.upper()
        for c in range(3):
            terms = [part[c] for part in parts]
            if len(terms) < 2:
                self.body.append(f"{block}[{c}] = {terms[0] if terms else '0.0'}")
                continue
            self.body.append(f"np.add({terms[0]}, {terms[1]}, out={block}[{c}])")
            self.body += [f"np.add({block}[{c}], {term}, out={block}[{c}])" for term in terms[2:]]
        return [f"{block}[{c}]" for c in range(3)]

    def _acceleration(self, prefix: str, force: list[str]) -> None:
        self.body += [f"{prefix.upper()} = E * im", f"{prefix.upper()} += W"]

    def _middle_velocity(self) -> None:
        self.body += ["D *= half", "D += V", "ux, uy, uz = D"]

    def _finish(self, total: list[str], working: list[list[str]]) -> None:
        self.body.append(f"{self._block('acceleration')} = A")
        if self.working:
            self._write_working(working)
        if not self.turning:
            self.body += ["if g == 0.0:", "    continue"]
        self.body += ["D = gh * A", "D += V", "D *= g"]
        if self.working:
            self.body += ["Z *= D", "j = Z[0] + Z[1]", "j += Z[2]", f"j += {self.load('work_rest')}"]
            self._two_sum("work", 0, self.load("work"), "j")
        self.body.append(f"D += {self._block('position_rest')}")
        self._two_sums("position", "X", "D")
        self.body += ["A *= g", f"A += {self._block('velocity_rest')}"]
        self._two_sums("velocity", "V", "A")

    def _write_working(self, working: list[list[str]]) -> None:
        """Keep the force that no potential stands for, in ``Z``; where that is all of it, it has been summed already."""
        if self.pulled or self.pushed or self.stored_work or any(term.accounted for term in self.terms):
            names = self._sum("z", [*(self._slot(name) for name in self.slots.pair_work), *working])
        else:
            names = []
            self.body.append("Z = E")
        self.body.append(f"{self._block('working')} = Z")
        if self.stored_work:
            self._sum("z", [names, self._slot("stored_working")])

    def _two_sums(self, name: str, old: str, more: str) -> None:
        """`_two_sum` of all components; ``more`` is used up."""
        self.body += [f"T = {old} + {more}", f"B = T - {old}", f"{more} -= B", "np.subtract(T, B, out=B)"]
        self.body += [
            f"np.subtract({old}, B, out=B)",
            f"np.add(B, {more}, out={self._block(name + '_rest')})",
            f"{old}[...] = T",
        ]

    def _loops(self, tick: list[str], body: list[str]) -> list[str]:
        blocks = [f"    {name} = np.empty((3, last - first))" for name in ("E", "Z", "R")]
        return [
            *blocks,
            *(f"    {line}" for line in self.once),
            "    for k in range(step, stop):",
            *(f"        {line}" for line in [*tick, *body]),
        ]


__all__ = ["AXES", "ArrayFieldText"]
