"""What an output of a Kepler orbit costs: 1,000 orbits at once at one time, and one orbit at 1,000 times."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from benchmarks.front import seconds
from benchmarks.measure import cpu_time, middle
from benchmarks.scenes.kepler import PERIOD, start
from benchmarks.smooth.ours import asked

ID, TITLE, N = "Kepler outputs", "1,000 outputs of two bodies", 1000
BAR = 2e-6  # [s]


def measure(samples: int, quick: bool, peers: Sequence[str] = ()) -> dict[str, Any]:
    """The rows of the table, and the bar."""
    n = 50 if quick else N
    rows, bars = [], []
    for name, make in (
        ("orbits at one time, and a read of all", many),
        ("times of one orbit, a run and a read each", often),
    ):
        try:
            acts = make(n)
        except LookupError as wrong:
            rows.append([f"{n:,} {name}", "-", str(wrong)])
            continue
        acts()
        found, _ = middle([cpu_time(acts) / n for _ in range(samples)])
        rows.append([f"{n:,} {name}", seconds(found), ""])
        if make is many:
            bars.append(
                {
                    "text": "a batch of 1,000 outputs under 2 µs each",
                    "found": seconds(found),
                    "met": None if quick else bool(found < BAR),
                }
            )
    return {
        "id": ID,
        "title": TITLE,
        "names": ["what", "CPU time an output", "note"],
        "rows": rows,
        "bars": bars,
        "text": "",
    }


def many(n: int) -> Callable[[], Any]:
    """Advances ``n`` pairs, 100 m apart and each of an eccentricity of its own, by a tenth of a period, and reads all places."""
    import xpheve as xp

    engine = asked("core:kepler")
    swarm = start()
    pairs = []
    for k in range(n):
        at = swarm.position + np.array([100.0 * k, 0.0, 0.0])
        slower = swarm.velocity * (1.0 - 1e-4 * k)
        pairs.append(
            [xp.PhysicalObject(mass=m, position=x, velocity=v) for m, x, v in zip(swarm.mass, at, slower, strict=True)]
        )
    engine.add_objects([body for pair in pairs for body in pair])
    engine.add_law("basic:universal_gravity", gravitational_constant=1.0, pairs=[tuple(pair) for pair in pairs])
    engine.run(until=0.0)
    _held(engine)

    def act() -> Any:
        engine.run(until=engine.time + 0.1 * PERIOD)
        return np.asarray(engine.bodies.position).sum()

    return act


def often(n: int) -> Callable[[], Any]:
    """Runs one pair to ``n`` times, a tenth of a period apart, and reads its places at each."""
    import xpheve as xp

    engine = asked("core:kepler")
    swarm = start()
    gravity = engine.add_law("basic:universal_gravity", gravitational_constant=1.0)
    rows = zip(swarm.mass, swarm.position, swarm.velocity, strict=True)
    engine.add_objects([xp.PhysicalObject(mass=m, position=x, velocity=v) for m, x, v in rows], laws=[gravity])
    engine.run(until=0.0)
    _held(engine)

    def act() -> Any:
        total = 0.0
        for _ in range(n):
            engine.run(until=engine.time + 0.1 * PERIOD)
            total += np.asarray(engine.bodies.position).sum()
        return total

    return act


def _held(engine: Any) -> None:
    served = {group["stepper"] for group in engine.explain().data["groups"]}
    if served != {"core:kepler"}:
        raise LookupError(f"core:kepler did not get the groups: {', '.join(sorted(map(str, served)))} did")
