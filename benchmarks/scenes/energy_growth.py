"""How the error of energy grows over 1e6 steps: two bodies, e = 0.2, 20 starts shifted by units in the last place.

Told is the rms over the starts at whole periods.

If nothing but rounding is left and rounding has no preference, it grows as the root of the number of steps, a slope
of 0.5 (D. Brouwer, Astronomical Journal 46, 149 (1937)). At whole periods the error of a symplectic method, which
swings with the orbit, is back where it began.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from benchmarks.front import seconds
from benchmarks.measure import cpu_time
from benchmarks.smooth.ours import built
from benchmarks.smooth.problem import End, Ours, Problem, Swarm, swarm_engine

ID, TITLE = "energy growth", "two bodies, e = 0.2: error of energy over 1e6 steps"
ECCENTRICITY, COMPANION, STARTS = 0.2, 1e-3, 20
MU = 1.0 + COMPANION
PERIOD = 2.0 * math.pi / math.sqrt(MU)
ORBITS = (10, 30, 100, 300, 1000, 5000, 35_000)
STEPS = 200  # an orbit, where dt is given
SLOPE_BAR = 0.55


def start(k: int) -> Swarm:
    """Two bodies at pericentre; start ``k`` has velocities of other last digits."""
    r = 1.0 - ECCENTRICITY
    v = math.sqrt(MU * (1.0 + ECCENTRICITY) / (1.0 - ECCENTRICITY)) * (1.0 + 2.0**-52 * (3 * k))
    shares = np.array([-COMPANION / MU, 1.0 / MU])
    zero = np.zeros(2)
    return Swarm(
        np.array([1.0, COMPANION]),
        np.stack([r * shares, zero, zero], axis=1),
        np.stack([zero, v * shares, zero], axis=1),
    )


Walk = Callable[[float], tuple[End, int]]
"""Carries on to a time; tells where all are, and how many steps were made."""


def ours(one: Ours) -> Callable[[Swarm], Walk]:
    """Makes a walk of xPheve."""

    def make(swarm: Swarm) -> Walk:
        from benchmarks.smooth.ours import read

        problem = Problem(ID, TITLE, PERIOD, "", swarm_engine(swarm), (), lambda end: 0.0)
        engine, bodies = built(problem, one)

        def walk(t: float) -> tuple[End, int]:
            engine.run(until=t, **one.run)
            return read(bodies), _steps(engine, t, one)

        return walk

    return make


def _steps(engine: Any, t: float, one: Ours) -> int:
    if "dt" in one.run:
        return round(t / one.run["dt"])
    return int(sum(group.get("steps", 0) for group in engine.explain().data["groups"]))


def rebound(setting: tuple[Any, ...]) -> Callable[[Swarm], Walk]:
    """Makes a walk of REBOUND."""
    from benchmarks.peers import rebound_peer

    def make(swarm: Swarm) -> Walk:
        sim = rebound_peer.simulation(swarm, setting)
        sim.exact_finish_time = 1

        def walk(t: float) -> tuple[End, int]:
            sim.integrate(t)
            sim.synchronize()
            return rebound_peer.read(sim), int(sim.steps_done)

        return walk

    return make


def growth(make: Callable[[Swarm], Walk], orbits: Sequence[int], starts: int) -> tuple[list[int], list[float], float]:
    """Steps (mean) and rms of the relative error of energy at each of ``orbits``; CPU time [s] of a step."""
    errors, counts, spent = np.zeros((starts, len(orbits))), np.zeros((starts, len(orbits))), 0.0
    for k in range(starts):
        swarm = start(k)
        walk = make(swarm)
        walk(1e-9 * PERIOD)
        for column, orbit in enumerate(orbits):
            found: list[tuple[End, int]] = []
            spent += cpu_time(lambda walk=walk, found=found, orbit=orbit: found.append(walk(orbit * PERIOD)))
            end, counts[k, column] = found[0]
            errors[k, column] = swarm.drift(end)
    rms = np.sqrt((errors * errors).mean(axis=0))
    return [round(c) for c in counts.mean(axis=0)], rms.tolist(), spent / max(counts[:, -1].sum(), 1.0)


def slope(steps: Sequence[float], rms: Sequence[float]) -> float:
    """The slope of the straight line through the logarithms, by least squares."""
    x, y = np.log(np.maximum(steps, 1)), np.log(np.maximum(rms, 1e-18))
    x, y = x - x.mean(), y - y.mean()
    return float((x * y).sum() / (x * x).sum())


def measure(samples: int, quick: bool, peers: Sequence[str] = ()) -> dict[str, Any]:
    """The rows of the table, the curves, and the bars."""
    orbits, starts = (ORBITS[:5], 3) if quick else (ORBITS, STARTS)
    made: list[tuple[str, str, Any, Sequence[int]]] = [
        (
            "xPheve adaptive",
            "rtol 1e-13",
            ours(Ours("adaptive", "core:adaptive", {"rtol": 1e-13, "atol": 1e-16})),
            orbits,
        ),
        (
            "xPheve symplectic8",
            f"{STEPS} steps an orbit",
            ours(Ours("symplectic8", "core:symplectic8", {"dt": PERIOD / STEPS})),
            orbits[:-1],
        ),
    ]
    if "rebound" in peers:
        made += [
            ("REBOUND ias15", "epsilon 1e-09", rebound(("ias15", 1e-9)), orbits[:-2]),
            ("REBOUND leapfrog8", f"{STEPS} steps an orbit", rebound(("leapfrog", 8, PERIOD / STEPS)), orbits[:-2]),
        ]
    rows, bars, curves = [], [], {}
    for engine, setting, make, spans in made:
        try:
            steps, rms, each = growth(make, spans, starts)
        except Exception as wrong:  # what fails or is not there is a row that says so
            rows.append(
                [engine, setting, "-", "-", "-", "-", f"{type(wrong).__name__}: {' '.join(str(wrong).split())[:120]}"]
            )
            continue
        fitted = slope(steps, rms)
        rows.append(
            [engine, setting, f"{steps[-1]:,}", f"{rms[-1]:.1e}", f"{fitted:.2f}", seconds(each), f"{starts} starts"]
        )
        curves[engine] = [steps, rms]
        if engine.startswith("xPheve"):
            text = f"{engine.partition(' ')[2]}: rms over 20 shifted starts grows with slope at most 0.55"
            enough = steps[-1] >= 9e5 and starts == STARTS
            met = bool(fitted <= SLOPE_BAR) if enough else None
            bars.append({"text": text, "found": f"{fitted:.2f} over {steps[-1]:,} steps, to {rms[-1]:.1e}", "met": met})
    names = ["engine", "setting", "steps", "rms of the energy error", "slope", "CPU time a step", "note"]
    return {
        "id": ID,
        "title": TITLE,
        "names": names,
        "rows": rows,
        "bars": bars,
        "curves": curves,
        "text": "",
        "file": "energy_growth",
    }
