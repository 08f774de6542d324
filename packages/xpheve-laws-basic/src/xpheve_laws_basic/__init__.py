"""Laws of everyday mechanics: gravity, drag, springs. One law a file, imported when it is asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from xpheve_laws_basic.damper import Damper
    from xpheve_laws_basic.damper_to_point import DamperToPoint
    from xpheve_laws_basic.linear_drag import LinearDrag
    from xpheve_laws_basic.planet_gravity import PlanetGravity
    from xpheve_laws_basic.quadratic_drag import QuadraticDrag
    from xpheve_laws_basic.spring import Spring
    from xpheve_laws_basic.spring_to_point import SpringToPoint
    from xpheve_laws_basic.universal_gravity import UniversalGravity

__version__ = "0.1.0"

__all__ = [
    "Damper",
    "DamperToPoint",
    "LinearDrag",
    "PlanetGravity",
    "QuadraticDrag",
    "Spring",
    "SpringToPoint",
    "UniversalGravity",
]

_HOMES = {
    "Damper": "damper",
    "DamperToPoint": "damper_to_point",
    "LinearDrag": "linear_drag",
    "PlanetGravity": "planet_gravity",
    "QuadraticDrag": "quadratic_drag",
    "Spring": "spring",
    "SpringToPoint": "spring_to_point",
    "UniversalGravity": "universal_gravity",
}


def __getattr__(name: str) -> Any:
    """Import a law when it is asked for."""
    if name in _HOMES:
        from importlib import import_module

        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
