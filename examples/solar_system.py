"""The Sun and eight planets under Newton's gravity, for some years, with the error of the integration measured.

Run it with ``python examples/solar_system.py [--years 10] [--dt 0.5] [--out DIR] [--quick]``; ``--dt`` is in days.

The motion has no closed form, so in steps of ``dt`` it goes by ``core:midpoint``, which is of second order. The same years are run with
steps of dt, dt/2 and dt/4. Two runs tell the error of each (Richardson); three tell the order. Without a ``dt`` the error is far smaller:
``ten_thousand_years.py``.

Sources
-------
Elements at J2000.0: E. M. Standish, Keplerian Elements for Approximate Positions of the Major Planets, table 1
(1800 to 2050 AD), Solar System Dynamics Group, JPL, https://ssd.jpl.nasa.gov/planets/approx_pos.html. They are fitted
to those 250 years, so they are good to some arc minutes, not to the last digit that is written; "Earth" is the
barycentre of Earth and Moon. Axes: mean ecliptic and equinox of J2000; z is north of the ecliptic.
GM of the Sun and of the planets with their moons: JPL DE440; R. S. Park et al., Astron. J. 161, 105 (2021), table 2.
Astronomical unit: IAU 2012 resolution B2.
"""

from __future__ import annotations

import argparse
import math
import time
from pathlib import Path

import numpy as np

import xpheve as xp

AU = 149_597_870_700.0  # [m]
DAY = 86_400.0  # [s]
CENTURY = 36_525.0 * DAY
GM_SUN = 132_712_440_041.279419e9  # [m^3/s^2]

# name: GM [km^3/s^2]; a [au], e, I, L, longitude of perihelion, longitude of the node [degrees]; their rates a century
PLANETS = {
    "Mercury": (
        22_031.868551,
        (0.38709927, 0.20563593, 7.00497902, 252.25032350, 77.45779628, 48.33076593),
        (0.00000037, 0.00001906, -0.00594749, 149472.67411175, 0.16047689, -0.12534081),
    ),
    "Venus": (
        324_858.592,
        (0.72333566, 0.00677672, 3.39467605, 181.97909950, 131.60246718, 76.67984255),
        (0.00000390, -0.00004107, -0.00078890, 58517.81538729, 0.00268329, -0.27769418),
    ),
    "Earth": (
        403_503.235625,  # Earth 398600.435507 and Moon 4902.800118
        (1.00000261, 0.01671123, -0.00001531, 100.46457166, 102.93768193, 0.0),
        (0.00000562, -0.00004392, -0.01294668, 35999.37244981, 0.32327364, 0.0),
    ),
    "Mars": (
        42_828.375816,
        (1.52371034, 0.09339410, 1.84969142, -4.55343205, -23.94362959, 49.55953891),
        (0.00001847, 0.00007882, -0.00813131, 19140.30268499, 0.44441088, -0.29257343),
    ),
    "Jupiter": (
        126_712_764.1,
        (5.20288700, 0.04838624, 1.30439695, 34.39644051, 14.72847983, 100.47390909),
        (-0.00011607, -0.00013253, -0.00183714, 3034.74612775, 0.21252668, 0.20469106),
    ),
    "Saturn": (
        37_940_584.8418,
        (9.53667594, 0.05386179, 2.48599187, 49.95424423, 92.59887831, 113.66242448),
        (-0.00125060, -0.00050991, 0.00193609, 1222.49362201, -0.41897216, -0.28867794),
    ),
    "Uranus": (
        5_794_556.4,
        (19.18916464, 0.04725744, 0.77263783, 313.23810451, 170.95427630, 74.01692503),
        (-0.00196176, -0.00004397, -0.00242939, 428.48202785, 0.40805281, 0.04240589),
    ),
    "Neptune": (
        6_836_527.10058,
        (30.06992276, 0.00859048, 1.77004347, -55.12002969, 44.96476227, 131.78422574),
        (0.00026291, 0.00005105, 0.00035372, 218.45945325, -0.32241464, -0.00508664),
    ),
}


