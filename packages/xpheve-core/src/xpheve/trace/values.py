"""What a law's methods compute with while they are read: values that look like the batches of `xpheve.laws.view` and write a graph.

A value has the shape that it would have in NumPy, with n for the number of objects, which a formula never knows: ``()`` a number, ``(3,)`` one
vector for all objects, ``(n, 1)`` a number an object, ``(n, 3)`` a vector an object, ``(n, 4)`` a quaternion, ``(n,)`` what ``[:, k]`` gives.
What NumPy would refuse, or spread over a square of n by n, is refused here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple, NoReturn

import numpy as np

from xpheve.trace.graph import Node
from xpheve.trace.recording import Recording

Make = Callable[..., Node]


class Form(NamedTuple):
    """Shape of a value: one for each object or one for all, and of how many components; None for a bare number."""

    each: bool
    width: int | None

    def __str__(self) -> str:
        parts = (["n"] if self.each else []) + ([str(self.width)] if self.width is not None else [])
        return f"({', '.join(parts)}{',' if len(parts) == 1 else ''})"


NUMBER = Form(False, None)
VECTOR = Form(False, 3)
COLUMN = Form(True, 1)
VECTORS = Form(True, 3)
LIST = Form(True, None)


class Count:
    """The number of objects, as ``len`` and ``.shape`` would give it: a formula holds for any, and so may not ask."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording

    def _refuse(self, *_: Any) -> NoReturn:
        self._recording.refuse(
            "asks for the number of objects, but a formula is said of each object, whatever their number. "
            "Start from np.zeros_like(v), 0.0 * v or xp.vector(x, y, z)"
        )

    __index__ = __int__ = __float__ = __bool__ = _refuse
    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = _refuse
    __lt__ = __le__ = __gt__ = __ge__ = __floordiv__ = __mod__ = _refuse

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Count) or self._refuse()

    __hash__ = object.__hash__

    def __repr__(self) -> str:
        return "n"


