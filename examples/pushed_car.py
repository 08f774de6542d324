"""A car that a lasting force pushes against a wall: figure 3-13 of the thesis.

Run it with ``python examples/pushed_car.py [--out DIR] [--quick]``; with ``--out`` it writes a picture and an animated GLB file.

A collision law that only turns the velocity round leaves the force in place, and a step later the car is in the wall (S. Nourian,
2004). Here the car, a body on four wheels, meets the wall at exact instants, each time at half the speed it left with, until the
bounces have died away; then it is held where it stands. It never passes the wall, and the books of energy
balance: what the force gave is what the wall took. Seen from above, without friction.
"""

from __future__ import annotations

import argparse
import math
from itertools import pairwise
from pathlib import Path

import numpy as np

import xpheve as xp

FORCE, RESTITUTION = 1500.0, 0.5  # [N]
LENGTH, WAY = 4.0, 3.0  # [m] of the car, and from its bumper to the wall at the start


def main() -> None:
    """Push the car, and hold its way against the closed form."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="folder for the picture and the animation")
    parser.add_argument("--quick", action="store_true", help="60 frames a second instead of 240")
    options = parser.parse_args()

    engine = xp.PhysicsEngine(up="z")
    bounce = engine.add_law("collision:elastic", restitution=RESTITUTION, resting="hold")
    engine.add_object(xp.PhysicalObject(xp.Plane((-1, 0, 0)), fixed=True, name="wall"), laws=[bounce])
    pose = np.eye(4)
    pose[0, 3] = -WAY - LENGTH / 2
    car = engine.add_object(xp.PhysicalObject(car_shape(), pose=pose, name="car"), laws=[bounce])
    car.add_force((FORCE, 0, 0))
    start = car.position[0]

    # At rest where the sum of all bounces ends, in closed form.
    acceleration = FORCE / car.mass
    first = math.sqrt(2 * WAY / acceleration)
    rest = first * (1 + RESTITUTION) / (1 - RESTITUTION)
    record = engine.run(until=math.ceil(rest) + 1.0, every=1 / (60 if options.quick else 240))

    gap = WAY - (record[car].position[:, 0] - start)  # from the bumper to the wall
    error = max(abs(g - gap_at(t, acceleration)) for g, t in zip(gap, record.time, strict=True))
    books = engine.explain().data["energy"]
    given, taken = books["work_by"]["forces"], books["work_by"]["collision:elastic"]
    print(
        f"{car.mass:.0f} kg pushed with {FORCE:g} N over {WAY:g} m: at the wall after {first:.3f} s, at rest after {rest:.3f} s"
    )
    print(
        f"impacts: {engine.explain().data['contacts']['generations']}, and then {engine.explain().data['contacts']['held']} held"
    )
    print(f"work of the force {given:.3f} J, of the wall {taken:.3f} J; kinetic energy left {books['kinetic']:g} J")
    print(f"error of the energy balance: {abs(given + taken) / given:.1e}")
    print(f"error of the way against the closed form: {error:.1e} m")
    print(f"deepest in the wall: {max(0.0, -float(gap.min())):.1e} m")
    print(f"turned by the wall: {math.hypot(*car.angular_velocity):.1e} rad/s")
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        print("picture:  ", draw(record, gap, car.mass, options.out / "pushed_car.png"))
        print("animation:", record.export_glb(options.out / "pushed_car.glb"))


def car_shape() -> xp.Compound:
    """A body and four wheels; x is ahead, z up, the ground is at z = 0."""
    across = xp.orientation.from_axis_angle((1, 0, 0), math.pi / 2)  # a capsule lies along z
    body = xp.Part(xp.Box((LENGTH, 1.6, 0.8)), (0, 0, 0.7), density=150.0)
    places = [(x, y, 0.3) for x in (-1.3, 1.3) for y in (-0.8, 0.8)]
    return xp.Compound([body, *(xp.Part(xp.Capsule(0.3, 0.05), place, across, density=900.0) for place in places)])


def gap_at(t: float, acceleration: float) -> float:
    """From the bumper to the wall [m]: parabolas, each begun at e times the speed at which the last one ended."""
    hit, speed = math.sqrt(2 * WAY / acceleration), math.sqrt(2 * WAY * acceleration)
    if t < hit:
        return WAY - 0.5 * acceleration * t * t
    while speed > 1e-9:
        speed *= RESTITUTION
        lasts = 2 * speed / acceleration
        if t < hit + lasts:
            return speed * (t - hit) - 0.5 * acceleration * (t - hit) ** 2
        hit += lasts
    return 0.0


def draw(record: xp.Record, gap: np.ndarray, mass: float, path: Path) -> Path:
    """The car from above at some instants; its way and speed; the books of energy."""
    from matplotlib.figure import Figure
    from matplotlib.patches import FancyBboxPatch, Rectangle

    time = record.time
    speed = record["car"].velocity[:, 0]
    figure = Figure(figsize=(9, 9), dpi=110, layout="constrained")
    above, way, energy = figure.subplots(3, 1, height_ratios=(1.5, 1.3, 1.3))

    turned = next(k for k, (a, b) in enumerate(pairwise(speed)) if a < 0 <= b)  # farthest away after the first bounce
    for row, (k, label) in enumerate([(0, "start"), (turned, "after a bounce"), (len(gap) - 1, "at rest")]):
        y, back = -2.6 * row, -float(gap[k]) - LENGTH
        for x in (back + 0.4, back + 3.0):
            for side in (-1.0, 0.75):
                above.add_patch(Rectangle((x, y + side), 0.6, 0.25, color="#333333"))
        style = "round,pad=0,rounding_size=0.25"
        above.add_patch(FancyBboxPatch((back, y - 0.8), LENGTH, 1.6, boxstyle=style, facecolor="#0072b2"))
        arrow = {"arrowstyle": "-|>", "color": "#d55e00", "lw": 2.5}
        above.annotate("", (back, y), (back - 1.6, y), arrowprops=arrow)
        above.text(-WAY - LENGTH - 2.0, y, f"{label}, {time[k]:.2f} s", ha="right", va="center")
    above.text(-WAY - LENGTH - 0.8, 0.25, f"{FORCE:g} N", ha="center", va="bottom", color="#d55e00")
    above.add_patch(Rectangle((0, -6.6), 0.5, 8.0, facecolor="#999999", hatch="///", edgecolor="#555555"))
    above.set(
        xlim=(-WAY - LENGTH - 6.0, 4.0),
        ylim=(-6.6, 1.4),
        aspect="equal",
        title="A car, a lasting force, a wall: from above",
    )
    above.axis("off")

    way.plot(time, gap, color="#0072b2", label="from bumper to wall [m]")
    way.plot(time, speed, color="#e69f00", label="speed towards it [m/s]")
    way.axhline(0.0, color="#555555", linewidth=0.8)
    way.set(ylabel="m, m/s", xlim=(0, time[-1]))

    kinetic = 0.5 * mass * speed**2
    given = FORCE * (WAY - gap)
    energy.plot(time, given, color="#d55e00", label="work of the force, F x way")
    energy.plot(time, kinetic, color="#0072b2", label="kinetic energy")
    energy.plot(time, given - kinetic, color="#009e73", label="taken by the wall: work less kinetic energy")
    energy.set(ylabel="energy [J]", xlabel="time [s]", xlim=(0, time[-1]))
    for axes in (way, energy):
        axes.grid(alpha=0.25)
        axes.legend(loc="upper right" if axes is way else "center right", fontsize=9)
    figure.savefig(path)
    return path


if __name__ == "__main__":
    main()
