"""Objects that the host holds, carries and lets go: exact ways, waiting forces, the books of energy, and all doors of an engine."""

from __future__ import annotations

import copy
import math
import pickle
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import InvalidValueError, LawFailedError, OwnershipError, StateError
from xpheve.scene import dumps, loads

when = xp.when
Built = tuple[xp.PhysicsEngine, xp.PhysicalLaw, xp.PhysicalObject]


@pytest.fixture
def falling() -> Built:
    """A ball that falls at 10 m/s^2 from 1 m."""
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", acceleration=10.0, name="g")
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(0, 0, 1), name="ball"), laws=[gravity])
    return engine, gravity, ball


def bits(engine: xp.PhysicsEngine) -> tuple[Any, ...]:
    """The state of ``engine`` to the bit."""
    names = ("position", "velocity", "orientation", "angular_velocity", "mass", "driven")
    return (engine.time, *(getattr(engine.bodies, name).tobytes() for name in names))


def test_a_held_object_stands_where_it_was_taken_hold_of_and_feels_nothing(falling: Built) -> None:
    engine, _, ball = falling
    engine.run(until=0.2)
    ball.hold()
    assert ball.driven and ball.position == (0, 0, 0.8) and ball.velocity == (0, 0, 0)
    ball.add_force((5, 0, 0))
    engine.run(until=3.0)
    assert ball.position == (0, 0, 0.8) and ball.velocity == (0, 0, 0)
    assert len(ball.forces) == 2, "they wait"


def test_a_carried_object_goes_uniformly_and_arrives_to_the_bit(falling: Built) -> None:
    engine, _, ball = falling
    ball.hold()
    ball.carry((0.3, 0, 1.7), (0, 0, 0, 1), within=0.7)
    engine.run(until=0.35)
    assert ball.position == pytest.approx((0.15, 0, 1.35), abs=1e-15)
    assert ball.velocity == (0.3 / 0.7, 0, 0.7 / 0.7)
    assert ball.angular_velocity == pytest.approx((0, 0, math.pi / 0.7))
    assert ball.orientation == pytest.approx((math.sqrt(0.5), 0, 0, math.sqrt(0.5)), abs=1e-15)
    engine.run(until=0.7)
    assert ball.position == (0.3, 0, 1.7) and ball.orientation == (0, 0, 0, 1), (
        "the arrival belongs to the run that ends there"
    )
    engine.run(until=9.0)
    assert ball.position == (0.3, 0, 1.7) and ball.velocity == (0, 0, 0) and ball.angular_velocity == (0, 0, 0)


def test_it_is_let_go_with_the_velocity_that_it_has_or_the_one_given(falling: Built) -> None:
    engine, _, ball = falling
    ball.drive(velocity=(2, 0, 0), angular_velocity=(0, 0, 3))
    engine.run(until=1.0)
    assert ball.position == (2, 0, 1)
    ball.release()
    assert not ball.driven and ball.velocity == (2, 0, 0) and ball.angular_velocity == (0, 0, 3)
    engine.run(until=1.5)
    assert ball.position == (3, 0, 1 - 1.25) and ball.velocity == (2, 0, -5)
    ball.hold()
    ball.release(velocity=(0, 0, 7))
    assert ball.velocity == (0, 0, 7) and ball.angular_velocity == (0, 0, 0)


def test_the_time_of_a_force_goes_on_while_the_object_is_held(falling: Built) -> None:
    engine, gravity, ball = falling
    engine.unmap(ball, gravity)
    ball.add_force((4, 0, 0), duration=1.0)
    ball.hold()
    engine.run(until=0.75)
    ball.release()
    engine.run(until=2.0)
    assert ball.velocity == (1.0, 0, 0), "a quarter of a second was left"


