"""Whom impulses move."""

from __future__ import annotations

from xpheve.objects import PhysicalObject

DRIVEN = hasattr(PhysicalObject, "driven")


def immovable(obj: PhysicalObject) -> bool:
    """Whether no impulse moves ``obj``: it is fixed, or the host drives it."""
    return bool(obj.fixed or (DRIVEN and obj.driven))


def inverse_mass(obj: PhysicalObject) -> float:
    """1 / mass [1/kg]; 0 for what no impulse moves."""
    return 0.0 if immovable(obj) else 1.0 / obj.mass
