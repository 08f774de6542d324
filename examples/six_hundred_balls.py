"""666 balls fall through 551 tilted boxes onto a hill of 1,444 columns: restitution 0.9, 2,000 fixed things, 5 s.

Run it with ``python examples/six_hundred_balls.py [--out DIR] [--film] [--quick]``; with ``--out`` it writes a picture, with ``--film`` a film, too.

All balls fly parabolas from impact to impact, and all impacts are found and answered in one compiled loop (``collision:impact``): `explain` says
so. Nobody chose that; the plan did, as all that moves are balls, and all they may meet besides each other are fixed boxes and planes.

It prints the time, the impacts, the deepest place of any ball in a box, a wall or another ball in any frame, found here anew from places and
sizes, and the books of energy: what the impacts took is work, so that kinetic plus potential less work stays the same, to rounding.
"""

from __future__ import annotations

import argparse
import math
import random
import time
from pathlib import Path

import numpy as np

import xpheve as xp

END = 5.0  # [s]
BALLS, RADIUS = 666, 0.05  # [m]
COLUMNS, PITCH = 38, 0.24  # on a side; [m]
HANGING, APART = 551, 0.38  # [m]
EDGE = COLUMNS * PITCH  # [m] of the ground
WALLS = (((0, 0, -0.5), (0, 0, 1)), ((0, 0, 0), (1, 0, 0)), ((EDGE, 0, 0), (-1, 0, 0)),
         ((0, 0, 0), (0, 1, 0)), ((0, EDGE, 0), (0, -1, 0)))  # place, normal  # fmt: skip


