"""Traced values against NumPy's own shapes and bits."""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from xpheve.errors import TracedBranchError, TraceError
from xpheve.trace.values import Traced

Formula = Callable[[Any, Any], Any]

LEAVES: list[Formula] = [
    lambda body, wind: body.position,
    lambda body, wind: body.velocity,
    lambda body, wind: body.orientation,
    lambda body, wind: body.mass,
    lambda body, wind: body.time,
    lambda body, wind: body.up,
    lambda body, wind: wind,
    lambda body, wind: wind[1],
    lambda body, wind: body.position[:, 2],
    lambda body, wind: body.position[:, 1:2],
    lambda body, wind: body.position[..., 0],
    lambda body, wind: body.orientation[:, 1:4],
    lambda body, wind: body.velocity.z,
    lambda body, wind: body.velocity[:, 0][:, None],
    lambda body, wind: 2.5,
    lambda body, wind: np.float64(-0.5),
    lambda body, wind: np.array((1.0, 2.0, 3.0)),
    lambda body, wind: np.array([[1.0, 2.0, 3.0]]),
]
BINARY: list[Callable[[Any, Any], Any]] = [
    operator.add,
    operator.sub,
    operator.mul,
    operator.truediv,
    np.minimum,
    np.maximum,
    operator.lt,
    operator.ge,
    lambda a, b: np.where(a > b, a, b),
    lambda a, b: (a > 0.0) * b,
]
UNARY: list[Callable[[Any], Any]] = [
    operator.neg,
    abs,
    lambda a: np.sqrt(np.abs(a)),
    lambda a: (1.0 * a) ** 2,
    lambda a: (1.0 * a) ** -1,
]


@st.composite
def formulas(draw: st.DrawFn, deep: int = 3) -> Formula:
    """A formula at random, of exact operations."""
    if deep == 0 or draw(st.booleans()):
        return draw(st.sampled_from(LEAVES))
    if draw(st.integers(0, 3)) == 0:
        unary, inner = draw(st.sampled_from(UNARY)), draw(formulas(deep - 1))
        return lambda body, wind: unary(inner(body, wind))
    binary, left, right = draw(st.sampled_from(BINARY)), draw(formulas(deep - 1)), draw(formulas(deep - 1))
    return lambda body, wind: binary(left(body, wind), right(body, wind))


@given(formula=formulas(), seed=st.integers(0, 10**6))
def test_what_numpy_gives_the_trace_gives_to_the_bit_and_what_numpy_refuses_it_refuses(
    make_bench: Any, formula: Formula, seed: int
) -> None:
    bench = make_bench(seed)
    try:
        with np.errstate(all="ignore"):
            expected = np.asarray(formula(bench.body, bench.wind))
    except (ValueError, TypeError):  # shapes, and differences of truths
        expected = None
    if expected is None or list(expected.shape).count(bench.count) > 1:  # n by n: every object with every other
        refusal = (
            "do not go together|difference of truths|boolean (negative|subtract)"  # NumPy's own, of literals alone
        )
        with pytest.raises((TraceError, TypeError), match=refusal), np.errstate(all="ignore"):
            formula(bench.traced_body, bench.traced_wind)
        return
    with np.errstate(all="ignore"):
        value = formula(bench.traced_body, bench.traced_wind)
    if not isinstance(value, Traced):  # made of literals alone
        return
    if expected.shape[:1] == (1,):  # (1, 3) broadcasts as (3,) does, and is taken for it
        expected = expected[0]
    assert bench.shape_of(value) == expected.shape
    assert np.array_equal(bench.numbers(value), expected, equal_nan=True)


def test_vectors_have_the_products_of_views(bench: Any) -> None:
    bench.same(lambda body, wind: body.position.norm())
    bench.same(lambda body, wind: body.position.dot(body.velocity))
    bench.same(lambda body, wind: body.position.cross(body.velocity))
    bench.same(lambda body, wind: body.position.dot(wind))
    bench.same(lambda body, wind: body.position.dot((1.0, 2.0, 3.0)))
    bench.same(lambda body, wind: body.position.cross(wind) - body.position.cross([0.0, 0.0, 1.0]))


def test_a_vector_for_all_has_them_too(bench: Any) -> None:
    bench.same(lambda body, wind: wind.norm() * body.velocity)
    bench.same(lambda body, wind: wind.dot(body.up) * body.mass)
    bench.same(lambda body, wind: wind.cross(body.velocity))
    bench.same(lambda body, wind: wind.x * body.mass + body.up.z)
    bench.same(lambda body, wind: sum(list(wind)) * body.mass)
    bench.same(lambda body, wind: len(wind) * wind[2] * body.mass)


def test_turning_is_that_of_views(bench: Any) -> None:
    bench.same(lambda body, wind: body.to_world(body.velocity))
    bench.same(lambda body, wind: body.to_body(wind))
    bench.same(lambda body, wind: body.to_world((1.0, 0.0, 0.0)))


