"""Expressions that are polynomials in time along a ballistic flight: their coefficients, and which are none."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from xpheve.trace.expression_trace import trace_expression

numbers = st.floats(-10.0, 10.0).map(lambda x: round(x, 3))
vectors = st.tuples(numbers, numbers, numbers)

POLYNOMIALS: list[tuple[Any, int]] = [
    (lambda body: body.position.z - 2.0, 2),
    (lambda body: body.velocity.dot((1.0, 2.0, -0.5)) / 4.0, 1),
    (lambda body: body.position.dot(body.position) - 4.0, 4),
    (lambda body: body.position.x * body.velocity.y - 3.0 * body.time, 3),
    (lambda body: body.velocity.z * body.time**2 + 3.0 * np.sqrt(body.mass), 3),
    (lambda body: np.where(body.mass > 1.0, body.position.z, -2.0 * body.velocity.x), 2),
    (lambda body: 1.0 - body.time, 1),
    (lambda body: (body.position.y + body.velocity.x * 2.0) ** 2, 4),
]


@pytest.mark.parametrize(("expression", "degree"), POLYNOMIALS)
@given(x=vectors, v=vectors, a=vectors, mass=st.floats(0.1, 3.0), begin=numbers, s=st.floats(0.0, 5.0))
def test_the_polynomial_has_the_value_of_the_expression(
    expression: Any, degree: int, x: Any, v: Any, a: Any, mass: float, begin: float, s: float
) -> None:
    trace = trace_expression(expression)
    assert trace.polynomial is not None
    start = {"position": x, "velocity": v, "acceleration": a, "time": (begin,), "mass": (mass,)}
    c = trace.polynomial.run(*(start[one.name][one.component] for one in trace.polynomial.inputs))
    assert len(c) == 5 and not any(c[degree + 1 :])
    here = {
        "position": [p + s * (u + 0.5 * s * b) for p, u, b in zip(x, v, a, strict=True)],
        "velocity": [u + s * b for u, b in zip(v, a, strict=True)],
        "time": (begin + s,),
        "mass": (mass,),
    }
    value = trace.floats.run(*(here[one.name][one.component] for one in trace.floats.inputs))[0]
    found = sum(one * s**k for k, one in enumerate(c))
    size = 1.0 + sum(abs(one) * s**k for k, one in enumerate(c)) + abs(value)
    # of terms that cancel: positions up to 200, squared
    assert found == pytest.approx(value, abs=1e-12 * size + 1e-10)


@pytest.mark.parametrize(
    "expression",
    [
        lambda body: body.position.norm() - 2.0,
        lambda body: np.sin(body.position.x),
        lambda body: np.where(body.position.z > 2.0, 1.0, -1.0),
        lambda body: 1.0 / body.position.x,
        lambda body: body.position.x**5,
        lambda body: body.angular_velocity.z * body.position.x,
        lambda body: abs(body.position.z),
    ],
)
def test_what_is_no_such_polynomial_is_none(expression: Any) -> None:
    assert trace_expression(expression).polynomial is None
