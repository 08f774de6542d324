"""Compounds, hulls and meshes: mass properties, frames, descriptions."""

from __future__ import annotations

import itertools
import json
import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve import orientation as turn
from xpheve.errors import InvalidValueError
from xpheve.kernels.principal_axes import principal_axes
from xpheve.shapes import Shape, from_description
from xpheve.shapes.triangles import triangles

edge = st.floats(0.1, 10)
vector = st.tuples(*[st.floats(-5, 5)] * 3)
CUBE = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
CORNER = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1.0)])
CORNER_FACES = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])


def tensor_of(shape: Shape, mass: float) -> np.ndarray:
    """Inertia tensor about the centre along the authored axes."""
    rotation = turn.to_matrix(shape.frame[1])  # authored to body
    return rotation.T @ np.diag(shape.inertia(mass)) @ rotation


def centre_of(shape: Shape) -> np.ndarray:
    """Centre of mass in the authored frame."""
    return np.array(turn.inverse(shape.frame)[0])


def rows_of(matrix: np.ndarray) -> tuple[tuple[float, ...], ...]:
    return tuple(map(tuple, matrix.tolist()))


# Hulls and meshes


@given(edge, edge, edge, vector)
def test_the_hull_of_a_boxs_corners_is_the_box(x: float, y: float, z: float, at: tuple[float, float, float]) -> None:
    hull, box = xp.Hull(CUBE * (x, y, z) + at), xp.Box((x, y, z))
    assert hull.volume == pytest.approx(box.volume, rel=1e-13)
    assert hull.frame[1] == (1, 0, 0, 0)
    assert np.allclose(hull.frame[0], -np.array(at), atol=1e-14)
    assert hull.inertia(2.0) == pytest.approx(box.inertia(2.0), rel=1e-13)
    assert hull.reach == pytest.approx(box.reach, rel=1e-13)


def test_a_tetrahedron_has_the_moments_of_the_closed_form() -> None:
    """A corner of a cube of unit edges: V = 1/6, centre 1/4, I_xx = 3 m / 40, I_xy = -m / 80 (to the centre)."""
    mesh = xp.Mesh(CORNER, CORNER_FACES)
    assert mesh.volume == pytest.approx(1 / 6, rel=1e-15)
    assert centre_of(mesh) == pytest.approx((0.25, 0.25, 0.25), rel=1e-14)
    expected = np.full((3, 3), 1 / 80) + np.eye(3) * (3 / 40 - 1 / 80)
    assert np.allclose(tensor_of(mesh, 1.0), expected, atol=1e-15)


@pytest.mark.parametrize("shape", [xp.Box((1, 2, 3)), xp.Sphere(0.7), xp.Capsule(0.5, 2.0)], ids=lambda s: s.kind)
def test_triangles_of_round_shapes_tend_to_their_volume_and_moments(shape: Shape) -> None:
    errors = []
    for around in (16, 32):
        mesh = xp.Mesh(*triangles(shape, around))
        errors.append([1 - mesh.volume / shape.volume, *(1 - np.array(mesh.inertia(1.0)) / shape.inertia(1.0))])
    if shape.kind == "box":
        assert np.allclose(errors, 0, atol=1e-14)
    else:
        assert np.allclose(np.array(errors[0]) / errors[1], 4, rtol=0.05)  # second order in the edges


def test_a_solid_cut_into_tetrahedra_has_the_moments_of_the_whole() -> None:
    points = np.random.default_rng(3).normal(size=(40, 3))
    hull = xp.Hull(points)
    v, apex = hull.authored_vertices, hull.authored_vertices.mean(axis=0)
    pieces = [xp.Hull([apex, *v[face]]) for face in hull.faces]
    whole = xp.Compound([xp.Part(piece, pose=np.eye(4)) for piece in pieces])
    assert whole.volume == pytest.approx(hull.volume, rel=1e-13)
    assert np.allclose(centre_of(whole), centre_of(hull), atol=1e-14)
    assert np.allclose(tensor_of(whole, 1.0), tensor_of(hull, 1.0), atol=1e-14)


