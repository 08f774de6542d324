"""Text of the part of `xpheve.loop.motion` that sums forces between all pairs of many bodies: by tiles, or by a tree.

*Tiles*: the numbers of 32 bodies lie side by side in scratch, and a body's pairs with all of them are found in one vector loop, each pair once.
Where a body's sum is taken and in which order is a matter of the list alone, so that all tiers find the same bits.

*A tree* (`xpheve.kernels.tree`): for laws that fall with the square of the distance and allow an error.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from xpheve.kernels import tree
from xpheve.loop.couples import ALL, variable
from xpheve.loop.motion import PairsText
from xpheve.loop.terms import SCENE, Term, slot_of
from xpheve.trace.graph import Input, walk
from xpheve.trace.inverse_square import inverse_square

if TYPE_CHECKING:
    from xpheve.laws import PairLaw
    from xpheve.trace.inverse_square import InverseSquare

TILES, TREE = "all, by tiles", "all, by a tree"
"""Which pairs, and how they are summed; see `xpheve.loop.couples`."""
TILES_FROM = 64
"""Bodies from which on tiles are faster than pair after pair."""
TREE_FROM = 4500
"""Bodies from which on a tree with an error of 1e-3 is faster than tiles."""
LEAST_TREE = 2000
"""Bodies from which on a tree may be."""
SHORT = 40
"""Lines of a force that is written down four times, for speed."""
WIDE, EIGHT = 32, 8
"""Bodies of a tile, and parts in which a sum over them is taken."""
NODES_OF_TREE = 1000
"""About how many bodies and nodes act on each body of a tree."""
TREE_PARAMETERS = 3
"""Behind the parameters of a law that is summed by a tree: strength, softening squared [m^2], error."""
TOLD = 2
"""Behind the tree's own floats: the greatest error measured so far, and the greatest number of walks."""


def how_to_sum(how: str, count: int, term: Term, law: PairLaw, steady: bool = True) -> str:
    """How the pairs of ``law`` among ``count`` bodies are summed: ``how`` as it is, `TILES` or `TREE`; ``steady`` as in `why_no_tree`."""
    if how != ALL:
        return how
    if law.allowed_error() > 0.0 and not why_no_tree(count, term, law, steady):
        return TREE
    by_hand = any(node.op == "kernel" for node in walk(term.trace.force or ()))  # it may fail for a body with itself
    return TILES if count >= TILES_FROM and not by_hand else ALL


def why_no_tree(count: int, term: Term, law: PairLaw, steady: bool) -> str:
    """Why a law that allows an error is summed exactly all the same; empty if it is not.

    ``steady`` says that the steps have a given length. Where their length follows from their error, the small jumps of a tree's forces would
    make them ever shorter.
    """
    if not steady:
        return (
            "the lengths of steps follow from their errors, or equations are solved, which a tree's error would spoil"
        )
    if not pays(count, law.allowed_error()):
        return "a tree would be slower"
    if inverse_square(term.trace, law) is None:
        return "the force is not proven to fall with the square of the distance"
    return ""


def pays(count: int, error: float) -> bool:
    """Whether a tree is likely to be faster than tiles for ``count`` bodies; no error is allowed if ``error`` is 0.

    Measured with Plummer spheres: 2,000 bodies for 1e-2, 4,000 for 1e-3, 11,000 for 1e-4, 45,000 for 1e-5.
    """
    return error > 0.0 and count >= max(LEAST_TREE, TREE_FROM * (1e-3 / error) ** 0.45)


def work_of(how: str, count: int) -> int:
    """About how many pairs are looked at for ``count`` bodies, or pairs of a list, that are summed so."""
    if how in (ALL, TILES):
        return count * (count - 1) // 2
    return count * NODES_OF_TREE if how == TREE else count


