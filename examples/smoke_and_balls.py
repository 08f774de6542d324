"""Smoke that obeys the wind beside balls that obey gravity: section 3.4 and figure 3-24 of the thesis.

Run it with ``python examples/smoke_and_balls.py [--out DIR] [--quick]``; with ``--out`` it writes a picture.

"An object representing a cloud of smoke does not need to obey collision law nor gravity; it does however need to be affected by
the wind" (S. Nourian, 2004). So each object has the laws it was given, and no others: puffs of smoke leave a chimney and obey
``basic:wind``; balls are thrown against the wind and obey ``basic:planet_gravity`` and ``collision:elastic``. The picture
shows the plume bent over by the wind, and through it the parabolas of the balls, which feel none of it.

It prints the largest distance of a puff from the closed form of quadratic drag in a wind, and that of a ball from a run
in which there is neither wind nor smoke.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Any

import numpy as np

import xpheve as xp

WIND = (4.0, 0.0, 0.0)  # [m/s]
MOUTH = (0.0, 0.0, 2.0)  # [m] of the chimney
PUFF = {"mass": 1e-3, "drag_area": 4e-3}  # [kg], [m^2]
BETA = 0.5 * 1.225 * 0.47 * PUFF["drag_area"] / PUFF["mass"]  # [1/m]
END = 4.0  # [s]


class Chimney(xp.PhysicalLaw):
    """Lets a puff of smoke out every 3/64 s, upward and a little to all sides."""

    id = "example:chimney"
    condition = xp.when.Elapsed(3 / 64, every=True)  # a multiple of the steps: so all puffs step together
    initial_state = {"released": []}  # noqa: RUF012

    def enforce_this_law(self, event: xp.Event) -> None:
        """One puff, into the wind; when and how it left is kept."""
        velocity = self.random.normal((0, 0, 5.0), (0.5, 0.5, 0.8)).tolist()
        name = f"puff {len(self.state['released'])}"
        self.engine.add_object(xp.PhysicalObject(position=MOUTH, velocity=velocity, name=name, **PUFF), laws=["wind"])
        self.state["released"].append([name, event.time, velocity])


def main() -> None:
    """Let it smoke, and throw balls."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="folder for the picture")
    parser.add_argument("--quick", action="store_true", help="steps of 1/64 s instead of 1/256 s")
    options = parser.parse_args()

    dt = 1 / 64 if options.quick else 1 / 256
    engine, balls = scene()
    engine.add_law("basic:wind", velocity=WIND, name="wind")
    chimney = engine.add_law(Chimney)
    record = engine.run(until=END, dt=dt, every=1 / 64)

    calm, others = scene()
    calm.run(until=END, dt=dt)
    puffs = [(engine.object(name), END - t, v) for name, t, v in chimney.state["released"]]
    smoke = max(math.dist(puff.position, closed_form(age, v)) for puff, age, v in puffs)
    apart = max(math.dist(ball.position, other.position) for ball, other in zip(balls, others, strict=True))
    for body in (puffs[0][0], balls[0]):
        print(f"{body.name} obeys", ", ".join(law.label() for law in body.laws))
    print(f"{len(puffs)} puffs; largest distance of one from the closed form: {smoke:.1e} m")
    print(f"{len(balls)} balls; largest distance of one from its way without wind: {apart:.1e} m")
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        print("picture:", draw(record, puffs, balls, options.out / "smoke_and_balls.png"))


def scene() -> tuple[xp.PhysicsEngine, list[xp.PhysicalObject]]:
    """Floor and balls, with the two laws that balls obey."""
    engine = xp.PhysicsEngine(up="z", seed=2004)
    laws = [
        engine.add_law("basic:planet_gravity", name="gravity"),
        engine.add_law("collision:elastic", restitution=0.85, name="collision"),
    ]
    engine.add_object(xp.PhysicalObject(xp.Plane((0, 0, 1)), fixed=True, name="floor"), laws=laws[1:])
    balls = [
        xp.PhysicalObject(
            xp.Sphere(0.15), mass=0.5, position=(13.5, 1.0 + k, 0.5 + k), velocity=(-3.6, 0, 4 + k), name=f"ball {k}"
        )
        for k in range(3)
    ]
    return engine, [engine.add_object(ball, laws=laws) for ball in balls]


def closed_form(t: float, v: tuple[float, ...]) -> np.ndarray:
    """Where [m] a puff is ``t`` after it left the chimney with ``v``: in the frame of the wind drag stops it along a line."""
    u = np.subtract(v, WIND)
    speed = math.hypot(*u)
    return np.array(MOUTH) + np.array(WIND) * t + u / speed * math.log1p(BETA * speed * t) / BETA


def draw(record: xp.Record, puffs: list[Any], balls: list[xp.PhysicalObject], path: Path) -> Path:
    """Seen from the side, at the end: smoke by its age, the ways of some puffs, and those of the balls."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 5.2), dpi=110, layout="constrained")
    axes = figure.add_subplot()
    axes.axhline(0, color="#9a9a9a", linewidth=3)
    axes.fill_between([-0.35, 0.35], 0, MOUTH[2], color="#8c564b")
    ages = np.array([age for _, age, _ in puffs])
    where = np.array([puff.position for puff, _, _ in puffs])
    axes.scatter(
        where[:, 0], where[:, 2], s=60 + 220 * ages, c="#555555", alpha=0.16, linewidth=0, label="smoke at 4 s"
    )
    for puff, _, _ in puffs[:: max(1, len(puffs) // 5)]:
        x = record[puff].position
        axes.plot(x[:, 0], x[:, 2], color="#555555", linewidth=0.8, alpha=0.8)
    for ball, color in zip(balls, ("#0072b2", "#d55e00", "#009e73"), strict=True):
        x = record[ball].position
        axes.plot(x[:, 0], x[:, 2], color=color, linewidth=1.4, label=ball.name)
        axes.plot(x[-1, 0], x[-1, 2], "o", color=color, markersize=9)
    axes.annotate(
        "", xy=(-0.6, 7.2), xytext=(-2.6, 7.2), arrowprops={"arrowstyle": "-|>", "color": "#e69f00", "linewidth": 2.5}
    )
    axes.text(-1.6, 7.45, "wind, 4 m/s", ha="center", color="#b87f00")
    axes.set(xlim=(-3, 16.5), ylim=(-0.2, 8.2), aspect="equal", xlabel="x [m]", ylabel="height [m]")
    axes.legend(loc="upper right", fontsize=9)
    axes.grid(alpha=0.25)
    figure.suptitle("Smoke obeys the wind and not gravity; balls obey gravity and collision and not the wind")
    figure.savefig(path)
    return path


if __name__ == "__main__":
    main()