class Traced:
    """A value of a law that is being read.

    ``store`` is shared by a value and its slices, as memory is in NumPy; ``at`` are the places of this one's components in it. What belongs to
    a view or a parameter is read-only.
    """

    __slots__ = ("at", "form", "locked", "recording", "store")

    def __init__(
        self,
        recording: Recording,
        nodes: Iterable[Node],
        form: Form,
        locked: str = "",
        at: tuple[int, ...] | None = None,
    ) -> None:
        self.recording = recording
        self.form = form
        self.locked = locked
        """What it belongs to, such as ``body.position``; empty for temporaries."""
        self.store: list[Node] = nodes if at is not None and isinstance(nodes, list) else list(nodes)
        self.at = tuple(range(len(self.store))) if at is None else at

    @property
    def nodes(self) -> tuple[Node, ...]:
        """One node a component."""
        return tuple(self.store[k] for k in self.at)

    def spread(self, width: int) -> tuple[Node, ...]:
        """The nodes, one repeated as often as needed."""
        nodes = self.nodes
        return nodes if len(nodes) == width else nodes * width

    @property
    def is_truth(self) -> bool:
        """Whether all of it are truths."""
        return all(node.truth for node in self.nodes)

    def __repr__(self) -> str:
        return f"<traced {'truth' if self.is_truth else 'value'} of shape {self.form}>"

    # Shape

    @property
    def shape(self) -> tuple[Any, ...]:
        count = (Count(self.recording),) if self.form.each else ()
        return count if self.form.width is None else (*count, self.form.width)

    @property
    def ndim(self) -> int:
        return self.form.each + (self.form.width is not None)

    @property
    def dtype(self) -> np.dtype[Any]:
        return np.dtype(bool if self.is_truth else float)

    @property
    def size(self) -> Any:
        return self.form.width or 1 if not self.form.each else Count(self.recording)

    def copy(self) -> Traced:
        return Traced(self.recording, self.nodes, self.form)

    __copy__ = copy

    def __deepcopy__(self, memo: Any) -> Traced:
        return self.copy()

    def astype(self, dtype: Any, **_: Any) -> Traced:
        if np.dtype(dtype) != np.dtype(float):
            self.recording.refuse(f"astype({dtype!r}): numbers of laws are float64")
        return Traced(self.recording, [self.recording.number(node) for node in self.nodes], self.form)

    # Vectors

    def _vector(self, what: str) -> tuple[Node, ...]:
        if self.form.width != 3:
            self.recording.refuse(f"{what} of a value of shape {self.form}; a vector, (n, 3) or (3,), has it")
        return tuple(self.recording.number(node) for node in self.nodes)

    def norm(self) -> Traced:
        """Length of each vector."""
        return elementwise(self.recording, "sqrt", self.dot(self))

    def dot(self, other: Any) -> Traced:
        """Scalar product, object by object."""
        self._vector("dot()")
        product = elementwise(self.recording, "*", self, other)
        x, y, z = product._vector("dot()")
        op = self.recording.op
        return Traced(self.recording, [op("+", op("+", x, y), z)], Form(product.form.each, 1))

    def cross(self, other: Any) -> Traced:
        """Vector product, object by object."""
        return cross(self.recording, self, other)

    def _component(self, k: int) -> Traced:
        self._vector(f".{'xyz'[k]}")
        return self._part((k,), Form(self.form.each, 1))

    @property
    def x(self) -> Traced:
        return self._component(0)

    @property
    def y(self) -> Traced:
        return self._component(1)

    @property
    def z(self) -> Traced:
        return self._component(2)

    # Parts

    def _part(self, which: Sequence[int], form: Form) -> Traced:
        return Traced(self.recording, self.store, form, self.locked, tuple(self.at[k] for k in which))

    def __getitem__(self, key: Any) -> Traced:
        which, form, copied = self._selected(key)
        found = self._part(which, form)
        return found.copy() if copied else found

    def __setitem__(self, key: Any, value: Any) -> None:
        self._unlocked()
        which, form, _ = self._selected(key)
        part = self._part(which, form)
        given = coerced(self.recording, value)
        together(self.recording, (part, given), into=form)
        for place, node in zip(part.at, given.spread(len(part.at)), strict=True):
            self.store[place] = self.recording.number(node)

    def _selected(self, key: Any) -> tuple[Sequence[int], Form, bool]:
        """Which components ``key`` names, their shape, and whether NumPy copies them."""
        keys = key if isinstance(key, tuple) else (key,)
        keys = tuple(one for one in keys if one is not Ellipsis)
        if any(isinstance(one, Traced) or _is_mask(one) for one in keys):
            self.recording.refuse("an index that depends on the state: choose with np.where(condition, a, b)")
        if self.form.each and len(keys) < len(key if isinstance(key, tuple) else (key,)):  # [..., k]: of the last axis
            keys = (slice(None), *keys) if len(keys) < self.ndim else keys
        all_of_them = range(len(self.at))
        if self.form.each:
            if keys and not (isinstance(keys[0], slice) and keys[0] == slice(None)):
                self._refuse_row(keys[0])
            keys = keys[1:]
            if not keys:
                return all_of_them, self.form, False
            if self.form.width is None and keys == (None,):
                return all_of_them, COLUMN, False
        elif keys and keys[0] is None and self.form.width is not None:  # (3,) as (1, 3): spreads alike
            keys = keys[1:]
        if not keys:
            return all_of_them, self.form, False
        if self.form.width is None or len(keys) != 1:
            self.recording.refuse(f"[{_shown(key)}] of a value of shape {self.form}: there is no such part")
        return self._of_last_axis(keys[0], key)

    def _of_last_axis(self, one: Any, key: Any) -> tuple[Sequence[int], Form, bool]:
        width = self.form.width or 0
        if isinstance(one, slice):
            which = range(width)[one]
            if not which:
                self.recording.refuse(f"[{_shown(key)}]: there are {width} components, and none of them is taken")
            return which, Form(self.form.each, len(which)), False
        if isinstance(one, (int, np.integer)) and not isinstance(one, bool):
            if not -width <= one < width:
                self.recording.refuse(f"[{_shown(key)}]: there are {width} components, counted from 0")
            return (int(one) % width,), Form(self.form.each, None), False
        if isinstance(one, (list, np.ndarray)) and all(isinstance(k, (int, np.integer)) for k in one):
            picked = [range(width)[k] for k in one]
            return picked, Form(self.form.each, len(picked)), True
        self.recording.refuse(f"[{_shown(key)}] of a value of shape {self.form}: write [:, k] or [:, k:m]")

    def _refuse_row(self, key: Any) -> NoReturn:
        if isinstance(key, (int, np.integer)):
            vector = self.form.width == 3 and 0 <= key < 3
            component = f"write .{'xyz'[key]}" if vector else "write [:, k]"
            self.recording.refuse(
                f"[{key}] of a batch of shape {self.form} is the row of one object, not a component of all: {component}"
            )
        self.recording.refuse(
            f"[{_shown(key)}] of a batch of shape {self.form} takes some of the objects; a formula says it for each: "
            "np.where(condition, a, b)"
        )

    def reshape(self, *shape: Any) -> Traced:
        wanted = shape[0] if len(shape) == 1 and isinstance(shape[0], tuple) else shape
        if wanted == (-1, 1) and self.form.each and len(self.at) == 1:
            return self._part((0,), COLUMN)
        self.recording.refuse(f"reshape{wanted!r}: components are put together by np.hstack, and taken by [:, k:m]")

    # In place

    def _unlocked(self) -> None:
        if self.locked:
            self.recording.refuse(
                f"writes into {self.locked}, which is read-only in a formula; make a value of your own, such as "
                f"{self.locked.rpartition('.')[2]} = 1.0 * {self.locked}, and return the force"
            )

    def _in_place(self, found: Traced) -> Traced:
        """Make it ``found``, and with it all that share its memory."""
        if self.form == NUMBER:  # numbers do not change in Python
            return found
        self._unlocked()
        if found.form != self.form:
            self.recording.refuse(f"puts a value of shape {found.form} in place of one of shape {self.form}")
        for place, node in zip(self.at, found.nodes, strict=True):
            self.store[place] = node
        return self

    def __iadd__(self, other: Any) -> Traced:
        return self._in_place(self + other)

    def __isub__(self, other: Any) -> Traced:
        return self._in_place(self - other)

    def __imul__(self, other: Any) -> Traced:
        return self._in_place(self * other)

    def __itruediv__(self, other: Any) -> Traced:
        return self._in_place(self / other)

    def __ipow__(self, other: Any) -> Traced:
        return self._in_place(self**other)

    def __iand__(self, other: Any) -> Traced:
        return self._in_place(self & other)

    def __ior__(self, other: Any) -> Traced:
        return self._in_place(self | other)

    # Arithmetic

    def __neg__(self) -> Traced:
        return elementwise(self.recording, "neg", self)

    def __pos__(self) -> Traced:
        return self.astype(float)

    def __abs__(self) -> Traced:
        return elementwise(self.recording, "abs", self)

    def __add__(self, other: Any) -> Traced:
        return elementwise(self.recording, "+", self, other)

    def __radd__(self, other: Any) -> Traced:
        return elementwise(self.recording, "+", other, self)

    def __sub__(self, other: Any) -> Traced:
        return elementwise(self.recording, "-", self, other)

    def __rsub__(self, other: Any) -> Traced:
        return elementwise(self.recording, "-", other, self)

    def __mul__(self, other: Any) -> Traced:
        return elementwise(self.recording, "*", self, other)

    def __rmul__(self, other: Any) -> Traced:
        return elementwise(self.recording, "*", other, self)

    def __truediv__(self, other: Any) -> Traced:
        return elementwise(self.recording, "/", self, other)

    def __rtruediv__(self, other: Any) -> Traced:
        return elementwise(self.recording, "/", other, self)

    def __pow__(self, other: Any) -> Traced:
        return power(self.recording, self, other)

    def __rpow__(self, other: Any) -> Traced:
        return power(self.recording, other, self)

    def __floordiv__(self, other: Any) -> Traced:
        return floor_divided(self.recording, self, other)

    def __rfloordiv__(self, other: Any) -> Traced:
        return floor_divided(self.recording, other, self)

    def __mod__(self, other: Any) -> Traced:
        return remainder(self.recording, self, other)

    def __rmod__(self, other: Any) -> Traced:
        return remainder(self.recording, other, self)

    def __matmul__(self, other: Any) -> Traced:
        return multiplied(self.recording, self, other)

    def __rmatmul__(self, other: Any) -> Traced:
        return multiplied(self.recording, other, self)

    # Comparison and logic

    def __lt__(self, other: Any) -> Traced:
        return elementwise(self.recording, "<", self, other)

    def __le__(self, other: Any) -> Traced:
        return elementwise(self.recording, "<=", self, other)

    def __gt__(self, other: Any) -> Traced:
        return elementwise(self.recording, ">", self, other)

    def __ge__(self, other: Any) -> Traced:
        return elementwise(self.recording, ">=", self, other)

    def __eq__(self, other: object) -> Traced:  # type: ignore[override]
        return elementwise(self.recording, "==", self, other)

    def __ne__(self, other: object) -> Traced:  # type: ignore[override]
        return elementwise(self.recording, "!=", self, other)

    __hash__ = None  # type: ignore[assignment]

    def __and__(self, other: Any) -> Traced:
        return logical(self.recording, "and", self, other)

    __rand__ = __and__

    def __or__(self, other: Any) -> Traced:
        return logical(self.recording, "or", self, other)

    __ror__ = __or__

    def __xor__(self, other: Any) -> Traced:
        return either(self.recording, self, other)

    __rxor__ = __xor__

    def __invert__(self) -> Traced:
        return logical(self.recording, "not", self)

    # What a value that is no number yet cannot say

    def __bool__(self) -> bool:
        return self.recording.decide(self)

    def __float__(self) -> float:
        self.recording.branch("float()")

    def __int__(self) -> int:
        self.recording.branch("int()")

    def __index__(self) -> int:
        self.recording.branch("an index")

    def __complex__(self) -> complex:
        self.recording.branch("complex()")

    def __round__(self, digits: int = 0) -> int:
        self.recording.branch("round()")

    def __floor__(self) -> int:
        self.recording.branch("int()")

    __trunc__ = __ceil__ = __floor__

    def __format__(self, spec: str) -> str:
        return repr(self)  # so that an f-string shows what print shows

    def __len__(self) -> int:
        if self.form.each or self.form.width is None:
            self.recording.branch("len()")
        return self.form.width

    def __iter__(self) -> Iterator[Traced]:
        if self.form.each or self.form.width is None:
            self.recording.branch("iteration")
        return iter([self[k] for k in range(self.form.width)])

    def __contains__(self, item: Any) -> bool:
        self.recording.branch("`in`")

    def item(self, *_: Any) -> float:
        self.recording.branch("float()")

    def tolist(self) -> Any:
        self.recording.branch("float()")

    # NumPy

    def __array__(self, *_: Any, **__: Any) -> NoReturn:
        self.recording.refuse(
            "makes a NumPy array of a traced value, which is no array yet: leave np.asarray, np.array and np.fromiter out; components are put "
            "together by xp.vector(x, y, z) or np.hstack([x, y, z])"
        )

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        from xpheve.trace.numpy_calls import call_ufunc

        return call_ufunc(self.recording, ufunc, method, inputs, options)

    def __array_function__(self, function: Any, types: Any, args: Any, options: Any) -> Any:
        from xpheve.trace.numpy_calls import call_function

        return call_function(self.recording, function, args, options)

    def sum(self, axis: Any = None, **options: Any) -> Any:
        return np.sum(self, axis=axis, **options)

    def mean(self, axis: Any = None, **options: Any) -> Any:
        return np.mean(self, axis=axis, **options)

    def max(self, axis: Any = None, **options: Any) -> Any:
        return np.max(self, axis=axis, **options)

    def min(self, axis: Any = None, **options: Any) -> Any:
        return np.min(self, axis=axis, **options)

    def any(self, axis: Any = None, **options: Any) -> Any:
        return np.any(self, axis=axis, **options)

    def all(self, axis: Any = None, **options: Any) -> Any:
        return np.all(self, axis=axis, **options)

    def clip(self, low: Any = None, high: Any = None) -> Any:
        return np.clip(self, low, high)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        self.recording.refuse(
            f".{name} of a traced value: it has norm(), dot(), cross(), x, y, z, [:, k] and [:, k:m], and NumPy's functions of numbers"
        )