class TilePairs(PairsText):
    """Writes ``pairs_<number>`` for all pairs of a list: those of the rows before a tile with it, and those inside it, tile after tile.

    Of the tiles it takes every ``strips``-th, from ``strip`` on.
    """

    more = "t, z, strip, strips"

    def function(self) -> list[str]:
        """The lines of the functions."""
        self.inputs = self._inputs("b")
        self.sums, self.ends = WIDE * len(self.inputs), WIDE * (len(self.inputs) + 3)
        take = [*self._loads("b", "j"), *(f"t[l + {WIDE * m}] = {variable(one)}" for m, one in enumerate(self.inputs))]
        take += [f"t[l + {self.sums + WIDE * c}] = 0.0" for c in range(3)]
        spread = ["j = left[first + l]", *(f"e{c} = t[l + {self.sums + WIDE * c}]" for c in range(3))]
        spread += self._add("j", "-", [f"e{c}" for c in range(3)])
        given = "s, p, tables, k, left, q, rows, x, v, a, w, now, t"
        lines = [
            f"for first in range({WIDE} * strip, count, {WIDE} * strips):",
            f"    lanes = min({WIDE}, count - first)",
        ]
        lines += [f"    for l in range({WIDE}):", "        j = left[first + min(l, lanes - 1)]", *_in(_in(take))]
        lines += [f"    begin = first if lanes == {WIDE} else 0"]
        lines += [f"    every_{self.number}({given}, begin)"]
        lines += [f"    some_{self.number}({given}, begin, first, lanes)"]
        lines += ["    for l in range(lanes):", *_in(_in(spread))]
        every = [f"def every_{self.number}({given}, end):", *_in([*self.parameters, *self.fixed])]
        every += ["    for m in range(end):", *_in(_in(self._row(masked=False))), "    return 0", ""]
        some = [f"def some_{self.number}({given}, begin, first, lanes):", *_in([*self.parameters, *self.fixed])]
        some += ["    for m in range(begin, first + lanes):", "        low = m - first + 1"]
        some += [*_in(_in(self._row(masked=True))), "    return 0", ""]
        return [*every, *some, self.head(), *_in([*lines, "return 0"]), ""]

    def _row(self, masked: bool) -> list[str]:
        """Lines that find the forces between body m of the list and those of the tile, of which ``masked`` leaves out what is no pair.

        The sum of the 32 that act on m is taken in eight parts, which are found side by side: at once where all are pairs and the force is
        short, else by the way of scratch, to the same bits.
        """
        lines = ["i = left[m]", *self._loads("a", "i")]
        if masked or len(self.force) > SHORT:
            lines += [f"for l in range({WIDE}):", *_in(self._pair(0, masked))]
            lines += [f"    t[l + {self.ends + WIDE * c}] = e{c}" for c in range(3)]
            lines.append(f"for l in range({EIGHT}):")
            for c in range(3):
                a, b, d, e = (f"t[l + {self.ends + WIDE * c + part}]" for part in range(0, WIDE, EIGHT))
                lines.append(f"    {a} = ({a} + {b}) + ({d} + {e})")
        else:
            lines.append(f"for l in range({EIGHT}):")
            for part in range(0, WIDE, EIGHT):
                lines += _in(_renamed(self._pair(part, masked), f"_{part}"))
            for c in range(3):
                a, b, d, e = (f"e{c}_{part}" for part in range(0, WIDE, EIGHT))
                lines.append(f"    t[l + {self.ends + WIDE * c}] = ({a} + {b}) + ({d} + {e})")
        lines += [f"e{c} = {_of_eight(self.ends + WIDE * c)}" for c in range(3)]
        return [*lines, *self._add("i", "+", ["e0", "e1", "e2"])]

    def _pair(self, part: int, masked: bool) -> list[str]:
        """Lines that find ``e0`` to ``e2``, the force of body m's pair with that in lane l + ``part``, and add it to what acts on the latter."""
        lines = [f"{variable(one)} = t[l + {WIDE * m + part}]" for m, one in enumerate(self.inputs)]
        lines += self.force
        if masked:
            lines.append(f"other = (low <= l + {part}) & (l + {part} < lanes)")
        for c, name in enumerate(self.names):
            place = f"t[l + {self.sums + WIDE * c + part}]"
            lines += [f"e{c} = {name} if other else 0.0" if masked else f"e{c} = {name}", f"{place} = {place} + e{c}"]
        return lines

    def _inputs(self, side: str) -> list[Input]:
        found = {n.value for n in walk(self.term.trace.force or ()) if n.op == "input" and n.value.side == side}
        return sorted(one for one in found if one.name not in SCENE)


