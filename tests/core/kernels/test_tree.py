"""The tree finds what the direct sum finds, to the error that is asked for, wherever bodies are and whatever their charges."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from xpheve.compile import assemble, compiled, interpreted
from xpheve.kernels import tree

TEXT = assemble(
    """
def entry(f, n):
    count = n[0][0]
    if n[0][1] == 0:
        return tree__solve(count, f[0], n[1], f[1], f[2][0], f[2][1])
    tree__fields(count, f[0], n[1], f[1], f[2][0], f[2][2], n[0][2], n[0][3])
    return 0
"""
)


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XPHEVE_CACHE_DIR", str(tmp_path_factory.mktemp("cache")))
        yield


class Solved:
    """Fields (3, n) in the order of the bodies, the error told, how many walks, and the buffers."""

    def __init__(self, x: np.ndarray, q: np.ndarray, softening: float, error: float, run: object = interpreted) -> None:
        n = len(q)
        size = tree.stride(n)
        self.s, self.w = np.zeros(tree.floats(n)), np.zeros(tree.ints(n), dtype=np.int64)
        self.t, self.numbers = np.zeros(tree.SCRATCH), np.array([softening**2, error, 0.0])
        for c in range(3):
            self.s[c * size : c * size + n] = x[c]
        self.s[3 * size : 3 * size + n] = q
        self.walks = self.call(run, [n, 0])
        self.order = self.w[:n]
        self.field = np.zeros((3, n))
        self.field[:, self.order] = self.s[4 * size : 7 * size].reshape(3, size)[:, :n]
        self.told = self.t[0]

    def call(self, run: object, counts: list[int]) -> int:
        return run(TEXT)([self.s, self.t, self.numbers], [np.array(counts), self.w])  # type: ignore[operator]


def direct(x: np.ndarray, q: np.ndarray, softening: float) -> np.ndarray:
    """All pairs, in NumPy."""
    d = x[:, :, None] - x[:, None, :]
    square = (d * d).sum(axis=0) + softening**2
    np.fill_diagonal(square, 1.0)
    with np.errstate(all="ignore"):
        k = q / (square * np.sqrt(square))
        np.fill_diagonal(k, 0.0)
        return np.einsum("cij,ij->ci", d, k)


def percentile(found: np.ndarray, exact: np.ndarray) -> float:
    whole = np.linalg.norm(exact, axis=0)
    off = np.linalg.norm(found - exact, axis=0)
    return float(np.percentile(np.divide(off, whole, out=np.zeros_like(off), where=off > 0.0), 99))


def plummer(rng: np.random.Generator, n: int) -> np.ndarray:
    radius = 1.0 / np.sqrt(rng.uniform(0.001, 0.999, n) ** (-2.0 / 3.0) - 1.0)
    way = rng.normal(size=(3, n))
    return radius * way / np.linalg.norm(way, axis=0)


def scene(kind: str, n: int, seed: int = 3) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    x, q = rng.normal(size=(3, n)), np.full(n, 1.0 / n)
    if kind == "plummer":
        x = plummer(rng, n)
    elif kind == "plasma":
        x, q = rng.uniform(-1.0, 1.0, (3, n)), rng.choice([-1.0, 1.0], n)
    elif kind == "charged gas":
        q = rng.choice([-1.0, 2.0], n)
    elif kind == "masses":
        q = 10.0 ** rng.uniform(-6.0, 0.0, n)
    elif kind == "massless":
        q = np.where(np.arange(n) < 3, 1.0, 0.0)
    elif kind == "wide":
        x = x * 10.0 ** rng.uniform(-9.0, 12.0, n)
    elif kind == "runaway":
        x[:, 0] *= 1e12
    elif kind == "lumps":
        x = 1e-3 * x + rng.normal(size=(3, 20))[:, rng.integers(0, 20, n)]
    elif kind == "disc":
        x[2] *= 1e-3
    elif kind == "line":
        x[1:] = 0.0
    elif kind == "lattice":
        x = np.stack(np.meshgrid(*3 * [np.arange(13.0)])).reshape(3, -1)[:, :n]
        q = np.ones(x.shape[1])
    return x, q


KINDS = [
    "plummer",
    "plasma",
    "charged gas",
    "masses",
    "massless",
    "wide",
    "runaway",
    "lumps",
    "disc",
    "line",
    "lattice",
]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("error", [1e-2, 1e-4])
def test_the_error_is_about_what_was_asked_for_and_what_is_told(kind: str, error: float) -> None:
    x, q = scene(kind, 2000)
    found = Solved(x, q, 1e-3, error, compiled)
    exact = direct(x, q, 1e-3)
    assert found.told <= error
    assert percentile(found.field, exact) < 2.0 * error  # the sample has 128 of the bodies
    assert 1 <= found.walks <= tree.FINER


def test_a_finer_error_costs_more_and_gives_more() -> None:
    x, q = scene("plummer", 3000)
    exact = direct(x, q, 0.01)
    errors = [percentile(Solved(x, q, 0.01, error, compiled).field, exact) for error in (1e-2, 1e-3, 1e-4, 1e-6)]
    assert errors == sorted(errors, reverse=True) and errors[0] > 1e-4 and errors[-1] <= 2e-6


def test_a_walk_that_is_not_good_enough_is_made_again_more_finely() -> None:
    x, q = scene("disc", 10_000)
    found = Solved(x, q, 1e-3, 1e-3, compiled)
    assert found.walks > 1 and found.told <= 1e-3


def test_an_error_beyond_rounding_gives_the_direct_sum() -> None:
    x, q = scene("plasma", 300)
    found = Solved(x, q, 0.0, 1e-30, compiled)
    assert found.told == 0.0
    assert percentile(found.field, direct(x, q, 0.0)) < 1e-13


@pytest.mark.parametrize("kind", ["plummer", "plasma", "lumps", "lattice"])
@pytest.mark.parametrize("n", [1, 2, 9, 33, 150, 400])
def test_bits_are_the_same_interpreted_and_compiled(kind: str, n: int) -> None:
    x, q = scene(kind, n)
    one, other = Solved(x, q, 0.01, 1e-3, interpreted), Solved(x, q, 0.01, 1e-3, compiled)
    assert one.field.tobytes() == other.field.tobytes()
    assert (one.walks, one.told, one.order.tolist()) == (other.walks, other.told, other.order.tolist())


def test_groups_may_be_found_in_any_order_and_by_any_thread() -> None:
    x, q = scene("plummer", 1000)
    found = Solved(x, q, 0.01, 1e-3, compiled)
    size = tree.stride(1000)
    found.numbers[2] = 1e-3
    found.call(compiled, [1000, 1, 0, 32])
    whole = found.s[4 * size : 7 * size].copy()
    found.s[4 * size : 7 * size] = 0.0
    for begin, end in ((20, 32), (0, 7), (7, 20)):
        found.call(compiled, [1000, 1, begin, end])
    assert found.s[4 * size : 7 * size].tobytes() == whole.tobytes()


def test_the_tree_has_full_leaves_and_every_body_once() -> None:
    x, q = scene("lumps", 1237)
    found = Solved(x, q, 0.01, 1e-2, compiled)
    size, most = tree.stride(1237), tree.nodes(1237)
    assert sorted(found.order.tolist()) == list(range(1237))
    first, last = found.w[size : size + most], found.w[size + most : size + 2 * most]
    after = found.w[size + 2 * most : size + 3 * most]
    leaves = last - first <= tree.LEAF
    assert sorted((last - first)[leaves].tolist())[1:] == [tree.LEAF] * (leaves.sum() - 1)
    assert (after[leaves] == np.flatnonzero(leaves) + 1).all() and after[0] == most
    weight = found.s[7 * size :][: tree.NODE * most].reshape(most, tree.NODE)
    radius = weight[:, tree.RADIUS]
    for k in range(0, most, 17):
        inside = x[:, found.order[first[k] : last[k]]]
        assert np.linalg.norm(inside - weight[k, :3, None], axis=0).max() <= radius[k] * (1.0 + 1e-12)
        assert math.isclose(weight[k, tree.CHARGE], q[found.order[first[k] : last[k]]].sum(), rel_tol=1e-12)


def test_moments_of_a_node_are_those_of_its_bodies() -> None:
    x, q = scene("charged gas", 500)
    found = Solved(x, q, 0.01, 1e-2, compiled)
    size = tree.stride(500)
    root = found.s[7 * size : 7 * size + tree.NODE]
    off = x - root[:3, None]
    assert np.allclose(root[:3], (np.abs(q) * x).sum(axis=1) / np.abs(q).sum(), atol=1e-12)
    assert np.allclose(root[tree.DIPOLE : tree.DIPOLE + 3], (q * off).sum(axis=1), atol=1e-10)
    second = np.einsum("i,ai,bi->ab", q, off, off)
    assert np.allclose(root[tree.QUADRUPOLE : tree.QUADRUPOLE + 6], second[np.triu_indices(3)], atol=1e-9)
    assert math.isclose(root[tree.SPREAD], (np.abs(q) * (off**2).sum(axis=0)).sum(), rel_tol=1e-12)


@pytest.mark.parametrize("softening", [0.0, 0.1])
@pytest.mark.parametrize("n", [2, 40, 3000])
def test_bodies_all_in_one_place_are_as_the_direct_sum_has_them(n: int, softening: float) -> None:
    x, q = np.full((3, n), 0.7), np.ones(n)
    found = Solved(x, q, softening, 1e-3, compiled)
    assert np.isnan(found.field).all() if softening == 0.0 else not found.field.any()


def test_two_bodies_in_one_place_spoil_one_another_and_nobody_else() -> None:
    x, q = scene("plummer", 500)
    x[:, 7] = x[:, 300]
    found = Solved(x, q, 0.0, 1e-3, compiled)
    assert np.flatnonzero(np.isnan(found.field).any(axis=0)).tolist() == [7, 300]
    others = np.delete(np.arange(500), [7, 300])
    assert percentile(found.field[:, others], direct(x, q, 0.0)[:, others]) < 2e-3


@pytest.mark.parametrize("wrong", [math.nan, math.inf])
def test_a_place_that_is_no_number_spoils_all_and_ends(wrong: float) -> None:
    x, q = scene("plummer", 700)
    x[1, 123] = wrong
    found = Solved(x, q, 0.01, 1e-3, compiled)
    assert np.isnan(found.field[1]).all()


def test_nothing_and_one_body_have_no_field() -> None:
    assert not Solved(np.zeros((3, 1)), np.ones(1), 0.0, 1e-3).field.any()
    assert Solved(np.zeros((3, 0)), np.ones(0), 0.0, 1e-3).walks == 0


@given(st.integers(1, 90), st.integers(0, 2**32 - 1), st.sampled_from([1.0, 1e-200, 1e100]), st.booleans())
def test_few_bodies_of_any_size_end_with_the_error_told(n: int, seed: int, scale: float, many: bool) -> None:
    rng = np.random.default_rng(seed)
    x = scale * (rng.integers(-2, 3, (3, n)) if many else rng.normal(size=(3, n)))
    q = rng.choice([0.0, -1.0, 1.0, 1e-9], n)
    found = Solved(x, q, 0.05 * scale, 1e-3, compiled)
    assert sorted(found.order.tolist()) == list(range(n))
    assert 1 <= found.walks <= tree.FINER + 1
    if scale == 1.0:
        whole = np.linalg.norm(direct(x, q, 0.05), axis=0)
        off = np.linalg.norm(found.field - direct(x, q, 0.05), axis=0)
        assert (off <= 1e-3 * whole + 1e-13).all()  # all bodies are in the sample
