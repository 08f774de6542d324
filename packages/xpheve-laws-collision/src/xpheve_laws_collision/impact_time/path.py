"""Where a body will be, as the steppers have it, and bounds on how fast it turns on the way."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

from xpheve.kernels.flight import (
    FREE,
    GENERAL,
    PRINCIPAL,
    RESTING,
    place,
    speed,
    turn_about_axis,
    turn_split,
    way_of_turning,
)
from xpheve.kernels.free_rotation import STEADY, turn
from xpheve.kernels.free_rotation import prepare as prepare_rotation
from xpheve.kernels.quaternion import rotate, rotate_inverse
from xpheve.kernels.vector import Vec, cross, norm, sub

if TYPE_CHECKING:
    from xpheve_laws_collision.narrow_phase import Mover


prepare = lru_cache(maxsize=256)(prepare_rotation)
"""A body that flies has the same rotation in the question of every pair."""


class Path:
    """The flight of a mover: constant acceleration, and the rotation that the steppers read.

    Bounds on the rotation: free of torque 2 T = sum I_i w_i^2 and L^2 = sum I_i^2 w_i^2 are kept, and so are 2 T I_max - L^2
    and L^2 - 2 T I_min, sums of squares both: each component w_i is bounded by each of them, and by 2 T. What bends it
    follows by Euler's equations.
    """

    def __init__(self, mover: Mover) -> None:
        self.start = mover
        self.way = way_of_turning(mover.orientation, mover.angular_velocity, mover.inertia, mover.torque)
        self.constants: tuple[float, ...] = ()
        self._last: tuple[float, Mover] = (0.0, mover)
        if self.way == FREE:
            self.constants = prepare(mover.orientation, mover.angular_velocity, mover.inertia)
        self._kicked = norm(mover.torque) != 0.0 and min(mover.inertia) > 0.0
        """Whether a torque turns it: what has no inertia is turned by none."""
        self.steady = self.way == RESTING or (self.way == FREE and self.constants[0] == STEADY)
        """Whether the angular velocity is constant in the world."""
        self._free = (norm(mover.angular_velocity), 0.0) if self.steady else self._free_bounds(mover.angular_velocity)

    def at(self, s: float) -> Mover:
        """The mover ``s`` [s] later."""
        if s != self._last[0]:
            self._last = (s, self._at(s))
        return self._last[1]

    def _at(self, s: float) -> Mover:
        m = self.start
        if s == 0.0:
            return m
        x, v, a = m.position, m.velocity, m.acceleration
        q, omega = self._turned(s)
        return m._replace(
            position=(place(x[0], v[0], a[0], s), place(x[1], v[1], a[1], s), place(x[2], v[2], a[2], s)),
            velocity=(speed(v[0], a[0], s), speed(v[1], a[1], s), speed(v[2], a[2], s)),
            orientation=q,
            angular_velocity=omega,
        )

    def _turned(self, s: float) -> tuple[tuple[float, float, float, float], Vec]:
        m = self.start
        if self.way == RESTING:
            return m.orientation, m.angular_velocity
        if self.way == FREE:
            return turn(self.constants, s)
        if self.way == PRINCIPAL:
            return turn_about_axis(m.orientation, m.angular_velocity, m.inertia, m.torque, s)
        return turn_split(m.orientation, m.angular_velocity, m.inertia, m.torque, s)

    def window(self, s: float) -> float:
        """How long [s] after ``s`` the bounds are asked for at a time: a torque at most doubles the rate, or turns by a radian."""
        if not self._kicked:
            return math.inf
        kick = norm(self.start.torque) / min(self.start.inertia)
        return max(norm(self.start.angular_velocity) / kick + s, 1.0 / math.sqrt(kick))

    def bounds(self, s: float, h: float) -> tuple[float, float]:
        """The most that rate [rad/s] and angular acceleration [rad/s^2] can be from ``s`` to ``s + h``.

        Under a torque that is not about the axis of a steady spin the orientation follows a formula of second order
        and not a motion; its own rate is taken to be at most twice that of the motion (not proven).
        """
        if not self._kicked:
            return self._free
        kick = norm(self.start.torque) / min(self.start.inertia)
        if self.way == PRINCIPAL:
            return norm(self.start.angular_velocity) + (s + h) * kick, kick
        rate, _ = self._free_bounds(self.start.angular_velocity)
        rate = 2.0 * (rate + (s + h) * kick)
        return rate, rate * rate + 2.0 * kick

    def _free_bounds(self, omega: Vec) -> tuple[float, float]:
        least, most = min(self.start.inertia), max(self.start.inertia)
        if least <= 0.0:
            return norm(omega), 0.0
        moments = [
            i / most for i in self.start.inertia
        ]  # only their ratios count, and products of these hold in floats
        least, most = min(moments), 1.0
        if least == 0.0:
            return math.inf, math.inf
        w = rotate_inverse(self.start.orientation, omega)
        squares = [c * c for c in w]
        energy = math.fsum(i * c for i, c in zip(moments, squares, strict=True))
        above = math.fsum(i * (most - i) * c for i, c in zip(moments, squares, strict=True))
        below = math.fsum(i * (i - least) * c for i, c in zip(moments, squares, strict=True))
        slack = 1e-12 * norm(omega)
        top = [slack, slack, slack]
        for k, i in enumerate(moments):
            found = [energy / i]
            if i * (most - i) > 0.0:
                found.append(above / (i * (most - i)))
            if i * (i - least) > 0.0:
                found.append(below / (i * (i - least)))
            top[k] += math.sqrt(min(found)) * (1.0 + 1e-12)
        bent = (
            abs(moments[1] - moments[2]) / moments[0] * top[1] * top[2],
            abs(moments[2] - moments[0]) / moments[1] * top[2] * top[0],
            abs(moments[0] - moments[1]) / moments[2] * top[0] * top[1],
        )
        return norm((top[0], top[1], top[2])), norm(bent)


def angular_acceleration(mover: Mover) -> Vec:
    """Rate of change [rad/s^2] of the angular velocity, world frame, by Euler's equations; zero where there are no moments."""
    moments = mover.inertia
    if min(moments) <= 0.0:
        return (0.0, 0.0, 0.0)
    w = rotate_inverse(mover.orientation, mover.angular_velocity)
    torque = rotate_inverse(mover.orientation, mover.torque)
    rest = sub(torque, cross(w, (moments[0] * w[0], moments[1] * w[1], moments[2] * w[2])))
    return rotate(mover.orientation, (rest[0] / moments[0], rest[1] / moments[1], rest[2] / moments[2]))


__all__ = ["GENERAL", "Path", "angular_acceleration"]
