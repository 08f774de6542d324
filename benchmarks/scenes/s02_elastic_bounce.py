"""S2: a sphere falls 1 m to a floor and loses nothing, for 10 s: 11 bounces."""

from __future__ import annotations

from benchmarks.ball import Ball

SCENE = Ball(
    id="S2",
    title="a sphere bounces, restitution 1",
    span=10.0,
    position=(0.0, 0.0, 1.1),
    restitution=1.0,
    error_bar=1e-11,
    drift_bar=1e-13,
)
