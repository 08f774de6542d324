"""Burrau's problem: masses 3, 4, 5 let go at the corners of a triangle of sides 3, 4, 5.

To t = 70, past close encounters that enlarge errors by some 1e14.

One start would tell luck: 20 starts, shifted by one unit in the last place here and there, each have an answer of
their own in quadruple precision. The row shows the median of 20 errors, and the time of all 20 runs over 20.

Source: C. Burrau, Astronomische Nachrichten 195, 113 (1913); V. Szebehely, C. F. Peters, Astronomical Journal 72, 876
(1967).
"""

from __future__ import annotations

import numpy as np

from benchmarks import references
from benchmarks.smooth.problem import Bar, End, Problem, Swarm, distance, relative, swarm_engine, tolerances

SPAN, STARTS = 70.0, 20
NAME = "pythagorean"
MASS = np.array([3.0, 4.0, 5.0])
PLACES = np.array([[1.0, 3.0, 0.0], [-2.0, -1.0, 0.0], [1.0, -1.0, 0.0]])


def shifted(k: int) -> Swarm:
    """Start ``k``: each coordinate a unit in the last place less, the same, or more, by the digits of a number to base three."""
    digits = [((7 * k + 1) // 3**power) % 3 - 1 for power in range(6)] if k else [0] * 6
    places = PLACES.copy()
    for number, digit in enumerate(digits):
        i, c = divmod(number, 2)
        places[i, c] = places[i, c] if digit == 0 else np.nextafter(places[i, c], digit * np.inf)
    return Swarm(MASS, places, np.zeros((3, 3)))


def error_of(k: int, end: End) -> float:
    """The largest error of a place as seen from body 0, of start ``k``."""
    known = references.load(NAME)[k]
    high, low = (relative(part[:9].reshape(3, 3)) for part in (known.high, known.low))
    return distance(relative(end.position), high, low)


SWARMS = [shifted(k) for k in range(STARTS)]


def single(k: int) -> Problem:
    """Start ``k`` by itself."""
    swarm = SWARMS[k]
    return Problem(
        id="Pythagorean",
        title="three bodies let go at rest, t = 70, 20 starts shifted by an ulp",
        span=SPAN,
        metric="largest error of a place; the median of 20 starts",
        build=swarm_engine(swarm),
        ours=tolerances("core:adaptive", 9, 11, 13),
        error=lambda end: error_of(k, end),
        drift=swarm.drift,
        swarm=swarm,
        peers={
            "rebound": [("ias15", 1e-6), ("ias15", 1e-9), ("bs", 1e-11), ("bs", 1e-14)],
            "heyoka": [1e-9, 1e-12, 0.0],
            "scipy": [("DOP853", 1e-13)],
        },
        bars=[
            Bar(
                "median error no larger than IAS15's, in at most 0.8x its time",
                "ratio",
                method="adaptive",
                setting="rtol 1e-13",
                peer="REBOUND ias15",
                peer_setting="epsilon 1e-09",
                ratio=0.8,
                no_larger=True,
            )
        ],
        short=1.0,
    )


PROBLEMS = [single(0)]
VARIANTS = [single(k) for k in range(STARTS)]