def test_the_work_of_the_hand_is_reported_and_the_balance_holds(falling: Built) -> None:
    engine, _, ball = falling
    ball.velocity = (3, 0, 0)
    engine.run(until=0.1)
    balance = engine.energy().balance
    ball.hold()
    assert engine.energy().balance == pytest.approx(balance, rel=1e-14)
    ball.carry((0, 0, 3), within=0.5)
    engine.run(until=0.9)
    assert engine.energy().balance == pytest.approx(balance, rel=1e-14)
    ball.release((1, 1, 1))
    engine.run(until=1.3)
    assert engine.energy().balance == pytest.approx(balance, rel=1e-13)
    work = engine.explain().data["energy"]["work_by"]["driven"]
    lifted = 10.0 * (3.0 - 1.0) + 0.5 * 3.0 - 0.5 * 9.0  # potential and kinetic energy that came in, on the whole
    assert work == pytest.approx(lifted, rel=1e-13)


def test_driven_objects_are_outside_energy_and_momentum_as_fixed_ones_are(falling: Built) -> None:
    engine, _, ball = falling
    engine.run(until=0.0)
    ball.drive(velocity=(2, 0, 0))
    energy = engine.energy()
    assert (energy.kinetic, energy.potential) == (0.0, 0.0)
    assert engine.momentum() == (0, 0, 0) and engine.angular_momentum() == (0, 0, 0)
    ball.release()
    assert engine.momentum() == (2, 0, 0) and engine.energy().kinetic == 2.0


def sprung() -> tuple[xp.PhysicsEngine, xp.PhysicalObject, xp.PhysicalObject]:
    """A mass on a spring whose other end is a hand."""
    engine = xp.PhysicsEngine(up="z")
    hand = engine.add_object(xp.PhysicalObject(position=(0, 0, 0), name="hand"))
    mass = engine.add_object(xp.PhysicalObject(position=(1, 0, 0), name="mass"))
    engine.add_law("basic:spring", stiffness=40.0, rest_length=1.0, between=(hand, mass))
    return engine, hand, mass


def test_a_spring_pulls_its_other_end_after_the_hand_to_second_order() -> None:
    """The end of a spring moves uniformly at v: x(t) = v t + L - (v / w) sin(w t)."""
    errors = []
    for dt in (1 / 100, 1 / 200):
        engine, hand, mass = sprung()
        hand.drive(velocity=(0.5, 0, 0))
        engine.run(until=1.0, dt=dt)
        w = math.sqrt(40.0)
        exact = 0.5 + 1.0 - 0.5 / w * math.sin(w)
        errors.append(abs(mass.position[0] - exact))
        assert hand.position == (0.5, 0, 0)
    assert errors[1] < 1e-4 and errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)


def test_what_pulls_on_a_driven_partner_is_booked_as_work_of_the_hand() -> None:
    drifts = []
    for dt in (1 / 200, 1 / 400):
        engine, hand, mass = sprung()
        engine.run(until=0.3, dt=dt)
        first = engine.energy().balance
        hand.drive(velocity=(0.5, 0, 0))
        engine.run(until=0.8, dt=dt)
        hand.carry((0, 1, 0), within=0.4)
        engine.run(until=1.0, dt=dt)
        hand.hold()
        engine.run(until=1.3, dt=dt)
        hand.release()
        engine.run(until=2.0, dt=dt)
        drifts.append(abs(engine.energy().balance - first))
        assert abs(engine.energy().work) > 0.01
    assert drifts[1] < 2e-4 and drifts[1] < 0.4 * drifts[0]
    assert mass.velocity != (0, 0, 0)


def test_partners_feel_the_hand_from_the_instant_it_moves() -> None:
    """A jump of the hand between two steps acts at once, as the same scene started at that instant."""
    engine, hand, mass = sprung()
    hand.hold()
    engine.run(until=0.105, dt=0.01)
    hand.position = (0.3, 0, 0)
    assert hand.driven
    engine.run(until=0.2, dt=0.01)
    assert mass.velocity[0] > 0.9 * 40 * 0.3 * 0.09 * 0.9


