"""Poses in and out, `xpheve.orientation`, and the pose of an object."""

from __future__ import annotations

import math
from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import xpheve as xp
from xpheve import orientation as turn
from xpheve.errors import InvalidValueError

angle = st.floats(-math.pi, math.pi)
angles = st.tuples(angle, angle, angle)
vector = st.tuples(*[st.floats(-10, 10)] * 3)
ORDERS = ["".join(p) for p in permutations("xyz")] + ["".join(p).upper() for p in permutations("xyz")]


def same(p: object, q: object) -> bool:
    """Whether two quaternions are one orientation."""
    return abs(float(np.dot(p, q))) > 1 - 1e-12  # type: ignore[arg-type]


@example((0.0, 2.2250738585e-313, 2.2250738585e-313))
@given(angles)
def test_axis_and_angle_come_back(v: tuple[float, float, float]) -> None:
    q = turn.from_rotation_vector(v)
    axis, amount = turn.to_axis_angle(q)
    assert 0 <= amount <= math.pi and abs(math.hypot(*axis) - 1) < 1e-15
    assert same(turn.from_axis_angle(axis, amount), q)
    assert same(turn.from_rotation_vector(turn.to_rotation_vector(q)), q)


@given(angles, st.sampled_from(ORDERS))
def test_three_angles_come_back_in_every_order(v: tuple[float, float, float], order: str) -> None:
    q = turn.from_euler(v, order)
    back = turn.to_euler(q, order)
    assert abs(back[1]) <= math.pi / 2 + 1e-12
    assert same(turn.from_euler(back, order), q)


@given(angles)
def test_small_letters_are_fixed_axes_and_capitals_the_bodys(v: tuple[float, float, float]) -> None:
    x, y, z = (turn.to_matrix(turn.from_axis_angle(np.eye(3)[k], v[k])) for k in range(3))
    assert np.allclose(turn.to_matrix(turn.from_euler(v)), z @ y @ x, atol=1e-14)
    assert np.allclose(turn.to_matrix(turn.from_euler(v, "XYZ")), x @ y @ z, atol=1e-14)
    assert same(turn.from_euler(v), turn.from_euler(v[::-1], "ZYX"))


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("sign", [1, -1])
def test_angles_are_found_in_gimbal_lock(order: str, sign: int) -> None:
    q = turn.from_euler((0.3, sign * math.pi / 2, 0.5), order)
    assert same(turn.from_euler(turn.to_euler(q, order), order), q)


def test_repeated_axes_can_be_given_though_not_read() -> None:
    q = turn.from_euler((0.1, 0.2, 0.3), "ZXZ")
    z, x, w = (
        turn.to_matrix(turn.from_axis_angle(a, t)) for a, t in (((0, 0, 1), 0.1), ((1, 0, 0), 0.2), ((0, 0, 1), 0.3))
    )
    assert np.allclose(turn.to_matrix(q), z @ x @ w, atol=1e-15)
    with pytest.raises(InvalidValueError, match="three different axes"):
        turn.to_euler(q, "ZXZ")


@given(angles, vector)
def test_matrices_come_back(v: tuple[float, float, float], p: tuple[float, float, float]) -> None:
    q = turn.from_rotation_vector(v)
    matrix = turn.to_pose(p, q)
    back = turn.from_pose(matrix)
    assert back[0] == pytest.approx(p) and same(back[1], q)
    assert np.allclose(matrix[:3, :3].T @ matrix[:3, :3], np.eye(3), atol=4e-16 * 4)
    assert same(turn.from_matrix(matrix), q) and same(turn.from_matrix(matrix[:3, :3]), q)


def test_all_quarter_turns_come_back() -> None:
    for order in permutations(range(3)):
        for signs in product((1, -1), repeat=3):
            matrix = np.eye(3)[list(order)] * np.array(signs)[:, None]
            if np.linalg.det(matrix) > 0:
                assert np.allclose(turn.to_matrix(turn.from_matrix(matrix)), matrix, atol=4e-16)


