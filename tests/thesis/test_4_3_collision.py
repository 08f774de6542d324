"""Thesis 4.3 and appendix A: collisions with what is fixed and between two bodies."""

from __future__ import annotations

import math

import pytest

import xpheve as xp
from xpheve.errors import InvalidValueError, NotAcceptedError
from xpheve_laws_collision import BoundingBoxes, Picking


def bounced(velocity: tuple[float, float, float], factor: float, height: float = 1.0) -> tuple[float, ...]:
    """Return the velocity after meeting a floor with normal (0, 1, 0), without gravity."""
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic", restitution=factor)
    engine.add_object(xp.PhysicalObject(xp.Plane((0, 1, 0)), fixed=True), laws=[law])
    ball = engine.add_object(
        xp.PhysicalObject(xp.Sphere(0.5), position=(0, 0.5 + height, 0), velocity=velocity), laws=[law]
    )
    engine.run(until=1.0)
    return ball.velocity


@pytest.mark.thesis("bounce")
@pytest.mark.parametrize(("factor", "after"), [(1.0, (3, 4, 0)), (0.5, (3, 2, 0)), (0.0, (3, 0, 0))])
def test_4_3_2_1_fig_4_13_to_4_16(factor: float, after: tuple[float, ...]) -> None:
    assert bounced((3, -4, 0), factor) == pytest.approx(after, abs=1e-15)


@pytest.mark.thesis("bounce")
def test_4_3_2_1_head_on() -> None:
    assert bounced((0, -4, 0), 1.0) == (0, 4, 0)


@pytest.mark.thesis("receding")
def test_4_3_2_1_a_receding_body_is_left_alone() -> None:
    assert bounced((3, 4, 0), 1.0, height=0.0) == (3, 4, 0)


@pytest.mark.thesis("heights")
@pytest.mark.parametrize("factor", [-0.1, 1.01, math.nan])
def test_4_3_2_1_a_factor_outside_0_to_1_is_refused(factor: float) -> None:
    with pytest.raises(InvalidValueError, match="restitution"):
        xp.PhysicsEngine().add_law("collision:elastic", restitution=factor)


def dropped(factor: float, g: float = 9.8) -> tuple[xp.PhysicsEngine, xp.PhysicalObject]:
    """Return a ball let go 1 m over the floor."""
    engine = xp.PhysicsEngine()
    gravity = engine.add_law("basic:planet_gravity", acceleration=g)
    law = engine.add_law("collision:elastic", restitution=factor)
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[law])
    return engine, engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(0, 1.5, 0)), laws=[gravity, law])


@pytest.mark.thesis("heights")
def test_4_3_2_1_heights_after_bounces() -> None:
    engine, ball = dropped(0.8)
    fall = math.sqrt(2 / 9.8)
    engine.run(until=math.nextafter(fall, 0.0))
    assert ball.velocity[1] == pytest.approx(-4.4272, abs=5e-5)
    time = fall
    for n in range(1, 9):
        rise = 0.8**n * fall
        engine.run(until=time + rise)
        assert ball.position[1] - 0.5 == pytest.approx(0.8 ** (2 * n), rel=1e-12)
        assert ball.velocity[1] == pytest.approx(0.0, abs=1e-12)
        time += 2 * rise


@pytest.mark.thesis("heights")
def test_4_3_2_1_at_rest_after_4_0658_seconds() -> None:
    engine, ball = dropped(0.8)
    rest = math.sqrt(2 / 9.8) * 1.8 / 0.2
    assert rest == pytest.approx(4.0658, abs=5e-5)
    engine.run(until=rest - 1e-6)
    assert ball.velocity != (0, 0, 0)
    engine.run(until=rest + 1e-6)
    assert ball.velocity == (0, 0, 0) and ball.position == pytest.approx((0, 0.5, 0), abs=1e-14)
    engine.run(until=1000.0)
    assert ball.velocity == (0, 0, 0) and ball.position == pytest.approx((0, 0.5, 0), abs=1e-14)


