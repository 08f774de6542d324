"""Rows of a scene: CPU time in turns beside error, drift, and what was paid once."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from benchmarks.measure import Row, cpu_time, middle
from benchmarks.problem import Scene

Go = Callable[[], Any]
SHORTEST = 2e-3  # [s] a sample shorter than this is made of several runs,
BUILDING = 0.1  # [s] as long as building all that takes no longer than this
ENOUGH = 2.6  # [s] of samples of one row, if not said otherwise, after which there are no more of it; rows of fewer samples say so
LONGEST = 12.0  # [s] a run that took longer is the last of its kind: finer settings of the same method are left out


@dataclass
class Contender:
    """What fills a row: ``make()`` builds and gives (go, end); ``go()`` is timed, ``end()`` tells where all are.

    ``parts`` is how many runs ``go`` makes; the time is that of one. ``watch()`` gives the ends at several times of a run that is not timed.
    """

    row: Row
    make: Callable[[], tuple[Go, Callable[[], Any]]]
    parts: int = 1
    watch: Callable[[], Sequence[Any]] | None = None


def row(problem: Scene, engine: str, setting: str, dt: float | None = None, note: str = "") -> Row:
    """An empty row."""
    return Row(problem.id, engine, setting, dt, note=note)


def together(several: Sequence[Contender]) -> Contender:
    """Contenders of the same row with different starts, as one whose end is the tuple of all ends."""

    def make() -> tuple[Go, Callable[[], Any]]:
        made = [one.make() for one in several]

        def go() -> None:
            for each, _ in made:
                each()

        return go, lambda: tuple(end() for _, end in made)

    return Contender(several[0].row, make, len(several))


def take_turns(problem: Scene, contenders: Sequence[Contender], samples: int, enough: float = ENOUGH) -> list[Row]:
    """Fill the rows of a scene; each contender has its turn ``samples`` times, so that a busy machine is busy for all.

    What fails or refuses is a row that says so: it has no time.
    """
    ready: list[tuple[Contender, int, int]] = []
    slow: dict[str, float] = {}
    for one in contenders:
        if one.row.engine in slow:
            one.row.note = f"left out: the setting before took {slow[one.row.engine]:.0f} s"
            continue
        found = _first(problem, one)
        if found is None:
            continue
        if found[1] > LONGEST:
            slow[one.row.engine] = found[1]
        made, ran = found
        runs = max(1, min(200, math.ceil(SHORTEST / max(ran, 1e-7)), int(BUILDING / max(made, 1e-7))))
        ready.append((one, runs, max(1, min(samples, round(enough / max(ran, 1e-7))))))
    times: list[list[float]] = [[] for _ in ready]
    for turn in range(samples):
        for (one, runs, wanted), found_times in zip(ready, times, strict=True):
            if turn < wanted:
                found_times.append(sum(cpu_time(one.make()[0]) for _ in range(runs)) / runs)
    for (one, _, wanted), found_times in zip(ready, times, strict=True):
        one.row.seconds, one.row.spread = middle([found / one.parts for found in found_times])
        one.row.more["samples"] = wanted
    return [one.row for one in contenders]


def _first(problem: Scene, one: Contender) -> tuple[float, float] | None:
    """A run to warm up, from which errors are told: CPU time [s] of building and running a second one; None if there is no such run."""
    try:
        begin = time.process_time()
        go, end = one.make()
        one.row.more["built"] = (time.process_time() - begin) / one.parts
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            first = cpu_time(go)
        if told:
            one.row.more["warned"] = sorted({type(each.message).__name__ for each in told})
        one.row.more["first"] = first / one.parts
        at = end()
    except Exception as wrong:  # a contender that fails is a row that says so
        one.row.note = f"{one.row.note}; " * bool(one.row.note) + f"{type(wrong).__name__}: {_short(wrong)}"
        return None
    one.row.error = problem.error(at)
    if problem.drift is not None:
        one.row.drift = problem.drift(at)
    one.row.more["measures"] = {name: measure(at) for name, measure in problem.measures.items()}
    if problem.watched is not None and one.watch is not None:
        seen = problem.watched(one.watch())
        one.row.error = seen.pop("error", one.row.error)
        one.row.more["measures"] |= seen
    if not math.isfinite(one.row.error):
        one.row.note, one.row.error = "not finite at the end", None
        return None
    if first > 1.0:
        return 0.0, first
    begin = time.process_time()
    again, _ = one.make()
    return time.process_time() - begin, cpu_time(again)


def _short(wrong: Exception) -> str:
    text = " ".join(str(wrong).split())
    return text if len(text) < 160 else text[:157] + "..."
