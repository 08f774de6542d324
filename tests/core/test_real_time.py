"""Real time: frames on a thread, reads and writes of other threads, replay, failures, and an end that does not hang."""

from __future__ import annotations

import contextlib
import gc
import json
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import xpheve as xp
from xpheve.errors import (
    ConflictError,
    InvalidValueError,
    LawFailedError,
    OwnershipError,
    RecordError,
    StateError,
    UnitError,
)
from xpheve.realtime import Inputs, Snapshot


class System:
    """A time of the system that the test sets; frames come when the test says that the host showed one."""

    def __init__(self, now: float = 10.0) -> None:
        self.now = now

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def engines() -> Iterator[list[xp.PhysicsEngine]]:
    """Engines to be ended when the test is over."""
    made: list[xp.PhysicsEngine] = []
    yield made
    for engine in made:
        with contextlib.suppress(xp.errors.XpheveError, KeyError):
            engine.terminate()
        engine._trouble.clear()


@pytest.fixture
def engine(engines: list[xp.PhysicsEngine]) -> xp.PhysicsEngine:
    """A ball that falls, and one that drifts."""
    made = xp.PhysicsEngine(up="z", seed=3)
    gravity = made.add_law("basic:planet_gravity", acceleration=10.0, name="gravity")
    made.add_object(xp.PhysicalObject(xp.Sphere(0.1), velocity=(1, 0, 0), name="falls"), laws=[gravity])
    made.add_object(xp.PhysicalObject(xp.Sphere(0.1), velocity=(0, 2, 0), position=(5, 0, 0), name="drifts"))
    engines.append(made)
    return made


def frame(engine: xp.PhysicsEngine, system: System, now: float) -> Snapshot:
    """The frame at the system's time ``now``."""
    before = engine.snapshot
    system.now = now
    engine.frame_passed()
    found = engine.next_frame(after=before, timeout=10)
    assert found is not None
    return found


# Time


def test_start_goes_on_from_the_present_time_and_hits_the_stop_time_exactly(engine: xp.PhysicsEngine) -> None:
    engine.run(until=1.0)
    engine.start(speed=5.0, until=1.7)
    assert engine.wait(timeout=10)
    assert engine.time == 1.7 and engine.state == "suspended"
    assert engine.object("drifts").position == (5, 3.4, 0)
    engine.resume()
    assert engine.wait(until=1.8, timeout=10)
    engine.terminate()
    assert engine.time >= 1.8 and engine.state == "terminated"


def test_wait_gives_up_after_its_timeout(engine: xp.PhysicsEngine) -> None:
    engine.start()
    begin = time.monotonic()
    assert not engine.wait(until=1e6, timeout=0.05)
    assert not engine.wait(timeout=0.05)
    assert time.monotonic() - begin < 5
    engine.terminate()
    assert engine.wait() and not engine.wait(until=1e6)


def test_the_stop_time_may_be_set_while_it_runs(engine: xp.PhysicsEngine) -> None:
    engine.start(speed=4.0)
    assert engine.stop_time is None
    goal = round(engine.time + 1.0, 1)
    engine.stop_time = goal
    assert engine.wait(timeout=10) and engine.time == goal == engine.stop_time
    with pytest.raises(InvalidValueError, match="lies before"):
        engine.stop_time = 0.0


def test_a_handler_may_set_the_stop_time(engine: xp.PhysicsEngine) -> None:
    class Stop(xp.PhysicalLaw):
        def enforce_this_law(self, event: Any) -> None:
            engine.stop_time = 0.25

    engine.add_law(Stop(), container=xp.LawContainer(xp.when.Elapsed(0.1)))
    engine.start(speed=0.5)
    assert engine.wait(timeout=10) and engine.time == 0.25


def test_frames_of_the_host_decide_when_time_passes(engine: xp.PhysicsEngine) -> None:
    system = System(10.0)
    engine.start(frames=2, source=system)
    before = engine.snapshot
    system.now = 10.5
    engine.frame_passed()
    assert engine.next_frame(after=before, timeout=0.1) is None and engine.time == 0.0
    engine.frame_passed()
    found = engine.next_frame(after=before, timeout=10)
    assert found is not None and found.time == 0.5
    assert found.of(engine.object("falls"), "velocity") == (1, 0, -5)


