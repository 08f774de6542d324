"""Two threads that read and write a started engine as fast as they can."""

from __future__ import annotations

import importlib
import random
import threading
import time
from pathlib import Path
from typing import Any

import pytest

import xpheve as xp


def box(balls: int) -> xp.PhysicsEngine:
    """Balls in a box of six planes under gravity."""
    engine = xp.PhysicsEngine(up="z", seed=5)
    gravity = engine.add_law("basic:planet_gravity", name="gravity")
    bounce = engine.add_law("collision:elastic", restitution=1.0, name="bounce")
    for axis in range(3):
        for sign in (1.0, -1.0):
            normal, position = [0.0] * 3, [0.0] * 3
            normal[axis], position[axis] = sign, -3.0 * sign
            engine.add_object(xp.PhysicalObject(xp.Plane(normal), position=position, fixed=True), laws=[bounce])
    chance = random.Random(5)
    for k in range(balls):
        place = (0.9 * (k % 5) - 1.8, 0.9 * (k // 5 % 5) - 1.8, 0.9 * (k // 25) - 1.0)
        velocity = [chance.gauss(0, 1) for _ in range(3)]
        engine.add_object(
            xp.PhysicalObject(xp.Sphere(0.1), position=place, velocity=velocity, name=f"ball {k}"),
            laws=[gravity, bounce],
        )
    return engine


def hammer(engine: xp.PhysicsEngine, span: float, seed: int, done: dict[str, int], wrong: list[Any]) -> None:
    """Read and write for ``span`` seconds; what was asked for is counted by door in ``done``."""
    chance = random.Random(seed)
    balls = [obj for obj in engine.objects if not obj.fixed]
    gravity = engine.law("gravity")
    ours: list[xp.PhysicalObject] = []
    end = time.monotonic() + span

    def count(door: str) -> None:
        done[door] = done.get(door, 0) + 1

    while time.monotonic() < end:
        ball = chance.choice(balls)
        what = chance.randrange(9)
        if what == 0:
            ball.add_force((chance.gauss(0, 1), chance.gauss(0, 1), 0), 0.1)
            count("add_force")
        elif what == 1:
            ball.angular_velocity = (chance.random(), 0, 0)
            count("write_object")
        elif what == 2:
            gravity.acceleration = chance.uniform(9, 10)
            count("set_parameter")
        elif what == 3:
            engine.post("now", {"n": chance.random()})
            count("post")
        elif what == 4 and chance.random() < 0.2:
            if len(ours) < 5:
                ours.append(engine.add_object(xp.PhysicalObject(position=(chance.random(), 9, seed)), laws=[gravity]))
                count("add_objects")
            else:
                engine.remove_object(ours.pop(0))
                count("remove_object")
        elif what == 5:
            shot = engine.snapshot
            if shot.position.shape != (len(shot.objects), 3) or abs(shot.position[6:]).max() > 1e6:
                wrong.append(shot)
        elif what == 6 and chance.random() < 0.1:
            engine.energy()
        elif what == 7 and chance.random() < 0.05:
            engine.copy()
        else:
            time.sleep(0.0002)


def hammered(balls: int, span: float) -> dict[str, Any]:
    """Two threads for ``span`` seconds, with pauses; then the replay."""
    engine = box(balls)
    first = engine.copy()
    counts: list[dict[str, int]] = [{}, {}]
    wrong: list[Any] = []
    engine.start(updates=60.0)
    threads = [threading.Thread(target=hammer, args=(engine, span, k, counts[k], wrong)) for k in range(2)]
    for thread in threads:
        thread.start()
    for _ in range(3):
        time.sleep(span / 4)
        engine.suspend()
        engine.resume()
    for thread in threads:
        thread.join()
    engine.terminate()
    asked: dict[str, int] = {}
    for found in counts:
        for door, number in found.items():
            asked[door] = asked.get(door, 0) + number
    logged: dict[str, int] = {}
    for one in engine.inputs:
        logged[one.door] = logged.get(one.door, 0) + 1
    logged.pop("resume", None)
    first.replay(engine.inputs)
    return {
        "asked": asked,
        "logged": logged,
        "wrong": wrong,
        "time": engine.time,
        "same bits": first.checkpoint() == engine.checkpoint(),
    }


def check(found: dict[str, Any]) -> None:
    assert found["wrong"] == []
    assert found["logged"] == found["asked"]  # nothing was lost, nothing came twice
    assert found["same bits"]


def test_two_threads_hammer_the_engine_for_three_seconds() -> None:
    found = hammered(balls=15, span=3.0)
    check(found)
    assert sum(found["asked"].values()) > 100


@pytest.mark.stress
def test_two_threads_hammer_the_engine_for_a_minute() -> None:
    check(hammered(balls=15, span=60.0))


@pytest.mark.stress
@pytest.mark.parametrize(("balls", "rate"), [(15, 50.0), (300, 30.0)])
def test_balls_in_a_box_are_updated_in_real_time_and_no_collision_is_missed(
    balls: int, rate: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The rates hold on a machine that is otherwise free."""
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2]))
    real_time = importlib.import_module("benchmarks.real_time")
    found = real_time.measure(balls, 5.0)
    assert found["updates per second"] > rate
    assert found["same bits as the replay"] and found["deepest overlap in a frame [m]"] < real_time.TOUCH
    assert found["CPU of 1 s suspended [s]"] < 0.05