EXCHANGES = [
    (2, 1, 3, 0, 1, 4),
    (1, 3, 4, 0, -2, 2),
    (1, 2, 3, -3, -5, 1),
    (1, 1, 3, -2, -2, 3),
    (5, 5, 7, 0, 0, 7),
]


@pytest.mark.thesis("two-bodies")
@pytest.mark.parametrize(("m1", "m2", "v1", "v2", "w1", "w2"), EXCHANGES)
def test_appendix_a_exchange(m1: float, m2: float, v1: float, v2: float, w1: float, w2: float) -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    one = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), mass=m1, velocity=(v1, 0, 0)), laws=[law])
    two = engine.add_object(
        xp.PhysicalObject(xp.Sphere(0.5), mass=m2, position=(2, 0, 0), velocity=(v2, 0, 0)), laws=[law]
    )
    before = engine.energy().total
    engine.run(until=2.0)
    assert (one.velocity[0], two.velocity[0]) == pytest.approx((w1, w2), abs=1e-14)
    assert two.velocity[0] - one.velocity[0] == pytest.approx(-(v2 - v1), abs=1e-14)
    assert engine.momentum()[0] == pytest.approx(m1 * v1 + m2 * v2, abs=1e-14)
    assert engine.energy().total == pytest.approx(before, rel=1e-15)


@pytest.mark.thesis("two-bodies")
def test_appendix_a_an_infinite_mass_reverses() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    one = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), mass=3.0, velocity=(4, 0, 0)), laws=[law])
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(2, 0, 0), fixed=True), laws=[law])
    engine.run(until=1.0)
    assert one.velocity == (-4, 0, 0)


@pytest.mark.thesis("surface-component")
def test_4_3_2_2_fig_4_17_the_surface_component_is_unchanged_to_the_bit() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    one = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), mass=2.0, velocity=(3, 0.1, 0.7)), laws=[law])
    two = engine.add_object(
        xp.PhysicalObject(xp.Sphere(0.5), mass=1.0, position=(2, 0, 0), velocity=(0, 0.1, 0.7)), laws=[law]
    )
    engine.run(until=1.0)
    assert one.velocity[1:] == two.velocity[1:] == (0.1, 0.7)
    assert (one.velocity[0], two.velocity[0]) == pytest.approx((1, 4), abs=1e-14)


@pytest.mark.thesis("elasticity", "elasticity/fix")
@pytest.mark.parametrize(
    ("own", "law_value", "expected"),
    [((None, None), 0.5, 0.5), ((0.2, None), 0.6, 0.4), ((0.2, 0.8), 1.0, 0.5), ((0.0, 0.0), 1.0, 0.0)],
)
@pytest.mark.parametrize("moving", [True, False], ids=["two movers", "one fixed"])
def test_4_3_2_3_fig_4_18_restitution_global_and_per_object(
    own: tuple[float | None, float | None], law_value: float, expected: float, moving: bool
) -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic", restitution=law_value)
    given = [{} if value is None else {"restitution": value} for value in own]
    one = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), velocity=(2, 0, 0), **given[0]), laws=[law])
    two = engine.add_object(
        xp.PhysicalObject(xp.Sphere(0.5), position=(2, 0, 0), fixed=not moving, **given[1]), laws=[law]
    )
    engine.run(until=2.0)
    assert two.velocity[0] - one.velocity[0] == pytest.approx(2 * expected, abs=1e-15)


