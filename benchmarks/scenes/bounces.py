"""S2 and S2b beside the engines of games and robots: a ball on a floor, with a closed form to hold them against."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np

from benchmarks import measure
from benchmarks.ball import Ball
from benchmarks.impacts import ours
from benchmarks.impacts.stage import Stage, Staged, Thing, step_of
from benchmarks.problem import Bar, End
from benchmarks.scenes import s02_elastic_bounce, s02b_lossy_bounce
from benchmarks.turns import Contender

BALLS = {ball.id: ball for ball in (s02_elastic_bounce.SCENE, s02b_lossy_bounce.SCENE)}
TUNED_TO_IT = {"mujoco": "benchmarks.peers.mujoco_peer", "pybullet": "benchmarks.peers.pybullet_peer"}
"""Adapters that find the best stiffness for this very scene, or build it with less."""
DTS = {"mujoco": (1 / 60, 1 / 240, 1 / 1000), "pybullet": (1 / 60, 1 / 240, 1 / 1000, 1 / 4000)}


def errors(ball: Ball, end: End) -> tuple[float, float]:
    """Distance [m] from the exact place, and error of the energy."""
    return ball.errors(end.position[0], end.velocity[0])


def problem(ball: Ball) -> Staged:
    """The scene of one ball."""
    stage = Stage(
        [
            Thing("plane", (0.0, 0.0, 1.0)),
            Thing("sphere", (ball.radius,), ball.position, ball.velocity, mass=ball.mass),
        ],
        1.0 if ball.restitution is None else ball.restitution,
        ball.gravity,
    )
    return Staged(
        id=ball.id,
        title=f"{ball.title}, {ball.span:g} s",
        span=ball.span,
        metric="distance from the exact place [m]",
        build=lambda engine: ours.fill(engine, stage),
        ours=[ours.DEFAULT, ours.ALWAYS],
        error=lambda end: errors(ball, end)[0],
        drift=lambda end: errors(ball, end)[1],
        stage=stage,
        peers={
            "rapier3d": [(one, dt) for one in ("default", "tuned") for dt in (1 / 60, 1 / 240, 1 / 1000)],
            "dartpy": [*(("default", dt) for dt in (1 / 60, 1 / 240, 1 / 1000)), ("tuned", 1 / 240)],
        },
        bars=[
            Bar("within 1e-11 m", "all errors", error=1e-11),
            Bar("energy within 1e-13", "drift", error=1e-13),
            Bar(
                "at most a tenth of the time of the fastest peer at 1/240",
                "ratio",
                peer_setting="dt 1/240",
                ratio=0.1,
                error=1e-11,
            ),
        ],
        short=1.0,
    )


PROBLEMS = [problem(ball) for ball in BALLS.values()]


def others(scene: Staged, peers: Mapping[str, Any]) -> list[Contender]:
    """The peers; two of them by adapters that are made for this scene."""
    found: list[Contender] = []
    for name, peer in peers.items():
        if name in TUNED_TO_IT:
            made = import_module(TUNED_TO_IT[name]).ball(BALLS[scene.id], DTS[name])
            found += [_turned(one) for one in made]
        else:
            found += peer.impacts(scene)
    return found


def _turned(one: measure.Contender) -> Contender:
    """A contender for scenes of one ball as one for these tables."""
    row = one.row
    assert row.dt is not None
    row.engine, row.setting = f"{row.engine} {row.setting}", step_of(row.dt)

    def make() -> tuple[Callable[[], Any], Callable[[], End]]:
        go, end = one.make()
        return go, partial(_end, end)

    return Contender(row, make)


def _end(end: Callable[[], tuple[Any, Any]]) -> End:
    place, velocity = end()
    return End(np.array([place]), np.array([velocity]))
