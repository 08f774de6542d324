"""The front door: a ball that bounces to rest on a floor, and a top that spins free of torque.

Run it with ``python examples/front_door.py [--out DIR] [--quick]``; with ``--out`` it writes a picture.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import xpheve as xp


def main() -> None:
    """Run the scene, and hold it against the closed form."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="folder for a picture")
    parser.add_argument("--quick", action="store_true", help="stop at 5 s in place of 10 s")
    options = parser.parse_args()
    end = 5.0 if options.quick else 10.0

    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", acceleration=9.81)
    bounce = engine.add_law("collision:elastic", restitution=0.8)

    engine.add_object(xp.PhysicalObject(shape=xp.Plane(), fixed=True, name="floor"), laws=[bounce])
    ball = engine.add_object(
        xp.PhysicalObject(shape=xp.Sphere(0.1), mass=1.0, position=(0, 0, 1.1), velocity=(0, 0, 0), name="ball"),
        laws=[gravity, bounce],
    )
    top = engine.add_object(
        xp.PhysicalObject(mass=1.0, inertia=(1, 2, 3), angular_velocity=(0.01, 2, 0.01), position=(5, 0, 5), name="top")
    )
    spin = engine.angular_momentum()
    again = engine.copy()

    engine.run(until=3.0)
    at_three = ball.position[2]
    engine.run(until=end, every=1 / 60)

    print("time", engine.time, "s")
    print("ball", ball.position, ball.velocity)
    print("top ", top.orientation, top.angular_velocity)
    print(engine.energy())
    print(engine.momentum(), engine.angular_momentum())
    print()
    print(engine.explain())
    print()

    error = abs(at_three - height(3.0, 1.0, 9.81, 0.8, 0.1))
    turned = math.dist(engine.angular_momentum(), spin)
    print(f"error of the ball's height at 3 s, against the closed form: {error:.1e} m")
    print(f"error of the top's angular momentum, which is conserved: {turned:.1e} kg m^2/s")
    rests = math.sqrt(2 / 9.81) * (1 + 0.8) / (1 - 0.8)
    print(f"at rest since {rests:.6f} s, speed now {math.hypot(*ball.velocity)} m/s")
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        print("picture:", draw(again.run(until=end, every=1 / 200), options.out / "front_door.png"))


def height(t: float, drop: float, g: float, e: float, radius: float) -> float:
    """Height [m] of the centre of a ball of ``radius`` that falls from ``drop`` above the ground and leaves it at e times its speed."""
    hit, speed = math.sqrt(2 * drop / g), math.sqrt(2 * drop * g)
    if t < hit:
        return radius + drop - 0.5 * g * t * t
    while True:
        speed *= e
        flight = 2 * speed / g
        if t < hit + flight:
            s = t - hit
            return radius + speed * s - 0.5 * g * s * s
        hit += flight


def draw(record: xp.Record, path: Path) -> Path:
    """The ball's height, and how the top turns over: its spin is about the axis of its middle moment of inertia."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 6.5), dpi=110, layout="constrained")
    ball, top = figure.subplots(2, 1, sharex=True)
    ball.plot(record.time, record["ball"].position[:, 2], color="#0072b2", label="height of the ball's centre")
    rests = math.sqrt(2 / 9.81) * (1 + 0.8) / (1 - 0.8)
    ball.axvline(rests, color="#d55e00", linestyle=":", label=f"at rest from {rests:.4f} s, in closed form")
    ball.axhline(0.1, color="#999999", linewidth=0.8)
    ball.set(ylabel="height [m]", title="A ball that bounces to rest (restitution 0.8), and a top without torque")
    rates = record["top"].angular_velocity
    for k, (axis, colour) in enumerate(zip("xyz", ("#56b4e9", "#009e73", "#cc79a7"), strict=True)):
        top.plot(record.time, rates[:, k], color=colour, label=f"about the world's {axis}")
    top.set(ylabel="angular velocity of the top [rad/s]", xlabel="time [s]", xlim=(0, record.time[-1]))
    for axes in (ball, top):
        axes.grid(alpha=0.25)
        axes.legend(loc="upper right", fontsize=9)
    figure.savefig(path)
    return path


if __name__ == "__main__":
    main()
