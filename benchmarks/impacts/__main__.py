"""Run the benchmarks of impacts: tables, files, plots, the page; 1 if a bar is missed."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from types import ModuleType
from typing import Any

from benchmarks import turns
from benchmarks.command import Command, Peers, told
from benchmarks.impacts import ours
from benchmarks.impacts.report import SECTION
from benchmarks.peers import IMPACTS
from benchmarks.problem import Scene
from benchmarks.turns import Contender

SCENES = ("bounces", "s05_elastic_spheres", "scenery", "drag_bounces", "superball")
SPECIALS = ("tumbling", "s09_bullets", "s10_cradles", "s12_contacts", "hard_spheres", "cold_start")
ENOUGH = 1.3  # [s] of samples of one row


def rows(module: ModuleType, peers: Peers, samples: int, quick: bool) -> list[dict[str, Any]]:
    """What is told of the scenes of a module. It may have ``QUICK`` ones, and say in ``others(scene, peers)`` who else takes part."""
    scenes = module.QUICK if quick and hasattr(module, "QUICK") else module.PROBLEMS
    return [told(scene, turns.take_turns(scene, contenders(module, scene, peers), samples, ENOUGH)) for scene in scenes]


def contenders(module: ModuleType, scene: Scene, peers: Peers) -> list[Contender]:
    """Ours, and those of the peers."""
    found = ours.contenders(scene)
    if hasattr(module, "others"):
        return found + list(module.others(scene, peers))
    for peer in peers.values():
        found += peer.impacts(scene)
    return found


COMMAND = Command(__doc__, "benchmarks.scenes", SCENES, SPECIALS, IMPACTS, SECTION, rows)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command."""
    return COMMAND.main(arguments)


if __name__ == "__main__":
    sys.exit(main())
