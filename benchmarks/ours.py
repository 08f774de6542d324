"""xPheve on the scenes of one sphere: without steps, in host steps, and with everything at its default."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from benchmarks.ball import Ball
from benchmarks.measure import Contender, Row

NAME = "xPheve"


def ball(scene: Ball, dts: tuple[float, ...]) -> list[Contender]:
    """A row without dt, and one for each of ``dts``: they must agree, for event-driven motion has no steps."""
    return [_contender(scene, dt) for dt in (None, *dts)]


def _contender(scene: Ball, dt: float | None) -> Contender:
    def make() -> tuple[Callable[[], Any], Callable[[], tuple[Any, Any]]]:
        engine, body = scene.build()
        return (lambda: engine.run(until=scene.span, dt=dt)), (lambda: (body.position, body.velocity))

    return Contender(Row(scene.id, NAME, "exact" if dt is None else "exact, host steps", dt), make)
