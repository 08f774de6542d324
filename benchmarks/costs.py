"""What is paid once: adding and planning many objects, changing one among them, importing, starting the command line."""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from benchmarks.measure import cpu_time, middle
from benchmarks.scenes import s12_free_spheres

TOO_LONG = 5.0  # [s] what takes longer is measured once


@dataclass
class Cost:
    """One cost with its bar, if it has one; ``unit`` is s, ms, or times for a ratio."""

    name: str
    value: float | None
    unit: str
    bar: float | None
    note: str = ""

    @property
    def met(self) -> bool | None:
        """Whether it is within its bar; None if it has none or could not be measured."""
        return None if self.value is None or self.bar is None else self.value <= self.bar

    def plain(self) -> dict[str, Any]:
        """As values for files."""
        return asdict(self) | {"met": self.met}


def measure(samples: int, quick: bool) -> list[Cost]:
    """All costs."""
    n = 1000 if quick else 10_000
    found = []
    for laws in (GRAVITY, GRAVITY_AND_ELASTIC):
        found += adding(n, laws, samples)
        found += one_among(n if laws == GRAVITY or not quick else 200, laws, samples)
    return [*found, *importing(samples), command_line(samples)]


GRAVITY = ("basic:planet_gravity",)
GRAVITY_AND_ELASTIC = ("basic:planet_gravity", "collision:elastic")


def _label(laws: Sequence[str]) -> str:
    return " + ".join(law.split(":")[1] for law in laws)


def _made(n: int) -> list[Any]:
    import xpheve as xp

    positions, velocities = s12_free_spheres.start(n)
    return [
        xp.PhysicalObject(xp.Sphere(0.1), mass=1.0, position=place, velocity=velocity)
        for place, velocity in zip(positions.tolist(), velocities.tolist(), strict=True)
    ]


def _engine(laws: Sequence[str]) -> tuple[Any, list[Any]]:
    import xpheve as xp

    engine = xp.PhysicsEngine(up="z")
    return engine, [engine.add_law(law) for law in laws]


def adding(n: int, laws: Sequence[str], samples: int) -> list[Cost]:
    """``n`` objects made one by one, added with `add_objects`, mapped and planned (and started: the first run saves what `reset` restores)."""
    parts: list[tuple[float, float, float]] = []
    while len(parts) < samples:
        engine, obeyed = _engine(laws)
        held: list[Any] = []
        made = cpu_time(lambda held=held: held.extend(_made(n)))
        added = cpu_time(lambda held=held, engine=engine, obeyed=obeyed: engine.add_objects(held, laws=obeyed))
        planned = cpu_time(lambda engine=engine: engine.run(until=0.0))
        parts.append((made, added, planned))
        if sum(parts[-1]) > TOO_LONG:
            break
    made, added, planned = (statistics.median(part[k] for part in parts) for k in range(3))
    total = statistics.median(sum(part) for part in parts)
    note = f"made {made:.3f}, added {added:.3f}, planned and started {planned:.3f}"
    if len(parts) < samples:
        note += f"; measured {'once' if len(parts) == 1 else f'{len(parts)} times'}"
    return [Cost(f"{n:,} objects added, mapped, planned: {_label(laws)}", total, "s", 0.5, note)]


def one_among(n: int, laws: Sequence[str], samples: int) -> list[Cost]:
    """Adding one among ``n`` and planning again; removing one and planning again."""
    import xpheve as xp

    engine, obeyed = _engine(laws)
    objects = engine.add_objects(_made(n), laws=obeyed)
    engine.run(until=0.0)
    added, removed = [], []
    for k in range(samples):
        extra = xp.PhysicalObject(xp.Sphere(0.1), mass=1.0, position=(-10.0, 10.0 * k, 100.0))

        def add(extra: Any = extra) -> None:
            engine.add_object(extra, laws=obeyed)
            engine.run(until=0.0)

        def remove(k: int = k) -> None:
            engine.remove_object(objects[(k * n) // samples])
            engine.run(until=0.0)

        added.append(1e3 * cpu_time(add))
        removed.append(1e3 * cpu_time(remove))
    label = _label(laws)
    return [
        Cost(f"one added among {n:,}, planned: {label}", middle(added)[0], "ms", 1.0, f"at worst {max(added):.2f}"),
        Cost(
            f"one removed among {n:,}, planned: {label}", middle(removed)[0], "ms", 1.0, f"at worst {max(removed):.2f}"
        ),
    ]


def _child(arguments: Sequence[str]) -> tuple[float, int, str]:
    """CPU time [s] of a process from start to end, its exit code, and what it said of errors."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(arguments, capture_output=True, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return spent, done.returncode, done.stderr.strip()


FIRST_ENGINE = "import xpheve as xp; e = xp.PhysicsEngine(); e.add_object(xp.PhysicalObject(), laws=[e.add_law('basic:planet_gravity')]); e.run(1.0)"


def importing(samples: int) -> list[Cost]:
    """`import xpheve` over `import numpy`, each less the bare interpreter, in turns; and with what is loaded when first used."""
    programs = ("pass", "import numpy", "import xpheve", FIRST_ENGINE)
    times = [[_child([sys.executable, "-c", text])[0] for text in programs] for _ in range(samples + 1)][1:]
    bare, numpy, xpheve, first = (statistics.median(row[k] for row in times) for k in range(4))
    ratios = [statistics.median((row[k] - row[0]) / (row[1] - row[0]) for row in times) for k in (2, 3)]
    note = f"CPU time less that of the interpreter ({1e3 * bare:.0f} ms): xpheve {1e3 * (xpheve - bare):.0f} ms, numpy {1e3 * (numpy - bare):.0f} ms"
    if xpheve < numpy:
        note += "; numpy comes with the first name touched"
    used = f"{1e3 * (first - bare):.0f} ms in all, with numpy"
    return [
        Cost("import xpheve / import numpy", ratios[0], "times", 1.2, note),
        Cost("import, first engine, law, object and run / import numpy", ratios[1], "times", None, used),
    ]


def command_line(samples: int) -> Cost:
    """The process `xpheve run`, start to end, on a scene of 10 objects for 1 s."""
    import xpheve as xp

    name = "`xpheve run`, 10 objects, 1 s, start to end"
    command = Path(sys.executable).with_name("xpheve")
    program = [str(command)] if command.exists() else [sys.executable, "-c", "from xpheve.cli import main; main()"]
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder, "scene.toml")
        engine, laws = _engine(GRAVITY_AND_ELASTIC)
        engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=laws[1:])
        for k in range(9):
            engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(0.5 * k, 0.0, 1.0 + 0.1 * k)), laws=laws)
        engine.save_scene(scene)
        arguments = [*program, "run", str(scene), "--until", "1", "--out", str(Path(folder, "out"))]
        return _in_folder(name, arguments, folder, samples)


def _in_folder(name: str, arguments: list[str], folder: str, samples: int) -> Cost:
    import time

    cpu, wall = [], []
    for k in range(samples):
        arguments[-1] = os.path.join(folder, f"out{k}")
        begin = time.perf_counter()
        spent, code, said = _child(arguments)
        wall.append(time.perf_counter() - begin)
        cpu.append(spent)
        if code != 0:
            return Cost(
                name, None, "s", 1.0, f"not measured: exit code {code}: {(said.splitlines() or ['?'])[-1][:120]}"
            )
    return Cost(
        name,
        statistics.median(cpu),
        "s",
        1.0,
        f"CPU time; {statistics.median(wall):.2f} s on the clock of this shared machine",
    )
