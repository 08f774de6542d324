"""Which answer is made how."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from benchmarks.references import bounces_in_wind, quad, save

TAYLOR = "Taylor series of heyoka in real128 (113 bits), at its least tolerance: benchmarks/references/quad.py"
LONG = "Taylor series of heyoka in long double (64 bits), at its least tolerance: benchmarks/references/quad.py"


def _scene(name: str) -> Any:
    return import_module(f"benchmarks.scenes.{name}")


def swarm(name: str) -> Path:
    """The one start of a scene of bodies that attract one another."""
    one = _scene(name).PROBLEMS[0]
    return save(name, TAYLOR, [_swarm(one.swarm, one.span)])


def _swarm(one: Any, span: float) -> tuple[float, Any, list[str]]:
    return span, [*one.position.ravel(), *one.velocity.ravel()], quad.swarm(one, span)


def pythagorean() -> Path:
    """All starts."""
    scene = _scene("pythagorean")
    return save("pythagorean", TAYLOR, [_swarm(one, scene.SPAN) for one in scene.SWARMS])


def slope(name: str, kind: str = "real128") -> Path:
    """The one start of a scene told by its slope."""
    one = _scene(name).PROBLEMS[0]
    return save(
        name,
        TAYLOR if kind == "real128" else LONG,
        [(one.span, one.slope.start, quad.slope(one.slope, one.span, kind))],
    )


MAKERS: dict[str, Callable[[], Path]] = {
    "figure_eight": lambda: swarm("figure_eight"),
    "pythagorean": pythagorean,
    "outer_solar_system": lambda: swarm("outer_solar_system"),
    "magnetic_bottle": lambda: slope("magnetic_bottle"),
    "heavy_top": lambda: slope("heavy_top"),
    "gravity_gradient": lambda: slope("gravity_gradient"),
    "bounces_in_wind": bounces_in_wind.make,
    "robertson": lambda: slope("robertson", "longdouble"),
    "van_der_pol": lambda: slope("van_der_pol", "longdouble"),
}
