"""A planet that moves, and 100,000 particles of next to no mass that orbit it, once round the inmost.

They stand beside the same particles in a fixed field.

What is between is the price of a source that moves: at most twice the time is the bar. Errors are those of 50
particles against Kepler's equation with 60 digits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

import xpheve as xp
from benchmarks.front import seconds
from benchmarks.measure import cpu_time, middle, ratio
from benchmarks.references.kepler import relative_state
from benchmarks.smooth.ours import asked
from benchmarks.smooth.problem import Ours, Swarm

ID, TITLE, N = "dust", "a planet and 100,000 particles, one orbit", 100_000
PERIOD = 2.0 * math.pi  # of the inmost
DRIFT = (0.01, 0.02, 0.0)  # [m/s] of the planet
STEPS, RATIO_BAR = 100, 2.0
MASSLESS = 1e-25  # [kg] in the reference: particles pull a planet of 1 kg by less than its last digit


class FixedField(xp.FieldLaw):
    """Attraction to the origin: F = -m mu x / |x|^3."""

    id = "benchmarks:fixed_field"

    mu = xp.Param(1.0, unit="m^3/s^2", ge=0, doc="mu.")

    def force(self, body: Any) -> Any:
        """Force on each body [N]."""
        square = body.position.dot(body.position)
        return -self.mu * body.mass / (square * np.sqrt(square)) * body.position

    def potential(self, body: Any) -> Any:
        """Potential energy [J]."""
        return -self.mu * body.mass / body.position.norm()


def particles(n: int) -> tuple[Any, Any]:
    """Places and velocities, (n, 3): circles of radius 1 to 2, leaning a little."""
    random = np.random.default_rng(7)
    radius, phase, lean = (
        random.uniform(1.0, 2.0, n),
        random.uniform(0.0, 2.0 * math.pi, n),
        random.uniform(-0.1, 0.1, n),
    )
    x = np.stack([np.cos(phase), np.sin(phase) * np.cos(lean), np.sin(phase) * np.sin(lean)], axis=1) * radius[:, None]
    v = np.stack([-np.sin(phase), np.cos(phase) * np.cos(lean), np.cos(phase) * np.sin(lean)], axis=1)
    return x, v / np.sqrt(radius)[:, None]


def with_planet(n: int, stepper: str | None, run: dict[str, float]) -> tuple[Callable[[], Any], Callable[[], Any]]:
    """(act, places of the particles from the planet): the planet moves, and pulls the particles by a one-sided law."""
    engine = asked(stepper)
    x, v = particles(n)
    planet = xp.PhysicalObject(mass=1.0, velocity=DRIFT)
    dust = [
        xp.PhysicalObject(mass=1.0, position=a, velocity=b)
        for a, b in zip(x.tolist(), (v + DRIFT).tolist(), strict=True)
    ]
    engine.add_objects([planet, *dust])
    engine.add_law("basic:universal_gravity", gravitational_constant=1.0, between=([planet], dust), one_sided=True)
    return _acts(engine, run), lambda: np.asarray(engine.bodies.position)[1:] - np.asarray(engine.bodies.position)[0]


def alone(n: int, stepper: str | None, run: dict[str, float]) -> tuple[Callable[[], Any], Callable[[], Any]]:
    """The same particles in a field that is fixed in the origin."""
    engine = asked(stepper)
    x, v = particles(n)
    dust = [xp.PhysicalObject(mass=1.0, position=a, velocity=b) for a, b in zip(x.tolist(), v.tolist(), strict=True)]
    engine.add_objects(dust, laws=[engine.add_law(FixedField)])
    return _acts(engine, run), lambda: np.asarray(engine.bodies.position)


def _acts(engine: Any, run: dict[str, float]) -> Callable[[], Any]:
    engine.run(until=0.0, **run)
    turns = [0]

    def act() -> Any:
        turns[0] += 1
        engine.run(until=turns[0] * STEPS * (PERIOD / STEPS), **run)

    return act


def error(places: Any, n: int) -> float:
    """The largest error of 50 of the particles, as seen from the planet, after one turn."""
    x, v = particles(n)
    worst = 0.0
    for k in range(0, n, max(1, n // 50)):
        pair = Swarm(np.array([1.0, MASSLESS]), np.stack([np.zeros(3), x[k]]), np.stack([DRIFT, v[k] + DRIFT]))
        high, low = relative_state(pair, STEPS * (PERIOD / STEPS))
        worst = max(worst, float(np.linalg.norm((places[k] - high[0]) - low[0])))
    return worst


def settings(quick: bool) -> list[tuple[Ours, int]]:
    """Settings and how many particles."""
    n = 300 if quick else N
    step = {"dt": PERIOD / STEPS}
    return [
        (Ours("midpoint", "core:midpoint", step), n),
        (Ours("symplectic8", "core:symplectic8", step), n // 10),
        (Ours("adaptive", "core:adaptive", {"rtol": 1e-9, "atol": 1e-12}), n),
    ]


def measure(samples: int, quick: bool, peers: Sequence[str] = ()) -> dict[str, Any]:
    """The rows of the table, and the bar."""
    rows, bars = [], []
    for one, n in settings(quick):
        try:
            both, places = with_planet(n, one.stepper, dict(one.run))
            single, fixed = alone(n, one.stepper, dict(one.run))
            both()
            single()
            off, off_alone = error(places(), n), error(fixed(), n)
            found, ours, theirs = ratio(both, single, min(samples, 5))
        except Exception as wrong:  # what fails or is not there is a row that says so
            text = " ".join(str(wrong).split())[:160]
            rows.append(
                [f"xPheve {one.method}", one.setting, f"{n:,}", "-", "-", "-", "-", f"{type(wrong).__name__}: {text}"]
            )
            continue
        cells = [seconds(ours), seconds(theirs), f"{found:.2f}", f"{off:.1e} ({off_alone:.1e})"]
        rows.append([f"xPheve {one.method}", one.setting, f"{n:,}", *cells, ""])
        text = f"{one.method}: at most 2x the test particles alone in a fixed field"
        bars.append(
            {
                "text": text,
                "found": f"{found:.2f} times, {n:,} particles",
                "met": None if quick else bool(found <= RATIO_BAR),
            }
        )
    if "rebound" in peers:
        rows += [
            _rebound(kind, N if not quick else 300, samples)
            for kind in (("leapfrog", 2, PERIOD / STEPS), ("leapfrog", 8, PERIOD / STEPS))
        ]
    names = ["engine", "setting", "particles", "with the planet", "alone", "ratio", "error (alone)", "note"]
    return {"id": ID, "title": TITLE, "names": names, "rows": rows, "bars": bars, "text": ""}


def _rebound(setting: tuple[Any, ...], n: int, samples: int) -> list[str]:
    """REBOUND with one active particle: the rest pulls nothing."""
    from benchmarks.peers import rebound_peer

    x, v = particles(n)
    masses = np.zeros(n + 1)
    masses[0] = 1.0
    swarm = Swarm(masses, np.vstack([np.zeros(3), x]), np.vstack([DRIFT, v + DRIFT]))
    sim = rebound_peer.simulation(swarm, setting)
    sim.N_active = 1
    sim.testparticle_hidewarnings = 1
    turns = [0]

    def act() -> Any:
        turns[0] += 1
        sim.integrate(turns[0] * STEPS * (PERIOD / STEPS))

    first = cpu_time(act)
    at = rebound_peer.read(sim).position
    off = error(at[1:] - at[0], n)
    found, _ = middle([first, *(cpu_time(act) for _ in range(min(samples - 1, 2)))])
    kind, said, _, _ = rebound_peer.describe(setting)
    return [f"REBOUND {kind}", said, f"{n:,}", seconds(found), "-", "-", f"{off:.1e}", ""]
