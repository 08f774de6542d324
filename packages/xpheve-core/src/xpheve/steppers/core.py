"""Core's own steppers, each imported when some group may want it."""

from __future__ import annotations

from importlib import import_module

from xpheve.steppers.contract import Stepper

ALONG: dict[str, str] = {
    "core:adaptive": "adaptive:Adaptive",
    "core:implicit": "implicit:Implicit",
    "core:kepler": "kepler:Kepler",
    "core:linear": "linear:Linear",
    "core:splitting": "splitting:Splitting",
    "core:symplectic2": "symplectic:Symplectic2",
    "core:symplectic4": "symplectic:Symplectic4",
    "core:symplectic6": "symplectic:Symplectic6",
    "core:symplectic8": "symplectic:Symplectic8",
}
"""Those for laws that are evaluated along the way: id, then module and class."""


def core_steppers(along: bool) -> list[Stepper]:
    """One of each; without ``along`` those that groups under stored forces alone may want."""
    from xpheve.steppers.ballistic import Ballistic
    from xpheve.steppers.midpoint import Midpoint

    found: list[Stepper] = [Ballistic(), Midpoint()]
    for place in ALONG.values() if along else ():
        module, _, name = place.partition(":")
        found.append(getattr(import_module(f"xpheve.steppers.{module}"), name)())
    return found
