"""Expressions of conditions, read: each function once when a container with it is added."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any
from weakref import WeakKeyDictionary

from xpheve.laws import LawContainer
from xpheve.laws import conditions as when
from xpheve.laws.combinations import leaves
from xpheve.trace.expression_trace import ExpressionTrace, trace_expression

_READ: WeakKeyDictionary[Callable[[Any], Any], ExpressionTrace] = WeakKeyDictionary()
"""What was read last of each function, so that copies of an engine follow what the engine follows."""


def read_expressions(world: Any, container: LawContainer) -> None:
    """Read what ``container`` waits for, with the numbers that the functions close over now; raises `TraceError`."""
    for leaf in leaves(container.condition):
        if isinstance(leaf, when.Crosses):
            _read(world, leaf.expression, container)


def expression_of(world: Any, function: Callable[[Any], Any]) -> ExpressionTrace:
    """What ``function`` computes, as it was read last."""
    try:
        found = _READ.get(function)
    except TypeError:  # it takes no weak references
        found = None
    return found or _read(world, function)


def _read(world: Any, function: Callable[[Any], Any], container: LawContainer | None = None) -> ExpressionTrace:
    laws = [*world.laws, *(container.laws if container is not None else ())]
    columns = {name: column for law in laws for name, column in law.columns.items()}
    found = trace_expression(function, columns, str(when.Crosses(function)))
    try:
        _READ[function] = found
    except TypeError:
        pass
    return found
