"""Expressions of a body as text, such as ``"body.position.z - 2.0"``: what a scene file can say. Only what is named here can be said."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NoReturn

from xpheve.errors import InvalidValueError

LONGEST = 500
"""Characters of an expression."""

DEEPEST = 50
"""Operations in one another."""

OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
    ast.Pow: lambda a, b: a**b,
    ast.USub: lambda a: -a,
    ast.UAdd: lambda a: +a,
    ast.Lt: lambda a, b: a < b,
    ast.LtE: lambda a, b: a <= b,
    ast.Gt: lambda a, b: a > b,
    ast.GtE: lambda a, b: a >= b,
}
FUNCTIONS = (
    "sqrt", "cbrt", "exp", "log", "sin", "cos", "tan", "arcsin", "arccos", "arctan", "arctan2", "sinh", "cosh", "tanh", "abs", "hypot",
    "minimum", "maximum", "where",
)  # fmt: skip
"""Functions of NumPy, by name: NumPy itself is not needed to read a text."""
METHODS = {"norm": 0, "dot": 1, "cross": 1, "to_world": 1, "to_body": 1}
"""Methods of vectors and of the body, and how many values they take."""
PARTS = ("x", "y", "z")
NUMBERS = {"pi": math.pi}


@dataclass(frozen=True)
class TextExpression:
    """``text`` as a function of a body.

    It is made of ``body.`` and its properties and columns, numbers (in SI), ``+ - * / **``, comparisons inside ``where``, vectors ``(x, y, z)``,
    ``.x``, ``.y``, ``.z``, the methods ``norm``, ``dot``, ``cross``, ``to_world``, ``to_body``, the functions of NumPy in `FUNCTIONS`, and ``pi``.
    Nothing else is run, whatever the text: it is parsed, and each part looked up here.

    Raises
    ------
    InvalidValueError
        If ``text`` says anything else; the part is named.
    """

    text: str
    _tree: ast.expr = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if len(self.text) > LONGEST:
            raise InvalidValueError(f"an expression of {len(self.text)} characters: {LONGEST} are the most")
        try:
            tree = ast.parse(self.text.strip(), mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            raise InvalidValueError(f"{self.text!r} is no expression: {getattr(error, 'msg', error)}") from None
        _check(tree, self.text, 0)
        object.__setattr__(self, "_tree", tree)
        object.__setattr__(self, "__qualname__", repr(self.text))  # what listings call it

    def __call__(self, body: Any) -> Any:
        return _value(self._tree, body)


def _check(node: ast.AST, text: str, depth: int) -> None:
    """Raise `InvalidValueError` unless ``node`` is made of what may be said."""
    if depth > DEEPEST:
        raise InvalidValueError(f"{text!r} has operations more than {DEEPEST} deep in one another")
    for part in _parts(node, text):
        _check(part, text, depth + 1)


def _parts(node: ast.AST, text: str) -> list[ast.expr]:
    """The operands of ``node``, which is of a kind that may be said."""
    match node:
        case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
            try:
                float(number)
            except OverflowError:
                _refuse(node, text)
            return []
        case ast.Name(id=name) if name in NUMBERS:
            return []
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
            return [left, right]
        case ast.UnaryOp(op=op, operand=operand) if type(op) in OPERATORS:
            return [operand]
        case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in OPERATORS:
            return [left, right]
        case ast.Tuple(elts=[x, y, z]) | ast.List(elts=[x, y, z]):
            return [x, y, z]
        case ast.Attribute(value=ast.Name(id="body"), attr=name) if not name.startswith("_") and name not in METHODS:
            return []
        case ast.Attribute(value=vector, attr=name) if name in PARTS:
            return [vector]
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in FUNCTIONS:
            return args
        case ast.Call(func=ast.Attribute(value=owner, attr=name), args=args, keywords=[]) if METHODS.get(name) == len(
            args
        ):
            return args if _is_body(owner) else [owner, *args]
    _refuse(node, text)


def _refuse(node: ast.AST, text: str) -> NoReturn:
    said = ast.get_source_segment(text.strip(), node) or type(node).__name__
    raise InvalidValueError(
        f"{text!r}: {said!r} cannot be said: numbers, body.position and other properties and columns of the body, .x .y .z, + - * / **, (x, y, z), "
        f"{', '.join(f'.{name}()' for name in METHODS)}, pi, and {', '.join(FUNCTIONS)} can"
    )


def _is_body(node: ast.AST) -> bool:
    return isinstance(node, ast.Name) and node.id == "body"


def _value(node: Any, body: Any) -> Any:
    """What ``node``, which was checked, gives for ``body``."""
    match node:
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.Name(id=name):
            return body if name == "body" else NUMBERS[name]
        case ast.BinOp(left=left, op=op, right=right):
            return OPERATORS[type(op)](_value(left, body), _value(right, body))
        case ast.UnaryOp(op=op, operand=operand):
            return OPERATORS[type(op)](_value(operand, body))
        case ast.Compare(left=left, ops=[op], comparators=[right]):
            return OPERATORS[type(op)](_value(left, body), _value(right, body))
        case ast.Tuple(elts=parts) | ast.List(elts=parts):
            return tuple(_value(part, body) for part in parts)
        case ast.Attribute(value=owner, attr=name):
            return getattr(_value(owner, body), name)
        case ast.Call(func=ast.Name(id=name), args=args):
            import numpy

            return getattr(numpy, name)(*(_value(one, body) for one in args))
        case ast.Call(func=ast.Attribute(value=owner, attr=name), args=args):
            return getattr(_value(owner, body), name)(*(_value(one, body) for one in args))
    raise AssertionError(node)


__all__ = ["TextExpression"]
