"""Ours and REBOUND's: each finds the accelerations of a softened Plummer sphere, G = 1, whole mass 1."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from xpheve.compile import assemble, compiled
from xpheve.kernels import tree
from xpheve.loop.direct_sum import DirectSum
from xpheve_laws_basic import UniversalGravity

Array = Any
SOFTENING = 0.01

TREE = """
def entry(f, n):
    return tree__solve(n[0][0], f[0], n[1], f[1], f[2][0], f[2][1])
"""


def plummer(count: int, seed: int = 1) -> Array:
    """Places (3, count) of a Plummer sphere of radius 1, cut at 0.1% and 99.9% of its mass."""
    rng = np.random.default_rng(seed)
    radius = 1.0 / np.sqrt(rng.uniform(0.001, 0.999, count) ** (-2.0 / 3.0) - 1.0)
    way = rng.normal(size=(3, count))
    return radius * way / np.linalg.norm(way, axis=0)


def exact(x: Array, which: Array) -> Array:
    """Accelerations (3, len(which)) of the bodies ``which``, summed in long double."""
    wide, mass = x.astype(np.longdouble), np.longdouble(1) / x.shape[1]
    found = np.empty((3, len(which)), dtype=np.longdouble)
    for k, body in enumerate(which):
        d = wide[:, body, None] - wide
        square = (d * d).sum(axis=0) + np.longdouble(SOFTENING) ** 2
        found[:, k] = -(mass / (square * np.sqrt(square)) * d).sum(axis=1)
    return found


def errors(found: Array, right: Array) -> tuple[float, float]:
    """Median and 99th percentile of the relative error of vectors (3, n)."""
    off = np.linalg.norm((found - right).astype(float), axis=0) / np.linalg.norm(right.astype(float), axis=0)
    return float(np.median(off)), float(np.percentile(off, 99))


class OurDirect:
    """All pairs by tiles."""

    def __init__(self, x: Array, threads: int = 1) -> None:
        self.count, self.threads = x.shape[1], threads
        self.columns = {"position": x, "mass": np.full(self.count, 1.0 / self.count)}
        self.sum = DirectSum(UniversalGravity(gravitational_constant=1.0, softening=SOFTENING), self.count)
        self.act()

    def act(self) -> None:
        """One evaluation."""
        self.forces = self.sum.forces(self.columns, self.threads)

    def read(self) -> Array:
        """Accelerations, (3, count)."""
        return self.forces * self.count


class OurTree:
    """The tree, with its build and its check, for an ``error``."""

    def __init__(self, x: Array, error: float) -> None:
        self.x, self.count = x, x.shape[1]
        size = self.size = tree.stride(self.count)
        self.s, self.t = np.zeros(tree.floats(self.count)), np.zeros(tree.SCRATCH)
        self.w, self.n = np.zeros(tree.ints(self.count), dtype=np.int64), np.array([self.count])
        self.numbers = np.array([SOFTENING**2, error])
        self.kernel = compiled(assemble(TREE), "the tree")
        self.places = self.s[: 4 * size].reshape(4, size)
        self.act()

    def act(self) -> None:
        """One evaluation."""
        self.places[:3, : self.count] = self.x
        self.places[3, : self.count] = 1.0 / self.count
        self.walks = self.kernel([self.s, self.t, self.numbers], [self.n, self.w])

    @property
    def told(self) -> float:
        """The 99th percentile of the error that the tree measured itself."""
        return float(self.t[0])

    def read(self) -> Array:
        """Accelerations, (3, count)."""
        found = np.empty((3, self.count))
        found[:, self.w[: self.count]] = -self.s[4 * self.size :][: 3 * self.size].reshape(3, -1)[:, : self.count]
        return found


class Rebound:
    """REBOUND's own routine of accelerations: ``gravity`` is "basic" or, with an opening angle, "tree"."""

    def __init__(self, x: Array, gravity: str, angle: float = 0.0) -> None:
        import rebound

        self.count = x.shape[1]
        self.sim = rebound.Simulation()
        self.sim.G, self.sim.softening, self.sim.dt = 1.0, SOFTENING, 1e-12
        self.sim.integrator = "leapfrog"
        if gravity == "tree":
            self.sim.root_size, self.sim.opening_angle2 = 4.0 * float(np.abs(x).max()), angle * angle
        for px, py, pz in x.T.tolist():
            self.sim.add(m=1.0 / self.count, x=px, y=py, z=pz)
        self.sim.gravity = gravity
        self.whole_step = gravity == "tree"  # which builds the tree, as the routine alone does not
        self.library = rebound.clibrebound
        self.sim.steps(1)

    def act(self) -> None:
        """One evaluation; of a tree, a leapfrog step, of which it is nearly all."""
        if self.whole_step:
            self.sim.steps(1)
        else:
            self.library.reb_simulation_update_acceleration(ctypes.byref(self.sim))

    def read(self) -> Array:
        """Accelerations, (3, count)."""
        found = np.empty((3, self.count))
        for k in range(self.count):
            one = self.sim.particles[k]
            found[:, k] = one.ax, one.ay, one.az
        return found
