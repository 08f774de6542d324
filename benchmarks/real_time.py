"""Real time: update rate, real-time factor, CPU while suspended, and whether a collision was missed.

Run it with ``python -m benchmarks.real_time [--seconds 5] [--balls 15 300] [--gap 0.8]``. Balls in a closed box collide with one another and
the six walls under gravity, without loss, on a thread, while a host reads and writes at each frame. Afterwards the inputs are
replayed by a plain run: it must end in the same bits, in which no collision is missed. A ball outside its box, or two balls inside
one another, would be one missed by both.
"""

from __future__ import annotations

import argparse
import math
import random
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

import xpheve as xp

RADIUS = 0.05  # [m]
GAP = 0.8  # [m] from one ball to the next at the start; half of it gives some three times as many impacts
TOUCH = 1e-9  # [m]: how deep counts as missed


def box_of_balls(count: int, gap: float = GAP, seed: int = 1) -> tuple[xp.PhysicsEngine, float]:
    """An engine with ``count`` balls in a box of six planes, and half the side [m] of the box."""
    engine = xp.PhysicsEngine(up="z", seed=seed)
    gravity = engine.add_law("basic:planet_gravity")
    bounce = engine.add_law("collision:elastic", restitution=1.0)
    per_side = math.ceil(count ** (1 / 3))
    half = 0.5 * gap * (per_side + 1)
    for axis in range(3):
        for sign in (1.0, -1.0):
            normal, position = [0.0] * 3, [0.0] * 3
            normal[axis], position[axis] = sign, -sign * half
            engine.add_object(xp.PhysicalObject(xp.Plane(normal), position=position, fixed=True), laws=[bounce])
    chance = random.Random(seed)
    balls = []
    for k in range(count):
        cell = (k % per_side, k // per_side % per_side, k // per_side**2)
        position = [gap * (c + 1) - half + chance.uniform(-0.05, 0.05) for c in cell]
        velocity = [chance.gauss(0, 0.5) for _ in range(3)]
        balls.append(xp.PhysicalObject(xp.Sphere(RADIUS), position=position, velocity=velocity, name=f"ball {k}"))
    engine.add_objects(balls, laws=[gravity, bounce])
    return engine, half


def deepest(shot: Any, half: float) -> float:
    """How far [m] a ball of ``shot`` is into a wall or another ball; 0 if none is."""
    x = np.asarray(shot.position)[~np.asarray(shot.fixed)]
    walls = float((np.abs(x) + RADIUS - half).max())
    apart = np.linalg.norm(x[:, None] - x[None, :], axis=2) + np.eye(len(x)) * 9
    return max(0.0, walls, float(2 * RADIUS - apart.min()))


def measure(count: int, span: float, gap: float = GAP) -> dict[str, Any]:
    """What a run of ``span`` seconds in real time with ``count`` balls shows."""
    engine, half = box_of_balls(count, gap)
    first = engine.copy()
    ball = engine.object("ball 0")
    worst, frames, reads, late = 0.0, 0, 0, []
    engine.start(updates=60.0)
    shot = engine.snapshot
    begin, begin_number = time.monotonic(), shot.number
    while time.monotonic() - begin < span:
        found = engine.next_frame(after=shot, timeout=5.0)
        assert found is not None
        shot = found
        frames += 1
        late.append(shot.lag)
        if frames % 10 == 0:
            worst = max(worst, deepest(shot, half))
        if frames % 5 == 0:
            ball.add_force((0.0, 0.0, 0.01), 0.1)
            ball.velocity = ball.velocity
        reads += len(engine.bodies.position)
    passed = time.monotonic() - begin
    updates = (shot.number - begin_number) / passed
    asked = time.monotonic()
    engine.suspend()
    heard = time.monotonic() - asked
    cpu = time.process_time()
    time.sleep(1.0)
    cpu = time.process_time() - cpu
    factor = engine.time / (passed + heard)
    engine.terminate()
    inputs = engine.inputs
    busy = time.process_time()
    first.replay(inputs)
    busy = time.process_time() - busy
    return {
        "balls": count,
        "updates per second": updates,
        "real-time factor": factor,
        "largest lag [s]": max(late),
        "suspend heard after [s]": heard,
        "CPU of 1 s suspended [s]": cpu,
        "deepest overlap in a frame [m]": worst,
        "impacts": engine.explain().data["contacts"]["impacts"],
        "inputs": len(inputs),
        "CPU per simulated second [s]": busy / engine.time,
        "same bits as the replay": first.checkpoint() == engine.checkpoint(),
        "missed collisions": "none" if worst < TOUCH else "some",
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; 1 if a bar is missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.real_time", description=__doc__)
    parser.add_argument("--seconds", type=float, default=5.0, help="of each run")
    parser.add_argument("--balls", type=int, nargs="+", default=[15, 300], help="how many")
    parser.add_argument("--gap", type=float, default=GAP, help="from one ball to the next at the start [m]")
    chosen = parser.parse_args(arguments)
    good = True
    for count in chosen.balls:
        found = measure(count, chosen.seconds, chosen.gap)
        for name, value in found.items():
            print(f"{name:<34} {value:.4g}" if isinstance(value, float) else f"{name:<34} {value}")
        print()
        good &= found["same bits as the replay"] and found["missed collisions"] == "none"
        good &= found["updates per second"] > (30.0 if count > 15 else 55.0)
        good &= found["real-time factor"] > 0.95
    return 0 if good else 1


if __name__ == "__main__":
    raise SystemExit(main())
