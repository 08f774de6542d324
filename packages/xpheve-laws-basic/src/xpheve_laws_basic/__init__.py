"""Laws of everyday mechanics: gravity, drag, wind, buoyancy, springs, charges, thrust. One law a file, imported when it is asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from xpheve_laws_basic.black_hole_gravity import BlackHoleGravity
    from xpheve_laws_basic.buoyancy import Buoyancy
    from xpheve_laws_basic.coulomb import Coulomb
    from xpheve_laws_basic.damper import Damper
    from xpheve_laws_basic.damper_to_point import DamperToPoint
    from xpheve_laws_basic.electric_field import ElectricField
    from xpheve_laws_basic.linear_drag import LinearDrag
    from xpheve_laws_basic.magnetic_field import MagneticField
    from xpheve_laws_basic.magnus import Magnus
    from xpheve_laws_basic.planet_gravity import PlanetGravity
    from xpheve_laws_basic.quadratic_drag import QuadraticDrag
    from xpheve_laws_basic.rotating_frame import RotatingFrame
    from xpheve_laws_basic.spring import Spring
    from xpheve_laws_basic.spring_to_point import SpringToPoint
    from xpheve_laws_basic.thrust import Thrust
    from xpheve_laws_basic.universal_gravity import UniversalGravity
    from xpheve_laws_basic.wind import Wind

__version__ = "0.1.0"

__all__ = [
    "BlackHoleGravity",
    "Buoyancy",
    "Coulomb",
    "Damper",
    "DamperToPoint",
    "ElectricField",
    "LinearDrag",
    "MagneticField",
    "Magnus",
    "PlanetGravity",
    "QuadraticDrag",
    "RotatingFrame",
    "Spring",
    "SpringToPoint",
    "Thrust",
    "UniversalGravity",
    "Wind",
]

_HOMES = {
    "BlackHoleGravity": "black_hole_gravity",
    "Buoyancy": "buoyancy",
    "Coulomb": "coulomb",
    "Damper": "damper",
    "DamperToPoint": "damper_to_point",
    "ElectricField": "electric_field",
    "LinearDrag": "linear_drag",
    "MagneticField": "magnetic_field",
    "Magnus": "magnus",
    "PlanetGravity": "planet_gravity",
    "QuadraticDrag": "quadratic_drag",
    "RotatingFrame": "rotating_frame",
    "Spring": "spring",
    "SpringToPoint": "spring_to_point",
    "Thrust": "thrust",
    "UniversalGravity": "universal_gravity",
    "Wind": "wind",
}


def __getattr__(name: str) -> Any:
    """Import a law when it is asked for."""
    if name in _HOMES:
        from importlib import import_module

        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
