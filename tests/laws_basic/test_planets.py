"""Surface gravities are G M / R^2 of the published figures."""

from __future__ import annotations

import pytest

import xpheve as xp
from xpheve_laws_basic.planets import SURFACE_GRAVITY

# G M [km^3/s^2], radius [km]
FIGURES = {
    "Sun": (1.32712440041e11, 695700.0),
    "Mercury": (22031.868551, 2440.53),
    "Venus": (324858.592, 6051.8),
    "Moon": (4902.800118, 1737.4),
    "Mars": (42828.375816, 3389.50),
    "Jupiter": (126686531.9, 71492.0),
    "Saturn": (37931206.234, 60268.0),
    "Uranus": (5793951.256, 25559.0),
    "Neptune": (6835099.97, 24764.0),
    "Pluto": (869.326, 1188.3),
    "Titan": (8978.1371, 2574.73),
}


@pytest.mark.parametrize("name", SURFACE_GRAVITY)
def test_4_2_other_planets_have_their_gravity(name: str) -> None:
    if name == "Earth":
        assert SURFACE_GRAVITY[name] == 9.80665
        return
    gm, radius = FIGURES[name]
    assert SURFACE_GRAVITY[name] == pytest.approx(gm / radius**2 * 1000, abs=0.0051 if name != "Sun" else 0.051)


def test_4_2_things_fall_on_the_moon_as_apollo_15_showed() -> None:
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", acceleration=SURFACE_GRAVITY["Moon"])
    hammer, feather = (engine.add_object(xp.PhysicalObject(mass=m), laws=[gravity]) for m in (1.32, 0.03))
    engine.run(until=1.3)
    assert hammer.position == feather.position
    assert hammer.position[2] == pytest.approx(-0.5 * 1.62 * 1.3**2, rel=1e-14)
