"""What the text of a loop defines besides its kernel files, for those that call it: the laws' answers, and shapes that are not in every scene.

A loop that is interpreted runs the kernel files themselves, as Python imports them; what they call here is then what that loop has given.
"""

from __future__ import annotations

import threading
from typing import Any

from xpheve.kernels.vector import Vec

DECLARED = ("respond", "solid_time", "solid_gap")


class Given(threading.local):
    """The functions of the loop that a thread runs at the moment, as files."""

    respond: Any
    solid_time: Any
    solid_gap: Any


GIVEN = Given()


def respond(f: Any, n: Any) -> int:
    """Read the contact in ``f[0]``, and write the answer of the law ``n[0]`` behind it: see `xpheve.kernels.response`."""
    found: int = GIVEN.respond(f, n)
    return found


def solid_time(shape: Any, c: int, x: Vec, v: Vec, pull: Vec, radius: float) -> tuple[float, int]:
    """When a sphere meets the box or capsule at ``c`` of the table, and how: see `xpheve_laws_collision.impact.solids`."""
    found: tuple[float, int] = GIVEN.solid_time(shape, c, x, v, pull, radius)
    return found


def solid_gap(shape: Any, c: int, x: Vec, v: Vec, pull: Vec, radius: float) -> tuple[float, Vec, float]:
    """How far they are apart, the normal towards the shape, and the second rate of the gap."""
    found: tuple[float, Vec, float] = GIVEN.solid_gap(shape, c, x, v, pull, radius)
    return found