class TreePairs(PairsText):
    """Writes ``pairs_<number>`` for all pairs of a list by a tree.

    ``right`` is the tree's whole numbers, ``t`` its scratch, and ``z`` its floats, with `TOLD` more.
    """

    more = "t, z"
    charge = ""
    """What bodies act by: "mass" or a column; empty if all act alike."""

    def function(self) -> list[str]:
        """The lines of the function."""
        at = self.term.size
        charge = f"k[{self.motion.slots.first[slot_of(self.charge)]} * rows + i]" if self.charge else "1.0"
        take = ["i = left[m]", *(f"z[{_part(c)} + m] = s[x + {c} * rows + i]" for c in range(3))]
        take.append(f"z[{_part(3)} + m] = {charge}")
        give = ["i = left[right[m]]", f"own = 0.0 - strength * z[{_part(3)} + m]"]
        give += [f"e{c} = own * z[{_part(4 + c)} + m]" for c in range(3)]
        give += self._add("i", "+", [f"e{c}" for c in range(3)])
        lines = [f"strength = p[q + {at}]", "size = tree__stride(count)", "told = tree__floats(count)"]
        lines += ["for m in range(count):", *_in(take)]
        lines.append(f"walks = tree__solve(count, z, right, t, p[q + {at + 1}], p[q + {at + 2}])")
        lines += ["z[told] = max(z[told], t[0])", "z[told + 1] = max(z[told + 1], float(walks))"]
        lines += ["for m in range(count):", *_in(give), "return 0"]
        if self.term.switch:
            lines = [f"if p[q + {len(self.term.trace.parameters)}] == 0.0:", "    return 0", *lines]
        return [self.head(), *_in(lines), ""]


def _renamed(lines: list[str], ending: str) -> list[str]:
    """``lines`` with another name for each variable that they give a value to."""
    given = {line.partition(" = ")[0] for line in lines}
    return [
        re.sub(r"\b[a-z]\w*\b(?!\()", lambda found: found[0] + (ending if found[0] in given else ""), line)
        for line in lines
    ]


def _part(c: int) -> str:
    return "size" if c == 1 else f"{c} * size"


def _in(lines: list[str]) -> list[str]:
    return [f"    {line}" for line in lines]


def _of_eight(place: int) -> str:
    """The sum of eight numbers of scratch."""
    a, b, c, d = (f"(t[{place + m}] + t[{place + m + 4}])" for m in range(4))
    return f"({a} + {c}) + ({b} + {d})"


def scratch(terms: list[Term]) -> int:
    """Length of the scratch that tiles of ``terms``, and a tree, need."""
    most = max((sum(n.op == "input" for n in walk(term.trace.force or ())) for term in terms), default=0)
    return max(WIDE * (most + 6), tree.SCRATCH)


def tree_numbers(found: InverseSquare | None, law: PairLaw) -> list[float]:
    """The numbers behind the parameters of ``law``, of which ``found`` was proven."""
    if found is None:
        return [0.0] * TREE_PARAMETERS
    return [found.strength, found.softening * found.softening, law.allowed_error()]


def told(count: int, floats: Any) -> tuple[float, int]:
    """The greatest error measured of a tree of ``count`` bodies so far, and the greatest number of walks; ``floats`` are its own."""
    at = tree.floats(count)
    return float(floats[at]), int(floats[at + 1])