@pytest.mark.thesis("live-collision-law")
def test_4_3_3_fig_4_19_objects_added_to_a_live_law_are_watched_and_removed_ones_are_not() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    wall = engine.add_object(xp.PhysicalObject(xp.Plane((-1, 0, 0), offset=-10), fixed=True), laws=[law])
    balls = [
        engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(0, 3 * k, 0), velocity=(1, 0, 0)))
        for k in range(3)
    ]
    engine.run(until=1.0)
    engine.map(balls[0], law)
    engine.map(balls[1], law)
    engine.run(until=5.0)
    engine.unmap(balls[1], law)
    late = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(0, -9, 0), velocity=(1, 0, 0)), laws=[law])
    engine.run(until=20.0)
    assert [ball.velocity[0] for ball in (*balls, late)] == [-1, 1, 1, -1] and wall.position == (0, 0, 0)


class Hear(xp.PhysicalLaw):
    """Keeps the contacts that it is told of."""

    role = "collision"
    condition = xp.when.Impact()

    def __init__(self, **given: object) -> None:
        super().__init__(**given)  # type: ignore[arg-type]
        self.heard: list[xp.Contact] = []

    def enforce_this_law(self, event: xp.Event) -> None:
        """Keep them."""
        self.heard += event.contacts


@pytest.mark.thesis("five-balls")
def test_4_3_1_fig_4_12_of_five_balls_each_touching_pair_is_reported_once_with_normal_and_point() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law(Hear())
    for k, speed in enumerate((4.0, 2.0, 0.0, -2.0, -4.0)):
        engine.add_object(
            xp.PhysicalObject(xp.Sphere(0.5), position=(2.0 * k, 0, 0), velocity=(speed, 0, 0)), laws=[law]
        )
    engine.run(until=0.51)
    assert len(law.heard) == len({frozenset((c.body_a, c.body_b)) for c in law.heard}) == 4
    assert all(abs(c.normal[0]) == 1.0 and c.approach_speed == 2.0 for c in law.heard)
    assert sorted(c.point[0] for c in law.heard) == pytest.approx([2.5, 3.5, 4.5, 5.5])


@pytest.mark.thesis("points-or-bodies", "points-or-bodies/decide")
def test_4_3_2_a_body_that_is_hit_off_its_centre_answers_as_a_point_or_with_its_inertia() -> None:
    for law, spin in (
        ("collision:point", 0.0),
        ("collision:elastic", -0.8 * 6 / (1 / 1 + 1 / 1 + 0.8**2 / (4.04 / 12)) / (4.04 / 12)),
    ):
        engine = xp.PhysicsEngine()
        made = engine.add_law(law)
        rod = engine.add_object(xp.PhysicalObject(xp.Box((0.2, 2.0, 0.2))), laws=[made])
        engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(-1, 0.8, 0), velocity=(3, 0, 0)), laws=[made])
        engine.run(until=0.4)
        assert rod.angular_velocity == pytest.approx((0, 0, spin), abs=1e-13)


def pair(container: xp.LawContainer, shape: xp.Shape, gap: float, **second: object) -> tuple[xp.PhysicsEngine, Hear]:
    """Return an engine with a ball of radius 0.5 at 6 m/s along x, and another body ``gap`` before it."""
    engine = xp.PhysicsEngine()
    law = engine.add_law(Hear(), container=container)
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), velocity=(6, 0, 0)), laws=[law])
    engine.add_object(xp.PhysicalObject(shape, **({"position": (1 + gap, 0, 0)} | second)), laws=[law])  # type: ignore[arg-type]
    engine.step(1 / 60)
    return engine, law


@pytest.mark.thesis("bounding-box")
def test_4_3_3_fig_4_20_bounding_boxes_may_be_early_and_the_exact_container_waits_until_they_touch() -> None:
    corner = {"position": (0.9, 0.9, 0)}
    assert len(pair(BoundingBoxes(), xp.Sphere(0.5), 0.0, **corner)[1].heard) == 1
    engine, exact = pair(xp.LawContainer(xp.when.Impact()), xp.Sphere(0.5), 0.0, **corner)
    assert len(exact.heard) == 0
    touch = (0.9 - math.sqrt(1 - 0.9**2)) / 6  # [s]: where the centres are 1 m apart
    engine.run(until=touch - 1e-9)
    assert len(exact.heard) == 0
    engine.run(until=touch + 1e-9)
    assert len(exact.heard) == 1


