"""Gravity at the surface of other worlds, for ``basic:planet_gravity``."""

from __future__ import annotations

SURFACE_GRAVITY: dict[str, float] = {
    "Sun": 274.2,
    "Mercury": 3.70,
    "Venus": 8.87,
    "Earth": 9.80665,
    "Moon": 1.62,
    "Mars": 3.73,
    "Jupiter": 24.79,
    "Saturn": 10.44,
    "Uranus": 8.87,
    "Neptune": 11.15,
    "Pluto": 0.62,
    "Titan": 1.35,
}
"""Acceleration [m/s^2] at the surface, or where the pressure of a giant's air is 1 bar, on the equator and without the turning of
the world. The Earth's is standard gravity (3rd CGPM, 1901).

Source: G M / R^2 with G M of the JPL ephemeris DE440 (R. S. Park et al., Astron. J. 161, 105 (2021)) and the equatorial radii of the IAU
(B. A. Archinal et al., Celest. Mech. Dyn. Astron. 130, 22 (2018)); mean radii for the Moon, Mars, Pluto and Titan.
"""