def main() -> None:
    """Let them fall, and look at the books."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="folder for the picture")
    parser.add_argument("--film", action="store_true", help="a film, too; half a minute")
    parser.add_argument("--quick", action="store_true", help="1.5 s instead of 5 s")
    options = parser.parse_args()

    engine, balls, boxes = scene()
    engine.run(until=0.0)  # plans, and takes the loop from the cache, or compiles it
    before = engine.energy()
    clock = time.process_time()
    record = engine.run(until=1.5 if options.quick else END, every=1 / 16)
    clock = time.process_time() - clock
    after = engine.energy()

    contacts = engine.explain().data["contacts"]
    print(f"{len(balls)} balls among {len(boxes)} boxes and {len(WALLS)} planes, {engine.time:g} s")
    print(f"{contacts['impacts']} impacts, {clock:.1f} s of computing")
    print("; ".join(contacts["told"]))
    print(f"deepest place of a ball in anything, in any frame: {deepest(record, balls, boxes):.1e} m")
    print(f"kinetic and potential energy: {before.total:.6f} J at the start, {after.total:.6f} J at the end")
    print(f"work of the impacts: {after.work:.6f} J")
    print(f"error of the energy balance: {record.energy_drift:.1e} of the energy in play")
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        print("picture:", draw(record, balls, options.out / "six_hundred_balls.png"))
        if options.film:
            print("film:   ", record.animate(options.out / "six_hundred_balls.gif", frames=80, size=(480, 360)))


def scene() -> tuple[xp.PhysicsEngine, list[xp.PhysicalObject], list[xp.PhysicalObject]]:
    """The engine, its balls and its boxes. A ball whose bounces end on something that is no plane is held there."""
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", acceleration=9.81)
    bounce = engine.add_law("collision:elastic", restitution=0.9, resting="hold")
    for place, normal in WALLS:
        engine.add_object(xp.PhysicalObject(xp.Plane(normal), position=place, fixed=True), laws=[bounce])
    chance = random.Random(666)
    boxes = hill(chance) + tilted(chance)
    engine.add_objects(boxes, laws=[bounce])
    balls = rain(chance)
    engine.add_objects(balls, laws=[gravity, bounce])
    return engine, balls, boxes


def hill(chance: random.Random) -> list[xp.PhysicalObject]:
    """Columns side by side, whose tops make a hill with steps."""
    columns = []
    for k in range(COLUMNS * COLUMNS):
        x, y = (k % COLUMNS + 0.5) * PITCH, (k // COLUMNS + 0.5) * PITCH
        top = 0.5 * math.exp(-0.15 * math.dist((x, y), (EDGE / 2, EDGE / 2)) ** 2) + chance.uniform(0.0, 0.2)
        shape = xp.Box((PITCH, PITCH, top + 0.5))
        columns.append(xp.PhysicalObject(shape, position=(x, y, (top - 0.5) / 2), fixed=True))
    return columns


def tilted(chance: random.Random) -> list[xp.PhysicalObject]:
    """Boxes that hang above the hill, turned in all ways, so far apart that a ball passes between them."""
    boxes = []
    side = math.ceil(math.sqrt(HANGING))
    for k in range(HANGING):
        turn = [chance.gauss(0.0, 1.0) for _ in range(4)]
        place = ((k % side + 0.5) * APART, (k // side + 0.5) * APART, chance.uniform(1.2, 1.6))
        edges = [chance.uniform(0.06, 0.16) for _ in range(3)]
        boxes.append(xp.PhysicalObject(xp.Box(edges), position=place, orientation=turn, fixed=True))
    return boxes


def rain(chance: random.Random) -> list[xp.PhysicalObject]:
    """Balls in two layers above everything, each with a small throw."""
    side = math.ceil(math.sqrt(BALLS / 2))
    balls = []
    for k in range(BALLS):
        cell = (EDGE - 0.4) / side
        x, y = (0.2 + cell * (n + 0.5) + chance.uniform(-0.02, 0.02) for n in (k % side, k // side % side))
        velocity = [chance.uniform(-0.5, 0.5) for _ in range(3)]
        position = (x, y, 2.0 + 0.4 * (k // side**2))
        balls.append(xp.PhysicalObject(xp.Sphere(RADIUS), mass=0.1, position=position, velocity=velocity))
    return balls


def deepest(record: xp.Record, balls: list[xp.PhysicalObject], boxes: list[xp.PhysicalObject]) -> float:
    """The largest overlap [m] of a ball with a box, a plane or another ball in any frame; 0 if there is none."""
    centres = np.array([box.position for box in boxes])
    halves = np.array([box.shape.size for box in boxes]) / 2
    reach = np.linalg.norm(halves, axis=1) + RADIUS
    turns = np.array([xp.orientation.to_matrix(box.orientation) for box in boxes])  # columns: the axes of a box
    worst = 0.0
    for places in np.stack([record[ball].position for ball in balls], axis=1):  # (balls, 3), frame by frame
        a, b = np.nonzero(apart(places, centres) < reach)
        local = np.abs(np.einsum("nij,ni->nj", turns[b], places[a] - centres[b])) - halves[b]
        gaps = [np.linalg.norm(np.maximum(local, 0.0), axis=1) + np.minimum(local.max(axis=1), 0.0) - RADIUS]
        gaps += [(places - place) @ np.array(normal, float) - RADIUS for place, normal in WALLS]
        a, b = np.nonzero(np.triu(apart(places, places) < 3 * RADIUS, 1))
        gaps.append(np.linalg.norm(places[a] - places[b], axis=1) - 2 * RADIUS)
        worst = max(worst, -float(np.concatenate(gaps).min()))
    return worst


def apart(some: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Distances [m], shape (some, others), to 1e-7 or so: enough to see who is near."""
    squares = (some**2).sum(1)[:, None] + (others**2).sum(1) - 2 * some @ others.T
    return np.sqrt(np.maximum(squares, 0.0)) - 1e-6


def draw(record: xp.Record, balls: list[xp.PhysicalObject], path: Path) -> Path:
    """The ways of every sixth ball, seen from the side, and where all are at the end."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 4), dpi=110, layout="constrained")
    axes = figure.subplots()
    for ball in balls[::6]:
        axes.plot(*record[ball].position[:, [0, 2]].T, linewidth=0.6, alpha=0.5)
    ends = np.array([ball.position for ball in balls])
    axes.scatter(ends[:, 0], ends[:, 2], s=6, color="black")
    axes.set(xlabel="x [m]", ylabel="height [m]", xlim=(0, EDGE), ylim=(-0.1, 2.6), aspect="equal")
    figure.savefig(path)
    return path


if __name__ == "__main__":
    main()
