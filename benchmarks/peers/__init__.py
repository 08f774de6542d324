"""One file a peer: the same scenes, with default and with tuned settings.

Each has ``NAME`` and ``MODULE`` (what must be installed). Game engines have ``ball(scene, dts)`` (the rows of a scene of one sphere) and
``field(positions, velocities, dt)`` (S12: a `benchmarks.measure.Field` for each setting); those for smooth motion have ``smooth(problem)``
(a `benchmarks.turns.Contender` for each setting that the scene names); those for impacts have ``impacts(scene)``, the same for a scene
told by a `benchmarks.impacts.stage.Stage`, and ``World(stage, setting, dt)``, to be stepped and read.
"""

from __future__ import annotations

from importlib import import_module, metadata, util
from types import ModuleType

ADAPTERS = {"mujoco": "benchmarks.peers.mujoco_peer", "pybullet": "benchmarks.peers.pybullet_peer"}
SMOOTH = {
    "rebound": "benchmarks.peers.rebound_peer",
    "heyoka": "benchmarks.peers.heyoka_peer",
    "scipy": "benchmarks.peers.scipy_peer",
    "mujoco": "benchmarks.peers.mujoco_smooth",
    "pybullet": "benchmarks.peers.pybullet_smooth",
}

IMPACTS = {
    "mujoco": "benchmarks.peers.mujoco_impacts",
    "pybullet": "benchmarks.peers.pybullet_impacts",
    "rapier3d": "benchmarks.peers.rapier3d_impacts",
    "dartpy": "benchmarks.peers.dartpy_impacts",
    "scipy": "benchmarks.peers.scipy_impacts",
}


def version(name: str) -> str:
    """The version of an installed peer."""
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "?"


def adapter(name: str, adapters: dict[str, str] = ADAPTERS) -> ModuleType | None:
    """The adapter of the peer ``name``, or None if the peer is not installed."""
    if util.find_spec(name) is None:
        return None
    return import_module(adapters[name])
