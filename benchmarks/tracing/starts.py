"""Processes from start to end: a small scene, a first compiled run with an empty cache and with a full one, and `import numpy, numba`."""

from __future__ import annotations

import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.tracing.runner import has_loop

SCRIPT = """
import hashlib, json, sys
import xpheve as xp
engine = xp.PhysicsEngine(up="z"{how})
laws = [engine.add_law(id) for id in ("basic:planet_gravity", "basic:quadratic_drag", "basic:wind")]
made = [
    xp.PhysicalObject(mass=1.0 + 0.001 * k, position=(k, 0.0, 10.0), velocity=(0.01 * k, 1.0, 0.0), drag_area=0.01)
    for k in range({n})
]
engine.add_objects(made, laws=laws)
engine.run(until={until}, dt={dt})
bits = hashlib.sha256(repr([one.position for one in made]).encode()).hexdigest()
tiers = sorted({{str(law.get("tier", "-")) for law in engine.explain().data["laws"]}})
print(json.dumps({{"numba": "numba" in sys.modules, "llvmlite": "llvmlite" in sys.modules, "tiers": tiers, "bits": bits}}))
"""
IMPORTS = "import numpy, numba\nprint('{}')"
SMALL_BAR, COLD_BAR, WARM_BAR, WARM_RATIO_BAR, STRETCH_BAR = 1.0, 3.0, 0.8, 2.7, 0.3
OURS_TO_CHOOSE = ("XPHEVE_", "NUMBA_", "XDG_", "PYTHONPATH")


def script(n: int, compile: str, steps: int) -> str:
    """A program as a user would write it."""
    return SCRIPT.format(n=n, how=f", compile={compile!r}" if has_loop() else "", until=steps / 1024, dt="1 / 1024")


def child(program: str, home: Path, more: Mapping[str, str] | None = None) -> dict[str, Any]:
    """One process: seconds on the clock and of CPU from start to end, and what it said. Caches are below ``home``, which is all it has.

    ``more`` is put into its environment.
    """
    clean = {key: value for key, value in os.environ.items() if not key.startswith(OURS_TO_CHOOSE)}
    clean |= {"HOME": str(home), "USERPROFILE": str(home), "LOCALAPPDATA": str(home), **(more or {})}
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, env=clean, cwd=home, check=False
    )
    clock, after = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise RuntimeError(f"a start failed: {done.stderr[-2000:]}")
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {"clock": clock, "cpu": cpu, **json.loads(done.stdout.splitlines()[-1])}


def measure(samples: int, n: int = 1000, steps: int = 256) -> dict[str, Any]:
    """All starts, in turns, each turn in a home of its own: what they took, what was imported, whether bits are the same."""
    programs = {
        "small": script(10, "auto", steps),
        "cold": script(n, "always", steps),
        "warm": script(n, "always", steps),
        "imports": IMPORTS,
    }
    found: dict[str, list[dict[str, Any]]] = {name: [] for name in programs}
    for _ in range(samples):
        with tempfile.TemporaryDirectory() as folder:
            for name, program in programs.items():  # cold comes before warm: it fills the cache
                home = Path(folder, "small" if name == "small" else "home")
                home.mkdir(exist_ok=True)
                found[name].append(child(program, home))
    rows = {
        name: {key: statistics.median(run[key] for run in runs) for key in ("clock", "cpu")}
        | {key: runs[-1][key] for key in ("numba", "llvmlite", "tiers", "bits") if key in runs[-1]}
        for name, runs in found.items()
    }
    over = statistics.median(a["clock"] / b["clock"] for a, b in zip(found["warm"], found["imports"], strict=True))
    bits = {run["bits"] for name in ("cold", "warm") for run in found[name]}
    return {
        "n": n,
        "steps": steps,
        "rows": rows,
        "warm over imports": over,
        "same bits": len(bits) == 1,
        "verdicts": verdicts(rows, over),
    }


def verdicts(rows: dict[str, Any], over: float) -> list[dict[str, Any]]:
    """What was asked for, with its bars."""
    small, cold, warm = (rows[name]["clock"] for name in ("small", "cold", "warm"))
    compiled = "compiled" in "".join(rows["warm"]["tiers"])
    note = "" if compiled else "not compiled: this engine does not say so"

    def line(what: str, value: float, unit: str, bar: float, note: str = "", met: bool = True) -> dict[str, Any]:
        return {"what": what, "value": value, "unit": unit, "bar": bar, "met": met and value <= bar, "note": note}

    said = "numba not imported" if not rows["small"]["numba"] else "numba was imported"
    return [
        line("small scene, 10 objects", small, "s", SMALL_BAR, said, not rows["small"]["numba"]),
        line("first compiled run, empty cache", cold, "s", COLD_BAR, note, compiled),
        line("first compiled run, from cache", warm, "s", WARM_BAR, note, compiled),
        line("from cache / `import numpy, numba`", over, "times", WARM_RATIO_BAR, note, compiled),
        line(
            "stretch: from cache without numba",
            warm,
            "s",
            STRETCH_BAR,
            "with numba" if rows["warm"]["numba"] else "without numba",
            compiled and not rows["warm"]["numba"],
        ),
    ]
