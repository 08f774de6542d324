"""The Sun and eight planets for 10,000 years, to the limit of rounding, with the error measured twice.

Run it with ``python examples/ten_thousand_years.py [--years 10000] [--dt 0.5] [--out DIR] [--quick]``; it takes a minute.

The scene is that of ``solar_system.py``. Without a ``dt`` it goes by ``core:adaptive`` (Gauss-Radau 15), and ``rtol=1e-13`` asks for all that
doubles can give. There is no closed form to hold it against, so two other runs tell the error:

- *there and back*: from the end, with velocities reversed, the same years lead back to the start, which is known. Errors grow with about the
  power 1.5 of time, as those of the period add up at random, and those of the place along with them (D. Brouwer, Astron. J. 46, 149
  (1937)): twice the years have nearly three times the error of one way;
- *another way*: the same years by ``core:symplectic8`` in steps of ``dt`` [days]. It shares neither steps nor rounding with the first, and the
  distance of the two holds the errors of both.

This is the error of the arithmetic. Newton's point masses are another matter: what is left out moves the planets far more. Relativity alone
turns Mercury's perihelion by 43 seconds of arc a century, and the Moon, the asteroids and the Sun's shape are not there.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
from solar_system import AU, DAY, GM_SUN, PLANETS, solar_system

import xpheve as xp

YEAR = 365.25 * DAY


def main() -> None:
    """Run the years, back again, and another way; say how far the three are apart."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--years", type=float, default=10_000.0, help="Julian years to run (default 10000)")
    parser.add_argument("--dt", type=float, default=0.5, help="steps of core:symplectic8 [days] (default 0.5)")
    parser.add_argument("--out", type=Path, help="folder for a picture")
    parser.add_argument("--quick", action="store_true", help="40 years")
    options = parser.parse_args()
    asked = 40.0 if options.quick else options.years
    every = 4 * max(
        1, round(asked / 2000)
    )  # [years]; whole days, so that all frames are on the grid of symplectic steps
    end = max(1, round(asked / every)) * every * YEAR

    engine = solar_system()
    begin, spin = places(engine), engine.angular_momentum()
    there = timed(engine, "there", until=end, every=every * YEAR, rtol=1e-13)

    returning = solar_system()
    for obj, other in zip(returning.objects, engine.objects, strict=True):
        obj.position, obj.velocity = other.position, tuple(-v for v in other.velocity)
    timed(returning, "and back", until=end, rtol=1e-13)
    back = length(places(returning) - begin)

    control = solar_system(stepper="core:symplectic8")
    other_way = timed(control, "another way", until=end, every=every * YEAR, dt=options.dt * DAY)
    apart = {name: length(there[name].position - other_way[name].position) for name in ("Sun", *PLANETS)}

    print(
        f"\nafter {end / YEAR:,.0f} years: error of the position by going back, and largest distance from core:symplectic8"
    )
    for k, name in enumerate(apart):
        print(f"{name:9}{back[k]:>14.3g} m{apart[name].max():>14.3g} m")
    print(f"\nlargest error, there and back: {back.max() / AU:.1e} au")
    print(f"largest distance from core:symplectic8: {max(line.max() for line in apart.values()) / AU:.1e} au")
    print(f"drift of the energy: {there.energy_drift:.1e} of the kinetic energy")
    moment = np.subtract(engine.angular_momentum(), spin)
    print(f"error of the angular momentum: {np.linalg.norm(moment) / np.linalg.norm(spin):.1e}")
    print(f"Relativity, which is not in it, would turn Mercury's orbit by {0.43 * end / YEAR / 3600:.2g} degrees.")
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        print("picture:", draw(there, apart, options.out / "ten_thousand_years.png"))


def timed(engine: xp.PhysicsEngine, title: str, **how: float) -> xp.Record:
    """Run, and print who made how many steps in what time."""
    clock = time.process_time()
    record = engine.run(**how)
    clock = time.process_time() - clock
    (group,) = engine.explain().data["groups"]
    print(f"{title}: {group['stepper']}, {group['steps']:,} steps, {clock:.1f} s")
    return record


def places(engine: xp.PhysicsEngine) -> np.ndarray:
    """Positions of all [m], (objects, 3)."""
    return np.array([obj.position for obj in engine.objects])


def length(x: np.ndarray) -> np.ndarray:
    """Lengths of vectors along the last axis."""
    return np.asarray(np.linalg.norm(x, axis=-1))


def perihelion(record: xp.Record, name: str) -> np.ndarray:
    """Where the ellipse that the planet is on is nearest to the Sun: the angle in the ecliptic, frame by frame [degrees from the first]."""
    sun, planet = record["Sun"], record[name]
    x, v = planet.position - sun.position, planet.velocity - sun.velocity
    toward = np.cross(v, np.cross(x, v)) / (GM_SUN + PLANETS[name][0] * 1e9) - x / length(x)[:, None]
    angle = np.degrees(np.unwrap(np.arctan2(toward[:, 1], toward[:, 0])))
    return angle - angle[0]


def draw(record: xp.Record, apart: dict[str, np.ndarray], path: Path) -> Path:
    """How the error grows, and how the orbits turn in the meantime."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 4.8), dpi=110, layout="constrained")
    grows, turns = figure.subplots(1, 2)
    years = record.time / YEAR
    for name in ("Mercury", "Venus", "Earth", "Jupiter", "Neptune"):
        grows.loglog(years[1:], apart[name][1:] / AU, linewidth=0.9, label=name)
    law = max(line[-1] for line in apart.values()) / AU * (years[1:] / years[-1]) ** 1.5
    grows.loglog(years[1:], law, "k--", linewidth=0.8, label="power 1.5 of time")
    grows.set(
        xlabel="years", ylabel="distance of two ways to run [au]", title="error: core:adaptive against core:symplectic8"
    )
    grows.legend(fontsize=8, loc="upper left")
    for name in ("Mars", "Earth", "Mercury"):
        turns.plot(years, perihelion(record, name), linewidth=0.9, label=name)
    turns.plot(years, 0.43 / 3600 * years, "k--", linewidth=0.8, label="relativity, of Mercury: left out")
    turns.set(
        xlabel="years from J2000.0",
        ylabel="turn of the perihelion [degrees]",
        title="what the planets do to one another",
    )
    turns.legend(fontsize=8, loc="upper left")
    for axes in (grows, turns):
        axes.grid(alpha=0.25)
    figure.savefig(path)
    return path


if __name__ == "__main__":
    main()
