"""A car driven by keys: press adds a force without end, release removes it. Section 2.5.1 of the thesis.

Run it with ``python examples/driven_car.py [--out DIR] [--quick]``; with ``--out`` it writes a picture.

The arrow keys of the thesis's racing game: as nobody knows how long a key will be held, a press adds a force of infinite
duration and keeps its id, and the release removes the force of that id (S. Nourian, 2004). But keyboards repeat: a
key that is held sends press after press, and one release. Two cars are driven by the same keys. The first does as the thesis
prints it, a force for each press: it accelerates faster and faster, and the release takes away the last force only. The
second knows which keys are down, and gives the force of a key the key's name as id: it obeys.

The picture shows acceleration, speed and way of both; the way of the second is that of the closed form, to rounding, though
no key event falls on a frame.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import xpheve as xp

MASS = 900.0  # [kg]
FORCES = {"up": (1800.0, 0.0, 0.0), "down": (-1350.0, 0.0, 0.0)}  # [N]
HELD = [("up", 0.513, 2.517), ("down", 4.001, 5.253), ("up", 6.107, 6.911)]  # key, from, to [s]
FIRST, REPEAT = 0.5, 0.033  # [s] until the first repeat, and between repeats, as keyboards do


class NaiveDriver:
    """What the thesis prints: each press adds a force and keeps its id, the release removes that id."""

    def __init__(self, car: xp.PhysicalObject) -> None:
        self.car = car
        self.ids: dict[str, int | str] = {}

    def pressed(self, key: str) -> None:
        """A press, or a repeat of one."""
        self.ids[key] = self.car.add_force(FORCES[key]).id

    def released(self, key: str) -> None:
        """The release."""
        self.car.remove_force(self.ids.pop(key))


class Driver:
    """The same with a memory: a key that is down is not pressed again. The key's name is the id of its force."""

    def __init__(self, car: xp.PhysicalObject) -> None:
        self.car = car
        self.down: set[str] = set()

    def pressed(self, key: str) -> None:
        """A press, or a repeat of one, which changes nothing."""
        if key not in self.down:
            self.down.add(key)
            self.car.add_force(FORCES[key], id=key)

    def released(self, key: str) -> None:
        """The release."""
        self.down.discard(key)
        self.car.remove_force(key)


def main() -> None:
    """Drive both cars with the same keys."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="folder for the picture")
    parser.add_argument("--quick", action="store_true", help="30 frames a second instead of 60")
    options = parser.parse_args()

    engine = xp.PhysicsEngine(up="z")
    naive = engine.add_object(xp.PhysicalObject(mass=MASS, position=(0, 3, 0), name="a force for each press"))
    car = engine.add_object(xp.PhysicalObject(mass=MASS, name="a force for each key"))
    drivers = [NaiveDriver(naive), Driver(car)]
    rate = 30 if options.quick else 60
    frames = [(k / rate, "frame", "") for k in range(8 * rate + 1)]
    rows = []
    for t, what, key in sorted(frames + keyboard()):
        engine.run(until=t)
        if what == "frame":
            rows.append((t, *(value for one in (naive, car) for value in look(one))))
        for driver in drivers:
            if what == "press":
                driver.pressed(key)
            elif what == "release":
                driver.released(key)

    presses = sum(what == "press" for _, what, _ in keyboard())
    x, v = closed_form(8.0)
    error = max(abs(car.position[0] - x) / x, abs(car.velocity[0] - v) / v)
    print(f"{len(HELD)} times a key was held; the keyboard sent {presses} presses and {len(HELD)} releases")
    print(f"a force for each key:   {car.velocity[0]:10.3f} m/s, {len(car.forces)} forces left")
    print(f"a force for each press: {naive.velocity[0]:10.3f} m/s, {len(naive.forces)} forces left")
    print(f"closed form:            {v:10.3f} m/s = F/m times the time that each key was down")
    print(f"error of the way and the speed: {error:.1e}")
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        print("picture:", draw(rows, options.out / "driven_car.png"))


def keyboard() -> list[tuple[float, str, str]]:
    """What the keyboard sends: press, repeats, release."""
    sent = []
    for key, down, up in HELD:
        sent.append((down, "press", key))
        repeats = max(0, math.ceil((up - down - FIRST) / REPEAT))
        sent += [(down + FIRST + k * REPEAT, "press", key) for k in range(repeats)]
        sent.append((up, "release", key))
    return sent


def closed_form(t: float) -> tuple[float, float]:
    """Way [m] and speed [m/s] at ``t``: each time a key was held adds a (t - (from + to)/2) d and a d."""
    pushes = [(FORCES[key][0] / MASS * (up - down), (down + up) / 2) for key, down, up in HELD]
    return math.fsum(v * (t - middle) for v, middle in pushes), math.fsum(v for v, _ in pushes)


def look(car: xp.PhysicalObject) -> tuple[float, float, float]:
    """Acceleration [m/s^2], speed [m/s] and way [m]."""
    return math.fsum(force.vector[0] for force in car.forces) / MASS, car.velocity[0], car.position[0]


def draw(rows: list[tuple[float, ...]], path: Path) -> Path:
    """Both cars against time; shaded where a key is down."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 7), dpi=110, layout="constrained")
    panels = figure.subplots(3, 1, sharex=True)
    time, *columns = zip(*rows, strict=True)
    labels = ("acceleration [m/s²]", "speed [m/s]", "way [m]")
    limits = ((-3.5, 6.5), (-2, 14), (-2, 60))
    for k, (axes, label, limit) in enumerate(zip(panels, labels, limits, strict=True)):
        for key, down, up in HELD:
            axes.axvspan(down, up, color="#e69f00" if key == "up" else "#56b4e9", alpha=0.22, linewidth=0)
            if k == 0:
                axes.text((down + up) / 2, limit[1] * 0.97, f"{key} key", ha="center", va="top", fontsize=9)
        style = "steps-post" if k == 0 else "default"  # forces jump
        axes.plot(time, columns[k], "--", drawstyle=style, color="#d55e00", label="a force for each press: runs away")
        axes.plot(
            time, columns[3 + k], drawstyle=style, color="#0072b2", linewidth=2, label="a force for each key: obeys"
        )
        axes.set(ylabel=label, ylim=limit, xlim=(0, 8))
        axes.grid(alpha=0.25)
    panels[1].legend(loc="upper right", fontsize=9)
    panels[2].set_xlabel("time [s]")
    figure.suptitle("A car driven by keys that repeat")
    figure.savefig(path)
    return path


if __name__ == "__main__":
    main()