def test_a_matrix_in_float32_is_taken_as_the_nearest_rotation() -> None:
    q = turn.from_rotation_vector((1.0, 2.0, 0.5))
    found = turn.from_matrix(turn.to_matrix(q).astype(np.float32))
    assert np.allclose(turn.to_matrix(found), turn.to_matrix(q), atol=1e-7)
    assert abs(math.fsum(x * x for x in found) - 1) < 4e-16


@pytest.mark.parametrize(
    ("matrix", "said"),
    [
        (np.diag([2.0, 2, 2, 1]), r"scale 2, 2, 2.*shape\.scaled\(2\)"),
        (np.diag([1.0, 2, 3, 1]), r"scale 1, 2, 3.*shape\.scaled\(\(1, 2, 3\)\)"),
        (np.diag([-1.0, 1, 1, 1]), "reflection"),
        ([[1, 0.5, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], "shear of 0.447"),
        ([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 1]], "perspective"),
        (np.diag([0.0, 1, 1, 1]), "flattens"),
        (np.full((4, 4), np.nan), "finite"),
        (np.eye(3), r"shape \(4, 4\)"),
        ("x", "a matrix of numbers"),
    ],
)
def test_what_no_pose_can_hold_is_refused_by_name_before_anything_changes(matrix: object, said: str) -> None:
    obj = xp.PhysicalObject(xp.Sphere(1), position=(1, 2, 3))
    with pytest.raises(InvalidValueError, match=said):
        obj.pose = matrix
    assert obj.position == (1, 2, 3)


@pytest.mark.parametrize(
    "bad",
    [
        lambda: turn.from_axis_angle((0, 0, 0), 1),
        lambda: turn.from_axis_angle((0, 0, 1), math.inf),
        lambda: turn.from_euler((1, 2), "xyz"),
        lambda: turn.from_euler((1, 2, 3), "xYz"),
        lambda: turn.from_euler((1, 2, 3), "xyw"),
        lambda: turn.unit((0, 0, 0, 0)),
        lambda: turn.from_matrix(np.eye(2)),
        lambda: xp.PhysicalObject(pose=np.eye(4), position=(1, 0, 0)),
    ],
)
def test_bad_values_are_refused(bad: object) -> None:
    with pytest.raises(InvalidValueError):
        bad()  # type: ignore[operator]


@given(angles, vector, angles, vector)
def test_poses_compose_as_their_matrices_do(a: object, p: object, b: object, q: object) -> None:
    one, two = (p, turn.from_rotation_vector(a)), (q, turn.from_rotation_vector(b))  # type: ignore[arg-type]
    both = turn.to_pose(*turn.compose(one, two))  # type: ignore[arg-type]
    assert np.allclose(both, turn.to_pose(*one) @ turn.to_pose(*two), atol=1e-12)  # type: ignore[arg-type]
    assert np.allclose(turn.to_pose(*turn.inverse(one)) @ turn.to_pose(*one), np.eye(4), atol=1e-12)  # type: ignore[arg-type]


@given(angles, vector)
def test_the_pose_of_an_object_is_that_of_the_frame_its_shape_was_authored_in(v: object, p: object) -> None:
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3.0)])
    shape = xp.Hull(corners)
    matrix = turn.to_pose(p, turn.from_rotation_vector(v))  # type: ignore[arg-type]
    obj = xp.PhysicalObject(shape, pose=matrix)
    assert np.allclose(obj.pose, matrix, atol=1e-13)
    assert np.allclose(obj.position, (matrix @ (0.25, 0.5, 0.75, 1))[:3], atol=1e-13)
    body = turn.to_pose(obj.position, obj.orientation)
    assert np.allclose(
        shape.vertices @ body[:3, :3].T + body[:3, 3], corners @ matrix[:3, :3].T + matrix[:3, 3], atol=1e-13
    )


def test_the_pose_of_an_object_in_an_engine_can_be_set() -> None:
    engine = xp.PhysicsEngine()
    obj = engine.add_object(xp.PhysicalObject(xp.Box((1, 2, 3)), velocity=(1, 0, 0)))
    engine.run(until=1.0)
    obj.pose = turn.to_pose((5, 0, 0), turn.from_axis_angle((0, 0, 1), 0.5))
    engine.run(until=2.0)
    assert obj.position == pytest.approx((6, 0, 0)) and obj.pose[:3, 3] == pytest.approx((6, 0, 0))
