"""Expressions of one object: what is read of them, their dimension, and what is refused, with the author's line."""

from __future__ import annotations

import random
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from xpheve.errors import DimensionError, TracedBranchError, TraceError
from xpheve.trace.expression_trace import trace_expression
from xpheve.trace.graph import Input
from xpheve.units import dimension

LIMIT = 2.5


def test_an_expression_knows_what_it_reads_its_dimension_and_its_value() -> None:
    trace = trace_expression(lambda body: body.position.z - LIMIT)
    assert trace.reads == {"position"} and trace.moves and trace.dimension == dimension("m")
    given = {Input("", "position", 2): np.array([2.0, 3.0])}
    assert trace.arrays(given, {})[0].tolist() == [-0.5, 0.5]
    assert trace.floats({Input("", "position", 2): 3.0}, {}) == [0.5]


@pytest.mark.parametrize(
    ("expression", "unit"),
    [
        (lambda body: body.velocity.norm(), "m/s"),
        (lambda body: body.position.x / body.time - 3.0, "m/s"),
        (lambda body: body.velocity.dot(body.position), "m^2/s"),
        (lambda body: np.sin(3.0 * body.time), "1"),
        (lambda body: body.position[:, 2] - 1.0, "m"),
        (lambda body: body.charge * body.mass, None),
        (lambda body: 0.5 * body.velocity.norm() ** 2 + 9.81 * body.position.z, None),
    ],
)
def test_dimensions_follow_from_what_is_read_and_numbers_of_the_text_take_what_fits(
    expression: Any, unit: str | None
) -> None:
    assert trace_expression(expression).dimension == (None if unit is None else dimension(unit))


def test_a_column_has_the_unit_that_its_law_declares() -> None:
    columns = {"charge": SimpleNamespace(unit="C")}
    assert trace_expression(lambda body: body.charge - 1.0, columns).dimension == dimension("C")
    with pytest.raises(DimensionError, match=r"subtracts s\*A and m"):
        trace_expression(lambda body: body.charge - body.position.x, columns)


def mixed(body: Any) -> Any:
    """Return metres less seconds."""
    return body.position.z - body.time


def branching(body: Any) -> Any:
    """Decide on what is no number yet."""
    if body.position.z > 2.0:
        return body.position.z
    return body.position.x


def compared(body: Any) -> Any:
    """Compare metres with seconds inside."""
    return np.where(body.position.z > body.time, 1.0, -1.0)


COUNTED = [0.0]


def counting(body: Any) -> Any:
    """Return something else at each call."""
    COUNTED[0] += 1.0
    return body.position.z - COUNTED[0]


@pytest.mark.parametrize(
    ("expression", "error", "said"),
    [
        (mixed, DimensionError, r"mixed subtracts m and s\. At .*: return body\.position\.z - body\.time\."),
        (compared, DimensionError, r"compares m and s\. At .*: return np\.where"),
        (branching, TracedBranchError, r"`if body\.position\.z > 2\.0:` branches on a traced value.*np\.where"),
        (counting, TraceError, r"read twice, says two things: 1\.0, then 2\.0"),
        (lambda body: body.position.z - random.random(), TraceError, "draws random numbers"),
        (lambda body: body.position - 2.0, TraceError, r"returned an array of shape \(n, 3\); one number an object"),
        (lambda body: body.position.z > 2.0, TraceError, "gave True or False, .* give a difference"),
        (lambda body: None, TraceError, "returned None"),
        (lambda body: "z", TraceError, "returned 'z'; one number an object is needed"),
        (lambda body: body.positon.z, TraceError, r'body\.positon, .*Did you mean "position"\?'),
        (lambda body: body.since - 2.0, TraceError, r"use body\.time"),
        (lambda body: body.position.z - body.count, TraceError, r"body\.count"),
        (lambda body: 1 / 0, TraceError, "raised ZeroDivisionError"),
    ],
)
def test_what_is_no_expression_is_refused_and_its_line_named(
    expression: Any, error: type[Exception], said: str
) -> None:
    COUNTED[0] = 0.0
    with pytest.raises(error, match=said):
        trace_expression(expression)


def test_what_reads_neither_state_nor_time_does_not_move() -> None:
    assert not trace_expression(lambda body: body.mass * body.up.z - 3.0).moves
    assert trace_expression(lambda body: body.time - 3.0).moves
    assert trace_expression(lambda body: body.to_world((1.0, 0.0, 0.0)).x).moves