def test_frames_change_the_motion_by_no_bit(engine: xp.PhysicsEngine) -> None:
    drag = engine.add_law("basic:quadratic_drag", density=1.0)
    engine.object("falls")["drag_area"] = 0.02
    engine.map(engine.object("falls"), drag)
    plain = engine.copy()
    system = System(0.0)
    engine.start(frames=1, source=system)
    for now in (0.1, 0.11, 1 / 3, 0.5, 0.9, 1.25):
        frame(engine, system, now)
    engine.terminate()
    plain.run(until=1.25)
    assert plain.checkpoint() == engine.checkpoint()


def test_with_dt_host_steps_are_on_the_engines_own_grid(engine: xp.PhysicsEngine) -> None:
    class Count(xp.PhysicalLaw):
        initial_state = {"times": []}  # noqa: RUF012

        def enforce_this_law(self, event: Any) -> None:
            self.state["times"].append(event.time)

    law = engine.add_law(Count(), container=xp.LawContainer(xp.when.Steps()))
    with pytest.raises(StateError, match="host steps"):
        engine.start()
    system = System(0.0)
    engine.start(dt=0.125, frames=1, source=system)
    for now in (0.3, 0.31, 0.7):
        frame(engine, system, now)
    engine.terminate()
    assert law.state["times"] == [0.0625 + 0.125 * k for k in range(6)]


@pytest.mark.parametrize(
    "given",
    [
        {"speed": 0},
        {"updates": -1},
        {"updates": None},
        {"dt": 0},
        {"frames": 0},
        {"frames": 1.5},
        {"until": -1.0},
        {"on_frame": 3},
        {"dt": 1, "rtol": 1e-3},
    ],
)
def test_a_start_that_makes_no_sense_is_refused(engine: xp.PhysicsEngine, given: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=next(iter(given))):
        engine.start(**given)
    assert engine.state == "ready"
    engine.run(until=1.0)


# Reads


def test_everything_read_elsewhere_is_of_one_instant(engine: xp.PhysicsEngine) -> None:
    engine.start(updates=200, speed=0.1)
    falls = engine.object("falls")
    shot = engine.snapshot
    for _ in range(30):
        found = engine.next_frame(after=shot, timeout=10)
        assert found is not None and found.time > shot.time
        shot = found
        row = shot.rows[falls]
        assert shot.position[row, 0] == shot.time and shot.velocity[row, 2] == pytest.approx(-10 * shot.time, rel=1e-12)
        bodies = engine.bodies
        assert len(bodies) == 2 and bodies.mass.tolist() == [1, 1] and bodies.fixed.tolist() == [False, False]
        assert falls.position[2] <= shot.position[row, 2]  # as old as the snapshot, or newer
    with pytest.raises(ValueError, match="read-only"):
        shot.position[0, 0] = 1.0
    with pytest.raises(AttributeError):
        shot.time = 3.0  # type: ignore[misc]
    with pytest.raises(InvalidValueError, match="no column"):
        shot["nothing"]
    with pytest.raises(OwnershipError, match="not in the snapshot"):
        shot.of(xp.PhysicalObject(), "position")


def test_a_view_taken_before_the_start_shows_snapshots_too(engine: xp.PhysicsEngine) -> None:
    view = engine.bodies
    system = System()
    engine.start(frames=1, source=system)
    shot = frame(engine, system, 10.5)
    assert view.position is shot.position and view["mass"] is shot.mass and len(view) == 2


def test_looks_at_the_whole_scene_wait_for_the_end_of_the_frame(engine: xp.PhysicsEngine, tmp_path: Path) -> None:
    engine.start()
    assert engine.wait(until=0.05, timeout=10)
    energy = engine.energy()
    assert energy.balance == pytest.approx(2.5, rel=1e-12)
    assert engine.momentum()[1] == 2.0
    data = engine.explain().data
    assert data["real_time"]["speed"] == 1.0 and "real time: " in str(engine.explain())
    copy = engine.copy()
    assert copy.state == "ready" and 0.05 <= copy.time <= engine.time
    again = xp.PhysicsEngine.restore(engine.checkpoint())
    assert again.time >= copy.time
    engine.save_scene(tmp_path / "scene.toml")
    assert engine.object("falls").forces[0].vector == (0, 0, -10)
    assert engine.object("falls").laws == (engine.law("gravity"),)
    assert engine.frame().time <= engine.time


