"""S2b: a sphere falls 1 m to a floor and keeps 0.8 of its speed, for 3 s: 7 bounces."""

from __future__ import annotations

from benchmarks.ball import Ball

SCENE = Ball(
    id="S2b",
    title="a sphere bounces, restitution 0.8",
    span=3.0,
    position=(0.0, 0.0, 1.1),
    restitution=0.8,
    error_bar=1e-11,
    drift_bar=1e-13,
)
