"""Shapes: volume, moments and reach against integrals done another way."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import xpheve as xp


def inside(shape: Any, x: Any) -> Any:
    """Return whether points (n, 3) lie in ``shape``, written afresh."""
    if isinstance(shape, xp.Sphere):
        return (x**2).sum(axis=1) <= shape.radius**2
    if isinstance(shape, xp.Box):
        return (np.abs(x) <= 0.5 * np.array(shape.size)).all(axis=1)
    z = np.clip(x[:, 2], -shape.length / 2, shape.length / 2)
    return x[:, 0] ** 2 + x[:, 1] ** 2 + (x[:, 2] - z) ** 2 <= shape.radius**2


@pytest.mark.parametrize("shape", [xp.Sphere(0.7), xp.Box((0.4, 0.9, 1.3)), xp.Capsule(0.3, 1.1)], ids=repr)
def test_volume_and_moments_are_those_of_the_solid(shape: Any) -> None:
    n = 90
    half = shape.reach
    axis = (np.arange(n) + 0.5) / n * 2 * half - half
    x = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    x = x[inside(shape, x)]
    cell = (2 * half / n) ** 3
    assert shape.volume == pytest.approx(len(x) * cell, rel=0.02)
    second = (x**2).mean(axis=0)
    expected = 3.0 * (second.sum() - second)
    assert shape.inertia(3.0) == pytest.approx(expected, rel=0.02)
    assert np.sqrt((x**2).sum(axis=1)).max() <= half


def test_a_capsule_between_its_limits() -> None:
    long, flat = xp.Capsule(1e-6, 2.0), xp.Capsule(1.0, 1e-9)
    assert long.inertia(3.0)[0] == pytest.approx(3.0 * 4.0 / 12, rel=1e-5)
    assert flat.inertia(5.0) == pytest.approx(xp.Sphere(1.0).inertia(5.0), rel=1e-8)


def test_planes_have_unit_normals_and_no_end() -> None:
    assert xp.Plane((0, 3, 4)).normal == pytest.approx((0, 0.6, 0.8))
    assert xp.Plane((0, 1e-300, 0)).normal == (0, 1, 0) and xp.Plane((0, 1e300, 0)).normal == (0, 1, 0)
    assert xp.Plane().normal is None and math.isinf(xp.Plane().reach)


def test_shapes_are_values() -> None:
    assert xp.Sphere(1) == xp.Sphere(1.0) != xp.Sphere(2) and xp.Box((1, 2, 3)) == xp.Box([1, 2, 3])
    assert len({xp.Sphere(1), xp.Sphere(1), xp.Plane(), xp.Plane()}) == 2
    assert eval(repr(xp.Capsule(1, 2)), {"Capsule": xp.Capsule}) == xp.Capsule(1, 2)
    for shape in (xp.Sphere(1), xp.Box((1, 2, 3)), xp.Capsule(1, 2), xp.Plane((0, 0, 1), 0.5)):
        said = shape.describe()
        kind = getattr(xp, said.pop("kind").capitalize())
        assert kind(**said) == shape