def test_callbacks_get_each_frame(engine: xp.PhysicsEngine) -> None:
    seen: list[Snapshot] = []
    engine.start(on_frame=seen.append, until=0.1)
    assert engine.wait(timeout=10)
    engine.terminate()
    assert [one.number for one in seen] == sorted({one.number for one in seen}) and any(one.time == 0.1 for one in seen)


def test_a_callback_may_write(engine: xp.PhysicsEngine) -> None:
    added: list[xp.PhysicalObject] = []

    def write(shot: Snapshot) -> None:
        engine.object("drifts").add_force((1, 0, 0), 0.01)
        if not added:
            added.append(engine.add_object(xp.PhysicalObject(name="new")))

    first = engine.copy()
    engine.start(on_frame=write)
    assert engine.wait(until=0.2, timeout=10)
    engine.terminate()
    first.replay(engine.inputs)
    assert first.checkpoint() == engine.checkpoint() and first.object("new").serial == added[0].serial


# Writes


def test_writes_are_done_at_the_next_frame(engine: xp.PhysicsEngine) -> None:
    system = System()
    engine.start(frames=1, source=system)
    drifts = engine.object("drifts")
    drifts.velocity = (0, 0, 1)
    force = drifts.add_force((1, 0, 0), 0.5)
    assert force.id == "input-1" and drifts.velocity == (0, 2, 0)
    engine.law("gravity").acceleration = 1.0
    drifts["colour"] = 0.5
    shot = frame(engine, system, 11.0)
    assert drifts.velocity == (0, 0, 1) and drifts.position == (5, 2, 0) and shot.time == 1.0
    assert drifts["colour"] == 0.5 and engine.law("gravity").acceleration == 1.0
    frame(engine, system, 12.0)
    assert drifts.velocity == (0.5, 0, 1) and drifts.forces == ()
    assert [one.door for one in engine.inputs] == ["write_object", "add_force", "set_parameter", "write_column"]
    assert {one.instant for one in engine.inputs} == {(1.0, 0.0)}


def test_what_changes_the_structure_is_done_at_once(engine: xp.PhysicsEngine) -> None:
    engine.start()
    gravity = engine.law("gravity")
    ball = engine.add_object(xp.PhysicalObject(name="new"), laws=[gravity])
    assert ball.serial == 2 and ball in engine.objects and ball.laws == (gravity,)
    engine.unmap(ball, gravity)
    assert ball.laws == ()
    engine.map(ball, "gravity")
    force = ball.add_force((0, 0, 10))
    assert ball.remove_force(force.id) == 1
    law = engine.add_law("basic:linear_drag", coefficient=0.1)
    engine.map(ball, law)
    law.enabled = False
    assert not law.enabled
    engine.remove_law(law)
    assert law not in engine.laws
    engine.remove_object(ball)
    assert ball not in engine.objects and ball.engine is None


def test_bad_values_raise_in_the_caller_before_anything_is_queued(engine: xp.PhysicsEngine) -> None:
    engine.start()
    drifts = engine.object("drifts")
    stranger = xp.PhysicalObject()
    with pytest.raises(InvalidValueError, match="velocity"):
        drifts.velocity = (1, 2)
    with pytest.raises(InvalidValueError, match="Force"):
        drifts.add_force((float("nan"), 0, 0))
    with pytest.raises(UnitError, match="acceleration"):
        engine.law("gravity").acceleration = "3 kg"
    with pytest.raises(OwnershipError, match="not in this engine"):
        engine.map(stranger, "gravity")
    with pytest.raises(InvalidValueError, match="already"):
        engine.add_object(xp.PhysicalObject(name="falls"))
    with pytest.raises(InvalidValueError, match="plain values"):
        engine.post("here", object())
    engine.add_law("collision:elastic", name="one")
    engine.map(drifts, "one")
    engine.add_law("collision:elastic", name="two")
    with pytest.raises(ConflictError):
        engine.map(drifts, "two")
    engine.terminate()
    assert [one.door for one in engine.inputs] == ["add_law", "map", "add_law"]


