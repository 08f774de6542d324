"""Thesis 2.1, figure 2-1: position and orientation, in as axis and angle, turns about x, y, z, or a matrix; out as a 4x4 matrix."""

from __future__ import annotations

import math

import numpy as np
import pytest

import xpheve as xp
from xpheve import orientation as turn
from xpheve.errors import InvalidValueError

QUARTER = [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]


@pytest.mark.thesis("pose", "pose/forms")
@pytest.mark.parametrize(
    "given",
    [
        {"position": (1, 2, 3), "orientation": turn.from_axis_angle((0, 0, 1), math.pi / 2)},
        {"position": (1, 2, 3), "orientation": turn.from_euler((0, 0, math.pi / 2))},
        {"position": (1, 2, 3), "orientation": turn.from_matrix(np.array(QUARTER)[:3, :3])},
        {"position": (1, 2, 3), "orientation": (math.sqrt(0.5), 0, 0, math.sqrt(0.5))},
        {"pose": QUARTER},
    ],
    ids=["axis and angle", "x, y, z", "3x3", "quaternion", "4x4"],
)
def test_figure_2_1_every_way_to_give_an_orientation_gives_one_4x4_matrix(given: dict[str, object]) -> None:
    obj = xp.PhysicalObject(xp.Box((1, 2, 3)), **given)  # type: ignore[arg-type]
    assert np.allclose(obj.pose, QUARTER, atol=1e-15)
    assert turn.to_axis_angle(obj.orientation)[1] == pytest.approx(math.pi / 2)
    assert turn.to_euler(obj.orientation) == pytest.approx((0, 0, math.pi / 2))


@pytest.mark.thesis("pose/forms")
def test_turns_about_x_y_and_z_are_about_the_worlds_axes_in_that_order() -> None:
    x = turn.to_matrix(turn.from_axis_angle((1, 0, 0), 0.1))
    y = turn.to_matrix(turn.from_axis_angle((0, 1, 0), 0.2))
    z = turn.to_matrix(turn.from_axis_angle((0, 0, 1), 0.3))
    assert np.allclose(turn.to_matrix(turn.from_euler((0.1, 0.2, 0.3))), z @ y @ x, atol=1e-15)


@pytest.mark.thesis("pose/decide")
def test_decided_a_matrix_with_scale_is_refused_naming_the_factor_and_scaling_the_shape_is_the_way_out() -> None:
    """Decision 0014."""
    matrix = np.array(QUARTER, dtype=float) @ np.diag([2, 2, 2, 1])
    with pytest.raises(InvalidValueError, match=r"scale 2, 2, 2.*shape\.scaled\(2\)"):
        xp.PhysicalObject(xp.Sphere(1.0), pose=matrix)
    factors, _ = turn.stretch(matrix)
    obj = xp.PhysicalObject(xp.Sphere(1.0).scaled(float(factors[0])), pose=matrix @ np.diag([0.5, 0.5, 0.5, 1]))
    assert obj.shape == xp.Sphere(2.0)