def _is_mask(key: Any) -> bool:
    return isinstance(key, (bool, np.bool_)) or (isinstance(key, np.ndarray) and key.dtype == bool)


def _shown(key: Any) -> str:
    """``key`` as it stands between brackets."""

    def one(part: Any) -> str:
        if isinstance(part, slice):
            text = ":".join("" if end is None else str(end) for end in (part.start, part.stop, part.step))
            return (
                text.removesuffix(":") if part.step is None and part.stop is not None else text[: max(1, len(text) - 1)]
            )
        return "..." if part is Ellipsis else str(part)

    return ", ".join(map(one, key)) if isinstance(key, tuple) else one(key)


def coerced(recording: Recording, value: Any) -> Traced:
    """``value`` as a traced one: numbers, and tuples, lists and arrays of some; raises `TraceError` for what is none."""
    if isinstance(value, Traced):
        return value
    if isinstance(value, (bool, np.bool_)):
        nothing = recording.graph.const(0.0)
        return Traced(recording, [recording.op("==" if value else "!=", nothing, nothing)], NUMBER)
    if isinstance(value, (int, float, np.integer, np.floating)):
        return Traced(recording, [recording.graph.const(float(value))], NUMBER)
    if isinstance(value, np.ndarray) and value.dtype.kind in "fiub":
        return _constant_array(recording, value)
    if isinstance(value, (tuple, list)):
        parts = [coerced(recording, one) for one in value]
        if parts and all(part.form == NUMBER for part in parts):
            return Traced(recording, [part.nodes[0] for part in parts], Form(False, len(parts)))
        recording.refuse(
            f"a {type(value).__name__} of values that differ from object to object: put components together by xp.vector(x, y, z), or "
            "np.hstack([x, y, z]) of columns"
        )
    if value is None:
        recording.refuse("None takes part in a formula: ask `is None` first, and write the formula without it")
    if isinstance(value, Count):
        value._refuse()
    recording.refuse(
        f"{value!r} takes part in a formula: numbers, vectors of three and what the objects have are needed"
    )