def test_a_hand_that_turns_an_asymmetric_body_turns_it_uniformly() -> None:
    engine = xp.PhysicsEngine()
    brick = engine.add_object(xp.PhysicalObject(inertia=(1, 2, 3)))
    brick.drive(angular_velocity=(0.3, 2.0, 0.1))
    engine.run(until=5.0)
    assert brick.angular_velocity == (0.3, 2.0, 0.1)
    size = math.hypot(0.3, 2.0, 0.1)
    expected = (math.cos(2.5 * size), *(c / size * math.sin(2.5 * size) for c in (0.3, 2.0, 0.1)))
    assert brick.orientation == pytest.approx(expected, abs=1e-14)
    brick.release()
    engine.run(until=6.0)
    assert brick.angular_velocity != (0.3, 2.0, 0.1), "free again, it tumbles"


def test_the_last_of_several_carries_in_one_instant_counts(falling: Built) -> None:
    engine, _, ball = falling
    ball.carry((9, 9, 9), within=0.25)
    ball.carry((1, 0, 1), within=0.5)
    engine.run(until=0.25)
    assert ball.position == (0.5, 0, 1) and ball.velocity == (2, 0, 0)
    ball.carry((0, 0, 0), within=2.0)
    engine.run(until=0.5)
    assert ball.position != (1, 0, 1) and ball.velocity != (0, 0, 0)
    engine.run(until=4.0)
    assert ball.position == (0, 0, 0)


def test_setting_its_state_ends_the_way_but_not_the_hold(falling: Built) -> None:
    engine, _, ball = falling
    ball.carry((1, 0, 1), within=1.0)
    engine.run(until=0.5)
    ball.velocity = (0, 2, 0)
    engine.run(until=2.0)
    assert ball.driven and ball.position == (0.5, 3.0, 1.0)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda obj: obj.carry((math.nan, 0, 0), within=1.0), "finite"),
        (lambda obj: obj.carry((1, 0, 0), within=math.nan), "above 0 s"),
        (lambda obj: obj.carry((1, 0, 0), within=0.0), "obj.position"),
        (lambda obj: obj.carry((1, 0, 0), within="soon"), "above 0 s"),
        (lambda obj: obj.carry((1e308, 0, 0), within=1e-10), "give it longer"),
        (lambda obj: obj.carry(within=1.0), "say where"),
        (lambda obj: obj.carry(orientation=(0, 0, 0, 0), within=1.0), "quaternion"),
        (lambda obj: obj.drive(velocity=(math.inf, 0, 0)), "finite"),
        (lambda obj: obj.drive(angular_velocity=(1, 2)), "three numbers"),
        (lambda obj: obj.hold() or obj.release((math.nan, 0, 0)), "finite"),
    ],
)
def test_what_makes_no_sense_is_refused_before_anything_changes(falling: Built, call: Any, words: str) -> None:
    engine, _, ball = falling
    before = bits(engine)
    with pytest.raises(InvalidValueError, match=words):
        call(ball)
    if not ball.driven:
        assert bits(engine) == before


def test_who_cannot_be_driven_is_told_so(falling: Built) -> None:
    engine, _, ball = falling
    floor = engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True))
    for call in (floor.hold, floor.drive, lambda: floor.carry((1, 0, 0), within=1.0)):
        with pytest.raises(InvalidValueError, match="fixed"):
            call()
    with pytest.raises(StateError, match="not driven"):
        ball.release()
    with pytest.raises(InvalidValueError, match=r"obj\.hold"):
        xp.PhysicalObject(driven=True)
    with pytest.raises(OwnershipError, match="in no engine"):
        xp.PhysicalObject().hold()