def test_what_only_shows_later_surfaces_in_the_next_call_and_names_the_write(engine: xp.PhysicsEngine) -> None:
    system = System()
    engine.start(frames=1, source=system)
    drifts = engine.object("drifts")
    drifts.add_force((1e308, 0, 0))
    drifts.add_force((1e308, 0, 0))
    before = engine.snapshot
    engine.frame_passed()
    with pytest.raises(InvalidValueError, match=r"add_force\(.*done at t = 0.0 s: .*beyond what a float can hold"):
        while True:
            engine.next_frame(after=before, timeout=10)
            drifts.velocity = (0, 0, 0)
    assert engine.state == "running"  # the write is lost, and it was said; the rest goes on


def test_looking_without_end_keeps_no_frame_out(engine: xp.PhysicsEngine) -> None:
    engine.start()
    over = threading.Event()

    def look() -> None:
        while not over.is_set():
            engine.momentum()

    threads = [threading.Thread(target=look) for _ in range(3)]
    for thread in threads:
        thread.start()
    assert engine.wait(until=0.3, timeout=20)
    over.set()
    for thread in threads:
        thread.join(10)
        assert not thread.is_alive()


def test_a_crowd_of_writes_is_done_and_none_is_lost(engine: xp.PhysicsEngine) -> None:
    engine.start(frames=1, source=System())  # no frame comes, so that the queue fills up
    drifts = engine.object("drifts")
    for k in range(10_500):
        drifts.velocity = (k, 0, 0)
    engine.terminate()
    assert drifts.velocity == (10_499, 0, 0) and len(engine.inputs) == 10_500


def test_writes_while_it_is_suspended_show_at_once(engine: xp.PhysicsEngine) -> None:
    engine.start()
    engine.suspend()
    shot, drifts = engine.snapshot, engine.object("drifts")
    drifts.position = (7, 7, 7)
    found = engine.next_frame(after=shot, timeout=10) if drifts.position != (7, 7, 7) else engine.snapshot
    assert found is not None and found.time == shot.time and drifts.position == (7, 7, 7)


# Inputs and replay


def test_a_replay_in_another_process_ends_in_the_same_bits(engine: xp.PhysicsEngine, tmp_path: Path) -> None:
    bounce = engine.add_law("collision:elastic", name="bounce")
    for obj in engine.objects:
        engine.map(obj, bounce)
    engine.add_object(xp.PhysicalObject(xp.Plane(), position=(0, 0, -0.3), fixed=True), laws=[bounce])
    engine.checkpoint(tmp_path / "first.xpc")
    engine.start(speed=2.0, updates=100)
    shot = engine.snapshot
    for k in range(30):
        shot = engine.next_frame(after=shot, timeout=10) or shot
        engine.object("drifts").add_force((0.1 * k, 0.3, -1), 0.05)
        if k == 5:
            engine.add_object(
                xp.PhysicalObject(xp.Sphere(0.05), position=(-3, 0, 1), name="late"), laws=engine.object("falls").laws
            )
        if k == 10:
            engine.suspend()
            engine.object("late").velocity = (0, 0, -3)
            engine.resume()
        if k == 15:
            engine.add_law("basic:linear_drag", coefficient="0.1 kg/s", name="drag")
            engine.map(engine.object("late"), "drag")
        if k == 20:
            engine.law("drag").enabled = False
            engine.remove_object(engine.object("falls"))
        if k == 25:
            engine.post("now", {"a": (1, 2.5)})
    engine.terminate()
    engine.inputs.save(tmp_path / "inputs.json")
    assert Inputs.load(tmp_path / "inputs.json") == engine.inputs
    json.loads((tmp_path / "inputs.json").read_text())
    code = (
        "import sys, xpheve as xp; from xpheve.realtime import Inputs\n"
        "engine = xp.PhysicsEngine.restore(sys.argv[1] + '/first.xpc')\n"
        "engine.replay(Inputs.load(sys.argv[1] + '/inputs.json'))\n"
        "engine.checkpoint(sys.argv[1] + '/last.xpc')\n"
    )
    subprocess.run([sys.executable, "-W", "error", "-c", code, str(tmp_path)], check=True, timeout=60)
    assert (tmp_path / "last.xpc").read_bytes() == engine.checkpoint()


