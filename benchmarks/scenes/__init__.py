"""One file a scene: what it is, how xPheve builds it, and what the exact answer is."""

from __future__ import annotations

from benchmarks.ball import Ball
from benchmarks.scenes import s01_thrown, s02_elastic_bounce, s02b_lossy_bounce

BALLS: tuple[Ball, ...] = (s01_thrown.SCENE, s02_elastic_bounce.SCENE, s02b_lossy_bounce.SCENE)