def main() -> None:
    """Run the years three times, and say what the steps cost in error."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--years", type=float, default=10.0, help="Julian years to run (default 10)")
    parser.add_argument("--dt", type=float, default=0.5, help="longest of the three steps [days] (default 0.5)")
    parser.add_argument("--out", type=Path, help="folder for a picture")
    parser.add_argument("--quick", action="store_true", help="half a year, in steps of a day and less")
    options = parser.parse_args()
    years, dt = (0.5, 1.0) if options.quick else (options.years, options.dt)
    # On the grid of all three: off it, a run ends with a look into a step, where angular momentum is not kept exactly.
    end = round(years * 365.25 / dt) * dt * DAY

    found = []
    for part in (1, 2, 4):
        clock = time.process_time()
        engine = solar_system()
        record = engine.run(until=end, dt=dt * DAY / part, every=2 * DAY if part == 4 else end / 100)
        places = np.array([obj.position for obj in engine.objects])
        found.append(places)
        clock = time.process_time() - clock
        spin = engine.angular_momentum()[2]
        print(f"dt = {dt / part:g} d: energy drift {record.energy_drift:.1e} of the kinetic energy, {clock:.1f} s")
    coarse, middle, fine = found
    better = fine + (fine - middle) / 3  # Richardson: without the error of second order
    worse = middle + (middle - coarse) / 3
    table = heliocentric_table(end)

    print(
        f"\nafter {end / DAY / 365.25:.3f} years: error of the position by Richardson, and of that position corrected by it;"
    )
    print("order; and how far the corrected position is from the table's own")
    print(f"{'':9}{'dt = ' + format(dt / 4, 'g') + ' d':>17}{'corrected':>14}{'order':>8}{'table':>14}")
    for k, name in enumerate(PLANETS, start=1):
        first, last = length(coarse[k] - middle[k]), length(middle[k] - fine[k])
        rest = length(better[k] - worse[k]) / 15
        away = length(better[k] - better[0] - table[name])
        order = math.log2(first / last)
        print(f"{name:9}{last / 3e3:>14.4g} km{rest / 1e3:>11.3g} km{order:>8.2f}{away / 1e3:>11.3g} km")
    worst = max(length(middle[k] - fine[k]) / 3 / (PLANETS[name][1][0] * AU) for k, name in enumerate(PLANETS, start=1))
    start = solar_system()
    moment = abs(spin / start.angular_momentum()[2] - 1)
    print(f"\nlargest error at dt = {dt / 4:g} d: {worst:.1e} of the planet's semi-major axis")
    print(f"error of the angular momentum, which is conserved: {moment:.1e}")
    print(f"speed of the barycentre, which is 0: {max(map(abs, engine.momentum())) * 6.6743e-11 / GM_SUN:.1e} m/s")
    print("The last column is the table's error and Newton's together, not that of the integration.")
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        print("picture:", draw(record, options.out / "solar_system.png"))


def length(x: np.ndarray) -> float:
    """Length of a vector, in its unit."""
    return float(np.linalg.norm(x))


def solar_system(stepper: str = "") -> xp.PhysicsEngine:
    """Sun and planets at J2000.0, their barycentre at rest in the origin."""
    engine = xp.PhysicsEngine(up="z", stepper=stepper)
    gravity = engine.add_law("basic:universal_gravity")
    constant = gravity.parameters["gravitational_constant"]
    states = [(np.zeros(3), np.zeros(3))]
    weights = [GM_SUN]
    for gm, elements, _ in PLANETS.values():
        states.append(state_of(elements, GM_SUN + gm * 1e9))
        weights.append(gm * 1e9)
    shares = np.array(weights) / math.fsum(weights)
    x0, v0 = (shares @ np.array([state[k] for state in states]) for k in (0, 1))
    for name, gm, (x, v) in zip(("Sun", *PLANETS), weights, states, strict=True):
        body = xp.PhysicalObject(mass=gm / constant, position=x - x0, velocity=v - v0, name=name)
        engine.add_object(body, laws=[gravity])
    return engine


def heliocentric_table(t: float) -> dict[str, np.ndarray]:
    """Where the table itself puts each planet at ``t`` [s] after J2000.0, from the Sun [m]."""
    found = {}
    for name, (gm, elements, rates) in PLANETS.items():
        moved = tuple(value + rate * t / CENTURY for value, rate in zip(elements, rates, strict=True))
        found[name] = state_of(moved, GM_SUN + gm * 1e9)[0]
    return found


def state_of(elements: tuple[float, ...], mu: float) -> tuple[np.ndarray, np.ndarray]:
    """Position [m] and velocity [m/s] from the Sun, of Keplerian elements as in `PLANETS`."""
    a, e = elements[0] * AU, elements[1]
    inclination, longitude, perihelion, node = map(math.radians, elements[2:])
    mean = math.remainder(longitude - perihelion, math.tau)
    anomaly = mean
    for _ in range(20):  # Kepler's equation by Newton's method; e is small, so it meets in a few turns
        anomaly -= (anomaly - e * math.sin(anomaly) - mean) / (1 - e * math.cos(anomaly))
    cosine, sine, root = math.cos(anomaly), math.sin(anomaly), math.sqrt(1 - e * e)
    rate = math.sqrt(mu / a**3) / (1 - e * cosine)
    in_plane = np.array([[a * (cosine - e), a * root * sine], [-a * sine * rate, a * root * cosine * rate]])
    w = perihelion - node
    along = np.array(
        [
            math.cos(w) * math.cos(node) - math.sin(w) * math.sin(node) * math.cos(inclination),
            math.cos(w) * math.sin(node) + math.sin(w) * math.cos(node) * math.cos(inclination),
            math.sin(w) * math.sin(inclination),
        ]
    )
    across = np.array(
        [
            -math.sin(w) * math.cos(node) - math.cos(w) * math.sin(node) * math.cos(inclination),
            -math.sin(w) * math.sin(node) + math.cos(w) * math.cos(node) * math.cos(inclination),
            math.cos(w) * math.sin(inclination),
        ]
    )
    x, v = (p * along + q * across for p, q in in_plane)
    return x, v


def draw(record: xp.Record, path: Path) -> Path:
    """The orbits seen from north of the ecliptic: near the Sun, and all of them; a dot where a planet is at the end."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 5.4), dpi=110, layout="constrained")
    for place, (names, reach) in enumerate(((list(PLANETS)[:4], 1.8), (list(PLANETS), 36.0)), start=1):
        axes = figure.add_subplot(1, 2, place)
        axes.plot([0], [0], "*", color="goldenrod", markersize=12)
        for name in names:
            x, y, _ = (record[name].position - record["Sun"].position).T / AU
            (line,) = axes.plot(x, y, linewidth=0.9)
            axes.plot(x[-1:], y[-1:], "o", color=line.get_color(), markersize=5)
            if place == 1 or name not in list(PLANETS)[:4]:
                axes.annotate(name, (x[-1], y[-1]), xytext=(6, 4), textcoords="offset points", fontsize=9)
        axes.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal", xlabel="x [au]", ylabel="y [au]")
        axes.grid(alpha=0.25)
    figure.suptitle(f"{record.time[-1] / DAY / 365.25:.4g} years from J2000.0, ecliptic; from the Sun")
    figure.savefig(path)
    return path


if __name__ == "__main__":
    main()
