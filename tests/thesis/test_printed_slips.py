"""What the thesis prints, and why we do otherwise: each slip as a small function, beside the engine that does not make it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import InvalidValueError


def printed_update(force: float, mass: float, duration: float, dt: float) -> tuple[float, float, float]:
    """Thesis 2.4 and 2.5: speed, place and what is left of the force after one update, from rest; rules (1) to (3)."""
    acting = duration if duration < dt else dt  # (1), else (2) and (3)
    speed = force / mass * acting
    return speed, 0.5 * speed * dt, duration - dt


def pushed(force: float, duration: float, dt: float, mass: float = 1.0) -> xp.PhysicalObject:
    """Return a body at rest after one step under a force."""
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject(mass=mass))
    body.add_force((force, 0, 0), duration)
    engine.step(dt)
    return body


@pytest.mark.thesis("units-of-force/fix")
def test_fig_2_12_in_milliseconds_the_speed_would_be_a_thousand_times_too_large() -> None:
    speed, _, _ = printed_update(20.0, 1.0, 1000.0, 1000.0)  # N, kg, ms
    assert speed == 20_000.0
    assert pushed(20.0, 1.0, 1.0).velocity == (20.0, 0.0, 0.0)


RULES = {  # of the text: impulse of an update, and what is left of the force
    1: lambda force, duration, dt: (force * duration, 0.0),  # shorter than the update
    2: lambda force, duration, dt: (force * dt, 0.0),  # as long
    3: lambda force, duration, dt: (force * dt, duration - dt),  # longer
}


@pytest.mark.thesis("impulse-of-a-step/fix")
@pytest.mark.parametrize(("by_text", "by_figure", "duration"), [(1, 3, 0.010), (2, 2, 0.020), (3, 1, 0.030)])
def test_fig_2_8_the_rules_of_the_text_hold_and_not_the_numbers_of_the_figure(
    by_text: int, by_figure: int, duration: float
) -> None:
    """Who goes by the numbers in the figure uses rule (3) for what is shorter than dt = 20 ms, and (1) for what is longer."""
    body = pushed(20.0, duration, 0.020)
    impulse, left = RULES[by_text](20.0, duration, 0.020)
    assert body.velocity[0] == pytest.approx(impulse, abs=1e-15)
    assert sum(force.duration for force in body.forces) == pytest.approx(left, abs=1e-15)
    if by_figure != by_text:
        assert abs(RULES[by_figure](20.0, duration, 0.020)[0] - body.velocity[0]) > 0.19


@pytest.mark.thesis("infinite-forces/fix")
def test_2_5_minus_one_is_no_duration() -> None:
    speed, _, left = printed_update(20.0, 1.0, -1.0, 0.02)
    assert speed == -20.0 and left < 0  # once, negatively; then it is taken off the list
    assert pushed(20.0, math.inf, 0.02).velocity == pytest.approx((0.4, 0, 0), rel=1e-15)
    with pytest.raises(InvalidValueError, match=r"math\.inf"):
        xp.Force((20, 0, 0), -1)


@pytest.mark.thesis("end-inside-a-step/fix")
def test_2_5_the_printed_step_misses_the_place_where_a_force_ends_inside_it() -> None:
    speed, place, _ = printed_update(20.0, 1.0, 0.25, 1.0)
    body = pushed(20.0, 0.25, 1.0)
    assert (speed, place) == (5.0, 2.5)
    assert body.velocity[0] == speed and body.position[0] == 4.375
    assert body.position[0] - place == 20.0 * 0.25 * (1.0 - 0.25) / 2


@pytest.mark.thesis("force-ids/fix")
def test_fig_2_9_one_call_has_one_name() -> None:
    """The thesis calls it getNextAvailableID in one place and generateID in another; here new_force_id, never the same id twice."""
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject())
    named = [name for name in dir(engine) if "id" in name.lower().split("_") and not name.startswith("_")]
    assert named == ["new_force_id"]
    found = [engine.new_force_id(), body.add_force((1, 0, 0)).id, engine.new_force_id(), body.add_force((1, 0, 0)).id]
    assert len(set(found)) == 4


@pytest.mark.thesis("never-inside/fix")
def test_2_8_a_response_that_comes_late_lets_objects_into_each_other() -> None:
    """A ball at 6 m/s, a wall 0.55 m ahead, updates each 20 ms: answered at the first update that sees it touch."""
    dt, place = 0.02, 0.0
    while place < 0.55:
        place += 6.0 * dt
    assert place > 0.59  # 4 cm deep
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic")
    engine.add_object(xp.PhysicalObject(xp.Plane((-1, 0, 0), offset=-1.05), fixed=True), laws=[bounce])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), velocity=(6, 0, 0)), laws=[bounce])
    farthest = max(engine.step(dt) or ball.position[0] for _ in range(20))
    assert farthest <= 0.55 + 1e-12 and ball.velocity[0] == -6.0


@pytest.mark.thesis("resume-is-no-start/fix")
def test_3_1_3_a_resume_that_posts_start_up_adds_gravity_again() -> None:
    """The printed startup container knows its wake-up by a number, and resume posts the same number."""
    start_up = resume = 1
    stored = [-9.8 for post in (start_up, *[resume] * 10) if post == start_up]
    assert sum(stored) == pytest.approx(-9.8 * 11)
    engine = xp.PhysicsEngine()
    holder = xp.LawContainer(xp.when.Started())
    gravity = engine.add_law("basic:planet_gravity", container=holder, acceleration=9.8)
    ball = engine.add_object(xp.PhysicalObject(), laws=[gravity])
    engine.run(until=0.0)
    for k in range(1, 11):
        engine.suspend()
        engine.resume()
        engine.run(until=0.1 * k)
    assert sum(force.vector[1] for force in ball.forces) == -9.8
    assert holder.firings == 1 and ball.velocity[1] == pytest.approx(-9.8, rel=1e-14)


@pytest.mark.thesis("balloon-and-car", "balloon-and-car/fix")
def test_fig_3_25_and_5_1_the_balloon_and_the_car() -> None:
    """As printed, a list is asked for a field `allLaws` that lists have not got: it fails where it would fill its first list."""
    printed_list: list[str] = []
    with pytest.raises(AttributeError, match="allLaws"):
        printed_list.allLaws.append("collision")  # type: ignore[attr-defined]

    engine = xp.PhysicsEngine()
    gravity = engine.add_law("basic:planet_gravity", acceleration=9.8)
    collision = engine.add_law("collision:elastic", restitution=0.5)
    collision_law_only = [collision]
    all_laws = [gravity, collision]
    balloon = xp.PhysicalObject(xp.Sphere(0.3), mass=0.1, position=(0, 5, 0), name="balloon")
    car = xp.PhysicalObject(xp.Sphere(1.0), mass=900.0, position=(5, 5.9, 0), name="car")
    floor = xp.PhysicalObject(xp.Plane(), fixed=True, name="floor")
    engine.add_object(balloon, collision_law_only)
    engine.add_object(car, all_laws)
    engine.add_object(floor, collision_law_only)
    engine.run(until=1.0)  # 4.9 m down: the car touches the floor at this instant
    assert balloon.position == (0, 5, 0)
    assert car.position == pytest.approx((5, 1, 0), abs=1e-12)
    assert car.velocity == pytest.approx((0, 4.9, 0), abs=1e-12)


@pytest.mark.thesis("wake-up-instant", "wake-up-instant/fix")
@pytest.mark.parametrize("dt", [None, 0.05])
def test_3_2_2_2_every_condition_in_time_is_answered_at_its_instant(dt: float | None) -> None:
    """Java3D hears of elapsed time when it looks: at the next frame, and then only behind other work."""
    asked, frame = 0.13, 0.05
    late = math.ceil(asked / frame) * frame
    assert late == pytest.approx(0.15)
    heard: dict[str, list[float]] = {}

    def law(name: str) -> Any:
        def enforce_this_law(self: Any, event: Any) -> None:
            heard.setdefault(name, []).append(event.time)

        return type(name, (xp.PhysicalLaw,), {"enforce_this_law": enforce_this_law})()

    engine = xp.PhysicsEngine()
    laws = {
        "elapsed": xp.when.Elapsed(asked),
        "expired": xp.when.ForceExpired("push"),
        "impact": xp.when.Impact(),
        "begin": xp.when.ContactBegin(),
        "posted": xp.when.Posted("now"),
    }
    made = {name: engine.add_law(law(name), container=xp.LawContainer(condition)) for name, condition in laws.items()}
    poster = type("Poster", (xp.PhysicalLaw,), {"enforce_this_law": lambda self, event: self.engine.post("now")})
    engine.add_law(poster(), container=xp.LawContainer(xp.when.Elapsed(asked)))
    both = [made["impact"], made["begin"], engine.add_law("collision:elastic")]
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), velocity=(10, 0, 0)), laws=both)
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(2.3, 0, 0), fixed=True), laws=both)
    far = engine.add_object(xp.PhysicalObject(position=(0, 99, 0)))
    far.add_force((1, 0, 0), asked, id="push")
    engine.run(until=0.2, dt=dt)
    assert set(heard) == set(laws)
    assert all(times == [pytest.approx(asked, abs=1e-15)] for times in heard.values()), heard


@pytest.mark.thesis("weight/fix")
@pytest.mark.parametrize("mass", [0.5, 2.0, 2.75])
def test_4_2_2_the_printed_quotient_and_a_whole_mass_are_both_wrong(mass: float) -> None:
    def printed(a: float, m: float) -> float:
        return a / int(m) if int(m) else math.inf

    engine = xp.PhysicsEngine()
    gravity = engine.add_law("basic:planet_gravity", acceleration=9.8)
    body = engine.add_object(xp.PhysicalObject(mass=mass), laws=[gravity])
    engine.run(until=0.0)
    weight = -body.forces[0].vector[1]
    assert weight == pytest.approx(9.8 * mass, rel=1e-15) != printed(9.8, mass)


@pytest.mark.thesis("each-start/fix")
def test_fig_4_7_a_condition_that_wakes_once_misses_the_second_start() -> None:
    """The printed container does not arm its condition again; ``once=True`` is that, until a reset."""
    for once, expected in ((False, 3), (True, 3)):
        engine = xp.PhysicsEngine()
        holder = engine.add_container(xp.LawContainer(xp.when.Started(once=once)))
        count = 0
        for _ in range(3):
            engine.run(until=1.0)
            count += holder.firings > 0
            engine.reset()
        assert count == expected

    def printed(starts: int) -> int:
        armed, fired = True, 0
        for _ in range(starts):
            fired += armed
            armed = False
        return fired

    assert printed(3) == 1


@pytest.mark.thesis("one-gravity-force/fix", "disabled-gravity/fix")
def test_4_2_2_clearing_all_forces_or_all_of_one_id_takes_away_what_is_not_the_laws() -> None:
    def printed_start(forces: list[Any], gravity: Any) -> list[Any]:
        forces.clear()
        return [gravity]

    def printed_removal(forces: list[tuple[str, Any]], id: str) -> list[tuple[str, Any]]:
        return [force for force in forces if force[0] != id]

    assert printed_start(["the user's"], "gravity") == ["gravity"]
    assert printed_removal([("gravity", -9.8), ("gravity", -1.6)], "gravity") == []

    engine = xp.PhysicsEngine()
    earth = engine.add_law("basic:planet_gravity", acceleration=9.8, name="earth")
    moon = engine.add_law("basic:planet_gravity", acceleration=1.6, name="moon")
    body = engine.add_object(xp.PhysicalObject(), laws=[earth, moon])
    mine = body.add_force((1, 0, 0))
    engine.run(until=0.0)
    assert {force.vector for force in body.forces} == {(1, 0, 0), (0, -9.8, 0), (0, -1.6, 0)}
    moon.enabled = False
    assert {force.vector for force in body.forces} == {(1, 0, 0), (0, -9.8, 0)} and mine in body.forces


def printed_reflection(v: np.ndarray, n: np.ndarray, factor: float) -> np.ndarray:
    """Thesis 4.3.2.1 with both angles by arccos; step 5 of the normal component read as it must be meant."""

    def component(direction: np.ndarray) -> np.ndarray:
        direction = direction / np.linalg.norm(direction)
        length = np.linalg.norm(v)
        return direction * length * np.cos(np.arccos(np.dot(direction, v) / length))

    return component(np.cross(n, np.cross(v, n))) - factor * component(-n)


def ours(v: Any, factor: float) -> np.ndarray:
    """Return the velocity after meeting a floor."""
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic", restitution=factor)
    engine.add_object(xp.PhysicalObject(xp.Plane((0, 1, 0)), fixed=True), laws=[law])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(0, 0.5, 0), velocity=v), laws=[law])
    engine.run(until=1e-3)
    return np.array(ball.velocity)


@pytest.mark.thesis("bounce/fix")
def test_4_3_2_1_the_printed_reflection_fails_head_on_and_loses_digits() -> None:
    n = np.array((0.0, 1.0, 0.0))
    assert printed_reflection(np.array((3.0, -4.0, 0.0)), n, 1.0) == pytest.approx((3, 4, 0), abs=1e-14)
    with np.errstate(invalid="ignore"):
        assert np.isnan(printed_reflection(np.array((0.0, -4.0, 0.0)), n, 1.0)).any()  # 0/0
    assert tuple(ours((0, -4, 0), 1.0)) == (0.0, 4.0, 0.0)
    graze = np.array((1.0, -1e-9, 0.0))  # arccos near 1 knows half the digits only
    assert abs(np.linalg.norm(printed_reflection(graze, n, 1.0) - (1.0, 1e-9, 0.0))) > 1e-17
    assert tuple(ours(graze, 1.0)) == (1.0, 1e-9, 0.0)


@pytest.mark.thesis("receding/fix")
def test_4_3_2_1_the_printed_law_turns_a_receding_body_back_into_the_wall() -> None:
    v = np.array((3.0, 4.0, 0.0))
    assert printed_reflection(v, np.array((0.0, 1.0, 0.0)), 1.0)[1] == pytest.approx(-4.0)
    assert tuple(ours(v, 1.0)) == (3.0, 4.0, 0.0)


def exchanged(m1: float, m2: float, v1: float, v2: float) -> tuple[float, float]:
    """Return the speeds of two balls along their line after they have met; the first is on the left."""
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    one, two = (
        engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), mass=m, position=(x, 0, 0), velocity=(v, 0, 0)), laws=[law])
        for m, x, v in ((m1, 0.0, v1), (m2, 1.5, v2))
    )
    engine.run(until=1.0)
    return one.velocity[0], two.velocity[0]


@pytest.mark.thesis("two-bodies/fix")
@pytest.mark.parametrize(("m1", "m2", "v1", "v2"), [(1, 2, 3, -3), (3, 1, 4, 1), (1, 3, 4, -1)])
def test_appendix_a_magnitudes_without_signs_do_not_keep_momentum(m1: float, m2: float, v1: float, v2: float) -> None:
    """The formula is right for signed components along one normal; the thesis puts lengths into it, and one speed comes out."""

    def formula(m1: float, m2: float, v1: float, v2: float) -> float:
        return (m1 - m2) / (m1 + m2) * v1 + 2 * m2 / (m1 + m2) * v2

    signed = formula(m1, m2, v1, v2), formula(m2, m1, v2, v1)
    assert exchanged(m1, m2, v1, v2) == pytest.approx(signed, abs=1e-13)
    assert m1 * signed[0] + m2 * signed[1] == pytest.approx(m1 * v1 + m2 * v2)
    assert signed[1] - signed[0] == pytest.approx(v1 - v2)
    if v2 < 0:
        lengths = formula(m1, m2, abs(v1), abs(v2)), formula(m2, m1, abs(v2), abs(v1))
        assert abs(m1 * lengths[0] + m2 * lengths[1] - (m1 * v1 + m2 * v2)) > 1.0


@pytest.mark.thesis("elasticity/fix")
def test_4_3_2_3_one_factor_for_all_cannot_tell_rubber_from_clay() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic", restitution=0.5)
    engine.add_object(xp.PhysicalObject(xp.Plane((0, 1, 0)), fixed=True), laws=[law])
    fell = [
        engine.add_object(
            xp.PhysicalObject(xp.Sphere(0.5), position=(3 * k, 1, 0), velocity=(0, -1, 0), **own), laws=[law]
        )
        for k, own in enumerate(({"restitution": 0.9}, {}, {"restitution": 0.0}))
    ]
    engine.run(until=0.75)
    assert [ball.velocity[1] for ball in fell] == pytest.approx([0.7, 0.5, 0.25], abs=1e-15)  # with the floor's 0.5


@pytest.mark.thesis("third-body", "third-body/fix")
def test_4_3_3_a_third_body_that_touches_a_pair_is_reported_too() -> None:
    """A detector that hands over one pair, as the thesis's, misses the second of a ball that meets two at one instant."""
    heard: list[frozenset[Any]] = []
    hear = type(
        "Hear",
        (xp.PhysicalLaw,),
        {
            "enforce_this_law": lambda self, event: heard.extend(
                frozenset((one.body_a, one.body_b)) for one in event.contacts
            )
        },
    )
    engine = xp.PhysicsEngine()
    laws = [engine.add_law(hear(), container=xp.LawContainer(xp.when.Impact())), engine.add_law("collision:elastic")]
    cue = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(-1, 0, 0), velocity=(1, 0, 0)), laws=laws)
    left, right = (
        engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(0, y, 0)), laws=laws) for y in (0.1, -0.1)
    )
    engine.run(until=2.0)
    assert set(heard) == {frozenset((cue, left)), frozenset((cue, right))}
    first_only: list[Any] = heard[:1]
    assert first_only != heard
    assert left.velocity[0] == right.velocity[0] > 0 and left.velocity[1] == -right.velocity[1] > 0


@pytest.mark.thesis("enforce-is-final/fix")
def test_fig_3_18_laws_begin_enabled() -> None:
    """A Java boolean begins as false, and the printed law does not set it: it would never be enforced."""
    kinds: list[Callable[[], xp.PhysicalLaw]] = [
        type("Own", (xp.PhysicalLaw,), {"enforce_this_law": lambda s, e: None})
    ]
    engine = xp.PhysicsEngine()
    made = [*(kind() for kind in kinds), engine.add_law("basic:planet_gravity"), engine.add_law("collision:elastic")]
    assert all(law.enabled for law in made)


@pytest.mark.thesis("pedal/fix")
def test_2_5_1_two_presses_as_printed_are_two_forces() -> None:
    """The thesis's handler adds a force at each key event, and keyboards repeat; one id that is removed first is one pedal."""

    def speed(release_first: bool) -> float:
        engine = xp.PhysicsEngine()
        car = engine.add_object(xp.PhysicalObject(mass=1000.0))
        for _ in range(2):
            if release_first:
                car.remove_force("pedal")
            car.add_force((5000, 0, 0), id="pedal")
        engine.run(until=1.0)
        return car.velocity[0]

    assert (speed(release_first=False), speed(release_first=True)) == (10.0, 5.0)
