"""What all contenders of a scene have in common: a start, something that advances, times taken in turns."""

from __future__ import annotations

import inspect
import statistics
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from benchmarks.measure import cpu_time

Array = Any
TURN = 0.5  # [s] a turn of the fastest contender takes about this long


@dataclass(frozen=True)
class Start:
    """Where a scene begins: arrays of shape (n, 3) or (n,), in SI, and what else its laws need."""

    position: Array
    velocity: Array
    mass: Array
    more: dict[str, Any] = field(default_factory=dict)

    @property
    def n(self) -> int:
        """How many bodies."""
        return len(self.mass)

    def first(self, n: int) -> Start:
        """The first ``n`` bodies only; for laws in which bodies do not know one another."""
        more = {key: value[:n] if isinstance(value, np.ndarray) else value for key, value in self.more.items()}
        return Start(self.position[:n], self.velocity[:n], self.mass[:n], more)


@dataclass
class Runner:
    """One contender, built: ``advance(k)`` makes k steps, ``read()`` gives positions and velocities, shape (n, 3)."""

    advance: Callable[[int], Any]
    read: Callable[[], tuple[Array, Array]]
    engine: Any = None


Make = Callable[[Start, float], Runner]
"""Builds a contender for steps of ``dt`` [s]."""


def has_loop() -> bool:
    """Whether this engine takes ``compile=``; one that does not is measured as it is."""
    import xpheve as xp

    return "compile" in inspect.signature(xp.PhysicsEngine).parameters


def new_engine(compile: str) -> Any:
    """An engine with z up; ``compile`` is auto, always or never."""
    import xpheve as xp

    return xp.PhysicsEngine(up="z", **({"compile": compile} if has_loop() else {}))


def engine_runner(engine: Any, objects: Any, dt: float) -> Runner:
    """An engine as a contender. ``dt`` should be a power of two: then k dt is exact, and every run ends on its grid."""
    done = 0

    def advance(steps: int) -> None:
        nonlocal done
        done += steps
        engine.run(until=done * dt, dt=dt)

    def read() -> tuple[Array, Array]:
        return np.array([one.position for one in objects]), np.array([one.velocity for one in objects])

    return Runner(advance, read, engine)


def tiers(engine: Any) -> dict[str, int]:
    """How many laws run where, as `engine.explain()` says; ``-`` of an engine that does not say."""
    return dict(Counter(str(law.get("tier", "-")) for law in engine.explain().data["laws"]))


def steps_for(runner: Runner, seconds: float = TURN) -> int:
    """How many steps take about ``seconds``."""
    steps = 1
    while True:
        took = cpu_time(partial(runner.advance, steps))
        if took > 0.1 * seconds:
            return max(1, round(steps * seconds / took))
        steps *= 4


def in_turns(runners: Mapping[str, Runner], steps: int, samples: int) -> dict[str, list[float]]:
    """CPU times [s] of a step. Each contender has its turn ``samples`` times, so that a busy machine is busy for all."""
    found: dict[str, list[float]] = {name: [] for name in runners}
    for _ in range(samples):
        for name, runner in runners.items():
            found[name].append(cpu_time(partial(runner.advance, steps)) / steps)
    return found


def ratio(times: Mapping[str, list[float]], ours: str, peer: str) -> float:
    """Median over the turns of our time over that of a peer."""
    return statistics.median(a / b for a, b in zip(times[ours], times[peer], strict=True))


def clock_time(act: Callable[[], Any]) -> float:
    """Seconds on the clock that ``act()`` takes."""
    begin = time.perf_counter()
    act()
    return time.perf_counter() - begin


def two_sum(total: Array, remainder: Array, step: Array) -> tuple[Array, Array]:
    """``total + step`` with what rounding left over: D. E. Knuth, The Art of Computer Programming 2, 4.2.2, theorem B."""
    step = step + remainder
    new = total + step
    back = new - total
    return new, (total - (new - back)) + (step - back)
