"""What a scene of smooth motion is: the same numbers for all engines, an exact answer, settings to try, bars to hold."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from benchmarks.problem import Array, Bar, End, Scene

__all__ = [
    "Array",
    "Bar",
    "End",
    "Ours",
    "Problem",
    "Slope",
    "Spin",
    "Swarm",
    "distance",
    "relative",
    "steps",
    "swarm_engine",
    "tolerances",
]

Formula = Callable[[Any, Any], tuple[Any, ...]]


@dataclass(frozen=True)
class Swarm:
    """Points that attract one another: masses (n,), positions and velocities (n, 3), the constant of gravity."""

    mass: Array
    position: Array
    velocity: Array
    constant: float = 1.0

    @property
    def n(self) -> int:
        """How many points."""
        return len(self.mass)

    def energy(self, position: Array, velocity: Array) -> Any:
        """Kinetic and potential energy, in long double."""
        long = np.longdouble
        m, x, v = (np.asarray(one, long) for one in (self.mass, position, velocity))
        total = long(0.5) * (m[:, None] * v * v).sum()
        for i in range(self.n):
            for j in range(i):
                d = x[i] - x[j]
                total -= long(self.constant) * m[i] * m[j] / np.sqrt((d * d).sum())
        return total

    def drift(self, end: End) -> float:
        """Change of the energy over the energy at the start."""
        begin = self.energy(self.position, self.velocity)
        return float((self.energy(end.position, end.velocity) - begin) / begin)


@dataclass(frozen=True)
class Slope:
    """y' = f(t, y), written once: ``make(sqrt)`` gives f for floats, for symbols or for many digits.

    ``f`` takes anything with indices and returns a tuple. ``end(y)`` says where the bodies are; ``jacobian``,
    if any, is df/dy as rows, for tuned solvers.
    """

    start: tuple[float, ...]
    make: Callable[[Callable[[Any], Any]], Formula]
    end: Callable[[Any], End]
    jacobian: Callable[[float, Any], Any] | None = None
    arrays: Callable[[float, Any], Any] | None = None
    """f on an array, where the system is so large that components one by one would be slow."""


@dataclass(frozen=True)
class Spin:
    """A free rigid body at the identity orientation: principal moments of inertia [kg m^2], angular velocity [rad/s]."""

    inertia: tuple[float, float, float]
    turning: tuple[float, float, float]


@dataclass(frozen=True)
class Ours:
    """A setting of xPheve: which stepper (None: its own choice), and what `engine.run` is told besides the end."""

    method: str
    stepper: str | None
    run: Mapping[str, float]

    @property
    def setting(self) -> str:
        """In words; ``atol`` is a thousandth of ``rtol`` unless it says otherwise."""
        if "dt" in self.run:
            return f"dt {self.run['dt']:.4g}"
        return f"rtol {self.run['rtol']:.0e}" if "rtol" in self.run else "-"


def tolerances(stepper: str | None, *powers: float, method: str | None = None) -> list[Ours]:
    """Settings by tolerance: 1e-``power`` for each, ``atol`` a thousandth of it."""
    name = method or f"{(stepper or 'core:default').partition(':')[2]}"
    return [Ours(name, stepper, {"rtol": 10.0**-p, "atol": 10.0 ** -(p + 3)}) for p in powers]


def steps(stepper: str | None, span: float, *counts: int, method: str | None = None) -> list[Ours]:
    """Settings by step: ``span`` in so many equal parts."""
    name = method or f"{(stepper or 'core:default').partition(':')[2]}"
    return [Ours(name, stepper, {"dt": span / count}) for count in counts]


@dataclass(frozen=True)
class Problem(Scene):
    """One scene of smooth motion over one span, told in as many ways as engines need."""

    swarm: Swarm | None = None
    slope: Slope | None = None
    spin: Spin | None = None
    models: Mapping[str, Callable[[float, str], str]] = field(default_factory=dict)
    """The scene in the language of a peer, by dt and integrator."""


def distance(end: Array, high: Array, low: Array) -> float:
    """The largest distance of points ``end`` from ``high + low``, all (n, 3)."""
    return float(np.sqrt((((np.asarray(end) - high) - low) ** 2).sum(axis=-1)).max())


def relative(x: Array) -> Array:
    """Places (n, 3) as seen from body 0, without body 0."""
    x = np.asarray(x)
    return x[1:] - x[:1]


def swarm_engine(swarm: Swarm) -> Callable[[Any], Sequence[Any]]:
    """Fills an engine with a `Swarm` under Newton's gravity."""

    def build(engine: Any) -> Sequence[Any]:
        import xpheve as xp

        gravity = engine.add_law("basic:universal_gravity", gravitational_constant=swarm.constant)
        rows = zip(swarm.mass.tolist(), swarm.position.tolist(), swarm.velocity.tolist(), strict=True)
        bodies = [xp.PhysicalObject(mass=m, position=x, velocity=v) for m, x, v in rows]
        engine.add_objects(bodies, laws=[gravity])
        return bodies

    return build
