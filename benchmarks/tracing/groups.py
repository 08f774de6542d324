"""The scenes, who takes part in each, and how a scene is measured."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.measure import middle
from benchmarks.tracing import air, air_peers, cutoff, cutoff_peers, springs, springs_peers
from benchmarks.tracing.runner import Make, Start, clock_time, in_turns, ratio, steps_for, tiers

OURS = "xPheve"
COMPILED_BAR, NUMPY_BAR = 1.2, 1.3
SPAN = 64  # steps over which errors are taken
REFINED = (1, 2, 4)


@dataclass(frozen=True)
class Group:
    """One scene at one size with those that are compared; ``units`` is how many of ``unit`` a step has."""

    scene: str
    tier: str
    unit: str
    start: Callable[[], Start]
    units: Callable[[Start], int]
    ours: Make
    peers: Mapping[str, Make]
    bar: float | None
    dt: float
    reference: Callable[[Start, float], Any]
    energy: Callable[..., float] | None = None
    timed_dt: float | None = None
    """A shorter step for timing, where many cheap steps would carry the scene into another regime, such as rest."""


def _air(n: int, tier: str, scene: str = "air", drag: str = "basic:quadratic_drag") -> Group:
    numpy = tier == "NumPy"
    ours = air.engine(drag, "never" if numpy else "always")
    peers, bar = (air_peers.NUMPY, NUMPY_BAR) if numpy else (air_peers.COMPILED, COMPILED_BAR)
    bound = None if numpy and n < 1000 else bar
    return Group(
        scene,
        tier,
        "body",
        lambda: air.start(n),
        lambda begin: begin.n,
        ours,
        peers,
        bound,
        air.DT,
        air.reference,
        None,
        2.0**-16,
    )


def _springs(n: int, count: int) -> Group:
    return Group(
        "springs", "compiled", "spring", lambda: springs.start(n, count), lambda begin: len(begin.more["pairs"]),
        springs.engine(), springs_peers.COMPILED, COMPILED_BAR, springs.DT, springs.reference, springs.energy,
    )  # fmt: skip


def _cutoff(n: int) -> Group:
    return Group(
        "cutoff", "compiled", "pair", lambda: cutoff.start(n), lambda begin: len(cutoff.near(begin.position)),
        cutoff.engine(), cutoff_peers.COMPILED, COMPILED_BAR, cutoff.DT, cutoff.reference, cutoff.energy,
    )  # fmt: skip


TITLES = {
    "air": "gravity, quadratic drag, wind",
    "outside": "the same, with drag from a pack outside the repository",
    "springs": "a network of springs",
    "cutoff": "a smooth Lennard-Jones with a cutoff",
}


def groups(quick: bool = False) -> list[Group]:
    """All groups; ``quick``: small ones."""
    sizes = (10, 40) if quick else (10, 1000, 100_000)
    air_like = [_air(n, "compiled") for n in sizes] + [_air(n, "compiled", "outside", air.OUTSIDE) for n in sizes]
    numpy = [_air(n, "NumPy") for n in sizes]
    joined = [_springs(27, 60) if quick else _springs(springs.N, springs.SPRINGS)]
    return [*air_like, *numpy, *joined, _cutoff(60 if quick else cutoff.N)]


def refined(quick: bool = False) -> list[Group]:
    """Those on which the order of the error is shown: sizes for which the reference takes seconds."""
    joined = _springs(27, 60) if quick else _springs(springs.N, springs.SPRINGS)
    return [
        _air(10 if quick else 1000, "compiled"),
        _air(10 if quick else 1000, "NumPy"),
        joined,
        _cutoff(60 if quick else 500),
    ]


def contenders(group: Group) -> dict[str, Make]:
    """Ours and the peers."""
    return {OURS: group.ours, **group.peers}


def measure(group: Group, samples: int, quick: bool = False) -> dict[str, Any]:
    """One group: what each takes, where it ends, and our time over that of each peer."""
    begin, dt = group.start(), group.timed_dt or group.dt
    runners, built, first = {}, {}, {}
    for name, make in contenders(group).items():
        built[name] = clock_time(lambda name=name, make=make: runners.update({name: make(begin, dt)}))
        first[name] = clock_time(lambda name=name: runners[name].advance(1))
    steps = 2
    if not quick:
        fastest = max(group.peers, key=lambda name: steps_for(group.peers[name](begin, dt)))
        ours = group.ours(begin, dt)
        ours.advance(1)  # plans and compiles
        steps = min(steps_for(group.peers[fastest](begin, dt)), steps_for(ours, 2.0))
    times = in_turns(runners, steps, samples)
    units = group.units(begin)
    rows = []
    for name, runner in runners.items():
        seconds, spread = middle(times[name])
        row = {
            "engine": name,
            "seconds": seconds,
            "spread": spread,
            "ns": 1e9 * seconds / units,
            "built": built[name],
            "first": first[name],
        }
        row["ratio"] = 1.0 if name == OURS else ratio(times, OURS, name)
        if group.energy is not None:
            row["drift"] = (
                group.energy(begin, *runner.read()) / group.energy(begin, begin.position, begin.velocity) - 1.0
            )
        rows.append(row)
    peer = max(rows[1:], key=lambda row: row["ratio"])
    _errors(group, begin, rows)
    return {
        "scene": group.scene, "tier": group.tier, "unit": group.unit, "n": begin.n, "units": units, "steps": steps, "dt": group.dt,
        "timed_dt": dt, "rows": rows, "against": peer["engine"], "ratio": peer["ratio"], "bar": group.bar,
        "met": None if group.bar is None else peer["ratio"] <= group.bar, "tiers": tiers(runners[OURS].engine),
    }  # fmt: skip


def _errors(group: Group, begin: Start, rows: Sequence[dict[str, Any]]) -> None:
    """Distance [m] of the worst body from the reference after `SPAN` steps; the first bodies, where all are for themselves."""
    expected = group.reference(begin, SPAN * group.dt)
    for row in rows:
        row["error"] = error(contenders(group)[row["engine"]], begin, group.dt, SPAN, expected)


def error(make: Make, begin: Start, dt: float, steps: int, expected: Any) -> float:
    """Distance [m] of the worst body from ``expected`` after ``steps`` steps."""
    runner = make(begin, dt)
    runner.advance(steps)
    return float(np.linalg.norm(runner.read()[0][: len(expected)] - expected, axis=1).max())


def order(group: Group) -> dict[str, Any]:
    """Errors of ours and of the first peer with steps halved twice, and the order that the last halving shows."""
    begin = group.start()
    expected = group.reference(begin, SPAN * group.dt)
    found = {}
    for name in (OURS, next(iter(group.peers))):
        errors = [error(contenders(group)[name], begin, group.dt / k, SPAN * k, expected) for k in REFINED]
        found[name] = {"errors": errors, "order": math.log2(errors[-2] / errors[-1])}
    return {
        "scene": group.scene,
        "tier": group.tier,
        "n": begin.n,
        "dt": [group.dt / k for k in REFINED],
        "found": found,
    }
