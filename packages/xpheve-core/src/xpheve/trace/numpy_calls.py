"""NumPy's functions on traced values, through its two protocols: universal functions, and functions of arrays.

What stands in the tables below is what a formula may call. Shapes and the order of operations are NumPy's.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

import numpy as np

from xpheve.trace.graph import Node
from xpheve.trace.recording import Recording
from xpheve.trace.values import (
    COLUMN,
    LIST,
    NUMBER,
    Count,
    Form,
    Traced,
    chosen,
    coerced,
    cross,
    either,
    elementwise,
    floor_divided,
    logical,
    multiplied,
    power,
    remainder,
    summed,
    together,
)

PLAIN = {
    "add": "+", "subtract": "-", "multiply": "*", "divide": "/", "negative": "neg", "absolute": "abs", "fabs": "abs",
    "maximum": "max", "minimum": "min", "sqrt": "sqrt", "cbrt": "cbrt", "exp": "exp", "expm1": "expm1", "log": "log",
    "log1p": "log1p", "sin": "sin", "cos": "cos", "tan": "tan", "arcsin": "asin", "arccos": "acos", "arctan": "atan",
    "arctan2": "atan2", "sinh": "sinh", "cosh": "cosh", "tanh": "tanh", "sign": "sign", "floor": "floor",
    "hypot": "hypot", "less": "<", "less_equal": "<=", "greater": ">", "greater_equal": ">=", "equal": "==",
    "not_equal": "!=",
}  # fmt: skip
"""Universal functions that are one operation of the graph."""

LOGIC = {
    "logical_and": "and", "bitwise_and": "and", "logical_or": "or", "bitwise_or": "or", "logical_not": "not",
    "invert": "not",
}  # fmt: skip

Maker = Callable[..., Traced]


def _is_nan(recording: Recording, x: Any) -> Traced:
    return elementwise(recording, "!=", x, x)


def _is_finite(recording: Recording, x: Any) -> Traced:
    return elementwise(recording, "<", elementwise(recording, "abs", x), math.inf)


def _is_infinite(recording: Recording, x: Any) -> Traced:
    return elementwise(recording, "==", elementwise(recording, "abs", x), math.inf)


def _scaled(factor: float) -> Maker:
    return lambda recording, x: elementwise(recording, "*", x, factor)


def _logarithm(base: float) -> Maker:
    return lambda recording, x: elementwise(recording, "/", elementwise(recording, "log", x), math.log(base))


def _ceiling(recording: Recording, x: Any) -> Traced:
    return -elementwise(recording, "floor", elementwise(recording, "neg", x))


def _step(recording: Recording, x: Any, half: Any) -> Traced:
    values = coerced(recording, x)
    return chosen(
        recording,
        values == 0.0,
        half,
        chosen(recording, values < 0.0, 0.0, chosen(recording, values > 0.0, 1.0, math.nan)),
    )


def _dotted(recording: Recording, one: Any, other: Any) -> Traced:
    product = elementwise(recording, "*", one, other)
    return Traced(recording, [summed(recording, product.nodes)], Form(product.form.each, None))


COMPOSED: dict[str, Maker] = {
    "power": power,
    "float_power": power,
    "square": lambda recording, x: power(recording, x, 2.0),
    "reciprocal": lambda recording, x: elementwise(recording, "/", 1.0, x),
    "positive": lambda recording, x: +coerced(recording, x),
    "conjugate": lambda recording, x: +coerced(recording, x),
    "degrees": _scaled(180.0 / math.pi),
    "rad2deg": _scaled(180.0 / math.pi),
    "radians": _scaled(math.pi / 180.0),
    "deg2rad": _scaled(math.pi / 180.0),
    "log10": _logarithm(10.0),
    "log2": _logarithm(2.0),
    "exp2": lambda recording, x: power(recording, 2.0, x),
    "ceil": _ceiling,
    "isnan": _is_nan,
    "isfinite": _is_finite,
    "isinf": _is_infinite,
    "heaviside": _step,
    "floor_divide": floor_divided,
    "remainder": remainder,
    "logical_xor": either,
    "bitwise_xor": either,
    "matmul": multiplied,
    "vecdot": _dotted,
}
"""Universal functions that are made of several."""


def call_ufunc(recording: Recording, ufunc: Any, method: str, inputs: Sequence[Any], options: dict[str, Any]) -> Any:
    """What ``ufunc`` gives; raises `TraceError` for those that no tier has, and for options of arrays."""
    name = ufunc.__name__
    into = options.pop("out", None)
    if method != "__call__" or options:
        how = f"np.{name}.{method}" if method != "__call__" else f"np.{name}(..., {', '.join(options)}=)"
        recording.refuse(f"{how} of a traced value: call np.{name}(...) plainly, or write {recording.apply}")
    if name in PLAIN:
        found = elementwise(recording, PLAIN[name], *inputs)
    elif name in LOGIC:
        found = logical(recording, LOGIC[name], *inputs)
    elif name in COMPOSED:
        found = COMPOSED[name](recording, *inputs)
    else:
        _unsupported(recording, f"np.{name}" if hasattr(np, name) else name)
    return found if into is None else _put(recording, into[0], found)


def _put(recording: Recording, into: Any, found: Traced) -> Traced:
    if not isinstance(into, Traced):
        recording.refuse(
            "writes a traced value into a NumPy array, which holds numbers: start from np.zeros_like(v) or 0.0 * v, "
            "where v is one that the objects have"
        )
    into[...] = found
    return into


def _unsupported(recording: Recording, name: str) -> NoReturn:
    recording.refuse(
        f"{name} has no traced form. Write it with + - * / **, np.sqrt, exp, log, sin, cos, tan, where, minimum, maximum, clip, floor, hypot, "
        f"dot, cross and norm, or write {recording.apply}, which is not traced"
    )


def call_function(recording: Recording, function: Any, args: Sequence[Any], options: dict[str, Any]) -> Any:
    """What NumPy's ``function`` gives; raises `TraceError` for those that no tier has."""
    made = FUNCTIONS.get(function)
    if made is None:
        module = str(getattr(function, "__module__", "numpy")).replace("numpy", "np", 1)
        _unsupported(recording, f"{module}.{function.__name__}")
    try:
        return made(recording, *args, **options)
    except TypeError as error:
        recording.refuse(f"np.{function.__name__}: {error}")


