"""Thesis 3.1.1 to 3.1.3, figures 3-1 to 3-9, 3-25, 5-1: the engine in real time."""

from __future__ import annotations

import importlib.util
import threading
import time
from pathlib import Path
from typing import Any

import pytest

import xpheve as xp
from xpheve.errors import StateError
from xpheve.realtime import RealClock, Snapshot

EXAMPLES = Path(__file__).parents[2] / "examples"


class System:
    """A time of the system that the test sets."""

    def __init__(self, now: float) -> None:
        self.now = now

    def __call__(self) -> float:
        return self.now


class Count(xp.PhysicalLaw):
    """Be counted."""

    def enforce_this_law(self, event: Any) -> None:
        """Do nothing."""


def frame(engine: xp.PhysicsEngine, system: System, now: float) -> Snapshot:
    """The frame that the host shows at the system's time ``now``."""
    before = engine.snapshot
    system.now = now
    engine.frame_passed()
    found = engine.next_frame(after=before, timeout=10)
    assert found is not None
    return found


@pytest.mark.thesis("real-time-updates", "real-time-updates/fix")
def test_3_1_1_fig_3_1_updates_come_every_so_many_milliseconds() -> None:
    engine = xp.PhysicsEngine()
    engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))
    engine.start(updates=50.0)
    begin, clock = engine.snapshot.number, time.monotonic()
    assert engine.wait(until=1.0, timeout=20)
    rate = (engine.snapshot.number - begin) / (time.monotonic() - clock)
    engine.terminate()
    assert 25 < rate < 60


@pytest.mark.thesis("real-time-updates", "real-time-updates/fix")
def test_3_1_1_fig_3_2_updates_come_every_so_many_frames_of_the_host() -> None:
    engine = xp.PhysicsEngine()
    engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))
    system = System(0.0)
    engine.start(frames=3, source=system)
    seen = []
    for k in range(1, 10):
        before, system.now = engine.snapshot, float(k)
        engine.frame_passed()
        if k % 3 == 0:
            shot = engine.next_frame(after=before, timeout=10)
            assert shot is not None
            seen.append(shot.time)
    engine.terminate()
    assert seen == [3.0, 6.0, 9.0]


@pytest.mark.thesis("real-time-updates", "real-time-updates/fix")
def test_3_1_1_one_object_does_not_use_a_whole_core() -> None:
    engine = xp.PhysicsEngine()
    gravity = engine.add_law("basic:planet_gravity")
    engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)), laws=[gravity])
    engine.start(updates=60.0)
    assert engine.wait(until=0.1, timeout=10)
    cpu, begin = time.process_time(), time.monotonic()
    time.sleep(1.5)
    used = (time.process_time() - cpu) / (time.monotonic() - begin)
    engine.terminate()
    assert used < 0.25


@pytest.mark.thesis("states")
def test_3_1_2_fig_3_4_each_command_acts_at_once() -> None:
    engine = xp.PhysicsEngine()
    ball = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))
    assert engine.state == "ready"
    engine.start()
    assert engine.state == "running"
    for _ in range(3):
        engine.suspend()
        stood = ball.position
        assert engine.state == "suspended"
        time.sleep(0.05)
        assert ball.position == stood and engine.time == stood[0]
        engine.resume()
        assert engine.state == "running"
        assert engine.wait(until=stood[0] + 0.02, timeout=10)
    engine.terminate()
    assert engine.state == "terminated"
    end = engine.time
    time.sleep(0.05)
    assert engine.time == end == ball.position[0]
    with pytest.raises(StateError, match="reset"):
        engine.start()


@pytest.mark.thesis("clock", "clock/formula", "clock/fix")
def test_fig_3_5_system_17_start_10_paused_3_gives_4() -> None:
    system = System(10.0)
    clock = RealClock(source=system)
    clock.start()
    engine = xp.PhysicsEngine()
    ball = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))
    engine.start(frames=1, source=system)
    frame(engine, system, 12.0)
    engine.suspend()
    clock.pause()
    system.now = 14.0
    assert clock.time == engine.time == ball.position[0] == 2.0 and clock.paused == 2.0  # it still runs, and counts
    system.now = 15.0
    engine.resume()
    clock.resume()
    shot = frame(engine, system, 17.0)
    engine.terminate()
    assert clock.time == shot.time == 4.0 and ball.position == (4, 0, 0) and ball.velocity == (1, 0, 0)


