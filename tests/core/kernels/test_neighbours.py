"""Verlet lists: the pairs of brute force, for any coordinates, interpreted and compiled."""

import math
from array import array
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.compile import assemble, compiled
from xpheve.kernels import neighbours
from xpheve.plan.pairs import PairSet


def tiles(points: Any, slot: int = 0, width: int = 96) -> tuple[Any, Any]:
    """Positions in tiles of 32 bodies, ``width`` numbers wide, and where each body's lane begins."""
    x = np.asarray(points, dtype=float).reshape(-1, 3)
    k = np.arange(len(x))
    address = (k // 32) * width + k % 32
    s = np.full((len(x) // 32 + 1) * width, math.nan)
    for axis in range(3):
        s[address + slot + 32 * axis] = x[:, axis]
    return s, address


class List:
    """A list of pairs and its buffers; built by ``module``, which is the kernel itself or a compiled one."""

    def __init__(self, points: Any, reach: float, *, slot: int = 0, width: int = 96, capacity: int = 0) -> None:
        self.slot, self.reach = slot, reach
        self.s, self.address = tiles(points, slot, width)
        self.count = len(self.address)
        self.reference = np.full(6 * self.count, math.nan)
        self.first = np.full(self.count + 1, -77, dtype=np.int64)
        self.kind, self.kinds = np.zeros(self.count, dtype=np.int64), 0
        self.resize(capacity)

    def resize(self, capacity: int) -> None:
        self.capacity = capacity
        self.partners = np.full(2 * capacity + 1, -77, dtype=np.int64)

    def build(self) -> int:
        """Build it, interpreted, with as much room as it takes."""
        kind = memoryview(self.kind)
        for _ in range(2):
            scratch = np.full(neighbours.room(self.count), 77, dtype=np.int64)
            views = [memoryview(one) for one in (self.s, self.address, self.reference, self.first, self.partners)]
            s, address, reference, first, partners = views
            work = memoryview(scratch)
            found = neighbours.build(
                *(s, address, self.slot, self.count, kind, self.kinds),
                *(self.reach, reference, work, first, partners, self.capacity),
            )
            if found >= 0:
                return found
            assert -found > self.capacity
            self.resize(-found)
        raise AssertionError("it asked for room twice")

    def moved(self, s: Any) -> float:
        """Square of the longest way to the positions in ``s``."""
        views = [memoryview(one) for one in (s, self.address, self.reference)]
        return neighbours.moved(views[0], views[1], self.slot, self.count, views[2])

    def pairs(self) -> list[tuple[int, int]]:
        return [(i, j) for i in range(self.count) for j in self.partners[self.first[i] : self.first[i + 1]].tolist()]


def brute(points: Any, reach: float) -> list[tuple[int, int]]:
    """All pairs closer than ``reach``, one by one."""
    x = [tuple(map(float, point)) for point in points]
    found = []
    for i in range(len(x)):
        for j in range(i + 1, len(x)):
            dx, dy, dz = (x[i][k] - x[j][k] for k in range(3))
            if dx * dx + dy * dy + dz * dz < reach * reach:
                found.append((i, j))
    return found


def check(points: Any, reach: float) -> int:
    one = List(points, reach)
    count = one.build()
    pairs = one.pairs()
    assert pairs == brute(points, reach)
    assert count == len(pairs) == one.first[-1]
    return count


@pytest.mark.parametrize("count", [0, 1, 2, 31, 32, 33, 65])
def test_few_bodies_have_the_pairs_that_brute_force_finds(count: int) -> None:
    x = np.random.default_rng(count).uniform(-1, 1, (count, 3))
    found = check(x, 1.0)
    assert found > 0 or count < 2 or (count == 2 and np.linalg.norm(x[0] - x[1]) >= 1.0)


SCENES = {
    "spread": lambda r: (r.uniform(-5, 5, (200, 3)), 1.7),
    "clusters": lambda r: (r.normal(0, 0.3, (150, 3)) + 40.0 * r.integers(-2, 3, (150, 3)), 0.4),
    "on a line": lambda r: (r.uniform(-50, 50, (150, 1)) * np.array([[1.0, 2.0, -0.5]]), 2.0),
    "in a plane": lambda r: (r.uniform(-5, 5, (150, 3)) * np.array([[1.0, 0.0, 1.0]]), 1.0),
    "on the faces of cells": lambda r: (1.00001 * r.integers(-3, 4, (150, 3)).astype(float), 1.0 + 2e-5),
    "at exactly the reach": lambda r: (r.integers(-3, 4, (150, 3)).astype(float), 1.0),
    "in one place": lambda r: (np.zeros((60, 3)) + 3.0, 0.1),
    "in one cell": lambda r: (r.uniform(0, 1, (80, 3)), 1e6),
    "reach without end": lambda r: (r.uniform(0, 1, (40, 3)), math.inf),
    "huge": lambda r: (r.uniform(-1e12, 1e12, (150, 3)), 4e11),
    "huge, small reach": lambda r: (1e12 + r.uniform(0, 3, (150, 3)), 0.7),
    "tiny": lambda r: (r.uniform(-1e-9, 1e-9, (150, 3)), 5e-10),
    "one far away": lambda r: (np.vstack([r.uniform(-2, 2, (99, 3)), [[1e12, -1e300, 1e9]]]), 0.8),
    "the first far away": lambda r: (np.vstack([[[1e12, -1e300, 1e9]], r.uniform(-2, 2, (99, 3))]), 0.8),
    "two heaps a world apart": lambda r: (
        r.uniform(-2, 2, (100, 3)) + 1e10 * (np.arange(100)[:, None] % 2),
        0.8,
    ),
    "beyond all squares": lambda r: (r.choice([-1e308, 0.0, 1e308], (60, 3)), 1.0),
    "cells whose numbers begin anew": lambda r: (
        r.uniform(0, 2, (120, 3)) + 1.00001 * 2097152 * r.integers(0, 2, (120, 3)),
        1.0,
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_a_list_has_the_pairs_that_brute_force_finds_in_their_order(name: str) -> None:
    for seed in range(3):
        x, reach = SCENES[name](np.random.default_rng(seed))
        check(x, reach)


coordinates = st.one_of(
    st.floats(-3, 3),
    st.sampled_from([0.0, 1.0, -1.0, 1e12, -1e12, 1e-9, 1e308, -1e308, math.nan, math.inf, -math.inf]),
)


@settings(max_examples=150, deadline=None)
@given(st.lists(st.tuples(coordinates, coordinates, coordinates), max_size=25), st.sampled_from([1e-9, 0.5, 1.0, 3.0]))
def test_any_coordinates_give_the_pairs_of_brute_force(points: list[tuple[float, float, float]], reach: float) -> None:
    check(points, reach)


@pytest.mark.parametrize("sides", [False, True])
def test_kinds_leave_out_the_pairs_that_a_set_leaves_out(sides: bool) -> None:
    r = np.random.default_rng(8)
    x = r.uniform(-2, 2, (150, 3))
    o = [xp.PhysicalObject() for _ in x]
    for k, obj in enumerate(o):
        obj._row = k
    between = ([one for one in o if r.random() < 0.4], [one for one in o if r.random() < 0.5]) if sides else None
    law = type("Near", (xp.PairLaw,), {"cutoff": 0.9})(between=between)
    pairs = PairSet(law, o, r.random(150) < 0.3)
    one = List(x, 0.9)
    one.kind, one.kinds = pairs.kinds(), 1
    one.build()
    expected = [(a, b) for both in pairs.chunks(x.T.copy()) for a, b in zip(*(s.tolist() for s in both), strict=True)]
    assert one.pairs() == [(min(pair), max(pair)) for pair in expected]
    assert 0 < len(expected) < len(brute(x, 0.9))
    turned = [not (one.kind[i] & 4 and one.kind[j] & 2) for i, j in one.pairs()]
    assert turned == [a > b for a, b in expected]


def test_what_is_not_finite_is_in_no_pair_and_its_way_is_infinite() -> None:
    x = np.zeros((5, 3))
    x[1, 0], x[2, 1], x[3, 2] = math.nan, math.inf, -math.inf
    one = List(x, 1.0)
    assert one.build() == 1 and one.pairs() == [(0, 4)]
    assert one.moved(one.s) == math.inf


def test_positions_are_read_at_the_slot_of_a_wider_tile_and_nowhere_else() -> None:
    x = np.random.default_rng(5).uniform(-2, 2, (70, 3))
    one = List(x, 1.0, slot=128, width=480)
    one.build()
    assert one.pairs() == brute(x, 1.0)
    assert one.moved(one.s) == 0.0


def test_too_little_room_is_told_exactly_and_nothing_is_written_beyond_it() -> None:
    x = np.random.default_rng(6).uniform(0, 2, (50, 3))
    needed = len(brute(x, 1.0))
    for capacity in (0, 1, needed - 1):
        one = List(x, 1.0, capacity=capacity)
        work = np.zeros(neighbours.room(50), dtype=np.int64)
        views = [memoryview(a) for a in (one.s, one.address, one.reference, work, one.first, one.partners)]
        s, address, reference, work_, first, partners = views  # a memory view raises where an index is outside
        kind = memoryview(one.kind)
        got = neighbours.build(s, address, 0, 50, kind, 0, 1.0, reference, work_, first, partners, capacity)
        assert got == -needed
    one = List(x, 1.0, capacity=needed)
    assert one.build() == needed and one.pairs() == brute(x, 1.0)


def test_arrays_of_python_serve_as_buffers() -> None:
    s = array("d", [0.0] * 96)
    s[1] = 0.5
    address, reference = array("q", [0, 1]), array("d", [0.0] * 12)
    work, first, partners = (array("q", [0] * size) for size in (neighbours.room(2), 3, 9))
    kind = array("q", [0, 0])
    assert neighbours.build(s, address, 0, 2, kind, 0, 1.0, reference, work, first, partners, 4) == 1  # type: ignore[arg-type]
    assert list(first) == [0, 1, 1] and partners[0] == 1


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.01, 1.0), st.floats(0.0, 0.6))
def test_a_list_serves_as_long_as_it_says(seed: int, skin: float, way: float) -> None:
    """While `serves` holds, every pair within the cutoff is in the list, wherever the bodies went meanwhile."""
    r = np.random.default_rng(seed)
    x = r.uniform(-2, 2, (40, 3))
    one = List(x, 1.0 + skin)
    one.build()
    y = x + r.normal(0, 1, x.shape) * way * skin
    most = one.moved(tiles(y)[0])
    assert most == pytest.approx(((y - x) ** 2).sum(axis=1).max(), rel=1e-12)
    if neighbours.serves(most, 1.0, 1.0 + skin):
        assert set(brute(y, 1.0)) <= set(one.pairs())
        assert 2.0 * math.sqrt(most) <= skin


def test_a_list_serves_up_to_the_skin_and_no_farther() -> None:
    assert neighbours.serves(0.0, 2.5, 2.8)
    assert neighbours.serves(0.1499999**2, 2.5, 2.8)
    assert not neighbours.serves(0.1500001**2, 2.5, 2.8)
    assert not neighbours.serves(math.inf, 2.5, 2.8)


ENTRY = """
def entry(f, n):
    found = neighbours__build(f[0], n[0], 0, n[1][0], n[5], n[1][2], f[2][0], f[1], n[2], n[3], n[4], n[1][1])
    x = f[2]
    x[1] = neighbours__moved(f[0], n[0], 0, n[1][0], f[1])
    return found
"""


@pytest.mark.slow
def test_compiled_it_writes_the_same_lists() -> None:
    run = compiled(assemble(ENTRY), "lists of neighbours")
    for seed, (name, scene) in enumerate(SCENES.items()):
        x, reach = scene(np.random.default_rng(11))
        x[7, 1] = math.nan
        one = List(x, reach)
        one.kind[:], one.kinds = np.random.default_rng(seed).integers(0, 1 << 11, len(x)), seed
        count = one.build()
        n, capacity = len(x), one.capacity
        numbers, work = np.array([reach, 0.0]), np.zeros(neighbours.room(n), dtype=np.int64)
        reference, first = np.zeros(6 * n), np.zeros(n + 1, dtype=np.int64)
        partners, sizes = np.zeros(2 * capacity + 1, dtype=np.int64), np.array([n, capacity, seed])
        found = run([one.s, reference, numbers], [one.address, sizes, work, first, partners, one.kind])
        assert (found, numbers[1]) == (count, math.inf), name
        assert first.tolist() == one.first.tolist() and partners[:count].tolist() == one.partners[:count].tolist(), name
        assert reference[: 3 * n].tobytes() == one.reference[: 3 * n].tobytes()
