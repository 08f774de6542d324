"""A superball with spin between two plates, no gravity: rough elastic impacts turn it back (Garwin), against fractions of the very same floats.

At each impact the velocity of the surface at the contact is turned round, across the normal too; of a solid ball that takes 2/7 of the slip
as an impulse, twice. R. L. Garwin, Am. J. Phys. 37, 88 (1969).
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np

from benchmarks.impacts.ours import ALWAYS, DEFAULT
from benchmarks.problem import Bar, End, Scene

RADIUS, HEIGHT, SPAN = 0.025, 0.5, 2.0
POSITION, VELOCITY, SPIN = (0.0, 0.0, 0.25), (2.0, 0.5, -3.0), (30.0, -80.0, 5.0)


def build(engine: Any) -> Sequence[Any]:
    """The ball between the plates."""
    import xpheve as xp

    rough = engine.add_law("collision:rough")
    plates = [
        xp.PhysicalObject(xp.Plane((0, 0, 1)), fixed=True),
        xp.PhysicalObject(xp.Plane((0, 0, -1)), fixed=True, position=(0, 0, HEIGHT)),
    ]
    engine.add_objects(plates, laws=[rough])
    ball = xp.PhysicalObject(xp.Sphere(RADIUS), mass=0.05, position=POSITION, velocity=VELOCITY, angular_velocity=SPIN)
    return [engine.add_object(ball, laws=[rough])]


@cache
def exact(span: float = SPAN) -> tuple[list[Fraction], int]:
    """Place, velocity and spin at ``span``, and how many impacts there were: all in fractions."""
    x, v, w = ([Fraction(c) for c in one] for one in (POSITION, VELOCITY, SPIN))
    r, left, count = Fraction(RADIUS), Fraction(span), 0
    while True:
        wall = r if v[2] < 0 else Fraction(HEIGHT) - r
        step = (wall - x[2]) / v[2]
        if step > left:
            return [*(a + left * b for a, b in zip(x, v, strict=True)), *v, *w], count
        x, left, count = [a + step * b for a, b in zip(x, v, strict=True)], left - step, count + 1
        up = -1 if v[2] > 0 else 1  # the normal, from the plate to the ball; the contact is at -r up
        slip = (v[0] - r * up * w[1], v[1] + r * up * w[0])
        push = [-Fraction(4, 7) * c for c in slip]  # change of velocity: 2 (2/5) / (1 + 2/5) of the slip
        v = [v[0] + push[0], v[1] + push[1], -v[2]]
        # I w' = (-r up) x (m push), I = 2/5 m r^2
        w = [w[0] + Fraction(5, 2) / r * up * push[1], w[1] - Fraction(5, 2) / r * up * push[0], w[2]]


def error(end: End, span: float = SPAN) -> float:
    """The largest error of place [m], velocity [m/s] and speed of the surface [m/s], over 1 m and the speed at the start."""
    known, _ = exact(span)
    found = [*end.position[0], *end.velocity[0], *(end.turning[0])]
    assert end.turning is not None
    scale = [1.0] * 3 + [float(np.linalg.norm(VELOCITY))] * 3 + [float(np.linalg.norm(SPIN))] * 3
    return max(abs(float(Fraction(float(a)) - b)) / s for a, b, s in zip(found, known, scale, strict=True))


def drift(end: End) -> float:
    """Change of the energy, of turning too, over that at the start."""

    def energy(v: Any, w: Any) -> Any:
        v, w = np.asarray(v, np.longdouble), np.asarray(w, np.longdouble)
        return (v * v).sum() + np.longdouble(0.4) * np.longdouble(RADIUS) ** 2 * (w * w).sum()

    assert end.turning is not None
    begin = energy(VELOCITY, SPIN)
    return float((energy(end.velocity[0], end.turning[0]) - begin) / begin)


PROBLEMS = [
    Scene(
        id="superball",
        title=f"a superball with spin between two plates, {exact()[1]} impacts",
        span=SPAN,
        metric="largest relative error of place, velocity, spin",
        build=build,
        ours=[DEFAULT, ALWAYS],
        error=error,
        drift=drift,
        bars=[Bar("matches the closed form of rough elastic impacts to 1e-12", "all errors", error=1e-12)],
        notes="No peer has a law of rough elastic impacts.",
        short=0.5,
    )
]