def _constant_array(recording: Recording, value: Any) -> Traced:
    plain = np.asarray(value, dtype=float)
    nodes = [recording.graph.const(one) for one in plain.ravel().tolist()]
    if plain.ndim == 0:
        return Traced(recording, nodes, NUMBER)
    if plain.ndim == 1 or (plain.ndim == 2 and plain.shape[0] == 1):
        return Traced(recording, nodes, Form(False, plain.shape[-1]))
    recording.refuse(
        f"an array of shape {plain.shape} takes part in a formula, which holds for any number of objects: numbers, (3,) and (1, 3) do"
    )


def together(recording: Recording, parts: Sequence[Traced], into: Form | None = None) -> Form:
    """The shape that ``parts`` broadcast to, as in NumPy; with ``into`` it must be that."""
    each = any(part.form.each for part in parts)
    widths = [part.form.width for part in parts if part.form.width is not None]
    width = max(widths, default=None) if all(one in (1, max(widths)) for one in widths) else -1
    bare = any(part.form == LIST for part in parts)
    if bare and any(part.form.each and part.form.width is not None for part in parts):
        width = -1
    elif bare:
        width = None if width in (None, 1) else -1
    found = Form(each, width)
    if width == -1 or (into is not None and found != into):
        shapes = " and ".join(str(part.form) for part in parts)
        how = (
            ": [:, k] gives (n,), and so does a norm or sum with axis=1; NumPy does not put it beside (n, 1): "
            "write .x or [:, k:k+1], v.norm() or keepdims=True"
            if bare
            else ""
        )
        recording.refuse(f"values of shapes {shapes} do not go together{how}")
    return found