@pytest.mark.thesis("pick-distance")
@pytest.mark.parametrize(("gap", "factor", "found"), [(0.19, 2.0, 1), (0.21, 2.0, 0), (0.31, 3.0, 0), (0.29, 3.0, 1)])
def test_4_3_3_fig_4_21_and_4_22_what_lies_ahead_within_tau_is_found(gap: float, factor: float, found: int) -> None:
    _, law = pair(Picking(factor=factor), xp.Sphere(0.5), gap)
    assert len(law.heard) == found
    for contact in law.heard:
        assert (
            abs(contact.normal[0]) == 1.0 and contact.separation == pytest.approx(gap) and contact.approach_speed == 6.0
        )


@pytest.mark.thesis("pick-overlap")
def test_4_3_3_fig_4_23_overlap_is_found_through_the_range_below_zero() -> None:
    assert len(pair(Picking(), xp.Box((1, 1, 1)), -0.19)[1].heard) == 1
    assert len(pair(Picking(), xp.Box((1, 1, 1)), -0.21)[1].heard) == 0


@pytest.mark.thesis("pick-misses")
def test_4_3_3_the_pick_from_the_centre_misses_glancing_hits_and_has_no_direction_at_rest() -> None:
    assert (
        len(pair(Picking(), xp.Sphere(0.5), 0.0, position=(0.6, 0.75, 0))[1].heard) == 0
    )  # they overlap; the ray goes by
    assert len(pair(Picking(), xp.Sphere(0.5), -0.05, velocity=(6, 0, 0))[1].heard) == 0


@pytest.mark.thesis("third-body")
@pytest.mark.parametrize("kind", [BoundingBoxes, Picking])
def test_4_3_3_a_third_body_that_touches_a_pair_is_reported_too(kind: type[xp.LawContainer]) -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law(Hear(), container=kind())
    for x, v in ((0.0, 1.0), (1.0, 0.0), (2.0, -1.0)):
        engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(x, 0, 0), velocity=(v, 0, 0)), laws=[law])
    engine.step(0.01)
    assert len(law.heard) == 2


@pytest.mark.thesis("live-collision-law")
def test_4_3_3_fig_4_19_a_live_bounding_box_container_watches_what_is_added_and_not_what_is_removed() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:stop", container="collision:bounding_box")
    engine.add_object(xp.PhysicalObject(xp.Plane((-1, 0, 0), offset=-5), fixed=True), laws=[law])
    balls = [
        engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(0, 3 * k, 0), velocity=(1, 0, 0)))
        for k in range(2)
    ]
    engine.run(until=1.0, dt=0.1)
    engine.map(balls[0], law)
    engine.map(balls[1], law)
    engine.run(until=2.0, dt=0.1)
    engine.unmap(balls[1], law)
    engine.run(until=9.0, dt=0.1)
    assert balls[0].velocity == (0, 0, 0) and balls[1].velocity == (1, 0, 0)


@pytest.mark.thesis("one-detection-many-laws")
def test_3_2_2_3_fig_3_11_a_hundred_detections_and_three_enforcements_for_each_event() -> None:
    engine = xp.PhysicsEngine()
    container = BoundingBoxes(period=0.01)
    laws = [engine.add_law(Hear(name=name), container=container) for name in "abc"]
    for x, v in ((0.0, 1.0), (1.505, 0.0)):
        engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(x, 0, 0), velocity=(v, 0, 0)), laws=laws)
    engine.run(until=1.0)
    assert container.detections == 100 and container.firings == 50
    assert [law.evaluations for law in laws] == [50, 50, 50]


