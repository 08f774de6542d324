"""A network of springs: 1,000 bodies on a shaken lattice, 5,000 springs between neighbours; forces of position alone."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.tracing.runner import Array, Runner, Start, engine_runner, has_loop, new_engine

DT = 1 / 512
STIFFNESS, LENGTH = 50.0, 1.0
N, SPRINGS = 1000, 5000


def start(n: int = N, springs: int = SPRINGS) -> Start:
    """``n`` bodies on a cubic lattice of 1 m, each off its place a little; the ``springs`` shortest pairs are joined."""
    random = np.random.default_rng(11)
    side = round(n ** (1 / 3) + 0.499)
    lattice = np.stack(np.meshgrid(*3 * [np.arange(side, dtype=float)], indexing="ij"), axis=-1).reshape(-1, 3)[:n]
    position = lattice + random.uniform(-0.1, 0.1, (n, 3))
    a, b = np.triu_indices(n, 1)
    shortest = np.sort(np.argsort(np.linalg.norm(position[a] - position[b], axis=1), kind="stable")[:springs])
    pairs = np.stack([a[shortest], b[shortest]], axis=1)
    return Start(position, random.normal(0.0, 0.3, (n, 3)), random.uniform(0.5, 2.0, n), {"pairs": pairs})


def engine(compile: str = "always") -> Any:
    """A maker of this scene in an engine."""

    def make(begin: Start, dt: float) -> Runner:
        import xpheve as xp
        from xpheve_laws_basic import Spring

        host = new_engine(compile)
        columns = zip(begin.position.tolist(), begin.velocity.tolist(), begin.mass.tolist(), strict=True)
        objects = [xp.PhysicalObject(mass=m, position=x, velocity=v) for x, v, m in columns]
        host.add_objects(objects)
        pairs = [(objects[a], objects[b]) for a, b in begin.more["pairs"].tolist()]
        if has_loop():
            host.add_law(Spring(stiffness=STIFFNESS, rest_length=LENGTH, pairs=pairs))
        else:  # a law does not take a list of pairs yet: one law a spring
            for a, b in pairs:
                host.add_law(Spring, stiffness=STIFFNESS, rest_length=LENGTH, between=([a], [b]))
        return engine_runner(host, objects, dt)

    return make


def energy(begin: Start, position: Array, velocity: Array) -> float:
    """Kinetic and elastic energy [J]."""
    a, b = begin.more["pairs"].T
    stretch = np.linalg.norm(position[a] - position[b], axis=1) - LENGTH
    return float(0.5 * begin.mass @ (velocity**2).sum(axis=1) + 0.5 * STIFFNESS * (stretch**2).sum())


def reference(begin: Start, span: float) -> Array:
    """Positions [m] at ``span`` by DOP853 at 1e-13."""
    from scipy.integrate import solve_ivp

    a, b = begin.more["pairs"].T
    inverse = 1.0 / begin.mass

    def slope(_: float, y: Array) -> Array:
        x, v = y.reshape(2, 3, -1)
        d = x[:, a] - x[:, b]
        length = np.sqrt((d * d).sum(axis=0))
        f = -STIFFNESS * (1.0 - LENGTH / length) * d
        sums = [np.bincount(a, c, begin.n) - np.bincount(b, c, begin.n) for c in f]
        return np.stack([v, np.array(sums) * inverse]).ravel()

    y = np.stack([begin.position.T, begin.velocity.T]).ravel()
    done = solve_ivp(slope, (0.0, span), y, method="DOP853", rtol=1e-13, atol=1e-13)
    assert done.success, done.message
    return done.y[:, -1].reshape(2, 3, -1)[0].T
