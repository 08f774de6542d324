"""NumPy's functions on traced values, beside NumPy's own answers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from xpheve.errors import TraceError

FEW_ULP = 4e-16

EXACT: list[Any] = [
    np.sqrt,
    np.abs,
    np.absolute,
    np.fabs,
    np.negative,
    np.positive,
    np.sign,
    np.floor,
    np.ceil,
    np.square,
    np.reciprocal,
    np.isnan,
    np.isfinite,
    np.isinf,
]
ROUNDED: list[Any] = [
    np.exp, np.exp2, np.expm1, np.log, np.log1p, np.log2, np.log10, np.sin, np.cos, np.tan, np.arcsin, np.arccos,
    np.arctan, np.sinh, np.cosh, np.tanh, np.cbrt, np.radians, np.degrees, np.deg2rad, np.rad2deg,
]  # fmt: skip
PAIRS: list[Any] = [
    np.add, np.subtract, np.multiply, np.divide, np.true_divide, np.maximum, np.minimum, np.hypot, np.arctan2, np.power,
    np.floor_divide, np.less, np.greater_equal, np.equal, np.not_equal, np.logical_and, np.logical_or, np.logical_xor,
    np.heaviside,
]  # fmt: skip


@pytest.mark.parametrize("function", EXACT, ids=lambda f: f.__name__)
def test_exact_functions_have_numpys_bits(bench: Any, function: Any) -> None:
    bench.same(lambda body, wind: function(body.mass))
    bench.same(lambda body, wind: function(body.position * np.where(body.mass > 1.0, np.nan, 3.0)))


@pytest.mark.parametrize("function", ROUNDED, ids=lambda f: f.__name__)
def test_rounded_functions_have_numpys_values_to_a_few_ulp(bench: Any, function: Any) -> None:
    bench.same(lambda body, wind: function(body.position / 4.0), rtol=FEW_ULP)


@pytest.mark.parametrize("function", PAIRS, ids=lambda f: f.__name__)
def test_functions_of_two_have_numpys_values(bench: Any, function: Any) -> None:
    bench.same(lambda body, wind: function(body.mass, 0.75), rtol=FEW_ULP)
    bench.same(lambda body, wind: function(1.5, body.mass), rtol=FEW_ULP)
    bench.same(lambda body, wind: function(np.array((1.0, 2.0, 3.0)), body.position), rtol=FEW_ULP)


def test_choices(bench: Any) -> None:
    bench.same(lambda body, wind: np.where(body.mass > 1.0, body.position, 0.0))
    bench.same(lambda body, wind: np.where(body.position > wind, (1.0, 2.0, 3.0), body.velocity))
    bench.same(lambda body, wind: np.clip(body.position, -0.5, 0.25))
    bench.same(lambda body, wind: np.clip(body.position, None, body.mass))
    bench.same(lambda body, wind: body.position.clip(-1.0, 1.0))
    bench.same(lambda body, wind: np.select([body.mass < 0.8, body.mass < 1.2], [body.position.x, 2.0], body.mass))
    bench.same(lambda body, wind: np.logical_not(body.mass > 1.0) & np.logical_or(body.time > 0.5, body.mass > 1.0))
    bench.same(lambda body, wind: np.where(body.mass > 1.0, body.position > 0.0, body.velocity > 0.0))


def test_sums_over_components(bench: Any) -> None:
    for function in (np.sum, np.mean, np.prod, np.max, np.min, np.any, np.all):
        bench.same(lambda body, wind, f=function: f(body.position, axis=1, keepdims=True), rtol=FEW_ULP)
        bench.same(lambda body, wind, f=function: f(body.position, axis=-1), rtol=FEW_ULP)
        bench.same(lambda body, wind, f=function: f(wind) * body.mass, rtol=FEW_ULP)
    bench.same(lambda body, wind: np.sum(body.position * body.position, axis=1, keepdims=True))
    bench.same(lambda body, wind: body.position.sum(axis=1, keepdims=True))
    bench.same(lambda body, wind: np.linalg.norm(body.position, axis=1, keepdims=True))
    bench.same(lambda body, wind: np.linalg.norm(wind) * body.mass, rtol=FEW_ULP)
    bench.same(lambda body, wind: np.einsum("ij,ij->i", body.position, body.velocity), rtol=1e-14)
    bench.same(lambda body, wind: np.vecdot(body.position, body.velocity), rtol=1e-14)


def test_products(bench: Any) -> None:
    matrix = np.array([[1.0, 2.0, 0.5], [0.0, 3.0, -1.0], [4.0, 0.0, 1.0]])
    bench.same(lambda body, wind: np.cross(body.position, body.velocity))
    bench.same(lambda body, wind: np.cross((0.0, 1.0, 2.0), body.velocity, axis=-1))
    bench.same(lambda body, wind: np.cross(wind, body.velocity))
    bench.same(lambda body, wind: body.position @ matrix, rtol=1e-14)
    bench.same(lambda body, wind: np.matmul(body.position, matrix.T), rtol=1e-14)
    bench.same(lambda body, wind: body.position @ np.array((1.0, 2.0, 3.0)), rtol=1e-13)


def test_components_are_put_together(bench: Any) -> None:
    bench.same(lambda body, wind: np.hstack([body.position.x, body.mass, 2.0 * body.velocity.z]))
    bench.same(lambda body, wind: np.concatenate([body.position[:, 0:2], body.mass], axis=1))
    bench.same(lambda body, wind: np.column_stack([body.position[:, 0], body.mass, body.velocity[:, 1]]))
    bench.same(lambda body, wind: np.stack([body.position[:, k] for k in (2, 1, 0)], axis=1))
    bench.same(lambda body, wind: np.stack([wind[1], 2.0, wind[0]]) * body.mass)
    bench.same(lambda body, wind: body.position[:, [2, 0, 1]])
    bench.same(lambda body, wind: body.position[:, 2].reshape(-1, 1) * body.velocity)


def test_fillings(bench: Any) -> None:
    bench.same(lambda body, wind: np.zeros_like(body.position) + body.mass)
    bench.same(lambda body, wind: np.ones_like(body.mass) * body.position)
    bench.same(lambda body, wind: np.full_like(body.mass, 3.0) * body.position)
    bench.same(lambda body, wind: np.broadcast_to(wind, body.position.shape) + body.mass)
    bench.same(lambda body, wind: np.copy(body.position) + np.zeros(3))


def test_an_output_may_be_a_temporary(bench: Any) -> None:
    def formula(body: Any, wind: Any) -> Any:
        force = 1.0 * body.position
        np.multiply(force, body.mass, out=force)
        return force

    bench.same(formula)


@pytest.mark.parametrize(
    ("call", "answer"),
    [
        (lambda v: np.sort(v), r"np\.sort has no traced form\. Write it with .* or write apply\(self, body\), which is not traced"),
        (lambda v: np.arcsinh(v), r"np\.arcsinh has no traced form"),
        (lambda v: np.linalg.det(v), r"np\.linalg\.det has no traced form"),
        (lambda v: np.sum(v), r"np\.sum\(\.\.\., axis=None\) goes over objects.*np\.sum\(v, axis=1, keepdims=True\)"),
        (lambda v: v.max(axis=0), r"np\.max\(\.\.\., axis=0\) goes over objects"),
        (lambda v: v.any(), r"np\.any\(\.\.\., axis=None\) goes over objects"),
        (lambda v: np.linalg.norm(v), r"np\.linalg\.norm\(\.\.\., axis=None\) goes over objects"),
        (lambda v: np.add.reduce(v), r"np\.add\.reduce of a traced value"),
        (lambda v: np.add(v, 1.0, where=v > 0.0), r"np\.add\(\.\.\., where=\)"),
        (lambda v: np.add(np.zeros(3), v, out=np.zeros(3)), r"writes a traced value into a NumPy array"),
        (lambda v: np.where(v > 0.0), r"give it both values"),
        (lambda v: np.hstack([v.x, 0.0, v.y]), r"xp\.vector\(x, y, z\) takes numbers and columns alike"),
        (lambda v: np.hstack([v[:, 0], v[:, 1]]), r"np\.hstack of shapes \(n,\), \(n,\)"),
        (lambda v: np.column_stack([v[:, 0], 0.0]), r"np\.column_stack of a number"),
        (lambda v: np.stack([v.x, v.y, v.z]), r"gives no vector an object"),
        (lambda v: np.concatenate([v, v]), r"would add objects: give axis=1"),
        (lambda v: np.einsum("ij,kj->ik", v, v), r"write a\.dot\(b\)"),
        (lambda v: v @ v, r"write a\.dot\(b\)"),
        (lambda v: np.linalg.norm(v, ord=1, axis=1), r"ord=1"),
    ],
)  # fmt: skip
def test_what_no_tier_has_names_itself_and_the_way_out(bench: Any, call: Any, answer: str) -> None:
    with pytest.raises(TraceError, match=answer):
        call(bench.traced_body.velocity)
