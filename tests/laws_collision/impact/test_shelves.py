"""Fixed shapes in cells: who looks at the shapes of its cell only meets the same as who looks at all, to the bit."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from tests.laws_collision.impact.loops import Restitution, flights, lattice, loop_of, plane, put, room, solid

from xpheve_laws_collision.impact import layout, rows, shelves
from xpheve_laws_collision.impact.impact_loop import ImpactLoop

SIZE = 2.0


def field(count: int, size: float = SIZE, seed: int = 4) -> list[list[float]]:
    """Turned boxes, capsules and spheres of many sizes in the lower part of a room."""
    rng = np.random.default_rng(seed)
    found = []
    for k in range(count):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        turn[:, 0] *= np.sign(np.linalg.det(turn))
        centre = rng.uniform(0.0, size, 3) * (1.0, 1.0, 0.4)
        kind = (rows.BOX, rows.CAPSULE, rows.SPHERE)[k % 3]
        sizes = (rng.uniform(0.02, 0.12, 3), (0.03, rng.uniform(0.05, 0.3)), (rng.uniform(0.02, 0.1),))[k % 3]
        found.append(solid(kind, centre, [float(one) for one in sizes], turn))
    return found


def hail(count: int, shapes: int, law: Any = None, **more: Any) -> ImpactLoop:
    """Balls of three sizes falling onto the field."""
    loop = loop_of(count, room(SIZE) + field(shapes), law or Restitution(0.9), **more)
    x, v = lattice(count, 0.9 * SIZE, seed=3)
    x[2] = SIZE - 0.06 - 0.4 * x[2]
    k = np.arange(count)
    put(loop, x, 2.0 * v, radius=0.02 * (1.0 + 0.5 * (k % 3)), mass=1.0 + k % 5, acceleration=(0.0, 0.0, -3.0))
    return loop


def test_cells_or_none_give_the_same_bits_interpreted() -> None:
    one, other = hail(10, 60, cells=True), hail(10, 60, cells=False)
    for loop in (one, other):
        assert loop.run((0.5, 0.0)).kind == "limit"
    assert one.impacts == other.impacts > 3 and one.crossings > 0 == other.crossings
    assert flights(one).tobytes() == flights(other).tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("crowd", [0.05, 0.35, 30.0])
def test_cells_of_any_size_give_the_same_bits(crowd: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(layout, "PLACES_A_CELL", crowd)
    one, other = hail(60, 90, compiled=True, cells=True), hail(60, 90, compiled=True, cells=False)
    for loop in (one, other):
        loop.run((1.5, 0.0))
    assert one.impacts == other.impacts > 100 and one.crossings > 0 == other.crossings
    assert flights(one).tobytes() == flights(other).tobytes()


def test_few_places_have_cells_where_there_are_many_shapes() -> None:
    assert loop_of(3, field(200)).celled and not loop_of(3, field(20)).celled and not loop_of(3, room(SIZE) * 50).celled


@pytest.mark.parametrize("kind", [rows.SPHERE, rows.BOX, rows.CAPSULE])
def test_a_shape_is_in_each_cell_from_which_it_can_be_touched(kind: int) -> None:
    rng = np.random.default_rng(kind)
    shapes = np.array([one for one in field(90) if one[rows.KIND] == kind])
    state = np.zeros((50, rows.STATES))
    state[:, rows.X : rows.X + 3] = rng.uniform(0.0, SIZE, (50, 3))
    state[:, rows.RADIUS] = 0.05
    grid = layout.grid_for(state, (0.0, 0.0), None, False, shelves.bounds(shapes))
    endless, lists = shelves.shelves_for(shapes, grid)
    everywhere = set(lists[:endless].tolist())
    half, radius = shelves.cores(shapes)
    turns = shelves.rotations(shapes)
    touching = 0
    for x in rng.uniform(-0.2, SIZE + 0.2, (4000, 3)):
        inside = np.einsum("mji,mj->mi", turns, x - shapes[:, rows.CENTRE : rows.CENTRE + 3])
        gap = np.linalg.norm(np.maximum(np.abs(inside) - half, 0.0), axis=1) - radius - 0.05
        cell = np.floor((x - grid.origin) / grid.widths).astype(int) % grid.sizes
        at = endless + (cell[0] * grid.sizes[1] + cell[1]) * grid.sizes[2] + cell[2]
        listed = lists[lists[at] : lists[at + 1]]
        assert (np.diff(listed) > 0).all()
        near = set(np.flatnonzero(gap <= 1e-9).tolist())
        assert near <= everywhere | set(listed.tolist())
        touching += len(near)
    assert touching > 20 and len(lists) < 0.5 * len(shapes) * math.prod(grid.sizes)


def test_planes_and_what_fills_the_room_are_for_all_to_look_at() -> None:
    shapes = np.array([*field(60), plane((0.0, 0.0, 1.0), 0.0), solid(rows.BOX, (0.0, 0.0, -5.0), (50.0, 50.0, 5.0))])
    state = np.zeros((400, rows.STATES))
    state[:, rows.X : rows.X + 3] = np.random.default_rng(1).uniform(0.0, SIZE, (400, 3))
    state[:, rows.RADIUS] = 0.02
    grid = layout.grid_for(state, (0.0, 0.0), None, False, shelves.bounds(shapes[:60]))
    endless, lists = shelves.shelves_for(shapes, grid)
    assert lists[:endless].tolist() == [60, 61]


def test_who_touches_is_found_in_the_cells_as_among_all() -> None:
    found = []
    for cells in (True, False):
        loop = loop_of(40, room(SIZE) + field(60), cells=cells)
        x, v = lattice(40, SIZE, seed=3)
        x[:, 1] = x[:, 0] + (0.1, 0.0, 0.0)
        x[:, 2] = (0.05, 1.0, 1.9)
        put(loop, x, 0.0 * v)
        loop.next_time()
        found.append([sorted(loop.near(place, (0.0, 0.0))) for place in range(40)])
    assert found[0] == found[1]
    assert (1, False) in found[0][0] and (0, False) in found[0][1] and (0, True) in found[0][2]


@pytest.mark.slow
def test_a_shape_in_a_cell_far_ahead_is_not_overlooked_where_balls_are_sparse() -> None:
    loop = loop_of(1000, [solid(rows.BOX, (0.0, 0.0, -60.0), (9.0, 9.0, 1.0), np.eye(3))], compiled=True)
    x, _ = lattice(1000, 100.0, seed=3)
    put(loop, x - 50.0, 0.0 * x + [[0.0], [0.0], [-40.0]])
    found = []
    for limit in (0.1, 0.2, 0.3, 0.5):
        loop.next_time()
        loop.run((limit, 0.0))
        found.append(loop.impacts)
    assert found == [0, 0, 0, 8], "four hit the box, and as they come back those behind them"
