"""Three equal bodies that chase one another along a figure eight, for ten periods.

Start: C. Simo; A. Chenciner, R. Montgomery, Annals of Mathematics 152, 881 (2000), with its eight digits, which are taken as exact.
"""

from __future__ import annotations

import numpy as np

from benchmarks import references
from benchmarks.smooth.problem import Bar, End, Problem, Swarm, distance, relative, steps, swarm_engine, tolerances

PERIOD = 6.32591398
SPAN = 10 * PERIOD
NAME = "figure_eight"


def start() -> Swarm:
    """The three bodies in a line."""
    x, v = (0.97000436, -0.24308753), (-0.93240737, -0.86473146)
    return Swarm(
        np.ones(3),
        np.array([[*x, 0.0], [-x[0], -x[1], 0.0], [0.0, 0.0, 0.0]]),
        np.array([[-0.5 * v[0], -0.5 * v[1], 0.0], [-0.5 * v[0], -0.5 * v[1], 0.0], [*v, 0.0]]),
    )


def error(end: End) -> float:
    """The largest error of a place as seen from body 0."""
    known = references.load(NAME)[0]
    high, low = (relative(part[:9].reshape(3, 3)) for part in (known.high, known.low))
    return distance(relative(end.position), high, low)


SWARM = start()
PROBLEMS = [
    Problem(
        id="figure eight",
        title="three bodies on a figure eight, 10 periods",
        span=SPAN,
        metric="largest error of a place",
        build=swarm_engine(SWARM),
        ours=[
            *tolerances("core:adaptive", 6, 9, 11, 13),
            *steps("core:symplectic8", SPAN, 500, 1000, 2000, 5000, 10_000),
            *steps("core:symplectic6", SPAN, 1000, 4000),
            *steps("core:symplectic4", SPAN, 1000, 4000),
            *steps("core:midpoint", SPAN, 1000, 10_000),
        ],
        error=error,
        drift=SWARM.drift,
        swarm=SWARM,
        peers={
            "rebound": [
                *(("ias15", eps) for eps in (1e-6, 1e-7, 1e-8, 1e-9)),
                *(("bs", eps) for eps in (1e-8, 1e-11, 1e-14)),
                ("leapfrog", 2, PERIOD / 1000),
                *(("leapfrog", 8, PERIOD / n) for n in (100, 300, 1000)),
            ],
            "heyoka": [1e-6, 1e-9, 1e-12, 0.0, "high accuracy"],
            "scipy": [("DOP853", 1e-6), ("DOP853", 1e-9), ("DOP853", 1e-13), ("LSODA", 1e-12), ("Radau", 1e-6)],
        },
        bars=[Bar("6e-14, on or ahead of the front of every peer", "front", error=6e-14)],
        short=1.0,
    )
]
