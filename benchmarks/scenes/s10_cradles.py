"""S10: Newton's cradle. Frictionless balls in a row touch; others strike at 1 m/s; as many must leave, and all others stand still."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np

from benchmarks.impacts import ours
from benchmarks.impacts.stage import Stage, Thing, step_of
from benchmarks.peers import IMPACTS
from benchmarks.problem import Array

RADIUS, MASS, SPAN, GAP = 0.05, 1.0, 1.0, 0.2
SIZES, STRIKERS = (*range(2, 13), 15, 20), range(1, 6)
STEPS = (1 / 60, 1 / 240, 1 / 1000)
NAMES = ("engine", "setting", "5 balls, 1 striker", "5 balls, 2 strikers", "largest of 5")


def stage(balls: int, strikers: int) -> Stage:
    """``balls`` that touch, to the last bit: 2 r k is exact for r = 0.05 only where it is rounded the same way, so places are added up."""
    x, things = 0.0, []
    for _ in range(balls):
        things.append(Thing("sphere", (RADIUS,), (x, 0.0, 0.0), mass=MASS))
        x += 2 * RADIUS
    for k in range(strikers):
        place = (-GAP - 2 * RADIUS * (k + 1), 0.0, 0.0)
        things.append(Thing("sphere", (RADIUS,), place, (1.0, 0.0, 0.0), mass=MASS))
    return Stage(things)


def exact(balls: int, strikers: int) -> Array:
    """The speeds at the end, as the stage has them: as many as strike leave, the farthest; of more strikers than balls the foremost, too."""
    order = sorted(range(balls + strikers), key=lambda k: k if k < balls else balls - 1 - k)
    # From left to right: strikers (the last first), then the row. The speeds keep their order: the rightmost get 1.
    speeds = np.zeros(balls + strikers)
    speeds[order[-strikers:]] = 1.0
    return speeds


def off(velocity: Array, balls: int, strikers: int) -> float:
    """The largest deviation [m/s] of a velocity."""
    wanted = np.zeros((balls + strikers, 3))
    wanted[:, 0] = exact(balls, strikers)
    found = np.asarray(velocity)
    return float(np.abs(found - wanted).max()) if np.isfinite(found).all() else float("inf")


def mine(balls: int, strikers: int) -> float:
    """How far xPheve is off."""
    engine = ours.new_engine()
    bodies = ours.fill(engine, stage(balls, strikers))
    engine.run(until=SPAN)
    return off(ours.read(bodies).velocity, balls, strikers)


def measure(samples: int, quick: bool, peers: tuple[str, ...]) -> dict[str, Any]:
    """Ours for all cradles; the peers for one of five balls."""
    sizes, strikers = ((2, 5), (1, 2)) if quick else (SIZES, STRIKERS)
    each = {(n, k): mine(n, k) for n in sizes for k in strikers}
    worst = max(each.values())
    rows = [["xPheve", "-", *(f"{each[5, k]:.1e}" for k in (1, 2)), f"{worst:.1e} of all cradles"]]
    for peer in peers:
        module = import_module(IMPACTS[peer])
        for setting in ("default", "tuned") if hasattr(module, "World") else ():
            for dt in STEPS[:1] if quick else STEPS:
                found = []
                for k in (1, 2):
                    world = module.World(stage(5, k), setting, dt)
                    world.advance(round(SPAN / dt))
                    found.append(off(world.read().velocity, 5, k))
                rows.append(
                    [f"{module.NAME} {setting}", step_of(dt), *(f"{one:.2g}" for one in found), f"{max(found):.2g}"]
                )
    return {
        "id": "S10",
        "title": "Newton's cradle",
        "names": NAMES,
        "rows": rows,
        "text": f"Largest deviation [m/s] of a ball from the exact answer. All cradles: {len(each)}, of {min(sizes)} to {max(sizes)} balls "
        f"with {min(strikers)} to {max(strikers)} strikers.",
        "bars": [
            {"text": "cradles of 2 to 20 with 1 to 5 strikers: 1e-12", "found": f"{worst:.1e}", "met": worst <= 1e-12}
        ],
    }
