"""Thesis 2.2, figures 2-2 to 2-4: parts grouped in one object keep their poses in it, through any motion."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve import orientation as turn

UPRIGHT = turn.from_axis_angle((1, 0, 0), math.pi / 2)
DOOR = xp.Box((1.0, 0.05, 0.8))
WHEEL = xp.Capsule(0.3, 0.05)


def car() -> xp.Compound:
    """Body, two doors, four wheels; x is ahead, z up."""
    body = xp.Part(xp.Box((4.0, 1.6, 0.8)), (0, 0, 0.7), density=150.0)
    doors = [xp.Part(DOOR, (0.2, y, 0.8), density=400.0) for y in (-0.85, 0.85)]
    wheels = [xp.Part(WHEEL, (x, y, 0.3), UPRIGHT, density=900.0) for x in (-1.3, 1.3) for y in (-0.8, 0.8)]
    return xp.Compound([body, *doors, *wheels])


def pose_of(obj: xp.PhysicalObject, part: xp.Part) -> np.ndarray:
    """Of a part, in the world."""
    return turn.to_pose(obj.position, obj.orientation) @ turn.to_pose(part.position, part.orientation)


@pytest.mark.thesis("parts")
def test_figure_2_3_the_car_is_one_object_of_seven_parts() -> None:
    obj = xp.PhysicalObject(car(), pose=np.eye(4))
    assert [part.shape.kind for part in obj.shape.parts] == ["box"] * 3 + ["capsule"] * 4
    assert obj.mass == pytest.approx(150 * 5.12 + 400 * 0.08 + 4 * 900 * WHEEL.volume)
    heights = [0.7] + [0.8] * 2 + [0.3] * 4
    weights = [150 * 5.12] + [400 * 0.04] * 2 + [900 * WHEEL.volume] * 4
    assert obj.position == pytest.approx((*np.average([[0.0, 0], [0.2, 0], [0.2, 0]] + [[0.0, 0]] * 4, axis=0, weights=weights),
                                          np.average(heights, weights=weights)))  # fmt: skip
    for part, authored in zip(obj.shape.parts, car().authored_parts, strict=True):
        assert np.allclose(pose_of(obj, part), turn.to_pose(authored.position, authored.orientation), atol=1e-14)


@pytest.mark.thesis("parts")
@given(
    st.tuples(*[st.floats(-5, 5)] * 3),
    st.tuples(*[st.floats(-5, 5)] * 3),
    st.tuples(*[st.floats(-3, 3)] * 3),
    st.floats(0.1, 20),
)
@settings(max_examples=30, deadline=None)
def test_figure_2_4_parts_keep_their_poses_through_any_motion(
    velocity: tuple[float, float, float],
    spin: tuple[float, float, float],
    facing: tuple[float, float, float],
    until: float,
) -> None:
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", acceleration=9.8)
    start = turn.to_pose((1, 2, 3), turn.from_rotation_vector(facing))
    obj = engine.add_object(
        xp.PhysicalObject(car(), pose=start, velocity=velocity, angular_velocity=spin), laws=[gravity]
    )
    engine.run(until=until)
    for part, authored in zip(obj.shape.parts, car().authored_parts, strict=True):
        inside = np.linalg.inv(obj.pose) @ pose_of(obj, part)
        assert np.allclose(inside, turn.to_pose(authored.position, authored.orientation), atol=1e-11)
    corner = np.linalg.norm(pose_of(obj, obj.shape.parts[0])[:3, 3] - pose_of(obj, obj.shape.parts[3])[:3, 3])
    assert corner == pytest.approx(np.linalg.norm(np.subtract((0, 0, 0.7), (-1.3, -0.8, 0.3))), rel=1e-12)


@pytest.mark.thesis("parts")
def test_a_group_falls_as_one_body_of_its_whole_mass() -> None:
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", acceleration=9.8)
    obj = engine.add_object(xp.PhysicalObject(car()), laws=[gravity])
    engine.run(until=1.0)
    assert obj.velocity == pytest.approx((0, 0, -9.8)) and obj.position == pytest.approx((0, 0, -4.9))