def test_numbers_tuples_and_arrays_stand_on_either_side(bench: Any) -> None:
    bench.same(lambda body, wind: (0.0, 0.0, 1.0) * body.mass)
    bench.same(lambda body, wind: [0.0, 0.0, 1.0] - body.position)
    bench.same(lambda body, wind: np.array((1.0, 2.0, 3.0)) / body.position)
    bench.same(lambda body, wind: np.float64(3.0) * body.position + 2)
    bench.same(lambda body, wind: 1 / body.mass)
    bench.same(lambda body, wind: 2.0**body.mass, rtol=1e-15)
    bench.same(lambda body, wind: body.mass**0.5)
    bench.same(lambda body, wind: body.mass**-1.5, rtol=1e-15)
    bench.same(lambda body, wind: body.mass**3, rtol=1e-15)
    bench.same(lambda body, wind: body.mass // 0.3)
    bench.same(lambda body, wind: body.mass % 0.3, rtol=1e-12)


def test_truths_join_and_count_as_one_and_nought(bench: Any) -> None:
    bench.same(lambda body, wind: (body.mass > 1.0) & (body.position.x < 0.0))
    bench.same(lambda body, wind: ((body.mass > 1.0) | (body.time >= 0.5)) ^ (body.mass != 1.0))
    bench.same(lambda body, wind: ~(body.mass <= 1.0) * (1.0, 0.0, 0.0))
    bench.same(lambda body, wind: (body.mass > 1.0) + 1.0)
    bench.same(lambda body, wind: 1.0 * ((body.mass > 1.0) + (body.mass > 0.5)))
    bench.same(lambda body, wind: 1.0 * ((body.mass > 1.0) + True))


def test_a_temporary_may_be_written_into_and_its_slices_share_it(bench: Any) -> None:
    def formula(body: Any, wind: Any) -> Any:
        force = 2.0 * body.velocity
        same = force
        same += body.position
        force[:, 2:3] -= body.mass
        force[:, 0] = 0.0
        part = force[:, 1:2]
        part *= 3.0
        speed = body.velocity.norm()
        scale = body.time
        scale *= 2.0
        return force / speed * scale * body.time

    bench.same(formula)


@pytest.mark.parametrize(
    "write",
    [
        lambda body, wind: operator.iadd(body.position, 1.0),
        lambda body, wind: operator.setitem(body.velocity, slice(None), 0.0),
        lambda body, wind: operator.imul(body.position.z, 2.0),
        lambda body, wind: operator.setitem(wind, 0, 0.0),
        lambda body, wind: np.add(body.position, 1.0, out=body.position),
    ],
)
def test_views_and_parameters_are_read_only(bench: Any, write: Formula) -> None:
    with pytest.raises(TraceError, match="read-only in a formula"):
        write(bench.traced_body, bench.traced_wind)


@pytest.mark.parametrize(
    ("key", "way_out"),
    [
        (2, r"\[2\] of a batch of shape \(n, 3\) is the row of one object, not a component of all: write \.z"),
        (slice(0, 2), r"takes some of the objects"),
        ((slice(None), 3), r"there are 3 components"),
        ((slice(None), None, 0), r"there is no such part"),
        (np.array([True, False, True]), r"choose with np\.where"),
    ],
)
def test_what_is_no_component_is_refused(bench: Any, key: Any, way_out: str) -> None:
    with pytest.raises(TraceError, match=way_out):
        bench.traced_body.position[key]


@pytest.mark.parametrize(
    ("ask", "answer"),
    [
        (lambda v: v.norm().norm(), r"norm|dot\(\) of a value of shape \(n, 1\)"),
        (lambda v: v[:, 2] * v.x, r"\(n,\) and \(n, 1\) do not go together: \[:, k\] gives \(n,\)"),
        (lambda v: np.zeros(v.shape), r"asks for the number of objects"),
        (lambda v: v.shape[0] > 2, r"asks for the number of objects"),
        (lambda v: v.T, r"\.T of a traced value"),
        (lambda v: v + None, r"None takes part in a formula"),
        (lambda v: v + "m", r"'m' takes part in a formula"),
        (lambda v: v + 1j, r"1j takes part in a formula"),
        (lambda v: v * np.ones((7, 3)), r"an array of shape \(7, 3\) takes part in a formula"),
        (lambda v: v * (v.x, v.y, v.z), r"put components together by xp\.vector"),
        (lambda v: np.asarray(v), r"makes a NumPy array of a traced value"),
        (lambda v: np.array([v.x, v.y, v.z]), r"makes a NumPy array of a traced value"),
        (lambda v: v.reshape(3, -1), r"reshape"),
        (lambda v: v.astype(int), r"are float64"),
    ],
)
def test_what_goes_wrong_says_how_it_goes_right(bench: Any, ask: Any, answer: str) -> None:
    with pytest.raises(TraceError, match=answer):
        ask(bench.traced_body.velocity)
    assert bench.recording.error is not None, "so that no except can swallow it"


@pytest.mark.parametrize(
    "ask", [bool, float, int, len, list, round, complex, range, lambda x: 1.0 in x, lambda x: x.tolist()]
)
def test_a_value_that_is_no_number_yet_makes_no_decision(bench: Any, ask: Any) -> None:
    with pytest.raises(TracedBranchError, match=r"test_values\.py:\d+: "):
        ask(bench.traced_body.mass)


def test_a_shape_tells_components_though_not_objects(bench: Any) -> None:
    v = bench.traced_body.velocity
    assert v.shape[1] == 3 and v.ndim == 2 and v.shape == bench.traced_body.position.shape
    assert repr(v) == "<traced value of shape (n, 3)>"
