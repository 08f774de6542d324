"""Gravity, quadratic drag and wind: bodies that do not know one another, forces that read velocity.

The scheme of all contenders is that of core:midpoint: a drift of half a step, a kick by the force of the middle (with the velocity of
the middle, predicted by the force at the old velocity), a drift of half a step; positions and velocities are summed with their remainders.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.tracing.runner import Array, Runner, Start, engine_runner, new_engine

DT = 1 / 1024
GRAVITY, DENSITY, COEFFICIENT, WIND = 9.81, 1.225, 0.47, (5.0, 0.0, 0.0)
OUTSIDE = "outside:quadratic_drag"
STARTS = 100_000


def start(n: int) -> Start:
    """``n`` bodies thrown in all directions, each with its own mass and area; fewer are the first of more."""
    random = np.random.default_rng(7)
    position, velocity = random.uniform(-100, 100, (STARTS, 3)), random.normal(0.0, 20.0, (STARTS, 3))
    mass, area = random.uniform(0.5, 2.0, STARTS), random.uniform(0.005, 0.02, STARTS)
    whole = Start(position, velocity, mass, {"area": area, "drag": np.full(STARTS, 0.5 * DENSITY * COEFFICIENT) * area})
    return whole.first(n)


def engine(drag: str = "basic:quadratic_drag", compile: str = "always") -> Any:
    """A maker of this scene in an engine; ``drag`` may be the law of the pack outside."""

    def make(begin: Start, dt: float) -> Runner:
        return in_engine(begin, dt, drag, compile)[0]

    return make


def in_engine(
    begin: Start, dt: float, drag: str = "basic:quadratic_drag", compile: str = "always"
) -> tuple[Runner, list[Any]]:
    """The scene in an engine, not planned yet, and its laws: gravity, drag, wind."""
    import xpheve as xp

    host = new_engine(compile)
    name = "drag_constant" if drag == OUTSIDE else "drag_area"
    fluid = {} if drag == OUTSIDE else {"density": DENSITY, "coefficient": COEFFICIENT}
    laws = [
        host.add_law("basic:planet_gravity", acceleration=GRAVITY),
        host.add_law(drag, **fluid),
        host.add_law("basic:wind", velocity=WIND, density=DENSITY, coefficient=COEFFICIENT),
    ]
    objects = []
    columns = zip(
        begin.position.tolist(),
        begin.velocity.tolist(),
        begin.mass.tolist(),
        begin.more["area"].tolist(),
        begin.more["drag"].tolist(),
        strict=True,
    )
    for x, v, m, area, constant in columns:
        own = {"drag_area": area} | ({name: constant} if drag == OUTSIDE else {})
        objects.append(xp.PhysicalObject(mass=m, position=x, velocity=v, **own))
    host.add_objects(objects, laws=laws)
    return engine_runner(host, objects, dt), laws


def reference(begin: Start, span: float, at_most: int = 1000) -> Array:
    """Positions [m] at ``span`` of the first bodies, by DOP853 (E. Hairer, S. P. Norsett, G. Wanner, Solving ODE I, II.5) at 1e-13."""
    from scipy.integrate import solve_ivp

    begin = begin.first(at_most)
    drag, mass, wind = begin.more["drag"][:, None], begin.mass[:, None], np.array(WIND)

    def slope(_: float, y: Array) -> Array:
        v = y.reshape(2, -1, 3)[1]
        u = v - wind
        force = -drag * (np.linalg.norm(v, axis=1, keepdims=True) * v + np.linalg.norm(u, axis=1, keepdims=True) * u)
        return np.stack([v, force / mass - np.array([0.0, 0.0, GRAVITY])]).ravel()

    y = np.stack([begin.position, begin.velocity]).ravel()
    done = solve_ivp(slope, (0.0, span), y, method="DOP853", rtol=1e-13, atol=1e-13)
    assert done.success, done.message
    return done.y[:, -1].reshape(2, -1, 3)[0]
