"""REBOUND. IAS15 (epsilon 1e-9 is its default), WHFast (default and with corrector 17), leapfrog of order 2 and 8, Bulirsch-Stoer, SABA(10,6,4).

H. Rein, S.-F. Liu, A&A 537, A128 (2012); IAS15: H. Rein, D. Spiegel, MNRAS 446, 1424 (2015).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import rebound

from benchmarks.smooth.problem import End, Problem
from benchmarks.turns import Contender, row

NAME, MODULE = "REBOUND", "rebound"


def smooth(problem: Problem) -> list[Contender]:
    """A contender a setting; only scenes of points that attract one another."""
    return [] if problem.swarm is None else [_contender(problem, tuple(one)) for one in problem.peers.get(MODULE, ())]


def _contender(problem: Problem, setting: tuple[Any, ...]) -> Contender:
    def make() -> tuple[Callable[[], Any], Callable[[], End]]:
        sim = simulation(problem.swarm, setting)

        def go() -> None:
            sim.integrate(problem.span)
            sim.synchronize()

        return go, lambda: read(sim)

    kind, said, dt, note = describe(setting)
    return Contender(row(problem, f"{NAME} {kind}", said, dt, note), make)


def describe(setting: tuple[Any, ...]) -> tuple[str, str, float | None, str]:
    """Method, setting in words, step, note."""
    kind = setting[0]
    if kind == "ias15":
        return kind, f"epsilon {setting[1]:.0e}", None, "its default" if setting[1] == 1e-9 else ""
    if kind == "bs":
        return kind, f"eps {setting[1]:.0e}", None, ""
    if kind == "leapfrog":
        return f"leapfrog{setting[1]}", f"dt {setting[2]:.4g}", setting[2], ""
    return kind, f"dt {setting[1]:.4g}", setting[1], ""


def simulation(swarm: Any, setting: tuple[Any, ...]) -> Any:
    """The points, ready to be integrated."""
    sim = rebound.Simulation()
    sim.G = swarm.constant
    for m, x, v in zip(swarm.mass.tolist(), swarm.position.tolist(), swarm.velocity.tolist(), strict=True):
        sim.add(m=m, x=x[0], y=x[1], z=x[2], vx=v[0], vy=v[1], vz=v[2])
    kind = setting[0]
    if kind == "ias15":
        sim.integrator = "ias15"
        sim.integrator.epsilon = setting[1]
    elif kind == "bs":
        sim.integrator = "bs"
        sim.integrator.eps_rel = sim.integrator.eps_abs = setting[1]
    elif kind == "leapfrog":
        sim.integrator = "leapfrog"
        sim.integrator.order = setting[1]
        sim.dt = setting[2]
    elif kind.startswith("saba"):
        sim.integrator = "saba"  # its default type is (10, 6, 4)
        sim.integrator.safe_mode = 0
        sim.dt = setting[1]
    else:
        sim.integrator = "whfast"
        sim.integrator.safe_mode = 0
        sim.dt = setting[1]
        if "corrector" in kind:
            sim.integrator.corrector = 17
    return sim


def read(sim: Any) -> End:
    """Where all are."""
    points = [sim.particles[k] for k in range(sim.N)]
    return End(np.array([[p.x, p.y, p.z] for p in points]), np.array([[p.vx, p.vy, p.vz] for p in points]))