# Choosing


def _where(recording: Recording, condition: Any, *values: Any) -> Any:
    if len(values) != 2:
        recording.refuse("np.where(condition) asks which objects: give it both values, np.where(condition, a, b)")
    return chosen(recording, condition, *values)


def _select(recording: Recording, conditions: Sequence[Any], choices: Sequence[Any], default: Any = 0) -> Any:
    found = coerced(recording, default)
    for condition, choice in zip(reversed(conditions), reversed(choices), strict=True):
        found = chosen(recording, condition, choice, found)
    return found


def _clip(recording: Recording, x: Any, low: Any = None, high: Any = None, **options: Any) -> Any:
    low, high = options.pop("min", low), options.pop("max", high)
    if options:
        recording.refuse(f"np.clip(..., {', '.join(options)}=) of a traced value: leave it out")
    found = coerced(recording, x)
    if low is not None:
        found = elementwise(recording, "max", found, low)
    return found if high is None else elementwise(recording, "min", found, high)


# Over components


def _reduced(combine: Callable[[Recording, Sequence[Node]], Node], name: str) -> Maker:
    """A reduction over the components of each object."""

    def reduce(recording: Recording, x: Any, axis: Any = None, keepdims: bool = False) -> Traced:
        values = coerced(recording, x)
        form = values.form
        if form.width is None or axis not in ((1, -1) if form.each else (None, 0, -1)):
            recording.refuse(
                f"np.{name}(..., axis={axis}) goes over objects; a formula is said of each object by itself. Over the components of each: "
                f"np.{name}(v, axis=1, keepdims=True)"
            )
        return Traced(recording, [combine(recording, values.nodes)], Form(form.each, 1 if keepdims else None))

    return reduce


def _chain(op: str) -> Callable[[Recording, Sequence[Node]], Node]:
    def combine(recording: Recording, nodes: Sequence[Node]) -> Node:
        ready = recording.truth if op in ("and", "or") else recording.number
        found = ready(nodes[0])
        for node in nodes[1:]:
            found = recording.op(op, found, ready(node))
        return found

    return combine


def _average(recording: Recording, nodes: Sequence[Node]) -> Node:
    return recording.op("/", summed(recording, nodes), recording.graph.const(float(len(nodes))))


def _norm(recording: Recording, x: Any, ord: Any = None, axis: Any = None, keepdims: bool = False) -> Traced:
    if ord not in (None, 2):
        recording.refuse(f"np.linalg.norm(..., ord={ord!r}): write it with np.abs, sums and powers")
    values = coerced(recording, x)
    squares = elementwise(recording, "*", values, values)
    return elementwise(recording, "sqrt", LENGTH(recording, squares, axis=axis, keepdims=keepdims))


def _dot(recording: Recording, one: Any, other: Any) -> Traced:
    a = coerced(recording, one) if isinstance(one, Traced) else one
    if isinstance(a, Traced) and a.form == NUMBER:
        return elementwise(recording, "*", one, other)
    return multiplied(recording, one, other)


def _einsum(recording: Recording, subscripts: Any, *operands: Any, **_: Any) -> Traced:
    wanted = str(subscripts).replace(" ", "")
    if len(operands) == 2 and wanted in ("ij,ij->i", "...i,...i->...", "...i,...i", "ij,j->i", "i,i->", "i,i"):
        return _dotted(recording, *operands)
    recording.refuse(f"np.einsum({subscripts!r}, ...): write a.dot(b) or a.cross(b)")


def _cross(recording: Recording, one: Any, other: Any, **options: Any) -> Traced:
    if any(axis not in (-1, 1) for axis in options.values()):
        recording.refuse("np.cross(..., axis=...): components are the last axis; leave it out")
    return cross(recording, one, other)


