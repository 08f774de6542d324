"""Measuring: CPU time of this process, in turns, medians of nine."""

from __future__ import annotations

import gc
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

SAMPLES = 9
SHORTEST = 2e-3  # [s] a sample shorter than this is made of several runs


@dataclass
class Row:
    """One engine with one setting on one scene."""

    scene: str
    engine: str
    setting: str
    dt: float | None = None
    seconds: float | None = None
    spread: float | None = None
    """Half the distance of the quartiles, over the median."""
    error: float | None = None
    drift: float | None = None
    note: str = ""
    more: dict[str, Any] = field(default_factory=dict)

    def plain(self) -> dict[str, Any]:
        """As values for files."""
        return asdict(self)


@dataclass
class Contender:
    """What fills a row: ``make()`` builds and gives (go, end); ``go()`` is timed, ``end()`` tells position and velocity."""

    row: Row
    make: Callable[[], tuple[Callable[[], Any], Callable[[], tuple[Any, Any]]]]


@dataclass
class Field:
    """A peer's many free spheres with one setting: back to the start, one step, positions and velocities of all."""

    setting: str
    start: Callable[[], Any]
    step: Callable[[], Any]
    read: Callable[[], tuple[Any, Any]]


def in_turns(contenders: Sequence[Contender], errors: Callable[[Any, Any], tuple[float, float]], samples: int) -> None:
    """Fill the rows: each contender has its turn ``samples`` times, so that a busy machine is busy for all."""
    runs: list[int] = []
    for one in contenders:
        go, end = one.make()
        took = cpu_time(go)
        one.row.error, one.row.drift = errors(*end())
        runs.append(max(1, min(50, int(SHORTEST / max(took, 1e-7)))))
    times: list[list[float]] = [[] for _ in contenders]
    for _ in range(samples):
        for one, count, found in zip(contenders, runs, times, strict=True):
            # Built and run one after the other: a peer may keep one world only.
            found.append(sum(cpu_time(one.make()[0]) for _ in range(count)) / count)
    for one, found in zip(contenders, times, strict=True):
        one.row.seconds, one.row.spread = middle(found)


def cpu_time(act: Callable[[], Any]) -> float:
    """CPU time [s] of ``act()``, the collector of garbage standing still."""
    was = gc.isenabled()
    gc.disable()
    try:
        begin = time.process_time()
        act()
        return time.process_time() - begin
    finally:
        if was:
            gc.enable()


def middle(found: Sequence[float]) -> tuple[float, float]:
    """Median, and half the distance of the quartiles over it."""
    median = statistics.median(found)
    if len(found) < 2 or median == 0:
        return median, 0.0
    low, _, high = statistics.quantiles(found, n=4)
    return median, 0.5 * (high - low) / median


def ratio(a: Callable[[], Any], b: Callable[[], Any], samples: int, repeat: int = 1) -> tuple[float, float, float]:
    """Median of time of ``a`` over time of ``b``, measured in turns, and the median times [s] of each."""
    times: list[tuple[float, float]] = []
    for act in (a, b):
        act()
    for _ in range(samples):
        times.append((_each(a, repeat), _each(b, repeat)))
    return (
        statistics.median(x / y for x, y in times),
        statistics.median(x for x, _ in times),
        statistics.median(y for _, y in times),
    )


def _each(act: Callable[[], Any], repeat: int) -> float:
    def many() -> None:
        for _ in range(repeat):
            act()

    return cpu_time(many) / repeat
