"""S1: one sphere thrown. Exact for free: nothing but gravity acts."""

from __future__ import annotations

from benchmarks.ball import Ball

SCENE = Ball(
    id="S1",
    title="a sphere thrown",
    span=4.0,
    position=(0.0, 0.0, 100.0),
    velocity=(3.0, 4.0, 5.0),
    error_bar=1e-12 * 100.0,  # 1e-12 of the height it is thrown from
    drift_bar=1e-12,
)