OF_TRUTHS: dict[Any, str] = {"+": "or", "*": "and", "max": "or", "min": "and", "abs": "", "-": "", "neg": ""}
"""What NumPy makes of operations between truths."""


def elementwise(recording: Recording, op: str | Make, *values: Any) -> Traced:
    """``op`` component by component, after broadcasting; truths count as 1 and 0, but among themselves as in NumPy."""
    plain = _plain_numbers(recording, values)
    if plain is not None:
        return Traced(recording, [op(*plain) if callable(op) else recording.op(op, *plain)], NUMBER)
    parts = [coerced(recording, value) for value in values]
    if op in OF_TRUTHS and all(part.is_truth for part in parts):
        if op in ("-", "neg"):
            recording.refuse("a difference of truths: write ~p for `not p`, and p ^ q for one of two")
        return logical(recording, OF_TRUTHS[op], *parts) if len(parts) > 1 else parts[0]
    form = together(recording, parts)
    make: Make = op if callable(op) else partial(recording.op, op)
    columns = [[recording.number(node) for node in part.spread(form.width or 1)] for part in parts]
    return Traced(recording, [make(*nodes) for nodes in zip(*columns, strict=True)], form)


def _plain_numbers(recording: Recording, values: Sequence[Any]) -> list[Node] | None:
    """The nodes of ``values`` if all are single numbers, as most are in a response; else None."""
    nodes = []
    for value in values:
        if type(value) is Traced and value.form == NUMBER and not value.store[value.at[0]].truth:
            nodes.append(value.store[value.at[0]])
        elif type(value) is float or type(value) is int:
            nodes.append(recording.graph.const(value))
        else:
            return None
    return nodes


