"""A fixed loop whose time tells how fast the machine is: divide by it to compare results of different machines.

One part is plain Python on floats, the other NumPy on arrays of 10,000. (A compiled part joins when the engine compiles.)
"""

from __future__ import annotations

import os
import platform

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


def calibrate(samples: int = SAMPLES) -> dict[str, float]:
    """CPU time [s] of both parts, median of ``samples``."""
    found: dict[str, list[float]] = {"python": [], "numpy": []}
    for _ in range(samples):
        found["python"].append(cpu_time(plain_python))
        found["numpy"].append(cpu_time(numpy_passes))
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