@pytest.mark.thesis("clock")
def test_fig_3_5_several_pauses_add_up() -> None:
    system = System(0.0)
    engine = xp.PhysicsEngine()
    ball = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))
    engine.start(frames=1, source=system)
    for _ in range(4):
        frame(engine, system, system.now + 0.25)
        engine.suspend()
        system.now += 1000.0
        engine.resume()
    shot = frame(engine, system, system.now + 0.5)
    engine.terminate()
    assert shot.time == 1.5 and ball.position == (1.5, 0, 0)


@pytest.mark.thesis("force-over-a-pause")
def test_3_1_2_half_a_second_of_a_force_is_left_after_an_hours_pause() -> None:
    system = System(100.0)
    engine = xp.PhysicsEngine()
    ball = engine.add_object(xp.PhysicalObject())
    engine.start(frames=1, source=system)
    frame(engine, system, 101.0)
    ball.add_force((2, 0, 0), 1.0)
    frame(engine, system, 102.0)  # the force begins here
    frame(engine, system, 102.5)
    engine.suspend()
    assert ball.forces[0].duration == 0.5
    system.now += 3600.0
    assert ball.forces[0].duration == 0.5 and ball.velocity == (1, 0, 0)
    engine.resume()
    shot = frame(engine, system, system.now + 10.0)
    engine.terminate()
    assert shot.time == 12.5 and ball.velocity == (2, 0, 0) and ball.forces == ()


@pytest.mark.thesis("suspended-is-deaf")
def test_3_1_3_fig_3_8_3_9_a_suspended_engine_monitors_nothing_but_its_commands() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law(Count(), container=xp.LawContainer(xp.when.Elapsed(0.01, every=True)))
    posted = engine.add_law(Count(), container=xp.LawContainer(xp.when.Posted("here")))
    engine.start()
    assert engine.wait(until=0.05, timeout=10)
    engine.suspend()
    engine.post("here")
    fired, number, cpu = law.evaluations, engine.snapshot.number, time.process_time()
    time.sleep(1.0)
    assert time.process_time() - cpu < 0.05
    assert law.evaluations == fired and posted.evaluations == 0
    assert engine.snapshot.number <= number + 1  # the post was written down
    engine.resume()
    assert engine.wait(until=engine.time + 0.05, timeout=10)
    engine.terminate()
    assert law.evaluations > fired and posted.evaluations == 1


@pytest.mark.thesis("resume-is-no-start")
def test_3_1_3_fig_4_8_ten_pauses_leave_the_acceleration_at_9_8() -> None:
    system = System(0.0)
    engine = xp.PhysicsEngine()
    gravity = engine.add_law("basic:planet_gravity", acceleration=9.8)
    started = engine.add_law(Count(), container=xp.LawContainer(xp.when.Started()))
    ball = engine.add_object(xp.PhysicalObject(), laws=[gravity])
    engine.start(frames=1, source=system)
    for _ in range(10):
        frame(engine, system, system.now + 0.125)
        engine.suspend()
        system.now += 1.0
        engine.resume()
    engine.terminate()
    assert started.evaluations == 1 and len(ball.forces) == 1
    assert ball.velocity[1] == pytest.approx(-9.8 * 1.25, rel=1e-14)


@pytest.mark.thesis("balloon-and-car", "balloon-and-car/decide")
def test_fig_3_25_5_1_the_balloon_and_car_program_ends_in_start(capsys: pytest.CaptureFixture[str]) -> None:
    """The program as printed, in seven steps, mended so that it runs."""
    # 1: import the engine. 2: make one.
    engine = xp.PhysicsEngine(up="z")
    # 3: give the objects shapes.
    balloon = xp.PhysicalObject(xp.Sphere(0.3), mass=0.1, velocity=(2, 0, 0), position=(-5, 0, 0.7), name="balloon")
    car = xp.PhysicalObject(xp.Sphere(0.7), mass=900.0, position=(0, 0, 2.2), name="car")
    # 4: make the laws. 5: say which laws an object obeys.
    gravity = engine.add_law("basic:planet_gravity", acceleration=9.8)
    collision = engine.add_law("collision:elastic", restitution=0.4)
    # 6: add the objects with their laws.
    engine.add_object(balloon, [collision])
    engine.add_object(car, [gravity, collision])
    # 7: start.
    first = engine.copy()
    engine.start(until=0.5)
    # A script waits like this.
    assert engine.wait(timeout=20)
    assert engine.time == 0.5 and balloon.position == (-4, 0, 0.7)
    assert car.position[2] == pytest.approx(2.2 - 4.9 * 0.25, rel=1e-14)
    engine.terminate()
    first.run(until=0.5)
    assert first.checkpoint() == engine.checkpoint()