def logical(recording: Recording, op: str, *values: Any) -> Traced:
    """``op`` of truths component by component; numbers that are not 0 are true."""
    parts = [coerced(recording, value) for value in values]
    form = together(recording, parts)
    columns = [[recording.truth(node) for node in part.spread(form.width or 1)] for part in parts]
    return Traced(recording, [recording.op(op, *nodes) for nodes in zip(*columns, strict=True)], form)


def either(recording: Recording, one: Any, other: Any) -> Traced:
    """One of two truths, not both."""
    both = logical(recording, "and", one, other)
    return logical(recording, "and", logical(recording, "or", one, other), logical(recording, "not", both))


def chosen(recording: Recording, condition: Any, one: Any, other: Any) -> Traced:
    """``one`` where ``condition`` holds, else ``other``."""
    parts = [coerced(recording, value) for value in (condition, one, other)]
    form = together(recording, parts)
    width = form.width or 1
    truths = [recording.truth(node) for node in parts[0].spread(width)]
    keep_truth = parts[1].is_truth and parts[2].is_truth
    nodes = []
    for truth, a, b in zip(truths, parts[1].spread(width), parts[2].spread(width), strict=True):
        if keep_truth:
            yes = recording.op("and", truth, a)
            nodes.append(recording.op("or", yes, recording.op("and", recording.op("not", truth), b)))
        else:
            nodes.append(recording.op("where", truth, recording.number(a), recording.number(b)))
    return Traced(recording, nodes, form)


def power(recording: Recording, base: Any, exponent: Any) -> Traced:
    """``base`` to the ``exponent``; a literal one may have a base with a dimension."""

    def one(x: Node, y: Node) -> Node:
        if y.op == "const" and math.isfinite(y.value):
            return recording.power(x, y.value)
        return recording.op("pow", x, y)

    return elementwise(recording, one, base, exponent)


def floor_divided(recording: Recording, one: Any, other: Any) -> Traced:
    """The whole part of a quotient, towards minus infinity."""
    recording.whole_part()
    return elementwise(recording, "floor", elementwise(recording, "/", one, other))


