"""The text of ``jacobians``: the derivatives of a motion's accelerations by places and velocities, for drivers to call.

``jacobians(f, n, x, v, jx, jv, now)`` adds, for rows i and j of one block (of one group: others do not act on one another), the derivative of
component r of i's acceleration by component c of j's place [1/s^2] to ``s[jx + e]``, e = ``d[h + i] + r * d[h + M + i] + d[h + 2 M + j] + c``,
and that by its velocity [1/s] to ``s[jv + e]``: ``s = f[0]``, ``d = n[2]``, M rows that move, h = `xpheve.loop.drivers.implicit.HEADER`. So the
stepper says how matrices lie: where the first line of a row begins in its block's, how wide that is, and the row's first column. The caller puts
zeros there before.

The derivatives are those of the laws' traces (`xpheve.trace.derivative`). Where some force is a kernel written by hand there is no trace to
derive: then all are differences of ``forces``, one call for each column of the largest block.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from xpheve.loop.couples import LISTED, variable
from xpheve.loop.drivers.implicit import HEADER
from xpheve.loop.fields import AXES
from xpheve.loop.motion import COUNTS, FIRST_COUNTS, FIRST_LISTS, LISTS, STILL_LEFT, STILL_RIGHT
from xpheve.loop.terms import SCENE, Term, depends, rowwise, shared_nodes, slot_of
from xpheve.trace.derivative import is_zero, jacobian
from xpheve.trace.emit import Writer
from xpheve.trace.graph import Node, Parameter, walk

if TYPE_CHECKING:
    from xpheve.loop.motion import MotionText
    from xpheve.loop.text import PairKind
    from xpheve.trace.law_trace import LawTrace

PLACES_OF = {"position": "jx", "velocity": "jv"}
"""What is derived by, and where that goes."""

Slope = tuple[str, str, int, int, Node]
"""Side and input, row and column of a derivative that is not zero everywhere."""


def jacobian_text(motion: MotionText) -> str:
    """The text that defines ``jacobians`` for the rows that ``motion`` has the ``forces`` of; there must be no rotation."""
    if any(is_by_hand(term) for term in motion.terms):
        return DIFFERENCES
    lines: list[str] = []
    for number, kind in enumerate(motion.kinds):
        lines += _rows(motion, number, kind)
    for number, pair in enumerate(motion.pair_kinds):
        lines += _pairs(motion, number, pair)
    return "\n".join([*lines, *_entry(motion)]) + "\n"


def is_by_hand(term: Term) -> bool:
    """Whether the force is a kernel written by hand, which has no derivative."""
    return any(node.op in ("kernel", "pick") for node in walk(term.trace.force or ()))


def slopes_of_force(trace: LawTrace) -> list[Slope]:
    """The derivatives of the force by places and velocities, but for those that are zero everywhere."""
    if trace.force is None:
        return []
    found = []
    for side in ("a", "b") if trace.pair else ("",):
        for name in PLACES_OF:
            for r, row in enumerate(jacobian(trace, name, side)):
                found += [(side, name, r, c, node) for c, node in enumerate(row) if not is_zero(node)]
    return found


def _entry(motion: MotionText) -> list[str]:
    lines = ["def jacobians(f, n, x, v, jx, jv, now):"]
    lines += ["    s = f[0]", "    p = f[1]", "    tables = f[2]", "    k = f[3]", "    counts = n[0]", "    g = n[1]"]
    lines += ["    d = n[2]", "    rows = counts[1]", "    moving = counts[2]"]
    for number, _ in enumerate(motion.pair_kinds):
        at, count = FIRST_LISTS + LISTS * number, FIRST_COUNTS + COUNTS * number
        lists = ", ".join(f"n[{at + one}]" for one in range(LISTS))
        numbers = f"counts[{count}], counts[{count + 1}], rows, moving"
        lines.append(f"    pair_slopes_{number}(s, p, tables, k, d, {lists}, {numbers}, x, v, jx, jv, now)")
    lines.append("    for j in range(counts[0]):")
    for number in range(len(motion.kinds)):
        numbers = "g[4 * j + 1], g[4 * j + 2], g[4 * j + 3], rows, moving"
        lines += [f"        if g[4 * j] == {number}:"]
        lines += [f"            row_slopes_{number}(s, p, tables, k, d, {numbers}, x, v, jx, jv, now)"]
    return [*lines, "    return 0", ""]


def _place(motion: MotionText, name: str, component: int, row: str) -> str:
    """Where a number that a law reads of ``row`` lies."""
    if name in ("position", "velocity"):
        return f"s[{'x' if name == 'position' else 'v'} + {component} * rows + {row}]"
    return f"k[{motion.slots.first[slot_of(name)] + component} * rows + {row}]"


def _start(row: str) -> list[str]:
    """Lines that find where the lines of a row begin in its matrix, and how wide it is."""
    return [f"at_{row} = d[{HEADER} + {row}]", f"width_{row} = d[{HEADER} + moving + {row}]"]


def _put(places: Sequence[tuple[str, str, str]], place: str, r: int, c: int, value: str) -> list[str]:
    """Lines that add ``value``: for each of (row, column, factor)."""
    lines = []
    for row, column, factor in places:
        to = f"s[{place} + at_{row} + {r} * width_{row} + column_{column} + {c}]"
        lines.append(f"{to} = {to} + {value} * {factor}")
    return lines


# Fields --------------------------------------------------------------------------------------------------------------


def _rows(motion: MotionText, number: int, terms: Sequence[Term]) -> list[str]:
    """The function for rows of one law set."""
    head: list[str] = []
    body = [*_start("i"), f"column_i = d[{HEADER} + 2 * moving + i]"]
    body.append(f"im = k[{motion.slots.first['inverse_mass']} * rows + i]")
    loaded: set[str] = set()
    sums: dict[tuple[str, int, int], list[str]] = {}
    offset = ages = 0
    for m, term in enumerate(terms):
        names = {one: f"k{m}_{k}" for k, one in enumerate(term.trace.parameters)}
        age, own = ages, offset
        offset += term.size
        ages += "since" in term.trace.reads

        def leaf(node: Node, names: dict[Parameter, str] = names, age: int = age) -> str:
            if node.op == "param":
                return names[node.value]
            shared = motion.leaf_of_scene(node)
            if shared is not None:
                return shared
            name, c = node.value.name, age if node.value.name == "since" else node.value.component
            called = f"{name[0]}{AXES[c]}_" if name in ("position", "velocity") else f"c{c}_{name}"
            if called not in loaded:
                loaded.add(called)
                body.append(f"{called} = {_place(motion, name, c, 'i')}")
            return called

        slopes = slopes_of_force(term.trace)
        if not slopes:
            continue
        outputs = [slope[-1] for slope in slopes]
        head += [f"{names[one]} = p[q + {own + k}]" for k, one in enumerate(term.trace.parameters)]
        fixed = Writer(leaf, prefix=f"f{m}_", starts=motion.starts)
        fixed.write(shared_nodes(outputs, rowwise(outputs)))
        head += fixed.lines
        writer = Writer(leaf, prefix=f"a{m}_", starts=motion.starts)
        writer.names.update(fixed.names)
        found = writer.write(outputs)
        body.extend(writer.lines)
        if term.switch:
            on = f"p[q + {own + len(names)}]"
            body.extend(f"o{m}_{k} = {name} if {on} != 0.0 else 0.0" for k, name in enumerate(found))
            found = [f"o{m}_{k}" for k in range(len(found))]
        for (_, by, r, c, _), name in zip(slopes, found, strict=True):
            sums.setdefault((PLACES_OF[by], r, c), []).append(name)
    for (place, r, c), parts in sorted(sums.items()):
        value = parts[0] if len(parts) == 1 else f"({' + '.join(parts)})"
        body.extend(_put([("i", "i", "im")], place, r, c, value))
    call = "s, p, tables, k, d, first, last, q, rows, moving, x, v, jx, jv, now"
    lines = [f"def row_slopes_{number}({call}):", *(f"    {line}" for line in head)]
    return [*lines, "    for i in range(first, last):", *(f"        {line}" for line in body), "    return 0", ""]


# Pairs ---------------------------------------------------------------------------------------------------------------


def _pairs(motion: MotionText, number: int, pair: PairKind) -> list[str]:
    """The function for one pair law: its force on ``a``, row i, and the opposite on ``b``, row j."""
    term = pair.term
    names = {one: f"k{m}" for m, one in enumerate(term.trace.parameters)}

    def leaf(node: Node) -> str:
        if node.op == "param":
            return names[node.value]
        return motion.leaf_of_scene(node) or variable(node.value)

    slopes = slopes_of_force(term.trace)
    outputs = [slope[-1] for slope in slopes]
    head = [f"k{m} = p[q + {m}]" for m in range(len(names))]
    fixed = Writer(leaf, prefix="f", starts=motion.starts)
    fixed.write(shared_nodes(outputs, rowwise(outputs) | depends(outputs, ("time",))))
    head += fixed.lines
    writer = Writer(leaf, prefix="t", starts=motion.starts)
    writer.names.update(fixed.names)
    found = writer.write(outputs)
    force = list(writer.lines)
    if term.switch:
        head.append(f"on = p[q + {len(names)}]")
        force += [f"o{k} = {name} if on != 0.0 else 0.0" for k, name in enumerate(found)]
        found = [f"o{k}" for k in range(len(found))]
    mass = motion.slots.first["inverse_mass"]
    sides = {"a": "i", "b": "j"}

    def loads(side: str) -> list[str]:
        row = sides[side]
        read = {
            n.value for n in walk(outputs) if n.op == "input" and n.value.side == side and n.value.name not in SCENE
        }
        return [f"{variable(one)} = {_place(motion, one.name, one.component, row)}" for one in sorted(read)]

    def put(row: str, column: str, sign: str) -> list[str]:
        lines = [f"im_{row} = {sign}k[{mass} * rows + {row}]", *_start(row)]
        lines.append(f"column_{column} = d[{HEADER} + 2 * moving + {column}]")
        for (side, by, r, c, _), name in zip(slopes, found, strict=True):
            if sides[side] == column:
                lines += _put([(row, column, f"im_{row}")], PLACES_OF[by], r, c, name)
        return lines

    act = []
    for row, column, sign in (("i", "i", ""), ("i", "j", ""), ("j", "i", "-"), ("j", "j", "-")):
        moves = f"if {row} < moving:" if row == column else "if i < moving and j < moving:"
        act += [moves, *(f"    {line}" for line in put(row, column, sign))]
    call = "s, p, tables, k, d, left, right, which, count, q, rows, moving, x, v, jx, jv, now"
    lines = [f"def pair_slopes_{number}({call}):"]
    if pair.how == LISTED:
        inner = ["i = left[m]", "j = right[m]"]
        if pair.shared:
            lines += [f"    {line}" for line in head]
        else:
            inner += ["q = which[m]", *head]
        inner += [*loads("a"), *loads("b"), *force, *act]
        return [*lines, "    for m in range(count):", *(f"        {line}" for line in inner), "    return 0", ""]
    if pair.how in (STILL_LEFT, STILL_RIGHT):
        still, moved = ("i", "j") if pair.how == STILL_LEFT else ("j", "i")
        outer = [f"{still} = left[m]", *([] if pair.shared else ["q = which[m]"]), *head]
        lines += ["    for m in range(count):", *(f"        {line}" for line in outer)]
        lines.append(f"        for {moved} in range(right[2 * m], right[2 * m + 1]):")
        inner = [*loads("a"), *loads("b"), *force, *act]
        return [*lines, *(f"            {line}" for line in inner), "    return 0", ""]
    lines += [f"    {line}" for line in head]
    lines += ["    for m in range(count):", "        i = left[m]", *(f"        {line}" for line in loads("a"))]
    inner = ["j = left[m + 1 + l]", *loads("b"), *force, *act]
    return [
        *lines,
        "        for l in range(count - 1 - m):",
        *(f"            {line}" for line in inner),
        "    return 0",
        "",
    ]


DIFFERENCES = """
def jacobians(f, n, x, v, jx, jv, now):
    return differences(f, n, x, v, jx, jv, now)
"""