def test_removed_while_driven_it_is_free_and_another_may_take_its_row(falling: Built) -> None:
    engine, gravity, ball = falling
    other = engine.add_object(xp.PhysicalObject(position=(5, 0, 0)), laws=[gravity])
    ball.carry((1, 0, 1), within=1.0)
    engine.run(until=0.5)
    engine.remove_object(ball)
    assert not ball.driven and ball.position == (0.5, 0, 1) and ball.velocity == (1, 0, 0)
    engine.run(until=2.0)
    assert other.position == (5, 0, -20) and not engine.bodies.driven.any()
    engine.add_object(ball, laws=[gravity])
    engine.run(until=3.0)
    assert ball.velocity == (1, 0, -10)


def test_laws_mapped_while_it_is_driven_act_from_its_release_on(falling: Built) -> None:
    engine, gravity, ball = falling
    wind = engine.add_law("basic:linear_drag", coefficient=1.0)
    ball.drive(velocity=(1, 0, 0))
    engine.unmap(ball, gravity)
    engine.map(ball, wind)
    engine.run(until=1.0)
    assert ball.position == (1, 0, 1) and ball.velocity == (1, 0, 0)
    ball.release()
    engine.run(until=2.0, rtol=1e-10, atol=1e-12)
    assert ball.velocity[0] == pytest.approx(math.exp(-1.0), rel=1e-6)


def test_a_handler_that_fails_lets_go_what_it_took_hold_of(falling: Built) -> None:
    engine, _, ball = falling

    class Clumsy(xp.PhysicalLaw):
        """Takes hold, and fails."""

        condition = when.Elapsed(0.5)

        def enforce_this_law(self, event: xp.Event) -> None:
            for obj in self.objects:
                obj.carry((9, 9, 9), within=1.0)
            raise RuntimeError("dropped")

    law = engine.add_law(Clumsy())
    engine.map(ball, law)
    with pytest.raises(LawFailedError, match="dropped"):
        engine.run(until=1.0)
    assert not ball.driven and not engine.bodies.driven.any() and engine.explain().data["energy"]["work_by"] == {}
    law.enabled = False
    engine.run(until=2.0)
    assert ball.position == (0, 0, 1 - 20)


def test_in_a_handler_it_may_be_taken_and_let_go_in_one_instant(falling: Built) -> None:
    engine, _, ball = falling

    class Catch(xp.PhysicalLaw):
        """Stops what falls."""

        condition = when.Elapsed(0.5)

        def enforce_this_law(self, event: xp.Event) -> None:
            for obj in self.objects:
                obj.hold()
                obj.release()

    engine.map(ball, engine.add_law(Catch()))
    engine.run(until=0.5)
    assert ball.velocity == (0, 0, 0) and not ball.driven
    engine.run(until=1.0)
    assert ball.velocity == (0, 0, -5)
    assert engine.energy().balance == pytest.approx(10.0, rel=1e-14)


def test_restored_copied_and_saved_engines_go_on_with_the_way(falling: Built) -> None:
    engine, gravity, ball = falling
    engine.add_object(xp.PhysicalObject(position=(3, 0, 0)), laws=[gravity])
    engine.run(until=0.25)
    ball.carry((0.3, 0.2, 1.7), (0, 0.6, 0, 0.8), within=1 / 3)
    engine.run(until=0.4)
    others = [engine.copy(), xp.PhysicsEngine.restore(engine.checkpoint())]
    for one in (engine, *others):
        one.run(until=0.5)
        one.object("ball").add_force((1, 2, 3), 0.25)
        one.run(until=0.9)
        one.object("ball").release()
        one.run(until=1.5)
    assert {bits(one) for one in others} == {bits(engine)}


@pytest.mark.parametrize("form", ["toml", "json"])
def test_a_scene_file_says_that_it_is_driven_and_where_to(falling: Built, form: str) -> None:
    engine, _, ball = falling
    engine.run(until=0.25)
    ball.carry((0.3, 0.2, 1.7), (0, 0.6, 0, 0.8), within=1 / 3)
    engine.run(until=0.375)
    text = dumps(engine, form)
    again = loads(text, form)
    twin = again.object("ball")
    assert twin.driven and dumps(again, form).split("\n", 1)[1] == text.split("\n", 1)[1]
    for name in ("position", "velocity", "orientation", "angular_velocity"):
        assert getattr(twin, name) == getattr(ball, name)
    again.run(until=1.0)
    assert twin.position == (0.3, 0.2, 1.7) and twin.velocity == (0, 0, 0)