def remainder(recording: Recording, one: Any, other: Any) -> Traced:
    """What is left of ``one``, with the sign of ``other``: x - y floor(x/y)."""
    return elementwise(recording, "-", one, elementwise(recording, "*", other, floor_divided(recording, one, other)))


def cross(recording: Recording, one: Any, other: Any) -> Traced:
    """Vector product in NumPy's order of operations."""
    parts = [coerced(recording, one), coerced(recording, other)]
    form = together(recording, parts)
    (a, b, c), (d, e, f) = (part._vector("cross()") for part in parts)

    def difference(p: Node, q: Node, r: Node, s: Node) -> Node:
        return recording.op("-", recording.op("*", p, q), recording.op("*", r, s))

    return Traced(recording, [difference(b, f, c, e), difference(c, d, a, f), difference(a, e, b, d)], form)


def packed(recording: Recording, values: Sequence[Any]) -> Traced:
    """One vector of ``values``, numbers and columns, as components."""
    parts = [coerced(recording, value) for value in values]
    if any(len(part.at) != 1 or part.form == LIST for part in parts):
        shapes = ", ".join(str(part.form) for part in parts)
        recording.refuse(
            f"vector() of shapes {shapes}: numbers, and columns (n, 1) such as body.position.z, are needed"
        )
    nodes = [recording.number(part.nodes[0]) for part in parts]
    return Traced(recording, nodes, Form(any(part.form.each for part in parts), len(nodes)))


def turned(recording: Recording, vector: Any, q: Traced, sense: float) -> Traced:
    """``vector`` turned by the unit quaternions ``q`` (sense 1), or back (-1); the arithmetic of `xpheve.laws.view`."""
    values = coerced(recording, vector)
    values._vector("to_world() and to_body()")
    w, u = q[:, 0:1], sense * q[:, 1:4]
    twice = 2.0 * cross(recording, u, values)
    return values + w * twice + cross(recording, u, twice)


def multiplied(recording: Recording, one: Any, other: Any) -> Traced:
    """``one @ other`` for vectors, and for vectors with a matrix of numbers; sums go from left to right."""
    left, right = (_matrix(value) for value in (one, other))
    if left is None and right is None:
        a, b = coerced(recording, one), coerced(recording, other)
        if a.form.each and b.form.each:
            recording.refuse("a @ b of two batches is no product object by object: write a.dot(b)")
        form = Form(a.form.each or b.form.each, None)
        return Traced(recording, [summed(recording, elementwise(recording, "*", a, b).nodes)], form)
    if left is not None and right is not None:
        recording.refuse("a product of two matrices takes part; multiply them outside the formula")
    matrix = right if right is not None else left.T
    vector = coerced(recording, one if right is not None else other)
    if left is not None and vector.form.each:
        recording.refuse("M @ v of a batch (n, 3) is refused by NumPy; write v @ M.T")
    if vector.form.width != matrix.shape[0]:
        recording.refuse(f"a vector of shape {vector.form} times a matrix of shape {matrix.shape}")
    nodes = [
        summed(recording, elementwise(recording, "*", vector, tuple(column)).nodes) for column in matrix.T.tolist()
    ]
    return Traced(recording, nodes, Form(vector.form.each, len(nodes)))


def _matrix(value: Any) -> Any:
    """``value`` as a matrix of numbers; None if it is none."""
    if isinstance(value, Traced):
        return None
    if isinstance(value, (tuple, list)) and not all(isinstance(row, (tuple, list)) for row in value):
        return None
    if isinstance(value, (np.ndarray, tuple, list)) and np.ndim(value) == 2:
        return np.asarray(value, dtype=float)
    return None


def summed(recording: Recording, nodes: Sequence[Node]) -> Node:
    """The sum of ``nodes`` from left to right, as NumPy adds fewer than eight."""
    total = recording.number(nodes[0])
    for node in nodes[1:]:
        total = recording.op("+", total, recording.number(node))
    return total