@given(st.tuples(*[st.floats(-3, 3)] * 3), vector)
@settings(max_examples=30)
def test_mass_properties_turn_and_move_with_the_vertices(
    v: tuple[float, float, float], at: tuple[float, float, float]
) -> None:
    hull = xp.Hull(np.random.default_rng(5).normal(size=(20, 3)))
    rotation = turn.to_matrix(turn.from_rotation_vector(v))
    moved = xp.Mesh(hull.authored_vertices @ rotation.T + at, hull.faces)
    assert moved.volume == pytest.approx(hull.volume, rel=1e-13)
    assert np.allclose(centre_of(moved), rotation @ centre_of(hull) + at, atol=1e-13)
    assert sorted(moved.inertia(1.0)) == pytest.approx(sorted(hull.inertia(1.0)), rel=1e-12)
    assert np.allclose(tensor_of(moved, 1.0), rotation @ tensor_of(hull, 1.0) @ rotation.T, atol=1e-12)
    assert moved.reach == pytest.approx(hull.reach, rel=1e-12)


def test_a_mesh_far_from_its_origin_keeps_its_digits() -> None:
    near, far = xp.Mesh(CORNER, CORNER_FACES), xp.Mesh(CORNER + 2.0**20, CORNER_FACES)
    assert far.volume == pytest.approx(near.volume, rel=1e-13)
    assert far.inertia(1.0) == pytest.approx(near.inertia(1.0), rel=1e-9)


def test_vertices_and_frame_are_those_of_the_body_and_cannot_be_changed() -> None:
    hull = xp.Hull(np.random.default_rng(1).normal(size=(30, 3)) * (1, 2, 3) + 5)
    pose = turn.to_pose(*hull.frame)
    assert np.allclose(hull.authored_vertices @ pose[:3, :3].T + pose[:3, 3], hull.vertices, atol=1e-13)
    again = xp.Mesh(hull.vertices, hull.faces)
    assert np.allclose(centre_of(again), 0, atol=1e-14) and again.frame[1] == (1, 0, 0, 0)
    with pytest.raises(ValueError, match="read-only"):
        hull.vertices[0, 0] = 9.0