@pytest.mark.thesis("container-refuses")
@pytest.mark.parametrize("container", ["collision:bounding_box", "collision:picking", "collision:exact"])
def test_fig_3_16_and_3_17_a_collision_container_refuses_a_law_of_another_role(container: str) -> None:
    with pytest.raises(NotAcceptedError, match=rf"{container} accepts.*role 'collision'.*gravity"):
        xp.PhysicsEngine().add_law("basic:planet_gravity", container=container)


@pytest.mark.thesis("cheap-responses")
@pytest.mark.parametrize("law", ["collision:reverse", "collision:stop"])
def test_2_6_the_cheapest_responses(law: str) -> None:
    engine = xp.PhysicsEngine()
    made = engine.add_law(law, container="collision:bounding_box")
    engine.add_object(xp.PhysicalObject(xp.Box((1, 1, 1)), velocity=(1, 0, 0)), laws=[made])
    engine.add_object(xp.PhysicalObject(xp.Box((1, 1, 1)), position=(2, 0, 0), fixed=True), laws=[made])
    engine.run(until=2.0, dt=0.1)
    assert engine.objects[0].velocity == ((-1, 0, 0) if law == "collision:reverse" else (0, 0, 0))


@pytest.mark.thesis("pushed-car")
def test_fig_3_13_a_car_that_is_a_box_neither_passes_the_wall_nor_gains_energy() -> None:
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic", restitution=0.5, resting="hold")
    engine.add_object(xp.PhysicalObject(xp.Plane((-1, 0, 0), offset=-5), fixed=True), laws=[bounce])
    car = engine.add_object(xp.PhysicalObject(xp.Box((4, 1.5, 2)), mass=10.0), laws=[bounce])
    car.add_force((20, 0, 0))
    record = engine.run(until=30.0, every=0.05)
    assert record[car].position[:, 0].max() <= 3.0 + 1e-9
    assert car.velocity == (0, 0, 0) and engine.energy().kinetic == 0.0


@pytest.mark.thesis("five-balls")
def test_4_3_1_fig_4_12_five_balls_each_touching_pair_once_with_normal_and_point() -> None:
    heard: list[xp.Contact] = []
    hear = type("Hear", (xp.PhysicalLaw,), {"enforce_this_law": lambda self, event: heard.extend(event.contacts)})
    engine = xp.PhysicsEngine()
    laws = [engine.add_law(hear(), container=xp.LawContainer(xp.when.Impact())), engine.add_law("collision:elastic")]
    middle = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5)), laws=laws)
    ways = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, 0, -1)]
    others = [
        engine.add_object(
            xp.PhysicalObject(xp.Sphere(0.5), position=[3 * c for c in way], velocity=[-c for c in way]), laws=laws
        )
        for way in ways
    ]
    engine.run(until=2.5)
    assert sorted(id(one.body_a if one.body_b is middle else one.body_b) for one in heard) == sorted(map(id, others))
    for one in heard:
        other, sign = (one.body_b, 1.0) if one.body_a is middle else (one.body_a, -1.0)
        way = ways[others.index(other)]
        assert [sign * c for c in one.normal] == pytest.approx(way, abs=1e-15)
        assert one.point == pytest.approx([0.5 * c for c in way], abs=1e-12)


@pytest.mark.thesis("points-or-bodies")
def test_4_3_2_spheres_that_meet_centrally_answer_alike_as_points_and_as_bodies() -> None:
    ends = []
    for law in ("collision:point", "collision:elastic"):
        engine = xp.PhysicsEngine()
        made = engine.add_law(law)
        for x, v, mass in ((0.0, 3.0, 2.0), (2.0, -1.0, 1.3)):
            ball = xp.PhysicalObject(xp.Sphere(0.5), mass=mass, position=(x, 0, 0), velocity=(v, 0.1, 0))
            engine.add_object(ball, laws=[made])
        engine.run(until=1.0)
        ends.append([(ball.velocity, ball.angular_velocity) for ball in engine.objects])
    assert ends[0] == ends[1]
