"""One file a peer: the same scenes, with default and with tuned settings.

Each has ``NAME``, ``MODULE`` (what must be installed), ``ball(scene, dts)`` (the rows of a scene of one sphere) and
``field(positions, velocities, dt)`` (S12: a `benchmarks.measure.Field` for each setting).
"""

from __future__ import annotations

from importlib import import_module, util
from types import ModuleType

ADAPTERS = {"mujoco": "benchmarks.peers.mujoco_peer", "pybullet": "benchmarks.peers.pybullet_peer"}


def adapter(name: str) -> ModuleType | None:
    """The adapter of the peer ``name``, or None if the peer is not installed."""
    if util.find_spec(name) is None:
        return None
    return import_module(ADAPTERS[name])
