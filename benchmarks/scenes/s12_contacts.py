"""S12 with contacts armed: 10,000 spheres fall far apart, and any two might meet.

Engines of xPheve with and without a law of impacts have their turns, a step of 1/60 s with a read of all places and velocities after the
other; peers look for contacts too, and are not read.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from itertools import count
from typing import Any

import numpy as np

from benchmarks.front import seconds
from benchmarks.impacts import ours
from benchmarks.impacts.stage import Stage, Thing
from benchmarks.measure import cpu_time, middle, ratio
from benchmarks.peers import IMPACTS
from benchmarks.scenes.s12_free_spheres import GRAVITY, STEP, build, start, worst_error

NAMES = ("engine", "setting", "CPU time a step", "times ours", "position error [m]", "built")
PEERS = {"mujoco": ("default",), "pybullet": ("tuned",), "rapier3d": ("default",), "dartpy": ("default",)}
STEPS = 10


def armed(n: int) -> Any:
    """An engine with the spheres of S12 that may meet."""
    import xpheve as xp

    engine = ours.new_engine()
    gravity = engine.add_law("basic:planet_gravity", acceleration=GRAVITY)
    bounce = engine.add_law("collision:elastic")
    ball = xp.Sphere(0.1)
    rows = zip(*(one.tolist() for one in start(n)), strict=True)
    objects = [xp.PhysicalObject(ball, mass=1.0, position=x, velocity=v) for x, v in rows]
    engine.add_objects(objects, laws=[gravity, bounce])
    engine.run(until=0.0)
    return engine


def stepping(engine: Any) -> Callable[[], Any]:
    """A step of 1/60 s and a read of all."""
    begin = engine.time
    times = (begin + STEP * k for k in count(1))

    def step() -> Any:
        engine.run(until=next(times))
        bodies = engine.bodies
        return bodies.position, bodies.velocity

    return step


def measure(samples: int, quick: bool, peers: tuple[str, ...]) -> dict[str, Any]:
    """With and without contacts armed, and the peers."""
    n = 500 if quick else 10_000
    found: list[Any] = []
    built = cpu_time(lambda: found.append(armed(n)))
    engine = found[0]
    times, mine, bare = ratio(stepping(engine), stepping(build(n)), samples, repeat=20)
    # The error is told at 1 s, of an engine of its own.
    again = armed(n)
    again.run(until=1.0)
    off = worst_error(np.array(again.bodies.position), n, 1.0)
    rows = [
        ["xPheve", "contacts armed", seconds(mine), "1", f"{off:.1e}", f"{built:.1f} s"],
        ["xPheve", "no contacts", seconds(bare), f"{bare / mine:.2f}", "-", "-"],
    ]
    taken: dict[str, float] = {}
    for peer in peers:
        for setting in PEERS.get(peer, ()):
            rows.append(_peer(peer, setting, n, mine, taken))
    best = min(taken, key=lambda name: taken[name]) if taken else None
    return {
        "id": "S12",
        "title": f"{n:,} spheres fall far apart, contacts armed",
        "names": NAMES,
        "rows": rows,
        "text": f"Peers: median of {STEPS} steps, reading not counted; their error after these steps.",
        "bars": [
            {"text": "as without contacts plus at most 20 %", "found": f"{times:.2f} times", "met": times <= 1.2},
            {
                "text": "at least 10x faster than the best peer",
                "found": f"{taken[best] / mine:.3g} times faster than {best}" if best else "no peer in this run",
                "met": taken[best] / mine >= 10 if best else None,
            },
        ],
    }


def _peer(peer: str, setting: str, n: int, mine: float, taken: dict[str, float]) -> list[str]:
    module = import_module(IMPACTS[peer])
    name, made = f"{module.NAME} {setting}", []
    places, velocities = start(n)
    rows = zip(places.tolist(), velocities.tolist(), strict=True)
    stage = Stage([Thing("sphere", (0.1,), tuple(x), tuple(v), mass=1.0) for x, v in rows], 1.0, GRAVITY)
    try:
        built = cpu_time(lambda: made.append(module.World(stage, setting, STEP)))
        world = made[0]
        world.advance(1)
        took, _ = middle([cpu_time(lambda: world.advance(1)) for _ in range(STEPS)])
        off = worst_error(world.read().position, n, (STEPS + 1) * STEP)
    except Exception as wrong:  # a peer that fails is a row that says so
        return [name, f"{type(wrong).__name__}: {wrong}", "-", "-", "-", "-"]
    taken[name] = took
    return [name, "contacts on", seconds(took), f"{took / mine:.3g}", f"{off:.1e}", f"{built:.1f} s"]
