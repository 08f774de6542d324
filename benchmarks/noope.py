"""Laws that wake only when needed, beside the same scene in which every law runs at each update.

The second is how NOOPE does it, the physics of objects before the thesis (S. Nourian, 2004, 1.4): an engine asks every law at every
update. Both runs are ours: same engine, same objects, same formulas. There are three settings:

- *when needed*: each law in the container that it would be given. Gravity and the wind are constant and stored, the wind is switched
  by two timers, collisions are found at their instant, the rest waits for what it waits for.
- *each update, stored*: each law in a container of `Steps(0)`. Forces are stored anew, object by object, at each update; the collision law
  looks who is in the floor, the door whether somebody called, the scale whether a mass is another than before.
- *each update, in arrays*: the same, but forces are evaluated along the way by core:midpoint, for all objects in one array
  operation. No engine of objects does that. (Without counting, laws are formulas, and the run loop takes less: benchmarks/tracing.)

Two scenes of the same 300 balls: in *busy* they bounce on a floor, in *quiet* the floor is out of reach.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

import xpheve as xp
from benchmarks import report
from benchmarks.calibrate import machine
from benchmarks.measure import SAMPLES, cpu_time
from xpheve import when
from xpheve_laws_collision import Elastic

ROOT = Path(__file__).resolve().parent.parent
BEGIN, END = "<!-- laws when needed: written by benchmarks/noope --page -->", "<!-- end of laws when needed -->"
BALLS, SPAN, RADIUS, GRAVITY, RESTITUTION = 300, 4.0, 0.1, 9.81, 0.8
PUSH, BLOWS = 0.5, (0.71, 1.23)  # [N], [s]
HEAVIER_AT, HEAVIER = 2.1, 2.0  # one ball's mass is set [s], [kg]
SETTINGS = ("when needed", "each update, stored", "each update, in arrays")

CONTENDERS = ((SETTINGS[0], None), (SETTINGS[1], 1 / 60), (SETTINGS[2], 1 / 60), (SETTINGS[2], 1 / 240))

asked: Counter[str] = Counter()
"""How many objects each law was asked about: the sum over its calls."""


class Gravity(xp.FieldLaw):
    """Uniform gravity, counted: by `apply`, since a formula is no place to count in."""

    id = "noope:gravity"
    acceleration = xp.Param(9.81, unit="m/s^2", ge=0)

    def apply(self, body: Any) -> Any:
        """Weight [N]."""
        asked[self.id] += len(body.mass)
        return self.acceleration * body.mass * -body.up

    def potential(self, body: Any) -> Any:
        """Potential energy [J]."""
        return self.acceleration * body.mass * body.position.dot(body.up)


class EachTime(Gravity):
    """Gravity that says that it depends on where a body is, and so is asked at each update."""

    def apply(self, body: Any) -> Any:
        """Weight [N]."""
        return super().apply(body) + 0.0 * body.position


class Wind(xp.FieldLaw):
    """A constant push; switched on and off by others."""

    id = "noope:wind"

    def apply(self, body: Any) -> Any:
        """Push [N]."""
        asked[self.id] += len(body.mass)
        return (PUSH, 0.0, 0.0)


class WindByClock(Wind):
    """The same push, which looks at the clock by itself."""

    def apply(self, body: Any) -> Any:
        """Push [N], while it blows."""
        asked[self.id] += len(body.mass)
        return (PUSH * bool(BLOWS[0] <= body.time < BLOWS[1]), 0.0, 0.0)


class Switch(xp.PhysicalLaw):
    """Turns the wind on or off."""

    id = "noope:switch"

    def enforce_this_law(self, event: Any) -> None:
        """Turn it."""
        asked[self.id] += 1
        wind = self.engine.law("wind")  # type: ignore[union-attr]
        wind.enabled = not wind.enabled


class Bounce(Elastic):
    """`collision:elastic`, counted."""

    id = "noope:bounce"

    def respond(self, contact: Any) -> float:
        """Speed [m/s] at which the pair parts."""
        asked[self.id] += 1
        return super().respond(contact)


class BounceIfInside(xp.PhysicalLaw):
    """Looks at each update which balls are in the floor and come down, and turns them back. The floor only: no pairs of balls."""

    id = "noope:bounce"

    def enforce_this_law(self, event: Any) -> None:
        """Look at all."""
        bodies, objects = self.engine.bodies, self.engine.objects  # type: ignore[union-attr]
        asked[self.id] += len(objects) - 1
        place, speed = bodies.position[:, 2], bodies.velocity[:, 2]
        for row in np.flatnonzero((place - RADIUS < objects[0].position[2]) & (speed < 0.0)):
            if row:
                x, y, z = objects[row].velocity
                objects[row].velocity = (x, y, -RESTITUTION * z)


class Door(xp.PhysicalLaw):
    """Waits for somebody to call, and nobody does."""

    id = "noope:door"
    initial_state: ClassVar[dict[str, Any]] = {"calls": 0}

    def enforce_this_law(self, event: Any) -> None:
        """Open, if somebody called."""
        asked[self.id] += 1
        if event.id == "open":
            self.state["calls"] += 1


class Scale(xp.PhysicalLaw):
    """Notes which mass was set; as a law of each update it must compare all of them."""

    id = "noope:scale"
    initial_state: ClassVar[dict[str, Any]] = {"noted": 0, "known": []}

    def enforce_this_law(self, event: Any) -> None:
        """Note."""
        if event.id == "mass":
            asked[self.id] += len(event.objects)
            self.state["noted"] += len(event.objects)
            return
        masses = self.engine.bodies.mass  # type: ignore[union-attr]
        asked[self.id] += len(masses) - 1
        now = [float(m) for m in np.ravel(masses)]
        if self.state["known"]:
            self.state["noted"] += sum(a != b for a, b in zip(now, self.state["known"], strict=True))
        self.state["known"] = now


@dataclass
class Scene:
    """One scene with one setting, built and planned."""

    engine: xp.PhysicsEngine
    balls: tuple[xp.PhysicalObject, ...]
    dt: float | None

    def go(self) -> None:
        """To the end; the host sets one mass on the way."""
        self.engine.run(until=HEAVIER_AT, dt=self.dt)
        self.balls[0].mass = HEAVIER
        self.engine.run(until=SPAN, dt=self.dt)


def heights(n: int) -> Any:
    """Heights [m] of the centres at the start: 3 to 12 m."""
    return RADIUS + 3.0 + 9.0 * np.arange(n) / n


def build(setting: str, dt: float | None = None, *, n: int = BALLS, quiet: bool = False) -> Scene:
    """A scene, planned."""
    engine = xp.PhysicsEngine(up="z")
    floor = xp.PhysicalObject(xp.Plane(), fixed=True, position=(0, 0, -1000.0 if quiet else 0.0))
    balls = [xp.PhysicalObject(xp.Sphere(RADIUS), position=(2.0 * k, 0, h)) for k, h in enumerate(heights(n).tolist())]
    gravity, wind, bounce, others = LAWS[setting](engine)
    engine.add_object(floor, laws=[bounce])
    engine.add_objects(balls, laws=[gravity, bounce, *others])
    for ball in balls[: n // 3]:
        engine.map(ball, wind)
    engine.run(until=0.0, dt=dt)
    return Scene(engine, tuple(balls), dt)


Laws = tuple[xp.PhysicalLaw, xp.PhysicalLaw, xp.PhysicalLaw, list[xp.PhysicalLaw]]


def _when_needed(engine: xp.PhysicsEngine) -> Laws:
    gravity = engine.add_law(Gravity(acceleration=GRAVITY))
    wind = engine.add_law(Wind(name="wind", enabled=False))
    bounce = engine.add_law(Bounce(restitution=RESTITUTION))
    for instant in BLOWS:
        engine.add_law(Switch(), container=xp.LawContainer(when.Elapsed(instant)))
    engine.add_law(Door(), container=xp.LawContainer(when.Posted("open")))
    scale = engine.add_law(Scale(), container=xp.LawContainer(when.Changed("mass")))
    return gravity, wind, bounce, [scale]


def _stored(engine: xp.PhysicsEngine) -> Laws:
    each = xp.LawContainer(when.Steps(0), name="each update")
    gravity = engine.add_law(Gravity(acceleration=GRAVITY), container=each)
    wind = engine.add_law(WindByClock(name="wind"), container=each)
    return gravity, wind, *_looking(engine, each)


def _in_arrays(engine: xp.PhysicsEngine) -> Laws:
    gravity = engine.add_law(EachTime(acceleration=GRAVITY))
    wind = engine.add_law(WindByClock(name="wind"))
    return gravity, wind, *_looking(engine, xp.LawContainer(when.Steps(0), name="each update"))


def _looking(engine: xp.PhysicsEngine, each: xp.LawContainer) -> tuple[xp.PhysicalLaw, list[xp.PhysicalLaw]]:
    bounce = engine.add_law(BounceIfInside(), container=xp.LawContainer(when.Steps(0, at="middle")))
    return bounce, [engine.add_law(Door(), container=each), engine.add_law(Scale(), container=each)]


LAWS: dict[str, Callable[[xp.PhysicsEngine], Laws]] = dict(
    zip(SETTINGS, (_when_needed, _stored, _in_arrays), strict=True)
)


def exact(n: int, *, quiet: bool = False) -> Any:
    """Places [m] at `SPAN` in closed form, shape (n, 3): falls and bounces in z, a push for a while in x."""
    places = np.zeros((n, 3))
    places[:, 0] = 2.0 * np.arange(n)
    blown = BLOWS[1] - BLOWS[0]  # all masses are 1 kg until then
    places[: n // 3, 0] += PUSH * blown * (blown / 2 + SPAN - BLOWS[1])
    for k, h in enumerate((heights(n) - RADIUS).tolist()):
        places[k, 2] = RADIUS + (h - 0.5 * GRAVITY * SPAN**2 if quiet else _height(h))
    return places


def _height(h: float) -> float:
    """Height [m] over the floor at `SPAN` of what is let go at ``h``."""
    fall = (2 * h / GRAVITY) ** 0.5
    if fall >= SPAN:
        return h - 0.5 * GRAVITY * SPAN**2
    time, speed = fall, GRAVITY * fall * RESTITUTION
    while time + 2 * speed / GRAVITY < SPAN:
        time, speed = time + 2 * speed / GRAVITY, speed * RESTITUTION
    s = SPAN - time
    return speed * s - 0.5 * GRAVITY * s * s


def run_once(setting: str, dt: float | None, *, n: int = BALLS, quiet: bool = False) -> dict[str, Any]:
    """One run: CPU time [s] of a planned scene, how often laws were called and about how many objects, planning included, and errors [m]."""
    asked.clear()
    scene = build(setting, dt, n=n, quiet=quiet)
    seconds = cpu_time(scene.go)
    off = np.linalg.norm([ball.position for ball in scene.balls] - exact(n, quiet=quiet), axis=1)
    noted = sum(law.state["noted"] for law in scene.engine.laws if isinstance(law, Scale))
    return {
        "seconds": seconds,
        "calls": sum(law.evaluations for law in scene.engine.laws),
        "asked": sum(asked.values()),
        "by law": {id: asked[id] for id in sorted(asked)},
        "noted": noted,
        "error": float(off.max()),
        "median error": float(np.median(off)),
    }


def measure(samples: int, n: int = BALLS) -> list[dict[str, Any]]:
    """All rows, each with its time over that of *when needed* in the same turn: medians."""
    rows = []
    for quiet in (False, True):
        found: list[list[dict[str, Any]]] = [[] for _ in CONTENDERS]
        for _ in range(samples):
            for (setting, dt), runs in zip(CONTENDERS, found, strict=True):
                runs.append(run_once(setting, dt, n=n, quiet=quiet))
        for (setting, dt), runs in zip(CONTENDERS, found, strict=True):
            row = dict(runs[0]) | {"scene": "quiet" if quiet else "busy", "setting": setting, "dt": dt}
            row["seconds"] = statistics.median(run["seconds"] for run in runs)
            row["ratio"] = statistics.median(a["seconds"] / b["seconds"] for a, b in zip(runs, found[0], strict=True))
            rows.append(row)
    return rows


def table(results: dict[str, Any]) -> str:
    """The results as Markdown."""
    about = results["machine"]
    lines = [
        f"Machine: {about['cores']} ({about['processor']}), Python {about['python']}, NumPy {about['numpy']}. {results['balls']} balls, "
        f"{SPAN:g} s; CPU time, medians of {results['samples']}, in turns."
        + (" A QUICK run." if results["quick"] else ""),
        "",
        "| scene | laws run | dt [s] | CPU time | times ours | calls of laws | objects asked about | worst error [m] |",
        "|" + " --- |" * 8,
    ]
    for row in results["rows"]:
        dt = "none" if row["dt"] is None else f"1/{round(1 / row['dt'])}"
        cells = [row["scene"], row["setting"], dt, report._seconds(row["seconds"]), f"{row['ratio']:.2f}"]
        cells += [f"{row['calls']:,}", f"{row['asked']:,}", report._number(row["error"])]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def put_into_page(text: str, page: Path) -> None:
    """Replace what stands between the two marks of the page."""
    before, _, rest = page.read_text(encoding="utf-8").partition(BEGIN)
    _, _, after = rest.partition(END)
    page.write_text(f"{before}{BEGIN}\n\n{text}\n{END}{after}", encoding="utf-8")


def main(arguments: Sequence[str] | None = None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="benchmarks/noope", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="few samples, 12 balls: to see that all works")
    parser.add_argument("--samples", type=int, help=f"turns that each row has (default: {SAMPLES})")
    parser.add_argument(
        "--out", type=Path, help="folder for the results (default: benchmarks/results; of --quick, .benchmarks)"
    )
    parser.add_argument("--page", action="store_true", help="put the table into docs/benchmarks.md, too")
    chosen = parser.parse_args(arguments)
    samples, n = (2, 12) if chosen.quick else (SAMPLES, BALLS)
    results: dict[str, Any] = {
        "machine": machine(),
        "samples": chosen.samples or samples,
        "balls": n,
        "quick": chosen.quick,
    }
    results["rows"] = measure(chosen.samples or samples, n)
    text = table(results)
    print(text)
    out = chosen.out or ROOT / (".benchmarks" if chosen.quick else "benchmarks/results")
    out.mkdir(parents=True, exist_ok=True)
    (out / "noope.json").write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    (out / "noope.md").write_text(text, encoding="utf-8")
    if chosen.page:
        put_into_page(text, ROOT / "docs" / "benchmarks.md")
    return 0


if __name__ == "__main__":
    sys.exit(main())
