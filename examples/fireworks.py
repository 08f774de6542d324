"""Fireworks in a wind that grows with height: 2,000 sparks under gravity and a law of seven lines, which runs compiled.

Run it with ``python examples/fireworks.py [--out DIR] [--quick]``; with ``--out`` it writes a picture.

Five rockets burst at different heights. Each spark falls (``basic:planet_gravity``) and is slowed by the air, which moves: the
strength of the wind is a table of height, as somebody measured it. That law is written here, as a stranger would write it, and
nobody told the engine more than its formula. It was traced when it was added: `explain` says what it reads, and that its loop is compiled.

It prints how the loop runs and what a step takes; the books of energy (what drag took is work, so that kinetic plus potential less
work stays the same, to rounding); and the error of the sparks' places, measured by a run at half the step.

Source: drag at high Reynolds numbers, I. Newton, Principia (1687), book 2, section 2; the profile of the wind is made up.
"""

from __future__ import annotations

import argparse
import math
import time
from pathlib import Path
from typing import Any

import numpy as np

import xpheve as xp

END = 3.0  # [s]
BURSTS = (  # place [m], speed of the sparks [m/s], colour
    ((-60.0, 0.0, 110.0), 45.0, "#ffd166"),
    ((-25.0, 0.0, 165.0), 60.0, "#ef476f"),
    ((10.0, 0.0, 105.0), 40.0, "#06d6a0"),
    ((45.0, 0.0, 185.0), 55.0, "#4cc9f0"),
    ((75.0, 0.0, 120.0), 50.0, "#f78c6b"),
)
SPARKS = 400  # of each


class Sparks(xp.FieldLaw):
    """Drag in a wind along x that depends on height: F = -c |u| u, where u = v - w(z)."""

    id = "example:sparks"
    c = xp.Param(4e-5, unit="kg/m", ge=0, doc="c.")
    wind = xp.Table(
        (0, 20, 60, 150, 300), (0, 6, 14, 22, 24), unit_x="m", unit="m/s", outside="hold", doc="w by height."
    )

    def force(self, body: Any) -> Any:
        """Drag on each body [N]."""
        u = body.velocity - xp.vector(self.wind(body.position.z), 0, 0)
        return -self.c * u.norm() * u


def main() -> None:
    """Let them burst, and look at the books."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="folder for the picture")
    parser.add_argument("--quick", action="store_true", help="steps of 1/128 s instead of 1/1024 s")
    options = parser.parse_args()

    dt = 1 / 128 if options.quick else 1 / 1024
    engine, sparks = scene()
    begin = engine.energy()
    record = engine.run(until=END, dt=dt, every=1 / 32)
    told = engine.explain().data
    group, law = told["groups"][0], told["laws"][1]
    print(f"{len(sparks)} sparks; the loop is {group['tier']}: {group['tier_because']}")
    print(f"{law['id']} reads {', '.join(law['reads'])}; {law['kind']}")
    step = timed(dt)
    print(f"a step takes {1e6 * step:.0f} us, {1e9 * step / len(sparks):.0f} ns a spark")

    end = engine.energy()
    scale = max(abs(value) for value in (*begin, *end))
    print(
        f"energy [J]: kinetic {begin.kinetic:.4f} -> {end.kinetic:.4f}, potential {begin.potential:.4f} -> {end.potential:.4f}"
    )
    print(f"drag took {-end.work:.4f} J; error of the energy balance: {abs(end.balance - begin.balance) / scale:.1e}")
    finer, others = scene()
    finer.run(until=END, dt=dt / 2)
    apart = max(math.dist(one.position, other.position) for one, other in zip(sparks, others, strict=True))
    print(
        f"largest error of a place, by half the step: {4 / 3 * apart:.1e} m"
    )  # order 2: the finer run has a quarter of it
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        print("picture:", draw(record, options.out / "fireworks.png"))


def scene() -> tuple[xp.PhysicsEngine, list[xp.PhysicalObject]]:
    """All sparks at the instant of the bursts, in all directions alike."""
    engine = xp.PhysicsEngine(up="z", seed=5)
    laws = [engine.add_law("basic:planet_gravity"), engine.add_law(Sparks)]
    directions = evenly(SPARKS)
    sparks = [
        xp.PhysicalObject(mass=1e-3, position=place, velocity=(speed * direction).tolist())
        for place, speed, _ in BURSTS
        for direction in directions
    ]
    engine.add_objects(sparks, laws=laws)
    return engine, sparks


def evenly(count: int) -> np.ndarray:
    """Unit vectors that cover the sphere evenly, shape (count, 3): points on a spiral of the golden angle."""
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    turn = np.pi * (3.0 - math.sqrt(5.0)) * np.arange(count)
    return np.stack([np.sqrt(1.0 - z * z) * np.cos(turn), np.sqrt(1.0 - z * z) * np.sin(turn), z], axis=1)


def timed(dt: float, steps: int = 256) -> float:
    """How long a step takes [s], in calls of many steps; the best of three."""
    engine, _ = scene()
    best = math.inf
    for k in range(4):  # the first is for compiling
        started = time.perf_counter()
        engine.run(until=(k + 1) * steps * dt, dt=dt)
        best = min(best, time.perf_counter() - started) if k else best
    return best / steps


def draw(record: xp.Record, path: Path) -> Path:
    """The ways of the sparks, seen from the side against the night, beside the table of the wind."""
    from matplotlib.collections import LineCollection
    from matplotlib.figure import Figure

    ways = record.position.reshape(len(record), -1, 3)  # (frames, sparks, 3)
    figure = Figure(figsize=(9, 6.4), dpi=110, layout="constrained", facecolor="#0b1026")
    left, right = figure.subplots(1, 2, width_ratios=(7, 1), sharey=True)
    for k, (place, _, color) in enumerate(BURSTS):
        own = ways[:, k * SPARKS : (k + 1) * SPARKS]
        for until, alpha in ((17, 0.35), (65, 0.16)):  # 0.5 s and 2 s: the young parts shine
            lines = own[:until, ::2, [0, 2]].transpose(1, 0, 2)
            left.add_collection(LineCollection(list(lines), colors=color, linewidths=0.7, alpha=alpha))
        left.scatter(own[64, :, 0], own[64, :, 2], s=5, color=color, linewidth=0)
        left.plot(place[0], place[2], "+", color="white", markersize=7)
    left.axhline(0.0, color="#5c6784", linewidth=2)
    left.set(xlim=(-95, 160), ylim=(-5, 235), aspect="equal", xlabel="x [m]", ylabel="height [m]")
    height = np.linspace(0.0, 235.0, 96)
    right.plot([Sparks.wind(z) for z in height], height, color="#9ad1ff")
    right.set(xlabel="wind [m/s]", xlim=(0, 25))
    for axes in (left, right):
        axes.set_facecolor("#0b1026")
        axes.tick_params(colors="white")
        axes.xaxis.label.set_color("white")
        axes.yaxis.label.set_color("white")
        axes.grid(alpha=0.12)
    figure.suptitle(
        "2,000 sparks 2 s after five bursts: gravity, and drag in a wind that grows with height", color="white"
    )
    figure.savefig(path)
    return path


if __name__ == "__main__":
    main()
