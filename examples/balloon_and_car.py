"""A balloon that collides but does not fall, and a car that does both: figures 3-25 and 5-1 of the thesis.

Run it with ``python examples/balloon_and_car.py [--out DIR] [--quick] [--live]``; with ``--out`` it writes a picture and a film,
with ``--live`` it ends as the thesis's program does, in ``engine.start()``: the same in real time.

The program printed in the thesis (S. Nourian, 2004) makes an engine, two laws, two lists of laws and two objects, and
ends in ``engine.start()``. It does not compile as printed. This one does the same in the same seven steps, and goes on
where the thesis stops: there is a floor, and the balloon drifts into the car.

Two things differ. ``run`` carries the scene to a time as fast as it can, before ``start()`` does so in real time. And the car
is a ball of the car's mass.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import xpheve as xp

G, RESTITUTION = 9.8, 0.4
CAR, BALLOON = 0.7, 0.3  # radii [m]
DROP = 1.5  # [m] the car falls before it meets the floor


def main() -> None:
    """The seven steps of figure 5-1."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="folder for a picture and a film")
    parser.add_argument("--quick", action="store_true", help="no film")
    parser.add_argument("--live", action="store_true", help="the same once more in real time")
    parser.add_argument("--speed", type=float, default=1.0, help="simulated seconds per second of --live")
    options = parser.parse_args()

    # 1: import the engine. 2: make one.
    engine = xp.PhysicsEngine(up="z")

    # 3: give the objects shapes.
    balloon = xp.PhysicalObject(
        xp.Sphere(BALLOON), mass=0.1, position=(-5, 0, 0.7), velocity=(2.0, 0, 0), restitution=0.8, name="balloon"
    )
    car = xp.PhysicalObject(xp.Sphere(CAR), mass=900.0, position=(0, 0, CAR + DROP), name="car")
    floor = xp.PhysicalObject(xp.Plane(), fixed=True, name="floor")

    # 4: make the laws. Each brings a container that says when it is enforced.
    gravity = engine.add_law("basic:planet_gravity", acceleration=G)
    collision = engine.add_law("collision:elastic", restitution=RESTITUTION)

    # 5: say which laws an object obeys.
    collision_law_only = [collision]
    all_laws = [gravity, collision]

    # 6: add the objects with their laws.
    engine.add_object(balloon, collision_law_only)
    engine.add_object(car, all_laws)
    engine.add_object(floor, collision_law_only)

    # 7: let time pass.
    before = engine.energy()
    again = engine.copy()
    record = engine.run(until=4.0, every=1 / 60)

    met, leaves = closed_form()
    k = int(record.time.searchsorted(met)) - 1  # the last frame before the two meet
    flown = -5 + 2.0 * record.time[k]
    errors = {
        "balloon's way before it meets the car": abs(float(record[balloon].position[k, 0]) - flown),
        "balloon's velocity after": abs(balloon.velocity[0] - leaves[0]),
        "car's velocity after": abs(car.velocity[0] - leaves[1]),
        "car's height at rest": abs(car.position[2] - CAR),
        "balloon's height, which no law changes": abs(balloon.position[2] - 0.7),
    }
    print("balloon", balloon.position, balloon.velocity, "obeys", [law.label() for law in balloon.laws])
    print("car    ", car.position, car.velocity, "obeys", [law.label() for law in car.laws])
    for what, error in errors.items():
        print(f"  error of the {what}: {error:.1e}")
    print(f"largest error against the closed form: {max(errors.values()):.1e}")
    balance = abs(engine.energy().balance - before.balance) / before.total
    print(f"error of the energy balance: {balance:.1e} of the energy at the start")
    if options.live:
        live(again, options.speed)
        print(
            "in real time: the same bits"
            if again.checkpoint() == engine.checkpoint()
            else "in real time: something else"
        )
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        print("picture:", record.plot(options.out / "balloon_and_car.png"))
        if not options.quick:
            print("film:   ", record.animate(options.out / "balloon_and_car.gif", frames=100, size=(480, 300)))


def live(engine: xp.PhysicsEngine, speed: float) -> None:
    """Show the balloon four times a simulated second, on a thread of its own, to 4 s."""
    balloon = engine.object("balloon")
    engine.start(speed=speed, until=4.0)
    for quarter in range(1, 17):
        engine.wait(until=quarter / 4)
        print(f"real time: t = {engine.time:.2f} s, the balloon is at x = {balloon.position[0]:.2f} m")
    engine.wait()
    engine.terminate()


def closed_form() -> tuple[float, tuple[float, float]]:
    """When balloon and car meet [s], and their velocities along x [m/s] afterwards (head-on: the car is at rest by then)."""
    hit = math.sqrt(2 * DROP / G)
    rests = hit * (1 + RESTITUTION) / (1 - RESTITUTION)
    met = (5 - CAR - BALLOON) / 2.0
    assert rests < met
    m, n, e = 0.1, 900.0, (0.8 + RESTITUTION) / 2  # the rule "average"
    together = m * 2.0 / (m + n)
    return met, (together - e * 2.0 * n / (m + n), together + e * 2.0 * m / (m + n))


if __name__ == "__main__":
    main()
