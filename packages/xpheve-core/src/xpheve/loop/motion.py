"""The text of ``forces``: the second derivatives of all that a batch carries, from places and velocities, for drivers to call.

``forces(f, n, x, v, a, w, now)``: component c of row i lies at ``s[x + c * N + i]``, s = ``f[0]``, and its velocity at
``s[v + c * N + i]``; of N rows the first M move. Written are the accelerations [m/s^2], ``s[a + c * N + i]``, 0 for rows that do not move,
and where some force has no potential, the sum of those forces [N], ``s[w + c * N + i]`` of the M rows. There are 3 components, or 7 where
rows turn: then 3 to 6 are the orientation, as `xpheve.kernels.turning` has it.

Buffers: ``f`` = the driver's own, parameters, tables, row constants (``k[slot * N + i]``), the motion of sources, scratch of pairs, then
one for each set of pairs (a tree's numbers); ``n`` = counts, segments,
the driver's own, then three for each set of pairs (left, right, places of parameters). Counts: segments, N, M, 0, then two for each set of
pairs (how many pairs or rows, place of the parameters). The fourth count is how many of the other
rows move: where they are is followed first, by `xpheve.kernels.course` from the motion of sources.
A segment is: kind, first row, last row, place of its parameters.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from xpheve.loop.couples import LISTED, variable
from xpheve.loop.fields import AXES, UP
from xpheve.loop.terms import SCENE, WIDTHS, Term, columns_of, depends, rowwise, shared_nodes, slot_of
from xpheve.loop.text import PairKind
from xpheve.trace.emit import Writer
from xpheve.trace.graph import Input, Node, walk
from xpheve.trace.table import packed, tables_of

FIRST_LISTS, LISTS = 3, 3
"""The first of the buffers with lists of pairs, and how many each set has."""
FIRST_COUNTS, COUNTS = 4, 2
"""The first of the counts of sets of pairs, and how many each has."""
STILL_LEFT, STILL_RIGHT = "from still rows on the left", "from still rows on the right"
"""Which pairs: those of rows that do not move, each with rows that lie side by side. The first list has the former, the second where the latter begin
and end."""
SCRATCH = 5
"""The buffer of scratch that all sets of pairs share; after it comes one for each set."""
PLACES, ROTATION = 3, 7
"""Components of a row that is carried along, and of one that turns, too."""
QUATERNION = ("orientation", "angular_velocity")


class RowSlots:
    """Where the constants of a row lie: slot k of row i at ``k * N + i``."""

    def __init__(self, columns: Sequence[str], turning: bool, stored_work: bool, ages: int) -> None:
        self.first: dict[str, int] = {}
        self.width = 0
        self._add("inverse_mass", 1)
        self._add("stored", 3)
        if stored_work:
            self._add("stored_working", 3)
        if turning:
            for name in ("stored_torque", "inertia", "inverse_inertia"):
                self._add(name, 3)
        self.columns = tuple(name for name in columns if not (turning and name in QUATERNION))
        for name in self.columns:
            self._add(slot_of(name), ages if name == "since" else WIDTHS.get(name, 1))

    def _add(self, name: str, width: int) -> None:
        if name not in self.first:
            self.first[name] = self.width
            self.width += width


class MotionText:
    """The text of ``forces`` for rows of ``kinds`` (law sets) and pairs of ``pair_kinds``.

    ``charges`` names what bodies of the sets of pairs act by that a tree sums.

    ``works`` says that some force has no potential, ``reads_velocity`` and ``reads_time`` what accelerations depend on besides places.
    """

    def __init__(
        self,
        kinds: Sequence[tuple[Term, ...]],
        pair_kinds: Sequence[PairKind],
        stored_work: bool,
        turning: bool,
        charges: Mapping[int, str] | None = None,
        followed: bool = False,
    ) -> None:
        self.charges = charges or {}
        self.kinds, self.pair_kinds = tuple(kinds), tuple(pair_kinds)
        self.turning, self.stored_work = turning, stored_work
        self.components = ROTATION if turning else PLACES
        self.terms = [term for kind in kinds for term in kind] + [kind.term for kind in pair_kinds]
        self.ages = max((sum("since" in term.trace.reads for term in kind) for kind in kinds), default=0)
        self.slots = RowSlots(columns_of(self.terms, turning), turning, stored_work, self.ages)
        tables = dict.fromkeys(table for term in self.terms for table in tables_of(term.trace.motion))
        self.tables, self.starts = packed(list(tables))
        self.works = stored_work or any(not term.accounted for term in self.terms)
        reads = frozenset[str]().union(*(term.trace.reads for term in self.terms))
        self.reads_velocity = turning or bool(reads & {"velocity", "angular_velocity"})
        self.reads_time = followed or "time" in reads
        self.followed = followed

    def text(self) -> str:
        """The text that defines ``forces``."""
        lines: list[str] = []
        for number, kind in enumerate(self.kinds):
            lines += _Rows(self, number, kind).function()
        for number, pair in enumerate(self.pair_kinds):
            lines += self.pairs(number, pair).function()
        return "\n".join([*lines, *self._forces()]) + "\n"

    def pairs(self, number: int, pair: PairKind) -> PairsText:
        """What writes the function of a set of pairs."""
        from xpheve.loop.long_range import TILES, TREE, TilePairs, TreePairs

        if pair.how == TREE:
            found = TreePairs(self, number, pair)
            found.charge = self.charges[number]
            return found
        return (TilePairs if pair.how == TILES else PairsText)(self, number, pair)

    def _forces(self) -> list[str]:
        lines = ["def forces(f, n, x, v, a, w, now):"]
        lines += ["    s = f[0]", "    p = f[1]", "    tables = f[2]", "    k = f[3]", "    c = n[0]", "    g = n[1]"]
        lines += ["    rows = c[1]", "    moving = c[2]"]
        if self.followed:
            lines.append(f"    course__follow(s, f[4], c[3], rows, x, v, {int(self.reads_velocity)}, now)")
        if self.pair_kinds:
            lines += ["    for i in range(3 * rows):", "        s[a + i] = 0.0"]
            if self.works:
                lines.append("        s[w + i] = 0.0")
        for number, pair in enumerate(self.pair_kinds):
            at, count = FIRST_LISTS + LISTS * number, FIRST_COUNTS + COUNTS * number
            lists = ", ".join(f"n[{at + one}]" for one in range(LISTS))
            words = {"t": f"f[{SCRATCH}]", "z": f"f[{SCRATCH + 1 + number}]", "strip": "0", "strips": "1"}
            more = "".join(f", {words[one]}" for one in self.pairs(number, pair).more.split(", ") if one)
            lines.append(
                f"    pairs_{number}(s, p, tables, k, {lists}, c[{count}], c[{count + 1}], rows, x, v, a, w, now{more})"
            )
        lines.append("    for j in range(c[0]):")
        for number in range(len(self.kinds)):
            lines += [
                f"        if g[4 * j] == {number}:",
                f"            rows_{number}(s, p, tables, k, g[4 * j + 1], g[4 * j + 2], g[4 * j + 3], rows, x, v, a, w, now)",
            ]
        if self.pair_kinds:
            lines += ["    for j in range(rows - moving):", "        i = moving + j"]
            lines += [f"        s[a + {c} * rows + i] = 0.0" for c in range(self.components)]
        return [*lines, "    return moving", ""]

    def leaf_of_scene(self, node: Node) -> str | None:
        """What an input of the whole scene is called."""
        if node.op != "input" or node.value.name not in SCENE:
            return None
        return "now" if node.value.name == "time" else f"p[{UP + node.value.component}]"


class _Rows:
    """Writes ``rows_<number>``: forces of ``terms`` on their rows, and all accelerations."""

    def __init__(self, motion: MotionText, number: int, terms: tuple[Term, ...]) -> None:
        self.motion, self.number, self.terms = motion, number, terms
        self.head: list[str] = []
        self.body: list[str] = []
        self._loaded: set[str] = set()

    def function(self) -> list[str]:
        """The lines of the function."""
        motion = self.motion
        if motion.turning:
            self._load_rotation()
        forces, twists, offset = [], [], 0
        for number, term in enumerate(self.terms):
            names = self._term(number, term, offset)
            offset += term.size
            if term.trace.force is not None:
                forces.append((names[:3], term.accounted))
            if motion.turning and term.trace.torque is not None:
                twists.append(names[-3:])
        self._accelerate(forces)
        if motion.turning:
            self._bend(twists)
        head = [f"def rows_{self.number}(s, p, tables, k, first, last, q, rows, x, v, a, w, now):"]
        head += [f"    {line}" for line in self.head]
        return [
            *head,
            "    for i in range(first, last):",
            *(f"        {line}" for line in self.body),
            "    return 0",
            "",
        ]

    def _constant(self, name: str, component: int = 0) -> str:
        return f"k[{self.motion.slots.first[name] + component} * rows + i]"

    def _load(self, name: str, text: str) -> str:
        if name not in self._loaded:
            self._loaded.add(name)
            self.body.append(f"{name} = {text}")
        return name

    def _load_rotation(self) -> None:
        q = ", ".join(f"s[x + {3 + c} * rows + i]" for c in range(4))
        rate = ", ".join(f"s[v + {3 + c} * rows + i]" for c in range(4))
        self.body += [f"turn_q = ({q})", f"turn_w = turning__spin_of(turn_q, ({rate}))"]

    def _term(self, number: int, term: Term, offset: int) -> list[str]:
        """Write the force, and torque, of ``term``; the names of their components."""
        motion = self.motion
        names = {one: f"k{number}_{m}" for m, one in enumerate(term.trace.parameters)}
        self.head += [f"{names[one]} = p[q + {offset + m}]" for m, one in enumerate(term.trace.parameters)]
        age = sum("since" in one.trace.reads for one in self.terms[:number])

        def leaf(node: Node) -> str:
            if node.op == "param":
                return names[node.value]
            name, c = node.value.name, node.value.component
            shared = motion.leaf_of_scene(node)
            if shared is not None:
                return shared
            if name in ("position", "velocity"):
                return self._load(f"{name[0]}{AXES[c]}_", f"s[{'x' if name == 'position' else 'v'} + {c} * rows + i]")
            if motion.turning and name in QUATERNION:
                return f"turn_{'q' if name == 'orientation' else 'w'}[{c}]"
            place = age if name == "since" else c
            return self._load(f"c{place}_{name}", self._constant(slot_of(name), place))

        outputs = term.trace.motion if motion.turning else list(term.trace.force or ())
        own = rowwise(outputs)
        fixed = Writer(leaf, prefix=f"f{number}_", starts=motion.starts)
        fixed.write(shared_nodes(outputs, own))
        self.head += fixed.lines
        writer = Writer(leaf, prefix=f"a{number}_", starts=motion.starts)
        writer.names.update(fixed.names)
        found = writer.write(outputs)
        self.body += writer.lines
        if not term.switch:
            return found
        on = f"p[q + {offset + len(names)}]"
        put = [f"o{number}_{c}" for c in range(len(found))]
        self.body += [f"{new} = {old} if {on} != 0.0 else 0.0" for new, old in zip(put, found, strict=True)]
        return put

    def _accelerate(self, forces: list[tuple[list[str], bool]]) -> None:
        """Accelerations: what is stored, and the sum of pairs and fields by the mass."""
        motion, coupled = self.motion, bool(self.motion.pair_kinds)
        self.body.append(f"im = {self._constant('inverse_mass')}")
        for c in range(3):
            parts = [*([f"s[a + {c} * rows + i]"] if coupled else []), *(names[c] for names, _ in forces)]
            total = f" + ({' + '.join(parts)}) * im" if parts else ""
            self.body.append(f"s[a + {c} * rows + i] = {self._constant('stored', c)}{total}")
            if motion.works:
                parts = [f"s[w + {c} * rows + i]"] if coupled else []
                parts += [names[c] for names, accounted in forces if not accounted]
                parts += [self._constant("stored_working", c)] if motion.stored_work else []
                self.body.append(f"s[w + {c} * rows + i] = {' + '.join(parts) or '0.0'}")

    def _bend(self, twists: list[list[str]]) -> None:
        def vector(name: str) -> str:
            return f"({', '.join(self._constant(name, c) for c in range(3))})"

        sums = [" + ".join([self._constant("stored_torque", c), *(one[c] for one in twists)]) for c in range(3)]
        self.body += [
            f"bend = turning__bend_of(turn_q, turn_w, {vector('inertia')}, {vector('inverse_inertia')}, ({', '.join(sums)}))"
        ]
        self.body += [f"s[a + {3 + c} * rows + i] = bend[{c}]" for c in range(4)]


class PairsText:
    """Writes ``pairs_<number>``: the force of a pair law on ``a``, and its opposite on ``b``, added pair by pair."""

    more = ""
    """What it needs besides: the scratch of all sets, ``t``, what is kept for this one, ``z``, and which tiles are summed."""

    def __init__(self, motion: MotionText, number: int, pair: PairKind) -> None:
        self.motion, self.number, self.term, self.how, self.shared = motion, number, *pair
        self.parameters: list[str] = []
        self.fixed: list[str] = []
        self._write()

    def head(self) -> str:
        """The first line of the function."""
        given = "s, p, tables, k, left, right, which, count, q, rows, x, v, a, w, now"
        return f"def pairs_{self.number}({given}{', ' * bool(self.more)}{self.more}):"

    def function(self) -> list[str]:
        """The lines of the function."""
        head = [self.head()]
        if self.how == LISTED:
            inner = ["i = left[m]", "j = right[m]"]
            if self.shared:
                head += [f"    {line}" for line in self.parameters + self.fixed]
            else:
                inner += ["q = which[m]", *self.parameters, *self.fixed]
            inner += [*self._loads("a", "i"), *self._loads("b", "j"), *self.force]
            inner += [*self._add("i", "+"), *self._add("j", "-")]
            return [*head, "    for m in range(count):", *(f"        {line}" for line in inner), "    return 0", ""]
        if self.how in (STILL_LEFT, STILL_RIGHT):
            return self._from_still(head)
        head += [f"    {line}" for line in self.parameters + self.fixed]
        outer = ["i = left[m]", *self._loads("a", "i"), *(f"sum{c} = 0.0" for c in range(3))]
        inner = ["j = left[m + 1 + l]", *self._loads("b", "j"), *self.force]
        inner += [*(f"sum{c} = sum{c} + {name}" for c, name in enumerate(self.names)), *self._add("j", "-")]
        after = self._add("i", "+", [f"sum{c}" for c in range(3)])
        lines = [*head, "    for m in range(count):", *(f"        {line}" for line in outer)]
        lines += ["        for l in range(count - 1 - m):", *(f"            {line}" for line in inner)]
        return [*lines, *(f"        {line}" for line in after), "    return 0", ""]

    def _from_still(self, head: list[str]) -> list[str]:
        """The lines of the function for pairs with rows that do not move, which feel nothing: loops of which compilers make vectors."""
        still, felt, sign = ("a", "b", "-") if self.how == STILL_LEFT else ("b", "a", "+")
        outer = ["j = left[m]"]
        if self.shared:
            head += [f"    {line}" for line in self.parameters + self.fixed]
        else:
            outer += ["q = which[m]", *self.parameters, *self.fixed]
        outer += [*self._loads(still, "j"), "first = right[2 * m]", "last = right[2 * m + 1]"]
        inner = [*self._loads(felt, "i"), *self.force, *self._add("i", sign)]
        lines = [*head, "    for m in range(count):", *(f"        {line}" for line in outer)]
        lines += ["        for i in range(first, last):", *(f"            {line}" for line in inner)]
        return [*lines, "    return 0", ""]

    def _write(self) -> None:
        """The lines of one pair's force, and of what all pairs of an instance share."""
        term, motion = self.term, self.motion
        names = {one: f"k{m}" for m, one in enumerate(term.trace.parameters)}
        self.parameters = [f"k{m} = p[q + {m}]" for m in range(len(names))]

        def leaf(node: Node) -> str:
            if node.op == "param":
                return names[node.value]
            return motion.leaf_of_scene(node) or variable(node.value)

        outputs = list(term.trace.force or ())
        own = rowwise(outputs) | depends(outputs, ("time",))
        head = Writer(leaf, prefix="f", starts=motion.starts)
        head.write(shared_nodes(outputs, own))
        self.fixed = head.lines
        writer = Writer(leaf, prefix="t", starts=motion.starts)
        writer.names.update(head.names)
        self.names = writer.write(outputs)
        self.force = list(writer.lines)
        if term.switch:
            self.parameters.append(f"on = p[q + {len(names)}]")
            self.force += [f"o{c} = {name} if on != 0.0 else 0.0" for c, name in enumerate(self.names)]
            self.names = [f"o{c}" for c in range(3)]

    def _loads(self, side: str, row: str) -> list[str]:
        """Lines that load what the force reads of the row on ``side``."""
        found = {n.value for n in walk(self.term.trace.force or ()) if n.op == "input" and n.value.side == side}
        lines, turned = [], False
        for one in sorted(found):
            if one.name in SCENE:
                continue
            if one.name == "angular_velocity" and self.motion.turning and not turned:
                q = ", ".join(f"s[x + {3 + c} * rows + {row}]" for c in range(4))
                rate = ", ".join(f"s[v + {3 + c} * rows + {row}]" for c in range(4))
                lines.append(f"{side}_spin = turning__spin_of(({q}), ({rate}))")
                turned = True
            lines.append(f"{variable(one)} = {self._place(one, side, row)}")
        return lines

    def _place(self, one: Input, side: str, row: str) -> str:
        if one.name in ("position", "velocity"):
            return f"s[{'x' if one.name == 'position' else 'v'} + {one.component} * rows + {row}]"
        if self.motion.turning and one.name == "orientation":
            return f"s[x + {3 + one.component} * rows + {row}]"
        if self.motion.turning and one.name == "angular_velocity":
            return f"{side}_spin[{one.component}]"
        return f"k[{self.motion.slots.first[slot_of(one.name)] + one.component} * rows + {row}]"

    def _add(self, row: str, sign: str, names: Sequence[str] = ()) -> list[str]:
        lines = []
        for target in ("a", *(() if self.term.accounted else ("w",))):
            for c, name in enumerate(names or self.names):
                place = f"s[{target} + {c} * rows + {row}]"
                lines.append(f"{place} = {place} {sign} {name}")
        return lines


__all__ = ["PLACES", "ROTATION", "MotionText", "PairsText", "RowSlots"]
