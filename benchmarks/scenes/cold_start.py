"""S5 in a new process: with an empty cache, and with what the first process left there; and S2, which is to compile nothing."""

from __future__ import annotations

import os
import statistics
import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.front import seconds
from benchmarks.tracing.starts import child

ROOT = Path(__file__).resolve().parents[2]
SAMPLES = 2
NAMES = (
    "process",
    "start to end",
    "CPU time",
    "of it to come by compiled code",
    "first run after the plan",
    "compiled",
    "numba imported",
)
PROGRAM = """
import hashlib, json, sys, time
sys.path.insert(0, {root!r})
from benchmarks.impacts import ours
from benchmarks.scenes import {module} as scene
problem = scene.PROBLEMS[0]
engine = ours.new_engine()
bodies = problem.build(engine)
engine.run(until=0.0)
begin = time.perf_counter()
engine.run(until=0.25)
first = time.perf_counter() - begin
bits = hashlib.sha256(repr([one.position for one in bodies]).encode()).hexdigest()
made = []
if "xpheve.compile" in sys.modules:
    from xpheve.compile import facts
    made = [one for one in facts() if one["origin"] != "interpreted"]
print(json.dumps({{
    "numba": "numba" in sys.modules, "bits": bits, "first": first,
    "kernels": len(made), "made": sum(one["seconds"] for one in made), "origins": sorted({{one["origin"] for one in made}}),
}}))
"""


def measure(samples: int, quick: bool, peers: tuple[str, ...]) -> dict[str, Any]:
    """Processes in turns; each turn has a home folder of its own, so that no cache is there but its own."""
    programs = {
        "S2": PROGRAM.format(root=str(ROOT), module="bounces"),
        "S5, empty cache": PROGRAM.format(root=str(ROOT), module="s05_elastic_spheres"),
        "S5, from cache": PROGRAM.format(root=str(ROOT), module="s05_elastic_spheres"),
    }
    here = {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    found: dict[str, list[dict[str, Any]]] = {name: [] for name in programs}
    for _ in range(1 if quick else min(samples, SAMPLES)):
        with tempfile.TemporaryDirectory() as folder:
            for name, program in programs.items():
                home = Path(folder, name[:2])
                home.mkdir(exist_ok=True)
                found[name].append(child(program, home, here))
    rows = {name: _middle(runs) for name, runs in found.items()}
    small, cold, warm = rows.values()
    compiled = cold["kernels"] > 0
    same = len({run["bits"] for name in list(programs)[1:] for run in found[name]}) == 1
    return {
        "id": "cold start",
        "title": "S5 in a new process",
        "names": NAMES,
        "rows": [_cells(name, row) for name, row in rows.items()],
        "text": "On the clock, medians; of a process the whole, with Python, NumPy, building 666 objects. Compiled code as the engine tells of it. "
        + ("Cold and from cache end in the same bits." if same else "COLD AND FROM CACHE END IN DIFFERENT BITS."),
        "bars": [
            _bar(
                "cold compile of S5 under 8 s (CPU time more than from cache)", cold["cpu"] - warm["cpu"], 8.0, compiled
            ),
            _bar("from cache under 1 s", warm["made"], 1.0, compiled),
            {
                "text": "small scenes compile nothing",
                "found": f"S2: {small['kernels']:.0f} kernels, numba {'imported' if small['numba'] else 'not imported'}",
                "met": small["kernels"] == 0 and not small["numba"],
            },
        ],
    }


def _middle(runs: list[dict[str, Any]]) -> dict[str, Any]:
    keys = ("clock", "cpu", "first", "made", "kernels")
    return {key: statistics.median(run[key] for run in runs) for key in keys} | {
        key: runs[-1][key] for key in ("numba", "origins")
    }


def _bar(text: str, found: float, limit: float, compiled: bool) -> dict[str, Any]:
    said = seconds(found) if compiled else "nothing was compiled"
    return {"text": text, "found": said, "met": compiled and found <= limit}


def _cells(name: str, row: dict[str, Any]) -> list[str]:
    kernels = f"{row['kernels']:.0f} ({', '.join(row['origins'])})" if row["kernels"] else "nothing"
    times = [seconds(row[key]) for key in ("clock", "cpu", "made", "first")]
    return [name, *times, kernels, "yes" if row["numba"] else "no"]
