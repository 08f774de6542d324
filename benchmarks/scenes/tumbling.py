"""A box and a capsule tumble in a room under gravity, restitution 1, for 100 impacts each: energy, momentum, and the way back."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np

from benchmarks.front import seconds
from benchmarks.impacts import ours
from benchmarks.impacts.stage import Stage, Thing, room, step_of
from benchmarks.measure import cpu_time, middle
from benchmarks.peers import IMPACTS
from benchmarks.problem import End

IMPACTS_OF_ALL, IMPACTS_BACK, GRAVITY = 100, 5, 9.81
STEPS = (1 / 240, 1 / 1000)
NAMES = (
    "body",
    "engine",
    "setting",
    "CPU time",
    "ms an impact",
    "energy error",
    "momentum less impulses",
    "error after the way back",
)

_TURNED = (math.cos(0.35), 0.3 * math.sin(0.35), -0.5 * math.sin(0.35), math.sqrt(1 - 0.34) * math.sin(0.35))
BODIES = {
    "box": Thing("box", (0.3, 0.2, 0.1), (1.0, 1.2, 1.4), (1.3, -0.7, 0.4), _TURNED, (2.0, -3.0, 1.0), 2.0),
    "capsule": Thing("capsule", (0.15, 0.5), (1.0, 1.2, 1.4), (1.3, -0.7, 0.4), _TURNED, (2.0, -3.0, 1.0), 2.0),
}


def stage(name: str) -> Stage:
    """The body in a room of 2 m x 2.4 m x 2.8 m."""
    return Stage([*room((0.0, 0.0, 0.0), (2.0, 2.4, 2.8)), BODIES[name]], 1.0, GRAVITY)


class Tumble:
    """The scene in xPheve, its impacts listened to or not."""

    def __init__(self, of: Stage, listened: bool = False) -> None:
        self.of, self.engine = of, ours.new_engine()
        (self.body,) = ours.fill(self.engine, of)
        self.impulse = np.zeros(3)
        self.times: list[float] = []
        if listened:
            ours.listen(self.engine, self.engine.objects, self._told)
        self.engine.run(until=0.0)

    def _told(self, event: Any) -> None:
        for contact in event.contacts:
            sign = 1.0 if contact.body_b is self.body else -1.0
            self.impulse += sign * contact.impulse * np.array(contact.normal)
            self.times.append(event.time)

    @property
    def end(self) -> End:
        """Where the body is."""
        return ours.read([self.body])


def until_impacts(of: Stage, count: int) -> tuple[float, Tumble]:
    """A run until ``count`` impacts were told, and between which times the last but one and the last were: a time in the middle."""
    tumble, t = Tumble(of, listened=True), 0.0
    while len(tumble.times) <= count:
        t += 0.25
        tumble.engine.run(until=t)
    return 0.5 * (tumble.times[count - 1] + tumble.times[count]), tumble


def momentum_error(of: Stage, span: float) -> float:
    """The momentum that is there less what the walls and gravity gave, over the largest momentum there could be."""
    tumble = Tumble(of, listened=True)
    tumble.engine.run(until=span)
    one = of.movers[0]
    given = tumble.impulse + one.mass * np.array([0.0, 0.0, -GRAVITY * span])
    changed = one.mass * (tumble.end.velocity[0] - np.array(one.velocity))
    scale = math.sqrt(2.0 * one.mass * float(of.energy(of.start)))
    return float(np.abs(changed - given).max() / scale)


def way_back(of: Stage, count: int) -> float:
    """Velocities and spin turned round after ``count`` impacts: how far the body is from its start after the same time again [m]."""
    span, _ = until_impacts(of, count)
    there = Tumble(of)
    there.engine.run(until=span)
    end, one = there.end, of.movers[0]
    back = replace(
        one,
        position=tuple(end.position[0].tolist()),
        velocity=tuple((-end.velocity[0]).tolist()),
        orientation=tuple(end.orientation[0].tolist()),  # type: ignore[index]
        turning=tuple((-end.turning[0]).tolist()),  # type: ignore[index]
    )
    again = Tumble(Stage([*of.scenery, back], of.restitution, of.gravity))
    again.engine.run(until=span)
    found = again.end
    off = [found.position[0] - one.position, found.velocity[0] + one.velocity, found.turning[0] + one.turning]  # type: ignore[index]
    return max(float(np.abs(part).max()) for part in off)


def measure(samples: int, quick: bool, peers: tuple[str, ...]) -> dict[str, Any]:
    """Ours, and the energy of the peers beside it."""
    count, back = (4, 1) if quick else (IMPACTS_OF_ALL, IMPACTS_BACK)
    rows: list[Sequence[Any]] = []
    bars: list[dict[str, Any]] = []
    for name in BODIES:
        of = stage(name)
        span, _ = until_impacts(of, count)
        took, ends = [], []
        for _ in range(min(samples, 3)):
            tumble = Tumble(of)
            took.append(cpu_time(partial(tumble.engine.run, until=span)))  # type: ignore[misc]
            ends.append(tumble.end)
        taken, _ = middle(took)
        energy, momentum, off = abs(of.drift(ends[0])), momentum_error(of, span), way_back(of, back)
        rows.append(
            (name, "xPheve", f"{count} impacts, {span:.1f} s", taken, 1e3 * taken / count, energy, momentum, off)
        )
        bars += [
            _bar(f"{name}: energy within 1e-10 after {count} impacts", energy, 1e-10),
            _bar(f"{name}: momentum equals the impulses of the walls within 1e-10", momentum, 1e-10),
            _bar(f"{name}: velocities turned round after {back} impacts: back at the start within 1e-8", off, 1e-8),
        ]
        for peer in peers:
            rows += _peer(name, of, peer, span)
    return {
        "id": "tumbling",
        "title": "a box and a capsule tumble in a room",
        "names": NAMES,
        "rows": [_cells(row) for row in rows],
        "text": "Energy error: relative, at the end; of the peers, too. Momentum in units of the largest that the energy allows.",
        "bars": bars,
    }


def _peer(name: str, of: Stage, peer: str, span: float) -> list[Sequence[Any]]:
    module = import_module(IMPACTS[peer])
    if not hasattr(module, "World"):
        return []
    found: list[Sequence[Any]] = []
    for setting in ("default", "tuned"):
        for dt in STEPS:
            try:
                world = module.World(of, setting, dt)
            except LookupError as wrong:
                found.append((name, f"{module.NAME} {setting}", f"left out: {wrong}", None, None, None, None, None))
                break
            took = cpu_time(lambda world=world, dt=dt: world.advance(round(span / dt)))  # type: ignore[misc]
            found.append(
                (name, f"{module.NAME} {setting}", step_of(dt), took, None, of.drift(world.read()), None, None)
            )
    return found


def _bar(text: str, found: float, limit: float) -> dict[str, Any]:
    return {"text": text, "found": f"{found:.1e}", "met": found <= limit}


def _cells(row: Sequence[Any]) -> list[str]:
    name, engine, setting, taken, each, *errors = row
    told = ["-" if one is None else "not finite" if not math.isfinite(one) else f"{one:.1e}" for one in errors]
    return [name, engine, setting, seconds(taken), "-" if each is None else f"{each:.2f}", *told]
