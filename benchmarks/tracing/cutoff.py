"""A force of short reach: 10,000 bodies in a liquid drop, Lennard-Jones made smooth at its cutoff."""

from __future__ import annotations

from typing import Any

import numpy as np

import xpheve as xp
from benchmarks.tracing.runner import Array, Runner, Start, engine_runner, has_loop, new_engine

DT = 1 / 512
N, SPACING, HEAT = 10_000, 1.1, 1.0
DEPTH, SIZE, CUTOFF = 1.0, 1.0, 2.5


class SmoothLennardJones(xp.PairLaw):
    """Lennard-Jones, less the first two terms of its force over distance at the cutoff: F = (f(q) - f(q_c) - f'(q_c) (q - q_c)) d, q = d.d.

    So force and slope come to 0 at the cutoff, energy is conserved to the order of the step, and no square root is needed.
    Source: J. E. Lennard-Jones (1924); M. P. Allen, D. J. Tildesley, Computer Simulation of Liquids (2nd ed. 2017), 5.2.3.
    """

    id = "tracing:smooth_lennard_jones"

    depth = xp.Param(DEPTH, unit="J", doc="epsilon.")
    size = xp.Param(SIZE, unit="m", gt=0, doc="sigma.")
    cutoff = xp.Param(CUTOFF, unit="m", gt=0, doc="Where the force ends.")
    level = xp.Param(0.0, unit="N/m", doc="f(q_c).")
    slope = xp.Param(0.0, unit="N/m^3", doc="f'(q_c).")

    def force(self, a: Any, b: Any) -> Any:
        """Force [N] on ``a`` of each pair."""
        d = a.position - b.position
        q = d.dot(d)
        s = self.size * self.size / q
        c = s * s * s
        beyond = q - self.cutoff * self.cutoff
        return (24.0 * self.depth * (2.0 * c * c - c) / q - self.level - self.slope * beyond) * d


class Gated(SmoothLennardJones):
    """The same for an engine that does not know ``cutoff``: 0 beyond it."""

    def force(self, a: Any, b: Any) -> Any:
        """Force [N] on ``a`` of each pair."""
        d = a.position - b.position
        return np.where(d.dot(d) < self.cutoff * self.cutoff, super().force(a, b), 0.0)


def level(q: float = CUTOFF**2) -> float:
    """f(q), the plain force over distance [N/m]."""
    c = (SIZE**2 / q) ** 3
    return 24.0 * DEPTH * (2.0 * c * c - c) / q


def slope(q: float = CUTOFF**2) -> float:
    """f'(q) [N/m^3]."""
    c = (SIZE**2 / q) ** 3
    return 24.0 * DEPTH * (4.0 * c - 14.0 * c * c) / (q * q)


def start(n: int = N) -> Start:
    """``n`` bodies of 1 kg in a ball cut out of a shaken cubic lattice, hot enough to be liquid; no momentum."""
    random = np.random.default_rng(5)
    side = int((2.2 * n) ** (1 / 3)) + 2
    lattice = SPACING * (
        np.stack(np.meshgrid(*3 * [np.arange(side)], indexing="ij"), axis=-1).reshape(-1, 3) - side / 2
    )
    inner = lattice[np.argsort((lattice**2).sum(axis=1), kind="stable")[:n]]
    position = inner[random.permutation(n)] + random.uniform(-0.05, 0.05, (n, 3))
    velocity = random.normal(0.0, HEAT, (n, 3))
    return Start(position, velocity - velocity.mean(axis=0), np.ones(n))


def engine(compile: str = "always") -> Any:
    """A maker of this scene in an engine."""

    def make(begin: Start, dt: float) -> Runner:
        host = new_engine(compile)
        law = host.add_law(SmoothLennardJones if has_loop() else Gated, level=level(), slope=slope())
        columns = zip(begin.position.tolist(), begin.velocity.tolist(), begin.mass.tolist(), strict=True)
        objects = [xp.PhysicalObject(mass=m, position=x, velocity=v) for x, v, m in columns]
        host.add_objects(objects, laws=[law])
        return engine_runner(host, objects, dt)

    return make


def near(position: Array) -> Array:
    """Pairs closer than the cutoff, shape (pairs, 2)."""
    from scipy.spatial import cKDTree

    return cKDTree(position).query_pairs(CUTOFF, output_type="ndarray")


def energy(begin: Start, position: Array, velocity: Array) -> float:
    """Kinetic and potential energy [J]; the potential of a pair is -1/2 of the integral of the force over distance, 0 at the cutoff."""
    a, b = near(position).T
    d = position[a] - position[b]
    q, end = (d * d).sum(axis=1), CUTOFF**2
    c, c_end = (SIZE**2 / q) ** 3, (SIZE**2 / end) ** 3
    plain = 4.0 * DEPTH * (c * c - c) - 4.0 * DEPTH * (c_end * c_end - c_end)
    taken = 0.5 * (level() * (q - end) + 0.5 * slope() * (q - end) ** 2)
    return float(0.5 * begin.mass @ (velocity**2).sum(axis=1) + (plain + taken).sum())


def reference(begin: Start, span: float) -> Array:
    """Positions [m] at ``span`` by DOP853 at 1e-13; the pairs found anew at each evaluation."""
    from scipy.integrate import solve_ivp

    inverse = 1.0 / begin.mass

    def moved(_: float, y: Array) -> Array:
        x, v = y.reshape(2, -1, 3)
        a, b = near(x).T
        d = x[a] - x[b]
        q = (d * d).sum(axis=1)
        c = (SIZE**2 / q) ** 3
        f = ((24.0 * DEPTH * (2.0 * c * c - c) / q - level() - slope() * (q - CUTOFF**2))[:, None] * d).T
        sums = np.array([np.bincount(a, part, begin.n) - np.bincount(b, part, begin.n) for part in f])
        return np.stack([v, (sums * inverse).T]).ravel()

    y = np.stack([begin.position, begin.velocity]).ravel()
    done = solve_ivp(moved, (0.0, span), y, method="DOP853", rtol=1e-13, atol=1e-13)
    assert done.success, done.message
    return done.y[:, -1].reshape(2, -1, 3)[0]
