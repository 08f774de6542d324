"""What the text of a loop defines besides its kernel files, for those that call it: the laws' answers, and shapes that are not in every scene."""

from __future__ import annotations

from typing import Any

from xpheve.kernels.vector import Vec

DECLARED = ("respond", "solid_time", "solid_gap")


def respond(f: Any, n: Any) -> int:
    """Read the contact in ``f[0]``, and write the answer of the law ``n[0]`` behind it: see `xpheve.kernels.response`."""
    raise NotImplementedError


def solid_time(shape: Any, c: int, x: Vec, v: Vec, pull: Vec, radius: float) -> tuple[float, int]:
    """When a sphere meets the box or capsule at ``c`` of the table, and how: see `xpheve_laws_collision.impact.solids`."""
    raise NotImplementedError


def solid_gap(shape: Any, c: int, x: Vec, v: Vec, pull: Vec, radius: float) -> tuple[float, Vec, float]:
    """How far they are apart, the normal towards the shape, and the second rate of the gap."""
    raise NotImplementedError
