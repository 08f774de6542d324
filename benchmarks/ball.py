"""A sphere under gravity, maybe above a floor: the description that all engines build, and the exact answer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mpmath

Vec = tuple[float, float, float]
DIGITS = 40


@dataclass(frozen=True)
class Ball:
    """One sphere, z up. With ``restitution`` there is a floor through the origin.

    ``error_bar`` [m] bounds the position error at ``span`` [s], ``drift_bar`` the energy error there, relative to the energy at the start.
    """

    id: str
    title: str
    span: float
    position: Vec
    velocity: Vec = (0.0, 0.0, 0.0)
    radius: float = 0.1
    mass: float = 1.0
    gravity: float = 9.81
    restitution: float | None = None
    error_bar: float = 0.0
    drift_bar: float = 0.0

    def build(self) -> tuple[Any, Any]:
        """A planned xPheve engine and the ball in it."""
        import xpheve as xp

        engine = xp.PhysicsEngine(up="z")
        laws = [engine.add_law("basic:planet_gravity", acceleration=self.gravity)]
        if self.restitution is not None:
            bounce = engine.add_law("collision:elastic", restitution=self.restitution)
            engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce])
            laws.append(bounce)
        ball = xp.PhysicalObject(xp.Sphere(self.radius), mass=self.mass, position=self.position, velocity=self.velocity)
        engine.add_object(ball, laws=laws)
        engine.run(until=0.0)  # plans: that is not part of the time of a run
        return engine, ball

    def exact(self, t: float) -> tuple[list[Any], list[Any]]:
        """Position [m] and velocity [m/s] at ``t``, to `DIGITS` digits, of the very float64 numbers that the engines are given."""
        with mpmath.workdps(DIGITS):
            x, v = [mpmath.mpf(c) for c in self.position], [mpmath.mpf(c) for c in self.velocity]
            s, g = mpmath.mpf(t), mpmath.mpf(self.gravity)
            if self.restitution is not None:
                return self._bounced(x, v, s, g)
            return [x[0] + v[0] * s, x[1] + v[1] * s, x[2] + v[2] * s - g * s * s / 2], [v[0], v[1], v[2] - g * s]

    def _bounced(self, x: list[Any], v: list[Any], s: Any, g: Any) -> tuple[list[Any], list[Any]]:
        """Bounce n leaves the floor with e^n of the speed of the first arrival, and lasts 2 e^n of its speed over g."""
        e, r = mpmath.mpf(self.restitution), mpmath.mpf(self.radius)
        arrival = mpmath.sqrt(v[2] ** 2 + 2 * g * (x[2] - r))
        since = s - (v[2] + arrival) / g
        if since < 0:
            return [x[0] + v[0] * s, x[1] + v[1] * s, x[2] + v[2] * s - g * s * s / 2], [v[0], v[1], v[2] - g * s]
        if e < 1 and since >= 2 * arrival / g * e / (1 - e):
            return [x[0] + v[0] * s, x[1] + v[1] * s, r], [v[0], v[1], mpmath.mpf(0)]
        speed = e * arrival
        while since >= 2 * speed / g:
            since -= 2 * speed / g
            speed *= e
        return [x[0] + v[0] * s, x[1] + v[1] * s, r + speed * since - g * since**2 / 2], [v[0], v[1], speed - g * since]

    def energy(self, x: Any, v: Any) -> Any:
        """Kinetic and potential energy [J], 0 where the sphere would lie on the floor."""
        return self.mass * (sum(c * c for c in v) / 2 + mpmath.mpf(self.gravity) * (x[2] - mpmath.mpf(self.radius)))

    def errors(self, position: Any, velocity: Any) -> tuple[float, float]:
        """Distance [m] from the exact position at the end, and error of the energy relative to that at the start."""
        with mpmath.workdps(DIGITS):
            x, v = [mpmath.mpf(float(c)) for c in position], [mpmath.mpf(float(c)) for c in velocity]
            x_exact, v_exact = self.exact(self.span)
            error = mpmath.sqrt(sum((a - b) ** 2 for a, b in zip(x, x_exact, strict=True)))
            begin = self.energy([mpmath.mpf(c) for c in self.position], [mpmath.mpf(c) for c in self.velocity])
            drift = (self.energy(x, v) - self.energy(x_exact, v_exact)) / begin
            return float(error), float(drift)
