"""Two bodies on an ellipse of eccentricity 0.9, m2 = 1e-3 m1, for 100 and 1,000 orbits from pericentre to pericentre: where each error counts most.

The answer is Kepler's equation, solved with 60 digits from the same float64 numbers (`benchmarks.references.kepler`).
"""

from __future__ import annotations

import math

import numpy as np

from benchmarks.references.kepler import relative_state
from benchmarks.smooth.problem import Bar, End, Problem, Swarm, distance, relative, steps, swarm_engine, tolerances

ECCENTRICITY, COMPANION = 0.9, 1e-3
MU = 1.0 + COMPANION
PERIOD = 2.0 * math.pi / math.sqrt(MU)


def start() -> Swarm:
    """At pericentre, a = 1, the barycentre at rest in the origin as nearly as float64 has it."""
    r = 1.0 - ECCENTRICITY
    v = math.sqrt(MU * (1.0 + ECCENTRICITY) / (1.0 - ECCENTRICITY))
    shares = np.array([-COMPANION / MU, 1.0 / MU])
    zero = np.zeros(2)
    return Swarm(
        np.array([1.0, COMPANION]),
        np.stack([r * shares, zero, zero], axis=1),
        np.stack([zero, v * shares, zero], axis=1),
    )


def problem(orbits: int) -> Problem:
    """The scene over ``orbits`` orbits."""
    swarm, span = start(), orbits * PERIOD
    high, low = relative_state(swarm, span)

    def error(end: End) -> float:
        return distance(relative(end.position), high, low)

    exact, adaptive = {100: (5e-12, 5e-11), 1000: (1e-10, 3e-10)}[orbits]
    return Problem(
        id=f"Kepler {orbits:,}",
        title=f"two bodies, e = 0.9, {orbits:,} orbits",
        span=span,
        metric="error of the place of one from the other, in semi-major axes",
        build=swarm_engine(swarm),
        ours=[
            *tolerances("core:kepler", 9),
            *tolerances("core:adaptive", 6, 9, 11, 13),
            *steps("core:symplectic8", span, *(1000 * orbits, 4000 * orbits)[: 2 if orbits < 1000 else 1]),
            *steps("core:midpoint", span, *(1000 * orbits, 10_000 * orbits)[: 2 if orbits < 1000 else 1]),
        ],
        error=error,
        drift=swarm.drift,
        swarm=swarm,
        peers={
            "rebound": [
                ("whfast", PERIOD / 2),
                *(("ias15", eps) for eps in (1e-6, 1e-7, 1e-8, 1e-9)),
                *(("bs", eps) for eps in (1e-8, 1e-11, 1e-14)),
                *(("leapfrog", 2, PERIOD / 1000), ("leapfrog", 8, PERIOD / 1000)),
            ],
            "heyoka": [1e-9, 1e-12, 0.0],
            "scipy": [("DOP853", 1e-9), ("DOP853", 1e-13), ("LSODA", 1e-12)][: 3 if orbits < 1000 else 0],
        },
        bars=[
            Bar(f"*kepler*: within {exact:.0e}", "all errors", error=exact, method="kepler"),
            Bar(
                f"*adaptive*: within {adaptive:.0e}, at no more time than IAS15 at no larger error",
                "front",
                error=adaptive,
                method="adaptive",
                setting="rtol 1e-13",
                peer="REBOUND ias15",
            ),
        ],
        short=3.0,
    )


PROBLEMS = [problem(100), problem(1000)]
