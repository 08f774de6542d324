"""The tree finds every box that a ray meets, and no other."""

from __future__ import annotations

import numpy as np
import pytest

from xpheve_laws_collision.queries.tree import Tree, inverses, meets


@pytest.mark.parametrize("count", [0, 1, 7, 16, 17, 129, 1500])
def test_it_finds_what_looking_at_all_boxes_finds(count: int) -> None:
    rng = np.random.default_rng(count)
    low = rng.uniform(-5, 5, (count, 3))
    high = low + rng.uniform(0, 1, (count, 3))
    origin, direction = rng.uniform(-8, 8, (60, 3)), rng.normal(size=(60, 3))
    direction[:3] = np.eye(3)  # rays along the axes have components that are zero
    length = rng.uniform(0.1, 20.0, 60)
    length[:5] = np.inf
    ray, box = Tree(low, high).met_by(origin, direction, length)
    found = set(zip(ray.tolist(), box.tolist(), strict=True))
    assert len(found) == len(ray)
    all_rays, all_boxes = np.repeat(np.arange(60), count), np.tile(np.arange(count), 60)
    hit = meets(origin[all_rays], inverses(direction)[all_rays], length[all_rays], low[all_boxes], high[all_boxes])
    assert found == set(zip(all_rays[hit].tolist(), all_boxes[hit].tolist(), strict=True))


def test_boxes_at_one_place_are_no_trouble() -> None:
    low = np.zeros((300, 3))
    _, box = Tree(low, low + 1.0).met_by(np.array([[-1.0, 0.5, 0.5]]), np.array([[1.0, 0.0, 0.0]]), np.array([np.inf]))
    assert sorted(box.tolist()) == list(range(300))


def test_a_ray_in_the_face_of_a_box_meets_it() -> None:
    one, unit = np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0]])
    assert meets(one, inverses(unit), np.array([9.0]), np.array([[1.0, 0.0, -1.0]]), np.array([[2.0, 1.0, 1.0]])).all()
    assert not meets(
        one, inverses(unit), np.array([9.0]), np.array([[1.0, 0.1, -1.0]]), np.array([[2.0, 1.0, 1.0]])
    ).any()
