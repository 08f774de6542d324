"""S5: 666 elastic spheres in a cube of 4 m, 1 m/s each, no gravity, for 10 s. Nobody knows where they end; energy and overlaps tell.

Beside the peers runs a loop that knows of nothing but this scene (`benchmarks.impacts.plain_loop`): what an engine around it costs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from typing import Any

import numpy as np

from benchmarks.impacts import ours
from benchmarks.impacts.stage import LOOKS, Stage, Staged, Thing, room
from benchmarks.measure import Row
from benchmarks.problem import Bar, End
from benchmarks.turns import Contender

N, EDGE, RADIUS, MASS, SPAN = 666, 4.0, 0.05, 0.1, 10.0
FEW = 60
PLAIN = "plain loop by hand"


@cache
def stage(n: int = N) -> Stage:
    """The spheres on places drawn from a grid, with directions drawn at random."""
    side = math.ceil(n ** (1.0 / 3.0) - 1e-9)
    random = np.random.default_rng(5)
    grid = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    chosen = np.sort(random.permutation(len(grid))[:n])
    places = (grid[chosen] + 0.5) * (EDGE / side)
    velocities = random.normal(size=(n, 3))
    velocities /= np.linalg.norm(velocities, axis=1)[:, None]
    spheres = [
        Thing("sphere", (RADIUS,), tuple(x), tuple(v), mass=MASS)
        for x, v in zip(places.tolist(), velocities.tolist(), strict=True)
    ]
    return Stage([*room((0.0,) * 3, (EDGE,) * 3), *spheres])


def watched(of: Stage, seen: Sequence[End]) -> dict[str, float]:
    """The deepest overlap [m], and the largest error of the energy."""
    return {
        "deepest overlap [m]": max(of.overlap(end) for end in seen),
        "largest energy error": max(abs(of.drift(end)) for end in seen),
    }


def error(of: Stage, end: End) -> float:
    """Energy error at the end, without its sign."""
    return abs(of.drift(end))


def plain(scene: Staged) -> Contender:
    """The loop by hand."""
    from benchmarks.impacts.plain_loop import Spheres, run

    start = scene.stage.start
    row = Row(scene.id, PLAIN, "-", note="numba; knows of nothing but elastic spheres of one size in a cube")
    row.more["aside"] = True

    def made() -> Spheres:
        return Spheres(start.position.copy(), start.velocity.copy(), 2 * RADIUS, EDGE, periodic=False)

    def make() -> tuple[Callable[[], Any], Callable[[], End]]:
        spheres = made()
        return partial(run, spheres, until=scene.span), lambda: End(spheres.position, spheres.velocity)

    def watch() -> list[End]:
        spheres, seen = made(), []
        for k in range(1, LOOKS + 1):
            run(spheres, until=k / LOOKS * scene.span)
            seen.append(End(spheres.position.copy(), spheres.velocity.copy()))
        return seen

    return Contender(row, make, watch=watch)


def problem(n: int = N, span: float = SPAN) -> Staged:
    """The scene with ``n`` spheres."""
    of = stage(n)
    return Staged(
        id="S5",
        title=f"{n} elastic spheres in a cube, {span:g} s",
        span=span,
        metric="error of the kinetic energy, relative",
        build=lambda engine: ours.fill(engine, of),
        ours=[ours.DEFAULT],
        error=partial(error, of),
        watched=partial(watched, of),
        stage=of,
        peers={
            "mujoco": [("default", 1 / 60), *(("tuned", dt) for dt in (1 / 60, 1 / 240))],
            "pybullet": [("default", 1 / 60), *(("tuned", dt) for dt in (1 / 60, 1 / 240))],
            "rapier3d": [("default", 1 / 60), *(("tuned", dt) for dt in (1 / 60, 1 / 240))],
            "dartpy": [("tuned", 1 / 60)],
        },
        bars=[
            Bar("kinetic energy within 1e-13", "all errors", error=1e-13, method="", setting="-"),
            Bar("largest energy error on the way below 1e-13", "value", key="largest energy error", ratio=1e-13),
            Bar("deepest overlap below 1e-12 m", "value", key="deepest overlap [m]", ratio=1e-12),
            Bar("at least 30x faster than the best peer at its own error", "ratio", ratio=1 / 30, finest=True),
            Bar("at most 1.3x the plain loop", "ratio", peer=PLAIN, ratio=1.3),
        ],
        short=0.5,
    )


PROBLEMS = [problem()]
QUICK = [problem(FEW, 1.0)]


def others(scene: Staged, peers: Mapping[str, Any]) -> list[Contender]:
    """The loop by hand, and the peers."""
    return [plain(scene), *(one for peer in peers.values() for one in peer.impacts(scene))]
