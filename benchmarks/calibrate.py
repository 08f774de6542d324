"""A fixed loop whose time tells how fast the machine is: divide by it to compare results of different machines.

One part is plain Python on floats, one NumPy on arrays of 10,000, one is compiled by the engine: what a loop of events is made of, reads from
here and there, square roots, branches.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Callable
from functools import cache

import numpy as np

from benchmarks.measure import SAMPLES, cpu_time, middle


def plain_python() -> float:
    """A damped oscillation in 100,000 steps of plain Python."""
    x, v, h = 1.0, 0.0, 1e-3
    for _ in range(100_000):
        v -= h * (x + 0.01 * v)
        x += h * v
    return x


def numpy_passes() -> float:
    """500 passes over 10,000 numbers in NumPy, three operations each."""
    x, v = np.linspace(0.0, 1.0, 10_000), np.linspace(1.0, 2.0, 10_000)
    out = np.empty(10_000)
    for k in range(500):
        np.multiply(v, 1e-3 * k, out=out)
        np.add(out, x, out=out)
        np.multiply(out, 0.999, out=out)
    return float(out[-1])


COMPILED = """
def entry(f, n):
    places, steps, at, met = f[0], n[0][0], 1, 0.0
    for k in range(steps):
        at = (at * 1103515245 + 12345) & 8191
        b = places[at] - 0.75
        c = places[(at + 4096) & 8191]
        if b < 0.0:
            d = b * b - 0.25 * c
            if d > 0.0:
                met = met + c / (math.sqrt(d) - b)
                places[at] = places[at] * 0.9999 + 0.00005
    f[1][0] = met
    return 0
"""
"""4,000,000 rounds over 64 KiB: a place drawn, a quadratic equation solved if there is one, a place written."""


@cache
def compiled() -> Callable[[], float] | None:
    """The compiled part, ready to be called; None where xPheve is not there, or cannot compile."""
    try:
        from xpheve.compile import assemble
        from xpheve.compile import compiled as made
    except ImportError:
        return None
    from xpheve.errors import CompileError

    try:
        kernel = made(assemble(COMPILED, {}), what="the fixed loop")
    except CompileError:
        return None
    rounds, out = np.array([4_000_000]), np.zeros(1)

    def run() -> float:
        kernel([np.linspace(0.0, 1.0, 8192), out], [rounds])
        return float(out[0])

    return run


def calibrate(samples: int = SAMPLES) -> dict[str, float]:
    """CPU time [s] of each part, median of ``samples``."""
    parts: dict[str, Callable[[], float]] = {"python": plain_python, "numpy": numpy_passes}
    fixed = compiled()
    if fixed is not None:
        parts["compiled"] = fixed
    found: dict[str, list[float]] = {name: [] for name in parts}
    for _ in range(samples):
        for name, part in parts.items():
            found[name].append(cpu_time(part))
    return {name: middle(times)[0] for name, times in found.items()}


def machine() -> dict[str, str]:
    """What kind of machine this is."""
    return {
        "cores": f"{os.cpu_count()} shared cores",
        "processor": platform.machine(),
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


if __name__ == "__main__":
    for part, seconds in calibrate().items():
        print(f"{part}: {1e3 * seconds:.2f} ms")
