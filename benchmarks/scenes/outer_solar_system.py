"""The Sun and the four giant planets for 10,000 Julian years.

Start: J. H. Applegate, M. R. Douglas, Y. Guersel, P. Hunter, C. Seitz, G. J. Sussman, Astronomical Journal 92, 176
(1986), from ephemerides of JPL; as used by REBOUND's example of the outer Solar System and by heyoka's benchmarks.
Units: astronomical unit, day, mass of the Sun; the constant of gravity is the square of Gauss's constant. The numbers
stand for metres and seconds in our engine, which does not mind.
"""

from __future__ import annotations

import numpy as np

from benchmarks import references
from benchmarks.smooth.problem import Bar, End, Problem, Swarm, distance, relative, steps, swarm_engine, tolerances

NAME = "outer_solar_system"
YEARS = 10_000
SPAN = 365.25 * YEARS
JUPITER = 4332.6  # [d] about its period
GAUSS = 0.01720209895
MASS = np.array([1.00000597682, 1.0 / 1047.355, 1.0 / 3501.6, 1.0 / 22869.0, 1.0 / 19314.0])
PLACES = np.array(
    [
        [-4.06428567034226e-3, -6.08813756435987e-3, -1.66162304225834e-6],
        [3.40546614227466e0, 3.62978190075864e0, 3.42386261766577e-2],
        [6.60801554403466e0, 6.38084674585064e0, -1.36145963724542e-1],
        [1.11636331405597e1, 1.60373479057256e1, 3.61783279369958e-1],
        [-3.01777243405203e1, 1.91155314998064e0, -1.53887595621042e-1],
    ]
)
VELOCITIES = np.array(
    [
        [6.69048890636161e-6, -6.33922479583593e-6, -3.13202145590767e-9],
        [-5.59797969310664e-3, 5.51815399480116e-3, -2.66711392865591e-6],
        [-4.17354020307064e-3, 3.99723751748116e-3, 1.67206320571441e-5],
        [-3.25884806151064e-3, 2.06438412905916e-3, -2.17699042180559e-5],
        [-2.17471785045538e-4, -3.11361111025884e-3, 3.58344705491441e-5],
    ]
)
SWARM = Swarm(MASS, PLACES, VELOCITIES, GAUSS * GAUSS)


def error(end: End) -> float:
    """The largest error of a place as seen from the Sun [au]."""
    known = references.load(NAME)[0]
    high, low = (relative(part[:15].reshape(5, 3)) for part in (known.high, known.low))
    return distance(relative(end.position), high, low)


def years(*parts: int) -> list[int]:
    """Steps over the span, for so many a period of Jupiter."""
    return [round(SPAN / JUPITER * part) for part in parts]


PROBLEMS = [
    Problem(
        id="outer Solar System",
        title=f"the Sun and four giant planets, {YEARS:,} years",
        span=SPAN,
        metric="largest error of a place from the Sun [au]",
        build=swarm_engine(SWARM),
        ours=[
            *tolerances("core:adaptive", 6, 9, 11, 13),
            *steps("core:symplectic8", SPAN, *years(30, 60, 100, 200)),
            *steps("core:symplectic4", SPAN, *years(100, 400)),
            *steps("core:midpoint", SPAN, *years(100, 1000)),
        ],
        error=error,
        drift=SWARM.drift,
        swarm=SWARM,
        peers={
            "rebound": [
                *(("ias15", eps) for eps in (1e-6, 1e-7, 1e-8, 1e-9)),
                *(("whfast", JUPITER / n) for n in (20, 100, 400)),
                *(("whfast corrector 17", JUPITER / n) for n in (20, 100, 400)),
                ("saba(10,6,4)", JUPITER / 20),
                ("bs", 1e-11),
                ("bs", 1e-14),
                ("leapfrog", 2, JUPITER / 100),
                ("leapfrog", 8, JUPITER / 100),
            ],
            "heyoka": [1e-9, 1e-12, 0.0, "high accuracy"],
            "scipy": [("DOP853", 1e-9), ("DOP853", 1e-13)],
        },
        bars=[
            Bar(
                "5e-11 au in at most 0.6x IAS15's time",
                "ratio",
                error=5e-11,
                method="adaptive",
                setting="rtol 1e-13",
                peer="REBOUND ias15",
                peer_setting="epsilon 1e-09",
                ratio=0.6,
            )
        ],
        short=3000.0,
    )
]
