"""Many orbits at once, to the bits of one by one."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from xpheve.kernels import kepler
from xpheve.steppers.kepler_arrays import FEW, moved, prepared

N = 600


def orbits(seed: int) -> tuple[list[Any], np.ndarray]:
    """Orbits of all kinds and sizes, some of them falls, some repelled, some free; and times from 1e-12 to 1e9 of their own."""
    rng = np.random.default_rng(seed)
    found, times = [], np.empty(N)
    for k in range(N):
        size = 10.0 ** rng.uniform(-9, 12)
        mu = 10.0 ** rng.uniform(-20, 20) * rng.choice([1.0, 1.0, 1.0, -1.0])
        d = rng.normal(size=3) * size
        v = rng.normal(size=3) * math.sqrt(abs(mu) / size) * 10.0 ** rng.uniform(-2, 0.3)
        if k % 7 == 0:
            d[1:] = v[1:] = 0.0
        if k % 11 == 0:
            mu = 0.0
        pairs = [tuple((float(one), float(one) * 1e-17) for one in vector) for vector in (d, v)]
        found.append(kepler.prepare(pairs[0], pairs[1], (float(mu), float(mu) * 1e-17)))  # type: ignore[arg-type]
        times[k] = rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-12, 9) / found[-1][1]
    times[::40] = 0.0
    return found, times


def same(found: tuple[np.ndarray, ...], one: Any, at: int) -> bool:
    return all(np.array_equal(array[:, at], part, equal_nan=True) for array, part in zip(found, one, strict=True))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_arrays_have_the_bits_of_floats(seed: int) -> None:
    every, times = orbits(seed)
    rests = times * 1e-17
    found = moved(np.array(every).T, times, rests)
    fallen = 0
    for k, orbit in enumerate(every):
        one = kepler.moved(orbit, float(times[k]), float(rests[k]))
        assert same(found, one, k), (orbit, times[k])
        fallen += math.isnan(one[0][0])
    assert 5 < fallen < N / 4


def test_one_orbit_at_many_times() -> None:
    orbit = kepler.prepare(
        ((0.1, 0.0), (0.0, 0.0), (0.0, 0.0)), ((0.0, 0.0), (math.sqrt(19.0), 0.0), (0.0, 0.0)), (1.0, 0.0)
    )
    times = np.linspace(-2000.0, 2000.0, 1001)
    found = moved(np.array(orbit)[:, None], times, np.zeros(len(times)))
    assert all(same(found, kepler.moved(orbit, s, 0.0), k) for k, s in enumerate(times.tolist()))
    assert np.isfinite(found).all()


def test_what_others_do_changes_no_bit() -> None:
    every, times = orbits(4)
    table = np.array(every).T
    together = np.array(moved(table, times, 0.0 * times))
    apart = np.concatenate(
        [np.array(moved(table[:, k : k + 3], times[k : k + 3], np.zeros(3))) for k in range(0, N, 3)], axis=2
    )
    assert np.array_equal(together, apart, equal_nan=True)


@pytest.mark.parametrize("n", [1, FEW, FEW + 1, 700])
def test_prepared_together_orbits_have_the_bits_of_one_by_one(n: int) -> None:
    rng = np.random.default_rng(n)
    size, mu = 10.0 ** rng.uniform(-9, 12, n), 10.0 ** rng.uniform(-20, 20, n) * rng.choice([1.0, 1.0, -1.0], n)
    d = rng.normal(size=(3, n)) * size
    v = rng.normal(size=(3, n)) * np.sqrt(np.abs(mu) / size) * 10.0 ** rng.uniform(-3, 0.4, n)
    d[1:, ::7] = v[1:, ::7] = 0.0  # falls
    v[:, 3::21] = 0.0
    mu[5::11] = 0.0
    for k in range(1, n, 13):  # circles
        across = np.cross(d[:, k], (0.0, 0.0, 1.0))
        v[:, k] = across * math.sqrt(abs(mu[k]) / np.linalg.norm(d[:, k])) / np.linalg.norm(across)
    given = [(one, one * 1e-17) for one in (d, v, mu)]
    found = prepared(*given)
    for k in range(n):
        place, velocity = ([(float(a[c, k]), float(b[c, k])) for c in range(3)] for a, b in given[:2])
        strength = float(given[2][0][k]), float(given[2][1][k])
        assert np.array_equal(found[:, k], kepler.prepare(tuple(place), tuple(velocity), strength)), k  # type: ignore[arg-type]


def test_none_at_all() -> None:
    assert moved(np.zeros((35, 0)), np.zeros(0), np.zeros(0))[0].shape == (3, 0)
