"""What a driver may call of the motion that it carries; the text of the motion takes the place of these declarations."""

from __future__ import annotations

from typing import Any

Buffers = Any
"""What ``f`` and ``n`` are: one after another the buffers of floats, or of whole numbers."""


def forces(f: Buffers, n: Buffers, x: int, v: int, a: int, w: int, now: float) -> int:
    """Write the second derivatives of all places into ``f[0]``; see `xpheve.loop.motion`."""
    raise NotImplementedError("the text of a motion defines it")


def jacobians(f: Buffers, n: Buffers, x: int, v: int, jx: int, jv: int, now: float) -> int:
    """Write the derivatives of ``forces`` by places and by velocities into ``f[0]``; see `xpheve.loop.motion`."""
    raise NotImplementedError("the text of a motion defines it")