def test_a_scene_file_written_by_hand_may_leave_the_velocity_to_the_arrival() -> None:
    text = 'xpheve = 1\n[[objects]]\ndriven = true\narrival = { position = [1.0, 0.0, 0.0], within = "2 s" }\n'
    engine = loads(text)
    assert engine.objects[0].velocity == (0.5, 0, 0)
    for wrong, words in (
        (text.replace("driven = true\n", ""), "driven = true"),
        (text.replace("driven = true", "driven = true\nfixed = true"), "fixed"),
        (text.replace("driven = true", "driven = true\nvelocity = [9.0, 0.0, 0.0]"), "leave velocity"),
        (text.replace('"2 s"', "-1"), "above 0"),
    ):
        with pytest.raises(xp.errors.SceneError, match=words):
            loads(wrong)


def test_reset_lets_go_of_what_was_taken_after_the_start_and_holds_what_was_held_before(falling: Built) -> None:
    engine, gravity, ball = falling
    held = engine.add_object(xp.PhysicalObject(position=(4, 0, 0)), laws=[gravity])
    held.carry((5, 0, 0), within=1.0)
    engine.run(until=0.5)
    ball.hold()
    held.release()
    engine.run(until=1.0)
    engine.reset()
    assert not ball.driven and held.driven and held.position == (4, 0, 0)
    engine.run(until=2.0)
    assert held.position == (5, 0, 0) and ball.position == (0, 0, -19)


def test_copies_and_pickles_are_free(falling: Built) -> None:
    ball = falling[2]
    ball.drive(velocity=(1, 2, 3))
    for twin in (copy.copy(ball), copy.deepcopy(ball), pickle.loads(pickle.dumps(ball))):
        assert not twin.driven and twin.engine is None and twin.velocity == (1, 2, 3)


def test_explain_and_listings_say_who_is_driven(falling: Built) -> None:
    engine, _, ball = falling
    ball.hold()
    engine.run(until=0.1)
    assert "driven" in repr(ball) and engine.bodies.driven.tolist() == [True]
    group = engine.explain().data["groups"][0]
    assert group["stepper"] == "core:driven" and "host" in group["because"]


@settings(deadline=None, max_examples=40)
@given(
    calls=st.lists(
        st.tuples(st.floats(0.01, 1.0), st.floats(-5, 5), st.floats(0.01, 2.0), st.integers(0, 3)), max_size=8
    ),
    looks=st.lists(st.floats(0.001, 8.0), max_size=5),
)
def test_looking_changes_nothing_of_a_way_and_positions_never_jump(
    calls: list[tuple[float, float, float, int]], looks: list[float]
) -> None:
    ends = []
    for looking in (False, True):
        engine = xp.PhysicsEngine(up="z")
        gravity = engine.add_law("basic:planet_gravity", acceleration=10.0)
        ball = engine.add_object(xp.PhysicalObject(), laws=[gravity])
        for span, x, within, kind in calls:
            now = engine.time
            before = ball.position
            if kind == 0:
                ball.hold()
            elif kind == 1:
                ball.carry((x, 0, x), within=within)
            elif kind == 2:
                ball.drive((x, 1, 0))
            elif ball.driven:
                ball.release()
            assert ball.position == before
            if looking:
                for look in sorted(looks):
                    if now < look < now + span:
                        engine.run(until=look)
                        engine.energy(), engine.bodies.position, engine.frame()
            engine.run(until=now + span)
        ends.append(bits(engine))
    assert ends[0] == ends[1]