def test_a_replay_goes_through_what_handlers_suspended(engine: xp.PhysicsEngine) -> None:
    class Stop(xp.PhysicalLaw):
        def enforce_this_law(self, event: Any) -> None:
            self.engine.suspend()  # type: ignore[union-attr]

    engine.add_law(Stop(), container=xp.LawContainer(xp.when.Elapsed(0.05, every=True)))
    first = engine.copy()
    engine.start(speed=2.0)
    for k in range(3):
        assert engine.wait(timeout=10)
        engine.object("drifts").velocity = (k, 0, 0)
        engine.resume()
    assert engine.wait(timeout=10)
    engine.terminate()
    first.replay(engine.inputs)
    assert first.checkpoint() == engine.checkpoint() and first.time == 0.2


def test_a_replay_may_stop_earlier_and_is_refused_elsewhere(engine: xp.PhysicsEngine) -> None:
    first, system = engine.copy(), System()
    engine.start(frames=1, source=system)
    engine.object("drifts").velocity = (0, 0, 1)
    frame(engine, system, 11.0)
    engine.object("drifts").velocity = (0, 0, 2)
    frame(engine, system, 12.0)
    inputs = engine.inputs
    first.replay(inputs, until=1.5)
    assert first.time == 1.5 and first.object("drifts").velocity == (0, 0, 1)
    with pytest.raises(StateError, match="begin at t = 0"):
        first.replay(inputs)
    other = xp.PhysicsEngine()
    with pytest.raises(RecordError, match="object #1"):
        other.replay(inputs)
    for text in ("", "[]", '{"format": "other"}', '{"format": "xpheve inputs", "version": 2}', inputs.to_json()[:-20]):
        with pytest.raises(RecordError):
            Inputs.from_json(text)


def test_containers_and_laws_of_no_pack_are_replayed_too(engine: xp.PhysicsEngine) -> None:
    first, system = engine.copy(), System()
    engine.start(frames=1, source=system)
    law = engine.add_law(Push(), container=xp.LawContainer(xp.when.Elapsed(0.25, every=True), name="now and then"))
    engine.map(engine.object("falls"), law)
    other = engine.add_law(Push, container=engine.containers[0], name="other")
    engine.containers[0].remove_law(other)
    engine.containers[0].add_law(other)
    frame(engine, system, 11.0)
    engine.terminate()
    assert law.evaluations == other.evaluations == 4
    with pytest.raises(xp.errors.UnknownLawError, match=r"classes=\[Push\]"):
        first.copy().replay(engine.inputs)
    first.replay(engine.inputs, classes=(Push,))
    assert first.checkpoint() == engine.checkpoint()


def test_the_log_may_be_left_out(engine: xp.PhysicsEngine) -> None:
    with pytest.raises(StateError, match="not started"):
        _ = engine.inputs
    engine.start(keep_inputs=False)
    engine.object("drifts").velocity = (0, 0, 1)
    with pytest.raises(StateError, match="keep_inputs"):
        _ = engine.inputs


# Failures


class Breaks(xp.PhysicalLaw):
    """Fail until it is mended."""

    broken = xp.Param(True, doc="Whether it fails.")

    def enforce_this_law(self, event: Any) -> None:
        """Fail."""
        if self.broken:
            raise ValueError("on purpose")


