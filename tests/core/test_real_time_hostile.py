"""Real time among hosts that mean no good: broken clocks, forks, locks, many threads at once; and all that other threads may add."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve import when
from xpheve.errors import InvalidValueError, RecordError, StateError, XpheveError
from xpheve.realtime import Inputs


class System:
    """A time of the system that the test sets; an exception is raised."""

    def __init__(self, now: Any) -> None:
        self.now = now

    def __call__(self) -> Any:
        if isinstance(self.now, Exception):
            raise self.now
        return self.now


class Echo(xp.PhysicalLaw):
    """Counts and keeps what it hears."""

    def enforce_this_law(self, event: Any) -> None:
        self.state["n"] = self.state.get("n", 0) + 1
        self.state["last"] = repr((event.time, event.id, event.data))


class Tagged(xp.PhysicalObject):
    """An object with something of the host's."""


def scene() -> xp.PhysicsEngine:
    """A ball over a floor, and one that drifts."""
    made = xp.PhysicsEngine(up="z", seed=3)
    gravity = made.add_law("basic:planet_gravity", acceleration=10.0, name="gravity")
    bounce = made.add_law("collision:elastic", restitution=0.7, name="bounce")
    made.add_object(xp.PhysicalObject(xp.Plane(), fixed=True, name="floor"), laws=[bounce])
    ball = xp.PhysicalObject(xp.Sphere(0.1), position=(0, 0, 1), velocity=(1, 0, 0), name="falls")
    made.add_object(ball, laws=[gravity, bounce])
    made.add_object(xp.PhysicalObject(xp.Sphere(0.1), velocity=(0, 2, 0), position=(5, 0, 3), name="drifts"))
    return made


@pytest.fixture
def engine() -> Iterator[xp.PhysicsEngine]:
    made = scene()
    yield made
    made._trouble.clear()
    if made.state != "terminated":
        within(10.0, made.terminate)
    made._trouble.clear()


def within(seconds: float, act: Callable[[], Any]) -> Any:
    """What ``act`` gives on a thread of its own; fails if it hangs."""
    found: list[Any] = []

    def work() -> None:
        try:
            found.append((act(), None))
        except BaseException as wrong:
            found.append((None, wrong))

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(seconds)
    assert found, f"hangs for more than {seconds} s"
    result, wrong = found[0]
    if wrong is not None:
        raise wrong
    return result


# Clocks


@pytest.mark.parametrize(
    "given", [{"updates": 1e-11}, {"updates": 1e308}, {"speed": 1e-6}, {"speed": 1e6}, {"updates": 1e4}]
)
def test_extreme_rates_still_hear_commands(engine: xp.PhysicsEngine, given: dict[str, float]) -> None:
    engine.start(**given)
    time.sleep(0.05)
    within(5.0, engine.suspend)
    within(5.0, engine.resume)
    within(5.0, engine.terminate)


def test_too_few_updates_are_refused(engine: xp.PhysicsEngine) -> None:
    with pytest.raises(InvalidValueError, match="updates = 5e-324"):
        engine.start(updates=5e-324)
    assert engine.state == "ready"


def test_a_timeout_may_be_longer_than_any_machine_can_count(engine: xp.PhysicsEngine) -> None:
    engine.start(frames=1)
    threading.Timer(0.05, engine.terminate).start()
    assert within(5.0, lambda: engine.wait(timeout=1e300))


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), "x", None, True, 1e308, RuntimeError("no clock")])
def test_a_time_source_that_breaks_stops_the_engine_and_tells(engine: xp.PhysicsEngine, bad: Any) -> None:
    system = System(100.0)
    engine.start(source=system)
    system.now = bad
    with pytest.raises((InvalidValueError, RuntimeError), match=r"source gave|no clock"):
        within(5.0, lambda: engine.wait(until=1.0))
    assert engine.state == "failed"
    system.now = 100.0
    engine.resume()
    system.now = 101.0
    assert within(5.0, lambda: engine.wait(until=0.9, timeout=4.0))


@pytest.mark.parametrize("bad", [float("nan"), "x", RuntimeError("no clock")])
def test_a_time_source_that_is_broken_from_the_start_starts_nothing(engine: xp.PhysicsEngine, bad: Any) -> None:
    with pytest.raises((InvalidValueError, RuntimeError)):
        engine.start(source=System(bad))
    assert engine.state == "ready"
    engine.run(until=0.1)


