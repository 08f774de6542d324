"""Until when nothing in a scene changes, so that its thread may sleep."""

from __future__ import annotations

import math
from typing import Any


def still_until(world: Any) -> float:
    """Simulation time [s] until which nothing moves and nothing happens; the present time if something moves.

    Careful: a group under laws along the way, a scene with host steps, or one that is not planned counts as moving.
    """
    now: float = world.time[0]
    if world.dirty or world.host_step_listeners():
        return now
    arrays = world.bodies.arrays
    for batch in world.batches:
        if not batch.state.count:
            continue
        if batch.signature.laws:
            return now
        rows = batch.state.rows
        if any(arrays[name][:, rows].any() for name in ("velocity", "angular_velocity", "force", "torque")):
            return now
    due: float = world.queue.next_time()[0]
    return max(due, now) if not math.isnan(due) else now


__all__ = ["still_until"]