def test_faces_of_a_hull_look_outwards() -> None:
    hull = xp.Hull(np.random.default_rng(2).normal(size=(100, 3)))
    a, b, c = (hull.vertices[hull.faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    assert ((normal * a).sum(axis=1) > 0).all()
    assert ((hull.vertices[None] - a[:, None]) * normal[:, None]).sum(axis=2).max() < 1e-12


@pytest.mark.parametrize(
    "points", [CUBE, np.array(list(itertools.product(np.linspace(0, 1, 4), repeat=3)))], ids=["cube", "grid"]
)
def test_points_in_common_planes_make_a_closed_hull(points: np.ndarray) -> None:
    assert xp.Hull(points).volume == pytest.approx(1.0, rel=1e-14)


def test_an_open_mesh_has_no_volume_and_says_the_ways_out() -> None:
    mesh = xp.Mesh(CORNER, CORNER_FACES[:3])
    assert not mesh.solid and mesh.volume == 0 and mesh.frame == ((0, 0, 0), (1, 0, 0, 0))
    for given_ in ({}, {"mass": 1.0}, {"density": 1.0}, {"inertia": 1.0}):
        with pytest.raises(InvalidValueError, match=r"not closed.*mass= and inertia=.*solid='hull'.*fixed=True"):
            xp.PhysicalObject(mesh, **given_)
    assert xp.PhysicalObject(mesh, mass=1.0, inertia=(1, 1, 1)).inertia == (1, 1, 1)
    assert xp.PhysicalObject(mesh, fixed=True).inertia == (0, 0, 0)
    filled = xp.Mesh(CORNER, CORNER_FACES[:3], solid="hull")
    assert filled.solid and filled.volume == pytest.approx(1 / 6)
    assert xp.Mesh(CORNER, CORNER_FACES, solid="none").solid is False


@pytest.mark.parametrize(
    ("bad", "said"),
    [
        (lambda: xp.Mesh([[0, 0, math.nan]] * 3, [[0, 1, 2]]), "vertex 0 is"),
        (lambda: xp.Mesh(CORNER, [[0, 1, 4]]), "triangle 0 is .0, 1, 4., yet there are 4"),
        (lambda: xp.Mesh(CORNER, [[0, 1, 1]]), "no area"),
        (lambda: xp.Mesh(CORNER, [[0.5, 1, 2]]), "whole numbers"),
        (lambda: xp.Mesh(CORNER, []), "m at least 1"),
        (lambda: xp.Mesh(CORNER, CORNER_FACES[:, ::-1]), "wind inwards.*repaired"),
        (lambda: xp.Mesh(CORNER, CORNER_FACES, solid="yes"), "'hull' or 'none'"),
        (lambda: xp.Mesh(CORNER * 1e60, CORNER_FACES), "overflow"),
        (lambda: xp.Hull(CORNER[:3]), "n at least 4"),
        (lambda: xp.Hull([[1, 2, 3]] * 9), "one plane"),
        (lambda: xp.Hull(CUBE * (1, 1, 0)), "one plane"),
        (lambda: xp.Hull(CORNER, CORNER_FACES[:3]), "gap"),
        (lambda: xp.Hull(CORNER, CORNER_FACES[:, ::-1]), "not convex or not outward"),
        (lambda: xp.Compound([]), "no parts"),
        (lambda: xp.Compound([xp.Plane()]), "a plane has no end"),
        (lambda: xp.Compound(3), "a list of parts"),
        (lambda: xp.Compound([7]), "part 0 is 7"),
        (lambda: xp.Compound([(xp.Sphere(1), (0, 0, math.inf))]), "finite"),
        (lambda: xp.Compound([xp.Part(xp.Sphere(1), density=1), xp.Sphere(1)]), "all parts or none"),
        (lambda: xp.Part(xp.Sphere(1), density=-1), "density above 0 kg/m"),
        (lambda: xp.Part(xp.Sphere(1), (1, 0, 0), pose=np.eye(4)), "give one"),
        (lambda: from_description({"kind": "cone"}), "no shape of core"),
        (lambda: from_description({"kind": "mesh", "vertices": "base64:??", "faces": []}), "places"),
    ],
)
def test_bad_shapes_are_refused_with_the_thing_and_the_value(bad: object, said: str) -> None:
    with pytest.raises(InvalidValueError, match=said):
        bad()  # type: ignore[operator]


# Compounds


@given(st.lists(edge, min_size=1, max_size=5), edge, edge)
def test_boxes_in_a_row_have_the_mass_properties_of_one_long_box(lengths: list[float], y: float, z: float) -> None:
    ends = np.concatenate([[0], np.cumsum(lengths)])
    row = xp.Compound([(xp.Box((b - a, y, z)), ((a + b) / 2, 0, 0)) for a, b in itertools.pairwise(ends)])
    whole = xp.Box((ends[-1], y, z))
    assert row.volume == pytest.approx(whole.volume, rel=1e-12)
    assert row.inertia(3.0) == pytest.approx(whole.inertia(3.0), rel=1e-12)
    assert row.reach == pytest.approx(whole.reach, rel=1e-12)
    assert row.frame[1] == (1, 0, 0, 0) and row.frame[0] == pytest.approx((-ends[-1] / 2, 0, 0), rel=1e-12)


@given(st.tuples(*[st.floats(-3, 3)] * 3), vector)
def test_a_compound_turned_as_a_whole_is_the_same_body(v: object, at: object) -> None:
    parts = [
        xp.Part(xp.Box((1, 2, 3)), (1, 0, 0)),
        xp.Part(xp.Capsule(0.3, 2), (0, 2, 0), turn.from_euler((1, 0.4, 0))),
    ]
    pose = (at, turn.from_rotation_vector(v))  # type: ignore[arg-type]
    moved = [xp.Part(p.shape, *turn.compose(pose, (p.position, p.orientation))) for p in parts]  # type: ignore[arg-type]
    one, two = xp.Compound(parts), xp.Compound(moved)
    assert sorted(one.inertia(1.0)) == pytest.approx(sorted(two.inertia(1.0)), rel=1e-12)
    rotation = turn.to_matrix(pose[1])
    assert np.allclose(tensor_of(two, 1.0), rotation @ tensor_of(one, 1.0) @ rotation.T, atol=1e-11)
    assert one.reach == pytest.approx(two.reach, rel=1e-12)


def test_densities_of_parts_make_mass_centre_and_moments() -> None:
    heavy, light = (
        xp.Part(xp.Box((1, 1, 1)), (-1, 0, 0), density=3.0),
        xp.Part(xp.Box((1, 1, 1)), (1, 0, 0), density=1.0),
    )
    body = xp.Compound([heavy, light])
    obj = xp.PhysicalObject(body)
    assert obj.mass == body.mass == 4.0
    assert centre_of(body) == pytest.approx((-0.5, 0, 0))
    across = 4 / 6 + 3 * 0.25 + 1 * 2.25
    assert obj.inertia == pytest.approx((4 / 6, across, across), rel=1e-15)
    assert xp.PhysicalObject(body, mass=8.0).inertia == pytest.approx((8 / 6, 2 * across, 2 * across))
    with pytest.raises(InvalidValueError, match="parts have densities"):
        xp.PhysicalObject(body, density=2.0)
    assert xp.PhysicalObject(xp.Compound([xp.Sphere(1)]), density=3.0).mass == pytest.approx(4 * math.pi)


def test_nested_compounds_are_taken_apart_and_stay_in_place() -> None:
    wheel = xp.Compound([(xp.Sphere(0.2), (1, 0, 0)), (xp.Sphere(0.1), (-1, 0, 0))])
    at = ((0.0, 3.0, 0.0), turn.from_axis_angle((0, 0, 1), math.pi / 2))
    nested = xp.Compound([xp.Part(wheel, pose=turn.to_pose(*at)), (xp.Box((1, 1, 1)), (0, 0, 5))])
    flat = xp.Compound([(xp.Sphere(0.2), (0, 4, 0)), (xp.Sphere(0.1), (0, 2, 0)), (xp.Box((1, 1, 1)), (0, 0, 5))])
    assert [part.shape.kind for part in nested.parts] == ["sphere", "sphere", "box"]
    assert nested.inertia(1.0) == pytest.approx(flat.inertia(1.0), rel=1e-14)
    for one, two in zip(nested.authored_parts, flat.authored_parts, strict=True):
        assert one.position == pytest.approx(two.position, abs=1e-15)


def test_parts_lie_in_the_frame_of_centre_and_principal_axes() -> None:
    body = xp.Compound([(xp.Box((1, 2, 3)), (1, 2, 3), turn.from_euler((0.3, 0.2, 0.1))), (xp.Sphere(1), (0, 1, -4))])
    again = xp.Compound(body.parts)
    assert np.allclose(again.frame[0], 0, atol=1e-14) and again.frame[1] == (1, 0, 0, 0)
    for authored, part in zip(body.authored_parts, body.parts, strict=True):
        pose = turn.to_pose(*body.frame) @ turn.to_pose(authored.position, authored.orientation)
        assert np.allclose(pose, turn.to_pose(part.position, part.orientation), atol=1e-14)


def test_hollow_parts_make_a_hollow_compound() -> None:
    skin = xp.Mesh(CORNER, CORNER_FACES[:3])
    body = xp.Compound([skin, (xp.Sphere(1), (1, 0, 0))])
    assert not body.solid and body.frame == ((0, 0, 0), (1, 0, 0, 0))
    with pytest.raises(InvalidValueError, match="not closed"):
        xp.PhysicalObject(body, mass=1.0)
    assert xp.PhysicalObject(body, fixed=True).mass == 1.0


def shapes() -> list[Shape]:
    points = np.random.default_rng(7).normal(size=(400, 3))
    hull = xp.Hull(points[:30])
    large = xp.Mesh(*triangles(xp.Sphere(1.0), 64))
    return [
        xp.Sphere(1), xp.Box((1, 2, 3)), xp.Capsule(1, 2), hull, xp.Hull(points), large, xp.Mesh(CORNER, CORNER_FACES[:3]),
        xp.Mesh(CORNER, CORNER_FACES[:3], "hull"),
        xp.Compound([xp.Part(hull, (1, 2, 3), (1, 2, 3, 4), 5.0), xp.Part(large, density=2.0)]),
    ]  # fmt: skip


@pytest.mark.parametrize("shape", shapes(), ids=lambda s: s.kind)
def test_shapes_come_back_to_the_bit_from_their_descriptions_and_pickles(shape: Shape) -> None:
    for again in (from_description(json.loads(json.dumps(shape.describe()))), pickle.loads(pickle.dumps(shape))):
        assert again == shape and hash(again) == hash(shape) and repr(again) == repr(shape)
        assert again.frame == shape.frame and again.reach == shape.reach and again.volume == shape.volume
        if shape.solid:
            assert again.inertia(1.7) == shape.inertia(1.7)
    assert len(repr(shape)) < 300


@pytest.mark.parametrize("shape", shapes(), ids=lambda s: s.kind)
def test_scaling_takes_volume_with_the_cube_and_moments_with_the_square(shape: Shape) -> None:
    twice = shape.scaled(2.0)
    assert twice.volume == pytest.approx(8 * shape.volume) and twice.reach == pytest.approx(2 * shape.reach)
    if shape.solid:
        assert twice.inertia(1.0) == pytest.approx(4 * np.array(shape.inertia(1.0)))
    assert np.allclose(twice.frame[0], 2 * np.array(shape.frame[0]))
    with pytest.raises(InvalidValueError):
        shape.scaled(0.0)


def test_three_factors_are_for_boxes_hulls_and_meshes() -> None:
    assert xp.Box((1, 1, 1)).scaled((1, 2, 3)) == xp.Box((1, 2, 3))
    assert xp.Hull(CUBE).scaled((1, 2, 3)).inertia(1.0) == pytest.approx(xp.Box((1, 2, 3)).inertia(1.0))
    for shape in (xp.Sphere(1), xp.Capsule(1, 1), xp.Compound([xp.Sphere(1)])):
        with pytest.raises(InvalidValueError, match="one factor"):
            shape.scaled((1, 2, 3))


@pytest.mark.parametrize("shape", shapes(), ids=lambda s: s.kind)
def test_the_reach_from_a_point_holds_the_shape(shape: Shape) -> None:
    places, _ = triangles(shape)
    for point in np.random.default_rng(0).normal(size=(5, 3)) * 3:
        farthest = np.linalg.norm(places - point, axis=1).max()
        assert farthest <= shape.reach_from(tuple(point)) * (1 + 1e-12) <= farthest * 1.05 + 0.01
    assert np.linalg.norm(places, axis=1).max() == pytest.approx(shape.reach, rel=0.02)


# Principal axes


@given(st.lists(st.floats(-1, 1), min_size=6, max_size=6))
def test_principal_axes_are_a_rotation_that_makes_the_tensor_diagonal(e: list[float]) -> None:
    tensor = ((e[0], e[3], e[4]), (e[3], e[1], e[5]), (e[4], e[5], e[2]))
    values, q = principal_axes(tensor)
    rotation = turn.to_matrix(q)
    size = max(map(abs, e)) or 1.0
    assert np.allclose(rotation.T @ np.array(tensor) @ rotation, np.diag(values), atol=4e-11 * size)
    assert np.allclose(sorted(values), np.linalg.eigvalsh(np.array(tensor)), atol=4e-11 * size)


@given(st.tuples(*[st.floats(-0.4, 0.4)] * 3), st.sampled_from([(1, 2, 4), (4, 1, 2), (2, 4, 1)]))
def test_axes_are_the_nearest_to_the_authored_ones(
    v: tuple[float, float, float], moments: tuple[float, float, float]
) -> None:
    q = turn.from_rotation_vector(v)
    rotation = turn.to_matrix(q)
    found, turned = principal_axes(rows_of(rotation @ np.diag(moments) @ rotation.T))
    assert found == pytest.approx(moments, rel=1e-11)
    assert abs(np.dot(turned, q)) == pytest.approx(1.0, abs=1e-11)


@given(st.tuples(*[st.floats(-3, 3)] * 3))
def test_equal_moments_turn_the_axes_no_more_than_needed(v: tuple[float, float, float]) -> None:
    rotation = turn.to_matrix(turn.from_rotation_vector(v))
    same, _ = principal_axes(rows_of(rotation @ (2 * np.eye(3)) @ rotation.T))
    assert same == pytest.approx((2, 2, 2))
    values, q = principal_axes(rows_of(rotation @ np.diag((2, 2, 1)) @ rotation.T))
    single = int(np.argmin(values))
    _, angle = turn.to_axis_angle(q)
    assert math.cos(angle) == pytest.approx(np.abs(rotation[:, 2]).max(), abs=1e-9)
    assert abs(turn.to_matrix(q)[:, single] @ rotation[:, 2]) == pytest.approx(1.0, abs=1e-9)


def test_a_tensor_that_is_diagonal_to_rounding_is_not_turned() -> None:
    values, q = principal_axes(((3, 1e-15, 0), (1e-15, 3, 0), (0, 0, 1)))
    assert values == (3, 3, 1) and q == (1, 0, 0, 0)


# Engines


def test_a_torque_free_compound_keeps_its_energy_and_angular_momentum_and_comes_back_from_a_checkpoint() -> None:
    body = xp.Compound([xp.Part(xp.Box((1, 2, 3)), (1, 0, 0), density=2), xp.Part(xp.Sphere(1), (0, 2, 1), density=1)])
    engine = xp.PhysicsEngine()
    engine.add_object(xp.PhysicalObject(body, angular_velocity=(1, 2, 3), name="body"))
    before = engine.angular_momentum(), engine.energy()
    engine.run(until=1.0)
    restored = xp.PhysicsEngine.restore(engine.checkpoint())
    for one in (engine, restored):
        one.run(until=5.0)
        assert one.angular_momentum() == pytest.approx(before[0], rel=1e-12)
        assert one.energy()[0] == pytest.approx(before[1][0], rel=1e-12)
    assert engine.object("body").orientation == restored.object("body").orientation
    assert restored.object("body").shape == body
