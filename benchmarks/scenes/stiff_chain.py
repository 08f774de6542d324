"""100 masses of 1 kg in a row between two points, joined by 101 springs of 1e8 N/m.

In a fluid that damps them a little, for 0.1 s.

The answer is the sum over the chain's 100 modes with 40 digits: w_j = 2 sqrt(k/m) sin(pi j / 202), damped all alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import pairwise
from typing import Any

import mpmath
import numpy as np

import xpheve as xp
from benchmarks.scenes.stiff_spring import LinearSpring
from benchmarks.smooth.problem import Bar, End, Ours, Problem, Slope

N, STIFFNESS, DAMPING, SPAN = 100, 1e8, 20.0, 0.1
START = np.random.default_rng(101).uniform(-1.0, 1.0, N)


class Link(xp.PairLaw):
    """A spring without length: F on a = -k (a - b)."""

    id = "benchmarks:link"

    stiffness = xp.Param(1.0, unit="N/m", ge=0, doc="k.")

    def force(self, a: Any, b: Any) -> Any:
        """Force [N] on ``a`` of each pair."""
        return -self.stiffness * (a.position - b.position)

    def potential(self, a: Any, b: Any) -> Any:
        """Potential energy [J] of each pair."""
        d = a.position - b.position
        return 0.5 * self.stiffness * d.dot(d)


def build(engine: Any) -> Sequence[Any]:
    """All rest places are the origin: the springs have no length, so that only displacements count."""
    drag = engine.add_law("basic:linear_drag", coefficient=DAMPING)
    anchor = engine.add_law(LinearSpring, stiffness=STIFFNESS)
    masses = [xp.PhysicalObject(mass=1.0, position=(x, 0.0, 0.0)) for x in START.tolist()]
    for k, one in enumerate(masses):
        engine.add_object(one, laws=[drag, anchor] if k in (0, N - 1) else [drag])
    engine.add_law(Link, stiffness=STIFFNESS, pairs=list(pairwise(masses)))
    return masses


@cache
def exact() -> tuple[Any, Any]:
    """Places at the end as a sum of two arrays (N,)."""
    with mpmath.workdps(40):
        mpf, root = mpmath.mpf, mpmath.sqrt(mpmath.mpf(2) / (N + 1))
        shapes = [
            mpmath.sin(mpmath.pi * k / (N + 1)) for k in range(2 * (N + 1))
        ]  # sin(pi j i / (N + 1)) by j i modulo its period
        half, s, start = mpf(DAMPING) / 2, mpf(SPAN), [mpf(x) for x in START.tolist()]
        ends = []
        for j in range(1, N + 1):
            at = sum(shapes[(j * (i + 1)) % (2 * (N + 1))] * x for i, x in enumerate(start)) * root
            square = 4 * mpf(STIFFNESS) * mpmath.sin(mpmath.pi * j / (2 * (N + 1))) ** 2
            omega = mpmath.sqrt(square - half * half)
            ends.append(at * mpmath.exp(-half * s) * (mpmath.cos(omega * s) + half / omega * mpmath.sin(omega * s)))
        places = [
            root * sum(shapes[((j + 1) * (i + 1)) % (2 * (N + 1))] * q for j, q in enumerate(ends)) for i in range(N)
        ]
        high = np.array([float(x) for x in places])
        return high, np.array([float(x - mpf(float(x))) for x in places])


def error(end: End) -> float:
    """The largest error of a place [m]."""
    high, low = exact()
    return float(np.abs((np.asarray(end.position)[:, 0] - high) - low).max())


def slope_on_arrays(t: float, y: Any) -> Any:
    """The slope for SciPy, in NumPy."""
    x, v = y[:N], y[N:]
    out = np.empty_like(y)
    out[:N] = v
    out[N:] = -2.0 * STIFFNESS * x - DAMPING * v
    out[N : 2 * N - 1] += STIFFNESS * x[1:]
    out[N + 1 :] += STIFFNESS * x[:-1]
    return out


def jacobian(t: float, y: Any) -> Any:
    """Of the slope; constant."""
    eye, off = np.eye(N), np.eye(N, k=1) + np.eye(N, k=-1)
    return np.block([[np.zeros((N, N)), eye], [STIFFNESS * (off - 2.0 * eye), -DAMPING * eye]])


def make(sqrt: Any) -> Any:
    """The slope for symbols."""

    def slope(t: Any, y: Any) -> Any:
        found = [y[N + i] for i in range(N)]
        for i in range(N):
            pull = -2.0 * y[i]
            if i:
                pull = pull + y[i - 1]
            if i < N - 1:
                pull = pull + y[i + 1]
            found.append(STIFFNESS * pull - DAMPING * y[N + i])
        return tuple(found)

    return slope


def ends(y: Any) -> End:
    """The state of the slope as an end."""
    values, zero = np.array([float(c) for c in y]), np.zeros(N)
    return End(*(np.stack([part, zero, zero], axis=1) for part in (values[:N], values[N:])))


PROBLEMS = [
    Problem(
        id="stiff chain",
        title="100 masses and 101 springs of 1e8 N/m, 0.1 s",
        span=SPAN,
        metric="largest error of a place [m]",
        build=build,
        ours=[
            *(Ours("linear", "core:linear", {"dt": dt}) for dt in (1 / 60, 1e-3)),
            Ours("linear", "core:linear", {"rtol": 1e-9}),
        ],
        error=error,
        slope=Slope((*START.tolist(), *[0.0] * N), make, ends, jacobian, slope_on_arrays),
        peers={"scipy": [("DOP853", 1e-10), ("LSODA", 1e-10)], "heyoka": [0.0]},
        bars=[Bar("1e-12, independent of dt", "all errors", error=1e-12, method="linear")],
        short=0.001,
    )
]
