"""Runs that are killed."""

from __future__ import annotations

import random
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from xpheve.record import Record

CHILD = """
import sys
import xpheve as xp

engine = xp.PhysicsEngine(up="z", seed=1)
gravity = engine.add_law("basic:planet_gravity")
bounce = engine.add_law("collision:elastic")
drag = engine.add_law("basic:linear_drag", coefficient=0.01)
floor = engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce])
for k in range(4):
    ball = xp.PhysicalObject(xp.Sphere(0.1), position=(0.5 * k, 0, 1 + 0.1 * k), velocity=(0, 0.1, 0), angular_velocity=(1, k, 0))
    engine.add_object(ball, laws=[gravity, bounce, *[drag][: k % 2]])
for k in range(76):  # so that frames are large, and go to the file in many batches
    engine.add_object(xp.PhysicalObject(position=(k, 9, 0), velocity=(0, 1, 0.1 * k)))
print("ready", flush=True)
sys.stdin.readline()
engine.run(until=float(sys.argv[2]), dt=0.01, every=1e-3, record=sys.argv[1])
print("done", flush=True)
"""

UNTIL = "1.0"
Kill = Callable[[int, Path], list[int]]


@pytest.fixture
def kill_runs() -> Kill:
    """Return a function that kills so many recorded runs at random moments; it gives how many frames each left behind."""

    def start(path: Path) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, "-c", CHILD, str(path), UNTIL], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def begin(child: subprocess.Popen[str]) -> None:
        assert child.stdin is not None and child.stdout is not None
        assert child.stdout.readline() == "ready\n"
        child.stdin.write("go\n")
        child.stdin.flush()

    def kill(count: int, folder: Path) -> list[int]:
        undisturbed = start(folder / "whole.arrow")
        begin(undisturbed)
        started = time.monotonic()
        assert undisturbed.stdout is not None and undisturbed.stdout.readline() == "done\n"
        span = time.monotonic() - started
        undisturbed.communicate()
        whole = list(Record.open(folder / "whole.arrow"))
        assert len(whole) == 1001
        chance = random.Random(count)
        lengths = []
        for k in range(count):
            path = folder / f"{k}.arrow"
            child = start(path)
            begin(child)
            time.sleep(span * chance.random())
            child.kill()
            child.communicate()
            if not path.exists():  # before the first byte
                lengths.append(0)
                continue
            record = Record.open(path)
            assert record.torn or len(record) == len(whole)
            lengths.append(len(record))
            for found, expected in zip(record, whole, strict=False):
                assert found.time == expected.time and found.energy == expected.energy
                for name in ("serial", "position", "velocity", "orientation", "angular_velocity"):
                    assert getattr(found, name).tobytes() == getattr(expected, name).tobytes()
        return lengths

    return kill
