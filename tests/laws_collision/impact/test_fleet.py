"""The impact stepper in the engine: the same motion as by the contact server, whatever happens on the way."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.laws_collision.impact.scenes import LOOP, SERVER, gas, states

import xpheve as xp
from xpheve_laws_collision.impact.impact_loop import ImpactLoop

Change = Callable[[xp.PhysicsEngine, list[xp.PhysicalObject]], None]


def after(stepper: str, change: Change | None = None, until: float = 1.0, **scene: object) -> np.ndarray:
    """States of a gas at ``until`` [s]; ``change`` is made at half of that."""
    engine, balls = gas(stepper, 40, **scene)
    engine.run(until=0.5 * until)
    if change is not None:
        change(engine, balls)
    engine.run(until=until)
    return states([ball for ball in balls if ball.engine is engine])


def served_by(engine: xp.PhysicsEngine) -> set[str]:
    return {one["stepper"] for one in engine.explain().data["groups"]}


def test_many_balls_fly_by_the_loop_and_explain_says_so() -> None:
    engine, _balls = gas("", 40)
    engine.run(until=0.3)
    loop = engine.explain().data["contacts"]["impact loop"]
    assert loop["moving"] == 40 and loop["scenery"] == 6 and loop["impacts"] > 5
    assert loop["tier"] == "interpreted", "40 balls do not pay for compiling"
    assert "collision:impact" in str(engine.explain())
    other, _ = gas(SERVER, 8)
    other.run(until=0.3)
    assert "core:ballistic was asked for" in str(other.explain())


@pytest.mark.parametrize(
    "scene",
    [
        {},
        {"gravity": 9.81},
        {"uneven": True},
        {"uneven": True, "gravity": 9.81, "restitution": 0.7},
        {"restitution": 0.0},
        {"speed": 30.0, "restitution": 0.5},
    ],
)
def test_the_loop_and_the_server_agree(scene: dict[str, float]) -> None:
    assert np.allclose(after(LOOP, **scene), after(SERVER, **scene), rtol=0, atol=1e-9)


def test_energy_is_kept_to_rounding() -> None:
    engine, _ = gas(LOOP, 60)
    before = engine.energy().kinetic
    engine.run(until=3.0)
    assert engine.energy().kinetic == pytest.approx(before, rel=1e-13)


def test_dissipated_energy_is_booked() -> None:
    books = []
    for stepper in (LOOP, SERVER):
        engine, _ = gas(stepper, 40, restitution=0.6, gravity=9.81)
        engine.run(until=1.0)
        energy = engine.energy()
        books.append((energy.total, energy.kinetic, energy.work))
    assert books[0] == pytest.approx(books[1], rel=1e-10)


def kick(engine: xp.PhysicsEngine, balls: list[xp.PhysicalObject]) -> None:
    balls[3].velocity = (2.0, -1.0, 0.5)


def push(engine: xp.PhysicsEngine, balls: list[xp.PhysicalObject]) -> None:
    balls[5].add_force(xp.Force((0.05, 0.0, 0.1), duration=0.2))


def remove(engine: xp.PhysicsEngine, balls: list[xp.PhysicalObject]) -> None:
    engine.remove_object(balls[7])


def add(engine: xp.PhysicsEngine, balls: list[xp.PhysicalObject]) -> None:
    spot = xp.PhysicalObject(xp.Sphere(0.01), mass=0.1, position=(0.99 - 0.02, 0.97, 0.97), velocity=(-3.0, -2.0, -2.0))
    engine.add_object(spot, laws=list(engine.laws))


def soften(engine: xp.PhysicsEngine, balls: list[xp.PhysicalObject]) -> None:
    engine.laws[0].restitution = 0.5


def soften_one(engine: xp.PhysicsEngine, balls: list[xp.PhysicalObject]) -> None:
    balls[0]["restitution"] = 0.1
    balls[1]["restitution"] = 0.2


def unmap(engine: xp.PhysicsEngine, balls: list[xp.PhysicalObject]) -> None:
    for ball in balls[:20]:
        engine.unmap(ball, engine.laws[0])


def move_wall(engine: xp.PhysicsEngine, balls: list[xp.PhysicalObject]) -> None:
    wall = next(obj for obj in engine.objects if obj.fixed)
    wall.position = tuple(0.05 * c for c in wall.shape.normal)


@pytest.mark.parametrize("change", [kick, push, remove, add, soften, soften_one, unmap, move_wall])
def test_what_changes_on_the_way_changes_the_same(change: Change) -> None:
    assert np.allclose(after(LOOP, change), after(SERVER, change), rtol=0, atol=1e-9)


def test_a_law_switched_off_and_on_again_leaves_no_impact_of_the_past() -> None:
    def run(stepper: str) -> np.ndarray:
        engine, balls = gas(stepper, 40, speed=3.0)
        engine.run(until=0.2)
        bounce = engine.laws[0]
        bounce.enabled = False
        engine.run(until=0.3)
        for ball in balls:
            ball.position = tuple(0.5 * c for c in ball.position)
        engine.run(until=0.32)
        bounce.enabled = True
        engine.run(until=0.5)
        return states(balls)

    assert np.allclose(run(LOOP), run(SERVER), rtol=0, atol=1e-9)


def test_looking_and_stopping_change_no_bit() -> None:
    plain, balls = gas(LOOP, 50, uneven=True, gravity=9.81)
    plain.run(until=1.0)
    looked, others = gas(LOOP, 50, uneven=True, gravity=9.81)
    for end in (0.1, 0.1234567, 0.5):
        looked.run(until=end, every=0.01)
    looked.run(until=1.0, dt=1 / 64)
    assert states(balls).tobytes() == states(others).tobytes()


def test_a_checkpoint_in_the_midst_continues_to_the_bit(tmp_path: Path) -> None:
    engine, balls = gas(LOOP, 50, uneven=True, gravity=9.81, restitution=0.9)
    engine.run(until=0.6)
    engine.checkpoint(tmp_path / "mid.xpc")
    engine.run(until=1.2)
    again = xp.PhysicsEngine.restore(tmp_path / "mid.xpc")
    again.run(until=1.2)
    assert states([obj for obj in again.objects if not obj.fixed]).tobytes() == states(balls).tobytes()


def test_interpreted_and_compiled_loops_have_the_same_bits() -> None:
    found = []
    for compile in ("never", "always"):
        engine, balls = gas(LOOP, 50, uneven=True, gravity=9.81, restitution=0.9, compile=compile)
        engine.run(until=1.0)
        assert engine.explain().data["contacts"]["impact loop"]["tier"] == (
            "compiled" if compile == "always" else "interpreted"
        )
        found.append(states(balls).tobytes())
    assert found[0] == found[1]


class Heard(xp.PhysicalLaw):
    """Keeps what it is told."""

    id = "test:heard"
    condition = xp.when.Impact()

    def __init__(self) -> None:
        super().__init__()
        self.told: list[tuple[float, str, str]] = []

    def enforce_this_law(self, event: xp.Event) -> None:
        self.told += [(event.time, one.body_a.label, one.body_b.label) for one in event.contacts]


def test_who_listens_is_told_of_each_impact() -> None:
    told = []
    for stepper in (LOOP, SERVER):
        engine, balls = gas(stepper, 40)
        heard = engine.add_law(Heard())
        for ball in balls[:10]:
            engine.map(ball, heard)
        for wall in [obj for obj in engine.objects if obj.fixed]:
            engine.map(wall, heard)
        engine.run(until=1.0)
        told.append(heard.told)
    assert len(told[0]) == len(told[1]) > 0
    for one, other in zip(*told, strict=True):
        assert one[0] == pytest.approx(other[0], abs=1e-9) and one[1:] == other[1:]


def test_a_response_in_plain_python_works_and_explain_says_that_it_is_slower() -> None:
    class Odd(xp.ResponseLaw):
        """Bounces, by a list that no trace follows."""

        id = "test:odd"
        container = "collision:exact"

        def respond(self, contact: xp.Contact) -> float:
            return [0.9, 0.9][int(contact.approach_speed > 1.0)] * contact.approach_speed

    found = []
    for stepper in (LOOP, SERVER):
        engine = xp.PhysicsEngine(stepper=stepper, compile="never")
        law = engine.add_law(Odd())
        balls = [
            xp.PhysicalObject(xp.Sphere(0.1), position=(0.5 * k, 0, 0), velocity=(-0.1 * k * k, 0.01 * k, 0))
            for k in range(8)
        ]
        engine.add_objects(balls, laws=[law])
        engine.run(until=1.5)
        assert law.evaluations > 3
        found.append(states(balls))
        if stepper == LOOP:
            assert "asked in Python, one impact at a time: " in str(engine.explain())
            assert list(engine.explain().data["contacts"]["impact loop"]["in Python"]) == [law.label()]
    assert np.allclose(*found, rtol=0, atol=1e-12)


def test_a_cradle_of_many_balls_comes_out_exactly() -> None:
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic")
    row = [xp.PhysicalObject(xp.Sphere(0.1), position=(0.2 * k, 0, 0)) for k in range(40)]
    first = xp.PhysicalObject(xp.Sphere(0.1), position=(-1, 0, 0), velocity=(1, 0, 0))
    engine.add_objects([*row, first], laws=[bounce])
    engine.run(until=1.5)
    assert served_by(engine) == {"collision:impact"}
    assert [ball.velocity[0] for ball in [first, *row]] == pytest.approx([0.0] * 40 + [1.0], abs=1e-12)


def test_balls_come_to_rest_on_the_floor_and_are_kicked_off_again() -> None:
    found = []
    for stepper in (LOOP, SERVER):
        engine = xp.PhysicsEngine(up="z", stepper=stepper)
        bounce = engine.add_law("collision:elastic", restitution=0.3)
        gravity = engine.add_law("basic:planet_gravity")
        engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce])
        balls = engine.add_objects(
            [
                xp.PhysicalObject(xp.Sphere(0.1), position=(k, 0, 0.3 + 0.1 * k), velocity=(0.01, 0, 0))
                for k in range(36)
            ],
            laws=[gravity, bounce],
        )
        engine.run(until=4.0)
        assert len(engine.explain().data["contacts"]["supports"]) == 36
        for ball in balls[::2]:
            ball.velocity = (0.0, 0.1, 2.0)
        engine.run(until=4.1)
        assert len(engine.explain().data["contacts"]["supports"]) == 18
        engine.run(until=6.0)
        assert len(engine.explain().data["contacts"]["supports"]) == 36
        found.append(states(balls))
    assert np.allclose(*found, rtol=0, atol=1e-10)


def test_a_place_is_crossed_at_the_same_times() -> None:
    class Crossed(xp.PhysicalLaw):
        """Keeps the times."""

        id = "test:crossed"
        condition = xp.when.Crosses("body.position.x")

        def __init__(self) -> None:
            super().__init__()
            self.times: list[float] = []

        def enforce_this_law(self, event: xp.Event) -> None:
            self.times.append(event.time)

    found = []
    for stepper in (LOOP, SERVER):
        engine, balls = gas(stepper, 40)
        crossed = engine.add_law(Crossed())
        for ball in balls[:20]:
            engine.map(ball, crossed)
        engine.run(until=1.5)
        found.append(crossed.times)
    assert found[0] == pytest.approx(found[1], abs=1e-9) and len(found[0]) > 2


def test_what_cannot_meet_for_long_is_left_alone() -> None:
    """Balls far apart cross cells in which nobody is: before something may meet none of that is done, and afterwards nothing is missed."""
    found = []
    for stepper in (LOOP, SERVER):
        engine = xp.PhysicsEngine(up="z", stepper=stepper)
        bounce, gravity = engine.add_law("collision:elastic"), engine.add_law("basic:planet_gravity")
        rng = np.random.default_rng(2)
        speeds = 0.3 * rng.uniform(-1.0, 1.0, (100, 3))
        speeds[:20:2], speeds[1:20:2] = (0.3, 0.0, 0.0), (-0.3, 0.0, 0.0)  # those meet at 16.3 s
        balls = [
            xp.PhysicalObject(xp.Sphere(0.1), position=(10.0 * (k % 10), 10.0 * (k // 10), 0.0), velocity=tuple(v))
            for k, v in enumerate(speeds.tolist())
        ]
        engine.add_objects(balls, laws=[bounce, gravity])
        engine.run(until=0.1)
        if stepper == LOOP:
            loop = next(iter(engine._world.contacts.fleet._states())).made["loop"]
            assert loop.next_time()[0] > 1.0 and loop.crossings == 0
        engine.run(until=20.0)
        found.append((states(balls), engine.explain().data["contacts"]["impacts"]))
    assert found[0][1] == found[1][1] == 10
    assert np.allclose(found[0][0], found[1][0], rtol=0, atol=1e-9)


def in_a_box(count: int, length: float = 6.0, *heard: xp.PhysicalLaw, **more: object) -> xp.PhysicsEngine:
    """``count`` balls of 0.4 m, evenly in a periodic cube, some across its faces."""
    rng = np.random.default_rng(1)
    engine = xp.PhysicsEngine(periodic=(length,) * 3, **more)
    laws = [engine.add_law("collision:elastic"), *(engine.add_law(one) for one in heard)]
    side = int(np.ceil(count ** (1 / 3)))
    places = length / side * np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    balls = [
        xp.PhysicalObject(xp.Sphere(0.2), position=tuple(x), velocity=tuple(rng.normal(size=3)))
        for x in places[:count].tolist()
    ]
    engine.add_objects(balls, laws=laws)
    return engine


def test_in_a_periodic_box_who_listens_is_told_and_nothing_else_changes() -> None:
    heard = Heard()
    engines = in_a_box(125), in_a_box(125, 6.0, heard)
    for engine in engines:
        engine.run(until=1.0)
    impacts = [engine.explain().data["contacts"]["impacts"] for engine in engines]
    assert impacts[0] == impacts[1] == len(heard.told) > 20
    for name in ("position", "velocity"):
        one, two = (np.array(getattr(engine.bodies, name)) for engine in engines)
        assert one == pytest.approx(two, abs=1e-11)


def test_a_listener_added_after_the_first_plan_is_told() -> None:
    engine = in_a_box(125)
    engine.run(until=0.5)
    before = engine.explain().data["contacts"]["impacts"]
    heard = engine.add_law(Heard())
    for obj in engine.objects:
        engine.map(obj, heard)
    engine.run(until=1.0)
    assert len(heard.told) == engine.explain().data["contacts"]["impacts"] - before > 0


@pytest.mark.parametrize("law", ["collision:elastic", "collision:friction", "collision:rough"])
@pytest.mark.parametrize("shift", [0.0, 2.9, 5.9])
def test_three_that_touch_at_once_across_a_face_part_as_they_do_inside(law: str, shift: float) -> None:
    found = []
    for middle in (3.0, 3.0 + shift):
        engine = xp.PhysicsEngine(periodic=(6.0, 6.0, 6.0))
        bounce = engine.add_law(law)
        balls = [
            xp.PhysicalObject(
                xp.Sphere(0.5),
                position=(middle + 1.5 * k, middle, middle),
                velocity=(-float(k), 0, 0),
                angular_velocity=(0, 1 - k, 2 * k),
            )
            for k in (-1, 0, 1)
        ]
        engine.add_objects(balls, laws=[bounce])
        engine.run(until=1.0)
        found.append([[*ball.velocity, *ball.angular_velocity] for ball in balls])
    assert [one[0] for one in found[0]] == pytest.approx([-1.0, 0.0, 1.0], abs=1e-14)
    assert np.array(found[0]) == pytest.approx(np.array(found[1]), abs=1e-13)


def test_a_ball_comes_to_rest_on_the_floor_of_a_periodic_box() -> None:
    engine = xp.PhysicsEngine(up="z", periodic=(1.0, 1.0, None))
    bounce = engine.add_law("collision:elastic", restitution=0.5)
    pull = engine.add_law("basic:planet_gravity", acceleration=10.0)
    engine.add_object(xp.PhysicalObject(xp.Plane((0, 0, 1)), fixed=True), laws=[bounce])
    ball = engine.add_object(
        xp.PhysicalObject(xp.Sphere(0.1), position=(0.5, 0.5, 0.3), velocity=(3.0, 0, 0)), laws=[bounce, pull]
    )
    engine.run(until=2.0)
    assert ball.position[2] == pytest.approx(0.1, abs=1e-15) and ball.velocity == (3.0, 0.0, 0.0)
    assert ball.position[0] == pytest.approx(0.5, abs=1e-12)


def test_what_is_known_pair_by_pair_only_is_refused_in_a_periodic_scene_before_anything_moves() -> None:
    engine = in_a_box(8, stepper=SERVER)
    with pytest.raises(xp.errors.ContactError, match=r"collision:elastic: in a periodic scene .* core:ballistic"):
        engine.run(until=1.0)
    engine = in_a_box(8)
    box = engine.add_object(xp.PhysicalObject(xp.Box((0.1, 0.1, 0.1)), position=(0.5, 0.5, 0.5)))
    engine.map(box, engine.laws[0])
    before = np.array(engine.bodies.position)
    with pytest.raises(xp.errors.ContactError, match="is a box that moves"):
        engine.run(until=1.0)
    assert engine.time == 0.0 and (np.array(engine.bodies.position) == before).all()


@pytest.mark.parametrize("compile", ["never", "always"])
def test_who_interrupts_a_run_can_go_on_as_if_he_had_not(compile: str, monkeypatch: pytest.MonkeyPatch) -> None:
    found, run = [], ImpactLoop.run
    for cut in (False, True):
        engine = in_a_box(125, compile=compile)
        engine.run(until=0.25)
        if cut:

            def interrupted(loop: ImpactLoop, limit: tuple[float, float]) -> object:
                run(loop, (limit[0] - 0.25, limit[1]))
                raise KeyboardInterrupt

            with monkeypatch.context() as patch:
                patch.setattr(ImpactLoop, "run", interrupted)
                with pytest.raises(KeyboardInterrupt):
                    engine.run(until=1.0)
            assert engine.time < 1.0
        engine.run(until=1.0)
        found.append((np.array(engine.bodies.position).tobytes(), engine.explain().data["contacts"]["impacts"]))
    assert found[0] == found[1]
