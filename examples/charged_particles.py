"""Charged particles in uniform fields: semicircles of a mass spectrometer, and the drift across crossed fields.

Run it with ``python examples/charged_particles.py [--out DIR] [--quick]``; with ``--out`` it writes a picture.

Left in the picture: ions of neon and argon, each with one charge and accelerated through 1 kV, enter a field of 0.1 T at the
origin. They fly half a circle and meet the detector, the line y = 0, at twice their radius sqrt(2 m V/q)/B: isotopes are told
apart. Right: particles of unlike charge and mass, at rest in crossed fields, fly cycloids. Each goes its own way, and all
drift alike, with E/B. The laws ``basic:magnetic_field`` and ``basic:electric_field`` of the library (thesis 5.3) do it; the
column ``charge`` says on whom.

It prints the radius measured at the detector beside that of the formula, and the error of the drift.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import numpy as np

import xpheve as xp

UNIT, CHARGE = 1.66053906892e-27, 1.602176634e-19  # [kg], [C]: an atomic mass, an elementary charge
VOLTAGE, FIELD = 1000.0, 0.1  # [V], [T]
IONS = {"neon 20": 19.99244, "neon 22": 21.99139, "argon 36": 35.96755, "argon 40": 39.96238}  # atomic masses
ACROSS = 2000.0  # [V/m]
DRIFTING = {"m, q": (1.0, 1.0), "2 m, q": (2.0, 1.0), "m, -q": (1.0, -1.0), "3 m, -2 q": (3.0, -2.0)}
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")


def main() -> None:
    """Both experiments."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="folder for the picture")
    parser.add_argument("--quick", action="store_true", help="fewer steps")
    options = parser.parse_args()
    steps = 500 if options.quick else 2000

    ions = spectrometer(steps)
    worst = 0.0
    print("ion        radius measured  sqrt(2 m V/q)/B")
    for name, mass in IONS.items():
        found, expected = landing(ions[name].position) / 2, math.sqrt(2 * mass * UNIT * VOLTAGE / CHARGE) / FIELD
        worst = max(worst, abs(found / expected - 1))
        print(f"{name:10} {1000 * found:12.4f} mm  {1000 * expected:12.4f} mm")
    print(f"largest error of a radius: {worst:.1e}")

    cycloids = crossed_fields(steps)
    turn = 2 * math.pi * 20 * UNIT / (CHARGE * FIELD)
    drifts = [cycloids[name].position[-1, 0] / cycloids.time[-1] for name in DRIFTING]
    error = max(abs(drift / (ACROSS / FIELD) - 1) for drift in drifts)
    print(f"drift after {cycloids.time[-1] / turn:g} turns, E/B = {ACROSS / FIELD:g} m/s: largest error {error:.1e}")
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        print("picture:", draw(ions, cycloids, options.out / "charged_particles.png"))


def spectrometer(steps: int) -> xp.Record:
    """Ions of one energy in a magnetic field, until the heaviest has come around."""
    engine = xp.PhysicsEngine(up="z")
    magnet = engine.add_law("basic:magnetic_field", field=(0, 0, f"{FIELD} T"))
    for name, mass in IONS.items():
        speed = math.sqrt(2 * CHARGE * VOLTAGE / (mass * UNIT))
        ion = xp.PhysicalObject(mass=mass * UNIT, velocity=(0, speed, 0), charge=CHARGE, name=name)
        engine.add_object(ion, laws=[magnet])
    half = math.pi * IONS["argon 40"] * UNIT / (CHARGE * FIELD)
    return engine.run(until=1.01 * half, dt=half / steps, every=half / steps)


def landing(path: np.ndarray) -> float:
    """Where [m] a path comes down through the line y = 0, between two frames."""
    after = int(np.flatnonzero((path[1:, 1] <= 0) & (path[:-1, 1] > 0))[0]) + 1
    (x0, y0), (x1, y1) = path[after - 1, :2], path[after, :2]
    return float(x0 + (x1 - x0) * y0 / (y0 - y1))


def crossed_fields(steps: int) -> xp.Record:
    """Particles at rest in E across B, for six turns of the lightest: a whole number of turns of each."""
    engine = xp.PhysicsEngine(up="z")
    fields = [
        engine.add_law("basic:magnetic_field", field=(0, 0, f"{FIELD} T")),
        engine.add_law("basic:electric_field", field=(0, f"{ACROSS} V/m", 0)),
    ]
    for name, (m, q) in DRIFTING.items():
        engine.add_object(xp.PhysicalObject(mass=20 * m * UNIT, charge=q * CHARGE, name=name), laws=fields)
    turn = 2 * math.pi * 20 * UNIT / (CHARGE * FIELD)
    return engine.run(until=6 * turn, dt=turn / steps, every=turn / 100)


def draw(ions: xp.Record, cycloids: xp.Record, path: Path) -> Path:
    """The semicircles down to the detector, and the cycloids."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12, 5), dpi=110, layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1, 1.25))
    left.axhline(0, color="#9a9a9a", linewidth=4)
    for color, (name, mass) in zip(COLOURS, IONS.items(), strict=True):
        x = ions[name].position
        down = np.flatnonzero((x[1:, 1] <= 0) & (x[:-1, 1] > 0))[0] + 1
        left.plot(x[:down, 0], x[:down, 1], color=color, label=name)
        exact = 2 * math.sqrt(2 * mass * UNIT * VOLTAGE / CHARGE) / FIELD
        left.plot(exact, 0, "v", color=color, markersize=9)
    left.text(0.05, 0.01, "detector; triangles: 2 sqrt(2 m V/q)/B", fontsize=9)
    left.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", title="1 kV, 0.1 T up out of the picture")
    left.legend(loc=(0.3, 0.25), fontsize=9)
    for k, (color, name) in enumerate(zip(COLOURS, DRIFTING, strict=True)):
        x = cycloids[name].position
        level = -0.25 * k
        right.plot(x[:, 0], x[:, 1] + level, color=color, label=name)
        right.plot(x[-1, 0], x[-1, 1] + level, "o", color=color)
        right.axhline(level, color=color, linewidth=0.5, alpha=0.5)
    end = ACROSS / FIELD * cycloids.time[-1]
    right.axvline(end, color="black", linestyle=":", label="E/B times time")
    right.set(xlabel="x [m]", ylabel="y [m], each from its own level", title="crossed fields: all drift with E/B")
    right.set_ylim(top=0.3)
    right.legend(loc="upper left", fontsize=8, ncols=2)
    for axes in (left, right):
        axes.grid(alpha=0.25)
    figure.savefig(path)
    return path


if __name__ == "__main__":
    main()