# Putting together


def _parts(recording: Recording, arrays: Any) -> list[Traced]:
    return [coerced(recording, one) for one in arrays]


def _joined(recording: Recording, parts: Sequence[Traced], name: str) -> Traced:
    """``parts`` side by side: all (n, k), or all (k,)."""
    each = parts[0].form.each
    if any(part.form.each != each or part.form.width is None for part in parts):
        shapes = ", ".join(str(part.form) for part in parts)
        recording.refuse(
            f"np.{name} of shapes {shapes}: NumPy puts columns (n, 1) and (n, k) together. xp.vector(x, y, z) takes numbers and columns alike"
        )
    nodes = [recording.number(node) for part in parts for node in part.nodes]
    return Traced(recording, nodes, Form(each, len(nodes)))


def _hstack(recording: Recording, arrays: Any, **_: Any) -> Traced:
    parts = [part if part.form != NUMBER else part._part((0,), Form(False, 1)) for part in _parts(recording, arrays)]
    return _joined(recording, parts, "hstack")


def _concatenate(recording: Recording, arrays: Any, axis: Any = 0, **_: Any) -> Traced:
    parts = _parts(recording, arrays)
    if axis not in ((1, -1) if parts[0].form.each else (0, -1)):
        recording.refuse(f"np.concatenate(..., axis={axis}) would add objects: give axis=1")
    return _joined(recording, parts, "concatenate")


def _column_stack(recording: Recording, arrays: Any) -> Traced:
    parts = [part._part((0,), COLUMN) if part.form == LIST else part for part in _parts(recording, arrays)]
    if not all(part.form.each for part in parts):
        recording.refuse(
            "np.column_stack of a number that is the same for all objects: xp.vector(x, y, z) takes numbers and columns alike"
        )
    return _joined(recording, parts, "column_stack")


def _stack(recording: Recording, arrays: Any, axis: Any = 0, **_: Any) -> Traced:
    parts = _parts(recording, arrays)
    if all(part.form == LIST for part in parts) and axis in (1, -1):
        return _column_stack(recording, parts)
    if all(part.form == NUMBER for part in parts) and axis in (0, -1):
        return _hstack(recording, parts)
    shapes = ", ".join(str(part.form) for part in parts)
    recording.refuse(
        f"np.stack(..., axis={axis}) of shapes {shapes} gives no vector an object: use np.hstack([x, y, z]) of columns"
    )


def _broadcast_to(recording: Recording, x: Any, shape: Any, **_: Any) -> Traced:
    values = coerced(recording, x)
    sizes = shape if isinstance(shape, tuple) else (shape,)
    each = bool(sizes) and isinstance(sizes[0], Count)
    rest = sizes[1:] if each else sizes
    if len(rest) > 1 and rest[0] == 1:
        rest = rest[1:]
    if len(rest) > 1:
        recording.refuse(f"np.broadcast_to(..., {shape}): a shape such as v.shape, or (3,), is needed")
    form = Form(each, int(rest[0]) if rest else None)
    target = Traced(recording, [recording.graph.const(0.0)] * (form.width or 1), form)
    together(recording, (values, target), into=form)
    return Traced(recording, values.spread(form.width or 1), form, locked="what np.broadcast_to gave")


def _filled(value: float) -> Maker:
    def fill(recording: Recording, x: Any, dtype: Any = None, **_: Any) -> Traced:
        values = coerced(recording, x)
        return Traced(recording, [recording.graph.const(value)] * len(values.nodes), values.form)

    return fill


def _full_like(recording: Recording, x: Any, value: Any, **_: Any) -> Traced:
    return elementwise(recording, "+", value, np.zeros_like(x))


LENGTH = _reduced(summed, "linalg.norm")

FUNCTIONS: dict[Any, Callable[..., Any]] = {
    np.where: _where,
    np.select: _select,
    np.clip: _clip,
    np.sum: _reduced(summed, "sum"),
    np.mean: _reduced(_average, "mean"),
    np.prod: _reduced(_chain("*"), "prod"),
    np.max: _reduced(_chain("max"), "max"),
    np.min: _reduced(_chain("min"), "min"),
    np.any: _reduced(_chain("or"), "any"),
    np.all: _reduced(_chain("and"), "all"),
    np.linalg.norm: _norm,
    np.dot: _dot,
    np.inner: _dotted,
    np.einsum: _einsum,
    np.cross: _cross,
    np.linalg.cross: _cross,
    np.hstack: _hstack,
    np.concatenate: _concatenate,
    np.column_stack: _column_stack,
    np.stack: _stack,
    np.broadcast_to: _broadcast_to,
    np.zeros_like: _filled(0.0),
    np.ones_like: _filled(1.0),
    np.full_like: _full_like,
    np.copy: lambda recording, x, **_: coerced(recording, x).copy(),
    np.shape: lambda recording, x: x.shape,
    np.ndim: lambda recording, x: x.ndim,
}
"""NumPy's functions of arrays that a formula may call."""