def test_a_time_source_that_runs_backwards_or_stands_lets_the_scene_stand(engine: xp.PhysicsEngine) -> None:
    system = System(100.0)
    engine.start(source=system)
    system.now = 100.5
    assert engine.wait(until=0.5, timeout=5.0)
    system.now = 20.0
    assert not engine.wait(until=0.51, timeout=0.1)
    assert engine.time == 0.5
    system.now = 101.0
    assert engine.wait(until=1.0, timeout=5.0) and engine.time == 1.0


def test_an_idle_scene_notices_a_time_source_that_jumps_to_its_event() -> None:
    heard: list[float] = []

    class Bell(xp.PhysicalLaw):
        def enforce_this_law(self, event: Any) -> None:
            heard.append(event.time)

    engine, system = xp.PhysicsEngine(), System(0.0)
    engine.add_law(Bell(), container=xp.LawContainer(when.Elapsed(3600.0)))
    engine.start(source=system)
    time.sleep(0.05)
    system.now = 4000.0
    latest = time.monotonic() + 5.0
    while not heard and time.monotonic() < latest:
        time.sleep(0.01)
    engine.terminate()
    assert heard == [3600.0]


# Callbacks, threads, processes


@pytest.mark.parametrize("command", ["terminate", "suspend"])
def test_a_callback_may_end_the_engine(engine: xp.PhysicsEngine, command: str) -> None:
    engine.start(on_frame=lambda shot: getattr(engine, command)() if shot.number == 3 else None)
    thread = engine._live.thread
    if command == "suspend":
        while engine.state == "running":
            time.sleep(0.01)
        within(5.0, engine.terminate)
    assert within(5.0, engine.wait)
    thread.join(5.0)
    assert not thread.is_alive() and engine.state == "terminated"


def test_a_host_may_hold_a_lock_that_its_callback_needs(engine: xp.PhysicsEngine) -> None:
    """Whoever waits for a frame while the callback waits for him does the frame's work himself."""
    lock, first = threading.Lock(), engine.copy()

    def show(shot: Any) -> None:
        with lock:
            time.sleep(0.001)

    def host() -> None:
        for k in range(5):
            with lock:
                time.sleep(0.02)  # the callback waits by now
                engine.suspend()
                engine.add_object(xp.PhysicalObject(position=(9, k, 0), velocity=(1, 0, 0)))
                engine.resume()
                engine.energy()
        with lock:
            time.sleep(0.02)
            engine.terminate()

    engine.start(updates=200.0, on_frame=show)
    within(10.0, host)
    first.replay(engine.inputs)
    assert first.checkpoint() == engine.checkpoint()