def test_a_failure_stops_just_before_its_event_and_surfaces_once(engine: xp.PhysicsEngine) -> None:
    law = engine.add_law(Breaks(), container=xp.LawContainer(xp.when.Elapsed(0.05)))
    first = engine.copy()
    engine.start()
    with pytest.raises(LawFailedError, match="on purpose"):
        engine.wait(timeout=10)
    assert engine.state == "failed" and engine.time == 0.05 and engine.object("drifts").position == (5, 0.1, 0)
    with pytest.raises(LawFailedError, match="on purpose"):
        engine.wait()  # as long as it stands so
    with pytest.raises(StateError, match="event that failed"):
        engine.suspend() if not engine._trouble else engine._surface()
    law.broken = False
    engine.resume()
    assert engine.wait(until=0.1, timeout=10)
    assert law.evaluations == 1
    engine.terminate()
    first.replay(engine.inputs, classes=(Breaks,))
    assert first.checkpoint() == engine.checkpoint()


class Varies(xp.PhysicalLaw):
    """Fail in one way or another."""

    how = xp.Param("value", choices=("value", "key"), doc="Which error it raises.")

    def enforce_this_law(self, event: Any) -> None:
        """Fail."""
        raise ValueError("a value") if self.how == "value" else KeyError("a key")


@pytest.mark.parametrize(
    ("how", "after", "told"), [("value", 0.05, True), ("key", 0.05, False), ("value", 0.04, False)]
)
def test_a_replay_passes_over_the_failure_that_was_logged_and_over_no_other(how: str, after: float, told: bool) -> None:
    def scene(how: str, after: float) -> xp.PhysicsEngine:
        made = xp.PhysicsEngine()
        made.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))
        made.add_law(Varies(how=how), container=xp.LawContainer(xp.when.Elapsed(after)))
        return made

    engine = scene("value", 0.05)
    engine.start()
    with pytest.raises(LawFailedError, match="a value"):
        engine.wait(timeout=10)
    engine.terminate()
    inputs = Inputs.from_json(engine.inputs.to_json())
    again = scene(how, after)
    if told:
        again.replay(inputs, classes=(Varies,))
        assert again.time == engine.time == 0.05
    else:
        with pytest.raises(LawFailedError, match="a key" if how == "key" else "0.04"):
            again.replay(inputs, classes=(Varies,))


def test_a_failure_in_a_callback_surfaces_too(engine: xp.PhysicsEngine) -> None:
    def fail(shot: Snapshot) -> None:
        raise KeyError("in the callback")

    engine.start(on_frame=fail)
    with pytest.raises(KeyError, match="in the callback"):
        engine.wait(timeout=10)
    assert engine.state == "failed"


def test_ending_an_engine_that_failed_tells_what_failed(engine: xp.PhysicsEngine) -> None:
    engine.add_law(Breaks(), container=xp.LawContainer(xp.when.Elapsed(0.01)))
    engine.start()
    while engine.state != "failed":
        time.sleep(0.001)
    with pytest.raises(LawFailedError, match="on purpose"):
        engine.terminate()
    assert engine.state == "terminated"
    engine.reset()
    assert engine.time == 0.0 and engine.state == "ready"


# Load and rest


