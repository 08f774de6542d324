"""Thirty-six balls of many sizes in a closed room: six walls, gravity, and a little loss at each impact.

Run it with ``python examples/bouncing_room.py [--out DIR] [--html] [--quick]``. It writes ``room.png`` and ``room.gif``
into DIR (default ``room-out``), and says how well energy is kept. Most of the time goes into the film.

No ball comes to rest within these seconds, so that nothing has to be held in place.
"""

from __future__ import annotations

import argparse
import random
import time
from pathlib import Path

import xpheve as xp

SIDE = 4.0  # [m] of the room in x and y
HEIGHT = 3.0  # [m]
BALLS = 36


def main() -> None:
    """Fill the room, let it run, look at it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("room-out"), help="folder for the pictures")
    parser.add_argument("--quick", action="store_true", help="1 s, and no film")
    parser.add_argument("--html", action="store_true", help="the film as a web page, too")
    options = parser.parse_args()
    end = 1.0 if options.quick else 8.0

    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", acceleration=9.81)
    bounce = engine.add_law("collision:elastic", restitution=0.95)
    room(engine, bounce)
    balls = fill(engine, [gravity, bounce])

    before = engine.energy()
    clock = time.process_time()
    record = engine.run(until=end, every=1 / 60)
    clock = time.process_time() - clock
    after = engine.energy()

    contacts = engine.explain().data["contacts"]
    print(f"{len(balls)} balls, {engine.time:g} s: {contacts['impacts']} impacts, {clock:.1f} s of computing")
    print(f"kinetic and potential energy: {before.total:.6f} J at the start, {after.total:.6f} J at the end")
    print(f"work of the impacts: {after.work:.6f} J")
    print(f"error of the energy balance: {record.energy_drift:.1e} of the energy in play")
    print(f"farthest into a wall in any frame: {deepest(record, balls):.1e} m")

    options.out.mkdir(parents=True, exist_ok=True)
    print("picture:", record.plot(options.out / "room.png"))
    if not options.quick:
        print("film:   ", record.animate(options.out / "room.gif", frames=120, size=(480, 360)))
    if options.html:
        print("film:   ", record.animate(options.out / "room.html", frames=120, size=(480, 360)))


def room(engine: xp.PhysicsEngine, bounce: xp.PhysicalLaw) -> None:
    """Floor, ceiling and four walls; each normal points into the room."""
    half = SIDE / 2
    walls = {
        "floor": ((0, 0, 0), (0, 0, 1)),
        "ceiling": ((0, 0, HEIGHT), (0, 0, -1)),
        "west": ((-half, 0, 0), (1, 0, 0)),
        "east": ((half, 0, 0), (-1, 0, 0)),
        "south": ((0, -half, 0), (0, 1, 0)),
        "north": ((0, half, 0), (0, -1, 0)),
    }
    for name, (position, normal) in walls.items():
        wall = xp.PhysicalObject(shape=xp.Plane(normal), position=position, fixed=True, name=name)
        engine.add_object(wall, laws=[bounce])


def fill(engine: xp.PhysicsEngine, laws: list[xp.PhysicalLaw]) -> list[xp.PhysicalObject]:
    """Balls on a grid in the air, thrown about; every sixth bounces without loss."""
    chance = random.Random(2004)
    balls = []
    for k in range(BALLS):
        column, row, layer = k % 4, k // 4 % 3, k // 12
        radius = chance.uniform(0.08, 0.24)
        position = (
            SIDE * ((column + 0.5) / 4 - 0.5) + chance.uniform(-0.2, 0.2),
            SIDE * ((row + 0.5) / 3 - 0.5) + chance.uniform(-0.3, 0.3),
            HEIGHT * (layer + 0.5) / 3 + chance.uniform(-0.15, 0.15),
        )
        velocity = (chance.uniform(-5, 5), chance.uniform(-5, 5), chance.uniform(-3, 5))
        own = {"restitution": 1.0} if k % 6 == 0 else {}
        ball = xp.PhysicalObject(
            xp.Sphere(radius), density=600.0, position=position, velocity=velocity, name=f"ball {k}", **own
        )
        balls.append(engine.add_object(ball, laws=laws))
    return balls


def deepest(record: xp.Record, balls: list[xp.PhysicalObject]) -> float:
    """The largest overlap [m] of a ball with a wall in any frame; 0 if there is none."""
    worst = 0.0
    for ball in balls:
        x, radius = record[ball].position, ball.shape.radius
        gaps = [SIDE / 2 - radius - abs(x[:, :2]).max(), x[:, 2].min() - radius, HEIGHT - radius - x[:, 2].max()]
        worst = max(worst, *(-gap for gap in gaps))
    return float(worst)


if __name__ == "__main__":
    main()