@pytest.mark.thesis("balloon-and-car")
def test_fig_5_1_the_example_ends_in_start_when_asked(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = EXAMPLES / "balloon_and_car.py"
    spec = importlib.util.spec_from_file_location("balloon_and_car", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setattr("sys.argv", [str(path), "--live", "--speed", "8"])
    module.main()
    shown = capsys.readouterr().out
    assert "in real time: the same bits" in shown and "largest error against the closed form" in shown


@pytest.mark.thesis("stop-time")
def test_fig_5_7_the_stop_time_is_hit_exactly_in_real_time_and_reset_sets_zero() -> None:
    engine = xp.PhysicsEngine()
    ball = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0), position=(2, 0, 0)))
    engine.start(speed=4.0, until=1 / 3)
    assert engine.wait(timeout=10) and engine.time == 1 / 3 and engine.state == "suspended"
    engine.reset()
    assert engine.time == 0.0 and ball.position == (2, 0, 0) and engine.state == "ready"


@pytest.mark.thesis("clock/fix")
def test_3_1_2_the_printed_clock_forgets_the_pause_that_runs_and_the_clock_of_the_wall_goes_back(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As printed: t = system - start - paused, where ``paused`` grows when a pause ends."""
    system = System(10.0)
    engine = xp.PhysicsEngine()
    engine.start(frames=1, source=system)
    frame(engine, system, 12.0)
    engine.suspend()
    system.now = 14.0
    printed = system.now - 10.0 - 0.0
    assert printed == 4.0 and engine.time == 2.0
    engine.terminate()
    monkeypatch.setattr(time, "time", lambda: -1e9)  # somebody sets the clock of the wall
    engine = xp.PhysicsEngine()
    engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))
    engine.start()
    assert engine.wait(until=0.05, timeout=10) and engine.time >= 0.05
    engine.terminate()


@pytest.mark.thesis("one-time-line/decide")
def test_2_8_calls_of_other_threads_act_at_the_next_frame_and_reads_are_of_one_instant() -> None:
    """Decision 13; what the threads did is replayed to the same bits."""
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", acceleration=10.0, name="gravity")
    ball = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0), name="ball"), laws=[gravity])
    gone = engine.add_object(xp.PhysicalObject(name="gone"))
    first, system = engine.copy(), System(0.0)
    engine.start(frames=1, source=system)
    frame(engine, system, 1.0)
    wrong: list[Any] = []

    def host(k: int) -> None:
        try:
            ball.add_force((0, 1.0, 0), 0.5)
            if k == 0:
                engine.law("gravity").enabled = False
                engine.remove_object(gone)
            for _ in range(200):
                shot = engine.snapshot
                row = shot.rows[ball]
                assert shot.position[row, 0] == shot.time
        except BaseException as problem:
            wrong.append(problem)

    threads = [threading.Thread(target=host, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(20)
    assert wrong == [] and ball.velocity == (1, 0, -10), "nothing acts before the next frame"
    frame(engine, system, 2.0)
    frame(engine, system, 3.0)
    engine.terminate()
    assert ball.velocity[1] == 2.0 and gone.engine is None and not engine.law("gravity").enabled
    first.replay(engine.inputs)
    assert first.checkpoint() == engine.checkpoint()


MOVES = {
    # state: what start, suspend, resume and terminate lead to; "" where they are refused
    "ready": ("running", "suspended", "", "terminated"),
    "started": ("", "suspended", "", "terminated"),
    "suspended": ("", "", "running", "terminated"),
    "terminated": ("", "", "", "terminated"),
}


@pytest.mark.thesis("states", "states/decide")
@pytest.mark.parametrize("state", MOVES)
@pytest.mark.parametrize("command", ["start", "suspend", "resume", "terminate"])
def test_3_1_2_fig_3_4_every_move_is_made_or_refused_with_the_way_out(state: str, command: str) -> None:
    """Decisions 8 and 12. Among them: resume before start, start twice, terminate while suspended, start after terminate."""
    engine = xp.PhysicsEngine()
    engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))
    if state != "ready":
        engine.start(frames=1, source=System(0.0))
    if state == "suspended":
        engine.suspend()
    if state == "terminated":
        engine.terminate()
    after = MOVES[state][("start", "suspend", "resume", "terminate").index(command)]
    if after:
        getattr(engine, command)()
        assert engine.state == after
    else:
        before = engine.state
        with pytest.raises(StateError, match=rf"{command}: the engine .*: \w+"):
            getattr(engine, command)()
        assert engine.state == before
    engine.terminate()
    engine.reset()
    assert engine.state == "ready" and engine.time == 0.0
