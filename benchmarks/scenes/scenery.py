"""666 balls of restitution 0.9 fall through 551 tilted boxes onto 1,444 columns, between four walls and a floor: 2,000 fixed things, 5 s.

The columns stand side by side with tops of different heights, and the boxes hang so far apart that a ball passes: nothing can be wedged.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache, partial
from itertools import pairwise

import numpy as np

from benchmarks.impacts import ours
from benchmarks.impacts.stage import Stage, Staged, Thing, room
from benchmarks.problem import Bar, End

BALLS, RADIUS, RESTITUTION, GRAVITY, SPAN = 666, 0.05, 0.9, 9.81, 5.0
COLUMNS, PITCH = 38, 0.24
HANGING, APART = 24, 0.38
HIGH = 0.3  # [m] of the highest column


@cache
def stage(balls: int = BALLS, columns: int = COLUMNS, hanging: int = HANGING, boxes: int = 551) -> Stage:
    """Columns on a square, boxes that hang above, balls on a jittered lattice above them."""
    random = np.random.default_rng(666)
    edge = columns * PITCH
    things = room((0.0, 0.0, -0.5), (edge, edge, 0.0))[:5]  # the sixth would be a ceiling
    for k in range(columns * columns):
        top = random.uniform(0.0, HIGH)
        half = 0.5 * (top + 0.5)
        place = ((k % columns + 0.5) * PITCH, (k // columns + 0.5) * PITCH, top - half)
        things.append(Thing("box", (0.5 * PITCH, 0.5 * PITCH, half), place))
    for k in range(boxes):
        q = random.normal(size=4)
        q /= math.sqrt(q @ q)
        place = ((k % hanging + 0.5) * APART, (k // hanging + 0.5) * APART, 1.0 + 0.4 * random.uniform())
        things.append(Thing("box", tuple(random.uniform(0.03, 0.08, 3).tolist()), place, orientation=tuple(q.tolist())))
    side = math.ceil(math.sqrt(balls / 2))
    for k in range(balls):
        jitter = random.uniform(-0.02, 0.02, 3)
        grid = (k % side + 0.5, k // side % side + 0.5, 0.0)
        x, y = (g / side * (edge - 0.2) + 0.1 for g in grid[:2])
        place = (x + jitter[0], y + jitter[1], 2.0 + 0.4 * (k // side**2) + jitter[2])
        things.append(
            Thing("sphere", (RADIUS,), tuple(map(float, place)), tuple(random.uniform(-0.5, 0.5, 3).tolist()), mass=0.1)
        )
    return Stage(things, RESTITUTION, GRAVITY)


def watched(of: Stage, seen: Sequence[End]) -> dict[str, float]:
    """The deepest penetration [m], and by how much the energy rose at most between two looks, over that at the start."""
    energies = [of.energy(end) for end in (of.start, *seen)]
    deepest = max(of.overlap(end) for end in seen)
    rises = [b - a for a, b in pairwise(energies)]
    return {"error": deepest, "energy rises by at most": max(0.0, float(max(rises) / energies[0]))}


def problem(of: Stage, span: float = SPAN) -> Staged:
    """The scene on a stage."""
    fixed = len(of.scenery)
    return Staged(
        id="scenery",
        title=f"{len(of.movers)} balls, restitution {RESTITUTION}, on {fixed:,} fixed boxes and planes, {span:g} s",
        span=span,
        metric="deepest penetration [m], at 60 looks",
        build=lambda engine: ours.fill(engine, of, resting="hold"),
        ours=[ours.DEFAULT],
        error=of.overlap,
        drift=of.drift,
        watched=partial(watched, of),
        stage=of,
        peers={name: [(one, 1 / 240) for one in ("default", "tuned")] for name in ("mujoco", "pybullet", "rapier3d")},
        bars=[
            Bar("nothing below the scenery (1e-12 m)", "all errors", error=1e-12),
            Bar(
                "energy never rises by more than 1e-12 of its scale",
                "value",
                key="energy rises by at most",
                ratio=1e-12,
            ),
            Bar("faster than PyBullet at 1/240", "ratio", peer="PyBullet", ratio=1.0),
            Bar("faster than MuJoCo at 1/240", "ratio", peer="MuJoCo", ratio=1.0),
        ],
        notes='The column "energy error" is the change from the start: with restitution 0.9 most is lost, and should be. '
        "A ball whose bounces end on a box is held there, by a setting of the law. DART is left out: it would take a minute.",
        short=0.3,
    )


PROBLEMS = [problem(stage())]
QUICK = [problem(stage(12, 4, 2, 4), 1.0)]
