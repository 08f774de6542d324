"""Scenes and exact answers that several tests of nature ask for."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath as mp
import pytest

import xpheve as xp

Bounce = Callable[[float, float, float, float], tuple[float, float]]


@pytest.fixture(scope="session")
def bounced() -> Bounce:
    """Height over the floor [m] and upward speed [m/s] of a ball dropped from ``h``, at ``t``, to 40 digits from the floats given.

    Arguments: ``h``, ``g``, ``e``, ``t``. The flight after bounce n lasts 2 t1 e^n, with t1 = sqrt(2 h / g).
    """

    def at(h: float, g: float, e: float, t: float) -> tuple[Any, Any]:
        with mp.workdps(40):
            height, gravity, restitution, left = mp.mpf(h), mp.mpf(g), mp.mpf(e), mp.mpf(t)
            first = mp.sqrt(2 * height / gravity)
            if left <= first:
                return height - gravity * left**2 / 2, -gravity * left
            left -= first
            if restitution == 1:
                left -= 2 * first * mp.floor(left / (2 * first))
                speed = gravity * first
            else:
                if left >= 2 * first * restitution / (1 - restitution):
                    return mp.mpf(0), mp.mpf(0)
                # All bounces before this one took 2 t1 (e + ... + e^n) = 2 t1 e (1 - e^n) / (1 - e).
                share = 1 - left * (1 - restitution) / (2 * first * restitution)
                n = int(mp.floor(mp.log(share) / mp.log(restitution)))
                left -= 2 * first * restitution * (1 - restitution**n) / (1 - restitution)
                speed = gravity * first * restitution ** (n + 1)
            return left * (speed - gravity * left / 2), speed - gravity * left

    return at


@pytest.fixture
def court() -> Callable[..., tuple[Any, Any, Any]]:
    """Return a maker of a floor, z up, with one ball above it: ``court(height=1.0, ...)`` gives engine, ball and floor."""

    def make(
        *,
        height: float = 1.0,
        gravity: float = 9.81,
        restitution: float = 1.0,
        velocity: tuple[float, float, float] = (0.0, 0.0, 0.0),
        radius: float = 0.1,
        mass: float = 1.0,
        begin: float = 0.0,
        across: float = 0.0,
        ground: float = 0.0,
    ) -> tuple[Any, Any, Any]:
        engine = xp.PhysicsEngine(up="z")
        if begin:
            engine.run(until=begin)
        pull = engine.add_law("basic:planet_gravity", acceleration=gravity)
        bounce = engine.add_law("collision:elastic", restitution=restitution)
        floor = engine.add_object(xp.PhysicalObject(xp.Plane(offset=ground), fixed=True), laws=[bounce])
        ball = engine.add_object(
            xp.PhysicalObject(
                xp.Sphere(radius), mass=mass, position=(across, 0.0, ground + radius + height), velocity=velocity
            ),
            laws=[pull, bounce],
        )
        return engine, ball, floor

    return make