def moving(count: int) -> xp.PhysicsEngine:
    """A scene whose laws keep the machine busy."""
    made = xp.PhysicsEngine()
    pull = made.add_law("basic:universal_gravity", gravitational_constant=1.0, softening=0.1)
    made.add_objects([xp.PhysicalObject(position=(k % 7, k // 7, 0.1 * k)) for k in range(count)], laws=[pull])
    return made


def test_a_machine_that_cannot_keep_up_drops_no_time_and_hears_commands(engines: list[xp.PhysicsEngine]) -> None:
    engine = moving(40)
    engines.append(engine)
    first = engine.copy()
    engine.copy().run(
        until=1.0
    )  # what is compiled is at hand: who asks in the midst of a compilation waits for its end
    engine.start(speed=1e4)
    shot = engine.snapshot
    times = []
    for _ in range(5):
        shot = engine.next_frame(after=shot, timeout=10) or shot
        times.append(shot.time)
    assert times == sorted(times) and engine.lag > 0 and 0 < engine.real_time_factor < 0.9
    begin = time.monotonic()
    engine.suspend()
    assert time.monotonic() - begin < 1.0
    engine.terminate()
    first.replay(engine.inputs)
    assert first.checkpoint() == engine.checkpoint()


@pytest.mark.parametrize("what", ["suspended", "idle", "terminated"])
def test_an_engine_with_nothing_to_do_uses_no_cpu(engines: list[xp.PhysicsEngine], what: str) -> None:
    engine = moving(20) if what != "idle" else xp.PhysicsEngine()
    engines.append(engine)
    if what == "idle":
        engine.add_object(xp.PhysicalObject(name="still"))
    engine.start()
    assert engine.wait(until=0.02, timeout=10)
    if what == "suspended":
        engine.suspend()
    if what == "terminated":
        engine.terminate()
    time.sleep(0.05)
    cpu, number = time.process_time(), engine.snapshot.number
    time.sleep(1.0)
    assert time.process_time() - cpu < 0.05
    if what == "idle":
        assert engine.snapshot.number == number and engine.time > 0.9  # time goes by, without a frame
        engine.object("still").velocity = (1, 0, 0)
        assert engine.next_frame(timeout=10) is not None
        assert engine.next_frame(timeout=10) is not None
        assert 0 < engine.object("still").position[0] < engine.time - 0.9
    else:
        assert engine.snapshot.time == engine.time


def test_an_idle_scene_wakes_for_its_next_event(engines: list[xp.PhysicsEngine]) -> None:
    engine = xp.PhysicsEngine()
    engines.append(engine)
    ball = engine.add_object(xp.PhysicalObject())
    push = engine.add_law(Push(), container=xp.LawContainer(xp.when.Elapsed(0.3)))
    engine.map(ball, push)
    engine.start(until=0.5)
    assert engine.wait(timeout=10)
    assert ball.position == pytest.approx((0.2, 0, 0)) and push.evaluations == 1


class Push(xp.PhysicalLaw):
    """Give a velocity."""

    def enforce_this_law(self, event: Any) -> None:
        """Give it."""
        for obj in self.objects:
            obj.velocity = (1, 0, 0)


def test_an_engine_that_was_forgotten_ends_its_thread() -> None:
    engine = moving(3)
    engine.start()
    assert engine.wait(until=0.02, timeout=10)
    thread, gone = engine._live.thread, weakref.ref(engine)
    del engine
    for _ in range(100):
        gc.collect()
        if gone() is None:
            break
        time.sleep(0.01)
    assert gone() is None
    thread.join(5)
    assert not thread.is_alive()


@pytest.mark.parametrize("what", ["pass", "engine.suspend()", "import time; time.sleep(0.1)"])
def test_the_interpreter_ends_though_an_engine_runs(what: str) -> None:
    code = f"import xpheve as xp\nengine = xp.PhysicsEngine()\nengine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))\nengine.start()\n{what}\n"
    done = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, timeout=30)
    assert done.returncode == 0 and done.stderr == ""


def test_a_failure_nobody_asked_for_is_told_when_the_interpreter_ends() -> None:
    code = (
        "import time, xpheve as xp\n"
        "class Breaks(xp.PhysicalLaw):\n    def enforce_this_law(self, event): raise ValueError('on purpose')\n"
        "engine = xp.PhysicsEngine()\n"
        "engine.add_law(Breaks(), container=xp.LawContainer(xp.when.Elapsed(0.01)))\n"
        "engine.start()\n"
        "while engine.state != 'failed': time.sleep(0.001)\n"
    )
    done = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, timeout=30)
    assert "LawFailedError" in done.stderr and "on purpose" in done.stderr


def test_commands_may_come_from_several_threads(engine: xp.PhysicsEngine) -> None:
    engine.start(updates=200)
    refused: list[StateError] = []

    def toggle() -> None:
        for _ in range(50):
            for command in (engine.suspend, engine.resume):
                try:
                    command()
                except StateError as error:
                    refused.append(error)

    threads = [threading.Thread(target=toggle) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(30)
        assert not thread.is_alive()
    if engine.state == "suspended":
        engine.resume()
    assert engine.wait(until=engine.time + 0.05, timeout=10)
    assert all("suspend" in str(error) for error in refused)
