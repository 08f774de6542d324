"""Time: runs, host steps and their order of accuracy, pauses, resets; same bits however a run is cut."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import StateError

when = xp.when


class Free(xp.PhysicalLaw):
    """Do what the test says."""

    def __init__(self, act: Callable[[Any, Any], None] | None = None, **given: Any) -> None:
        super().__init__(**given)
        self.act = act

    def enforce_this_law(self, event: Any) -> None:
        if self.act is not None:
            self.act(self, event)


def spring_by_force(law: Any, event: Any) -> None:
    """Store the force of a spring of 1 N/m on each object."""
    for obj in law.objects:
        obj.add_force([-c for c in obj.position])


def spring_by_velocity(law: Any, event: Any) -> None:
    """Set the velocity that a spring of 1 N/m gives over a step."""
    for obj in law.objects:
        obj.velocity = [v - event.dt * x for v, x in zip(obj.velocity, obj.position, strict=True)]


def oscillator(act: Callable[[Any, Any], None], n: int, condition: Any, until: float = 4.0) -> float:
    """Return the error at ``until`` of a unit oscillator in ``n`` steps."""
    engine = xp.PhysicsEngine()
    law = engine.add_law(Free(act), container=xp.LawContainer(condition))
    body = engine.add_object(xp.PhysicalObject(position=(1, 0, 0), velocity=(0, 1, 0)), laws=[law])
    engine.run(until=until, dt=until / n)
    c, s = math.cos(until), math.sin(until)
    return max(
        math.dist(body.position, (c, s, 0)),
        math.dist(body.velocity, (-s, c, 0)) if act is spring_by_force else 0.0,
    )


@pytest.mark.parametrize(
    ("act", "condition", "order"),
    [
        (spring_by_force, when.Steps(), 2.0),
        (spring_by_velocity, when.Steps(), 1.0),
        (spring_by_velocity, when.Steps(at="middle"), 2.0),
    ],
    ids=["force", "velocity at the start", "velocity in the middle"],
)
def test_free_form_laws_converge_with_the_order_they_promise(act: Any, condition: Any, order: float) -> None:
    errors = [oscillator(act, n, condition) for n in (40, 80, 160, 320)]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders == pytest.approx(order, abs=0.15)


def test_a_force_that_is_not_stored_again_is_withdrawn() -> None:
    def act(law: Any, event: Any) -> None:
        if event.time < 0.5:
            for obj in law.objects:
                obj.add_force((1, 0, 0))

    engine = xp.PhysicsEngine()
    law = engine.add_law(Free(act), container=xp.LawContainer(when.Steps()))
    body = engine.add_object(xp.PhysicalObject(), laws=[law])
    body.add_force((0, 1, 0), id="user")
    engine.run(until=1.0, dt=0.25)
    assert body.velocity == (0.5, 1.0, 0.0)
    assert [force.id for force in body.forces] == ["user"]


def test_a_force_stored_each_step_is_one_force() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law(Free(spring_by_force), container=xp.LawContainer(when.Steps()))
    body = engine.add_object(xp.PhysicalObject(position=(1, 0, 0)), laws=[law])
    engine.run(until=1.0, dt=0.1)
    assert len(body.forces) == 1
    engine.unmap(body, law)
    assert body.forces == ()
    engine.map(body, law)
    engine.run(until=1.5, dt=0.1)
    law.enabled = False
    assert body.forces == ()


def test_a_law_written_for_batches_works_at_host_steps_too() -> None:
    class Spring(xp.FieldLaw):
        stiffness = xp.Constant(1.0, unit="N/m")

        def force(self, body: Any) -> Any:
            return -self.stiffness * body.position

    def error(n: int) -> float:
        engine = xp.PhysicsEngine()
        law = engine.add_law(Spring(), container=xp.LawContainer(when.Steps()))
        body = engine.add_object(xp.PhysicalObject(position=(1, 0, 0)), laws=[law])
        engine.run(until=4.0, dt=4.0 / n)
        assert law.evaluations == n
        return abs(body.position[0] - math.cos(4.0))

    assert math.log2(error(100) / error(200)) == pytest.approx(2.0, abs=0.15)


def test_step_is_the_next_point_of_the_grid_of_run() -> None:
    def make() -> tuple[xp.PhysicsEngine, Any, list[float]]:
        seen: list[float] = []

        def act(law: Any, event: Any) -> None:
            seen.append(event.time)
            spring_by_force(law, event)

        engine = xp.PhysicsEngine()
        law = engine.add_law(Free(act), container=xp.LawContainer(when.Steps()))
        return engine, engine.add_object(xp.PhysicalObject(position=(1, 0, 0)), laws=[law]), seen

    by_run, by_step, mixed, looked = make(), make(), make(), make()
    by_run[0].run(until=12.5, dt=0.125)
    for _ in range(100):
        by_step[0].step(0.125)
    mixed[0].run(until=3.14, dt=0.125)
    mixed[0].step(0.125)
    assert mixed[0].time == 3.25
    mixed[0].run(until=12.5, dt=0.125)
    for k in range(1, 1000):
        looked[0].run(until=0.01 * k, dt=0.125)
    looked[0].run(until=12.5, dt=0.125)
    for engine, body, seen in (by_step, mixed, looked):
        assert engine.time == by_run[0].time == 12.5
        assert (body.position, body.velocity, seen) == (by_run[1].position, by_run[1].velocity, by_run[2])
    assert len(by_run[2]) == 100


def test_steps_without_listeners_keep_the_grid() -> None:
    engine = xp.PhysicsEngine()
    for k in range(1, 50):
        engine.step(0.1)
        assert engine.time == pytest.approx(0.1 * k, abs=1e-14)
    engine.run(until=5.25, dt=0.1)
    engine.step(0.1)
    assert engine.time == pytest.approx(5.3, abs=1e-15)


def full_scene() -> xp.PhysicsEngine:
    """Return a scene with everything: steps of a tolerance, bounces, timers, forces that end."""
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity")
    bounce = engine.add_law("collision:elastic", restitution=0.9)
    drag = engine.add_law("basic:linear_drag", name="drag")
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce])
    for k in range(3):
        engine.add_object(
            xp.PhysicalObject(xp.Sphere(0.1), position=(0.15 * k, 0.05 * k, 1 + k), angular_velocity=(0.1, k, 1)),
            laws=[gravity, bounce],
        )
    engine.add_object(xp.PhysicalObject(position=(9, 9, 9), velocity=(5, 0, 5)), laws=[gravity, drag])
    kicked = engine.add_object(
        xp.PhysicalObject(inertia=(1, 2, 3), angular_velocity=(1e-4, 2, 1e-4), position=(-5, 0, 0))
    )
    kicked.add_force((1, 2, 3), 0.7)
    law = engine.add_law(
        Free(lambda law, event: [setattr(obj, "velocity", [1.01 * v for v in obj.velocity]) for obj in law.objects]),
        container=xp.LawContainer(when.Elapsed(0.3, every=True)),
    )
    engine.map(kicked, law)
    return engine


def bits(engine: xp.PhysicsEngine) -> list[Any]:
    """Return all states."""
    return [(obj.position, obj.velocity, obj.orientation, obj.angular_velocity, obj.forces) for obj in engine.objects]


@pytest.mark.parametrize("dt", [None, 0.01], ids=["tolerance", "steps"])
def test_the_same_bits_however_a_run_is_cut_recorded_and_looked_at(dt: float | None) -> None:
    whole, cut, looked = full_scene(), full_scene(), full_scene()
    whole.run(until=2.0, dt=dt)
    for until in (0.0, 0.1, 0.3, 0.30000001, 0.7, 1.2345, 2.0):
        cut.run(until=until, dt=dt)
    record = looked.run(until=2.0, dt=dt, every=0.013)
    assert bits(cut) == bits(whole) and bits(looked) == bits(whole)
    assert record is not None and whole.time == cut.time == looked.time == 2.0


@pytest.mark.parametrize("dt", [None, 0.01], ids=["tolerance", "steps"])
def test_looking_changes_nothing(dt: float | None) -> None:
    engine, blind = full_scene(), full_scene()
    looks: list[Callable[[], Any]] = [
        engine.explain, lambda: str(engine.explain()), engine.energy, engine.momentum, engine.angular_momentum,
        lambda: engine.bodies.position, lambda: engine.bodies.orientation, lambda: engine.bodies.velocity,
        lambda: engine.bodies["mass"], engine.frame, engine.object_table, engine.copy, engine.checkpoint, lambda: repr(engine),
        lambda: [(obj.forces, obj.laws, repr(obj), obj.mass) for obj in engine.objects],
        lambda: [(law.objects, repr(law)) for law in engine.laws],
    ]  # fmt: skip
    for until in (0.5, 1.0, 1.5):
        for look in looks:
            before = engine.checkpoint()
            look()
            look()
            assert engine.checkpoint() == before
        engine.run(until=until, dt=dt)
        blind.run(until=until, dt=dt)
        assert bits(engine) == bits(blind)
    assert engine.checkpoint() == blind.checkpoint()


def test_a_copy_goes_its_own_way_to_the_same_end() -> None:
    engine = full_scene()
    engine.run(until=0.8)
    law = engine.laws[-1]
    engine.remove_law(law)  # of no pack
    twin = engine.copy()
    assert bits(twin) == bits(engine) and twin.time == engine.time
    twin.run(until=2.0)
    assert engine.time == 0.8 and bits(twin) != bits(engine)
    engine.run(until=2.0)
    assert bits(twin) == bits(engine)
    twin.objects[1].velocity = (0, 0, 0)
    assert engine.objects[1].velocity != (0, 0, 0)


# Suspend, resume, terminate, reset

TABLE: dict[str, dict[str, str]] = {
    "ready": {
        "run": "ready",
        "step": "ready",
        "suspend": "suspended",
        "resume": "!",
        "terminate": "terminated",
        "reset": "ready",
    },
    "suspended": {
        "run": "!",
        "step": "!",
        "suspend": "!",
        "resume": "ready",
        "terminate": "terminated",
        "reset": "ready",
    },
    "terminated": {"run": "!", "step": "!", "suspend": "!", "resume": "!", "terminate": "terminated", "reset": "ready"},
}


@pytest.mark.parametrize("call", ["run", "step", "suspend", "resume", "terminate", "reset"])
@pytest.mark.parametrize("state", TABLE)
@pytest.mark.parametrize("started", [False, True], ids=["before the first run", "after"])
def test_every_move_from_every_state(state: str, call: str, started: bool) -> None:
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))
    if started:
        engine.run(until=1.0)
    {"ready": lambda: None, "suspended": engine.suspend, "terminated": engine.terminate}[state]()
    assert engine.state == state
    act = {"run": lambda: engine.run(until=2.0), "step": lambda: engine.step(0.5)}.get(
        call, getattr(engine, call, None)
    )
    assert act is not None
    expected = TABLE[state][call]
    if expected == "!":
        time = engine.time
        with pytest.raises(StateError):
            act()
        assert engine.state == state and engine.time == time
    else:
        act()
        assert engine.state == expected
    assert body.position == (engine.time, 0, 0)


@pytest.mark.parametrize("call", ["suspend", "terminate"])
def test_a_handler_that_stops_the_engine_stops_it_after_the_instant(call: str) -> None:
    engine = xp.PhysicsEngine()
    told: list[str] = []
    holder = xp.LawContainer(when.Elapsed(1.0))
    engine.add_law(Free(lambda law, event: (getattr(engine, call)(), told.append("first")), name="a"), container=holder)
    engine.add_law(Free(lambda law, event: told.append("second"), name="b"), container=holder)
    engine.add_law(
        Free(lambda law, event: told.append("third"), name="c"), container=xp.LawContainer(when.Elapsed(1.0))
    )
    body = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))
    engine.run(until=5.0)
    assert engine.time == 1.0 and body.position == (1, 0, 0)
    assert engine.state == {"suspend": "suspended", "terminate": "terminated"}[call]
    assert sorted(told) == ["first", "second", "third"]
    if call == "suspend":
        engine.resume()
        engine.run(until=5.0)
        assert body.position == (5, 0, 0) and len(told) == 3


def test_a_pause_changes_nothing() -> None:
    paused, whole = full_scene(), full_scene()
    for k in range(1, 11):
        paused.run(until=0.2 * k)
        paused.suspend()
        paused.resume()
    whole.run(until=2.0)
    assert bits(paused) == bits(whole)


def test_reset_restores_what_was_authored() -> None:
    engine = full_scene()
    authored = bits(engine)
    parameters = [dict(law.parameters) for law in engine.laws]
    engine.run(until=1.0)
    first = bits(engine)
    late = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))
    extra = engine.add_law("basic:quadratic_drag", name="extra")
    gone = engine.remove_object(engine.objects[0])
    engine.law("drag").enabled = False
    engine.laws[0].acceleration = 1.0  # type: ignore[attr-defined]
    late.add_force((1, 0, 0))
    engine.run(until=1.5)
    engine.reset()
    assert engine.time == 0.0 and engine.state == "ready"
    assert sorted(repr(one[:4]) for one in bits(engine)) == sorted(repr(one[:4]) for one in authored)
    assert [engine.user_forces(obj) for obj in engine.objects if engine.user_forces(obj)] == [
        (xp.Force((1, 2, 3), 0.7, 1),)
    ]
    assert late.engine is None and late.position == (0.625, 0, 0)
    assert extra.engine is None and gone.engine is engine
    assert [dict(law.parameters) for law in engine.laws] == parameters and engine.law("drag").enabled
    engine.run(until=1.0)
    assert sorted(map(repr, bits(engine))) == sorted(map(repr, first))
    engine.reset()
    engine.reset()
    assert engine.time == 0.0


def test_force_ids_repeat_from_run_to_run() -> None:
    def ids() -> list[Any]:
        engine = xp.PhysicsEngine()
        body = engine.add_object(xp.PhysicalObject())
        return [body.add_force((1, 0, 0)).id, body.add_force((1, 0, 0), 1.0).id, engine.new_force_id()]

    assert ids() == ids() == [1, 2, 3]
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject())
    engine.run(until=0.5)
    first = body.add_force((1, 0, 0), 0.1).id
    engine.reset()
    assert body.add_force((1, 0, 0), 0.1).id == first


def test_time_may_be_cut_finely_late_in_a_run() -> None:
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))
    engine.run(until=1e6)
    engine.run(until=math.nextafter(1e6, math.inf))
    assert body.position[0] == math.nextafter(1e6, math.inf)


def test_an_empty_engine_runs() -> None:
    engine = xp.PhysicsEngine()
    assert engine.run(until=1.0) is None
    record = engine.run(until=2.0, every=0.5)
    assert record is not None and engine.time == 2.0
    assert engine.energy().total == 0.0 and engine.momentum() == (0, 0, 0)


def test_a_progress_that_raises_leaves_the_engine_ready() -> None:
    engine = xp.PhysicsEngine()
    engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))

    def fail(time: float) -> None:
        if time >= 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        engine.run(until=1.0, every=0.25, progress=fail)
    assert engine.state == "ready" and engine.time == 0.5
    engine.run(until=1.0)
    assert engine.objects[0].position == (1, 0, 0)


def test_no_warning_in_a_run_of_everything() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        engine = full_scene()
        engine.run(until=1.0)
    assert engine.time == 1.0
