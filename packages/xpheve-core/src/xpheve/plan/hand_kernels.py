"""Laws whose force is a kernel written by hand: a file of plain functions that runs as a part of the loop, and row by row in Python.

The function ``force`` of the file takes arguments named after what it reads, and returns the force [N] as a tuple of three. Of a pair law
they end in ``_a`` and ``_b``, and the force is that on ``a``.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import os
from collections.abc import Callable, Sequence
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from xpheve.errors import LawDefinitionError, LawFailedError
from xpheve.laws import ContinuousLaw, PairLaw

if TYPE_CHECKING:
    from xpheve.trace.graph import Graph, Node
    from xpheve.trace.law_trace import LawTrace

WIDTHS = {"position": 3, "velocity": 3, "angular_velocity": 3, "orientation": 4, "inertia": 3, "up": 3}
SINGLE = ("mass", "volume", "since", "time")
SCENE = ("time", "up")


class HandKernel(NamedTuple):
    """A kernel file as it is now.

    ``name`` is what it is called in texts, ``stamp`` a hash of what stands in it, ``arguments`` those of its function ``force``.
    """

    name: str
    path: str
    stamp: str
    arguments: tuple[str, ...]


class Argument(NamedTuple):
    """What an argument means: "input" of ``side``, or "param"; ``width`` is 0 for a number, else that of a tuple."""

    kind: str
    side: str
    name: str
    width: int


_FILES: dict[str, tuple[tuple[int, int], HandKernel]] = {}
_TRACES: dict[tuple[Any, ...], LawTrace] = {}
_FUNCTIONS: dict[HandKernel, Callable[..., Any]] = {}


def is_by_hand(law: ContinuousLaw) -> bool:
    """Whether the force of ``law`` is a kernel written by hand."""
    return bool(law.kernel) and not (law.defines("force") or law.defines("torque"))


def formula_of(law: ContinuousLaw) -> LawTrace | None:
    """What ``law`` computes: its trace, or one that calls its kernel; None if it is plain Python."""
    if is_by_hand(law):
        return hand_trace(law)
    from xpheve.trace.recorder import trace_law

    return trace_law(law)


def hand_kernel(law: ContinuousLaw) -> HandKernel:
    """The kernel file of ``law``, read again when it has changed; raises `LawDefinitionError`."""
    path = _path_of(law)
    about = os.stat(path)
    seen = about.st_mtime_ns, about.st_size
    held = _FILES.get(path)
    if held is None or held[0] != seen:
        held = _FILES[path] = seen, _read(law, path)
    return held[1]


def _path_of(law: ContinuousLaw) -> str:
    wanted = f"{law.label()}: kernel = {law.kernel!r}"
    try:
        found = importlib.util.find_spec(law.kernel)
    except (ImportError, ValueError) as error:
        raise LawDefinitionError(
            f"{wanted}: {error}. Give the import path of a Python file, such as 'pack.lift'"
        ) from None
    if found is None or not found.origin or not found.origin.endswith(".py"):
        raise LawDefinitionError(
            f"{wanted}: there is no such Python file. Give its import path, such as 'pack.lift' for lift.py in the package pack"
        )
    return found.origin


def _read(law: ContinuousLaw, path: str) -> HandKernel:
    from xpheve.compile.parsing import parse

    with open(path, "rb") as file:
        text = file.read()

    try:
        tree = parse(text, path)
    except SyntaxError as error:
        raise LawDefinitionError(f"kernel file {path}:{error.lineno}: it is not Python ({error.msg})") from None
    functions = {one.name: one for one in tree.body if isinstance(one, ast.FunctionDef)}
    if "force" not in functions:
        raise LawDefinitionError(
            f"{law.label()}: kernel file {path} has no function 'force'; it has {', '.join(functions) or 'none'}"
        )
    if _falls_through(functions["force"].body):
        raise LawDefinitionError(
            f"{law.label()}: kernel file {path}:{functions['force'].lineno}: force may come to its end without a `return`; "
            "for no force return (0.0, 0.0, 0.0)"
        )
    arguments = functions["force"].args
    names = tuple(one.arg for one in [*arguments.posonlyargs, *arguments.args])
    name = "hand_" + "_".join(part for part in law.kernel.replace(".", "_").split("_") if part)
    return HandKernel(name, path, hashlib.sha256(text).hexdigest(), names)


def _falls_through(body: list[ast.stmt]) -> bool:
    """Whether what comes after ``body`` may be reached."""
    last = body[-1]
    if isinstance(last, ast.If):
        return not last.orelse or _falls_through(last.body) or _falls_through(last.orelse)
    if isinstance(last, ast.While) and isinstance(last.test, ast.Constant) and last.test.value:
        return any(isinstance(one, ast.Break) for one in ast.walk(last))
    return not isinstance(last, (ast.Return, ast.Raise))


def meanings(law: ContinuousLaw, kernel: HandKernel) -> list[Argument]:
    """What each argument of ``kernel`` is; raises `LawDefinitionError` for one that is nothing."""
    return [_meaning(law, kernel, argument) for argument in kernel.arguments]


def _meaning(law: ContinuousLaw, kernel: HandKernel, argument: str) -> Argument:
    pair = isinstance(law, PairLaw)
    if argument in law.parameters:
        return _parameter(law, kernel, argument)
    side, name = "", argument
    if pair and argument[-2:] in ("_a", "_b"):
        name, side = argument[:-2], argument[-1]
    own = [*WIDTHS, *SINGLE, *law.columns]
    if name in own and (name in SCENE) == (not side if pair else name in SCENE):
        return Argument("input", side, name, WIDTHS.get(name, 0))
    known = [one for one in own if one not in SCENE]
    bodily = [f"{one}_{end}" for one in known for end in "ab"] if pair else known
    at_hand = [*bodily, *SCENE, *law.parameters]
    near = get_close_matches(argument, at_hand, n=1)
    meant = f' Did you mean "{near[0]}"?' if near else ""
    raise LawDefinitionError(
        f"{law.label()}: argument {argument!r} of force in {kernel.path} is no property, no column that the law declares and no parameter; "
        f"at hand: {', '.join(at_hand)}.{meant}"
    )


def _parameter(law: ContinuousLaw, kernel: HandKernel, name: str) -> Argument:
    value = law.parameters[name]
    if isinstance(value, tuple):
        return Argument("param", "", name, len(value))
    if isinstance(value, (bool, str)) or value is None:
        raise LawDefinitionError(
            f"{law.label()}: argument {name!r} of force in {kernel.path} is the parameter {name} = {value!r}; a kernel takes numbers"
        )
    return Argument("param", "", name, 0)


# As a part of a loop


def hand_trace(law: ContinuousLaw) -> LawTrace:
    """A trace that is a call of the kernel; raises `LawDefinitionError`."""
    kernel = hand_kernel(law)
    key = (
        type(law),
        kernel,
        tuple((k, type(v), len(v) if isinstance(v, tuple) else 0) for k, v in law.parameters.items()),
    )
    found = _TRACES.get(key)
    if found is None:
        from xpheve.trace.graph import Graph
        from xpheve.trace.law_trace import LawTrace

        graph = Graph(law.label(), check_dimensions=False)
        given = meanings(law, kernel)
        numbers = [node for argument in given for node in _nodes(graph, argument)]
        force = graph.call((kernel.name, kernel.path, kernel.stamp), numbers, tuple(one.width for one in given), 3)
        found = LawTrace(law.label(), isinstance(law, PairLaw), graph, (force[0], force[1], force[2]), None, None)
        _TRACES[key] = found
    return found


def _nodes(graph: Graph, argument: Argument) -> list[Node]:
    components = range(argument.width or 1)
    if argument.kind == "param":
        return [graph.param(argument.name, c, None) for c in components]
    return [graph.input(argument.name, c, None, argument.side) for c in components]


# Row by row


def function_of(kernel: HandKernel) -> Callable[..., Any]:
    """The function ``force`` of ``kernel``, as Python runs it; raises `CompileError`."""
    found = _FUNCTIONS.get(kernel)
    if found is None:
        from xpheve.compile import assemble

        names: dict[str, Any] = {}
        text = assemble(f"def entry(f, n):\n    return {kernel.name}__force\n", {kernel.name: kernel.path})
        exec(compile(text, kernel.path, "exec"), names)
        found = _FUNCTIONS[kernel] = names[f"{kernel.name}__force"]
    return found


def force_by_rows(law: ContinuousLaw) -> Callable[..., Any]:
    """What takes views of the objects (two for pairs) and gives forces (n, 3)."""
    from xpheve.loop.array_run import by_rows

    kernel = hand_kernel(law)
    given, function = meanings(law, kernel), function_of(kernel)

    def checked(*numbers: Any) -> Any:
        found = function(*numbers)
        try:
            x, y, z = (float(one) for one in found)
        except (TypeError, ValueError):
            raise LawFailedError(
                f"{law.label()}: force in {kernel.path} returned {found!r}; a tuple of three numbers [N] is needed", law
            ) from None
        return x, y, z

    def force(*views: Any) -> Any:
        numbers = [_numbers(law, argument, views) for argument in given]
        return np.array(by_rows(checked, *numbers)).T

    return force


def _numbers(law: ContinuousLaw, argument: Argument, views: Sequence[Any]) -> Any:
    if argument.kind == "param":
        return law.parameters[argument.name]
    values = np.asarray(getattr(views[argument.side == "b"], argument.name), dtype=float)
    if argument.name == "time":
        return float(values)
    if argument.name == "up":
        return tuple(values.tolist())
    columns = tuple(np.ascontiguousarray(column) for column in values.reshape(len(values), -1).T)
    return columns if argument.width else columns[0]


__all__ = ["HandKernel", "force_by_rows", "formula_of", "hand_kernel", "hand_trace", "is_by_hand"]