def test_commands_reads_and_writes_of_several_threads_in_any_state_raise_nothing_of_their_own(
    engine: xp.PhysicsEngine,
) -> None:
    unexpected: list[BaseException] = []
    end = time.monotonic() + 1.5
    acts: list[Callable[[], Any]] = [
        lambda: engine.start(speed=5.0, on_frame=lambda shot: None),
        lambda: engine.suspend(),
        lambda: engine.resume(),
        lambda: engine.terminate(),
        lambda: engine.reset(),
        lambda: engine.wait(timeout=0.001),
        lambda: engine.next_frame(timeout=0.001),
        lambda: engine.add_object(xp.PhysicalObject(position=(0, 9, 0))),
        lambda: setattr(engine.object("falls"), "velocity", (1, 2, 3)),
        lambda: setattr(engine, "stop_time", engine.time + 0.01),
        lambda: engine.energy(),
        lambda: engine.copy(),
        lambda: engine.snapshot.position.sum(),
    ]

    def worker(seed: int) -> None:
        chance = np.random.default_rng(seed)
        while time.monotonic() < end:
            try:
                acts[chance.integers(len(acts))]()
            except XpheveError:
                continue
            except BaseException as wrong:
                unexpected.append(wrong)

    threads = [threading.Thread(target=worker, args=(seed,), daemon=True) for seed in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(20.0)
        assert not thread.is_alive()
    assert unexpected == []
    engine._trouble.clear()
    within(5.0, engine.terminate)
    engine.reset()
    engine.run(until=0.5)
    assert engine.copy().checkpoint() == engine.checkpoint()


def test_starting_and_ending_again_and_again_leaves_nothing_behind() -> None:
    before = threading.active_count()
    engine = scene()
    for k in range(60):
        engine.start(speed=10.0)
        engine.object("falls").velocity = (1, 2, 3)
        if k % 3:
            engine.terminate()
        else:
            engine.suspend()
        engine.reset()
    for _ in range(30):
        dropped = scene()
        dropped.start()
        del dropped
    latest = time.monotonic() + 5.0
    while threading.active_count() > before and time.monotonic() < latest:
        gc.collect()  # a frame at hand held its engine
        time.sleep(0.01)
    assert threading.active_count() == before


FORK = """
import os, sys, time
import xpheve as xp
engine = xp.PhysicsEngine(up="z")
engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0), name="drifts"))
engine.start()
time.sleep(0.05)
child = os.fork()
if child == 0:
    assert engine.state == "ready"
    goal = engine.time + 1.0
    engine.run(until=goal)
    assert abs(engine.object("drifts").position[0] - goal) < 1e-12
    engine.start()
    assert engine.wait(until=goal + 0.05, timeout=5.0)
    engine.terminate()
    os._exit(7)
assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7
assert engine.state == "running" and engine.wait(until=engine.time + 0.05, timeout=5.0)
engine.terminate()
print("both went on")
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no forks here")
def test_a_fork_leaves_the_child_a_whole_scene_without_a_clock() -> None:
    child = subprocess.run([sys.executable, "-c", FORK], capture_output=True, text=True, timeout=60)
    assert child.stdout == "both went on\n", child.stderr


# What other threads may add, and its replay

CONDITIONS: dict[str, Callable[[Any, Any, xp.Region, xp.Probe], when.Condition]] = {
    "begin": lambda ball, floor, room, tip: when.ContactBegin(ball, floor),
    "clear": lambda ball, floor, room, tip: when.ContactClear(a=ball),
    "active": lambda ball, floor, room, tip: when.RegionActive(room),
    "not active": lambda ball, floor, room, tip: ~when.RegionActive(room),
    "enter": lambda ball, floor, room, tip: when.ObserverEnter(room),
    "probe": lambda ball, floor, room, tip: when.ProbeExit(room, tip),
    "object": lambda ball, floor, room, tip: when.ProbeExit(room, ball),
    "any": lambda ball, floor, room, tip: when.Posted("a") | when.Elapsed(0.1, every=True),
    "all": lambda ball, floor, room, tip: when.Posted("a") & when.Input("key"),
    "now": lambda ball, floor, room, tip: when.AllNow(when.Elapsed(0.05, every=True), when.RegionActive(room)),
    "key": lambda ball, floor, room, tip: when.Input("key", {"k": 1}),
    "paused": lambda ball, floor, room, tip: when.Paused() | when.Resumed(),
    "changed": lambda ball, floor, room, tip: when.Changed("mass", ball, once=True),
    "moved": lambda ball, floor, room, tip: when.PoseChanged(ball, tol=0.1),
    "asleep": lambda ball, floor, room, tip: when.Asleep(ball),
}


def fill(engine: xp.PhysicsEngine) -> None:
    """Everything that another thread may do, with frames in between."""
    ball, drifts = engine.object("falls"), engine.object("drifts")

    def frame() -> None:
        assert engine.wait(until=engine.time + 0.02, timeout=10.0)

    eye = engine.add_observer(xp.Observer("eye", (3, 0, 1), radius=0.5))
    tip = engine.add_probe(xp.Probe("tip", attached=ball))
    room = xp.Region(xp.Sphere(1.0), position=(1, 0, 1), orientation=(0.6, 0.8, 0, 0))
    for name, made in CONDITIONS.items():
        condition = made(ball, engine.object("floor"), room, tip)
        engine.add_law(Echo(name=name), container=xp.LawContainer(condition))
    drifts.hold()
    frame()
    drifts.drive((0, 1, 0), (0, 0, 2.0))
    drifts.carry((5, 5, 5), (0, 1, 0, 0), within=0.01)
    frame()
    drifts.release((0, 0, 1.0))
    drifts.shape = xp.Box((1, 2, 3))
    engine.input("key", {"k": 1, "more": [1, (2.5, None)]})
    engine.post("a", {"x": 1})
    frame()
    eye.position = np.array([1.2, 0.0, 1.0])
    frame()
    tip.position = (9, 9, 9)
    engine.suspend()
    ball.mass = 2.0
    engine.resume()
    frame()
    corners = [(x, y, z) for x in (0, 0.3) for y in (0, 0.3) for z in (0, 0.3)]
    faces = xp.Hull(corners).faces
    parts = [xp.Part(xp.Sphere(0.1), position=(-0.2, 0, 0), density=5.0), xp.Part(xp.Box((0.2, 0.3, 0.1)), density=2.0)]
    for k, (shape, density) in enumerate(
        [(xp.Hull(corners), 7.0), (xp.Mesh(corners, faces), 8.0), (xp.Compound(parts), None), (xp.Sphere(0.1), 9.0)]
    ):
        added = xp.PhysicalObject(
            shape,
            density=density,
            position=(9 + 3 * k, 0, 5),
            angular_velocity=(1, 2, 3),
            restitution=0.5,
            name=f"new {k}",
        )
        engine.add_object(added, laws=["gravity"])
    tagged = Tagged(position=(99, 0, 0), name="tagged")
    tagged.team, tagged.picture = [1, "red"], object()  # type: ignore[attr-defined]
    engine.add_object(tagged, laws=["gravity"])
    frame()
    engine.remove_observer(eye)
    engine.remove_probe(tip)
    engine.remove_object(engine.object("new 0"))
    engine.add_observer(xp.Observer("rider", attached=ball, radius=0.1))
    frame()


def test_all_that_other_threads_may_do_is_replayed_to_the_bit_in_another_process(
    engine: xp.PhysicsEngine, tmp_path: Path
) -> None:
    first = tmp_path / "first.xpc"
    first.write_bytes(engine.checkpoint())
    engine.start()
    fill(engine)
    engine.terminate()
    engine.inputs.save(tmp_path / "inputs.json")
    heard = {law.name: law.state.get("n", 0) for law in engine.laws if isinstance(law, Echo)}
    assert heard["paused"] == 2 and heard["key"] == heard["changed"] == 1 and heard["not active"] and heard["any"]
    del engine.object("tagged").__dict__["picture"]
    program = f"""
import importlib.util, pathlib
spec = importlib.util.spec_from_file_location("hostile", {__file__!r})
hostile = importlib.util.module_from_spec(spec)
spec.loader.exec_module(hostile)
engine = hostile.xp.PhysicsEngine.restore({str(first)!r})
engine.replay(hostile.Inputs.load({str(tmp_path / "inputs.json")!r}), classes=(hostile.Echo, hostile.Tagged))
pathlib.Path({str(tmp_path / "end.xpc")!r}).write_bytes(engine.checkpoint())
print(engine.object("tagged").team)
"""
    child = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=100)
    assert child.returncode == 0, child.stderr
    assert child.stdout == "[1, 'red']\n"
    assert (tmp_path / "end.xpc").read_bytes() == engine.checkpoint()


def test_a_replay_that_lacks_the_class_of_an_object_says_so(engine: xp.PhysicsEngine) -> None:
    first = engine.copy()
    engine.start()
    engine.add_object(Tagged(name="tagged"))
    engine.terminate()
    with pytest.raises(RecordError, match="class Tagged"):
        first.replay(engine.inputs)


@pytest.mark.parametrize("data", [np.arange(3), {1, 2}, object(), lambda: 3])
def test_inputs_that_no_file_can_hold_are_refused_at_once(engine: xp.PhysicsEngine, data: Any) -> None:
    engine.start()
    with pytest.raises(InvalidValueError, match="input: data"):
        engine.input("key", data)


def test_what_cannot_be_written_down_may_be_added_when_no_log_is_kept(engine: xp.PhysicsEngine) -> None:
    def height(body: Any) -> Any:
        return body.position.z - 1.0

    engine.start()
    with pytest.raises(InvalidValueError, match="written down"):
        engine.add_law(Echo(name="a"), container=xp.LawContainer(when.Crosses(height)))
    engine.terminate()
    engine.reset()
    engine.start(keep_inputs=False)
    law = engine.add_law(Echo(name="a"), container=xp.LawContainer(when.Crosses(height)))
    assert law in engine.laws


@pytest.mark.parametrize(
    "change",
    [
        ('"Posted"', '"dataclass"'),
        ('"Posted"', '"__class__"'),
        ('"new container"', '"_init_"'),
        ('"new container"', '" call "'),
        ('"condition"', '"engine"'),
        ('"id": "go"', '"id": {"law": 99}'),
        ('"id": "go"', '"idd": "go"'),
        ('"add_container"', '"terminate"'),
        ('"add_container"', '"__init__"'),
    ],
)
def test_inputs_from_strangers_name_nothing_but_what_inputs_may(
    engine: xp.PhysicsEngine, change: tuple[str, str]
) -> None:
    first = engine.copy()
    engine.start()
    engine.add_container(xp.LawContainer(when.Posted("go")))
    engine.terminate()
    text = engine.inputs.to_json()
    assert change[0] in text
    with pytest.raises(RecordError):
        first.replay(Inputs.from_json(text.replace(*change)))


def test_a_stop_time_in_the_past_or_of_no_start_is_refused(engine: xp.PhysicsEngine) -> None:
    with pytest.raises(StateError, match="not started"):
        engine.stop_time = 1.0
    engine.start()
    assert engine.wait(until=0.1, timeout=5.0)
    with pytest.raises(InvalidValueError, match="suspend"):
        engine.stop_time = 0.05
