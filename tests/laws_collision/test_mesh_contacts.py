"""Balls and triangle meshes: the walls of a room, hills, thin walls, open borders."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.laws_collision.convex_bodies import NONE, body, floor, gap_of, impact, leave, points_of, quaternions, vectors
from tests.laws_collision.meshes import HALF, ball_mesh, distance, grid, room, terrain, walls

import xpheve as xp
from xpheve.errors import ContactError
from xpheve.kernels.quaternion import from_axis_angle, rotate
from xpheve_laws_collision.narrow_phase import Mover
from xpheve_laws_collision.narrow_phase.mesh_features import features_of

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
MESHES = {"ball": ball_mesh(), "hills": terrain(12), "room": room()}


def still(mesh: xp.Mesh, position: Any = NONE, orientation: Any = UPRIGHT) -> Mover:
    return Mover(tuple(map(float, position)), NONE, NONE, orientation, mesh)  # type: ignore[arg-type]


def ball(radius: float, position: Any, velocity: Any = NONE, acceleration: Any = NONE) -> Mover:
    return body(xp.Sphere(radius), position, velocity, acceleration)


@settings(max_examples=80, deadline=None)
@given(vectors, vectors, st.booleans(), st.floats(0.01, 0.4), st.sampled_from((1e-3, 1.0, 1e3)))
def test_a_room_of_triangles_is_a_room_of_planes(
    where: Any, velocity: Any, falls: bool, radius: float, scale: float
) -> None:
    ground = still(room(scale))
    place = [scale * 0.55 * c * half for c, half in zip(where, HALF, strict=True)]
    pull = (0.0, 0.0, -10.0 * scale) if falls else NONE
    a = ball(radius * scale, place, [5 * scale * c for c in velocity], pull)
    planes = [body(plane, at) for plane, at in walls(scale)]
    expected = min(impact(a, plane) for plane in planes)
    t = impact(a, ground)
    assert t == expected or math.isclose(t, expected, rel_tol=1e-13)
    if t < math.inf:
        normals = {gap_of(a.at(t), plane).normal for plane in planes if impact(a, plane) == expected}
        gap = gap_of(a.at(t), ground)
        assert gap.normal in normals and gap.speed < 0.0


@settings(max_examples=80, deadline=None)
@given(
    st.sampled_from(sorted(MESHES)),
    vectors,
    vectors,
    vectors,
    quaternions,
    st.sampled_from((0.0, 0.01, 0.2, 1.5)),
    st.floats(0.5, 20.0),
)
def test_nothing_touches_before_the_impact_and_it_touches_then(
    name: str, aim: Any, velocity: Any, pull: Any, turn: Any, radius: float, speed: float
) -> None:
    mesh = MESHES[name]
    ground = still(mesh, (0.3, -0.2, 0.1), turn)
    start = [6 * c for c in aim]
    shape = xp.Sphere(radius) if radius else type("Point", (), {"kind": "sphere", "radius": 0.0})
    a = Mover(tuple(start), tuple(speed * c for c in velocity), tuple(5 * c for c in pull), UPRIGHT, shape)  # type: ignore[arg-type]
    back = (turn[0], -turn[1], -turn[2], -turn[3])

    def away(s: float) -> float:
        moved = [c - d for c, d in zip(a.at(s).position, ground.position, strict=True)]
        return distance(mesh, rotate(back, moved)) - radius

    if away(0.0) < 1e-6:
        return
    assert abs(gap_of(a, ground).separation - away(0.0)) < 2e-9
    t = impact(a, ground)
    for k in range(1, 60):
        assert away(min(t, 4.0) * (k / 60) ** 0.5) > -1e-12
    if t < math.inf:
        gap = gap_of(a.at(t), ground)
        way = (
            speed * math.hypot(*velocity) * t + 2.5 * math.hypot(*pull) * t * t
        )  # a place is rounded as its way is long
        near = 1e-12 + 1e-15 * way
        assert abs(gap.separation) < near and gap.speed < 0.0
        assert abs(away(t)) < (near if radius else near + 2e-9)


def test_a_flat_floor_of_triangles_bounces_as_a_plane_wherever_a_ball_lands() -> None:
    ground = still(grid(np.zeros((9, 9)), 4.0))
    generator = np.random.default_rng(5)
    places = [(0.0, 0.0), (1.0, 0.5), (0.5, 0.5), (2.0, -1.0), *generator.uniform(-3, 3, (40, 2)).tolist()]
    for x, y in places:
        a = ball(0.3, (x, y, 2.0), (0.3, -0.1, 1.0), (0, 0, -10.0))
        for _ in range(3):
            t = impact(a, ground)
            assert t == impact(a, floor())
            a = a.at(t)
            gap = gap_of(a, ground)
            assert gap.normal == (0.0, 0.0, -1.0) and gap.separation == gap_of(a, floor()).separation
            assert len(points_of(a, ground)) == 1
            a = a._replace(velocity=(a.velocity[0], a.velocity[1], -0.7 * a.velocity[2]))


def test_a_ball_that_slides_over_inner_edges_feels_nothing_of_them() -> None:
    tilted = from_axis_angle((0.6, 0.8, 0.0), 0.3)
    for turn in (UPRIGHT, tilted):
        ground = still(grid(np.zeros((9, 9)), 4.0), NONE, turn)
        for angle in np.linspace(0.0, 6.0, 13):
            at = rotate(turn, (0.1, -0.2, 0.3))
            along = rotate(turn, (math.cos(angle), math.sin(angle), 0.0))
            assert impact(ball(0.3, at, along), ground) == math.inf
            down = tuple(-10.0 * c for c in rotate(turn, (0.0, 0.0, 1.0)))
            assert impact(ball(0.3, at, along, down), ground) == math.inf  # it rests on it


def test_it_slides_into_a_wall() -> None:
    a = ball(0.3, (0.1, 0.2, -0.7), (1.0, 0.0, 0.0))  # what bears it takes the weight away
    t = impact(a, still(room()))
    assert math.isclose(t, 1.6, rel_tol=1e-15)
    gaps = points_of(a.at(t), still(room()))
    assert sorted(gap.normal for gap in gaps) == [(0.0, 0.0, -1.0), (1.0, 0.0, 0.0)]
    assert {abs(gap.speed) for gap in gaps} >= {1.0}


def test_in_a_corner_three_faces_are_three_points_and_a_wall_is_one() -> None:
    ground = still(room())
    corner = points_of(ball(0.3, (1.7, 2.7, 0.7)), ground)
    assert sorted(gap.normal for gap in corner) == [(0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)]
    assert max(abs(gap.separation) for gap in corner) < 1e-15
    assert corner == points_of(ball(0.3, (1.7, 2.7, 0.7)), ground)
    assert len(points_of(ball(0.3, (0.0, 0.0, 0.7)), ground)) == 1  # on the diagonal of the ceiling
    apart = points_of(ball(0.3, (0.0, 0.0, 0.5)), ground)
    assert len(apart) == 1 and math.isclose(apart[0].separation, 0.2, rel_tol=1e-15)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_bullet_never_passes_a_thin_wall(scale: float) -> None:
    wall = still(grid(np.zeros((5, 5)), scale))
    generator = np.random.default_rng(7)
    places = [(0.0, 0.0), (0.5, 0.5), (0.25, 0.25), (0.5, 0.0), *generator.uniform(-0.9, 0.9, (30, 2)).tolist()]
    for x, y in places:
        for shape in (xp.Sphere(1e-4 * scale), type("Point", (), {"kind": "sphere", "radius": 0.0})):
            shot = Mover(
                (x * scale, y * scale, 100.0 * scale),
                (0.0, 0.0, -1e4 * scale),
                (0.0, 0.0, -9.0 * scale),
                UPRIGHT,
                shape,
            )
            t = impact(shot, wall)
            assert math.isclose(t, 0.01, rel_tol=1e-5)
            after = shot.at(t)
            gap = gap_of(after, wall)
            assert gap.normal == (0.0, 0.0, -1.0) and gap.speed < 0.0
            back = after._replace(velocity=(0.0, 0.0, 1e4 * scale), acceleration=NONE)
            assert gap_of(back, wall).speed > 0.0 and impact(back, wall) == math.inf


def test_both_sides_of_a_skin_are_hit_and_its_border_is_round() -> None:
    skin = still(grid(np.zeros((3, 3)), 1.0))
    for sign in (1.0, -1.0):
        a = ball(0.1, (0.2, 0.3, sign), (0, 0, -sign))
        assert math.isclose(impact(a, skin), 0.9, rel_tol=1e-15)
        assert gap_of(a, skin).normal == (0.0, 0.0, -sign)
    beside = ball(0.5, (1.3, 0.1, 2.0), (0, 0, -1.0))
    t = impact(beside, skin)
    assert math.isclose(t, 2.0 - 0.4, rel_tol=1e-15)
    assert np.allclose(gap_of(beside.at(t), skin).normal, (-0.6, 0.0, -0.8), atol=1e-15)
    corner = ball(0.5, (1.3, 1.3, 2.0), (0, 0, -1.0))
    assert math.isclose(impact(corner, skin), 2.0 - math.sqrt(0.25 - 0.18), rel_tol=1e-14)
    assert impact(ball(0.5, (1.6, 0, 2.0), (0, 0, -1.0)), skin) == math.inf
    # Thrown past the border from above, it comes back from below.
    past = ball(0.1, (2.0, 0.0, 0.05), (-1.0, 0.0, -5.0), (0, 0, 10.0 / 3))
    t = impact(past, skin)
    assert 0.5 < t < 3 and gap_of(past.at(t), skin).normal[2] > 0.9


def test_a_ball_that_cuts_the_surface_is_pushed_to_the_side_of_its_centre() -> None:
    ground = still(room())
    for x, normal in ((1.9, 1.0), (2.1, -1.0)):
        gap = gap_of(ball(0.5, (x, 0.2, 0.1)), ground)
        assert math.isclose(gap.separation, -0.4, rel_tol=1e-14) and gap.normal == (normal, 0.0, 0.0)
        assert impact(ball(0.5, (x, 0.2, 0.1), (normal, 0, 0)), ground) == 0.0
        assert math.isclose(leave(ball(0.5, (x, 0.2, 0.1), (-normal, 0, 0)), ground), 0.4, rel_tol=1e-12)
    assert gap_of(ball(0.5, (2.0, 0.2, 0.1)), ground).normal == (
        -1.0,
        0.0,
        0.0,
    )  # in front of it: the triangles face outwards


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(sorted(MESHES)), vectors, vectors, vectors, st.sampled_from((0.1, 0.4)))
def test_a_ball_leaves_when_samples_say(name: str, aim: Any, velocity: Any, pull: Any, radius: float) -> None:
    mesh = MESHES[name]
    start = [2 * c for c in aim]
    a = ball(radius, start, [3 * c for c in velocity], pull)
    ground = still(mesh)
    if not distance(mesh, start) < radius - 1e-9:
        return
    t = leave(a, ground, 5.0)
    for k in range(1, 80):
        assert distance(mesh, a.at(min(t, 5.0) * k / 80).position) < radius + 1e-11
    if t < math.inf:
        assert abs(distance(mesh, a.at(t).position) - radius) < 1e-11
        assert gap_of(a.at(t), ground).speed > -1e-9


def test_neighbours_in_one_plane_share_it_and_keep_their_border() -> None:
    features = features_of(grid(np.zeros((9, 9)), 4.0))
    assert len(set(features.plane.tolist())) == 1
    assert int(features.sharp.sum()) == 32 and int(features.pointed.sum()) == 32
    cube = features_of(room())
    assert int(cube.sharp.sum()) == 12 and int(cube.pointed.sum()) == 8 and len(set(cube.plane.tolist())) == 6


def test_the_tree_looks_at_few_of_many_triangles() -> None:
    features = features_of(terrain(101))
    seen = 0

    def test(lows: Any, highs: Any) -> Any:
        nonlocal seen
        seen += len(lows)
        return ((lows <= 0.3) & (highs >= 0.1)).all(axis=1)

    found = features.within(test)
    brute = np.flatnonzero(((features.lows <= 0.3) & (features.highs >= 0.1)).all(axis=1))
    assert sorted(found.tolist()) == brute.tolist() and seen < 2000
    assert sorted(features.order.tolist()) == list(range(20_000))


def test_a_mesh_that_turns_is_refused_by_name() -> None:
    ground = still(room())._replace(angular_velocity=(0.0, 0.0, 1.0))
    with pytest.raises(ContactError, match="turns"):
        gap_of(ball(0.1, NONE), ground)


def test_a_mesh_that_flies_is_met_as_from_its_own_place() -> None:
    flying = Mover((0.0, 0.0, 0.0), (1.0, 2.0, 3.0), (0.0, 0.0, -10.0), UPRIGHT, room())
    a = ball(0.2, (0.1, 0.2, 0.3), (2.0, 2.0, 3.0), (0.0, 0.0, -10.0))
    assert math.isclose(impact(a, flying), 1.7, rel_tol=1e-14)


def test_a_compound_with_a_mesh_among_its_parts_is_met_part_by_part() -> None:
    house = xp.Compound([xp.Part(room()), xp.Part(xp.Box((1.0, 1.0, 0.5)), (5.0, 0.0, 0.0))])
    x, y, z = house.parts[0].position
    stands = Mover((-x, -y, -z), NONE, NONE, UPRIGHT, house)
    assert math.isclose(impact(ball(0.3, NONE, (1.0, 0.0, 0.0)), stands), 1.7, rel_tol=1e-14)
    assert math.isclose(impact(ball(0.3, (5.0, 0.0, 2.0), (0.0, 0.0, -1.0)), stands), 1.45, rel_tol=1e-14)
    assert math.isclose(leave(ball(0.3, (1.9, 0.0, 0.0), (1.0, 0.0, 0.0)), stands), 0.4, rel_tol=1e-12)
    assert len(points_of(ball(0.3, (1.7, 2.7, 0.7)), stands)) == 3
    with pytest.raises(ContactError, match="turns"):
        gap_of(ball(0.3, NONE), stands._replace(angular_velocity=(0.0, 0.0, 1.0)))
    with pytest.raises(ContactError, match="mesh"):
        gap_of(body(xp.Box((1, 1, 1)), NONE), stands)


def test_balls_in_a_room_of_triangles_keep_their_energy_and_stay_in_it() -> None:
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", acceleration=10.0)
    bounce = engine.add_law("collision:elastic", restitution=1.0)
    engine.add_object(xp.PhysicalObject(room(), fixed=True), laws=[bounce])
    balls = [
        xp.PhysicalObject(xp.Sphere(0.1), position=(0.5 * k, 0.3 * k, 0.1 * k), velocity=(1.0 + k, -2.0, 0.5))
        for k in range(-2, 3)
    ]
    engine.add_objects(balls, laws=[gravity, bounce])
    before = engine.energy()
    engine.run(until=5.0)
    after = engine.energy()
    assert abs(after.kinetic + after.potential - before.kinetic - before.potential) < 1e-12
    for one in balls:
        assert all(abs(c) <= half - 0.1 + 1e-12 for c, half in zip(one.position, HALF, strict=True))


@pytest.mark.parametrize("far", [0.0, 1e3, 1e6])
@pytest.mark.parametrize("name", ["ball", "room"])
def test_a_ball_that_bounces_inside_a_turned_mesh_never_gets_out(name: str, far: float) -> None:
    turn = from_axis_angle((0.6, 0.0, 0.8), 0.7)
    ground = still(MESHES[name], (far, -far, far), turn)
    for radius, restitution in ((0.2, 1.0), (0.0, 1.0), (0.01, 0.5)):
        shape = xp.Sphere(radius) if radius else type("Point", (), {"kind": "sphere", "radius": 0.0})
        a = Mover((far + 0.1, 0.2 - far, far), (3.0, -2.0, 1.0), (0.0, 0.0, -1.0), UPRIGHT, shape)
        for _ in range(15):
            t = impact(a, ground)
            assert 0.0 < t < math.inf
            a = a.at(t)
            for _ in range(30):
                gaps = [gap for gap in points_of(a, ground) if gap.speed < -gap.still]
                assert all(abs(gap.separation) <= gap.touch for gap in gaps)
                if not gaps:
                    break
                push = (1.0 + restitution) * gaps[0].speed
                a = a._replace(velocity=tuple(v + push * n for v, n in zip(a.velocity, gaps[0].normal, strict=True)))
            inside = rotate(
                (turn[0], -turn[1], -turn[2], -turn[3]), (a.position[0] - far, a.position[1] + far, a.position[2] - far)
            )
            limits = HALF if name == "room" else (1.0, 1.0, 1.0)
            assert all(abs(c) <= limit - radius + 1e-9 for c, limit in zip(inside, limits, strict=True))


def test_a_ball_that_slides_on_the_floor_of_a_mesh_meets_its_wall() -> None:
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic", restitution=1.0)
    engine.add_object(xp.PhysicalObject(room(), fixed=True), laws=[bounce])
    one = xp.PhysicalObject(xp.Sphere(0.1), position=(0, 0, -0.9), velocity=(1, 0, 0))
    engine.add_object(one, laws=[bounce])
    engine.run(until=2.5)
    assert one.velocity == (-1.0, 0.0, 0.0)


@pytest.mark.parametrize("name", ["collision:elastic", "collision:point"])
@pytest.mark.parametrize("angle", [0.5, 1.0, 2.0])
def test_a_ball_thrown_into_an_edge_leaves_as_from_planes(name: str, angle: float) -> None:
    half = 0.5 * angle
    c, s = math.cos(half), math.sin(half)
    corners = [(0, y, 0) for y in (-9, 9)] + [(9 * c, y, sign * 9 * s) for sign in (1, -1) for y in (-9, 9)]
    gutter = xp.Mesh(corners, [(0, 1, 3), (0, 3, 2), (0, 4, 5), (0, 5, 1)])
    found = []
    for grounds in ([gutter], [xp.Plane((s, 0, -c)), xp.Plane((s, 0, c))]):
        engine = xp.PhysicsEngine()
        bounce = engine.add_law(name, restitution=0.5) if name.endswith("elastic") else engine.add_law(name)
        for ground in grounds:
            place = ground.frame[0] if ground is gutter else (0.0, 0.0, 0.0)
            engine.add_object(xp.PhysicalObject(ground, fixed=True, position=place), laws=[bounce])
        ball_ = xp.PhysicalObject(xp.Sphere(0.1), position=(3, 0, 0), velocity=(-2, 0.3, 0))
        engine.add_object(ball_, laws=[bounce])
        engine.run(until=2.0)
        found.append(ball_.velocity)
    assert found[0][0] > 0.9 and math.dist(*found) < 1e-13
