"""Tables that laws look up: given points, with straight lines or monotone cubics between them.

``Table`` is declared in the class body of a law, like `Param`, and called in its expressions. The numbers lie in a flat buffer, in the
layout of `xpheve.kernels.table`, whose functions the text of a law calls; here are their siblings for arrays, with the same arithmetic.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from xpheve.errors import DimensionError, InvalidValueError
from xpheve.kernels import table as kernel
from xpheve.trace.graph import Node, at, author_place, equal, walk
from xpheve.units import NONE, Dimension, parse, show

if TYPE_CHECKING:
    from xpheve.trace.values import Traced

Array = NDArray[np.float64]

OUTSIDE = ("error", "hold", "extend")
KINDS = ("linear", "cubic")


class TableRead:
    """Something that is looked up in the numbers of a table: its value, or one of its derivatives.

    ``kind`` names the function of `xpheve.kernels.table`, ``base`` is the table that has the numbers, ``dim`` the dimension of the result.
    """

    kind: str
    base: Table
    dim: Dimension

    @property
    def slope(self) -> TableRead | None:
        """The derivative, to be looked up in its turn; None where it is 0 everywhere."""
        raise NotImplementedError

    def __call__(self, x: Any) -> Any:
        """What the table has at ``x``: a float, an array of any shape, or what stands for one while a law is traced."""
        from xpheve.trace.values import Traced

        if isinstance(x, Traced):
            return self._traced(x)
        numbers, count = self.base.numbers(), self.base.count
        if isinstance(x, np.ndarray):
            found = ARRAYS[self.kind](numbers, 0, count, np.asarray(x, dtype=float))
            return found.view(type(x)) if x.ndim else found
        return float(FLOATS[self.kind](self.base.listed, 0, count, float(x)))

    def _traced(self, x: Traced) -> Traced:
        """What stands for the look-up at ``x`` while a law is read; raises `DimensionError`."""
        recording, nodes = x.recording, [x.recording.number(node) for node in x.nodes]
        for node in nodes:
            if node.dim is not None and not equal(node.dim, self.base.dim_x):
                wrong = DimensionError(
                    f"{recording.where}: the table {self.base.name or 'looked up'} is over {show(self.base.dim_x)}, not over "
                    f"{show(node.dim)}. {at(author_place())}".rstrip()
                )
                recording.note(wrong)
                raise wrong
        return type(x)(recording, [recording.graph.table(self, node, self.dim) for node in nodes], x.form)


class Table(TableRead):
    """A function that is given by points, to be declared in the class body of a law and called in its expressions.

    Parameters
    ----------
    x, y
        The points: finite, as many of one as of the other, at least two; ``x`` strictly increasing.
    unit_x, unit
        Of ``x`` and of ``y``. The numbers are converted to SI, so that ``unit_x="km"`` may be said; ``"1"`` for pure numbers.
    kind
        ``"linear"``: straight lines. ``"cubic"``: piecewise cubics with continuous slope that rise where the points rise and have
        extremes only at points (F. N. Fritsch, J. Butland, SIAM J. Sci. Stat. Comput. 5, 300 (1984), with the weights and the
        ends of C. Moler, Numerical Computing with MATLAB (2004), section 3.6); of two points, a straight line.
    outside
        Beyond the first and last point: ``"error"`` gives NaN, which stops a run; ``"hold"`` the value of the last point; ``"extend"``
        goes on in a straight line.
    doc
        One sentence for people.

    Raises
    ------
    InvalidValueError
        If the points are not as said, or so steep that a slope is beyond the range of a float.
    UnitError
        If a unit is none.

    Examples
    --------
    >>> density = Table((0, 11), (1.225, 0.3639), unit_x="km", unit="kg/m^3", outside="hold")
    >>> density(0.0), density(20000.0)
    (1.225, 0.3639)
    """

    def __init__(
        self,
        x: Iterable[float],
        y: Iterable[float],
        *,
        unit_x: str = "1",
        unit: str = "1",
        kind: str = "linear",
        outside: str = "error",
        doc: str = "",
    ) -> None:
        if kind not in KINDS:
            raise InvalidValueError(f"Table: kind = {kind!r}: choose one of {', '.join(KINDS)}")
        if outside not in OUTSIDE:
            raise InvalidValueError(f"Table: outside = {outside!r}: choose one of {', '.join(OUTSIDE)}")
        self.name = self.owner = ""
        self.kind, self.outside, self.doc = kind, outside, doc
        self.unit_x, self.unit = unit_x, unit
        self.x, self.dim_x = _in_si(x, unit_x, "x")
        self.y, self.dim = _in_si(y, unit, "y")
        self.count = len(self.x)
        self._check()
        self._numbers = _layout(self.x, self.y, kind, outside)
        self.listed: list[float] = self._numbers.tolist()
        if not np.isfinite(self._numbers[kernel.HEAD :]).all():
            raise InvalidValueError(f"Table: {self!r} is so steep that a slope is beyond the range of a float")

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name
        self.owner = getattr(owner, "id", "") or owner.__name__

    def __repr__(self) -> str:
        named = f"{self.owner}.{self.name}" if self.name else "Table"
        span = f"{self.x[0]!r} to {self.x[-1]!r}" if self.count else "nothing"
        return f"<{named}: {self.kind}, {self.count} points, {span} {show(self.dim_x)}>"

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "slope"}

    def _check(self) -> None:
        if len(self.y) != self.count:
            raise InvalidValueError(f"Table: {self.count} x and {len(self.y)} y: give one y for each x")
        if self.count < 2:
            raise InvalidValueError(f"Table: x = {self.x!r}: at least two points are needed")
        for k in range(1, self.count):
            if not self.x[k - 1] < self.x[k]:
                raise InvalidValueError(
                    f"Table: x[{k}] = {self.x[k]!r} comes after x[{k - 1}] = {self.x[k - 1]!r}: sort the points, and give each x once"
                )

    @property
    def base(self) -> Table:  # type: ignore[override,unused-ignore]
        """The table itself."""
        return self

    @cached_property
    def slope(self) -> TableRead:
        """The derivative dy/dx, as something to look up."""
        return Derived(self, f"{self.kind}_slope", 1)

    def numbers(self) -> Array:
        """The flat data, read-only, in the layout of `xpheve.kernels.table`."""
        return self._numbers


class Derived(TableRead):
    """The derivative of ``order`` of a table."""

    def __init__(self, base: Table, kind: str, order: int) -> None:
        self.base, self.kind, self.order = base, kind, order
        self.dim = tuple(y - order * x for x, y in zip(base.dim_x, base.dim, strict=True))

    def __repr__(self) -> str:
        return f"<{self.kind} of {self.base!r}>"

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "slope"}

    @cached_property
    def slope(self) -> TableRead | None:
        """The next derivative; None where it is 0 between all points."""
        further = {"cubic_slope": "cubic_bend", "cubic_bend": "cubic_third"}.get(self.kind)
        return None if further is None else Derived(self.base, further, self.order + 1)


def tables_of(nodes: Sequence[Node]) -> list[Table]:
    """The tables that ``nodes`` look up, each once, in the order of `walk`."""
    return list(dict.fromkeys(node.value.base for node in walk(nodes) if node.op == "table"))


def packed(tables: Sequence[Table]) -> tuple[Array, dict[Table, int]]:
    """The numbers of ``tables`` one after another, and where each begins."""
    starts: dict[Table, int] = {}
    total = 0
    for table in tables:
        starts[table] = total
        total += len(table.numbers())
    return np.concatenate([table.numbers() for table in tables]) if tables else np.zeros(0), starts


# Making


def _in_si(values: Iterable[float], unit: str, what: str) -> tuple[tuple[float, ...], Dimension]:
    above, below, dim = parse(unit) if unit != "1" else (1, 1, NONE)
    found = []
    try:
        listed = list(values)
    except TypeError:
        raise InvalidValueError(f"Table: {what} = {values!r}: a list of numbers is needed") from None
    for k, given in enumerate(listed):
        try:
            number = math.nan if isinstance(given, (bool, str)) else float(given) * above / below
        except (TypeError, ValueError, OverflowError):
            number = math.nan
        if not math.isfinite(number):
            raise InvalidValueError(f"Table: {what}[{k}] = {given!r}: a finite number in {unit} is needed")
        found.append(number)
    return tuple(found), dim


def _layout(x: tuple[float, ...], y: tuple[float, ...], kind: str, outside: str) -> Array:
    """The numbers as `xpheve.kernels.table` wants them."""
    always = (-math.inf, math.inf)
    ends = (x[0], x[-1])
    head = {"error": (*ends, *always), "hold": (*always, *ends), "extend": (*always, *always)}[outside]
    xs, ys = np.array(x), np.array(y)
    with np.errstate(all="ignore"):
        pieces = _lines(xs, ys) if kind == "linear" else _cubics(xs, ys)
    numbers: Array = np.concatenate([head, np.append(xs[:1], xs), np.append(ys[:1], ys), *pieces])
    numbers.flags.writeable = False
    return numbers


def _lines(x: Array, y: Array) -> list[Array]:
    """Slopes of the pieces."""
    steep = np.diff(y) / np.diff(x)
    return [np.concatenate([steep[:1], steep, steep[-1:]])]


def _cubics(x: Array, y: Array) -> list[Array]:
    """Slopes at the anchors, and the coefficients of square and cube."""
    h = np.diff(x)
    steep = np.diff(y) / h
    d = _monotone_slopes(h, steep)
    square = (3.0 * steep - 2.0 * d[:-1] - d[1:]) / h
    cube = (d[:-1] + d[1:] - 2.0 * steep) / h / h
    return [np.append(d[:1], d), np.concatenate([[0.0], square, [0.0]]), np.concatenate([[0.0], cube, [0.0]])]


def _monotone_slopes(h: Array, steep: Array) -> Array:
    """Slopes at the points: weighted harmonic means of those of the lines beside, 0 at extremes."""
    d: Array = np.full(len(steep) + 1, steep[0])
    if len(steep) == 1:
        return d
    before, behind = steep[:-1], steep[1:]
    w, v = 2.0 * h[1:] + h[:-1], h[1:] + 2.0 * h[:-1]
    rising = np.sign(before) * np.sign(behind) > 0.0
    d[1:-1] = np.where(rising, (w + v) / (w / before + v / behind), 0.0)
    d[0] = _end_slope(h[0], h[1], steep[0], steep[1])
    d[-1] = _end_slope(h[-1], h[-2], steep[-1], steep[-2])
    return d


def _end_slope(h: float, next_h: float, steep: float, next_steep: float) -> float:
    """That of the parabola through three points, cut so that the shape is kept."""
    found = ((2.0 * h + next_h) * steep - h * next_steep) / (h + next_h)
    if found * steep <= 0.0:
        return 0.0
    if steep * next_steep <= 0.0 and abs(found) > 3.0 * abs(steep):
        return 3.0 * steep
    return float(found)


# Looking up, for arrays: the arithmetic of `xpheve.kernels.table`


def _piece(tables: Array, start: int, count: int, x: Any) -> Any:
    first = start + kernel.HEAD + 1
    return start + kernel.HEAD + np.searchsorted(tables[first : first + count], x, side="right")


def _held(tables: Array, start: int, x: Any) -> Any:
    inside = np.where((tables[start] <= x) & (x <= tables[start + 1]), x, np.nan)
    above = np.where(inside < tables[start + 2], tables[start + 2], inside)
    return np.where(above > tables[start + 3], tables[start + 3], above)


def _moves(tables: Array, start: int, x: Any) -> Any:
    inside = np.where((tables[start] <= x) & (x <= tables[start + 1]), 1.0, np.nan)
    return np.where((tables[start + 2] <= x) & (x <= tables[start + 3]), inside, 0.0 * inside)


def _linear(tables: Array, start: int, count: int, x: Any) -> Any:
    u = _held(tables, start, x)
    k = _piece(tables, start, count, u)
    n = count + 1
    return tables[k + n] + (u - tables[k]) * tables[k + 2 * n]


def _linear_slope(tables: Array, start: int, count: int, x: Any) -> Any:
    k = _piece(tables, start, count, x)
    return tables[k + 2 * (count + 1)] * _moves(tables, start, x)


def _cubic(tables: Array, start: int, count: int, x: Any) -> Any:
    u = _held(tables, start, x)
    k = _piece(tables, start, count, u)
    n = count + 1
    t = u - tables[k]
    return tables[k + n] + t * (tables[k + 2 * n] + t * (tables[k + 3 * n] + t * tables[k + 4 * n]))


def _cubic_slope(tables: Array, start: int, count: int, x: Any) -> Any:
    k = _piece(tables, start, count, x)
    n = count + 1
    t = x - tables[k]
    found = tables[k + 2 * n] + t * (2.0 * tables[k + 3 * n] + t * (3.0 * tables[k + 4 * n]))
    follows = _moves(tables, start, x)
    return np.where(follows == 0.0, 0.0, found * follows)


def _cubic_bend(tables: Array, start: int, count: int, x: Any) -> Any:
    k = _piece(tables, start, count, x)
    n = count + 1
    found = 2.0 * tables[k + 3 * n] + (x - tables[k]) * (6.0 * tables[k + 4 * n])
    follows = _moves(tables, start, x)
    return np.where(follows == 0.0, 0.0, found * follows)


def _cubic_third(tables: Array, start: int, count: int, x: Any) -> Any:
    k = _piece(tables, start, count, x)
    return 6.0 * tables[k + 4 * (count + 1)] * _moves(tables, start, x)


ARRAYS: dict[str, Callable[..., Any]] = {
    "linear": _linear,
    "linear_slope": _linear_slope,
    "cubic": _cubic,
    "cubic_slope": _cubic_slope,
    "cubic_bend": _cubic_bend,
    "cubic_third": _cubic_third,
}
"""By kind, for arrays; `xpheve.trace.emit` calls them ``np_table__linear`` and so on."""

FLOATS: dict[str, Callable[..., float]] = {kind: getattr(kernel, kind) for kind in ARRAYS}
"""By kind, for floats; in the text ``table__linear`` and so on."""
